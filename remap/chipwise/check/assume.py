# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock and the tools that a program without M250 or without tool changes is taken to be for.

Called by check/answer.py.  In this order: what the user names, the comments of the CAM system
(program/post_comments.py), the program's own path
(survey.py).  A tool is never made up: where neither tool table nor comments have its diameter, Unknown says what to
name.

The stock of a path alone: in X and Y as far as the tools reach in feed moves below the top, down to the lowest tip of a
feed move.  Its top is Z0 if the program feeds below Z0 and is ever above it, else the highest place of a feed move
across.  So it has no walls beyond the path: a stock that is larger in truth is cut deeper at the sides only where tools
lead in.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Optional

from chipwise.tool_data import table
from chipwise.program import post_comments
from chipwise.check.survey import Box, Survey
from chipwise.program.program_file import Unreadable
from chipwise.errors import format_length, format_place
from chipwise.tool_data.geometry import ToolGeometry

if TYPE_CHECKING:
    from chipwise.check.survey import ToolPath
    from chipwise.clib.arrays import Corners
    from chipwise.program.reader import Machine, Reader

Progress = Callable[[float], object]  # called with the number of a line, or with the share of all that is done
COMMENT, PATH = "comment", "assumed"  # where a stock comes from
TOOL, STOCK = "tool", "stock"  # what may be lacking
SAME = 0.01  # diameters that differ less are the same
LEAST_MM = 0.01  # of a stock's extent
AROUND_MM = 1e-3
MOST = 0.7  # of a path that lies inside a stock


@dataclass(frozen=True)
class AssumedTool:
    """diameter: mm; geometry: by a comment; described: whether the tool geometry of that number is this tool's."""

    diameter: float
    geometry: Optional[ToolGeometry] = None
    described: bool = True


@dataclass(frozen=True)
class Named:
    """What the user names of a program.  stock: whether a stock; tool: number, diameter: mm, of the tool in the spindle
    at the beginning, or None."""

    stock: bool = False
    tool: Optional[int] = None
    diameter: Optional[float] = None


@dataclass
class Assumption:
    """Stock: low, high (mm, work coordinates of the first move; None: the program or the user has one) and source.
    tools: {number: AssumedTool} that the tool table does not have; spindle: number of the tool at the beginning, None:
    the program calls it; notes: sentences for the user; lacking: [(fact, remedy, about)] of what nobody has said."""

    low: Optional[tuple] = None
    high: Optional[tuple] = None
    source: str = ""
    tools: dict = field(default_factory=dict)
    spindle: Optional[int] = None
    notes: list = field(default_factory=list)
    lacking: list = field(default_factory=list)

    @property
    def guessed(self) -> bool:
        """Whether something of it is not what the user has named."""
        return self.low is not None or any(tool.geometry is not None for tool in self.tools.values())

    def note(self, text: str) -> None:
        """A sentence for the user."""
        self.notes.append(text)

    def lacks(self, fact: str, remedy: str, about: str) -> None:
        """Something that cannot be assumed.  about: TOOL or STOCK."""
        self.lacking.append((fact, remedy, about))


class Unknown(Unreadable):
    """What is missing cannot be assumed.  about: TOOL, STOCK or both; fact: without the remedy; survey: what is known
    without it."""

    def __init__(self, text: str, remedy: str, survey: Survey, line: int = 0, about: tuple[str, ...] = ()) -> None:
        super().__init__(text, remedy, line)
        self.fact, self.survey, self.about = text, survey, tuple(dict.fromkeys(about))


def surveyed(reader: Reader, machine: Machine, progress: Progress | None = None) -> Survey:
    """Survey of a program that `reader` (program/reader.py) reads.  progress: called with the number of the line."""
    survey = Survey(machine)
    with reader:
        for block in reader:
            survey.take(block)
            if progress:
                progress(int(block[-1, 1]))
    survey.carries_stock = reader.carries_stock
    return survey


def halves(progress: Progress | None) -> tuple[Progress | None, Progress | None]:
    """Two functions of a line, for two readings of one program of which each is half the work; progress: of a line, or
    None."""
    if progress is None:
        return None, None
    told, last = progress, 0.0

    def first(line: float) -> None:
        nonlocal last
        last = line
        told(line / 2)

    return first, lambda line: told((last + line) / 2)


def assume(survey: Survey, program: str, machine: Machine, line: int = 0, named: Named = Named()) -> Assumption:
    """Assumption for a program; Unknown without a tool or a depth.

    line: where it cuts without a tool or a stock; named: by the user.
    """
    said = post_comments.read(program, machine.unit_mm)
    found = Assumption()
    _Tools(said, machine, found).assume(survey, named.tool, named.diameter)
    if not (survey.has_stock or named.stock):
        _assume_stock(survey, said, found, machine.unit)
    if found.lacking:
        facts, remedies, about = zip(*found.lacking)
        raise Unknown(", and ".join(facts), ", and ".join(dict.fromkeys(remedies)), survey, line, about)
    if said.rapids_are_feeds:
        found.note("its traverses are G1, as Fusion writes them for personal use: moves in air count as feed moves")
    return found


# ---- tools -----------------------------------------------------------------------------------------------------------


class _Tools:
    """The tools of a program: what is assumed, said and lacking goes into `found`, an Assumption."""

    def __init__(self, said: post_comments.Said, machine: Machine, found: Assumption) -> None:
        self.said, self.found = said, found
        self.unit = machine.unit
        self.table = (
            {number: diameter * machine.unit_mm for number, diameter in table.diameters(machine.table)}
            if machine.table
            else {}
        )
        self.added = machine.added

    def assume(self, survey: Survey, tool: int | None, diameter: float | None) -> None:
        """tool, diameter: as in Named."""
        for number, path in survey.tools.items():
            if number == 0:
                self._spindle(tool, diameter)
            elif path.figures.diameter > 0:
                self._compare(number, path.figures.diameter)
            else:
                self._without_diameter(number, diameter)

    def _length(self, value: float) -> str:
        return format_length(value, self.unit)

    def _compare(self, number: int, had: float) -> None:
        compare(self.found, self.said, {number: had}, self.unit)

    def _without_diameter(self, number: int, diameter: float | None) -> None:
        comment = self.said.tools.get(number)
        if comment:
            self.found.tools[number] = AssumedTool(comment.diameter, _geometry(comment))
            length = self._length(comment.diameter)
            if number in self.added:
                self.found.note(f"tool {number} is not in the tool table and is taken as {length}, from a comment")
            else:
                self.found.note(
                    f"tool {number} has no diameter in the tool table and is taken as {length}, from a comment"
                )
        elif diameter:
            self.found.tools[number] = AssumedTool(diameter)
        else:
            self._no_diameter(number)

    def _no_diameter(self, number: int) -> None:
        if number in self.added:
            self.found.lacks(
                f"tool {number} is not in the tool table, and no comment has its diameter",
                "add it there with its D, or name the D with --tool-diameter",
                TOOL,
            )
        else:
            self.found.lacks(
                f"tool {number} has no diameter in the tool table",
                "give it a D there, or name it with --tool-diameter",
                TOOL,
            )

    def _spindle(self, tool: int | None, diameter: float | None) -> None:
        """The tool of moves before any tool change."""
        tools = self.said.tools
        told = [tools[number] for number in self.said.calls if number in tools] or list(tools.values())
        if tool is not None:
            told = [tools[tool]] if tool in tools else []
        if diameter:
            number = tool or (told[0].number if len(told) == 1 else None) or 0
            self._take(number, AssumedTool(diameter, None, _same(self.table.get(number), diameter)))
        elif len(told) == 1:
            number = told[0].number or 0
            self._take(
                number,
                AssumedTool(told[0].diameter, _geometry(told[0]), _same(self.table.get(number), told[0].diameter)),
            )
            self.found.note(
                f"the program calls no tool; it is taken as tool {number}, {self._length(told[0].diameter)}, from a "
                f"comment"
            )
        elif tool is not None:
            self._no_diameter(tool)
        else:
            names = ", ".join(f"T{one.number} {self._length(one.diameter)}" for one in told[:8])
            self.found.lacks(
                f"no tool is in the spindle (tool 0), and the program's comments name "
                f"{'several: ' + names if told else 'none'}",
                "call one with T.. M6 before, or name it with --tool N or --tool-diameter D",
                TOOL,
            )

    def _take(self, number: int, tool: AssumedTool) -> None:
        self.found.spindle, self.found.tools[number] = number, tool
        if number in self.table and not tool.described:
            self.found.note(
                f"tool {number} of the tool table has {self._length(self.table[number])} and is another one"
            )


def compare(found: Assumption, said: post_comments.Said, diameters: dict[int, float], unit: str) -> None:
    """Note in an Assumption the tools that the comments describe otherwise.  said: post_comments.Said; diameters:
    {number: mm} of the tool table."""
    for number, had in diameters.items():
        comment = said.tools.get(number)
        if comment and not _same(comment.diameter, had):
            found.note(
                f"tool {number} has {format_length(had, unit)} in the tool table and "
                f"{format_length(comment.diameter, unit)} in a comment; the tool table counts"
            )


def _same(one: float | None, other: float) -> bool:
    """Whether two diameters (mm; None: not known) are those of one tool."""
    return one is not None and abs(one - other) <= SAME * other


def _geometry(said: post_comments.SaidTool) -> ToolGeometry:
    """ToolGeometry of a tool in a comment."""
    if said.tip_angle:
        return ToolGeometry("tapered-ball" if said.corner_radius else "vee", said.corner_radius or None, said.tip_angle)
    if said.corner_radius <= 0:
        return ToolGeometry()
    return (
        ToolGeometry("ball")
        if said.corner_radius >= 0.499 * said.diameter
        else ToolGeometry("bull", said.corner_radius)
    )


# ---- stock -----------------------------------------------------------------------------------------------------------


def _assume_stock(survey: Survey, said: post_comments.Said, found: Assumption, unit: str) -> None:
    def diameter(number: int, path: ToolPath) -> float:
        assumed = found.tools.get(
            number or found.spindle
        )  # None: of a tool that is lacking, whose depth is known all the same
        return path.figures.diameter or (assumed.diameter if assumed else 0.0)

    box, top = swept(survey, {number: diameter(number, path) for number, path in survey.tools.items()})
    if not box or top - box.low[2] < LEAST_MM:
        found.lacks(
            "no stock is defined, and the program feeds at one height only: its depth is not known",
            "add M250, or name the stock with --stock X0 Y0 Z0 X1 Y1 Z1",
            STOCK,
        )
        return
    if found.lacking:
        return
    low: Sequence[float] = [*box.low[:2], box.low[2]]
    high: Sequence[float] = [*box.high[:2], top]
    found.source = PATH
    if said.low and said.high and _meet(said.low, said.high, low, high):
        low, high, found.source = said.low, said.high, COMMENT
    elif said.size and _fits(said.size, low, high):
        low, high = _of_size(said.size, low, high)
        found.source = COMMENT
    elif said.low:
        found.note("the stock of its comments does not reach where it cuts, and is not used")
    found.low, found.high = (
        tuple(float(round(value, 4)) for value in corner) for corner in survey.at_first_move(low, high)
    )
    words, origin = (
        format_place((*found.low, *found.high), unit),
        "its comments" if found.source == COMMENT else "its path",
    )
    found.note(f"the stock is assumed from {origin}: --stock {words}")


def swept(survey: Survey, diameters: dict[int, float]) -> tuple[Box, float]:
    """(Box in X, Y and Z of the stock, its top) by the path alone, mm.  diameters: {number of a tool: mm}."""
    at_zero = survey.lowest < -AROUND_MM and survey.is_above(AROUND_MM)
    box = Box()
    for number, path in survey.tools.items():
        part = path.below_zero if at_zero else path.below_top
        if part:
            grown, radius = Box(), diameters[number] / 2
            grown.low, grown.high = part.low - (radius, radius, 0.0), part.high + (radius, radius, 0.0)
            box.join(grown)
    return box, 0.0 if at_zero else survey.top


def _meet(low: Sequence[float], high: Sequence[float], other_low: Sequence[float], other_high: Sequence[float]) -> bool:
    """Whether two boxes overlap, and the first reaches down to the middle of the other's depth at least."""
    across = all(a < d and c < b for a, b, c, d in zip(low[:2], high[:2], other_low[:2], other_high[:2]))
    return across and low[2] < (other_low[2] + other_high[2]) / 2 and high[2] > other_low[2]


def _fits(size: Sequence[float | None], low: Sequence[float], high: Sequence[float]) -> bool:
    """Whether a stock of that size can be what is cut: not less than half of it, either way."""
    return all(s is None or s > 0.5 * (b - a) for s, a, b in zip(size, low, high))


def _of_size(size: Sequence[float | None], low: Sequence[float], high: Sequence[float]) -> Corners:
    """Corners of a stock of known size about what is cut from low to high: its zero is at a corner or in the middle,
    whichever has most of the path inside, or else it lies about the path."""
    corners = []
    for s, a, b in zip(size[:2], low[:2], high[:2]):
        if s is None:
            corners.append((a, b))
            continue
        inside, first, last = max(
            ((min(b, last) - max(a, first), first, last) for first, last in ((0.0, s), (-s / 2, s / 2), (-s, 0.0))),
            key=lambda place: round(place[0], 6),
        )
        corners.append((first, last) if inside > MOST * min(s, b - a) else ((a + b - s) / 2, (a + b + s) / 2))
    bottom = high[2] - size[2] if size[2] is not None else low[2]
    return (*(a for a, _ in corners), bottom), (*(b for _, b in corners), high[2])
