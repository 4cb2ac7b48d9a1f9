# SPDX-License-Identifier: GPL-2.0-or-later
"""The feed law: F = Q / A at the tool, braking before the load, modes, floor, fallback."""

import math

import numpy as np
import pytest

from chipwise.clib import core
from support.feed_cases import (
    OFF,
    LIMIT,
    CONSTANT,
    WINDOW,
    NOTHING,
    HERE,
    AHEAD,
    FLOOR,
    CEILING,
    FALLBACK,
    given,
    law,
    hostile,
)
from support.random_cases import random_count, random_seed, write_replay


def test_at_the_tool():
    """v = Q / A: 60 / 12 = 5 of 10 mm/s; below Q / F = 6 mm2 the programmed feed stays."""
    assert law(area=12.0) == (pytest.approx(0.5), HERE)
    assert law(area=6.0001) == (pytest.approx(60 / 6.0001 / 10), HERE)
    assert law(area=5.99) == (1.0, NOTHING)
    assert law(area=0.0) == (1.0, NOTHING)


def test_lookahead():
    """v^2 = (Q/A)^2 + 2 (a/2) (d - two periods of travel): 1 + 500 x (0.5 - 0.02)."""
    assert law(ahead=[(0.15, 60.0)]) == (pytest.approx(math.sqrt(1 + 500 * 0.13) / 10), AHEAD)
    assert law(0.5, ahead=[(0.15, 60.0)])[0] == pytest.approx(math.sqrt(1 + 500 * 0.14) / 10)
    assert law(ahead=[(0.5, 60.0)]) == (1.0, NOTHING)  # far enough to go on
    assert law(ahead=[(0.0, 60.0)])[0] == pytest.approx(0.1)  # there already
    assert law(ahead=[(-3.0, 60.0)])[0] == pytest.approx(0.1)
    assert law(ahead=[(0.3, 7.0), (0.15, 60.0)])[0] == pytest.approx(math.sqrt(66) / 10)


def test_ahead_is_braked_in_time():
    """Driven period by period with the planner braking at a/2 only, the tool never meets the wall
    faster than Q / A, nor (the sluggish side) crawls up to it: it starts braking within 10 % of
    the shortest path."""
    for area, accel in ((12.0, 500.0), (30.0, 500.0), (60.0, 200.0)):
        wall, at, v, scale, started = 20.0, 0.0, 10.0, 1.0, None
        while at < wall:
            asked = scale * 10.0  # last period's scale, as motion sees it
            scale = law(scale, accel=accel, ahead=[(wall - at, area)])[0]
            if scale < 1.0 and started is None:
                started = wall - at
            v = max(asked, v - accel / 2 * 0.001) if v > asked else min(asked, v + accel / 2 * 0.001)
            at += v * 0.001
        assert v <= 60.0 / area * 1.001 + accel / 2 * 0.001
        shortest = (100.0 - (60.0 / area) ** 2) / accel
        assert started <= 1.1 * shortest + 0.04


def test_unknown_last_scale_counts_as_full_speed():
    assert law(math.nan, ahead=[(0.15, 60.0)]) == law(1.0, ahead=[(0.15, 60.0)])


def test_modes():
    assert law(kind=OFF, area=1000.0) == (1.0, NOTHING)
    assert law(kind=7, area=1000.0) == (1.0, NOTHING)
    # 2: F is replaced; requested is the ceiling
    assert law(kind=CONSTANT, area=12.0, programmed=1.0) == (pytest.approx(0.5), HERE)
    assert law(kind=CONSTANT, area=1.0, programmed=1.0) == (1.0, CEILING)
    # 1 with a requested velocity above F: F is kept
    assert law(kind=LIMIT, area=1.0, programmed=4.0, requested=10.0) == (pytest.approx(0.4), NOTHING)
    # 3: F stays while lower <= A F <= target
    window = dict(kind=WINDOW, lower=20.0, programmed=4.0)
    assert law(area=8.0, **window) == (pytest.approx(0.4), NOTHING)  # 32 mm3/s
    assert law(area=4.0, **window) == (pytest.approx(0.5), HERE)  # 20 / 4 = 5
    assert law(area=20.0, **window) == (pytest.approx(0.3), HERE)  # 60 / 20 = 3
    assert law(area=1.0, **window) == (1.0, CEILING)  # 20 mm/s wanted
    assert law(area=0.0, **window)[0] == 1.0


@pytest.mark.parametrize("kind", [OFF, 7, -1])
def test_off_is_f_where_a_ceiling_is_left_over(kind):
    """LinuxCNC still told 50 mm/s, the program's F 15: the machine is given 0.3, in arcs and probing too; else what the
    law says."""
    left = dict(kind=kind, area=1000.0, programmed=15.0, requested=50.0)
    assert law(**left) == (1.0, NOTHING)
    for motion in (2, 3, 5):
        assert core.feed_override(given(**left, motion=motion, trusted=0), 1.0) == pytest.approx(0.3)
    for other in (
        dict(motion=0),
        dict(motion=1),
        dict(motion=4),
        dict(programmed=0.0),
        dict(programmed=math.nan),
        dict(programmed=60.0),
        dict(programmed=50.0),
        dict(requested=0.0),
        dict(requested=math.inf),
        dict(programmed=-1.0),
        dict(programmed=math.inf),
        dict(requested=math.nan),
    ):
        assert core.feed_override(given(**{**left, **other}), 1.0) == 1.0, other
    for mode in (LIMIT, CONSTANT, WINDOW):
        assert core.feed_override(given(**{**left, "kind": mode}), 0.7) == 0.7


@pytest.mark.parametrize("motion", [0, 1, 4, 5, 6])
def test_only_feed_moves(motion):
    assert law(area=1000.0, motion=motion) == (1.0, NOTHING)


def test_floor():
    assert law(area=600.0, floor=0.5) == (pytest.approx(0.05), FLOOR)
    assert law(area=12000.0, floor=0.0) == (pytest.approx(0.001), FLOOR)  # never stops
    assert law(area=600.0, floor=50.0, programmed=5.0) == (pytest.approx(0.5), FLOOR)  # F at most


@pytest.mark.parametrize(
    "bad",
    [
        dict(trusted=0),
        dict(target=0.0),
        dict(target=-1.0),
        dict(target=math.nan),
        dict(target=math.inf),
        dict(area=math.nan),
        dict(area=-1.0),
        dict(area=math.inf),
        dict(accel=0.0),
        dict(accel=math.nan),
        dict(ahead=[(math.nan, 1.0)]),
        dict(ahead=[(1.0, math.inf)]),
        dict(kind=WINDOW, lower=math.nan),
        dict(kind=WINDOW, lower=61.0),
        dict(kind=WINDOW, lower=-1.0),
    ],
)
def test_fallback_is_the_programmed_feed(bad):
    values = {"area": 12.0, "programmed": 4.0, **bad}
    assert law(**values) == (pytest.approx(0.4), FALLBACK)


@pytest.mark.parametrize("requested", [0.0, -1.0, math.nan, math.inf])
def test_no_requested_velocity(requested):
    assert law(area=12.0, requested=requested) == (1.0, FALLBACK)


def test_hostile_input():
    """Whatever comes in: finite, 0 <= scale <= 1, a known code."""
    seed, random = random_seed(), np.random.default_rng(random_seed())
    for _ in range(max(random_count(0), 20000)):
        case = hostile(random)
        values = dict(case)
        scale, by = law(values.pop("last"), **values)
        if not (0.0 <= scale <= 1.0 and by in range(6)):
            pytest.fail(f"seed {seed}: scale {scale}, by {by}; {write_replay('feed', case)}")


def test_sound_random_input():
    """Never above Q/A (unless the floor lifts it) nor above F, and as fast as both allow."""
    random = np.random.default_rng(random_seed())
    for _ in range(max(random_count(0), 5000)):
        target, area, programmed, requested = random.uniform([1, 0.1, 0.1, 0.1], [500, 200, 50, 50])
        programmed = min(programmed, requested)
        scale, by = law(target=target, area=area, programmed=programmed, requested=requested)
        want = max(min(target / area, programmed), 0.001 * requested)
        assert scale * requested == pytest.approx(want)
        assert by == (NOTHING if want == programmed else HERE if want > 0.001 * requested else FLOOR)


def test_monotone():
    """More stock, or nearer stock, is never faster."""
    scales = [law(area=a)[0] for a in np.linspace(0.1, 100, 300)]
    assert all(b <= a + 1e-12 for a, b in zip(scales, scales[1:]))
    scales = [law(ahead=[(d, 60.0)])[0] for d in np.linspace(0.0, 5.0, 300)]
    assert all(b >= a - 1e-12 for a, b in zip(scales, scales[1:]))


# --- limits beside the removal rate ------------------------------------------------------------


def test_what_the_tool_stands():
    """The smaller of Q and the tool's rate: 60 and 24 mm3/s on 12 mm2 are 5 and 2 mm/s."""
    assert law(area=12.0, tool_target=24.0) == (pytest.approx(0.2), HERE)
    assert law(area=12.0, tool_target=90.0) == (pytest.approx(0.5), HERE)
    assert law(area=12.0, tool_target=0.0) == (pytest.approx(0.5), HERE)  # unknown
    assert law(area=12.0, tool_target=math.nan, programmed=4.0) == (pytest.approx(0.4), FALLBACK)
    # a window that begins above what the tool stands: held at that, no fallback
    assert law(kind=WINDOW, lower=40.0, area=12.0, tool_target=24.0, programmed=1.0) == (pytest.approx(0.2), HERE)


def test_fastest_while_cutting():
    """most in mm/s and as a share of F, the smaller; not in air; braked to ahead."""
    assert law(area=1.0, most=3.0) == (pytest.approx(0.3), CEILING)
    assert law(area=1.0, programmed=4.0, kind=CONSTANT, most_share=1.5) == (pytest.approx(0.6), CEILING)
    assert law(area=1.0, programmed=4.0, kind=CONSTANT, most_share=1.5, most=5.0)[0] == pytest.approx(0.5)
    assert law(area=12.0, most=8.0) == (pytest.approx(0.5), HERE)  # the rate is the lower limit
    assert law(area=0.0, most=3.0) == (1.0, NOTHING)
    assert law(area=0.0, most=3.0, ahead=[(0.0, 1.0)]) == (pytest.approx(0.3), AHEAD)
    assert law(area=0.0, most=3.0, ahead=[(0.07, 1.0)])[0] == pytest.approx(math.sqrt(9 + 500 * 0.05) / 10)
    assert law(area=1.0, most=math.nan) == (1.0, NOTHING)


def test_slowest_as_a_share():
    assert law(area=600.0, floor_share=0.25, programmed=4.0) == (pytest.approx(0.1), FLOOR)
    assert law(area=600.0, floor_share=0.25, floor=2.0, programmed=4.0) == (pytest.approx(0.2), FLOOR)
    assert law(area=600.0, floor_share=7.0, programmed=4.0) == (pytest.approx(0.4), FLOOR)  # F at most
    assert law(area=600.0, floor=2.0, most=1.0) == (pytest.approx(0.1), FLOOR)  # never above the highest


def test_air():
    """Modes 2 and 3 only, while nothing is met, still braking for what comes."""
    assert law(kind=CONSTANT, air=6.0, programmed=2.0) == (pytest.approx(0.6), CEILING)
    assert law(kind=WINDOW, air=6.0, programmed=2.0, lower=10.0) == (pytest.approx(0.6), CEILING)
    assert law(kind=CONSTANT, air=60.0, programmed=2.0) == (1.0, CEILING)
    assert law(kind=LIMIT, air=6.0) == (1.0, NOTHING)
    assert law(kind=CONSTANT, air=6.0, area=1.0) == (1.0, CEILING)
    assert law(kind=CONSTANT, air=6.0, ahead=[(0.0, 30.0)]) == (pytest.approx(0.2), AHEAD)


def test_plunge():
    """Its downward part: straight down at 1.5 mm/s, a ramp of 30 degrees at twice that."""
    assert law(area=1.0, plunge=1.5, upward=-1.0) == (pytest.approx(0.15), CEILING)
    assert law(area=1.0, plunge=1.5, upward=-0.5) == (pytest.approx(0.3), CEILING)
    assert law(area=1.0, plunge=1.5, upward=0.5) == (1.0, NOTHING)
    assert law(area=1.0, plunge=1.5, upward=0.0) == (1.0, NOTHING)
    assert law(area=0.0, plunge=1.5, upward=-1.0) == (1.0, NOTHING)  # in air
    assert law(area=0.0, plunge=1.5, upward=-1.0, ahead=[(0.0, 1.0)]) == (pytest.approx(0.15), AHEAD)
    assert law(area=1.0, plunge=1.5, upward=math.nan) == (1.0, NOTHING)
    assert law(area=1.0, plunge=1.5, upward=-99.0)[0] == pytest.approx(0.15)


CHIP = dict(kind=CONSTANT, target=1e6, chip=0.02, teeth=2, turns=-100.0, tool_width=10.0, requested=100.0)


def mean_of_the_arc(engagement):
    """Mean of sin phi over the arc of engagement, summed up."""
    n = 100000
    end = math.acos(1 - 2 * engagement)
    return sum(math.sin((i + 0.5) / n * end) for i in range(n)) / n


@pytest.mark.parametrize("engagement", [0.01, 0.1, 0.5, 0.73, 1.0])
def test_mean_chip(engagement):
    """v = h n z / mean(sin phi): the mean is summed over the arc here."""
    area = engagement * 10.0 * 4.0
    speed = 0.02 * 100 * 2 / mean_of_the_arc(engagement)
    assert law(area=area, stock_height=4.0, **CHIP) == (pytest.approx(speed / 100, rel=1e-6), HERE)


def test_light_cut_is_the_tool_makers_rule():
    """h = fz sqrt(ae / D) for a small ae, within 1 % at 2 %."""
    speed = law(area=0.02 * 40, stock_height=4.0, **CHIP)[0] * 100
    assert speed / (100 * 2) * math.sqrt(0.02) == pytest.approx(0.02, rel=0.01)


def test_unknown_chip():
    """An unknown engagement counts as the thickest mean chip; without spindle or teeth no bound."""
    thickest = max(mean_of_the_arc(e / 100) for e in range(60, 90, 5))
    speed = law(area=4.0, **CHIP)[0] * 100
    assert speed == pytest.approx(0.02 * 100 * 2 / thickest, rel=1e-3)
    for missing in ("chip", "teeth", "turns"):
        assert law(area=4.0, **{**CHIP, missing: 0.0}) == (1.0, CEILING)
        assert law(area=4.0, **{**CHIP, missing: math.nan}) == (1.0, CEILING)
    assert law(area=1e9, stock_height=4.0, **{**CHIP, "target": 1e300})[0] == pytest.approx(0.04 * math.pi / 2)
