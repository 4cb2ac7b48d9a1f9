# SPDX-License-Identifier: GPL-2.0-or-later
"""Turn the log of a trace into a height map, a surface and a program, or a height map of a probing program into a
stock.

The log has the pins in-contact, ball-x, ball-y and ball-z of tracer(9), as halsampler writes them. The map is a stock
file that M254 restores; the surface is an STL file that G24 machines; the program follows the model with a ball tool as
large as the stylus. Lengths of the options are mm, the results have the coordinates of the log.

Without --ball the file is a height map of Candle, bCNC or OpenCNCPilot, or points x y z. It becomes a stock file that
M254 restores, shifted by
--offset from work to machine coordinates.

Exit status: 0 done, 1 samples are missing in the log, 2 the log or an option cannot be used.
"""

import json
import math
import os

import numpy as np

from chipwise.options.machine import refuser
from chipwise.cli.output import check_outputs, write_output
from chipwise.digitise import height_map, mesh, probed, program, record
from chipwise.errors import MM_PER_INCH, CycleError, unnamed
from chipwise.stock import store

NAME = "digitise"
HELP = "turn the log of a tracer head, or a probed height map, into a stock, a surface or a program"

refuse = refuser(NAME)
LENGTHS = {
    "ball": (0.01, 100.0),
    "cell": (0.01, 100.0),
    "floor": (-1e5, 1e5),
    "chord": (1e-5, 10.0),
    "allowance": (0.0, 100.0),
    "clearance": (0.0, 1000.0),
    "feed": (0.1, 1e6),
}


def add_arguments(parser):
    parser.add_argument("log", metavar="LOG", help="what halsampler has written, or a height map of a probing program")
    parser.add_argument(
        "-o",
        "--output",
        required=True,
        metavar="FILE",
        help="height map FILE.stock, surface FILE.stl, or program FILE.ngc",
    )
    parser.add_argument(
        "--ball", type=float, metavar="R", help="radius of the stylus' ball; without it LOG is a height map"
    )
    parser.add_argument(
        "--offset",
        type=float,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="machine coordinates of the zero of a height map, mm",
    )
    parser.add_argument("--inch", action="store_true", help="the log or height map is in inch")
    parser.add_argument("--cell", type=float, default=0.25, metavar="MM", help="cell of the map (default: 0.25)")
    parser.add_argument(
        "--floor", type=float, metavar="Z", help="bottom of the map (default: 1 mm below the lowest point)"
    )
    parser.add_argument(
        "--chord", type=float, default=0.005, metavar="MM", help="chord error of the program (default: 0.005)"
    )
    parser.add_argument(
        "--allowance",
        type=float,
        default=0.0,
        metavar="MM",
        help="raises the program, for roughing, or the stock of a height map (default: 0)",
    )
    parser.add_argument(
        "--clearance", type=float, default=5.0, metavar="MM", help="of the program above the model (default: 5)"
    )
    parser.add_argument("--feed", type=float, default=500.0, metavar="F", help="of the program, mm/min (default: 500)")
    parser.add_argument("--json", metavar="FILE", help="the figures, for programs")
    parser.error = refuse


def _check(options):
    for name, (low, high) in LENGTHS.items():
        value = getattr(options, name)
        if value is not None and not (math.isfinite(value) and low <= value <= high):
            refuse(f"--{name} {value:g} is not from {low:g} to {high:g}")
    if not options.output.endswith(tuple(KINDS)):
        refuse(f"{options.output} is not FILE.stock, FILE.stl or FILE.ngc")
    if options.ball is None:
        _check_height_map(options)
    elif options.offset is not None:
        refuse("--offset is for a height map: the log of a trace has machine coordinates")
    check_outputs(refuse, {"-o": options.output, "--json": options.json}, [("the log", options.log)])


def _check_height_map(options):
    if options.output.endswith((".stl", ".ngc")):
        refuse(f"{options.output} is made of the log of a tracer: give --ball, or -o FILE.stock for a height map")
    if options.offset is None:
        refuse(
            "the place of a height map in the machine is not known; give --offset X Y Z, the machine coordinates of "
            "its zero in mm "
            "(the work offset it was probed with), or --ball for the log of a tracer"
        )
    if not all(math.isfinite(value) and abs(value) <= 1e5 for value in options.offset):
        refuse(f"--offset {' '.join(f'{value:g}' for value in options.offset)} is not from -100000 to 100000")


def _stock_of_height_map(options):
    """-> figures"""
    points = probed.read(options.log, options.inch)
    model = probed.cells_of(points, options.offset, options.cell)
    return {
        **_stock(height_map.HeightMap(model.heights + options.allowance, model.x0, model.y0, model.cell), options),
        "points": points.height.size,
    }


def _write_map(found, options):
    """-> figures"""
    return _stock(height_map.envelope(found.centres, options.ball, options.cell), options)


def _stock(model, options):
    """Write a HeightMap as a stock file; -> figures"""
    floor = options.floor if options.floor is not None else math.floor(float(np.nanmin(model.heights))) - 1.0
    head, cells = height_map.as_stock(model, floor)
    store.write(options.output, head, cells)
    untouched = int(np.isnan(model.heights).sum())
    print(
        f"{options.output}: {head.nx} x {head.ny} cells of {head.cell:g} mm, Z {np.nanmin(model.heights):.3f} to "
        f"{np.nanmax(model.heights):.3f} mm, {untouched} cells not touched"
    )
    return {"cells": [head.nx, head.ny], "cell": head.cell, "low": head.low, "high": head.high, "untouched": untouched}


def _write_surface(found, options):
    """-> figures"""
    model = height_map.envelope(found.centres, options.ball, options.cell)
    corners = mesh.triangles(model)
    write_output(NAME, options.output, mesh.stl(corners))
    untouched = int(np.isnan(model.heights).sum())
    print(
        f"{options.output}: {len(corners)} triangles, Z {corners[..., 2].min():.3f} to {corners[..., 2].max():.3f} mm, "
        f"{untouched} cells not touched"
    )
    return {"triangles": len(corners), "cell": options.cell, "untouched": untouched}


def _write_program(found, options):
    """-> figures"""
    paths = program.lines(found.centres, found.start, options.chord)
    if not paths:
        raise CycleError("the log has no two neighbouring rows in contact", "record while tracer.N.state is 2")
    text = program.program(
        paths, options.ball, options.allowance, options.clearance, options.feed, os.path.basename(options.output)
    )
    write_output(NAME, options.output, text)
    points = sum(map(len, paths))
    print(f"{options.output}: {len(paths)} lines, {points} of {len(found.centres)} points")
    return {"lines": len(paths), "points": points}


KINDS = {".stock": _write_map, ".stl": _write_surface, ".ngc": _write_program}


def run(options):
    """-> exit status."""
    _check(options)
    found = None
    try:
        if options.ball is None:
            figures = _stock_of_height_map(options)
        else:
            found = record.read(options.log, 1.0 / MM_PER_INCH if options.inch else 1.0)
            figures = KINDS[os.path.splitext(options.output)[1]](found, options)
    except CycleError as error:
        refuse(unnamed(error))
    except store.StoreError as error:
        refuse(str(error))
    except OSError as error:
        refuse(f"{options.log}: {error.strerror}")
    if found and found.overruns:
        print(f"{options.log}: samples are missing in {found.overruns} places; use a larger depth= of sampler")
    if options.json:
        more = {"rows": found.rows, "overruns": found.overruns} if found else {}
        write_output(NAME, options.json, json.dumps({**figures, **more}, indent=1) + "\n")
    return 1 if found and found.overruns else 0
