# SPDX-License-Identifier: GPL-2.0-or-later
"""Lines whose one step becomes straight moves, or none, as text: nearly all of a long program's, a batch at a time, and
long runs of such moves.

Called by text.py, which writes the others one by one.
"""

import numpy as np

from chipwise.program.records import ARC, RAPID
from chipwise.rewrite.move_text import G, Numbers, changed_words

BATCH = 4096  # steps whose moves are made lists at once


class StraightLines:
    """Of a Program with Edits."""

    def __init__(self, program, edits, alone):
        """alone (m,) bool: steps that are the only one of their line."""
        self.program = program
        self._steps, self._first, self._table = edits.instead.merged()
        self._notes, self._note = edits.instead.notes()
        arcs = np.concatenate(([0], np.cumsum(self._table.kind == ARC, dtype=np.int32)))
        good = alone[self._steps] & (np.diff(arcs[self._first]) == 0)
        good &= ~np.isin(self._steps, edits.after.steps) & ~np.isin(self._steps, list(edits.feeds))
        self._row = np.full(program.steps, -1, np.int32)
        self._row[self._steps[good]] = np.flatnonzero(good)
        self._begin = self._end = self._at = 0  # the rows of the batch, and the number of its first move
        self._kind, self._places, self._feed = [], [], []

    def note(self, step):
        """The note on a step that is such a line's."""
        return self._notes[self._note[self._row[step]]]

    def has(self, step):
        """Whether a step is such a line's, and no mode needs more than its moves."""
        if self._row[step] < 0:
            return False
        modes = self.program.modes_on(step)
        return modes.distance == 90 and not modes.cycle

    def _load(self, row):
        """The batch that begins with a row."""
        frames = self.program.frame[self._steps[row : row + BATCH]]
        other = np.flatnonzero(frames != frames[0])
        self._begin, self._end = row, row + (int(other[0]) if len(other) else len(frames))
        self._at, last = int(self._first[row]), int(self._first[self._end])
        part = slice(self._at, last)
        self._kind, self._feed = self._table.kind[part].tolist(), self._table.feed[part].tolist()
        self._places = _in_work(self.program.frames[frames[0]], self._table.end[part])

    def moves(self, step, feed, end):
        """(text, the last move's kind and end (3,), None without moves, F in force then) of a step's moves where F is
        in force (None: it has to be said)."""
        row = int(self._row[step])
        if not self._begin <= row < self._end:
            self._load(row)
        own = slice(int(self._first[row]) - self._at, int(self._first[row + 1]) - self._at)
        if own.stop == own.start:
            return "", None, feed
        text, feed, _ = lines_of(
            Numbers(self.program.modes_on(step).units),
            self._kind[own],
            self._places[own],
            self._feed[own],
            feed,
            None,
            end,
        )
        return text, (self._kind[own.stop - 1], self._table.end[self._at + own.stop - 1]), feed


def lines_of(numbers, kinds, places, feeds, feed, had, end):
    """(text, F in force then, the last place and its words) of straight moves.

    kinds, places in work coordinates, feeds: of each; feed: in force, None: it has to be said; had: as the third
    result, None: all words are written.
    """
    lines, (before, texts) = [], had or (None, None)
    for kind, place, own in zip(kinds, places, feeds):
        if before is None:
            text = [numbers.length(v) for v in place]
        else:
            text = [t if v == u else numbers.length(v) for v, u, t in zip(place, before, texts)]
        words, before, texts = changed_words(text, texts), place, text
        if not words:
            continue
        if kind != RAPID and (feed is None or abs(feed - own) > 1e-9):
            words.append("F" + numbers.feed(own))
            feed = own
        lines.append(f"{G[kind]} {' '.join(words)}{end}")
    return "".join(lines), feed, (before, texts)


def long_lines(numbers, frame, table, feed, end):
    """Yield (text, F in force then) of a Table of straight moves in a Frame, part by part."""
    had = None
    for first in range(0, len(table), BATCH):
        part = slice(first, first + BATCH)
        text, feed, had = lines_of(
            numbers,
            table.kind[part].tolist(),
            _in_work(frame, table.end[part]),
            table.feed[part].tolist(),
            feed,
            had,
            end,
        )
        yield text, feed


def _in_work(frame, points):
    """[(x, y, z)] of points (n, 3) in the work coordinates of a Frame."""
    return list(zip(*(v.tolist() for v in frame.to_work(points.T))))
