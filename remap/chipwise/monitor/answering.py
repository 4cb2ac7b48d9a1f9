# SPDX-License-Identifier: GPL-2.0-or-later
"""A process that reads the loaded program for chipwise-monitor: an order as JSON goes in, an answer as JSON comes out,
nobody waits.

Called by set_up.py, shadow.py and comment_clamps.py.
"""

import contextlib
import json
import time

from chipwise.check import asked
from chipwise.host.clock import patience

READ_S = 120.0  # until a process that reads is ended
NO_ANSWER = {"why": "it could not be read within the time and memory for it"}


class Answering:
    """At most one process at a time, of one module."""

    def __init__(self, module):
        self.module, self.child, self.since = module, None, 0.0

    def ask(self, order):
        """Begin; what was asked before is forgotten."""
        self.end()
        self.child = asked.start(self.module)
        self.since = time.monotonic()
        with contextlib.suppress(BrokenPipeError):
            self.child.stdin.write(json.dumps(order).encode())
            self.child.stdin.close()

    def take(self):
        """The answer, once; None until it is there.  It has to be shorter than what a pipe holds."""
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
        asked.end(self.child)
        self.child.stdout.close()
        self.child = None
