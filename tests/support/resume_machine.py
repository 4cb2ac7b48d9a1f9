# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs that are stopped in a real LinuxCNC, killed or by a button, and gone on with there.  Used by
bench/bench_resume.py --real.

1. The uninterrupted run: its map, the time that its program takes, and the seconds of feed in air that the servo thread
   has counted.
2. A stop: abort, E-stop, abort with a STOCK_DIR that has become read-only, kill -9 of rtapi_app, of milltask or of
   everything, each after a random share of that time.  After kill -9 LinuxCNC is started again; KEEP_STOCK brings its
   stock back.
3. `chipwise resume` in the environment of the running machine; its program runs, the guards on.
4. Judged: map in the end, messages (a guard's stop is one), feed in air of both parts against the uninterrupted run's.
"""

import random
import shutil

import numpy as np

from support import ROOT
from support.operate import Stopped, operate
from support.resume_case import SAME_MM
from support.resume_oracle import outside

BUTTONS = ("abort", "estop", "read-only")
HOW = (*BUTTONS, "rtapi_app", "milltask", "everything")
SPEED = 4
AIR = ("volumetric-feed.0.air-time", "volumetric-feed.0.cut-time")
PROCESSES = ("linuxcnc", "rtapi_app", "milltask", "io", "linuxcncsvr", "halui")
REST_S = 3.0  # of the machine's time, after an abort: the journal gets what was cut last


class Machine:
    """The folder of one program on one machine."""

    def __init__(self, folder, case):
        self.folder, self.stock, self.path = folder, folder / "kept", folder / case.path.name
        self.path.write_bytes(case.path.read_bytes())
        for model in () if case.path.parent == folder else case.path.parent.glob("*.stl"):
            shutil.copy(model, self.folder)
        self.out, self.air = folder / "resumed.ngc", folder / "air.txt"
        self.edit = f"s#^STOCK_DIR = .*#STOCK_DIR = {self.stock}#; s#^KEEP_STOCK = .*#KEEP_STOCK = yes#"

    def clean(self):
        shutil.rmtree(self.stock, ignore_errors=True)
        self.stock.mkdir()
        for folder in (self.folder, self.stock):
            folder.chmod(0o777)
        for file in (self.out, self.air):
            file.unlink(missing_ok=True)

    def operate(self, steps):
        return operate(self.folder, steps, edit=self.edit, speed=SPEED, timeout=600)

    def run(self, program, name):
        """Steps of a run to the end."""
        return [["open", str(program)], ["run_from", 0], ["finish"], ["pins", *AIR], ["map", str(name)]]

    def resume(self):
        return ["program", str(ROOT / "bin" / "chipwise"), "resume", str(self.path), "-o", str(self.out)]


def whole(machine):
    """(heights, s of feed in air, s of feed in stock) of the uninterrupted run."""
    machine.clean()
    name = machine.folder / "whole.npy"
    *_, said, (air, cut), _map = machine.operate(machine.run(machine.path, name))
    if said:
        raise Stopped([], f"the uninterrupted run says {said}")
    return np.load(name), float(air), float(cut)


def stop_steps(machine, how, seconds):
    """Steps that begin the program and stop it."""
    steps = [["open", str(machine.path)], ["run_from", 0]]
    wait = [["sleep", seconds]]
    if how == "read-only":
        wait = [["sleep", seconds / 2], ["program", "chmod", "555", str(machine.stock)], ["sleep", seconds / 2]]
    note = ["program", "sh", "-c", f"halcmd getp {AIR[0]} > {machine.air}"]
    if how in BUTTONS:
        return [*steps, *wait, note, ["estop" if how == "estop" else "abort"], ["sleep", REST_S], ["errors"]]
    kill = (
        [["kill_monitor"], *(["kill", name] for name in PROCESSES)]
        if how == "everything"
        else [["kill", how], ["sleep", REST_S]]
    )
    return [*steps, *wait, note, *kill, ["program", "sh", "-c", "kill -9 $PPID"]]


def by_button(machine, how, seconds):
    """The last answers, from that of resume on: stopped and gone on with in one LinuxCNC."""
    refused = [machine.resume(), ["program", "chmod", "777", str(machine.stock)]] if how == "read-only" else []
    end = [
        *([["on"]] if how == "estop" else []),
        machine.resume(),
        *machine.run(machine.out, machine.folder / "end.npy"),
    ]
    answers = machine.operate([*stop_steps(machine, how, seconds), *refused, *end])
    if refused:
        status, said = answers[-len(end) - 2]
        if status != 2 or "cannot be written" not in said or "Traceback" in said:
            raise Stopped([], f"a read-only STOCK_DIR: {status} {said}")
    return answers[-6:]


def killed(machine, how, seconds):
    """The same with kill -9 and a second LinuxCNC."""
    try:
        machine.operate(stop_steps(machine, how, seconds))
    except Stopped:  # the display is killed, too
        pass
    return machine.operate([["errors"], machine.resume(), *machine.run(machine.out, machine.folder / "end.npy")])[1:]


def stops(folder, case, count, seed):
    """Yield a dict for each stop, as bench_resume.simulated()."""
    machine, rng = Machine(folder, case), random.Random(seed)
    heights, air, cut = whole(machine)
    order = rng.sample(HOW, len(HOW))
    for number in range(count):
        how, share = order[number % len(order)], rng.uniform(0.2, 0.9)
        machine.clean()
        run = by_button if how in BUTTONS else killed
        found = {
            "program": case.path.stem,
            "kind": how,
            "index": number,
            "line": 0,
            "note": f"share {share:.2f}",
            "added": None,
        }
        try:
            found["fault"], found["added"] = judged(machine, run(machine, how, share * (air + cut)), heights, air)
        except Stopped as stopped:
            refused = [answer[1] for answer in stopped.answers if isinstance(answer, list) and answer[:1] == [2]]
            found["fault"] = f"refused: {refused}" if refused else f"not done: {stopped}"
        yield found


def judged(machine, answers, heights, air):
    """(fault, s of feed in air added)."""
    (status, said), _open, _run, errors, (late, _cut), _map = answers
    if status:
        return f"refused: {said}", None
    higher, lower = outside(heights, np.load(machine.folder / "end.npy"))
    added = float(machine.air.read_text()) + float(late) - air
    errors = [text for text in errors if not text.startswith("Note:")]  # LinuxCNC's own, after an E-stop
    if errors:
        return f"messages: {errors}", added
    if max(higher, lower) >= SAME_MM:
        return f"heights differ by {higher:.3f} mm higher, {lower:.3f} mm lower", added
    return "", added
