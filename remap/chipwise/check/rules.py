# SPDX-License-Identifier: GPL-2.0-or-later
"""What every reader of a program's records has to ask before it cuts: which numbers, stocks, tools and heights are
usable.

Called by simulate.py and by rewrite/.  Lengths mm, machine coordinates of the tool's tip.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Iterator, NamedTuple, NoReturn

import numpy as np

from chipwise.program import records
from chipwise.program.program_file import Missing
from chipwise.program.reader import Unreadable
from chipwise.clib.height_map import HeightMap, least_cell

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats, Ints
    from chipwise.clib.height_map import Shape

MIN_CELLS = 4  # least number of cells across a tool
FINE_CELLS = 8  # cells across a tool that the cell is chosen for
MAX_POSITION_MM = 1e5  # from machine zero
ACROSS_MM = 1e-4  # shorter moves, seen from above, go straight up or down
BEEN_MM = 1e-3  # by which a tool that comes back may be lower than it was: rounding
ACROSS, DOWN = 3, 4  # X and Y, and Z, of a mask of axes
PLACES_APART_MM = 3 * MAX_POSITION_MM  # in the heights of one place and the next, so that a running minimum begins anew


def check_finite(block: Floats) -> None:
    """Unreadable for a block of records with a number that is not finite."""
    bad = ~np.isfinite(block).all(axis=1)
    if bad.any():
        raise Unreadable("a number is not finite", "give every expression a value", int(block[bad][0, 1]))


class Moved(NamedTuple):
    """Consecutive moves (n, WIDTH) of a block of records; stops: whether the machine waits behind them."""

    moves: Floats
    stops: bool


class Other(NamedTuple):
    """A record of something else than a move."""

    kind: int
    line: int
    values: list[float]


def parts(block: Floats, last: bool = False) -> Iterator[Moved | Other]:
    """Yield the parts of a block of records, in its order.  last: nothing follows the block."""
    kinds, start = block[:, 0].astype(int), 0
    for event in (*np.flatnonzero(kinds > records.ARC).tolist(), len(block)):
        if event > start:
            stops = kinds[event] not in (records.PATH, records.SPINDLE) if event < len(block) else last
            yield Moved(block[start:event], stops)
        if event < len(block):
            yield Other(int(kinds[event]), int(block[event, 1]), block[event, 2:].tolist())
        start = event + 1


def check_positions(moves: Floats) -> None:
    """Unreadable for records of moves that go too far."""
    far = np.abs(moves[:, 2:5]).max(axis=1) > MAX_POSITION_MM
    if far.any():
        raise Unreadable(
            "a position is more than 100 m from machine zero", "correct the coordinates", int(moves[far][0, 1])
        )


def moves_at_unknown_height(kinds: Floats | Ints, z: Floats) -> tuple[int, bool]:
    """(number of leading traverses up to the first one in Z, whether there is such a one or a feed): before it the
    interpreter stands at machine zero, the machine anywhere.  kinds, z (n,): of the first moves."""
    known = (kinds != records.RAPID) | (np.abs(z) > 1e-9)
    if not known.any():
        return len(kinds), False
    first = int(np.argmax(known))
    return first + int(kinds[first] == records.RAPID), True


def moves_to_first_place(kinds: Floats | Ints, places: Floats, frame: records.Frame) -> tuple[int, bool]:
    """(number of leading traverses to the first place across Z, whether it is reached): where they begin is only known
    on the machine, and the interpreter starts at X0 Y0 of the work coordinates.  kinds (n,), places (n, 3): of the
    first moves; frame: records.Frame."""
    lead = len(kinds) if (kinds == records.RAPID).all() else int(np.argmax(kinds != records.RAPID))
    x, y, _z = frame.to_work(places[:lead].T)
    away = np.maximum(np.abs(x), np.abs(y)) > 1e-6
    return (int(np.argmax(away)) + 1, True) if away.any() else (lead, lead < len(kinds))


class Unplaced:
    """The first moves of a program, up to where it has named X, Y and Z: where they go is known on the machine only,
    and the interpreter starts at 0."""

    def __init__(self) -> None:
        self._axes: int | None = None  # mask of those that are not named yet; None: before the first move
        self._missed = 0  # line of the first move that might have cut
        self._height_known = False
        self.arrives = False  # whether the last of the moves just counted comes to the first place
        self._named = self._late = 0  # line that names the last axes, and their mask

    def lead(self, moves: Floats, top: float) -> int:
        """Number of leading moves that cannot be judged.  top: of the stock, mm."""
        lead = self._unnamed(moves, top)
        if not self._height_known:
            height, self._height_known = moves_at_unknown_height(moves[:, 0], moves[:, 4])
            lead = max(lead, height)
        self.arrives = lead > 0 and not moves[lead - 1, records.UNNAMED]
        return lead

    def _unnamed(self, moves: Floats, top: float) -> int:
        """lead() for axes that are not named yet."""
        if self._axes == 0:
            return 0
        unnamed = moves[:, records.UNNAMED].astype(int)
        first = int(np.argmin(unnamed > 0)) if (unnamed == 0).any() else len(moves)
        axes = int(unnamed[first - 1]) if first else self._axes or 0
        lead = first + (_moves_of_step(moves[first:]) if axes and first < len(moves) else 0)  # that one begins anywhere
        if (
            moves[:lead, 0] == records.RAPID
        ).all():  # nothing is cut on the way: from work zero, as the interpreter has it
            lead = 0
        low, known = moves[:lead, 4] < top, unnamed[:lead] & DOWN == 0
        missed = np.where(moves[:lead, 0] == records.RAPID, low & known, low | ~known)
        if (
            axes == DOWN
            and 0 < lead
            and first < lead
            and (first == 0 or math.dist(moves[first - 1, 2:4], moves[first, 2:4]) < ACROSS_MM)
        ):
            missed[first] = False  # straight down: its end says it all
        if missed.any() and not self._missed:
            self._missed = int(moves[int(np.argmax(missed)), 1])
        self._axes = axes
        if first < len(moves):
            self._named, self._late, self._axes = int(moves[first, 1]), axes, 0
        return lead

    def notes(self) -> list[list[int | str]]:
        """[[line, text]] of moves that were not judged."""
        if not self._missed:
            return []
        axes = [name for axis, name in enumerate("XYZ") if (self._axes or self._late) >> axis & 1]
        names = " and ".join(filter(None, (", ".join(axes[:-1]), axes[-1]))) + (" are" if len(axes) > 1 else " is")
        if self._axes:
            return [
                [
                    self._missed,
                    f"{names} never named in the program: where it moves is known on the machine only and is not "
                    f"judged; "
                    "name X, Y and Z before the first cut",
                ]
            ]
        return [
            [
                self._named,
                f"{names} named first in line {self._named}: what is moved before is not judged, from line "
                f"{self._missed} on",
            ]
        ]


def _moves_of_step(moves: Floats) -> int:
    """Number of the moves of the first step of (n, WIDTH) records: an arc has a chord a move."""
    others = (moves[1:, 0] != records.ARC) | (moves[1:, 6] > 0)
    return (int(np.argmax(others)) + 1 if others.any() else len(moves)) if moves[0, 0] == records.ARC else 1


def near_stock(start: Floats, positions: Floats, kinds: Ints, top: float, been: float) -> tuple[Bools, float]:
    """(n,) bool: traverses that may come too near to stock at their side, of moves from start (3,) to positions (n, 3);
    and the lowest Z since the tool is at its last place across the axis, which is `been` (mm) at the first.

    Not straight up, nor above the top of the stock (mm), nor straight down to where the tool has been since it came
    there, as between the pecks of a drill.
    """
    z = np.concatenate((np.array([min(been, start[2])]), positions[:, 2]))
    moved = np.hypot(*np.diff(positions[:, :2], axis=0, prepend=start[None, :2]).T) > ACROSS_MM
    place = np.concatenate(([0], np.cumsum(moved)))
    lowest = (
        np.minimum.accumulate(z - place * PLACES_APART_MM) + place * PLACES_APART_MM
    )  # since the tool is at a place
    before = np.concatenate((start[None, 2], positions[:-1, 2]))
    rises, again = ~moved & (positions[:, 2] >= before), ~moved & (positions[:, 2] >= lowest[:-1] - BEEN_MM)
    return (kinds == records.RAPID) & ~rises & ~again & (np.minimum(before, positions[:, 2]) < top), float(lowest[-1])


def make_map(line: int, values: list[float], cell: float) -> HeightMap:
    """HeightMap of a STOCK record; the cell is larger where the stock is.  Unreadable for one that cannot be known."""
    shape, turn, *corners = values[:8]
    if shape < 0:
        raise Unreadable(
            "M254 restores a stock that only the machine has",
            "define it with M250, or name it with --stock and leave M254 out",
            line,
        )
    low, high = corners[:3], corners[3:]
    if not all(b - a >= 1e-3 for a, b in zip(low, high)):
        raise Unreadable("the stock has no extent", "give a maximum above the minimum in X, Y and Z", line)
    return HeightMap(low, high, max(cell, least_cell(low, high)), int(shape), turn)


def cannot_cut(tool: int | None, shape: Shape | None, line: int) -> NoReturn:
    """Missing for a feed move without a tool (number, None: none), its shape, or a stock."""
    if shape is None:
        if tool is not None:
            raise Missing(f"tool {tool} has no diameter in the tool table", "give it a D there", line)
        raise Missing("no tool is in the spindle (tool 0)", "call one with T.. M6 before", line)
    raise Missing(
        "no stock is defined",
        "add M250 (with words, or with a WORKPIECE comment), or name the stock with --stock X0 Y0 Z0 X1 Y1 Z1",
        line,
    )


def is_too_coarse(stock: HeightMap, diameter: float) -> bool:
    """Whether a tool has too few cells across."""
    return diameter < MIN_CELLS * stock.cell


def finer_cell(stock: HeightMap, asked: float | None, line: int, number: int, diameter: float) -> float:
    """The cell (mm) that suits a tool; Unreadable if the user has asked for a larger one or the stock is too large."""
    cell, least = math.floor(diameter / FINE_CELLS * 1000) / 1000, least_cell(stock.low, stock.high)
    if asked:
        raise Unreadable(
            f"tool {number} of {diameter:g} mm has less than {MIN_CELLS} cells of {stock.cell:g} mm across",
            f"use --cell {cell:g}, or leave --cell out",
            line,
        )
    if cell < least:
        raise Unreadable(
            f"tool {number} of {diameter:g} mm is too small for a stock of this size: its cells have at least "
            f"{least:.3g} mm",
            "check the program in parts, with --stock around each",
            line,
        )
    return cell


def divided(count: Ints) -> tuple[Ints, Floats]:
    """(owner (m,), share (m,)) of pieces: the move each is a part of and how much of it lies behind the piece's end.

    count (n,) int: pieces of each move.
    """
    owner = np.repeat(np.arange(len(count)), count)
    return owner, (np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count) + 1) / count[owner]
