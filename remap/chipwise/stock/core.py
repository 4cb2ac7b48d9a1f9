"""The C core (components/core/) from Python, through the shared library.

Who calls it: the tests, bench/, bin/chipwise.  The same C files run in realtime inside
stock_tracker and volumetric_feed; nothing is computed twice in another language here.

All lengths mm, machine coordinates; areas mm2, volumes mm3, velocities mm/s.
"""
from __future__ import annotations

import ctypes as C
import math
import os
from pathlib import Path

import numpy as np

SAMPLES, LEVELS, QUEUE, RINGS, TRAIL, PIECES = 192, 8, 16, 12, 32, 160
CELL_DTYPE = np.dtype([("top", "<f4"), ("drop", "<u2"), ("cut", "<u2")])


class CoreError(Exception):
    """The core refused a value; the text says what, value, unit, rule."""


class _Ring(C.Structure):
    _fields_ = [(n, C.c_double) for n in ("radius", "height", "rise", "run", "inner", "outer")] \
        + [("straight", C.c_int)]


class _Tool(C.Structure):
    _fields_ = [(n, C.c_double) for n in ("radius", "corner", "slope", "flute", "r_flat",
                                          "r_arc", "arc_top", "shoulder")] \
        + [("rings", C.c_int), ("ring", _Ring * RINGS)]


class _Head(C.Structure):
    """struct cw_stock without its cells (stock.h)."""
    _fields_ = [("magic", C.c_uint32), ("version", C.c_uint32), ("generation", C.c_uint32),
                ("capacity", C.c_uint32)] \
        + [(n, C.c_double) for n in ("cell", "x0", "y0", "z_min", "z_max", "x_max", "y_max",
                                     "drop_unit")] \
        + [("nx", C.c_int32), ("ny", C.c_int32), ("filled", C.c_int32), ("shape", C.c_int32),
           ("removed", C.c_double), ("half_x", C.c_double), ("half_y", C.c_double), ("turn", C.c_double)]


class _Sweep(C.Structure):
    _fields_ = [("at", C.c_double * 3), ("queue", C.c_double * 3 * QUEUE), ("waiting", C.c_int),
                ("known", C.c_int), ("trail", C.c_int), ("row", C.c_int), ("row_end", C.c_int),
                ("column", C.c_int), ("run", C.c_double * 2), ("straight", C.c_double), ("stray", C.c_double)]


class _Section(C.Structure):
    _fields_ = [("area", C.c_double), ("depth", C.c_double), ("nodes", C.c_int)]


class Piece(C.Structure):
    """struct cw_piece (way.h): a line, arc or helix; mm, rad, rad/mm."""
    _fields_ = [("origin", C.c_double * 3)] \
        + [("aim", C.c_double * 2)] + [(n, C.c_double) for n in ("level", "slope", "curvature", "length",
                                     "accel")] \
        + [("rapid", C.c_int), ("join", C.c_int)]


class _Corner(C.Structure):
    """struct cw_corner (way.h)."""
    _fields_ = [("on", C.c_int), ("start", C.c_double * 3), ("dir", C.c_double * 3)] \
        + [(n, C.c_double) for n in ("length", "done", "speed", "top", "left", "slow")]


class _Way(C.Structure):
    _fields_ = [("known", C.c_int), ("fresh", C.c_int), ("at", C.c_double), ("begin", C.c_double),
                ("key", C.c_long * PIECES), ("piece", Piece * PIECES), ("first", C.c_int),
                ("count", C.c_int), ("end", C.c_double), ("changed", C.c_double), ("corner", _Corner)]


class _Course(C.Structure):
    _fields_ = [("known", C.c_int), ("piece", Piece)] \
        + [(n, C.c_double) for n in ("travelled", "speed", "last_heading", "last_step", "last_turn",
                                     "last_slope")] \
        + [("place", C.c_double * 2 * TRAIL), ("newest", C.c_int), ("places", C.c_int)]


class _Ahead(C.Structure):
    _fields_ = [("way", _Way), ("course", _Course), ("on_way", C.c_int)] \
        + [(n, C.c_double) for n in ("at", "lead", "build_up", "gaining", "gap", "step", "origin", "held")] \
        + [(n, C.c_int) for n in ("first", "count", "stale")] + [("s", C.c_double * SAMPLES)] \
        + [(n, C.c_float * SAMPLES) for n in ("area", "most", "depth", "smear", "turn")] + [("bend", C.c_double * SAMPLES)] \
        + [(n, C.c_ubyte * SAMPLES) for n in ("corner", "near")]


class _Level(C.Structure):
    _fields_ = [(n, C.c_double) for n in ("distance", "area", "accel")]


class _View(C.Structure):
    _fields_ = [("area", C.c_double), ("depth", C.c_double),
                ("levels", C.c_int), ("level", _Level * LEVELS)]


class FeedIn(C.Structure):
    """struct cw_feed_in (feed.h): target, lower mm3/s; velocities mm/s; areas mm2."""
    _fields_ = [("kind", C.c_int), ("target", C.c_double), ("lower", C.c_double),
                ("programmed", C.c_double), ("requested", C.c_double), ("motion", C.c_int),
                ("accel", C.c_double), ("floor", C.c_double), ("dt", C.c_double),
                ("trusted", C.c_int), ("area", C.c_double),
                ("next_distance", C.c_double * LEVELS), ("next_area", C.c_double * LEVELS),
                ("next_accel", C.c_double * LEVELS)] \
        + [(n, C.c_double) for n in ("tool_target", "most", "floor_share", "most_share", "air",
                                     "plunge", "upward", "chip", "teeth", "turns", "tool_width",
                                     "stock_height", "knob", "jerk", "speed", "gain")]


class FeedOut(C.Structure):
    """struct cw_feed_out (feed.h)."""
    _fields_ = [("scale", C.c_double), ("by", C.c_int)]


class FeedEasing(C.Structure):
    """struct cw_feed_easing (feed.h): what the easing remembers between periods."""
    _fields_ = [("ramp", C.c_double), ("held", C.c_double), ("begun", C.c_int)]


class ObeyIn(C.Structure):
    """struct cw_obey_in (obey.h)."""
    _fields_ = [("kind", C.c_int), ("motion", C.c_int)] \
        + [(n, C.c_double) for n in ("programmed", "requested", "scale", "actual", "accel",
                                     "most_override", "dt", "jerk")] \
        + [("index", C.c_int), ("told", C.c_int)]


class Obey(C.Structure):
    """struct cw_obey (obey.h)."""
    _fields_ = [("explained", C.c_double), ("at_rest", C.c_double), ("above", C.c_int), ("faster", C.c_double),
                ("synchronised", C.c_int), ("disobeyed", C.c_int)]


_TOOL_ERRORS = {1: "diameter must be a number > 0 mm", 2: "corner radius must lie in 0..radius",
                3: "tip angle must lie in 0..180 degrees (180 excluded)",
                4: "flute length must be a number >= 0 mm"}
_STOCK_ERRORS = {1: "a corner of the box is not a finite number",
                 2: "the box's max must be greater than its min in X, Y and Z",
                 3: "the box needs more cells than the map has"}


def library_path() -> Path:
    """Where the shared library is: $CHIPWISE_CORE, else build/ of this checkout."""
    named = os.environ.get("CHIPWISE_CORE")
    return Path(named) if named else Path(__file__).resolve().parents[3] / "build/libchipwise.so"


def _load():
    path = library_path()
    if not path.exists():
        raise CoreError(f"chipwise: core library {path} is missing; run `make build` first")
    lib = C.CDLL(str(path))
    vec, head = C.c_double * 3, C.c_void_p
    for name, result, args in (
            ("cw_tool_init", C.c_int, [C.POINTER(_Tool)] + [C.c_double] * 4),
            ("cw_tool_height", C.c_double, [C.POINTER(_Tool), C.c_double]),
            ("cw_tool_reach", C.c_double, [C.POINTER(_Tool), C.c_double]),
            ("cw_stock_cells", C.c_uint32, [C.c_double] * 3),
            ("cw_stock_bytes", C.c_uint64, [C.c_uint32]),
            ("cw_stock_init", None, [head, C.c_double, C.c_uint32]),
            ("cw_stock_define", C.c_int, [head, vec, vec]),
            ("cw_stock_define_shape", C.c_int, [head, vec, vec, C.c_int]),
            ("cw_stock_define_turned", C.c_int, [head, vec, vec, C.c_int, C.c_double]),
            ("cw_stock_sound", C.c_int, [head, C.c_double, C.c_uint32]),
            ("cw_stock_fill", C.c_int, [head, C.c_int]),
            ("cw_stock_ready", C.c_int, [head]),
            ("cw_stock_volume", C.c_double, [head]),
            ("cw_stock_above", C.c_double, [head] + [C.c_double] * 3),
            ("cw_sweep_place", None, [C.POINTER(_Sweep), vec]),
            ("cw_sweep_to", None, [C.POINTER(_Sweep), vec]),
            ("cw_sweep_run", C.c_double,
             [C.POINTER(_Sweep), head, C.POINTER(_Tool), C.c_long, C.POINTER(C.c_long)]),
            ("cw_section_at", _Section, [head, C.POINTER(_Tool), vec, vec, C.c_double, C.c_double]),
            ("cw_section_clear", C.c_double, [head]),
            ("cw_ahead_reset", None, [C.POINTER(_Ahead)]),
            ("cw_ahead_step", None, [C.POINTER(_Ahead), head, C.POINTER(_Tool), vec, vec,
                                     C.c_double, C.c_double, C.c_int]),
            ("cw_ahead_look", None, [C.POINTER(_Ahead), head, C.POINTER(_Tool), C.c_double,
                                     C.POINTER(_View)]),
            ("cw_piece_line", C.c_int, [C.POINTER(Piece), vec, vec]),
            ("cw_piece_arc", C.c_int, [C.POINTER(Piece), C.c_double * 2, vec, C.c_double, C.c_double]),
            ("cw_way_reset", None, [C.POINTER(_Way)]),
            ("cw_way_follow", None, [C.POINTER(_Way), C.c_long, C.c_double, C.c_double]),
            ("cw_way_append", None, [C.POINTER(_Way), C.c_long, C.POINTER(Piece)]),
            ("cw_way_retract", None, [C.POINTER(_Way)]),
            ("cw_way_at", C.c_double, [C.POINTER(_Way), C.c_double, vec, vec]),
            ("cw_feed", FeedOut, [C.POINTER(FeedIn), C.c_double]),
            ("cw_feed_target", C.c_double, [C.POINTER(FeedIn)]),
            ("cw_feed_override", C.c_double, [C.POINTER(FeedIn), C.c_double]),
            ("cw_feed_ease", FeedOut, [C.POINTER(FeedEasing), C.POINTER(FeedIn), FeedOut,
                                       C.c_double, C.c_double]),
            ("cw_obey_step", C.c_int, [C.POINTER(Obey), C.POINTER(ObeyIn)])):
        function = getattr(lib, name)
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
        self.c = _Tool()
        error = library().cw_tool_init(C.byref(self.c), diameter, corner_radius, tip_angle,
                                       flute_length)
        if error:
            raise CoreError(f"tool: {_TOOL_ERRORS[error]} (diameter {diameter} mm, corner "
                            f"{corner_radius} mm, tip {tip_angle} deg, flute {flute_length} mm)")

    @property
    def radius(self):
        return self.c.radius

    def height(self, r):
        """Profile height in mm at distance r mm from the axis."""
        return library().cw_tool_height(C.byref(self.c), r)

    def reach(self, height):
        """Largest distance in mm from the axis at which the profile lies below `height` mm above the tip."""
        return library().cw_tool_reach(C.byref(self.c), height)


class Stock:
    """A stock box `low`..`high` (3 floats each, mm, machine coordinates) with square cells; shape 1: the
    cylinder along Z inscribed in it.  turn (rad): the box is turned about its middle by that."""

    def __init__(self, low, high, cell=0.25, capacity=None, shape=0, turn=0.0):
        lib = library()
        wide, deep = (abs(math.cos(turn)), abs(math.sin(turn))) if turn else (1.0, 0.0)
        size = high[0] - low[0], high[1] - low[1]
        cells = capacity or lib.cw_stock_cells(cell, wide * size[0] + deep * size[1], deep * size[0] + wide * size[1])
        if not cells:
            raise CoreError(f"stock: {_STOCK_ERRORS[2]} (min {tuple(low)}, max {tuple(high)} mm)")
        self._block = np.zeros(lib.cw_stock_bytes(cells), np.uint8)
        self.address = self._block.ctypes.data
        lib.cw_stock_init(self.address, cell, cells)
        self.define(low, high, shape, turn)

    def define(self, low, high, shape=0, turn=0.0):
        """Starts over with a new box; raises CoreError and keeps the old stock if it does not fit."""
        error = library().cw_stock_define_turned(self.address, _vec(low), _vec(high), shape, turn)
        if error:
            raise CoreError(f"stock: {_STOCK_ERRORS[error]} (min {tuple(low)}, max {tuple(high)} mm)")
        while not library().cw_stock_fill(self.address, 1 << 30):
            pass

    @property
    def head(self):
        return _Head.from_address(self.address)

    @property
    def cells(self):
        """(ny, nx) view of the cells, dtype CELL_DTYPE, without the empty ring."""
        head = self.head
        start = C.sizeof(_Head)
        count = (head.ny + 2) * (head.nx + 2)
        grid = self._block[start:start + 8 * count].view(CELL_DTYPE)
        return grid.reshape(head.ny + 2, head.nx + 2)[1:-1, 1:-1]

    def volume(self):
        """Volume left, mm3."""
        return library().cw_stock_volume(self.address)

    def above(self, x, y, floor):
        """Interpolated height of the stock above `floor` at a point, mm."""
        return library().cw_stock_above(self.address, x, y, floor)

    def section(self, tool, tip, direction, clear=None, curvature=0.0):
        """Section area (mm2) and depth (mm) of `tool` at `tip` moving along the unit vector.

        clear (mm): how far readings keep clear of what the tool has cut; default: as for a tool
        that has cut up to `tip`; 0: for a place the tool has not come near.  curvature: of the way, rad/mm.
        """
        if clear is None:
            clear = library().cw_section_clear(self.address)
        met = library().cw_section_at(self.address, C.byref(tool.c), _vec(tip), _vec(direction),
                                      clear, curvature)
        return met.area, met.depth


class Cutter:
    """A tool on its way through a stock; `work` counts what it took, in cells of a flat end (sweep.h, 2)."""

    def __init__(self, stock, tool, tip):
        self.stock, self.tool, self._sweep, self._work = stock, tool, _Sweep(), C.c_long(0)
        library().cw_sweep_place(C.byref(self._sweep), _vec(tip))

    @property
    def work(self):
        return self._work.value

    def to(self, tip, bound=(1 << 30)):
        """Cuts the straight way to `tip` (mm); returns the volume removed, mm3."""
        library().cw_sweep_to(C.byref(self._sweep), _vec(tip))
        return self.run(bound)

    def run(self, bound=(1 << 30)):
        """Goes on with waiting legs until the work reaches `bound`; returns mm3."""
        return library().cw_sweep_run(C.byref(self._sweep), self.stock.address,
                                      C.byref(self.tool.c), bound, C.byref(self._work))

    @property
    def waiting(self):
        return self._sweep.waiting


def line(start, end):
    """Piece of way from start to end (mm); None where it has no length."""
    piece = Piece()
    return piece if library().cw_piece_line(C.byref(piece), _vec(start), _vec(end)) else None


def arc(centre, start, angle, rise=0.0):
    """Piece of way about centre (x, y) from start, angle rad (counter-clockwise positive), rising
    by `rise` mm; None where it has no length."""
    piece = Piece()
    done = library().cw_piece_arc(C.byref(piece), (C.c_double * 2)(*map(float, centre)), _vec(start),
                                  angle, rise)
    return piece if done else None


class Way:
    """A chain of pieces (way.h).  struct: the chain of an Ahead, else one of its own."""

    def __init__(self, struct=None):
        self.c = _Way() if struct is None else struct
        library().cw_way_reset(C.byref(self.c))

    def follow(self, key, length, progress):
        library().cw_way_follow(C.byref(self.c), key, length, progress)

    def append(self, key, piece):
        library().cw_way_append(C.byref(self.c), key, C.byref(piece))

    def retract(self):
        library().cw_way_retract(C.byref(self.c))

    def at(self, s):
        """(tip, direction, curvature) at the place s mm."""
        tip, direction = (C.c_double * 3)(), (C.c_double * 3)()
        bend = library().cw_way_at(C.byref(self.c), s, tip, direction)
        return tuple(tip), tuple(direction), bend


class Ahead:
    """The look-ahead of one tool in one stock (ahead.h)."""

    def __init__(self, stock, tool):
        self.stock, self.tool, self.c = stock, tool, _Ahead()
        library().cw_ahead_reset(C.byref(self.c))

    def step(self, start, end, period, horizon, budget=1000):
        library().cw_ahead_step(C.byref(self.c), self.stock.address, C.byref(self.tool.c),
                                _vec(start), _vec(end), period, horizon, budget)

    def look(self, horizon):
        """struct cw_ahead_view: area, depth, levels, level[i].distance/.area."""
        view = _View()
        library().cw_ahead_look(C.byref(self.c), self.stock.address, C.byref(self.tool.c),
                                horizon, C.byref(view))
        return view


def feed(values: FeedIn, last_scale: float = 1.0) -> FeedOut:
    """The feed law for one period."""
    return library().cw_feed(C.byref(values), last_scale)


def feed_override(values: FeedIn, scale: float) -> float:
    """What the machine is given (feed.h, 8 and 9)."""
    return library().cw_feed_override(C.byref(values), scale)


def ease(easing: FeedEasing, values: FeedIn, law: FeedOut, recover=0.0, deadband=0.0) -> FeedOut:
    """The feed eased (feed.h, 7) for one period."""
    return library().cw_feed_ease(C.byref(easing), C.byref(values), law, recover, deadband)


def obeys(watch: Obey, values: ObeyIn) -> bool:
    """One period of the watch over the override (obey.h); False once it is disobeyed."""
    return not library().cw_obey_step(C.byref(watch), C.byref(values))
