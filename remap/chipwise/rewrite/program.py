# SPDX-License-Identifier: GPL-2.0-or-later
"""A program as it is rewritten: its canonical moves in arrays, and what each was written with.

Called by run.py, flute.py, feed.py and proof.py.  LinuxCNC's own interpreter reads the program (check/reader.py).

A *move* is one chord: a traverse, a straight feed or a chord of an arc.  A *step* is what one word of G-code makes: a
traverse, a straight feed or a whole arc.  All lengths mm, machine coordinates of the tool's tip; feeds mm/min.
"""

import functools
import math
import re
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from chipwise.check import records, rules
from chipwise.check.reader import Reader, Unreadable
from chipwise.rewrite.words import only_comment, plain_move, words_of

MOST_MOVES = 4_000_000          # 500 MB
INCH = 25.4                     # mm


class Modes(NamedTuple):
    """The modal state that decides how a move is written: numbers of G codes."""

    distance: float = 90
    units: float = 21
    plane: float = 17
    cutter_side: float = 40
    arc_distance: float = 91.1
    cycle: float = 0            # 73, 76, 81 .. 89 while such a cycle is modal, else 0
    unclear: bool = False       # a G word on this line is an expression


# which of Modes a G word sets
_SETS = {float(code): name for name, codes in {
    "distance": (90, 91), "units": (20, 21), "plane": (17, 18, 19), "cutter_side": (40, 41, 41.1, 42, 42.1),
    "arc_distance": (90.1, 91.1), "cycle": (0, 1, 2, 3, 33, 33.1, 73, 76, *range(80, 90))}.items() for code in codes}
_CYCLES = {73, 76, *range(81, 90)}


def after_line(modes, text):
    """Modes after a line of text."""
    own = {"unclear": False} if modes.unclear else {}
    for letter, value in words_of(text):
        if letter != "G":
            continue
        if value is None:
            own["unclear"] = True
        elif value in _SETS:
            own[_SETS[value]] = value if _SETS[value] != "cycle" or value in _CYCLES else 0
    return modes._replace(**own) if own else modes


def modes_by_line(source, subs, modes):
    """[Modes on each line] of a program that is run from the first line to the last; subs: numbers of lines in subs."""
    result = []
    for number, text in enumerate(source, 1):
        if number not in subs and (modes.unclear or (("G" in text or "g" in text) and not only_comment(text)
                                                     and (modes.cycle or not plain_move(text)))):    # that ends a cycle, no more
            modes = after_line(modes, text)
        result.append(modes)
    return result


_O_WORD = re.compile(rb"^\s*/?\s*(?:n\s*\d[\d\s]*)?o\s*(?:<[^>]*>|\d+|#\S+|\[[^\]]*\])\s*([a-z]+)", re.I)
_M98 = re.compile(rb"^[^(;]*\bm\s*9[89]\b", re.I)
_MOVES = b"GXYZIJKFgxyzijkf("        # a line that begins so has no O-word
_OPENS, _CLOSES = {b"sub", b"while", b"do", b"if", b"repeat"}, {b"endsub", b"endwhile", b"endif", b"endrepeat"}


def o_blocks(lines):
    """({numbers of the lines inside subs, loops and conditions}, {those inside subs}, whether subs are called) of a program."""
    inside, subs, calls, blocks = set(), set(), False, []
    for number, text in enumerate(lines, 1):
        if text[:1] in _MOVES and b"M" not in text and b"m" not in text:
            if blocks:
                inside.add(number)
                if b"sub" in blocks:
                    subs.add(number)
            continue
        match = _O_WORD.match(text)
        word = match.group(1).lower() if match else None
        calls = calls or word == b"call" or bool(_M98.match(text))
        if word in _CLOSES or (word == b"while" and blocks[-1:] == [b"do"]):
            del blocks[-1:]
        elif word in _OPENS:
            blocks.append(word)
        if blocks or word:
            inside.add(number)
        if b"sub" in blocks:
            subs.add(number)
    return inside, subs, calls


@dataclass(frozen=True)
class Circle:
    """An arc: plane 1 XY, 2 YZ, 3 XZ; centre (3,) mm; turns, negative: clockwise."""

    plane: int
    centre: tuple
    turns: float


@dataclass
class Event:
    """A tool, a stock or M251 before move number `at`."""

    at: int
    kind: int
    line: int
    values: list


@dataclass
class Program:
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
    circles: list
    frames: list
    events: list
    source: list            # lines of text
    modes: list             # Modes on each line
    messages: list = field(default_factory=list)
    inside: set = field(default_factory=set)        # numbers of lines in subs, loops and conditions
    calls: bool = False                             # subs are called
    simulated: dict = field(default_factory=dict)   # by cell: proof.simulated() of it

    @property
    def steps(self):
        return len(self.first) - 1

    def start(self, move):
        """(3,): start of a move. The machine's position before the first is unknown: the first move starts at its end."""
        return self.end[max(move - 1, 0)]

    @functools.cached_property
    def height_known_from(self):
        """Number of the first move whose height the machine and the interpreter agree on (rules.moves_at_unknown_height)."""
        return rules.moves_at_unknown_height(self.kind, self.end[:, 2])[0]

    def modes_on(self, step):
        """The Modes while a step runs."""
        line = self.line_of(step)
        return self.modes[line - 1] if 1 <= line <= len(self.modes) else Modes()

    def as_written(self, points, step):
        """(n, 3) points as they are read back once they are written at a step: rounded to the last digit (text.Numbers)."""
        frame, digits, unit = self.frames[self.frame[step]], 5, 1.0
        if frame.turn:
            return points                               # not worth it
        if self.modes_on(step).units == 20:
            digits, unit = 6, INCH
        zero = np.asarray(frame.offset) + np.asarray(frame.g92)
        return zero + np.round((points - zero) / unit, digits) * unit

    @functools.cached_property
    def first_unclear(self):
        """Number of the first line with a G word that is an expression; infinite without one."""
        return next((n for n, modes in enumerate(self.modes, 1) if modes.unclear), math.inf)

    def check_writable(self, line, why):
        """Unreadable where a line cannot change because it is not one place in the program."""
        unclear = self.first_unclear
        if unclear <= line:
            raise Unreadable(f"{why} in line {line}, and a G word is an expression", "write it as a number", unclear)
        if self.calls or line in self.inside:
            what = "subs are called (O-words, M98)" if self.calls else "the line is in a loop or a condition"
            raise Unreadable(f"{why} here, and {what}", "write the program out without them", line)

    def content(self):
        """The program's own bytes."""
        return "".join(self.source).encode("utf-8", "surrogateescape")

    def line_of(self, step):
        return int(self.line[self.first[step]])

    def kind_of(self, step):
        return int(self.kind[self.first[step]])


class _Collector:
    """Blocks of records -> arrays."""

    def __init__(self):
        self.parts, self.count = [], 0
        self.firsts, self.circle, self.frame = [], [], []
        self.circles, self.frames, self.events = [], [records.Frame()], []
        self.pending = -1

    def take(self, block):
        kinds = block[:, 0].astype(int)
        start = 0
        for event in (*np.flatnonzero(kinds > records.ARC).tolist(), len(block)):
            if event > start:
                self._moves(block[start:event])
            if event < len(block):
                self._event(int(kinds[event]), int(block[event, 1]), block[event, 2:].tolist())
            start = event + 1

    def _moves(self, block):
        rules.check_positions(block)
        kinds = block[:, 0].astype(np.int8)
        begins = (kinds != records.ARC) | (block[:, 6] > 0)
        firsts = np.flatnonzero(begins)
        circle = np.full(len(firsts), -1, np.int32)
        arcs = kinds[firsts] == records.ARC
        if arcs.any():                  # each arc's CIRCLE comes directly before its chords
            circle[arcs] = self.pending
        self.firsts.append(firsts + self.count)
        self.circle.append(circle)
        self.frame.append(np.full(len(firsts), len(self.frames) - 1, np.int32))
        self.parts.append((kinds, block[:, 1].astype(np.int32), block[:, 2:5].copy(), block[:, 5].copy()))
        self.count += len(block)
        if self.count > MOST_MOVES:
            raise Unreadable(f"it makes more than {MOST_MOVES} moves", "rewrite it in parts")

    def _event(self, kind, line, values):
        if kind == records.CIRCLE:
            self.pending = len(self.circles)
            self.circles.append(Circle(int(values[0]), tuple(values[1:4]), values[4]))
        elif kind == records.FRAME:
            self.frames.append(records.Frame.of(values))
        else:
            self.events.append(Event(self.count, kind, line, values))

    def program(self, path, messages, before):
        kind, line, end, feed = (np.concatenate(parts) for parts in zip(*self.parts))
        first = np.concatenate((*self.firsts, [self.count]))
        step = np.repeat(np.arange(len(first) - 1), np.diff(first))
        with open(path, "rb") as file:
            source = file.readlines()           # as LinuxCNC: only a line feed ends a line
        inside, subs, calls = o_blocks(source)
        source = [text.decode("utf-8", "surrogateescape") for text in source]
        return Program(path, kind, line, end, feed, step, first, np.concatenate(self.circle), np.concatenate(self.frame),
                       self.circles, self.frames, self.events, source, modes_by_line(source, subs, before), messages, inside, calls)


def read(path, machine, stock=None, progress=None, **limits):
    """Program of a file.  machine: reader.Machine; stock: (low, high) mm in work coordinates or None.  Raises Unreadable."""
    collector = _Collector()
    with Reader(path, machine, stock, written=True, **limits) as reader:
        for block in reader:
            rules.check_finite(block)
            collector.take(block)
            if progress:
                progress(int(block[-1, 1]))
        codes = f"G{20 if machine.unit_mm > 10 else 21} {machine.startup}"
        return collector.program(path, reader.messages, after_line(Modes(), codes))
