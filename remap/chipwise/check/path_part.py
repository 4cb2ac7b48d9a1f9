# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves of a program that follow one another, as the clock and the judges of a check see them.  Called by simulate.py
and survey.py."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chipwise.program import records


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
    def of(cls, block, steps, length, volume, moving):
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
    def direction(self):
        """(n, 3) unit vectors."""
        return self.steps / self.length[:, None]

    @cached_property
    def cutting(self):
        """(n,) bool: feed moves, whether they meet stock or not."""
        return self.kinds != records.RAPID
