# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads a whole program with LinuxCNC's own interpreter: blocks of records, as they come.

Called by check/answer.py, and by all that reads a whole program: rewrite, resume, set-up, panel, filter.  The
interpreter runs in a process of its own (reader_runner.py has the records), on the machine of an INI file: remaps, tool
table, work offsets of the parameter file, SUBROUTINE_PATH.  Nothing of the machine is written.

    with Reader(program, ini) as reader:
        for records in reader:          # (n, WIDTH) float64
            ..
        reader.messages                 # [[line, text], ..] of the program

Raises Unreadable, with file, line, problem and remedy, for a program that cannot be read.
"""

import contextlib
import json
import os
import select
import signal
import struct
import subprocess
import time
from dataclasses import dataclass
from typing import Optional, TypedDict

import numpy as np

from chipwise.program import program_code
from chipwise.program.program_file import (
    MAX_BYTES,
    Unfinished,
    Unreadable,
    Unsafe,
    Unusable,
    check_file,
    lacking,
    only_sub,
    readable,
)
from chipwise.program.records import WIDTH
from chipwise.host.clock import patience
from chipwise.errors import CycleError, unnamed
from chipwise.ini import section_of, usable
from chipwise.program import rs274
from chipwise.host.temp_folder import OwnFolder, check_room, put, writing
from chipwise.host.processes import tree_cpu_s
from chipwise.settings import load_settings

PYTHON = "/usr/bin/python3"
RUNNER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "reader_runner.py")

MAX_MOVES = 50_000_000
QUIET_S = 20  # computing time without a block of moves
CPU_S = 600  # computing time of the interpreter
STUCK_S = 30.0  # without computing: the process waits for something that never comes
CHORD_MM = 0.002  # sag of the chords of arcs
LENGTHS = "XYZABCUVW"
MOST_POCKET = 1000  # of LinuxCNC's tool table


class Machine:
    """The machine of an INI file.  Raises Unreadable if it cannot be used.  tool: number of the tool in the spindle at
    the beginning, 0: none; codes: the two lines that are executed before the program; block_delete: whether lines with
    / are left out; diameters: {number:  mm} of tools that the tool table has none of; spindle: number of the one
    that is taken to be in the spindle, or None (assumed/); added: numbers of tools that are read as if the tool table
    had them, without a diameter (check/answer.py); limits: machine.limits.axis_limits() if they are to be judged."""

    tool = 0
    diameters: dict = {}
    spindle: Optional[int] = None
    block_delete = False
    added: tuple = ()
    limits: tuple = ()

    def __init__(self, ini):
        self.ini = os.path.abspath(ini)
        self.folder = os.path.dirname(self.ini)
        try:
            self.text = usable(self.ini)
            lines = self.text.splitlines()
            section = {
                name: section_of(lines, name)
                for name in ("TRAJ", "DISPLAY", "EMCIO", "RS274NGC", "AXIS_X", "AXIS_Y", "AXIS_Z")
            }
            self.unit_mm = rs274.units_in_mm(section["TRAJ"].get("LINEAR_UNITS", "mm"))
        except OSError as error:
            included = error.filename not in (None, self.ini)
            raise Unreadable(
                f"INI file {ini}: {f'#INCLUDE {error.filename}: ' if included else ''}{error.strerror}",
                "correct the line" if included else "name the machine's INI file with --ini",
            ) from error
        except rs274.Rs274Error as error:
            raise Unreadable(f"INI file {ini}: {error}", "") from error
        self.places = program_code.Places.of(lines, self.folder)
        self.table = self._path(section["EMCIO"].get("TOOL_TABLE"))
        self.random = section["EMCIO"].get("RANDOM_TOOLCHANGER", "0").strip() == "1"
        self.parameters = self._path(section["RS274NGC"].get("PARAMETER_FILE"))
        self.codes = ["G20" if self.unit_mm > 10 else "G21", section["RS274NGC"].get("RS274NGC_STARTUP_CODE", "")]
        coordinates = section["TRAJ"].get("COORDINATES", "XYZ").upper()
        self.axis_mask = sum(1 << k for k, letter in enumerate(LENGTHS) if letter in coordinates) or 7
        self.speeds = [
            self._number(section[f"AXIS_{a}"].get("MAX_VELOCITY"), section["TRAJ"].get("MAX_LINEAR_VELOCITY"))
            for a in "XYZ"
        ]
        self.accels = [
            self._number(section[f"AXIS_{a}"].get("MAX_ACCELERATION"), section["TRAJ"].get("MAX_LINEAR_ACCELERATION"))
            for a in "XYZ"
        ]
        self.max_override = (self._number(section["DISPLAY"].get("MAX_FEED_OVERRIDE")) or self.unit_mm) / self.unit_mm

    @property
    def has_y(self):
        """Whether it has Y: a lathe has none."""
        return bool(self.axis_mask & 2)

    @property
    def unit(self):
        """ "mm" or "in", for messages."""
        return "in" if self.unit_mm > 10 else "mm"

    def own_code(self, program):
        """Paths of the machine's own files whose Python is executed; None: all Python is.  Raises Unsafe for a program
        that runs some, or a shell."""
        allowed = runs_python(self.ini)
        code = program_code.first_code([program], self.places, not allowed)
        if code:
            text, line = code.sentence(program)
            raise Unsafe(text, code.remedy, line)
        return None if allowed else program_code.of_machine(self.text.splitlines(), self.places, [program])

    def _path(self, name):
        return os.path.join(self.folder, os.path.expanduser(name)) if name else ""

    def _number(self, *texts):
        """The first number above 0 of the texts, in mm; None without one."""
        for text in filter(None, texts):
            try:
                value = float(text)
            except ValueError:
                continue
            if 0 < value < 1e9:
                return value * self.unit_mm
        return None


def runs_python(ini):
    """Whether the owner of the machine lets programs run Python; no, if its settings cannot be read."""
    try:
        return load_settings(ini)["PROGRAM_PYTHON"]
    except CycleError:
        return False


class Limits(TypedDict, total=False):
    """What bounds the reading of a program: as in Reading."""

    quiet_s: float
    cpu_s: float
    most_moves: int
    most_bytes: int
    memory_mb: Optional[int]


@dataclass(frozen=True)
class Reading:
    """How a program is read."""

    quiet_s: float = QUIET_S
    cpu_s: float = CPU_S
    most_moves: int = MAX_MOVES
    most_bytes: int = MAX_BYTES  # of the file
    memory_mb: Optional[int] = None
    written: bool = False
    judged: bool = True  # False: codes that cannot be judged are read over, to see whether the program has an end
    watched: Optional[dict] = (
        None  # of a marked program (executed_words.py), whose items are in Reader.trace at the end
    )
    targets: bool = False  # with the contours of G77, G78 and G79
    needs_end: bool = False  # whether one without M2 is refused, else it is read and noted
    clamps: bool = False  # with its CLAMP comments


class Reader:
    """One program under way; `how`: fields of a Reading."""

    def __init__(self, program, machine, stock=None, **how):
        self.program, self.machine, self.messages = os.path.abspath(program), machine, []
        self.notes = []  # [[line, text], ..] about how it was read
        # whether a zero that is probed before the first cut carries the stock, so that `stock` counts from there
        self.carries_stock = False
        self.trace = None
        self._stock, self._how = stock, Reading(**how)
        self._needs_end = self._how.needs_end or self._how.written
        self._quiet_s = min(self._how.quiet_s, 0.8 * self._how.cpu_s)
        self._child = self._folder = None

    def __enter__(self):
        check_file(self.program, self._how.most_bytes)
        self._own_code = self.machine.own_code(self.program)
        self._folder = OwnFolder("check")
        try:
            self._start(self._folder.name)
        except BaseException:
            self._folder.cleanup()
            raise
        return self

    def _start(self, folder):
        machine = self.machine
        ini = put(folder, "machine.ini", rs274.usable_elsewhere(machine.text, machine.folder))
        parameters = b"5161 0\n"
        if machine.parameters:
            with contextlib.suppress(OSError), open(machine.parameters, "rb") as file:
                parameters = file.read(1 << 20) or parameters
        order = json.dumps(
            {
                "program": readable(self.program, folder),
                "parameters": put(folder, "machine.var", parameters),
                "table": self._table(folder),
                "random": machine.random,
                "units_per_mm": 1.0 / machine.unit_mm,
                "axis_mask": machine.axis_mask,
                "quiet_s": self._quiet_s,
                "codes": machine.codes,
                "most_moves": self._how.most_moves,
                "cpu_s": self._how.cpu_s,
                "stock": self._stock,
                "chord_mm": CHORD_MM,
                "written": self._how.written,
                "judged": self._how.judged,
                "own_code": self._own_code,
                "memory_mb": self._how.memory_mb,
                "tool": machine.tool,
                "watched": self._how.watched,
                "targets": self._how.targets,
                "block_delete": machine.block_delete,
                "diameters": machine.diameters,
                "spindle": machine.spindle,
                "clamps": self._how.clamps,
            }
        )
        environment = {**os.environ, "HOME": folder, "INI_FILE_NAME": ini, "LC_ALL": "C", "OPENBLAS_NUM_THREADS": "1"}
        with writing():
            self._errors = open(os.path.join(folder, "errors"), "w+b")
        self._child = subprocess.Popen(
            [PYTHON, "-s", RUNNER, str(os.getpid())],
            env=environment,
            cwd=machine.folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
        )
        with contextlib.suppress(BrokenPipeError):
            self._child.stdin.write(order.encode())
            self._child.stdin.close()

    def _table(self, folder):
        """Path of the tool table."""
        machine, text = self.machine, b""
        if not machine.added:
            return machine.table
        with contextlib.suppress(OSError), open(machine.table, "rb") as file:
            text = file.read(1 << 20)
        lines = "".join(f"T{number} P{MOST_POCKET - k}\n" for k, number in enumerate(machine.added))
        return put(folder, "tools.tbl", text + b"\n" + lines.encode())

    def __exit__(self, *_):
        if self._child is not None:
            self._child.kill()
            self._child.wait()
            self._child.stdout.close()
            self._errors.close()
        self._folder.cleanup()

    # ---- blocks ---------------------------------------------------------------------------------------------

    def _read(self, count):
        """So many bytes; b"" if the child has ended before."""
        data, had, since = bytearray(), None, time.monotonic()
        handle = self._child.stdout.fileno()
        while len(data) < count:
            if not select.select([handle], [], [], 1.0)[0]:
                now = tree_cpu_s(self._child.pid)  # cycles are planned in a process of their own
                if now != had:
                    had, since = now, time.monotonic()
                elif time.monotonic() - since > patience(STUCK_S):
                    raise Unusable(
                        "it waits for a file or a program that does not answer",
                        "look at the files that it calls on the SUBROUTINE_PATH",
                    )
                continue
            part = os.read(handle, count - len(data))
            if not part:
                return b""
            data += part
        return bytes(data)

    def __iter__(self):
        while True:
            head = self._read(5)
            if not head:
                self._ended()
            (size,) = struct.unpack("=I", head[1:])
            data = self._read(size)
            if len(data) < size:
                self._ended()
            if head[:1] == b"E":
                self._end(json.loads(data))
                return
            if data:
                yield np.frombuffer(data, np.float64).reshape(-1, WIDTH)

    def _ended(self):
        """Raise Unreadable for a child that has ended without its last block."""
        status = self._child.wait()
        if status == -signal.SIGPROF:
            raise Unfinished(
                f"it does not end: {self._quiet_s:g} s of computing time without a move",
                "look for an O-word loop without an end",
            )
        if status == -signal.SIGXCPU:
            raise Unfinished(
                f"reading it needs more than {self._how.cpu_s:g} s of computing time",
                "look for an O-word loop without an end, or raise --time-limit",
            )
        check_room(self._folder.name, status)
        self._errors.seek(0, os.SEEK_END)
        self._errors.seek(max(0, self._errors.tell() - 4096))
        said = self._errors.read().decode("utf-8", "replace").strip().splitlines() or [f"status {status}"]
        raise Unusable(f"LinuxCNC's interpreter ended ({said[-1]})", "see whether `rs274 -g` reads it")

    def _end(self, end):
        self.messages, self.notes, self.trace, self.carries_stock = (
            end["messages"],
            end["notes"],
            end["trace"],
            end["carries"],
        )
        if end["stop"]:
            line, text, remedy, unfinished = end["stop"]
            raise (Unfinished if unfinished else Unreadable)(text, remedy, line)
        if end["error"] and (found := lacking(end["error"][1], end["error"][0])):
            raise found
        sub = (
            only_sub(self.program)
            if not end["moves"] and (not end["error"] or "program end" in end["error"][1])
            else ""
        )
        if sub and end["error"]:
            raise Unusable(f"it has no moves and no end, it defines the sub {sub} only", "name a program that calls it")
        if sub:
            raise Unreadable(f"it has no moves, it defines the sub {sub} only", "name a program that calls it")
        if end["error"] and end["moves"] and not self._needs_end and "program end" in end["error"][1]:
            self.notes.append(
                [
                    end["error"][0],
                    "it has no M2, M30 or second %: LinuxCNC reports an error where it ends; end it with M2",
                ]
            )
        elif end["error"]:
            line, text = end["error"]
            text = unnamed(text.strip())
            remedy = "end it with M2" if "program end" in text else "" if ";" in text else "correct the line"
            raise Unusable(text, remedy, line)
        if end["moves"] == 0:
            raise Unreadable("it has no moves", "name a G-code program")
