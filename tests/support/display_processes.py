# SPDX-License-Identifier: GPL-2.0-or-later
"""Steps of scripted_display.py that look at processes, stop, kill and start them, chipwise-monitor above all.  Its head
says what each step is."""

import contextlib
import ctypes
import os
import signal
import subprocess
import time

import hal
import linuxcnc

from chipwise.cli.load import MONITOR_TIMEOUT_S
from chipwise.host import halcmd, processes
from chipwise.host.clock import patience
from chipwise.headless import session
from chipwise.monitor import buffers

from support.display_program import IDLE_POLLS, WAIT_S

HAL_ANSWERS_S = 3.0
WORKS_S = 2.0  # between two questions whether chipwise-monitor is there and works
BEAT_PIN = "chipwise-monitor.heartbeat"  # counts its looks
TASK_TURNS = 4  # of LinuxCNC's task: it has seen what there was before, and has told of it
TIMEOUT_PIN, FAULT_PIN, UNWATCHED = "stock-tracker.0.monitor-timeout", "stock-tracker.0.fault-code", 16
SILENT_S = 300.0 * session.SPEED  # it may be silent if no step is about that: a busy computer lets it wait
DEAD = "chipwise: chipwise-monitor does not answer"
LOOKS = 6  # an idle computer lets it have more in the shortest wait of a step


def send(pid, number):
    """A signal to a process, which may be gone by now: the worker of chipwise-monitor ends with its parent."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)


def parent_of(pid):
    """0 if there is no such process."""
    return int((processes.stat_fields(pid)[1:2] or [0])[0])


def hal_answers():
    """Whether the mutex of HAL is free.  A process that is stopped while it holds it keeps it, and halcmd, screens and
    this program wait for ever."""
    asked = subprocess.Popen(
        ["halcmd", "-s", "show", "comp", "halcmd"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    with contextlib.suppress(subprocess.TimeoutExpired):  # it ends by itself when the mutex is free
        asked.wait(HAL_ANSWERS_S * session.SPEED)
    return asked.returncode is not None


def stop(pid):
    """SIGSTOP, but not while the process reads or writes one of LinuxCNC's buffers or reads from HAL: nobody else could
    then, LinuxCNC itself included, and LinuxCNC gives up."""
    while True:
        send(pid, signal.SIGSTOP)
        while processes.stat_fields(pid)[:1] not in (["T"], ["Z"], ["X"], []):
            time.sleep(0.001)
        if not buffers.held_by(pid) and hal_answers():
            return
        send(pid, signal.SIGCONT)
        time.sleep(0.001)


def kill(pids):
    """SIGKILL, at such a moment, too: all are stopped first, for a worker ends with its parent."""
    for pid in pids:
        stop(pid)
    for pid in pids:
        send(pid, signal.SIGKILL)


def stolen():
    """s for which a host that this computer is a guest of has kept its processors back."""
    with open("/proc/stat") as handle:
        ticks = int(handle.readline().split()[8])
    return ticks / os.sysconf("SC_CLK_TCK")


class ProcessSteps:
    """Of an Operator, which has a machine (chipwise.headless.session)."""

    @staticmethod
    def planners():
        return sum(
            any(b"planner/server.py" in word for word in processes.command_line(pid)) for pid in processes.pids()
        )

    @staticmethod
    def kill(name):
        for process in processes.named(name):
            send(process, signal.SIGKILL)

    @staticmethod
    def waited():
        """s for which LinuxCNC and this program have waited for a processor, or the computer's host kept one back."""
        total = stolen()
        for process in [os.getpid()] + processes.named("milltask", "rtapi_app", "io"):
            for thread in os.listdir(f"/proc/{process}/task"):
                with open(f"/proc/{process}/task/{thread}/schedstat") as handle:
                    total += int(handle.read().split()[1]) / 1e9
        return total

    @staticmethod
    def monitors():
        """Processes of chipwise-monitor that live.  A child of the one that works has the same command line until it
        runs another program, and until then its parent cannot be stopped (vfork): it is left alone."""
        both = {pid: parent_of(pid) for pid in processes.pids() if processes.command_line(pid)[-1:] == [b"monitor"]}
        return [pid for pid, parent in both.items() if both.get(parent) not in both]

    def let_monitor_be_late(self):
        """It may, until watch_monitor(); what was said of one that was late at the start is forgotten."""
        self.is_watched = False
        if hal.component_exists("chipwise-monitor"):
            self.is_watched = True
            hal.set_p(TIMEOUT_PIN, f"{SILENT_S:g}")
            self.monitor_is_back()
            self.task_looks()
            self.machine.poll()
            self.machine.errors = [text for text in self.machine.errors if not text.startswith(DEAD)]

    def watch_monitor(self, seconds=None):
        """Behind the step that has stopped or killed it, so that no fault can be there before."""
        hal.set_p(TIMEOUT_PIN, f"{seconds or patience(MONITOR_TIMEOUT_S):.17g}")
        self.is_watched = True

    def monitor_is_back(self):
        """It has been told to go on, or there is another one: as soon as its fault is over it may be late again, and no
        second one comes."""
        if self.is_watched:
            self.machine.wait("chipwise-monitor is back", lambda _s: hal.get_value(FAULT_PIN) != UNWATCHED, WAIT_S)
            hal.set_p(TIMEOUT_PIN, f"{SILENT_S:g}")
            self.is_watched = False

    def monitor_costs(self):
        return [sum(map(processes.cpu_s, self.monitors())), hal.get_value(BEAT_PIN)]

    def kill_monitor(self):
        kill(self.monitors())
        while self.monitors():
            time.sleep(0.01)

    def follow_monitor(self, seen):
        """Wait until seen(), as long as chipwise-monitor works: a busy computer keeps it from its next look for
        seconds, and one that is dead or stopped never has another."""
        end, asked = time.monotonic() + WAIT_S, 0.0
        while hal.component_exists("chipwise-monitor") and not seen() and time.monotonic() < end:
            if time.monotonic() > asked + WORKS_S:
                if not self.monitor_works():
                    return
                asked = time.monotonic()
            time.sleep(0.01)

    def monitor_works(self):
        """Whether the process of the component lives, and none of the two is stopped; the pins of one that was killed
        stay, beside those of the next one."""
        owners = [
            int(words[3])
            for words in (line.split() for line in halcmd.attempt("show", "comp").stdout.splitlines())
            if words[2:3] == ["chipwise-monitor"] and words[3:4] and words[3].isdigit()
        ]
        return any(processes.lives(pid) for pid in owners) and not any(
            processes.stat_fields(pid)[:1] == ["T"] for pid in self.monitors()
        )

    def monitor_looks(self, before=None):
        """Wait until chipwise-monitor has looked so often that it has said what there is to say; before: its count at
        the beginning, now."""
        if hal.component_exists("chipwise-monitor"):
            before = hal.get_value(BEAT_PIN) if before is None else before
            self.follow_monitor(lambda: not 0 <= hal.get_value(BEAT_PIN) - before < LOOKS)

    @staticmethod
    def task_turns():
        """Number of cycles that LinuxCNC's task has done, counted by its sleeps; None if no task runs."""
        for pid in processes.named("milltask"):
            with contextlib.suppress(OSError), open(f"/proc/{pid}/status") as handle:
                return next(int(line.split()[1]) for line in handle if line.startswith("voluntary_ctxt_switches"))
        return None

    def task_looks(self, turns=TASK_TURNS):
        """Wait until LinuxCNC's task has been at work, from which a busy computer keeps it for seconds."""
        before, end = self.task_turns(), time.monotonic() + WAIT_S
        while time.monotonic() < end and None not in (before, now := self.task_turns()) and now - before < turns:
            time.sleep(0.01)

    def workers(self):
        """Those of the two that do the work: the children of the others."""
        both = self.monitors()
        return [pid for pid in both if parent_of(pid) in both]

    def kill_worker(self):
        """The child of the two; the parent starts another one."""
        workers = self.workers()
        kill(workers)
        return bool(workers)

    def freeze_worker(self):
        """The process that does the work of chipwise-monitor is stopped until thaw_worker()."""
        self.frozen = self.workers()
        for process in self.frozen:
            stop(process)
        return len(self.frozen)

    def thaw_worker(self):
        for process in self.frozen:
            send(process, signal.SIGCONT)
        self.monitor_is_back()

    def busy(self, number):
        for _ in range(number):
            subprocess.Popen(["sh", "-c", "while :; do :; done"], stdin=subprocess.DEVNULL)

    def hold_status(self, seconds):
        """The semaphore of emcStatus."""
        libc = ctypes.CDLL(None, use_errno=True)
        number = libc.semget(buffers.STATUS, 1, 0)
        take, give = (buffers.Step(0, step, 0) for step in (-1, 1))
        for operation, pause in ((take, seconds * session.SPEED), (give, 0)):
            if number < 0 or libc.semop(number, ctypes.byref(operation), 1):
                raise session.SessionError("status buffer: %s" % os.strerror(ctypes.get_errno()))
            time.sleep(pause)

    def signal_monitor(self, name):
        for process in self.monitors():
            stop(process) if name == "STOP" else send(process, getattr(signal, "SIG" + name))
        if name == "CONT":
            self.monitor_is_back()

    def kill_monitor_in(self, line, what, seconds):
        monitors = self.monitors()
        before = set(os.listdir(what)) if what != "hold" else ()
        self.machine.set_mode(linuxcnc.MODE_MDI, "MDI")
        while not self.caught(
            line, lambda: hal.get_value("chipwise-monitor.hold") if what == "hold" else set(os.listdir(what)) - before
        ):
            self.errors()  # of the line that was over before this program had a look: it is begun again
        time.sleep(seconds)
        kill(monitors)
        while self.monitors():
            time.sleep(0.01)

    def caught(self, line, there):
        """Begin an MDI line; -> whether `there()` was seen before the line was over."""
        idle = 0
        self.machine.command.mdi(line)

        def seen(status):
            nonlocal idle
            idle = (
                idle + 1
                if status.echo_serial_number >= self.machine.command.serial
                and status.interp_state == linuxcnc.INTERP_IDLE
                else 0
            )
            return idle > IDLE_POLLS or bool(there())

        self.machine.wait(line, seen, WAIT_S)
        return idle <= IDLE_POLLS

    def start_monitor(self):
        program = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "bin", "chipwise")
        env = {name: value for name, value in os.environ.items() if name != "INI_FILE_NAME"}
        env["PYTHONFAULTHANDLER"] = "1"  # for what_it_does()
        started = subprocess.Popen([program, "monitor"], cwd="/", env=env, stdin=subprocess.DEVNULL)

        def ready(_status):
            states = [line.split() for line in halcmd.attempt("show", "comp").stdout.splitlines()]
            if started.poll() is not None:
                raise session.SessionError(f"the new chipwise-monitor has ended with status {started.returncode}")
            return any(
                words[2].startswith("chipwise-monitor") and words[3:] == [str(started.pid), "ready"]
                for words in states
                if len(words) > 3
            )

        try:
            self.machine.wait("a new chipwise-monitor", ready, WAIT_S)
        except session.SessionError as error:
            raise session.SessionError(f"{error}; {self.what_it_does(started.pid)}") from error
        self.monitor_is_back()

    @staticmethod
    def what_it_does(pid):
        """A process and those it started, and the components in HAL, for a failure's text; where it is in its source it
        prints."""
        there = [
            (each, processes.command_line(each), processes.stat_fields(each)[:1])
            for each in [pid, *processes.descendants(pid)]
        ]
        text = f"{there}\n{halcmd.attempt('show', 'comp').stdout}"
        send(pid, signal.SIGABRT)
        return text
