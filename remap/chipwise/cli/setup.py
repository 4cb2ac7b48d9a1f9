# SPDX-License-Identifier: GPL-2.0-or-later
"""Set up a program as it is: its stock, what its tools cut, and a proposal for their feeds; confirmed, it becomes the
program's job file.

The stock is the one of M250 in the program, else that of --stock, else the one that the comments of the CAM system or
the path make likely.  The proposal of a tool: hold the largest mean rate over 1 s of its cuts at F, up to 2 times the F
of a move. Moves down keep their F, and so do tools that only go down. No line of the program changes.

Exit status: 0 done, 2 the program cannot be set up, or the job file cannot be written.
"""

import json
import sys

from chipwise.options.machine import UsageError
from chipwise.cli.check import add_tool_options, surveyed
from chipwise.options.machine import Progress, add_machine_options, ini_of, machine_of, refuser, tool_of
from chipwise.cli.output import check_outputs, write_output
from chipwise.errors import CycleError, format_length, format_minutes, format_place, printable, unnamed, with_line
from chipwise.host.processes import exit_on_sigterm
from chipwise.rates import MM3_PER_CM3

NAME = "setup"
HELP = "set up a program: stock, tools, a proposal for the feed"
SOURCES = {
    "program": "a stock of its own",
    "comment": "a stock assumed from its comments",
    "option": "the stock of --stock",
    "assumed": "a stock assumed from its path",
}

AIR_PAYS = 0.99  # of the time: what saves less is not worth a line

refuse = refuser(NAME)


def add_arguments(parser):
    parser.add_argument("program", metavar="PROGRAM", help="G-code file")
    parser.add_argument(
        "--material",
        metavar="NAME",
        default="",
        help="what the stock is made of, a name of docs/user/materials.md; kept in the job file",
    )
    parser.add_argument(
        "--air", action="store_true", default=None, help="feeds above the stock are as fast as the axes"
    )
    parser.add_argument(
        "--clamps",
        type=int,
        metavar="P",
        help="number of a set-up of clamps of M256 that is in force with the set-up, 0: none (default: as confirmed "
        "before)",
    )
    parser.add_argument(
        "--clamp-box",
        action="append",
        nargs=7,
        metavar=("NAME", "X0", "Y0", "Z0", "X1", "Y1", "Z1"),
        help="a clamp of this program: machine units, work coordinates of the first move",
    )
    parser.add_argument(
        "--clamp-cylinder",
        action="append",
        nargs=6,
        metavar=("NAME", "X", "Y", "Z0", "Z1", "D"),
        help="the same, a cylinder along Z",
    )
    parser.add_argument("--yes", action="store_true", help="confirm the proposal without a question")
    parser.add_argument("--json", metavar="FILE", help="the result as JSON (-: standard output)")
    add_tool_options(parser)
    add_machine_options(parser, refuse)


def run(options):
    """-> exit status."""
    from chipwise.check.run import lines_of
    from chipwise.setup.confirmed import names
    from chipwise.setup.job import MAX_TEXT, path_of
    from chipwise.setup.measure import Wanted, measure

    if options.material and not (options.material.isprintable() and len(options.material) <= MAX_TEXT):
        refuse(f"--material is not a text of at most {MAX_TEXT} characters")
    arguments = machine_of(options, refuse)
    machine = arguments.pop("machine")
    arguments |= tool_of(options.tool, options.diameter, machine, refuse)
    check_outputs(
        refuse, {"--json": options.json}, [("the program", options.program), ("the INI file", ini_of(options))]
    )
    settings = _settings(machine)
    _check_material(options.material, settings)
    path = path_of(options.program, settings.path("JOBS"))
    options.clamps = _clamps(options, path, machine.unit_mm)
    options.air = settings["SETUP_AIR"] if options.air is None else options.air
    exit_on_sigterm()
    progress, lines = Progress(sys.stderr), lines_of(options.program)
    measured = measure(
        options.program,
        machine,
        names(options.program, machine),
        wanted=Wanted(options.material, *options.clamps),
        progress=lambda line: progress(line / lines),
        **arguments,
    )
    progress.end()
    said = sys.stderr if options.json == "-" else sys.stdout
    print("\n".join(report(options.program, measured, options.air)), file=said, flush=True)
    trouble, confirmed = measured.result.error, False
    if not trouble:
        try:
            confirmed = confirm(options, measured, path, said)
        except CycleError as error:
            trouble = unnamed(error), 0
    if options.json:
        _write(options.json, json_text(options, measured, path, confirmed, trouble))
    if trouble and not measured.result.error:
        raise UsageError(f"{NAME}: {trouble[0]}")
    return 2 if trouble else 0


def _settings(machine):
    """[CHIPWISE]."""
    from chipwise.settings import load_settings

    try:
        return load_settings(machine.ini)
    except CycleError as error:
        raise UsageError(f"{NAME}: {unnamed(error)}") from error


def _check_material(name, settings):
    """Refuse a material that no table has."""
    from chipwise.tool_data.materials import find_material

    try:
        if name:
            find_material(name, settings.path("MATERIALS"))
    except CycleError as error:
        raise UsageError(f"{NAME}: {unnamed(error)}") from error


def _clamps(options, path, unit_mm):
    """(set_up, clamps) of a Job: those asked for, else those that were confirmed before."""
    from chipwise.clamps import set_ups
    from chipwise.setup.confirmed import clamps_before
    from chipwise.setup.job import name_of

    if options.clamps is options.clamp_box is options.clamp_cylinder is None:
        return clamps_before(path, options.program)
    found = {}
    for shape, rows in (("box", options.clamp_box), ("cylinder", options.clamp_cylinder)):
        for name, *texts in rows or ():
            if name in found:
                refuse(f"the clamp {name[:40]} is named twice")
            try:
                values = [float(text) * unit_mm for text in texts]
                found[name] = set_ups.clamp_of(
                    "setup",
                    f"clamp {name[:40]}",
                    name,
                    {shape: values},
                    f"clamp {name} of the set-up of {name_of(options.program)}",
                )
            except ValueError:
                refuse(f"clamp {name[:40]}: {' '.join(texts)[:60]} are not numbers")
            except CycleError as error:
                refuse(unnamed(error).removeprefix("setup: ").partition(";")[0])
    number = options.clamps or 0
    if not 0 <= number <= set_ups.MAX_SET_UP:
        refuse(f"--clamps {number} is not from 0 to {set_ups.MAX_SET_UP}")
    return number, found


# ---- confirm -------------------------------------------------------------------------------------------------------


def confirm(options, measured, path, said):
    """Whether the proposal is confirmed, by --yes or by the person at the terminal; it is in the job file then."""
    from chipwise.setup import confirmed
    from chipwise.setup import job as jobs

    found, why_not = jobs.state_of(path, options.program, measured.digest)
    wanted = confirmed.job_of(options.program, measured, options.material, options.air, *options.clamps)
    shown = printable(path)
    if found == jobs.as_written(wanted):
        print(f"confirmed before, in {shown}", file=said)
        return True
    if why_not:
        print(printable(unnamed(why_not)), file=said)
    elif found:
        print(f"{shown} has another set-up of this program", file=said)
    if not (options.yes or asked(path)):
        print("not confirmed, nothing is written; --yes confirms", file=said)
        return False
    confirmed.write(path, options.program, wanted)
    print(f"confirmed: {shown}", file=said)
    return True


def asked(path):
    """Whether the person at the terminal says yes; without a terminal nobody does."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    print(printable(f"Confirm stock and feeds, and write {path}? [y/N] "), end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


# ---- what is printed -----------------------------------------------------------------------------------------------


def report(program, measured, air):
    """Lines of text.  air: whether feeds above the stock are to be as fast as the axes."""
    from chipwise.check.findings import grouped_notes

    result = measured.result
    if result.error:
        text, line = result.error
        yield with_line(printable(f"{program}: {text}"), line)
        yield from surveyed(result)
        return
    low, high, source = measured.stock
    corners = (format_place(corner, result.unit) for corner in (low, high))
    yield printable(f"{program}: {SOURCES[source]}, from {' to '.join(corners)} {result.unit}")
    for text in grouped_notes(result.notes):
        yield f"  {printable(text)}"
    if measured.has_own_rate:
        yield "  the program has M251 of its own, which takes the place of what is set up here"
    if result.findings.count:
        yield f"  chipwise check has {result.findings.count} finding{'s' * (result.findings.count != 1)} in it"
    for tool in measured.tools:
        yield from tool_lines(tool, result.unit)
    now, then, free = measured.time_s, measured.time_with_s, measured.time_air_s
    if air:
        yield f"  feeds above the stock as fast as the axes: {format_minutes(free)} instead of {format_minutes(then)}"
    yield f"  in all {format_minutes(now)} at F, {format_minutes(measured.time_set_up_s(air))} set up"
    if not air and free < AIR_PAYS * then:
        yield f"  with --air, which makes feeds above the stock as fast as the axes: {format_minutes(free)}"


def tool_lines(tool, unit):
    """Two lines of one Proposal."""
    what = [
        format_length(tool.diameter, unit),
        *([tool.name] if tool.name else []),
        *([f"{tool.flutes} flutes"] if tool.flutes and "flute" not in tool.name else []),
    ]
    air = 100 * tool.air_s / tool.time_s if tool.time_s > 0 else 0
    cuts = f"{tool.mean / MM3_PER_CM3:.3g} cm3/min in the mean of all cuts"
    if tool.rate > 0:
        cuts += f", {tool.rate / MM3_PER_CM3:.3g} at most over 1 s sideways"
    yield printable(
        f"  tool {tool.number}, {', '.join(what)}: {format_minutes(tool.time_s)} at F, {air:.0f} % of it in air; {cuts}"
    )
    if tool.longer:
        yield (
            f"    it keeps F: with that rate held it would take {format_minutes(tool.longer)}, because it removes "
            f"more in places or on the way down"
        )
    elif tool.target is None:
        yield "    it only goes down, and keeps F"
    else:
        limit = ", the max_rate of its tool geometry" if tool.limited else ""
        chip = ", its largest chip" if tool.of_chip else ""
        yield (
            f"    proposal: hold {tool.target / MM3_PER_CM3:.3g} cm3/min{limit}, up to {tool.ceiling:g} times "
            f"F{chip}, moves down at F: {format_minutes(tool.time_with_s)}"
        )
    for name in tool.slowed_by:
        values = {
            "chip": (tool.chip, tool.chip_limit),
            "power": (tool.power, tool.power_limit),
            "bending": (tool.bending, tool.bending_limit),
        }[name]
        most, limit = (f"{v:.3g} W" if name == "power" else format_length(round(v, 3), unit) for v in values)
        yield f"    at F its largest {name} is {most}, the limit {limit}: M251 and a set-up go below F there"


def json_text(options, measured, path, confirmed, trouble):
    """As the page and other programs read it; mm, s, mm3/min."""
    result = measured.result
    stock = measured.stock and {
        "min": list(measured.stock[0]),
        "max": list(measured.stock[1]),
        "source": measured.stock[2],
    }
    return (
        json.dumps(
            {
                "program": printable(options.program),
                "status": 2 if trouble else 0,
                "error": trouble and printable(trouble[0]),
                "error_line": trouble and trouble[1],
                "stock": stock,
                "material": options.material,
                "air": bool(options.air),
                "clamps": {
                    "set_up": options.clamps[0],
                    "own": {name: {"min": clamp.low, "max": clamp.high} for name, clamp in options.clamps[1].items()},
                },
                "tools": [tool.json() for tool in measured.tools],
                "dwell_s": result.dwell_s,
                "findings": result.findings.count,
                "notes": result.notes,
                "own_m251": measured.has_own_rate,
                "confirmed": confirmed,
                "job": printable(path) if confirmed else None,
                "sha256": measured.digest,
            },
            indent=1,
            allow_nan=False,
        )
        + "\n"
    )


def _write(path, text):
    if path == "-":
        sys.stdout.write(text)
    else:
        write_output(NAME, path, text)
