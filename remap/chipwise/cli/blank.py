# SPDX-License-Identifier: GPL-2.0-or-later
"""Make the stock of a casting or a sawn bar from touched points.

FILE has the points: the log of probe_grid.ngc, lines x y z, a PROBEOPEN log, or a height map of Candle, bCNC or
OpenCNCPilot. OUT is a stock file, or with a machine the number of a slot, 0 to 9, that M254 restores. --stock is the
blank as M250 would get it, in the coordinates of the points; points lower it where they are, as far as the steepest
slope found allows. What is not probed stays as high as it, with the allowance. Lengths are mm.

Exit status: 0 done, 2 the points or an option cannot be used, or the result could not be written; OUT is then as it
was.
"""

import json
import math
import os

from chipwise.cli.output import check_outputs, write_output
from chipwise.errors import MM_PER_INCH, CycleError, printable, unnamed
from chipwise.options.machine import refuser
from chipwise.options.slots import check_name, path_of, settings_of
from chipwise.stock import reasons

NAME = "blank"
HELP = "make the stock of a casting or sawn bar from touched points"
LENGTHS = {"error": (0.0, 10.0), "allowance": (0.0, 100.0), "cell": (0.01, 10.0), "rotation": (-360.0, 360.0)}
FARTHEST = 1e5  # mm

refuse = refuser(NAME)


def add_arguments(parser):
    parser.add_argument("file", metavar="FILE", help="touched points, or a height map")
    parser.add_argument("-o", "--output", required=True, metavar="OUT", help="FILE.stock, or a slot for M254")
    parser.add_argument(
        "--stock",
        required=True,
        nargs=6,
        type=float,
        metavar=("X0", "Y0", "Z0", "X1", "Y1", "Z1"),
        help="corners of the blank, in the coordinates of the points",
    )
    parser.add_argument(
        "--round",
        action="store_true",
        help="the blank is the cylinder along Z in these corners: outside of the circle there is no stock",
    )
    parser.add_argument(
        "--error", type=float, default=0.01, metavar="MM", help="how far a touched point may be off (default: 0.01)"
    )
    parser.add_argument(
        "--allowance",
        type=float,
        metavar="MM",
        help="how much larger the blank may be, at its sides and top (default: [CHIPWISE]ALLOWANCE with a machine, "
        "else 0)",
    )
    parser.add_argument(
        "--offset",
        nargs=3,
        type=float,
        metavar=("X", "Y", "Z"),
        help="machine coordinates of the zero of the points; the log of probe_grid.ngc has it",
    )
    parser.add_argument("--rotation", type=float, metavar="DEG", help="of the work offset (G10 L2 R), with --offset")
    parser.add_argument(
        "--inch", action="store_true", help="the points are in inch; the log of probe_grid.ngc says it itself"
    )
    parser.add_argument(
        "--cell", type=float, metavar="MM", help="cell of the stock (default: [CHIPWISE]CELL with a machine, else 0.25)"
    )
    parser.add_argument("--ini", metavar="INI", help="the machine whose slots are meant (default: INI_FILE_NAME)")
    parser.add_argument("--json", metavar="FILE", help="the figures, for programs (-: standard output)")
    parser.error = refuse


def run(options):
    """-> exit status."""
    check(options)
    try:
        settings = settings_of(options.ini, (options.output,), refuse)
        target = path_of(options.output, settings)
        check_outputs(refuse, {"-o": target, "--json": options.json}, [("the file of the points", options.file)])
        found = made(options, settings)
        figures = write(found, target)
    except CycleError as error:
        refuse(unnamed(error))
    except OSError as error:
        refuse(f"{error.filename}: {error.strerror}")
    if options.json != "-":
        print(printable("\n".join(lines_of(figures))))
    if options.json:
        write_output(NAME, options.json, json.dumps(figures, indent=1) + "\n")
    return 0


def check(options):
    """Refuse what needs no file."""
    for name, (low, high) in LENGTHS.items():
        value = getattr(options, name)
        if value is not None and not (math.isfinite(value) and low <= value <= high):
            refuse(f"--{name} {value:g} is not from {low:g} to {high:g}")
    for name in ("stock", "offset"):
        values = getattr(options, name) or []
        if not all(math.isfinite(value) and abs(value) <= FARTHEST for value in values):
            refuse(f"--{name} {' '.join(f'{value:g}' for value in values)} is not from {-FARTHEST:g} to {FARTHEST:g}")
    check_name(options.output, refuse)


def made(options, settings):
    """-> blank.stock.Probed.  Raises CycleError, OSError."""
    from chipwise.blank import points, stock

    machine_mm = None
    if settings:
        from chipwise.program.reader import Machine, Unreadable

        try:
            machine_mm = Machine(options.ini or os.environ["INI_FILE_NAME"]).unit_mm
        except Unreadable as error:
            refuse(str(error).partition("; see")[0])
    touched = points.read(options.file, MM_PER_INCH if options.inch else None, machine_mm)
    place = place_of(options, touched)
    allowance = options.allowance if options.allowance is not None else settings["ALLOWANCE"] if settings else 0.0
    cell = options.cell or (settings["CELL"] if settings else 0.25)
    typed = stock.Typed(options.stock[:3], options.stock[3:], allowance, options.round)
    return stock.made(touched.points, typed, place, cell, options.error)


def place_of(options, touched):
    """Where the zero of the points is."""
    from chipwise.blank.points import Place

    if touched.place is not None:
        if options.offset is not None or options.rotation is not None or options.inch:
            refuse(f"{options.file} says its unit and where its zero is; leave --offset, --rotation and --inch out")
        return touched.place
    if options.offset is None:
        refuse(
            "where the zero of the points is in the machine is not known; give --offset X Y Z, the machine coordinates "
            "of their zero in mm"
        )
    return Place(tuple(options.offset), rotation=options.rotation or 0.0)


def write(found, target):
    """Stock and doubt; -> figures."""
    from chipwise.blank import doubt
    from chipwise.stock import store

    figures = {
        "output": target,
        "points": found.points,
        "spacing_mm": found.spacing,
        "steepest": found.steepest,
        "min": found.head.low,
        "max": found.head.high,
        "cell": found.head.cell,
        "cells": [found.head.nx, found.head.ny],
        "probed": found.probed,
        "doubt_mm": found.doubt,
        "most_doubt_mm": found.most_doubt,
        "volume_mm3": found.volume,
        "above_share": found.above_share,
        "spacing_needed_mm": found.spacing_needed,
    }
    try:
        store.write(target, found.head, found.cells)
    except store.StoreError as error:
        refuse(f"{error}; {reasons.REASONS[error.reply][1]}")
    doubt.write(target, figures)
    return figures


def lines_of(figures):
    """For the terminal."""
    from chipwise.blank import doubt

    low, high = (
        " ".join(f"{axis}{value:.3f}" for axis, value in zip("XYZ", figures[corner])) for corner in ("min", "max")
    )
    yield (
        f"{figures['output']}: {figures['points']} points {figures['spacing_mm']:.2f} mm apart, steepest slope "
        f"{figures['steepest']:.3f}; {low} to {high} mm machine"
    )
    yield f"the stock is a probed blank: {doubt.sentence(figures)}"
    if figures["probed"]:
        yield f"the volume of what is probed is at most {figures['above_share']:.1%} above that of the part"
    if figures["spacing_needed_mm"]:
        yield f"for at most 3 %, probe about every {figures['spacing_needed_mm']:.1f} mm"
