# SPDX-License-Identifier: GPL-2.0-or-later
"""The C core (components/core/) from Python, through the shared library.

Who calls it: the tests, bench/, bin/chipwise.  The same C files run in realtime inside
stock_tracker and volumetric_feed; nothing is computed twice in another language here.
layout.py, made from the C headers, has the structures and constants; the library confirms them when it is opened.

All lengths mm, machine coordinates; areas mm2, volumes mm3, velocities mm/s.
"""
from __future__ import annotations

import ctypes as C
import math
import os
from pathlib import Path

import numpy as np

from chipwise.errors import LibraryError
from chipwise.stock import layout

FeedIn = layout.FeedIn
FeedOut = layout.FeedOut
FeedEasing = layout.FeedEasing
Watchdog = layout.Watchdog
WatchdogIn = layout.WatchdogIn
Segment = layout.Segment
CELL_DTYPE = np.dtype(layout.Cell)


class CoreError(Exception):
    """The core refused a value; the text says what, value, unit, rule."""


_TOOL_ERRORS = {
    layout.ToolError.DIAMETER: f"diameter must be {layout.MIN_TOOL_DIAMETER:g}..{layout.MAX_TOOL_DIAMETER:g} mm",
    layout.ToolError.CORNER: "corner radius must lie in 0..radius",
    layout.ToolError.ANGLE: f"tip angle must be 0 or {layout.MIN_TIP_ANGLE:g}..180 degrees (180 excluded)",
    layout.ToolError.FLUTE: f"flute length must be 0..{layout.MAX_FLUTE_LENGTH:g} mm"}
_STOCK_ERRORS = {
    layout.StockError.NOT_FINITE: "a corner of the box is not a finite number",
    layout.StockError.EMPTY: "the box's max must be greater than its min in X, Y and Z",
    layout.StockError.TOO_LARGE: "the box needs more cells than the map has"}


def library_path() -> Path:
    """Where the shared library is: $CHIPWISE_CORE, else build/ of this checkout."""
    named = os.environ.get("CHIPWISE_CORE")
    return Path(named) if named else Path(__file__).resolve().parents[3] / "build/libchipwise.so"


class _LayoutEntry(C.Structure):
    """struct chip_layout_entry (layout_table.c)"""

    _fields_ = [("name", C.c_char_p), ("value", C.c_long)]


def _layout_of(lib):
    """The library's table of sizes and offsets; {} for a library without one or of another version."""
    try:
        if lib.chip_core_version() != layout.CORE_VERSION:
            return {}
        entry = C.pointer(_LayoutEntry.in_dll(lib, "chip_layout_table"))
    except (AttributeError, ValueError):
        return {}
    found, n = {}, 0
    while entry[n].name:
        found[entry[n].name.decode()] = entry[n].value
        n += 1
    return found


def _check_layout(lib, path):
    """Raise LibraryError if the library has other structures than layout.py: a call would overwrite memory."""
    expected = {}
    for name, structure in layout.STRUCTURES.items():
        expected[name] = C.sizeof(structure)
        for field in structure._fields_:
            member = getattr(structure, field[0])
            expected[f"{name}.{field[0]}"], expected[f"{name}.{field[0]} size"] = member.offset, member.size
    found = _layout_of(lib)
    for name in sorted(set(expected) | set(found)):
        if expected.get(name) != found.get(name):
            raise LibraryError(f"chipwise: core library {path} is of another version ({name}: {found.get(name)} bytes, "
                               f"expected {expected.get(name)}); run `make build`")


_VEC, _HEAD = C.c_double * 3, C.c_void_p
_SWEEP, _TOOL, _PATH = C.POINTER(layout.Sweep), C.POINTER(layout.Tool), C.POINTER(layout.Path)
_LOOKAHEAD, _SEGMENT, _FEED_IN = C.POINTER(layout.Lookahead), C.POINTER(layout.Segment), C.POINTER(layout.FeedIn)
_MESH, _DROP_TOOL = C.POINTER(layout.DropMesh), C.POINTER(layout.DropTool)
_FUNCTIONS = (      # name, result, arguments
    ("chip_tool_init", C.c_int, [_TOOL] + [C.c_double] * 4), ("chip_tool_height", C.c_double, [_TOOL, C.c_double]),
    ("chip_tool_reach", C.c_double, [_TOOL, C.c_double]), ("chip_stock_cells", C.c_uint32, [C.c_double] * 3),
    ("chip_stock_bytes", C.c_uint64, [C.c_uint32]), ("chip_stock_init", None, [_HEAD, C.c_double, C.c_uint32]),
    ("chip_stock_init_finer", None, [_HEAD, C.c_double, C.c_double, C.c_uint32]),
    ("chip_stock_define", C.c_int, [_HEAD, _VEC, _VEC]),
    ("chip_stock_define_shape", C.c_int, [_HEAD, _VEC, _VEC, C.c_int]),
    ("chip_stock_define_turned", C.c_int, [_HEAD, _VEC, _VEC, C.c_int, C.c_double]),
    ("chip_stock_sound", C.c_int, [_HEAD, C.c_double, C.c_double, C.c_uint32]), ("chip_stock_fill", C.c_int, [_HEAD, C.c_int]),
    ("chip_stock_ready", C.c_int, [_HEAD]), ("chip_stock_volume", C.c_double, [_HEAD]),
    ("chip_stock_above", C.c_double, [_HEAD] + [C.c_double] * 3), ("chip_sweep_start", None, [_SWEEP, _VEC]),
    ("chip_sweep_to", None, [_SWEEP, _VEC]),
    ("chip_sweep_run", C.c_double, [_SWEEP, _HEAD, _TOOL, C.c_long, C.POINTER(C.c_long)]),
    ("chip_section_at", layout.Section, [_HEAD, _TOOL, _VEC, _VEC, C.c_double, C.c_double]),
    ("chip_section_clear", C.c_double, [_HEAD]), ("chip_lookahead_reset", None, [_LOOKAHEAD]),
    ("chip_lookahead_step", None, [_LOOKAHEAD, _PATH, _HEAD, _TOOL, _VEC, _VEC, C.c_double, C.c_double, C.c_int]),
    ("chip_lookahead_profile", None, [_LOOKAHEAD, _PATH, _HEAD, _TOOL, C.c_double, C.POINTER(layout.LoadProfile)]),
    ("chip_segment_line", C.c_int, [_SEGMENT, _VEC, _VEC]),
    ("chip_segment_arc", C.c_int, [_SEGMENT, C.c_double * 2, _VEC, C.c_double, C.c_double]),
    ("chip_path_reset", None, [_PATH]), ("chip_path_follow", None, [_PATH, C.c_long, C.c_double, C.c_double]),
    ("chip_path_mark_read", None, [_PATH]), ("chip_path_append", None, [_PATH, C.c_long, _SEGMENT]),
    ("chip_path_retract", None, [_PATH]), ("chip_path_at", C.c_double, [_PATH, C.c_double, _VEC, _VEC]),
    ("chip_feed", layout.FeedOut, [_FEED_IN, C.c_double]), ("chip_feed_target", C.c_double, [_FEED_IN]),
    ("chip_feed_override", C.c_double, [_FEED_IN, C.c_double]),
    ("chip_feed_ease", layout.FeedOut,
     [C.POINTER(layout.FeedEasing), _FEED_IN, layout.FeedOut, C.c_double, C.c_double]),
    ("chip_watchdog_step", C.c_int, [C.POINTER(layout.Watchdog), C.POINTER(layout.WatchdogIn)]),
    ("chip_height_sweep", C.c_double, [C.POINTER(layout.HeightMap), C.POINTER(layout.HeightTool), _VEC, C.c_void_p,
                                       C.c_long, C.c_void_p]),
    ("chip_height_times", C.c_double, [C.c_long] + [C.c_void_p] * 5 + [C.POINTER(C.c_double), C.c_void_p]),
    ("chip_drop_entries", C.c_int64, [_MESH]), ("chip_drop_fill", None, [_MESH]),
    ("chip_drop_points", None, [_MESH, _DROP_TOOL, C.c_long, C.c_void_p, C.c_void_p]),
    ("chip_traverse_seconds", C.c_double, [C.c_long, C.c_void_p] + [C.c_double] * 3),
    ("chip_traverse_improve", C.c_double, [C.POINTER(layout.Lane), C.c_long, C.c_void_p, C.c_int]),
    ("chip_drop_excess", None, [_MESH, _DROP_TOOL, C.c_long] + [C.c_void_p] * 4),
    ("chip_drop_over_stock", C.c_double, [C.POINTER(layout.HeightMap), _DROP_TOOL, C.c_double * 2, C.c_double * 2, C.c_void_p]),
    ("chip_stock_need", C.c_long, [C.POINTER(layout.HeightMap), _DROP_TOOL, C.c_long] + [C.c_void_p] * 2 + [C.c_double] + [C.c_void_p] * 3),
    ("chip_prove_depths", C.c_long, [C.POINTER(layout.ProofStock), C.c_void_p, C.c_long, C.POINTER(layout.ProofPath), C.c_double,
                                     C.c_void_p, C.c_void_p, C.c_long]),
    ("chip_chain_fit", C.c_long, [C.c_long] + [C.c_void_p] * 7),
    ("chip_png_unfilter", C.c_int, [C.c_void_p, C.c_long, C.c_long, C.c_int]))


def _load():
    path = library_path()
    if not path.exists():
        raise LibraryError(f"chipwise: core library {path} is missing; run `make build` first")
    try:
        lib = C.CDLL(str(path))
    except OSError as error:
        raise LibraryError(f"chipwise: core library {path} cannot be loaded ({error}); run `make build`") from error
    _check_layout(lib, path)
    for name, result, args in _FUNCTIONS:
        function = getattr(lib, name, None)
        if function is None:
            raise LibraryError(f"chipwise: core library {path} is of another version (it has no {name}); run `make build`")
        function.restype, function.argtypes = result, args
    return lib


_lib = None


def library():
    """The loaded shared library (loaded at first use)."""
    global _lib
    if _lib is None:
        _lib = _load()
    return _lib


def _vec(values):
    return (C.c_double * 3)(*[float(v) for v in values])


class Tool:
    """A rotating tool: diameter, corner_radius, flute_length in mm, tip_angle the included
    angle in degrees (0: no cone).  Raises CoreError."""

    def __init__(self, diameter, corner_radius=0.0, tip_angle=0.0, flute_length=0.0):
        self.c = layout.Tool()
        error = library().chip_tool_init(C.byref(self.c), diameter, corner_radius, tip_angle,
                                       flute_length)
        if error:
            raise CoreError(f"tool: {_TOOL_ERRORS[error]} (diameter {diameter} mm, corner "
                            f"{corner_radius} mm, tip {tip_angle} deg, flute {flute_length} mm)")

    @property
    def radius(self):
        return self.c.radius

    def height(self, r):
        """Profile height in mm at distance r mm from the axis."""
        return library().chip_tool_height(C.byref(self.c), r)

    def reach(self, height):
        """Largest distance in mm from the axis at which the profile lies below `height` mm above the tip."""
        return library().chip_tool_reach(C.byref(self.c), height)


class Stock:
    """A stock box `low`..`high` (3 floats each, mm, machine coordinates) with square cells; shape 1: the
    cylinder along Z inscribed in it.  turn (rad): the box is turned about its middle by that.  With room for more cells (`capacity`)
    than it needs, they get smaller, down to `finest` mm."""

    def __init__(self, low, high, cell=0.25, capacity=None, shape=0, turn=0.0, finest=None):
        lib = library()
        wide, deep = (abs(math.cos(turn)), abs(math.sin(turn))) if turn else (1.0, 0.0)
        size = high[0] - low[0], high[1] - low[1]
        cells = capacity or lib.chip_stock_cells(cell, wide * size[0] + deep * size[1], deep * size[0] + wide * size[1])
        if not cells:
            raise CoreError(f"stock: {_STOCK_ERRORS[layout.StockError.EMPTY]} (min {tuple(low)}, max {tuple(high)} mm)")
        self._block = np.zeros(lib.chip_stock_bytes(cells), np.uint8)
        self.address = self._block.ctypes.data
        lib.chip_stock_init_finer(self.address, cell, cell if finest is None else finest, cells)
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

    def section(self, tool, tip, direction, clear=None, curvature=0.0):
        """Section area (mm2) and depth (mm) of `tool` at `tip` moving along the unit vector.

        clear (mm): how far readings keep clear of the cut stock; default: as for a tool
        that has cut up to `tip`; 0: for a position the tool has not come near.  curvature: of the path, rad/mm.
        """
        if clear is None:
            clear = library().chip_section_clear(self.address)
        met = library().chip_section_at(self.address, C.byref(tool.c), _vec(tip), _vec(direction),
                                      clear, curvature)
        return met.area, met.depth


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
        return library().chip_sweep_run(C.byref(self._sweep), self.stock.address,
                                      C.byref(self.tool.c), bound, C.byref(self._work))

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
    done = library().chip_segment_arc(C.byref(segment), (C.c_double * 2)(*map(float, centre)), _vec(start),
                                  angle, rise)
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


class Lookahead:
    """The look-ahead of one tool in one stock (lookahead.h), along its own `path`."""

    def __init__(self, stock, tool):
        self.stock, self.tool, self.path, self.c = stock, tool, ProgrammedPath(), layout.Lookahead()
        library().chip_lookahead_reset(C.byref(self.c))

    def step(self, start, end, period, horizon, budget=1000):
        """The tool went from start to end (mm) in `period` s."""
        library().chip_lookahead_step(C.byref(self.c), C.byref(self.path.c), self.stock.address, C.byref(self.tool.c),
                                      _vec(start), _vec(end), period, horizon, budget)
        library().chip_path_mark_read(C.byref(self.path.c))

    def profile(self, horizon):
        """struct chip_load_profile: area, depth, steps, step[i].distance/.area."""
        profile = layout.LoadProfile()
        library().chip_lookahead_profile(C.byref(self.c), C.byref(self.path.c), self.stock.address, C.byref(self.tool.c),
                                         horizon, C.byref(profile))
        return profile


def feed(values: FeedIn, last_scale: float = 1.0) -> FeedOut:
    """The feed law for one period."""
    return library().chip_feed(C.byref(values), last_scale)


def feed_override(values: FeedIn, scale: float) -> float:
    """The override sent to the machine (feed.h, 8 and 11)."""
    return library().chip_feed_override(C.byref(values), scale)


def ease(easing: FeedEasing, values: FeedIn, law: FeedOut, recover=0.0, deadband=0.0) -> FeedOut:
    """The feed eased (feed.h, 7) for one period."""
    return library().chip_feed_ease(C.byref(easing), C.byref(values), law, recover, deadband)


def follows_override(watchdog: Watchdog, values: WatchdogIn) -> bool:
    """One period of the watchdog (watchdog.h); False once the override is ignored."""
    return not library().chip_watchdog_step(C.byref(watchdog), C.byref(values))
