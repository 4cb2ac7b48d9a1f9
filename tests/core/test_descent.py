# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves that go down keep F where a job raises the feed (feed.h, 12): on them, and by braking before them."""

import math

import pytest

from chipwise.clib import core
from support.feed_cases import CEILING, CONSTANT, HERE, law
from support.path_cases import chain

F, TOP = 10.0, 30.0
JOB = dict(kind=CONSTANT, programmed=F, requested=TOP, keeps=1, descent=-1.0)


def test_down_at_f_and_level_at_the_ceiling():
    assert law(**JOB) == (1.0, CEILING) and law(**JOB, upward=-5e-5)[0] == 1.0 and law(**JOB, upward=0.5)[0] == 1.0
    for upward in (-1.1e-4, -0.01, -1.0):
        assert law(**JOB, upward=upward) == (pytest.approx(F / TOP), CEILING)
        assert law(**(JOB | {"keeps": 0}), upward=upward)[0] == 1.0
    assert law(**JOB, upward=-1.0, area=12.0) == (pytest.approx(5.0 / TOP), HERE)  # the target counts there, too


@pytest.mark.parametrize("odd", [dict(upward=math.nan), dict(descent=math.nan), dict(descent=math.inf)])
def test_what_is_not_known_keeps_f(odd):
    assert law(**(JOB | odd))[0] == pytest.approx(F / TOP)


@pytest.mark.parametrize("knob", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("accel, given", [(500.0, 0.0), (500.0, 250.0), (200.0, 50.0), (500.0, 1e9)])
def test_it_is_braked_in_time(knob, accel, given):
    """Driven period by period with the braking the planner is said to have: F where the descent begins, and not long
    before."""
    real = min(given, accel) if given else 0.5 * accel
    wall, at, v, scale, started = 40.0, 0.0, knob * TOP, 1.0, None
    while at < wall:
        goal = knob * scale * TOP  # last period's scale, as motion sees it
        scale = law(scale, **(JOB | {"descent": wall - at}), accel=accel, descent_accel=given, knob=knob)[0]
        if scale < 1.0 and started is None:
            started = wall - at
        v = max(goal, v - real * 0.001) if v > goal else min(goal, v + real * 0.001)
        at += v * 0.001
    assert v <= knob * F + real * 0.002
    blend = (knob * F) ** 2 / (2 * real)
    shortest = knob * knob * (TOP * TOP - F * F) / (2 * real)
    assert shortest <= started <= 1.05 * shortest + blend + 0.003 * knob * TOP


LEVEL_RAMP = (0, 0, 0), (10, 0, 0), (14, 3, 0), (20, 3, -1), (30, 3, -1)


def test_where_the_path_goes_down():
    assert chain(LEVEL_RAMP, accels=(100.0, 200.0, 300.0, 400.0)).descent() == (
        pytest.approx(15.0),
        pytest.approx((10 * 100 + 5 * 200) / 15),
    )
    assert chain(LEVEL_RAMP[2:]).descent()[0] == 0.0
    assert chain(LEVEL_RAMP[:3]).descent()[0] == chain(LEVEL_RAMP[::-1]).descent()[0] == -1.0
    assert chain(LEVEL_RAMP, rapid=(3,)).descent()[0] == -1.0
    assert chain(LEVEL_RAMP, stops=(2,)).descent()[0] == -1.0  # at rest before it
    assert core.ProgrammedPath().descent()[0] == -1.0
    path = chain(LEVEL_RAMP)
    path.follow(1, 10.0, 4.0)
    assert path.descent()[0] == pytest.approx(11.0)
