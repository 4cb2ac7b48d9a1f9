# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock as it stands under a pocket, and what of a level of it is cleared already; pure, mm.

Made by planner/plans.py from the map of the stock tracker; asked by pocket_engage.py.

What counts as cleared is never more than what is, and less by up to a cell and a half: a place of the tool counts if
all cells that its circle touches are wholly at or below the level.  A cell with a wall in it is not, and a cell outside
of the map is not known, so it is stock.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import Elements, make_lines

# Heights within this are the same: the map has single precision. mm
LEVEL_MM = 1e-3


@dataclass(frozen=True)
class Standing:
    """Cells of the map.

    corner         (x, y) of the first cell's outer corner, machine coordinates
    cell           side of a cell
    rows, columns  how many, along Y and X
    tops           bytes of float32, row by row: height of the highest part of each cell, machine Z
    origin         (x, y, z) of the work coordinates, machine coordinates
    turn           rad: of the work coordinates
    """

    corner: tuple
    cell: float
    rows: int
    columns: int
    tops: bytes
    origin: tuple
    turn: float

    def within(self, low, high, radius: float) -> "Standing":
        """Only the cells that a tool of this radius can ask for in a box of work coordinates."""
        first, after = self._window(low, high, radius)
        a, b = np.maximum(first, 0), np.maximum(np.minimum(after, (self.columns, self.rows)), np.maximum(first, 0))
        tops = np.frombuffer(self.tops, np.float32).reshape(self.rows, self.columns)[a[1] : b[1], a[0] : b[0]]
        corner = tuple((np.array(self.corner) + a * self.cell).tolist())
        return replace(self, corner=corner, rows=tops.shape[0], columns=tops.shape[1], tops=tops.tobytes())

    def cleared(self, contour: Elements, z: float, radius: float, mirrored: bool = False) -> Elements:
        """Lines of places that a tool, of this radius and on this level (work coordinates), may have been at, so that
        all it has swept is cleared: those that a region within this contour can ask for.  mirrored: X of the region is
        negative."""
        (left, lower), (right, upper) = (f(part, axis=0) for f, part in zip((np.min, np.max), elements.boxes(contour)))
        low, high = self._window(
            (-right, lower) if mirrored else (left, lower), (-left, upper) if mirrored else (right, upper), radius
        )
        tops = np.frombuffer(self.tops, np.float32).reshape(self.rows, self.columns)
        free = np.zeros((high[1] - low[1], high[0] - low[0]), bool)
        a, b = np.maximum(low, 0), np.minimum(high, (self.columns, self.rows))
        if (a < b).all():
            free[a[1] - low[1] : b[1] - low[1], a[0] - low[0] : b[0] - low[0]] = (
                tops[a[1] : b[1], a[0] : b[0]] <= z + self.origin[2] + LEVEL_MM
            )
        start, end = _runs(_with_clearance(free, radius / self.cell))
        place = [self._work(np.array(self.corner) + (low + at + 0.5) * self.cell) for at in (start, end)]
        side = np.array((-1.0 if mirrored else 1.0, 1.0))
        return make_lines(place[0] * side, place[1] * side)

    def _window(self, low, high, radius):
        """(first cell, cell after the last) (x, y) of those that a tool can touch whose circle is within two radii of a
        box."""
        corners = np.array([(x, y) for x in (low[0], high[0]) for y in (low[1], high[1])])
        c, s = math.cos(self.turn), math.sin(self.turn)
        at = (
            np.column_stack((c * corners[:, 0] - s * corners[:, 1], s * corners[:, 0] + c * corners[:, 1]))
            + self.origin[:2]
        )
        index = (at - self.corner) / self.cell
        more = 3.0 * radius / self.cell + 1.0
        return np.floor(index.min(axis=0) - more).astype(int), np.ceil(index.max(axis=0) + more).astype(int)

    def _work(self, point):
        c, s = math.cos(self.turn), math.sin(self.turn)
        x, y = (point - self.origin[:2]).T
        return np.column_stack((c * x + s * y, c * y - s * x))


def _with_clearance(free, radius):
    """Which cells (rows, columns) have only free ones that a circle about their middle, of a radius in cells,
    touches."""
    apart = _apart(free)
    found = free.copy()
    for row in range(1, math.ceil(radius + 0.5) + 1):
        half = radius**2 - (row - 0.5) ** 2
        if half <= 0.0:
            break
        near = apart >= math.sqrt(half) + 0.5
        found[:-row] &= near[row:]
        found[row:] &= near[:-row]
        found[-row:] = found[:row] = False
    return found & (apart >= radius + 0.5)


def _apart(free):
    """How many columns away the nearest cell of the same row is that is not free; those beside the array are not."""
    column = np.arange(free.shape[1])
    before = np.maximum.accumulate(np.where(free, -1, column), axis=1)
    after = np.minimum.accumulate(np.where(free, free.shape[1], column)[:, ::-1], axis=1)[:, ::-1]
    return np.minimum(column - before, after - column)


def _runs(cells):
    """(first (n, 2), last (n, 2)) column and row of each run of cells in a row."""
    padded = np.zeros((cells.shape[0], cells.shape[1] + 2), np.int8)
    padded[:, 1:-1] = cells
    change = np.diff(padded, axis=1)
    row, first = np.nonzero(change == 1)
    _, after = np.nonzero(change == -1)
    return np.column_stack((first, row)), np.column_stack((after - 1, row))
