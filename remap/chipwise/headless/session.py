# SPDX-License-Identifier: GPL-2.0-or-later
"""One run of a program on a running LinuxCNC, with nobody at the screen.

    E-stop reset -> machine on -> home all -> open -> run -> idle again

run() is called by bin/chipwise-headless.  Each step commands a state and polls
until it is reached or its time is over, so that a LinuxCNC that has died ends
the run with an error and never hangs it.  A stop by a guard ends the run too,
because nobody presses Stop.
"""

import os
import time

import linuxcnc

from chipwise.host import processes

POLL_S = 0.010
ALIVE_S = 0.5  # between two looks whether the task still runs: /proc is read for that
SPEED = float(os.environ.get("CHIPWISE_SPEED", 1.0))  # of the clock, in a sandbox
STEP_TIMEOUT_S = 100.0 * SPEED  # for every step but the program itself: patience is in real time
AGAIN_S = 10.0  # a state that is not reached is commanded again; by the clock of LinuxCNC, whose own time-out is 5 s
IDLE_POLLS = 20  # the interpreter is idle when it was this many times
GUARD_S = 0.2  # a guard's stop that lasts as long is one
GUARD_WORDS_S = 10.0 * SPEED  # for its message to come
GUARD_WORDS = "stopped"  # in that message (monitor/messages.py: guard_text)
# What the guard says of a busy computer (chipwise_guard.comp): an error, as the realtime side has nothing else,
# although the program goes on by itself.
WAITED = "chipwise: a traverse waits because chipwise-monitor has not described tool "
INTERP_ERROR = 5  # interp_return.hh; not among the module's constants


class SessionError(Exception):
    """The machine did not reach a commanded state; str() has the state and the reason."""


class Guard:
    """chipwise-guard.0 as the pins show it; a machine need not have one."""

    def __init__(self):
        self.component = None
        self.since = None  # time.monotonic() when it was first seen to stop the machine

    def pin(self, name):
        """Value of one of its pins, None if there is none."""
        return self.value("chipwise-guard.0." + name)

    def value(self, name):
        """Value of any pin, None if there is none."""
        import hal

        if self.component is None:
            self.component = hal.component("chipwise-headless-%d" % os.getpid())
            self.component.ready()
        try:
            return hal.get_value(name)
        except RuntimeError:
            return None

    def stopped(self):
        """Whether it has stopped the machine for GUARD_S."""
        now = time.monotonic()
        if not self.pin("stop"):
            self.since = None
        elif self.since is None:
            self.since = now
        return self.since is not None and now - self.since >= GUARD_S


class Session:
    """The command, status and error channels of a running LinuxCNC."""

    def __init__(self, deadline):
        self.deadline = deadline  # time.monotonic(), s
        self.command = linuxcnc.command()
        self.status = linuxcnc.stat()
        self.channel = linuxcnc.error_channel()
        self.errors = []
        self.messages = []
        self.notes = []
        self.failure = ""  # why the program does not count as finished: the task's error state
        self.guard = Guard()

    # --- polling ------------------------------------------------------------

    def poll(self):
        """Fetch status and messages; LinuxCNC gone is a SessionError."""
        try:
            self.status.poll()
        except linuxcnc.error as error:
            raise SessionError("LinuxCNC does not answer: %s" % error) from error
        if self.status.state == linuxcnc.RCS_ERROR:
            self.note_failure("in an error state")
        self.collect_messages()

    def note_failure(self, what):
        """Keep what the task reports, and at which line: the first report is the cause."""
        s = self.status
        if not self.failure:
            self.failure = "LinuxCNC was %s at line %d (interpreter %d, execution %d, motion line %d)" % (
                what,
                s.current_line,
                s.interp_state,
                s.exec_state,
                s.motion_line,
            )
            if (
                s.exec_state == linuxcnc.EXEC_ERROR
            ):  # of all its causes the one without a message (emctaskmain.cc, usrmotintf.cc)
                self.failure += (
                    "; if no message says why, its motion did not answer a command within [EMCMOT]COMM_TIMEOUT, as on "
                    "a "
                    "computer that was blocked: run it again, or raise COMM_TIMEOUT"
                )

    def collect_messages(self):
        while True:
            message = self.channel.poll()
            if not message:
                return
            kind, text = message
            serious, text = kind in (linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR), text.strip()
            waited = text.startswith(WAITED)
            (self.notes if waited else self.errors if serious else self.messages).append(text)

    def wait(self, what, reached, timeout=STEP_TIMEOUT_S):
        """Poll until reached(status); what names it for the error text."""
        looked = time.monotonic()
        end = min(looked + timeout, self.deadline)
        while True:
            self.poll()
            if reached(self.status):
                return
            now = time.monotonic()
            if now > end:
                raise SessionError("%s: not reached in time" % what)
            if now - looked > ALIVE_S:
                looked = now
                if not task_runs():
                    raise SessionError("%s: the LinuxCNC task has ended" % what)
            time.sleep(POLL_S)

    # --- steps --------------------------------------------------------------

    def set_state(self, state, what, reached):
        """Command a state, and again until reached(status).

        The task drops what its io does not answer within 5 s, as on a computer that was blocked, and tells nobody."""
        self.command.state(state)
        sent = time.monotonic()

        def is_so(status):
            nonlocal sent
            if reached(status):
                return True
            if time.monotonic() - sent > AGAIN_S:
                self.command.state(state)
                sent = time.monotonic()
            return False

        self.wait(what, is_so)

    def switch_on(self):
        self.set_state(linuxcnc.STATE_ESTOP_RESET, "E-stop reset", lambda s: s.task_state != linuxcnc.STATE_ESTOP)
        self.set_state(linuxcnc.STATE_ON, "machine on", lambda s: s.task_state == linuxcnc.STATE_ON)

    def set_mode(self, mode, name):
        self.command.mode(mode)
        self.wait(name + " mode", lambda s: s.task_mode == mode)

    def home(self):
        self.set_mode(linuxcnc.MODE_MANUAL, "manual")
        self.command.teleop_enable(0)
        self.wait("joint mode", lambda s: s.motion_mode == linuxcnc.TRAJ_MODE_FREE)
        self.command.home(-1)
        self.wait("home", lambda s: all(s.homed[: s.joints]))

    def open(self, program):
        self.set_mode(linuxcnc.MODE_AUTO, "auto")
        self.command.program_open(program)
        self.wait("open " + program, lambda s: os.path.realpath(s.file or "") == os.path.realpath(program))

    def run_program(self):
        """Run the open program until the interpreter stays idle.

        -> how long it has been idle when that is certain, s.
        """
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        self.wait("start of program", lambda s: s.echo_serial_number >= self.command.serial)
        idle, idle_since = 0, 0.0

        def ended(status):
            nonlocal idle, idle_since
            if status.paused and status.interp_state == linuxcnc.INTERP_PAUSED:
                self.command.auto(linuxcnc.AUTO_RESUME)  # M0: nobody to press Start
            idle = idle + 1 if is_at_rest(status) else 0
            idle_since = time.monotonic() if idle <= 1 else idle_since
            return idle >= IDLE_POLLS or status.task_state != linuxcnc.STATE_ON or self.guard.stopped()

        self.wait("end of program", ended, timeout=float("inf"))
        if self.guard.since is not None:
            self.give_up_at_guard()
        if self.status.task_state != linuxcnc.STATE_ON:
            raise SessionError("the machine went off while the program ran")
        if self.status.interpreter_errcode == INTERP_ERROR:
            self.note_failure("left with an interpreter error")
        return time.monotonic() - idle_since

    def give_up_at_guard(self):
        """Nobody presses Stop: wait for the message, abort, SessionError."""
        line, end = self.guard.pin("line"), time.monotonic() + GUARD_WORDS_S
        while not any(GUARD_WORDS in text for text in self.errors) and time.monotonic() < end:
            self.poll()
            time.sleep(POLL_S)
        self.command.abort()
        self.wait("abort", lambda s: s.interp_state == linuxcnc.INTERP_IDLE)
        raise SessionError("a guard has stopped the program (line %d)" % line)


def is_at_rest(status):
    """Whether nothing is left of a line or program.  A machine that has taken a move and not begun it looks the same
    for a moment."""
    return status.interp_state == linuxcnc.INTERP_IDLE and status.inpos and status.queue == 0


def task_runs():
    """Whether a milltask process lives; the status buffer outlives a crash."""
    return bool(processes.named("milltask", "linuxcnctask"))


def wait_for_task(deadline):
    """Wait until the task has come up: linuxcnc starts the display alongside."""
    while True:
        try:
            status = linuxcnc.stat()
            status.poll()
            if status.task_state and task_runs():
                return
        except linuxcnc.error:
            pass
        if time.monotonic() > deadline:
            raise SessionError("LinuxCNC did not start")
        time.sleep(POLL_S)
