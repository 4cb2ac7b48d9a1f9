# SPDX-License-Identifier: GPL-2.0-or-later
"""What the realtime components lack on this machine, said to the operator: the path ahead.

Called by worker.py.  stock-tracker.0.path-refused has the check that failed (components/core/path_watch.h): what was refused while
LinuxCNC started counts at once, the rest after 1 s of cutting.
"""

from chipwise.monitor.messages import PATH_REFUSALS
from chipwise.monitor.start_line import Quiet
from chipwise.stock.layout import PathRefusal

AT_START = range(PathRefusal.NO_BLOCK, PathRefusal.HEARTBEAT)


class Hints:
    """Each is said once."""

    def __init__(self, pins, say, linuxcnc):
        """pins: of chipwise-monitor; say: function of a text for the operator."""
        self.pins, self.say, self.linuxcnc = pins, say, linuxcnc
        self.said, self.quiet = set(), None

    def follow(self, now):
        self.follow_path(now)

    def follow_path(self, now):
        """A path that is not read: at the start as soon as a message disturbs no command, else while M251 is on."""
        code = self.pins['path-refused']
        if not code or code in self.said:
            return
        if code in AT_START:
            self.quiet = self.quiet or Quiet(self.linuxcnc)
            if not self.quiet(now):
                return
        elif not self.pins['mode']:
            return
        self.said.add(code)
        self.say(PATH_REFUSALS.get(code, f'check {code} of the motion planner fails, so the path ahead is only predicted'))
