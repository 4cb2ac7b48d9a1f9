# SPDX-License-Identifier: GPL-2.0-or-later
"""What check, rewrite and filter have in common: the machine, the stock and the limits a program is read with;
progress.

Called by cli/check.py, cli/rewrite.py and cli/filter.py.
"""

import os
import shutil
import sys

from chipwise import ROOT
from chipwise.errors import CycleError, printable
from chipwise.host.files import open_regular

BAR = 30  # characters
CELLS_MM = 0.01, 10.0
LIMITS_S = 1, 1e6


class CommandError(Exception):
    """Printed as `chipwise: TEXT`: problem, value with unit, rule, remedy."""

    status = 1  # of the process


class UsageError(CommandError):
    """The command line cannot be carried out."""

    status = 2


def refuser(name):
    """-> refuse(text) of a subcommand: argparse's own complaints in our form, too."""

    def refuse(text):
        raise UsageError(f"{name}: {text}; see chipwise {name} --help")

    return refuse


def require_file(path, remedy, what=""):
    """Raise UsageError for what cannot be read as a file."""
    try:
        open_regular(path, sys.maxsize).close()
    except OSError as error:
        raise UsageError(f"{what}{printable(path)}: {error.strerror}; {remedy}") from error


def add_machine_options(parser, refuse):
    """--ini, --stock, --cell, --time-limit."""
    add_ini(parser)
    parser.add_argument(
        "--stock",
        nargs=6,
        type=float,
        metavar=("X0", "Y0", "Z0", "X1", "Y1", "Z1"),
        help="corners of the stock for programs without M250: machine units, work coordinates of the first move",
    )
    parser.add_argument("--cell", type=float, metavar="MM", help="cell of the stock model (default: [CHIPWISE]CELL)")
    parser.add_argument(
        "--time-limit", type=float, default=600.0, metavar="S", help="computing time for one program (default: 600)"
    )
    parser.error = refuse


def add_ini(parser):
    parser.add_argument("--ini", metavar="INI", help="the machine (default: INI_FILE_NAME, else configs/mill.ini)")


def add_file_of_machine(parser, key, what):
    """--ini and --file of file_of_machine(); what: is in the file."""
    parser.add_argument("--ini", metavar="INI", help="the machine (default: INI_FILE_NAME)")
    parser.add_argument("--file", metavar="FILE", help=f"file of the {what} (default: [CHIPWISE]{key} of the INI file)")


def file_of_machine(options, key, refuse):
    """Path of --file, else of the file that [CHIPWISE] of the machine names by a key; where no machine is named it is
    refused."""
    if options.file:
        return options.file
    from chipwise.settings import load_settings  # no work of commands that need none

    settings = load_settings(options.ini)
    if not settings.folder and not (options.ini or os.environ.get("INI_FILE_NAME")):
        refuse("no machine is named; use --ini INI or --file FILE")
    return settings.path(key)


def ini_of(options):
    """Path of the machine's INI file."""
    return options.ini or os.environ.get("INI_FILE_NAME") or os.path.join(ROOT, "configs", "mill.ini")


def machine_of(options, refuse):
    """Arguments of answer.check (a Checking) and rewrite.run from the options: machine, stock, cell, cpu_s."""
    from chipwise.program.reader import Machine, Unreadable

    low, high = CELLS_MM
    if options.cell is not None and not low <= options.cell <= high:
        refuse(f"--cell {options.cell:g} is not a length from 0.01 to 10 mm")
    low, high = LIMITS_S
    if not low <= options.time_limit <= high:
        refuse(f"--time-limit {options.time_limit:g} is not from 1 to 1000000 s")
    try:
        machine = Machine(ini_of(options))
    except Unreadable as error:
        refuse(str(error).partition("; see")[0])
    say_old_rates(machine)
    return {
        "machine": machine,
        "stock": stock_of(options.stock, machine.unit_mm, refuse),
        "cell": options.cell,
        "cpu_s": int(options.time_limit),
    }


def say_old_rates(machine):
    """Name the tools whose rate is in the old unit, on standard error."""
    from chipwise.settings import load_settings
    from chipwise.tool_data.geometry import old_rates

    try:
        notes = old_rates(load_settings(machine.ini).path("TOOL_GEOMETRY"))
    except CycleError:  # whoever needs the settings says why
        return
    for note in notes:
        print(printable(f"chipwise: {note}"), file=sys.stderr)


def stock_of(corners, unit_mm, refuse):
    """--stock -> (low, high) mm."""
    if corners is None:
        return None
    low, high = ([value * unit_mm for value in corners[k : k + 3]] for k in (0, 3))
    for axis, a, b in zip("XYZ", low, high):
        if not 1e-3 <= b - a <= 1e5:
            refuse(f"--stock: the stock has no extent in {axis}; give X0 Y0 Z0 (minimum) and X1 Y1 Z1 (maximum)")
    return low, high


def tool_of(number, diameter, machine, refuse, name="--diameter"):
    """--tool, --diameter (its name) -> arguments of answer.check and run.rewritten."""
    from chipwise.program.post_comments import SIZES_MM
    from chipwise.tool_data.geometry import MAX_DIGITS

    if number is not None and not 1 <= number < 10**MAX_DIGITS:
        refuse(f"--tool {number} is not a tool number")
    across = diameter and diameter * machine.unit_mm
    if diameter is not None and not SIZES_MM[0] <= across <= SIZES_MM[1]:
        refuse(f"{name} {diameter:g} is not a diameter of a tool")
    machine.tool = number or 0
    return {"tool": number, "diameter": across}


class Progress:
    """A bar on a terminal; as the filter of a GUI FILTER_PROGRESS= lines, at most 100; elsewhere nothing."""

    def __init__(self, stream, is_filter=None):
        """is_filter: None: whether a GUI of LinuxCNC has started this, which sets AXIS_PROGRESS_BAR."""
        self.stream, self.terminal, self.shown, self.drawn = stream, stream.isatty(), 0, False
        self.is_filter = "AXIS_PROGRESS_BAR" in os.environ if is_filter is None else is_filter

    def __call__(self, share):
        percent = min(99, int(100 * share))
        if percent <= self.shown:
            return
        self.shown = percent
        if self.terminal:
            room = max(5, min(BAR, shutil.get_terminal_size().columns - 10))
            full = room * percent // 100
            self.stream.write(f"\r[{'#' * full}{'.' * (room - full)}] {percent} %")
            self.drawn = True
        elif self.is_filter:
            self.stream.write(f"FILTER_PROGRESS={percent}\n")
        self.stream.flush()

    def clear(self):
        """Before something else is printed."""
        if self.drawn:
            self.stream.write("\r\033[K")
            self.stream.flush()
            self.drawn = False

    end = clear
