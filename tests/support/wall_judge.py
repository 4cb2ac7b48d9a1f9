# SPDX-License-Identifier: GPL-2.0-or-later
"""How a pocket's finished walls are come onto and left, from the moves alone.  Called by
tests/cycles/test_pocket_walls.py and bench/bench_walls.py.

A move is on a wall if both its ends and its middle touch one.  A finish is a row of such moves that passes its own
start again; of several along one wall the last counts.  Lengths mm.
"""

import math
from dataclasses import dataclass

import numpy as np

from support import hole_oracle as trace
from support import pocket_oracle as oracle

ON_MM, SAME_MM = 2e-4, 1e-4


@dataclass(frozen=True)
class Finish:
    """place; on, off: degrees between the wall and the feed before and after, None where there is none at the depth;
    past: mm that it runs on over its start."""

    place: tuple
    on: object
    off: object
    past: float


def heading(e, at_end):
    """rad, in the plane"""
    if e.kind != "arc":
        return math.atan2(e.b[1] - e.a[1], e.b[0] - e.a[0])
    start, turn = e.sweep
    return start + (turn if at_end else 0.0) + math.copysign(math.pi / 2, turn)


def length(e):
    return e.radius * abs(e.sweep[1]) if e.kind == "arc" else math.dist(e.a[:2], e.b[:2])


def finishes(case, moves, level):
    """[Finish] of the moves at a level."""
    level_feed = [
        e.kind != "rapid" and abs(e.a[2] - level) < 1e-6 and abs(e.b[2] - level) < 1e-6 and length(e) > 1e-9
        for e in moves
    ]
    places = np.array([oracle.on_path(e, max(length(e), 1e-9) / 2)[[0, -1]].tolist() + [middle(e)] for e in moves])[
        :, :, :2
    ]
    gap = np.abs(oracle.clearance(case.loops, places.reshape(-1, 2)) - case.distance).reshape(-1, 3).max(axis=1)
    on = np.array(level_feed) & (gap < ON_MM)
    found, k = [], 0
    while k < len(moves):
        last = k
        while last < len(moves) and on[last]:
            last += 1
        row = moves[k:last]
        at = next((n for n, e in enumerate(row, 1) if math.dist(e.b[:2], row[0].a[:2]) < SAME_MM), None)
        if at is not None and sum(map(length, row[:at])) > 20 * SAME_MM:
            again = Finish(
                row[0].a[:2],
                _between(moves, k - 1, level_feed),
                _between(moves, last - 1, level_feed),
                sum(map(length, row[at:])),
            )
            found = [
                f for f in found if min(float(trace.distance(e, *np.array(f.place)[:, None])[0]) for e in row) > ON_MM
            ] + [again]
        k = max(last, k + 1)
    return found


def middle(e):
    """(x, y, z) half along a move."""
    if e.kind != "arc":
        return [(a + b) / 2 for a, b in zip(e.a, e.b)]
    start, turn = e.sweep
    return [
        e.centre[0] + e.radius * math.cos(start + turn / 2),
        e.centre[1] + e.radius * math.sin(start + turn / 2),
        (e.a[2] + e.b[2]) / 2,
    ]


def _between(moves, k, level_feed):
    """Degrees that the path turns from move k to the next one; None where one of them is not a feed at the level."""
    if k < 0 or k + 1 >= len(moves) or not (level_feed[k] and level_feed[k + 1]):
        return None
    return abs(math.degrees(math.remainder(heading(moves[k + 1], False) - heading(moves[k], True), 2 * math.pi)))
