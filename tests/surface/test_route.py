# SPDX-License-Identifier: GPL-2.0-or-later
"""Routes of links over heights, and their times: laws, closed forms and an independent planner (support/link_judge.py)."""
import math

import numpy as np
import pytest
from support import link_judge
from support.random_cases import random_count, random_seed

from chipwise.surface import route

TOP = 20.0


def random_needs(rng):
    at = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 3.0, rng.integers(1, 40)))])
    needs = np.cumsum(rng.normal(0, rng.choice([0.1, 1.0, 4.0]), len(at) - 1))
    return at, needs, needs[0] + rng.uniform(-1, 3), needs[-1] + rng.uniform(-1, 3)


def below(points, at, needs):
    """How far (mm) a route is below a need anywhere."""
    corners = np.concatenate([at, points[:, 0]])
    found = 0.0
    for a, b, need in zip(at[:-1], at[1:], needs):
        inside = corners[(corners > a + 1e-9) & (corners < b - 1e-9)]
        for x in (a + 1e-9, *inside, b - 1e-9):
            heights = [np.interp(x, *pair.T) for pair in zip_pairs(points) if pair[0, 0] <= x <= pair[1, 0]]
            found = max(found, need - min(heights))
    return found


def zip_pairs(points):
    return [points[k:k + 2] for k in range(len(points) - 1)]


def test_random_routes_are_over_all_needs_and_under_the_top():
    rng = np.random.default_rng(random_seed())
    for case in range(random_count(200)):
        at, needs, start, end = random_needs(rng)
        needs, start, end = (np.minimum(v, TOP - 1) for v in (needs, start, end))
        blend = float(rng.choice([0.0, 0.35]))
        found = route.routes(at, needs, start, end, TOP, blend)
        assert len(found) >= 2
        for points in found:
            assert below(points, at, needs) <= 1e-6, (random_seed(), case)
            assert points[0, 1] >= start - 1e-9 and points[-1, 1] >= end - 1e-9 and points[:, 1].max() <= TOP + 1e-9
            assert points[0, 0] == at[0] and points[-1, 0] == pytest.approx(at[-1]) and (np.diff(points[:, 0]) >= -1e-9).all()
            assert len(points) <= route.MOST_SIDES + 2


def test_the_judge_of_needs_sees_one():
    assert below(np.array([(0.0, 1.0), (10.0, 1.0)]), np.array([0.0, 4.0, 10.0]), np.array([0.0, 3.0])) == pytest.approx(2.0)


def test_needs_above_the_top_end_there():
    """The clearance plane is clear whatever the map says."""
    (points, *_rest) = route.routes(np.array([0.0, 5.0, 10.0]), np.array([1.0, 99.0]), 0.0, 0.0, 8.0, 0.3)
    assert points[:, 1].max() == 8.0


def test_closed_forms_of_the_time():
    """Long moves v / a + l / v, short ones 2 sqrt(l / a), and both axes together."""
    def time(*points, blend=0.0):
        return route.seconds(np.array(points, float), blend)
    assert time((0, 0, 0), (40, 0, 0)) == pytest.approx(0.6)
    assert time((0, 0, 0), (0, 0, 5)) == pytest.approx(0.2)
    assert time((0, 0, 0), (40, 0, 40)) == pytest.approx(0.6)
    assert time((0, 0, 0), (40, 0, 0), (40, 30, 0)) == pytest.approx(0.6 + 0.5)
    assert time((0, 0, 0), (20, 0, 0), (20, 0, 0), (40, 0, 0)) == pytest.approx(0.6)
    assert time((1, 2, 3)) == time((1, 2, 3), (1, 2, 3)) == 0.0
    radius = 0.5 / (math.sqrt(2) - 1)               # of the arc that is 0.5 mm off a right angle
    slow, straight = math.sqrt(0.75 ** 0.5 * 500 * radius), 40 + 30 - 2 * radius
    ramps = 2 * 100 ** 2 / 500 - slow ** 2 / 500
    expected = 2 * (100 + 100 - slow) / 500 + (straight - ramps) / 100 + radius * math.pi / 2 / slow
    assert time((0, 0, 0), (40, 0, 0), (40, 30, 0), blend=0.5) == pytest.approx(expected)


def test_random_times_are_those_of_the_judge():
    """By another planner, which passes over points 0.05 mm apart: at most 3 % off."""
    rng = np.random.default_rng(random_seed())
    for case in range(random_count(30)):
        points = np.cumsum(rng.uniform(-1, 1, (rng.integers(2, 8), 3)) * rng.choice([2.0, 15.0, 60.0]), axis=0)
        blend = float(rng.choice([0.002, 0.1, 0.5]))
        expected = link_judge.path_seconds(*link_judge.rounded(list(points), blend))
        assert route.seconds(points, blend) == pytest.approx(expected, rel=0.03), (random_seed(), case)


def test_hull():
    points = np.array([(0, 0), (1, 3), (1, 2), (2, 1), (4, 2), (5, 0)], float)
    assert route.upper_hull(points).tolist() == [[0, 0], [1, 3], [4, 2], [5, 0]]
    assert math.isclose(route.upper_hull(np.array([(0, 1), (2, 1)], float))[-1, 0], 2)
