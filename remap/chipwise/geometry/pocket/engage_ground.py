# SPDX-License-Identifier: GPL-2.0-or-later
"""Ground that a tool has cleared in a region, and paths of constant engagement through it: components/offline/engage*.c
from Python.

Called by geometry/pocket/engage*.py.  Lengths mm, angles rad.  Poses are rows x, y, heading.
"""

from __future__ import annotations

import ctypes as C
import math

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import Elements
from chipwise.clib import layout
from chipwise.clib.library import library

# Size of the squares of the grid, in tool radii.
SQUARE = 0.25

# Rows that a path may have at first; it is asked for again with more.
MOST = 20000

COLUMNS = int(layout.ENGAGE_COLUMNS)
_ROW = C.c_double * COLUMNS

# What cleared ground is asked smaller by, in tool radii, as the C has it.
SLACK = 0.0005


def rows_of(e: Elements) -> np.ndarray:
    """Elements -> (n, 7) as the C functions take them."""
    return np.ascontiguousarray(np.column_stack((e.start, e.end, e.centre, e.sweep)))


def elements_of(rows: np.ndarray) -> Elements:
    """(n, 7) of the C functions -> Elements."""
    start, end, centre, sweep = rows[:, 0:2], rows[:, 2:4], rows[:, 4:6], rows[:, 6]
    arc = sweep != 0.0
    return elements.make_arcs(
        start, end, np.where(arc[:, None], centre, 0.0), np.where(arc, np.hypot(*(start - centre).T), 0.0), sweep
    )


def fitted(pose: np.ndarray, within: float) -> Elements:
    """As few lines and arcs, tangent to one another, as stay within `within` of poses (n, 3)."""
    pose = np.ascontiguousarray(pose, float)
    found = np.empty((max(2 * len(pose), 1), COLUMNS))
    count = library().chip_engage_fit(len(pose), pose.ctypes.data, within, found.ctypes.data)
    return elements_of(found[:count])


def patches(wanted: np.ndarray) -> list[np.ndarray]:
    """[indices (n, 2)] of the places of a raster (columns, rows) bool that hang together by a side or a corner, each in
    the order of the raster."""
    asked = np.ascontiguousarray(wanted, np.uint8)
    label, waiting = np.empty((2, *asked.shape), np.int32)
    count = library().chip_engage_patches(*asked.shape, asked.ctypes.data, label.ctypes.data, waiting.ctypes.data)
    place = np.argwhere(label)
    order = np.argsort(label[label > 0], kind="stable")
    ends = np.searchsorted(label[label > 0][order], np.arange(1, count + 1), "right")
    return np.split(place[order], ends[:-1]) if count else []


class Ground:
    """The ground of a region of tool centres (closed contours that have it on their left)."""

    def __init__(self, contours, radius: float, size: float = 0.0):
        """size: of the squares of the grid; 0: a share of the radius."""
        rows = np.ascontiguousarray(np.concatenate([rows_of(e) for e in contours]))
        after, first = [], 0
        for contour in contours:
            after += [first + (k + 1) % len(contour) for k in range(len(contour))]
            first += len(contour)
        following = np.array(after, np.int64)
        self.radius, self._lib = radius, library()
        self.grown = 0  # times that something was cleared
        self._handle = self._lib.chip_engage_open(
            len(rows), rows.ctypes.data, following.ctypes.data, radius, size or SQUARE * radius
        )
        if not self._handle:
            raise MemoryError

    def close(self) -> None:
        """Give the memory back."""
        handle, self._handle = self._handle, None
        if handle:
            self._lib.chip_engage_close(handle)

    def __del__(self):
        self.close()

    def _sound(self) -> None:
        if self._lib.chip_engage_failed(self._handle):
            raise MemoryError

    def depth(self, point: np.ndarray) -> np.ndarray:
        """Distance (n,) of points (n, 2) from the border of the region, positive within it."""
        point = np.ascontiguousarray(point, float)
        found = np.empty(len(point))
        self._lib.chip_engage_depth(self._handle, len(point), point.ctypes.data, found.ctypes.data)
        self._sound()
        return found

    def clear(self, e: Elements) -> None:
        """The tool runs along a chain."""
        self.grown += 1
        rows = rows_of(e)
        self._lib.chip_engage_clear(self._handle, len(rows), rows.ctypes.data)
        self._sound()

    def rim(self, point: np.ndarray, less: float) -> np.ndarray:
        """Which (n,) bool of points (n, 2) have the circle of the radius, less by `less`, on cleared ground all
        around."""
        point = np.ascontiguousarray(point, float)
        found = np.empty(len(point), np.uint8)
        self._lib.chip_engage_rim(self._handle, len(point), point.ctypes.data, less, found.ctypes.data)
        return found.astype(bool)

    def swept(self, e: Elements, more: float, fine: float) -> bool:
        """Whether all that the tool, with a radius larger by `more`, sweeps along a chain is cleared."""
        rows = rows_of(e)
        return bool(self._lib.chip_engage_swept(self._handle, len(rows), rows.ctypes.data, more, fine))

    def swept_line(self, a, b, more: float, fine: float) -> bool:
        """The same along a line between two places, or at one."""
        row = _ROW(a[0], a[1], b[0], b[1], 0.0, 0.0, 0.0)
        return bool(self._lib.chip_engage_swept(self._handle, 1, row, more, fine))

    def inside(self, rows: np.ndarray, slack: float, stride: float) -> bool:
        """Whether elements (n, 7) stay in the region, but for `slack`; asked every `stride` beside its border."""
        found = self._lib.chip_engage_inside(self._handle, len(rows), rows.ctypes.data, slack, stride)
        self._sound()
        return bool(found)

    def passes(self, row: tuple, slack: float, stride: float, more: float, fine: float) -> bool:
        """inside() and swept() of one element, 7 numbers."""
        given = _ROW(*row)
        return bool(
            self._lib.chip_engage_inside(self._handle, 1, given, slack, stride)
            and self._lib.chip_engage_swept(self._handle, 1, given, more, fine)
        )

    def left(self, fine: float) -> tuple[float, np.ndarray]:
        """(mm2 of what the tool reaches and has not cleared, a place (2,) of it)."""
        place = (C.c_double * 2)()
        area = self._lib.chip_engage_left(self._handle, fine, place)
        self._sound()
        return float(area), np.array(place)

    def along(self, e: Elements, spacing: float) -> np.ndarray:
        """(n, 4) x, y, heading and engagement at most `spacing` apart along a chain, which is cleared meanwhile."""
        self.grown += 1
        rows = rows_of(e)
        found = np.empty((int(elements.lengths(e).sum() / spacing) + len(e) + 1, 4))
        count = self._lib.chip_engage_along(
            self._handle, len(rows), rows.ctypes.data, spacing, found.ctypes.data, len(found)
        )
        self._sound()
        return found[:count]

    def trace(self, pose, rule: layout.EngageRule, commit: bool, most: int = MOST) -> tuple[np.ndarray, int]:
        """((n, 4) x, y, heading, engagement of a path of constant engagement from a pose, why it ended)."""
        self.grown += bool(commit)
        found, why = np.empty((most, 4)), C.c_int(0)
        count = self._lib.chip_engage_trace(
            self._handle, (C.c_double * 3)(*pose), C.byref(rule), commit, found.ctypes.data, most, C.byref(why)
        )
        self._sound()
        return found[:count].copy(), why.value


def rule(angle, rho, inset, step, air, escape=0.06) -> layout.EngageRule:
    """What a trace keeps to, as engage.h describes it."""
    return layout.EngageRule(angle=angle, escape=escape, rho=rho, inset=inset, step=step, air=air)


def slack(radius: float) -> float:
    """What the rim is asked smaller by, so that a tool in its own slot counts as on cleared ground. mm"""
    return 2.2 * SLACK * radius


def turn_of(a: float, b: float) -> float:
    """From one heading to another."""
    return math.remainder(b - a, 2.0 * math.pi)
