"""From a line with one of our codes to the motion it makes: the frame every cycle runs in.

    program line -> REMAP= -> remap.py -> run_cycle -> read state and words -> plan (pure) -> emit -> interpreter

refuse() is the only place where errors become the operator's message.  A cycle is planned completely before its first
move is emitted, so one that cannot be done emits nothing.  Nothing here touches HAL or waits for the machine.
"""

import emccanon
from interpreter import INTERP_ERROR, INTERP_EXECUTE_FINISH, INTERP_OK

from chipwise.errors import CycleError
from chipwise.glue import emit, named
from chipwise.glue.ceiling import restore_programmed
from chipwise.glue.state import State

MESSAGE_LENGTH = 250    # linuxcnc.h: LINELEN is 255


def run_cycle(interp, code, kwargs, plan):
    """Run one cycle.

    interp  the interpreter (`self` of a remap)
    code    "G12"
    kwargs  the words LinuxCNC passed, n the line number
    plan    function of a State, giving moves in mm, absolute work coordinates
    Returns INTERP_OK or, with the message set, INTERP_ERROR: never an exception, never a traceback.
    """
    try:
        restore_programmed(interp)
        named.check_known(interp)
        state = State(interp, code, kwargs)
        state.check_modes()
        moves = plan(state)
        for text in state.messages:
            emccanon.MESSAGE(text[:MESSAGE_LENGTH])
        emit.emit(interp, state, moves)
        return INTERP_OK
    except Exception as error:
        return refuse(interp, code, error)


def run_steps(interp, code, kwargs, steps):
    """Run a code that has to wait for the machine: a generator, as LinuxCNC wants it then.

    steps  generator function of a State; each `yield` in it waits until the machine has done all that was queued
    Yields INTERP_EXECUTE_FINISH for those waits and in the end INTERP_OK or, with the message set, INTERP_ERROR.
    """
    try:
        restore_programmed(interp)
        named.check_known(interp)
        for _ in steps(State(interp, code, kwargs)):
            yield INTERP_EXECUTE_FINISH
        yield INTERP_OK
    except GeneratorExit:  # the program was aborted while we waited
        raise
    except Exception as error:
        yield refuse(interp, code, error)


def refuse(interp, code, error):
    """Any exception -> the operator's message; returns INTERP_ERROR."""
    if isinstance(error, CycleError):
        error.code = error.code or code
        inch = interp.length_units == emccanon.CANON_UNITS.CANON_UNITS_INCHES
        interp.set_errormsg(error.text("in" if inch else "mm"))
        return INTERP_ERROR
    # InterpreterException cannot be named in an except clause (2.9)
    text = interp.get_errormsg() if type(error).__name__ == "InterpreterException" else ""
    first_line = (text or f"{type(error).__name__}: {error}").strip().splitlines()[0]
    interp.set_errormsg(f"chipwise: {code}: internal error: {first_line}"[:250])
    return INTERP_ERROR
