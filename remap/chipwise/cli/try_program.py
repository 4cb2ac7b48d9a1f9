# SPDX-License-Identifier: GPL-2.0-or-later
"""Print the canonical motion of a program, chipwise's codes included, without a machine.

LinuxCNC's interpreter `rs274` runs it on the machine of an INI file: its remaps, its subroutine path and its tool
table. Work offsets are 0, whatever the machine has. Nothing is written, and a running LinuxCNC is not disturbed.
"""

import os
import sys

from chipwise.errors import CycleError, printable, unnamed, with_line
from chipwise.headless import runner
from chipwise.program import rs274
from chipwise.program.program_file import Unusable, check_file

NAME = "try"
HELP = "print the motion of a program without a machine"


def add_arguments(parser):
    parser.add_argument("program", help="G-code program")
    parser.add_argument(
        "--ini",
        metavar="INI",
        default=os.path.join(runner.ROOT, "configs", "mill.ini"),
        help="the machine (default: the simulated mill, configs/mill.ini)",
    )


def run(options):
    from chipwise.options.machine import UsageError, require_file

    require_file(options.program, "name a G-code program that can be read")
    try:
        check_file(options.program, sys.maxsize)
    except Unusable as error:
        raise UsageError(with_line(f"{printable(options.program)}: {error}", error.line)) from error
    require_file(options.ini, "name the machine's INI file with --ini", "INI file ")
    try:
        return 1 if rs274.run(options.program, options.ini, to=sys.stdout).returncode else 0
    except (CycleError, rs274.Rs274Error) as error:
        raise UsageError(unnamed(error)) from error
