# SPDX-License-Identifier: GPL-2.0-or-later
"""Times and removal rates of the moves of a program, at F and under M251.

Called by simulate.py, segment by segment.  Speeds are mm/s, accelerations mm/s2, targets mm3/min.  The time with
acceleration is that of a planner that looks ahead: height_sweep.c, chip_height_times.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chipwise.check import blends
from chipwise.program import records
from chipwise.check.rate_histogram import Load
from chipwise.program.reader import Unreadable
from chipwise.clib.height_map import times
from chipwise.clib.layout import FeedMode

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats
    from chipwise.check.path_part import PathPart
    from chipwise.check.result import ToolFigures
    from chipwise.program.reader import Machine

RATE_WINDOW_MM = 2.0  # a rate is measured over at least this much path
CORNER_MM = 0.01  # how far a corner may be rounded where the path mode is not known
PLAN_WINDOW_MM = 1.0  # and the feed under M251 is planned over this much
DEFAULT_SPEED, DEFAULT_ACCEL = 50.0, 500.0  # mm/s, mm/s2 if the INI file has none
OFF, LIMIT, CONSTANT, WINDOW = map(int, FeedMode)  # M251 P


class Timer:
    """The clock of a program: spend() each part of its moves."""

    def __init__(self, machine: Machine) -> None:
        self.speeds = np.array([v or DEFAULT_SPEED for v in machine.speeds])
        self.accels = np.array([a or DEFAULT_ACCEL for a in machine.accels])
        self.mode, self.target, self.lower, self.ceiling = OFF, 0.0, 0.0, 0.0
        self.volumetric = False  # whether M251 was ever on
        self.load, self.load_volumetric = Load(), Load()
        self._speed, self._speed_volumetric = [0.0], [0.0]
        self.allowed: Floats | None = None  # (n,) mm/s by chip and power, of the moves of the next spend(); None: all
        self.seconds = np.zeros(0), np.zeros(0)  # (n,) of the moves of the last spend(), at F and under M251
        self._last: tuple[int, Floats] | None = None  # (kind, direction) of the last segment
        self.path = CORNER_MM  # of a PATH record
        self.override = machine.max_override

    def set_feed_mode(self, mode: float, target: float, lower: float, ceiling: float) -> None:
        """M251, M252."""
        self.mode, self.target, self.lower, self.ceiling = int(mode), target, lower, ceiling
        self.volumetric = self.volumetric or self.mode != OFF

    def wait(self, seconds: float) -> None:
        """A dwell."""
        self.load.wait(seconds)
        self.load_volumetric.wait(seconds)

    def _most_along(self, direction: Floats) -> tuple[Floats, Floats]:
        """Speed (mm/s) and acceleration (mm/s2) that the axes allow along unit vectors."""
        with np.errstate(divide="ignore"):
            return (self.speeds / np.abs(direction)).min(axis=1), (self.accels / np.abs(direction)).min(axis=1)

    def spend(self, part: PathPart, tool: ToolFigures | None, stops: bool = False) -> Floats | None:
        """Time of a PathPart; -> its removal rates at F, mm3/min, or None if none is cut.

        tool: ToolFigures or None; stops: whether the machine waits behind it.
        """
        direction, cutting = part.direction, part.cutting
        length, volume = part.length, part.volume
        rapid_speed, accel = self._most_along(direction)
        unfed = cutting & ~(part.feed > 0)
        if unfed.any():
            raise Unreadable("no feed is set", "give F on this line or before", int(part.lines[unfed][0]))
        plain = np.where(cutting, np.minimum(part.feed, rapid_speed), rapid_speed)
        moves = blends.moves(part, plain, accel)
        planned = self._planned(part, moves, plain, accel, self._speed, stops)
        volumetric, volumetric_planned = plain, planned
        if self.mode == OFF:
            self._speed_volumetric[0] = self._speed[0]
        else:
            wanted = np.where(cutting, np.minimum(self._volumetric(moves, part, plain, tool), rapid_speed), plain)
            asked = np.where(
                cutting,
                np.minimum(
                    np.maximum(np.maximum(plain, wanted), self.ceiling / 60.0 if self.mode != LIMIT else 0.0),
                    rapid_speed,
                ),
                plain,
            )
            volumetric = wanted
            volumetric_planned = self._planned(
                part, blends.moves(part, asked, accel), wanted, accel, self._speed_volumetric, stops
            )
            self._plan_more(part, wanted, rapid_speed, accel, stops)
        self._last = int(part.kinds[-1]), direction[-1].copy()
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

    def _plan_more(self, part: PathPart, wanted: Floats, rapid_speed: Floats, accel: Floats, stops: bool) -> None:
        """Another clock of a subclass; wanted, rapid_speed: mm/s under M251 and of the axes; accel: mm/s2 of the
        axes."""

    def _planned(
        self, part: PathPart, moves: blends.Moves, wanted: Floats, accel: Floats, speed: list[float], stops: bool
    ) -> Floats:
        """Seconds of each segment with acceleration.  moves: blends.Moves of the part, with the speeds that the planner
        is asked for; wanted: mm/s that the feed law leaves of them; accel: mm/s2 along it; speed: [mm/s at the
        beginning], changed to that at the end."""
        ends, saved, shares = blends.joined(moves, self.accels, self.path, self.override)
        if stops and self.path >= 0.0:
            shares[-1] *= blends.PARABOLIC
        corner = np.full(len(part.length), np.inf)
        corner[-1] = 0.0 if stops else np.inf
        corner[moves.begins[1:] - 1] = ends
        if self._last is None or (self._last[0] == records.RAPID) != (moves.kind[0] == records.RAPID):
            speed[0] = 0.0
        elif speed[0] > 0.0:  # goes on from the part before
            half = np.sqrt(max((1.0 + float(self._last[1] @ part.direction[0])) / 2.0, 0.0))
            speed[0] = min(speed[0], float(np.sqrt(accel[0] * max(self.path, 0.0) * half / max(1.0 - half, 1e-12))))
        most = np.minimum(wanted, moves.speed[moves.whole])
        seconds, speed[0] = times(part.length, most, accel * shares[moves.whole], np.minimum(corner, 1e9), speed[0])
        each = np.bincount(moves.whole, seconds)
        saved = np.minimum(saved, 0.5 * np.minimum(each[1:], each[:-1]))
        return seconds * (1.0 - np.append(0.0, saved) / np.maximum(each, 1e-12))[moves.whole]

    def _volumetric(self, moves: blends.Moves, part: PathPart, plain: Floats, tool: ToolFigures | None) -> Floats:
        """mm/s of each move under M251 (docs/user/codes.md)."""
        target, lower = self.target, self.lower
        limit = tool and tool.geometry and tool.geometry.max_removal_rate
        if limit:
            target, lower = min(target or limit, limit), min(lower, limit)
        area = np.maximum(windows(part.length, part.volume, PLAN_WINDOW_MM, moves)[0], 1e-9)
        held = target / 60.0 / area if target else np.full(len(area), np.inf)
        if self.allowed is not None:
            held = np.minimum(held, self.allowed)
        elif not self.target:  # M251 without Q, and the limits are not known
            return plain
        ceiling = self.ceiling / 60.0 or np.inf
        if self.mode == LIMIT:
            return np.minimum(plain, held)
        if self.mode == CONSTANT:
            return np.minimum(held, ceiling)
        raised = np.minimum(
            np.maximum(plain, lower / 60.0 / area), np.maximum(ceiling, plain) if self.ceiling else plain
        )
        return np.minimum(raised, held)


def windows(
    length: Floats, volume: Floats, most: float = RATE_WINDOW_MM, moves: blends.Moves | None = None
) -> tuple[Floats, Floats]:
    """(mm2: volume per mm of path, mm: length) of the window of about so many mm that each segment belongs to; with
    blends.Moves none goes on from a long move to another one, or from a G0 to a feed."""
    number = np.floor(np.cumsum(length) / most)
    begins = np.diff(number) > 0
    if moves is not None:
        long = moves.length >= most / 2
        ends = (long[1:] | long[:-1]) | ((moves.kind[1:] == records.RAPID) != (moves.kind[:-1] == records.RAPID))
        begins[moves.begins[1:][ends] - 1] = True
    window = np.append(0, np.cumsum(begins))
    distance = np.bincount(window, length)
    return (np.bincount(window, volume) / distance)[window], distance[window]


def _rates(length: Floats, plain: Floats, planned: Floats, volume: Floats, cutting: Bools) -> Floats | None:
    """Removal rate of each move at F, mm3/min; None if nothing is removed."""
    if not volume.any():
        return None
    area, distance = windows(length, np.where(cutting, volume, 0.0))
    rate = area * np.where(cutting, np.minimum(plain, length / np.maximum(planned, 1e-12)), 0.0) * 60.0
    # a window shorter than it should be (the end of a block, a single short move) gives no rate
    rate[distance < RATE_WINDOW_MM / 2] = 0.0
    return rate
