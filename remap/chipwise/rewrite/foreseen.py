# SPDX-License-Identifier: GPL-2.0-or-later
"""The moves of a program with its edits, before they are written: what the interpreter will make of the text.

Called by run.py, so that a trial that is too deep need be neither written nor read.  Lengths mm, machine coordinates of the tool's tip.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.check import records
from chipwise.rewrite import along
from chipwise.rewrite.edits import Move
from chipwise.rewrite.program import Moves

SAME_MM = 3e-5              # of two moves' ends: the last digit of the text, as a tie is rounded up or down


@dataclass
class Foreseen(Moves):
    """kind, line (n,) int, end (n, 3) mm, events: as of program.Program; feed (n,) mm/min, NaN: the one in force."""

    kind: np.ndarray
    line: np.ndarray
    end: np.ndarray
    feed: np.ndarray
    events: list


def foreseen(program, edits):
    """Foreseen of a Program with Edits."""
    steps, moves = edits.moves()
    ends = _as_written(program, moves.end, steps)
    lines = _lines(program, steps)
    still = (moves.kind[1:] != records.ARC) & (ends[1:] == ends[:-1]).all(axis=1) & (lines[1:] == lines[:-1])
    goes = np.flatnonzero(np.concatenate(([True], ~still))[:len(moves)])        # the others would have no words
    replaced = np.zeros(program.steps, bool)
    replaced[edits.instead.steps] = True
    steps, kinds, feeds, ends = _with_chords(program, replaced, moves.take(goes), steps[goes], ends[goes])
    kept = np.flatnonzero(~replaced[program.step])
    kept_feed = _kept_feeds(program, edits.feeds)[kept]
    before = np.concatenate((kept, program.first[steps + 1] - 1))               # the move of the program that each is, or comes behind
    order = np.argsort(before, kind="stable")
    events = [type(e)(int(np.searchsorted(before[order], e.at)), e.kind, e.line, e.values) for e in program.events]
    return Foreseen(*(np.concatenate(pair)[order] for pair in ((program.kind[kept], kinds), (program.line[kept], _lines(program, steps)),
                                                               (program.end[kept], ends), (kept_feed, feeds))), events)


def _kept_feeds(program, feeds):
    """(n,) float32: F of a program's moves with other F by step."""
    result = program.feed.astype(np.float32)
    for step, feed in feeds.items():
        result[program.first[step]:program.first[step + 1]] = feed
    return result


def _lines(program, steps):
    """(n,) int: the lines of the program itself that make steps."""
    return program.places[program.first[steps]]


def _as_written(program, points, steps):
    """Program.as_written() of (n, 3) points, each at a step of its own."""
    inch = np.array([modes.units == 20 for modes in program.modes])
    group = program.frame[steps] * 2 + inch[np.clip(_lines(program, steps), 1, len(inch)) - 1]
    result = points.copy()
    for one in np.unique(group):
        own = np.flatnonzero(group == one)
        result[own] = program.as_written(points[own], int(steps[own[0]]))
    return result


def _with_chords(program, replaced, moves, steps, ends):
    """(steps, kinds, feeds, ends) of a Table of moves that end at `ends`, arcs in chords; replaced (m,) bool: steps of the program."""
    arcs = sorted(moves.circles)
    parts, count = [], np.ones(len(moves), int)
    for k, last in zip(arcs, (-1, *arcs)):
        step = int(steps[k])
        if k and steps[k - 1] in ((step, step - 1) if replaced[step] else (step,)):
            begin = ends[k - 1]
        elif replaced[step]:
            begin = program.start(int(program.first[step]))
        else:
            begin = program.end[program.first[step + 1] - 1]
        made = along.chords(begin, Move(records.ARC, tuple(ends[k].tolist()), None, moves.circles[k]))
        parts += [ends[last + 1:k], made]
        count[k] = len(made)
    parts.append(ends[arcs[-1] + 1:] if arcs else ends)
    return np.repeat(steps, count), np.repeat(moves.kind, count), np.repeat(moves.feed.astype(np.float32), count), np.concatenate(parts)


def same_moves(path, program):
    """Whether a Program makes the moves of a Foreseen, to SAME_MM, with the same tools in the same stocks."""
    def cuts(one):
        return [(e.at, e.kind, e.values) for e in one.events if e.kind in (records.TOOL, records.STOCK)]

    return (len(path.kind) == len(program.kind) and bool(((path.kind == records.RAPID) == (program.kind == records.RAPID)).all())
            and float(np.abs(path.end - program.end).max(initial=0.0)) <= SAME_MM and cuts(path) == cuts(program))
