"""Judges one program: records of reader.py -> Result.

Called by run.py.  Source: CN105492980 [0043]..[0048]: from the path, the stock's shape and the length of the flutes it is
decided whether the flutes are long enough everywhere; JP3131045 [0006]..[0009]: the removal rate of every move.
Departs from the sources: the whole program with all its tools, and traverses and holders too.

Depth is how far the stock that a move meets reaches above the tool's tip, at most one cell more and not less but for remains
smaller than a cell (components/core/height_sweep.h); stock that an earlier move has removed, or that is thinner than 0.004 mm, does not count.
"""

import math
import time
from dataclasses import dataclass, field

import numpy as np

from chipwise.check import records
from chipwise.check.findings import FLUTE, FLUTES_UNKNOWN, HOLDER, RAPID, RATE, TOOL, Finding, Findings
from chipwise.check.load import Load
from chipwise.check.reader import CPU_S, Reader, Unreadable
from chipwise.check.sweep import HeightMap, Shape, least_cell, times
from chipwise.errors import CycleError
from chipwise.settings import load_settings
from chipwise.tools import ToolGeometry, load_tools

OVER_MM = 0.005             # a depth, and a touch, by less than that is none
PIECE_MM = 1.0              # moves with feeds are judged in pieces of that length
LEAST_CELLS = 4             # a tool has at least so many across
FINE_CELLS = 8              # and so many where the cell is chosen for it
GAP = 5                     # pieces that break no rule, and yet do not part a finding
PART = 65536                # pieces judged at once
RATE_WINDOW_MM = 2.0        # a rate is measured over at least that way
RATE_SLACK = 1.05           # the cells tell the rate over such a way to some per cent
FARTHEST_MM = 1e5           # of a place from machine zero
CORNER_MM = 0.01            # how far a corner may be rounded (G64 P) when times are estimated
USUAL_SPEED, USUAL_ACCEL = 50.0, 500.0      # mm/s, mm/s2 where the INI file has none
PICTURE = 400               # cells of a picture along its longer side
OFF, LIMIT, CONSTANT, WINDOW = 0, 1, 2, 3   # M251 P


class _TooCoarse(Exception):
    """The cells are too large for a tool: line, tool number, diameter (mm)."""


@dataclass
class ToolFigures:
    """One tool in one program; mm, mm3, s."""

    number: int
    diameter: float
    geometry: ToolGeometry = None       # None: not described
    feed_s: float = 0.0                 # at F and the rapid rate, no acceleration
    planned_s: float = 0.0              # with the machine's acceleration
    volumetric_s: float = 0.0           # with M251
    volumetric_planned_s: float = 0.0
    cutting_s: float = 0.0              # planned, while stock is removed
    volume: float = 0.0
    peak_rate: float = 0.0              # mm3/min at F, over RATE_WINDOW_MM
    depth: float = 0.0
    depth_line: int = 0
    depth_place: tuple = None
    lowest: float = math.inf            # Z of the tip below the top of the stock
    reach: float = 0.0                  # stick-out that is enough whatever the holder

    def json(self):
        """As in --json."""
        g = self.geometry or ToolGeometry(shape=None)
        return {"tool": self.number, "diameter_mm": self.diameter, "shape": g.shape, "flute_length_mm": g.flute_length,
                "stick_out_mm": g.stick_out, "feed_s": self.feed_s, "planned_s": self.planned_s,
                "volumetric_s": self.volumetric_s, "volumetric_planned_s": self.volumetric_planned_s,
                "cutting_s": self.cutting_s, "volume_mm3": self.volume,
                "mean_rate_mm3_min": self.volume / self.cutting_s * 60.0 if self.cutting_s > 0 else 0.0,
                "peak_rate_mm3_min": self.peak_rate, "depth_mm": self.depth, "depth_line": self.depth_line,
                "depth_place": self.depth_place, "least_flute_length_mm": math.ceil(self.depth * 10 - 1e-6) / 10,
                "least_stick_out_mm": math.ceil(max(self.reach, self.depth) * 10 - 1e-6) / 10}


@dataclass
class Result:
    """One program.  error: (text, line) where it cannot be judged, else None."""

    program: str
    error: tuple = None
    unit: str = "mm"
    cell: float = 0.0
    moves: int = 0
    tools: dict = field(default_factory=dict)
    findings: Findings = field(default_factory=Findings)
    messages: list = field(default_factory=list)
    load: tuple = None                  # (seconds of a bin, mm3/min) at F
    load_volumetric: tuple = None       # with M251; None without
    pictures: tuple = None              # (cell mm, x0, y0, z_min, heights before, heights after)
    dwell_s: float = 0.0

    @property
    def status(self):
        return 2 if self.error else 1 if self.findings.count else 0

    def json(self):
        """As in --json."""
        kept = self.findings
        return {"program": self.program, "status": self.status, "error": self.error and self.error[0],
                "error_line": self.error and self.error[1], "cell_mm": self.cell, "moves": self.moves, "dwell_s": self.dwell_s,
                "tools": [t.json() for t in self.tools.values()], "findings": [f.json() for f in kept.kept],
                "more_findings": kept.dropped, "messages": self.messages,
                "load": self.load and {"bin_s": self.load[0], "mm3_min": np.round(self.load[1], 1).tolist()},
                "load_volumetric": self.load_volumetric and {"bin_s": self.load_volumetric[0],
                                                             "mm3_min": np.round(self.load_volumetric[1], 1).tolist()}}


class Judge:
    """A program under way: take() each block of records, then result()."""

    def __init__(self, program, machine, cell, settings, tools):
        self.result = Result(program, unit="in" if machine.unit_mm > 10 else "mm")
        self.settings, self.cell, self.geometry = settings, cell, tools
        self.speeds = np.array([v or USUAL_SPEED for v in machine.speeds])
        self.accels = np.array([a or USUAL_ACCEL for a in machine.accels])
        self.at = None                                  # (3,), mm
        self.height_known = False
        self.map = self.before = None
        self.tool, self.shape = None, None
        self.frame = (0.0,) * 7
        self.mode, self.target, self.lower, self.ceiling = OFF, 0.0, 0.0, 0.0
        self.load, self.load_volumetric, self.volumetric = Load(), Load(), False
        self.speed, self.speed_volumetric = [0.0], [0.0]
        self.last_kind, self.last_way = None, None
        self.pieces = 0                                 # taken before this part
        self.broken = {}                                # by rule: the last piece that broke it

    # ---- blocks ---------------------------------------------------------------------------------------------

    def take(self, block):
        """One block of records."""
        if not np.isfinite(block).all():
            line = int(block[~np.isfinite(block).all(axis=1)][0, 1])
            raise Unreadable("a number is not finite", "give every expression a value", line)
        kinds = block[:, 0].astype(int)
        events = np.flatnonzero(kinds > records.ARC)
        start = 0
        for event in (*events.tolist(), len(block)):
            if event > start:
                self._moves(block[start:event])
            if event < len(block):
                self._event(kinds[event], int(block[event, 1]), block[event, 2:].tolist())
            start = event + 1

    def _event(self, kind, line, values):
        if kind == records.TOOL:
            self._take_tool(int(values[0]), values[1], line)
        elif kind == records.STOCK:
            self._define(line, *values)
        elif kind == records.VOLUME:
            self.mode, (self.target, self.lower, self.ceiling) = int(values[0]), values[1:4]
            self.volumetric = self.volumetric or self.mode != OFF
        elif kind == records.DWELL:
            self.result.dwell_s += values[0]
            self.load.wait(values[0])
            self.load_volumetric.wait(values[0])
        elif kind == records.FRAME:
            self.frame = tuple(values[:7])

    def _define(self, line, shape, turn, *corners):
        """A stock."""
        if shape < 0:
            raise Unreadable("M254 restores a stock that only the machine has", "define it with M250, or name it with --stock "
                             "and leave M254 out", line)
        low, high = corners[:3], corners[3:]
        if not all(b - a >= 1e-3 for a, b in zip(low, high)):
            raise Unreadable("the stock has no extent", "give a maximum above the minimum in X, Y and Z", line)
        cell = max(self.cell, least_cell(low, high))
        self.map = HeightMap(low, high, cell, int(shape), turn)
        self.before = self.map.picture(PICTURE)
        self.result.cell = cell

    def _take_tool(self, number, diameter, line):
        self.tool = self.shape = None
        if number <= 0:
            return
        if number not in self.result.tools:
            self.result.tools[number] = ToolFigures(number, diameter, self.geometry.get(number))
            if diameter > 0:
                self._name_unknown(number, line)
        self.tool = self.result.tools[number]
        if diameter > 0:
            g = self.tool.geometry or ToolGeometry()
            corner = diameter / 2 if g.shape == "ball" else min(g.corner_radius or 0.0, diameter / 2)
            cone = g.tip_angle or 0.0 if g.shape in ("vee", "tapered-ball") else 0.0
            known = g.holder_diameter and g.stick_out
            self.shape = Shape(diameter, corner, cone, g.holder_diameter if known else 0.0, g.stick_out if known else 0.0)

    def _name_unknown(self, number, line):
        geometry = self.geometry.get(number)
        if geometry is None:
            self.result.findings.add(Finding(TOOL, line, line, number, at=self.pieces))
        elif geometry.flute_length is None:
            self.result.findings.add(Finding(FLUTES_UNKNOWN, line, line, number, at=self.pieces))

    # ---- moves ----------------------------------------------------------------------------------------------

    def _moves(self, block):
        """Moves with one tool in one stock."""
        places, lines = block[:, 2:5], block[:, 1].astype(int)
        far = np.abs(places).max(axis=1) > FARTHEST_MM
        if far.any():
            raise Unreadable("a place is more than 100 m from machine zero", "correct the coordinates", int(lines[far][0]))
        if self.at is None:                             # where the machine stands before the first move is not known
            self.at = places[0].copy()
        self.result.moves += len(block)
        lead = self._height_unknown(block)
        if lead:
            stock, self.map = self.map, None
            self._take_moves(block[:lead])
            self.map = stock
        if lead < len(block):
            for part in self._pieces(block[lead:]):
                self._take_moves(part)

    def _height_unknown(self, block):
        """Leading traverses up to the first one in Z: to the interpreter the machine stands at its zero before, in truth it
        may stand anywhere."""
        if self.height_known:
            return 0
        known = (block[:, 0] != records.RAPID) | (np.abs(block[:, 4]) > 1e-9)
        self.height_known = bool(known.any())
        if not self.height_known:
            return len(block)
        first = int(np.argmax(known))
        return first + (block[first, 0] == records.RAPID)

    def _pieces(self, block):
        """The moves with feeds divided into pieces of about PIECE_MM, so that what happens within one is seen; in parts."""
        places = block[:, 2:5]
        length = np.sqrt((np.diff(places, axis=0, prepend=self.at[None]) ** 2).sum(axis=1))
        count = np.where(block[:, 0] == records.RAPID, 1.0, np.clip(np.ceil(length / PIECE_MM), 1, PART)).astype(int)
        first, start = 0, self.at
        while first < len(block):
            end = max(first + 1, first + int(np.searchsorted(np.cumsum(count[first:]), PART, side="right")))
            n, rows = count[first:end], block[first:end]
            if n.max() == 1:
                yield rows
            else:
                before = np.concatenate((start[None], rows[:-1, 2:5]))
                index = np.repeat(np.arange(len(n)), n)
                share = (np.arange(len(index)) - np.repeat(np.cumsum(n) - n, n) + 1) / n[index]
                part = rows[index]
                part[:, 2:5] = np.where((share < 1)[:, None], before[index] + (part[:, 2:5] - before[index]) * share[:, None],
                                        part[:, 2:5])
                yield part
            first, start = end, rows[-1, 2:5]

    def _take_moves(self, block):
        kinds, places, lines = block[:, 0].astype(int), block[:, 2:5], block[:, 1].astype(int)
        steps = np.diff(places, axis=0, prepend=self.at[None])
        length = np.sqrt((steps * steps).sum(axis=1))
        met = self._cut(places, lines, kinds, length)
        self._spend(block, kinds, steps, length, met)
        self.at = places[-1].copy()
        self.pieces += len(block)

    def _cut(self, places, lines, kinds, length):
        """Cut them; -> what they met, None without a stock."""
        if self.map is None or self.shape is None:
            bad = (kinds != records.RAPID) & (length > 0)
            if bad.any():
                self._cannot_cut(int(lines[bad][0]))
            return None
        if self.shape.diameter < LEAST_CELLS * self.map.cell:
            raise _TooCoarse(int(lines[0]), self.tool.number, self.shape.diameter)
        met = self.map.cut(self.shape, self.at, places)
        tool, stock = self.tool, self.map
        tool.volume += float(met["volume"].sum(dtype=np.float64))
        cuts = (met["depth"] > OVER_MM) & (kinds != records.RAPID)
        if cuts.any():
            worst = int(np.argmax(np.where(cuts, met["depth"], 0.0)))
            if met["depth"][worst] > tool.depth:
                tool.depth, tool.depth_line = float(met["depth"][worst]), int(lines[worst])
                tool.depth_place = self._place(places, worst, met)
            tool.reach = max(tool.reach, stock.z_max - float(places[cuts, 2].min()))
        g = tool.geometry
        if g is not None and g.flute_length is not None:
            self._find(FLUTE, cuts & (met["depth"] > g.flute_length + OVER_MM), met["depth"], g.flute_length, places, lines, met)
        self._find(RAPID, (met["depth"] > OVER_MM) & (kinds == records.RAPID), met["depth"], None, places, lines, met)
        self._find(HOLDER, met["holder"] > OVER_MM, met["holder"], self.shape.stick_out or None, places, lines, met)
        return met

    def _cannot_cut(self, line):
        if self.shape is None:
            if self.tool is not None:
                raise Unreadable(f"tool {self.tool.number} has no diameter in the tool table", "give it a D there", line)
            raise Unreadable("no tool is in the spindle (tool 0)", "call one with T.. M6 before", line)
        raise Unreadable("no stock is defined", "add M250 (with words, or with a WORKPIECE comment), or name the stock with "
                         "--stock X0 Y0 Z0 X1 Y1 Z1", line)

    def _place(self, places, index, met):
        """Where on a move the worst was, mm in work coordinates."""
        start = places[index - 1] if index else self.at
        p = start + float(met["at"][index]) * (places[index] - start)
        angle, gx, gy, gz, x92, y92, z92 = self.frame
        x, y = p[0] - gx, p[1] - gy
        c, s = math.cos(angle), math.sin(angle)
        return x * c + y * s - x92, y * c - x * s - y92, float(p[2]) - gz - z92

    def _find(self, rule, broken, values, limit, places, lines, met):
        """One finding for each stretch of pieces that break a rule."""
        last, at = self.broken.get(rule, -GAP - 1), self.pieces
        indices = np.flatnonzero(broken)
        if not len(indices):
            return
        self.broken[rule] = at + int(indices[-1])
        for part in np.split(indices, np.flatnonzero(np.diff(indices) > GAP) + 1):
            first, end = int(part[0]), int(part[-1]) + 1
            worst = int(part[np.argmax(values[part])])
            self.result.findings.stretch(
                Finding(rule, int(lines[first:end].min()), int(lines[first:end].max()), self.tool.number,
                        tuple(map(float, self._place(places, worst, met))), float(values[worst]), limit, len(part), at + first),
                goes_on=at + first - last <= GAP)
            last = at + end - 1

    # ---- times ----------------------------------------------------------------------------------------------

    def _spend(self, block, kinds, steps, length, met):
        """Times and rates of the moves."""
        moving = length > 1e-9
        if not moving.any():
            return
        kinds, length, way = kinds[moving], length[moving], steps[moving] / length[moving, None]
        volume = met["volume"][moving].astype(np.float64) if met is not None else np.zeros(len(length))
        with np.errstate(divide="ignore"):
            rapid_speed = (self.speeds / np.abs(way)).min(axis=1)
            accel = (self.accels / np.abs(way)).min(axis=1)
        feed = block[moving, 5] / 60.0
        cutting = kinds != records.RAPID
        if (cutting & ~(feed > 0)).any():
            line = int(block[moving, 1][cutting & ~(feed > 0)][0])
            raise Unreadable("no feed is set", "give F on this line or before", line)
        plain = np.where(cutting, np.minimum(feed, rapid_speed), rapid_speed)
        corner = self._corner_speeds(kinds, way, length, accel)
        planned = self._planned(length, plain, accel, corner, self.speed)
        self._rates(length, plain, planned, volume, cutting, block[moving])
        volumetric, volumetric_planned = plain, planned
        if self.mode != OFF:
            wanted = np.where(cutting, np.minimum(self._volumetric(length, volume, plain), rapid_speed), plain)
            volumetric, volumetric_planned = wanted, self._planned(length, wanted, accel, corner, self.speed_volumetric)
        self.load.add(planned, volume)
        self.load_volumetric.add(volumetric_planned, volume)
        tool = self.tool
        if tool is not None:
            tool.feed_s += float((length / plain).sum())
            tool.planned_s += float(planned.sum())
            tool.volumetric_s += float((length / volumetric).sum())
            tool.volumetric_planned_s += float(volumetric_planned.sum())
            tool.cutting_s += float(planned[volume > 0].sum())

    def _corner_speeds(self, kinds, way, length, accel):
        """Most speed at the end of each move: that at which a corner is rounded by CORNER_MM, and none between G0 and G1."""
        nothing = self.last_way is None
        before = np.concatenate((way[:1] if nothing else self.last_way[None], way[:-1]))
        cosine = np.clip((before * way).sum(axis=1), -1.0, 1.0)
        half = np.sqrt(np.maximum((1.0 + cosine) / 2.0, 0.0))           # sine of half the angle between the two sides
        turn = np.arccos(cosine)
        with np.errstate(divide="ignore", invalid="ignore"):
            begin = np.sqrt(accel * CORNER_MM * half / np.maximum(1.0 - half, 1e-12))
            arc = np.sqrt(accel * length / np.maximum(turn, 1e-12))
        begin = np.where(kinds == records.ARC, np.minimum(np.maximum(begin, arc), arc), begin)
        kinds_before = np.concatenate((kinds[:1] if nothing else [self.last_kind], kinds[:-1]))
        begin[(kinds == records.RAPID) != (kinds_before == records.RAPID)] = 0.0
        self._begin = 0.0 if nothing else float(begin[0])
        self.last_way, self.last_kind = way[-1].copy(), int(kinds[-1])
        return np.concatenate((begin[1:], [np.inf]))

    def _planned(self, length, most, accel, corner, speed):
        """Seconds of each move with acceleration; speed: [mm/s at the beginning], changed to that at the end."""
        seconds, speed[0] = times(length, most, accel, np.minimum(corner, 1e9), min(speed[0], self._begin))
        return seconds

    def _windows(self, length):
        """Index of the window of RATE_WINDOW_MM each move belongs to, from 0."""
        number = np.floor(np.cumsum(length) / RATE_WINDOW_MM)
        return np.concatenate(([0], np.cumsum(np.diff(number) > 0)))

    def _rated(self, length, volume):
        """(mm2: volume per mm of way, mm: length of that way) of each move, over the window it belongs to."""
        window = self._windows(length)
        way = np.bincount(window, length)
        return (np.bincount(window, volume) / way)[window], way[window]

    def _rates(self, length, plain, planned, volume, cutting, block):
        """Peak of the removal rate, and where it is too high for the tool."""
        if self.tool is None or not volume.any():
            return
        area, way = self._rated(length, np.where(cutting, volume, 0.0))
        rate = area * np.where(cutting, np.minimum(plain, length / np.maximum(planned, 1e-12)), 0.0) * 60.0
        # a window shorter than it should be (the end of a block, a single short move) says nothing
        rate[way < RATE_WINDOW_MM / 2] = 0.0
        self.tool.peak_rate = max(self.tool.peak_rate, float(rate.max()))
        limit = self.tool.geometry and self.tool.geometry.max_removal_rate
        if limit and self.mode == OFF:
            met = np.zeros(len(rate), [("at", "<f4")])
            met["at"] = 1.0
            self._find(RATE, rate > RATE_SLACK * limit, rate, limit, block[:, 2:5], block[:, 1].astype(int), met)

    def _volumetric(self, length, volume, plain):
        """mm/s of each move under M251 (docs/Gcodes.md)."""
        target, lower = self.target, self.lower
        limit = self.tool and self.tool.geometry and self.tool.geometry.max_removal_rate
        if limit:
            target, lower = min(target, limit), min(lower, limit)
        area = np.maximum(self._rated(length, volume)[0], 1e-9)
        held, ceiling = target / 60.0 / area, self.ceiling / 60.0 or np.inf
        if self.mode == LIMIT:
            return np.minimum(plain, held)
        if self.mode == CONSTANT:
            return np.minimum(held, ceiling)
        raised = np.minimum(np.maximum(plain, lower / 60.0 / area), np.maximum(ceiling, plain) if self.ceiling else plain)
        return np.minimum(raised, held)

    def finish(self, messages):
        """-> the Result."""
        result = self.result
        if self.map is None:
            raise Unreadable("no stock is defined", "add M250, or name the stock with --stock X0 Y0 Z0 X1 Y1 Z1")
        result.messages = messages
        result.findings.kept.sort(key=lambda finding: finding.at)
        result.load = self.load.rates()
        result.load_volumetric = self.load_volumetric.rates() if self.volumetric else None
        step = max(1, math.ceil(max(self.map.nx, self.map.ny) / PICTURE))
        result.pictures = (self.map.cell * step, self.map.x0, self.map.y0, self.map.z_min, self.before,
                           self.map.picture(PICTURE))
        return result


def check(program, machine, stock=None, cell=None, progress=None, cpu_s=CPU_S, **limits):
    """Result of one program.

    machine: reader.Machine; stock: (low, high) mm in work coordinates or None; cell: mm, default [CHIPWISE]CELL, smaller
    where a tool needs it; progress: called with the number of the line that is being judged.
    """
    try:
        settings = load_settings(machine.ini)
        tools = load_tools(settings.path("TOOL_GEOMETRY"))
        wanted = cell or settings["CELL"]
        while True:
            judge = Judge(program, machine, wanted, settings, tools)
            try:
                return _run(judge, Reader(program, machine, stock, cpu_s=cpu_s, **limits), progress, cpu_s)
            except _TooCoarse as error:
                wanted = _finer(judge, cell, *error.args)
    except Unreadable as error:
        return Result(program, error=(str(error), error.line))
    except CycleError as error:
        return Result(program, error=(error.text().removeprefix("chipwise: "), 0))


def _run(judge, reader, progress, cpu_s):
    """Read and judge to the end."""
    with reader:
        for block in reader:
            judge.take(block)
            if time.process_time() > cpu_s:
                raise Unreadable(f"it is not judged within {cpu_s:g} s of computing time",
                                 "use a larger --cell, or raise --time-limit", int(block[-1, 1]))
            if progress:
                progress(int(block[-1, 1]))
        return judge.finish(reader.messages)


def _finer(judge, asked, line, number, diameter):
    """The cell (mm) that suits a tool; Unreadable where the user has asked for a larger one, or the stock is too large."""
    cell, least = math.floor(diameter / FINE_CELLS * 1000) / 1000, least_cell(judge.map.low, judge.map.high)
    if asked:
        raise Unreadable(f"tool {number} of {diameter:g} mm has less than {LEAST_CELLS} cells of {judge.map.cell:g} mm across",
                         f"use --cell {cell:g}, or leave --cell out", line)
    if cell < least:
        raise Unreadable(f"tool {number} of {diameter:g} mm is too small for a stock of this size: its cells have at least "
                         f"{least:.3g} mm", "check the program in parts, with --stock around each", line)
    return cell
