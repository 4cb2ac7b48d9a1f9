# SPDX-License-Identifier: GPL-2.0-or-later
"""Puts clamps in front of the realtime guard: those of M256, of the set-up that is confirmed for the loaded program,
and of its CLAMP comments.  Called by stock_files.py (M256), set_up.py (JOB), comment_clamps.py (COMMENTS), and by
worker.py for their names.

 1. Those of M256 stay in force until another M256, also after the program and in MDI: what is on the table does not go
    away with it.  The others belong to the loaded program.
 2. M256 P0 in MDI takes all away: it is the operator's word.  Those of the program come back when it is opened again.
 3. M256 of a running program takes the place of all clamps that the program has named before: those of its set-up, and
    of the comments in front of that line.  They come back when the run has ended.
 4. A monitor that takes over finds those in force in the table and does not know their names; they count as clamps of
    M256.
"""

import time

from chipwise.clib import layout
from chipwise.errors import CycleError
from chipwise.host.clock import patience
from chipwise.host.files import printable
from chipwise.stock import reasons

TAKEN_S = 10.0  # the tracker takes them over in its next period: a busy computer may hold up either for seconds
AT_ONCE_S = 0.02  # so long the monitor waits for it; after that it goes on with its work, and looks again
REFUSED = -1  # clamps-taken: the last table was
UNNAMED = "clamp {} of the set-up in force"
JOB, COMMENTS = "job", "comments"


class ClampsInForce:
    """Those of one LinuxCNC.  names: of the clamps, in the order of the table; reply: to the last change
    (stock/reasons.py); executed: how many M256 the running program has executed."""

    def __init__(self, component, settings):
        self.component, self.settings, self.names = component, settings, ()
        self.reply, self.executed = reasons.IDLE, 0
        self._base = None  # of M256; None: what is in the table
        self._more: dict = {}  # {JOB or COMMENTS: [(how many M256 come before it, Clamp)]}
        self.dropped = set()  # sources whose clamps M256 of the running program has taken away
        self._before = self._base, self._more  # of the table in force
        self._due = (
            None  # (names, what clamps-taken will show, whether it showed a refusal before, when it is too late)
        )

    @property
    def waits(self):
        """Whether the tracker has not answered yet."""
        return self._due is not None

    def follow(self, running):
        """At each look; running: whether a program runs."""
        if not running:
            self.executed = 0

    def put(self, table, number):
        """M256: the set-up `number` (0: none); -> the reply: BUSY if look() will have it."""
        from chipwise.clamps import set_ups

        try:
            clamps = set_ups.clamps_of(self.settings.path("CLAMPS"), number) if number else ()
        except CycleError as error:
            print(printable(f"chipwise: clamps: {error}"), flush=True)
            return reasons.NO_CLAMPS
        if table is None:
            return reasons.NOT_TAKEN
        more = self._more
        if self.component["program-running"]:
            self.executed += 1
            self.dropped |= {source for source, rows in more.items() if rows}
            more = {COMMENTS: [one for one in more.get(COMMENTS, ()) if one[0] >= self.executed]}
        elif not number:
            more = {}
            self.dropped.clear()
        return self._write(table, tuple(clamps), more)

    def lay(self, table, source, clamps):
        """Clamps of the loaded program, [(how many M256 come before it, Clamp)], in place of those of that source; ->
        the reply."""
        if table is None:
            return reasons.NOT_TAKEN
        self.dropped.discard(source)
        own = [clamp for _after, clamp in clamps]
        base = tuple(
            clamp for clamp in self._of_table(table) if not any(clamp.is_where(other) for other in own)
        )  # a monitor that takes over has found them
        return self._write(table, base, {**self._more, source: list(clamps)})

    def has(self, source):
        """Whether clamps of a source are in force."""
        return bool(self._more.get(source))

    def _of_table(self, table):
        """Those of M256."""
        from chipwise.clamps.clamp import Clamp

        if self._base is None:
            self._base = tuple(
                Clamp.seen_from_above(row, UNNAMED.format(number)) for number, row in enumerate(table.rows(), 1)
            )
        return self._base

    def _write(self, table, base, more):
        clamps = (*base, *(clamp for rows in more.values() for _after, clamp in rows))
        if len(clamps) > layout.CLAMPS:
            print(f"chipwise: clamps: {len(clamps)} are more than {layout.CLAMPS}; leave some out", flush=True)
            self.reply = reasons.NO_CLAMPS
            return self.reply
        if self._due is None:
            self._before = self._of_table(table), self._more
        self._base, self._more = base, more
        before, now = self.component["clamps-taken"], time.monotonic()
        taken = table.put(clamps, self.settings["CLAMP_CLEARANCE"])
        self._due = tuple(clamp.name for clamp in clamps), taken, before == REFUSED, now + patience(TAKEN_S)
        while self.look() == reasons.BUSY and time.monotonic() < now + AT_ONCE_S:
            time.sleep(0.001)
        return self.reply

    def look(self):
        """The reply to the last change, which is BUSY until the tracker has answered.  A refusal that was there before
        may be of an earlier table."""
        if self._due is None:
            return self.reply
        names, taken, was_refused, end = self._due
        shown, self.reply = self.component["clamps-taken"], reasons.BUSY
        if shown == taken:
            self.names, self._due, self.reply = names, None, reasons.DONE
        elif shown == REFUSED and not was_refused or time.monotonic() > end:
            self._due, self.reply = None, reasons.NOT_TAKEN
            self._base, self._more = self._before
        return self.reply

    def name(self, number):
        """Of the clamp at place `number` of the table, from 1."""
        return self.names[number - 1] if 0 < number <= len(self.names) else UNNAMED.format(number)
