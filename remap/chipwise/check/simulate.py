# SPDX-License-Identifier: GPL-2.0-or-later
"""Simulates one program: records of program/reader.py -> Result.

Called by answer.py.  Source: CN105492980 [0043]..[0048]: from the path, the stock's shape and the length of the flutes
it is decided whether the flutes are long enough everywhere; JP3131045 [0006]..[0009]: the removal rate of every move.
Departs from the sources: the whole program with all its tools, and traverses and holders too.

Depth is the height of the stock that a move meets above the tool's tip.  It is at most one cell too large, and too
small only by remains smaller than a cell (components/offline/height_sweep.h); stock that an earlier move has removed,
or that is thinner than 0.004 mm, does not count.
"""

import math
import os

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
from chipwise.check.path_part import PathPart
from chipwise.check.tooth_rules import ToothRules
from chipwise.check.travel import Extents, Travel
from chipwise.stock import store
from chipwise.tool_data.geometry import ToolGeometry

MIN_DEPTH_MM = 0.005  # smaller depths and contacts are ignored
SEGMENT_MM = 1.0  # moves with feeds are divided into segments of this length
STILL_MM = 1e-6  # across the axis: straight down
GAP = 5  # segments within the rule that do not divide a finding
PART = 65536  # segments simulated at once
RATE_SLACK = 1.05  # the cells give the rate over a window to some per cent


class TooCoarse(Exception):
    """The cells are too large for a tool: line, tool number, diameter (mm)."""


class Simulation(ToothRules):
    """A program under way: take() each block of records, then finish().  needles: {number of the stock: places (n, 2)}
    besides; assumption: of assumed/, None: everything is the program's own; job: setup/job.py's of a set-up, None:
    without one."""

    def __init__(self, program, machine, cell, settings, tools, needles=None, assumption=None, job=None):
        self.result = Result(program, unit=machine.unit)
        self.settings, self.cell, self.geometry = settings, cell, tools
        self.timer = Timer(machine)
        self.position = None  # (3,), mm
        self.place_known = self.blind = False  # blind: what cannot be judged moves
        self.unplaced = rules.Unplaced()
        self.map = self.draughtsman = None
        self.tool, self.shape = None, None
        self.begin_tooth(program, settings, job.material if job else "")
        self.been = math.inf  # mm, lowest Z of this tool since it is at its place across the axis
        self.frame = records.Frame()
        self.apart = 0  # traverses to the first place that are still to come
        self.segments = 0  # taken before this part
        self.broken = {}  # by rule: the last segment that broke it
        self.needles, self.stock_number = needles or {}, -1
        self.doubts = {}  # {number of the stock: [(radius, rows of doubts.doubtful())]}
        self.extents = Extents()
        self.travel = Travel(machine.limits) if machine.limits else None
        self.clamps = Clamps(settings, job)
        self.assumption, self.carries_stock = assumption, False  # the latter: reader.Reader's; set by who reads
        if assumption:
            self.result.assume(assumption)
            if assumption.spindle is not None:
                self._use(assumption.spindle, 0.0, 1)

    def take(self, block, last=False):
        """One block of records.  last: nothing follows."""
        rules.check_finite(block)
        for part in rules.parts(block, last):
            if isinstance(part, rules.Other):
                self._event(*part)
            else:
                self._moves(*part)

    def _event(self, kind, line, values):
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
            self.turns = abs(values[0])
        elif kind == records.DWELL:
            self.result.dwell_s += values[0]
            self.timer.wait(values[0])
        elif kind == records.FRAME:
            self.frame = records.Frame.of(values)

    def _set_length(self, length):
        """A tool length offset (3,)."""
        self.clamps.set_length(length)
        if self.travel:
            self.travel.length = length

    def _define(self, line, values):
        """A stock."""
        self._name_doubt(line, values)
        self.map = rules.make_map(line, values, self.cell)
        self.stock_number += 1
        if self.stock_number in self.needles:
            self.map.add_needles(self.needles[self.stock_number])
        self.draughtsman, self.been = Draughtsman(self.map, self.segments), math.inf
        self.result.cell = self.map.cell

    def _name_doubt(self, line, values):
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

    def _take_tool(self, number, diameter, line):
        self.tool = self.shape = None
        self.been = math.inf
        if number > 0:
            self.result.tool_changes += 1
            self._use(number, diameter, line)

    def _use(self, number, diameter, line):
        """A tool in the spindle."""
        described = self.geometry.get(number)
        if diameter <= 0 and self.assumption and number in self.assumption.tools:
            assumed = self.assumption.tools[number]
            diameter, described = assumed.diameter, assumed.described and described or assumed.geometry
        if number not in self.result.tools:
            self.result.tools[number] = ToolFigures(number, diameter, described)
            self.tooth[number] = self.limits.of_tool(diameter, described) if diameter > 0 else None
            if diameter > 0 and number > 0:
                self._name_unknown(number, line)
        self.tool = self.result.tools[number]
        if diameter > 0:
            self.shape = Shape.of_tool(diameter, self.tool.geometry or ToolGeometry())

    def _name_unknown(self, number, line):
        geometry = self.result.tools[number].geometry
        if geometry is None:
            self.result.findings.add(Finding(TOOL, line, line, number, at=self.segments))
        elif geometry.flute_length is None:
            self.result.findings.add(Finding(FLUTES_UNKNOWN, line, line, number, at=self.segments))

    # ---- moves ----------------------------------------------------------------------------------------------

    def _moves(self, block, stops):
        """Moves with one tool in one stock.  stops: the machine waits behind them."""
        rules.check_positions(block)
        self.position = (
            block[0, 2:5].copy() if self.position is None else self.position
        )  # unknown before the first move
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

    def _arrive(self, move, straight):
        """Judge the end of a move that begins anywhere; straight: above its end."""
        place = self.position.copy()
        self.position[2] = max(self.map.z_max, place[2]) if self.map and straight else place[2]
        self._cut(place[None], move[None, 1].astype(int), move[None, 0].astype(int), np.zeros(1))
        self.position = place

    def _segments(self, block):
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

    def _take_moves(self, block, stops):
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
            loads = self._tooth_loads(part, met["depth"][moving] if met is not None else None)
            rate = self.timer.spend(part, self.tool, stops)
            if rate is not None:
                self._check_rates(rate, block[moving])
                self._check_tooth(loads, part.length, block[moving])
        self.position = positions[-1].copy()
        self.segments += len(block)

    def _check_rates(self, rate, block):
        """Peak of the removal rate, and findings for rates too high for the tool."""
        self.tool.peak_rate = max(self.tool.peak_rate, float(rate.max()))
        limit = self.tool.geometry and self.tool.geometry.max_removal_rate
        if limit and self.timer.mode == OFF:
            met = np.zeros(len(rate), [("at", "<f4")])
            met["at"] = 1.0
            self._find(RATE, rate > RATE_SLACK * limit, rate, limit, block[:, 2:5], block[:, 1].astype(int), met)

    def _cut(self, positions, lines, kinds, length):
        """Cut them; -> what they met, None without a stock."""
        usable, bad = self.map is not None and self.shape is not None, (kinds != records.RAPID) & (length > 0)
        if not usable and bad.any():
            rules.cannot_cut(self.tool and self.tool.number, self.shape, int(lines[bad][0]))
        if not usable or self.blind:
            return None
        if rules.is_too_coarse(self.map, self.shape.diameter):
            raise TooCoarse(int(lines[0]), self.tool.number, self.shape.diameter)
        judged, self.been = rules.near_stock(self.position, positions, kinds, self.map.z_max, self.been)
        met = self.map.cut(self.shape, self.position, positions, judged, self.settings["TRAVERSE_CLEARANCE"])
        self.draughtsman.add(kinds, positions, lines, self.frame)
        tool, stock = self.tool, self.map
        tool.volume += float(met["volume"].sum(dtype=np.float64))
        cuts = (met["depth"] > MIN_DEPTH_MM) & (kinds != records.RAPID)
        if cuts.any():
            worst = int(np.argmax(np.where(cuts, met["depth"], 0.0)))
            if met["depth"][worst] > tool.depth:
                tool.depth, tool.depth_line = float(met["depth"][worst]), int(lines[worst])
                tool.depth_position = self._contact(positions, worst, met)[1]
            tool.reach = max(tool.reach, stock.z_max - float(positions[cuts, 2].min()))
        g = tool.geometry
        if g is not None and g.flute_length is not None:
            self._find(
                FLUTE,
                cuts & (met["depth"] > g.flute_length + MIN_DEPTH_MM),
                met["depth"],
                g.flute_length,
                positions,
                lines,
                met,
            )
            self._doubt(positions, cuts, met["depth"], g.flute_length + MIN_DEPTH_MM)
        self._find_traverses(kinds, positions, lines, met)
        self._find(
            HOLDER, met["holder"] > MIN_DEPTH_MM, met["holder"], self.shape.stick_out or None, positions, lines, met
        )
        return met

    def _find_traverses(self, kinds, positions, lines, met):
        """Traverses in stock.  The model cuts one straight down in steps, and the depth of each is that of what is new;
        together they are as deep as the volume over the tool's circle, or more."""
        broken = (kinds == records.RAPID) & (met["depth"] > MIN_DEPTH_MM)
        near = (met["beside"] >= 0.0) & ~broken
        if near.any():
            where = met[["beside_at"]].copy()
            where.dtype.names = ("at",)
            self._find(
                CLEARANCE, near, met["beside"], self.settings["TRAVERSE_CLEARANCE"], positions, lines, where, np.argmin
            )
        if not broken.any():
            return
        across = np.hypot(*np.diff(positions[:, :2], axis=0, prepend=self.position[None, :2]).T)
        down = met["volume"] / (math.pi * self.shape.diameter**2 / 4)
        whole = broken & (across < STILL_MM) & (down > met["depth"])
        met["at"][whole] = 1.0
        self._find(RAPID, broken, np.where(whole, down, met["depth"]), None, positions, lines, met)

    def _doubt(self, positions, cuts, depth, limit):
        """Keep the moves up that may cut deeper than they are judged."""
        if not self.needles:
            found = extra_needles.doubtful(
                np.concatenate((self.position[None], positions[:-1])), positions, cuts, depth, limit
            )
            if len(found):
                self.doubts.setdefault(self.stock_number, []).append((self.shape.diameter / 2, found))

    def _contact(self, positions, index, met):
        """Where on a move the worst contact was, mm in machine and in work coordinates."""
        start = positions[index - 1] if index else self.position
        p = start + float(met["at"][index]) * (positions[index] - start)
        return tuple(map(float, p)), tuple(map(float, self.frame.to_work(p)))

    def _find(self, rule, broken, values, limit, positions, lines, met, worst_of=np.argmax):
        """One finding for each chain of segments that break a rule."""
        last, at, indices = self.broken.get(rule, -GAP - 1), self.segments, np.flatnonzero(broken)
        if not len(indices):
            return
        self.broken[rule] = at + int(indices[-1])
        for part in np.split(indices, np.flatnonzero(np.diff(indices) > GAP) + 1):
            first, end = int(part[0]), int(part[-1]) + 1
            worst = int(part[worst_of(values[part])])
            machine, work = self._contact(positions, worst, met)
            self.result.findings.extend(
                Finding(
                    rule,
                    int(lines[first:end].min()),
                    int(lines[first:end].max()),
                    self.tool.number,
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

    def second_look(self):
        """-> (a Simulation that reads the program once more, what takes its result), or None."""
        return None

    def finish(self, messages, notes):
        """-> the Result."""
        result = self.result
        if self.map is None:
            raise Missing("no stock is defined", "add M250, or name the stock with --stock X0 Y0 Z0 X1 Y1 Z1")
        result.messages, result.notes = (
            messages,
            [*result.notes, *notes, *self.clamps.notes(), *self.unplaced.notes(), *self.tooth_notes()],
        )
        if self.travel:
            self.travel.finish(result.findings, result.notes, result.unit)
        result.findings.kept.sort(key=lambda finding: finding.at)
        result.extents = self.extents.corners()
        result.load = self.timer.load.rates()
        result.load_volumetric = self.timer.load_volumetric.rates() if self.timer.volumetric else None
        result.drawing = self.draughtsman.drawing()
        return result
