# SPDX-License-Identifier: GPL-2.0-or-later
"""G24: words and the SURFACE comment -> the fields of a SurfaceRequest.  Called by codes.py through session.run_cycle.

Comment as in docs/user/surfaces.md:
    (SURFACE,FILE=part.stl,X=0,Y=0,Z=0,SCALE=1)
"""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING

from chipwise.program import comments
from chipwise.errors import CycleError
from chipwise.glue import known_cuts
from chipwise.program import known_stock
from chipwise.ini import Ini, file_name
from chipwise.pattern import mirroring
from chipwise.tool_data.geometry import ToolGeometry, tool_geometry

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.order import Order
    from chipwise.surface.model import Placing

WORDS = "dlzrikep"
KEYS = ("X", "Y", "Z", "SCALE", "PIXEL", "DEPTH")
RELIEF = 1.0  # mm, K without a word


def order(state: State) -> Order:
    """The order of G24 for session.run_cycle: State -> Order."""
    state.check_words(WORDS)
    path, placing = surface_of(state)
    fields = dict(_words(state), file=path, stamp=stamp_of(path), placing=placing)
    frame = state.machine_point((0.0, 0.0, 0.0)), state.interp.rotation_xy
    earlier = known_cuts.before(state.interp, frame, fields)
    known_cuts.add(state.interp, frame, fields)
    return state.order("surface", dict(fields, earlier=earlier))


def _words(state: State) -> dict[str, object]:
    """Words of the line -> fields of a SurfaceRequest (mm), all but the model."""
    from chipwise.clib.height_map import Shape  # here, so that only G24 loads numpy into the interpreter

    clearance, bottom = state.heights()
    relief, top = state.length("k"), known_stock.top(state.interp)
    diameter = state.tool_diameter()
    geometry = tool_geometry(state.settings.path("TOOL_GEOMETRY"), state.interp.tool_table[0].toolno) or ToolGeometry()
    return dict(
        bottom=bottom,
        clearance=clearance,
        tool=Shape.of_tool(diameter, geometry),
        step=state.needed("d", "step-over"),
        direction=float(state.number("l") or 0),
        allowance=state.length("i") or 0.0,
        relief=RELIEF if relief is None else relief,
        link=state.number("p") or 0,
        climb=state.turns_clockwise() != mirroring.mirrored,
        tolerance=state.settings["SURFACE_TOLERANCE"],
        stock_top=None if top is None else top - state.machine_point((0.0, 0.0, 0.0))[2],
        cell=state.settings["CELL"],
        start=state.position(),
        depth=_height(state, "_chipwise_surface_depth"),
        least=_height(state, "_chipwise_surface_rest"),
        scallop=_height(state, "_chipwise_surface_scallop"),
        arcs=not state.interp.rotation_xy,
        ramp_angle=state.ramp_angle(),
        traverse_clearance=state.settings["TRAVERSE_CLEARANCE"],
        flute_length=geometry.flute_length or 0.0,
        **state.feeds(),
    )


def _height(state: State, name: str) -> float | None:
    """A named parameter in program units -> mm; None where it is 0 or not set.  Raises CycleError."""
    value = state.parameter(name)
    if value is not None and not 0 <= value < math.inf:
        raise CycleError(
            f"#<{name}> = {value:g} is not a height of 0 or more", f"set #<{name}> to 0 (not used) or more"
        )
    return value * state.unit_mm if value else None


def surface_of(state: State) -> tuple[str, Placing]:
    """(path, Placing) of the last SURFACE comment before the line; its lengths are in program units."""
    from chipwise.surface.model import DEPTH, Placing

    text = find_comment(state.program(), state.line_number)
    if text is None:
        raise CycleError(
            "there is no SURFACE comment before this line", "add (SURFACE,FILE=part.stl,X=0,Y=0,Z=0,SCALE=1) before it"
        )
    name, numbers = parse_comment(text)
    unit = state.unit_mm
    pixel = numbers.get("PIXEL")
    placing = Placing(
        tuple(numbers.get(axis, 0.0) * unit for axis in "XYZ"),
        numbers.get("SCALE", 1.0),
        None if pixel is None else pixel * unit,
        numbers["DEPTH"] * unit if "DEPTH" in numbers else DEPTH,
        "SCALE" in numbers,
    )
    return found_path(name, state.program()), placing


def find_comment(path: str, line_number: int) -> str | None:
    """Inside of the last SURFACE comment up to a line of a program; None without one."""
    found: str | None = None
    try:
        with open(path, encoding="utf-8", errors="surrogateescape") as program:
            for number, line in enumerate(program, 1):
                if number > line_number > 0:
                    break
                found = (found, *comments.insides(line, "SURFACE"))[-1]
    except OSError:
        return None
    return found


def parse_comment(text: str) -> tuple[str, dict[str, float]]:
    """ "FILE=part.stl,X=0,.." -> (name, {"X": 0.0, ..}).  Raises CycleError."""
    name, numbers = "", {}
    for part in filter(None, (piece.strip() for piece in text.split(","))):
        key, _equals, value = (piece.strip() for piece in part.partition("="))
        if key.upper() in numbers or name and key.upper() == "FILE":
            raise CycleError("SURFACE comment: {key} is given twice", "give it once", key=key.upper())
        if key.upper() == "FILE" and value:
            name = value
            continue
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if key.upper() not in KEYS or not math.isfinite(number) or key.upper() in KEYS[3:] and number <= 0:
            raise CycleError(
                "SURFACE comment: {part} is not FILE=name, X, Y or Z with a number, or SCALE, PIXEL or DEPTH with a "
                "number above 0",
                "correct the comment",
                part=part,
            )
        numbers[key.upper()] = number
    if not name:
        raise CycleError("SURFACE comment: FILE is missing", "add FILE=part.stl")
    return name, numbers


def found_path(name: str, program: str) -> str:
    """Path of a model: in the program's folder, else in [DISPLAY]PROGRAM_PREFIX; an absolute one as it is."""
    folders = [os.path.dirname(os.path.abspath(program))]
    ini = file_name()
    if ini:
        folders.append(
            os.path.join(
                os.path.dirname(os.path.abspath(ini)),
                os.path.expanduser(Ini(ini).text("DISPLAY", "PROGRAM_PREFIX", ".")),
            )
        )
    paths = [os.path.join(folder, os.path.expanduser(name)) for folder in folders]
    return next((path for path in paths if os.path.exists(path)), paths[0])


def stamp_of(path: str) -> tuple[int, int]:
    """(time of change in ns, bytes) of a file: a plan is kept for them; (0, 0) if it cannot be read."""
    try:
        found = os.stat(path)
        return found.st_mtime_ns, found.st_size
    except (OSError, ValueError):
        return 0, 0
