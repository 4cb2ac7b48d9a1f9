# SPDX-License-Identifier: GPL-2.0-or-later
"""Which move has cut a place as deep as it is in the end: the program once more, over one needle.  Called by
part_simulation.py."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from chipwise.check.simulate import Simulation
from chipwise.clib.height_map import BOX

if TYPE_CHECKING:
    from chipwise.check.result import Result
    from chipwise.check.simulate import Case
    from chipwise.clib.arrays import Floats, Ints
    from chipwise.clib.height_map import HeightMap, Shape

CELL_MM, AROUND_MM = 0.1, 0.2  # of the map, and how far it goes around the needle
SAME_MM = 2e-3  # of a height
WIDER_MM = 0.01  # of the tool's radius: the place is that of a needle at the rim of the cut, to the model's rounding


class Culprit(Simulation):
    """A program under way.  place: (x, y, z) mm, machine coordinates, z as it is left; stock: number of the stock;
    found: (line, number of the tool), None if no move was found."""

    def __init__(self, place: Sequence[float], stock: int, case: Case) -> None:
        super().__init__(replace(case, job=None), CELL_MM)
        self._place, self._stock, self._level = np.array([place[:2]]), stock, place[2] + SAME_MM
        self.found: tuple[int, int] | None = None

    def _define(self, line: int, values: list[float]) -> None:
        x, y = self._place[0]
        super()._define(
            line, [float(BOX), 0.0, x - AROUND_MM, y - AROUND_MM, values[4], x + AROUND_MM, y + AROUND_MM, values[7]]
        )
        self.drawn.stock.add_needles(self._place)

    def _segments(self, block: Floats) -> Iterator[Floats]:
        yield block

    def _take_moves(self, block: Floats, stops: bool) -> None:
        self._cut(block[:, 2:5], block[:, 1].astype(int), block[:, 0].astype(int), np.zeros(len(block)))
        self.position = block[-1, 2:5].copy()

    def _cut(self, positions: Floats, lines: Ints, kinds: Ints, length: Floats) -> None:
        stock, tool, shape = self.map, self.tool, self.shape
        if stock is None or tool is None or shape is None or self.blind or self.found:
            return
        before, wider = stock.needle_height.copy(), replace(shape, diameter=shape.diameter + 2 * WIDER_MM)
        if self.stock_number != self._stock or before[0] <= self._level:
            return
        if self._left(stock, wider, before, positions) > self._level:
            return
        low, high = 0, len(positions)  # of moves: not yet, and deep enough
        while high - low > 1:
            middle = (low + high) // 2
            is_deep = self._left(stock, wider, before, positions[:middle]) <= self._level
            low, high = (low, middle) if is_deep else (middle, high)
        self.found = int(lines[high - 1]), tool.number

    def _left(self, stock: HeightMap, wider: Shape, before: Floats, positions: Floats) -> float:
        """Height of the needle behind moves, mm; before: what it was."""
        stock.needle_height[:] = before
        stock.cut(wider, self.position, positions)
        return float(stock.needle_height[0])

    def finish(self, messages: list[list[int | str]], notes: list[list[int | str]]) -> Result:
        """-> the Result, which is empty: what counts is `found`."""
        return self.result
