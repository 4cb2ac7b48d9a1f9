# SPDX-License-Identifier: GPL-2.0-or-later
"""Writes calls, loops and conditions out in their place: as the moves and codes of the lines that they have executed.

Called by calls.py.

 1. Outermost blocks are written out; every other line keeps its text.
 2. The moves are G0 to G3 of canonical moves, absolute, in the coordinate system, units, plane and arc mode in force
    there.  Canned cycles, cycles of chipwise and cutter compensation become their moves.
 3. Codes that do something else come with the values that they have had (kept_codes.py), comments that do something
    too.
 4. Behind a block its parameters have the values that the block has left, and G90 or G91, the motion mode and F are
    what it has left.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Iterable

import numpy as np

from chipwise.program.reader import Unreadable
from chipwise.program.records import ARC, RAPID
from chipwise.program.executed_words import BEGINS, ENDS
from chipwise.rewrite import kept_codes
from chipwise.rewrite.edits import original
from chipwise.rewrite.line_marks import not_the_users
from chipwise.rewrite.move_text import MoveText, Numbers, g_code, plain
from chipwise.rewrite.marked_reader import AT, FEED, FILE, ITEM, LINE_NUMBER, MOTION, SIDE, WHAT, modes_of
from chipwise.rewrite.words import active_comments, code, plain_move, words_of

if TYPE_CHECKING:
    from chipwise.program.executed_words import MarkItem
    from chipwise.rewrite.blocks import Block
    from chipwise.rewrite.marked_reader import Followed
    from chipwise.rewrite.program import Modes

MOST_SHOWN = 120  # characters of a line that is shown as a comment
MOST_LINES = 40  # of a block that are shown
# known on the machine only, or while it runs: what a block does by them is not known before
_MACHINES = re.compile(
    r"#\s*<_(?:task|hal\[[^\]]*\]|feed_override|adaptive_feed|feed_hold)\s*>|#\s*(?:5399|50(?:6\d|70))(?!\d)", re.I
)
_VALUE = re.compile(r"#\s*<_value", re.I)


class Unroller:
    """One Followed program (marked_reader.py)."""

    def __init__(self, followed: Followed) -> None:
        self.followed, self.program = followed, followed.program
        self.marks = self.program.marks
        self.steps = np.searchsorted(self.program.first, self.marks[:, AT]).tolist()  # before each mark
        self.checked: set[tuple[int, int]] = set()  # (file, line) of lines that may be written out
        self.end = "\r\n" if self.program.source[0].endswith("\r\n") else "\n"
        self.out: list[str] = []
        self.checks: dict[int, int] = {}
        self.origin: list[int] = []
        self.key: tuple[int, float, float] | None = None
        self.text: MoveText | None = None
        self.motion: str | None = None

    def write(self, blocks: set[Block]) -> bytes:
        """Bytes of the program with Blocks written out.  Then checks is {line of it: first line of the block that it is
        the end of}, and origin [the line of the program that each of its lines comes from]."""
        program, outermost = self.program, self.program.blocks.outermost
        for number, text in enumerate(program.source, 1):
            block = outermost.get(number)
            if block not in blocks:
                self.out.append(text if text.endswith("\n") else text + self.end)
            elif number == block.first:
                self._block(block)
            self.origin += [number] * (len(self.out) - len(self.origin))
            if block and number == block.last:
                self.checks[len(self.out)] = block.first
        return "".join(self.out).encode("utf-8", "surrogateescape")

    # ---- a block ----------------------------------------------------------------------------------------------

    def _line(self, text: str) -> None:
        self.out.append(text + self.end)

    def _block(self, block: Block) -> None:
        begin, last = self._marks_of(block)
        if self.program.first[self.steps[begin]] < self.program.lead.named_from:
            raise kept_codes.cannot("its moves", block.first, "X, Y and Z are not all named before")
        self._check_text(block)
        self._show(block)
        modes = modes_of(self.marks[begin])
        self.motion = f"G{self.marks[begin, MOTION] / 10:g}"
        self.now, self.feed, self.key, self.fresh, self.shifted = (
            modes,
            float(self.marks[begin, FEED]),
            None,
            True,
            False,
        )
        if modes.distance == 91:
            self._line("G90")
        if modes.cycle:
            self._line("G80")
            self.motion = "G80"
        for k in range(begin, last):
            try:
                self._executed(k)
            except Unreadable as error:
                if file := int(self.marks[k, FILE]):
                    error.args = (f"{os.path.basename(self.followed.files[file - 1].path)}: {error}",)
                raise
        self._leave(block, last)

    def _marks_of(self, block: Block) -> tuple[int, int]:
        """Numbers of the first and the last mark of a block."""
        begins = np.flatnonzero((self.marks[:, WHAT] == BEGINS) & (self.marks[:, LINE_NUMBER] == block.first))
        ends = np.flatnonzero((self.marks[:, WHAT] == ENDS) & (self.marks[:, LINE_NUMBER] == block.first))
        if len(begins) != 1 or len(ends) != 1:
            raise kept_codes.cannot("its end", block.first, "the program ends in it")
        if self.marks[begins[0], SIDE] or self.marks[ends[0], SIDE]:
            raise kept_codes.cannot("cutter compensation (G41, G42)", block.first, "it goes on before or behind it")
        if self.followed.missing:
            raise kept_codes.cannot(
                f"a call of o<{self.followed.missing}>",
                block.first,
                "no file on the SUBROUTINE_PATH has this sub and no more",
            )
        return int(begins[0]), int(ends[0])

    def _show(self, block: Block) -> None:
        """The block's own lines as comments."""
        shown = self.program.source[block.first - 1 : block.last]
        for k, text in enumerate(shown[:MOST_LINES]):
            note = "written out: " if k == 0 else "| "
            self._line(f"(chipwise: {note}{re.sub(r'[()]', ' ', text).strip()[:MOST_SHOWN]})")
        if len(shown) > MOST_LINES:
            self._line(f"(chipwise: | and {len(shown) - MOST_LINES} lines more)")

    def _source(self, k: int) -> str:
        """The text of an executed line."""
        file, number = int(self.marks[k, FILE]), int(self.marks[k, LINE_NUMBER])
        return (self.program.source if file == 0 else self.followed.texts[file - 1])[number - 1]

    def _check_text(self, block: Block) -> None:
        """Unreadable for what is known on the machine only, in the block and in all subs."""
        program, source = self.program, self.program.source
        own = [(n, source[n - 1]) for n in (*range(block.first, block.last + 1), *sorted(program.blocks.subs))]
        for number, text in own + [(n, text) for texts in self.followed.texts for n, text in enumerate(texts, 1)]:
            found = _MACHINES.search(code(text)) if "#" in text else None
            if found:
                raise kept_codes.cannot(found[0], number, "its value is known on the machine only")
        for number, text in enumerate(source, 1):
            if "_value" in text and _VALUE.search(code(text)) and number not in program.blocks.inside:
                raise kept_codes.cannot("#<_value>", number, "a line behind it reads what the sub returns")

    def _check_line(self, k: int) -> None:
        """Unreadable for an executed line that cannot be written out whatever it does."""
        place = int(self.marks[k, FILE]), int(self.marks[k, LINE_NUMBER])
        if place in self.checked:
            return
        self.checked.add(place)
        text, line = self._source(k), place[1]
        if text.lstrip().startswith("/"):
            raise kept_codes.cannot("/", line, "the line is run only while block delete is off")
        if "$" in code(text):
            raise kept_codes.cannot("$", line, "it chooses a spindle")
        if "=" in text and (number := not_the_users(text)) is not None:
            raise kept_codes.cannot(f"#{number}", line, "the line sets a parameter of LinuxCNC's own")

    def _executed(self, k: int) -> None:
        """What a line has done: the modes it has set, its codes, its moves [2], [3]."""
        self._check_line(k)
        program, item, line = self.program, self._item(k), int(self.marks[k, LINE_NUMBER])
        after = modes_of(self.marks[k + 1])
        first, end = self.steps[k], self.steps[k + 1]
        self._set(after)
        if item is not None and "comment" in item:
            self._comment(self._source(k), item, line)
        codes, own = kept_codes.kept(item, line) if item is not None and "g" in item else ([], False)
        if codes:
            self._codes(codes, own, k)
            self.shifted = self.shifted or any(letter == "G" and int(code) in (43, 49) for letter, code in codes)
            if end > first and not own and item and not kept_codes.may_move(item):
                raise kept_codes.cannot(" ".join(f"{a}{b:g}" for a, b in codes), line, "the machine moves by it")
        if own:
            self.motion, self.fresh, self.shifted = None, True, False
            return
        if self.shifted and end > first and program.kind_of(first) == ARC:  # from where, the records do not say
            raise kept_codes.cannot("an arc", line, "the tool's length has changed just before")
        self._moves(range(first, end), after)

    def _item(self, k: int) -> MarkItem | None:
        number = int(self.marks[k, ITEM])
        return self.program.items[number] if number >= 0 and self.marks[k, WHAT] not in (BEGINS, ENDS) else None

    def _set(self, modes: Modes) -> None:
        """The modes that decide how lengths and arcs are read."""
        words = [
            f"G{getattr(modes, name):g}"
            for name in ("units", "plane", "arc_distance")
            if getattr(modes, name) != getattr(self.now, name)
        ]
        if words:
            self._line(" ".join(words))
        self.now = modes

    def _codes(self, codes: list[tuple[str, float]], own: bool, k: int) -> None:
        """The kept codes of a line; in G91 where they move by themselves and the program has it."""
        relative = own and modes_of(self.marks[k + 1]).distance == 91
        words = [letter + plain(value, 9) for letter, value in codes]
        if ("G", 53) in codes:
            motion = int(self.marks[k + 1, MOTION]) // 10
            words.insert(1, f"G{motion}")
            if motion:
                self.feed = float(self.marks[k + 1, FEED])
                words.append("F" + plain(self.feed * Numbers(self.now.units).scale, 6))
        if relative:
            self._line("G91")
        self._line(" ".join(words))
        if relative:
            self._line("G90")

    def _comment(self, text: str, item: MarkItem, line: int) -> None:
        own = active_comments(text)[-1]
        if "#" in own:
            if "said" not in item:
                raise kept_codes.cannot("(PRINT, LOG)", line, "it shows a parameter")
            own = f"(MSG,{re.sub('[()]', ' ', item['said'])})"
        self._line(own)

    def _moves(self, steps: range, modes: Modes) -> None:
        program = self.program
        for step in steps:
            fresh = self.fresh or self.shifted  # where the tool is before, the records need not say
            self.fresh = self.shifted = False
            move, start = original(program, step), program.start(int(program.first[step]))
            if not fresh and move.circle is None and np.abs(np.asarray(move.end) - start).max() < 1e-9:
                continue
            key = int(program.frame[step]), modes.units, modes.arc_distance
            text = self.text
            if fresh or key != self.key or text is None or np.abs(np.asarray(text.at) - start).max() > 1e-9:
                text = MoveText(program.frames[key[0]], modes, start)
                self.key, self.text = key, text
            words = text.words(move)
            if not words:
                continue
            if move.kind != RAPID and move.feed is not None and abs(self.feed - move.feed) > 1e-9:
                words.append("F" + plain(move.feed * text.numbers.scale, 6))
                self.feed = move.feed
            self.motion = g_code(move)
            self._line(" ".join(words))

    # ---- behind it --------------------------------------------------------------------------------------------

    def _leave(self, block: Block, last: int) -> None:
        """[4]"""
        mark = self.marks[last]
        for name, value in self.program.items[int(mark[ITEM])]["changed"].items():
            self._line(f"#{name}={np.format_float_positional(value, trim='-')}")
        if modes_of(mark).distance == 91:
            self._line("G91")
        if mark[FEED] > 0.0 and abs(self.feed - mark[FEED]) > 1e-9:
            self._line("F" + plain(float(mark[FEED]) * Numbers(self.now.units).scale, 6))
        wanted = f"G{mark[MOTION] / 10:g}"
        if wanted != self.motion:
            if wanted in ("G0", "G1", "G80"):
                self._line(wanted)
            elif not says_motion(self.program.source[block.last :]):
                raise kept_codes.cannot(
                    f"{wanted} at its end", block.last, "the line behind the block has no G word for its move"
                )


def says_motion(source: Iterable[str]) -> bool:
    """Whether the first line with a move, or the program's end, comes with a motion G word of its own and before any
    O-word."""
    for text in source:
        own = words_of(text)
        if any(letter == "O" for letter, _ in own) or (
            plain_move(text) is None and re.match(r"\s*/?\s*(?:n\s*\d+\s*)?o", code(text), re.I)
        ):
            return False
        if any(letter == "G" and value is not None and int(value) in kept_codes.MOTIONS for letter, value in own):
            return True
        if any(letter == "M" and value in (2, 30) for letter, value in own):
            return True
        if any(letter in "XYZ" or value is None for letter, value in own):
            return False
    return True
