# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs one line by MDI in the LinuxCNC that runs here, or says why not; opens a program in it.  Called by cli/enter.py,
panel/entry_process.py, resume/running.py.

    state = read()              what the machine is doing; CycleError without a LinuxCNC
    check(state, unit, cuts)    CycleError unless the line may be run now
    send(line)                  switches to MDI and hands the line over
    open_program(path)          opens a program, and starts nothing

The line is planned before from the state that was read: work position, tool in the spindle, loaded program.  So it has
to be read again, and be the same, just before the line is handed over (same()).
"""

import math
import os
import shutil
import subprocess
import time
from dataclasses import dataclass
from typing import Optional

from chipwise.program import loaded
from chipwise.program.records import Frame
from chipwise.host.clock import patience
from chipwise.errors import CycleError
from chipwise.host.processes import is_near, named

NEAR_MM = 1e-3  # a tool that has moved less is where it was
MODE_S, TAKEN_S = 5.0, 2.0  # for the mode; for a line to be refused: what takes longer is under way
OPEN_S = 20.0  # for a program to be open: a screen draws it first
TASKS = ("milltask", "linuxcnctask")
_INCH, _INCREMENTAL = 200, 910  # of stat.gcodes: ten times the code
_REFUSED = 3  # RCS_ERROR


@dataclass(frozen=True)
class State:
    """estop, on, homed (all joints), idle (interpreter and task), at_rest; unit "mm" or "in" and incremental (G91) of
    MDI; tool: number in the spindle, 0 none; position (x, y, z) mm, work coordinates; program: path of the loaded one,
    "" none."""

    estop: bool = False
    on: bool = True
    homed: bool = True
    idle: bool = True
    at_rest: bool = True
    unit: str = "mm"
    incremental: bool = False
    tool: int = 0
    position: tuple = (0.0, 0.0, 0.0)
    program: str = ""


def read() -> State:
    """State of the LinuxCNC that runs here.  Raises CycleError if there is none."""
    if not any(map(is_near, named(*TASKS))):  # the status buffer outlives a crash
        raise CycleError("LinuxCNC is not running here", "start it, or leave --run out")
    import linuxcnc

    return state_of(_polled(), linuxcnc)


def _polled():
    """The status of the LinuxCNC that runs here.  Raises CycleError if it does not answer."""
    import linuxcnc

    status = linuxcnc.stat()
    try:
        status.poll()
    except (linuxcnc.error, SystemError) as error:  # 2.9 fails without a reason at the status of another user
        raise CycleError("LinuxCNC does not answer", "see whether it is starting or ending") from error
    return status


def scene() -> dict:
    """loaded.scene() of the LinuxCNC that read() has found."""
    return loaded.scene(_polled())


def ini() -> str:
    """Path of the INI file of the LinuxCNC that read() has found."""
    return str(_polled().ini_filename)


def tip(frame: Optional[Frame]) -> tuple:
    """Place of the tool's tip: mm, work coordinates of a Frame, None: those in force."""
    import linuxcnc

    status = _polled()
    if frame is None:
        return state_of(status, linuxcnc).position
    return frame.to_work(
        [(value - offset) / status.linear_units for value, offset in zip(status.position[:3], status.tool_offset[:3])]
    )


def state_of(status, names) -> State:
    """State of a polled linuxcnc.stat; names: the module with the constants."""
    mm = 1.0 / status.linear_units
    offset = tuple((a + b) * mm for a, b in zip(status.g5x_offset[:3], status.tool_offset[:3]))
    frame = Frame(math.radians(status.rotation_xy), offset, tuple(value * mm for value in status.g92_offset[:3]))
    return State(
        estop=bool(status.estop),
        on=status.task_state == names.STATE_ON,
        homed=all(status.homed[: status.joints]),
        idle=status.interp_state == names.INTERP_IDLE and not status.paused and not status.queue,
        at_rest=bool(status.inpos),
        unit="in" if _INCH in status.gcodes else "mm",
        incremental=_INCREMENTAL in status.gcodes,
        tool=max(0, status.tool_in_spindle),
        position=frame.to_work([value * mm for value in status.position[:3]]),
        program=status.file,
    )


def check(state: State, unit: str, cuts: bool = True) -> None:
    """Raise CycleError unless a line in "mm" or "in" may be run now; cuts: the code is a cycle, which needs a tool."""
    for wrong, fact, remedy in (
        (state.estop, "the machine is in E-stop", "release it"),
        (not state.on, "the machine is off", "switch it on"),
        (not state.homed, "the machine is not homed", "home all axes"),
        (not state.idle, "a program or a command is under way", "wait for its end, or press Stop"),
        (not state.at_rest, "the machine moves", "wait until it is at rest"),
        (state.incremental, "G91 is active in LinuxCNC, and the line is planned in G90", "give G90 in MDI"),
        (cuts and not state.tool, "no tool is in the spindle", "load one with T.. M6"),
    ):
        if wrong:
            raise CycleError(f"the line is not run: {fact}", remedy)
    if state.unit != unit:
        raise CycleError(
            f"the line is not run: it is in {unit} and LinuxCNC in {state.unit}",
            f"give {'G20' if unit == 'in' else 'G21'} in MDI, or use --unit {state.unit}",
        )


def same(before: State, now: State) -> None:
    """Raise CycleError unless the line, planned from the state before, still means the same."""
    if before.tool != now.tool or before.program != now.program or math.dist(before.position, now.position) > NEAR_MM:
        raise CycleError(
            "the line is not run: tool, position or program have changed since it was planned", "enter it again"
        )


def send(line: str) -> None:
    """Hand a line over.  Raises CycleError if LinuxCNC refuses it at once."""
    import linuxcnc

    command = linuxcnc.command()
    command.mode(linuxcnc.MODE_MDI)
    command.wait_complete(MODE_S)
    status = linuxcnc.stat()
    status.poll()
    if status.task_mode != linuxcnc.MODE_MDI:
        raise CycleError("the line is not run: LinuxCNC does not switch to MDI", "see its screen")
    command.mdi(line)
    if command.wait_complete(TAKEN_S) == _REFUSED:
        raise CycleError("LinuxCNC has refused the line", "see the message on its screen")


def open_program(path: str) -> None:
    """Open a program; nothing is started.  Raises CycleError if LinuxCNC does not open it."""
    import linuxcnc

    if named("axis") and shutil.which("axis-remote"):  # AXIS shows only what it has opened itself
        try:
            subprocess.run(
                ["axis-remote", path],
                timeout=patience(OPEN_S),
                stdin=subprocess.DEVNULL,
                capture_output=True,
                check=False,
            )
        except (subprocess.TimeoutExpired, OSError):
            pass
    else:
        command = linuxcnc.command()
        command.mode(linuxcnc.MODE_AUTO)
        command.wait_complete(MODE_S)
        command.program_open(path)
        command.wait_complete(MODE_S)
    end = time.monotonic() + patience(OPEN_S)
    while os.path.realpath(_polled().file) != os.path.realpath(path):
        if time.monotonic() > end:
            raise CycleError("{path} is written, and LinuxCNC does not open it", "open it on its screen", path=path)
        time.sleep(0.05)
