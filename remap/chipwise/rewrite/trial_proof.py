# SPDX-License-Identifier: GPL-2.0-or-later
"""Depths, proved, of a path that is still sought: components/offline/depth_proof.c [6] from Python.

Called by flute.py, levels.py and trials.py.  depth_proof.py proves the whole program at the end, whatever was found
here.  Lengths mm, machine coordinates of the tool's tip.
"""

from __future__ import annotations

import ctypes as C
import weakref
from typing import TYPE_CHECKING, Callable, Sequence

import numpy as np

from chipwise.rewrite import depth_proof, sections
from chipwise.clib import layout
from chipwise.clib.library import library

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats, Ints, Records
    from chipwise.clib.height_map import HeightMap

ROOM = 100_000  # witnesses of one path
SQUARES = 20_000_000  # looked at for one path: seconds; beyond, nothing is sought in this stock any more
ALLOWED_MM = (
    0.004  # deeper than the flutes are long: check reports 0.005, and may read a little more of what is written
)
OVER_STOCK_MM = 1.0  # where a tool comes down from


class Sought:
    """The moves of the new program in one HeightMap with some of cutting.Tools, as far as they are known.

    expected: () -> a depths.Path of moves with these tools that none to come will be lower than, or None.
    """

    _found: Records

    def __init__(
        self, stock: HeightMap, tools: list[sections.Tool], expected: Callable[[], depth_proof.Path] | None = None
    ) -> None:
        limits = [tool.flutes + ALLOWED_MM for tool in tools]
        self._stock, self._tools, self._table = stock, tools, depth_proof.table_of(tools, limits)
        self._waiting: list[tuple[int, Floats, Floats]] = []
        self._handle: int | None = None
        self._expected = expected
        self.is_off = False

    def follow(self, tool: sections.Tool, start: Floats, ends: Floats) -> None:
        """Moves from start (3,) along ends (n, 3) that stay as they are: cut as soon as a path is asked about."""
        if len(ends) and not self.is_off:
            self._waiting.append((self._tools.index(tool), np.asarray(start, float), np.asarray(ends, float)))

    def too_deep(self, tool: sections.Tool, places: Floats, asked: bool | Bools = True) -> Records:
        """FOUND records of what moves along places (n, 3) meet too deep, behind all that is kept; they take the place
        of those asked about before.  The tool comes down at the first place.  asked (n - 1,) bool: which of the moves
        are asked for."""
        if self.is_off:
            return np.zeros(0, depth_proof.FOUND)
        if self._handle is None:
            self._open()
        library().chip_proof_back(self._handle)
        if self._waiting:
            for index, start, ends in self._waiting:
                self._add(depth_proof.not_judged(index), start, ends)
            self._waiting = []
            self.keep()
        own, above = self._tools.index(tool), [*places[0, :2], max(self._stock.z_max, places[0, 2]) + OVER_STOCK_MM]
        self._add(depth_proof.not_judged(own), above, places[:1])
        return self._add(np.where(asked, own, depth_proof.not_judged(own)), places[0], places[1:])

    def keep(self) -> None:
        """The moves that were asked about last stay."""
        if not self.is_off and library().chip_proof_mark(self._handle) < 0:
            raise MemoryError

    def _open(self) -> None:
        self._handle = library().chip_proof_open(
            C.byref(depth_proof.shape_of(self._stock)),
            self._table.ctypes.data,
            len(self._table),
            depth_proof.cell_of(self._stock, self._table),
        )
        if not self._handle:
            raise MemoryError
        weakref.finalize(self, library().chip_proof_close, self._handle)
        if self._expected:
            path = self._expected()
            if library().chip_proof_expect(self._handle, C.byref(path.struct())) < 0:
                raise MemoryError
        self._found = np.zeros(ROOM, depth_proof.FOUND)
        self.keep()

    def _add(self, index: int | Ints, start: Sequence[float] | Floats, ends: Floats) -> Records:
        start, to = np.ascontiguousarray(start, np.float64), np.ascontiguousarray(ends, np.float64)
        tool, squares = np.full(len(to), index, np.int32), C.c_int64(SQUARES)
        path = layout.ProofPath(start.ctypes.data, to.ctypes.data, tool.ctypes.data, len(to))
        count = library().chip_proof_add(
            self._handle, C.byref(path), C.addressof(squares), self._found.ctypes.data, ROOM
        )
        if count < 0:
            raise MemoryError
        self.is_off = squares.value <= 0
        return self._found[:count]
