"""Connecting and reading the sampler of hal/headless.hal.

The pins of log.COLUMNS are found by name: one that already feeds a signal is
tapped there, whatever the signal is called; one this machine does not have is
left out and its figures are unknown.
"""

import os
import subprocess
import time

from chipwise.machine import log as runlog

SAMPLER = 'sampler.0'
DRAIN_TIMEOUT_S = 5.0


def halcmd(*words):
    return subprocess.run(['halcmd', '-s'] + list(words), text=True, check=False,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE)


def pins():
    """-> {pin name: signal name or None} of everything in HAL."""
    found = {}
    for line in halcmd('show', 'pin').stdout.splitlines():
        words = line.split()
        if len(words) >= 5:
            linked = len(words) >= 7 and words[5] in ('==>', '<==', '<=>')
            found[words[4]] = words[6] if linked else None
    return found


class Sampling:
    """The sampler, from connected to read out."""

    def __init__(self, path):
        self.path = path
        self.reader = None
        self.columns = set()        # names of the columns this machine has

    def start(self):
        """Connect the pins, start the reader and then the sampling.

        -> False where the machine has no sampler: no figures then.
        """
        present = pins()
        if SAMPLER + '.enable' not in present:
            return False
        for number, (name, pin, _type) in enumerate(runlog.COLUMNS):
            if pin not in present:
                continue
            target = '%s.pin.%d' % (SAMPLER, number)
            signal = present[pin] or 'headless-' + name.replace('_', '-')
            words = ['net', signal, target] if present[pin] else ['net', signal, pin, target]
            if halcmd(*words).returncode == 0:
                self.columns.add(name)
        self.reader = subprocess.Popen(['halsampler', '-t', self.path],
                                       stdin=subprocess.DEVNULL)
        time.sleep(0.1)
        halcmd('setp', SAMPLER + '.enable', '1')
        return True

    def stop(self):
        """Stop sampling, let the reader drain the fifo and end."""
        if self.reader is None:
            return
        halcmd('setp', SAMPLER + '.enable', '0')
        end = time.monotonic() + DRAIN_TIMEOUT_S
        while time.monotonic() < end:
            if halcmd('getp', SAMPLER + '.curr-depth').stdout.strip() in ('0', ''):
                break
            time.sleep(0.05)
        time.sleep(0.1)
        self.reader.terminate()
        try:
            self.reader.wait(DRAIN_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self.reader.kill()
            self.reader.wait()
        self.reader = None

    def load(self):
        """-> the log; after stop()."""
        return runlog.load_text(self.path) if os.path.exists(self.path) else None
