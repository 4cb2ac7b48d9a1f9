# SPDX-License-Identifier: GPL-2.0-or-later
"""Rewrite a whole program: respect the flute length of its tools (--flute), or feeds for a constant removal rate
(--feed).

--flute shifts the parts of the path for which the flutes are too short up along the tool's axis, and adds passes for
what is left, until the program's own path has been cut. --feed writes F for every move, and divides moves where the
load changes; the path stays the same. The program is read by LinuxCNC's own interpreter on the machine of an INI file;
the new one is read back and compared before it is kept.

Exit status: 0 written, 2 the program cannot be rewritten; nothing is written then.
"""

import math
import os
import sys
from dataclasses import replace

from chipwise.cli import rewrite_folder
from chipwise.options.machine import Progress, add_machine_options, ini_of, machine_of, refuser, tool_of
from chipwise.cli.output import check_outputs
from chipwise.host.processes import exit_on_sigterm

NAME = "rewrite"
HELP = "rewrite a program for its flutes, or for a constant removal rate"

refuse = refuser(NAME)


def add_arguments(parser):
    parser.add_argument("program", metavar="PROGRAM", help="G-code file, or a folder of them")
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT.ngc",
        required=True,
        help="the new program; with a folder the folder of the new ones",
    )
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--flute", action="store_true", help="respect the flute length of every tool")
    what.add_argument("--feed", type=float, metavar="Q", help="removal rate, cm3/min (in3/min on an inch machine)")
    parser.add_argument(
        "--lower",
        type=float,
        metavar="Q2",
        help="with --feed: F stays where the rate lies between Q2 and Q, both in the same unit",
    )
    parser.add_argument(
        "--split", type=float, metavar="MM", help="with --feed: moves are divided to this length (default: 1)"
    )
    parser.add_argument(
        "--ceiling",
        type=float,
        metavar="F",
        help="with --feed: no F is raised above it, machine units/min (default: the axes' velocity)",
    )
    parser.add_argument(
        "--whole", action="store_true", help="with --flute: travel the whole path again, not only where stock is left"
    )
    parser.add_argument(
        "--diameter", type=float, metavar="MM", help="with --flute: of arcs at corners (default: the tool's)"
    )
    parser.add_argument(
        "--tool", type=int, metavar="N", help="number of the tool in the spindle of a program that calls none"
    )
    parser.add_argument("--tool-diameter", type=float, metavar="D", help="its diameter, in machine units")
    parser.add_argument(
        "--jobs", type=int, metavar="N", help="programs of a folder at a time (default: one per processor)"
    )
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="work the programs of a folder on a Dask cluster: tcp://HOST:PORT"
    )
    add_machine_options(parser, refuse)


def run(options):
    """-> exit status."""
    from chipwise.rewrite.batch_job import one

    check_options(options)
    arguments = machine_of(options, refuse)
    machine, cell = arguments["machine"], arguments.pop("cell")
    named = tool_of(options.tool, options.tool_diameter, machine, refuse, "--tool-diameter")
    exit_on_sigterm()
    order = replace(order_of(options, machine), cell=cell, tool=named["tool"], tool_diameter=named["diameter"])
    if os.path.isdir(options.program):
        return rewrite_folder.run(options, {"order": order, **arguments}, refuse)
    progress = Progress(sys.stderr)
    result = one(options.program, progress, {"order": order, **arguments})
    progress.end()
    return rewrite_folder.kept(options.output, result)


def check_options(options):
    """UsageError for what cannot be meant."""
    for name in ("feed", "lower", "split", "ceiling", "diameter"):
        value = getattr(options, name)
        if value is not None and not 0 < value < (
            math.inf if name in ("feed", "lower") else 1e6
        ):  # order_of() has the unit of rates
            refuse(f"--{name} {value:g} is not a number above 0")
    for name in ("lower", "split", "ceiling"):
        if options.flute and getattr(options, name) is not None:
            refuse(f"--{name} goes with --feed")
    if not options.flute and (options.whole or options.diameter is not None):
        refuse(f"--{'whole' if options.whole else 'diameter'} goes with --flute")
    if options.lower is not None and options.feed is not None and options.lower > options.feed:
        refuse(f"--lower {options.lower:g} is above --feed {options.feed:g}")
    if options.split is not None and options.split < 0.05:
        refuse(f"--split {options.split:g} mm is too short; use 0.05 or more")
    rewrite_folder.check_options(options, refuse)
    if not os.path.isdir(options.program):
        check_outputs(
            refuse, {"-o": options.output}, [("the program", options.program), ("the INI file", ini_of(options))]
        )


def order_of(options, machine):
    """The Order; rates in mm3/min."""
    from chipwise.rates import MAX_RATE
    from chipwise.rewrite import feed
    from chipwise.rewrite.run import Order, rate_unit

    if options.flute:
        return Order(whole=options.whole, diameter=options.diameter)
    scale, unit = rate_unit(machine)
    for name in ("feed", "lower"):
        value = getattr(options, name)
        if value is not None and value * scale > MAX_RATE:
            refuse(
                f"--{name} {value:g} {unit} is above {MAX_RATE / scale:.5g} {unit}, which no machine removes; give it "
                f"in {unit}, not in mm3/min"
            )
    return Order(
        feed.Rates(
            options.feed * scale,
            (options.lower or 0.0) * scale,
            options.ceiling and options.ceiling * machine.unit_mm,
            options.split or 1.0,
        )
    )
