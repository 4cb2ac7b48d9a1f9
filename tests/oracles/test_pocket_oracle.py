# SPDX-License-Identifier: GPL-2.0-or-later
"""The oracle of pockets is able to fail: moves of G79 that are made worse, each seen
(tests/support/pocket_oracle.py)."""

import math
from dataclasses import replace

from support import hole_oracle as trace
from support import pocket_oracle as oracle
from chipwise.cycles import pocket as cycle
from chipwise.moves import Arc, Line, Rapid
from support.pocket_requests import BOX, request, faults
from support.pocket_judge import case_of
from support.pocket_random import circle

JUDGED = request((BOX, circle(6, (30, 20))), depth_step=2.5)


def sabotaged(change):
    """Faults after change(list of moves)."""
    moves = list(cycle.pocket_plan(JUDGED).moves)
    return " ".join(faults(JUDGED, change(moves)))


def nth(moves, kind, n, wanted=lambda m: True):
    return [k for k, m in enumerate(moves) if isinstance(m, kind) and wanted(m)][n]


def without_the_last_ring(moves):
    """Without the last run along the island, of 9 mm, and what follows it but the end."""
    ring = [
        isinstance(m, Arc)
        and m.z is None
        and (m.cx, m.cy) == (30.0, 20.0)
        and abs(math.hypot(m.x - 30.0, m.y - 20.0) - 9.0) < 1e-6
        for m in moves
    ]
    last = len(ring) - ring[::-1].index(True)
    while ring[last - 1]:
        last -= 1
    return moves[:last] + moves[-1:]


def test_the_oracle_finds_nothing_in_the_original():
    assert faults(JUDGED) == []


def test_the_oracle_sees_a_gouge():
    def closer(moves):
        k = nth(moves, Line, -2, lambda m: m.z is None)
        return moves[:k] + [replace(moves[k], x=moves[k].x + 0.01, y=moves[k].y + 0.01)] + moves[k + 1 :]

    assert "gouge" in sabotaged(closer) or "gouge" in sabotaged(
        lambda m: [
            replace(e, y=e.y - 0.002) if getattr(e, "y", None) is not None and not isinstance(e, Arc) else e for e in m
        ]
    )
    assert "gouge" in sabotaged(lambda m: m[:-1] + [Line(x=30.0, y=20.0, feed=600.0)] + m[-1:])  # into the island
    assert "gouge" in sabotaged(lambda m: m[:-1] + [Line(x=90.0, y=20.0, feed=600.0)] + m[-1:])  # outside


def test_the_oracle_sees_residue_and_a_wall_left_out():
    """A third of the moves of the last level gone; and the last ring about the island alone."""
    assert "residue" in sabotaged(lambda m: m[: 5 * len(m) // 6] + m[-1:])
    assert "wall not run" in sabotaged(without_the_last_ring)


def test_the_oracle_sees_a_rapid_through_stock():
    def rapid(moves):
        k = max(
            (k for k, m in enumerate(moves) if isinstance(m, Line) and m.z is None and k < len(moves) // 3),
            key=lambda k: math.dist((moves[k].x, moves[k].y), (moves[k - 1].x or 0, moves[k - 1].y or 0)),
        )
        return moves[:k] + [Rapid(x=moves[k].x, y=moves[k].y)] + moves[k + 1 :]

    assert "rapid" in sabotaged(rapid)
    assert "rapid" in sabotaged(lambda m: [Rapid(z=1.0), Rapid(x=20.0, y=30.0), Rapid(z=0.9)] + m)


def test_the_oracle_sees_entries_and_floor():
    steep = request((BOX, circle(6, (30, 20))), depth_step=2.5, ramp_angle=4.0)
    moves = cycle.pocket_plan(steep).moves
    assert "slope" in " ".join(oracle.judge(case_of(steep), trace.walk(moves, steep.start), 3.0, cycle.GAP_MM, ()))
    k = nth(moves, Arc, 0)
    assert "plunge" in sabotaged(lambda m: m[:k] + [Line(z=-1.5, feed=1.0)] + m[k:])
    assert "too deep" in sabotaged(lambda m: m[:-1] + [Line(z=-4.01, feed=1.0)] + m[-1:])
