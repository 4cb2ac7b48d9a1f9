# SPDX-License-Identifier: GPL-2.0-or-later
"""M250, M253, M254: the stock of the realtime components, defined, saved and restored in step with motion.

Called by codes.py through session.run_steps.  The codes queue numbers (registers.py), wait for them (`yield`) and read
back whether they were taken.  In the preview the words are checked and nothing is done.
"""

from __future__ import annotations

import contextlib
import os
from typing import TYPE_CHECKING, Callable, Generator

import emccanon

from chipwise.host import files
from chipwise.program import preview
from chipwise.host.clock import patience
from chipwise.errors import CycleError
from chipwise.glue import program_run
from chipwise.glue import known_cuts
from chipwise.program import known_stock
from chipwise.glue.registers import InForce, send, status_now, status_value
from chipwise.glue.workpiece import allowance, check_extent, check_fits, stock_of
from chipwise.clib import layout
from chipwise.stock import reasons, turn_request
from chipwise.clib.layout import Fault, Register

if TYPE_CHECKING:
    from chipwise.glue.registers import Box
    from chipwise.glue.state import State
    from chipwise.program.interp import Waits
    from chipwise.settings import Settings

FILL_TRIES, FILL_WAIT_S = 100, 0.05  # the map is filled a part per servo period:
FILL_CELLS = 100_000  # so many in a try at least (tracker.h: 12000 a period, stock.c: a quarter of turned ones)
TOOL_FAULTS = range(Fault.TOOL_DIAMETER, Fault.NO_MONITOR + 1)  # of the tool, not of the stock; M250 may come before M6
FILE_S, FILE_WAIT_S = 30.0, 0.05  # the monitor reads or writes a file meanwhile
REFUSED = range(Fault.BOX_NOT_FINITE, Fault.BOX_TOO_LARGE + 1)  # of the last request
SAME_MM, SAME_DEG = 1e-6, 1e-9  # boxes that differ by less are the same


def define_stock(state: State) -> Waits:
    """M250."""
    state.check_words("pqrijk", "use P Q R (minimum in X, Y, Z) and I J K (size in X, Y, Z)")
    low, high, shape, turn = stock_of(state)
    check_extent(low, high)
    check_fits(state.settings, low, high, turn)
    known_stock.define(state.interp, high[2])
    known_cuts.forget(state.interp)
    if not state.interp.task:
        preview.stock(state.line_number, low, high, shape, turn)
        return
    if _run_from_line_keeps_stock(state, (low, high, shape, turn)):
        yield  # without one the message is thrown away with all that the line has queued
        return
    if state.settings["KEEP_STOCK"]:
        yield  # until the machine is here: what is cut before belongs to the stock before
        _forget_kept(state.settings)
    units = emccanon.GET_EXTERNAL_LENGTH_UNITS()
    send(state, Register.BOX_SHAPE, [shape, turn], Register.IDLE)
    send(state, Register.BOX_FIRST, [value * units for value in [*low, *high]], Register.BOX_COMMIT)
    room = state.settings["MAP_SIZE"]
    for _ in range(FILL_TRIES + int(room[0] * room[1] / state.settings["CELL"] ** 2 / FILL_CELLS)):
        emccanon.DWELL(FILL_WAIT_S)
        yield
        _mode, defined, fault = status_now(state)
        if defined or fault and fault not in TOOL_FAULTS:
            break
    emccanon.SET_AUX_OUTPUT_VALUE(state.settings["ANALOG_OUT"], Register.IDLE)
    if not defined or fault in REFUSED:  # what is defined may be the old stock
        yield  # an error throws away what is queued: the request would stand, and be served later
        raise CycleError(
            f"the stock tracker has refused the stock (fault {fault})",
            "see its message; without one, load chipwise.hal ([HAL]HALFILE); where chipwise-monitor has "
            "died start `chipwise monitor` again",
        )
    InForce.box, InForce.stock_here = (low, high, shape, turn), True


def _forget_kept(settings: Settings) -> None:
    """What is saved of the stock before must not come back after a power loss, even if no chipwise-monitor runs that
    could remove it."""
    with contextlib.suppress(OSError):  # the monitor tries it again, and tells the operator
        files.remove_durable(os.path.join(settings.path("STOCK_DIR"), files.JOURNAL))


_START_BEFORE = "start the program at this line or before"


def _run_from_line_keeps_stock(state: State, box: Box | None = None) -> bool:
    """Run from line executes M250 and M254 of the lines it reads over, and would make a whole block of a part that is
    cut.

    -> True where the line is read over, and the stock in force stays.  Raises CycleError where that is not the stock of
    this line (box: low, high, shape, turn; None for M254), or where it cannot be known and there is a stock to lose.
    """
    if not (program_run.skipped() or program_run.may_be_skipped()):
        return False
    _mode, defined, _fault = status_now(state)
    same = box is None or InForce.box is None or _same_box(box, InForce.box)
    if program_run.may_be_skipped():
        if defined and same:
            raise CycleError(
                "chipwise cannot tell whether run from line executes or skips this line, and a stock is in force",
                "run the program again, or give this line in MDI",
            )
        return False
    if not defined:
        raise CycleError(
            "run from line skips this line and no stock is defined",
            f"give it in MDI, or restore the stock with M254, or {_START_BEFORE}",
        )
    if not same and program_run.stock_is_defined_again(state.interp):  # that line decides
        return True
    if not same:
        raise CycleError(
            "run from line skips this line, and the stock in force is a different one",
            f"give this line in MDI, or restore the stock with M254, or {_START_BEFORE}",
        )
    emccanon.MESSAGE(f"chipwise: {state.code}: run from line skips this line, so the stock stays as it is")
    InForce.stock_here = True
    return True


def _same_box(first: Box, second: Box) -> bool:
    return (
        first[2] == second[2]
        and abs(first[3] - second[3]) < SAME_DEG
        and all(abs(a - b) < SAME_MM for one, other in zip(first[:2], second[:2]) for a, b in zip(one, other))
    )


def _slot(state: State, words: str = "p") -> int:
    """Word P of M253, M254: 0 to 9.  words: those of the code."""
    state.check_words(words)
    slot = state.number("p")
    if slot is None:
        raise CycleError("word P (slot) is missing", "add P0 to P9")
    if slot not in range(reasons.SLOTS):
        raise CycleError(f"slot P{slot:g} is not from 0 to {reasons.SLOTS - 1}", "use P0 to P9")
    return int(slot)


def _reply(state: State) -> int:
    """What the monitor says of the request (reasons.py), now."""
    return status_value(state.settings) % layout.STATUS_JOB // layout.STATUS_REPLY


def _wait_for(state: State, answered: Callable[[int], bool]) -> Generator[None, None, int | None]:
    """Wait until the monitor's reply is one; -> it, None after the time-out."""
    for _ in range(round(patience(FILE_S) / FILE_WAIT_S)):
        yield
        if answered(_reply(state)):
            return _reply(state)
        emccanon.DWELL(FILE_WAIT_S)
    return None


def request(state: State, number: int, commit: int, failed: str) -> Waits:
    """M253, M254, M256: have the monitor do something with the file of a slot or a set-up, and wait for it.  failed:
    what is said if it did not."""
    if not state.interp.task:
        return
    emccanon.SET_AUX_OUTPUT_VALUE(state.settings["ANALOG_OUT"], Register.IDLE)
    reply = yield from _wait_for(state, lambda now: now == reasons.IDLE)
    if reply is not None:
        send(state, Register.FILE_SLOT, [number], commit)
        reply = yield from _wait_for(state, lambda now: now not in (reasons.IDLE, reasons.BUSY))
    emccanon.SET_AUX_OUTPUT_VALUE(state.settings["ANALOG_OUT"], Register.IDLE)
    if reply != reasons.DONE:
        yield  # as in define_stock()
    if reply is None:
        raise CycleError(
            f"{failed}: chipwise-monitor gave no answer within {FILE_S:g} s",
            "load chipwise.hal ([HAL]HALFILE); if it has died start `chipwise monitor` again",
        )
    if reply != reasons.DONE:
        problem, remedy = reasons.REASONS.get(reply, (f"reason {reply}", "see the log"))
        raise CycleError(f"{failed}: {problem}", remedy)


def save_stock(state: State) -> Waits:
    """M253."""
    if state.interp.task and program_run.skipped():
        _slot(state)
        emccanon.MESSAGE("chipwise: M253: run from line skips this line, so the file stays as it is")
        yield
        return
    slot = _slot(state)
    yield from request(state, slot, Register.SAVE_COMMIT, f"slot {slot} was not saved")


TURN_WORDS = "rhijk"


def _turn(state: State, slot: int) -> turn_request.TurnRequest | None:
    """Words R H I J K of M254 -> a turn_request.TurnRequest, None for the stock as it was saved."""
    dropped = [letter.upper() for letter in TURN_WORDS if state.has_any(letter) and state.number(letter) is None]
    if dropped:
        raise CycleError(
            f"word {dropped[0]} does not reach chipwise",
            "write argspec=prhijkN in the line REMAP = M254 of the INI file",
        )
    if not state.has_any(TURN_WORDS):
        return None
    half_turn, axis = state.number("r"), state.number("h")
    if half_turn != 180:
        raise CycleError(
            "H, I, J and K are words of a part that was turned over, and R180 is missing"
            if half_turn is None
            else f"R{half_turn:g} is not half a turn",
            "use R180 for a part that was turned over, or give P alone",
        )
    if axis not in (1, 2):
        raise CycleError(
            "word H (axis that the part was turned about) is missing"
            if axis is None
            else f"axis H{axis:g} is neither 1 nor 2",
            "use H1 for X, H2 for Y",
        )
    if state.interp.rotation_xy % 360:
        raise CycleError(
            f"the work coordinates are turned by {state.interp.rotation_xy:g} degrees, and a stock is turned over "
            f"along the axes of the machine",
            "align the part, and set the rotation to R0 with G10 L2",
        )
    corner = state.machine_point([state.length(letter) or 0.0 for letter in "ijk"])
    for name, value in zip("XYZ", corner):
        if not abs(value) <= layout.MAX_COORDINATE:
            raise CycleError(
                f"the corner is at {name}{{far}} of the machine, more than {{most}} from its zero",
                "correct I, J, K or the work offset",
                far=value,
                most=layout.MAX_COORDINATE,
            )
    return turn_request.TurnRequest(slot, turn_request.AXES[int(axis) - 1], corner, allowance(state))


def _ask_for(state: State, request: turn_request.TurnRequest) -> None:
    """Write a TurnRequest where the monitor looks for it; the machine is here."""
    folder = state.settings.path("STOCK_DIR")
    try:
        turn_request.write(folder, request)
    except OSError as error:
        raise CycleError(
            f"slot {request.slot} was not restored: {folder} cannot be written: {error.strerror}",
            "see [CHIPWISE]STOCK_DIR, the rights of that folder, and room on the disk",
        ) from error


def restore_stock(state: State) -> Waits:
    """M254."""
    slot = _slot(state, "p" + TURN_WORDS)
    turn = _turn(state, slot)
    known_stock.forget(state.interp)
    known_cuts.forget(state.interp)
    if not state.interp.task:
        preview.restored(state.line_number, -1 if turn else slot)
    if state.interp.task and _run_from_line_keeps_stock(state):
        yield
        return
    if turn and state.interp.task:
        yield  # until the machine is here
        _ask_for(state, turn)
    yield from request(
        state, reasons.TURNED if turn else slot, Register.RESTORE_COMMIT, f"slot {slot} was not restored"
    )
    InForce.box, InForce.stock_here = None, True
