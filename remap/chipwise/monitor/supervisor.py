# SPDX-License-Identifier: GPL-2.0-or-later
"""Keep a process running: the work of chipwise-monitor in a child, its HAL pins in the parent.

Called by cli/monitor.py.  The parent owns the HAL component and does nothing else, so that little can go wrong in it;
the child has the same pins (HAL is shared memory) and does the work.  A child that dies or hangs is replaced by another
one: pins, names and signals stay.  If the parent is killed the child dies with it, and `chipwise monitor` starts both
again (takeover.py).
"""

import os
import signal
import time

from chipwise.host.clock import patience
from chipwise.monitor import buffers
from chipwise.host.processes import die_with_parent

LOOK_S = 1.0  # between two looks at the heartbeat
GLANCE_S = 0.02  # between two looks at the signals
HUNG_S = 30.0  # without a heartbeat: the child is ended and replaced
CALM_S = 10.0  # a child that lived this long is replaced at once, else after a pause
PAUSE_S = 1.0
LAST_WORDS_S = 120.0  # for a child that has been asked to end: it may have a stock to save

OURS = {signal.SIGTERM, signal.SIGINT, signal.SIGCHLD}


def how_it_ended(status):
    """The status of os.waitpid as words."""
    code = os.waitstatus_to_exitcode(status)
    return f"was ended by signal {-code}" if code < 0 else f"ended with status {code}"


def next_signal(seconds):
    """The number of the next of OURS, None if none comes in so many seconds.

    It polls, because signal.sigtimedwait(OURS, seconds) returns a signal that was never sent if the process was stopped
    and continued after that time (SIGSTOP, a debugger, a machine that slept; Python 3.11, Modules/signalmodule.c)."""
    until = time.monotonic() + seconds
    while True:
        seen = signal.sigtimedwait(OURS, 0)
        if seen is not None:
            return seen.si_signo
        if time.monotonic() >= until:
            return None
        time.sleep(GLANCE_S)


class Child:
    """A process that works."""

    def __init__(self, number):
        """number: that of the process."""
        self.number = number
        self.born = self.beaten = time.monotonic()  # s

    def ended(self):
        """Status of the child if it has ended, else None.  LinuxCNC's buffers are free then."""
        number, status = os.waitpid(self.number, os.WNOHANG)
        if not number:
            return None
        buffers.give_back(number)
        return status

    def kill(self):
        os.kill(self.number, signal.SIGKILL)

    def end(self):
        """Ask the child to end and wait for it."""
        os.kill(self.number, signal.SIGTERM)
        until = time.monotonic() + patience(LAST_WORDS_S)
        while time.monotonic() < until:
            if self.ended() is not None:
                return
            time.sleep(GLANCE_S)
        self.kill()
        os.waitpid(self.number, 0)
        buffers.give_back(self.number)


class Supervisor:
    """One child after the other, until one ends by itself with status 0 or we are asked to end."""

    def __init__(self, work, heartbeat):
        """work: function of the reason why the child before has ended ('' for the first one), run in the child, which
        ends with it.  heartbeat: function -> a number that changes while the child works."""
        self.work, self.heartbeat = work, heartbeat
        self.last_beat = None

    def start(self, reason):
        """-> the Child."""
        parent, number = os.getpid(), os.fork()
        if number:
            return Child(number)
        status = 1
        try:
            die_with_parent(parent)
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles it
            signal.pthread_sigmask(signal.SIG_UNBLOCK, OURS)
            self.work(reason)
            status = 0
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 0
        except BaseException as error:  # reported in the log; the parent starts another child
            print(f"chipwise-monitor: {type(error).__name__}: {error}", flush=True)
        finally:
            os._exit(status)  # without destructors: the component is the parent's

    def look(self, child):
        """End a child that hangs; -> whether it did."""
        beat, now = self.heartbeat(), time.monotonic()
        if beat != self.last_beat:
            self.last_beat, child.beaten = beat, now
        if now - child.beaten < patience(HUNG_S):
            return False
        child.kill()
        return True

    def run(self):
        signal.pthread_sigmask(signal.SIG_BLOCK, OURS)
        child, hung = self.start(""), False
        while True:
            if next_signal(LOOK_S) in (signal.SIGTERM, signal.SIGINT):
                child.end()
                return
            status = child.ended()
            if status is None:
                hung = self.look(child) or hung
            elif status == 0:
                return
            else:
                if time.monotonic() - child.born < CALM_S and self.pause():
                    return
                child = self.start(f"hung for {HUNG_S:g} s" if hung else how_it_ended(status))
                hung = False

    @staticmethod
    def pause():
        """Wait a little; -> whether we have been asked to end meanwhile."""
        until = time.monotonic() + PAUSE_S
        while time.monotonic() < until:
            if signal.sigpending() & {signal.SIGTERM, signal.SIGINT}:
                return True
            time.sleep(0.02)
        return False
