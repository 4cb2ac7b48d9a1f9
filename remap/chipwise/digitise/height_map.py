# SPDX-License-Identifier: GPL-2.0-or-later
"""Heights of a model from the ball centres of a trace.

Called by cli/digitise.py.  The model is below every ball that has touched it: the height at a point is the lowest
surface of all balls above it.  That compensates for the ball without a normal.  Between two lines it is high by the
scallop, and in a corner narrower than the ball by what the ball cannot reach.

The lowest of many has the lowest noise.  So the third lowest counts, as far as the noise of the trace can be the reason
for its distance from the lowest: the map is below the model by at most three standard deviations over the cosine of the
slope.  Cells at the rim that only the flank of a ball has passed are not known (rim.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from chipwise.digitise import rim
from chipwise.errors import CycleError
from chipwise.clib import core, layout
from chipwise.stock import store

MOST_CELLS = 20_000_000
MOST_WORK = 2e10  # points x cells under a ball: a few minutes
LOWEST = 3  # of so many balls the highest counts, within
BAND = 6.0  # standard deviations of the noise from the lowest
AIR_MM = 1.0  # of the box above the highest point


@dataclass(frozen=True)
class HeightMap:
    """heights (ny, nx) mm at the cells' middles, NaN where no ball was; x0, y0 mm: the corner; cell mm."""

    heights: np.ndarray
    x0: float
    y0: float
    cell: float


def noise(centres: np.ndarray) -> float:
    """Standard deviation of the noise along an axis, mm: from second differences of neighbours, which a smooth path has
    not."""
    if len(centres) < 20:
        return 0.0
    bend = np.abs(np.diff(centres, n=2, axis=0))
    return float(np.median(bend[:, 2])) / (0.6745 * math.sqrt(6.0))


def _lowest(bottom: np.ndarray, first: np.ndarray, group: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The LOWEST lowest of each group of balls, (LOWEST, k) mm, and the index of the lowest, (k,)."""
    left, found, index = bottom.copy(), [], np.zeros(0, np.int64)
    order = np.arange(len(bottom))
    for turn in range(LOWEST):
        least = np.minimum.reduceat(left, first)
        own = np.minimum.reduceat(np.where(left == least[group], order, len(order)), first)
        if turn == 0:
            index = own
        found.append(least)
        left[own] = np.inf
    return np.array(found), index


def envelope(centres: np.ndarray, radius: float, cell: float) -> HeightMap:
    """The lowest surface of balls of `radius` (mm) round `centres` (n, 3), in their order.  Raises CycleError if it is
    too much."""
    low = np.floor(centres[:, :2].min(axis=0) / cell) * cell
    count = np.maximum(1, np.ceil((centres[:, :2].max(axis=0) - low) / cell - 1e-9)).astype(np.int64)
    reach = math.ceil(radius / cell)
    if count.prod() > MOST_CELLS or len(centres) * (2.0 * reach + 1.0) ** 2 > MOST_WORK:
        raise CycleError(
            f"a cell of {cell:g} mm is too small for {len(centres)} points on {count[0]} x {count[1]} cells",
            "use a larger --cell",
        )
    band = BAND * noise(centres)
    place = np.minimum(np.floor((centres[:, :2] - low) / cell).astype(np.int64), count - 1)
    order = np.lexsort((place[:, 0], place[:, 1]))
    centres, place = centres[order], place[order]
    starts = np.concatenate([[True], (np.diff(place, axis=0) != 0).any(axis=1)])
    first, group = np.flatnonzero(starts), np.cumsum(starts) - 1
    home = place[first]
    heights = np.full((LOWEST, count[1], count[0]), np.inf)
    winner = np.full((count[1], count[0]), -1)
    for dx in range(-reach, reach + 1):
        for dy in range(-reach, reach + 1):
            target = home + (dx, dy)
            inside = ((target >= 0) & (target < count)).all(axis=1)
            middle = (place + (dx + 0.5, dy + 0.5)) * cell + low
            off = np.square(middle - centres[:, :2]).sum(axis=1)
            bottom = np.where(
                off < radius * radius, centres[:, 2] - np.sqrt(np.maximum(radius * radius - off, 0.0)), np.inf
            )
            lowest, index = _lowest(bottom, first, group)
            x, y = target[inside].T
            wins = lowest[0, inside] < heights[0, y, x]
            winner[y[wins], x[wins]] = index[inside][wins]
            heights[:, y, x] = np.sort(np.concatenate([heights[:, y, x], lowest[:, inside]]), axis=0)[:LOWEST]
    return HeightMap(
        _known(heights, winner, rim.Balls(centres, place, radius), (low, count), (cell, band)),
        float(low[0]),
        float(low[1]),
        cell,
    )


def _known(
    heights: np.ndarray,
    winner: np.ndarray,
    balls: rim.Balls,
    box: tuple[np.ndarray, np.ndarray],
    sizes: tuple[float, float],
) -> np.ndarray:
    """The heights (ny, nx) of the lowest ones (LOWEST, ny, nx) and the balls that made them; NaN where no ball has
    touched."""
    (low, count), (cell, band) = box, sizes
    with np.errstate(invalid="ignore"):
        near = heights - heights[0] <= band
    chosen = np.where(near, heights, -np.inf).max(axis=0)
    y, x = np.nonzero(winner >= 0)
    middles = (np.stack([x, y], axis=1) + 0.5) * cell + low
    flank = rim.flanks(balls, winner[y, x], middles, count, cell)
    known = np.full(winner.shape, np.nan)
    known[y[~flank], x[~flank]] = chosen[y[~flank], x[~flank]]
    return known


def as_stock(model: HeightMap, floor: float) -> tuple[store.Head, np.ndarray]:
    """A stock (stock/store.py) whose top is the model: from `floor` (mm) up; where no ball was it is as high as the
    box.

    Raises CycleError if the floor is not below the model."""
    top = float(np.nanmax(model.heights)) + AIR_MM
    if not floor < np.nanmin(model.heights):
        raise CycleError(
            f"the floor {floor:g} mm is not below the lowest point {np.nanmin(model.heights):.3f} mm",
            "use a lower --floor",
        )
    ny, nx = model.heights.shape
    low, high = (model.x0, model.y0, floor), (model.x0 + nx * model.cell, model.y0 + ny * model.cell, top)
    try:
        stock = core.Stock(low, high, model.cell)
    except core.CoreError as error:
        raise CycleError(str(error), "use another --cell or --floor") from error
    head = stock.head
    if (head.nx, head.ny) != (nx, ny):
        raise CycleError(f"cells of {model.cell:g} mm do not divide the map evenly", "use another --cell")
    stock.cells["top"] = np.where(np.isnan(model.heights), np.float32(top), model.heights.astype(np.float32))
    removed = float(np.sum(top - stock.cells["top"].astype(float))) * model.cell**2
    found = store.Head(model.cell, low, high, layout.StockShape.BOX, nx, ny, removed, (head.half_x, head.half_y), 0.0)
    return found, stock.cells_and_ring.copy()
