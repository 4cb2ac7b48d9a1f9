# SPDX-License-Identifier: GPL-2.0-or-later
"""What the programs that run LinuxCNC's interpreter (module gcode) in a process of their own have in common.

Called by contour_sub/runner.py, pattern/runner.py and program/reader_runner.py.  It is the interpreter of AXIS's
preview: full doubles, line numbers, no HAL, no machine.  Read in LinuxCNC 2.9: gcodemodule.cc, rs274/interpret.py.
"""

import ctypes
import os
import resource
import signal
import struct
import sys

import gcode

from chipwise.ini import section_of
from chipwise.program.program_code import RUNS_PYTHON

INCH = 25.4  # mm of the unit the interpreter gives coordinates in
DECIMALS = 9  # of a mm: a program's decimals come out as they went in
PLANES = {1: "G17", 2: "G19", 3: "G18"}
# of a plane: which of its arcs' axes (first, second, along) are X, Y and Z
ARC_AXES = {1: (0, 1, 2), 2: (2, 0, 1), 3: (1, 2, 0)}


class Stop(Exception):
    """The program does what the reader refuses."""


class Canon:
    """Answers to what the interpreter asks; job: dict with units_per_mm, parameters, own_code (parse()) and, unless
    XYZ, axis_mask."""

    wants_targets = False  # chipwise.program.preview

    def __init__(self, job):
        self.job = job

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda *arguments: self.other(name)

    def other(self, name):
        """A call that the reader has no method for."""

    def refuse_python(self, text):
        """The program, or a file that it calls, has run Python.  Keeps it as the reason why the run is stopped."""
        raise NotImplementedError

    def get_external_length_units(self):
        return self.job["units_per_mm"]

    def get_external_angular_units(self):
        return 1.0

    def get_axis_mask(self):
        return self.job.get("axis_mask", 7)

    def get_block_delete(self):
        return self.job.get("block_delete", False)

    def check_abort(self):
        return False

    @property
    def parameter_file(self):
        return self.job["parameters"]


def mm(*inches) -> list:
    """Coordinates of the interpreter in mm."""
    return [round(value * INCH, DECIMALS) for value in inches]


def tool_entry(number, diameter, orientation=0) -> tuple:
    """The numbers of get_tool() of a tool without offsets; diameter in machine units, orientation of a lathe's tool."""
    return (number,) + (0.0,) * 9 + (diameter, 0.0, 0.0, orientation)


def fails_alike(canon, line, text) -> bool:
    """Whether a line alone, as text, gives the error of the canon's program.  Which line an error belongs to, gcode
    says only if the line could be read (2.9)."""
    alone = os.path.join(os.environ["HOME"], "line.ngc")
    with open(alone, "w", encoding="utf-8", errors="surrogateescape") as file:
        file.write(line.rstrip("\n") + "\nM2\n")
    try:
        result, _ = parse(canon, alone)
        return (
            result > gcode.MIN_ERROR and gcode.strerror(result).split(alone)[0] == text.split(canon.job["program"])[0]
        )
    except (Stop, RuntimeError):
        return False


def parse(canon, program) -> tuple:
    """gcode.parse() of a program after the job's codes.  Python that the program itself executes is refused unless
    job["own_code"] is None; else it has the paths of the machine's own files, in which it is executed.

    Most of it is found in the text (program/program_code.py); this sees the rest, as in the file of a sub whose number
    is an expression.  The interpreter executes text and files straight from here, without a frame of Python between;
    remaps are called.  Before it opens a file, it executes what the INI file names."""
    frame, own = sys._getframe(), canon.job["own_code"]

    def refuse(event, arguments):
        if event == "exec" and sys._getframe(1) is frame:
            file = getattr(getattr(sys.modules.get("interpreter"), "this", None), "filename", "")
            if file and os.path.realpath(file) not in own and os.path.realpath(arguments[0].co_filename) != toplevel:
                canon.refuse_python(f"{os.path.basename(file)} {RUNS_PYTHON}")
                raise Stop("Python")

    if own is not None:
        toplevel = os.path.realpath(_toplevel())
        sys.addaudithook(refuse)
    return gcode.parse(program, canon, *canon.job["codes"])


def _toplevel() -> str:
    """Path of the Python that the INI file names, which is executed again when it changes."""
    with open(os.environ["INI_FILE_NAME"], encoding="utf-8", errors="surrogateescape") as file:
        return os.path.expanduser(section_of(file.read().splitlines(), "PYTHON").get("TOPLEVEL", "")) or os.devnull


def own_output() -> int:
    """A handle of standard output for the result alone: (print,..) of a program, which writes there too, goes to
    standard error."""
    result = os.dup(1)
    os.dup2(2, 1)
    return result


def sender(handle: int):
    """Function that writes a block of a kind (one byte) to a handle: its length comes before it."""

    def send(kind: bytes, data: bytes) -> None:
        view = memoryview(kind + struct.pack("=I", len(data)) + data)
        while view:
            view = view[os.write(handle, view) :]

    return send


def limit_computing(seconds: float) -> None:
    """Let the kernel end this process after so much more computing time, also inside C code."""
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGPROF])
    signal.setitimer(signal.ITIMER_PROF, seconds)


def limit_run(seconds: float) -> None:
    """limit_computing(), for a process that the planner has started: it inherits the computing time that the planner is
    lent (planner/client.py), which may be less, and would end without a reason."""
    _soft, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (hard, hard))
    limit_computing(seconds)


def named_function(library: ctypes.CDLL, name: str, mangled: str):
    """A function of LinuxCNC's C++ library: 2.10 exports it under its own name, 2.9 under that of the compiler.  Raises
    AttributeError."""
    return getattr(library, name, None) or getattr(library, mangled)


def make_tool_table(random: bool = False):
    """Make ~/.tool.mmap, which gcode expects a task to have made: 2.9 crashes without.  -> the library, None without
    one: another LinuxCNC, another way of keeping tools."""
    try:
        library = ctypes.CDLL("libtooldata.so.0")
        named_function(library, "tool_mmap_creator", "_Z17tool_mmap_creatorPK13EMC_TOOL_STATi")(None, int(random))
        return library
    except (OSError, AttributeError):
        return None


NO_TOOL = (-1,) + (0.0,) * 12 + (0,)
MAX_POCKETS = 1001  # CANON_POCKETS_MAX of LinuxCNC


def calls_by_number() -> bool:
    """Whether gcode calls change_tool() with the tool's number, as 2.10 does; 2.9 has its index in the table.  What
    differs in gcode is that CHANGE_TOOL() of 2.10 has no index."""
    return hasattr(ctypes.CDLL(gcode.__file__), "_Z11CHANGE_TOOLv")


class ToolTable:
    """LinuxCNC's own reader of tool tables; the table is ~/.tool.mmap of a HOME of this process's own."""

    def __init__(self, path, random):
        self._lib = None
        self._random, self._by_number = random, calls_by_number()
        try:
            lib = make_tool_table(random)
            named_function(lib, "tooldata_init", "_Z13tooldata_initb")(bool(random))
            self._get = named_function(lib, "tooldata_get", "_Z12tooldata_getP16CANON_TOOL_TABLEi")
            load = named_function(lib, "tooldata_load", "_Z13tooldata_loadPKcPPc")
            if path and load(os.fsencode(path), None) == 0:  # 2.10 has no second argument
                self._lib = lib
        except AttributeError:
            pass  # another LinuxCNC, another way of keeping tools

    def entry(self, index):
        """The numbers of get_tool(), machine units; those of no tool if the pocket is empty."""
        if self._lib is None or index < 0:
            return NO_TOOL
        room = ctypes.create_string_buffer(1024)
        if self._get(room, index) != 0:
            return NO_TOOL
        number, _pocket, *lengths = struct.unpack_from("=ii12d", room.raw)
        (orientation,) = struct.unpack_from("=i", room.raw, 8 + 12 * 8)
        return (number, *lengths, orientation)

    def of_number(self, number):
        """entry() of the tool of that number; 0: no tool."""
        return (
            next((tool for tool in map(self.entry, range(1, MAX_POCKETS)) if tool[0] == number), NO_TOOL)
            if number
            else NO_TOOL
        )

    def called(self, word):
        """entry() of the tool that is loaded by change_tool(word)."""
        if self._by_number:
            spindle = self.entry(0) if self._random else NO_TOOL
            return spindle if word and spindle[0] == word else self.of_number(word)
        return self.entry(word) if word > 0 or self._random else NO_TOOL
