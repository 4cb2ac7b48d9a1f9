# SPDX-License-Identifier: GPL-2.0-or-later
"""Times and removal rates of the moves of a program, at F and under M251.

Called by simulate.py, segment by segment.  Speeds are mm/s, accelerations mm/s2, targets mm3/min.  The time with acceleration
is that of a planner that looks ahead: height_sweep.c, chip_height_times.
"""

import numpy as np

from chipwise.check import records
from chipwise.check.load import Load
from chipwise.check.reader import Unreadable
from chipwise.check.sweep import times
from chipwise.stock.layout import FeedMode

RATE_WINDOW_MM = 2.0        # a rate is measured over at least this much path
CORNER_MM = 0.01            # how far a corner may be rounded (G64 P) when times are estimated
# LinuxCNC's planner shares the acceleration of an arc between its two directions, and that of two moves that blend parabolically
# between them (tc.c, blendmath.h: BLEND_ACC_RATIO_TANGENTIAL, BLEND_ACC_RATIO_NORMAL).
ALONG_ARC, CENTRIPETAL, BESIDE_BLEND = 0.5, 0.75 ** 0.5, 0.5
DEFAULT_SPEED, DEFAULT_ACCEL = 50.0, 500.0      # mm/s, mm/s2 if the INI file has none
OFF, LIMIT, CONSTANT, WINDOW = map(int, FeedMode)      # M251 P


class Timer:
    """The clock of a program: spend() each part of its moves."""

    def __init__(self, machine):
        self.speeds = np.array([v or DEFAULT_SPEED for v in machine.speeds])
        self.accels = np.array([a or DEFAULT_ACCEL for a in machine.accels])
        self.mode, self.target, self.lower, self.ceiling = OFF, 0.0, 0.0, 0.0
        self.volumetric = False                         # whether M251 was ever on
        self.load, self.load_volumetric = Load(), Load()
        self._speed, self._speed_volumetric = [0.0], [0.0]
        self._last_kind, self._last_direction = None, None
        self.seconds = None                             # (n,) of the moves of the last spend(), at F and under M251

    def set_feed_mode(self, mode, target, lower, ceiling):
        """M251, M252."""
        self.mode, self.target, self.lower, self.ceiling = int(mode), target, lower, ceiling
        self.volumetric = self.volumetric or self.mode != OFF

    def wait(self, seconds):
        """A dwell."""
        self.load.wait(seconds)
        self.load_volumetric.wait(seconds)

    def spend(self, kinds, lines, feed, steps, length, volume, tool):
        """Time of moves that are not empty; -> their removal rates at F, mm3/min, or None if none is cut.

        kinds, lines, feed (mm/s), length (mm), volume (mm3): (n,); steps: (n, 3) mm; tool: ToolFigures or None.
        """
        direction = steps / length[:, None]
        with np.errstate(divide="ignore"):
            rapid_speed = (self.speeds / np.abs(direction)).min(axis=1)
            accel = (self.accels / np.abs(direction)).min(axis=1)
        cutting = kinds != records.RAPID
        if (cutting & ~(feed > 0)).any():
            raise Unreadable("no feed is set", "give F on this line or before", int(lines[cutting & ~(feed > 0)][0]))
        plain = np.where(cutting, np.minimum(feed, rapid_speed), rapid_speed)
        corner = self._corner_speeds(kinds, direction, length, accel)
        accel *= _accel_shares(kinds, lines)
        planned = self._planned(length, plain, accel, corner, self._speed)
        volumetric, volumetric_planned = plain, planned
        if self.mode != OFF:
            wanted = np.where(cutting, np.minimum(self._volumetric(length, volume, plain, tool), rapid_speed), plain)
            volumetric, volumetric_planned = wanted, self._planned(length, wanted, accel, corner, self._speed_volumetric)
        self.seconds = planned, volumetric_planned
        self.load.add(planned, volume)
        self.load_volumetric.add(volumetric_planned, volume)
        if tool is None:
            return None
        tool.feed_s += float((length / plain).sum())
        tool.planned_s += float(planned.sum())
        tool.volumetric_s += float((length / volumetric).sum())
        tool.volumetric_planned_s += float(volumetric_planned.sum())
        tool.cutting_s += float(planned[cutting & (volume > 0)].sum())
        tool.feed_volume += float(volume[cutting].sum())
        return _rates(length, plain, planned, volume, cutting)

    def _corner_speeds(self, kinds, direction, length, accel):
        """Highest speed at the end of each move: a corner is rounded by CORNER_MM; 0 between G0 and G1."""
        first = self._last_direction is None
        before = np.concatenate((direction[:1] if first else self._last_direction[None], direction[:-1]))
        cosine = np.clip((before * direction).sum(axis=1), -1.0, 1.0)
        half = np.sqrt(np.maximum((1.0 + cosine) / 2.0, 0.0))           # sine of half the angle between the two sides
        turn = np.arccos(cosine)
        with np.errstate(divide="ignore", invalid="ignore"):
            begin = np.sqrt(accel * CORNER_MM * half / np.maximum(1.0 - half, 1e-12))
            arc = np.sqrt(CENTRIPETAL * accel * length / np.maximum(turn, 1e-12))
        begin = np.where(kinds == records.ARC, np.minimum(np.maximum(begin, arc), arc), begin)
        kinds_before = np.concatenate((kinds[:1] if first else [self._last_kind], kinds[:-1]))
        begin[(kinds == records.RAPID) != (kinds_before == records.RAPID)] = 0.0
        self._begin = 0.0 if first else float(begin[0])
        self._last_direction, self._last_kind = direction[-1].copy(), int(kinds[-1])
        return np.concatenate((begin[1:], [np.inf]))

    def _planned(self, length, max_speed, accel, corner, speed):
        """Seconds of each move with acceleration; speed: [mm/s at the beginning], changed to that at the end."""
        seconds, speed[0] = times(length, max_speed, accel, np.minimum(corner, 1e9), min(speed[0], self._begin))
        return seconds

    def _volumetric(self, length, volume, plain, tool):
        """mm/s of each move under M251 (docs/user/codes.md)."""
        target, lower = self.target, self.lower
        limit = tool and tool.geometry and tool.geometry.max_removal_rate
        if limit:
            target, lower = min(target, limit), min(lower, limit)
        area = np.maximum(windows(length, volume)[0], 1e-9)
        held, ceiling = target / 60.0 / area, self.ceiling / 60.0 or np.inf
        if self.mode == LIMIT:
            return np.minimum(plain, held)
        if self.mode == CONSTANT:
            return np.minimum(held, ceiling)
        raised = np.minimum(np.maximum(plain, lower / 60.0 / area), np.maximum(ceiling, plain) if self.ceiling else plain)
        return np.minimum(raised, held)


def _accel_shares(kinds, lines):
    """The share of the acceleration that LinuxCNC's planner uses along each move (tcGetTangentialMaxAccel in tc.c)."""
    shares = np.where(kinds == records.ARC, ALONG_ARC, 1.0)
    begins = np.concatenate(([True], (np.diff(kinds) != 0) | (np.diff(lines) != 0) | (kinds[1:] != records.ARC)))
    whole = np.cumsum(begins) - 1                           # number of the arc or straight move that each belongs to
    kind = kinds[begins] == records.RAPID
    meets = np.concatenate((kind[1:] != kind[:-1], [False]))                # a blend between G0 and G1 follows
    beside = meets | np.concatenate(([False], meets[:-1]))
    return np.where(beside[whole] & (kinds != records.RAPID), BESIDE_BLEND * shares, shares)


def windows(length, volume):
    """(mm2: volume per mm of path, mm: length) of the window of about RATE_WINDOW_MM that each move belongs to."""
    number = np.floor(np.cumsum(length) / RATE_WINDOW_MM)
    window = np.concatenate(([0], np.cumsum(np.diff(number) > 0)))
    distance = np.bincount(window, length)
    return (np.bincount(window, volume) / distance)[window], distance[window]


def _rates(length, plain, planned, volume, cutting):
    """Removal rate of each move at F, mm3/min; None if nothing is removed."""
    if not volume.any():
        return None
    area, distance = windows(length, np.where(cutting, volume, 0.0))
    rate = area * np.where(cutting, np.minimum(plain, length / np.maximum(planned, 1e-12)), 0.0) * 60.0
    # a window shorter than it should be (the end of a block, a single short move) gives no rate
    rate[distance < RATE_WINDOW_MM / 2] = 0.0
    return rate
