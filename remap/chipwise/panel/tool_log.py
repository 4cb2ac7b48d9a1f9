# SPDX-License-Identifier: GPL-2.0-or-later
"""What each tool did in a program: reference, mean and peak of the removal rate, time, how often and how it was held back.

Called by watch.py for the running program; at its end the rows go into the file [CHIPWISE]PANEL_LOG, a CSV file that any
spreadsheet opens.  The columns are those of load logs of machine tools: reference, mean, peak, time, reaction.
"""

import csv
import io
import os
import time

from chipwise.panel.display import FEED_MOTION
from chipwise.stock.layout import LimitedBy

COLUMNS = ("start", "program", "tool", "diameter_mm", "reference_cm3_min", "mean_cm3_min", "peak_cm3_min", "cutting_s", "removed_cm3",
           "slowed_s", "stops")
MOST_BYTES = 5_000_000      # of the file; then it is renamed to NAME.old and a new one begins
MM3_PER_CM3 = 1000.0
SLOWED = (LimitedBy.STOCK_HERE, LimitedBy.STOCK_AHEAD)
MOST_TOOLS = 1000


def mean(uses):
    """Removal rate of uses while they cut, mm3/min."""
    seconds = sum(use.cut_s for use in uses)
    return sum(use.volume for use in uses) / seconds * 60 if seconds > 0 else 0.0


class Use:
    """One tool in one run; s, mm3, mm3/min."""

    def __init__(self, tool, diameter):
        self.tool, self.diameter = tool, diameter
        self.cut_s = self.slowed_s = self.volume = self.peak = self.reference = 0.0
        self.stops = 0

    def row(self):
        """The figures as a page and the file show them."""
        return {"tool": self.tool, "diameter_mm": round(self.diameter, 4), "reference_cm3_min": round(self.reference / MM3_PER_CM3, 4),
                "mean_cm3_min": round(mean([self]) / MM3_PER_CM3, 4), "peak_cm3_min": round(self.peak / MM3_PER_CM3, 4),
                "cutting_s": round(self.cut_s, 1), "removed_cm3": round(self.volume / MM3_PER_CM3, 4),
                "slowed_s": round(self.slowed_s, 1), "stops": self.stops}


class ToolLog:
    """The tools of one run of a program, in the order of their first cut."""

    def __init__(self, program, now):
        """now: s since 1970."""
        self.program, self.start = program, now
        self.uses = {}
        self._removed = None
        self._stopped = False

    def look(self, dt, pins):
        """dt s after the look before; pins: Machine.pins()."""
        before, self._removed = self._removed, pins["removed"]
        cut = pins["removed"] - before if before is not None else 0.0       # below 0: another stock
        stopped, was_stopped = bool(pins["guard_reason"]), self._stopped
        self._stopped = stopped
        number = int(pins["tool"])
        # a rate without volume: the servo thread has not run since the look before (a busy simulation), and makes up for it later
        cutting = before is not None and pins["motion_type"] in FEED_MOTION and (cut > 0 or pins["mrr"] > 0)
        if number not in self.uses and (cut <= 0 and not stopped and not cutting or len(self.uses) >= MOST_TOOLS):
            return
        use = self.uses.setdefault(number, Use(number, pins["tool_diameter"]))
        use.stops += stopped and not was_stopped
        if not cutting:
            return
        use.cut_s += dt
        use.volume += max(0.0, cut)
        use.peak = max(use.peak, pins["mrr"])
        use.reference = max(use.reference, pins["target"])
        use.slowed_s += dt if pins["mode"] and pins["limited_by"] in SLOWED else 0.0

    @property
    def mean(self):
        """Of all tools, mm3/min."""
        return mean(self.uses.values())

    def rows(self):
        return [use.row() for use in self.uses.values()]


def safe(text):
    """A text for a spreadsheet: a name that begins like a formula is shown, not computed."""
    return "'" + text if text[:1] in ("=", "+", "-", "@", "\t", "\r") else text


def append(path, log):
    """Add the rows of a run to the file.  Raises OSError."""
    rows = log.rows()
    if not rows:
        return
    if os.path.exists(path) and os.path.getsize(path) > MOST_BYTES:
        os.replace(path, path + ".old")
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS)
    start = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(log.start))
    handle = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NONBLOCK | os.O_CLOEXEC, 0o644)
    with open(handle, "ab") as file:
        if file.tell() == 0:
            writer.writeheader()
        writer.writerows({"start": start, "program": safe(log.program), **row} for row in rows)
        file.write(text.getvalue().encode("utf-8", "replace"))
