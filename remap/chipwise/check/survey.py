# SPDX-License-Identifier: GPL-2.0-or-later
"""Where a program goes, without a stock: extents of its feed moves by tool, its times.

Called by assume.py with the records of program/reader.py, block by block.  mm; extents are in the work coordinates that
are in force at the first feed move: a post may go to machine zero before it chooses them.  Times are those of
check/times.py.

The place of the machine before the first move is not known, and no move from there is counted.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from chipwise.check import rules
from chipwise.program import records
from chipwise.check.path_part import PathPart
from chipwise.check.result import ToolFigures
from chipwise.check.times import Timer

if TYPE_CHECKING:
    from chipwise.clib.arrays import Floats
    from chipwise.program.reader import Machine

ACROSS_MM = 1e-4  # shorter moves, seen from above, go straight up or down
LEVEL_MM = 1e-6  # heights that are the same


class Box:
    """Corners of what has been added, (2, 3) mm; empty at first."""

    def __init__(self) -> None:
        self.low, self.high = np.full(3, np.inf), np.full(3, -np.inf)

    def __bool__(self) -> bool:
        return bool(self.low[0] <= self.high[0])

    def add(self, *points: Floats) -> None:
        """Arrays (n, 3)."""
        for array in points:
            if len(array):
                self.low, self.high = np.minimum(self.low, array.min(axis=0)), np.maximum(self.high, array.max(axis=0))

    def join(self, other: Box) -> None:
        """Another box."""
        self.low, self.high = np.minimum(self.low, other.low), np.maximum(self.high, other.high)


class ToolPath:
    """The feed moves of one tool."""

    def __init__(self, number: int, diameter: float) -> None:
        self.figures = ToolFigures(number, diameter)
        self.all = Box()
        self.below_zero = Box()  # the parts of moves that lie below Z0
        self.below_top = Box()  # moves that begin or end below the highest place of a move across
        self.at_top = Box()  # the other ones at that height


class Survey:
    """A program under way: take() each block of records."""

    def __init__(self, machine: Machine) -> None:
        self.timer = Timer(machine)
        self.tools: dict[int, ToolPath] = {}  # by number; of those with feed moves
        self.spindle = 0, 0.0
        self.frame = records.Frame()  # of the first feed move
        self.first_frame: records.Frame | None = None  # of the first move
        self.position: Floats | None = None  # (3,), machine
        self.lowest = np.inf  # Z of feed moves
        self.top = -np.inf  # the highest end of a feed move across
        self.highest = -np.inf  # Z of any move, machine coordinates
        self.has_stock = False
        self.carries_stock = False  # reader.Reader's; set by who reads
        self.dwell_s, self.tool_changes = 0.0, 0
        self.place_known, self.unplaced = False, rules.Unplaced()

    def take(self, block: Floats) -> None:
        """One block of records."""
        rules.check_finite(block)
        for part in rules.parts(block):
            if isinstance(part, rules.Other):
                self._event(*part)
            else:
                self._moves(*part)

    def _event(self, kind: int, _line: int, values: list[float]) -> None:
        if kind == records.TOOL:
            self.spindle = max(0, int(values[0])), float(values[1])
            self.tool_changes += values[0] > 0
        elif kind == records.STOCK:
            self.has_stock = True
        elif kind == records.DWELL:
            self.dwell_s += values[0]
            self.timer.wait(values[0])
        elif kind == records.PATH:
            self.timer.path = values[0]
        elif kind == records.FRAME and not self.tools:
            self.frame = records.Frame.of(values)

    def _moves(self, block: Floats, stops: bool) -> None:
        rules.check_positions(block)
        self.first_frame = self.first_frame or self.frame
        kinds, places = block[:, 0].astype(int), block[:, 2:5]
        known, apart = self.position is not None, 0
        start = places[0] if self.position is None else self.position
        if not self.place_known:
            apart, self.place_known = rules.moves_to_first_place(kinds, places, self.frame)
        before = np.concatenate((start[None], places[:-1]))
        self.position = places[-1].copy()
        steps = places - before
        length = np.sqrt((steps * steps).sum(axis=1))
        cuts = (kinds != records.RAPID) & (length > 0)
        tool = self._tool() if cuts.any() else None
        moving = length > 1e-9
        moving[:apart] = False
        if moving.any():
            self.timer.spend(
                PathPart.of(block, steps, length, np.zeros(len(length)), moving), tool.figures if tool else None, stops
            )
        self.highest = max(
            self.highest,
            float(
                places[int(not known and kinds[0] == records.RAPID and abs(places[0, 2]) < 1e-9) :, 2].max(
                    initial=-np.inf
                )
            ),
        )
        cuts[: self.unplaced.lead(block, -np.inf)] = False
        if tool and cuts.any():
            self._feeds(tool, self._work(before[cuts]), self._work(places[cuts]))

    def _tool(self) -> ToolPath:
        number, diameter = self.spindle
        if number not in self.tools:
            self.tools[number] = ToolPath(number, diameter)
        return self.tools[number]

    def _work(self, places: Floats) -> Floats:
        """(n, 3) machine -> work coordinates of the first feed move."""
        return np.column_stack(self.frame.to_work(places.T))

    def _feeds(self, tool: ToolPath, start: Floats, end: Floats) -> None:
        """Feed moves from start to end, (n, 3) mm."""
        tool.all.add(start, end)
        self.lowest = min(self.lowest, float(start[:, 2].min()), float(end[:, 2].min()))
        tool.below_zero.add(*_below(start, end, 0.0))
        across = np.hypot(*(end - start)[:, :2].T) > ACROSS_MM
        if across.any():
            top = float(max(start[across, 2].max(), end[across, 2].max()))
            if top > self.top + LEVEL_MM:
                self.top = top
                for other in self.tools.values():
                    other.below_top.join(other.at_top)
                    other.at_top = Box()
        low = np.minimum(start[:, 2], end[:, 2]) < self.top - LEVEL_MM
        tool.below_top.add(*_below(start[low], end[low], self.top))
        tool.at_top.add(start[~low & across], end[~low & across])

    def is_above(self, level: float) -> bool:
        """Whether a move ends above a height, work coordinates."""
        return self.highest - self.frame.offset[2] - self.frame.g92[2] > level

    def at_first_move(self, low: Sequence[float], high: Sequence[float]) -> tuple[Iterable[float], Iterable[float]]:
        """Corners of a box in the work coordinates of the first move; where those are turned against the others, of the
        box around it.  A zero that is probed before the first cut carries a stock that is named in them."""
        frame, first = self.frame, self.first_frame
        if first is None or frame == first or self.carries_stock:
            return low, high
        corners = np.array(
            [
                first.to_work(frame.to_machine((x, y, z)))
                for x in (low[0], high[0])
                for y in (low[1], high[1])
                for z in (low[2], high[2])
            ]
        )
        return corners.min(axis=0), corners.max(axis=0)

    def extents(self) -> Box:
        """Box of all feed moves of the tools' tips."""
        box = Box()
        for tool in self.tools.values():
            box.join(tool.all)
        return box


def _below(start: Floats, end: Floats, level: float) -> tuple[Floats, Floats]:
    """The parts of moves (n, 3) that lie below a level: their starts and ends, (m, 3) each."""
    low = np.minimum(start[:, 2], end[:, 2]) < level - LEVEL_MM
    start, end = start[low], end[low]
    rise = end[:, 2] - start[:, 2]
    share = np.clip((level - start[:, 2]) / np.where(rise == 0, 1.0, rise), 0.0, 1.0)
    cross = start + share[:, None] * (end - start)
    return np.where((start[:, 2] > level)[:, None], cross, start), np.where((end[:, 2] > level)[:, None], cross, end)
