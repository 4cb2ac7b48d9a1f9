# SPDX-License-Identifier: GPL-2.0-or-later
"""A program's moves in the stock, section by section: moves with the same tool.

Called by flute.py, feed.py and read_back.py.  The model is clib/height_map.py's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Callable, Iterator, Optional, Sequence

import numpy as np

from chipwise.check import rules
from chipwise.program import records
from chipwise.clib.height_map import Shape
from chipwise.clib import layout
from chipwise.tool_data.geometry import ToolGeometry

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats, Ints, Records
    from chipwise.clib.height_map import HeightMap
    from chipwise.rewrite.program import Event, Moves, Program

CELLS_ACROSS = 16  # of the smallest tool, where memory allows
CELLS_FOR_VOLUME = 48  # the same where the volume of a short move counts
PART = 50_000  # moves that are cut at once
LOWERED = 0.01  # cells: what lowers a cell by less does nothing, far above what the model's heights differ by


@dataclass(frozen=True)
class Tool:
    """number, Shape, ToolGeometry (None: not described)."""

    number: int
    shape: Shape
    geometry: Optional[ToolGeometry]

    @property
    def flute_length(self) -> float | None:
        return self.geometry.flute_length if self.geometry else None

    @property
    def flutes(self) -> float:
        """How deep the flutes reach, mm; infinite where that is not known: it limits nothing."""
        return math.inf if self.flute_length is None else self.flute_length


def tool_of(number: int, diameter: float, geometry: dict[int, ToolGeometry]) -> Tool:
    """A Tool from the tool table's diameter (mm) and [CHIPWISE]TOOL_GEOMETRY."""
    known = geometry.get(number)
    return Tool(number, Shape.of_tool(diameter, known or ToolGeometry()), known)


@dataclass
class Section:
    """Moves first .. end - 1 with one tool in the stock as they find it: tool: None without one, or without its
    diameter; number: of the tool, None without one; stock: the STOCK event before, or None."""

    first: int
    end: int
    tool: Optional[Tool]
    number: Optional[int] = None
    stock: Optional[Event] = None


@dataclass(frozen=True)
class Cut:
    """Moves first .. end - 1 of a Section that cut with a tool in a stock."""

    first: int
    end: int
    tool: Tool


def sections(program: Moves, geometry: dict[int, ToolGeometry]) -> list[Section]:
    """The Sections of a program, in its order."""
    result: list[Section] = []
    tool: Tool | None = None
    number: int | None = None
    stock: Event | None = None
    begun = 0

    def close(at: int) -> None:
        nonlocal stock, begun
        if at > begun or stock is not None:
            result.append(Section(begun, at, tool, number, stock))
            stock = None
        begun = at

    for event in program.events:
        if event.kind == records.TOOL:
            close(event.at)
            number, diameter = int(event.values[0]), event.values[1]
            tool = tool_of(number, diameter, geometry) if diameter > 0 else None
            if not (tool or number > 0):  # tool 0 has a diameter where one is assumed
                number = None
        elif event.kind == records.STOCK:
            close(event.at)
            stock = event
    close(len(program.kind))
    return result


def cell_for(program: Program, geometry: dict[int, ToolGeometry], wanted: float, cells: int = CELLS_ACROSS) -> float:
    """The cell (mm): `wanted`, smaller where a tool has fewer than `cells` across."""
    across = [s.tool.shape.diameter for s in sections(program, geometry) if s.tool]
    return min(wanted, *(max(0.02, d / cells) for d in across)) if across else wanted


def in_stock(
    program: Moves,
    found: list[Section],
    cell: float,
    progress: Callable[[float], object] | None = None,
    needles: dict[int, Floats] | None = None,
) -> Iterator[tuple[Cut, HeightMap]]:
    """Yield (Cut, HeightMap) of the Sections that move, in their order; the moves are the caller's to cut.

    The moves before the first known place belong to none.  Raises Unreadable where a feed move has no tool or no stock
    to cut in, or the cells are too large for the tool.  progress: called with the share that is done; needles: {number
    of the stock, from 0: places
    (n, 2) of needles to add to its map}.
    """
    stock, count = None, 0
    for section in found:
        if section.stock is not None:
            stock = rules.make_map(section.stock.line, section.stock.values, cell)
            if needles and count in needles:
                stock.add_needles(needles[count], layout.NEEDLE_SKIN, layout.NEEDLE_AREA)
            count += 1
        first, tool = max(section.first, program.known_from), section.tool
        if section.end > first:
            feeds = np.flatnonzero(program.kind[first : section.end] != records.RAPID)
            if stock is not None and tool is not None:
                if rules.is_too_coarse(stock, tool.shape.diameter):
                    rules.finer_cell(
                        stock, stock.cell <= cell, int(program.line[first]), tool.number, tool.shape.diameter
                    )
                yield Cut(first, section.end, tool), stock
            elif len(feeds):
                rules.cannot_cut(section.number, tool.shape if tool else None, int(program.line[first + feeds[0]]))
        if progress:
            progress(section.end / max(1, len(program.kind)))


def pieces(points: Floats, most: float) -> tuple[Floats, Ints]:
    """Points (k, 3) with new ones between them, so that none is further than `most` mm from the next.

    -> (points (n, 3), owner (n - 1,): the segment of the old points that each new segment lies on).
    """
    points = np.asarray(points, float)
    length = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    count = np.maximum(np.ceil(length / most - 1e-9), 1).astype(int)
    owner, share = rules.divided(count)
    made = points[owner] + (points[owner + 1] - points[owner]) * share[:, None]
    whole = share >= 1.0
    made[whole] = points[owner[whole] + 1]
    return np.concatenate((points[:1], made)), owner


def apart(start: Floats | Sequence[float], places: Floats) -> Bools:
    """(n,) bool: moves from start (3,) along places (n, 3) that need nothing of the one before: HeightMap.cut() of the
    moves up to them, then of the others, is the same as that of all, but for the volume of the move before
    (height_sweep.h [3])."""
    steps = np.diff(places[:, :2], axis=0, prepend=np.asarray(start, float)[None, :2])
    across = np.hypot(steps[:, 0], steps[:, 1])
    return (across > layout.HEIGHT_LAG + 1e-6) | (across < layout.HEIGHT_STILL / 2)


def cut_along(
    stock: HeightMap, shape: Shape, start: Floats, ends: Floats, most: float
) -> Iterator[tuple[Ints, Records]]:
    """Cut moves from start (3,) along ends (n, 3) in pieces of at most `most` mm -> yield (owner (k,): number of the
    move, MET records (k,)), so many at a time that the memory is limited however many there are."""
    at = 0
    while at < len(ends):
        points, owner = pieces(np.concatenate((np.asarray(start, float)[None], ends[at : at + PART])), most)
        if at + PART < len(ends):
            begins = np.flatnonzero(np.diff(owner)) + 1  # of the moves but the first
            begins = begins[apart(points[0], points[1:])[begins]]
            if not len(begins):
                points, owner = pieces(np.concatenate((np.asarray(start, float)[None], ends[at:])), most)
            else:
                points, owner = points[: begins[-1] + 1], owner[: begins[-1]]
        yield owner + at, stock.cut(shape, points[0], points[1:])
        at += int(owner[-1]) + 1
        start = ends[at - 1]


def near(stock: HeightMap, points: Floats, radius: float) -> Floats:
    """View of the heights of a HeightMap that a tool of this radius cuts or looks at along points (n, 3)."""
    return stock.height[_near(stock, points, radius)]


def _near(stock: HeightMap, points: Floats, radius: float) -> tuple[slice, slice]:
    """The slices of rows and columns of near()."""
    low, high = points.min(axis=0) - radius, points.max(axis=0) + radius
    row = [int(np.clip((v - stock.y0) / stock.cell + k, 0, stock.ny)) for v, k in ((low[1], -2), (high[1], 3))]
    column = [int(np.clip((v - stock.x0) / stock.cell + k, 0, stock.nx)) for v, k in ((low[0], -2), (high[0], 3))]
    return slice(*row), slice(*column)


class Final:
    """What a program leaves of a stock: height and high (ny, nx) mm; high: the highest of a cell and its neighbours, up
    to which the proof allows stock."""

    def __init__(self, stock: HeightMap) -> None:
        self.height, self.high = stock.height, filtered(stock.height, np.maximum)


class Window:
    """The heights near a path, to be put back."""

    def __init__(self, stock: HeightMap, points: Floats, radius: float) -> None:
        self._stock, self._slices = stock, _near(stock, points, radius)
        self._views = stock.height[self._slices], stock.needle_height
        self._kept = [view.copy() for view in self._views]

    def restore(self) -> None:
        for view, kept in zip(self._views, self._kept):
            view[...] = kept

    def swapped(self) -> Window:
        """Put back the heights; -> a Window of those that were there."""
        other = object.__new__(Window)
        other._stock, other._slices, other._views = self._stock, self._slices, self._views
        other._kept = [view.copy() for view in self._views]
        self.restore()
        return other

    def left(self, least: float, final: Final) -> Floats:
        """Places (n, 2) in mm of the cells that were more than `least` (mm) too high and that nothing lowers later.
        final: a Final."""
        if not self._kept[0].size:
            return np.zeros((0, 2))
        stock, now = self._stock, self._views[0]
        row, column = np.nonzero(
            (self._kept[0] > final.high[self._slices] + least)
            & (final.height[self._slices] > now - LOWERED * stock.cell)
        )
        row, column = row + self._slices[0].start, column + self._slices[1].start
        return np.column_stack(
            [stock.x0 + column * stock.cell + stock.shift_x[row], stock.y0 + row * stock.cell + stock.shift_y[column]]
        )

    def keep(self) -> None:
        """The heights as they are now are those to be put back."""
        for view, kept in zip(self._views, self._kept):
            kept[...] = view


def highest(stock: HeightMap, x: float, y: float, radius: float) -> float:
    """Z of the highest stock within a radius of a place; z_min without any."""
    rows = np.arange(
        max(0, int((y - radius - stock.y0) / stock.cell) - 1),
        min(stock.ny, int((y + radius - stock.y0) / stock.cell) + 2),
    )
    columns = np.arange(
        max(0, int((x - radius - stock.x0) / stock.cell) - 1),
        min(stock.nx, int((x + radius - stock.x0) / stock.cell) + 2),
    )
    if not len(rows) or not len(columns):
        return stock.z_min
    u = stock.x0 + columns[None] * stock.cell + stock.shift_x[rows][:, None] - x
    v = stock.y0 + rows[:, None] * stock.cell + stock.shift_y[columns][None] - y
    near = u * u + v * v < radius * radius
    heights = stock.height[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    single = stock.needles_in((x - radius, y - radius), (x + radius, y + radius))
    single = stock.needle_height[single[np.hypot(*(stock.needles[single] - (x, y)).T) < radius]]
    return float(max(heights[near].max(initial=stock.z_min), single.max(initial=stock.z_min)))


def filtered(heights: Floats, pick: np.ufunc) -> Floats:
    """Each cell's lowest or highest of itself and its eight neighbours."""
    padded = np.pad(heights, 1, mode="edge")
    across = pick(pick(padded[:, :-2], padded[:, 1:-1]), padded[:, 2:])
    return pick(pick(across[:-2], across[1:-1]), across[2:])
