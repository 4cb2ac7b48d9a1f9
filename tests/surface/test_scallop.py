# SPDX-License-Identifier: GPL-2.0-or-later
"""Step-over from a scallop height: what the cuts leave, along the normal, against what was asked, by brute force over
the moves."""

import itertools
import math

import numpy as np
import pytest
from support import drop_oracle, surface_cases, surface_judge

from chipwise.clib.height_map import Shape
from chipwise.cycles.surface import surface_plan
from chipwise.errors import CycleError
from chipwise.surface import scallop

START, ASKED = (-40.0, -40.0, 40.0), 0.05  # mm
FACETS = 0.004  # mm: a sphere's and a torus' triangles are that much inside of it
BALL, BULL = Shape(6, 3), Shape(6, 1)


def plane(across, along=0):
    """A plane of 12 x 8 mm that rises in Y and X, degrees."""
    x, y = np.array([0.0, 12]), np.array([0.0, 8])
    return surface_cases.terrain(
        x, y, math.tan(math.radians(across)) * y[:, None] + math.tan(math.radians(along)) * x[None, :]
    )


def torus(large, small, count):
    """The upper half of a ring about the origin."""
    turn, up = np.meshgrid(np.linspace(0, 2 * np.pi, count + 1), np.linspace(0, np.pi, count // 2 + 1))
    r = large + small * np.cos(up)
    p = np.stack([r * np.cos(turn), r * np.sin(turn), small * np.sin(up)], axis=2)
    a, b, c, d = p[:-1, :-1], p[:-1, 1:], p[1:, 1:], p[1:, :-1]
    return np.concatenate(
        [np.stack([a, b, d], axis=2).reshape(-1, 3, 3), np.stack([b, c, d], axis=2).reshape(-1, 3, 3)]
    )


STAMPS = itertools.count()


def plan_of(tmp_path, triangles, shape, **fields):
    file = surface_cases.write_stl(tmp_path / "model.stl", triangles)
    known = dict(tool=shape, stamp=(next(STAMPS),), step=3.0, start=START, scallop=ASKED)
    return surface_plan(surface_cases.request(file, **{**known, **fields}))


def stock_at(plan, shape, xy):
    """Heights that the moves leave at places (n, 2)."""
    needles = surface_judge.Needles(plan.low, plan.high, 1e3, 0, 0)
    needles.xy, needles.height = xy, np.full(len(xy), 1e3)
    needles.follow(plan.moves, START, shape)
    return np.column_stack([xy, needles.height])


def places(low, high, count=1500):
    return np.random.default_rng(7).uniform(low, high, (count, 2))


@pytest.mark.parametrize("degrees", [0, 20, 40, 60])
def test_planes(tmp_path, degrees):
    """Across the tracks and along them, both tools: at most what was asked, and the step-over is not needlessly
    small."""
    for along, shape in ((0, BALL), (30, BALL), (0, BULL)) if degrees else ((0, BALL),):
        plan = plan_of(tmp_path, plane(degrees, along), shape)
        a, b = math.tan(math.radians(along)), math.tan(math.radians(degrees))
        left = stock_at(plan, shape, places((3.5, 3.5), (8.5, 7.0)))
        found = (left[:, 2] - a * left[:, 0] - b * left[:, 1]) / math.sqrt(1 + a * a + b * b)
        assert -1e-3 <= found.min() and 0.5 * ASKED <= found.max() <= ASKED, (along, shape, found.max())


def test_sphere_and_torus(tmp_path):
    plan = plan_of(tmp_path, surface_cases.sphere(12.0, 160), BALL, bottom=3.0, direction=30.0)
    xy = places((-8, -8), (8, 8))
    xy = xy[np.hypot(*xy.T) < 9]
    found = np.linalg.norm(stock_at(plan, BALL, xy), axis=1) - 12
    assert -FACETS <= found.min() and 0.5 * ASKED <= found.max() <= ASKED, found.max()
    plan = plan_of(tmp_path, torus(12.0, 5.0, 160), BALL, bottom=1.0, margin=3.0)
    xy = places((-16, -16), (16, 16), 3000)
    r = np.hypot(*xy.T)
    left = stock_at(plan, BALL, xy[np.abs(r - 12) < 4])
    found = np.hypot(np.hypot(left[:, 0], left[:, 1]) - 12, left[:, 2]) - 5
    assert -FACETS <= found.min() and 0.5 * ASKED <= found.max() <= ASKED, found.max()


def test_a_step_over_that_is_too_large_is_seen(tmp_path):
    """The measure of the tests above is above 1 without the scallop, and D stays the largest step-over."""
    plan = plan_of(tmp_path, plane(60), BALL, scallop=None, step=1.0)
    left = stock_at(plan, BALL, places((3.5, 3.5), (8.5, 7.0)))
    assert ((left[:, 2] - math.tan(math.radians(60)) * left[:, 1]) / 2).max() > 2 * ASKED
    fine = plan_of(tmp_path, plane(0), BALL, step=0.3)
    assert fine.cuts == 1 + math.ceil(8 / 0.3)


def test_walls_do_not_stop_it(tmp_path):
    """Beside a vertical wall along the tracks there is no step-over without a scallop; the number of cuts stays
    sane."""
    step = np.concatenate([surface_cases.box((0, 0, -5), (25, 20, 0)), surface_cases.box((6, 6, 0), (15.3, 14.1, 4))])
    assert plan_of(tmp_path, step, BALL).cuts < 80


@pytest.mark.parametrize("shape", [BALL, BULL, Shape(6), Shape(6, 0, 60), Shape(6, 1, 20)])
def test_profile_on_a_slope(shape):
    """S(u) against a search along the track."""
    height, radius = drop_oracle.profile(shape)
    found = scallop.Profile(shape)
    for slope in (0.0, 0.4, 1.7):
        for u in (0.0, 0.9, 2.2, 2.9):
            s = np.linspace(-1, 1, 20001) * math.sqrt(radius**2 - u**2)
            expected = (slope * s + height(np.minimum(np.hypot(s, u), radius))).min()
            assert found.left(np.array([u]), np.array([slope]))[0] == pytest.approx(expected, abs=0.003), (slope, u)


def test_refused(tmp_path):
    for value, text in (
        (0.0, "scallop 0 mm is not above 0"),
        (float("nan"), "is not above 0"),
        (1e-5, "scallop 0 mm is below 0.001 mm"),
    ):
        with pytest.raises(CycleError) as error:
            plan_of(tmp_path, plane(0), BALL, scallop=value)
        assert text in str(error.value)


def test_with_levels_and_zigzag(tmp_path):
    """The same tracks in levels and in a zigzag."""
    base = plan_of(tmp_path, plane(40), BALL)
    assert plan_of(tmp_path, plane(40), BALL, link=2).cuts == 2 * base.cuts - 1
    leveled = plan_of(tmp_path, plane(40), BALL, depth=2.0)
    left = stock_at(leveled, BALL, places((3.5, 3.5), (8.5, 7.0)))
    found = (left[:, 2] - math.tan(math.radians(40)) * left[:, 1]) * math.cos(math.radians(40))
    assert found.max() <= ASKED + 0.05
