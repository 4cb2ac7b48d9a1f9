# SPDX-License-Identifier: GPL-2.0-or-later
"""The smallest circle round points: the size of a piece, and where a tool clears one.

Called by slug/ (pieces) and pocket/rest_material.py.  Pure; mm.
"""

import math
import random


def enclosing_circle(points):
    """Smallest circle around points [(x, y)], mm -> (x, y, diameter).  Welzl's algorithm, iterative, exact.

    The order of the points is shuffled with a fixed seed: expected linear time, same answer every time.
    """
    points = list(dict.fromkeys((float(x), float(y)) for x, y in points))
    if not points:
        return 0.0, 0.0, 0.0
    random.Random(1988).shuffle(points)
    circle = (*points[0], 0.0)
    for i, p in enumerate(points):
        if _inside(circle, p):
            continue
        circle = (*p, 0.0)
        for j, q in enumerate(points[:i]):
            if _inside(circle, q):
                continue
            circle = _circle_of_two(p, q)
            for s in points[:j]:
                if not _inside(circle, s):
                    circle = _circle_of_three(p, q, s)
    return circle[0], circle[1], 2 * circle[2]


def _inside(circle, point):
    """Whether a point lies in (x, y, radius), with room for rounding only."""
    return math.hypot(point[0] - circle[0], point[1] - circle[1]) <= circle[2] * (1 + 1e-12) + 1e-12


def _circle_of_two(p, q):
    """The circle with pq as diameter, (x, y, radius)."""
    return (p[0] + q[0]) / 2, (p[1] + q[1]) / 2, math.hypot(p[0] - q[0], p[1] - q[1]) / 2


def _circle_of_three(p, q, s):
    """The circle through three points, (x, y, radius); of points in line the one around all three."""
    bx, by, cx, cy = q[0] - p[0], q[1] - p[1], s[0] - p[0], s[1] - p[1]
    twice_area = 2 * (bx * cy - by * cx)
    if abs(twice_area) < 1e-14 * (abs(bx) + abs(by)) * (abs(cx) + abs(cy)):
        return max((_circle_of_two(a, b) for a, b in ((p, q), (p, s), (q, s))), key=lambda c: c[2])
    b2, c2 = bx * bx + by * by, cx * cx + cy * cy
    ux, uy = (cy * b2 - by * c2) / twice_area, (bx * c2 - cx * b2) / twice_area
    return p[0] + ux, p[1] + uy, math.hypot(ux, uy)


def piece_size(outline):
    """Diameter (mm) of the smallest circle a piece fits into."""
    return enclosing_circle(outline)[2]
