# SPDX-License-Identifier: GPL-2.0-or-later
"""Which move has cut a place as deep as it is in the end: the program once more, over one needle.  Called by
part_simulation.py."""

from dataclasses import replace

import numpy as np

from chipwise.check.simulate import Simulation
from chipwise.clib.height_map import BOX

CELL_MM, AROUND_MM = 0.1, 0.2  # of the map, and how far it goes around the needle
SAME_MM = 2e-3  # of a height
WIDER_MM = 0.01  # of the tool's radius: the place is that of a needle at the rim of the cut, to the model's rounding


class Culprit(Simulation):
    """A program under way.  place: (x, y, z) mm, machine coordinates, z as it is left; stock: number of the stock."""

    def __init__(self, place, stock, program, machine, settings, tools, assumption):
        super().__init__(program, machine, CELL_MM, settings, tools, None, assumption)
        self._place, self._stock, self._level, self._found = np.array([place[:2]]), stock, place[2] + SAME_MM, None

    def _define(self, line, values):
        x, y = self._place[0]
        super()._define(
            line, [float(BOX), 0.0, x - AROUND_MM, y - AROUND_MM, values[4], x + AROUND_MM, y + AROUND_MM, values[7]]
        )
        self.map.add_needles(self._place)

    def _segments(self, block):
        yield block

    def _take_moves(self, block, stops):
        self._cut(block[:, 2:5], block[:, 1].astype(int), block[:, 0].astype(int), None)
        self.position = block[-1, 2:5].copy()

    def _cut(self, positions, lines, kinds, length):
        if self.map is None or self.shape is None or self.blind or self._found:
            return
        before = self.map.needle_height.copy()
        if self.stock_number != self._stock or before[0] <= self._level or self._left(before, positions) > self._level:
            return
        low, high = 0, len(positions)  # of moves: not yet, and deep enough
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if self._left(before, positions[:middle]) <= self._level else (middle, high)
        self._found = int(lines[high - 1]), self.tool.number

    def _left(self, before, positions):
        """Height of the needle behind moves, mm; before: what it was."""
        self.map.needle_height[:] = before
        self.map.cut(replace(self.shape, diameter=self.shape.diameter + 2 * WIDER_MM), self.position, positions)
        return float(self.map.needle_height[0])

    def finish(self, _messages, _notes):
        """-> (line, number of the tool), None if no move was found."""
        return self._found
