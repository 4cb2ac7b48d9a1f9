# SPDX-License-Identifier: GPL-2.0-or-later
"""The file of the set-ups of clamps, [CHIPWISE]CLAMPS: read, and changed without losing what else is in it.

    [set_up.2]                          # M256 P2
    name = "vice"
    [set_up.2.clamp.fixed-jaw]          # mm, machine coordinates
    box = [100.0, 80.0, -90.0, 220.0, 95.0, -60.0]          # minimum in X, Y, Z, maximum
    [set_up.2.clamp.stop]
    cylinder = [90.0, 60.0, -90.0, -65.0, 12.0]             # X, Y, lower end, upper end, diameter

Called by cli/clamps.py, glue/clamps.py, setup/job.py and check/clamps.py.
"""

import os
import re
from dataclasses import dataclass
from typing import Any, NoReturn

from chipwise.host import toml_file
from chipwise.clamps.clamp import Clamp
from chipwise.errors import CycleError, braceless
from chipwise.stock.shape_comment import BOX, BOX_KEYS, CYLINDER, CYLINDER_KEYS
from chipwise.clib.layout import MAX_COORDINATE
from chipwise.host.toml_file import REMEDY

MAX_SET_UP, MAX_CLAMPS, MAX_NAME = 999, 100, 60
CLAMP_NAME = re.compile(r"[A-Za-z0-9_-]{1,40}")
_HEAD = "# Set-ups of clamps of chipwise (M256): mm, machine coordinates.\n"
_NUMBERS = {"box": BOX_KEYS, "cylinder": CYLINDER_KEYS}


@dataclass(frozen=True)
class SetUp:
    """name: "" without one; clamps: {name: Clamp}."""

    name: str
    clamps: dict


def load(path: str) -> dict:
    """{number: SetUp} of a file, {} without one.  Raises CycleError that names set-up, clamp and rule."""
    tables = toml_file.document(path).get("set_up", {})
    if not isinstance(tables, dict):
        _fail(path, "", "set_up is not a table")
    return {_number(path, name): _set_up(path, name, table) for name, table in tables.items()}


def _number(path, name):
    if not (name.isascii() and name.isdigit() and len(name) <= 4 and 1 <= int(name) <= MAX_SET_UP):
        _fail(path, "", f"set-up {name[:40]} is not a number from 1 to {MAX_SET_UP}")
    return int(name)


def _set_up(path, number, table):
    where = f"set-up {number}"
    if not isinstance(table, dict):
        _fail(path, where, "is not a table")
    name, clamps = table.get("name", ""), table.get("clamp", {})
    if not (isinstance(name, str) and len(name) <= MAX_NAME and (name.isprintable() or not name)):
        _fail(path, where, f"its name is not a line of at most {MAX_NAME} characters")
    if not isinstance(clamps, dict) or len(clamps) > MAX_CLAMPS:
        _fail(path, where, f"clamp is not a table of at most {MAX_CLAMPS} clamps")
    return SetUp(
        name,
        {
            clamp: clamp_of(
                path, f"set-up {number}, clamp {clamp[:40]}", clamp, fields, f"clamp {clamp} of set-up {number}"
            )
            for clamp, fields in clamps.items()
        },
    )


def clamp_of(path: str, where: str, name: str, fields: Any, said: str) -> Clamp:
    """The Clamp of one table.  said: its name for the operator.  Raises CycleError that names the file, where and the
    rule."""
    if not CLAMP_NAME.fullmatch(name):
        _fail(path, where, "its name has other characters than letters, digits, - and _")
    shapes = [key for key in _NUMBERS if key in fields] if isinstance(fields, dict) else []
    if len(shapes) != 1:
        _fail(path, where, "it has not one of box and cylinder")
    shape, values = shapes[0], fields[shapes[0]]
    keys = _NUMBERS[shape]
    if not (
        isinstance(values, list)
        and len(values) == len(keys)
        and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values)
    ):
        _fail(path, where, f"{shape} is not {len(keys)} numbers: {', '.join(keys)}")
    if not all(abs(v) <= MAX_COORDINATE for v in values):  # NaN is not, either
        _fail(path, where, f"a number of {shape} is not a position")
    low, high = corners(shape, values)
    for axis, a, b in zip("XYZ", low, high):
        if not b > a:
            _fail(path, where, f"it has no extent in {axis} ({a:g} to {b:g})")
    return Clamp(CYLINDER if shape == "cylinder" else BOX, 0.0, low, high, said)


def corners(shape, values):
    """(low, high) mm of the numbers of a "box" or "cylinder"."""
    values = tuple(map(float, values))
    if shape == "box":
        return values[:3], values[3:]
    x, y, z_low, z_high, diameter = values
    return (x - diameter / 2, y - diameter / 2, z_low), (x + diameter / 2, y + diameter / 2, z_high)


def numbers_of(clamp: Clamp) -> tuple:
    """("box" or "cylinder", its numbers) of a Clamp that is not turned: corners() the other way round."""
    low, high = clamp.low, clamp.high
    return (
        ("cylinder", [*clamp.middle, low[2], high[2], high[0] - low[0]])
        if clamp.shape == CYLINDER
        else ("box", [*low, *high])
    )


def clamps_of(path: str, number: int) -> tuple:
    """The Clamps of a set-up.  Raises CycleError for one that the file does not have."""
    found = load(path)
    if number not in found:
        raise CycleError(
            f"there is no set-up P{number} of clamps; there are {', '.join(map(str, sorted(found))) or 'none'}",
            "add it with `chipwise clamps add`, or use P0 for none",
        )
    return tuple(found[number].clamps.values())


def add(path: str, number: int, clamp: str, shape: str, values: list, name: Any = None) -> None:
    """Put a clamp into a set-up, which is made if it is not there; name: of the set-up, None: as it is.  Raises
    CycleError; the file is then as before."""
    with _changing(path) as document:
        table = document.setdefault("set_up", {}).setdefault(str(number), {})
        if name is not None:
            table["name"] = name
        clamps = table.setdefault("clamp", {})
        if clamp in clamps:
            raise CycleError(
                braceless(f"set-up {number} has a clamp {clamp} already"), "remove it before, or give another name"
            )
        clamps[clamp] = {shape: [float(value) for value in values]}
        _set_up(path, str(number), table.unwrap() if hasattr(table, "unwrap") else table)


def remove(path: str, number: int, clamp: Any = None) -> None:
    """Take a set-up out of the file, or one clamp of it."""
    with _changing(path) as document:
        if clamp is None:
            document["set_up"].pop(str(number))
        else:
            document["set_up"][str(number)]["clamp"].pop(clamp)


def _changing(path):
    load(path)  # a file that is wrong stays as it is
    return toml_file.changing(path, _HEAD, "CLAMPS", "set-ups of clamps")


def _fail(path: str, where: str, text: str) -> NoReturn:
    """Raise the message naming file, set-up, clamp and rule."""
    raise CycleError(braceless(f"{os.path.basename(path)}: {f'{where}: ' if where else ''}{text}"), REMEDY)
