# SPDX-License-Identifier: GPL-2.0-or-later
"""G79: arcs onto and off finished walls and the run over the seam, by support/wall_judge.py."""

import dataclasses
import math

import numpy as np
import pytest

from support import wall_judge
from support.engagement_shapes import SHAPES
from support.glyph_shapes import Font, fonts
from support.hole_oracle import Element
from support.pocket_judge import case_of, random_request, verdict
from support.pocket_requests import BOX, faults, request, walked
from support.pocket_random import circle, rectangle
from support.random_cases import random_count, random_seed
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import LineElement, make_contour
from chipwise.geometry.pocket.machinable import split
from chipwise.geometry.pocket.strategies import NAMES, STRATEGIES
from chipwise.geometry.pocket.wall_arcs import Walls, over_seam

TANGENT = 0.05  # degrees; six decimals of a short arc are less


def finishes(asked):
    return wall_judge.finishes(case_of(asked), walked(asked), asked.bottom + asked.floor_allowance)


@pytest.mark.parametrize("climb", [True, False])
@pytest.mark.parametrize("name", sorted(SHAPES))
@pytest.mark.parametrize("strategy", sorted(NAMES))
def test_every_wall_is_come_onto_and_left_on_an_arc(strategy, name, climb):
    asked = request(SHAPES[name], strategy=strategy, climb=climb)
    found = finishes(asked)
    assert len(found) == len(SHAPES[name])
    for finish in found:
        assert finish.on is not None and finish.on < TANGENT and finish.off is not None and finish.off < TANGENT
        assert finish.past == pytest.approx(0.3, abs=1e-3)


def rows_to_the_wall(field, strategy, radius, step, walls):
    """mm between the finished walls and what is cut before them."""
    border = elements.join(field.contours)
    ends = [
        end
        for track in STRATEGIES[strategy](field, radius, step, 0.3, True, walls)
        for end in track.elements.end
        if not track.wall
    ]
    return min(
        (elements.distances(border, np.arange(len(border)), np.broadcast_to(end, (len(border), 2))).min())
        for end in ends
    )


@pytest.mark.parametrize("name", sorted(SHAPES))
@pytest.mark.parametrize("strategy", [1, 2])
def test_rows_end_before_the_walls(strategy, name):
    """0.04 tool radii; to the wall itself without Walls."""
    contours = [make_contour(parts) for parts in SHAPES[name]]
    for field in split(contours[0], contours[1:], 3.0):
        assert rows_to_the_wall(field, strategy, 3.0, 2.4, Walls(field, 3.0, True, 0.3)) > 0.12 - 1e-5
        assert rows_to_the_wall(field, strategy, 3.0, 2.4, None) < 1e-6


@pytest.mark.parametrize("strategy", [1, 2])
@pytest.mark.parametrize("wide", [6.05, 6.2, 6.3])
def test_necks_where_rows_have_no_room_before_the_walls(strategy, wide):
    """Two rooms and a neck hardly wider than the tool, and a room without a row: nothing is left, one room is one entry
    of P2."""
    low, high = 10.0 - 0.5 * wide, 10.0 + 0.5 * wide
    x = (0, 20, 20, 40, 40, 60, 60, 40, 40, 20, 20, 0)
    y = (0, 0, low, low, 0, 0, 20, 20, high, high, 20, 20)
    corners = list(zip(map(float, x), map(float, y)))
    two = tuple(LineElement(a, b, 1) for a, b in zip(corners, corners[1:] + corners[:1]))
    assert faults(request((two,), strategy=strategy)) == []
    assert faults(request((two,), strategy=strategy, step=5.9)) == []
    assert faults(request((rectangle(0, 0, 6.2, 6.2),), strategy=strategy)) == []
    (field,) = split(make_contour(two), [], 3.0)
    assert (Walls(field, 3.0, True, 0.3).within is field) == (wide < 6.24)


@pytest.mark.parametrize("strategy", sorted(NAMES))
@pytest.mark.parametrize("overlap", [0.0, 2.5, 500.0])
def test_the_seam_overlap(strategy, overlap):
    """At most once more around."""
    asked = request((circle(20, (0, 0)),), strategy=strategy, seam_overlap=overlap)
    (finish,) = finishes(asked)
    assert finish.past == pytest.approx(min(overlap, 34 * math.pi), abs=1e-3)
    assert faults(asked) == []


@pytest.mark.parametrize("strategy", sorted(NAMES))
def test_a_region_that_is_a_line_has_no_arcs(strategy):
    asked = request((rectangle(0, 0, 6, 30),), strategy=strategy)
    assert not any(e.kind == "arc" for e in walked(asked)) and faults(asked) == []


@pytest.mark.parametrize("strategy", sorted(NAMES))
def test_random_walls(strategy):
    """No fault of the pocket's judge, and where the tool comes from its depth or leaves at it it is tangent in most
    cases."""
    first, good, every = random_seed(), 0, 0
    for seed in range(first, first + random_count(4)):
        asked = random_request(seed, strategy)
        found, plan = verdict(asked, seed)
        assert found == [], f"tools/judge pocket {seed} {strategy}"
        for finish in finishes(asked) if plan is not None else ():
            every, good = every + 1, good + (finish.off is not None and finish.off < TANGENT)
    assert 2 * good >= every


@pytest.mark.parametrize("strategy", sorted(NAMES))
def test_letters(strategy):
    font = Font(next(iter(fonts().values())))
    for code in (ord("B"), ord("S")):
        asked = dataclasses.replace(request(font.loops(code, 70.0), tool_radius=1.5, step=1.2, strategy=strategy))
        assert faults(asked) == []
        assert all(f.off is not None and f.off < TANGENT for f in finishes(asked))


def test_smaller_arcs_where_the_widest_has_no_room():
    """A corridor between island and wall that is a little wider than the tool: no arc of P0 leaves the region."""
    for wide in (6.3, 7.0, 9.0):
        (field,) = split(make_contour(rectangle(0, 0, 40, wide)), [], 3.0)
        chain = Walls(field, 3.0, True, 0.3).finished(field.boundary)
        arc = elements.take(chain, np.array([len(chain) - 1]))
        assert arc.is_arc[0] and elements.point_at(arc, np.array([0]), np.array([1.0]))[0][1] <= wide - 3.0
        assert faults(request((rectangle(0, 0, 40, wide),))) == []


def test_over_the_seam_is_the_first_of_a_chain():
    loop = make_contour(BOX).elements
    assert over_seam(loop, 0.0) == [] and over_seam(loop, 1e4) == [loop]
    (again,) = over_seam(loop, 62.0)
    assert elements.lengths(again).sum() == pytest.approx(62.0) and again.end[-1].tolist() == pytest.approx([60.0, 2.0])


def test_the_judge_sees_a_square_start():
    """A wall that is struck square and left square, and one that is not passed again."""
    asked = request((rectangle(0, 0, 30, 30),))
    corner = [(10.0, 3.0), (27.0, 3.0), (27.0, 27.0), (3.0, 27.0), (3.0, 3.0), (10.0, 3.0)]
    path = [(10.0, 9.0), *corner, (10.0, 9.0)]
    moves = [Element("feed", (*a, -4.0), (*b, -4.0)) for a, b in zip(path, path[1:])]
    (finish,) = wall_judge.finishes(case_of(asked), moves, -4.0)
    assert finish.on == pytest.approx(90.0) and finish.off == pytest.approx(90.0) and finish.past == 0.0
    assert wall_judge.finishes(case_of(asked), moves[:-3], -4.0) == []
    (finish,) = wall_judge.finishes(case_of(asked), moves[1:-1], -4.0)
    assert finish.on is None and finish.off is None
