"""From a line with one of our codes to the motion it makes: the frame every cycle runs in.

    program line -> REMAP= -> remap.py -> run_cycle -> read state and words -> plan (pure) -> emit -> interpreter

run_cycle is the only place where errors become the operator's message.  A cycle is planned completely before its first
move is emitted, so one that cannot be done emits nothing.  Nothing here touches HAL or waits for the machine.
"""

from interpreter import INTERP_ERROR, INTERP_OK

from chipwise.errors import CycleError
from chipwise.glue import emit
from chipwise.glue.state import State


def run_cycle(interp, code, kwargs, plan):
    """Run one cycle.

    interp  the interpreter (`self` of a remap)
    code    "G12"
    kwargs  the words LinuxCNC passed, n the line number
    plan    function of a State, giving moves in mm, absolute work coordinates
    Returns INTERP_OK or, with the message set, INTERP_ERROR: never an exception, never a traceback.
    """
    unit = "mm"
    try:
        state = State(interp, code, kwargs)
        unit = state.unit
        state.check_modes()
        moves = plan(state)
        emit.emit(interp, state, moves)
        return INTERP_OK
    except CycleError as error:
        error.code = error.code or code
        interp.set_errormsg(error.text(unit))
    except Exception as error:  # InterpreterException cannot be named in an except clause (2.9)
        text = interp.get_errormsg() if type(error).__name__ == "InterpreterException" else ""
        first_line = (text or f"{type(error).__name__}: {error}").strip().splitlines()[0]
        interp.set_errormsg(f"chipwise: {code}: internal error: {first_line}"[:250])
    return INTERP_ERROR
