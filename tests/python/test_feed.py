"""The feed law: F = Q / A at the tool, braking before the load, modes, floor, fallback."""
import math

import numpy as np
import pytest

from chipwise.stock import core
from conftest import random_count, random_seed, write_replay

OFF, LIMIT, CONSTANT, WINDOW = range(4)
NOTHING, HERE, AHEAD, FLOOR, CEILING, FALLBACK = range(6)
ODD = [math.nan, math.inf, -math.inf, 0.0, -0.0, -1.0, 1e-9, 5e-324, 1.0, 60.0, 1e308, -1e308]


def given(**values):
    """A sound input: target 60 mm3/s, F and requested 10 mm/s, 500 mm/s2, 1 ms; changed by
    `values`; ahead=[(distance, area), ..]."""
    into = core.FeedIn()
    into.kind, into.target, into.lower = LIMIT, 60.0, 0.0
    into.programmed = into.requested = 10.0
    into.motion, into.accel, into.dt, into.trusted = 2, 500.0, 0.001, 1
    for i, (distance, area) in enumerate(values.pop("ahead", [])):
        into.next_distance[i], into.next_area[i] = distance, area
    for name, value in values.items():
        setattr(into, name, value)
    return into


def law(last=1.0, **values):
    out = core.feed(given(**values), last)
    return out.scale, out.by


def test_at_the_tool():
    """v = Q / A: 60 / 12 = 5 of 10 mm/s; below Q / F = 6 mm2 the programmed feed stays."""
    assert law(area=12.0) == (pytest.approx(0.5), HERE)
    assert law(area=6.0001) == (pytest.approx(60 / 6.0001 / 10), HERE)
    assert law(area=5.99) == (1.0, NOTHING)
    assert law(area=0.0) == (1.0, NOTHING)


def test_ahead():
    """v^2 = (Q/A)^2 + 2 (a/2) (d - two periods of travel): 1 + 500 x (0.5 - 0.02)."""
    assert law(ahead=[(0.15, 60.0)]) == (pytest.approx(math.sqrt(1 + 500 * 0.13) / 10), AHEAD)
    assert law(0.5, ahead=[(0.15, 60.0)])[0] == pytest.approx(math.sqrt(1 + 500 * 0.14) / 10)
    assert law(ahead=[(0.5, 60.0)]) == (1.0, NOTHING)              # far enough to go on
    assert law(ahead=[(0.0, 60.0)])[0] == pytest.approx(0.1)       # there already
    assert law(ahead=[(-3.0, 60.0)])[0] == pytest.approx(0.1)
    assert law(ahead=[(0.3, 7.0), (0.15, 60.0)])[0] == pytest.approx(math.sqrt(66) / 10)


def test_ahead_is_braked_in_time():
    """Driven period by period with the planner braking at a/2 only, the tool never meets the wall
    faster than Q / A, nor (the sluggish side) crawls up to it: it starts braking within 10 % of
    the shortest way."""
    for area, accel in ((12.0, 500.0), (30.0, 500.0), (60.0, 200.0)):
        wall, at, v, scale, started = 20.0, 0.0, 10.0, 1.0, None
        while at < wall:
            asked = scale * 10.0            # last period's scale, as motion sees it
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
    assert law(area=8.0, **window) == (pytest.approx(0.4), NOTHING)             # 32 mm3/s
    assert law(area=4.0, **window) == (pytest.approx(0.5), HERE)                # 20 / 4 = 5
    assert law(area=20.0, **window) == (pytest.approx(0.3), HERE)               # 60 / 20 = 3
    assert law(area=1.0, **window) == (1.0, CEILING)                            # 20 mm/s wanted
    assert law(area=0.0, **window)[0] == 1.0


@pytest.mark.parametrize("motion", [0, 1, 4, 5, 6])
def test_only_feed_moves(motion):
    assert law(area=1000.0, motion=motion) == (1.0, NOTHING)


def test_floor():
    assert law(area=600.0, floor=0.5) == (pytest.approx(0.05), FLOOR)
    assert law(area=12000.0, floor=0.0) == (pytest.approx(0.001), FLOOR)     # never stands still
    assert law(area=600.0, floor=50.0, programmed=5.0) == (pytest.approx(0.5), FLOOR)   # F at most


@pytest.mark.parametrize("bad", [
    dict(trusted=0), dict(target=0.0), dict(target=-1.0), dict(target=math.nan), dict(target=math.inf),
    dict(area=math.nan), dict(area=-1.0), dict(area=math.inf), dict(accel=0.0), dict(accel=math.nan),
    dict(ahead=[(math.nan, 1.0)]), dict(ahead=[(1.0, math.inf)]),
    dict(kind=WINDOW, lower=math.nan), dict(kind=WINDOW, lower=61.0), dict(kind=WINDOW, lower=-1.0)])
def test_fallback_is_the_programmed_feed(bad):
    values = {"area": 12.0, "programmed": 4.0, **bad}
    assert law(**values) == (pytest.approx(0.4), FALLBACK)


@pytest.mark.parametrize("requested", [0.0, -1.0, math.nan, math.inf])
def test_no_requested_velocity(requested):
    assert law(area=12.0, requested=requested) == (1.0, FALLBACK)


def hostile(random):
    names = ["target", "lower", "programmed", "requested", "accel", "floor", "dt", "area"]
    case = {"kind": int(random.integers(-1, 6)), "motion": int(random.integers(0, 5)),
            "trusted": int(random.integers(0, 4) != 0), "last": 1.0, "ahead": []}
    for name in random.choice(names, random.integers(1, 6), replace=False):
        case[str(name)] = ODD[random.integers(len(ODD))]
    if random.integers(2):
        case["ahead"] = [(ODD[random.integers(len(ODD))], ODD[random.integers(len(ODD))])
                         for _ in range(random.integers(1, 9))]
    if random.integers(4) == 0:
        case["last"] = ODD[random.integers(len(ODD))]
    return case


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
