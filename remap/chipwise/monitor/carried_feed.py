# SPDX-License-Identifier: GPL-2.0-or-later
"""M251 of MDI in the next run of the program that was loaded when it was given: the mark of that program, and messages to the operator.  Called by
worker.py; chipwise_command decides with the mark, at the start of a program.
"""

import os
import zlib

from chipwise import loaded
from chipwise.files import printable
from chipwise.monitor.stock_files import LARGEST_S32


def mark_of(program):
    """Checksum of a program's path and of the state of its file; 0: none."""
    state = loaded.identity(program) if program else None
    return state and (zlib.crc32(repr((program, state)).encode('utf-8', 'backslashreplace')) & LARGEST_S32 or 1) or 0


class CarriedFeed:
    """Of one LinuxCNC; follow() at each look, after program-mark and program-running are set."""

    def __init__(self, pins, inform, feed_is_remapped):
        """inform: function of a text for the operator.  feed_is_remapped: the program's first F says that M251 has ended (glue/volumetric.py)."""
        self.pins, self.inform, self.feed_is_remapped = pins, inform, feed_is_remapped
        self.was_carried = self.was_running = self.feed_of_mdi = self.is_due = False

    def follow(self, program):
        """program: path."""
        running, carried = bool(self.pins['program-running']), bool(self.pins['feed-carried'])
        if carried and not self.was_carried:
            self.inform(f'{printable(os.path.basename(program))}: M251 of MDI is in force in this run, and ends with it')
        if self.is_due and not carried and not self.feed_is_remapped:
            self.inform('M251 of MDI has ended with the start of a program, so F is as programmed')
        self.is_due = running and not self.was_running and self.feed_of_mdi         # in the next look it is decided
        if not running:
            self.feed_of_mdi = bool(self.pins['mode'])
        self.was_running, self.was_carried = running, carried
