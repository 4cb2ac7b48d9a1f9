# SPDX-License-Identifier: GPL-2.0-or-later
"""Connecting and reading the sampler of hal/headless.hal.

The pins of log.COLUMNS are found by name.  A pin that is on a signal is read
from that signal; a pin that this machine does not have is left out, and its
figures are unknown.
"""

import os
import subprocess
import time

from chipwise.host.clock import patience
from chipwise.host.halcmd import attempt, getp, pins
from chipwise.headless import log as runlog

SAMPLER = "sampler.0"
DRAIN_TIMEOUT_S = 60.0


class Sampling:
    """The sampler, from connected to read out."""

    def __init__(self, path):
        self.path = path
        self.reader = None
        self.columns = set()  # names of the columns this machine has
        self.overruns = (
            0  # periods without a sample, because the reader was late: the samples' own counter leaves them out
        )

    def start(self):
        """Connect the pins, start the reader and then the sampling.

        -> False if the machine has no sampler, and so no figures.
        """
        present = pins()
        if SAMPLER + ".enable" not in present:
            return False
        for number, (name, pin, _type) in enumerate(runlog.COLUMNS):
            if pin not in present:
                continue
            target = "%s.pin.%d" % (SAMPLER, number)
            _arrow, theirs = present[pin]
            words = ["net", theirs, target] if theirs else ["net", "headless-" + name.replace("_", "-"), pin, target]
            if attempt(*words).returncode == 0:
                self.columns.add(name)
        self.reader = subprocess.Popen(["halsampler", "-t", self.path], stdin=subprocess.DEVNULL)
        time.sleep(0.1)
        self.overruns = -self._counted()
        attempt("setp", SAMPLER + ".enable", "1")
        return True

    @staticmethod
    def _counted():
        return int(getp(SAMPLER + ".overruns") or 0)

    def stop(self):
        """Stop sampling, let the reader drain the fifo and end."""
        if self.reader is None:
            return
        attempt("setp", SAMPLER + ".enable", "0")
        end = time.monotonic() + patience(DRAIN_TIMEOUT_S)
        while time.monotonic() < end:
            if getp(SAMPLER + ".curr-depth") in ("0", ""):
                break
            time.sleep(0.05)
        self.overruns += self._counted()
        time.sleep(0.1)
        self.reader.terminate()
        try:
            self.reader.wait(patience(DRAIN_TIMEOUT_S))
        except subprocess.TimeoutExpired:
            self.reader.kill()
            self.reader.wait()
        self.reader = None

    def load(self):
        """-> the log; after stop()."""
        return runlog.load_text(self.path) if os.path.exists(self.path) else None
