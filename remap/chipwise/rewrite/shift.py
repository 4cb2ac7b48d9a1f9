# SPDX-License-Identifier: GPL-2.0-or-later
"""Amounts of shift along the tool's axis: how a shifted path is made fit to be travelled.

Called by levels.py, path_moves.py, merge_moves.py and trials.py.  Source: CN105492980 [0097]..[0115], figures 14 to 20.
Pure functions on arrays; lengths mm.  The tool's axis is a unit vector that points away from the work: today always +Z.

 1. [0101] to [0104]: if the shifted path travels at 90 degrees or more to the first path, the points at both ends of
    that segment are dropped and their neighbours joined (turned_points); flute.py asks whether the bridge interferes.
 2. [0105] to [0111]: if the shifted path has a corner in the plane of travel and axis, arcs take its place, always on
    the outside of the work (rounded).  Shifts are amounts per point over the arc length of the travel across the axis;
    a new point's amount is interpolated (between).

Departs from the source: a corner towards the work and one away from it are rounded by one operation each (a dilation by
a disc, lowered by its radius, then a closing by the same disc).  What comes out passes through every peak as in [0108],
never lies below the shifted path, and has no bend tighter than the disc at a point of the path.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chipwise.clib.library import library

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats

AXIS = (0.0, 0.0, 1.0)


def along(points: Floats, axis: tuple[float, float, float] = AXIS) -> Floats:
    """(n,): arc length of the travel of (n, 3) points across the axis."""
    steps = np.diff(points, axis=0)
    across = steps - np.outer(steps @ np.asarray(axis), axis)
    return np.concatenate((np.zeros(1), np.cumsum(np.sqrt((across * across).sum(axis=1)))))


def shifted(points: Floats, amount: Floats, axis: tuple[float, float, float] = AXIS) -> Floats:
    """(n, 3) points moved by (n,) amounts along the axis."""
    return points + np.outer(amount, axis)


def turned_points(first: Floats, moved: Floats) -> Bools:
    """(n,) bool: points at the ends of segments that travel at 90 degrees or more to those of the first path.

    The first and the last point stay.  first, moved (n, 3).
    """
    a, b = np.diff(first, axis=0), np.diff(moved, axis=0)
    turned = ((a * b).sum(axis=1) <= 0.0) & ((a * a).sum(axis=1) > 0.0)
    drop = np.zeros(len(first), bool)
    drop[:-1] |= turned
    drop[1:] |= turned
    drop[[0, -1]] = False
    return drop


def rolled(s: Floats, values: Floats, radius: float, side: float) -> Floats:
    """(n,): the most of the neighbours' values with discs round them, side 1, or the least below them, side -1."""
    s, values = np.ascontiguousarray(s), np.ascontiguousarray(values)
    result = np.empty(len(s))
    library().chip_disc_roll(len(s), s.ctypes.data, values.ctypes.data, radius, side, result.ctypes.data)
    return result


def rounded(s: Floats, amount: Floats, radius: float) -> Floats:
    """(n,): amounts of shift, never smaller, whose corners are arcs of `radius` mm.  s (n,): arc length of the points,
    rising."""
    if radius <= 0.0 or not amount.any():
        return amount.copy()
    convex = np.maximum(rolled(s, amount, radius, 1.0) - radius, 0.0)
    closed = rolled(s, rolled(s, convex, radius, 1.0), radius, -1.0)
    return np.maximum(np.maximum(closed, convex), amount)


def held(s: Floats, amount: Floats, air: Bools) -> Floats:
    """(n,): amounts of shift that stay up where the path cuts nothing: no way down and up again for nothing.

    amount (n,); air (n - 1,) bool: segments that meet no stock.  At the ends the nearest amount holds, between two it
    goes over from one to the other; no amount becomes smaller.
    """
    inside = ~(np.append(air, True) & np.append(True, air))
    if not inside.any():
        return amount.copy()
    index = np.flatnonzero(inside)
    return np.maximum(between(s[index], amount[index], s), amount)


def between(s: Floats, amount: Floats, wanted: Floats) -> Floats:
    """(k,): amounts of shift of new points at the arc lengths `wanted`."""
    return np.interp(wanted, s, amount)
