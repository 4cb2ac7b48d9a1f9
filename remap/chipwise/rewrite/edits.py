# SPDX-License-Identifier: GPL-2.0-or-later
"""What takes the place of a program's steps: made by flute.py and feed.py, written by text.py.

Long programs have millions of such moves: they are kept in arrays.  Lengths mm, machine coordinates of the tool's tip;
feeds mm/min.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Iterator, NamedTuple, Optional, Sequence

import numpy as np

from chipwise.program.records import ARC, RAPID
from chipwise.rewrite.program import Circle

if TYPE_CHECKING:
    from chipwise.clib.arrays import Ints
    from chipwise.rewrite.program import Program

BATCH = 1024  # Moves made at a time


class Move(NamedTuple):
    """A move to be written: kind RAPID, FEED or ARC; end (3,) mm; circle of an ARC; feed, None: the one in force."""

    kind: int
    end: tuple[float, ...]
    feed: Optional[float] = None
    circle: Optional[Circle] = None

    @property
    def arc(self) -> Circle:
        """The circle of an ARC."""
        assert self.circle is not None
        return self.circle


@dataclass(frozen=True)
class Table:
    """n Moves: kind (n,) int8; end (n, 3) mm; feed (n,), NaN: the one in force; circles by number of the ARC."""

    kind: np.ndarray
    end: np.ndarray
    feed: np.ndarray
    circles: dict[int, Circle]

    @classmethod
    def of(cls, moves: list[Move]) -> Table:
        """From Moves."""
        return cls(
            np.array([m.kind for m in moves], np.int8),
            np.array([m.end for m in moves], float).reshape(-1, 3),
            np.array([math.nan if m.feed is None else m.feed for m in moves], float),
            {k: m.arc for k, m in enumerate(moves) if m.kind == ARC},
        )

    @classmethod
    def joined(cls, tables: list[Table]) -> Table:
        """One Table after the other."""
        if len(tables) < 2:
            return tables[0] if tables else cls.of([])
        first = np.cumsum([0, *map(len, tables)]).tolist()
        circles = {at + k: circle for at, table in zip(first, tables) for k, circle in table.circles.items()}
        return cls(
            np.concatenate([table.kind for table in tables]),
            np.concatenate([table.end for table in tables]),
            np.concatenate([table.feed for table in tables]),
            circles,
        )

    def take(self, index: Ints) -> Table:
        """The Table of the moves `index` (k,) int."""
        kind = self.kind[index]
        circles = {k: self.circles[int(index[k])] for k in np.flatnonzero(kind == ARC).tolist()} if self.circles else {}
        return Table(kind, self.end[index], self.feed[index], circles)

    def part(self, first: int, end: int) -> Table:
        """The Table of the moves first .. end - 1."""
        circles = {k - first: self.circles[k] for k in range(first, end) if k in self.circles} if self.circles else {}
        return Table(self.kind[first:end], self.end[first:end], self.feed[first:end], circles)

    def __len__(self) -> int:
        return len(self.kind)

    def __iter__(self) -> Iterator[Move]:
        """The Moves."""
        for first in range(0, len(self), BATCH):
            part = slice(first, first + BATCH)
            rows = zip(self.kind[part].tolist(), self.end[part].tolist(), self.feed[part].tolist())
            for k, (kind, end, feed) in enumerate(rows, first):
                yield Move(kind, tuple(end), None if feed != feed else feed, self.circles.get(k))


class ByStep:
    """A Table for each of some steps of a program, and a note on it, said in a comment before its first line.  A step
    that is set twice has what was set last."""

    def __init__(self) -> None:
        self._parts: list[tuple[Ints, Ints, Table, Ints]] = []
        self._small = 0
        self._notes: list[str | None] = [None]

    def put(
        self, steps: Sequence[int] | Ints, first: Sequence[int] | Ints, table: Table, note: str | None = None
    ) -> None:
        """steps (k,) int, different; first (k + 1,) int: where the moves of each begin in the Table."""
        if note not in self._notes:
            self._notes.append(note)
        self._parts.append(
            (
                np.asarray(steps, np.int32),
                np.asarray(first, np.int32),
                table,
                np.full(len(steps), self._notes.index(note), np.int8),
            )
        )
        self._small += 1
        if self._small >= BATCH:
            self._parts[-BATCH:] = [_one(self._parts[-BATCH:])]
            self._small = 0

    def __setitem__(self, step: int, moves: list[Move]) -> None:
        self.put([step], [0, len(moves)], Table.of(moves))

    def _whole(self) -> tuple[Ints, Ints, Table, Ints]:
        if self._small or len(self._parts) != 1:
            self._parts, self._small = [_one(self._parts)], 0
        return self._parts[0]

    def merged(self) -> tuple[Ints, Ints, Table]:
        """(steps (k,) int, rising; first (k + 1,) int; Table)."""
        return self._whole()[:3]

    def part(self, begin: int, end: int | None = None) -> tuple[Ints, Ints, Table]:
        """merged() of the steps begin .. end - 1; end None: of all from there."""
        steps, first, table = self.merged()
        a, b = int(steps.searchsorted(begin)), len(steps) if end is None else int(steps.searchsorted(end))
        return steps[a:b], first[a : b + 1] - first[a], table.part(int(first[a]), int(first[b]))

    @property
    def steps(self) -> Ints:
        """(k,) int, rising."""
        return self._whole()[0]

    def get(self, step: int) -> Table | None:
        """The Table of a step."""
        steps, first, table, _ = self._whole()
        k = steps.searchsorted(step)
        return table.part(int(first[k]), int(first[k + 1])) if k < len(steps) and steps[k] == step else None

    def note(self, step: int) -> str | None:
        """The note on a step, None without one."""
        steps, _, _, note = self._whole()
        k = steps.searchsorted(step)
        return self._notes[note[k]] if k < len(steps) and steps[k] == step else None

    def notes(self) -> tuple[list[str | None], Ints]:
        """(the different notes, (k,) int8: which of them is on each step of merged())."""
        return self._notes, self._whole()[3]

    def __len__(self) -> int:
        return len(self.steps)


def _one(parts: list[tuple[Ints, Ints, Table, Ints]]) -> tuple[Ints, Ints, Table, Ints]:
    """One part of several, its steps rising."""
    if not parts:
        return np.zeros(0, np.int32), np.zeros(1, np.int32), Table.of([]), np.zeros(0, np.int8)
    steps, note = (np.concatenate([part[k] for part in parts]) for k in (0, 3))
    count = np.concatenate([np.diff(part[1]) for part in parts])
    begin = np.cumsum(count) - count
    own, last = np.unique(steps[::-1], return_index=True)
    last = len(steps) - 1 - last
    index, first = _ranges(begin[last], count[last])
    first = first.astype(np.int32)
    table = Table.joined([part[2] for part in parts])
    return (
        own,
        first,
        table if len(index) == len(table) and (np.diff(index) == 1).all() else table.take(index),
        note[last],
    )


def _ranges(begin: Ints, count: Ints) -> tuple[Ints, Ints]:
    """(begin[0] .. begin[0] + count[0] - 1, begin[1] .., where each begins in it (k + 1,))."""
    first = np.concatenate((np.array([0]), np.cumsum(count)))
    return np.arange(first[-1]) + np.repeat(begin - first[:-1], count), first


@dataclass
class Edits:
    """By number of step: `instead` the moves in its place, `after` those behind it, `feeds` a feed in its line's
    text."""

    instead: ByStep = field(default_factory=ByStep)
    after: ByStep = field(default_factory=ByStep)
    feeds: dict[int, float] = field(default_factory=dict)

    def changed(self) -> set[int]:
        """Numbers of the steps that change."""
        return {*self.instead.steps.tolist(), *self.after.steps.tolist(), *self.feeds}

    def moves(self, begin: int = 0, end: int | None = None) -> tuple[Ints, Table]:
        """(step (n,) int, rising, Table of n moves): what takes the place of the steps begin .. end - 1 or comes behind
        them; end None: of all."""
        parts = [own.part(begin, end) for own in (self.instead, self.after)]
        steps = np.concatenate([np.repeat(steps, np.diff(first)) for steps, first, _ in parts])
        order = np.argsort(steps, kind="stable")
        return steps[order], Table.joined([table for _, _, table in parts]).take(order)

    def __bool__(self) -> bool:
        return bool(len(self.instead) or len(self.after) or self.feeds)


def original(program: Program, step: int) -> Move:
    """A step of a program as a Move."""
    last = int(program.first[step + 1]) - 1
    kind = program.kind_of(step)
    circle = program.circles[program.circle[step]] if kind == ARC else None
    return Move(kind, tuple(program.end[last].tolist()), None if kind == RAPID else float(program.feed[last]), circle)
