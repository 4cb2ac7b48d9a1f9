# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the tool is, from the servo thread's pins.  Called by worker.py.

LinuxCNC's status is milltask's: when that is killed it stays as it was, while motion goes on to the end of what is
queued, and cuts.  The pins are read only where the status has not changed, and seldom: hal.get_value takes HAL's mutex,
and a process that is killed with it stops every reader of HAL.
"""

import time

ASK_S = 0.5

TIP = (
    ("stock-tracker.0.pos-x", "stock-tracker.0.tool-offset-x"),
    ("stock-tracker.0.pos-y", "stock-tracker.0.tool-offset-y"),
    ("stock-tracker.0.pos-z", "stock-tracker.0.tool-offset-z"),
)
LINE = "motion.program-line"


class ToolPlace:
    """get_value: hal.get_value, None: it is looked for."""

    def __init__(self, get_value=None):
        self._get, self._last = get_value, None
        self._seen, self._asked = None, -ASK_S

    def look(self, status):
        """([x, y, z] of the tip in machine units, line); those of the last look where the pins have gone, of LinuxCNC's
        status where they never were, and while it changes."""
        seen = [at - offset for at, offset in zip(status.position[:3], status.tool_offset[:3])], status.motion_line
        if seen != self._seen:
            self._seen, self._last, self._asked = seen, seen, -ASK_S
            return seen
        now = time.monotonic()
        if now - self._asked < ASK_S:
            return self._last
        self._asked = now
        if self._get is None:
            import hal

            self._get = hal.get_value
        try:
            self._last = [self._get(at) - self._get(offset) for at, offset in TIP], self._get(LINE)
        except RuntimeError:
            pass
        return self._last
