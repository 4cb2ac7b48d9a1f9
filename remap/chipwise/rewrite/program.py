# SPDX-License-Identifier: GPL-2.0-or-later
"""A program as it is rewritten: its canonical moves in arrays, and what each was written with.

Called by run.py, flute.py, feed.py and read_back.py.  LinuxCNC's own interpreter reads the program (program/reader.py).

A *move* is one chord: a traverse, a straight feed or a chord of an arc.  A *step* is what one word of G-code makes: a
traverse, a straight feed or a whole arc.  All lengths mm, machine coordinates of the tool's tip; feeds mm/min.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Callable, NamedTuple, Optional

import numpy as np

from chipwise.check import rules
from chipwise.program import records
from chipwise.program.reader import Reader, Unreadable
from chipwise.program.executed_words import BEGINS
from chipwise.rewrite.blocks import Blocks, blocks_of
from chipwise.rewrite.growable_array import Growing
from chipwise.rewrite.source import Lines
from chipwise.rewrite.words import only_comment, plain_move, words_of

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Corners, Floats, Ints
    from chipwise.program.executed_words import MarkItem
    from chipwise.program.reader import Limits, Machine
    from chipwise.rewrite.blocks import Block

MOST_MOVES = 4_000_000  # 500 MB
INCH = 25.4  # mm


class Modes(NamedTuple):
    """The modal state that decides how a move is written: numbers of G codes."""

    distance: float = 90
    units: float = 21
    plane: float = 17
    cutter_side: float = 40
    arc_distance: float = 91.1
    cycle: float = 0  # 73, 74, 76, 81 .. 89 while such a cycle is modal, else 0
    diameter: float = 8  # 7: X is a diameter
    synchronised: float = 0  # of SYNCHRONISED while it is modal, else 0
    unclear: bool = False  # a G word on this line is an expression


SYNCHRONISED = {33, 33.1, 74, 76, 84}  # motion that follows the spindle
# which of Modes a G word sets
_SETS = {
    float(code): name
    for name, codes in {
        "distance": (90, 91),
        "units": (20, 21),
        "plane": (17, 18, 19),
        "cutter_side": (40, 41, 41.1, 42, 42.1),
        "arc_distance": (90.1, 91.1),
        "diameter": (7, 8),
        "cycle": (0, 1, 2, 3, 33, 33.1, 73, 74, 76, *range(80, 90)),
    }.items()
    for code in codes
}
_CYCLES = {73, 74, 76, *range(81, 90)}


def after_line(modes: Modes, text: str) -> Modes:
    """Modes after a line of text."""
    own: dict[str, float] = {}
    unclear = False
    for letter, value in words_of(text):
        if letter != "G":
            continue
        if value is None:
            unclear = True
        elif value in _SETS:
            own[_SETS[value]] = value if _SETS[value] != "cycle" or value in _CYCLES else 0
            if _SETS[value] == "cycle":
                own["synchronised"] = value if value in SYNCHRONISED else 0
    return modes._replace(unclear=unclear, **own) if own or unclear or modes.unclear else modes


def modes_by_line(source: Lines, subs: set[int], modes: Modes) -> list[Modes]:
    """[Modes on each line] of a program that is run from the first line to the last; subs: numbers of lines in subs."""
    result = []
    for number, text in enumerate(source, 1):
        if number not in subs and (
            modes.unclear
            or (
                ("G" in text or "g" in text)
                and not only_comment(text)
                and (modes.cycle or modes.synchronised or not plain_move(text))
            )
        ):  # that ends a cycle, no more
            modes = after_line(modes, text)
        result.append(modes)
    return result


@dataclass(frozen=True)
class Circle:
    """An arc: plane 1 XY, 2 YZ, 3 XZ; centre (3,) mm; turns, negative: clockwise."""

    plane: int
    centre: tuple[float, ...]
    turns: float


@dataclass
class Event:
    """A tool, a stock or M251 before move number `at`."""

    at: int
    kind: int
    line: int
    values: list[float]


@dataclass(frozen=True)
class Lead:
    """The first moves of a program, up to where it has named X, Y and Z (rules.Unplaced): known_from: number of the
    first move that is cut, arrives:  whether that one begins anywhere, and counts at its end only; named_from: of the
    first move that has all axes named; notes: [[line, text]]."""

    known_from: int = 0
    arrives: bool = False
    named_from: int = 0
    notes: tuple[list[int | str], ...] = ()


class Moves:
    """Moves of a class that has their kind (n,) int, end (n, 3) mm and lead."""

    kind: np.ndarray
    line: np.ndarray
    end: np.ndarray
    events: list[Event]
    lead: Lead

    @property
    def known_from(self) -> int:
        """Number of the first move that is cut."""
        return self.lead.known_from

    def start(self, move: int) -> Floats:
        """(3,): start of a move. The machine's position before the first is unknown: the first move starts at its
        end."""
        return self.end[move if self.lead.arrives and move == self.lead.known_from else max(move - 1, 0)]


@dataclass
class Program(Moves):
    """n moves, m steps.

    kind, line (n,) int; end (n, 3) mm; feed (n,) mm/min
    step (n,) int: number of the step each move belongs to; first (m + 1,) int: its first move
    circle (m,) int: index in circles, -1: straight; frame (m,) int: index in frames
    """

    path: str
    kind: np.ndarray
    line: np.ndarray
    end: np.ndarray
    feed: np.ndarray
    step: np.ndarray
    first: np.ndarray
    circle: np.ndarray
    frame: np.ndarray
    circles: list[Circle]
    frames: list[records.Frame]
    events: list[Event]
    source: Lines
    modes: list[Modes]  # Modes on each line
    messages: list[list[int | str]] = field(default_factory=list)
    notes: list[list[int | str]] = field(default_factory=list)  # [line, text] about how it was read
    blocks: Blocks = field(default_factory=Blocks)
    place: Optional[np.ndarray] = (
        None  # (n,) int: the line of the program itself that makes a move; of a block, its first (marked_reader.py)
    )
    # (k, 9): moves before it, line and values of each MARK record of a marked program
    marks: np.ndarray = field(default_factory=lambda: np.zeros((0, 9)))
    items: list[MarkItem] = field(default_factory=list)  # what the marks refer to
    simulated: dict = field(default_factory=dict)  # by cell: proof.simulated() of it
    lead: Lead = Lead()

    @property
    def steps(self) -> int:
        return len(self.first) - 1

    def modes_on(self, step: int) -> Modes:
        """The Modes while a step runs."""
        line = self.place_of(step)
        return self.modes[line - 1] if 1 <= line <= len(self.modes) else Modes()

    def as_written(self, points: Floats, step: int) -> Floats:
        """(n, 3) points as they are read back once they are written at a step: rounded to the last digit
        (text.Numbers)."""
        frame, digits, unit = self.frames[self.frame[step]], 5, 1.0
        if frame.turn:
            return points  # not worth it
        if self.modes_on(step).units == 20:
            digits, unit = 6, INCH
        zero = np.asarray(frame.offset) + np.asarray(frame.g92)
        return zero + np.round((points - zero) / unit, digits) * unit

    @functools.cached_property
    def first_unclear(self) -> float:
        """Number of the first line with a G word that is an expression; infinite without one."""
        return next((n for n, modes in enumerate(self.modes, 1) if modes.unclear), math.inf)

    @functools.cached_property
    def first_not_plain(self) -> float:
        """Number of the first line with a G word that is an expression, or with cutter compensation on; infinite
        without one."""
        return next((n for n, modes in enumerate(self.modes, 1) if modes.unclear or modes.cutter_side != 40), math.inf)

    @functools.cached_property
    def remarks(self) -> Bools:
        """(lines + 1,) bool: by number, the lines with a comment, which may be one that does something."""
        return self.source.having(b"(;")

    def check_writable(self, step: int, why: str) -> None:
        """Unreadable where a step cannot change because it is not in one place of the program."""
        line, unclear = self.line_of(step), self.first_unclear
        if self.traced:
            line, unclear = self.place_of(step), math.inf
        if unclear <= line:
            raise Unreadable(f"{why} in line {line}, and a G word is an expression", "write it as a number", unclear)
        if (self.blocks.calls or line in self.blocks.inside) and not (self.traced and self.block_of(step) is None):
            what = "subs are called (O-words, M98)" if self.blocks.calls else "the line is in a loop or a condition"
            raise Unreadable(f"{why} here, and {what}", "write the program out without them", line)

    def check_shiftable(self, first: int, end: int) -> None:
        """Unreadable where moves first .. end - 1 are written in a way that cannot be shifted; those in blocks of a
        traced program stay."""
        places = self.places[first:end]
        if not (self.traced or self.blocks.calls or self.blocks.inside) and int(places.max()) < self.first_not_plain:
            return
        for place, at in zip(*(a.tolist() for a in np.unique(places, return_index=True))):
            if self.traced and place in self.blocks.outermost:
                continue
            self.check_writable(int(self.step[first + at]), "the flutes are too short")
            if 1 <= place <= len(self.modes) and self.modes[place - 1].cutter_side != 40:
                raise Unreadable(
                    "the flutes are too short here, and cutter compensation is on (G41, G42)",
                    "write the program with the tool's own path",
                    int(self.line[first]),
                )

    @property
    def traced(self) -> bool:
        """Whether each move's place is known: without calls and loops it is the line."""
        return self.place is not None

    @property
    def places(self) -> Ints:
        """(n,) int: the line of the program itself that makes each move; of a block, its first."""
        return self.line if self.place is None else self.place

    def place_of(self, step: int) -> int:
        """The same of a step."""
        return int(self.places[self.first[step]])

    def block_of(self, step: int) -> Block | None:
        """The outermost Block that makes a step of a traced program, None without one."""
        return self.blocks.outermost.get(self.place_of(step))

    def before_block(self, block: Block) -> tuple[str | None, float]:
        """(G word of the motion mode, F in mm/min) where a Block of a traced program begins; None, 0 if it is not
        run."""
        found = self.marks[(self.marks[:, 3] == BEGINS) & (self.marks[:, 1] == block.first)]
        return (f"G{found[0, 7] / 10:g}", float(found[0, 8])) if len(found) else (None, 0.0)

    def content(self) -> bytes:
        """The program's own bytes."""
        return self.source.data

    def line_of(self, step: int) -> int:
        return int(self.line[self.first[step]])

    def kind_of(self, step: int) -> int:
        return int(self.kind[self.first[step]])


def _short(values: Ints) -> Ints:
    """(n,) int32 that need no room where all are the same, as those of most programs are."""
    return np.broadcast_to(values[0], values.shape) if len(values) and (values == values[0]).all() else values


class Collector:
    """Blocks of records -> arrays."""

    def __init__(self, most: int = MOST_MOVES) -> None:
        self.most = most  # moves
        self.columns, self.count = (
            (Growing(np.int8), Growing(np.int32), Growing(float, 3), Growing(float)),
            0,
        )  # kind, line, end and feed
        self.first, self.circle, self.frame = (Growing(np.int32) for _ in range(3))
        self.circles: list[Circle] = []
        self.frames, self.pending = [records.Frame()], -1
        self.events: list[Event] = []
        self.marks: list[Floats] = []
        self._unplaced, self._top, self._lead = rules.Unplaced(), -math.inf, Lead()

    def take(self, block: Floats) -> None:
        kinds = block[:, 0].astype(int)
        marks = kinds == records.MARK
        if marks.any():
            at = self.count + np.cumsum(kinds <= records.ARC)[marks]
            self.marks.append(np.column_stack((at, block[marks, 1:9])))
            block = block[~marks]
        for part in rules.parts(block):
            if isinstance(part, rules.Other):
                self._event(*part)
            else:
                self._moves(part.moves)

    def _moves(self, block: Floats) -> None:
        rules.check_positions(block)
        kinds = block[:, 0].astype(np.int8)
        begins = (kinds != records.ARC) | (block[:, 6] > 0)
        firsts = np.flatnonzero(begins)
        circle = np.full(len(firsts), -1, np.int32)
        arcs = kinds[firsts] == records.ARC
        if arcs.any():  # each arc's CIRCLE comes directly before its chords
            circle[arcs] = self.pending
        self.first.add(firsts + self.count)
        self.circle.add(circle)
        self.frame.add(np.full(len(firsts), len(self.frames) - 1, np.int32))
        self._lead_in(block)
        for column, own in zip(self.columns, (kinds, block[:, 1], block[:, 2:5], block[:, 5])):
            column.add(own)
        self.count += len(block)
        if self.count > self.most:
            raise Unreadable(
                f"it makes more than {self.most} moves", "look for a loop without an end, or rewrite it in parts"
            )

    def _lead_in(self, block: Floats) -> None:
        """Moves of a block that are not to be cut."""
        lead, before = self._unplaced.lead(block, self._top), self._lead
        if lead:
            begins = self._unplaced.arrives and block[lead - 1, 0] != records.RAPID
            before = replace(before, known_from=self.count + lead - begins, arrives=bool(begins))
        unnamed = np.flatnonzero(block[:, records.UNNAMED]) if before.named_from == self.count else np.zeros(0, int)
        self._lead = replace(before, named_from=self.count + int(unnamed[-1]) + 1) if len(unnamed) else before

    def _event(self, kind: int, line: int, values: list[float]) -> None:
        if kind == records.STOCK:
            self._top = values[7]
        if kind == records.CIRCLE:
            self.pending = len(self.circles)
            self.circles.append(Circle(int(values[0]), tuple(values[1:4]), values[4]))
        elif kind == records.FRAME:
            self.frames.append(records.Frame.of(values))
        else:
            self.events.append(Event(self.count, kind, line, values))

    def program(self, path: str, messages: list[list[int | str]], before: Modes, text: bool = True) -> Program:
        """The Program; text: as in read()."""
        kind, line, end, feed = (column.whole() for column in self.columns)
        self.first.add([self.count])
        first = self.first.whole()
        step = np.repeat(np.arange(len(first) - 1, dtype=np.int32), np.diff(first))
        source, blocks, modes = Lines(b""), Blocks(), []
        if text:
            with open(path, "rb") as file:
                source = Lines(file.read())
            blocks = blocks_of(source.parts())
            modes = modes_by_line(source, blocks.subs, before)
        return Program(
            path,
            kind,
            line,
            end,
            feed,
            step,
            first,
            _short(self.circle.whole()),
            _short(self.frame.whole()),
            self.circles,
            self.frames,
            self.events,
            source,
            modes,
            messages,
            blocks=blocks,
            marks=np.concatenate(self.marks) if self.marks else np.zeros((0, 9)),
            lead=replace(self._lead, notes=tuple(self._unplaced.notes())),
        )


def read(
    path: str,
    machine: Machine,
    stock: Corners | None = None,
    progress: Callable[[float], object] | None = None,
    text: bool = True,
    most: int = MOST_MOVES,
    **limits: float | None,
) -> Program:
    """Program of a file.  machine: reader.Machine; stock: (low, high) mm in work coordinates or None; text: whether its
    lines are wanted, with what follows from them (source, modes, blocks); most: moves; limits: of Reader.  Raises
    Unreadable."""
    collector = Collector(most)
    with Reader(path, machine, stock, written=True, **limits) as reader:
        for block in reader:
            rules.check_finite(block)
            collector.take(block)
            if progress:
                progress(int(block[-1, 1]))
        program = collector.program(path, reader.messages, first_modes(machine), text)
        program.notes = [*reader.notes, *program.lead.notes]
        return program


@dataclass(frozen=True)
class Reads:
    """How programs are read: machine, stock, most and limits as in read()."""

    machine: Machine
    stock: Optional[Corners]
    limits: Limits
    most: int = MOST_MOVES

    def program(self, path: str, text: bool = True) -> Program:
        """That of a file."""
        return read(path, self.machine, self.stock, text=text, most=self.most, **self.limits)


def first_modes(machine: Machine) -> Modes:
    """The Modes at a program's beginning."""
    return after_line(Modes(), " ".join(machine.codes))
