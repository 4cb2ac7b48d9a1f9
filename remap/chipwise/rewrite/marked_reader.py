# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads a program with marks on its lines (line_marks.py), so that each move's place in the program itself is known.

Called by calls.py.  Calls run lines of other places, and loops run lines again: the number of a line alone does not say
where a move belongs.
"""

from __future__ import annotations

import functools
import os
from typing import TYPE_CHECKING

import numpy as np

from chipwise.program.reader import Reader, Unreadable
from chipwise.program.executed_words import BEGINS, ENDS, LINE
from chipwise.host.temp_folder import OwnFolder, put
from chipwise.rewrite.line_marks import marked, sub_files, watched
from chipwise.rewrite.program import Collector, Modes, after_line, first_modes

if TYPE_CHECKING:
    from chipwise.clib.arrays import Corners, Floats
    from chipwise.program.executed_words import Watched
    from chipwise.program.reader import Limits, Machine
    from chipwise.rewrite.program import Program
    from chipwise.rewrite.unroll import Unroller

# columns of Program.marks
AT, LINE_NUMBER, FILE, WHAT, ITEM, MODES, SIDE, MOTION, FEED = range(9)
_UNITS, _PLANES, _ARCS = {1: 20, 2: 21}, {1: 17, 2: 19, 3: 18}, {0: 90.1, 1: 91.1}


def modes_of(mark: Floats) -> Modes:
    """The Modes in force at a mark."""
    return _modes(int(mark[MODES]), int(mark[MOTION]) // 10, bool(mark[SIDE]))


@functools.lru_cache(maxsize=256)
def _modes(packed: int, motion: int, side: bool) -> Modes:
    units, distance, plane, arcs = packed // 1000, packed // 100 % 10, packed // 10 % 10, packed % 10
    cycle = motion if motion in (73, 76) or 81 <= motion <= 89 else 0
    return Modes(
        90 + (distance != 0),
        _UNITS.get(units, 21),
        _PLANES.get(plane, 17),
        41 if side else 40,
        _ARCS.get(arcs, 91.1),
        cycle,
    )


class Followed:
    """A program that has been read with marks: program, texts: lines of the files of its subs, missing: name of a sub
    that is in no file (None without one), watch: its parameters that are watched, origin: of Unroller."""

    def __init__(
        self,
        program: Program,
        machine: Machine,
        stock: Corners | None,
        before: Followed | None = None,
        unroller: Unroller | None = None,
        limits: Limits | None = None,
    ) -> None:
        """Read it again.  program: the Program as it is; before: the Followed that an Unroller has made it from;
        unroller: has checks.  Raises Unreadable."""
        blocks = program.blocks
        self.files, self.missing = sub_files(blocks, machine.ini)
        self.texts = [[text.decode("utf-8", "surrogateescape") for text in sub.lines] for sub in self.files]
        texts = [*program.source, *(text for lines in self.texts for text in lines)]
        self.watch: Watched = before.watch if before else watched(texts)
        self.origin: list[int] = (
            [before.origin[n - 1] for n in unroller.origin]
            if unroller and before
            else list(range(1, len(program.source) + 1))
        )
        collector = Collector()
        with OwnFolder("rewrite") as folder:
            path = put(
                folder,
                os.path.basename(program.path),
                marked(program.source, blocks, self.files, unroller.checks if unroller else {}),
            )
            with Reader(path, machine, stock, written=True, watched=self.watch, **(limits or {})) as reader:
                for block in reader:
                    collector.take(block)
                items = reader.trace
        self.program = collector.program(program.path, program.messages, first_modes(machine))
        self.program.items = items
        self._check_same(program)
        self._places()

    def line_of(self, line: int) -> int:
        """The line of the user's program that a line of this one comes from."""
        return self.origin[line - 1] if 1 <= line <= len(self.origin) else line

    def _check_same(self, program: Program) -> None:
        """Marks change nothing; else what they say is of another program."""
        own = self.program
        if not (
            np.array_equal(own.kind, program.kind)
            and np.array_equal(own.end, program.end)
            and np.array_equal(own.feed, program.feed)
        ):
            raise Unreadable(
                "a move that has to change is in a sub, a loop or a condition, and the program moves otherwise when "
                "its "
                "lines are followed",
                "write it out without them",
            )

    def _places(self) -> None:
        """place, marks and modes of the Program."""
        program = self.program
        marks = program.marks
        what, number = marks[:, WHAT].astype(int), marks[:, LINE_NUMBER].astype(int)
        begun = np.cumsum(what == BEGINS) - np.cumsum(what == ENDS)  # 1 in a block, its mark at the beginning included
        opened = np.maximum.accumulate(np.where(what == BEGINS, np.arange(len(marks)), -1)) if len(marks) else what
        place = np.where(begun > 0, number[np.maximum(opened, 0)], number) if len(marks) else number
        last = np.searchsorted(marks[:, AT], np.arange(len(program.kind)), side="right") - 1
        program.place = (
            np.where(last >= 0, place[np.maximum(last, 0)], program.line) if len(marks) else program.line.copy()
        )
        for k in np.flatnonzero((what == LINE) & (begun == 0) & (marks[:, FILE] == 0)).tolist():
            if 1 <= number[k] <= len(program.modes):
                program.modes[number[k] - 1] = after_line(modes_of(marks[k]), program.source[number[k] - 1])
