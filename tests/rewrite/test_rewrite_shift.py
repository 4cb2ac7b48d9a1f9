# SPDX-License-Identifier: GPL-2.0-or-later
"""Amounts of shift: the patent's figures 14 to 19 (CN105492980), and what the roundings and bridges promise."""

import numpy as np
import pytest

from chipwise.rewrite import shift
from chipwise.rewrite.path_moves import kept_points, without
from chipwise.rewrite.segments import segments
from support.random_cases import random_count, random_seed


def test_figures_14_to_16():
    """The shifted path turns back between MP3 and MP4: both are dropped, MP2 and MP5 are joined."""
    first = np.array([[0, 0, 0], [10, 0, -1], [20, 0, -4], [21, 0, -14], [30, 0, -16], [40, 0, -17]], float)
    moved = shift.shifted(first, [2, 2, 1, 14, 4, 2])  # MP3a -> MP4a goes down, MP3b -> MP4b up
    assert shift.turned_points(first, moved).tolist() == [False, False, True, True, False, False]
    assert not shift.turned_points(first, first).any()


def test_a_right_angle_is_too_much_and_less_is_not():
    first = np.array([[0, 0, 0], [10, 0, 0], [10, 0, -10], [20, 0, -10]], float)
    right = np.array([[0, 0, 0], [10, 0, 0], [20, 0, 0], [30, 0, 0]], float)
    assert shift.turned_points(first, right).tolist() == [False, True, True, False]
    assert not shift.turned_points(first, right + [[0, 0, 0], [0, 0, 0], [0, 0, -1], [0, 0, -1]]).any()


def test_figures_17_to_19():
    """Up a slope to a plateau: the arc at the top goes through MP13, the arc at the foot is tangent, and all is
    outside."""
    s = np.linspace(0, 60, 6001)
    amount = np.interp(s, [0, 20, 30, 60], [0, 0, 10, 10])  # MP11, MP12, MP13, MP14
    radius = 4.0
    result = shift.rounded(s, amount, radius)
    assert (result >= amount).all()
    assert result[s >= 30] == pytest.approx(10.0, abs=1e-9)  # through MP13 [0108]
    off = radius * (np.sqrt(2) - 1)  # the slope is tangent to the arc at the top
    middle = (s > 24) & (s < 25)
    assert result[middle] == pytest.approx(amount[middle] + off, abs=0.01)
    assert bends(s, result) >= radius - 0.1


def bends(s, z):
    """Smallest radius of a profile."""
    dz, h = np.gradient(z, s), s[1] - s[0]
    curve = np.abs(np.gradient(dz, h)) / (1 + dz**2) ** 1.5
    return 1.0 / max(
        float(np.sort(curve)[-len(curve) // 500]), 1e-9
    )  # but for the points next to a change of curvature


def test_rounded_is_never_below_and_nowhere_tighter():
    rng = np.random.default_rng(random_seed())
    for case in range(random_count(30)):
        s = np.arange(0, 80, 0.01)
        amount = np.interp(s, np.sort(rng.uniform(0, 80, 8)), np.where(rng.random(8) < 0.4, 0, rng.uniform(0, 6, 8)))
        radius = rng.uniform(1, 5)
        result = shift.rounded(s, amount, radius)
        assert (result >= amount - 1e-12).all(), case
        assert result.max() == pytest.approx(amount.max(), abs=1e-9)
        assert shift.rounded(s, amount, 0.0) == pytest.approx(amount)


def test_a_disc_that_rolls():
    """Above and below random profiles, some with walls, against all pairs of points."""
    rng = np.random.default_rng([random_seed(), 5])
    for case in range(random_count(60)):
        count, radius = int(rng.integers(1, 60)), rng.uniform(0.1, 5)
        s = np.sort(rng.choice(np.round(rng.uniform(0, 12, 30), 1), count))
        values = rng.uniform(-3, 3, count)
        gap = np.abs(s[:, None] - s[None])
        disc = np.where(gap <= radius, np.sqrt(np.maximum(radius**2 - gap**2, 0.0)), -np.inf)
        assert shift.rolled(s, values, radius, 1.0) == pytest.approx((values[None] + disc).max(axis=1), abs=1e-12), case
        assert shift.rolled(s, values, radius, -1.0) == pytest.approx((values[None] - disc).min(axis=1), abs=1e-12), (
            case
        )


def test_a_shift_holds_through_the_air():
    s, air = np.arange(8.0), np.array([True, True, False, False, True, True, True])
    assert shift.held(s, np.array([0, 0, 3.0, 3, 1, 0, 0, 0]), air).tolist() == [3, 3, 3, 3, 1, 1, 1, 1]
    assert shift.held(s, np.zeros(8), air).tolist() == [0] * 8


def test_new_points_are_interpolated():
    assert shift.between(np.array([0.0, 10]), np.array([2.0, 4]), np.array([5.0])).tolist() == [3.0]


def test_stretches_and_kept_points():
    left = np.zeros(30, bool)
    left[[3, 4, 20]] = True
    s = np.arange(31) * 0.5
    assert segments(left, s, 0.25, 3.0) == [
        (2, 8),
        (19, 24),
    ]  # a piece more, and as far as a strip a cell wide may be hidden
    assert segments(left, s, 0.25, 50.0) == [(2, 16), (19, 30)]
    left[8:12] = True
    assert segments(left, s, 0.25, 50.0) == [(2, 30)]  # they would be one beside the other
    s = np.arange(5.0)
    assert kept_points(s, np.array([0, 0, 0, 1.0, 2.0])) == [0, 2, 4]
    assert kept_points(s, np.array([0, np.nan, 0, 0, 0])) == [0, 4]
    assert kept_points(s, np.full(5, np.nan)) == []  # the whole step is bridged


def test_a_path_without_what_is_done():
    """Each segment that is not done is travelled once, in order, between its own points; between two of them the tool
    is above, or goes straight up or down at a point of the path."""
    rng = np.random.default_rng([random_seed(), 12])
    for case in range(random_count(200)):
        count = int(rng.integers(1, 120))
        points, done = (
            np.cumsum(rng.normal(size=(count + 1, 3)), axis=0),
            np.repeat(rng.random(count) < 0.7, rng.integers(1, 30, count))[:count],
        )
        if done.all():
            done[int(rng.integers(count))] = False
        above = float(points[:, 2].max()) + 1.0
        places, own, segment = without(points, done, above)
        assert (np.diff(segment[own]) > 0).all() and set(np.flatnonzero(~done)) <= set(segment[own].tolist()), case
        assert (places[:-1][own] == points[segment[own]]).all() and (
            places[1:][own] == points[segment[own] + 1]
        ).all(), case
        a, b = places[:-1][~own], places[1:][~own]
        straight = (a[:, :2] == b[:, :2]).all(axis=1)
        assert (straight | ((a[:, 2] == above) & (b[:, 2] == above))).all(), case
        assert len(places) <= count + 1 + 2 * np.count_nonzero(~own), case
        whole, goes, all_of_it = without(points, np.zeros(count, bool), above)
        assert (whole == points).all() and goes.all() and all_of_it.tolist() == list(range(count)), case
