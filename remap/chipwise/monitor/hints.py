# SPDX-License-Identifier: GPL-2.0-or-later
"""What the realtime components lack on this machine, said to the operator: the path ahead, and time.

Called by worker.py.  stock-tracker.0.path-refused has the check that failed (components/core/path_watch.h): what was
refused while LinuxCNC started counts at once, the rest after 1 s of cutting.

HAL measures how long stock-tracker.0 takes, and motion how long a period is: in clocks of the processor (LinuxCNC 2.9)
or in ns
(2.10), both in the same unit (hal_lib.c: thread_task, motion/control.c), so their quotient is the share of the period
in any unit.
"""

import os
import statistics
from collections import deque

from chipwise.host.clock import speed
from chipwise.ini import Ini
from chipwise.monitor.messages import PATH_REFUSALS, slow_text
from chipwise.monitor.start_line import Quiet
from chipwise.clib.layout import PathRefusal

AT_START = range(PathRefusal.NO_BLOCK, PathRefusal.HEARTBEAT)
SLOW_SHARE = 0.5  # of the period: the rest of the thread and the screen need the other half
LOOKS = 500  # of 0.02 s that are remembered
SLOW_LOOKS = 100  # of them: without a realtime kernel a run may be interrupted, at times for longer than a period
PERIODS = 51  # whose median is the period: one alone may begin late


class Pace:
    """How much of the servo period stock-tracker.0 takes; read: function of a pin's name -> its value."""

    def __init__(self, read, is_realtime):
        self.read, self.is_realtime = read, is_realtime
        self.periods: deque[float] = deque(maxlen=PERIODS)
        self.shares: deque[float] = deque(maxlen=LOOKS)
        self.took: float | None = None  # of the last look

    def look(self):
        """-> share of the period that is worth saying, 0 if none is."""
        self.periods.append(self.read("motion.servo.last-period"))
        period = statistics.median(self.periods) * speed()  # a clock that runs fast makes the real period short
        if len(self.periods) < PERIODS or period <= 0:
            return 0.0
        most = self.read("stock-tracker.0.tmax") / period if self.is_realtime else 0.0
        if most >= SLOW_SHARE:
            return most
        took = self.read("stock-tracker.0.time")
        if took == self.took:  # perhaps of the same run: the thread waits
            return 0.0
        self.took = took
        self.shares.append(took / period)
        slow = [share for share in self.shares if share >= SLOW_SHARE]
        return statistics.median(slow) if len(slow) >= SLOW_LOOKS else 0.0


def is_realtime():
    """Whether LinuxCNC runs on a realtime kernel; 2.10 has it in a module of its own, and warns of hal.is_rt."""
    try:
        import lcnc_realtime
    except ImportError:
        import hal

        return bool(hal.is_rt)
    return bool(lcnc_realtime.verify())


def make_pace():
    """The Pace of this machine; None without these pins."""
    import hal

    try:
        pace = Pace(hal.get_value, is_realtime())
        pace.look()
        hal.get_value("stock-tracker.0.tmax")
    except RuntimeError:
        return None
    return pace


class Hints:
    """Each is said once."""

    def __init__(self, pins, say, inform, linuxcnc):
        """pins: of chipwise-monitor; say, inform: functions of a text for the operator."""
        self.pins, self.say, self.inform, self.linuxcnc = pins, say, inform, linuxcnc
        self.said, self.quiet = set(), None
        self.pace, self.is_timed = None, False

    def follow(self, now):
        self.follow_path(now)
        self.follow_pace()

    def follow_pace(self):
        """A stock tracker that takes half of the period or more."""
        if not self.is_timed:
            self.pace, self.is_timed = make_pace(), True
        share = self.pace.look() if self.pace else 0.0
        if share:
            self.pace = None
            period_us = Ini().servo_period_s() * 1e6 if os.environ.get("INI_FILE_NAME") else 1000.0
            self.inform(slow_text(share * period_us, period_us))

    def follow_path(self, now):
        """A path that is not read: at the start as soon as a message disturbs no command, else while M251 is on."""
        code = self.pins["path-refused"]
        if not code or code in self.said:
            return
        if code in AT_START:
            self.quiet = self.quiet or Quiet(self.linuxcnc)
            if not self.quiet(now):
                return
        elif not self.pins["mode"]:
            return
        self.said.add(code)
        self.say(
            PATH_REFUSALS.get(code, f"check {code} of the motion planner fails, so the path ahead is only predicted")
        )
