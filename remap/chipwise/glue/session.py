# SPDX-License-Identifier: GPL-2.0-or-later
"""From a line with one of our codes to the motion it makes: the frame every cycle runs in.

    program line -> REMAP= -> codes.py -> run_cycle -> read state and words -> order -> planner -> emit -> interpreter

refuse() is the only place where errors become the operator's message.  A cycle is planned completely before its first
move is emitted, so one that cannot be done emits nothing.  Nothing here touches HAL.  While a cycle takes longer
the task gets its turns (task_share.py), so that Stop works.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Callable, NamedTuple

import emccanon
from interpreter import INTERP_ERROR, INTERP_EXECUTE_FINISH, INTERP_OK

from chipwise import report
from chipwise.planner import client
from chipwise.program import preview
from chipwise.errors import CycleError, clip, printable
from chipwise.glue import program_run
from chipwise.glue import barriers, clamps, emit, known_cuts, named, path_mode, task, volumetric
from chipwise.program import known_stock
from chipwise.glue.ceiling import restore_programmed
from chipwise.glue.state import State
from chipwise.glue.task_share import TaskShare, hand_over
from chipwise.program.program_file import opened_name

if TYPE_CHECKING:
    from chipwise.order import Order, Outcome
    from chipwise.program.interp import Interp, Steps, Waits, Words

REFUSED = "InterpreterException"
NO_O_WORD = 0  # O_none of LinuxCNC's interp_internal.hh


def begin(interp: Interp, words: Words, ours: bool = True) -> None:
    """Before anything else: what the program before, or MDI, has left ends; the program's own F.  ours: whether the
    line has a code of ours."""
    another = program_run.enter(interp, words)
    if another:
        known_stock.forget(interp)
        barriers.forget(interp)
        clamps.forget(interp)
        known_cuts.forget(interp)
    path_mode.renew(interp, another, ours)
    volumetric.begin(interp, another)
    restore_programmed(interp)


def program_feed(interp: Interp, words: Words) -> int | Steps:
    """The remapped F; returns INTERP_OK or, with the message set, INTERP_ERROR; where it has to wait a generator."""
    try:
        begin(interp, words, ours=False)
        feed = interp.blocks[interp.remap_level].f_number
        if volumetric.job_is_due(interp):
            path_mode.renew(interp, another=False, ours=True)
            return _first_feed(interp, words, feed)
        volumetric.keep_line_number(interp, words)
        volumetric.program_feed(interp, feed)
        return done(interp)
    except Exception as error:
        return refuse(interp, "F", words, error)


def _first_feed(interp: Interp, words: Words, feed: float) -> Steps:
    """The first F of a program that has a set-up: a generator, as run_steps()."""
    try:
        for _ in volumetric.begin_job(interp):
            hand_over()
            yield INTERP_EXECUTE_FINISH
        volumetric.keep_line_number(interp, words)
        volumetric.program_feed(interp, feed)
        yield done(interp)
    except GeneratorExit:  # the program was aborted while we waited
        raise
    except Exception as error:
        yield refuse(interp, "F", words, error)


def carry_out(state: State, turn: TaskShare, outcome: Outcome) -> Steps:
    """Execute the chunks of an Outcome: a generator that yields where the task gets its turn."""
    for chunk in outcome.chunks:
        if turn.is_over(chunk) and not program_run.may_be_skipped():
            yield from turn.wait()
        emit.emit(state.interp, state.line_number, chunk)
        turn.count(chunk)


class Cycle(NamedTuple):
    """What a code has of its own.

    order_of  function of a State, giving an Order
    check     function of a State that refuses modes
    do        generator function that executes the Outcome
    rests     function of a State that says whether the machine has to be at rest before the order; None: never
    """

    order_of: Callable[[State], Order]
    check: Callable[[State], None] = State.check_modes
    do: Callable[[State, TaskShare, Outcome], Steps] = carry_out
    rests: Callable[[State], bool] | None = None


def run_cycle(interp: Interp, code: str, kwargs: Words, cycle: Cycle) -> Steps:
    """Run one cycle: a generator, as LinuxCNC wants it of a code that may have to wait.

    interp    the interpreter (`self` of a remap)
    code      "G12"
    kwargs    the words LinuxCNC passed, n the line number
    Yields INTERP_EXECUTE_FINISH for each wait (task_share.py) and in the end INTERP_OK or, with the message set,
    INTERP_ERROR:  never an exception, never a traceback.
    """
    try:
        turn = TaskShare(interp)
        begin(interp, kwargs)
        named.check_known(interp)
        if program_run.skipped():  # what is queued before a wait would be executed
            yield INTERP_OK
            return
        state = State(interp, code, kwargs)
        cycle.check(state)
        if cycle.rests and cycle.rests(state):
            yield from turn.wait()
        plan = client.ask(cycle.order_of(state), turn.budget(state.settings["PLAN_TIME"]))
        while not plan.ready(turn.patience()):
            yield from turn.wait()
        outcome = plan.outcome()
        for text in outcome.messages:
            emccanon.MESSAGE(clip(text, place(interp, kwargs)))
        if outcome.report:
            kind, figures = outcome.report
            report.record(kind, **figures)
        if outcome.targets:
            preview.target(state.line_number, outcome.targets)
        yield from cycle.do(state, turn, outcome)
        yield done(interp)
    except GeneratorExit:
        raise
    except Exception as error:
        yield refuse(interp, code, kwargs, error)


def run_steps(interp: Interp, code: str, kwargs: Words, steps: Callable[[State], Waits]) -> Steps:
    """Run a code that has to wait for the machine: a generator, as LinuxCNC wants it then.

    steps  generator function of a State; each `yield` in it waits until the machine has done all that was queued
    Yields INTERP_EXECUTE_FINISH for those waits and in the end INTERP_OK or, with the message set, INTERP_ERROR.
    """
    try:
        begin(interp, kwargs)
        named.check_known(interp)
        for _ in steps(State(interp, code, kwargs)):
            hand_over()
            yield INTERP_EXECUTE_FINISH
        yield done(interp)
    except GeneratorExit:  # the program was aborted while we waited
        raise
    except Exception as error:
        yield refuse(interp, code, kwargs, error)


def done(interp: Interp) -> int:
    """INTERP_OK, of a remap that is carried out.

    LinuxCNC goes on with the rest of the line.  If that waits (G38, M6, M66) in a sub of MDI, it executes the call of
    the remap once more behind the wait, without the line it belongs to, and its task crashes (interp_o_word.cc,
    execute_call; rs274ngc_pre.cc, _execute with mdi_interrupt).  So the call is taken away: a block without an O word
    does nothing there.
    """
    if program_run.is_mdi():
        interp.blocks[0].o_type = NO_O_WORD
    return INTERP_OK


def refuse(interp: Interp, code: str, kwargs: Words, error: Exception) -> int:
    """Any exception -> the operator's message, with the line; returns INTERP_ERROR."""
    try:
        text = message_of(interp, code, error)
    except Exception as failure:  # the path of all other errors: whatever happens there, the code is named
        text = f"chipwise: {code}: internal error: {type(failure).__name__}"
    interp.set_errormsg(clip(text, place(interp, kwargs)))
    return INTERP_ERROR


def message_of(interp: Interp, code: str, error: Exception) -> str:
    """An exception -> text for the operator, without the line."""
    if isinstance(error, CycleError):
        error.code = error.code or code
        inch = interp.length_units == emccanon.CANON_UNITS.CANON_UNITS_INCHES
        return error.text("in" if inch else "mm")
    if isinstance(error, MemoryError):
        return f"chipwise: {code}: the memory is not enough for this; use larger steps or a smaller shape"
    # What the interpreter raises for a line that it refuses cannot be named in an except clause (2.9); and it is not an
    # exception to Python, which raises a SystemError that names it
    text = interp.get_errormsg() if REFUSED in f"{type(error).__name__} {error}" else ""
    first_line = (text or f"{type(error).__name__}: {error}").strip().splitlines()[0]
    return printable(f"chipwise: {code}: internal error: {first_line}")


def place(interp: Interp, kwargs: Words) -> str:
    """ " (line 12)", " (line 5 of 100.ngc)" in a sub's own file, "" in MDI.

    AXIS and LinuxCNC name the line they have read last, which is another one when a cycle refuses.
    """
    try:
        line = int(kwargs.get("n", 0))
        if line <= 0:
            return ""
        level = interp.call_level
        if level <= 1 and program_run.is_mdi():  # the number of the line that was read last
            return ""
        if level > 0 and interp.sub_context[0].filename not in ("", interp.filename):
            return printable(f" (line {line} of {opened_name(interp.filename)})")
        return f" (line {line})"
    except Exception:  # a name that is not UTF-8
        return f" (line {line})" if kwargs.get("n", 0) > 0 else ""


try:
    if task.is_here():
        client.start()  # it takes half a second to come up; LinuxCNC is starting, too.  A preview may need none
except OSError:
    pass  # the first cycle says so
