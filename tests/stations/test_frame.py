# SPDX-License-Identifier: GPL-2.0-or-later
"""The coordinate system of a station from its points, against the rotation that has made them."""

import math

import numpy as np
import pytest

from chipwise.errors import CycleError
from chipwise.stations.frame import frame_of
from support.random_cases import random_count, random_seed
from support.station_cases import case, off, shares_of_bound


@pytest.mark.parametrize("k", range(random_count(50)))
def test_exact_points(k):
    matrix, origin, local, points = case(random_seed() + k)
    found = frame_of(points)
    assert np.abs(np.array(found.matrix) - matrix).max() < 1e-9 and np.abs(np.array(found.origin) - origin).max() < 1e-9
    assert max(map(abs, found.residuals.values())) < 1e-9
    for number, place in local.items():
        assert found.local(points[number]) == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize("k", range(random_count(50)))
def test_noise_stays_within_the_predicted_bound(k):
    """Every point is off by 0.01 mm in a direction of its own; places up to 300 mm away."""
    seed = random_seed() + k
    share = shares_of_bound(seed, 0.01)
    assert max(share) <= 1.0, f"CHIPWISE_SEED={seed}: {max(share):.3f} of the bound"
    assert max(share) > 0.05  # and the bound is not far too large


def test_the_bound_is_met_by_the_worst_noise():
    """Three points of a right angle: a place on the far side of the plane's axis moves by the sum that the bound
    has."""
    points = {1: (0.0, 0.0, 0.0), 2: (100.0, 0.0, 0.0), 3: (0.0, 100.0, 0.0)}
    place, noise = np.array([300.0, 300.0, 0.0]), 0.01
    bound = frame_of(points).predicted_error(place, noise)
    worst = frame_of({1: (0, 0, -noise), 2: (100, 0, noise), 3: (0, 100, noise)})
    moved = off(worst, np.eye(3), np.zeros(3), place)
    assert 0.8 * bound < moved <= bound


def test_least_squares():
    """One of eight points is 0.08 mm high: the plane follows it by its share, and the residual shows it."""
    points = {
        1: (0, 0, 0),
        2: (200, 0, 0),
        3: (0, 200, 0),
        4: (200, 200, 0),
        5: (100, 0, 0),
        6: (0, 100, 0),
        7: (200, 100, 0),
        8: (100, 200, 0.08),
    }
    found = frame_of({number: tuple(map(float, p)) for number, p in points.items()})
    heights = [abs(v) for v in found.residuals.values()]
    a = np.array([(x, y, 1) for x, y, _ in points.values()], float)
    z = np.array([p[2] for p in points.values()])
    flat = z - a @ np.linalg.lstsq(a, z, rcond=None)[0]  # computed in another form: heights over X and Y
    assert np.array(heights) == pytest.approx(np.abs(flat), abs=1e-6)
    assert max(found.residuals, key=lambda n: abs(found.residuals[n])) == 8


GOOD = {1: (0.0, 0.0, 0.0), 2: (100.0, 0.0, 0.0), 3: (0.0, 100.0, 0.0)}


@pytest.mark.parametrize(
    "change, words",
    [
        ({3: (100.0, 4.0, 0.0)}, "point 3 is 2.3 degrees from the line through points 1 and 2"),
        ({3: (-100.0, 4.0, 0.0)}, "point 3 is 2.3 degrees from the line"),
        ({2: (0.3, 0.4, 0.0)}, "point 2 is 0.5 mm from point 1"),
        ({3: (0.0, 0.0, 0.9)}, "point 3 is 0.9 mm from point 1"),
        ({3: (100.5, 0.0, 0.0)}, "point 3 is 0.5 mm from point 2"),
        ({2: (math.nan, 0.0, 0.0)}, "Xnan of point 2 is not a position"),
        ({4: (0.0, math.inf, 0.0)}, "Yinf of point 4 is not a position"),
        ({1: (0.0, 0.0, 2e6)}, "Z2e+06 of point 1 is not a position"),
        ({4: (50.0, 50.0, 90.0)}, "point 4 is 90 mm above or below the plane of points 1, 2 and 3"),
    ],
)
def test_refused(change, words):
    with pytest.raises(CycleError) as caught:
        frame_of(GOOD | change)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "missing, words",
    [
        ((2,), "point 2 is not taught; teach it with M255 Q2"),
        ((1, 3), "point 1, 3 are not taught; teach it with M255 Q1"),
    ],
)
def test_missing(missing, words):
    with pytest.raises(CycleError) as caught:
        frame_of({number: p for number, p in GOOD.items() if number not in missing})
    assert words in str(caught.value)


def test_points_interchanged_turn_the_station_over():
    assert frame_of(GOOD | {2: GOOD[3], 3: GOOD[2]}).tilt == pytest.approx(180.0)
