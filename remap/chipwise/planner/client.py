# SPDX-License-Identifier: GPL-2.0-or-later
"""Plans cycles in a process of its own, so that nothing a program asks for can hold up the task or the preview.

Called by glue/session.py.  The process is planner/server.py; one belongs to each interpreter and stays for its life.

    plan = ask(order)                   an Order of planner/plans.py; the process begins at once
    while not plan.ready(0.1): ..       wait so long at most; what is queued goes on moving, the task serves Stop
    outcome = plan.outcome()            an Outcome, or the CycleError that it ended with

Rules:
 1. A plan has a budget: computing time, memory, moves (settings PLAN_TIME, PLAN_MEMORY, PLAN_MOVES).  Computing time is
    counted by the kernel for the process, so other load on the machine takes nothing from it.
 2. LinuxCNC does not tell a remap that its program was aborted.  So computing time is lent: LEASE_S at first, more each
    time somebody asks for the plan.  A plan nobody asks for any more ends after that; one asked for later begins again.
 3. The next order ends a plan that is still under way.  The kernel ends the process with its parent.
 4. An answer is received in parts, for as long as the caller has patience, and its chunks are taken apart one by one
    (Packed of order.py):  a plan of 500,000 moves has 25 MB.
 5. A process that ended in any other way than by rules 1 and 2 is tried a second time, with a new one.
"""

import math
import os
import pickle
import resource
import select
import signal
import socket
import struct
import subprocess
import time

from chipwise.host.clock import patience
from chipwise.errors import CycleError
from chipwise.host.processes import cpu_s

PYTHON = "/usr/bin/python3"  # the interpreter LinuxCNC is built for
RUNNER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "server.py")

LEASE_S = 2  # computing time without a question; RLIMIT_CPU counts whole seconds
STUCK_S = 60.0  # a process that computes nothing for so long waits for something that never comes
TRIES = 2
HEAD = struct.Struct("!Q")  # before each message: its length
_PART = 1 << 20


class _Process:
    """The runner and the socket to it."""

    def __init__(self):
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "LC_ALL": "C"}
        self._socket, other = socket.socketpair()
        with other:
            self._child = subprocess.Popen(
                [PYTHON, "-s", RUNNER, str(os.getpid())], env=environment, stdin=other.fileno(), stdout=other.fileno()
            )
        self._socket.setblocking(False)
        self.pid = self._child.pid
        self._unsent, self._received, self._count = b"", [], 0

    def send(self, message):
        """Queue a message; exchange() sends it."""
        self._unsent = memoryview(HEAD.pack(len(message)) + message)

    def exchange(self, timeout):
        """Send and receive for so long (s) at most, one part at least.  -> the reply, None while it is not there as a
        whole.  Raises EOFError at its end."""
        end = time.monotonic() + timeout
        poll = select.poll()
        if self._socket.fileno() < 0:
            raise EOFError
        while True:
            poll.register(self._socket, select.POLLIN | (select.POLLOUT if self._unsent else 0))
            ready = dict(poll.poll(max(0.0, end - time.monotonic()) * 1000.0)).get(self._socket.fileno(), 0)
            try:
                if ready & select.POLLOUT:
                    self._unsent = self._unsent[self._socket.send(self._unsent[:_PART], socket.MSG_NOSIGNAL) :]
                if ready & ~select.POLLOUT:
                    reply = self._read()
                    if reply is not None:
                        return reply
            except BlockingIOError:
                pass
            except ConnectionError as error:
                raise EOFError from error
            if not ready or time.monotonic() >= end:
                return None

    def _read(self):
        part = self._socket.recv(_PART)
        if not part:
            raise EOFError
        self._received.append(part)
        self._count += len(part)
        if self._count - len(part) < HEAD.size:
            self._received = [b"".join(self._received)]
        if self._count < HEAD.size or self._count < HEAD.size + HEAD.unpack_from(self._received[0])[0]:
            return None
        message, self._received, self._count = b"".join(self._received), [], 0
        return memoryview(message)[HEAD.size :]

    def lend(self, until_s):
        """Let it compute until it has had so much in all (s, rounded up); then the kernel ends it."""
        _, hard = resource.prlimit(self.pid, resource.RLIMIT_CPU)
        resource.prlimit(self.pid, resource.RLIMIT_CPU, (math.ceil(until_s), hard))

    def end(self):
        """Kill it where it lives.  -> how it ended, as Popen.returncode."""
        if self._child.poll() is None:
            self._child.kill()
        self._child.wait()
        self._socket.close()
        return self._child.returncode

    def wait(self):
        """How it ended, once its socket has."""
        try:
            self._child.wait(1.0)
        except subprocess.TimeoutExpired:
            pass
        return self.end()

    @property
    def alive(self):
        return self._child.poll() is None


_current = None  # the _Process
_busy = None  # the Plan it works on


def start():
    """Have a process: it takes half a second to come up."""
    global _current
    if _current is None or not _current.alive:
        if _current is not None:
            _current.end()
        _current = _Process()
    return _current


def end():
    """End the process, if there is one, whatever it does."""
    global _current, _busy
    _busy = None
    if _current is not None:
        _current.end()
        _current = None


def ask(order, budget_s):
    """The Plan of an Order (planner/plans.py) that may take budget_s of computing time."""
    global _busy
    if _busy is not None:
        end()
    _busy = Plan(order, budget_s)
    return _busy


class Plan:
    """A plan under way."""

    def __init__(self, order, budget_s):
        self.order, self.budget_s = order, budget_s
        self._message = pickle.dumps(order)
        self._outcome, self._tries = None, 0
        self._begin()

    def _begin(self):
        self._process = start()
        self._had = cpu_s(self._process.pid)
        self._lent = 0.0
        self._seen = self._had, time.monotonic()
        self._lend(self._had)
        self._process.send(self._message)
        self._exchange(0.0)

    def _lend(self, now):
        """Rules 1 and 2: computing time from `now` (s) on."""
        lent = min(self.budget_s, now - self._had + LEASE_S)
        if lent > self._lent:
            self._lent = lent
            self._process.lend(self._had + lent)

    def ready(self, timeout):
        """Whether there is an outcome, after waiting for it so long (s) at most."""
        self._exchange(0.0)  # an answer that is there counts, however late it is fetched
        if self._outcome is None:
            now = cpu_s(self._process.pid)
            if now < math.inf:
                self._lend(now)
                self._watch(now)
            self._exchange(timeout)
        return self._outcome is not None

    def _watch(self, now):
        """End a process that waits for something that never comes."""
        if now != self._seen[0]:
            self._seen = now, time.monotonic()
        elif time.monotonic() - self._seen[1] > patience(STUCK_S):
            self._done(
                CycleError(
                    "planning waits for a file that does not answer", "look at the contour subs on the SUBROUTINE_PATH"
                )
            )
            end()

    def _exchange(self, timeout):
        if self._outcome is not None:
            return
        try:
            reply = self._process.exchange(timeout)
        except EOFError:
            self._ended(self._process.wait())
            return
        if reply is not None:
            self._done(pickle.loads(reply))

    def _ended(self, status):
        """The process has ended without an answer."""
        if status == -signal.SIGXCPU and self._lent >= self.budget_s:
            self._done(
                CycleError(
                    f"planning takes more than {self.budget_s:g} s of computing time",
                    "use a larger step, fewer passes or a simpler contour, or raise [CHIPWISE]PLAN_TIME",
                )
            )
            return
        if status != -signal.SIGXCPU:
            self._tries += 1
        if self._tries < TRIES:
            self._begin()
            return
        how = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
        self._done(
            CycleError(
                f"the planning process {how}",
                "try again; if it happens again, raise "
                "[CHIPWISE]PLAN_MEMORY or use a simpler contour, and report the program",
            )
        )

    def _done(self, outcome):
        global _busy
        self._outcome = outcome
        if _busy is self:
            _busy = None

    def outcome(self):
        """The Outcome; raises the CycleError in its place."""
        if isinstance(self._outcome, CycleError):
            raise self._outcome
        return self._outcome
