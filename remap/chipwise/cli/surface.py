# SPDX-License-Identifier: GPL-2.0-or-later
"""Make a program that cuts a curved surface, from an STL file or a PNG picture as depth.

The tool goes over the model in parallel cuts, as low as model, floor and holder allow. MODEL may be a job file: a TOML file that
names the model and gives the options of one cut or several, one after the other. Lengths are in the unit of the machine, STL
files count as mm. The model stays where its file has it, unless --at or --scale says otherwise; a picture has its lower left corner
at the origin and white at Z0. The stock is taken to fill everything below --stock-top.

Exit status: 0 written, 1 written, but cuts are deeper than the flutes, 2 the model, the tool or an option cannot be used; nothing is
written then.
"""

import argparse
import json
import sys
import time

from chipwise.cli.machine_options import Progress, add_ini, ini_of, refuser
from chipwise.cli.output import check_outputs, write_output
from chipwise.cli.surface_job import is_job, read_job
from chipwise.cli.surface_program import LENGTHS, figures_of, planned, program_text, unit_of
from chipwise.errors import CycleError, printable
from chipwise.processes import exit_on_sigterm

NAME = 'surface'
HELP = 'make a program that cuts a curved surface from STL or a depth picture'

refuse = refuser(NAME)

LARGEST = 1e5               # of any length option, machine units
MOST = 1e6                  # of feeds, speed and scale


def add_arguments(parser):
    parser.add_argument('model', metavar='MODEL', help='STL file, PNG picture with 8 or 16 bit, or job file .toml')
    parser.add_argument('-o', '--output', metavar='OUT.ngc', required=True, help='the program')
    parser.add_argument('--tool', type=int, metavar='N', help='number of the tool in the tool table')
    for name, (metavar, _default, _least, _closed, text) in LENGTHS.items():
        parser.add_argument(f'--{name}', type=float, metavar=metavar, help=text)
    parser.add_argument('--direction', type=int, metavar='DEG', default=0, help='of the cuts, whole degrees to X (default: 0)')
    parser.add_argument('--link', type=int, metavar='0|1|2', default=0,
                        help='0 over the clearance plane (default), 1 the lowest safe link, 2 zigzag')
    parser.add_argument('--conventional', action='store_true', help='one-way cuts are conventional, not climb, with M3')
    parser.add_argument('--at', nargs=3, type=float, metavar=('X', 'Y', 'Z'), default=(0.0, 0.0, 0.0), help="where the file's origin goes")
    parser.add_argument('--scale', type=float, metavar='S', help="factor of the file's lengths (default: 1)")
    parser.add_argument('--feed', type=float, metavar='F', help='cutting feed, machine units/min (default: 600 mm/min)')
    parser.add_argument('--plunge-feed', type=float, metavar='E', help='plunge feed (default: half of --feed)')
    parser.add_argument('--speed', type=float, metavar='S', default=10000.0, help='spindle speed (default: 10000)')
    parser.add_argument('--json', metavar='FILE', help='the figures, for programs')
    add_ini(parser)
    parser.error = refuse


def run(options):
    """-> exit status."""
    exit_on_sigterm()
    progress, began = Progress(sys.stderr), time.monotonic()
    try:
        cuts = cuts_of(options)
        for cut in cuts:
            check_options(cut)
            check_outputs(refuse, {'-o': cut.output, '--json': cut.json},
                          [('the model', cut.model), ('the job file', getattr(cut, 'job', None)), ('the INI file', ini_of(cut))])
        parts = planned(cuts, refuse, progress)
        write_output(NAME, options.output, program_text(parts))
    except CycleError as error:
        progress.clear()
        print(printable(error.text(unit_of(options)).replace('chipwise: ', f'chipwise: {NAME}: ', 1)), file=sys.stderr)
        return 2
    except MemoryError:
        progress.clear()
        print(f'chipwise: {NAME}: the memory is not enough for this model; export it with a larger tolerance', file=sys.stderr)
        return 2
    progress.end()
    figures = [figures_of(part.request, part.plan, time.monotonic() - began) for part in parts]
    for part, one in zip(parts, figures):
        for note in part.plan.notes:
            print(printable(CycleError(note.text, **note.lengths).text(unit_of(options))))
        which = f'tool {part.options.tool}: ' if len(parts) > 1 else ''
        print(printable(f'{options.output}: {which}{one["cuts"]} cuts, {one["moves"]} moves from {one["sampled"]} points'))
    if options.json:
        found = {'parts': figures} if is_job(options.model) else figures[0]
        write_output(NAME, options.json, json.dumps({'output': options.output, **found}, indent=1) + '\n')
    return int(any(part.plan.beyond_flutes for part in parts))


def cuts_of(options):
    """The options of each cut: those of the command, or of the job file it names."""
    if not is_job(options.model):
        for name in ('tool', 'step'):
            if getattr(options, name) is None and (name == 'tool' or options.scallop is None):
                refuse(f'--{name} is missing')
        return [options]
    given = [f'--{name.replace("_", "-")}' for name, value in job_defaults().items()
             if name != 'model' and getattr(options, name) != value]
    if given:
        refuse(f'{given[0]} is given beside a job file: write it into the file')
    cuts = read_job(options.model, job_defaults())
    for cut in cuts:
        cut.output, cut.json, cut.ini, cut.job = options.output, options.json, options.ini, options.model
    return cuts


def job_defaults():
    """{option: default} of what a job file may give."""
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    known = {action.dest: action.default for action in parser._actions if action.dest != 'help'}
    return {name: value for name, value in known.items() if name not in ('output', 'json', 'ini')}


def check_options(options):
    """UsageError for what cannot be meant."""
    for name, (_metavar, _default, least, closed, _text) in LENGTHS.items():
        value = getattr(options, name.replace('-', '_'))
        if value is None:
            continue
        low = -LARGEST if least is None else least
        if not (low < value <= LARGEST or closed and value == low):
            kind = f'a length from {-LARGEST:.0f}' if least is None else 'a length of 0 or more' if closed else 'a length above 0'
            refuse(f'--{name} {value:g} is not {kind}, up to {LARGEST:.0f}')
    for name in ('feed', 'plunge_feed', 'speed', 'scale'):
        value = getattr(options, name)
        if value is not None and not 0 < value <= MOST:
            refuse(f'--{name.replace("_", "-")} {value:g} is not a number above 0, up to {MOST:.0f}')
    if not all(abs(value) <= LARGEST for value in options.at):
        refuse('--at needs three lengths')
    if options.tool < 1:
        refuse(f'--tool {options.tool} is not the number of a tool')
