# SPDX-License-Identifier: GPL-2.0-or-later
"""Type the data of a code in one line, with commas between them, and get the G-code line.

The names of the data are shown in the order in which they are typed. An empty place keeps the default of the code: 100,-8,,5
and Enter. Numbers have a point, not a comma. In a terminal a line that is wrong can be corrected; otherwise each line of standard
input gives a line on standard output. "list" as the code shows all codes.

Exit status: 0 every line was made, 1 a line was refused, 2 the code, a file or an option cannot be used.
"""

import sys

from chipwise import entry, language
from chipwise.cli.machine_options import add_ini, ini_of, refuser
from chipwise.errors import MM_PER_INCH, CycleError, printable
from chipwise.ini import Ini
from chipwise.settings import load_settings

NAME = 'enter'
HELP = 'type the data of a code with commas between them, and get its G-code line'
LIST, ASK = 'list', '?'     # instead of a code: all codes; instead of data: their names again
MAX_LINE = 10_000           # bytes of a line of standard input

refuse = refuser(NAME)


def add_arguments(parser):
    parser.add_argument('code', metavar='CODE', help='G79, M251, ..; or list')
    parser.add_argument('--unit', choices=('mm', 'in'), help='of the program: G21 or G20 (default: that of the machine)')
    add_ini(parser)
    parser.error = refuse


def run(options):
    """-> exit status."""
    try:
        options.table = load_settings(ini_of(options)).path('ENTRY')
        options.unit = options.unit or ('in' if Ini(ini_of(options)).units_per_mm() == 1.0 / MM_PER_INCH else 'mm')
        options.code = options.code.upper()
        if options.code == LIST.upper():
            print('\n'.join(listed(options.table)))
            return 0
        entry.fields(options.code, options.table)
    except CycleError as error:
        refuse(str(error).removeprefix('chipwise: '))
    return asked(options) if sys.stdin and sys.stdin.isatty() else read(options)


def listed(table):
    """Lines with every code."""
    translate = language.translator()
    for code in entry.codes(table):
        letters = ','.join(field.letter for field in entry.fields(code, table))
        yield f'{code:5} {translate(entry.title(code, table))}' + (f': {letters}' if letters else '')


def names(code, unit, table):
    """Lines with the data of a code in their order."""
    translate = language.translator()
    known = entry.fields(code, table)
    yield f'{code}: {translate(entry.title(code, table))}'
    shown = [translate(field.name) + (f', {field.unit(unit)}' if field.unit(unit) else '') for field in known]
    width = max(map(len, shown), default=0)
    for number, (field, text) in enumerate(zip(known, shown), 1):
        meanings = ', '.join(f'{value} {translate(meaning)}' for value, meaning in field.choices)
        yield printable(f'{number:3} {field.letter}  {text:{width}}  {translate("required") if field.required else "[" + translate(field.default) + "]"}'
                        + (f'  {meanings}' if meanings else ''))


# ---- standard input that is not a terminal ---------------------------------------------------------------------


def read(options):
    """A G-code line of each line of standard input; -> exit status."""
    status = 0
    for number, text in enumerate(lines_of(sys.stdin), 1):
        try:
            print(entry.line(options.code, text, options.table), flush=True)
        except CycleError as error:
            print(f'chipwise: {NAME}: line {number}: ' + str(error).removeprefix('chipwise: '), file=sys.stderr)
            status = 1
    return status


def lines_of(stream):
    """Lines of standard input, however long they are."""
    while stream:
        data = stream.buffer.readline(MAX_LINE)
        if not data:
            return
        yield data.decode('utf-8', 'replace')


# ---- a terminal ------------------------------------------------------------------------------------------------


def asked(options):
    """Ask until a line is right; -> exit status."""
    translate = language.translator()
    print('\n'.join([*names(options.code, options.unit, options.table),
                     translate('in this order, with , between them; an empty place keeps the default')]), file=sys.stderr)
    letters = ','.join(field.letter for field in entry.fields(options.code, options.table))
    text = ''
    while True:
        try:
            text = answer(f'{options.code} {letters}> ', text)
        except EOFError:
            print(file=sys.stderr)
            return 1
        if text.strip() == ASK:
            print('\n'.join(names(options.code, options.unit, options.table)), file=sys.stderr)
            text = ''
            continue
        try:
            print(entry.line(options.code, text, options.table))
            return 0
        except CycleError as error:
            print(error, file=sys.stderr)


def answer(prompt, before):
    """A line of the terminal, beginning with the one before so that it can be corrected.  Raises EOFError."""
    if not sys.stdout.isatty():             # only the result goes there
        print(prompt, end='', file=sys.stderr, flush=True)
        text = sys.stdin.readline()
        if not text:
            raise EOFError
        return text.rstrip('\n')
    try:
        import readline
    except ImportError:
        return input(prompt)
    readline.set_startup_hook(lambda: readline.insert_text(before))
    try:
        return input(prompt)
    finally:
        readline.set_startup_hook(None)
