# SPDX-License-Identifier: GPL-2.0-or-later
"""The oracle of chopped contours is able to fail: lines and passes that are made worse, each seen
(tests/support/chop_oracle.py)."""

import math

import pytest

from support import chop_oracle as oracle
from support.chop_judge import SQUARE, Chopped, outline, verdict


@pytest.fixture(scope="module")
def honest():
    return Chopped([outline(*[(x / 2, y / 2) for x, y in SQUARE])], 0.5, 5.4)


def test_honest_motions_pass(honest):
    assert len(honest.lines()) == 6 and verdict(honest, stages=True)[0] == []


def long(el, by):
    """A line longer by `by` mm at its end."""
    _, x0, y0, x1, y1 = el
    n = math.hypot(x1 - x0, y1 - y0)
    return ("L", x0, y0, x1 + by * (x1 - x0) / n, y1 + by * (y1 - y0) / n)


@pytest.mark.parametrize(
    "name, change, complaint",
    [
        ("one line missing", lambda lines: lines[:3] + lines[4:], "piece of"),
        (
            "a line 2 um too long",
            lambda lines: lines[:-1] + [[long(el, 0.002) for el in lines[-1]]],
            "outside the contour",
        ),
        ("a line 2 mm too short", lambda lines: [[long(el, -2.0) for el in lines[0][-1:]]] + lines[1:], "piece of"),
    ],
)
def test_oracle_rejects(honest, name, change, complaint):
    found, _ = verdict(honest, lines=change(honest.lines()))
    assert any(complaint in text for text in found), found


def test_oracle_rejects_a_path_that_is_not_run(honest):
    """Without the contour's pass the outer pieces hang on the part; with half of it one is missing nothing is loose."""
    cuts = [el for line in honest.lines() for el in line]
    every = oracle.final_pieces(honest.finish, cuts + [el for loop in honest.paths for el in loop], 0.5)
    inner = oracle.final_pieces(honest.finish, cuts, 0.5)
    assert len(every) == 16 and len(inner) == 4


def test_oracle_sees_what_is_loose_too_early(honest):
    lines, paths = honest.lines(), honest.paths
    first, second = lines[:3], lines[3:]
    assert "on the way" in str(verdict(honest, lines=[[el for loop in paths for el in loop]] + lines, stages=True)[0])
    skipped = first + [second[0], second[2], second[1]]  # the middle line last: a strip two cells wide is loose
    assert "on the way" in str(verdict(honest, lines=skipped, stages=True)[0])


def test_oracle_sees_a_broken_bridge():
    """A tongue on a bridge of half a cell is loose, on one of two cells it is not."""
    for wide, loose in ((0.5, True), (2.5, False)):
        stage = oracle.Stage(
            [[("L", 0, 0, 10, 0), ("L", 10, 0, 10, 10), ("L", 10, 10, 0, 10), ("L", 0, 10, 0, 0)]], 0.5
        )
        gap = wide * oracle.CELL
        y = stage.y[stage.y.shape[0] // 2, 0] + 0.3 * oracle.CELL
        for path in (
            ("L", 2, 2, 8, 2),
            ("L", 8, 2, 8, 8),
            ("L", 8, 8, 2, 8),
            ("L", 2, 2, 2, y - 0.5),
            ("L", 2, y + 1.0 * gap + 0.5, 2, 8),
        ):
            stage.cut(path)
        assert bool(stage.loose()) == loose
