# SPDX-License-Identifier: GPL-2.0-or-later
"""Heights of a real blank from touched points: never below the truth minus the probe's error, and little above it."""

import math

import numpy as np
import pytest

from chipwise.blank import heights as blank
from chipwise.errors import CycleError
from support.castings import CASES, CELL, MOST_ABOVE, Casting
from support.random_cases import random_count, random_seed


@pytest.mark.parametrize("k", range(random_count(CASES)))
def test_random_castings(k):
    casting = Casting(random_seed() * 100_019 + k)
    found, truth = casting.found(), casting.highest()
    assert found.probed.all() and (found.top >= truth - casting.error).all(), float(
        (truth - casting.error - found.top).max()
    )
    assert (found.top - found.doubt <= truth + 1e-9).all()  # the doubt reaches down to the truth
    above = found.top.sum() / casting.z(*casting.places.T).sum() - 1.0
    assert above <= MOST_ABOVE, above


def test_a_slope_that_is_too_small_is_seen(monkeypatch):
    """The judge of the castings fails without the steepest slope."""
    monkeypatch.setattr(blank, "SURER", 0.2)
    casting = Casting(1)
    assert (casting.found().top < casting.highest() - casting.error).any()


def test_scattered_points():
    """Not on a grid."""
    rng = np.random.default_rng(5)
    casting = Casting(2)
    xy = rng.uniform((0, 0), (casting.wide, casting.deep), (900, 2))
    casting.points = np.column_stack((xy, casting.z(*xy.T)))
    found, truth = casting.found(), casting.highest()
    assert (
        found.probed.mean() > 0.9
        and (found.top >= truth - 1e-9)[found.probed].all()
        and (found.top == casting.high)[~found.probed].all()
    )


@pytest.mark.parametrize("turned", [False, True])
def test_a_step_between_the_points(turned):
    """A rib: the points do not show where its walls are, so it reaches to the points beside it."""
    x, y = (v.ravel() for v in np.meshgrid(np.arange(0.0, 101.0, 10.0), np.arange(0.0, 61.0, 10.0)))
    rib = y if turned else x
    z = np.where((rib > 34.0) & (rib < 57.0), 30.0, 10.0)
    px, py = (v.ravel() for v in np.meshgrid(np.arange(0.5, 100.0), np.arange(0.5, 60.0)))
    found = blank.heights(np.column_stack((x, y, z)), np.column_stack((px, py)), 0.0, 40.0, 0.01, 1.0)
    at = py if turned else px
    on = (at > 30.5) & (at < 59.5)
    assert (
        (found.top[on] == 30.0).all()
        and (found.top[(at < 18.0) | (at > 76.0)] < 11.0).all()
        and (found.doubt[on & (at < 39.0)] >= 19.9).all()
    )


def test_what_was_not_probed_is_the_typed_blank():
    """A line shows nothing beside it; outside of a grid is the allowance of M250."""
    line = np.column_stack((np.arange(0.0, 50.0, 5.0), np.full(10, 20.0), np.full(10, 7.0)))
    places = np.array([[22.0, 20.0], [22.0, 23.0], [22.0, 80.0], [-4.0, 20.0]])
    found = blank.heights(line, places, 0.0, 12.0)
    assert found.probed.tolist() == [True, False, False, False] and found.top.tolist() == pytest.approx(
        [7.0, 12.0, 12.0, 12.0]
    )
    x, y = (v.ravel() for v in np.meshgrid(np.arange(0.0, 50.0, 5.0), np.arange(0.0, 50.0, 5.0)))
    found = blank.heights(
        np.column_stack((x, y, np.full(100, 7.0))),
        np.array([[22.0, 22.0], [-0.1, 20.0], [45.1, 45.1], [60.0, 60.0]]),
        0.0,
        12.0,
        0.02,
    )
    assert found.probed.tolist() == [True, False, False, False] and found.top[1:].tolist() == [12.0] * 3
    assert (
        7.0 <= found.top[0] < 7.05
        and found.doubt[0] < 0.1
        and found.spacing == pytest.approx(5.0)
        and found.doubt[3] == 12.0
    )


def test_laws():
    """A plane with all heights moved, turned by a right angle, and with every point twice; more error is never lower;
    never above the typed blank."""
    casting = Casting(3)
    first = casting.found()
    moved = blank.heights(casting.points + [0, 0, 5.0], casting.places, 0.0, casting.high + 5.0, casting.error, CELL)
    assert np.allclose(moved.top, first.top + 5.0)
    turned = blank.heights(
        casting.points * [-1, 1, 1] @ np.array([[0, 1, 0], [1, 0, 0], [0, 0, 1]]),
        (casting.places * [-1, 1])[:, ::-1],
        0.0,
        casting.high,
        casting.error,
        CELL,
    )
    assert np.allclose(turned.top, first.top)
    twice = blank.heights(
        np.concatenate((casting.points, casting.points - [0, 0, 0.3])),
        casting.places,
        0.0,
        casting.high,
        casting.error,
        CELL,
    )
    assert np.allclose(twice.top, first.top)
    surer = blank.heights(casting.points, casting.places, 0.0, casting.high, 2 * casting.error, CELL)
    assert (surer.top >= first.top - 1e-9).all() and (surer.doubt >= first.doubt - 1e-9).all()
    assert (
        blank.heights(casting.points, casting.places, 0.0, casting.base, casting.error, CELL).top.max() <= casting.base
    )


@pytest.mark.parametrize(
    "points, error, what",
    [
        ([[0, 0, 0], [1, 1, 1]], 0.0, "not enough"),
        ([[1, 1, 5]] * 9, 0.0, "all points are in one place"),
        ([[0, 0, math.nan]] * 4, 0.0, "not a place"),
        ([[0, 0, 1], [5, 0, 1], [0, 5, 1e9]], 0.0, "not a place"),
        ([[0, 0, 1], [5, 0, 1], [0, 5, 1]], -1.0, "not a length"),
        ([[0, 0, 1], [5, 0, 1], [0, 5, 1]], math.inf, "not a length"),
    ],
)
def test_what_cannot_be_a_blank(points, error, what):
    with pytest.raises(CycleError, match=what):
        blank.heights(points, np.zeros((1, 2)), 0.0, 10.0, error)
