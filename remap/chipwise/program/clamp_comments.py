# SPDX-License-Identifier: GPL-2.0-or-later
"""CLAMP comments of a program that is read, as CLAMP records, and M256.  Called by reader_runner.py, whose Canon has
job, machine coordinates and _event().

A comment counts from the first move behind it on, in the units and work coordinates of that move: comments at the head
of a program stand before its G20 and G54.
"""

import math

from chipwise.program.records import CLAMP, CLAMP_SET_UP
from chipwise.clamps import comment as comments
from chipwise.errors import CycleError, unnamed
from chipwise.program.canon import INCH

_INCH_UNITS, _G20 = 1, 200  # of the interpreter's length_units, and of its state behind a line


class ClampComments:
    """Part of a Canon.  `pending`: [(line, inside of a comment)] that no move has followed yet."""

    pending: list
    clamps = 0  # until now
    units = 0  # of the state behind the line before

    def _in_inch(self):
        """Whether the line that is executed has inches."""
        return int(self._interpreter.length_units) == _INCH_UNITS if self._interpreter else self.units == _G20

    def refuse_lost(self):
        """Refuse a program with a CLAMP comment that LinuxCNC does not execute."""
        if self.job["clamps"]:
            with open(self.job["program"], "rb") as program:
                found = comments.lost(program.read())
            if found:
                self.line = found[0]
                self.refuse(found[1], "give it a line of its own")

    def clamp_comment(self, text):
        """A comment of the program."""
        inside = comments.inside(text) if self.job["clamps"] else None
        if inside is not None:
            if self.clamps + len(self.pending) >= comments.MOST:
                self.refuse(f"the program has more than {comments.MOST} clamps", "leave some out")
            self.pending.append((self.line, inside))

    def clamp_set_up(self, line, number):
        """M256 (program/preview.py)."""
        if self.job["clamps"]:
            self.line, self.pending = line, []
            self._event(CLAMP_SET_UP, number)

    def place_clamps(self):
        """Those that are pending, before a move."""
        here, unit = self.line, INCH if self._in_inch() else 1.0
        for line, inside in self.pending:
            self.line = line
            try:
                low, high, shape = comments.read(inside, unit)
            except CycleError as error:
                self.refuse(unnamed(error.text()), "")
            self.box_event(CLAMP, shape, low, high)
            self.clamps += 1
        self.line, self.pending = here, []

    def box_event(self, kind, shape, low, high):
        """A box or cylinder, mm in the work coordinates in force."""
        middle = [(a + b) / 2 for a, b in zip(low, high)]
        half = [(b - a) / 2 for a, b in zip(low, high)]
        place = self._machine(*(value / INCH for value in middle))
        self._event(
            kind,
            shape,
            math.degrees(self.angle),
            *(p - h for p, h in zip(place, half)),
            *(p + h for p, h in zip(place, half)),
        )
