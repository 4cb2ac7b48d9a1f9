# SPDX-License-Identifier: GPL-2.0-or-later
"""Traverses over a line seen from above, or over two with a corner, above all that the tool must keep above, and how
long they take.

Called by quickest_link.py.  Pure; mm, s.  A route is points (k, 2): distance along the line, and height.
The time is that of LinuxCNC's planner: components/offline/traverse_time.c; traverse_search.c looks for a shorter one.
"""

import ctypes as C
import math
from dataclasses import dataclass

import numpy as np

from chipwise.clib import layout
from chipwise.clib.library import library

SPEED, ACCEL = 100.0, 500.0  # mm/s, mm/s2 of an axis: they decide between routes that are all safe
SAME = 1e-6  # mm
STEEP = 1e9  # rise over run of a side in place of one straight up
MOST_SIDES = 10  # of a route
SIDES = 6  # at least, of one whose points are moved


@dataclass(frozen=True)
class Lane:
    """The places that a route leads over, and what it keeps above.

    places  (3, 2) mm: where it begins, where it has a corner seen from above, where it ends
    corner  distance of that, mm; 0: the first two places are the same
    limit   (k, 2) upper hull of what its sides are not below; lower: (k, 2), its arcs; lines over distances from 0 to
            the end
    start   height (mm) where it begins: from there straight up to what `limit` asks for; end: height where it ends
    top     no route is higher
    blend   how far corners will be rounded
    """

    places: np.ndarray
    corner: float
    limit: np.ndarray
    lower: np.ndarray
    start: float
    end: float
    top: float
    blend: float

    def routes(self):
        """[(seconds, (k, 2))] that may be taken, the quickest one first: level, over the upper hull of the limit, and
        over fewer and fewer of its sides, which then are longer; and the quickest of these with its points moved as
        long as that saves time."""
        found = [(self._seconds(points, False), points) for points in self._first()]
        moved = _divided(min(found, key=_seconds_of)[1])
        found.append((self._seconds(moved, True), moved))
        return sorted((one for one in found if one[0] < layout.ROUTE_BAD), key=_seconds_of)

    def level(self):
        """(4, 2): straight up, level over all, and straight down."""
        high = max(self.limit[:, 1].max(), self.end)
        far = self.limit[-1, 0]
        return np.array([(0.0, self.start), (0.0, high), (far, high), (far, self.end)])

    def chain(self, points):
        """A route as points (n, 3), with one over the corner."""
        points = _with_corner(points, self.corner)
        at = (0.0, self.corner, self.limit[-1, 0]) if self.corner > SAME else (0.0, self.limit[-1, 0])
        place = [np.interp(points[:, 0], at, corners[-len(at) :]) for corners in self.places.T]
        chain = np.column_stack([*place, points[:, 1]])
        return chain[np.append(True, np.linalg.norm(np.diff(chain, axis=0), axis=1) > SAME)]

    def _seconds(self, points, search):
        """Of a route, or ROUTE_BAD if it may not be; with search its points are moved first."""
        limit, lower = (np.ascontiguousarray(one, np.float64) for one in (self.limit, self.lower))
        lane = layout.Lane(
            (C.c_double * 6)(*self.places.ravel()),
            self.corner,
            self.limit[-1, 0],
            self.top,
            self.blend,
            SPEED,
            ACCEL,
            limit.ctypes.data,
            lower.ctypes.data,
            len(limit),
            len(lower),
        )
        return library().chip_traverse_improve(C.byref(lane), len(points), points.ctypes.data, search)

    def _first(self):
        """Routes to begin with, (k, 2) each."""
        far, slopes = (
            self.limit[-1, 0],
            _fewer_sides(np.vstack([(-SAME, self.limit[0, 1] - STEEP * SAME), self.limit]), self.top),
        )
        for points in (self.level()[1:-1], *(one[1:] for one in slopes)):
            points = points.copy()
            points[0, 0] = 0.0
            rises = points[0, 1] > self.start + SAME
            points[int(not rises) :, 1] = np.minimum(points[int(not rises) :, 1] + self.blend, self.top)
            if rises:
                points = np.vstack([(0.0, self.start), points])
            yield np.append(points, [(far, self.end)], axis=0)
            points[-1, 1] = self.end
            yield points


def _fewer_sides(hull, top):
    """A hull and those over it that have one side less each, from MOST_SIDES on: the side is left out over which its
    neighbours meet lowest."""
    if len(hull) <= MOST_SIDES + 1:
        yield hull
    while len(hull) > 3:
        corners = _meetings(hull)
        height = corners[:, 1] - hull[1:-2, 1]
        k = int(np.where(corners[:, 1] <= top, height, np.inf).argmin())
        if corners[k, 1] > top:
            return
        hull = np.concatenate([hull[: k + 1], corners[k : k + 1], hull[k + 3 :]])
        if len(hull) <= MOST_SIDES + 1:
            yield hull


def _meetings(hull):
    """Where the neighbours of each side of a hull but the first and the last meet -> (sides - 2, 2)."""
    slope = np.diff(hull[:, 1]) / np.diff(hull[:, 0])
    before, after = slope[:-2], slope[2:]
    run = (hull[2:-1, 1] - hull[1:-2, 1] - after * (hull[2:-1, 0] - hull[1:-2, 0])) / np.maximum(before - after, 1e-12)
    return np.column_stack([hull[1:-2, 0] + run, hull[1:-2, 1] + before * run])


def seconds(points, blend):
    """The time (s) of straight traverses along points (k, 3), at rest at both ends; corners are rounded by `blend`
    (mm)."""
    points = np.ascontiguousarray(points, np.float64)
    return library().chip_traverse_seconds(len(points), points.ctypes.data, SPEED, ACCEL, blend)


def upper_hull(points):
    """The corners (k, 2) of the upper hull of points (n, 2) from the leftmost to the rightmost."""
    found = []
    for x, y in points[np.lexsort((points[:, 1], points[:, 0]))].tolist():
        if found and x - found[-1][0] < SAME:
            found.pop()  # a higher one at the same place
        while (
            len(found) > 1
            and (found[-1][1] - found[-2][1]) * (x - found[-2][0])
            <= (y - found[-2][1]) * (found[-1][0] - found[-2][0]) + SAME
        ):
            found.pop()
        found.append((x, y))
    return np.array(found)


def _seconds_of(one):
    return one[0]


def _divided(points):
    """A route with its longest sides halved until it has SIDES."""
    while len(points) <= SIDES:
        k = int(np.diff(points[:, 0]).argmax())
        points = np.insert(points, k + 1, points[k : k + 2].mean(axis=0), axis=0)
    return np.array(points, np.float64, order="C")


def _with_corner(points, far):
    """A route with a point at a distance, too."""
    if np.abs(points[:, 0] - far).min() < SAME:
        return points
    k = int(np.searchsorted(points[:, 0], far))
    return np.insert(points, k, (far, np.interp(far, *points[k - 1 : k + 1].T)), axis=0)


def cut_corners(points, blend):
    """Points (n, 3) of a path whose corners are cut off straight where their arcs begin and end: it is inside of the
    arcs."""
    step = np.diff(points, axis=0)
    length = np.linalg.norm(step, axis=1)
    step, found = step / np.maximum(length, SAME)[:, None], [points[0]]
    for k in range(1, len(step)):
        half = 0.5 * math.acos(min(max(float(step[k - 1] @ step[k]), -1.0), 1.0))
        reach = blend * math.sin(half) / max(1.0 - math.cos(half), SAME)  # an arc of that tolerance, from the corner
        reach = min(reach, length[k - 1] / 2, length[k] / 2)
        found += [points[k] - reach * step[k - 1], points[k] + reach * step[k]]
    return np.array([*found, points[-1]])
