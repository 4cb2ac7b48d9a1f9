# SPDX-License-Identifier: GPL-2.0-or-later
"""How long the cycles keep the task to themselves.  Called by session.py.

A remap runs in the task's own thread: while it does, LinuxCNC serves neither abort nor pause nor E-stop.  The task gets
a turn when a remap yields INTERP_EXECUTE_FINISH.  It then lets the machine do all that is queued before the remap goes
on, so a cycle yields only
 - before its first move, when its plan is not there after WAIT_S: planning goes on in its own process meanwhile, so
   what is lost is the blend of the last move before the cycle with the first one of it;
 - between chunks of lines (gcode_lines.py), where the tool may rest, before they are more than TURN_MOVES moves.
Both are counted over all cycles since the last turn, because LinuxCNC reads up to 1000 lines before it looks for
commands
(emctaskmain.cc, readahead_reading(), 2.9.0~pre1).

The preview has nobody to serve and never yields.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import emccanon
from interpreter import INTERP_EXECUTE_FINISH

if TYPE_CHECKING:
    from chipwise.program.interp import Interp, Steps

WAIT_S = 0.1
AGAIN_S = 0.03  # of a cycle that has let the task have its turn: the machine rests already, and no blend is lost
TURN_MOVES = 5000

# The preview waits in steps of this; each lends the planner more computing time.
PREVIEW_STEP_S = 0.5

# A plan that was good in the preview is good in the run, also where the machine is busy: in the task it may compute so
# many times as long.
RUN_SHARE = 3


class _Since:
    """What has been used since the task's last turn."""

    seconds = 0.0
    moves = 0


def hand_over() -> None:
    """Queue the move before, which LinuxCNC may still hold back to join it with the next one (G64 P Q): it forgets what
    it holds back when a remap yields INTERP_EXECUTE_FINISH (emccanon.cc: chained_points, drop_segments(); 2.9.0~pre1).
    A dwell of 0 s queues it."""
    emccanon.DWELL(0.0)


def _size(chunk: tuple) -> int:
    """Moves of a chunk of lines.chunks()."""
    return sum(lines.count("\n") + 1 for _, lines, *_line in chunk)


class TaskShare:
    """One cycle's view of it."""

    def __init__(self, interp: Interp) -> None:
        self._interp, self._began, self._wait_s = interp, time.monotonic(), WAIT_S

    def budget(self, plan_time: float) -> float:
        """Computing time (s) of a plan."""
        return plan_time * (RUN_SHARE if self._interp.task else 1)

    def patience(self) -> float:
        """How long (s) to wait for a plan now."""
        if not self._interp.task:
            return PREVIEW_STEP_S
        self._tick()
        return max(0.0, self._wait_s - _Since.seconds)

    def is_over(self, chunk: tuple) -> bool:
        """Whether it is the task's turn before a chunk is executed.  A large one begins a turn of its own."""
        if not self._interp.task:
            return False
        self._tick()
        size = _size(chunk)
        return _Since.seconds >= WAIT_S or size > TURN_MOVES or _Since.moves > 0 and _Since.moves + size > TURN_MOVES

    def count(self, chunk: tuple) -> None:
        """A chunk has been executed."""
        _Since.moves += _size(chunk)
        self._began = time.monotonic()

    def wait(self) -> Steps:
        """Let the task have its turn, and the machine do what is queued.

        The interpreter then takes feed and modes from the machine; F is put back, as it may be a ceiling (ceiling.py).
        """
        if not self._interp.task:
            return
        feed = self._interp.feed_rate
        hand_over()
        yield INTERP_EXECUTE_FINISH
        self._interp.feed_rate = feed
        self._wait_s = AGAIN_S
        _Since.seconds, _Since.moves, self._began = 0.0, 0, time.monotonic()

    def _tick(self) -> None:
        now = time.monotonic()
        _Since.seconds += now - self._began
        self._began = now
