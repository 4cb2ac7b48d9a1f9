# SPDX-License-Identifier: GPL-2.0-or-later
"""Lines whose one step becomes straight moves, as text: nearly all of a long program's, a batch at a time.

Called by text.py, which writes the others one by one.
"""

import numpy as np

from chipwise.check.records import ARC, RAPID
from chipwise.rewrite.move_text import G, Numbers, changed_words

BATCH = 4096                # steps whose moves are made lists at once


class StraightLines:
    """Of a Program with Edits."""

    def __init__(self, program, edits, alone):
        """alone (m,) bool: steps that are the only one of their line."""
        self.program = program
        self._steps, self._first, self._table = edits.instead.merged()
        self._notes = edits.instead.notes()
        arcs = np.concatenate(([0], np.cumsum(self._table.kind == ARC)))
        good = alone[self._steps] & (np.diff(self._first) > 0) & (np.diff(arcs[self._first]) == 0)
        good &= ~np.isin(self._steps, edits.after.steps) & ~np.isin(self._steps, list(edits.feeds))
        self._row = np.full(program.steps, -1, np.int32)
        self._row[self._steps[good]] = np.flatnonzero(good)
        self._begin = self._end = self._at = 0      # the rows of the batch, and the number of its first move
        self._frame, self._kind, self._places, self._feed = -1, [], [], []

    def note(self, step):
        """The note on a step that is such a line's."""
        return self._notes[self._row[step]]

    def has(self, step):
        """Whether a step is such a line's, and no mode needs more than its moves."""
        if self._row[step] < 0:
            return False
        modes = self.program.modes_on(step)
        return modes.distance == 90 and not modes.cycle

    def _load(self, row):
        """The batch that begins with a row."""
        frames = self.program.frame[self._steps[row:row + BATCH]]
        other = np.flatnonzero(frames != frames[0])
        self._begin, self._end = row, row + (int(other[0]) if len(other) else len(frames))
        self._at, last = int(self._first[row]), int(self._first[self._end])
        part = slice(self._at, last)
        work = self.program.frames[frames[0]].to_work(self._table.end[part].T)
        self._kind, self._feed, self._places = self._table.kind[part].tolist(), self._table.feed[part].tolist(), list(zip(*(v.tolist() for v in work)))

    def moves(self, step, feed, end):
        """(text, kind of the last move, its end (3,), F in force then) of a step's moves where F is in force (None: it has to be said)."""
        row = int(self._row[step])
        if not self._begin <= row < self._end:
            self._load(row)
        numbers, had, lines = Numbers(self.program.modes_on(step).units), None, []
        first, last = int(self._first[row]) - self._at, int(self._first[row + 1]) - self._at
        for kind, place, own in zip(self._kind[first:last], self._places[first:last], self._feed[first:last]):
            text = [numbers.length(v) for v in place]
            words = changed_words(text, had)
            had = text
            if not words:
                continue
            if kind != RAPID and (feed is None or abs(feed - own) > 1e-9):
                words.append("F" + numbers.feed(own))
                feed = own
            lines.append(f'{G[kind]} {" ".join(words)}{end}')
        return "".join(lines), kind, self._table.end[self._at + last - 1], feed
