# SPDX-License-Identifier: GPL-2.0-or-later
"""M256: the set-up of clamps that is in force.  For cycles it ends with the program, as in the preview; before the
realtime guard it stays (monitor/clamps_in_force.py).

Called by codes.py through session.run_steps, by session.begin and by state.py.  What needs numpy is imported when a
set-up is used: LinuxCNC's task must not load it for every machine.
"""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING

import emccanon

from chipwise import ini
from chipwise.glue import program_run, soft_limits
from chipwise.order import ClampsAsked
from chipwise.pattern.job import DEPTH
from chipwise.program import preview
from chipwise.errors import CycleError
from chipwise.clib.layout import Register

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.program.interp import Interp, Waits

MOST = 999
SET_UP = "_chipwise>clamps"  # no program can write it: to LinuxCNC's parser a name ends at ">"
SINCE = "_chipwise>clamps_since"  # line of the M256
CURRENT = 5220  # LinuxCNC's parameters: the coordinate system in force, and behind it all of them
SYSTEMS, EACH = 9, 20
TURN = 9  # of a system


def put_on(state: State) -> Waits:
    """M256."""
    state.check_words("p")
    number = state.number("p")
    if number is None:
        raise CycleError("word P (set-up of clamps) is missing", "add P, or P0 for none")
    if number not in range(MOST + 1):
        raise CycleError(f"set-up P{number:g} is not from 0 to {MOST}", "use P0 for none")
    if number:
        from chipwise.clamps import set_ups

        set_ups.clamps_of(state.settings.path("CLAMPS"), int(number))
    state.interp.params[SET_UP], state.interp.params[SINCE] = (
        number,
        program_run.main_line(state.interp, state.line_number),
    )
    if not state.interp.task:
        preview.clamps(state.line_number, int(number))
        return
    from chipwise.glue import stock_codes

    if program_run.skipped():
        emccanon.MESSAGE(
            "chipwise: M256: run from line skips this line, so the clamps before the machine stay as they are; give it "
            "in MDI before"
        )
        yield
        return
    yield from stock_codes.request(
        state, int(number), Register.CLAMPS_COMMIT, f"the clamps of set-up P{number:g} are not in force"
    )


def asked(state: State) -> ClampsAsked | None:
    """The ClampsAsked of a cycle: the planner finds the clamps of M256, of the program's comments and of its set-up.
    In MDI, and in the sub of a pattern, only those of M256; None without a program."""
    interp, settings = state.interp, state.settings
    known = interp.params.globals()
    number, since = (int(interp.params[name]) if name in known else 0 for name in (SET_UP, SINCE))
    program = "" if program_run.is_mdi() or os.environ.get(DEPTH, "0") != "0" else program_run.main_file(interp)
    if not (number or program):
        return None
    try:
        diameter = state.tool_diameter()
    except CycleError:
        diameter = 0.0
    return ClampsAsked(
        set_up=number,
        file=settings.path("CLAMPS"),
        program=program,
        line=program_run.main_line(interp, state.line_number),
        since=since,
        ini=ini.file_name() or "",
        jobs=settings.path("JOBS"),
        now=_now(state),
        systems=_systems(state),
        clearance=settings["CLAMP_CLEARANCE"],
        diameter=diameter,
        geometry=(settings.path("TOOL_GEOMETRY"), interp.tool_table[0].toolno),
        limits=soft_limits.of(state),
    )


def _now(state: State) -> tuple[str, int, tuple[float, tuple[float, float, float], tuple[float, float, float]]]:
    """Units, number of the coordinate system and its frame."""
    interp, unit = state.interp, state.unit_mm
    offset = interp.origin_offset_x * unit, interp.origin_offset_y * unit, interp.origin_offset_z * unit
    return state.unit, int(interp.params[CURRENT]), (math.radians(interp.rotation_xy), offset, _g92(state))


def _g92(state: State) -> tuple[float, float, float]:
    interp, unit = state.interp, state.unit_mm
    return interp.axis_offset_x * unit, interp.axis_offset_y * unit, interp.axis_offset_z * unit


def _systems(state: State) -> tuple[tuple[float, tuple[float, ...], tuple[float, float, float]], ...]:
    """The frames of LinuxCNC's table, which has machine units."""
    params, g92 = state.interp.params, _g92(state)
    unit = 1.0 / emccanon.GET_EXTERNAL_LENGTH_UNITS()
    firsts = range(CURRENT + 1, CURRENT + 1 + SYSTEMS * EACH, EACH)
    return tuple(
        (math.radians(params[first + TURN]), tuple(params[first + k] * unit for k in range(3)), g92) for first in firsts
    )


def forget(interp: Interp) -> None:
    """No set-up is in force."""
    for name in (SET_UP, SINCE):
        if name in interp.params.globals():
            del interp.sub_context[0].named_params[name]
