# SPDX-License-Identifier: GPL-2.0-or-later
"""The path of a program as a picture needs it, and where on it the tool is.  Pure; mm, machine coordinates of the tool's tip.

Called by ahead_process.py, which makes the path, and by ahead.py, which follows the tool on it.

Thinner: of points that lie within a step of path the last is kept, and both ends of a longer move, so a corner between long moves stays where it
is, and no point of the program is further than the step from a kept one.  If there are more than MOST_POINTS, the step is doubled.
follow(): the next place on the path at which the tip is, among the segments that the machine can have got to since the last one; the line that
the machine runs has to be one of the segment's.
"""

from dataclasses import dataclass

import numpy as np

STEP_MM = 0.1               # of a path of few points; a pixel of a part of 100 mm
MOST_POINTS = 400_000       # 16 MB
CHUNK = 65_536              # points that are thinned at once
NEAR_MM = 1.0               # the tip is that far from the path at most: G64 rounds corners
SAME_MM = 0.05              # of two places as near as that the earlier one counts


@dataclass(frozen=True)
class Path:
    """points (n, 3) float32; rapid (n,) bool: the segment that ends there is a traverse; low, high (n,) int32: lines of the program on that segment;
    step: mm between a point of the program and the path at most; s (n,): length of the path up to each point, mm."""

    points: np.ndarray
    rapid: np.ndarray
    low: np.ndarray
    high: np.ndarray
    step: float
    s: np.ndarray

    def after(self, s: float) -> int:
        """Number of the first point behind a length of path; the number of points at its end."""
        return int(np.searchsorted(self.s, s, side="right"))


def lengths(points):
    """(n,) length of the path up to each point."""
    return np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points.astype(float), axis=0), axis=1))))[:len(points)]


def thinned(points, rapid, low, high, step):
    """The same four without points that are nearer than the step to others of the same kind; the first and the last stay."""
    if len(points) < 3:
        return points, rapid, low, high
    s = lengths(points)
    bucket = np.floor(s / step)
    keep = np.ones(len(points), bool)
    keep[1:-1] = (bucket[1:-1] != bucket[2:]) | (np.diff(s)[:-1] > step) | (rapid[1:-1] != rapid[2:])
    kept = np.flatnonzero(keep)
    first = np.concatenate(([0], kept[:-1] + 1))        # what a kept point has taken over
    return points[kept], rapid[kept], np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)


class Thinner:
    """Takes the points of a program as they come."""

    def __init__(self, most=MOST_POINTS, step=STEP_MM):
        self._most, self._step = most, step
        self._parts, self._count = [], 0

    def add(self, points, rapid, lines):
        """points (n, 3); rapid (n,) bool; lines (n,)."""
        for first in range(0, len(points), CHUNK):
            part = slice(first, first + CHUNK)
            line = np.asarray(lines[part], np.int32)
            found = thinned(np.asarray(points[part], np.float32), np.asarray(rapid[part], bool), line, line, self._step)
            self._parts.append(found)
            self._count += len(found[0])
            if self._count > self._most:
                self._thin()

    def _thin(self):
        joined = tuple(map(np.concatenate, zip(*self._parts)))
        while len(joined[0]) > 0.75 * self._most:
            self._step *= 2
            joined = thinned(*joined, self._step)
        self._parts, self._count = [joined], len(joined[0])

    def path(self):
        """The Path of all that was added, None of less than two points."""
        if self._count < 2:
            return None
        points, rapid, low, high = map(np.concatenate, zip(*self._parts))
        return Path(points, rapid, low, high, self._step, lengths(points))


def follow(path, done, tip, line, reach):
    """Length of path at which the tip is, mm; None if it is not near the path.

    done   the same at the look before; reach: mm that the machine can have gone since
    tip    (3,) mm; line: that the machine runs, 0: not known
    """
    first = max(1, int(np.searchsorted(path.s, done - NEAR_MM)))
    last = int(np.searchsorted(path.s, done + reach, side="right"))
    found = on_segments(path, first, last + 1, tip, line)
    return None if found is None else max(done, found)


def anywhere(path, done, tip, line):
    """As follow(), on the whole path: what is behind `done` counts before what is in front of it."""
    at = path.after(done)
    found = on_segments(path, max(1, at - 1), len(path.s), tip, line)
    return found if found is not None else on_segments(path, 1, at, tip, line)


def on_segments(path, first, last, tip, line):
    """Length of path at the nearest place to the tip on the segments first .. last - 1; None without one that is near enough.  A segment has the
    number of the point at its end."""
    last = min(last, len(path.s))
    if first >= last:
        return None
    start = path.points[first - 1:last - 1].astype(float)
    along = path.points[first:last] - start
    square = np.maximum((along * along).sum(axis=1), 1e-12)
    to_tip = np.asarray(tip, float) - start
    share = np.clip((to_tip * along).sum(axis=1) / square, 0.0, 1.0)
    distance = np.linalg.norm(to_tip - share[:, None] * along, axis=1)
    if line > 0:
        distance[(path.low[first:last] > line) | (path.high[first:last] < line)] = np.inf
    least = distance.min()
    if not least <= NEAR_MM + path.step:
        return None
    at = int(np.argmax(distance <= least + SAME_MM))
    return float(path.s[first - 1 + at] + share[at] * np.sqrt(square[at]))
