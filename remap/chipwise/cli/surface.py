# SPDX-License-Identifier: GPL-2.0-or-later
"""Make a program that cuts a curved surface, from an STL file or a PNG picture as depth.

The tool goes over the model in parallel cuts, as low as model, floor and holder allow. MODEL may be a job file: a TOML
file that names the model and gives the options of one cut or several, one after the other. Lengths are in the unit of
the machine, STL files count as mm. The model stays where its file has it, unless --at or --scale says otherwise; a
picture has its lower left corner at the origin and white at Z0. The stock is taken to fill everything below
--stock-top.

Exit status: 0 written, 1 written, but cuts are deeper than the flutes, 2 the model, the tool or an option cannot be
used; nothing is written then.
"""

import json
import sys
import time

from chipwise.options.machine import Progress, ini_of
from chipwise.cli.output import check_outputs, write_output
from chipwise.options.surface_job import add_arguments  # noqa: F401  build_parser() calls it
from chipwise.options.surface_job import NAME, check_options, cuts_of, is_job, refuse
from chipwise.options.surface_program import figures_of, planned, program_text, unit_of
from chipwise.errors import CycleError, printable
from chipwise.host.processes import exit_on_sigterm

HELP = "make a program that cuts a curved surface from STL or a depth picture"


def run(options):
    """-> exit status."""
    exit_on_sigterm()
    progress, began = Progress(sys.stderr), time.monotonic()
    try:
        cuts = cuts_of(options)
        for cut in cuts:
            check_options(cut)
            check_outputs(
                refuse,
                {"-o": cut.output, "--json": cut.json},
                [("the model", cut.model), ("the job file", getattr(cut, "job", None)), ("the INI file", ini_of(cut))],
            )
        parts = planned(cuts, refuse, progress)
        write_output(NAME, options.output, program_text(parts))
    except CycleError as error:
        progress.clear()
        print(printable(error.text(unit_of(options)).replace("chipwise: ", f"chipwise: {NAME}: ", 1)), file=sys.stderr)
        return 2
    except MemoryError:
        progress.clear()
        print(
            f"chipwise: {NAME}: the memory is not enough for this model; export it with a larger tolerance",
            file=sys.stderr,
        )
        return 2
    progress.end()
    figures = [figures_of(part.request, part.plan, time.monotonic() - began) for part in parts]
    for part, one in zip(parts, figures):
        for note in part.plan.notes:
            print(printable(CycleError(note.text, **note.lengths).text(unit_of(options))))
        which = f"tool {part.options.tool}: " if len(parts) > 1 else ""
        print(
            printable(f"{options.output}: {which}{one['cuts']} cuts, {one['moves']} moves from {one['sampled']} points")
        )
    if options.json:
        found = {"parts": figures} if is_job(options.model) else figures[0]
        write_output(NAME, options.json, json.dumps({"output": options.output, **found}, indent=1) + "\n")
    return int(any(part.plan.beyond_flutes for part in parts))
