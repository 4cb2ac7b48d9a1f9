# SPDX-License-Identifier: GPL-2.0-or-later
"""Braking of the feed law with the operator's override and with a planner that bounds the jerk."""

import math

import pytest

from support.feed_cases import CONSTANT, ODD, law


def approach(law_knob, knob, jerk=0.0, law_jerk=0.0, area=30.0, accel=500.0, ceiling=60.0, wall=45.0):
    """Rate over k Q where the load begins, of a machine that starts from rest `wall` mm before it: it goes at `knob`
    times what a command, with half the acceleration and, if jerk > 0, with that bound on the jerk; mm, s."""
    at, v, gain, scale = 0.0, 0.0, 0.0, 1.0
    while at < wall:
        goal = knob * scale * ceiling  # last period's scale, as motion sees it
        scale = law(
            scale,
            kind=CONSTANT,
            requested=ceiling,
            programmed=10.0,
            accel=accel,
            knob=law_knob,
            jerk=law_jerk,
            speed=v,
            gain=gain,
            ahead=[(wall - at, area)],
        )[0]
        if jerk:
            wanted = math.copysign(min(math.sqrt(2 * jerk * abs(goal - v)), accel / 2), goal - v)
            gain += min(max(wanted - gain, -jerk * 0.001), jerk * 0.001)
        else:
            gain = min(max((goal - v) / 0.001, -accel / 2), accel / 2)
        v = max(v + gain * 0.001, 0.01)
        at += v * 0.001
    return v * area / (knob * 60.0)


@pytest.mark.parametrize("knob", [0.5, 0.8, 1.0, 1.2, 2.0])
def test_braking_is_reckoned_with_the_operator_s_override(knob):
    """The target goes with the knob, braking does not: at 120 % the tool has to brake earlier."""
    assert 0.9 < approach(knob, knob) < 1.01


def test_the_check_sees_an_override_left_out():
    assert approach(1.0, 1.2) > 1.1


@pytest.mark.parametrize("jerk", [1000.0, 3000.0, 20000.0, 1e5])
@pytest.mark.parametrize("knob", [1.0, 1.2])
def test_braking_is_reckoned_with_the_jerk(jerk, knob):
    """A planner that bounds the jerk still gains velocity after a command to brake, and builds up its braking."""
    assert 0.5 < approach(knob, knob, jerk, jerk) < 1.02


@pytest.mark.parametrize("jerk", [1000.0, 3000.0])
def test_the_check_sees_a_jerk_left_out(jerk):
    assert approach(1.0, 1.0, jerk, 0.0) > 1.5


@pytest.mark.parametrize("name", ["knob", "jerk", "speed", "gain"])
@pytest.mark.parametrize("value", ODD)
def test_no_override_or_jerk_makes_it_unsound(name, value):
    scale, _by = law(area=12.0, ahead=[(1.0, 60.0)], **{"jerk": 3000.0, "gain": 100.0, name: value})
    assert math.isfinite(scale) and 0.0 <= scale <= 1.0
