# SPDX-License-Identifier: GPL-2.0-or-later
"""How stiff a tool is: the side force that bends it by 1 mm at its tip, and the largest one that its `deflection`
allows.

Called by monitor/tool_shape.py, glue/tooth_limits.py and check/tooth_load.py.  A beam that is clamped at one end bends
by F L^3 / (3 E I), with L the stick_out, I = pi D^4 / 64 and E by the tool's material.  Flutes make a tool up to 2.4
times as soft (0.8 D counts, L. Kops and D. T. Vo, Annals of the CIRP 39, 1990); a shank that is thicker than the cutter
makes it stiffer.  Neither is in it.
"""

import math

ELASTICITY = {"carbide": 580e3, "hss": 210e3}  # N/mm2; carbide: of 10 % cobalt
RADIAL = 1.044  # the whole side force over the part along the edge's path (core/tooth.h, 11)


def stiffness(diameter, stick_out, material):
    """N/mm of a tool, lengths mm; 0.0: not known."""
    if not (diameter and diameter > 0.0 and stick_out and stick_out > 0.0 and material in ELASTICITY):
        return 0.0
    return 3.0 * ELASTICITY[material] * math.pi * diameter**4 / 64.0 / stick_out**3


def largest_force(diameter, geometry):
    """N that bend a tool by the `deflection` of its ToolGeometry; 0.0: no limit, or what it needs is not known."""
    if geometry is None or not geometry.deflection:
        return 0.0
    return geometry.deflection * stiffness(diameter, geometry.stick_out, geometry.material)


def lacking(geometry):
    """What a ToolGeometry with `deflection` lacks for a limit, in words; "" if nothing, or there is no `deflection`."""
    if geometry is None or not geometry.deflection:
        return ""
    return " and ".join(
        name
        for name, known in (
            ("stick_out", geometry.stick_out),
            ("material", geometry.material),
            ("flutes", geometry.flutes),
        )
        if not known
    )
