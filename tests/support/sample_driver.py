# SPDX-License-Identifier: GPL-2.0-or-later
"""Starts one LinuxCNC with its screen, works on it as an operator would, and says what came of it.

    sample_driver.py INI JOB.json RESULT.json

Run in a sandbox by samples.py.  JOB: `lines` and `after` lists of MDI lines, before and after the program, and
`program` (text) with {placeholders}, `picture` a path for a screenshot, `pins` a list, `watch` pins to be read while
the tool cuts.  RESULT: `started`, `said` (lines of chipwise's in LinuxCNC's output), `output` (its end),
`screen_alive`, `errors` (operator's), `done`, `pins` {name: text}, `during` the same of `watch`, `signals` {pin:
signal}, `paused` (s: the longest pause of this computer).
"""

import json
import os
import subprocess
import sys
import threading
import time

import linuxcnc

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "remap"))

from chipwise.host.halcmd import attempt  # noqa: E402
from chipwise.headless import session  # noqa: E402

START_S = HOME_S = RUN_S = PATIENCE_S = 300.0  # real time; a machine under load is slow
SETTLE_S = 6.0  # without change in HAL: the screen's own HAL files have run
ENDED = "Shutting down and cleaning up LinuxCNC"


class Trouble(Exception):
    """What did not happen."""


def halcmd(*words):
    done = attempt(*words)
    return done.stdout + done.stderr


class Sample:
    def __init__(self, ini, log):
        self.log = log
        self.process = subprocess.Popen(
            ["linuxcnc", "-r", ini], stdin=subprocess.DEVNULL, stdout=open(log, "w"), stderr=subprocess.STDOUT
        )
        self.status = self.command = self.channel = None
        self.errors = []

    def text(self):
        with open(self.log, errors="replace") as handle:
            return handle.read()

    def ended(self):
        return self.process.poll() is not None or ENDED in self.text()

    def wait(self, what, reached, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if self.ended():
                raise Trouble(f"LinuxCNC ended while {what}")
            if reached():
                return
            self.collect()
            time.sleep(0.05)
        raise Trouble(f"not within {seconds:g} s: {what}")

    def answers(self):
        """Whether the task serves us: asked in a child, because a look too early spoils the process for good."""
        if subprocess.run(
            [sys.executable, "-c", "import linuxcnc, sys\ns = linuxcnc.stat()\ns.poll()\nsys.exit(not s.joints)"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ).returncode:
            return False
        self.status = linuxcnc.stat()
        self.status.poll()
        return True

    def poll(self):
        self.status.poll()
        return self.status

    def collect(self):
        while self.channel:
            message = self.channel.poll()
            if not message:
                return
            if message[0] in (linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR):
                self.errors.append(message[1].strip())

    def settle(self):
        """Wait until HAL has not changed for SETTLE_S: screens run POSTGUI_HALFILE some seconds after their start."""
        last, since = None, time.monotonic()
        end = time.monotonic() + START_S
        while time.monotonic() < end and time.monotonic() - since < SETTLE_S:
            if self.ended():
                raise Trouble("LinuxCNC ended while its screen started")
            links = [line.split()[4:] for line in halcmd("show", "pin").splitlines()]
            links = [(words[0], words[1:] and words[-1]) for words in links if words]
            if links != last:
                last, since = links, time.monotonic()
            time.sleep(0.3)

    def start(self, connected):
        """connected(): what the screen's own HAL files connect is there."""
        self.wait("starting", self.answers, START_S)
        self.wait("connecting the screen", connected, START_S)
        self.command, self.channel = linuxcnc.command(), linuxcnc.error_channel()
        self.settle()

    def switched_on(self):
        """One more step towards a machine that is on and stays on: a screen that is still starting switches, too."""
        for state in (linuxcnc.STATE_ESTOP_RESET, linuxcnc.STATE_ON):
            if self.poll().task_state < state:
                self.command.state(state)
                self.command.wait_complete(5)
        end = time.monotonic() + 2.0
        while time.monotonic() < end:
            if self.poll().task_state != linuxcnc.STATE_ON:
                return False
            time.sleep(0.05)
        return True

    def home(self):
        command = self.command
        self.wait("switching on", self.switched_on, PATIENCE_S)
        command.mode(linuxcnc.MODE_MANUAL)
        command.wait_complete()
        command.teleop_enable(0)
        command.wait_complete()
        command.home(-1)
        self.wait("homing", lambda: all(self.poll().homed[: self.status.joints]), HOME_S)
        time.sleep(2.0)  # screens change pages and modes now

    def idle(self):
        return session.is_at_rest(self.poll())

    def in_mode(self, mode):
        """One try to have a mode that stays: screens change it by themselves after homing and when a program is
        opened."""
        if self.poll().task_mode != mode:
            self.command.mode(mode)
            self.command.wait_complete(10)
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            if self.poll().task_mode != mode:
                return False
            time.sleep(0.02)
        return True

    def mdi(self, line):
        self.wait("MDI", lambda: self.in_mode(linuxcnc.MODE_MDI), PATIENCE_S)
        self.command.mdi(line)
        self.command.wait_complete(20)
        self.wait(line, self.idle, PATIENCE_S)

    def begun(self, program):
        """One try to start it: a screen that opens its own program just now takes the task's mode and file."""
        if not self.in_mode(linuxcnc.MODE_AUTO):
            return False
        self.command.program_open(program)
        self.command.wait_complete(10)
        if (
            not self.in_mode(linuxcnc.MODE_AUTO)
            or self.poll().task_mode != linuxcnc.MODE_AUTO
            or self.status.file != program
        ):
            return False
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        end = time.monotonic() + 4.0
        while time.monotonic() < end:
            if not self.idle():
                return True
            time.sleep(0.02)
        return False

    def run(self, program, watch):
        """-> what the pins `watch` are while the tool cuts."""
        seen = {}
        self.wait("the start of the program", lambda: self.begun(program), PATIENCE_S)
        if watch:
            self.wait("the first chip", lambda: float(halcmd("getp", "stock-tracker.0.mrr") or 0) > 0, PATIENCE_S)
            time.sleep(0.4)
            seen = {pin: halcmd("getp", pin).strip() for pin in watch}
        self.wait("the program", self.idle, RUN_S)
        return seen


class Pauses(threading.Thread):
    """Looks ten times a second whether it is there.  longest: s that it was not."""

    def __init__(self):
        super().__init__(daemon=True)
        self.longest = 0.0

    def run(self):
        while True:
            before = time.monotonic()
            time.sleep(0.1)
            self.longest = max(self.longest, time.monotonic() - before - 0.1)


def place(status):
    """Placeholders of the program: D the sign of the side where X has room, LOW the stock's lower X."""
    x, limits = status.actual_position[0], status.axis[0]
    plus = limits["max_position_limit"] - x > x - limits["min_position_limit"]
    return {"D": "" if plus else "-", "LOW": "6" if plus else "-31"}


def signals(pins):
    found = {}
    for pin in pins:
        words = [line.split() for line in halcmd("show", "pin", pin).splitlines()]
        found[pin] = next((w[6] for w in words if len(w) >= 7 and w[4] == pin), "")
    return found


def work(sample, job, result):
    sample.start(
        lambda: (
            all(signals(job["signals"]).values())
            and all(halcmd("show", "pin", pin).strip() for pin in [*job["pins"], *job.get("watch", [])])
        )
    )
    result["started"] = True
    sample.home()
    tool = next(tool.id for tool in sample.poll().tool_table[1:] if tool.id > 0)
    for line in job["lines"]:
        sample.mdi(line.replace("{TOOL}", str(tool)))
    path = os.path.join(os.environ["HOME"], "sample.ngc")
    with open(path, "w") as handle:
        handle.write(job["program"].format(**place(sample.poll())))
    result["during"] = sample.run(path, job.get("watch", []))
    for line in job.get("after", []):
        sample.mdi(line)
    result["done"] = True
    if job.get("watch"):
        time.sleep(1.0)  # chipwise-display says its line
    sample.collect()


def main(ini, job_path, result_path):
    with open(job_path) as handle:
        job = json.load(handle)
    result = {"started": False, "done": False, "trouble": ""}
    os.makedirs(os.path.join(os.environ["HOME"], "linuxcnc", "nc_files"), exist_ok=True)  # touchy looks there
    pauses = Pauses()
    pauses.start()
    sample = Sample(ini, os.path.join(os.environ["HOME"], "output"))
    try:
        work(sample, job, result)
    except (Trouble, linuxcnc.error) as trouble:
        result["trouble"] = str(trouble)
    if job.get("picture"):
        time.sleep(1.0)
        subprocess.run(["import", "-window", "root", job["picture"]], check=False)
    result["screen_alive"] = not sample.ended()
    result["errors"], result["paused"] = sample.errors, pauses.longest
    result["pins"] = {pin: halcmd("getp", pin).strip() for pin in job["pins"]} if result["screen_alive"] else {}
    result["signals"] = signals(job["signals"]) if result["screen_alive"] else {}
    text = sample.text()
    result["said"] = [line for line in text.splitlines() if line.startswith("chipwise")]
    result["output"] = text[-4000:]
    with open(result_path, "w") as handle:
        json.dump(result, handle, indent=1)


if __name__ == "__main__":
    main(*sys.argv[1:])
