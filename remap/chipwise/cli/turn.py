# SPDX-License-Identifier: GPL-2.0-or-later
"""Plan the turning of a part from its drawing: which steps, with which tools, over which ranges; and write them as
plain G-code.

The program's G26 line names the sub of the part; its WORKPIECE comment, or the sub in P, is the blank; its LATHE
comment names the tools. The machine is not needed. -o FILE.svg draws the plan, -o FILE.ngc writes it as plain G-code
with one commented block a step, for machines with or without chipwise. A plan that cannot be shown to be safe is
refused, and nothing is written then.

Exit status: 0 planned, 1 planned and stock is left that no tool reaches, 2 it cannot be planned.
"""

import json
import os
import sys
from dataclasses import replace

from chipwise import ROOT
from chipwise.options.machine import UsageError
from chipwise.options.machine import refuser
from chipwise.cli.output import check_outputs, write_output
from chipwise.errors import CycleError, braceless, unnamed
from chipwise.host.files import read_bytes
from chipwise.ini import Ini
from chipwise.settings import load_settings

NAME = "turn"
HELP = "plan the turning of a part from blank, drawing and tools, and write plain G-code"
MAX_BYTES = 1 << 26
SUFFIXES = (".svg", ".ngc", ".nc")

refuse = refuser(NAME)


def add_arguments(parser):
    parser.add_argument("program", metavar="PROGRAM", help="G-code file with a G26 line and the sub of the part")
    parser.add_argument("--plan", action="store_true", help="print the plan only, whatever -o says")
    parser.add_argument("-o", "--output", metavar="FILE", help="FILE.svg: picture; FILE.ngc: the plan as plain G-code")
    parser.add_argument("--json", metavar="FILE", help="the plan as data: mm, mm2, s; - is standard output")
    parser.add_argument(
        "--steps",
        metavar="FILE.toml",
        help="steps = [..]: other steps, or in another order (default: [CHIPWISE]TURNING_STEPS)",
    )
    parser.add_argument("--ini", metavar="INI", help="the machine (default: INI_FILE_NAME, else configs/lathe.ini)")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter that the program sets for its sub: --set _width=40 --set 100=3",
    )
    parser.error = refuse


def run(options):
    """-> exit status."""
    from chipwise.cli.contour import parameters as values
    from chipwise.contour_sub import parameters
    from chipwise.turning import text
    from chipwise.turning.plan import make_plan
    from chipwise.turning.read_part import Machine, job_of, make_order, read_steps, tool_notes
    from chipwise.turning.request import lines_of_plans, read_request
    from chipwise.turning.times import times

    check_options(options)
    unit = "mm"
    try:
        numbered, named = values(options.set)
        path = options.ini or os.environ.get("INI_FILE_NAME") or os.path.join(ROOT, "configs", "lathe.ini")
        machine = Machine(Ini(path), load_settings(path), path)
        program = read_program(options.program)
        request = read_request(program, machine.startup)
        unit = request.unit
        job = replace(job_of(options.program, request, machine), numbered=numbered, named=named)
        for sub in filter(None, (request.words["Q"], request.words["P"])):
            parameters.check(replace(job, sub=sub))
        order = make_order(
            job, program, request, machine, read_steps(options.steps) if options.steps else machine.steps
        )
        plan = make_plan(order)
        title = f"O{request.words['Q']} of {os.path.basename(options.program)}"
        said = [unnamed(note.text(unit)) for note in tool_notes(order, request, machine)]
        output = output_text(options, plan, request, title)
    except CycleError as error:
        parameters.hint_set(error)
        raise UsageError(f"{NAME}: " + unnamed(error.text(unit))) from error
    if output:
        write_output(NAME, options.output, output)
    report(options, request, plan, times(plan, request, machine.motion), text)
    for line in said:
        print(f"chipwise: {NAME}: {line}", file=sys.stderr)
    others = lines_of_plans(program)[1:]
    if others:
        print(
            f"chipwise: {NAME}: this is the plan of line {request.line} only; G26 or G27 is also in line "
            f"{', '.join(map(str, others))}",
            file=sys.stderr,
        )
    return 1 if plan.residue else 0


def output_text(options, plan, request, title):
    """Picture or program, None if neither is asked for."""
    from chipwise.drawing.turning import svg
    from chipwise.turning.nc import program

    if not options.output or options.plan:
        return None
    if options.output.lower().endswith(".svg"):
        return svg(plan, title)
    return program(plan, request, f"{title}, planned by chipwise turn")


def report(options, request, plan, spent, text):
    """Print the plan, and write --json."""
    found = json.dumps(text.data(plan, request, spent), indent=1) + "\n"
    if options.json == "-":
        print(found, end="")
        return
    if options.json:
        write_output(NAME, options.json, found)
    print("\n".join(text.report(plan, request, spent)))


def check_options(options):
    """UsageError for files that cannot be written, before any work."""
    if options.output and not options.output.lower().endswith(SUFFIXES):
        refuse(f"-o {options.output} is neither a picture nor a program; use .svg or .ngc")
    check_outputs(
        refuse,
        {"-o": options.output, "--json": options.json},
        [("the program", options.program), ("the file of steps", options.steps), ("the INI file", options.ini)],
    )


def read_program(path):
    """Text of the program."""
    try:
        return read_bytes(path, MAX_BYTES).decode("utf-8", "replace")
    except OSError as error:
        raise CycleError(f"{braceless(path)}: {error.strerror}", "name a G-code file that can be read") from error
