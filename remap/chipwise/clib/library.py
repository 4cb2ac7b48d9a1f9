# SPDX-License-Identifier: GPL-2.0-or-later
"""The shared library with the C core (components/core/, components/offline/): where it is, its functions, how it is
opened.

Who calls it: core.py, and whoever needs no more than a function of the library.  The library confirms the structures of
layout.py when it is opened.
"""

from __future__ import annotations

import ctypes as C
import os
from pathlib import Path

from chipwise import version
from chipwise.errors import LibraryError
from chipwise.host.fit import remedy
from chipwise.clib import layout


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


def _check_version(lib, path):
    """Raise LibraryError if the library is of another chipwise: it may compute otherwise."""
    try:
        found = C.string_at(C.addressof(C.c_char.in_dll(lib, "chip_version"))).decode("ascii", "replace")
    except ValueError:
        return  # older than the stamp; _check_layout finds what differs
    if found != version():
        raise LibraryError(
            f"chipwise: core library {path} is of chipwise {found}, and the programs are {version()}; {remedy()}"
        )


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
            raise LibraryError(
                f"chipwise: core library {path} is of another version ({name}: {found.get(name)} bytes, "
                f"expected {expected.get(name)}); run `make build`"
            )


_VEC, _HEAD = C.c_double * 3, C.c_void_p
_SWEEP, _TOOL, _PATH = C.POINTER(layout.Sweep), C.POINTER(layout.Tool), C.POINTER(layout.Path)
_LOOKAHEAD, _SEGMENT, _FEED_IN = C.POINTER(layout.Lookahead), C.POINTER(layout.Segment), C.POINTER(layout.FeedIn)
_CLAMPS = C.POINTER(layout.Clamps)
_MESH, _DROP_TOOL = C.POINTER(layout.DropMesh), C.POINTER(layout.DropTool)
_FUNCTIONS = (  # name, result, arguments
    ("chip_tooth_set", C.c_int, [C.c_void_p] * 2),
    ("chip_tooth_follow", None, [C.c_void_p, C.c_void_p]),
    ("chip_tooth_law", layout.ToothOut, [C.c_void_p]),
    ("chip_tool_init", C.c_int, [_TOOL] + [C.c_double] * 4),
    ("chip_tool_height", C.c_double, [_TOOL, C.c_double]),
    ("chip_tool_reach", C.c_double, [_TOOL, C.c_double]),
    ("chip_stock_cells", C.c_uint32, [C.c_double] * 3),
    ("chip_stock_bytes", C.c_uint64, [C.c_uint32]),
    ("chip_stock_init", None, [_HEAD, C.c_double, C.c_uint32]),
    ("chip_stock_init_finer", None, [_HEAD, C.c_double, C.c_double, C.c_uint32]),
    ("chip_stock_define", C.c_int, [_HEAD, _VEC, _VEC]),
    ("chip_stock_define_shape", C.c_int, [_HEAD, _VEC, _VEC, C.c_int]),
    ("chip_stock_define_turned", C.c_int, [_HEAD, _VEC, _VEC, C.c_int, C.c_double]),
    ("chip_stock_sound", C.c_int, [_HEAD, C.c_double, C.c_double, C.c_uint32]),
    ("chip_stock_fill", C.c_int, [_HEAD, C.c_int]),
    ("chip_stock_ready", C.c_int, [_HEAD]),
    ("chip_stock_volume", C.c_double, [_HEAD]),
    ("chip_stock_above", C.c_double, [_HEAD] + [C.c_double] * 3),
    ("chip_sweep_start", None, [_SWEEP, _VEC]),
    ("chip_sweep_to", None, [_SWEEP, _VEC]),
    ("chip_sweep_run", C.c_double, [_SWEEP, _HEAD, _TOOL, C.c_long, C.POINTER(C.c_long)]),
    ("chip_section_at", layout.Section, [_HEAD, _TOOL, _VEC, _VEC, C.c_double, C.c_double]),
    ("chip_lookahead_reset", None, [_LOOKAHEAD]),
    ("chip_lookahead_step", None, [_LOOKAHEAD, _PATH, _HEAD, _TOOL, _VEC, _VEC, C.c_double, C.c_double, C.c_int]),
    ("chip_lookahead_profile", None, [_LOOKAHEAD, _PATH, _HEAD, _TOOL, C.c_double, C.POINTER(layout.LoadProfile)]),
    ("chip_segment_line", C.c_int, [_SEGMENT, _VEC, _VEC]),
    ("chip_segment_arc", C.c_int, [_SEGMENT, C.c_double * 2, _VEC, C.c_double, C.c_double]),
    ("chip_path_reset", None, [_PATH]),
    ("chip_path_follow", None, [_PATH, C.c_long, C.c_double, C.c_double]),
    ("chip_path_mark_read", None, [_PATH]),
    ("chip_path_append", None, [_PATH, C.c_long, _SEGMENT]),
    ("chip_path_done_step", None, [C.POINTER(layout.PathThinner), C.POINTER(layout.PathDone), _VEC]),
    ("chip_clamps_take", C.c_int, [_CLAMPS, C.c_void_p]),
    ("chip_clamps_begin", None, [_CLAMPS]),
    ("chip_clamps_build", None, [_CLAMPS, _TOOL, C.c_double, C.c_double]),
    ("chip_clamps_check", C.c_int, [_CLAMPS, C.POINTER(layout.ClampIn)]),
    ("chip_clamp_distance", C.c_double, [C.POINTER(layout.Clamp), C.POINTER(layout.ClampBody), _VEC]),
    ("chip_path_retract", None, [_PATH]),
    ("chip_path_descent", C.c_double, [_PATH, C.POINTER(C.c_double)]),
    ("chip_path_pace", layout.Pace, [_PATH, C.POINTER(layout.PaceIn)]),
    ("chip_path_at", C.c_double, [_PATH, C.c_double, _VEC, _VEC]),
    ("chip_feed", layout.FeedOut, [_FEED_IN, C.c_double]),
    ("chip_feed_target", C.c_double, [_FEED_IN]),
    ("chip_feed_override", C.c_double, [_FEED_IN, C.c_double]),
    (
        "chip_feed_ease",
        layout.FeedOut,
        [C.POINTER(layout.FeedEasing), _FEED_IN, layout.FeedOut, C.c_double, C.c_double],
    ),
    ("chip_watchdog_step", C.c_int, [C.POINTER(layout.Watchdog), C.POINTER(layout.WatchdogIn)]),
    ("chip_feed_hold_step", layout.FeedOut, [C.POINTER(layout.FeedHold), _FEED_IN, C.c_int, layout.FeedOut]),
    ("chip_run_sums_step", None, [C.POINTER(layout.RunSums), _FEED_IN, C.c_int, C.c_double]),
    ("chip_run_mean", C.c_double, [C.POINTER(layout.RunTotals)]),
    ("chip_load_watch_step", C.c_int, [C.POINTER(layout.LoadWatch), C.POINTER(layout.LoadWatchIn)]),
    (
        "chip_height_sweep",
        C.c_double,
        [C.POINTER(layout.HeightMap), C.POINTER(layout.HeightTool), _VEC, C.c_void_p, C.c_long, C.c_void_p, C.c_void_p],
    ),
    (
        "chip_traverse_clearance",
        C.c_double,
        [C.POINTER(layout.HeightMap), C.POINTER(layout.HeightTool), C.c_double, _VEC, _VEC],
    ),
    ("chip_height_times", C.c_double, [C.c_long] + [C.c_void_p] * 5 + [C.POINTER(C.c_double), C.c_void_p]),
    ("chip_drop_entries", C.c_int64, [_MESH]),
    ("chip_drop_fill", None, [_MESH]),
    ("chip_drop_points", None, [_MESH, _DROP_TOOL, C.c_long, C.c_void_p, C.c_void_p]),
    ("chip_traverse_seconds", C.c_double, [C.c_long, C.c_void_p] + [C.c_double] * 3),
    ("chip_traverse_improve", C.c_double, [C.POINTER(layout.Lane), C.c_long, C.c_void_p, C.c_int]),
    ("chip_drop_excess", None, [_MESH, _DROP_TOOL, C.c_long] + [C.c_void_p] * 4),
    (
        "chip_drop_over_stock",
        C.c_double,
        [C.POINTER(layout.HeightMap), _DROP_TOOL, C.c_double * 2, C.c_double * 2, C.c_void_p, C.c_double],
    ),
    (
        "chip_stock_need",
        C.c_long,
        [C.POINTER(layout.HeightMap), _DROP_TOOL, C.c_long] + [C.c_void_p] * 2 + [C.c_double] + [C.c_void_p] * 3,
    ),
    (
        "chip_prove_depths",
        C.c_long,
        [
            C.POINTER(layout.ProofStock),
            C.c_void_p,
            C.c_long,
            C.POINTER(layout.ProofPath),
            C.c_double,
            C.c_void_p,
            C.c_void_p,
            C.c_long,
        ],
    ),
    ("chip_proof_open", C.c_void_p, [C.POINTER(layout.ProofStock), C.c_void_p, C.c_long, C.c_double]),
    ("chip_proof_close", None, [C.c_void_p]),
    ("chip_proof_add", C.c_long, [C.c_void_p, C.POINTER(layout.ProofPath), C.c_void_p, C.c_void_p, C.c_long]),
    ("chip_proof_expect", C.c_int, [C.c_void_p, C.POINTER(layout.ProofPath)]),
    ("chip_proof_mark", C.c_int, [C.c_void_p]),
    ("chip_proof_back", None, [C.c_void_p]),
    ("chip_chain_fit", C.c_long, [C.c_long] + [C.c_void_p] * 7),
    ("chip_nearest_gaps", None, [C.POINTER(layout.ElementTree), C.c_long] + [C.c_void_p] * 3),
    ("chip_engage_open", C.c_void_p, [C.c_long, C.c_void_p, C.c_void_p, C.c_double, C.c_double]),
    ("chip_engage_close", None, [C.c_void_p]),
    ("chip_engage_failed", C.c_int, [C.c_void_p]),
    ("chip_engage_depth", None, [C.c_void_p, C.c_long, C.c_void_p, C.c_void_p]),
    ("chip_engage_inside", C.c_int, [C.c_void_p, C.c_long, C.c_void_p, C.c_double, C.c_double]),
    ("chip_engage_patches", C.c_long, [C.c_long] * 2 + [C.c_void_p] * 3),
    ("chip_engage_clear", None, [C.c_void_p, C.c_long, C.c_void_p]),
    ("chip_engage_rim", None, [C.c_void_p, C.c_long, C.c_void_p, C.c_double, C.c_void_p]),
    ("chip_engage_swept", C.c_int, [C.c_void_p, C.c_long, C.c_void_p, C.c_double, C.c_double]),
    ("chip_engage_left", C.c_double, [C.c_void_p, C.c_double, C.c_double * 2]),
    ("chip_engage_along", C.c_long, [C.c_void_p, C.c_long, C.c_void_p, C.c_double, C.c_void_p, C.c_long]),
    ("chip_engage_at", None, [C.c_void_p, C.c_long, C.c_void_p, C.c_void_p]),
    (
        "chip_engage_trace",
        C.c_long,
        [C.c_void_p, _VEC, C.POINTER(layout.EngageRule), C.c_int, C.c_void_p, C.c_long, C.POINTER(C.c_int)],
    ),
    ("chip_engage_fit", C.c_long, [C.c_long, C.c_void_p, C.c_double, C.c_void_p]),
    ("chip_raster_route", C.c_long, [C.POINTER(layout.Raster), C.c_long, C.c_long, C.c_void_p]),
    ("chip_disc_roll", None, [C.c_long, C.c_void_p, C.c_void_p, C.c_double, C.c_double, C.c_void_p]),
    ("chip_work_trial", C.c_double, [C.c_int] * 2),
    ("chip_png_unfilter", C.c_int, [C.c_void_p, C.c_long, C.c_long, C.c_int]),
)


def _load():
    path = library_path()
    if not path.exists():
        raise LibraryError(f"chipwise: core library {path} is missing; run `make build` first")
    try:
        lib = C.CDLL(str(path))
    except OSError as error:
        raise LibraryError(f"chipwise: core library {path} cannot be loaded ({error}); run `make build`") from error
    _check_layout(lib, path)
    _check_version(lib, path)
    for name, result, args in _FUNCTIONS:
        function = getattr(lib, name, None)
        if function is None:
            raise LibraryError(
                f"chipwise: core library {path} is of another version (it has no {name}); run `make build`"
            )
        function.restype, function.argtypes = result, args
    return lib


_lib = None


def library():
    """The loaded shared library (loaded at first use)."""
    global _lib
    if _lib is None:
        _lib = _load()
    return _lib
