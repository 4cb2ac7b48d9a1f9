# SPDX-License-Identifier: GPL-2.0-or-later
"""As tracker_slot: the same mm3 and mm2, lengths in inch."""

from support.halrig import SCENES, load_module

slot = load_module(SCENES / "tracker_slot/check.py")


def check(trace):
    slot.check(trace, 1 / 25.4)


def in_mm(t):
    """Distances as a machine in mm would have them."""
    return t.but(**{f"load_step_distance_{i}": lambda d: 25.4 * d for i in range(8)})


SABOTAGE = dict(
    slot.SABOTAGE,
    **{
        "volume in cubic inch": lambda t: t.but(removed_volume=lambda v: v / 25.4**3),
        "load in square inch": lambda t: t.but(section_area=lambda v: v / 25.4**2),
        "depth in mm": lambda t: t.but(depth=lambda v: 25.4 * v),
        "warning in mm": in_mm,
    },
)
# Sabotages of the distances are in machine units: half a millimetre would be half an inch here.
SABOTAGE["warning late"] = lambda t: t.but(**{f"load_step_distance_{i}": lambda d: d + 0.5 / 25.4 for i in range(8)})
SABOTAGE["warning far too early"] = lambda t: t.but(
    **{f"load_step_distance_{i}": lambda d: d - 1.5 / 25.4 for i in range(8)}
)
