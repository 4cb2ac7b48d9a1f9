# SPDX-License-Identifier: GPL-2.0-or-later
"""The clamps that the realtime guard keeps the tool from: the table behind the path done, in the memory of the stock
map (components/core/clamp.h).

Called by monitor/clamps_in_force.py, through SharedStock.clamp_table().  There is one writer.  The generation is odd
while it writes, so that the tracker takes the table over as a whole or not at all.
"""

import ctypes as C
import math

from chipwise.clib import layout
from chipwise.stock.shape_comment import BOX, CYLINDER

TAKEN_MASK = 0x7FFFFFFF  # of stock-tracker.N.clamps-taken


class ClampTable:
    """`memory`: writable buffer with the map; start: bytes in front of struct chip_clamp_table."""

    def __init__(self, memory, start):
        self._table = layout.ClampTable.from_buffer(memory, start)

    def put(self, clamps, clearance):
        """Clamps (clamps/clamp.py, at most layout.CLAMPS) and mm -> what clamps-taken shows when they are in force."""
        table = self._table
        table.generation |= 1  # a writer that was killed may have left it odd
        table.count, table.clearance = len(clamps), clearance
        for row, clamp in zip(table.clamp, clamps):
            row.x, row.y = clamp.middle
            row.half_x, row.half_y = (clamp.high[0] - clamp.low[0]) / 2, (clamp.high[1] - clamp.low[1]) / 2
            row.cosine, row.sine = math.cos(math.radians(clamp.turn)), math.sin(math.radians(clamp.turn))
            row.top, row.is_round = clamp.top, int(clamp.shape == CYLINDER)
        table.generation += 1
        return table.generation // 2 & TAKEN_MASK

    def rows(self):
        """rows() of what is in it."""
        return rows(self._table)

    def close(self):
        """Give the memory back."""
        self._table = None


def rows(table):
    """[(shape, turn in degrees, (x, y) of its middle, (half_x, half_y), top)] mm, machine coordinates, of a
    layout.ClampTable."""
    return [
        (
            CYLINDER if row.is_round else BOX,
            math.degrees(math.atan2(row.sine, row.cosine)),
            (row.x, row.y),
            (row.half_x, row.half_y),
            row.top,
        )
        for row in table.clamp[: min(table.count, layout.CLAMPS)]
    ]


SIZE = C.sizeof(layout.ClampTable)
