# SPDX-License-Identifier: GPL-2.0-or-later
"""Simulates one program: records of program/reader.py -> Result.

Called by answer.py.  Source: CN105492980 [0043]..[0048]: from the path, the stock's shape and the length of the flutes
it is decided whether the flutes are long enough everywhere; JP3131045 [0006]..[0009]: the removal rate of every move.
Departs from the sources: the whole program with all its tools, and traverses and holders too.

Depth is the height of the stock that a move meets above the tool's tip.  It is at most one cell too large, and too
small only by remains smaller than a cell (components/offline/height_sweep.h); stock that an earlier move has removed,
or that is thinner than 0.004 mm, does not count.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from chipwise.blank import doubt
from chipwise.check import extra_needles
from chipwise.check import rules
from chipwise.program import records
from chipwise.check.clamps import Clamps
from chipwise.check.drawing import Draughtsman
from chipwise.check.findings import CLEARANCE, FLUTE, FLUTES_UNKNOWN, HOLDER, RAPID, RATE, TOOL, Finding
from chipwise.program.program_file import Missing
from chipwise.program.reader import Unreadable
from chipwise.check.result import Result, ToolFigures
from chipwise.clib.height_map import Shape
from chipwise.check.times import OFF, Timer
from chipwise.check.path_part import CutMoves, PathPart
from chipwise.check.tooth_rules import ToothRules
from chipwise.check.travel import Extents, Travel
from chipwise.stock import store
from chipwise.tool_data.geometry import ToolGeometry

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats, Ints, Records
    from chipwise.check.tooth_rules import LoadedPart
    from chipwise.check.assume import Assumption
    from chipwise.program.reader import Machine
    from chipwise.check.clamps import Job
    from chipwise.clib.height_map import HeightMap
    from chipwise.settings import Settings

MIN_DEPTH_MM = 0.005  # smaller depths and contacts are ignored
SEGMENT_MM = 1.0  # moves with feeds are divided into segments of this length
STILL_MM = 1e-6  # across the axis: straight down
GAP = 5  # segments within the rule that do not divide a finding
PART = 65536  # segments simulated at once
RATE_SLACK = 1.05  # the cells give the rate over a window to some per cent


class TooCoarse(Exception):
    """The cells of a stock are too large for a tool."""

    def __init__(self, stock: HeightMap, line: int, tool: int, diameter: float) -> None:
        super().__init__(line, tool, diameter)
        self.stock, self.line = stock, line
        self.tool, self.diameter = tool, diameter  # number, mm


@dataclass(frozen=True)
class Case:
    """A program and what it is judged with.  tools: {number: ToolGeometry} of the file; assumption: of assume.py, None:
    everything is the program's own; job: of a set-up, None: without one."""

    program: str
    machine: Machine
    settings: Settings
    tools: dict[int, ToolGeometry]
    assumption: Assumption | None = None
    job: Job | None = None


class Simulation:
    """A program under way: take() each block of records, then finish().  cell: mm; needles: {number of the stock:
    places (n, 2)} besides."""

    def __init__(self, case: Case, cell: float, needles: dict[int, Floats] | None = None) -> None:
        machine, assumption = case.machine, case.assumption
        self.result = Result(case.program, unit=machine.unit)
        self.settings, self.cell, self.geometry = case.settings, cell, case.tools
        self.timer = Timer(machine)
        self.position = np.zeros(3)  # mm; not known before the first move
        self.place_known = self.blind = False  # blind: what cannot be judged moves
        self.unplaced = rules.Unplaced()
        self.draughtsman: Draughtsman | None = None  # of the stock, None before the first one
        self.tool: ToolFigures | None = None  # in the spindle, None: none
        self.shape: Shape | None = None  # of the tool, None where its diameter is not known
        self.teeth = ToothRules(case.program, case.settings, case.job.material if case.job else "")
        self.been = math.inf  # mm, lowest Z of this tool since it is at its place across the axis
        self.frame = records.Frame()
        self.apart = 0  # traverses to the first place that are still to come
        self.segments = 0  # taken before this part
        self.broken: dict[str, int] = {}  # by rule: the last segment that broke it
        self.needles, self.stock_number = needles or {}, -1
        self.doubts: dict[int, list[tuple[float, Floats]]] = {}  # by number of the stock: (radius, doubtful() rows)
        self.extents = Extents()
        self.travel = Travel(machine.limits) if machine.limits else None
        self.clamps = Clamps(case.settings, case.job)
        self.assumption, self.carries_stock = assumption, False  # the latter: reader.Reader's; set by who reads
        if assumption:
            self.result.assume(assumption)
            if assumption.spindle is not None:
                self._use(assumption.spindle, 0.0, 1)

    @property
    def map(self) -> HeightMap | None:
        """The stock, None before the first one."""
        return self.draughtsman.stock if self.draughtsman else None

    @property
    def drawn(self) -> Draughtsman:
        """The stock and its pictures.  Raises Missing for a program that has defined none."""
        if self.draughtsman is None:
            raise Missing("no stock is defined", "add M250, or name the stock with --stock X0 Y0 Z0 X1 Y1 Z1")
        return self.draughtsman

    def take(self, block: Floats, last: bool = False) -> None:
        """One block of records.  last: nothing follows."""
        rules.check_finite(block)
        for part in rules.parts(block, last):
            if isinstance(part, rules.Other):
                self._event(*part)
            else:
                self._moves(*part)

    def _event(self, kind: int, line: int, values: list[float]) -> None:
        if kind == records.TOOL:
            self._take_tool(int(values[0]), values[1], line)
        elif kind == records.STOCK:
            self._define(line, values)
        elif kind == records.VOLUME:
            self.timer.set_feed_mode(*values[:4])
        elif kind == records.PATH:
            self.timer.path = values[0]
        elif kind == records.LENGTH:
            self._set_length(np.array(values[:3]))
        elif kind in (records.CLAMP, records.CLAMP_SET_UP):
            self.clamps.take_event(kind, line, values)
        elif kind == records.SPINDLE:
            self.teeth.turns = abs(values[0])
        elif kind == records.DWELL:
            self.result.dwell_s += values[0]
            self.timer.wait(values[0])
        elif kind == records.FRAME:
            self.frame = records.Frame.of(values)

    def _set_length(self, length: Floats) -> None:
        """A tool length offset (3,)."""
        self.clamps.set_length(length)
        if self.travel:
            self.travel.length = length

    def _define(self, line: int, values: list[float]) -> None:
        """A stock."""
        self._name_doubt(line, values)
        stock = rules.make_map(line, values, self.cell)
        self.stock_number += 1
        if self.stock_number in self.needles:
            stock.add_needles(self.needles[self.stock_number])
        self.draughtsman, self.been = Draughtsman(stock, self.segments), math.inf
        self.result.cell = stock.cell

    def _name_doubt(self, line: int, values: list[float]) -> None:
        """Raise Unreadable for the probed blank of a slot, with its doubt."""
        slot = int(values[1]) if values[0] < 0 else -1
        found = doubt.read(os.path.join(self.settings.path("STOCK_DIR"), store.slot_name(slot))) if slot >= 0 else None
        if found:
            found = found.replace("; ", ", ")
            raise Unreadable(
                f"M254 restores the probed blank of slot {slot}, which only the machine has: {found}",
                "define the blank with M250 and that allowance, or name it with --stock and leave M254 out",
                line,
            )

    def _take_tool(self, number: int, diameter: float, line: int) -> None:
        self.tool = self.shape = None
        self.been = math.inf
        if number > 0:
            self.result.tool_changes += 1
            self._use(number, diameter, line)

    def _use(self, number: int, diameter: float, line: int) -> None:
        """A tool in the spindle."""
        described = self.geometry.get(number)
        if diameter <= 0 and self.assumption and number in self.assumption.tools:
            assumed = self.assumption.tools[number]
            diameter, described = assumed.diameter, assumed.described and described or assumed.geometry
        if number not in self.result.tools:
            self.result.tools[number] = ToolFigures(number, diameter, described)
            self.teeth.add_tool(number, diameter, described)
            if diameter > 0 and number > 0:
                self._name_unknown(number, line)
        self.tool = tool = self.result.tools[number]
        if diameter > 0:
            self.shape = Shape.of_tool(diameter, tool.geometry or ToolGeometry())

    def _name_unknown(self, number: int, line: int) -> None:
        geometry = self.result.tools[number].geometry
        if geometry is None:
            self.result.findings.add(Finding(TOOL, line, line, number, at=self.segments))
        elif geometry.flute_length is None:
            self.result.findings.add(Finding(FLUTES_UNKNOWN, line, line, number, at=self.segments))

    # ---- moves ----------------------------------------------------------------------------------------------

    def _moves(self, block: Floats, stops: bool) -> None:
        """Moves with one tool in one stock.  stops: the machine waits behind them."""
        rules.check_positions(block)
        if not self.result.moves:
            self.position = block[0, 2:5].copy()
        self.result.moves += len(block)
        if not self.place_known:
            self.apart, self.place_known = rules.moves_to_first_place(block[:, 0], block[:, 2:5], self.frame)
        lead = self.unplaced.lead(block, self.map.z_max if self.map else -math.inf)
        if lead:
            self.blind = True
            self._take_moves(block[:lead], stops)
            self.blind = False
            straight = lead > 1 and math.dist(block[lead - 2, 2:4], block[lead - 1, 2:4]) < rules.ACROSS_MM
            if self.unplaced.arrives:
                self._arrive(block[lead - 1], straight)
        arrives = bool(lead and self.unplaced.arrives)
        known = lead - arrives
        self.clamps.take(block, known, straight if arrives else None, self)
        if self.travel and known < len(block):
            self.travel.take(block[known:], self.frame, self.tool.number if self.tool else 0, self.segments)
        for part in self._segments(block[lead:]):
            self._take_moves(part, stops and part[-1, 1] == block[-1, 1])

    def _arrive(self, move: Floats, straight: bool) -> None:
        """Judge the end of a move that begins anywhere; straight: above its end."""
        place = self.position.copy()
        self.position[2] = max(self.map.z_max, place[2]) if self.map and straight else place[2]
        self._cut(place[None], move[None, 1].astype(int), move[None, 0].astype(int), np.zeros(1))
        self.position = place

    def _segments(self, block: Floats) -> Iterator[Floats]:
        """Yield the moves in parts, those with feeds divided into segments of about SEGMENT_MM."""
        positions = block[:, 2:5]
        length = np.sqrt((np.diff(positions, axis=0, prepend=self.position[None]) ** 2).sum(axis=1))
        count = np.where(block[:, 0] == records.RAPID, 1.0, np.clip(np.ceil(length / SEGMENT_MM), 1, PART)).astype(int)
        first, start = 0, self.position
        while first < len(block):
            end = max(first + 1, first + int(np.searchsorted(np.cumsum(count[first:]), PART, side="right")))
            n, rows = count[first:end], block[first:end]
            if n.max() == 1:
                yield rows
            else:
                before = np.concatenate((start[None], rows[:-1, 2:5]))
                index, share = rules.divided(n)
                part = rows[index]
                part[:, 2:5] = np.where(
                    (share < 1)[:, None], before[index] + (part[:, 2:5] - before[index]) * share[:, None], part[:, 2:5]
                )
                yield part
            first, start = end, rows[-1, 2:5]

    def _take_moves(self, block: Floats, stops: bool) -> None:
        kinds, positions, lines = block[:, 0].astype(int), block[:, 2:5], block[:, 1].astype(int)
        steps = np.diff(positions, axis=0, prepend=self.position[None])
        length = np.sqrt((steps * steps).sum(axis=1))
        met = self._cut(positions, lines, kinds, length)
        moving = length > 1e-9
        if not self.blind:
            self.extents.take(moving & (kinds != records.RAPID), self.position, positions, self.frame)
        moving[: self.apart], self.apart = False, max(0, self.apart - len(moving))
        if moving.any():
            volume = met["volume"].astype(np.float64) if met is not None else np.zeros(len(length))
            part = PathPart.of(block, steps, length, volume, moving)
            loaded = self.teeth.loaded(part, self.tool, met["depth"][moving] if met is not None else None)
            self.timer.allowed = loaded.allowed if loaded else None
            rate = self.timer.spend(part, self.tool, stops)
            if rate is not None and self.tool:
                self._check_rates(self.tool, rate, block[moving])
                if loaded:
                    self._check_teeth(loaded, block[moving])
        self.position = positions[-1].copy()
        self.segments += len(block)

    def _check_rates(self, tool: ToolFigures, rate: Floats, block: Floats) -> None:
        """Peak of the removal rate, and findings for rates too high for the tool."""
        tool.peak_rate = max(tool.peak_rate, float(rate.max()))
        limit = tool.geometry and tool.geometry.max_removal_rate
        if limit and self.timer.mode == OFF:
            self._find(RATE, rate > RATE_SLACK * limit, rate, limit, CutMoves.at_ends(block))

    def _check_teeth(self, loaded: LoadedPart, block: Floats) -> None:
        """Findings for chip, power and bending above their limits."""
        moves = CutMoves.at_ends(block)
        for rule, broken, values, most in self.teeth.judged(loaded, self.timer, block):
            self._find(rule, broken, values, most, moves)

    def _cut(self, positions: Floats, lines: Ints, kinds: Ints, length: Floats) -> Records | None:
        """Cut them; -> what they met, None without a stock."""
        tool, shape, drawn = self.tool, self.shape, self.draughtsman
        if tool is None or shape is None or drawn is None:
            bad = (kinds != records.RAPID) & (length > 0)
            if bad.any():
                rules.cannot_cut(tool.number if tool else None, shape, int(lines[bad][0]))
            return None
        if self.blind:
            return None
        stock = drawn.stock
        if rules.is_too_coarse(stock, shape.diameter):
            raise TooCoarse(stock, int(lines[0]), tool.number, shape.diameter)
        judged, self.been = rules.near_stock(self.position, positions, kinds, stock.z_max, self.been)
        met = stock.cut(shape, self.position, positions, judged, self.settings["TRAVERSE_CLEARANCE"])
        drawn.add(kinds, positions, lines, self.frame)
        moves = CutMoves(kinds, lines, positions, met)
        tool.volume += float(met["volume"].sum(dtype=np.float64))
        cuts = (met["depth"] > MIN_DEPTH_MM) & (kinds != records.RAPID)
        if cuts.any():
            worst = int(np.argmax(np.where(cuts, met["depth"], 0.0)))
            if met["depth"][worst] > tool.depth:
                tool.depth, tool.depth_line = float(met["depth"][worst]), int(lines[worst])
                tool.depth_position = self._contact(moves, worst)[1]
            tool.reach = max(tool.reach, stock.z_max - float(positions[cuts, 2].min()))
        g = tool.geometry
        if g is not None and g.flute_length is not None:
            deepest = g.flute_length + MIN_DEPTH_MM
            self._find(FLUTE, cuts & (met["depth"] > deepest), met["depth"], g.flute_length, moves)
            self._doubt(moves, cuts, deepest, shape.diameter / 2)
        self._find_traverses(moves, shape.diameter)
        self._find(HOLDER, met["holder"] > MIN_DEPTH_MM, met["holder"], shape.stick_out or None, moves)
        return met

    def _find_traverses(self, moves: CutMoves, diameter: float) -> None:
        """Traverses in stock.  The model cuts one straight down in steps, and the depth of each is that of what is new;
        together they are as deep as the volume over the tool's circle, or more."""
        met = moves.met
        broken = (moves.kinds == records.RAPID) & (met["depth"] > MIN_DEPTH_MM)
        near = (met["beside"] >= 0.0) & ~broken
        if near.any():
            where = met[["beside_at"]].copy()
            where.dtype.names = ("at",)
            clearance, beside = self.settings["TRAVERSE_CLEARANCE"], replace(moves, met=where)
            self._find(CLEARANCE, near, met["beside"], clearance, beside, np.argmin)
        if not broken.any():
            return
        across = np.hypot(*np.diff(moves.positions[:, :2], axis=0, prepend=self.position[None, :2]).T)
        down = met["volume"] / (math.pi * diameter**2 / 4)
        whole = broken & (across < STILL_MM) & (down > met["depth"])
        met["at"][whole] = 1.0
        self._find(RAPID, broken, np.where(whole, down, met["depth"]), None, moves)

    def _doubt(self, moves: CutMoves, cuts: Bools, limit: float, radius: float) -> None:
        """Keep the moves up that may cut deeper than they are judged."""
        if not self.needles:
            start = np.concatenate((self.position[None], moves.positions[:-1]))
            found = extra_needles.doubtful(start, moves.positions, cuts, moves.met["depth"], limit)
            if len(found):
                self.doubts.setdefault(self.stock_number, []).append((radius, found))

    def _contact(self, moves: CutMoves, index: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Where on a move the worst contact was, mm in machine and in work coordinates."""
        end = moves.positions[index]
        start = moves.positions[index - 1] if index else self.position
        p = start + float(moves.met["at"][index]) * (end - start)
        return tuple(map(float, p)), tuple(map(float, self.frame.to_work(p)))

    def _find(
        self,
        rule: str,
        broken: Bools,
        values: Floats,
        limit: float | None,
        moves: CutMoves,
        worst_of: Callable[[Floats], Any] = np.argmax,
    ) -> None:
        """One finding for each chain of segments that break a rule."""
        last, at, indices = self.broken.get(rule, -GAP - 1), self.segments, np.flatnonzero(broken)
        if not len(indices):
            return
        self.broken[rule] = at + int(indices[-1])
        for part in np.split(indices, np.flatnonzero(np.diff(indices) > GAP) + 1):
            first, end = int(part[0]), int(part[-1]) + 1
            worst = int(part[worst_of(values[part])])
            machine, work = self._contact(moves, worst)
            self.result.findings.extend(
                Finding(
                    rule,
                    int(moves.lines[first:end].min()),
                    int(moves.lines[first:end].max()),
                    self.tool.number if self.tool else 0,
                    work,
                    float(values[worst]),
                    limit,
                    len(part),
                    at + first,
                    machine,
                ),
                goes_on=at + first - last <= GAP,
            )
            last = at + end - 1

    def second_look(self) -> tuple[Simulation, Callable[[], None]] | None:
        """-> (a Simulation that reads the program once more, what takes what it has found), or None."""
        return None

    def finish(self, messages: list[list[int | str]], notes: list[list[int | str]]) -> Result:
        """-> the Result."""
        result, drawn = self.result, self.drawn
        result.messages, result.notes = (
            messages,
            [
                *result.notes,
                *notes,
                *self.clamps.notes(),
                *self.unplaced.notes(),
                *self.teeth.notes(result.tools.values(), result.unit),
            ],
        )
        if self.travel:
            self.travel.finish(result.findings, result.notes, result.unit)
        result.findings.kept.sort(key=lambda finding: finding.at)
        result.extents = self.extents.corners()
        result.load = self.timer.load.rates()
        result.load_volumetric = self.timer.load_volumetric.rates() if self.timer.volumetric else None
        result.drawing = drawn.drawing()
        return result
