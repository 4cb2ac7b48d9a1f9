# SPDX-License-Identifier: GPL-2.0-or-later
"""Check whole programs: flute length, traverses through stock, holder, removal rate, times.

Each program is read by LinuxCNC's own interpreter on the machine of an INI file, so subs, loops, work offsets, the tool
table and remapped codes count; it cuts a model of the stock, and every move is checked. The stock is the one of M250 in
the program, else that of --stock. Unknown tools and flutes are reported, never assumed.

Exit status: 0 no findings, 1 findings, 2 a program cannot be checked.
"""

import json
import os
import sys

from chipwise.options.machine import Progress, add_machine_options, ini_of, machine_of, refuser, tool_of
from chipwise.cli.output import check_outputs, write_output
from chipwise.errors import format_length, printable, with_line
from chipwise.host.processes import exit_on_sigterm
from chipwise.rates import MM3_PER_CM3

NAME = "check"
HELP = "check whole programs: flutes, traverses, holder, times"

MAX_PRINTED = 20  # groups of findings of one program; --json has all
MAX_JOBS = 256
TOLERANCES_MM = 0.005, 10.0
SCALES = 1e-4, 1e4
MOST_PLACE = 1e6

refuse = refuser(NAME)


def add_arguments(parser):
    parser.add_argument("programs", nargs="+", metavar="PROGRAM", help="G-code file, or a folder of them")
    parser.add_argument("--json", metavar="FILE", help="all results as JSON (-: standard output)")
    parser.add_argument("--report", metavar="FILE.html", help="all results as one page that needs no network")
    parser.add_argument("--jobs", type=int, metavar="N", help="programs at a time (default: one per processor)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="work the programs on a Dask cluster: tcp://HOST:PORT")
    parser.add_argument(
        "--part", metavar="MODEL", help="model of the part (STL): what is cut into it and what is left on it"
    )
    parser.add_argument(
        "--part-at",
        nargs=3,
        type=float,
        metavar=("X", "Y", "Z"),
        default=(0.0, 0.0, 0.0),
        help="where its origin is: machine units, work coordinates of the first move (default: 0 0 0)",
    )
    parser.add_argument(
        "--part-scale", type=float, metavar="S", help="factor of its lengths; those of an STL file count as mm"
    )
    parser.add_argument(
        "--part-tolerance", type=float, metavar="D", help="what counts, in machine units (default: 0.05 mm)"
    )
    add_tool_options(parser)
    add_machine_options(parser, refuse)


def add_tool_options(parser):
    """--tool, --diameter; setup.py has them too."""
    parser.add_argument(
        "--tool", type=int, metavar="N", help="number of the tool in the spindle of a program that calls none"
    )
    parser.add_argument("--diameter", "--tool-diameter", type=float, metavar="D", help="its diameter, in machine units")


def run(options):
    """-> exit status."""
    from chipwise.check.run import programs_of
    from chipwise.setup.job import confirmed_of

    if options.jobs is not None and not 1 <= options.jobs <= MAX_JOBS:
        refuse(f"--jobs {options.jobs} is not from 1 to {MAX_JOBS}")
    if options.scheduler is not None and options.jobs is not None:
        refuse("--jobs counts processes of this computer; leave it out with --scheduler")
    arguments = machine_of(options, refuse)
    arguments.update(
        assumes=True,
        completes=True,
        confirmed=confirmed_of,
        **tool_of(options.tool, options.diameter, arguments["machine"], refuse),
    )
    if options.ini or os.environ.get("INI_FILE_NAME"):  # the user's own machine
        from chipwise.machine.limits import axis_limits

        arguments["machine"].limits = axis_limits(arguments["machine"].ini)
    if options.part is not None:
        arguments["simulated"] = part_of(options, arguments["machine"])
    programs = programs_of(options.programs)
    if not programs:
        refuse(f"there is no program (.ngc, .nc, .tap) in the folder {' '.join(options.programs)}")
    check_outputs(
        refuse,
        {"--report": options.report, "--json": options.json},
        [*(("one of the programs", program) for program in programs), ("the INI file", ini_of(options))],
    )
    exit_on_sigterm()
    results, progress = [None] * len(programs), Progress(sys.stderr)
    for number, result in results_of(options, programs, progress, arguments):
        results[number] = result
        progress.clear()
        if options.json != "-":
            print("\n".join(report(result)), flush=True)
    progress.end()
    if options.json:
        write(options.json, json_text(results))
    if options.report:
        from chipwise.check.page import page

        write(options.report, page(results))
    return max(result.status for result in results)


def part_of(options, machine):
    """--part and its options -> PartOrder."""
    from chipwise.check.part_simulation import TOLERANCE_MM, PartOrder
    from chipwise.surface.model import Placing

    tolerance = TOLERANCE_MM if options.part_tolerance is None else options.part_tolerance * machine.unit_mm
    if not TOLERANCES_MM[0] <= tolerance <= TOLERANCES_MM[1]:
        refuse(f"--part-tolerance {options.part_tolerance:g} is not from 0.005 to 10 mm")
    scale = 1.0 if options.part_scale is None else options.part_scale
    if not SCALES[0] <= scale <= SCALES[1]:
        refuse(f"--part-scale {scale:g} is not from 0.0001 to 10000")
    if not all(abs(value) < MOST_PLACE for value in options.part_at):
        refuse("--part-at is not three numbers below 1000000")
    shift = tuple(value * machine.unit_mm for value in options.part_at)
    return PartOrder(
        os.path.abspath(options.part), Placing(shift, scale, said=options.part_scale is not None), tolerance
    )


def results_of(options, programs, progress, arguments):
    """Yield (number, Result) of each program as it is ready."""
    from chipwise.check.run import check_all, failed

    if options.scheduler is None:
        yield from check_all(programs, options.jobs or os.cpu_count() or 1, progress, **arguments)
        return
    from chipwise.batch.cluster import ClusterError, on_cluster
    from chipwise.options.machine import UsageError

    try:
        yield from on_cluster(options.scheduler, "check", programs, arguments, failed, progress)
    except ClusterError as error:
        raise UsageError(f"{NAME}: {error}") from None


# ---- what is printed -----------------------------------------------------------------------------------------------


def report(result):
    """Lines of text of one program."""
    from chipwise.check.findings import grouped, grouped_notes

    if result.error:
        text, line = result.error
        yield with_line(printable(f"{result.program}: {text}"), line)
        yield from surveyed(result)
        return
    count = result.findings.count
    yield (
        printable(f"{result.program}: ")
        + (f"{count} finding{'s' * (count != 1)}" if count else "no findings")
        + (", on an assumed stock" if result.stock else ", with an assumed tool" if result.guessed else "")
    )
    for text in grouped_notes(result.notes):
        yield f"  {printable(text)}"
    if result.extents:
        yield "  " + feeds(result)
    for tool in result.tools.values():
        yield "  " + tool_line(tool, result.unit)
    if result.tools:
        yield "  " + apart(result)
    if result.part:
        yield "  " + result.part.said(result.unit)
    groups = grouped(result.findings.kept)
    for group in groups[:MAX_PRINTED]:
        yield "  " + group.text(result.unit) + (assumed(result) if result.is_assumed(group[0]) else "")
    more = result.findings.dropped + sum(map(len, groups[MAX_PRINTED:]))
    if more:
        yield f"  and {more} more; --json has {'all' if not result.findings.dropped else 'the first ones'}"


def assumed(result):
    """What is said of a finding that depends on what is assumed."""
    return " (on the assumed stock)" if result.stock else " (with the assumed tool)"


def feeds(result):
    """Extents of the feed moves."""
    low, high = (
        " ".join(
            f"{axis}{format_length(round(value, 3), result.unit).split()[0]}" for axis, value in zip("XYZ", corner)
        )
        for corner in result.extents
    )
    return f"it feeds from {low} to {high}"


def surveyed(result):
    """Lines of what is known of a program that is not judged."""
    if result.extents:
        yield "  " + feeds(result)
    for tool in result.tools.values():
        size = f", {format_length(tool.diameter, result.unit)}" if tool.diameter else ""
        yield f"  tool {tool.number}{size}: {seconds(tool.planned_s)}"
    if result.tools:
        yield "  " + apart(result)


def apart(result):
    """What the times of the tools do not have."""
    changes = f"{result.tool_changes} tool change{'s' * (result.tool_changes != 1)}, " if result.tool_changes else ""
    dwells = f", dwells ({seconds(result.dwell_s)})" if result.dwell_s else ""
    return f"not in the times: {changes}starts of the spindle, the move to the first place{dwells}"


def tool_line(tool, unit):
    """Figures of one tool."""
    g = tool.geometry
    what = f"tool {tool.number}, {format_length(tool.diameter, unit)} {g.shape if g else '(not described)'}"
    depth = f"deepest {format_length(round(tool.depth, 3), unit)}"
    if g and g.flute_length:
        depth += f" of {format_length(g.flute_length, unit)}"
    time = f"{seconds(tool.planned_s)}"
    if abs(tool.volumetric_planned_s - tool.planned_s) > 0.05:
        time += f", {seconds(tool.volumetric_planned_s)} with M251"
    if tool.peak_chip:
        depth += f", largest chip {format_length(round(tool.peak_chip, 3), unit)}"
    if tool.peak_power:
        depth += f", {tool.peak_power:.3g} W"
    if tool.peak_bending:
        depth += f", bent by {format_length(round(tool.peak_bending, 3), unit)}"
    return (
        f"{what}: {time}, {tool.volume:.0f} mm3, mean {tool.mean_rate / MM3_PER_CM3:.4g} and peak "
        f"{tool.peak_rate / MM3_PER_CM3:.4g} cm3/min at F, {depth}"
    )


def seconds(value):
    """ "75.2 s" or "1:15:02"."""
    if value < 600:
        return f"{value:.1f} s"
    return f"{int(value) // 3600}:{int(value) // 60 % 60:02}:{int(value) % 60:02}"


# ---- files ---------------------------------------------------------------------------------------------------------


def json_text(results):
    """All results, in the order of the programs."""
    return (
        json.dumps(
            {"status": max(r.status for r in results), "programs": [r.json() for r in results]},
            indent=1,
            allow_nan=False,
        )
        + "\n"
    )


def write(path, text):
    """Write a file, whole or not at all; "-": standard output."""
    if path == "-":
        sys.stdout.write(text)
    else:
        write_output(NAME, path, text)
