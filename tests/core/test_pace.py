# SPDX-License-Identifier: GPL-2.0-or-later
"""Feeds above the stock as fast as the axes: where the path comes down the tool has the speed of the move there
(path_pace.h; feed.h, 14)."""

import math
import random

import pytest

from chipwise.clib import core
from support.feed_cases import CEILING, CONSTANT, law
from support.path_cases import ACCEL, chain

CLEAR, CEIL, AXES, DT = 0.5, 2.0, 100.0, 0.001
NONE, UNKNOWN = -1.0, -2.0


def place(path, **asked):
    """(distance, vel, accel) of its pace."""
    found = path.pace(CLEAR, CEIL, **asked)
    return found.distance, found.vel, found.accel


OVER = [(0, 0, 10), (40, 0, 10), (40, 0, -2), (70, 0, -2)]  # across above, down, along


def test_where_it_comes_down():
    """At the clearance, with the F of that move; before it nothing limits, and behind it the ceiling does."""
    path = chain(OVER, (20.0, 5.0, 20.0))
    assert place(path) == pytest.approx((40 + 9.5, 5.0, ACCEL), abs=1e-3)
    path.follow(1, 40.0, 30.0)
    assert place(path) == pytest.approx((19.5, 5.0, ACCEL), abs=1e-3)
    path.follow(2, 12.0, 11.0)
    assert place(path) == pytest.approx((0.0, 5.0, 0.0))
    path.follow(3, 30.0, 1.0)
    assert place(path) == pytest.approx((0.0, CEIL * 20.0, 0.0))
    assert place(chain([(0, 0, -2), (1, 0, 9), (50, 0, 9)], (5.0, 5.0)))[1] == 10.0  # up is not down,
    assert place(chain([(0, 0, -2), (0, 0, 9), (50, 0, 9)], (5.0, 5.0)))[0] == NONE  # and straight up nothing is cut


def test_what_limits_nothing():
    assert place(chain(OVER[:2], (20.0,)))[0] == NONE
    assert place(chain([(0, 0, CLEAR), (40, 0, CLEAR)], (20.0,)))[0] == NONE  # a retract plane at the clearance
    assert place(chain(OVER, (20.0, 5.0, 20.0), rapid=(2, 3)))[0] == NONE
    assert place(chain(OVER, (20.0, 5.0, 20.0), stops=(1,)))[0] == NONE  # at rest before it
    assert place(chain(OVER, (0.0, 0.0, 0.0)))[0] == NONE  # the planner has F itself
    assert place(core.ProgrammedPath())[0] == UNKNOWN
    for odd in (math.nan, math.inf, 0.5):
        assert chain(OVER, (20.0, 5.0, 20.0)).pace(CLEAR, odd).distance == UNKNOWN
    assert chain(OVER, (20.0, 5.0, 20.0)).pace(math.nan, CEIL).distance == UNKNOWN


def test_the_lowest_of_several():
    """A slow move far away against a faster one that is near: whichever asks for less now."""
    points = [(0, 0, 0), (10, 0, 0), (20, 0, 0), (60, 0, 0), (60, 0, -1)]
    path = chain(points, (30.0, 20.0, 30.0, 1.0))
    assert place(path)[:2] == (0.0, 60.0)
    path.follow(1, 10.0, 9.5)
    assert place(path)[:2] == pytest.approx((0.5, 40.0)) and place(path, override=0.2)[:2] == (0.0, 60.0)
    near = [(0, 0, 0), (2, 0, 0), (2.2, 0, 0), (2.2, 0, -1)]
    assert place(chain(near, (30.0, 30.0, 1.0)))[:2] == pytest.approx((2.2, 1.0), abs=1e-6)


def test_a_path_that_ends_before_the_braking_distance():
    """What lies behind what is known may go down."""
    path = chain(OVER[:2], (20.0,))
    assert place(path, horizon=30.0)[0] == NONE and place(path, horizon=60.0)[:2] == pytest.approx((40.0, 20.0))


JOB = dict(kind=CONSTANT, programmed=20.0, requested=AXES, keeps=1, descent=-1.0, air_free=1, ceiling=CEIL, target=1e9)


def test_the_law():
    assert (
        law(**JOB, pace=NONE) == (1.0, CEILING) and law(**JOB, pace=NONE, upward=-1.0)[0] == 1.0
    )  # down, above the stock
    assert law(**JOB, pace=0.0, pace_vel=40.0)[0] == pytest.approx(0.4) and law(
        **JOB, pace=0.0, pace_vel=5.0, upward=-1.0
    )[0] == pytest.approx(0.05)
    assert law(**(JOB | dict(air_free=0)), pace=0.0, pace_vel=5.0)[0] == 1.0
    for odd in (UNKNOWN, math.nan, math.inf, -math.inf):
        assert law(**JOB, pace=odd)[0] == pytest.approx(0.4) and law(**JOB, pace=odd, upward=-1.0)[0] == pytest.approx(
            0.2
        )
    assert law(**(JOB | dict(trusted=0)), pace=NONE)[0] == pytest.approx(0.2)  # an unknown tool: F
    for ceiling in (0.0, math.nan, -1.0):
        assert law(**(JOB | dict(ceiling=ceiling)), pace=UNKNOWN)[0] == pytest.approx(0.2)


def random_path(rng):
    """(points, feeds): above and below the clearance."""
    points, feeds = [(0.0, 0.0, rng.uniform(1, 12))], []
    while len(points) < 14:
        x, y, z = points[-1]
        z = rng.choice((z, z, rng.uniform(-3, 12), rng.uniform(-3, 0.4), z + 4))
        new = (x + rng.choice((0.0, rng.uniform(0.2, 40))), y + rng.uniform(-3, 3), z)
        if math.dist(points[-1], new) > 0.1:
            points.append(new)
            feeds.append(rng.choice((rng.uniform(2, 30), feeds[-1] if feeds else 10.0)))
    return points, feeds


def most_over(points, feeds, knob):
    """(largest velocity over what is allowed there, mm/s; seconds; seconds at F) of a tool that the law drives and the
    planner brakes."""
    path, lengths = chain(points, feeds), [math.dist(*pair) for pair in zip(points, points[1:])]
    n, at, v, scale, worst, seconds = 0, 0.0, 0.0, 0.0, -math.inf, 0.0
    while n < len(feeds):
        path.follow(n + 1, lengths[n], at)
        pace = path.pace(CLEAR, CEIL, 2 * DT * v, knob, v * v / ACCEL + 4 * v * DT)
        z0, z1 = points[n][2], points[n + 1][2]
        tip, upward = z0 + (z1 - z0) * at / lengths[n], (z1 - z0) / lengths[n]
        if tip < CLEAR - 0.01 and upward < 0.999:
            worst = max(worst, v - knob * feeds[n] * (1.0 if upward < -1e-4 else CEIL))
        goal = knob * scale * AXES  # last period's scale, as motion sees it
        scale = law(
            scale,
            **(JOB | dict(programmed=feeds[n])),
            upward=upward,
            accel=ACCEL,
            knob=knob,
            pace=pace.distance,
            pace_vel=pace.vel,
            pace_accel=pace.accel,
        )[0]
        v = max(goal, v - ACCEL * DT) if v > goal else min(goal, v + ACCEL * DT)
        at, seconds = at + v * DT, seconds + DT
        while n < len(feeds) and at >= lengths[n]:
            at, n = at - lengths[n], n + 1
    return worst, seconds, sum(length / (knob * feed) for length, feed in zip(lengths, feeds))


@pytest.mark.parametrize("knob", [0.5, 1.0, 1.3])
def test_no_place_is_passed_too_fast(knob):
    """Random paths: below the clearance never above F down and the ceiling otherwise, but for two periods of braking;
    and faster than F in all."""
    rng = random.Random(f"pace {knob}")
    worst, took, at_f = zip(*(most_over(*random_path(rng), knob) for _ in range(12)))
    assert max(worst) <= 2 * ACCEL * DT and sum(took) < 0.7 * sum(at_f)
