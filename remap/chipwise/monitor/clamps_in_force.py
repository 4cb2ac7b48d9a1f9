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


class ClampsInForce:
    """Those of one LinuxCNC.  names: of the clamps, in the order of the table."""

    def __init__(self, component, settings):
        self.component, self.settings, self.names = component, settings, ()

    def put(self, table, number):
        """The set-up `number` (0: none) into the table; -> the reply."""
        from chipwise.clamps import set_ups
        try:
            clamps = set_ups.clamps_of(self.settings.path('CLAMPS'), number) if number else ()
        except CycleError as error:
            print(printable(f'chipwise: clamps: {error}'), flush=True)
            return reasons.NO_CLAMPS
        if table is None:
            return reasons.NOT_TAKEN
        taken, end = table.put(clamps, self.settings['CLAMP_CLEARANCE']), time.monotonic() + patience(TAKEN_S)
        while self.component['clamps-taken'] != taken:
            if time.monotonic() > end:
                return reasons.NOT_TAKEN
            time.sleep(0.001)
        self.names = tuple(clamp.name for clamp in clamps)
        return reasons.DONE

    def name(self, number):
        """Of the clamp at place `number` of the table, from 1."""
        return self.names[number - 1] if 0 < number <= len(self.names) else f'clamp {number} of the set-up in force'
