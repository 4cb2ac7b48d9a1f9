# SPDX-License-Identifier: GPL-2.0-or-later
"""Writes feeds into a program so that the removal rate stays constant, for controls without the realtime components.

Called by run.py.  Source: JP3131045: F = UQ x LC / VC [0007], and [0013] for two bounds.

 1. Each feed move is divided into pieces of the reference length.  The volume VC of each piece of length LC is cut out
    of the stock as the moves before have left it.
 2. One rate Q: F = Q LC / VC.  Two: the programmed F where its rate lies between them, else the nearest F whose rate
    does.  A tool's own max_rate bounds both.
 3. A piece counts with the larger of the areas VC / LC of itself and its neighbours, for where in a piece the load
    changes is not known.
 4. F is never above the ceiling: what the axes can do, or less where it is asked for.  Where nothing is cut the
    programmed F stays.  On a stock or a tool that nobody has confirmed (rewrite/assumed.py) F is never raised.
 5. Pieces one after the other whose F differ by at most SPREAD have one F, that of all of them together; a move is
    divided where they differ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Callable, Iterable, Optional, Sequence

import numpy as np

from chipwise.program.records import ARC, FEED, RAPID
from chipwise.rewrite import sections
from chipwise.rewrite.path_moves import arcs_through
from chipwise.rewrite.edits import Edits, Move, Table, original

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats, Ints
    from chipwise.clib.height_map import HeightMap
    from chipwise.rewrite.program import Circle, Program
    from chipwise.tool_data.geometry import ToolGeometry

SPREAD = 1.03  # more, and what is between is too fast or too slow; less, and moves are divided for the cells' sake
AIR_MM = 0.005  # stock less deep than that is not cut


@dataclass
class Rates:
    """What was asked for: mm3/min; lower 0: one rate; ceiling mm/min or None; split: the reference length, mm; raises:
    whether F may rise."""

    target: float
    lower: float = 0.0
    ceiling: Optional[float] = None
    split: float = 1.0
    raises: bool = True


@dataclass(frozen=True)
class Order:
    """cell: mm; speeds: (3,) mm/s of the axes, None where unknown; fixed: numbers of lines whose F stays."""

    cell: float
    rates: Rates
    speeds: Sequence[Optional[float]]
    fixed: Iterable[int] = ()


@dataclass
class Figures:
    """Seconds at the feeds alone."""

    before_s: float = 0.0
    after_s: float = 0.0
    moves: int = 0  # feed moves of the program
    changed: int = 0
    divided: int = 0
    peak_before: float = 0.0  # mm3/min
    peak_after: float = 0.0


class Feeder:
    """One program."""

    def __init__(self, program: Program, geometry: dict[int, ToolGeometry], order: Order) -> None:
        self.program, self.rates, self.cell = program, order.rates, order.cell
        self.speeds = np.array([s or np.inf for s in order.speeds]) * 60.0  # mm/min of the axes
        self.fixed = frozenset(order.fixed)  # lines whose F stays
        self.sections = sections.sections(program, geometry)
        self.edits, self.figures = Edits(), Figures()

    def run(self, progress: Callable[[float], object] | None = None) -> Edits:
        """-> Edits."""
        for section, stock in sections.in_stock(self.program, self.sections, self.cell, progress):
            self._section(section, stock)
        return self.edits

    def _section(self, section: sections.Cut, stock: HeightMap) -> None:
        program, first, end = self.program, section.first, section.end
        points = np.concatenate((program.start(first)[None], program.end[first:end]))
        points, owner = sections.pieces(points, self.rates.split)
        met = stock.cut(section.tool.shape, points[0], points[1:])
        move = owner + first
        length = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
        cuts = (program.kind[move] != RAPID) & (length > 1e-9)
        with np.errstate(divide="ignore", invalid="ignore"):
            area = np.where(cuts & (met["depth"] > AIR_MM), met["volume"] / length, 0.0)
        wanted = self._wanted(section.tool, points, move, length, area, cuts)
        self._figures(area, length, cuts, program.feed[move], wanted)
        self._write(points, move, wanted, np.flatnonzero(cuts))

    def _wanted(
        self, tool: sections.Tool, points: Floats, move: Ints, length: Floats, area: Floats, cuts: Bools
    ) -> Floats:
        """mm/min of each piece [2], [3], [4]."""
        programmed = self.program.feed[move]
        limit = tool.geometry.max_removal_rate if tool.geometry else None
        target = min(self.rates.target, limit or math.inf)
        lower = min(self.rates.lower, target)
        beside = area.copy()
        beside[1:] = np.maximum(beside[1:], np.where(cuts[:-1], area[:-1], 0.0))
        beside[:-1] = np.maximum(beside[:-1], np.where(cuts[1:], area[1:], 0.0))
        area = np.where(area > 0.0, beside, np.where(beside > 0.0, beside, 0.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            high, low = target / area, (lower if lower > 0.0 else target) / area
            unit = np.abs(np.diff(points, axis=0)) / length[:, None]
            able = (self.speeds / unit).min(axis=1)
        ceiling = np.minimum(able, self.rates.ceiling or np.inf)
        wanted = np.where(area > 0.0, np.clip(programmed, low, high), programmed)
        wanted = np.where(wanted > programmed, np.maximum(np.minimum(wanted, ceiling), programmed), wanted)
        if not self.rates.raises:
            wanted = np.minimum(wanted, programmed)
        return np.where(cuts, wanted, 0.0)

    def _figures(self, area: Floats, length: Floats, cuts: Bools, programmed: Floats, wanted: Floats) -> None:
        f = self.figures
        with np.errstate(divide="ignore", invalid="ignore"):
            f.before_s += float((length[cuts] / programmed[cuts]).sum() * 60.0)
            f.after_s += float((length[cuts] / wanted[cuts]).sum() * 60.0)
        if cuts.any():
            f.peak_before = max(f.peak_before, float((area * programmed)[cuts].max()))
            f.peak_after = max(f.peak_after, float((area * wanted)[cuts].max()))

    def _write(self, points: Floats, move: Ints, wanted: Floats, cuts: Ints) -> None:
        """[5]"""
        program, steps = self.program, self.program.step[move]
        if not len(cuts):
            return
        bounds = np.array([0, *(np.flatnonzero(np.diff(steps[cuts])) + 1).tolist(), len(cuts)])
        now = None
        for a, b in zip(bounds[:-1].tolist(), bounds[1:].tolist()):
            index = cuts[a:b]
            step = int(steps[index[0]])
            if program.line_of(step) in self.fixed:
                now = None
                continue
            own = float(program.feed[move[index[0]]])
            groups, now = grouped(wanted[index], now, own)
            self.figures.moves += 1
            if len(groups) == 1 and abs(groups[0][1] - own) <= 1e-6 * own:
                continue
            self.figures.changed += 1
            if len(groups) == 1:
                self.edits.feeds[step] = groups[0][1]
                continue
            self.figures.divided += 1
            table = Table.of(self._divided(step, points, move, int(index[0]), groups))
            self.edits.instead.put([step], [0, len(table)], table, "divided")

    def _divided(
        self, step: int, points: Floats, move: Ints, begin: int, groups: list[tuple[int, float]]
    ) -> list[Move]:
        """Moves of a step that is divided; begin: its first piece."""
        moves: list[Move] = []
        whole = original(self.program, step)
        end = begin + sum(count for count, _ in groups)
        points = points[begin : end + 1]
        if whole.kind == ARC:
            points = on_arc(whole.arc, points, np.append(np.append(True, np.diff(move[begin:end]) != 0), True))
        begin = 0
        for count, feed in groups:
            end = begin + count
            if whole.kind == ARC:
                moves += arcs_through(whole.arc, points[begin : end + 1], 0.0, feed)[0]
            else:
                moves.append(Move(FEED, tuple(points[end].tolist()), feed))
            begin = end
        return moves


def on_arc(circle: Circle, points: Floats, ends: Bools) -> Floats:
    """Points (n, 3) along the chords of an arc, moved onto it; ends (n,) bool: those that chords begin or end at, which
    are on it."""
    u, v = {1: (0, 1), 2: (1, 2), 3: (2, 0)}[circle.plane]
    off = points[:, [u, v]] - np.array(circle.centre)[[u, v]]
    radius, index = np.hypot(off[:, 0], off[:, 1]), np.arange(len(points))
    result, between = points.copy(), ~ends
    wanted = np.interp(index[between], index[ends], radius[ends])  # that of a spiral changes
    result[np.flatnonzero(between)[:, None], [u, v]] += off[between] * (wanted / radius[between] - 1.0)[:, None]
    return result


def grouped(
    wanted: Floats, now: float | None = None, own: float | None = None
) -> tuple[list[tuple[int, float]], float | None]:
    """([(number of pieces, their F), ..], the last F): pieces one after the other whose F differ by at most SPREAD.

    wanted (n,) mm/min, of pieces of the same length; now: F of the piece before, kept where it is not too fast and at
    most SPREAD too slow; own: the programmed F, kept where it lies between those of the pieces; or None.
    """
    result: list[tuple[int, float]] = []
    begin, low, high = 0, wanted[0], wanted[0]
    for k in range(1, len(wanted) + 1):
        if k < len(wanted) and max(high, wanted[k]) <= SPREAD * min(low, wanted[k]):
            low, high = min(low, wanted[k]), max(high, wanted[k])
            continue
        mean = float(wanted[begin]) if low == high else (k - begin) / float((1.0 / wanted[begin:k]).sum())
        if own is not None and low <= own <= high:
            feed = own
        else:
            feed = now if now is not None and now <= mean and high <= SPREAD * now else mean
        if result and result[-1][1] == feed:
            result[-1] = (result[-1][0] + k - begin, feed)
        else:
            result.append((k - begin, feed))
        now = feed
        if k < len(wanted):
            begin, low, high = k, wanted[k], wanted[k]
    return result, now


def rewrite(
    program: Program, geometry: dict[int, ToolGeometry], order: Order, progress: Callable[[float], object] | None = None
) -> tuple[Edits, Figures]:
    """(Edits, Figures) of a program: JP3131045.  geometry: {number: ToolGeometry}.  Raises Unreadable."""
    feeder = Feeder(program, geometry, order)
    return feeder.run(progress), feeder.figures
