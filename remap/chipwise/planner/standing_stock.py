# SPDX-License-Identifier: GPL-2.0-or-later
"""The map of the stock tracker as a pocket starts from it.  Called by planner/plans.py.

The machine is at rest meanwhile (glue/pocket.py waits for that), so the map is of one moment.  Where it cannot be
read, the cycle starts from solid stock, as in the preview.
"""

from __future__ import annotations

import math
from typing import Optional

import numpy as np

from chipwise.cycles.standing import Standing
from chipwise.order import MapPlace
from chipwise.stock.mapped import SharedStockError
from chipwise.stock.shared import of_key


def standing(place: MapPlace, loops: tuple, radius: float) -> Optional[Standing]:
    """The Standing under loops of parts, None where no stock can be read."""
    try:
        stock = of_key(place.key)
        try:
            taken = stock.take()
        finally:
            stock.close()
    except SharedStockError:
        return None
    if taken is None:
        return None
    head, cells = taken
    low, high = _box(loops)
    return of_cells(head, cells, place).within(low, high, radius)


def of_cells(head, cells, place: MapPlace) -> Standing:
    """The Standing of a store.Head and its cells, ring included."""
    tops = np.ascontiguousarray(cells["top"][1:-1, 1:-1], np.float32)
    return Standing(
        tuple(head.low[:2]), head.cell, tops.shape[0], tops.shape[1], tops.tobytes(), place.origin, place.turn
    )


def _box(loops: tuple) -> tuple:
    """((x, y), (x, y)) around loops of parts, or more."""
    points = []
    for part in (part for loop in loops for part in loop):
        points += [part.start, part.end]
        centre = getattr(part, "centre", None)
        if centre is not None:
            reach = math.dist(part.start, centre)
            points += [(centre[0] - reach, centre[1] - reach), (centre[0] + reach, centre[1] + reach)]
    return tuple(map(min, *points)), tuple(map(max, *points))
