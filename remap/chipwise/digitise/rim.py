# SPDX-License-Identifier: GPL-2.0-or-later
"""Cells at the rim of a trace that no ball has touched, but the flank of the last one is above.

Called by height_map.py.  Along each axis the outermost balls of a trace have a neighbour on one side only.  Their slope
to it is that of the surface, so the ball touches the model at the offset -radius x normal from its centre.  A cell that
lies further out than that has been passed by the flank only: there the map would be high by up to the radius.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

STEP = 0.1  # of the radius: neighbours nearer than that show noise for a slope
SLACK = 0.05  # of the radius, for the noise of the slope
BENDS = 0.1  # of the distance of the neighbour: the slope is that of the middle between them


def _between_lines(centre: np.ndarray) -> np.ndarray:
    """(n, m, 2) with the cells between known ones of a row filled in: there is no ball between two lines."""
    filled, cells = centre.copy(), np.arange(centre.shape[1])
    for row in filled:
        known = np.flatnonzero(np.isfinite(row[:, 1]))
        if len(known) > 1:
            for values in row.T:
                values[:] = np.interp(cells, known, values[known], np.nan, np.nan)
    return filled


def _neighbour(known: np.ndarray, step: int) -> np.ndarray:
    """Of each cell (n, m) the nearest known row at least `step` rows before it; -1 without one."""
    last = np.maximum.accumulate(np.where(known, np.arange(len(known))[:, None], -1), axis=0)
    found = np.full_like(last, -1)
    found[step:] = last[:-step]
    return found


def _beyond(centre: np.ndarray, offset: np.ndarray, winner: np.ndarray, radius: float, cell: float) -> np.ndarray:
    """Cells beyond the contact of a ball that has no neighbour before it along the rows.

    centre: (n, m, 2) mean place along the rows and height of the balls of a cell, NaN without any; offset: (k,) of
    cells from the centres of the balls that made them, along the rows; winner: (k, 2) cell of these balls."""
    centre = _between_lines(centre)
    known = np.isfinite(centre[..., 1])
    step = max(2, round(STEP * radius / cell))  # a line may be in two cells
    before = _neighbour(known, step)
    behind = len(known) - 1 - _neighbour(known[::-1], step)[::-1]
    i, j = winner.T
    after = behind[i, j]
    has = (before[i, j] < 0) & (after < len(known))
    here, there = centre[i, j], centre[np.minimum(after, len(known) - 1), j]
    with np.errstate(invalid="ignore", divide="ignore"):
        apart = there[:, 0] - here[:, 0]
        slope = (there[:, 1] - here[:, 1]) / apart
        contact = radius * slope / np.sqrt(1.0 + slope * slope)
        return has & (offset < contact - (0.25 * cell + SLACK * radius + BENDS * apart))


@dataclass(frozen=True, eq=False)
class Balls:
    """centres (n, 3) mm with their cells `place` (n, 2); radius of all, mm."""

    centres: np.ndarray
    place: np.ndarray
    radius: float


def flanks(balls: Balls, winner: np.ndarray, middles: np.ndarray, count: np.ndarray, cell: float) -> np.ndarray:
    """(k,) bool: cells that only a flank has passed.

    winner (k,): the ball that made a cell; middles (k, 2) of the cells, mm; count: cells along X and Y; cell: mm."""
    centres, place, radius = balls.centres, balls.place, balls.radius
    sums = np.zeros((4, count[0], count[1]))
    for row, values in zip(sums, (np.ones(len(centres)), *centres.T)):
        np.add.at(row, tuple(place.T), values)
    with np.errstate(invalid="ignore"):
        x, y, z = sums[1:] / np.where(sums[0] > 0, sums[0], np.nan)
    home, offset = place[winner], middles - centres[winner, :2]
    found = np.zeros(len(winner), bool)
    for along, own, cells in ((x, offset[:, 0], home), (y.T, offset[:, 1], home[:, ::-1])):
        high = z if along is x else z.T
        found |= _beyond(np.stack([along, high], axis=2), own, cells, radius, cell)
        mirrored = np.stack([-along[::-1], high[::-1]], axis=2)
        found |= _beyond(mirrored, -own, np.stack([len(along) - 1 - cells[:, 0], cells[:, 1]], axis=1), radius, cell)
    return found
