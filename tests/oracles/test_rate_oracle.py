# SPDX-License-Identifier: GPL-2.0-or-later
"""The judge of machine runs, judged itself on traces whose rate is known."""

import math

import numpy as np
import pytest

from support.computing import least_s
from support.rate_oracle import OracleTool, check_rate, rates, removed_total

BOX = ((-20.0, -20.0, -10.0), (20.0, 20.0, 0.0))
FLAT, BALL, VEE = OracleTool(3.0), OracleTool(3.0, "ball"), OracleTool(4.0, "vee", math.pi / 4)


def trace(points, speed, period=0.001):
    """Arrays t, x, y, z at servo rate along points; speed mm/s, one for all or one per segment."""
    points = np.array(points, float)
    took = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.broadcast_to(speed, len(points) - 1)
    passed = np.concatenate([[0.0], np.cumsum(took)])
    t = np.arange(0.0, passed[-1] + 1e-9, period)
    return t, *(np.interp(t, passed, points[:, i]) for i in range(3))


def judged(points, speed, tool=FLAT, scale=0.5, box=BOX):
    t, x, y, z = trace(points, speed)
    return rates(t, x, y, z, np.full(t.shape, 2), np.full(t.shape, scale), box, tool)


def steady(found, after, before=np.inf):
    return found.rate[(found.time > after) & (found.time < before)]


@pytest.mark.parametrize("angle", [0, 17, 31, 45, 73])
def test_slot(angle):
    """6 mm x 2 mm at 5 mm/s: 60 mm3/s, every window within 0.5 %."""
    a = math.radians(angle)
    found = judged([(-9 * math.cos(a), -9 * math.sin(a), -2), (9 * math.cos(a), 9 * math.sin(a), -2)], 5)
    assert np.allclose(steady(found, 0.7), 60.0, rtol=0.005)


@pytest.mark.parametrize("width", [0.6, 1.5, 3.0, 5.4])
def test_side_cut(width):
    """A second pass `width` beside the first: width x depth x speed, on average within 1 %, each
    window within one line of the 96 across the tool."""
    found = judged(
        [(-25, 0, -2), (25, 0, -2), (25, 0, 5), (-25, width, 5), (-25, width, -2), (15, width, -2)],
        [50, 50, 50, 50, 10],
    )
    got = steady(found, found.time[-1] - 2.5)
    assert got.mean() == pytest.approx(width * 2 * 10, rel=0.01 + 0.03 / width)
    assert np.abs(got / (width * 20) - 1).max() < 0.07 / width + 0.005


def test_ramp_and_plunge():
    slope = 2.0 / 12.0
    found = judged([(-6, 0, 0), (6, 0, -2)], 3.0)
    v = 3.0 / math.hypot(1, slope)
    depth = slope * v * (found.time - 0.005)
    want = 6 * depth * v + math.pi * 9 * slope * v
    late = found.time > 0.5
    assert np.allclose(found.rate[late], want[late], rtol=0.02)
    found = judged([(0, 0, 0), (0, 0, -3)], 2.0)
    assert np.allclose(steady(found, 0.05), math.pi * 9 * 2, rtol=0.01)


def test_ball_and_vee():
    found = judged([(-9, 1, -3), (9, 4, -3)], 4.0, BALL)
    assert np.allclose(steady(found, 1.0), 4 * math.pi * 4.5, rtol=0.02)
    found = judged([(-9, 1, -3), (9, 4, -3)], 4.0, VEE)
    assert np.allclose(steady(found, 1.0), 4 * 9, rtol=0.02)


def test_arc():
    """An annulus of the tool's width: 12 mm2 per mm whatever the radius."""
    for radius in (4.0, 9.0):
        a = np.linspace(0, 0.9 * math.pi, 200)
        points = np.column_stack([radius * np.cos(a), radius * np.sin(a), np.full(a.shape, -2.0)])
        found = judged(points, 5.0)
        got = steady(found, 0.6)
        assert got.mean() == pytest.approx(60.0, rel=0.01)
        assert got.std() < 0.02 * 60


def test_again_is_air():
    found = judged([(-9, 1, -2), (9, 3, -2), (-9, 1, -2)], 20.0)
    again = steady(found, found.time[-1] * 0.5 + 0.2)
    assert np.abs(again).max() < 0.005 * 240


def test_outside_and_above():
    assert judged([(-40, 0, -2), (-30, 0, -2)], 20.0).volume.sum() == 0.0
    assert judged([(-9, 0, 1), (9, 0, 1)], 20.0).volume.sum() == 0.0


def test_both_ways_of_counting_agree():
    """Sum over the windows against the needles, on a job with corners, ramps and layers."""
    points = [
        (-8, -8, 1),
        (-8, -8, -1),
        (8, -8, -2),
        (8, -4, -2),
        (-8, -4, -2),
        (-8, -8, -2),
        (-8, -8, -3),
        (8, -7, -3),
        (6, 6, -3),
        (-6, 5, -1),
    ]
    for tool in (FLAT, BALL):
        t, x, y, z = trace(points, 15.0)
        found = rates(t, x, y, z, np.full(t.shape, 2), np.ones(t.shape), BOX, tool)
        # what the tool has around it at the start is cut by no window
        assert found.volume.sum() == pytest.approx(removed_total(x, y, z, BOX, tool, 0.06), rel=0.01)


# --- the checker must fail where it should -----------------------------------

PATH = [(-30, -6, -2), (18, -6, -2), (18, -3, -2), (-18, -3, -2), (-18, 1.5, -2), (18, 1.5, -2)]


def ideal(factor=1.0):
    """A run that holds 240 mm3/s: slot at 20 mm/s, then 3 mm and 4.5 mm side cuts."""
    return judged(PATH, np.array([20, 20, 40, 22, 80 / 3.0]) * factor)


@pytest.fixture(scope="module")
def good():
    return ideal()


def test_good_run_passes(good):
    verdict = check_rate(good, 240.0, within=0.04, most_below=0.2, most_above=0.04)
    assert verdict.held > 0.75


def test_too_fast_fails():
    with pytest.raises(AssertionError, match="too fast"):
        check_rate(ideal(1.05), 240.0, within=0.04, most_below=0.2, most_above=0.04)


def test_constant_feed_fails():
    """The feed of the slot everywhere: sluggish; the feed of the side cut everywhere: too fast."""
    with pytest.raises(AssertionError, match="sluggish"):
        check_rate(judged(PATH, 20.0), 240.0, within=0.04, most_below=0.2, most_above=0.04)
    with pytest.raises(AssertionError, match="too fast"):
        check_rate(judged(PATH, 40.0), 240.0, within=0.04, most_below=0.2, most_above=0.04)


def test_sluggish_fails():
    with pytest.raises(AssertionError, match="sluggish"):
        check_rate(ideal(0.9), 240.0, within=0.04, most_below=0.2, most_above=0.04)


def test_full_override_is_no_sluggishness():
    """At override 1 the program's own feed is the limit."""
    verdict = check_rate(judged(PATH, 12.0, scale=1.0), 240.0, within=0.04)
    assert verdict.ceiling > 0.9


def test_nothing_cut_fails():
    with pytest.raises(AssertionError, match="nothing"):
        check_rate(judged([(-9, 0, 1), (9, 0, 1)], 20.0), 60.0)


def test_cost():
    """Two seconds of a run in less than four of computing."""
    assert least_s(lambda: judged([(-9, 0, -2), (1, 0, -2)], 5.0), 4.0)[1] < 4.0
