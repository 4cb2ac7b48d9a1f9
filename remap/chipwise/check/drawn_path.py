# SPDX-License-Identifier: GPL-2.0-or-later
"""The path of a program as a picture needs it.  Pure; mm, machine coordinates of the tool's tip.

Called by drawing.py, for the report of a check, by panel/look_ahead_process.py, for the path ahead of the tool, and by
setup/measure.py.

Thinner: of points that lie within a step of path the last is kept, and both ends of a longer move, so a corner between
long moves stays where it is, and no point of the program is further than the step from a kept one.  If there are more
than MOST_POINTS, the step is doubled.  A point where feed and traverse change is kept, too, unless these alone are more
than half of MOST_POINTS, as with thousands of holes: then what lies between two kept points is drawn as the second of
them is, feed or traverse.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats, Ints

    Points = tuple[Floats, Bools, Ints, Ints]  # points (n, 3), rapid (n,), low (n,), high (n,): as in a Path

STEP_MM = 0.1  # of a path of few points; a pixel of a part of 100 mm
MOST_POINTS = 400_000  # 16 MB
CHUNK = 65_536  # points that are thinned at once


@dataclass(frozen=True)
class Path:
    """points (n, 3) float32; rapid (n,) bool: the segment that ends there is a traverse; low, high (n,) int32: lines of
    the program on that segment; step: mm between a point of the program and the path at most; s (n,): length of the
    path up to each point, mm."""

    points: np.ndarray
    rapid: np.ndarray
    low: np.ndarray
    high: np.ndarray
    step: float
    s: np.ndarray

    def after(self, s: float) -> int:
        """Number of the first point behind a length of path; the number of points at its end."""
        return int(np.searchsorted(self.s, s, side="right"))


def lengths(points: Floats) -> Floats:
    """(n,) length of the path up to each point."""
    return np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points.astype(float), axis=0), axis=1))))[
        : len(points)
    ]


def thinned(points: Floats, rapid: Bools, low: Ints, high: Ints, step: float, mixed: bool = False) -> Points:
    """The same four without points that are nearer than the step to others of the same kind, mixed: of either; the
    first and the last stay."""
    if len(points) < 3:
        return points, rapid, low, high
    s = lengths(points)
    bucket = np.floor(s / step)
    keep = np.ones(len(points), bool)
    keep[1:-1] = (bucket[1:-1] != bucket[2:]) | (np.diff(s)[:-1] > step) | (not mixed) & (rapid[1:-1] != rapid[2:])
    kept = np.flatnonzero(keep)
    first = np.concatenate((np.zeros(1, int), kept[:-1] + 1))  # what a kept point has taken over
    return points[kept], rapid[kept], np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)


class Thinner:
    """Takes the points of a program as they come."""

    def __init__(self, most: int = MOST_POINTS, step: float = STEP_MM) -> None:
        self._most, self._step = most, step
        self._parts: list[Points] = []
        self._count, self._mixed = 0, False

    def add(self, points: Floats, rapid: Bools, lines: Floats | Ints) -> None:
        """points (n, 3); rapid (n,) bool; lines (n,)."""
        for first in range(0, len(points), CHUNK):
            part = slice(first, first + CHUNK)
            line = np.asarray(lines[part], np.int32)
            found = thinned(
                np.asarray(points[part], np.float32), np.asarray(rapid[part], bool), line, line, self._step, self._mixed
            )
            self._parts.append(found)
            self._count += len(found[0])
            if self._count > self._most:
                self._thin()

    def _joined(self) -> Points:
        points, rapid, low, high = zip(*self._parts)
        return np.concatenate(points), np.concatenate(rapid), np.concatenate(low), np.concatenate(high)

    def _thin(self) -> None:
        joined = self._joined()
        self._mixed = self._mixed or np.count_nonzero(np.diff(joined[1])) > self._most / 2
        while len(joined[0]) > 0.75 * self._most:
            self._step *= 2
            joined = thinned(*joined, self._step, self._mixed)
        self._parts, self._count = [joined], len(joined[0])

    def path(self) -> Path | None:
        """The Path of all that was added, None of less than two points."""
        if self._count < 2:
            return None
        points, rapid, low, high = self._joined()
        return Path(points, rapid, low, high, self._step, lengths(points))
