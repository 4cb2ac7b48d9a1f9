# SPDX-License-Identifier: GPL-2.0-or-later
"""Traverses in a vertical plane, above all that the tool must keep above, and how long they take.

Called by links.py.  Pure; mm, s.  A route is points (k, 2): distance along a line seen from above, and height.
The time is that of LinuxCNC's planner: components/offline/traverse_time.c.
"""

import numpy as np

from chipwise.stock.core import library

SPEED, ACCEL = 100.0, 500.0     # mm/s, mm/s2 of an axis: they decide between routes that are all safe
SAME = 1e-6                     # mm
MOST_SIDES = 10                 # of a route


def routes(at, needs, start, end, top, blend):
    """Routes that begin at the height `start` or above it and lead to the height `end`, or to what is needed there, [(k, 2)]: level, over the
    upper hull of the needs, and over fewer and fewer of the hull's sides, which then are longer.

    at      (n + 1,) rising distances; needs: (n,) heights the tip may not go below between each two of them
    top     no route is higher, and no need
    blend   how far corners will be rounded: all but the last point are higher by that
    """
    needs = np.minimum(needs, top)
    hull = upper_hull(np.concatenate([[(at[0], start)], np.column_stack([at[:-1], needs]), np.column_stack([at[1:], needs]), [(at[-1], end)]]))
    high = float(hull[:, 1].max())
    found = [np.array([(at[0], high), (at[-1], high)]), *_fewer_sides(hull, top)]
    found += [np.append(points, [(at[-1], end)], axis=0) for points in found if points[-1, 1] > end + SAME]
    return [_raised(points, top, blend) for points in found]


def _fewer_sides(hull, top):
    """A hull and those over it that have one side less each, from MOST_SIDES on: the side is left out over which its neighbours meet lowest."""
    if len(hull) <= MOST_SIDES + 1:
        yield hull
    while len(hull) > 3:
        corners = _meetings(hull)
        height = corners[:, 1] - hull[1:-2, 1]
        k = int(np.where(corners[:, 1] <= top, height, np.inf).argmin())
        if corners[k, 1] > top:
            return
        hull = np.concatenate([hull[:k + 1], corners[k:k + 1], hull[k + 3:]])
        if len(hull) <= MOST_SIDES + 1:
            yield hull


def _meetings(hull):
    """Where the neighbours of each side of a hull but the first and the last meet -> (sides - 2, 2)."""
    slope = np.diff(hull[:, 1]) / np.diff(hull[:, 0])
    before, after = slope[:-2], slope[2:]
    run = (hull[2:-1, 1] - hull[1:-2, 1] - after * (hull[2:-1, 0] - hull[1:-2, 0])) / np.maximum(before - after, 1e-12)
    return np.column_stack([hull[1:-2, 0] + run, hull[1:-2, 1] + before * run])


def seconds(points, blend):
    """The time (s) of straight traverses along points (k, 3), at rest at both ends; corners are rounded by `blend` (mm)."""
    points = np.ascontiguousarray(points, np.float64)
    return library().chip_traverse_seconds(len(points), points.ctypes.data, SPEED, ACCEL, blend)


def upper_hull(points):
    """The corners (k, 2) of the upper hull of points (n, 2) from the leftmost to the rightmost."""
    found = []
    for x, y in points[np.lexsort((points[:, 1], points[:, 0]))].tolist():
        if found and x - found[-1][0] < SAME:
            found.pop()                         # a higher one at the same place
        while len(found) > 1 and (found[-1][1] - found[-2][1]) * (x - found[-2][0]) <= (y - found[-2][1]) * (found[-1][0] - found[-2][0]) + SAME:
            found.pop()
        found.append((x, y))
    return np.array(found)


def _raised(points, top, blend):
    """All points but the last higher by `blend`, but not above top."""
    points = points.copy()
    points[:-1, 1] = np.minimum(points[:-1, 1] + blend, top)
    return points
