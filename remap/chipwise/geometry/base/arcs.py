# SPDX-License-Identifier: GPL-2.0-or-later
"""Operations on circles and arcs, on arrays.

Called by elements.py, contour.py and intersect.py.  An arc is centre (n, 2) mm,
radius (n,) mm, start angle (n,) rad and sweep (n,) rad, positive counter-clockwise,
|sweep| <= 2 pi.
"""

import numpy as np

from chipwise.geometry.base.lines import cross, dot
from chipwise.geometry.base.tolerances import NODE_MM

TWO_PI = 2.0 * np.pi


def sweep_from_ends(start, end, centre, ccw, full):
    """Signed sweep (n,) rad of arcs from start to end about centre, all (n, 2).

    ccw (n,) bool; full (n,) bool marks full circles.
    """
    a, b = start - centre, end - centre
    turn = np.arctan2(cross(a, b), dot(a, b))
    sweep = np.where(ccw, np.where(turn <= 0.0, turn + TWO_PI, turn), np.where(turn >= 0.0, turn - TWO_PI, turn))
    return np.where(full, np.where(ccw, TWO_PI, -TWO_PI), sweep)


def angle_parameter(point, centre, start_angle, sweep):
    """Parameter of points (n, 2) on arcs; in [-g, 1 + g] where the gap of the arc is
    shared evenly by both ends, so that a point just before the start gives t < 0."""
    v = point - centre
    turned = np.arctan2(v[:, 1], v[:, 0]) - start_angle
    middle = 0.5 * sweep
    off = turned - middle
    off -= TWO_PI * np.round(off / TWO_PI)
    return (middle + off) / sweep


def intersect_line_circle(start, end, centre, radius):
    """Common points of the carriers of lines and circles: (2, n, 2) mm, nan where none.

    A line that misses or crosses the circle by less than NODE_MM touches it: both points
    are then the foot of the perpendicular (or its two ends, as the roots come out).
    """
    along = end - start
    along = along / np.hypot(along[:, 0], along[:, 1])[:, None]
    to_start = start - centre
    height = cross(to_start, along)
    foot = start - along * dot(to_start, along)[:, None]
    inside = (radius - height) * (radius + height)
    half = np.sqrt(np.maximum(inside, 0.0))
    half = np.where(np.abs(height) <= radius + NODE_MM, half, np.nan)
    return np.stack((foot - along * half[:, None], foot + along * half[:, None]))


def intersect_circles(centre_a, radius_a, centre_b, radius_b):
    """Common points of pairs of circles: (2, n, 2) mm, nan where none.

    Circles that miss each other by less than NODE_MM touch.  Concentric circles share
    either nothing or everything; what arcs on them share is found by their ends.
    """
    between = centre_b - centre_a
    distance = np.hypot(between[:, 0], between[:, 1])
    apart = distance > radius_a + radius_b + NODE_MM
    within = distance < np.abs(radius_a - radius_b) - NODE_MM
    none = apart | within | (distance <= NODE_MM)
    safe = np.where(none, 1.0, distance)
    unit = between / safe[:, None]
    along = 0.5 * (safe + (radius_a - radius_b) * (radius_a + radius_b) / safe)
    along = np.clip(along, -radius_a, radius_a)
    half = np.sqrt((radius_a - along) * (radius_a + along))
    half = np.where(none, np.nan, half)
    foot = centre_a + unit * along[:, None]
    across = np.stack((-unit[:, 1], unit[:, 0]), axis=1) * half[:, None]
    return np.stack((foot - across, foot + across))


def segment_area(radius, sweep):
    """Signed area (n,) mm2 between arcs and their chords, positive left of a ccw arc."""
    return 0.5 * radius * radius * (sweep - np.sin(sweep))
