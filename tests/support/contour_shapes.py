# SPDX-License-Identifier: GPL-2.0-or-later
"""Small contours with known answers, for the geometry tests."""

import math

import numpy as np

from chipwise.geometry.base.contour import ArcElement, LineElement, make_contour


def polygon(*points, closed=True):
    """Contour of straight elements, source lines 1, 2, ..."""
    n = len(points)
    return make_contour([LineElement(points[k], points[(k + 1) % n], k + 1) for k in range(n if closed else n - 1)])


def run(start, *steps, close=False):
    """Contour of steps ("L", x, y) and ("A", x, y, cx, cy, ccw), source lines 1, 2, ..."""
    here, parts = tuple(start), []
    for step in steps + ((("L", *start),) if close else ()):
        end = tuple(step[1:3])
        if step[0] == "L":
            parts.append(LineElement(here, end, len(parts) + 1))
        else:
            parts.append(ArcElement(here, end, tuple(step[3:5]), bool(step[5]), len(parts) + 1))
        here = end
    return make_contour(parts)


def circle(radius, centre=(0.0, 0.0), ccw=True, line=1):
    start = (centre[0] + radius, centre[1])
    return make_contour([ArcElement(start, start, centre, ccw, line)])


def slot(length, width):
    """Obround slot about the origin, counter-clockwise, two lines and two half circles."""
    a, r = 0.5 * length, 0.5 * width
    return run((-a, -r), ("L", a, -r), ("A", a, r, a, 0.0, True), ("L", -a, r), ("A", -a, -r, -a, 0.0, True))


def rounded_square(size, fillet):
    """Square from (0, 0), counter-clockwise, with four equal fillets."""
    s, f = size, fillet
    return run(
        (f, 0),
        ("L", s - f, 0),
        ("A", s, f, s - f, f, True),
        ("L", s, s - f),
        ("A", s - f, s, s - f, s - f, True),
        ("L", f, s),
        ("A", 0, s - f, f, s - f, True),
        ("L", 0, f),
        ("A", f, 0, f, f, True),
    )


def path_length(path):
    e = path.elements
    return sum(
        float(e.radius[k] * abs(e.sweep[k])) if e.sweep[k] else math.hypot(*(e.end[k] - e.start[k]))
        for k in range(len(e))
    )


def corners(path):
    """Start points of all elements, rounded, as a set."""
    return {tuple(np.round(p, 6) + 0.0) for p in path.elements.start.tolist()}
