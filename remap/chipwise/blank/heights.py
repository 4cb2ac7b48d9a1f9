# SPDX-License-Identifier: GPL-2.0-or-later
"""Heights of a real blank from touched points: an upper bound of what is there, and how far it may be too high.  Pure:
no LinuxCNC.

All lengths mm.  For a place p, the points within REACH spacings of p count; d is the spacing, e the probe's error.
 1. Slope: the steepest one between those and their neighbours (PAIR spacings apart at most), (|z_i - z_j| + 2 e) / |p_i
    - p_j|, times SURER: between points the surface may be steeper than from point to point.
 2. Height: the least of z_i + slope |p - p_i|.  If the truth within that reach is nowhere steeper than the slope, this
    is nowhere below the truth minus e: each point is at least the truth minus e there.  (It is McShane's extension,
    made local.)
 3. If the steepest slope found is more than STEPPED, a step is somewhere between the points: the highest point within
    PAIR spacings of p counts.
 4. p is probed if the points around it leave no gap of more than 180 degrees.  Elsewhere, and as an upper bound
    everywhere, the height is that of the top of the blank that was typed: its allowance is for what was not probed.
 5. The doubt is what the height may be above the truth: height minus the most of z_i - e - slope |p - p_i|, and of the
    bottom; in [3] minus the lowest point.
"""

import math
from dataclasses import dataclass

import numpy as np

from chipwise.errors import CycleError

REACH = 2.3  # spacings: two rows of a grid, and its corners
PAIR = 1.6  # spacings: the neighbours and diagonals of a grid
SURER = 1.45  # times the steepest slope found
STEPPED = 1.0  # slope: 45 degrees
LEAST_POINTS = 3
MOST_POINTS = 1_000_000
# of the spacing: points in one square of that side are one, the higher counts; nearer ones show no slope but their
# errors
SAME_SHARE = 0.2
CHUNK = 1 << 14  # places at a time: bounds the memory


@dataclass
class Blank:
    """top, doubt: (n,) mm; probed: (n,) bool; spacing of the points, steepest slope found (without SURER), mm and 1."""

    top: np.ndarray
    doubt: np.ndarray
    probed: np.ndarray
    spacing: float
    steepest: float


def heights(points, places, low, high, error=0.0, size=0.0):
    """The Blank at places (n, 2) of touched points (m, 3); low, high: bottom and top of the typed blank; error: the
    probe's; size: side of a cell whose middle a place is, so that its corners are covered, too.  Raises CycleError."""
    points = checked(points, error)
    spacing = spacing_of(points)
    points = merged(points, SAME_SHARE * spacing)
    grid = Grid(points, REACH * spacing)
    slopes, pairs = _pairs(points, grid, PAIR * spacing, error)
    # the steepest slope at each point: of the pairs that it is in; and the one within the reach of a place is the most
    # of its points' ones
    own = np.zeros(len(points))
    np.maximum.at(own, pairs[:, 0], slopes)
    np.maximum.at(own, pairs[:, 1], slopes)
    touched = _Touched(points, own, grid, spacing, error)
    top, doubt, probed = (np.empty(len(places)) for _ in range(3))
    for first in range(0, len(places), CHUNK):
        part = slice(first, min(first + CHUNK, len(places)))
        top[part], doubt[part], probed[part] = touched.at(np.asarray(places[part], float), low, high, size)
    return Blank(top, doubt, probed.astype(bool), spacing, float(slopes.max(initial=0.0)))


def checked(points, error):
    """(m, 3) float.  Raises CycleError for what cannot be points of a blank."""
    points = np.asarray(points, float).reshape(-1, 3)
    if len(points) < LEAST_POINTS:
        raise CycleError(f"{len(points)} points are not enough", f"touch at least {LEAST_POINTS}, not in one line")
    if len(points) > MOST_POINTS:
        raise CycleError(f"{len(points)} points are more than {MOST_POINTS}", "leave some out")
    if not np.isfinite(points).all() or np.abs(points).max() > 1e6:
        raise CycleError("a point is not a place of a machine", "see the list of points")
    if not 0.0 <= error < math.inf:
        raise CycleError(f"the probe's error {error:g} mm is not a length", "give it in mm")
    return points


def spacing_of(points):
    """The spacing of points: the median distance to the nearest other one, and not less than that of a grid of so many.
    Raises CycleError if they are all in one place."""
    around = points[:, :2]
    extent = np.ptp(around, axis=0)
    side = max(math.sqrt(max(extent[0] * extent[1], 0.0) / len(points)), float(extent.max()) / len(points))
    if not side > 0:
        raise CycleError("all points are in one place", "touch the blank in several places")
    grid = Grid(points, 2.0 * side)
    near, distance = grid.near(around)
    distance[(near < 0) | (distance < 1e-6)] = np.inf
    nearest = distance.min(axis=1, initial=np.inf)
    found = nearest[np.isfinite(nearest)]
    return max(float(np.median(found)) if len(found) else 0.0, side)


def merged(points, least):
    """The points, of those nearer to each other than `least` the highest."""
    order = np.lexsort((-points[:, 2], *np.floor(points[:, 1::-1].T / max(least, 1e-9))))
    keys = np.floor(points[order, :2] / max(least, 1e-9))
    first = np.ones(len(points), bool)
    first[1:] = (keys[1:] != keys[:-1]).any(axis=1)
    return points[order[first]]


class Grid:
    """Points in squares of a side `reach`: those within the reach of a place are in its square and the eight around."""

    def __init__(self, points, reach):
        self.points, self.reach = points, reach
        self.low = points[:, :2].min(axis=0)
        square = np.floor((points[:, :2] - self.low) / reach).astype(int)
        self.size = square.max(axis=0) + 1
        keys = square[:, 0] * self.size[1] + square[:, 1]
        self.order = np.argsort(keys, kind="stable")
        self.keys = keys[self.order]

    def near(self, places):
        """(numbers (n, k) of the points within the reach, -1 behind them; distances (n, k))."""
        square = np.floor((places - self.low) / self.reach).astype(int)
        found = []
        for dx in (-1, 0, 1):
            for dy in (-1, 0, 1):
                x, y = square[:, 0] + dx, square[:, 1] + dy
                inside = (x >= 0) & (y >= 0) & (x < self.size[0]) & (y < self.size[1])
                key = np.where(inside, x * self.size[1] + y, -1)
                first, end = np.searchsorted(self.keys, key), np.searchsorted(self.keys, key, side="right")
                most = int((end - first).max(initial=0))
                at = first[:, None] + np.arange(most)
                found.append(np.where(at < end[:, None], self.order[np.minimum(at, len(self.order) - 1)], -1))
        near = np.concatenate(found, axis=1)
        distance = np.hypot(*(self.points[near, k] - places[:, k, None] for k in (0, 1)))
        near[distance > self.reach] = -1
        keep = (near >= 0).any(axis=0)
        return near[:, keep], distance[:, keep]


def _pairs(points, grid, far, error):
    """(slopes (k,), numbers (k, 2)) of the points that are neighbours [1]."""
    near, distance = grid.near(points[:, :2])
    first, column = np.nonzero((near >= 0) & (distance <= far) & (distance >= SAME_SHARE * far / PAIR))
    second = near[first, column]
    once = first < second
    first, second, along = first[once], second[once], distance[first[once], column[once]]
    return (np.abs(points[first, 2] - points[second, 2]) + 2.0 * error) / along, np.column_stack((first, second))


@dataclass(frozen=True, eq=False)
class _Touched:
    """points (m, 3) and the Grid of them; steepest (m,): slope at each; spacing of the points, error of the probe."""

    points: np.ndarray
    steepest: np.ndarray
    grid: Grid
    spacing: float
    error: float

    def at(self, places, low, high, size):
        """(top, doubt, probed) of some places.  low, high, size: as in heights()."""
        near, distance = self.grid.near(places)
        if not near.shape[1]:
            return np.full(len(places), high), np.full(len(places), high - low), np.zeros(len(places))
        there, z = near >= 0, self.points[near, 2]
        found = np.where(there, self.steepest[near], 0.0).max(axis=1)
        slope = SURER * found
        half = size * math.sqrt(0.5)
        reached = slope[:, None] * (distance + half)
        top = np.where(there, z + reached, np.inf).min(axis=1)
        least = np.where(there, z - self.error - reached, -np.inf).max(axis=1)
        beside = there & (distance <= PAIR * self.spacing + half)
        stepped = found > STEPPED
        top = np.where(stepped, np.where(beside, z, -np.inf).max(axis=1), top)
        least = np.where(stepped, np.where(beside, z, np.inf).min(axis=1) - self.error, least)
        probed = _surrounded(self.points[near, :2] - places[:, None, :], there, distance, half)
        top = np.where(probed, np.minimum(top, high), high)
        least = np.where(probed, np.maximum(least, low), low)
        return top, np.maximum(top - least, 0.0), probed


def _surrounded(towards, there, distance, half):
    """Whether the directions to points leave no gap of more than 180 degrees [4]; a cell that reaches a point is."""
    angle = np.where(there, np.arctan2(towards[..., 1], towards[..., 0]), np.nan)
    angle = np.sort(angle, axis=1)  # NaN behind
    last = there.sum(axis=1)
    gaps = np.diff(angle, axis=1)
    around = 2 * math.pi - (angle[np.arange(len(angle)), np.maximum(last - 1, 0)] - angle[:, 0])
    widest = np.maximum(np.nanmax(np.where(np.isnan(gaps), -1.0, gaps), axis=1, initial=0.0), around)
    at_a_point = (there & (distance <= max(half, 1e-9))).any(axis=1)
    return (last > 0) & ((widest <= math.pi + 1e-9) | at_a_point)
