# SPDX-License-Identifier: GPL-2.0-or-later
"""Turn the stock of side one over: the stock of side two.

FILE is a stock file (M253, KEEP_STOCK), or with a machine the number of a slot, 0 to 9. The result is another stock
file, or slot, that M254 restores. What side one has cut through is missing from it; every other cut of side one is an
undercut now and counts as stock, because a height map cannot hold it. Lengths are mm, machine coordinates of the tool's
tip.

Exit status: 0 done, 2 the file or an option cannot be used, or the result could not be written; the file of side one
stays as it is.
"""

import json
import math

from chipwise.cli.output import check_outputs, write_output
from chipwise.errors import CycleError, printable, unnamed
from chipwise.options.machine import refuser
from chipwise.options.slots import check_name, path_of, settings_of
from chipwise.stock import reasons

NAME = "turn-over"
HELP = "turn the stock of side one over, for side two"
FARTHEST = 1e5  # mm
MOST_ALLOWANCE = 100.0  # mm

refuse = refuser(NAME)


def add_arguments(parser):
    parser.add_argument("file", metavar="FILE", help="stock of side one: a file, or a slot of M253")
    parser.add_argument(
        "-o", "--output", required=True, metavar="OUT", help="stock of side two: FILE.stock, or a slot for M254"
    )
    parser.add_argument(
        "--about",
        required=True,
        choices=("X", "Y"),
        type=str.upper,
        help="axis of the machine that the part was turned about",
    )
    parser.add_argument(
        "--corner",
        type=float,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="the touched corner as the part lies now: its smallest X and Y, its top",
    )
    parser.add_argument(
        "--allowance",
        type=float,
        metavar="MM",
        help="of the M250 of side one (default: [CHIPWISE]ALLOWANCE with a machine, else 0)",
    )
    parser.add_argument("--ini", metavar="INI", help="the machine whose slots are meant (default: INI_FILE_NAME)")
    parser.add_argument("--json", metavar="FILE", help="the figures, for programs (-: standard output)")
    parser.error = refuse


def run(options):
    """-> exit status."""
    check(options)
    try:
        settings = settings_of(options.ini, (options.file, options.output), refuse)
        source, target = (path_of(name, settings) for name in (options.file, options.output))
        if options.allowance is None:
            options.allowance = settings["ALLOWANCE"] if settings else 0.0
        check_outputs(refuse, {"-o": target, "--json": options.json}, [("the stock of side one", source)])
        figures = turned(options, source, target)
    except CycleError as error:
        refuse(unnamed(error))
    except OSError as error:
        refuse(f"{error.filename}: {error.strerror}")
    if options.json != "-":
        print(printable(text_of(figures)))
    if options.json:
        write_output(NAME, options.json, json.dumps(figures, indent=1) + "\n")
    return 0


def check(options):
    """Refuse what needs no file."""
    if options.corner is None:
        refuse(
            "where the part lies now is not known; touch a corner and give --corner X Y Z: its smallest X and Y, and "
            "its top, machine coordinates"
        )
    if not all(math.isfinite(value) and abs(value) <= FARTHEST for value in options.corner):
        refuse(
            f"--corner {' '.join(f'{value:g}' for value in options.corner)} is not from {-FARTHEST:g} to {FARTHEST:g}"
        )
    if options.allowance is not None and not 0 <= options.allowance <= MOST_ALLOWANCE:
        refuse(f"--allowance {options.allowance:g} is not from 0 to {MOST_ALLOWANCE:g}")
    check_name(options.output, refuse)


def turned(options, source, target):
    """Write the turned stock; -> figures."""
    from chipwise.stock import store, turn_over

    try:
        before = store.read(source)
    except store.StoreError as error:
        unreadable = error.reply == store.DISK
        refuse(f"{error}; {'name a stock file that can be read' if unreadable else reasons.REASONS[error.reply][1]}")
    try:
        head, cells = turn_over.turned_over(*before, options.about, tuple(options.corner), options.allowance)
        store.write(target, head, cells)
    except store.StoreError as error:
        refuse(f"{error}; {reasons.REASONS[error.reply][1]}")
    inner = cells[1:-1, 1:-1]
    through = int((inner["top"] <= inner["top"].dtype.type(head.low[2])).sum())
    return {
        "output": target,
        "about": options.about,
        "min": head.low,
        "max": head.high,
        "cell": head.cell,
        "cells": [head.nx, head.ny],
        "cut_through_mm2": through * head.cell**2,
    }


def text_of(figures):
    low, high = (
        " ".join(f"{axis}{value:.3f}" for axis, value in zip("XYZ", figures[corner])) for corner in ("min", "max")
    )
    return (
        f"{figures['output']}: {low} to {high} mm machine, {figures['cut_through_mm2']:.0f} mm2 of it cut through or "
        f"outside of the blank; "
        "pockets of side one count as stock"
    )
