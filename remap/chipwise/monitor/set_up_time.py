# SPDX-License-Identifier: GPL-2.0-or-later
"""How long the loaded program would take at F, and set up: pins for the line at its end (panel/display.py).  Called by
shadow.py.

It is simulated in a process of its own (setup/time_process.py), once for each program with an assumed stock, after that
stock is there.  It takes up to a minute of computing time for a large program, so it goes on while the program runs; a
run that ends before has no such figure.
"""

from chipwise.monitor.answering import Answering

PINS = ("at-f-time", "set-up-time")  # s, 0: not known


class SetUpTime:
    """Of one LinuxCNC.  look() at each look of the monitor."""

    def __init__(self, component, is_wanted):
        """is_wanted: whether a set-up can raise the feed above F on this machine."""
        self.pins, self.is_wanted = component, is_wanted
        self.reading = Answering("chipwise.setup.time_process")
        self.key = None  # (program, identity, work offset) that the pins are of

    def ask(self, key, order):
        """order: {"ini", "program", "scene"} of the program of this key; one that was asked for before is not read
        again."""
        if not self.is_wanted or key == self.key:
            return
        self.forget()
        self.key = key
        self.reading.ask(order)

    def look(self, program):
        """program: that LinuxCNC has loaded, None: not known."""
        if self.key and program not in (self.key[0], None):
            self.forget()
        found = self.reading.take()
        if found and "time_with" in found:
            self._show(found["time"], found["time_with"])

    def forget(self):
        """Another program."""
        self.reading.end()
        self.key = None
        self._show(0.0, 0.0)

    def _show(self, *seconds):
        for name, value in zip(PINS, seconds):
            self.pins[name] = value
