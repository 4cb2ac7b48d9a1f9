# SPDX-License-Identifier: GPL-2.0-or-later
"""The judge of a run: removal rate, volume and optimum from the servo-rate log, the blank and the tool alone.

Called by bench/bench_claims.py and tests/oracles/test_judge.py.  How it computes: tests/support/judge.c, which shares
nothing with the product's core and nothing with tests/support/fine_model.c; it knows no cells.

    verdict = judge(Run(log), blank, [Tool(6.0)], target_mm3_s)

Two ways to the same volume are always computed, the section area summed along the path and needles on a grid
turned by TURN; `verdict.own_error` is their difference as a share of the volume.
"""

import ctypes as C
from dataclasses import dataclass

import numpy as np

from support import ROOT

LIBRARY = ROOT / "build" / "tests" / "support" / "judge.so"
TURN = 0.5437  # rad, of the needles' grid against the machine's axes
NEEDLE = 0.11  # mm between needles, and no fewer than 40 over the smallest tool
CHORD = 1e-4  # mm, how far chords may be from the samples
CELL = 0.04  # mm of travel between two section areas; above 6 mm of diameter in proportion
FEEDS = (2, 3)  # motion types of a feed move and an arc
OVER = 1.02
WINDOW_S, SHORT_S = 0.010, 0.001
CUTTING_MM3 = 1e-6  # a window that removes less does not cut
CUTTING_MM2 = 1e-3


@dataclass(frozen=True)
class Tool:
    """Diameter, corner radius (mm), included tip angle (degrees; 0: none)."""

    diameter: float
    corner: float = 0.0
    angle: float = 0.0


def ball(diameter):
    return Tool(diameter, 0.5 * diameter)


@dataclass(frozen=True)
class Blank:
    """A box, or a cylinder along Z, in machine coordinates, mm; `turn` (rad) about its centre."""

    x: float
    y: float
    size_x: float
    size_y: float
    low: float
    high: float
    turn: float = 0.0
    round: bool = False

    @classmethod
    def corners(cls, low, high):
        return cls(
            0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), high[0] - low[0], high[1] - low[1], low[2], high[2]
        )

    @classmethod
    def cylinder(cls, x, y, diameter, low, high):
        return cls(x, y, diameter, diameter, low, high, round=True)

    def packed(self):
        return np.array(
            [
                float(self.round),
                self.x,
                self.y,
                0.5 * self.size_x,
                0.5 * self.size_y,
                np.cos(self.turn),
                np.sin(self.turn),
                self.low,
                self.high,
            ]
        )


class Run:
    """A log: tips (n, 3) mm, tool (n,) number in the list of tools, apart (n,) nothing is swept up to here."""

    def __init__(self, log, tool=None, start=0):
        """`log`: the columns of a servo-rate log; `tool`: which tool is in at every row; `start`: the blank's first
        row."""
        data = {key: log[key] for key in (log.files if hasattr(log, "files") else log)}
        self.period, unit = float(data["period"]), float(data["units_per_mm"])
        offset = data["tool_offset_z"]
        self.tips = np.column_stack([data["x"], data["y"], data["z"] - offset]) / unit
        self.sample = data["sample"]
        count = len(self.sample)
        self.tool = np.zeros(count, dtype=np.int32) if tool is None else np.asarray(tool, dtype=np.int32)
        self.motion, self.line = data["motion_type"], data["line"]
        ticks = np.diff(self.sample, prepend=self.sample[:1] - 1)
        self.lost = int(ticks.sum() - count) + int(data.get("overruns", 0))
        self.took = ticks * self.period
        apart = np.diff(offset, prepend=offset[:1]) != 0.0
        apart |= np.diff(self.tool, prepend=self.tool[:1]) != 0
        apart[: start + 1] = True
        self.apart = apart
        self.feeding = np.isin(self.motion, FEEDS)
        self.columns = data


def library():
    lib = C.CDLL(str(LIBRARY))
    for name in ("judge_areas", "judge_chords", "judge_engagement", "judge_force"):
        getattr(lib, name).restype = C.c_long
    return lib


def pointer(array):
    return array.ctypes.data_as(C.c_void_p)


def chords(tips, apart, tolerance=CHORD):
    """-> (first, last) samples of the chords, path (n,) mm along them."""
    tips = np.ascontiguousarray(tips, dtype=float)
    apart = np.ascontiguousarray(apart, dtype=np.uint8)
    count = len(tips)
    first, last, path = np.zeros(count, np.int64), np.zeros(count, np.int64), np.zeros(count)
    made = library().judge_chords(
        C.c_long(count),
        pointer(tips),
        pointer(apart),
        C.c_double(tolerance),
        pointer(first),
        pointer(last),
        pointer(path),
    )
    return first[:made], last[:made], path


def packed_tools(tools):
    return np.array([[t.diameter, t.corner, t.angle] for t in tools], dtype=float)


def areas(blank, tools, ends, tool_of, cell=CELL):
    """-> (m, 2): path at the end of each cell (mm), section area in it (mm2)."""
    room = int(np.linalg.norm(ends[:, 3:] - ends[:, :3], axis=1).sum() / cell) + 2 * len(ends) + 16
    cells, sizes, box = np.zeros((room, 2)), packed_tools(tools), blank.packed()
    made = library().judge_areas(
        pointer(box),
        C.c_long(len(sizes)),
        pointer(sizes),
        C.c_long(len(ends)),
        pointer(ends),
        pointer(tool_of),
        C.c_double(cell),
        C.c_long(room),
        pointer(cells),
    )
    if made < 0:
        raise RuntimeError("judge: no room for the cells")
    return cells[:made]


def needles(blank, tools, ends, tool_of, spacing, turn=TURN):
    """-> (n,) volume (mm3) gone at the end of each chord."""
    volume, sizes, box = np.zeros(len(ends)), packed_tools(tools), blank.packed()
    if library().judge_needles(
        pointer(box),
        C.c_long(len(sizes)),
        pointer(sizes),
        C.c_long(len(ends)),
        pointer(ends),
        pointer(tool_of),
        C.c_double(spacing),
        C.c_double(turn),
        pointer(volume),
    ):
        raise MemoryError("judge: no memory for the needles")
    return volume


@dataclass
class Swept:
    """What the run removed: path (n,) mm and volume (n,) mm3 at each sample, area (n,) mm2 of the step that ends
    there."""

    path: np.ndarray
    volume: np.ndarray
    area: np.ndarray
    needle_volume: float
    own_error: float  # |area summed - needles| / volume, the worst over the run, as a share of its end


def sweep(run, blank, tools, cell=CELL, spacing=None, turn=TURN, tolerance=CHORD):
    first, last, path = chords(run.tips, run.apart, tolerance)
    ends = np.ascontiguousarray(np.hstack([run.tips[first], run.tips[last]]))
    tool_of = np.ascontiguousarray(run.tool[last], dtype=np.int32)
    found = areas(blank, tools, ends, tool_of, cell)
    steps = np.diff(np.concatenate([[0.0], found[:, 0]]))
    total = np.concatenate([[0.0], np.cumsum(found[:, 1] * steps)])
    volume = np.interp(path, np.concatenate([[0.0], found[:, 0]]), total)
    moved = np.diff(path, prepend=path[:1])
    area = np.where(moved > 1e-9, np.diff(volume, prepend=volume[:1]) / moved.clip(1e-9), 0.0)
    if spacing is None:
        spacing = min(NEEDLE, min(t.diameter for t in tools) / 40.0)
    counted = needles(blank, tools, ends, tool_of, spacing, turn) if len(ends) else np.zeros(1)
    off = (
        np.abs(np.interp(path[last], np.concatenate([[0.0], found[:, 0]]), total) - counted)
        if len(ends)
        else np.zeros(1)
    )
    return Swept(path, volume, area, float(counted[-1]), float(off.max() / max(counted[-1], 1e-9)))


@dataclass
class Verdict:
    peak_10ms: float  # of the target
    peak_1ms: float
    over_share: float  # of the cutting time, above 102 % in 10 ms
    cutting_s: float
    volume: float  # mm3, needles
    rapid_volume: float  # mm3 removed by traverses
    own_error: float
    mean: float  # of the target, over the windows limited by nothing but the stock
    places: list  # [(ratio, ms, line, x, y, z)] worst clusters above 102 %
    worst: tuple  # (ratio, line, x, y, z) of the highest 10 ms


def windows(run, swept, target, span):
    """-> (rows, ratio): windows of `span` periods ending at `rows`, wholly in feed moves with a target, that cut."""
    held = run.feeding & (target > 0) & ~run.apart
    whole = np.concatenate([[0], np.cumsum(held)])
    end = np.arange(span, len(held))
    inside = whole[end + 1] - whole[end + 1 - span] == span
    gone = swept.volume[end] - swept.volume[end - span]
    clock = np.cumsum(run.took)
    rows = end[inside & (gone > CUTTING_MM3)]
    rate = (swept.volume[rows] - swept.volume[rows - span]) / (clock[rows] - clock[rows - span])
    lowest = np.minimum(target[rows], target[rows - span + 1])
    return rows, rate / lowest


def clusters(run, rows, ratio, span, count=6):
    """The places above 102 %, worst first: windows less than 50 ms apart are one place."""
    over = ratio > OVER
    rows, ratio = rows[over], ratio[over]
    if not len(rows):
        return []
    cut = np.flatnonzero(np.diff(rows) > 0.05 / run.period) + 1
    found = []
    for some, level in zip(np.split(rows, cut), np.split(ratio, cut)):
        row = int(some[np.argmax(level)]) - span // 2
        found.append(
            (
                round(float(level.max()), 4),
                round(1000.0 * len(some) * run.period, 1),
                int(run.line[row]),
                *np.round(run.tips[row], 3).tolist(),
            )
        )
    return sorted(found, reverse=True)[:count]


def judge(run, blank, tools, target, swept=None, **options):
    """`target` (n,) or number, mm3/s; 0 where nothing is held.  -> Verdict"""
    swept = swept or sweep(run, blank, tools, **options)
    target = np.broadcast_to(np.asarray(target, dtype=float), run.tool.shape)
    span, short = (max(1, int(round(seconds / run.period))) for seconds in (WINDOW_S, SHORT_S))
    rows, ratio = windows(run, swept, target, span)
    _rows, brief = windows(run, swept, target, short)
    rapid = np.diff(swept.volume, prepend=0.0)[run.motion == 1].sum()
    top = int(np.argmax(ratio)) if len(ratio) else 0
    worst = (
        ()
        if not len(ratio)
        else (float(ratio[top]), int(run.line[rows[top]]), *np.round(run.tips[rows[top] - span // 2], 3).tolist())
    )
    return Verdict(
        float(ratio.max(initial=0.0)),
        float(brief.max(initial=0.0)),
        float((ratio > OVER).mean()) if len(ratio) else 0.0,
        len(rows) * run.period,
        swept.needle_volume,
        float(rapid),
        swept.own_error,
        float(np.median(ratio)) if len(ratio) else 0.0,
        clusters(run, rows, ratio, span),
        worst,
    )
