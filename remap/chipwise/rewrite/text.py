# SPDX-License-Identifier: GPL-2.0-or-later
"""Writes a rewritten program: the lines that need no change keep their text, the others become plain G0, G1, G2, G3.

Called by run.py.

 1. A line whose moves stay as they are is copied byte for byte.
 2. Else its moves are written out: absolute, in the units, plane and arc mode in force there, under the coordinate
    system in force there.  The line itself stays above them as a comment, so that N words and remarks can be read.
 3. A canned cycle is written out whole, with the lines that repeat it.
 4. What the next line takes over from the ones before is put right: G91, the motion mode, F.
 5. A line that does more than move (a tool, a spindle, M250) cannot be written out: Unreadable.
 6. Calls, loops and conditions stay: calls.py has written out those with moves that change.  Before them the motion
    mode and F are what the program has there.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from chipwise.program.records import ARC, RAPID
from chipwise.program.reader import Unreadable
from chipwise.rewrite.edits import Table, original
from chipwise.rewrite.move_text import PLANE, G, MoveText, Numbers, g_code
from chipwise.rewrite.straight_text import StraightLines, long_lines
from chipwise.rewrite.words import MOTION, active_comments, code, plain_move, with_feed, with_word, words_of

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats
    from chipwise.rewrite.blocks import Block
    from chipwise.rewrite.edits import Edits
    from chipwise.rewrite.program import Program

BATCH = 8192  # lines whose numbers are made Python's at a time
MOST_SHOWN = 120  # characters of a line that is shown as a comment; LinuxCNC takes 255 bytes a line
_BRACKETS = re.compile(r"[()\r\n]")
_OUR_CYCLES = {12, 13, 24, 77, 78, 79}
_SETTERS = {17, 18, 19, 20, 21, 90, 91, 90.1, 91.1, 94, 61, 61.1, 98, 99, 40}
_WITHOUT_F = {33, 33.1, 76}  # the spindle alone sets their feed; G33 refuses an F
_BESIDE_MOTION = {28, 30}  # traverses that take no motion word and leave the motion mode
_OTHER_MOTION = {5, 5.1, 5.2, 5.3, 28, 30, 33, 33.1, 74, 76, 84, 87, 88}
_PLAIN_G = {*_OUR_CYCLES, *_SETTERS, 0, 1, 2, 3, 80, 73, 81, 82, 83, 85, 86, 89}


class Output:
    """The new program's text as it grows, in a file."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._open = False  # whether the last line has no end yet

    def line(self, text: str, end: str = "") -> None:
        """A line, or lines, after the end of the one before."""
        if text or end:
            self._file.write((text + end).encode("utf-8", "surrogateescape"))
            self._open = not (end or text).endswith("\n")

    def end_line(self, end: str) -> None:
        """What is there ends with an end of line."""
        if self._open:
            self.line(end)


class Writer:
    """One program with its edits, as text in a file that is open for bytes."""

    def __init__(self, program: Program, edits: Edits, file: BinaryIO) -> None:
        self.program, self.edits, self.source = program, edits, program.source
        self.out = Output(file)
        self.at: Floats | tuple[float, ...] = np.array(program.start(0), float)  # mm, machine coordinates
        self.motion: str | None = None  # G-code in force in the output, None: as in the source
        self.feed: float | None = None  # F in force in the output, mm/min; None: as in the source
        self._said: str | None = None  # the note on the last line that was written out
        self._place = program.places[program.first[:-1]]  # (m,) int: the line of each step
        self._by_place = np.argsort(self._place, kind="stable").astype(
            np.int32
        )  # (m,): the steps line by line, and where each line's begin
        self._begin = np.concatenate(
            (np.array([0]), np.cumsum(np.bincount(self._place, minlength=len(self.source) + 1)))
        ).astype(np.int32)
        self._straight = StraightLines(program, edits, (np.diff(self._begin) == 1)[self._place])
        self.end = "\r\n" if self.source and self.source[0].endswith("\r\n") else "\n"

    def write(self) -> None:
        """The whole text.  Raises Unreadable."""
        written_out = self._written_out()
        for number, text in enumerate(self.source, 1):
            self._line(number, text, written_out[number])

    def _line(self, number: int, text: str, is_written_out: bool) -> None:
        """A line of the source, and the moves behind it."""
        steps, blocks = self._steps_of(number), self.program.blocks
        if is_written_out:
            self._write_out(number, text, steps)
        elif number in blocks.outermost:
            self._keep_of_block(number, text, blocks.outermost[number])
        elif number in blocks.subs:
            self.out.line(text)
        else:
            self._keep(text, steps, self.program.modes[number - 1].synchronised)
            if steps and (moves := self.edits.after.get(steps[-1])):
                self._moves(steps[-1], moves, number)

    # ---- which lines ------------------------------------------------------------------------------------------

    def _steps_of(self, number: int) -> list[int]:
        """[numbers of the steps that a line makes], rising."""
        return self._by_place[self._begin[number] : self._begin[number + 1]].tolist()

    def _written_out(self) -> Bools:
        """(n + 1,) bool: by number, the lines that are written out [2], [3]."""
        edits, place = self.edits, self._place
        several = (np.diff(self._begin) > 1)[place]
        changed = np.zeros(len(place), bool)
        changed[edits.instead.steps] = True
        after = edits.after.steps
        changed[after] |= self._by_place[self._begin[place[after] + 1] - 1] != after  # not the last of its line
        feeds = np.fromiter(edits.feeds, int, len(edits.feeds))
        changed[feeds] |= several[feeds]
        result = np.zeros(len(self._begin) - 1, bool)
        result[place[changed]] = True
        cycle = {number: self._cycle_of(self._steps_of(number)) for number in np.unique(place[several]).tolist()}
        if any(cycle.values()):
            ordered = np.unique(place).tolist()
            for along in (ordered, ordered[::-1]):  # the lines that repeat a cycle, before and behind
                before = None
                for number in along:
                    if (
                        before is not None
                        and result[before]
                        and cycle.get(number)
                        and cycle[number] == cycle.get(before)
                    ):
                        result[number] = True
                    before = number
        numbers = np.flatnonzero(result)
        for first in range(0, len(numbers), BATCH):
            for number in numbers[first : first + BATCH].tolist():
                self._check(number)
        return result

    def _cycle_of(self, steps: list[int]) -> float:
        """The canned cycle that a line runs, 0 without one."""
        program = self.program
        return (
            program.modes_on(steps[0]).cycle
            if len(steps) > 1 and program.place_of(steps[0]) not in program.blocks.outermost
            else 0
        )

    def _check(self, number: int) -> None:
        """[5]"""
        if not 1 <= number <= len(self.source):
            raise Unreadable(
                "a move that has to change is not written in this file", "write the program out without subs", number
            )
        text, program = self.source[number - 1], self.program
        if program.first[self._steps_of(number)[0]] < program.lead.named_from:
            raise Unreadable(
                "its moves have to change, and X, Y and Z are not all named before",
                "name them before the first cut",
                number,
            )
        modes = program.modes[number - 1]
        if modes.cutter_side != 40:
            raise Unreadable(
                "its moves have to change, and cutter compensation is on (G41, G42)",
                "write the program with the tool's own path",
                number,
            )
        if modes.diameter == 7:
            raise Unreadable("its moves have to change, and X is a diameter (G7)", "write the program with G8", number)
        if plain_move(text):
            return
        if text.lstrip().startswith("/"):
            raise Unreadable(
                "its moves have to change, and it is run only while block delete is off",
                "remove the / if it counts",
                number,
            )
        if "=" in code(text):
            raise Unreadable("its moves have to change, and it sets a parameter", "give that a line of its own", number)
        for letter, value in words_of(text):
            plain = letter in "NXYZIJKRFPLQDEH" or (letter == "G" and value in _PLAIN_G)
            if letter == "G" and value in _OTHER_MOTION:
                raise Unreadable(
                    f"its moves have to change, and they are those of G{value:g}", "write them as G0 to G3", number
                )
            if not plain:
                what = f"{letter}{value:g}" if value is not None else letter
                raise Unreadable(
                    f"its moves have to change, and {what} on the same line is more than a move",
                    "give it a line of its own",
                    number,
                )

    # ---- lines ------------------------------------------------------------------------------------------------

    def _keep(self, text: str, steps: list[int], synchronised: float) -> None:
        """[1], [4]; synchronised: of Modes."""
        self._said = None
        plain = plain_move(text)
        says_motion = synchronised or (plain[1] if plain else MOTION.search(code(text)))
        beside = not plain and any(letter == "G" and value in _BESIDE_MOTION for letter, value in words_of(text))
        feeds = [s for s in steps if self.program.kind_of(s) != RAPID and synchronised not in _WITHOUT_F]
        wanted = self.edits.feeds.get(feeds[0]) if len(steps) == 1 and feeds else None
        if steps and self.motion is not None and not (says_motion or beside or self._cycle_of(steps)):
            word = _g_of(self.program, steps[0])
            if word != self.motion:
                text = with_word(text, word)
        if steps and not beside or says_motion:
            self.motion = None
        if feeds and (wanted is not None or self.feed is not None):
            own = float(self.program.feed[self.program.first[feeds[0]]])
            target = own if wanted is None else wanted
            says = any(letter == "F" for letter, _ in words_of(text))
            differs = self.feed is None or abs(self.feed - target) > 1e-9
            if (wanted is not None and (differs or says)) or (wanted is None and not says and differs):
                units = self.program.modes_on(steps[-1]).units
                changed = with_feed(text, Numbers(units).feed(target))
                if changed is None:
                    raise Unreadable(
                        "its F is an expression, and has to change",
                        "write F as a number",
                        self.program.line_of(steps[0]),
                    )
                text = changed
            self.feed = target if wanted is not None else None
        elif not feeds and self.feed is not None and any(letter == "F" for letter, _ in words_of(text)):
            self.feed = None
        if steps:
            self.at = self.program.end[self.program.first[steps[-1] + 1] - 1]
        self.out.line(text)

    def _keep_of_block(self, number: int, text: str, block: Block) -> None:
        """[6]"""
        self._said, steps = None, self._steps_of(block.first)
        if number == block.first and (self.motion is not None or self.feed is not None):
            motion, feed = self.program.before_block(block)
            if None not in (self.motion, motion) and self.motion != motion:
                if motion not in ("G0", "G1", "G80"):
                    raise Unreadable(
                        f"a call or a loop begins while {motion} is in force, and the moves before it have to change",
                        f"write the G word of the first move in it, and G1 before line {number}",
                        number,
                    )
                self.out.line(motion, self.end)
            if self.feed is not None and feed > 0.0 and abs(self.feed - feed) > 1e-9:
                self.out.line("F" + Numbers(self.program.modes[number - 1].units).feed(feed), self.end)
            self.motion = self.feed = None
        if number == block.last and steps:
            self.at = self.program.end[self.program.first[steps[-1] + 1] - 1]
        self.out.line(text)

    def _write_out(self, number: int, text: str, steps: list[int]) -> None:
        """[2]"""
        self.out.end_line(self.end)
        plain = plain_move(text)
        if plain and len(steps) == 1 and self._straight.has(steps[0]):
            self._write_straight(text, steps[0])
            return
        note = next(filter(None, map(self.edits.instead.note, steps)), None)
        self.out.line(self._shown(note, text), self.end)
        if not plain:
            for comment in active_comments(text):
                self.out.line(comment, self.end)
            set_here = [f"G{value:g}" for letter, value in words_of(text) if letter == "G" and value in _SETTERS]
            if set_here:
                self.out.line(" ".join(set_here), self.end)
        parts = []
        for step in steps:
            own = self.edits.instead.get(step)
            if own is None:
                one = original(self.program, step)
                feed = self.edits.feeds.get(step)
                own = Table.of([one if feed is None else one._replace(feed=feed)])
            parts += [own, *filter(None, [self.edits.after.get(step)])]
        self._moves(steps[-1], Table.joined(parts), number)

    def _write_straight(self, text: str, step: int) -> None:
        """The same of nearly all lines."""
        lines, last, self.feed = self._straight.moves(step, self.feed, self.end)
        self.out.line(f"{self._shown(self._straight.note(step), text)}{self.end}{lines}")
        if last:
            self.motion, self.at = G[last[0]], last[1]
        self._take_over(step)

    def _shown(self, note: str | None, text: str) -> str:
        """The comment above what takes a line's place.  The note is said once: long programs have millions of such
        lines."""
        old = _BRACKETS.sub(" ", text).strip()[:MOST_SHOWN]
        had, self._said = self._said, note or "written out"
        return f"(was: {old})" if had == self._said else f"(chipwise: {self._said}: {old})"

    def _take_over(self, step: int) -> None:
        """The F of the source is in force behind a step if the output's is the same."""
        program = self.program
        own = float(program.feed[program.first[step + 1] - 1]) if program.kind_of(step) != RAPID else None
        if own is not None and self.feed is not None and abs(self.feed - own) < 1e-9:
            self.feed = None

    def _moves(self, step: int, moves: Table, number: int) -> None:
        """Moves in the coordinate system and the modes of a step's line [2], [4]."""
        program = self.program
        modes, frame = self.program.modes_on(step), program.frames[program.frame[step]]
        self.out.end_line(self.end)
        if modes.distance == 91:
            self.out.line("G90", self.end)
        if modes.cycle:
            self.out.line("G80", self.end)
        if len(moves) and not moves.circles:
            for lines, feed in long_lines(Numbers(modes.units), frame, moves, self.feed, self.end):
                self.out.line(lines)
                self.feed = feed
            self.at, self.motion = moves.end[-1], G[int(moves.kind[-1])]
        else:
            self._single_moves(MoveText(frame, modes, self.at), moves)
        if modes.distance == 91:
            self.out.line("G91", self.end)
        self._take_over(step)

    def _single_moves(self, text: MoveText, moves: Table) -> None:
        """Moves one by one, with a MoveText of their own.  Segments that are travelled again may have arcs of other
        planes than the line's."""
        move, plane = None, text.modes.plane
        for move in moves:
            words = text.words(move)
            if words and move.kind == ARC and PLANE[move.arc.plane] != plane:
                plane = PLANE[move.arc.plane]
                words.insert(0, f"G{plane}")
            feed = move.feed
            if (
                words
                and move.kind != RAPID
                and feed is not None
                and (self.feed is None or abs(self.feed - feed) > 1e-9)
            ):
                words.append("F" + text.numbers.feed(feed))
                self.feed = feed
            if words:
                self.out.line(" ".join(words), self.end)
        if plane != text.modes.plane:
            self.out.line(f"G{text.modes.plane:g}", self.end)
        self.at = text.at
        if move is not None:
            self.motion = g_code(move)


def _g_of(program: Program, step: int) -> str:
    return g_code(original(program, step))
