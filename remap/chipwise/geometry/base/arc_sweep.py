# SPDX-License-Identifier: GPL-2.0-or-later
"""How far an arc of LinuxCNC turns, and how many chords it needs.  Called by program/reader_runner.py,
pattern/isometry.py and rewrite/path_moves.py.

Source: pmCircleInit() in _posemath.c of LinuxCNC 2.9 and 2.10.  An arc is a full turn if it ends within 1e-8 machine
units of its start, in its plane, however small the angle of a longer one is: CAM programs write arcs of 10^6 to 10^9 mm
radius for lines.  Departs from it: the cross product is that of the radius and the chord, which keeps its digits where
start and end are close together.
"""

import math
from typing import Sequence

FUZZ = 1e-8  # CART_FUZZ: machine units, and their square


def arc_sweep(
    start: Sequence[float], end: Sequence[float], centre: Sequence[float], turns: float, scale: float = 1.0
) -> float:
    """Angle (rad, positive counter-clockwise) from start to end about the centre, each two coordinates in the plane;
    turns: +-1 for an arc of at most a full turn, more for whole turns besides; scale: machine units of a unit of the
    coordinates."""
    v, chord = (start[0] - centre[0], start[1] - centre[1]), (end[0] - start[0], end[1] - start[1])
    radius, last = math.hypot(*v), math.hypot(end[0] - centre[0], end[1] - centre[1])
    across, along = v[0] * chord[1] - v[1] * chord[0], radius * radius + v[0] * chord[0] + v[1] * chord[1]
    angle = math.atan2(abs(across), along)
    forward = math.copysign(1.0, turns) * across * (radius / last if last > 0.0 else 0.0)
    if math.hypot(*chord) * scale < FUZZ:
        angle = 2 * math.pi
    elif forward * scale * scale < FUZZ:
        angle = 2 * math.pi - angle
    return math.copysign(angle + 2 * math.pi * (abs(turns) - 1), turns)


def chord_angle(radius: float, sag: float) -> float:
    """The angle (rad) of a chord that is `sag` from its arc, at most half a turn; of any radius."""
    return 4.0 * math.asin(math.sqrt(0.5 * min(1.0, sag / max(radius, 1e-9))))
