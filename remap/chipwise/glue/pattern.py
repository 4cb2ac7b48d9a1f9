# SPDX-License-Identifier: GPL-2.0-or-later
"""G75: words -> the fields of a PatternRequest, and the PatternJob of its sub.  Called by codes.py through
session.run_cycle."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import TYPE_CHECKING

import emccanon

from chipwise.errors import CycleError
from chipwise.glue import soft_limits
from chipwise.glue import robot, shape, stations
from chipwise.program import known_stock
from chipwise.pattern import mirroring
from chipwise.pattern.job import DEPTH, PatternJob

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.order import Order
    from chipwise.pattern.isometry import Isometry

WORDS = "qxyzrhlijkp"

_MODES = (0, 10, 20, 30)  # G0 to G3 as the interpreter's motion mode


def check_modes(state: State) -> None:
    """Raise CycleError where a mode is active that G75 does not work in: on a machine without Y those of a lathe
    count."""
    if "Y" in state.axes():
        state.check_modes()
        return
    if state.interp.plane != emccanon.CANON_PLANE.CANON_PLANE_XZ:
        raise CycleError("the plane is not G18", "program G18 before")
    state.check_common_modes()


def order(state: State) -> Order:
    """The order of G75 for session.run_cycle: State -> Order."""
    state.check_words(WORDS)
    machine = state.axes()
    lathe = "Y" not in machine
    if state.interp.feed_mode != 0 and not lathe:
        raise CycleError("feed per revolution (G95) is on", "program G94 before")
    number = state.number("p") or 0
    if number and os.environ.get(DEPTH, "0") != "0":
        raise CycleError(
            f"station P{number:g} in a sub that is run as a pattern: its place would be moved with the pattern",
            "use P in the program itself",
        )
    station = stations.place_of(state, number) if number and not lathe else None
    shift, travel = _shift(state, station), soft_limits.of(state)
    fields = dict(_fields(state, shift, travel), lathe=lathe, station=number)
    fields.update(robot.of(state, station, travel))
    up: float | None = shift[2]
    if station:
        fields["place"] = (station.matrix, station.shift)
        up = station.point(shift)[2] if stations.is_level(station) else None
    # the orientation of a robot's tool is the station's: its axes are nothing that a sub turns
    letters = "".join(letter for letter in machine if letter in "XYZ" or not state.settings["TOOL_POSE"])
    fields["abc"] = tuple(
        getattr(state.interp, 2 * letter + "_current") if letter in letters else 0.0 for letter in "ABC"
    )
    return replace(state.order("pattern", fields, _job(state, up, letters)), axes=machine)


def _shift(state: State, station: Isometry | None) -> tuple[float, ...]:
    """(x, y, z) mm of the words X Y Z, in coordinates of the station; station: the Isometry from them to work
    coordinates, None without one."""
    here = state.position()
    shift = []  # under G7 the interpreter has halved X
    for letter, now in zip("xyz", station.back(here) if station else here):
        value = state.length(letter)
        shift.append(0.0 if value is None else now + value if state.incremental else value)
    return tuple(shift)


def _fields(state: State, shift: tuple[float, ...], travel: dict[str, tuple] | None) -> dict[str, object]:
    """Words of the line -> fields of a PatternRequest (mm, degrees)."""
    copies = state.number("l")
    return dict(
        shift=shift,
        start=state.position(),
        chord=state.settings["CHORD"],
        rotation=state.number("r") or 0.0,
        mirror=state.number("h") or 0,
        copies=1 if copies is None else copies,
        in_mirror=mirroring.mirrored,
        travel=travel,
        keep_climb=_keep_climb(state),
        close_gap=state.settings["CLOSE_GAP"],
        step=(state.length("i") or 0.0, state.length("j") or 0.0),
        turn=state.number("k") or 0.0,
    )


def _keep_climb(state: State) -> bool:
    """#<_chipwise_keep_climb>, else [CHIPWISE]KEEP_CLIMB."""
    value = state.parameter("_chipwise_keep_climb")
    if value is None:
        return state.settings["KEEP_CLIMB"]
    if value not in (0.0, 1.0):
        raise CycleError(
            f"#<_chipwise_keep_climb> = {value:g} is neither 0 nor 1",
            "set it to 1 to run closed chains of a mirrored sub backwards",
        )
    return value == 1.0


def _job(state: State, up: float | None, letters: str) -> PatternJob:
    """The sub as it would be called here, in a pattern that is shifted up by so much (mm); None: tilted; letters: of
    the axes it may move."""
    interp, params = state.interp, state.interp.params
    turn = (3 if params["_spindle_cw"] else 4) if params["_spindle_on"] else 5
    motion, top = interp.motion_mode, known_stock.top(interp)
    sub = replace(
        shape.job(state, shape.sub_number(state)),
        lathe="Y" not in letters,
        diameter=bool(params["_lathe_diameter_mode"]),
    )
    return PatternJob(
        sub,
        mirrored=mirroring.mirrored,
        axes=letters,
        per_rev=interp.feed_mode != 0,
        orientation=interp.tool_table[0].orientation,
        spindle=(turn, float(interp.speed[0])),
        coolant=(bool(params["_mist"]), bool(params["_flood"])),
        motion=motion // 10 if motion in _MODES else 0,
        stock_top=None if top is None or up is None else top - up,
    )
