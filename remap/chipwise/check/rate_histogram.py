# SPDX-License-Identifier: GPL-2.0-or-later
"""Removal over time, in bins whose width grows with the program.  Called by times.py."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from chipwise.clib.arrays import Floats

BINS = 4096
FIRST_S = 0.01


class Load:
    """mm3 removed in each bin of `width` seconds."""

    def __init__(self) -> None:
        self.width, self.volume, self.end = FIRST_S, np.zeros(BINS), 0.0

    def add(self, seconds: Floats, volumes: Floats) -> None:
        """Moves that follow: each removes its volume evenly in its time."""
        if not len(seconds):
            return
        times = self.end + np.concatenate((np.zeros(1), np.cumsum(seconds)))
        self.end = float(times[-1])
        while self.end > BINS * self.width:
            self.volume = np.concatenate((self.volume.reshape(-1, 2).sum(axis=1), np.zeros(BINS // 2)))
            self.width *= 2
        first, last = int(times[0] / self.width), min(BINS, int(self.end / self.width) + 1)
        edges = np.arange(first, last + 1) * self.width
        total = np.concatenate((np.zeros(1), np.cumsum(volumes)))
        self.volume[first:last] += np.diff(np.interp(edges, times, total))

    def wait(self, seconds: float) -> None:
        """Time in which nothing is removed."""
        self.add(np.array([seconds]), np.zeros(1))

    def rates(self, most: int = 1000) -> tuple[float, Floats]:
        """(seconds of each bin, mm3/min in it) with at most so many bins."""
        used = max(1, min(BINS, int(np.ceil(self.end / self.width))))
        step = -(-used // most)
        volume = np.concatenate((self.volume[:used], np.zeros(-used % step))).reshape(-1, step).sum(axis=1)
        return self.width * step, volume / (self.width * step) * 60.0
