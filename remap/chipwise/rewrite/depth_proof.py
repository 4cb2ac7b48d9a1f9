# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether a program cuts deeper than the flutes are long, or travels too near to stock, proved:
components/offline/depth_proof.c from Python.

Called by run.py.  Lengths mm, machine coordinates of the tool's tip.
"""

from __future__ import annotations

import ctypes as C
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Optional

import numpy as np

from chipwise.program import records
from chipwise.program.reader import Unreadable
from chipwise.clib.height_map import CYLINDER
from chipwise.rewrite import sections as cutting
from chipwise.clib import layout
from chipwise.clib.library import library

if TYPE_CHECKING:
    from chipwise.clib.arrays import Floats, Ints, Records
    from chipwise.clib.height_map import HeightMap
    from chipwise.rewrite.program import Moves, Program
    from chipwise.tool_data.geometry import ToolGeometry

ROOM = (
    2_000_000  # witnesses of one stock that are found: a long program has one in every few moves before it is repeated
)
MOST = 200_000  # those of them that count: the deepest
SQUARES = 300_000_000  # looked at for one stock: minutes
CELLS_ACROSS = 16  # of the smallest tool, of the proof's map
MOST_CELLS = 4_000_000
UNLIMITED = 1e30
APART_MM = 0.02  # of two needles
ACROSS_MM = 1e-4  # shorter traverses, seen from above, go straight up or down
SAME_MM = 1e-3  # of two traverses' ends: the rounding of the text
NO_CLEARANCE = -1.0  # of chip_proof_tool: of feed moves

ELSEWHERE = -1 << 31  # CHIP_PROOF_ELSEWHERE

TOOL: np.dtype = np.dtype(layout.ProofTool)
FOUND: np.dtype = np.dtype(layout.ProofFound)


@dataclass(frozen=True)
class Witness:
    """A place of stock that a feed move cuts too deep: number of the stock, x, y (mm), depth (mm), tool: cutting.Tool,
    line, place (3,): of the tip.  traverse: of one that is nearer to it than the clearance, where it begins and ends
    (6,)."""

    stock: int
    x: float
    y: float
    depth: float
    tool: cutting.Tool
    line: int
    place: tuple[float, ...]
    traverse: Optional[tuple[float, ...]] = None


@dataclass
class _Stock:
    """A height map's shape, and the moves in it: tools, [(first, end, index of the tool, limit)]."""

    map: HeightMap
    tools: list[cutting.Tool]
    parts: list[tuple[cutting.Cut, int, float]]


def _stocks(program: Moves, geometry: dict[int, ToolGeometry], cell: float, over: float) -> list[_Stock]:
    """[_Stock] of a program."""
    found: list[_Stock] = []
    for section, stock in cutting.in_stock(program, cutting.sections(program, geometry), cell):
        if not found or found[-1].map is not stock:
            found.append(_Stock(stock, [], []))
        limit = section.tool.flutes + over
        found[-1].parts.append((section, len(found[-1].tools), limit))
        found[-1].tools.append(section.tool)
    return found


def not_judged(number: int | Ints) -> int | Ints:
    """What chip_proof_path has as the tool of a move that is cut and not judged: of that of its tool, and back."""
    return ~number


@dataclass
class Path:
    """The moves in a stock: start (3,) mm; to (n, 3) mm; tool (n,) int32, as in chip_proof_path; index (n,): number of
    the program's move of each."""

    start: np.ndarray
    to: np.ndarray
    tool: np.ndarray
    index: np.ndarray

    def place(self, move: int, share: float) -> Floats:
        """(3,): of the tip at a share of a move."""
        begin = self.to[move - 1] if move else self.start
        return begin + share * (self.to[move] - begin)

    def ends_of(self, move: int) -> tuple[float, ...]:
        """Where a move begins and ends (6,)."""
        return (*self.place(move, 0.0).tolist(), *self.place(move, 1.0).tolist())

    def check_traverses(self, tools: int, top: float) -> None:
        """Those of them are judged that have stock at their side: not straight up, nor above `top` (mm).  Their tools
        are the ones `tools` further in the table."""
        steps = np.diff(self.to, axis=0, prepend=self.start[None])
        up = (np.hypot(steps[:, 0], steps[:, 1]) < ACROSS_MM) & (steps[:, 2] >= 0.0)
        lowest = np.minimum(self.to[:, 2], self.to[:, 2] - steps[:, 2])
        judged = (self.tool < 0) & (self.tool != ELSEWHERE) & ~up & (lowest < top - layout.PROOF_LEVEL)
        self.tool[judged] = tools + not_judged(self.tool[judged])

    def struct(self) -> layout.ProofPath:
        return layout.ProofPath(self.start.ctypes.data, self.to.ctypes.data, self.tool.ctypes.data, len(self.to))


def _path(program: Moves, stock: _Stock) -> Path:
    """The Path of a program in a _Stock.  Its places are the program's own, not a copy, if the moves follow one
    another."""
    parts = [(s.first, s.end, tool) for s, tool, _ in stock.parts]
    start = np.array(program.start(parts[0][0]), float)
    joined = all(a[1] == b[0] for a, b in zip(parts, parts[1:]))
    if joined:
        to, index = program.end[parts[0][0] : parts[-1][1]], np.arange(parts[0][0], parts[-1][1], dtype=np.int32)
    else:  # a place more before each, where it begins
        to = np.concatenate([np.concatenate((program.start(a)[None], program.end[a:b])) for a, b, _ in parts])
        index = np.concatenate([np.arange(a - 1, b, dtype=np.int32) for a, b, _ in parts])
    tool, at = np.full(len(index), ELSEWHERE, np.int32), 0
    for a, b, number in parts:
        at += not joined
        tool[at : at + b - a] = np.where(program.kind[a:b] != records.RAPID, number, not_judged(number))
        at += b - a
    return Path(start, np.ascontiguousarray(to, np.float64), tool, index)


def path_of(program: Program, sections: list[cutting.Section], tools: list[cutting.Tool]) -> Path:
    """The Path of all of a Program's moves; tools: cutting.Tools, those of the Sections."""
    tool, to = np.full(len(program.kind), ELSEWHERE, np.int32), program.end
    for section in sections:
        if section.tool in tools:
            own = slice(max(section.first, program.known_from), section.end)
            number = tools.index(section.tool)
            tool[own] = np.where(program.kind[own] != records.RAPID, number, not_judged(number))
    if program.lead.arrives and program.known_from:
        to = to.copy()
        to[program.known_from - 1] = to[program.known_from]
    return Path(np.array(program.start(0), float), to, tool, np.arange(len(tool), dtype=np.int32))


def shape_of(stock: HeightMap) -> layout.ProofStock:
    """ProofStock of a HeightMap."""
    turn = math.radians(stock.turn)
    (x0, y0, z0), (x1, y1, z1) = stock.low, stock.high
    return layout.ProofStock(
        (x0 + x1) / 2,
        (y0 + y1) / 2,
        (x1 - x0) / 2,
        (y1 - y0) / 2,
        math.cos(turn),
        math.sin(turn),
        z0,
        z1,
        int(stock.shape == CYLINDER),
        0,
    )


def table_of(tools: list[cutting.Tool], limits: list[float]) -> Records:
    """TOOL records of cutting.Tools with the depths (mm) that are allowed."""
    table = np.zeros(len(tools), TOOL)
    table["clearance"] = NO_CLEARANCE
    table["limit"] = [min(limit, UNLIMITED) for limit in limits]
    for row, tool in zip(table, tools):
        row["radius"], row["corner"] = tool.shape.diameter / 2, min(tool.shape.corner_radius, tool.shape.diameter / 2)
        row["half_angle"] = math.radians(tool.shape.tip_angle) / 2
    return table


def cell_of(stock: HeightMap, tools: Records) -> float:
    """mm: the cell of the proof's map of a HeightMap and TOOL records: a matter of time and memory."""
    wide = max(1e-3, (stock.nx * stock.cell) * (stock.ny * stock.cell))
    return max(float(tools["radius"].min()) * 2 / CELLS_ACROSS, math.sqrt(wide / MOST_CELLS))


def with_traverses(tools: Records, clearance: float) -> Records:
    """TOOL records with those of their traverses behind, which keep a clearance (mm)."""
    traverses = tools.copy()
    traverses["limit"], traverses["clearance"] = layout.PROOF_LEVEL, clearance
    return np.concatenate((tools, traverses))


def too_deep(
    program: Moves, geometry: dict[int, ToolGeometry], cell: float, over: float, clearance: float | None = None
) -> list[Witness]:
    """[Witness] of a Program: places where a feed move cuts deeper than the flutes are long, and `over` (mm); with a
    clearance (mm) also those that are nearer to a traverse.

    No contact is missed but stock thinner than CHIP_PROOF_SKIN at the tool's side, or smaller than CHIP_PROOF_LEAST.
    Raises Unreadable, MemoryError.
    """
    result = []
    for number, stock in enumerate(_stocks(program, geometry, cell, over)):
        shape, tools, path = (
            shape_of(stock.map),
            table_of(stock.tools, [limit for _, _, limit in stock.parts]),
            _path(program, stock),
        )
        if clearance is not None:
            path.check_traverses(len(tools), stock.map.z_max)
            tools = with_traverses(tools, clearance)
        if not ((tools["limit"] < UNLIMITED)[path.tool[path.tool >= 0]]).any():
            continue
        found, squares = np.zeros(ROOM, FOUND), C.c_int64(SQUARES)
        count = library().chip_prove_depths(
            C.byref(shape),
            tools.ctypes.data,
            len(tools),
            C.byref(path.struct()),
            cell_of(stock.map, tools),
            C.addressof(squares),
            found.ctypes.data,
            ROOM,
        )
        if count < 0:
            raise MemoryError
        if squares.value <= 0 and not count:
            raise Unreadable(
                "the depth of the cuts cannot be proved, there are too many walls",
                "rewrite the program in parts",
                int(program.line[path.index[-1]]),
            )
        result += [
            _witness(number, one, program, path, stock.tools) for one in _deepest(found[:count], path, tools["limit"])
        ]
    return result


def _witness(number: int, one: np.void, program: Moves, path: Path, tools: list[cutting.Tool]) -> Witness:
    """Witness of a record of FOUND; number: of the stock; tools: of the stock, those of traverses follow them in the
    path."""
    move = int(one["move"])
    place, own = path.place(move, one["at"]), int(path.tool[move])
    return Witness(
        number,
        float(one["x"]),
        float(one["y"]),
        float(one["height"] - place[2]),
        tools[own % len(tools)],
        int(program.line[path.index[move]]),
        tuple(place.tolist()),
        path.ends_of(move) if own >= len(tools) else None,
    )


def _deepest(found: Records, path: Path, limits: Floats) -> Records:
    """ProofFound records: MOST of them, those that are deepest over their limits (m,), in their order."""
    if len(found) <= MOST:
        return found
    move = found["move"]
    begin = np.where(move > 0, path.to[move - 1, 2], path.start[2])
    tip = begin + found["at"] * (path.to[move, 2] - begin)
    over = found["height"] - tip - limits[path.tool[move]]
    return found[np.sort(np.argpartition(-over, MOST)[:MOST])]


def but_own(found: list[Witness], own: list[Witness]) -> list[Witness]:
    """[Witness] without those of traverses that begin and end where one of `own` does, which are Witnesses of the
    program's own."""
    ends = np.array([witness.traverse for witness in own if witness.traverse]).reshape(-1, 6)
    return [
        w for w in found if w.traverse is None or not len(ends) or np.abs(ends - w.traverse).max(axis=1).min() > SAME_MM
    ]


def with_needles(needles: dict[int, Floats], found: list[Witness]) -> dict[int, Floats]:
    """{number of the stock: places (n, 2)} with those of Witnesses besides; of places nearer than APART_MM one
    stays."""
    result = dict(needles)
    for number in {witness.stock for witness in found}:
        places = np.array([(w.x, w.y) for w in found if w.stock == number])
        if number in needles:
            places = np.concatenate((needles[number], places))
        _, kept = np.unique(np.round(places / APART_MM), axis=0, return_index=True)
        result[number] = places[np.sort(kept)]
    return result
