# SPDX-License-Identifier: GPL-2.0-or-later
"""Points on a smooth curve -> as few lines and arcs as stay within a tolerance of them.  Called by dxf.py and svg.py.

From each point the arc through it, a middle and a last point is stretched as far as every point between lies within the
tolerance; then comes the next.  Corners stay: no arc runs over one.
"""

import math

import numpy as np

from chipwise.importing.drawn import arc, line

STRAIGHT_MM = 1e6  # an arc of a larger radius is a line
SHARE = 0.8  # of the tolerance for arcs; the rest is for the points, which lie on the curve in chords
WIDEST_RAD = 3.0  # of one arc


def fitted(points, tolerance):
    """([part, ..], mm by which the points differ most) of points (n, 2)."""
    points = np.asarray(points, float)
    keep = np.concatenate(([True], np.hypot(*np.diff(points, axis=0).T) > 1e-9))
    points, parts, worst, first = points[keep], [], 0.0, 0
    while first < len(points) - 1:
        last, part, off = _longest(points, first, SHARE * tolerance)
        parts.append(part)
        worst, first = max(worst, off), last
    return parts, worst


def _longest(points, first, tolerance):
    """(last, part, deviation) of the longest part from a point that fits."""
    good: tuple = (first + 1, line(points[first], points[first + 1]), 0.0)
    step = 2
    while first + step < len(points):
        found = _part(points[first : first + step + 1], tolerance)
        if found is None:
            break
        good, step = (first + step, *found), 2 * step
    low, high = good[0] - first, min(step, len(points) - first)
    while high - low > 1:
        middle = (low + high) // 2
        found = _part(points[first : first + middle + 1], tolerance) if first + middle < len(points) else None
        if found is None:
            high = middle
        else:
            low, good = middle, (first + middle, *found)
    return good


def _part(points, tolerance):
    """(line or arc, deviation) from the first to the last point, or None."""
    a, b = points[0], points[-1]
    chord = b - a
    length = float(np.hypot(*chord))
    if length > 0.0:
        off = np.abs((points - a) @ np.array([-chord[1], chord[0]])) / length
        along = (points - a) @ chord / length
        if off.max() <= 0.1 * tolerance and np.all(np.diff(along) > 0.0):
            return line(a, b), float(off.max())
    m = points[len(points) // 2]
    centre = _centre(a, m, b)
    if centre is None:
        return None
    radius = float(np.hypot(*(a - centre)))
    off = np.abs(np.hypot(*(points - centre).T) - radius)
    angle = np.unwrap(np.arctan2(points[:, 1] - centre[1], points[:, 0] - centre[0]))
    turn = np.diff(angle)
    middle = np.hypot(*((points[1:] + points[:-1]) / 2 - centre).T)  # chords between points bow the same way
    if off.max() > tolerance or np.abs(middle - radius).max() > 1.5 * tolerance + radius * (turn**2).max() / 8:
        return None
    if not (np.all(turn > 0) or np.all(turn < 0)) or abs(angle[-1] - angle[0]) > WIDEST_RAD:
        return None
    return arc(a, b, centre, turn[0] > 0), float(off.max())


def _centre(a, m, b):
    """Of the circle through three points; None if they are on a line."""
    (ax, ay), (bx, by) = m - a, b - a
    cross = 2.0 * (ax * by - ay * bx)
    if abs(cross) < 1e-300:
        return None
    p, q = ax * ax + ay * ay, bx * bx + by * by
    out = np.array([(by * p - ay * q) / cross, (ax * q - bx * p) / cross])
    return a + out if math.hypot(*out) < STRAIGHT_MM else None
