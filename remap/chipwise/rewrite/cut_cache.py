# SPDX-License-Identifier: GPL-2.0-or-later
"""Cuts of a path that changes little from trial to trial: what is as it was is not cut again.

Called by trials.py.  The path is divided into parts.  A part that goes through the same points as in the trial before,
in stock that has the same heights (both by a digest of 128 bits), leaves the same heights and meets the same depths:
they are put there.  So the result is that of HeightMap.cut(), to the last bit.  Lengths mm.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Sequence

import numpy as np

from chipwise.rewrite import sections
from chipwise.clib import layout

if TYPE_CHECKING:
    from chipwise.clib.arrays import Floats, Ints
    from chipwise.clib.height_map import HeightMap, Shape

PART_POINTS = 512  # points of the first path in a part
FROM_CALL = 2  # before, nothing is kept, most paths need no more
MOST_BYTES = 48_000_000  # kept; what is beyond is cut each time


@dataclass(frozen=True)
class Kept:
    """A part in the trial before: digest of its points and of the heights before, depths (n,), the cells and needles
    that it has changed, their heights."""

    digest: bytes
    depth: np.ndarray
    cells: np.ndarray
    heights: np.ndarray
    needles: np.ndarray
    needle_heights: np.ndarray

    @property
    def size(self) -> int:
        """Bytes."""
        return 500 + sum(a.nbytes for a in (self.depth, self.cells, self.heights, self.needles, self.needle_heights))


class Recut:
    """Cuts of one path after another in the same HeightMap with the same Shape."""

    def __init__(self, stock: HeightMap, shape: Shape) -> None:
        self.stock, self.shape = stock, shape
        self.again = 0  # parts that were not cut again
        self._kept: dict[int, Kept] = {}
        self._calls, self._bytes = 0, 0

    def depths(self, start: Floats, places: Floats, label: Ints) -> Floats:
        """Cut moves from start (3,) along places (n, 3) -> depth (n,) float32 that each of them meets.

        label (n,) int, not falling: moves with the same label are a part.
        """
        self._calls += 1
        if self._calls < FROM_CALL:
            return self.stock.cut(self.shape, start, places)["depth"]
        result, bounds = np.empty(len(places), np.float32), parts(start, places, label)
        for a, b in zip(bounds[:-1], bounds[1:]):
            points = np.concatenate(((places[a - 1] if a else np.asarray(start, float))[None], places[a:b]))
            result[a:b] = self._part(int(label[a]), points)
        return result

    def _part(self, key: int, points: Floats) -> Floats:
        stock, radius = self.stock, self.shape.diameter / 2
        view, single = (
            sections.near(stock, points, radius),
            stock.needles_in(*_box(points, radius + layout.HEIGHT_SKIN)),
        )
        before, needles_before = view.copy(), stock.needle_height[single]
        digest = hashlib.blake2b(points.data, digest_size=16)
        digest.update(before.data)
        digest.update(needles_before.data)
        kept = self._kept.get(key)
        if kept and kept.digest == digest.digest():
            self.again += 1
            view[np.unravel_index(kept.cells, view.shape)] = kept.heights
            stock.needle_height[kept.needles] = kept.needle_heights
            return kept.depth
        depth = stock.cut(self.shape, points[0], points[1:])["depth"].copy()
        after, cells = view.ravel(), np.flatnonzero(view != before).astype(np.int32)
        changed = single[stock.needle_height[single] != needles_before]
        self._keep(key, Kept(digest.digest(), depth, cells, after[cells], changed, stock.needle_height[changed]))
        return depth

    def _keep(self, key: int, new: Kept) -> None:
        old = self._kept.pop(key, None)
        self._bytes -= old.size if old else 0
        if self._bytes + new.size <= MOST_BYTES:
            self._kept[key] = new
            self._bytes += new.size


def _box(points: Floats, radius: float) -> tuple[Floats, Floats]:
    """(low, high), each (3,): what is within a radius of the box round points."""
    return points.min(axis=0) - radius, points.max(axis=0) + radius


def parts(start: Floats | Sequence[float], places: Floats, label: Ints) -> list[int]:
    """[0, .., n]: where the parts of moves from start (3,) along places (n, 3) begin and end: where the label (n,)
    changes, or at the next move that needs nothing of the one before."""
    free = np.append(np.flatnonzero(sections.apart(start, places)), len(places))
    wanted = np.flatnonzero(np.diff(label)) + 1
    return np.unique([0, *free[np.searchsorted(free, wanted)].tolist(), len(places)]).tolist()
