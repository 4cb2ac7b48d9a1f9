# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves of a program that follow one another, as the clock and the judges of a check see them.  Called by simulate.py
and survey.py."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from chipwise.program import records

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats, Ints, Records


@dataclass(frozen=True)
class PathPart:
    """Moves that are not empty, in their order, all with one tool: arrays (n,), but for steps."""

    kinds: np.ndarray  # of records.py
    lines: np.ndarray
    feed: np.ndarray  # F, mm/s
    steps: np.ndarray  # (n, 3), mm
    length: np.ndarray  # mm
    volume: np.ndarray  # mm3 that they cut
    first: np.ndarray  # whether it is the first chord of an arc

    @classmethod
    def of(cls, block: Floats, steps: Floats, length: Floats, volume: Floats, moving: Bools) -> PathPart:
        """Of a block of records: those that are `moving` (n,) bool."""
        block = block[moving]
        return cls(
            block[:, 0].astype(int),
            block[:, 1].astype(int),
            block[:, 5] / 60.0,
            steps[moving],
            length[moving],
            volume[moving],
            block[:, 6],
        )

    @cached_property
    def direction(self) -> Floats:
        """(n, 3) unit vectors."""
        return self.steps / self.length[:, None]

    @cached_property
    def cutting(self) -> Bools:
        """(n,) bool: feed moves, whether they meet stock or not."""
        return self.kinds != records.RAPID


@dataclass(frozen=True)
class CutMoves:
    """Moves one after the other, and what the tool met on each: arrays (n,), but for positions."""

    kinds: Ints  # of records.py
    lines: Ints
    positions: Floats  # (n, 3), mm, where each ends
    met: Records  # at: share of the move at which the worst contact is, and what else was met

    @classmethod
    def at_ends(cls, block: Floats) -> CutMoves:
        """Of a block of records; the worst is at the end of each."""
        met = np.zeros(len(block), [("at", "<f4")])
        met["at"] = 1.0
        return cls(block[:, 0].astype(int), block[:, 1].astype(int), block[:, 2:5], met)
