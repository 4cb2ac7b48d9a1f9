# SPDX-License-Identifier: GPL-2.0-or-later
"""The file of the stations, [CHIPWISE]STATIONS: read, and changed without losing what else is in it.

    [station.3]                 # mm, machine coordinates of the tool's tip
    1 = [100.0, 50.0, -20.0]    # the origin; 2 on +X, 3 in the XY plane on the +Y side, 4 and on in the XY plane
    2 = [300.0, 50.0, -20.0]

Called by glue/stations.py and cli/stations.py.
"""

import os
from typing import Any, NoReturn

from chipwise.host import toml_file
from chipwise.errors import CycleError, braceless
from chipwise.host.toml_file import REMEDY

MAX_COORDINATE = 1e6  # mm
MAX_STATION, MAX_POINT = 999, 99
DECIMALS = 9  # of a mm
_HEAD = "# Stations of chipwise (M255): points in mm, machine coordinates of the tool's tip.\n"


def load(path: str) -> dict:
    """{station: {point: (x, y, z)}} of a file, {} without one.  Raises CycleError that names station, point and
    rule."""
    tables = toml_file.document(path).get("station", {})
    if not isinstance(tables, dict):
        _fail(path, None, "station is not a table", REMEDY)
    return {
        _number(path, None, name, MAX_STATION, "station"): _points(path, name, table) for name, table in tables.items()
    }


def _points(path, station, table):
    """One [station.N] table -> {point: (x, y, z)}; other keys than numbers are the user's."""
    if not isinstance(table, dict):
        _fail(path, station, "is not a table", REMEDY)
    points = {}
    for name, value in table.items():
        if not name.isdigit():
            continue
        number = _number(path, station, name, MAX_POINT, "point")
        good = (
            isinstance(value, list)
            and len(value) == 3
            and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in value)
        )
        if not good:
            _fail(path, station, f"point {number} is not three numbers", REMEDY)
        if not all(abs(v) <= MAX_COORDINATE for v in value):  # NaN is not, either
            _fail(path, station, f"point {number} is not a position", REMEDY)
        points[number] = tuple(map(float, value))
    return points


def _number(path, station, name, most, what):
    if not (name.isascii() and name.isdigit() and len(name) <= 4 and 1 <= int(name) <= most):
        _fail(path, station, f"{what} {name[:40]} is not a number from 1 to {most}", REMEDY)
    return int(name)


def _fail(path: str, station: Any, text: str, remedy: str) -> NoReturn:
    """Raise the message naming file, station, what and rule."""
    where = os.path.basename(path) + (f": station {station}" if station is not None else "")
    raise CycleError(braceless(f"{where}: {text}"), remedy)


def teach(path: str, station: int, point: int, place, anew: bool = False) -> None:
    """Put a point (x, y, z) of a station into the file; anew: the station has no other points afterwards.

    Raises CycleError; the file is then as before."""
    with _changing(path) as document:
        table = document.setdefault("station", {}).setdefault(str(station), {})
        for name in [name for name in table if anew and name.isdigit()]:
            del table[name]
        table[str(point)] = [round(float(value), DECIMALS) + 0.0 for value in place]


def remove(path: str, station: int) -> None:
    """Take a station out of the file."""
    with _changing(path) as document:
        document.get("station", {}).pop(str(station), None)


def _changing(path):
    """The file as a document: toml_file.changing."""
    load(path)  # a file that is wrong stays as it is
    return toml_file.changing(path, _HEAD, "STATIONS", "stations")
