"""M250..M254: stock and feed for the realtime components, in step with motion.

Called by codes.py through session.run_steps.  Numbers go to chipwise_command (its man page has the registers) through
two of motion's analog outputs, set as M68 does in its turn of the queue, and the codes wait for that (`yield`) and read
back through an analog input whether they were obeyed.  In the preview the words are checked and nothing is done.

What is queued are canonical calls, not lines: execute(line, number) after a `yield` takes the task down in 2.9.0~pre1
(interpmodule.cc, wrap_interp_execute_2, leaves the call state of the waiting remap in place).
"""

import emccanon

from chipwise import preview
from chipwise.clock import patience
from chipwise.errors import MM_PER_INCH, CycleError
from chipwise.glue import ceiling as feed_ceiling
from chipwise.glue import context, task
from chipwise.glue.ceiling import Ceiling, set_canon_feed
from chipwise.glue.workpiece import check_fits, stock_of
from chipwise.settings import feed_is_remapped, load_settings
from chipwise.stock import reasons

# Registers of chipwise_command
BOX_FIRST, BOX_COMMIT = 1, 7
BOX_SHAPE = 8                       # and the turn, degrees
FEED_FIRST, FEED_COMMIT = 11, 17
FILE_SLOT, SAVE_COMMIT, RESTORE_COMMIT = 21, 27, 28
IDLE = 0

OFF, LIMIT, CONSTANT, WINDOW = 0, 1, 2, 3
_CM3_MM3, _IN3_MM3 = 1000.0, MM_PER_INCH ** 3

FILL_TRIES, FILL_WAIT_S = 100, 0.05     # the map is filled a part per servo period:
FILL_CELLS = 100_000                    # so many in a try at least (tracker.h: 12000 a period, stock.c: a quarter of turned ones)
TOOL_FAULTS = range(11, 17)             # tracker.h: of the tool, not of the stock; M250 may come before the first M6
TOOL_CHANGED, NO_MONITOR = 15, 16       # tool_watch.h: nobody describes the tool in the spindle
TOOL_TRIES, TOOL_WAIT_S = 60, 0.05      # the monitor may be late, or is being started again
FILE_TRIES, FILE_WAIT_S = 600, 0.05     # the monitor reads or writes a file meanwhile


SAME_MM, SAME_DEG = 1e-6, 1e-9          # boxes that differ by less are the same


class _InForce:
    """What M250 and M251 have left in force, as far as the interpreter knows.

    feed        M251 is on; feed_of_mdi: it was given in MDI
    feed_left   it has ended, and the realtime side has still to be told
    box         (low, high, shape, turn) of the last M250, None where the stock came from a file
    stock_here  the stock was defined in this run of the program, or in this MDI
    """

    feed = feed_left = feed_of_mdi = stock_here = False
    box = None


def begin(interp, another):
    """Before each code: what has ended is put back.  another: another run of a program, or MDI, begins.

    M251 ends with its program.  In MDI it stays, unless the realtime side has ended it (machine off, E-stop).
    """
    if not interp.task:
        return
    if another:
        _InForce.stock_here = False
    if _InForce.feed and (another or context.is_mdi() and _mode_now(load_settings()) == OFF):
        if another and not context.is_mdi() and _InForce.feed_of_mdi:
            emccanon.MESSAGE("chipwise: M251 of MDI has ended, a program starts: F as programmed")
        feed_ceiling.forget(interp)
        _InForce.feed, _InForce.feed_left = False, True
    if context.skipped():
        return
    if _InForce.feed_left:
        _end_of_feed(load_settings())
    if Ceiling.waiting:
        feed_ceiling.begin(interp, *Ceiling.waiting)


def _end_of_feed(settings):
    """Queue for the realtime side that the feed is off and F is not replaced; once more by the next code where this may be lost."""
    _queue(settings, FEED_FIRST, [OFF, 0.0, 0.0], FEED_COMMIT)
    emccanon.SET_AUX_OUTPUT_VALUE(settings["ANALOG_OUT"] + 2, 0.0)
    _InForce.feed_left = task.is_restoring()


def _send(state, first, values, commit):
    """As _queue()."""
    _queue(state.settings, first, values, commit)


def _queue(settings, first, values, commit):
    """Queue the registers first, first + 1, .. and the commit, in step with motion."""
    word = settings["ANALOG_OUT"]
    for number, value in enumerate(values, first):
        emccanon.SET_AUX_OUTPUT_VALUE(word, number)
        emccanon.SET_AUX_OUTPUT_VALUE(word + 1, value)
    emccanon.SET_AUX_OUTPUT_VALUE(word, commit)


def _mode_now(settings):
    """The mode of the realtime side, now; 0 where it is not there."""
    return round(emccanon.GET_EXTERNAL_ANALOG_INPUT(settings["ANALOG_IN"], 0.0)) % 10


def _status(state):
    """(mode, stock is defined, fault code) of the realtime side, now; (0, False, 0) where it is not there."""
    value = round(emccanon.GET_EXTERNAL_ANALOG_INPUT(state.settings["ANALOG_IN"], 0.0))
    return value % 10, value // 10 % 10 == 1, value // 100 % 100


def define_stock(state):
    """M250."""
    state.check_words("pqrijk")
    low, high, shape, turn = stock_of(state)
    size = check_fits(state.settings, low, high, turn)
    if not state.interp.task:
        preview.stock(state.line_number, low, high, shape, turn)
        return
    if _run_from_line_keeps_stock(state, (low, high, shape, turn)):
        yield                       # without one the message is thrown away with all that the line has queued
        return
    units = emccanon.GET_EXTERNAL_LENGTH_UNITS()
    _send(state, BOX_SHAPE, [shape, turn], IDLE)
    _send(state, BOX_FIRST, [value * units for value in [*low, *high]], BOX_COMMIT)
    for _ in range(FILL_TRIES + int(size[0] * size[1] / state.settings["CELL"] ** 2 / FILL_CELLS)):
        emccanon.DWELL(FILL_WAIT_S)
        yield
        _mode, defined, fault = _status(state)
        if defined or fault and fault not in TOOL_FAULTS:
            break
    emccanon.SET_AUX_OUTPUT_VALUE(state.settings["ANALOG_OUT"], IDLE)
    if not defined:
        yield                       # an error throws away what is queued: the request would stand, and be served later
        raise CycleError(f"the stock tracker did not take the stock (fault {fault})",
                         "see its message; without one, load chipwise.hal ([HAL]HALFILE); where chipwise-monitor has "
                         "died start `chipwise monitor` again")
    _InForce.box, _InForce.stock_here = (low, high, shape, turn), True


_START_BEFORE = "start the program at this line or before"


def _run_from_line_keeps_stock(state, box=None):
    """Run from line executes M250 and M254 of the lines it reads over, and would make a whole block of a part that is cut.

    -> True where the line is read over, and the stock in force stays.  Raises CycleError where that is not the stock of
    this line (box: low, high, shape, turn; None for M254), or where it cannot be known and there is a stock to lose.
    """
    if not (context.skipped() or context.may_be_skipped()):
        return False
    _mode, defined, _fault = _status(state)
    same = box is None or _InForce.box is None or _same_box(box, _InForce.box)
    if context.may_be_skipped():
        if defined and same:
            raise CycleError("it is not known whether this line is to be executed or only read over (run from line), and a "
                             "stock is in force", "run the program again, or give this line in MDI")
        return False
    if not defined:
        raise CycleError("run from line reads over this line and no stock is defined",
                         f"give it in MDI, or restore the stock with M254, or {_START_BEFORE}")
    if not same:
        raise CycleError("run from line reads over this line, and the stock in force is another one",
                         f"give this line in MDI, or restore the stock with M254, or {_START_BEFORE}")
    emccanon.MESSAGE(f"chipwise: {state.code}: run from line reads over this line, the stock stays as it is")
    _InForce.stock_here = True
    return True


def _same_box(first, second):
    return first[2] == second[2] and abs(first[3] - second[3]) < SAME_DEG and all(
        abs(a - b) < SAME_MM for one, other in zip(first[:2], second[:2]) for a, b in zip(one, other))


def _slot(state):
    """Word P of M253, M254: 0 to 9."""
    state.check_words("p")
    slot = state.number("p")
    if slot is None:
        raise CycleError("word P (slot) is missing", "add P0 to P9")
    if slot not in range(reasons.SLOTS):
        raise CycleError(f"slot P{slot:g} is none of 0 to {reasons.SLOTS - 1}", "use P0 to P9")
    return int(slot)


def _reply(state):
    """What the monitor says of the request (reasons.py), now."""
    return round(emccanon.GET_EXTERNAL_ANALOG_INPUT(state.settings["ANALOG_IN"], 0.0)) // 10000


def _wait_for(state, answered):
    """Wait until the monitor's reply is one; -> it, None after the time-out."""
    for _ in range(FILE_TRIES):
        yield
        if answered(_reply(state)):
            return _reply(state)
        emccanon.DWELL(FILE_WAIT_S)
    return None


def _file_request(state, commit, what):
    """M253, M254: have the monitor do something with the file of a slot, and wait for it."""
    slot = _slot(state)
    if not state.interp.task:
        return
    emccanon.SET_AUX_OUTPUT_VALUE(state.settings["ANALOG_OUT"], IDLE)
    reply = yield from _wait_for(state, lambda now: now == reasons.IDLE)
    if reply is not None:
        _send(state, FILE_SLOT, [slot], commit)
        reply = yield from _wait_for(state, lambda now: now not in (reasons.IDLE, reasons.BUSY))
    emccanon.SET_AUX_OUTPUT_VALUE(state.settings["ANALOG_OUT"], IDLE)
    if reply != reasons.DONE:
        yield                       # as in define_stock()
    if reply is None:
        raise CycleError(f"slot {slot} was not {what}: chipwise-monitor gave no answer within "
                         f"{FILE_TRIES * FILE_WAIT_S:g} s", "load chipwise.hal ([HAL]HALFILE); where it has died start "
                         "`chipwise monitor` again")
    if reply != reasons.DONE:
        problem, remedy = reasons.REASONS.get(reply, (f"reason {reply}", "see the log"))
        raise CycleError(f"slot {slot} was not {what}: {problem}", remedy)


def save_stock(state):
    """M253."""
    if state.interp.task and context.skipped():
        _slot(state)
        emccanon.MESSAGE("chipwise: M253: run from line reads over this line, the file stays as it is")
        yield
        return
    yield from _file_request(state, SAVE_COMMIT, "saved")


def restore_stock(state):
    """M254."""
    _slot(state)
    if not state.interp.task:
        preview.restored(state.line_number)
    if state.interp.task and _run_from_line_keeps_stock(state):
        yield
        return
    yield from _file_request(state, RESTORE_COMMIT, "restored")
    _InForce.box, _InForce.stock_here = None, True


def _rate(state, letter, meaning):
    """A removal rate word (cm3/min or in3/min) as mm3/min."""
    value = state.number(letter)
    unit = "in3/min" if state.unit == "in" else "cm3/min"
    if value is None:
        raise CycleError(f"word {letter.upper()} ({meaning}, {unit}) is missing", f"add {letter.upper()}")
    if not value > 0:
        raise CycleError(f"{meaning} {letter.upper()}{value:g} {unit} is not above 0", f"give {letter.upper()} above 0")
    return value * (_IN3_MM3 if state.unit == "in" else _CM3_MM3)


def _feed_words(state):
    """(mode, target, lower, ceiling) of M251: mm3/min, mm/min; ceiling None where F stays the upper limit."""
    state.check_words("qpre")
    mode = state.number("p")
    mode = LIMIT if mode is None else mode
    if mode not in (LIMIT, CONSTANT, WINDOW):
        raise CycleError(f"mode P{mode:g} is none of 1 (limit), 2 (constant), 3 (window)", "use P1, P2 or P3")
    target = _rate(state, "q", "removal rate")
    lower = _rate(state, "r", "lower removal rate") if mode == WINDOW else 0.0
    if lower > target:
        raise CycleError(f"lower removal rate R{state.number('r'):g} is above the upper one, Q{state.number('q'):g}",
                         "give R below Q")
    ceiling = state.length("e")
    if ceiling is None and mode == CONSTANT:
        raise CycleError("word E (ceiling of the feed) is missing", "mode P2 replaces F; add E")
    if ceiling is not None and (mode == LIMIT or not ceiling > 0):
        raise CycleError("ceiling E{e}/min is not above 0" if mode != LIMIT else "word E is not used in mode P1",
                         "give E above 0" if mode != LIMIT else "leave E out, or use P2 or P3", e=ceiling)
    if ceiling is not None and not feed_is_remapped():
        raise CycleError(f"mode P{mode:g} with a ceiling E replaces F, and F is not remapped",
                         "add REMAP = F argspec=N python=feed to [RS274NGC] (not for programs with G93), or use P1")
    return int(mode), target, lower, ceiling


def _wait_for_the_tool(state):
    """Wait until the tool in the spindle is known to the stock tracker; CycleError where it does not get known."""
    for _ in range(int(patience(TOOL_TRIES))):
        yield
        fault = _status(state)[2]
        if fault not in (TOOL_CHANGED, NO_MONITOR):
            return
        emccanon.DWELL(TOOL_WAIT_S)
    yield
    raise CycleError("the tool in the spindle is not known: chipwise-monitor does not "
                     + ("answer" if fault == NO_MONITOR else "follow it"), "start `chipwise monitor` in a shell")


def feed_on(state):
    """M251."""
    mode, target, lower, ceiling = _feed_words(state)
    if not state.interp.task:
        preview.volume(state.line_number, mode, target, lower, ceiling)
        return
    yield from _no_ceiling(state)
    yield from _wait_for_the_tool(state)
    _send(state, FEED_FIRST, [mode, target, lower, 0.0 if context.is_mdi() else 1.0], FEED_COMMIT)
    emccanon.ENABLE_ADAPTIVE_FEED()
    state.interp.adaptive_feed = True
    _InForce.feed, _InForce.feed_left, _InForce.feed_of_mdi = True, False, context.is_mdi()
    yield
    now, defined, _fault = _status(state)
    if now != mode or not defined:
        _InForce.feed = False
        _send(state, FEED_FIRST, [OFF], FEED_COMMIT)
        yield
        if now != mode:
            raise CycleError("the realtime side does not answer",
                             "load chipwise.hal ([HAL]HALFILE) and see [CHIPWISE]ANALOG_OUT and ANALOG_IN")
        raise CycleError("no stock is defined", "define it with M250 before")
    _say_what_is_in_force()
    yield from _begin_ceiling(state, ceiling)


def _say_what_is_in_force():
    if not _InForce.stock_here:
        emccanon.MESSAGE("chipwise: M251: the stock is that of before, as it has been cut since")
    if context.is_mdi():
        emccanon.MESSAGE("chipwise: M251 stays on until M252 or until a program starts")


def _begin_ceiling(state, ceiling):
    """F is replaced from here on, or, where run from line reads over the line, from the first code behind the start line."""
    output = state.settings["ANALOG_OUT"] + 2
    if not context.skipped():
        feed_ceiling.begin(state.interp, ceiling, output)
        return
    emccanon.SET_AUX_OUTPUT_VALUE(output, 0.0)
    yield                           # what is queued without one is thrown away
    if ceiling is not None:
        Ceiling.waiting = ceiling, output


def feed_off(state):
    """M252."""
    state.check_words("")
    if not state.interp.task:
        preview.volume(state.line_number, OFF)
        return
    Ceiling.waiting = None
    yield from _no_ceiling(state)
    _InForce.feed = False
    _end_of_feed(state.settings)
    yield


def _no_ceiling(state):
    """F is the machine's feed again, before the override may rise to 1."""
    if Ceiling.value is None:
        return
    feed_ceiling.end(state.interp)
    yield


def keep_line_number(interp, words):
    """Let a move on the line of an F keep its line number.

    LinuxCNC 2.9 goes on with the rest of the line under the number that the calling frame was left with, which nobody has set
    for a remap (interp_o_word.cc, execute_call, CS_REEXEC_PYBODY): such moves had line 0 or that of another line.
    """
    if interp.call_level > 0 and "n" in words:
        interp.sub_context[interp.call_level - 1].sequence_number = int(words["n"])


def program_feed(interp, feed):
    """The remapped F: what LinuxCNC does itself, and the ceiling where one is active."""
    interp.feed_rate = feed
    set_canon_feed(interp, feed)
