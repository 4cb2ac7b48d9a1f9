# SPDX-License-Identifier: GPL-2.0-or-later
"""A typed line as the machine would plan it: what moves, over which contour, in which stock.  No machine is needed.

Called by cli/enter.py and the panel; drawing/entered.py draws it.

A program is written around the line (units, tool, position, then the line) and read by LinuxCNC's own interpreter with
the remaps of the INI file (program/reader.py): the cycle itself plans, nothing of it is repeated here.  A program of
the user's gives the subs and the WORKPIECE and SURFACE comments; its other lines are blank in the copy, so that
messages have its line numbers.  Chop lines are the cuts that are not there with H0.
"""

import os
import re
from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from chipwise.program.program_file import Unreadable
from chipwise.program.reader import Machine, Reader
from chipwise.program.records import ARC, FEED, FRAME, RAPID, STOCK, TOOL, Frame
from chipwise.contour_sub import read
from chipwise.program.find_sub import o_word, plain_text
from chipwise.contour_sub.job import Job
from chipwise.entry.table import EntryField, fields
from chipwise.errors import MM_PER_INCH, CycleError, braceless
from chipwise.host.files import read_bytes
from chipwise.ini import values_of
from chipwise.host.temp_folder import OwnFolder, put
from chipwise.settings import load_settings
from chipwise.program.sub_process import decimal
from chipwise.tool_data.table import numbers

MAX_BYTES = 1 << 26  # of the program with the subs
MAX_MOVES = 200_000  # of one line
CPU_S = 60  # computing time of one line, the plan included
NEAR_MM = 1e-6
_KEPT = re.compile(r"\(\s*(WORKPIECE|SURFACE)\s*,", re.IGNORECASE)
_FILE = re.compile(r"(FILE\s*=\s*)([^,)]+)", re.IGNORECASE)
_TOOL = re.compile(r"t(\d+)")
_WORD = re.compile(r"\b([A-Z])(?=-?[0-9.])|\bword ([A-Z])\b")
_LINE = re.compile(r" \(line \d+\)$")  # of the program around the typed line: not the user's
_SHAPED = ("G77", "G78", "G79")  # codes with a contour sub in Q
CHOPPED = ("G12", "G13", "G78")
_KINDS = {RAPID: "rapid", FEED: "line", ARC: "arc"}
DRAWN = ("G12", "G13", "G24", "G75", "G77", "G78", "G79", "M250")


@dataclass(frozen=True)
class Scene:
    """Where the line is run.

    ini         path of the machine's INI file
    unit        "mm" or "in": G21 or G20
    program     path of the program with subs and comments, "" for none
    tool        number of the tool; 0: the first of the program, else of the tool table
    at          (x, y, z) of the tool before the line, mm
    numbered    ((number, value), ..) parameters that a program would have set; named: ((name, value), ..)
    """

    ini: str
    unit: str = "mm"
    program: str = ""
    tool: int = 0
    at: tuple = (0.0, 0.0, 5.0)
    numbered: tuple = ()
    named: tuple = ()

    @property
    def unit_mm(self) -> float:
        """mm of a unit of the line."""
        return MM_PER_INCH if self.unit == "in" else 1.0


@dataclass(frozen=True)
class Run:
    """Moves of one kind, one behind the other: kind "cut", "chop" or "rapid"; points (n, 3) mm, work coordinates, n at
    least 2."""

    kind: str
    points: np.ndarray


@dataclass(frozen=True)
class Planned:
    """What a line does.

    line; scene; tool: number; diameter: of the tool, mm; runs: (Run, ..); loops: ((n, 2) mm, ..) of the contour sub;
    stock: (low, high) of M250, mm, None without; messages: of the code
    """

    line: str
    scene: Scene
    tool: int
    diameter: float
    runs: tuple = ()
    loops: tuple = ()
    stock: Optional[tuple] = None
    messages: tuple = ()

    def length(self, *kinds: str) -> float:
        """Length of the moves of these kinds, mm."""
        return float(
            sum(np.linalg.norm(np.diff(run.points, axis=0), axis=1).sum() for run in self.runs if run.kind in kinds)
        )


class PlanError(CycleError):
    """A line that its code refuses; field: the datum that its message names, None if it names none."""

    def __init__(self, problem: str, field: Optional[EntryField], number: int):
        self.field, self.number = field, number
        super().__init__(braceless(problem))


def plan(scene: Scene, line: str, path: Optional[str] = None) -> Planned:
    """What a line does on the machine of a Scene.  path as in table.load_table.  Raises PlanError or CycleError."""
    code = line.split()[0]
    found, moves = _read(scene, line, path)
    if code in CHOPPED and " H" not in line:
        moves = _with_chops(moves, _read(scene, line + " H0", path)[1])
    return replace(found, runs=_runs(moves), loops=_loops(scene, line, found) if code in _SHAPED else ())


def field_of(code: str, text: str, path: Optional[str] = None) -> tuple:
    """(place from 1, EntryField) of the datum that a message of a code names first; (0, None) if it names none."""
    known = fields(code, path)
    letters = [field.letter for field in known]
    for match in _WORD.finditer(text.partition(";")[0]):
        letter = match.group(1) or match.group(2)
        if letter in letters:
            return letters.index(letter) + 1, known[letters.index(letter)]
    return 0, None


# ---- the program around the line --------------------------------------------------------------------------------


def _read(scene, line, path):
    """(Planned without runs and loops, [Move, ..])."""
    try:
        machine = Machine(scene.ini)
    except Unreadable as error:
        raise _refused(line.split()[0], str(error), path) from error
    _check_remap(machine, line.split()[0])
    kept, before = _program(scene, machine)
    with OwnFolder("enter") as folder:
        program = put(
            folder, os.path.basename(scene.program) or "line.ngc", "\n".join([*kept, *before, line, "M2", ""])
        )
        try:
            with Reader(program, machine, most_moves=MAX_MOVES, cpu_s=CPU_S) as reader:
                records = np.concatenate([np.empty((0, 10)), *reader])
        except Unreadable as error:
            raise _refused(line.split()[0], str(error), path) from error
        messages = tuple(_LINE.sub("", text) for _line, text in reader.messages)
    return _planned(scene, line, records, len(kept) + len(before), messages)


def _check_remap(machine, code):
    """CycleError for a code that the machine does not have."""
    remaps = values_of(machine.text.splitlines(), "RS274NGC", "REMAP")
    if code not in [text.split()[0].upper() for text in remaps if text]:
        raise CycleError(
            "{file} has no REMAP for {name}, so LinuxCNC does not know it there",
            "name another machine with --ini, or add the line of configs/chipwise_codes.inc",
            file=os.path.basename(machine.ini),
            name=code,
        )


def _refused(code, text, path):
    """PlanError of what the interpreter said."""
    text = _LINE.sub("", text).removeprefix(f"{code}: ")
    number, field = field_of(code, text, path)
    error = PlanError(text, field, number)
    error.code = code
    return error


def _program(scene, machine):
    """(lines of the user's program that count, lines before the typed one)."""
    text = ""
    if scene.program:
        try:
            text = read_bytes(scene.program, MAX_BYTES).decode("utf-8", "surrogateescape")
        except OSError as error:
            raise CycleError(
                braceless(f"{scene.program}: {error.strerror}"), "name a G-code file that can be read"
            ) from error
    lines = text.replace("\r\n", "\n").split("\n") if text else []
    tool = (
        scene.tool
        or next((int(n) for raw in lines for n in _TOOL.findall(plain_text(raw))), 0)
        or next(iter(numbers(machine.table)), 0)
    )
    if not tool:
        raise CycleError("no tool is named, and the tool table has none", "use --tool N")
    place = " ".join(f"{letter}{decimal(value / scene.unit_mm)}" for letter, value in zip("XYZ", scene.at))
    parameters = [f"#{number} = {decimal(value)}" for number, value in scene.numbered] + [
        f"#<{name}> = {decimal(value)}" for name, value in scene.named
    ]
    modes = f"{'G20' if scene.unit == 'in' else 'G21'} G17 G40 G80 G90 G91.1 G94"
    return _kept(lines, scene.program), [
        modes,
        f"T{tool} M6",
        *parameters,
        "F1000" if scene.unit == "mm" else "F40",
        f"G0 {place}",
    ]


def _kept(lines, path):
    """The lines of a program: its subs and comments, the others blank."""
    kept, inside = [], None
    for raw in lines:
        word = o_word(raw)
        if inside is None and word and word[1] == "sub":
            inside = word[0]
        comment = inside is None and _KEPT.search(raw)
        kept.append(
            raw
            if inside is not None
            else _with_folder(raw[comment.start() :].partition(")")[0] + ")", path)
            if comment
            else ""
        )
        if word == (inside, "endsub"):
            inside = None
    return kept


def _with_folder(comment, path):
    """A comment whose FILE is found from elsewhere, too."""
    folder = os.path.dirname(os.path.abspath(path))
    return _FILE.sub(lambda match: match.group(1) + _absolute(folder, match.group(2).strip()), comment)


def _absolute(folder, name):
    """A file beside the program by its whole path; any other name, and one whose path a comment cannot hold, as it
    is."""
    found = os.path.join(folder, os.path.expanduser(name))
    return found if os.path.exists(found) and not set("(),\n") & set(found) else name


# ---- what the interpreter did ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Move:
    """One straight move or chord: kind "rapid", "line", "arc" or "chop"; start, end: (x, y, z) mm, work coordinates."""

    kind: str
    start: tuple
    end: tuple


def _planned(scene, line, records, start_line, messages):
    """(Planned without runs and loops, [Move, ..]) from the records; those of the line that goes to the start do not
    count."""
    frame, tool, stock, here = Frame(), (0, 0.0), None, tuple(scene.at)
    moves: list = []
    for record in records:
        kind = int(record[0])
        if kind == FRAME:
            frame = Frame.of(record[2:9])
        elif kind == TOOL:
            tool = int(record[2]), float(record[3])
        elif kind == STOCK and record[2] >= 0:
            stock = tuple(np.array(frame.to_work(record[k : k + 3])) for k in (4, 7))
        elif kind in _KINDS:
            there = tuple(map(float, frame.to_work(record[2:5])))
            if record[1] != start_line or moves:
                moves.append(_Move(_KINDS[kind], here, there))
            here = there
    return Planned(line, scene, tool[0], tool[1], (), (), stock, messages), moves


def _runs(moves):
    """The moves as runs."""
    found: list = []
    for move in moves:
        kind = {"line": "cut", "arc": "cut"}.get(move.kind, move.kind)
        if not found or found[-1][0] != kind:
            found.append((kind, [move.start]))
        found[-1][1].append(move.end)
    return tuple(Run(kind, np.array(points)) for kind, points in found)


def _with_chops(moves, plain):
    """The moves, the level straight cuts that are not on a straight cut of the plan without chop lines as "chop"."""
    lines = [move for move in plain if _is_level_cut(move)]
    known = {_key(move) for move in lines}
    start, end = (np.array([getattr(move, name)[:2] for move in lines]).reshape(-1, 2) for name in ("start", "end"))
    return [
        replace(move, kind="chop")
        if _is_level_cut(move) and _key(move) not in known and not _is_on(move, start, end)
        else move
        for move in moves
    ]


def _is_level_cut(move):
    """Whether a move is a straight cut in XY."""
    return move.kind == "line" and abs(move.end[2] - move.start[2]) < NEAR_MM < np.hypot(
        move.end[0] - move.start[0], move.end[1] - move.start[1]
    )


def _key(move):
    """Both ends, to NEAR_MM."""
    return tuple(np.round(np.array((move.start, move.end)) / NEAR_MM).astype(np.int64).ravel().tolist())


def _is_on(move, start, end):
    """Whether the middle of a move is on one of the lines from start to end, (n, 2) mm."""
    if not len(start):
        return False
    middle = (np.array(move.start[:2]) + np.array(move.end[:2])) / 2
    along = end - start
    t = np.clip(((middle - start) * along).sum(axis=1) / (along * along).sum(axis=1), 0.0, 1.0)
    return bool((np.hypot(*(start + t[:, None] * along - middle).T) < 1e-3).any())


def _loops(scene, line, found):
    """Points of the loops of a line's contour sub."""
    from chipwise.geometry.base.chains import flat

    sub = next(int(word[1:]) for word in line.split()[1:] if word[0] == "Q")
    machine_unit = Machine(scene.ini).unit_mm
    shape = read.read_shape(
        Job(
            program=scene.program,
            sub=sub,
            ini=os.path.abspath(scene.ini),
            unit=scene.unit,
            machine_unit=machine_unit,
            position=scene.at,
            tool=(found.tool, found.diameter / machine_unit),
            numbered=scene.numbered,
            named=scene.named,
            close_gap=load_settings(scene.ini)["CLOSE_GAP"],
        )
    )
    return tuple(flat(contour.elements, 0.01) for contour in read.contours(shape))
