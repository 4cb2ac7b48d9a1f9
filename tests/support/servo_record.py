# SPDX-License-Identifier: GPL-2.0-or-later
"""Pins of a running LinuxCNC, every servo period: what a test waits for cannot be over before it looks.

Called by scripted_display.py.  A sampler at the end of the servo thread writes a row per period to a file, through
halsampler.  The display reads rows when it comes to it, however late that is: `first()` finds the period in which
a pin got to a value, `span()` gives lowest and highest of the periods after that.
"""

import os
import subprocess
import tempfile
import time

import hal

from chipwise.headless import session
from chipwise.host import halcmd

DEPTH = 60000  # rows the sampler keeps until halsampler has read them: a minute of servo periods
KEPT = 20000  # rows before the mark
GROWS_S = 300 * session.SPEED  # in real time, however fast the clock is
LETTERS = {hal.HAL_FLOAT: "f", hal.HAL_BIT: "b", hal.HAL_S32: "s", hal.HAL_U32: "u"}
SAMPLER = "sampler"


class RecordError(Exception):
    """The record has a gap, or does not grow."""


class Record:
    """Rows (one list of floats per servo period) of some pins; `mark` is the row that the next question begins at.

    The last column is a number that now() raises: the row in which it first stands is the period of that now(), however
    much of the record is still on its way through halsampler.  Rows are kept as text until they are looked at, and
    those long before the mark are dropped: a session may last for many minutes.
    """

    def __init__(self, wanted, period_s):
        self.period_s, self.lines, self.first_row, self.mark = period_s, [], 0, 0
        there = {row["NAME"]: row["TYPE"] for row in hal.get_info_pins()}
        self.columns = {name: k for k, name in enumerate(name for name in wanted if name in there)}
        self.rest, self.file, self.reader = "", None, None
        self.serial, self.searched = 0, None  # of the last now(), and how far its row has been looked for
        self.component = hal.component("servo-record")
        self.component.newpin("mark", hal.HAL_U32, hal.HAL_OUT)
        self.component.ready()
        if self.columns and SAMPLER not in halcmd.components():
            self.start(there)
        else:
            self.columns = {}

    def start(self, types):
        """The sampler on all pins; halsampler begins to read it."""
        halcmd.halcmd(
            "loadrt", SAMPLER, f"depth={DEPTH}", "cfg=" + "".join(LETTERS[types[name]] for name in self.columns) + "u"
        )
        for name, k in self.columns.items():
            signal = halcmd.signal_of(name)
            halcmd.halcmd("net", *([signal] if signal else [f"recorded-{k}", name]), f"{SAMPLER}.0.pin.{k}")
        halcmd.halcmd("net", "recorded-mark", "servo-record.mark", f"{SAMPLER}.0.pin.{len(self.columns)}")
        descriptor, path = tempfile.mkstemp(suffix=".record")
        os.close(descriptor)
        self.file = open(path)
        self.reader = subprocess.Popen(["halsampler", "-t", path], stdin=subprocess.DEVNULL)
        halcmd.halcmd("addf", f"{SAMPLER}.0", "servo-thread")
        self.wait_rows(1)

    def read(self):
        """Take in what has been written since the last time."""
        if self.file is None:
            return
        *lines, self.rest = (self.rest + self.file.read()).split("\n")
        for line in lines:
            if line.strip() == "overrun":
                raise RecordError("servo periods are missing in the record")
            self.lines.append(line)

    def row(self, number):
        """The pins in a period, counted from the first one."""
        return [float(word) for word in self.lines[number - self.first_row].split()[1:]]

    @property
    def count(self):
        """How many periods have been recorded."""
        return self.first_row + len(self.lines)

    def forget(self):
        """Drop what is long before the mark."""
        old = self.mark - self.first_row
        if old > KEPT:
            del self.lines[:old]
            self.first_row = self.mark

    def wait_rows(self, count, seconds=GROWS_S):
        """Until there are so many rows."""
        end = time.monotonic() + seconds
        while self.count < count:
            if time.monotonic() > end:
                raise RecordError("the record does not grow")
            time.sleep(0.005)
            self.read()

    def now(self):
        """What follows counts from here."""
        if self.columns:
            self.searched = self.mark if self.searched is None else self.searched
            self.serial += 1
            self.component["mark"] = self.serial

    def find_mark(self):
        """Put the mark where now() was last called."""
        while self.searched is not None:
            self.wait_rows(self.searched + 1)
            if self.row(self.searched)[-1] >= self.serial:
                self.mark, self.searched = self.searched, None
                self.forget()
            else:
                self.searched += 1

    def first(self, pin, holds):
        """A function that says whether there has been a row, from the mark on, in which holds(value); the mark goes
        there."""
        self.find_mark()
        column, seen = self.columns[pin], self.mark

        def reached(_status=None):
            nonlocal seen
            self.read()
            while seen < self.count:
                if holds(self.row(seen)[column]):
                    self.mark = seen
                    return True
                seen += 1
            return False

        return reached

    def pass_by(self, seconds):
        """The mark goes so much further."""
        self.find_mark()
        self.mark += round(seconds / self.period_s)
        self.wait_rows(self.mark)

    def span(self, seconds, pins):
        """[lowest, highest] of each pin in the periods after the mark, which goes to their end."""
        self.find_mark()
        count = max(1, round(seconds / self.period_s))
        self.wait_rows(self.mark + count)
        rows = [self.row(number) for number in range(self.mark, self.mark + count)]
        self.mark += count
        return [[extreme(row[self.columns[pin]] for row in rows) for extreme in (min, max)] for pin in pins]

    def close(self):
        if self.reader is not None:
            self.reader.terminate()
            self.reader.wait()
