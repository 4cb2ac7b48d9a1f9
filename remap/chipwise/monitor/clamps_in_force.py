# SPDX-License-Identifier: GPL-2.0-or-later
"""M256: puts the clamps of a set-up in front of the realtime guard.  Called by stock_files.py, and by worker.py for their names.

They stay in force until another M256, also after the program and in MDI: what is on the table does not go away with it.  A monitor that takes over
leaves the table as it is and does not know the names.
"""

import time

from chipwise.errors import CycleError
from chipwise.host.clock import patience
from chipwise.host.files import printable
from chipwise.stock import reasons

TAKEN_S = 10.0          # the tracker takes them over in its next period: a busy computer may hold up either for seconds
AT_ONCE_S = 0.02        # so long the monitor waits for it; after that it goes on with its work, and looks again
REFUSED = -1            # clamps-taken: the last table was


class ClampsInForce:
    """Those of one LinuxCNC.  names: of the clamps, in the order of the table."""

    def __init__(self, component, settings):
        self.component, self.settings, self.names = component, settings, ()
        self._last = reasons.IDLE
        self._due = None            # (names, what clamps-taken will show, whether it showed a refusal before, when it is too late)

    @property
    def waits(self):
        """Whether the tracker has not answered yet."""
        return self._due is not None

    def put(self, table, number):
        """The set-up `number` (0: none) into the table; -> the reply: BUSY if look() will have it."""
        from chipwise.clamps import set_ups
        try:
            clamps = set_ups.clamps_of(self.settings.path('CLAMPS'), number) if number else ()
        except CycleError as error:
            print(printable(f'chipwise: clamps: {error}'), flush=True)
            return reasons.NO_CLAMPS
        if table is None:
            return reasons.NOT_TAKEN
        before, now = self.component['clamps-taken'], time.monotonic()
        taken = table.put(clamps, self.settings['CLAMP_CLEARANCE'])
        self._due = tuple(clamp.name for clamp in clamps), taken, before == REFUSED, now + patience(TAKEN_S)
        while self.look() == reasons.BUSY and time.monotonic() < now + AT_ONCE_S:
            time.sleep(0.001)
        return self._last

    def look(self):
        """The reply to the last put(), which is BUSY until the tracker has answered.  A refusal that was there before may be of an earlier table."""
        names, taken, was_refused, end = self._due
        shown, self._last = self.component['clamps-taken'], reasons.BUSY
        if shown == taken:
            self.names, self._due, self._last = names, None, reasons.DONE
        elif shown == REFUSED and not was_refused or time.monotonic() > end:
            self._due, self._last = None, reasons.NOT_TAKEN
        return self._last

    def name(self, number):
        """Of the clamp at place `number` of the table, from 1."""
        return self.names[number - 1] if 0 < number <= len(self.names) else f'clamp {number} of the set-up in force'
