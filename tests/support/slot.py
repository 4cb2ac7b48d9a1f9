# SPDX-License-Identifier: GPL-2.0-or-later
"""A slot of 60 mm, 6 mm wide (T1) and 2 mm deep, milled by LinuxCNC: 720 mm3, 12 mm2, at 6 cm3/min 8.33 mm/s.

Called by tests/machine: test_unknown.py, test_kinds_of_moves.py.
"""

from support.operate import BOX

AREA, RADIUS, DEPTH, WHOLE = 12.0, 3.0, 2.0, 720.0
SLOT_VEL = 6000 / 60 / AREA  # mm/s
BEGIN = f"G21 G90 G64 P0.01\nT1 M6\n{BOX}\nM251 Q6 P2 E3000\nF300\nS10000 M3\n"
FEED, BY, VELOCITY, VOLUME, TYPE = (
    "volumetric-feed.0.adaptive-feed",
    "volumetric-feed.0.limited-by",
    "motion.current-vel",
    "stock-tracker.0.removed-volume",
    "motion.motion-type",
)
OVERRIDE_IGNORED = "volumetric-feed.0.override-ignored"


def values(answer):
    return [1.0 if v == "TRUE" else 0.0 if v == "FALSE" else float(v) for v in answer]
