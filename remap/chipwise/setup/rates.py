# SPDX-License-Identifier: GPL-2.0-or-later
"""What one tool cuts at the program's own F, and the time that a target and a ceiling would take.

Called by measure.py, part by part.  Seconds, mm, mm3, mm3/min.

1. The rate that counts is the largest mean over WINDOW_S of cutting that does not go down: traverses, moves in air and
   moves down do not belong to its time.  It is within 1 % for any cell, where the largest rate of a moment is not.
2. The volumes of short moves are those of a window of path (times.py), since the cells give them in lumps.  For 3 it is
   a shorter window, because a feed that is held loses time at each place that has more.
3. The time with a target t of moves that cut is the larger of the one at the ceiling, with the machine's acceleration,
   and volume / t; that of moves down, which keep F, the larger of the one at F and volume / t.  The target is known at
   the end only, so both are summed up by their rate.
"""

import math

import numpy as np

from chipwise.check.times import PLAN_WINDOW_MM, windows

WINDOW_S = 1.0
LEAST_AREA = 1e-4  # mm2: a move that removes less per mm is in air
GAP_MM = 2.0  # of path without a cell, between cuts, still counts as cutting
SIDEWAYS = 0.01  # a tool that removes a smaller share of its volume sideways only goes down
BINS_PER_DECADE = 50
LOW, DECADES = 1e-2, 11  # mm3/min of the first bin


class LargestMean:
    """The largest mean over WINDOW_S of moves that follow each other; exact: volume is linear in time between their
    ends."""

    def __init__(self):
        self.best = 0.0  # mm3 in WINDOW_S
        self.seconds = self.volume = 0.0
        self._time, self._sum = np.zeros(1), np.zeros(1)

    def add(self, seconds, volume):
        """(n,) moves."""
        if not len(seconds):
            return
        time = np.concatenate((self._time, self._time[-1] + np.cumsum(seconds)))
        total = np.concatenate((self._sum, self._sum[-1] + np.cumsum(volume)))
        self.seconds += float(time[-1] - self._time[-1])
        self.volume += float(total[-1] - self._sum[-1])
        if time[-1] - time[0] >= WINDOW_S:
            ends, starts = time - time[0] >= WINDOW_S, time[-1] - time >= WINDOW_S
            self.best = max(
                self.best,
                float((total[ends] - np.interp(time[ends] - WINDOW_S, time, total)).max()),
                float((np.interp(time[starts] + WINDOW_S, time, total) - total[starts]).max()),
            )
        first = max(0, int(np.searchsorted(time, time[-1] - WINDOW_S)) - 1)
        self._time, self._sum = time[first:] - time[first], total[first:] - total[first]

    def rate(self):
        """mm3/min; of all the moves if they take less than the window."""
        if self.seconds >= WINDOW_S:
            return self.best / WINDOW_S * 60.0
        return self.volume / self.seconds * 60.0 if self.seconds > 0 else 0.0


class TimeByRate:
    """Seconds and volumes of moves, summed up by their rate."""

    def __init__(self):
        self.seconds, self.volume = np.zeros(BINS_PER_DECADE * DECADES), np.zeros(BINS_PER_DECADE * DECADES)

    def add(self, seconds, volume):
        """(n,) moves."""
        rate = np.maximum(volume / np.maximum(seconds, 1e-12) * 60.0, LOW)
        index = np.minimum((np.log10(rate / LOW) * BINS_PER_DECADE).astype(int), len(self.seconds) - 1)
        self.seconds += np.bincount(index, seconds, len(self.seconds))
        self.volume += np.bincount(index, volume, len(self.volume))

    def with_target(self, target):
        """Seconds with a target (mm3/min)."""
        return float(np.maximum(self.seconds, self.volume * 60.0 / target).sum())


class ToolLoad:
    """One tool of a program."""

    def __init__(self):
        self.sideways = LargestMean()
        self.by_rate = TimeByRate()  # of moves that cut, at the ceiling; those down at F
        self.air_s = 0.0
        self.air_saved_s = self.air_saved_at_f_s = (
            0.0  # by feeds above the stock that are as fast as the axes, of a tool with a target and without
        )
        self._since_cut = math.inf  # mm of path at the end of what has been added

    def add(self, feeds, down, length, volume, seconds, raised):
        """Moves (n,): feeds, down: bool; seconds at F, raised: at the ceiling."""
        cuts = self._cuts(feeds, length, volume)
        self.air_s += float(seconds[feeds & ~cuts].sum())
        work = cuts & ~down
        if work.any():
            even = windows(length[work], volume[work])[0] * length[work]
            self.sideways.add(seconds[work], even)
        for some in (work, cuts & down):
            if some.any():
                self.by_rate.add(raised[some], windows(length[some], volume[some], PLAN_WINDOW_MM)[0] * length[some])

    def add_air(self, free, seconds, raised, air):
        """Moves (n,): free: feeds above the stock; seconds at F, at the ceiling, and at what the axes allow there."""
        self.air_saved_at_f_s += float((seconds - air)[free].sum())
        self.air_saved_s += float((raised - air)[free].sum())

    def _cuts(self, feeds, length, volume):
        """(n,) bool: feeds that cut, and those between two cuts."""
        found = feeds & (volume > LEAST_AREA * length)
        end = np.cumsum(length)
        hits = np.flatnonzero(found)
        if not len(hits):
            self._since_cut += float(end[-1])
            return found
        before = np.searchsorted(hits, np.arange(len(length)), side="right") - 1  # the last hit at or before each
        last = np.where(before >= 0, end[hits[before]], -self._since_cut)
        after = np.minimum(before + 1, len(hits) - 1)
        following = np.where(before + 1 < len(hits), end[hits[after]] - length[hits[after]], np.inf)
        self._since_cut = float(end[-1] - end[hits[-1]])
        return found | feeds & (following - last <= GAP_MM)

    def rate(self, volume):
        """mm3/min: the largest mean sideways of a tool that removes `volume` in all by feeds; 0 if it only goes
        down."""
        return self.sideways.rate() if self.sideways.volume > SIDEWAYS * volume else 0.0
