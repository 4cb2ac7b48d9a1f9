# SPDX-License-Identifier: GPL-2.0-or-later
"""Tool geometry for which LinuxCNC's tool table has no columns.

Called by the cycles' glue (flute length), by the stock tracker's wiring (shape) and by bin/chipwise.  One TOML file,
named by [CHIPWISE]TOOL_GEOMETRY, one table per tool number, lengths in mm, angles in degrees:

    [tool.3]
    shape = "bull"            # flat (default), ball, bull, vee, tapered-ball
    corner_radius = 0.5       # bull, tapered-ball
    tip_angle = 90            # included; vee, tapered-ball
    flute_length = 12
    flutes = 2
    max_rate = 9              # cm3/min
    stick_out = 30            # tip to the lower end of the holder; with
    holder_diameter = 40
    chip_load = 0.04          # largest chip
    chip_least = 0.005        # below it the edge rubs
    deflection = 0.02         # largest bending of the tool
    material = "carbide"      # of the tool: carbide, hss

A rate is cm3/min wherever a person types it, as with M251.  Files of before have max_removal_rate in mm3/min; it is
read, and named by old_rates().
"""

import os
import tomllib
from dataclasses import dataclass
from typing import Any, NoReturn, Optional

from chipwise.errors import CycleError, braceless
from chipwise.host.files import read_bytes
from chipwise.rates import MAX_RATE, MM3_PER_CM3

MATERIALS = ("carbide", "hss")
SHAPES = ("flat", "ball", "bull", "vee", "tapered-ball")
_REQUIRED = {"bull": ("corner_radius",), "vee": ("tip_angle",), "tapered-ball": ("corner_radius", "tip_angle")}


@dataclass(frozen=True)
class ToolGeometry:
    """One tool.  None: not given."""

    shape: str = "flat"
    corner_radius: Optional[float] = None  # mm
    tip_angle: Optional[float] = None  # degrees, included
    flute_length: Optional[float] = None  # mm
    flutes: Optional[int] = None
    max_removal_rate: Optional[float] = None  # mm3/min: max_rate of the file is cm3/min
    stick_out: Optional[float] = None  # mm
    holder_diameter: Optional[float] = None  # mm
    chip_load: Optional[float] = None  # mm, largest chip thickness of an edge
    chip_least: Optional[float] = None  # mm, smallest chip that is cut and not rubbed
    deflection: Optional[float] = None  # mm, how far the tool may bend at its tip
    material: Optional[str] = None  # of the tool
    note: str = ""  # about the old key of the rate: what to write; "" without it


MAX_BYTES = 1 << 18  # of a file: some thousand tools
MAX_DIGITS = 9  # of a tool number
MAX_SHOWN = 40  # characters of a wrong value in a message

_NUMBERS = {
    # key: (smallest, is the smallest itself allowed, largest, rule)
    "corner_radius": (0.0, True, 1e4, "a length of 0 mm or more"),
    "tip_angle": (0.1, True, 179.999, "an angle of 0.1 degrees or more, below 180"),
    "flute_length": (0.0, False, 1e4, "a length above 0 mm"),
    "flutes": (1, True, 100, "a whole number from 1 to 100"),
    "max_rate": (0.0, False, MAX_RATE / MM3_PER_CM3, f"a rate above 0, at most {MAX_RATE / MM3_PER_CM3:g} cm3/min"),
    "stick_out": (0.0, False, 1e4, "a length above 0 mm"),
    "holder_diameter": (0.0, False, 1e4, "a length above 0 mm"),
    "chip_load": (0.0, False, 10.0, "a thickness above 0, at most 10 mm"),
    "chip_least": (0.0, False, 10.0, "a thickness above 0, at most 10 mm"),
    "deflection": (0.0, False, 10.0, "a length above 0, at most 10 mm"),
}

KEYS = ("shape", *_NUMBERS, "material")
OLD_RATE = "max_removal_rate"  # mm3/min; max_rate takes its place
_OLD_NUMBERS = {OLD_RATE: (0.0, False, MAX_RATE, f"a rate above 0, at most {MAX_RATE:.0f} mm3/min")}


def _fail(path: str, tool: Any, text: str, remedy: str) -> NoReturn:
    """Raise the message naming file, tool, key and rule."""
    where = os.path.basename(path) + (f": tool {tool}" if tool is not None else "")
    raise CycleError(braceless(f"{where}: {text}"), remedy)


def _shown(value: Any) -> str:
    """A value of the file in a message."""
    try:
        text = repr(value)
    except ValueError:  # 0x1000.. has no limit, its decimal digits have
        text = "a number of thousands of digits"
    return text if len(text) <= MAX_SHOWN else text[:MAX_SHOWN] + ".."


def _named(key: str) -> str:
    """A key of the file in a message."""
    return key if key.isprintable() and len(key) <= MAX_SHOWN else _shown(key)


def _check_number(path: str, tool: int, key: str, value: Any) -> Any:
    """One numeric key's value, or CycleError."""
    low, closed, high, rule = (_NUMBERS | _OLD_NUMBERS)[key]
    good = isinstance(value, (int, float)) and not isinstance(value, bool)
    good = good and (isinstance(value, int) or key != "flutes")
    if not (good and (value > low or (closed and value == low)) and value <= high):
        _fail(path, tool, f"{key} = {_shown(value)} is not {rule}", "correct the file")
    return value


def _parse_tool(path: str, tool: int, table: Any) -> ToolGeometry:
    """One [tool.N] table -> ToolGeometry."""
    if not isinstance(table, dict):
        _fail(path, tool, "is not a table", f"write [tool.{tool}]")
    for key in table:
        if key not in (*KEYS, OLD_RATE):
            _fail(path, tool, f"{_named(key)} is not a key", "use " + ", ".join(KEYS))
    shape = table.get("shape", "flat")
    if shape not in SHAPES:
        _fail(path, tool, f"shape = {_shown(shape)} is unknown", "use one of " + ", ".join(SHAPES))
    for key in _REQUIRED.get(shape, ()):
        if key not in table:
            _fail(path, tool, f"shape {shape} needs {key}", f"add {key} = ...")
    material = table.get("material")
    if material is not None and material not in MATERIALS:
        _fail(path, tool, f"material = {_shown(material)} is unknown", "use one of " + ", ".join(MATERIALS))
    numbers = {key: _check_number(path, tool, key, table[key]) for key in (*_NUMBERS, OLD_RATE) if key in table}
    if numbers.get("chip_least", 0.0) > numbers.get("chip_load", 10.0):
        _fail(
            path,
            tool,
            f"chip_least = {numbers['chip_least']} mm is more than chip_load = {numbers['chip_load']} mm",
            "correct the file",
        )
    rate, note = rate_of(numbers), _rate_note(numbers)
    numbers = {key: value for key, value in numbers.items() if key not in ("max_rate", OLD_RATE)}
    return ToolGeometry(
        shape=shape,
        **numbers,
        material=material,
        max_removal_rate=None if rate is None else rate * MM3_PER_CM3,
        note=braceless(f"{os.path.basename(path)}: tool {tool}: {note}") if note else "",
    )


def rate_of(table: dict) -> Optional[float]:
    """cm3/min of a tool's table, of both keys the smaller; None without either."""
    found = [table["max_rate"]] if "max_rate" in table else []
    if OLD_RATE in table:
        rate = float(f"{table[OLD_RATE] / MM3_PER_CM3:.12g}")
        found.append(int(rate) if rate == int(rate) else rate)
    return min(found, default=None)


def _rate_note(table: dict) -> str:
    """What to write in place of the old key of the rate, "" without it."""
    if OLD_RATE not in table:
        return ""
    if "max_rate" in table:
        return (
            f"max_rate (cm3/min) and max_removal_rate (mm3/min) are both given, the smaller counts: "
            f"{rate_of(table)} cm3/min; remove max_removal_rate"
        )
    return f"max_removal_rate is in mm3/min; write max_rate = {rate_of(table)} (cm3/min)"


def old_rates(path: str) -> list[str]:
    """A line for each tool of a file that has the old key of the rate; none where the file cannot be used: who needs a
    tool of it says why."""
    try:
        return [tool.note for tool in load_tools(path).values() if tool.note]
    except CycleError:
        return []


def parse_tools(text: str, path: str = "tools.toml") -> dict[int, ToolGeometry]:
    """TOML text -> {tool number: ToolGeometry}.  Raises CycleError naming file, tool, key and rule."""
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a number of 5,000 digits is a ValueError
        _fail(path, None, f"is not TOML: {error}", "correct the file")
    for key in document:
        if key not in ("tool", "lathe"):  # turning/tool.py reads the latter
            _fail(path, None, f"[{_named(key)}] is unknown", "use [tool.N], on a lathe [lathe.N], N the tool number")
    tables = document.get("tool", {})
    if not isinstance(tables, dict):
        _fail(path, None, "tool is not a table", "use [tool.N], N the tool number")
    tools = {}
    for name, table in tables.items():
        if not name.isascii() or not name.isdigit() or len(name) > MAX_DIGITS:
            _fail(
                path,
                _named(name),
                "is not a tool number",
                f"use [tool.N], N a whole number of at most {MAX_DIGITS} digits",
            )
        if int(name) in tools:
            _fail(path, int(name), "is given twice", "remove one of them")
        tools[int(name)] = _parse_tool(path, int(name), table)
    return tools


_cache: dict = {}


def load_tools(path: str) -> dict[int, ToolGeometry]:
    """{tool number: ToolGeometry} of a file; {} where path is "".  Cached, an error too, by path and time of change."""
    if not path:
        return {}
    try:
        found = os.stat(path)
        stamp = (os.path.abspath(path), found.st_mtime_ns, found.st_size, found.st_ino)
    except (OSError, ValueError) as error:
        _fail(
            path,
            None,
            f"cannot be read: {getattr(error, 'strerror', None) or error}",
            "correct [CHIPWISE]TOOL_GEOMETRY",
        )
    if stamp not in _cache:
        _cache.clear()
        try:
            _cache[stamp] = _read_tools(path)
        except CycleError as error:
            _cache[stamp] = error
    if isinstance(_cache[stamp], CycleError):
        raise _cache[stamp].with_traceback(None)
    return _cache[stamp]


def _read_tools(path: str) -> dict[int, ToolGeometry]:
    try:
        text = read_bytes(path, MAX_BYTES).decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        _fail(
            path,
            None,
            f"cannot be read: {getattr(error, 'strerror', None) or error}",
            "correct [CHIPWISE]TOOL_GEOMETRY",
        )
    return parse_tools(text, path)


def tool_geometry(path: str, number: int) -> Optional[ToolGeometry]:
    """The ToolGeometry of one tool, None if the file has none for it."""
    return load_tools(path).get(number)
