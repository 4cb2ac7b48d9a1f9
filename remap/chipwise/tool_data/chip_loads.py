# SPDX-License-Identifier: GPL-2.0-or-later
"""The largest chip of a tool that has no chip_load: by its diameter and the group of the material.

Called by monitor/limits.py, glue/tooth_limits.py and check/tooth_load.py.  Source: two public charts of starting values
for carbide end mills, machinecalcs.com/chip-load-chart and formulafactory.tools/reference-charts/recommended-chip-loads
(both read in 2026); the shares below are the lower ends of what they give from 3 to 12 mm, rounded.  Departs from them:
from 12 mm on it does not grow any more, and cast iron counts as steel.
"""

SHARES = {
    "N": 1 / 120,
    "P": 1 / 240,
    "K": 1 / 240,
    "M": 1 / 300,
    "S": 1 / 400,
    "H": 1 / 400,
}  # of the diameter, by ISO 513
LARGEST_MM = 12.0  # of a diameter


def default_chip(diameter, flutes, material):
    """mm; 0: none, where diameter (mm), flutes or the group of the material are not known."""
    if not material or not flutes or not diameter > 0:
        return 0.0
    return round(SHARES.get(material.group, 0.0) * min(diameter, LARGEST_MM), 4)


def chip_limit(diameter, geometry, material, settings):
    """The largest chip of a tool, mm: chip_load of its geometry, else the default; 0: none."""
    if geometry is None:
        return 0.0
    return geometry.chip_load or (
        default_chip(diameter, geometry.flutes, material) if settings["DEFAULT_CHIP"] else 0.0
    )
