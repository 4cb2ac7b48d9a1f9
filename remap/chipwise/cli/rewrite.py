# SPDX-License-Identifier: GPL-2.0-or-later
"""Rewrite a whole program: respect the flute length of its tools (--flute), or feeds for a constant removal rate (--feed).

--flute shifts the parts of the path for which the flutes are too short up along the tool's axis, and adds passes for what is
left, until the program's own path has been cut. --feed writes F for every move, and divides moves where the load changes; the
path stays the same. The program is read by LinuxCNC's own interpreter on the machine of an INI file; the new one is read back and
compared before it is kept.

Exit status: 0 written, 2 the program cannot be rewritten; nothing is written then.
"""

import os
import signal
import sys
import tempfile

from chipwise import ROOT
from chipwise.cli.check import Progress, stock_of
from chipwise.cli.output import PREFIX, unwritable, write_whole
from chipwise.errors import format_length, printable

NAME = 'rewrite'
HELP = 'rewrite a program for its flutes, or for a constant removal rate'

SYNCHRONISED = {33, 33.1, 74, 76, 84}
REPEATS = 5                     # of judging the new program again,
RESERVE_MM = 0.03               # each time with so much more room below the flutes' end


def add_arguments(parser):
    parser.add_argument('program', metavar='PROGRAM', help='G-code file')
    parser.add_argument('-o', '--output', metavar='OUT.ngc', required=True, help='the new program')
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument('--flute', action='store_true', help='respect the flute length of every tool')
    what.add_argument('--feed', type=float, metavar='Q', help='removal rate, cm3/min (in3/min on an inch machine)')
    parser.add_argument('--lower', type=float, metavar='Q2', help='with --feed: F stays where the rate lies between Q2 and Q')
    parser.add_argument('--split', type=float, metavar='MM', help='with --feed: moves are divided to this length (default: 1)')
    parser.add_argument('--ceiling', type=float, metavar='F',
                        help="with --feed: no F is raised above it, machine units/min (default: the axes' velocity)")
    parser.add_argument('--whole', action='store_true', help='with --flute: travel the whole path again, not only where stock is left')
    parser.add_argument('--diameter', type=float, metavar='MM', help="with --flute: of arcs at corners (default: the tool's)")
    parser.add_argument('--ini', metavar='INI', help='the machine (default: INI_FILE_NAME, else configs/mill.ini)')
    parser.add_argument('--stock', nargs=6, type=float, metavar=('X0', 'Y0', 'Z0', 'X1', 'Y1', 'Z1'),
                        help='corners of the stock for a program without M250: machine units, work coordinates of the first move')
    parser.add_argument('--cell', type=float, metavar='MM', help='cell of the stock model (default: [CHIPWISE]CELL)')
    parser.add_argument('--time-limit', type=float, default=600.0, metavar='S', help='computing time to read it (default: 600)')
    parser.error = refuse


def refuse(text):
    """argparse's own complaints in our form."""
    from chipwise.cli import UsageError
    raise UsageError(f'{NAME}: {text}; see chipwise {NAME} --help')


def run(options):
    """-> exit status."""
    from chipwise.check.reader import Machine, Unreadable
    from chipwise.rewrite.proof import Different
    check_options(options)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    ini = options.ini or os.environ.get('INI_FILE_NAME') or os.path.join(ROOT, 'configs', 'mill.ini')
    try:
        machine = Machine(ini)
    except Unreadable as error:
        refuse(str(error).partition('; see')[0])
    progress = Progress(sys.stderr)
    try:
        said = rewritten(options, machine, progress)
    except Unreadable as error:
        progress.clear()
        line = f' (line {error.line})' if error.line and '(line ' not in str(error) else ''
        return failed(options, f'{error}{line}')
    except Different as error:
        progress.clear()
        return failed(options, f'{error}: nothing is written; please report it with the program')
    except MemoryError:
        return failed(options, 'the memory is not enough for it; use a larger --cell')
    progress.end()
    print(printable(said))
    return 0


def failed(options, text):
    print(printable(f'chipwise: {options.program}: {text}'), file=sys.stderr)
    return 2


def check_options(options):
    """UsageError for what cannot be meant."""
    for name in ('feed', 'lower', 'split', 'ceiling', 'diameter', 'cell'):
        value = getattr(options, name)
        if value is not None and not 0 < value < 1e6:
            refuse(f'--{name} {value:g} is not a number above 0')
    for name in ('lower', 'split', 'ceiling'):
        if options.flute and getattr(options, name) is not None:
            refuse(f'--{name} goes with --feed')
    if not options.flute and (options.whole or options.diameter is not None):
        refuse(f'--{"whole" if options.whole else "diameter"} goes with --flute')
    if options.lower is not None and options.feed is not None and options.lower > options.feed:
        refuse(f'--lower {options.lower:g} is above --feed {options.feed:g}')
    if options.split is not None and options.split < 0.05:
        refuse(f'--split {options.split:g} mm is too short; use 0.05 or more')
    if not 1 <= options.time_limit <= 1e6:
        refuse(f'--time-limit {options.time_limit:g} is not from 1 to 1000000 s')
    trouble = unwritable(options.output)
    if trouble:
        refuse('-o ' + '; '.join(trouble))


def rewritten(options, machine, progress):
    """Do it; -> what is said."""
    from chipwise.check.reader import Unreadable
    from chipwise.errors import CycleError
    from chipwise.rewrite import cutting
    from chipwise.rewrite.program import read
    from chipwise.settings import load_settings
    from chipwise.tools import load_tools
    try:
        settings = load_settings(machine.ini)
        geometry = load_tools(settings.path('TOOL_GEOMETRY'))
    except CycleError as error:
        raise Unreadable(error.text().removeprefix('chipwise: '), '') from error
    stock = stock_of(options.stock, machine.unit_mm)
    limits = {'cpu_s': int(options.time_limit)}

    def read_it(path):
        return read(path, machine, stock, **limits)

    program = read_it(options.program)
    progress(0.2)
    cell = options.cell or cutting.cell_for(program, geometry, settings['CELL'],
                                            *([] if options.flute else [cutting.CELLS_FOR_VOLUME]))
    work = respect_flutes if options.flute else write_feeds
    data, said = work(options, machine, program, geometry, cell, read_it, lambda share: progress(0.2 + 0.5 * share))
    try:
        write_whole(options.output, data)
    except OSError as error:
        raise Unreadable(f'-o {options.output}: {error.strerror}', 'name a file in a folder of yours that has room') from error
    return f'{options.output}: {said}'


def read_back(options, data, read_it):
    """The Program of the new text."""
    with tempfile.TemporaryDirectory(prefix=PREFIX) as folder:
        path = os.path.join(folder, os.path.basename(options.program))
        write_whole(path, data)
        return read_it(path)


def respect_flutes(options, machine, program, geometry, cell, read_it, progress):
    """CN105492980; -> (bytes, what is said)."""
    from chipwise.check.reader import Unreadable
    from chipwise.rewrite import flute, proof
    from chipwise.rewrite.text import Writer
    edits, figures = flute.rewrite(program, geometry, cell, options.whole, options.diameter, progress)
    if not edits:
        return program.content(), 'the flutes are long enough everywhere, the program is unchanged'
    data, trouble = Writer(program, edits).write(), None
    for repeat in range(1, REPEATS + 1):
        try:
            second = read_back(options, data, read_it)
        except Unreadable as error:
            raise proof.Different(f'the new program cannot be read ({error})') from error
        try:
            proof.flutes(program, second, geometry, cell)
            break
        except proof.TooDeep as error:      # by less than a cell: the model's steps along the new path are others
            trouble = error
            again, _ = flute.rewrite(second, geometry, cell, options.whole, options.diameter, reserve=RESERVE_MM * repeat)
            data = Writer(second, again).write()
    else:
        raise trouble
    unit = 'in' if machine.unit_mm > 10 else 'mm'
    parts = [f'line{"s" * (b > a)} {a}' + (f' to {b}' if b > a else '') + f' in {n} levels' for a, b, n in figures.lines[:5]]
    more = f' and {len(figures.lines) - 5} more' if len(figures.lines) > 5 else ''
    return data, (f'{", ".join(parts)}{more}; {format_length(round(figures.added_feed, 1), unit)} of feed added to '
                  f'{format_length(round(figures.first_feed, 1), unit)}')


def write_feeds(options, machine, program, geometry, cell, read_it, progress):
    """JP3131045; -> (bytes, what is said)."""
    from chipwise.check.reader import Unreadable
    from chipwise.rewrite import feed, proof
    from chipwise.rewrite.text import Writer
    from chipwise.rewrite.words import words_of
    scale, unit = (machine.unit_mm ** 3, 'in3/min') if machine.unit_mm > 10 else (1000.0, 'cm3/min')
    rates = feed.Rates(options.feed * scale, (options.lower or 0.0) * scale,
                       options.ceiling and options.ceiling * machine.unit_mm, options.split or 1.0)
    fixed = [n for n, text in enumerate(program.source, 1)
             if any(letter == 'G' and value in SYNCHRONISED for letter, value in words_of(text))]
    edits, figures = feed.rewrite(program, geometry, cell, rates, machine.speeds, fixed, progress)
    for step in (*edits.feeds, *edits.instead):
        program.check_writable(program.line_of(step), 'F has to change')
    data = Writer(program, edits).write() if edits else program.content()
    if edits:
        try:
            second = read_back(options, data, read_it)
        except Unreadable as error:
            raise proof.Different(f'the new program cannot be read ({error})') from error
        proof.same_path(program, second)
    return data, (f'F of {figures.changed} of {figures.moves} feed moves changed, {figures.divided} divided; {figures.before_s:.1f} s '
                  f'of feed become {figures.after_s:.1f} s, peak {figures.peak_before / scale:.4g} {unit} becomes '
                  f'{figures.peak_after / scale:.4g}')
