# SPDX-License-Identifier: GPL-2.0-or-later
"""Routes of links over heights, and their times: laws, closed forms and an independent planner
(support/link_judge.py)."""

import math

import numpy as np
import pytest
from support import link_judge
from support.random_cases import random_count, random_seed

from chipwise.surface import route

TOP = 20.0
FINE = 1e-4  # mm: the judge's arcs are points 0.05 mm apart


def random_lane(rng):
    """A Lane over random heights, with or without a corner seen from above, and with a start above the heights or a
    rise at it."""
    at = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 3.0, rng.integers(1, 40)))])
    needs = np.minimum(np.cumsum(rng.normal(0, rng.choice([0.1, 1.0, 4.0]), len(at))), TOP - 4)
    relief = float(rng.choice([0.1, 1.0, 2.0]))
    start, end = needs[0] - rng.choice([0.0, 2.0]), needs[-1] + rng.uniform(0, 0.5)
    corner = float(at[-1] * rng.uniform(0.05, 0.95)) if rng.random() < 0.6 else 0.0
    turn = rng.uniform(-1.2, 1.2)
    first = np.array([0.0, 0.0])
    bend = first + corner * np.array([1.0, 0.0])
    places = np.array([first, bend, bend + (at[-1] - corner) * np.array([math.cos(turn), math.sin(turn)])])
    limit = route.upper_hull(np.vstack([np.column_stack([at, needs]), [(at[-1], end)]]))
    lower = route.upper_hull(np.vstack([np.column_stack([at, needs - relief / 2]), [(at[-1], end - relief / 2)]]))
    return route.Lane(places, corner, limit, lower, float(start), float(limit[-1, 1]), TOP, 0.7 * relief)


def below(path, limit):
    """How far (mm) a path (k, 2) of distance and height is below a limit (n, 2), but where it goes straight up or down
    at its ends."""
    inside = (path[:, 0] > 1e-3) & (path[:, 0] < limit[-1, 0] - 1e-3)
    at = np.concatenate([path[inside, 0], limit[1:-1, 0]])
    keep = np.concatenate([[True], np.diff(path[:, 0]) > 1e-9])
    return float((np.interp(at, *limit.T) - np.interp(at, *path[keep | np.append(keep[1:], True)].T)).max(initial=0.0))


def distances(lane, chain):
    """How far along its lane each point (n, 3) of a path is, nearest by."""
    a, b, c = lane.places
    found = []
    for point in chain[:, :2]:
        both = []
        for start, end, first in ((a, b, 0.0), (b, c, lane.corner)):
            length = math.dist(start, end)
            share = np.clip((point - start) @ (end - start) / max(length, 1e-12) ** 2, 0, 1)
            both.append((math.dist(point, start + share * (end - start)), first + share * length))
        found.append(min(both)[1])
    return np.array(found)


def test_random_routes_are_over_the_limits_and_as_quick_as_they_say():
    """The corners by another judge. The first route is the quickest; test_random_times_are_those_of_the_judge has the
    times."""
    rng, seen = np.random.default_rng(random_seed()), 0
    for case in range(random_count(100)):
        lane = random_lane(rng)
        found = lane.routes()
        for number, (seconds, points) in enumerate(found):
            assert below(points, lane.limit) <= 1e-6, (random_seed(), case)
            assert points[0, 1] == lane.start and points[-1, 1] == lane.end and points[:, 1].max() <= TOP + 1e-6
            assert (
                points[0, 0] == 0.0
                and points[-1, 0] == pytest.approx(lane.limit[-1, 0])
                and (np.diff(points[:, 0]) >= 0).all()
            )
            chain = lane.chain(points)
            assert seconds >= found[0][0] - 1e-9
            if number > 2:
                continue
            arcs = link_judge.rounded(list(chain), lane.blend)[0]
            if not lane.corner:  # else the arc over the corner is beside the lane: test_surface_links.py has these
                assert below(np.column_stack([distances(lane, arcs), arcs[:, 2]]), lane.lower) <= FINE, (
                    random_seed(),
                    case,
                )
            assert seconds == pytest.approx(route.seconds(chain, lane.blend), rel=1e-6)
            seen += 1
    assert seen > random_count(100)


def flat(limit, lower, start=0.0, end=0.0, blend=0.7):
    """A Lane of 40 mm in a plane."""
    places = np.array([(0.0, 0.0), (0.0, 0.0), (40.0, 0.0)])
    return route.Lane(places, 0.0, np.array(limit, float), np.array(lower, float), start, end, TOP, blend)


def test_routes_that_may_not_be_are_refused():
    """A side below the limit, an arc below the lower one, a point above the top or back along the lane."""
    lane = flat([(0, 0), (20, 5), (40, 0)], [(0, 0), (20, 4.5), (40, 0)])
    good = np.array([(0.0, 0), (20, 5.8), (40, 0)])
    assert lane._seconds(good, False) < 1
    for bad in (
        [(0.0, 0), (20, 4.9), (40, 0)],
        [(0.0, 0), (15, 5.5), (40, 0)],
        [(0.0, 0), (20, TOP + 1), (40, 0)],
        [(0.0, 0), (25, 6), (20, 6), (40, 0)],
    ):
        assert lane._seconds(np.array(bad), False) == route.layout.ROUTE_BAD, bad
    tight = flat([(0, 0), (20, 5), (40, 0)], [(0, 0), (20, 5), (40, 0)])
    assert tight._seconds(np.array([(0.0, 0), (20, 5), (40, 0)]), False) == route.layout.ROUTE_BAD  # its arc is below
    assert tight._seconds(good, False) < 1


def test_the_search_arches_over_a_block():
    """Over a block with steep sides: quicker than the hull, over it, and never quicker than the distance alone."""
    block = [(0, 0), (2, 5), (38, 5), (40, 0)]
    lane = flat(block, [(at, height - 0.5 * (height > 0)) for at, height in block])
    (seconds, points), *first = lane.routes()
    assert 0.6 <= seconds < 0.92 * min(one for one, _points in first)
    assert below(points, lane.limit) <= 1e-6 and points[:, 1].max() > 5.5


def test_the_judge_of_needs_sees_one():
    limit = np.array([(0.0, 0.0), (4.0, 3.0), (10.0, 1.0)])
    assert below(np.array([(0.0, 1.0), (10.0, 1.0)]), limit) == pytest.approx(2.0)


def test_a_limit_at_the_top_is_gone_over_there():
    lane = flat([(0, 0), (20, TOP), (40, 0)], [(0, 0), (20, TOP), (40, 0)])
    assert all(points[:, 1].max() == TOP for _seconds, points in lane.routes())
    assert lane.level()[:, 1].tolist() == [0, TOP, TOP, 0]


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
    radius = 0.5 / (math.sqrt(2) - 1)  # of the arc that is 0.5 mm off a right angle
    slow, straight = math.sqrt(0.75**0.5 * 500 * radius), 40 + 30 - 2 * radius
    ramps = 2 * 100**2 / 500 - slow**2 / 500
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
