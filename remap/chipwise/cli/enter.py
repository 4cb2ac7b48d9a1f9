# SPDX-License-Identifier: GPL-2.0-or-later
"""Type the data of a code in one line, with commas between them, and get the G-code line, with a drawing of what it
does.

The names of the data are shown in the order in which they are typed. An empty place keeps the default of the code:
100,-8,,5 and Enter. Numbers have a point, not a comma. In a terminal a line that is wrong can be corrected; otherwise
each line of standard input gives a line on standard output. "list" as the code shows all codes.

With -o or --program the code plans the line as the machine would: its own rules are checked, too. The program named has
the sub and the WORKPIECE or SURFACE comments; nothing else of it is run. LinuxCNC need not run.

With --run the line is planned from where the machine is, and run by MDI if the machine is on, homed, idle and at rest;
in a terminal after a question.

Exit status: 0 every line was made, 1 a line was refused, 2 the code, a file or an option cannot be used.
"""

import math
import os
import sys
from dataclasses import replace

from chipwise import entry
from chipwise.host import language
from chipwise.cli.contour import parameters
from chipwise.options.machine import add_ini, ini_of, refuser
from chipwise.cli.output import check_outputs
from chipwise.cli.picture import check_output, write_picture
from chipwise.errors import MM_PER_INCH, CycleError, printable, unnamed
from chipwise.ini import Ini
from chipwise.settings import load_settings

NAME = "enter"
HELP = "type the data of a code with commas between them, and get its G-code line and a drawing"
YES = ("y", "yes", "j", "ja")
LIST, ASK = "list", "?"  # instead of a code: all codes; instead of data: their names again
MAX_LINE = 10_000  # bytes of a line of standard input

refuse = refuser(NAME)


def add_arguments(parser):
    parser.add_argument("code", metavar="CODE", help="G79, M251, ..; or list")
    parser.add_argument(
        "--unit", choices=("mm", "in"), help="of the program: G21 or G20 (default: that of the machine)"
    )
    add_ini(parser)
    parser.add_argument("-o", "--output", metavar="FILE", help="drawing of what the line does: FILE.svg or FILE.png")
    parser.add_argument("--dark", action="store_true", help="the drawing in the colours of dark screens")
    parser.add_argument(
        "--program",
        metavar="PROGRAM",
        help="G-code file with the sub and the comments; else subs are sought on the SUBROUTINE_PATH",
    )
    parser.add_argument(
        "--tool",
        type=int,
        default=0,
        metavar="N",
        help="tool of the tool table (default: the first of the program, else of the table)",
    )
    parser.add_argument(
        "--at",
        nargs=3,
        type=float,
        metavar=("X", "Y", "Z"),
        help="position of the tool before the line, in the units of the line (default: 0 0, 5 mm above 0)",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter that the program would have set: --set _chipwise_chop_size=12 --set 100=3",
    )
    parser.add_argument(
        "--run",
        action="store_true",
        help="run the line by MDI in the LinuxCNC that runs here, planned from where its tool is",
    )
    parser.error = refuse


def run(options):
    """-> exit status."""
    try:
        options.table = load_settings(ini_of(options)).path("ENTRY")
        options.unit = options.unit or ("in" if Ini(ini_of(options)).units_per_mm() == 1.0 / MM_PER_INCH else "mm")
        options.code = options.code.upper()
        if options.code == LIST.upper():
            print("\n".join(listed(options.table)))
            return 0
        entry.fields(options.code, options.table)
        options.planned = bool(options.output or options.program or options.run)
        if options.planned:
            check_planned(options)
    except CycleError as error:
        refuse(unnamed(error))
    return asked(options) if sys.stdin and sys.stdin.isatty() else read(options)


def listed(table):
    """Lines with every code."""
    translate = language.translator()
    for code in entry.codes(table):
        letters = ",".join(field.letter for field in entry.fields(code, table))
        yield f"{code:5} {translate(entry.title(code, table))}" + (f": {letters}" if letters else "")


def names(code, unit, table):
    """Lines with the data of a code in their order."""
    translate = language.translator()
    known = entry.fields(code, table)
    yield f"{code}: {translate(entry.title(code, table))}"
    shown = [translate(field.name) + (f", {field.unit(unit)}" if field.unit(unit) else "") for field in known]
    width = max(map(len, shown), default=0)
    for number, (field, text) in enumerate(zip(known, shown), 1):
        meanings = ", ".join(f"{value} {translate(meaning)}" for value, meaning in field.choices)
        yield printable(
            f"{number:3} {field.letter}  {text:{width}}  "
            f"{translate('required') if field.required else '[' + translate(field.default) + ']'}"
            + (f"  {meanings}" if meanings else "")
        )


# ---- what the line does ----------------------------------------------------------------------------------------


def check_planned(options):
    """Refuse, before anything is asked, what cannot be planned; options.scene."""
    from chipwise.entry.planned import DRAWN, Scene

    if options.output:
        check_output(options.output)
        if options.code not in DRAWN:
            refuse(f"{options.code} has nothing to draw; leave -o out")
        check_outputs(
            refuse, {"-o": options.output}, [("the program", options.program), ("the INI file", ini_of(options))]
        )
    numbered, named = parameters(options.set)
    scale = MM_PER_INCH if options.unit == "in" else 1.0
    at = tuple(scale * value for value in options.at) if options.at else (0.0, 0.0, 5.0)
    if not all(map(math.isfinite, at)):
        refuse("--at is not a position; give three numbers")
    if options.run and (options.program or options.tool or options.at):
        refuse("--run takes program, tool and position from LinuxCNC; leave --program, --tool and --at out")
    if options.tool < 0:
        refuse(f"--tool {options.tool} is not the number of a tool; use a number of the tool table")
    options.scene = Scene(
        os.path.abspath(ini_of(options)),
        options.unit,
        options.program and os.path.abspath(options.program) or "",
        options.tool,
        at,
        numbered,
        named,
    )


def made(options, text):
    """The G-code line of what was typed; planned and drawn if that is asked for.  Raises CycleError."""
    line = entry.line(options.code, text, options.table)
    if options.planned:
        from chipwise.entry.planned import plan

        state = machine_state(options) if options.run else None
        scene = (
            options.scene
            if state is None
            else replace(options.scene, program=state.program, tool=state.tool, at=state.position)
        )
        found = plan(scene, line, options.table)
        for message in found.messages:
            print(printable(message), file=sys.stderr)
        if options.output:
            draw(options, line, found)
        if options.run:
            run_line(options, line, state)
    return line


def machine_state(options):
    """What the machine is doing, if the line may be run."""
    from chipwise.entry import mdi

    state = mdi.read()
    mdi.check(state, options.unit, options.code.startswith("G"))
    return state


def run_line(options, line, before):
    """Run a line that was planned, in a terminal after a question.  Raises CycleError if it is not run."""
    from chipwise.entry import mdi

    translate = language.translator()
    if sys.stdin.isatty():
        print(f"{translate('run now?')} {line}  [y/N] ", end="", file=sys.stderr, flush=True)
        if sys.stdin.readline().strip().lower() not in YES:
            raise CycleError("the line is not run: it was not confirmed", "enter it again, and type y")
    now = machine_state(options)
    mdi.same(before, now)
    mdi.send(line)
    print(translate("running; Stop on the screen of LinuxCNC ends it"), file=sys.stderr)


def draw(options, line, found):
    """Write the drawing."""
    from chipwise.drawing.entered import figures, svg
    from chipwise.panel import colours

    translate = language.translator()
    words = entry.words(line, options.unit, translate, options.table)
    items = colours.load(load_settings(ini_of(options)).path("COLOURS"))
    write_picture(
        svg(
            found,
            entry.title(options.code, options.table),
            words,
            items,
            "dark" if options.dark else "light",
            translate,
        ),
        options.output,
    )
    print(
        "; ".join(
            [
                f"{translate('tool')} {found.tool}",
                *figures(found, translate),
                f"{translate('picture')}: {printable(options.output)}",
            ]
        ),
        file=sys.stderr,
    )


def explained(error):
    """The message of an error, with the field that the code's own message means."""
    text = str(error)
    number, field = getattr(error, "number", 0), getattr(error, "field", None)
    return text if isinstance(error, entry.EntryError) or field is None else f"{text} (field {number}, {field.letter})"


# ---- standard input that is not a terminal ---------------------------------------------------------------------


def read(options):
    """A G-code line of each line of standard input; -> exit status."""
    status = number = 0
    for number, text in enumerate(lines_of(sys.stdin), 1):
        if (options.output or options.run) and number > 1:
            refuse("-o and --run are for one line, and standard input has more; give the first alone")
        try:
            print(made(options, text), flush=True)
        except CycleError as error:
            print(f"chipwise: {NAME}: line {number}: " + unnamed(explained(error)), file=sys.stderr)
            status = 1
    if options.run and not number:
        print(
            f"chipwise: {NAME}: nothing is run, because standard input is closed or empty; give the data there",
            file=sys.stderr,
        )
        return 1
    return status


def lines_of(stream):
    """Lines of standard input, however long they are."""
    while stream:
        data = stream.buffer.readline(MAX_LINE)
        if not data:
            return
        yield data.decode("utf-8", "replace")


# ---- a terminal ------------------------------------------------------------------------------------------------


def asked(options):
    """Ask until a line is right; -> exit status."""
    translate = language.translator()
    print(
        "\n".join(
            [
                *names(options.code, options.unit, options.table),
                translate("in this order, with , between them; an empty place keeps the default"),
            ]
        ),
        file=sys.stderr,
    )
    letters = ",".join(field.letter for field in entry.fields(options.code, options.table))
    text = ""
    while True:
        try:
            text = answer(f"{options.code} {letters}> ", text)
        except EOFError:
            print(file=sys.stderr)
            return 1
        if text.strip() == ASK:
            print("\n".join(names(options.code, options.unit, options.table)), file=sys.stderr)
            text = ""
            continue
        try:
            print(made(options, text))
            return 0
        except CycleError as error:
            print(explained(error), file=sys.stderr)


def answer(prompt, before):
    """A line of the terminal, beginning with the one before so that it can be corrected.  Raises EOFError."""
    if not sys.stdout.isatty():  # only the result goes there
        print(prompt, end="", file=sys.stderr, flush=True)
        text = sys.stdin.readline()
        if not text:
            raise EOFError
        return text.rstrip("\n")
    try:
        import readline
    except ImportError:
        return input(prompt)
    readline.set_startup_hook(lambda: readline.insert_text(before))
    try:
        return input(prompt)
    finally:
        readline.set_startup_hook(None)
