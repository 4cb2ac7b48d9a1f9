# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock of a whole program, offline: components/offline/height_sweep.c from Python.

Called by check/simulate.py and check/times.py.  All lengths mm, machine coordinates of the tool's tip; areas mm2,
volumes mm3.
"""

import ctypes as C
import math
from dataclasses import dataclass

import numpy as np

from chipwise.clib import layout
from chipwise.clib.library import library

MAX_CELLS = 12_000_000  # 48 MB of heights
MIN_CELL = 0.01  # mm
BOX, CYLINDER = map(int, layout.StockShape)
STRIP_ROWS = 4  # there are so many times fewer strips of needles than rows, were they even
_STEP_X, _STEP_Y = (
    math.sqrt(2.0) - 1.0,
    (math.sqrt(5.0) - 1.0) / 2.0,
)  # shifts that fill a cell evenly, in any direction

MET: np.dtype = np.dtype(layout.HeightMet)


@dataclass(frozen=True)
class Shape:
    """A tool: mm, degrees (0: no cone); holder_diameter 0: not known."""

    diameter: float
    corner_radius: float = 0.0
    tip_angle: float = 0.0
    holder_diameter: float = 0.0
    stick_out: float = 0.0

    @classmethod
    def of_tool(cls, diameter, geometry):
        """From the tool table's diameter (mm) and a ToolGeometry."""
        g = geometry
        corner = diameter / 2 if g.shape == "ball" else min(g.corner_radius or 0.0, diameter / 2)
        cone = g.tip_angle or 0.0 if g.shape in ("vee", "tapered-ball") else 0.0
        known = g.holder_diameter and g.stick_out
        return cls(diameter, corner, cone, g.holder_diameter if known else 0.0, g.stick_out if known else 0.0)

    def struct(self):
        slope = 1.0 / math.tan(math.radians(self.tip_angle) / 2.0) if self.tip_angle else 0.0
        return layout.HeightTool(
            self.diameter / 2.0,
            min(self.corner_radius, self.diameter / 2.0),
            slope,
            self.holder_diameter / 2.0,
            self.stick_out,
        )


def least_cell(low, high):
    """The smallest cell (mm) a stock box may have here."""
    return max(MIN_CELL, math.sqrt((high[0] - low[0]) * (high[1] - low[1]) / MAX_CELLS))


class Strips:
    """Places (n, 2) in strips of Y, in each X rising: those in a box are found without looking at all.

    order (n,): their index, strip by strip; first (count + 1,) int32: where each strip begins in that; low, width: mm,
    of the strips.
    """

    def __init__(self, places):
        x, y = places[:, 0], places[:, 1]
        self.count = 1 + int(math.sqrt(len(places)) / STRIP_ROWS)
        self.low = float(y.min(initial=math.inf)) if len(places) else 0.0
        self.width = max((float(y.max()) - self.low) / self.count, 1e-6) * (1 + 1e-9) if len(places) else 1.0
        number = np.clip(((y - self.low) / self.width).astype(np.int64), 0, self.count - 1)
        self.order = np.lexsort((x, number))
        self.first = np.searchsorted(number[self.order], np.arange(self.count + 1)).astype(np.int32)
        self._x = x[self.order]

    def between(self, low, high):
        """Numbers (k,) int in `order` of the places of X low[0] .. high[0] in the strips of Y low[1] .. high[1]."""
        a, b = (math.floor(min(max((v - self.low) / self.width, -1.0), float(self.count))) for v in (low[1], high[1]))
        found = []
        for first, end in zip(self.first[max(a, 0) : b + 1].tolist(), self.first[max(a, 0) + 1 : b + 2].tolist()):
            own = self._x[first:end]
            found.append(np.arange(first + own.searchsorted(low[0]), first + own.searchsorted(high[0], side="right")))
        return np.concatenate(found) if found else np.zeros(0, int)


class HeightMap:
    """One height per needle.  A box or cylinder `low` .. `high` as in stock.core.Stock, turn in degrees."""

    def __init__(self, low, high, cell, shape=BOX, turn=0.0):
        c, s = abs(math.cos(math.radians(turn))), abs(math.sin(math.radians(turn)))
        self._middle = middle = (low[0] + high[0]) / 2, (low[1] + high[1]) / 2
        size = high[0] - low[0], high[1] - low[1]
        wide, deep = size[0] * c + size[1] * s, size[0] * s + size[1] * c
        self.cell, self.low, self.high, self.shape, self.turn = cell, tuple(low), tuple(high), shape, turn
        self.x0, self.y0 = middle[0] - wide / 2, middle[1] - deep / 2
        self.nx, self.ny = max(1, math.ceil(wide / cell - 1e-6)), max(1, math.ceil(deep / cell - 1e-6))
        self.z_min, self.z_max = low[2], high[2]
        self._x = (np.arange(self.nx) * cell).astype(np.float32)
        self.shift_x = (np.arange(self.ny) * _STEP_X % 1.0 * cell).astype(np.float32)
        self.shift_y = (np.arange(self.nx) * _STEP_Y % 1.0 * cell).astype(np.float32)
        self.height = np.full((self.ny, self.nx), self.z_max, np.float32)
        self._leave()
        self._struct = layout.HeightMap(
            self.x0,
            self.y0,
            cell,
            self.z_min,
            self.z_max,
            self.nx,
            self.ny,
            self.height.ctypes.data,
            self._x.ctypes.data,
            self.shift_x.ctypes.data,
            self.shift_y.ctypes.data,
        )
        self._functions, self._room = library(), None
        self.needles, self.needle_height = np.zeros((0, 2)), np.zeros(0, np.float32)

    def _leave(self):
        """Remove the cells outside of the shape, row by row."""
        for row in range(self.ny):
            x, y = (
                self._x + self.shift_x[row] + (self.x0 - self._middle[0]),
                self.shift_y + (self.y0 + row * self.cell - self._middle[1]),
            )
            self.height[row, ~self._inside(x, y)] = self.z_min

    def _inside(self, x, y):
        """(n,) bool: places x, y (n,) from the middle of the stock that it covers."""
        size = self.high[0] - self.low[0], self.high[1] - self.low[1]
        if self.turn:
            c, s = math.cos(math.radians(self.turn)), math.sin(math.radians(self.turn))
            x, y = x * c + y * s, y * c - x * s
        if self.shape == CYLINDER:
            return (2 * x / size[0]) ** 2 + (2 * y / size[1]) ** 2 <= 1.0
        return (np.abs(x) <= size[0] / 2) & (np.abs(y) <= size[1] / 2)

    def add_needles(self, places, skin=layout.HEIGHT_SKIN, area=0.0):
        """Single needles (n, 2) in mm besides, exact where those of the cells are not; as high as the stock before it
        is cut.  skin: mm by which a tool that meets them is smaller in radius; area: cells that each counts with in a
        volume."""
        self._strips = strips = Strips(places)
        self.needles = np.asfortranarray(places[strips.order], np.float64)
        x, y = self.needles[:, 0], self.needles[:, 1]
        self.needle_height = np.where(
            self._inside(x - self._middle[0], y - self._middle[1]), self.z_max, self.z_min
        ).astype(np.float32)
        self._struct.needle_x, self._struct.needle_y = x.ctypes.data, y.ctypes.data
        self._struct.needle_height, self._struct.needles = self.needle_height.ctypes.data, len(places)
        self._struct.strip, self._struct.strips = strips.first.ctypes.data, strips.count
        self._struct.needle_area = area * self.cell**2
        self._struct.strip_y, self._struct.strip_width, self._struct.needle_skin = strips.low, strips.width, skin

    def needles_in(self, low, high):
        """Index (k,) of the single needles in a box (x, y)."""
        if not len(self.needles):
            return np.zeros(0, int)
        index = self._strips.between(low, high)
        y = self.needles[index, 1]
        return index[(y >= low[1]) & (y <= high[1])]

    def cut(self, tool, start, places, judged=None, clearance=0.0):
        """Moves from `start` (3,) along `places` (n, 3) -> records of MET, one per move.  judged (n,) bool: traverses
        whose distance from stock is asked for, if it is less than the clearance (mm)."""
        places = np.ascontiguousarray(places, np.float64)
        met = np.zeros(len(places), MET)
        shape, traverses = tool.struct(), None
        if judged is not None:
            judged = np.ascontiguousarray(judged, np.uint8)
            traverses = C.byref(layout.HeightTraverses(judged.ctypes.data, clearance))
        self._functions.chip_height_sweep(
            C.byref(self._struct),
            C.byref(shape),
            (C.c_double * 3)(*start),
            places.ctypes.data,
            len(places),
            met.ctypes.data,
            traverses,
        )
        return met

    def is_clear(self, tool, clearance, start, end):
        """Whether a traverse of a Shape from start to end (3,) keeps a clearance (mm) from stock at its side; straight
        up it does."""
        shape = tool.struct()
        return (
            self._functions.chip_traverse_clearance(
                C.byref(self._struct), C.byref(shape), clearance, (C.c_double * 3)(*start), (C.c_double * 3)(*end)
            )
            >= clearance
        )

    def lowest_over(self, tool, start, end, ahead=None, clearance=0.0):
        """The lowest tip (mm) of layout.DropTool `tool` on a level segment start to end (2,) that keeps off the stock
        by a cell, and its side by a clearance (mm).  ahead: a point and a unit vector (4,); only stock that is ahead of
        the point counts."""
        return self._functions.chip_drop_over_stock(
            C.byref(self._struct),
            C.byref(tool),
            (C.c_double * 2)(*start),
            (C.c_double * 2)(*end),
            None if ahead is None else (C.c_double * 4)(*ahead),
            clearance,
        )

    def needed(self, tool, start, end, least):
        """Which of n steps of a path, start (n, 3) to end (n, 3), layout.DropTool `tool` has to cut so that no needle
        stays more than `least` (mm) higher than the whole path leaves it -> (n,) bool.  A step is not longer than a
        cell.  Nothing is cut."""
        start, end = (np.ascontiguousarray(v, np.float64) for v in (start, end))
        if self._room is None:
            self._room = np.full(self.height.shape, layout.NEED_NONE, np.float32), np.zeros(self.height.shape, np.int32)
        found = np.zeros(len(start), np.uint8)
        self._functions.chip_stock_need(
            C.byref(self._struct),
            C.byref(tool),
            len(start),
            start.ctypes.data,
            end.ctypes.data,
            least,
            self._room[0].ctypes.data,
            self._room[1].ctypes.data,
            found.ctypes.data,
        )
        return found.astype(bool)

    def volume(self):
        """mm3 of stock."""
        return float((self.height.astype(np.float64) - self.z_min).sum()) * self.cell**2

    def picture(self, most):
        """Heights on a coarser grid of at most `most` by `most` -> (rows, columns) float32: the highest needle of each
        field."""
        step = max(1, math.ceil(max(self.nx, self.ny) / most))
        rows, columns = math.ceil(self.ny / step), math.ceil(self.nx / step)
        result = np.empty((rows, columns), np.float32)
        starts = np.arange(0, self.nx, step)
        for row in range(rows):
            result[row] = np.maximum.reduceat(self.height[row * step : (row + 1) * step].max(axis=0), starts)
        return result


def times(length, max_speed, accel, corner, speed):
    """(seconds of each move, speed at the end): chip_height_times of height_sweep.h."""
    arrays = [np.ascontiguousarray(a, np.float64) for a in (length, max_speed, accel, corner)]
    ends, seconds, now = np.empty(len(length)), np.empty(len(length)), C.c_double(speed)
    library().chip_height_times(
        len(length), *(a.ctypes.data for a in arrays), ends.ctypes.data, C.byref(now), seconds.ctypes.data
    )
    return seconds, now.value
