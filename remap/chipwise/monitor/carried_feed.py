# SPDX-License-Identifier: GPL-2.0-or-later
"""M251 of MDI in the next run of the program that was loaded when it was given: the mark of that program, and messages
to the operator.  Called by worker.py; chipwise_command decides with the mark, at the start of a program.
"""

import zlib

from chipwise.program import loaded
from chipwise.host.files import printable
from chipwise.monitor.known import LARGEST_S32
from chipwise.program.program_file import opened_name


def mark_of(program):
    """Checksum of a program's path and of the state of its file; 0: none."""
    state = loaded.identity(program) if program else None
    return state and (zlib.crc32(repr((program, state)).encode("utf-8", "backslashreplace")) & LARGEST_S32 or 1) or 0


class CarriedFeed:
    """Of one LinuxCNC; follow() at each look, after program-mark and program-running are set.

    What is to be said waits for a move of the run or its end: a message before the first line of chipwise would take
    the place of the command that has started the run, so that glue/task.py could not tell where it starts, and a
    program whose only F comes first would not get M251."""

    def __init__(self, pins, inform, feed_is_remapped):
        """inform: function of a text for the operator.  feed_is_remapped: the program's first F says that M251 has
        ended (glue/volumetric.py)."""
        self.pins, self.inform, self.feed_is_remapped = pins, inform, feed_is_remapped
        self.was_carried = self.was_running = self.feed_of_mdi = self.is_due = False
        self.text, self.line = "", 0

    def follow(self, program, line):
        """program: path; line: of the last move that was carried out, in this run or one before it."""
        running, carried = bool(self.pins["program-running"]), bool(self.pins["feed-carried"])
        if running and not self.was_running:
            self.line = line
        if carried and not self.was_carried:
            self.text = f"{printable(opened_name(program))}: M251 of MDI is in force in this run, and ends with it"
        if self.is_due and not carried and not self.feed_is_remapped:
            self.text = "M251 of MDI has ended with the start of a program, so F is as programmed"
        self.is_due = running and not self.was_running and self.feed_of_mdi  # in the next look it is decided
        if not running:
            self.feed_of_mdi = bool(self.pins["mode"])
        self.was_running, self.was_carried = running, carried
        if self.text and (not running or line not in (0, self.line)):
            text, self.text = self.text, ""
            self.inform(text)
