# SPDX-License-Identifier: GPL-2.0-or-later
"""Go on with a program that was interrupted: after an abort, an E-stop, a crash, a power loss or a broken tool.

The stock that [CHIPWISE]KEEP_STOCK has kept says where: the first move whose cut is not done. The new program retracts,
restores that stock (M254), has the tool, offsets, spindle, coolant and modes of that place, comes down where the tool
has cut, and goes on along the path; the lines behind it keep their text. The plan is printed before anything is
written. What is not certain is refused: another or an edited program, other offsets or tools, a damaged file.

Exit status: 0 done, 2 it cannot go on; nothing is written then.
"""

import os
import sys

from chipwise.options.machine import add_ini, ini_of, refuser
from chipwise.cli.output import check_outputs, write_output
from chipwise.errors import of_unexpected, printable, unnamed
from chipwise.host.processes import exit_on_sigterm

NAME = "resume"
HELP = "go on with a program that was interrupted, from the stock that is kept"
MOST_S = 3600.0

refuse = refuser(NAME)


def add_arguments(parser):
    parser.add_argument("program", metavar="PROGRAM", help="the program that was interrupted")
    parser.add_argument("-o", "--output", metavar="OUT.ngc", help="the program that goes on")
    parser.add_argument("--plan", action="store_true", help="say what it would do, and write nothing")
    parser.add_argument(
        "--line", type=int, metavar="N", help="go on before line N; the stock is the program's up to there"
    )
    parser.add_argument(
        "--time",
        type=float,
        metavar="S",
        help="go on so many seconds of program time before the stop: nothing was cut since",
    )
    parser.add_argument(
        "--tool-broke",
        action="store_true",
        help="the tool broke: at --line or --time, else at an unknown moment since it was put in",
    )
    add_ini(parser)
    parser.add_argument(
        "--time-limit", type=float, default=600.0, metavar="S", help="computing time for the program (default: 600)"
    )
    parser.error = refuse


def run(options):
    """-> exit status."""
    from chipwise.program.reader import Unreadable
    from chipwise.host.temp_folder import FolderError, OwnFolder
    from chipwise.resume.run import Different

    check_options(options)
    exit_on_sigterm()
    try:
        with OwnFolder(NAME) as folder:
            return of_machine(options, folder)
    except Unreadable as error:
        return failed(options.program, str(error), error.line)
    except Different as error:
        return failed(options.program, f"{error}: nothing is written; please report it with the program")
    except FolderError as error:
        return failed(options.program, unnamed(error))
    except MemoryError:
        return failed(options.program, "the memory is not enough for it")
    except Exception as error:
        if os.environ.get("CHIPWISE_TRACEBACK"):
            raise
        return failed(options.program, of_unexpected(error))


def of_machine(options, folder):
    """-> exit status.  Raises Unreadable, Different, FolderError."""
    from chipwise.resume.run import Order, resumed
    from chipwise.resume.running import machine_here

    machine = machine_here(ini_of(options), folder)
    if not machine.has_y:
        return of_lathe(options, machine.ini)
    found = resumed(
        options.program,
        Order(options.line, options.time or 0.0, options.tool_broke),
        machine,
        cpu_s=int(options.time_limit),
    )
    for sentence in found.said:
        print(printable(sentence))
    if options.plan:
        return 0
    sys.stdout.flush()
    found.save()
    write_output(NAME, options.output, found.data)
    print(printable(f"{options.output} is written; look at it in the preview before you start it"))
    return 0


def of_lathe(options, ini):
    """Say what G26 does; -> exit status.  Raises Unreadable."""
    from chipwise.program.reader import Unreadable
    from chipwise.resume.lathe import sentences

    if options.line is not None or options.time is not None or options.tool_broke:
        raise Unreadable(
            "--line, --time and --tool-broke are for mills", "leave them out: G26 knows which cuts the machine has done"
        )
    for sentence in sentences(options.program, ini):
        print(printable(sentence))
    if options.plan:
        return 0
    raise Unreadable("a lathe needs no other program", "start this one again: G26 goes on with the part")


def check_options(options):
    """UsageError for what cannot be meant."""
    if not options.plan and not options.output:
        refuse("-o OUT.ngc is missing: where is the new program to be written")
    if options.time is not None and not 0 < options.time <= MOST_S:
        refuse(f"--time {options.time:g} is not from 0 to {MOST_S:g} s")
    if not 1 <= options.time_limit <= 1e6:
        refuse(f"--time-limit {options.time_limit:g} is not from 1 to 1000000 s")
    if not options.plan:
        check_outputs(
            refuse, {"-o": options.output}, [("the program", options.program), ("the INI file", ini_of(options))]
        )


def failed(program, text, line=0):
    """Print why nothing is written; -> exit status."""
    where = f" (line {line})" if line else ""
    print(printable(f"chipwise: {program}{where}: {text}"), file=sys.stderr)
    return 2
