# SPDX-License-Identifier: GPL-2.0-or-later
"""M251 and M252: the volumetric feed of the realtime components, in step with motion; and the remapped F.

Called by codes.py through session.run_steps, and by session.py before each code.  The codes queue numbers
(registers.py), wait for them (`yield`) and read back whether they were taken.  In the preview the words are checked and
nothing is done.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import emccanon

from chipwise.program import preview
from chipwise.host.clock import monitor_patience
from chipwise.errors import CycleError, printable
from chipwise.glue import ceiling as feed_ceiling
from chipwise.glue import program_run
from chipwise.glue import task, tooth_limits
from chipwise.glue.ceiling import Ceiling, set_canon_feed
from chipwise.glue.registers import InForce, feed_is_carried, job_now, mode_now, queue, send, status_now
from chipwise.rates import MAX_RATE, MM3_PER_CM3, MM3_PER_IN3
from chipwise.settings import feed_is_remapped, load_settings, planner_limits_jerk
from chipwise.clib import layout
from chipwise.clib.layout import Fault, Register
from chipwise.program.program_file import opened_name

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.program.interp import Interp, Waits, Words
    from chipwise.settings import Settings

OFF, LIMIT, CONSTANT, WINDOW = map(int, layout.FeedMode)

ENDED = "M251 of MDI has ended with the start of a program, so F is as programmed"
# The monitor sees a tool or a program within 20 ms; on a busy computer, or while it is being started again, later.
MONITOR_S, LOOK_S = 3.0, 0.05


def begin(interp: Interp, another: bool) -> None:
    """Before each code: what has ended is put back.  another: another run of a program, or MDI, begins.

    M251 ends with its program.  In MDI it stays, unless the realtime side has ended it (machine off, E-stop), and the
    next start of the program that was loaded then has it, too: the realtime side says whether it is that one
    (chipwise_command), and this side compares the file.  Its ceiling comes with the main program's first F, as that of
    a set-up.
    """
    if not interp.task:
        return
    if another:
        InForce.stock_here = InForce.job_asked = False
    if InForce.feed and (another or program_run.is_mdi() and mode_now(load_settings()) == OFF):
        feed_ceiling.forget(interp)
        starts = another and not program_run.is_mdi() and InForce.feed_of_mdi
        carried = starts and InForce.loaded is not None and InForce.loaded == program_run.loaded_program(interp)
        InForce.feed = InForce.feed_carried = carried
        InForce.feed_left, InForce.feed_of_mdi = not carried, False
        if starts and not carried:
            emccanon.MESSAGE("chipwise: " + ENDED)
    if program_run.skipped():
        return
    if InForce.feed_carried and another:
        emccanon.SET_AUX_OUTPUT_VALUE(load_settings()["ANALOG_OUT"] + 2, 0.0)  # the F of MDI is not the program's
    if InForce.feed_left:
        _end_of_feed(load_settings())
    if Ceiling.waiting:
        feed_ceiling.begin(interp, *Ceiling.waiting)


def _end_of_feed(settings: Settings, of_program: bool = False) -> None:
    """Queue for the realtime side that the feed is off and F is not replaced; once more by the next code where this may
    be lost.  of_program: whether a program says so, which ends the set-up of a job (chipwise_command), and not what is
    left of another one."""
    queue(settings, Register.FEED_FIRST, [OFF, 0.0, 0.0, 1.0 if of_program else 0.0], Register.FEED_COMMIT)
    emccanon.SET_AUX_OUTPUT_VALUE(settings["ANALOG_OUT"] + 2, 0.0)
    InForce.feed_left = task.is_restoring()


def _rate(state: State, letter: str, meaning: str) -> float:
    """A removal rate word (cm3/min or in3/min) as mm3/min."""
    value = state.number(letter)
    unit, per = ("in3/min", MM3_PER_IN3) if state.unit == "in" else ("cm3/min", MM3_PER_CM3)
    if value is None:
        raise CycleError(f"word {letter.upper()} ({meaning}, {unit}) is missing", f"add {letter.upper()}")
    if not value > 0:
        raise CycleError(f"{meaning} {letter.upper()}{value:g} {unit} is not above 0", f"give {letter.upper()} above 0")
    if value * per > MAX_RATE:
        raise CycleError(
            f"{meaning} {letter.upper()}{value:g} {unit} is above {MAX_RATE / per:.5g} {unit}, which no machine "
            f"removes",
            f"give {letter.upper()} in {unit}, not in mm3/min",
        )
    return value * per


def _target(state: State, mode: float) -> float:
    """mm3/min: Q, or the rate of the nominal cut I, J at the F in force; 0: none of them, and limits of the tool bound
    the feed alone."""
    if not state.has_any("ij"):
        if mode == LIMIT or state.number("q") is not None:
            return _rate(state, "q", "removal rate")
        lacking = tooth_limits.lacking(state)
        if lacking:
            raise CycleError(
                f"word Q (removal rate) is missing, and no limit of chip or power is known for tool "
                f"{state.interp.tool_table[0].toolno}",
                f"add Q, or {lacking}",
            )
        return 0.0
    if state.number("q") is not None:
        raise CycleError("Q and the nominal cut I, J are both given", "give Q, or I and J")
    if state.number("i") is None and state.number("j") is None:
        raise CycleError(
            "words I and J do not reach chipwise",
            "write argspec=qpreijN in the line REMAP = M251 of the INI file, or give Q",
        )
    sides = [state.needed(letter, meaning) for letter, meaning in (("i", "width of cut"), ("j", "depth of cut"))]
    for letter, meaning, value in zip("IJ", ("width", "depth"), sides):
        if not value > 0:
            raise CycleError(f"{meaning} of cut {letter}{{size}} is not above 0", f"give {letter} above 0", size=value)
    feed = state.feed_per_minute()
    if not feed > 0:
        raise CycleError("the rate of a cut I, J needs a feed, and no F is set", "give F before, or on the line")
    target = sides[0] * sides[1] * feed
    if target > MAX_RATE:
        raise CycleError(
            f"a cut of I{{i}} and J{{j}} at F{{f}}/min is {target / MM3_PER_CM3:.5g} cm3/min, above "
            f"{MAX_RATE / MM3_PER_CM3:.5g} cm3/min, "
            "which no machine removes",
            "give width and depth of one cut",
            i=sides[0],
            j=sides[1],
            f=feed,
        )
    return target


def _feed_words(state: State) -> tuple[int, float, float, float | None]:
    """(mode, target, lower, ceiling) of M251: mm3/min, mm/min; target 0: none; ceiling None where F stays the upper
    limit."""
    state.check_words("qpreij")
    if planner_limits_jerk():
        raise CycleError(
            "LinuxCNC's planner of [TRAJ]PLANNER_TYPE = 1 leaves the path where the feed changes in a blended corner",
            "set PLANNER_TYPE = 0, or leave M251 out",
        )
    mode = state.number("p")
    mode = LIMIT if mode is None else mode
    if mode not in (LIMIT, CONSTANT, WINDOW):
        raise CycleError(f"mode P{mode:g} is not a valid mode", "use P1 (limit), P2 (constant) or P3 (window)")
    target = _target(state, mode)
    lower = _rate(state, "r", "lower removal rate") if mode == WINDOW else 0.0
    if lower > target > 0:
        if state.number("q") is None:
            raise CycleError(
                f"lower removal rate R{state.number('r'):g} is above that of the cut I, J", "give R below it"
            )
        raise CycleError(
            f"lower removal rate R{state.number('r'):g} is above the upper one, Q{state.number('q'):g}",
            "give R below Q",
        )
    ceiling = state.length("e")
    if ceiling is None and mode == CONSTANT:
        raise CycleError("word E (ceiling of the feed) is missing", "mode P2 replaces F; add E")
    if ceiling is not None and (mode == LIMIT or not ceiling > 0):
        raise CycleError(
            "ceiling E{e}/min is not above 0" if mode != LIMIT else "word E is not used in mode P1",
            "give E above 0" if mode != LIMIT else "leave E out, or use P2 or P3",
            e=ceiling,
        )
    if ceiling is not None and not feed_is_remapped():
        raise CycleError(
            f"mode P{mode:g} with a ceiling E replaces F, and F is not remapped",
            "add REMAP = F argspec=N python=feed to [RS274NGC] (not for programs with G93), or use P1",
        )
    return int(mode), target, lower, ceiling


def _looks() -> range:
    """As many looks, LOOK_S apart, as chipwise-monitor is waited for."""
    return range(round(monitor_patience(MONITOR_S) / LOOK_S))


def _wait_for_the_tool(state: State) -> Waits:
    """Wait until the tool in the spindle is known to the stock tracker; CycleError where it does not get known."""
    for _ in _looks():
        yield
        fault = status_now(state)[2]
        if fault not in (Fault.TOOL_CHANGED, Fault.NO_MONITOR):
            return
        emccanon.DWELL(LOOK_S)
    yield
    raise CycleError(
        "the tool in the spindle is not known: chipwise-monitor does not "
        + ("answer" if fault == Fault.NO_MONITOR else "follow it"),
        "start `chipwise monitor` in a shell",
    )


def feed_on(state: State) -> Waits:
    """M251."""
    mode, target, lower, ceiling = _feed_words(state)
    if not state.interp.task:
        preview.volume(state.line_number, mode, target, lower, ceiling)
        return
    yield from _no_ceiling(state)
    yield from _wait_for_the_tool(state)
    send(state, Register.FEED_FIRST, [mode, target, lower, 0.0 if program_run.is_mdi() else 1.0], Register.FEED_COMMIT)
    emccanon.ENABLE_ADAPTIVE_FEED()
    state.interp.adaptive_feed = True
    InForce.feed, InForce.feed_left, InForce.feed_of_mdi, InForce.feed_carried = (
        True,
        False,
        program_run.is_mdi(),
        False,
    )
    InForce.loaded, InForce.ceiling = program_run.loaded_program(state.interp), ceiling
    yield
    now, defined, _fault = status_now(state)
    if now != mode or not defined:
        InForce.feed = False
        send(state, Register.FEED_FIRST, [OFF], Register.FEED_COMMIT)
        yield
        if now != mode:
            raise CycleError(
                "the realtime side does not answer",
                "load chipwise.hal ([HAL]HALFILE) and see [CHIPWISE]ANALOG_OUT and ANALOG_IN",
            )
        raise CycleError("no stock is defined", "define it with M250 before")
    _say_what_is_in_force(InForce.loaded)
    yield from _begin_ceiling(state, ceiling)


def _say_what_is_in_force(loaded: tuple[str, object] | None) -> None:
    if not InForce.stock_here:
        emccanon.MESSAGE("chipwise: M251: this program has not defined a stock, so the one in force is used")
    if program_run.is_mdi():
        emccanon.MESSAGE("chipwise: M251 stays on until M252 or until a program starts")
        if loaded:
            emccanon.MESSAGE(f"chipwise: {printable(opened_name(loaded[0]))} takes M251 into its next run, once")


def _begin_ceiling(state: State, ceiling: float | None) -> Waits:
    """F is replaced from here on, or, where run from line reads over the line, from the first code behind the start
    line."""
    output = state.settings["ANALOG_OUT"] + 2
    if not program_run.skipped():
        feed_ceiling.begin(state.interp, ceiling, output)
        return
    emccanon.SET_AUX_OUTPUT_VALUE(output, 0.0)
    yield  # what is queued without one is thrown away
    if ceiling is not None:
        Ceiling.waiting = ceiling, output


def feed_off(state: State) -> Waits:
    """M252."""
    state.check_words("")
    if not state.interp.task:
        preview.volume(state.line_number, OFF)
        return
    Ceiling.waiting = None
    yield from _no_ceiling(state)
    InForce.feed = InForce.feed_carried = False
    _end_of_feed(state.settings, not program_run.is_mdi())
    yield


def _no_ceiling(state: State) -> Waits:
    """F is the machine's feed again, before the override may rise to 1."""
    if Ceiling.value is None:
        return
    feed_ceiling.end(state.interp)
    yield


def keep_line_number(interp: Interp, words: Words) -> None:
    """Let a move on the line of an F keep its line number.

    LinuxCNC 2.9 goes on with the rest of the line under the number that the calling frame was left with, which nobody
    has set for a remap (interp_o_word.cc, execute_call, CS_REEXEC_PYBODY): such moves had line 0 or that of another
    line.
    """
    if interp.call_level > 0 and "n" in words:
        interp.sub_context[interp.call_level - 1].sequence_number = int(words["n"])


def job_is_due(interp: Interp) -> bool:
    """Whether this is the main program's first F, and it has a set-up (monitor/set_up.py) or M251 of MDI.  In a tool
    change that is remapped the level is deeper: there the old tool is still in."""
    if (
        InForce.job_asked
        or not interp.task
        or program_run.is_mdi()
        or program_run.skipped()
        or program_run.may_be_skipped()
        or interp.remap_level != 1
    ):
        return False
    InForce.job_asked = True
    ceiling, waits, _active, air = job_now(load_settings())
    return InForce.feed_carried or not InForce.feed and (ceiling > 1.0 or waits or air)


def begin_job(interp: Interp) -> Waits:
    """The set-up's ceiling from here on: a generator that waits until the realtime side has the set-up in force.  Where
    that does not come the feed stays at most F.  Adaptive feed that waits is switched on here: chipwise-monitor may do
    so in manual mode and MDI only."""
    settings = load_settings()
    if InForce.feed_carried:
        yield from _begin_carried(interp, settings)
        return
    for _ in _looks():
        yield
        ceiling, waits, active, air = job_now(settings)
        if active or not ceiling:
            break
        emccanon.DWELL(LOOK_S)
    if waits:
        emccanon.ENABLE_ADAPTIVE_FEED()
        interp.adaptive_feed = True
    if active and (ceiling > 1.0 or air):
        InForce.feed, InForce.feed_left, InForce.feed_of_mdi = True, False, False
        feed_ceiling.begin(
            interp, feed_ceiling.AXES if air else feed_ceiling.Times(ceiling), settings["ANALOG_OUT"] + 2
        )


def _begin_carried(interp: Interp, settings: Settings) -> Waits:
    """The ceiling of M251 of MDI from here on; or that has ended."""
    for _ in _looks():
        yield
        carried = feed_is_carried(settings)
        if carried or mode_now(settings) == OFF:
            break
        emccanon.DWELL(LOOK_S)
    InForce.feed = carried
    InForce.feed_carried = False
    if not carried:
        _end_of_feed(settings)
        emccanon.MESSAGE("chipwise: " + ENDED)
    elif InForce.ceiling is not None:
        feed_ceiling.begin(interp, InForce.ceiling, settings["ANALOG_OUT"] + 2)


def program_feed(interp: Interp, feed: float) -> None:
    """The remapped F: what LinuxCNC does itself, and the ceiling where one is active."""
    interp.feed_rate = feed
    set_canon_feed(interp, feed)
