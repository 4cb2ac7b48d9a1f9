# SPDX-License-Identifier: GPL-2.0-or-later
"""The moves of a program with its edits, before they are written: what the interpreter will make of the text.

Called by run.py, so that a trial that is too deep need be neither written nor read.  Lengths mm, machine coordinates of
the tool's tip.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chipwise.program import records
from chipwise.rewrite import path_moves
from chipwise.rewrite.edits import Move
from chipwise.rewrite.growable_array import Growing
from chipwise.rewrite.program import Lead, Moves

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats, Ints
    from chipwise.rewrite.edits import Edits, Table
    from chipwise.rewrite.program import Event, Program

PART_STEPS = 16_384  # of the program that are worked on at a time
PART_MOVES = 65_536  # that are compared at a time
SAME_MM = 3e-5  # of two moves' ends: the last digit of the text, as a tie is rounded up or down


@dataclass
class Foreseen(Moves):
    """kind, line (n,) int, end (n, 3) mm, events, lead: as in program.Program; feed (n,) mm/min, NaN: the one in
    force."""

    kind: np.ndarray
    line: np.ndarray
    end: np.ndarray
    feed: np.ndarray
    events: list[Event]
    lead: Lead = Lead()


def foreseen(program: Program, edits: Edits) -> Foreseen:
    """Foreseen of a Program with Edits, made PART_STEPS at a time: no more than that is copied."""
    replaced, before = np.zeros(program.steps, bool), None
    columns = Growing(np.int8), Growing(np.int32), Growing(float, 3), Growing(np.float32)  # kind, line, end and feed
    replaced[edits.instead.steps] = True
    inch, feeds = np.array([modes.units == 20 for modes in program.modes]), _kept_feeds(program, edits.feeds)
    wanted = np.array([event.at for event in program.events], int)
    at = np.zeros(len(wanted), int)
    for first in range(0, program.steps, PART_STEPS):
        end = min(first + PART_STEPS, program.steps)
        (steps, kinds, new_feeds, ends), before = _new_moves(program, edits.moves(first, end), replaced, inch, before)
        a, b = program.first[[first, end]].tolist()
        kept = a + np.flatnonzero(~replaced[program.step[a:b]])
        behind = np.concatenate(
            (kept, program.first[steps + 1] - 1)
        )  # the move of the program that each is, or comes behind
        order = np.argsort(behind, kind="stable")
        at += np.searchsorted(behind[order], wanted)
        for column, *both in zip(
            columns,
            (program.kind[kept], program.line[kept], program.end[kept], feeds[kept]),
            (kinds, _lines(program, steps), ends, new_feeds),
        ):
            column.add(np.concatenate(both)[order])
    events = [type(e)(int(k), e.kind, e.line, e.values) for k, e in zip(at, program.events)]
    kind, line, moved, feed = (column.whole() for column in columns)
    return Foreseen(kind, line, moved, feed, events, program.lead)


@dataclass(frozen=True)
class _Before:
    """The edits' last move before a part: end (3,) mm and line; step of the last one that goes anywhere."""

    end: np.ndarray
    line: int
    step: int


def _new_moves(
    program: Program, moves: tuple[Ints, Table], replaced: Bools, inch: Bools, before: _Before | None
) -> tuple[tuple[Ints, Ints, Floats, Floats], _Before | None]:
    """((steps, kinds, feeds, ends) of Edits.moves(), the _Before of the moves behind).  before: a _Before or None."""
    steps, table = moves
    if not len(table):
        return _with_chords(program, replaced, table, steps, table.end, before), before
    ends, lines = _as_written(program, table.end, steps, inch), _lines(program, steps)
    end, line, step = (ends[0], -1, -1) if before is None else (before.end, before.line, before.step)
    same = (np.concatenate((end[None], ends[:-1])) == ends).all(axis=1)
    same &= np.concatenate((np.array([line]), lines[:-1])) == lines
    if before is None:
        same[0] = False
    goes = np.flatnonzero((table.kind == records.ARC) | ~same)  # the others would have no words
    behind = _Before(ends[-1].copy(), int(lines[-1]), int(steps[goes[-1]]) if len(goes) else step)
    return _with_chords(program, replaced, table.take(goes), steps[goes], ends[goes], before), behind


def _kept_feeds(program: Program, feeds: dict[int, float]) -> Floats:
    """(n,) float32: F of a program's moves with other F by step."""
    result = program.feed.astype(np.float32)
    for step, feed in feeds.items():
        result[program.first[step] : program.first[step + 1]] = feed
    return result


def _lines(program: Program, steps: Ints) -> Ints:
    """(n,) int: the lines of the program itself that make steps."""
    return program.places[program.first[steps]]


def _as_written(program: Program, points: Floats, steps: Ints, inch: Bools) -> Floats:
    """Program.as_written() of (n, 3) points, each at a step of its own; inch (lines,) bool: whether G20 is in force on
    each line."""
    group = program.frame[steps] * 2 + inch[np.clip(_lines(program, steps), 1, len(inch)) - 1]
    result = points.copy()
    for one in np.unique(group):
        own = np.flatnonzero(group == one)
        result[own] = program.as_written(points[own], int(steps[own[0]]))
    return result


def _with_chords(
    program: Program, replaced: Bools, moves: Table, steps: Ints, ends: Floats, before: _Before | None
) -> tuple[Ints, Ints, Floats, Floats]:
    """(steps, kinds, feeds, ends) of a Table of moves that end at `ends`, arcs in chords; replaced (m,) bool: steps of
    the program; before: _Before or None."""
    arcs = sorted(moves.circles)
    parts, count = [], np.ones(len(moves), int)
    for k, last in zip(arcs, (-1, *arcs)):
        step = int(steps[k])
        old = (int(steps[k - 1]), ends[k - 1]) if k else (before.step, before.end) if before else (None, None)
        if old[0] in ((step, step - 1) if replaced[step] else (step,)):
            begin = old[1]
        elif replaced[step]:
            begin = program.start(int(program.first[step]))
        else:
            begin = program.end[program.first[step + 1] - 1]
        made = path_moves.chords(begin, Move(records.ARC, tuple(ends[k].tolist()), None, moves.circles[k]))
        parts += [ends[last + 1 : k], made]
        count[k] = len(made)
    parts.append(ends[arcs[-1] + 1 :] if arcs else ends)
    return (
        np.repeat(steps, count),
        np.repeat(moves.kind, count),
        np.repeat(moves.feed.astype(np.float32), count),
        np.concatenate(parts),
    )


def same_moves(path: Foreseen, program: Program) -> bool:
    """Whether a Program makes the moves of a Foreseen, to SAME_MM, with the same tools in the same stocks."""

    def cuts(one: Moves) -> list[tuple[int, int, list[float]]]:
        return [(e.at, e.kind, e.values) for e in one.events if e.kind in (records.TOOL, records.STOCK)]

    return (
        len(path.kind) == len(program.kind)
        and path.lead.named_from == program.lead.named_from
        and bool(((path.kind == records.RAPID) == (program.kind == records.RAPID)).all())
        and all(
            float(np.abs(path.end[k : k + PART_MOVES] - program.end[k : k + PART_MOVES]).max()) <= SAME_MM
            for k in range(0, len(path.kind), PART_MOVES)
        )
        and cuts(path) == cuts(program)
    )
