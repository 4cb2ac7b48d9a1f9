# SPDX-License-Identifier: GPL-2.0-or-later
"""M255: teach a point of a station.  And the place of a station for G75 (word P).

Called by codes.py through session.run_steps, and by glue/pattern.py.  In the preview nothing is taught.  What needs
numpy is imported when a station is used: LinuxCNC's task must not load it for every machine.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Mapping

import emccanon

from chipwise.errors import CycleError
from chipwise.glue import program_run
from chipwise.stations import ORIGIN, ON_X, ON_Y, store

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.pattern.isometry import Isometry
    from chipwise.program.interp import Waits
    from chipwise.stations.frame import Frame

PROBED = (5061, 5062, 5063)  # parameters: where the last G38 has found something, and
PROBE_DONE = 5070  # whether it has
TYPICAL_ERROR = 0.01  # mm a taught point may be off, for the message; edge finders and probes are so good
_LEVEL = 1e-9  # of a direction's horizontal part


def teach(state: State) -> Waits:
    """M255."""
    state.check_words("pqh")
    station = _whole(state, "p", "station", store.MAX_STATION)
    point = _whole(state, "q", "point", store.MAX_POINT)
    how = state.number("h") or 0
    if how not in (0, 1):
        raise CycleError(f"H{how:g} is neither H0 nor H1", "use H1 for the last probed position, or leave H out")
    if not state.interp.task:
        return
    if program_run.skipped() or program_run.may_be_skipped():
        emccanon.MESSAGE("chipwise: M255: run from line skips this line, so the station stays as it is")
        yield  # without one the message is thrown away with all that the line has queued
        return
    yield  # the tool gets there
    from chipwise.stations import frame

    place = state.machine_point(_probed(state) if how else state.position())
    path = state.settings.path("STATIONS")
    frame.check_point(point, place)
    kept = {} if point == ORIGIN else store.load(path).get(station, {})  # old points do not belong to a new origin
    points = {**kept, point: place}
    made = frame.frame_of(points) if {ORIGIN, ON_X, ON_Y} <= set(points) else None
    store.teach(path, station, point, place, anew=point == ORIGIN)
    emccanon.MESSAGE(_taught(station, point, points, made).text(state.unit))
    yield


def _whole(state: State, letter: str, meaning: str, most: int) -> int:
    """A word that is a number from 1 to most."""
    value = state.number(letter)
    if value is None:
        raise CycleError(f"word {letter.upper()} ({meaning}) is missing", f"add {letter.upper()}")
    if value not in range(1, most + 1):
        raise CycleError(
            f"{meaning} {letter.upper()}{value:g} is not from 1 to {most}",
            f"use {letter.upper()}1 to {letter.upper()}{most}",
        )
    return int(value)


def _probed(state: State) -> tuple[float, ...]:
    """Where the last G38 has found something: mm, work coordinates."""
    params = state.interp.params
    if params[PROBE_DONE] != 1:
        raise CycleError("H1, but no G38 has found anything", "probe first, or leave H out")
    return tuple(params[number] * state.unit_mm for number in PROBED)


def _taught(station: int, point: int, points: Mapping[int, tuple], made: Frame | None) -> CycleError:
    """What the operator reads, as a CycleError holds it."""
    what = f"station {station}: point {point} is taught"
    if made is None:
        missing = [number for number in (ORIGIN, ON_X, ON_Y) if number not in points]
        return CycleError(f"{what}; point {' and '.join(map(str, missing))} to come", code="M255")
    worst = max(made.predicted_error(made.local(place), TYPICAL_ERROR) for _, place in made.points)
    checked = "residual {residual}" if len(made.points) > 3 else "a fourth point would check it"
    return CycleError(
        f"{what}; tilt {made.tilt:.3f} degrees, {checked}; points that are {{typical}} off move it by up to {{worst}}",
        code="M255",
        residual=max(abs(value) for value in made.residuals.values()),
        typical=TYPICAL_ERROR,
        worst=worst,
    )


def place_of(state: State, number: float) -> Isometry:
    """The Isometry from coordinates of a station to work coordinates."""
    from chipwise.pattern.isometry import Isometry
    from chipwise.stations import frame

    if number not in range(1, store.MAX_STATION + 1):
        raise CycleError(f"station P{number:g} is not from 1 to {store.MAX_STATION}", "use P0 or leave P out for none")
    points = store.load(state.settings.path("STATIONS")).get(int(number))
    if not points:
        raise CycleError(f"station P{number:g} is not taught", f"teach its points with M255 P{number:g} Q1, Q2 and Q3")
    try:
        made = frame.frame_of(points)
    except CycleError as error:
        error.problem = f"station P{number:g}: {error.problem}"
        raise
    angle = math.radians(state.interp.rotation_xy)
    c, s = math.cos(angle), math.sin(angle)
    work = Isometry(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)), state.machine_point((0.0, 0.0, 0.0)))
    return work.inverse().after(Isometry(made.matrix, made.origin))


def is_level(isometry: Isometry) -> bool:
    """Whether Z points up."""
    return math.hypot(isometry.matrix[0][2], isometry.matrix[1][2]) < _LEVEL and isometry.matrix[2][2] > 0
