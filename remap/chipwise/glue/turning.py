# SPDX-License-Identifier: GPL-2.0-or-later
"""G26 and G27: words and modes -> the order of the planner, and its blocks -> tool changes, spindle and lines.

Called by codes.py through session.run_cycle.  The plan is that of `chipwise turn` (turning/g26_plan.py), the lines are
those that it writes (turning/blocks.py).

A tool change is a line of its own in the task: it is queued, the remap yields, and when the machine has done it
LinuxCNC has the tool's offsets (interp_convert.cc, convert_tool_change() and rs274ngc_pre.cc, read_inputs(),
2.9.0~pre1).  M6 stops the spindle, and what the interpreter reads back of its speed afterwards is the machine's: 0, or
the largest one under G96.  So the speed comes from the text of the program, and each step says its own.
"""

from __future__ import annotations

import contextlib
import os
from dataclasses import replace
from typing import TYPE_CHECKING, Callable

import emccanon
from interpreter import INTERP_EXECUTE_FINISH

from chipwise import ini
from chipwise.errors import Across, CycleError, clip
from chipwise.glue import program_run, soft_limits
from chipwise.glue import barriers, emit, shape
from chipwise.turning import stock_file
from chipwise.turning.blocks import approach
from chipwise.turning.request import Request, complete, read_program, read_spindle

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.glue.task_share import TaskShare
    from chipwise.order import Order, Outcome
    from chipwise.program.interp import Steps
    from chipwise.turning.blocks import Turning
    from chipwise.turning.stock_file import Record

WORDS, ONE_WORDS = "qpideh", "qpidel"
_PER_REV = 2  # interp_internal.hh: FEED_MODE
_NEEDED = ("T", "S", "M3", "M4", "M6")  # codes that a step executes
SAME = 1e-6  # program units


def check_modes(state: State) -> None:
    """Raise CycleError where a mode is active that G26 does not work in."""
    if state.interp.plane != emccanon.CANON_PLANE.CANON_PLANE_XZ:
        raise CycleError("the plane is not G18", "program G18 before")
    if state.interp.rotation_xy:
        raise CycleError("the work coordinates are rotated (G10 R)", "set R to 0")
    state.check_common_modes()


def order_of(single: bool) -> Callable[[State], Order]:
    """The order of G26 (single False) or G27 (single True) for session.run_cycle: State -> Order."""
    return lambda state: _order(state, single)


def _order(state: State, single: bool) -> Order:
    state.check_words(ONE_WORDS if single else WORDS)
    number, say = state.number("l"), state.number("h") or 0
    if single and (number is None or number < 1):
        raise CycleError("word L (number of the step) is missing or below 1", "see the numbers with G26 H1")
    if say not in (0, 1):
        raise CycleError(f"H{say:g} is neither 0 nor 1", "H1 only says the plan")
    _refuse_remapped()
    program = "" if program_run.is_mdi() else state.program()
    request = _request(state, read_program(program))
    job = replace(shape.job(state, request.words["Q"]), lathe=True, diameter=request.diameter)
    stock = "" if single or not program or program_run.may_be_skipped() else state.settings.path("TURNING_STOCK")
    fields = {
        "request": request,
        "program": program,
        "number": int(number or 0),
        "only_say": bool(say),
        "zero": barriers.shift(state),
        "home": state.position()[2::-2],
        "limits": soft_limits.lathe(state),
        "stock": stock,
        "keep": bool(stock and state.interp.task),
    }
    return state.order("turning", fields, job)


def _request(state: State, text: str) -> Request:
    """Request of the line and the modes in force."""
    interp = state.interp
    css, cap, speed = read_spindle(text, program_run.main_line(interp, state.line_number))
    request = Request(
        line=state.line_number,
        unit=state.unit,
        diameter=bool(interp.params["_lathe_diameter_mode"]),
        per_rev=interp.feed_mode == _PER_REV,
        css=bool(interp.params["_spindle_css_mode"]),
        barriers=barriers.in_work_coordinates(state),
    )
    if request.css and not (css and cap and speed):
        raise CycleError(
            "G96 is on, and the program has no G96 with D and S as numbers before this line",
            "write G96 D2500 S180, or use G97",
        )
    request.cap, request.speed = cap, speed or float(interp.speed[0])
    request.direction = (3 if interp.params["_spindle_cw"] else 4) if interp.params["_spindle_on"] else 0
    if not request.direction or not request.speed:
        raise CycleError("the spindle does not turn", "program S and M3 or M4 before")
    words = {letter.upper(): value for letter, value in state.words.items()}
    return complete(request, {**words, "F": interp.feed_rate})


def _refuse_remapped() -> None:
    """A remapped code would run the rest of the program inside of the cycle (emit.py)."""
    name = ini.file_name()
    if not name:
        return
    for text in ini.values_of(ini.read_lines(name), "RS274NGC", "REMAP"):
        code = text.split(None, 1)[0].upper() if text else ""
        if code in _NEEDED:
            raise CycleError(
                f"{code} is remapped on this machine ({os.path.basename(name)})",
                "write the plan with chipwise turn -o FILE.ngc and run that",
            )


def carry_out(state: State, turn: TaskShare, outcome: Outcome) -> Steps:
    """Execute the blocks of an Outcome: a generator that yields for tool changes and where the task gets its turn."""
    interp, plan = state.interp, outcome.turning
    home: tuple[float, float] | None = None
    if plan is None:
        return
    if plan.question and plan.record:
        yield from _ask(state, turn, plan)
    for block, chunks, stages in plan.blocks:
        if block.change:
            yield from _change_tool(state, turn, block.tool)
            home = interp.current_z, interp.current_x
            _check_clear(state, home, plan.clear)
        _emit(state, block.spindle, *approach(block))
        for chunk, stage in zip(chunks, stages):
            if turn.is_over(chunk) and not program_run.may_be_skipped():
                yield from turn.wait()
            emit.emit(interp, state.line_number, chunk, lathe=True)
            turn.count(chunk)
            if stage:
                yield from turn.wait()  # what has been cut is known when it has been cut
                _note(plan.record, stage)
        if block.back:
            assert home is not None  # a block that goes back begins with a change
            _emit(state, f"G0 X{home[1]:.10f}", f"G0 Z{home[0]:.10f}")
    if plan.record or plan.blocks and plan.blocks[-1].block.spindle != plan.spindle:
        _emit(state, plan.spindle)
    if plan.record:
        with contextlib.suppress(OSError):
            stock_file.end(plan.record)


def _ask(state: State, turn: TaskShare, plan: Turning) -> Steps:
    """Stop spindle and program until the operator has confirmed that the part in the chuck is the one that was stopped:
    Resume.

    Each block makes the spindle turn again."""
    yield from turn.wait()
    _note(plan.record, stock_file.ASKED)
    _emit(state, "M5")
    emccanon.MESSAGE(clip(plan.question))
    emccanon.PROGRAM_STOP()
    yield INTERP_EXECUTE_FINISH
    _note(plan.record, stock_file.CONFIRMED)


def _note(record: Record | None, what: int | str) -> None:
    """Append to the file of the stock.  Where that fails it says less than has been cut, which is safe."""
    if record is not None:
        with contextlib.suppress(OSError):
            stock_file.note(record, what)


def _emit(state: State, *lines: str) -> None:
    emit.emit(state.interp, state.line_number, ((None, "\n".join(lines)),), lathe=True)


def _change_tool(state: State, turn: TaskShare, number: int) -> Steps:
    """T M6 G43; the machine is at rest afterwards."""
    interp = state.interp
    if interp.tool_table[0].toolno != number:
        try:
            interp.execute(f"T{number} M6")  # nothing may be executed before the machine has done it
        except Exception as error:  # SystemError: LinuxCNC has refused it (2.9)
            raise CycleError(
                f"LinuxCNC does not know tool {number}, which is in the tool table file",
                "load the tool table again, or start LinuxCNC anew",
            ) from error
        yield from turn.wait()
        if not interp.task:
            place = interp.current_x, interp.current_z
            interp.execute("G18")  # it reads the place back, which the preview has in the unit of the last move
            interp.current_x, interp.current_z = place
    _emit(state, "G43")


def _check_clear(state: State, place: tuple[float, float], clear: tuple[float, float]) -> None:
    """Refuse to go on from a place beside the work: the approach has rapids in X and Z, one after the other.

    The preview only says it: it begins where the machine is when the program is opened, before homing at zero.
    """
    if place[0] >= clear[0] - SAME or place[1] >= clear[1] - SAME:
        return
    unit = state.unit_mm
    error = CycleError(
        "the tool is beside the work at Z{z} X{x}",
        "begin in front of Z{front} or outside of X{out}",
        state.code,
        z=place[0] * unit,
        x=Across(place[1] * unit),
        front=clear[0] * unit,
        out=Across(clear[1] * unit),
    )
    error.across(bool(state.interp.params["_lathe_diameter_mode"]))
    if state.interp.task:
        raise error
    emccanon.MESSAGE(clip(error.text(state.unit)))
