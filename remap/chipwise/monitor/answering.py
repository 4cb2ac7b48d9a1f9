# SPDX-License-Identifier: GPL-2.0-or-later
"""A process that reads the loaded program for chipwise-monitor: an order as JSON goes in, an answer as JSON comes out, nobody waits.

Called by set_up.py.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time

from chipwise.clock import patience

READ_S = 120.0          # until a process that reads is ended
REMAP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
NO_ANSWER = {"why": "it could not be read within the time and memory for it"}


class Answering:
    """At most one process at a time, of one module."""

    def __init__(self, module):
        self.module, self.child, self.since = module, None, 0.0

    def ask(self, order):
        """Begin; what was asked before is forgotten."""
        self.end()
        self.child = subprocess.Popen([sys.executable, "-m", self.module, str(os.getpid())], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                      stderr=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": REMAP}, start_new_session=True)
        self.since = time.monotonic()
        with contextlib.suppress(BrokenPipeError):
            self.child.stdin.write(json.dumps(order).encode())
            self.child.stdin.close()

    def take(self):
        """The answer, once; None as long as there is none.  It is shorter than a pipe holds."""
        if self.child is None:
            return None
        if self.child.poll() is None:
            if time.monotonic() - self.since <= patience(READ_S):
                return None
            text = b""
        else:
            text = self.child.stdout.read()
        self.end()
        try:
            return json.loads(text)
        except ValueError:
            return NO_ANSWER

    def end(self):
        """Nobody wants the answer any more."""
        if self.child is None:
            return
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.child.pid, signal.SIGKILL)
        self.child.wait()
        self.child.stdout.close()
        self.child = None
