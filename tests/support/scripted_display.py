#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A display program that does what a test tells it: CHIPWISE_STEPS, a JSON list of steps, one answer each.

    ["home"]                        E-stop reset, machine on, home all
    ["mdi", "G0 X1"]                execute a line; answer: the operator errors it raised
    ["mdi quietly", "G0 X1"]        the same, but goes on at once
    ["jog", axis, distance, velocity]   jog in teleop mode, mm and mm/s; answer: [lowest adaptive-feed seen]
    ["pins", name, ...]             answer: values, as text
    ["position"]                    answer: [x, y, z] commanded, machine units
    ["modes"]                       answer: what of the program outlives it: active codes, feed, speed, path tolerances,
    offsets
    ["sleep", seconds]
    ["open", program]
    ["open text", program text]
    ["run_until_stopped", seconds, line]   run from a line (0: the start) until a guard stops it
                                    (answer true) or it ends (false), for so long and WAIT_S at least
    ["run_from", line]              run from a line; goes on at once
    ["run_until", axis, value]      run until the axis is past the value (machine units, rising)
    ["abort"]
    ["errors"]                      answer: the operator errors since the last time
    ["errors", text]                the same, but waits for one that contains the text; with what is said of a busy
    computer (session.py: WAITED)
    ["kill_monitor"]
    ["kill_worker"]                 only the process of chipwise-monitor that does the work
    ["signal_monitor", "STOP" or "CONT"]    to its processes, at once
    ["watch_monitor"]               from now on it is a fault if chipwise-monitor is silent for the time-out that
    `chipwise load` sets; before, and when one is back (start_monitor, CONT, thaw_worker), it may be for SILENT_S
    ["watch_monitor", seconds]      the same with another time-out
    ["freeze_worker"], ["thaw_worker"]   stop that process with SIGSTOP, let it go on
    ["kill_monitor_in", line, what, seconds]    begin an MDI line; kill the monitor so long after it has begun to "hold"
                                    the map, or to write a file in the folder `what`; the line goes on.
                                    A line that is over before that could be seen is begun again
    ["hold status", seconds]        take LinuxCNC's status buffer for so long, in real time, as a process does that is
    stopped meanwhile
    ["busy", number]                so many processes that do nothing but work, until the end
    ["start_monitor"]               as from a shell, without LinuxCNC's environment; waits until it is ready
    ["monitor_costs"]               answer: [s of computing time that it has taken so far, its looks]
    ["mdi_end"]                     wait for the end of that line; answer: the operator errors it raised
    ["map_sum"]                     answer: [checksum of the map's cells, mm3 removed]
    ["messages"]                    answer: messages other than errors since the start, without the start line
    ["messages", text]              the same, but waits for one that contains the text
    ["start_line"]                  waits for the line with which chipwise says that it runs; answer: it
    ["map", name]                   saves the heights of the map as NAME (.npy), without one as a file beside the
                                    answers; answer: [mm3 removed, name]

    ["start", program text]         open and run a program; goes on at once
    ["until", pin, ">", "<" or "=", number]   wait until a pin has got to a value since the last step but these; answer:
    its value
    ["pause"], ["resume"], ["reverse"], ["forward"], ["abort"], ["estop"], ["off"], ["on"]   as the buttons do; pause
    waits for standstill
    ["until paused"]                wait until the program has stopped for M0 or M1
    ["optional stop", on]           whether M1 stops: the button of a screen
    ["step to end"]                 answer: how many single steps that took
    ["finish"]                      wait for the end of the program; answer: the operator errors since the last answer
    ["over", seconds, pin, ...]     answer: [lowest, highest] of each pin in that time, from the "until" before on
    ["feed override", factor]       the operator's slider
    ["hal", word, ...]              a halcmd command
    ["enter", text, argument, ...]  chipwise enter with the text as standard input; answer: [exit status, output,
    errors]
    ["program", word, ...]          a program in LinuxCNC's environment; answer: [exit status, what it printed]
    ["stop", how, seconds]          abort or estop, so long after the start of the open program; answer: {"served": s
                                    until the task had done it, "stood": s until nothing moved}, both without the time
                                    for which other programs had the processors; "busy": whether the program was still
                                    under way
    ["begin"]                       start the open program; goes on at once
    ["planners until", ">", "<" or "=", number]     wait until so many processes plan cycles; answer: how many
    ["kill", name]                  kill the processes of that name
    ["log", program]                run a program, a path or its text, and save its servo-rate log
                                    (chipwise.headless.log); the sampler is that of hal/headless.hal, so that "until"
                                    looks at live pins; answer: [the operator errors it raised, path of the log]
    ["log together", program]       the same, but both overrides are 0 % until the task has sent all moves that it can:
                                    how a move begins after a rest depends on whether the next one is there already
    ["kept", path]                  wait until the file of [CHIPWISE]KEEP_STOCK has the stock as it is
    ["fresh"]                       the machine as after the step home: idle and at home without a tool and without an
                                    offset, its own modes, no M251, 100 % override; errors and messages are forgotten.
                                    But there is a stock, of 1 mm, in the machine's corner: removed-volume is 0

The pins of "until" and "over" are recorded every servo period (servo_record.py): however late a loaded machine lets
this program look, nothing that was there for a period is missed.  Pins that are not there at the start are looked at
live.

The answers go to CHIPWISE_ANSWERS as one JSON list.  CHIPWISE_PATIENCE: s of real time that they may take.
"""

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
import zlib

sys.path[:0] = [os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", folder) for folder in ("../remap", "")]

import hal  # noqa: E402
import linuxcnc  # noqa: E402

from chipwise import version
from chipwise.host import halcmd  # noqa: E402
from chipwise.headless import log as runlog  # noqa: E402
from chipwise.headless import sampling, session  # noqa: E402

from support.display_processes import BEAT_PIN, ProcessSteps  # noqa: E402
from support.display_program import RELATIONS, WAIT_S, ProgramSteps  # noqa: E402
from support.servo_record import Record, RecordError  # noqa: E402

# Steps that set the machine going: what comes of them counts from their beginning, of all others from their end.
BEGINNING = ("start", "begin", "run from", "run_from", "mdi quietly", "resume", "reverse", "forward")
LOOKING = ("until", "over", "sleep", "pins", "program")  # these do nothing to the machine
STARTED = f"chipwise: version {version()} is running"
SENT_S, SENT_TURNS = 1.0, 40  # that the task sends no move, and how often it has been at work meanwhile
SETTLE_S = 0.3  # the monitor's messages come this late at most,
SETTLED_S = SETTLE_S * session.SPEED  # where a step asks for them: in real time
# In real time, however fast the clock is: a busy computer takes that longer.
PATIENCE_S = (
    float(os.environ.get("CHIPWISE_PATIENCE", "240")) * session.SPEED
)  # for all steps from the start, or a step "fresh", on
FRESH = (
    "M252",
    "M52 P0",
    "G17 G21 G40 G49 G54 G80 G90 G91.1 G94 G97 G64 P0.01 M48 M5",
    "G10 L2 P1 X0 Y0 Z0 R0",
    "G92.1",
    "G53 G0 Z89.9",
    "G53 G0 X0 Y0",
    "T0 M6",
    "M250 P-49 Q-49 R-59 I1 J1 K1",
)  # RS274NGC_STARTUP_CODE of the INI files, and more


def defined(look):
    """What is seen of the stock map, as soon as there is a stock: a kept one comes some time after the start."""
    end = time.monotonic() + WAIT_S
    while True:
        seen = look()
        if seen is not None or time.monotonic() > end:
            return seen
        time.sleep(0.05)


class Operator(ProgramSteps, ProcessSteps):
    def __init__(self, steps):
        session.wait_for_task(time.monotonic() + session.STEP_TIMEOUT_S)
        self.machine = session.Session(time.monotonic() + PATIENCE_S)
        self.component = hal.component("scripted-display")  # hal.get_value wants one
        self.component.ready()
        self.let_monitor_be_late()
        pins = [step[1:2] if step[0] == "until" else step[2:] for step in steps if step[0] in ("until", "over")]
        period_ns = linuxcnc.ini(os.environ["INI_FILE_NAME"]).find("EMCMOT", "SERVO_PERIOD")
        self.record = Record(dict.fromkeys(sum(pins, [])), int(period_ns) / 1e9)

    def home(self):
        self.machine.switch_on()
        self.machine.home()

    def fresh(self):
        self.machine.deadline = time.monotonic() + PATIENCE_S
        self.abort()
        self.errors()
        self.machine.command.feedrate(1.0)
        for line in FRESH:
            said = [text for text in self.mdi(line) if not text.startswith("Note:")]  # of a homing long ago
            if said:
                raise session.SessionError(f"{line}: {said}")
        self.messages()
        self.machine.messages = []

    def log_together(self, program):
        self.machine.command.feedrate(0.0)
        self.machine.command.rapidrate(0.0)
        let_go = threading.Thread(target=self.let_go_when_sent, daemon=True)
        let_go.start()
        try:
            return self.log(program)
        finally:
            let_go.join()

    def let_go_when_sent(self):
        """100 % as soon as there are moves, and have been as many for SENT_S and SENT_TURNS."""
        status, last, since, turns = linuxcnc.stat(), (0, 0), time.monotonic(), 0
        while not last[0] or time.monotonic() - since < SENT_S or 0 <= (self.task_turns() or 0) - turns < SENT_TURNS:
            status.poll()
            now = status.queue, status.read_line
            if now != last:
                last, since, turns = now, time.monotonic(), self.task_turns() or 0
            time.sleep(0.02)
        self.machine.command.feedrate(1.0)
        self.machine.command.rapidrate(1.0)

    def log(self, program):
        descriptor, path = tempfile.mkstemp(suffix=".npz", dir=os.path.dirname(os.environ["CHIPWISE_ANSWERS"]))
        os.close(descriptor)
        with tempfile.NamedTemporaryFile(suffix=".samples") as samples:
            sampler = sampling.Sampling(samples.name)
            self.open_text(program) if "\n" in program else self.open(program)
            sampler.start()
            try:
                idle_s = self.machine.run_program()
                self.end_is_seen()
            finally:
                sampler.stop()
            runlog.save(
                path,
                runlog.without_tail(sampler.load(), self.record.period_s, idle_s),
                period=self.record.period_s,
                units_per_mm=self.machine.status.linear_units,
            )
        return [self.errors(), path]

    def errors(self, text=None, settle_s=SETTLED_S):
        machine = self.machine
        self.hear(lambda: machine.notes + machine.errors, text, settle_s)
        found = (machine.notes if text else []) + machine.errors
        machine.errors, machine.notes = [], []
        return found

    def messages(self, text=None):
        self.hear(lambda: self.machine.messages, text)
        return [found for found in self.machine.messages if STARTED not in found]

    def start_line(self):
        self.hear(lambda: self.machine.messages, STARTED)
        return next((found for found in self.machine.messages if STARTED in found), None)

    def hear(self, said, text, settle_s=SETTLED_S):
        """What is said for a while, in which chipwise-monitor has had some looks, or until something said contains the
        text (WAIT_S at most)."""
        before = hal.get_value(BEAT_PIN) if hal.component_exists("chipwise-monitor") else None
        time.sleep(SETTLE_S if text else settle_s)
        if text is None:
            self.monitor_looks(before)
            self.task_looks()  # what it hands on of motion and chipwise-monitor
        self.machine.poll()
        end = time.monotonic() + WAIT_S
        while text is not None and not any(text in one for one in said()) and time.monotonic() < end:
            time.sleep(0.05)
            self.machine.poll()

    def mdi(self, line):
        self.machine.set_mode(linuxcnc.MODE_MDI, "MDI")
        self.machine.command.mdi(line)
        self.machine.command.wait_complete(WAIT_S)
        self.rest("end of " + line)
        return self.errors(settle_s=SETTLE_S)

    def mdi_quietly(self, line):
        self.machine.set_mode(linuxcnc.MODE_MDI, "MDI")
        self.machine.command.mdi(line)

    def jog(self, axis, distance, velocity):
        machine = self.machine
        machine.set_mode(linuxcnc.MODE_MANUAL, "manual")
        machine.command.teleop_enable(1)
        machine.wait("teleop", lambda s: s.motion_mode == linuxcnc.TRAJ_MODE_TELEOP)
        there = machine.status.position[axis] + distance
        machine.command.jog(linuxcnc.JOG_INCREMENT, False, axis, velocity, distance)
        lowest, end = 1.0, time.monotonic() + abs(distance / velocity) + WAIT_S
        while abs(machine.status.position[axis] - there) > 1e-6 and time.monotonic() < end:
            lowest = min(lowest, float(self.pins("volumetric-feed.0.adaptive-feed")[0]))
            machine.poll()
        self.rest("end of jog")
        time.sleep(0.5)  # the task still treats it as jogging,
        self.task_looks()  # until it has seen the end
        return [lowest]

    def pins(self, *names):
        """All by one halcmd: where a computer is busy, the machine goes on for long before many have started.  The one
        before it only takes its time, so that the monitor, which is as late there, has had some."""
        halcmd.getp(names[0])
        done = subprocess.run(
            ["halcmd", "-s", "-k", "-f"],
            input="".join(f"getp {name}\n" for name in names),
            text=True,
            capture_output=True,
        )
        found = done.stdout.split()
        return found if len(found) == len(names) else [halcmd.getp(name) for name in names]

    def position(self):
        """At rest as the pins have it: the status of a busy computer comes behind them."""
        joints = range(self.machine.status.joints)
        self.machine.wait(
            "the place in the status",
            lambda s: (
                hal.get_value("motion.current-vel") > 0
                or all(abs(s.joint_position[k] - hal.get_value(f"joint.{k}.pos-cmd")) < 1e-6 for k in joints)
            ),
            WAIT_S,
        )
        return list(self.machine.status.position[:3])

    def modes(self):
        """Without line numbers, and without codes that are not modal."""
        self.machine.poll()
        s = self.machine.status
        return [
            list(s.gcodes[1:2] + s.gcodes[3:16]),
            list(s.mcodes[2:]),
            [round(v, 9) for v in s.settings[1:]],
            list(s.g5x_offset),
            list(s.g92_offset),
            list(s.tool_offset),
            s.rotation_xy,
            s.g5x_index,
        ]

    def sleep(self, seconds):
        before = hal.get_value(BEAT_PIN) if hal.component_exists("chipwise-monitor") else None
        time.sleep(seconds)
        self.record.pass_by(seconds if self.record.columns else 0)
        self.machine.poll()
        if session.is_at_rest(self.machine.status):  # a program would go on meanwhile
            self.monitor_looks(before)

    def mdi_end(self):
        self.rest("end of the line")
        return self.errors()

    def map_sum(self):
        from chipwise.stock import shared

        stock = shared.attach()
        head, cells = defined(stock.take)
        stock.close()
        return [zlib.crc32(cells.tobytes()), head.removed]

    def kept(self, path):
        from chipwise.stock import journal, shared, store

        stock, end = shared.attach(), time.monotonic() + WAIT_S
        while time.monotonic() < end:
            try:
                if journal.read(path, stock.capacity)[1].tobytes() == defined(stock.take)[1].tobytes():
                    stock.close()
                    return
            except store.StoreError:  # not there yet
                pass
            time.sleep(0.1)
        raise session.SessionError(f"{path} does not have the stock")

    def planners_until(self, relation, number):
        """Without a look at the task, which may be dead."""
        end = time.monotonic() + WAIT_S
        while not RELATIONS[relation](self.planners(), number) and time.monotonic() < end:
            time.sleep(0.02)
        return self.planners()

    def map(self, name=""):
        import numpy as np
        from chipwise.stock import shared

        if not name:
            descriptor, name = tempfile.mkstemp(suffix=".npy", dir=os.path.dirname(os.environ["CHIPWISE_ANSWERS"]))
            os.close(descriptor)
        stock = shared.attach()
        seen = defined(stock.snapshot)
        np.save(name, seen.heights)
        stock.close()
        return [seen.removed, name]

    def estop(self):
        self.machine.set_state(linuxcnc.STATE_ESTOP, "E-stop", lambda s: s.task_state == linuxcnc.STATE_ESTOP)
        self.machine.wait("standstill", self.stands)
        time.sleep(0.1)
        self.end_is_seen()

    def off(self):
        self.machine.set_state(linuxcnc.STATE_OFF, "off", lambda s: s.task_state != linuxcnc.STATE_ON)
        self.machine.wait("standstill", self.stands)
        time.sleep(0.1)
        self.end_is_seen()

    def on(self):
        self.machine.switch_on()

    def feed_override(self, factor):
        self.machine.command.feedrate(factor)
        self.machine.wait("feed override", lambda s: abs(s.feedrate - factor) < 1e-6)

    @staticmethod
    def program(*words):
        done = subprocess.run(
            words, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        return [done.returncode, done.stdout]

    def hal(self, *words):
        return halcmd.attempt(*words).stdout.strip()

    def enter(self, text, *arguments):
        command = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "bin", "chipwise")
        done = subprocess.run([command, "enter", *arguments], input=text, text=True, capture_output=True, check=False)
        return [done.returncode, done.stdout, done.stderr]


def main():
    steps = json.loads(os.environ["CHIPWISE_STEPS"])
    operator = Operator(steps)
    answers = []
    try:
        for name, *arguments in steps:
            if name in BEGINNING:
                operator.record.now()
            answers.append(getattr(operator, name.replace(" ", "_"))(*arguments))
            if name not in BEGINNING + LOOKING:
                operator.record.now()
    except (session.SessionError, RecordError) as error:
        answers.append("failed: %s" % error)
    operator.record.close()
    with open(os.environ["CHIPWISE_ANSWERS"], "w") as handle:
        json.dump(answers, handle)


if __name__ == "__main__":
    main()
