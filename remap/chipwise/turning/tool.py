# SPDX-License-Identifier: GPL-2.0-or-later
"""Turning tools: LinuxCNC's tool table (D I J Q) and the [lathe.N] tables of the tool geometry file, checked.

Called by read_part.py, request.py and g26_plan.py.  The conventions are those of LinuxCNC's tool picture
(rs274/glcanon.py, 2.9): orientation Q gives where the nose's centre is, seen from the controlled point; I and J are the
directions of the two edges, in degrees from +Z towards +X.  Q2 I85 J25 is an outside tool that cuts towards the chuck.
"""

import math
import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NoReturn, TypedDict, TypeGuard, cast

from chipwise.errors import CycleError, braceless
from chipwise.host.files import read_bytes

ROLES = ("rough", "finish", "groove", "undercut", "thread", "drill", "partoff")
CENTRE = {1: (1, -1), 2: (1, 1), 3: (-1, 1), 4: (-1, -1), 5: (0, -1), 6: (1, 0), 7: (0, 1), 8: (-1, 0), 9: (0, 0)}
RELIEF_DEG = 2.0  # the edges' clearance from the work, unless the file says another
MAX_BYTES = 1 << 18

# key: (largest, may be 0 or less, rule)
_NUMBERS = {
    "edge_length": (500.0, False, "a length above 0 mm"),
    "width": (100.0, False, "a length above 0 mm"),
    "depth": (50.0, False, "a length above 0 mm"),
    "point_angle": (180.0, False, "an angle above 0, up to 180 degrees"),
    "cutting_speed": (2000.0, False, "a speed above 0, up to 2000 m/min"),
    "feed": (10.0, False, "a feed above 0, up to 10 mm per revolution"),
    "finish_feed": (10.0, False, "a feed above 0, up to 10 mm per revolution"),
    "relief": (20.0, True, "an angle from 0 to 20 degrees"),
    "bar": (500.0, False, "a length above 0 mm"),
}


class LatheTable(TypedDict, total=False):
    """A [lathe.N] table of the tool geometry file, as its author writes it; lengths mm, angles degrees."""

    roles: list[str]
    holder: list[float]
    pitch: list[float]
    edge_length: float
    width: float
    depth: float
    point_angle: float
    cutting_speed: float
    feed: float
    finish_feed: float
    relief: float
    bar: float


@dataclass(frozen=True)
class LatheTool:
    """A tool in the frame of its side: x is away from the axis outside, towards the axis inside (mirrored).

    number; role names; inside: bool
    nose                mm, radius; diameter: mm, of the table
    left, right         mm per mm: how the insert's lower edges rise to the left and right of the nose; inf: they do not
                        bind
    flat                mm, bottom of a grooving tool between its corners
    edge                mm, length of the edge; depth: mm, largest depth of cut
    holder_left, holder_right, holder_up    mm from the nose's centre: the holder's box begins `up` above it
    bar                 mm from the nose's lowest point to the far side of a boring bar; 0: not inside
    towards             -1 cuts towards -Z, 1 towards +Z
    tip                 (z, x) mm from the nose's centre to the controlled point, in the machine's own frame
    point_angle         degrees, of a drill; 0: not a drill
    lean                mm per mm by which the edge in front leans away from a wall; inf: it reaches over
    cutting_speed       m/min; feed, finish_feed: mm per revolution of cuts and of finishing cuts; 0: the program's
    relief              degrees by which left and right are flatter than the edges
    included            degrees between the edges; pitch: mm, (least, most) of a threading tool, () for any
    """

    number: int
    roles: tuple[str, ...]
    inside: bool
    nose: float
    diameter: float
    left: float
    right: float
    flat: float
    edge: float
    depth: float
    holder_left: float
    holder_right: float
    holder_up: float
    bar: float
    towards: int
    tip: tuple[float, float]
    point_angle: float = 0.0
    included: float = 0.0
    pitch: tuple[float, ...] = ()
    lean: float = math.inf
    cutting_speed: float = 0.0
    feed: float = 0.0
    finish_feed: float = 0.0
    relief: float = 0.0

    def bare(self) -> "LatheTool":
        """The insert itself, without the relief: left and right rise more."""
        rises = [
            v if math.isinf(v) else math.tan(math.atan(v) + math.radians(self.relief)) for v in (self.left, self.right)
        ]
        return replace(self, left=rises[0], right=rises[1], relief=0.0)


@dataclass(frozen=True)
class TableTool:
    """A line of the tool table: D, I, J, Q, and the offsets X (a radius) and Z; machine units and degrees."""

    diameter: float = 0.0
    front: float = 0.0
    back: float = 0.0
    orientation: int = 0
    x: float = 0.0
    z: float = 0.0


def read_table(path: str) -> dict[int, TableTool]:
    """{tool number: TableTool} of a LinuxCNC tool table."""
    try:
        text = read_bytes(path, MAX_BYTES * 16).decode("utf-8", "replace")
    except OSError as error:
        raise CycleError(f"tool table {braceless(path)}: {error.strerror}", "correct [EMCIO]TOOL_TABLE") from error
    tools: dict[int, TableTool] = {}
    for line in text.splitlines():
        words = {word[0]: word[1:] for word in line.partition(";")[0].upper().split() if word[0] in "TDIJQXZ"}
        if re.fullmatch(r"\d{1,9}", words.get("T", "")):
            tools.setdefault(int(words["T"]), _table_tool(path, line, words))
    return tools


def _table_tool(path: str, line: str, words: dict[str, str]) -> TableTool:
    """TableTool of the words {letter: text} of a line."""
    try:
        numbers = {letter: float(text) for letter, text in words.items()}
        if all(map(math.isfinite, numbers.values())):
            return TableTool(
                diameter=numbers.get("D", 0.0),
                front=numbers.get("I", 0.0),
                back=numbers.get("J", 0.0),
                orientation=int(numbers.get("Q", 0)),
                x=numbers.get("X", 0.0),
                z=numbers.get("Z", 0.0),
            )
    except ValueError:
        pass
    raise CycleError(
        f"tool table {braceless(path)}: the line {braceless(line.strip()[:60])} cannot be read",
        "correct the tool table",
    )


def read_geometry(path: str) -> dict[int, LatheTable]:
    """{tool number: {key: value}} of the [lathe.N] tables; {} without a file."""
    if not path:
        return {}
    try:
        document = tomllib.loads(read_bytes(path, MAX_BYTES).decode("utf-8"))
    except OSError as error:
        raise CycleError(
            f"{braceless(path)} cannot be read: {error.strerror}", "correct [CHIPWISE]TOOL_GEOMETRY"
        ) from error
    except (ValueError, RecursionError) as error:
        raise CycleError(f"{braceless(path)} is not TOML: {braceless(str(error))}", "correct the file") from error
    tables = document.get("lathe", {})
    if not isinstance(tables, dict) or not all(
        re.fullmatch(r"\d{1,9}", n) and isinstance(t, dict) for n, t in tables.items()
    ):
        raise CycleError("lathe is not a table of tool numbers", "write [lathe.N], N the tool number")
    return {int(number): _checked(int(number), table) for number, table in tables.items()}


def _checked(number: int, table: dict[str, object]) -> LatheTable:
    """A [lathe.N] table whose keys and values are known."""
    for key, value in table.items():
        if key == "roles":
            if not isinstance(value, list) or any(role not in ROLES for role in value):
                raise CycleError(f"lathe tool {number}: roles are not a list of known ones", "use " + ", ".join(ROLES))
        elif key == "holder":
            box = _numbers_of(value, 3)
            if not (box and box[0] < box[1] and box[2] > 0):
                raise CycleError(
                    f"lathe tool {number}: holder is not [left, right, up] with left below right and up above 0",
                    "give the holder's box in mm from the centre of the nose: holder = [-2, 18, 8]",
                )
        elif key == "pitch":
            ends = _numbers_of(value, 2)
            if not (ends and 0 < ends[0] <= ends[1]):
                raise CycleError(
                    f"lathe tool {number}: pitch is not [least, most] above 0",
                    "give the pitches of the insert in mm: pitch = [0.5, 1.5]",
                )
        elif key not in _NUMBERS:
            raise CycleError(
                f"lathe tool {number}: {braceless(key[:40])} is not a key",
                "use roles, holder, pitch, " + ", ".join(_NUMBERS),
            )
        else:
            most, zero, rule = _NUMBERS[key]
            if not _finite(value) or not (0 <= value <= most if zero else 0 < value <= most):
                raise CycleError(f"lathe tool {number}: {key} is not {rule}", "correct the file")
    return cast(LatheTable, table)  # each key and each value has been looked at


def _numbers_of(value: object, count: int) -> list[float]:
    """The value if it is a list of so many finite numbers, else []."""
    return value if isinstance(value, list) and len(value) == count and all(map(_finite, value)) else []


def _finite(value: object) -> TypeGuard[float]:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def make_tool(
    number: int, table: dict[int, TableTool], geometry: dict[int, LatheTable], unit_mm: float = 1.0
) -> LatheTool:
    """LatheTool of a line of the tool table and its [lathe.N] table.  Raises CycleError for what leaves its shape
    open."""

    def wrong(fact: str, remedy: str) -> NoReturn:
        raise CycleError(f"tool {number}: {fact}", remedy)

    if number not in table:
        wrong("the tool table has no such tool", "add it, or name another one in (LATHE,..)")
    entry, more = table[number], geometry.get(number)
    if more is None:
        wrong("the tool geometry file has no [lathe.N] table for it", "add edge_length and holder of the tool")
    if entry.orientation not in CENTRE:
        wrong(f"orientation Q{entry.orientation} is not from 1 to 9", "set Q in the tool table")
    nose, diameter = 0.5 * entry.diameter * unit_mm, entry.diameter * unit_mm
    if "point_angle" in more:
        return _drill(number, entry, more, diameter, wrong)
    return _insert(number, entry, more, nose, wrong)


def _insert(
    number: int, entry: TableTool, more: LatheTable, nose: float, wrong: Callable[[str, str], NoReturn]
) -> LatheTool:
    """LatheTool of an insert; nose: its radius, mm; wrong(fact, remedy) raises."""
    if not 0.0 < nose <= 50.0:
        wrong(
            f"the nose diameter D{2 * nose:g} mm is not above 0 and up to 100 mm",
            "set D in the tool table to twice the nose radius",
        )
    for key in ("edge_length", "holder"):
        if key not in more:
            wrong(f"[lathe.{number}] has no {key}", f"add {key}: without it nobody knows what the tool touches")
    inside, low, high = _edges(entry, "width" in more, wrong)
    relief = more.get("relief", RELIEF_DEG)
    left, right = _rise(180.0 - high, relief), _rise(low, relief)
    if min(left, right) <= 0.0:
        wrong(
            f"its edges at I{entry.front:g} J{entry.back:g} leave nothing of the relief of {relief:g} degrees",
            "correct I and J, or set relief",
        )
    flat = _bottom(more, nose, wrong)
    if inside and "bar" not in more:
        wrong(f"[lathe.{number}] has no bar", "add the width of the boring bar, from the tip to its far side")
    towards, lean = _front(low, high)
    return LatheTool(
        number=number,
        roles=tuple(more.get("roles", ())),
        inside=inside,
        nose=nose,
        diameter=2 * nose,
        left=left,
        right=right,
        flat=flat,
        edge=more["edge_length"],
        depth=min(more.get("depth", more["edge_length"] / 2), more["edge_length"]),
        holder_left=more["holder"][0],
        holder_right=more["holder"][1],
        holder_up=more["holder"][2],
        bar=more.get("bar", 0.0),
        towards=towards,
        tip=_tip(entry.orientation, nose, flat),
        included=high - low,
        pitch=tuple(more.get("pitch", ())),
        lean=lean,
        relief=relief,
        cutting_speed=more.get("cutting_speed", 0.0),
        feed=more.get("feed", 0.0),
        finish_feed=more.get("finish_feed", 0.0),
    )


def _bottom(more: LatheTable, nose: float, wrong: Callable[[str, str], NoReturn]) -> float:
    """mm between the corners of a grooving tool, 0.0 of other inserts."""
    if "width" in more and more["width"] < 2 * nose:
        wrong(f"its width {more['width']:g} mm is less than twice the nose radius {nose:g} mm", "correct width or D")
    return max(more.get("width", 0.0) - 2 * nose, 0.0)


def _front(low: float, high: float) -> tuple[int, float]:
    """(towards, lean) of an insert whose edges have these angles, degrees."""
    towards = 1 if low >= 90.0 and high > 90.0 else -1
    ahead = low - 90.0 if towards > 0 else 90.0 - high
    return towards, math.tan(math.radians(ahead)) if ahead >= 0.0 else math.inf


def _tip(orientation: int, nose: float, flat: float) -> tuple[float, float]:
    """(z, x) mm from the nose's centre to the controlled point."""
    x, z = CENTRE[orientation]
    return {1: 0.0, 0: 0.5, -1: 1.0}[z] * flat - z * nose, -x * nose


def _edges(entry: TableTool, flat: bool, wrong: Callable[[str, str], NoReturn]) -> tuple[bool, float, float]:
    """(inside, lower, higher angle) of the insert, mirrored to the outside; flat: a grooving tool, whose edges may be
    parallel."""
    low, high = sorted(angle % 360.0 for angle in (entry.front, entry.back))
    if high - low > 180.0:
        low, high = high - 360.0, low
    if high - low < 1.0 and not (flat and high - low == 0.0):
        wrong(
            f"its edges at I{entry.front:g} J{entry.back:g} leave no insert between them",
            "set I and J in the tool table, in degrees from +Z",
        )
    inside = low >= 180.0
    if inside:
        low, high = 360.0 - high, 360.0 - low
    if not (0.0 < low and high < 180.0):
        wrong(
            f"its edges at I{entry.front:g} J{entry.back:g} point along Z: it turns neither outside nor inside",
            "use a tool whose edges are both above or both below the Z axis",
        )
    x = CENTRE[entry.orientation][0]
    if x and (x < 0) != inside:
        wrong(
            f"orientation Q{entry.orientation} and edges at I{entry.front:g} J{entry.back:g} are of different sides",
            "correct Q, I or J",
        )
    return inside, low, high


def _rise(angle: float, relief: float) -> float:
    """Rise of an edge at an angle from the Z axis, flatter by the relief; inf from 90 degrees on: there it leans
    away."""
    return math.inf if angle >= 90.0 else math.tan(math.radians(angle - relief))


def _drill(
    number: int, entry: TableTool, more: LatheTable, diameter: float, wrong: Callable[[str, str], NoReturn]
) -> LatheTool:
    if not diameter > 0.0:
        wrong("the drill has no diameter", "set D in the tool table")
    if entry.orientation != 7:
        wrong(f"orientation Q{entry.orientation} is not that of a drill", "set Q7 in the tool table")
    if "edge_length" not in more:
        wrong(f"[lathe.{number}] has no edge_length", "add the length of the drill's flutes")
    return LatheTool(
        number=number,
        roles=tuple(more.get("roles", ("drill",))),
        inside=True,
        nose=0.0,
        diameter=diameter,
        left=math.inf,
        right=math.inf,
        flat=0.0,
        edge=more["edge_length"],
        depth=more.get("depth", diameter),
        holder_left=0.0,
        holder_right=0.0,
        holder_up=0.0,
        bar=0.0,
        towards=-1,
        tip=(0.0, 0.0),
        point_angle=more["point_angle"],
        cutting_speed=more.get("cutting_speed", 0.0),
        feed=more.get("feed", 0.0),
        finish_feed=more.get("finish_feed", 0.0),
    )
