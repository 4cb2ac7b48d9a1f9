# SPDX-License-Identifier: GPL-2.0-or-later
"""Lines whose one step becomes straight moves, or none, as text: nearly all of a long program's, a batch at a time, and
long runs of such moves.

Called by text.py, which writes the others one by one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Iterator, NamedTuple

import numpy as np

from chipwise.program.records import ARC, RAPID
from chipwise.rewrite.move_text import G, Numbers, changed_words

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats
    from chipwise.program.records import Frame
    from chipwise.rewrite.edits import Edits, Table
    from chipwise.rewrite.program import Program

Place = tuple[float, ...]  # X Y Z

BATCH = 4096  # steps whose moves are made lists at once


class Moves(NamedTuple):
    """Straight ones: of each its kind, its end in work coordinates, and its feed."""

    kinds: list[int]
    places: list[Place]
    feeds: list[float]


class StraightLines:
    """Of a Program with Edits."""

    def __init__(self, program: Program, edits: Edits, alone: Bools) -> None:
        """alone (m,) bool: steps that are the only one of their line."""
        self.program = program
        self._steps, self._first, self._table = edits.instead.merged()
        self._notes, self._note = edits.instead.notes()
        arcs = np.concatenate((np.array([0]), np.cumsum(self._table.kind == ARC, dtype=np.int32)))
        good = alone[self._steps] & (np.diff(arcs[self._first]) == 0)
        good &= ~np.isin(self._steps, edits.after.steps) & ~np.isin(self._steps, list(edits.feeds))
        self._row = np.full(program.steps, -1, np.int32)
        self._row[self._steps[good]] = np.flatnonzero(good)
        self._begin = self._end = self._at = 0  # the rows of the batch, and the number of its first move
        self._kind: list[int] = []
        self._places: list[Place] = []
        self._feed: list[float] = []

    def note(self, step: int) -> str | None:
        """The note on a step that is such a line's."""
        return self._notes[self._note[self._row[step]]]

    def has(self, step: int) -> bool:
        """Whether a step is such a line's, and no mode needs more than its moves."""
        if self._row[step] < 0:
            return False
        modes = self.program.modes_on(step)
        return modes.distance == 90 and not modes.cycle

    def _load(self, row: int) -> None:
        """The batch that begins with a row."""
        frames = self.program.frame[self._steps[row : row + BATCH]]
        other = np.flatnonzero(frames != frames[0])
        self._begin, self._end = row, row + (int(other[0]) if len(other) else len(frames))
        self._at, last = int(self._first[row]), int(self._first[self._end])
        part = slice(self._at, last)
        self._kind, self._feed = self._table.kind[part].tolist(), self._table.feed[part].tolist()
        self._places = _in_work(self.program.frames[frames[0]], self._table.end[part])

    def moves(self, step: int, feed: float | None, end: str) -> tuple[str, tuple[int, Floats] | None, float | None]:
        """(text, the last move's kind and end (3,), None without moves, F in force then) of a step's moves where F is
        in force (None: it has to be said)."""
        row = int(self._row[step])
        if not self._begin <= row < self._end:
            self._load(row)
        own = slice(int(self._first[row]) - self._at, int(self._first[row + 1]) - self._at)
        if own.stop == own.start:
            return "", None, feed
        moves = Moves(self._kind[own], self._places[own], self._feed[own])
        text, feed, _ = lines_of(Numbers(self.program.modes_on(step).units), moves, feed, None, end)
        return text, (self._kind[own.stop - 1], self._table.end[self._at + own.stop - 1]), feed


def lines_of(
    numbers: Numbers, moves: Moves, feed: float | None, had: tuple[Place, list[str]] | None, end: str
) -> tuple[str, float | None, tuple[Place, list[str]] | None]:
    """(text, F in force then, the last place and its words) of straight moves.

    feed: in force, None: it has to be said; had: as the third result, None: all words are written.
    """
    lines = []
    for kind, place, own in zip(*moves):
        if had is None:
            text = [numbers.length(v) for v in place]
        else:
            text = [t if v == u else numbers.length(v) for v, u, t in zip(place, *had)]
        words, had = changed_words(text, had and had[1]), (place, text)
        if not words:
            continue
        if kind != RAPID and (feed is None or abs(feed - own) > 1e-9):
            words.append("F" + numbers.feed(own))
            feed = own
        lines.append(f"{G[kind]} {' '.join(words)}{end}")
    return "".join(lines), feed, had


def long_lines(
    numbers: Numbers, frame: Frame, table: Table, feed: float | None, end: str
) -> Iterator[tuple[str, float | None]]:
    """Yield (text, F in force then) of a Table of straight moves in a Frame, part by part."""
    had = None
    for first in range(0, len(table), BATCH):
        part = slice(first, first + BATCH)
        moves = Moves(table.kind[part].tolist(), _in_work(frame, table.end[part]), table.feed[part].tolist())
        text, feed, had = lines_of(numbers, moves, feed, had, end)
        yield text, feed


def _in_work(frame: Frame, points: Floats) -> list[Place]:
    """[(x, y, z)] of points (n, 3) in the work coordinates of a Frame."""
    return list(zip(*(v.tolist() for v in frame.to_work(points.T))))
