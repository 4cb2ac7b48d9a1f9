# SPDX-License-Identifier: GPL-2.0-or-later
"""An assumed stock that goes on with the next program though that one assumes a larger box: one file a tool is the
habit.

Called by monitor/shadow.py.  Both boxes belong to one work offset, so both are turned alike.  mm, machine coordinates.

A place that may have material has it:
 1. The stock is the box around both.  What neither file has cut is whole, up to the higher of the two tops.
 2. A place that has been cut keeps its height, also where it was cut through: the part below the bottom of then is
    there.
 3. An uncut place that was lower than the top of now is as high as that.
 4. Cells keep their side and their places, so that walls stay where they are; if the map has no room for that, a larger
    cell is as high as the highest of those that it touches.
"""

import math

import numpy as np

from chipwise.clib import layout
from chipwise.clib.core import CellSides, Stock

LEVEL_MM = 1e-3  # heights that are the same; a map has single precision
SLIVER = 1e-3  # of a cell that is within the box: none of it
WHOLE = 0.98  # of the stock in a cell of the outline: all of it


def turned(point, turn):
    """(x, y) turned about zero by turn (rad)."""
    c, s = math.cos(turn), math.sin(turn)
    return point[0] * c - point[1] * s, point[0] * s + point[1] * c


def around(one, other, turn):
    """(low, high) of the box around two, each (low, high) of an upright box that is turned about its own middle."""
    flat = [_moved(box, -turn) for box in (one, other)]
    return _moved((tuple(map(min, flat[0][0], flat[1][0])), tuple(map(max, flat[0][1], flat[1][1]))), turn)


def _moved(box, turn):
    """A box with its middle turned about zero."""
    low, high = box
    middle = turned([(a + b) / 2 for a, b in zip(low[:2], high[:2])], turn)
    half = [(b - a) / 2 for a, b in zip(low[:2], high[:2])]
    return (*(m - h for m, h in zip(middle, half)), low[2]), (*(m + h for m, h in zip(middle, half)), high[2])


def join(head, cells, box, turn, room):
    """core.Stock of the box (low, high) that lies around the stock of `head` and `cells` (SharedStock.take()).  room:
    (finest, coarsest, capacity) of the map.  Raises CoreError if there is no room for it."""
    finest, coarsest, capacity = room
    if not turn:
        low = [
            edge - head.cell * math.ceil((edge - corner) / head.cell - 1e-6)
            for corner, edge in zip(box[0][:2], head.low[:2])
        ]
        count = [math.ceil((corner - edge) / head.cell - 1e-9) + 2 for corner, edge in zip(box[1][:2], low)]
        if count[0] * count[1] <= capacity:
            stock = Stock((*low, box[0][2]), box[1], head.cell, capacity)
            _keep(stock, head, cells)
            return stock
    stock = Stock(box[0], box[1], CellSides(coarsest, finest), capacity, turn=turn)
    _spread(stock, head, cells)
    return stock


def _inside(head):
    """(rows, columns) of the cells of a stock that is not turned which have a part of its box; beyond, a cell is empty
    as one that was cut through is."""
    return tuple(math.ceil((head.high[k] - head.low[k]) / head.cell - SLIVER) for k in (1, 0))


def _levels(head, cells):
    """Of cells with their share of the box: (top, height of the cut part, its share of the cell), mm; an uncut one has
    the share 0."""
    top, cut, drop = cells["top"].astype(float), cells["cut"].astype(int), cells["drop"].astype(int)
    unit = (head.high[2] - head.low[2]) / layout.DROP_FULL
    rim, two = drop & layout.RIM != 0, drop & (layout.RIM | layout.RIM_TWO) == layout.RIM | layout.RIM_TWO
    gone = np.where(two, (cut >> 5) / layout.RIM_GONE, cut / layout.FULL)
    share_of_rim = np.where(two, (drop >> 10 & 15) | (cut & 31) << 4, 0) / layout.RIM_CUT
    rim_low = top - (drop & layout.RIM_DROP) / layout.RIM_DROP * (head.high[2] - head.low[2])
    lowered = rim & ~two & (top < head.high[2] - LEVEL_MM)
    low = np.where(rim, np.where(lowered, top, rim_low), top - drop * unit)
    share = np.where(rim, np.where(lowered | (two & (share_of_rim > WHOLE)), 1 - gone, 0.0), cut / layout.FULL)
    return np.where(rim, head.high[2], top), low, share


def _keep(stock, head, cells):
    """The old cells at their places among new ones of the same side."""
    new, (rows, columns) = stock.head, _inside(head)
    there = cells[1 : rows + 1, 1 : columns + 1]
    column, row = round((head.low[0] - new.x0) / head.cell), round((head.low[1] - new.y0) / head.cell)
    part = stock.cells[row : row + rows, column : column + columns]
    there = there[: part.shape[0], : part.shape[1]]
    top, low, share = _levels(head, there)
    top = np.where(top >= head.high[2] - LEVEL_MM, new.z_max, top)
    drop = np.floor((top - low) / new.drop_unit + 1e-9).clip(0, layout.DROP_FULL).astype(int)
    share = np.floor(share * layout.FULL).astype(int)
    whole = share >= layout.FULL - 1
    edge = (
        (part["drop"] == layout.RIM)
        & (there["drop"] == layout.RIM)
        & (np.abs(part["cut"].astype(int) - there["cut"].astype(int)) <= 2)
    )
    part["top"] = np.where(
        edge, np.where(there["top"] >= head.high[2] - LEVEL_MM, new.z_max, there["top"]), part["top"]
    )
    plain = part["drop"] & layout.RIM == 0  # other cells on the new outline stay uncut
    part["top"] = np.where(plain, np.where(whole, low, top), part["top"])
    both = plain & ~whole & (share > 0) & (drop > 0)
    part["drop"], part["cut"] = (
        np.where(plain, np.where(both, drop, 0), part["drop"]),
        np.where(plain, np.where(both, share, 0), part["cut"]),
    )


def _spread(stock, head, cells):
    """Cells of another side: each as high as the highest of the old ones that it touches, whole where it touches the
    outline of the old stock or what lies beyond."""
    new = stock.head
    high = cells["top"].astype(float)
    high[cells["drop"] & layout.RIM != 0] = new.z_max
    rows, columns = _inside(head)
    high[[0, -1], :] = high[:, [0, -1]] = high[rows + 1 :, :] = high[:, columns + 1 :] = new.z_max
    high[high >= head.high[2] - LEVEL_MM] = new.z_max
    if head.turn:
        x, y = (low + (np.arange(n + 2) - 0.5) * head.cell for low, n in zip(head.low[:2], (head.nx, head.ny)))
        middle = [(a + b) / 2 for a, b in zip(head.low[:2], head.high[:2])]
        c, s = math.cos(head.turn), math.sin(head.turn)
        across, along = x[None, :] - middle[0], y[:, None] - middle[1]
        inside = (np.abs(across * c + along * s) < head.half[0] - head.cell) & (
            np.abs(along * c - across * s) < head.half[1] - head.cell
        )
        high[~inside] = new.z_max
    columns, rows = (
        _touched(first, n, new.cell, low, head.cell, count)
        for first, n, low, count in ((new.x0, new.nx, head.low[0], head.nx), (new.y0, new.ny, head.low[1], head.ny))
    )
    part, found = stock.cells, np.full((new.ny, new.nx), -np.inf)
    for i in range(rows.shape[1]):
        for j in range(columns.shape[1]):
            np.maximum(found, high[np.ix_(rows[:, i], columns[:, j])], out=found)
    plain = part["drop"] & layout.RIM == 0
    part["top"] = np.where(plain, found, part["top"])


def _touched(first, n, cell, low, old_cell, count):
    """(n, k) indices, ring included, of the old cells that each of n new cells touches along an axis."""
    start = np.floor((first + np.arange(n) * cell - low) / old_cell + 1e-9).astype(int)
    k = math.ceil(cell / old_cell) + 1
    return (start[:, None] + np.arange(k)[None, :] + 1).clip(0, count + 1)
