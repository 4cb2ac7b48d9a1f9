# SPDX-License-Identifier: GPL-2.0-or-later
"""The C core (components/core/) from Python, through the shared library that library.py opens.

Who calls it: the tests, bench/, bin/chipwise.  The same C files run in realtime inside
stock_tracker and volumetric_feed; nothing is computed twice in another language here.
layout.py, made from the C headers, has the structures and constants.

All lengths mm, machine coordinates; areas mm2, volumes mm3, velocities mm/s.
"""

from __future__ import annotations

import ctypes as C
import math
from typing import NamedTuple

import numpy as np

from chipwise.clib import layout
from chipwise.clib.library import library

FeedIn = layout.FeedIn
FeedOut = layout.FeedOut
FeedEasing = layout.FeedEasing
FeedHold = layout.FeedHold
LoadWatch = layout.LoadWatch
LoadWatchIn = layout.LoadWatchIn
RunSums = layout.RunSums
Watchdog = layout.Watchdog
WatchdogIn = layout.WatchdogIn
Segment = layout.Segment
CELL_DTYPE = np.dtype(layout.Cell)


class CoreError(Exception):
    """The core refused a value; the text says what, value, unit, rule."""


UNCUT = math.inf  # mm in front of the tool: nothing has been cut near (Stock.section)

_TOOL_ERRORS = {
    layout.ToolError.DIAMETER: f"diameter must be {layout.MIN_TOOL_DIAMETER:g}..{layout.MAX_TOOL_DIAMETER:g} mm",
    layout.ToolError.CORNER: "corner radius must lie in 0..radius",
    layout.ToolError.ANGLE: f"tip angle must be 0 or {layout.MIN_TIP_ANGLE:g}..180 degrees (180 excluded)",
    layout.ToolError.FLUTE: f"flute length must be 0..{layout.MAX_FLUTE_LENGTH:g} mm",
}
_STOCK_ERRORS = {
    layout.StockError.NOT_FINITE: "a corner of the box is not a finite number",
    layout.StockError.EMPTY: "the box's max must be greater than its min in X, Y and Z",
    layout.StockError.TOO_LARGE: "the box needs more cells than the map has",
}


def _vec(values):
    return (C.c_double * 3)(*[float(v) for v in values])


class Tool:
    """A rotating tool: diameter, corner_radius, flute_length in mm, tip_angle the included
    angle in degrees (0: no cone).  Raises CoreError."""

    def __init__(self, diameter, corner_radius=0.0, tip_angle=0.0, flute_length=0.0):
        self.c, self.tooth = layout.Tool(), layout.Tooth()
        error = library().chip_tool_init(C.byref(self.c), diameter, corner_radius, tip_angle, flute_length)
        if error:
            raise CoreError(
                f"tool: {_TOOL_ERRORS[error]} (diameter {diameter} mm, corner "
                f"{corner_radius} mm, tip {tip_angle} deg, flute {flute_length} mm)"
            )

    def limit(self, chip_weight=1.0, power_weight=1.0, exponent=0.25, force_weight=0.0, edges=3):
        """Limits of its edges (core/tooth.h), so that Stock.tooth() and Stock.side_force() have something to say: 1/mm,
        Kienzle's exponent."""
        library().chip_tooth_set(
            C.byref(self.tooth), C.byref(layout.ToothWeights(chip_weight, power_weight, force_weight, exponent, edges))
        )
        self.c.tooth = C.addressof(self.tooth)
        return self

    @property
    def radius(self):
        return self.c.radius

    def height(self, r):
        """Profile height in mm at distance r mm from the axis."""
        return library().chip_tool_height(C.byref(self.c), r)

    def reach(self, height):
        """Largest distance in mm from the axis at which the profile lies below `height` mm above the tip."""
        return library().chip_tool_reach(C.byref(self.c), height)


class CellSides(NamedTuple):
    """mm: between which the side of a stock's cells is, by the room for them."""

    coarsest: float
    finest: float


class Stock:
    """A stock box `low`..`high` (3 floats each, mm, machine coordinates) with square cells; shape 1: the
    cylinder along Z inscribed in it.  turn (rad): the box is turned about its middle by that.  cell: their side in mm,
    or CellSides: with room for more cells (`capacity`) than the coarsest ones need, they get smaller."""

    def __init__(self, low, high, cell=0.25, capacity=None, shape=0, turn=0.0):
        lib = library()
        cell, finest = cell if isinstance(cell, CellSides) else (cell, cell)
        wide, deep = (abs(math.cos(turn)), abs(math.sin(turn))) if turn else (1.0, 0.0)
        size = high[0] - low[0], high[1] - low[1]
        cells = capacity or lib.chip_stock_cells(cell, wide * size[0] + deep * size[1], deep * size[0] + wide * size[1])
        if not cells:
            raise CoreError(f"stock: {_STOCK_ERRORS[layout.StockError.EMPTY]} (min {tuple(low)}, max {tuple(high)} mm)")
        self._block = np.zeros(lib.chip_stock_bytes(cells), np.uint8)
        self.address = self._block.ctypes.data
        lib.chip_stock_init_finer(self.address, cell, finest, cells)
        self.define(low, high, shape, turn)

    def define(self, low, high, shape=0, turn=0.0):
        """Starts over with a new box; raises CoreError and keeps the old stock if it does not fit."""
        error = library().chip_stock_define_turned(self.address, _vec(low), _vec(high), shape, turn)
        if error:
            raise CoreError(f"stock: {_STOCK_ERRORS[error]} (min {tuple(low)}, max {tuple(high)} mm)")
        while not library().chip_stock_fill(self.address, 1 << 30):
            pass

    @property
    def head(self):
        return layout.Stock.from_address(self.address)

    @property
    def cells_and_ring(self):
        """(ny + 2, nx + 2) view of the cells, dtype CELL_DTYPE, the empty ring around them included."""
        head = self.head
        count = (head.ny + 2) * (head.nx + 2)
        return np.frombuffer(self._block, CELL_DTYPE, count, C.sizeof(layout.Stock)).reshape(head.ny + 2, head.nx + 2)

    @property
    def cells(self):
        """(ny, nx) view of the cells, without the ring."""
        return self.cells_and_ring[1:-1, 1:-1]

    def volume(self):
        """Volume left, mm3."""
        return library().chip_stock_volume(self.address)

    def above(self, x, y, floor):
        """Interpolated height of the stock above `floor` at a point, mm."""
        return library().chip_stock_above(self.address, x, y, floor)

    def section(self, tool, tip, direction, in_front=0.0, curvature=0.0):
        """Section area (mm2) and depth (mm) of `tool` at `tip` moving along the unit vector.

        in_front (mm): how far in front of the tool `tip` is; default: a tool that has cut up to there; UNCUT: a
        position no cut has come near.  curvature: of the path, rad/mm.
        """
        met = self._section(tool, tip, direction, in_front, curvature)
        return met.area, met.depth

    def tooth(self, tool, tip, direction, in_front=0.0, curvature=0.0):
        """Largest chip over the feed per tooth, and A_mc (mm2), of a tool with limits; otherwise as section()."""
        met = self._section(tool, tip, direction, in_front, curvature)
        return met.chip, met.power_area

    def side_force(self, tool, tip, direction, in_front=0.0, curvature=0.0):
        """Side force of a tool with limits, mm (core/tooth.h, 9): the largest vector sum of its edges over a turn, and
        the mean."""
        met = self._section(tool, tip, direction, in_front, curvature)
        return met.side_force, met.mean_force

    def _section(self, tool, tip, direction, in_front, curvature):
        return library().chip_section_at(self.address, C.byref(tool.c), _vec(tip), _vec(direction), in_front, curvature)


class Cutter:
    """A tool cutting through a stock; `work` counts its work, in cells of a flat end (sweep.h, 2)."""

    def __init__(self, stock, tool, tip):
        self.stock, self.tool, self._sweep, self._work = stock, tool, layout.Sweep(), C.c_long(0)
        library().chip_sweep_start(C.byref(self._sweep), _vec(tip))

    @property
    def work(self):
        return self._work.value

    def to(self, tip, bound=(1 << 30)):
        """Cuts the straight segment to `tip` (mm); returns the volume removed, mm3."""
        library().chip_sweep_to(C.byref(self._sweep), _vec(tip))
        return self.run(bound)

    def run(self, bound=(1 << 30)):
        """Continues with waiting segments until the work reaches `bound`; returns mm3."""
        return library().chip_sweep_run(
            C.byref(self._sweep), self.stock.address, C.byref(self.tool.c), bound, C.byref(self._work)
        )

    @property
    def waiting(self):
        return self._sweep.waiting


def line(start, end):
    """Straight segment from start to end (mm); None where it has no length."""
    segment = Segment()
    return segment if library().chip_segment_line(C.byref(segment), _vec(start), _vec(end)) else None


def arc(centre, start, angle, rise=0.0):
    """Arc or helix about centre (x, y) from start, angle rad (counter-clockwise positive), rising
    by `rise` mm; None where it has no length."""
    segment = Segment()
    done = library().chip_segment_arc(C.byref(segment), (C.c_double * 2)(*map(float, centre)), _vec(start), angle, rise)
    return segment if done else None


class ProgrammedPath:
    """A programmed path (path.h): a chain of segments."""

    def __init__(self):
        self.c = layout.Path()
        library().chip_path_reset(C.byref(self.c))

    def follow(self, key, length, progress):
        """The tool is `progress` mm into the segment `key` of `length` mm."""
        library().chip_path_follow(C.byref(self.c), key, length, progress)

    def append(self, key, segment):
        """A segment at the far end."""
        library().chip_path_append(C.byref(self.c), key, C.byref(segment))

    def retract(self):
        """Removes the last segment."""
        library().chip_path_retract(C.byref(self.c))

    def at(self, s):
        """(tip, direction, curvature) at s mm."""
        tip, direction = (C.c_double * 3)(), (C.c_double * 3)()
        curvature = library().chip_path_at(C.byref(self.c), s, tip, direction)
        return tuple(tip), tuple(direction), curvature

    def descent(self):
        """(mm until a feed goes down, negative: none in sight; mean braking until there, mm/s2, 0: unknown)."""
        accel = C.c_double()
        return library().chip_path_descent(C.byref(self.c), C.byref(accel)), accel.value

    def pace(self, clear_z=0.5, ceiling=2.0, late=0.0, override=1.0, horizon=0.0):
        """struct chip_pace: where feeds above the stock have to be slower (path_pace.h)."""
        asked = layout.PaceIn(clear_z, ceiling, late, override, horizon)
        return library().chip_path_pace(C.byref(self.c), C.byref(asked))


class Lookahead:
    """The look-ahead of one tool in one stock (lookahead.h), along its own `path`."""

    def __init__(self, stock, tool):
        self.stock, self.tool, self.path, self.c = stock, tool, ProgrammedPath(), layout.Lookahead()
        library().chip_lookahead_reset(C.byref(self.c))

    def limit(self, chip_weight, power_weight, exponent, force_weight=0.0, edges=3):
        """Limits of the tool's edges from now on (tooth.h): 1/mm, 1/mm, Kienzle's exponent, 1/mm, their number."""
        self.tool.c.tooth = C.addressof(self.tool.tooth)
        weights = layout.ToothWeights(chip_weight, power_weight, force_weight, exponent, edges)
        if library().chip_tooth_set(C.byref(self.tool.tooth), C.byref(weights)) == layout.ToothChange.BEGUN:
            library().chip_lookahead_reset(C.byref(self.c))
        library().chip_tooth_follow(C.byref(self.c), C.byref(self.tool.tooth))

    def step(self, start, end, period, horizon, budget=1000):
        """The tool went from start to end (mm) in `period` s."""
        library().chip_lookahead_step(
            C.byref(self.c),
            C.byref(self.path.c),
            self.stock.address,
            C.byref(self.tool.c),
            _vec(start),
            _vec(end),
            period,
            horizon,
            budget,
        )
        library().chip_path_mark_read(C.byref(self.path.c))

    def profile(self, horizon):
        """struct chip_load_profile: area, depth, steps, step[i].distance/.area."""
        profile = layout.LoadProfile()
        library().chip_lookahead_profile(
            C.byref(self.c), C.byref(self.path.c), self.stock.address, C.byref(self.tool.c), horizon, C.byref(profile)
        )
        return profile


def feed(values: FeedIn, last_scale: float = 1.0) -> FeedOut:
    """The feed law for one period."""
    return library().chip_feed(C.byref(values), last_scale)


def tooth_law(values: FeedIn) -> layout.ToothOut:
    """The weights of the limits of a tooth, and what is cut now (tooth_law.h)."""
    return library().chip_tooth_law(C.byref(values))


def feed_override(values: FeedIn, scale: float) -> float:
    """The override sent to the machine (feed.h, 8 and 11)."""
    return library().chip_feed_override(C.byref(values), scale)


def ease(easing: FeedEasing, values: FeedIn, law: FeedOut, recover=0.0, deadband=0.0) -> FeedOut:
    """The feed eased (feed.h, 7) for one period."""
    return library().chip_feed_ease(C.byref(easing), C.byref(values), law, recover, deadband)


def hold_feed(hold: FeedHold, values: FeedIn, is_lost: bool, law: FeedOut) -> FeedOut:
    """One period of the feed while the load may be lost (feed_hold.h)."""
    return library().chip_feed_hold_step(C.byref(hold), C.byref(values), is_lost, law)


def load_is_lost(watch: LoadWatch, values: LoadWatchIn) -> bool:
    """One period of the watch over the load (load_watch.h)."""
    return bool(library().chip_load_watch_step(C.byref(watch), C.byref(values)))


def add_period(sums: RunSums, values: FeedIn, is_running: bool, removed: float) -> None:
    """One period of the sums of a program (run_sums.h); removed: by the map, mm3."""
    library().chip_run_sums_step(C.byref(sums), C.byref(values), is_running, removed)


def run_mean(sums: RunSums) -> float:
    """Mean removal rate of the program, mm3/s (run_sums.h)."""
    return library().chip_run_mean(C.byref(sums.program))


def follows_override(watchdog: Watchdog, values: WatchdogIn) -> bool:
    """One period of the watchdog (watchdog.h); False once the override is ignored."""
    return not library().chip_watchdog_step(C.byref(watchdog), C.byref(values))
