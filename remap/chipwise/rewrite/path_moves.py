# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves along paths of points: as they are written, and as LinuxCNC's interpreter gives them back.

Called by flute.py, levels.py and feed.py.  Straight steps lose the points on a line, arcs stay arcs where their shift
is the same.  Lengths mm, machine coordinates of the tool's tip.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chipwise.geometry.base.arc_sweep import arc_sweep, chord_angle
from chipwise.program.records import ARC, FEED
from chipwise.program.reader import CHORD_MM
from chipwise.rewrite import shift
from chipwise.rewrite.edits import Move, Table
from chipwise.rewrite.program import Circle

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats, Ints
    from chipwise.rewrite.program import Program

ARC_RAD = 2.9  # of a part of an arc at most: less than half a turn has one centre whatever its rounding
NEAR_SEGMENTS = 10  # that are done are travelled: going up, across and down between those beside them costs as much
LINE_MM = 2e-4  # points nearer to a line are on it


@dataclass
class Body:
    """points (n, 3) of the first path; move (n - 1,): the program's move each segment is a piece of; lead: vertical
    moves before; entered: the tool comes down from above to the first point."""

    points: np.ndarray
    move: np.ndarray
    lead: list[int]
    entered: bool = False


def without(points: Floats, done: Bools, above: float) -> tuple[Floats, Bools, Ints]:
    """A path along the segments of points (k + 1, 3) that are not done (k,) bool, up to `above` (mm), across and down
    between them.

    -> (places (n, 3), goes (n - 1,) bool: whether a move goes along a segment, segment (n - 1,) int: along which, or to
    which one it leads).  Some that are done may be travelled, too.
    """
    index = np.flatnonzero(~done)
    parts = np.split(index, np.flatnonzero(np.diff(index) > NEAR_SEGMENTS) + 1)
    places: list[Floats] = []
    goes: list[Bools] = []
    segment: list[Ints] = []
    for part in parts:
        a, b = int(part[0]), int(part[-1]) + 1
        if places:
            places.append(np.array([[*places[-1][-1, :2], above], [*points[a, :2], above]]))
            goes.append(np.zeros(3, bool))  # up, across, down
            segment.append(np.full(3, a))
        places.append(points[a : b + 1])
        goes.append(np.ones(b - a, bool))
        segment.append(np.arange(a, b))
    return np.concatenate(places), np.concatenate(goes), np.concatenate(segment)


def moves_along(program: Program, part: Body, path: Floats) -> tuple[Table, Ints]:
    """(Table of the moves along the path of a Body, (n, 2) int: the first and the last of its points that each of them
    goes along).

    path (n, 3): where the Body's points have been shifted to; NaN: left out.
    """
    steps = program.step[part.move]
    bounds = np.concatenate((np.array([0]), np.flatnonzero(np.diff(steps)) + 1, np.array([len(steps)])))
    circles = program.circle[steps[bounds[:-1]]]
    single = (circles < 0) & (
        (np.diff(bounds) == 1) | _lines(part.points, path[:, 2], bounds)
    )  # one straight move: most of a long program
    runs = [0, *(np.flatnonzero(np.diff(single)) + 1).tolist(), len(single)]
    tables, spans = [], []
    for a, b in zip(runs[:-1], runs[1:]):
        if single[a]:
            table, own = _singles(program, part, path, bounds[a:b], bounds[a + 1 : b + 1])
        else:
            table, own = _pieces(program, part, path, bounds[a : b + 1].tolist(), circles[a:b].tolist())
        tables.append(table)
        spans.append(own)
    return Table.joined(tables), np.concatenate(spans)


def _lines(points: Floats, z: Floats, bounds: Ints) -> Bools:
    """(k,) bool: whether the heights z (n,) of a path between the points `bounds` (k + 1,) are surely on a line, as
    kept_points() sees it."""
    s, a, b = shift.along(points), bounds[:-1], bounds[1:]
    of = np.repeat(np.arange(len(a)), b - a)  # of the points but the first
    length = np.where(s[b] > s[a], s[b] - s[a], np.nan)
    off = np.abs(z[1:] - z[a][of] - ((z[b] - z[a]) / length)[of] * (s[1:] - s[a][of]))
    return np.maximum.reduceat(off, a) <= LINE_MM - 1e-9  # NaN: no


def _singles(program: Program, part: Body, path: Floats, a: Ints, b: Ints) -> tuple[Table, Ints]:
    """(Table, spans) of straight steps from the points a (k,) to b (k,)."""
    there = ~np.isnan(path[b, 2])
    a, b = _travelled(path)[a[there]], b[there]
    return Table(np.full(len(a), FEED, np.int8), path[b], program.feed[part.move[b - 1]], {}), np.column_stack((a, b))


def _travelled(path: Floats) -> Ints:
    """(n,) int: of each point, itself, or the last one before it that is not left out."""
    return np.maximum.accumulate(np.where(np.isnan(path[:, 2]), 0, np.arange(len(path))))


def _pieces(program: Program, part: Body, path: Floats, bounds: list[int], circles: list[int]) -> tuple[Table, Ints]:
    """(Table, spans) of steps between the points `bounds`; circles: number of the circle of each, -1: straight."""
    moves, spans = [], []
    for a, b, circle in zip(bounds[:-1], bounds[1:], circles):
        feed = float(program.feed[part.move[a]])
        if circle >= 0:
            more, own = _arc(program.circles[circle], feed, part, path, a, b)
        else:
            more, own = _straight(feed, part, path, a, b)
        moves += more
        spans += own
    return Table.of(moves), np.array(spans, int).reshape(-1, 2)


def _straight(feed: float, part: Body, path: Floats, a: int, b: int) -> tuple[list[Move], list[tuple[int, int]]]:
    """([Move], spans) of the points a .. b of one straight step, those on a line left out."""
    moves, spans = [], []
    before = int(_travelled(path[: a + 1])[-1])
    for k in kept_points(shift.along(part.points[a : b + 1]), path[a : b + 1, 2]):
        if k > 0:
            moves.append(Move(FEED, tuple(path[a + k].tolist()), feed))
            spans.append((before, a + k))
            before = a + k
    return moves, spans


def _arc(
    circle: Circle, feed: float, part: Body, path: Floats, a: int, b: int
) -> tuple[list[Move], list[tuple[int, int]]]:
    """([Move], spans) of the points a .. b of one arc: arcs where the shift is the same, chords elsewhere."""
    moves, spans = [], []
    amount = path[:, 2] - part.points[:, 2]
    k = a
    while k < b:
        e = k + 1
        while e < b and abs(amount[e + 1] - amount[k]) < 1e-9 and abs(amount[e] - amount[k]) < 1e-9:
            e += 1
        if np.isnan(path[k : e + 1]).any() or abs(amount[e] - amount[k]) > 1e-9 or e - k < 3:
            for i in range(k + 1, e + 1):
                if not np.isnan(path[i, 2]):
                    moves.append(Move(FEED, tuple(path[i].tolist()), feed))
                    spans.append((i - 1, i))
        else:
            arcs, ends = arcs_through(circle, path[k : e + 1], float(amount[k]), feed)
            moves += arcs
            spans += [(k + i, k + j) for i, j in zip([0, *ends], ends)]
        k = e
    return moves, spans


def arcs_through(circle: Circle, points: Floats, amount: float, feed: float) -> tuple[list[Move], list[int]]:
    """(Arcs, index of the point each ends at) through points (n, 3) of a circle shifted by an amount along Z, none of
    more than ARC_RAD."""
    centre = (circle.centre[0], circle.centre[1], circle.centre[2] + amount)
    u, v = {1: (0, 1), 2: (1, 2), 3: (2, 0)}[circle.plane]
    angle = np.unwrap(np.arctan2(points[:, v] - centre[v], points[:, u] - centre[u]))
    parts = max(1, math.ceil(abs(angle[-1] - angle[0]) / ARC_RAD))
    ends = np.unique(np.round(np.linspace(0, len(points) - 1, parts + 1)).astype(int))[1:]
    turns = math.copysign(1.0, circle.turns)
    return [
        Move(ARC, tuple(points[e].tolist()), feed, Circle(circle.plane, centre, turns)) for e in ends.tolist()
    ], ends.tolist()


def polyline(start: Floats, moves: Table) -> tuple[Floats, Ints]:
    """(points (n, 3), owner (n - 1,)): a Table of moves from a place as program/reader.py gives them, arcs in
    chords."""
    begin = np.concatenate((np.array(start, float)[None], moves.end))
    count = np.ones(len(moves), int)
    parts: list[Floats] = []
    last = 0
    for number, circle in sorted(moves.circles.items()):
        made = chords(tuple(begin[number].tolist()), Move(ARC, tuple(moves.end[number].tolist()), None, circle))
        parts += [begin[last : number + 1], made]
        count[number], last = len(made), number + 2
    return np.concatenate((*parts, begin[last:])), np.repeat(np.arange(len(moves)), count)


def chords(begin: Floats | tuple[float, ...], move: Move) -> Floats:
    """(n, 3): ends of the chords of an arc of at most half a turn; its radius goes over from that of its begin to that
    of its end."""
    circle, end = move.arc, np.array(move.end)
    centre = circle.centre
    u, v = {1: (0, 1), 2: (1, 2), 3: (2, 0)}[circle.plane]
    along = 3 - u - v
    radius, last = (math.hypot(p[u] - centre[u], p[v] - centre[v]) for p in (begin, end))
    a0 = math.atan2(begin[v] - centre[v], begin[u] - centre[u])
    sweep = arc_sweep((begin[u], begin[v]), (end[u], end[v]), (centre[u], centre[v]), circle.turns)
    count = max(1, math.ceil(abs(sweep) / chord_angle(radius, CHORD_MM)))
    t = np.arange(1, count + 1) / count
    result = np.empty((count, 3))
    r, angle = radius + (last - radius) * t, a0 + sweep * t
    result[:, u], result[:, v] = centre[u] + r * np.cos(angle), centre[v] + r * np.sin(angle)
    result[:, along] = begin[along] + (end[along] - begin[along]) * t
    result[-1] = end
    return result


def kept_points(s: Floats, z: Floats, tolerance: float = LINE_MM) -> list[int]:
    """Indices of the points of a polyline (s, z) that stay when those within a tolerance of a line are left out; NaN:
    left out."""
    good = np.flatnonzero(~np.isnan(z))
    if not len(good):
        return []
    keep, stack = {int(good[0]), int(good[-1])}, [(0, len(good) - 1)]
    while stack:
        a, b = stack.pop()
        if b - a < 2:
            continue
        i, inner = good[[a, b]], good[a + 1 : b]
        line = np.interp(s[inner], s[i], z[i]) if s[i[1]] > s[i[0]] else np.full(len(inner), z[i[0]])
        off = np.abs(z[inner] - line)
        worst = int(off.argmax())
        if off[worst] > tolerance:
            keep.add(int(inner[worst]))
            stack += [(a, a + 1 + worst), (a + 1 + worst, b)]
    return sorted(keep)
