# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves up whose first contact may lie before the first needle of the map that they meet: where needles of their own
are wanted.

Called by simulate.py.  On a slope the tip is lower at the contact than at that needle, so the depth is more than the
one judged.  Lengths mm, machine coordinates of the tool's tip.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats, Ints

SPACING_MM = 0.01  # of the needles: at 80 degrees a contact is judged at most 0.03 mm too low with them
MOST = 200_000  # needles
WORK = 2e9  # needles times segments of the program: some ten seconds of computing
ACROSS = 1500  # needles across a tool: a grid of some million places is looked at for a segment
_STEP_X, _STEP_Y = math.sqrt(2.0) - 1.0, (math.sqrt(5.0) - 1.0) / 2.0  # no wall runs along a row of needles


def doubtful(start: Floats, end: Floats, cuts: Bools, depth: Floats, limit: float) -> Floats:
    """Segments up that are within the limit as judged, and would not be where they or the one before began.

    start, end (n, 3): of segments one after the other; cuts (n,) bool: feeds that meet stock; depth (n,): judged.
    -> (k, 5): where the segment before begins (x, y), and where each ends (x, y); its depth at most.
    """
    before = np.concatenate((start[:1], start[:-1]))
    rise, earlier = end[:, 2] - start[:, 2], np.maximum(start[:, 2] - before[:, 2], 0.0)
    most = depth + rise + earlier
    found = cuts & (rise > 0) & (depth <= limit) & (most > limit)
    return np.column_stack((before[found, :2], end[found, :2], most[found]))


def places(segments: Floats, radius: float, spacing: float) -> Floats:
    """(n, 2) of a grid: what the tool's side comes over in segments (k, 5) of doubtful(), and not where they begin."""
    found = [_crescent(np.array(row[:2]), np.array(row[2:4]), radius, spacing) for row in segments]
    index = np.unique(np.concatenate(found), axis=0) if found else np.zeros((0, 2), int)
    return _position(index, spacing)


def _position(index: Ints, spacing: float) -> Floats:
    return (index + np.column_stack((index[:, 1] * _STEP_X % 1.0, index[:, 0] * _STEP_Y % 1.0))) * spacing


def _crescent(start: Floats, end: Floats, radius: float, spacing: float) -> Ints:
    """(n, 2) int: of the grid, within the radius of start .. end, and not of start."""
    low = np.floor((np.minimum(start, end) - radius) / spacing).astype(int) - 1
    high = np.ceil((np.maximum(start, end) + radius) / spacing).astype(int) + 1
    index = np.stack(np.meshgrid(*(np.arange(a, b) for a, b in zip(low, high)), indexing="ij"), axis=-1).reshape(-1, 2)
    offset, step = _position(index, spacing) - start, end - start
    share = np.clip(offset @ step / max(float(step @ step), 1e-12), 0.0, 1.0)
    near = np.hypot(*(offset - share[:, None] * step).T) <= radius
    return index[near & (offset @ step >= 0.0) & (np.hypot(*offset.T) >= radius - 2 * spacing)]


def spacing_of(doubts: list[tuple[float, Floats]], segments: int, cell: float) -> float | None:
    """mm between needles for [(radius, rows)] in a program of so many segments; None where cells are as fine."""
    if not doubts:
        return None
    area = sum(
        2 * radius * float((np.hypot(*(rows[:, 2:4] - rows[:, :2]).T) + 4 * SPACING_MM).sum())
        for radius, rows in doubts
    )
    spacing = max(
        SPACING_MM,
        max(2 * radius for radius, _ in doubts) / ACROSS,
        math.sqrt(area / min(MOST, WORK / max(segments, 1))),
    )
    return spacing if spacing < cell / 2 else None


def needles(doubts: dict[int, list[tuple[float, Floats]]], segments: int, cell: float) -> dict[int, Floats]:
    """{number of the stock: places (n, 2)} for {number: [(radius, rows of doubtful())]}; empty if they would not
    help."""
    spacing = spacing_of([one for found in doubts.values() for one in found], segments, cell)
    if spacing is None:
        return {}
    found = {
        number: np.concatenate([places(rows, radius, spacing) for radius, rows in some])
        for number, some in doubts.items()
    }
    return {number: one for number, one in found.items() if len(one)}
