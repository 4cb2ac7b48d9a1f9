# SPDX-License-Identifier: GPL-2.0-or-later
"""The lowest tip over triangles (support/drop_oracle.c): no point of them is higher, and closed forms of planes, edges
and corners are reached."""

import math

import numpy as np
import pytest

from chipwise.clib.height_map import Shape
from support import drop_oracle
from support.random_cases import random_count, random_seed

SHAPES = {
    "flat": Shape(6),
    "ball": Shape(6, 3),
    "bull": Shape(6, 1),
    "cone": Shape(6, 0, 90),
    "round cone": Shape(6, 0.7, 60),
}
FLOOR = -50.0
NEAR = 1e-6  # mm: what a search may end below the highest point


def highest(points, shape, x, y):
    """The tip on the highest of points, by numpy."""
    height, radius = drop_oracle.profile(shape)
    r = np.hypot(points[:, 0] - x, points[:, 1] - y)
    return np.where(r <= radius, points[:, 2] - height(np.minimum(r, radius)), FLOOR).max(initial=FLOOR)


@pytest.mark.parametrize("name", SHAPES)
def test_no_point_of_a_triangle_is_higher(name):
    rng, met = np.random.default_rng(random_seed()), 0
    for case in range(random_count(60)):
        triangles = rng.uniform(-4, 4, (3, 1, 3)) + rng.uniform(-1, 1, (3, 3, 3)) * 10 ** rng.uniform(-1, 1)
        x, y = rng.uniform(-4, 4, 2)
        share = np.sort(rng.uniform(0, 1, (5000, 2)), axis=1)
        points = np.einsum(
            "wk,nkc->nwc", np.column_stack((share[:, 0], share[:, 1] - share[:, 0], 1 - share[:, 1])), triangles
        ).reshape(-1, 3)
        there, found = highest(points, SHAPES[name], x, y), drop_oracle.lowest(triangles, SHAPES[name], x, y, FLOOR)
        assert there - 1e-12 <= found <= triangles[:, :, 2].max() + 1e-12, (random_seed(), case)
        met += there > FLOOR
    assert met > random_count(60) / 2


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("slope", [0.0, 0.3, 2.0])
def test_a_plane_and_an_edge(name, slope):
    """z = slope x: all over, and a vertical triangle whose upper edge is beside the axis; a place where neither is met
    has the floor."""
    height, radius = drop_oracle.profile(SHAPES[name])
    corners = np.array([(x, y, slope * x) for x, y in ((-20, -20), (20, -20), (20, 20), (-20, 20))])
    plane = corners[[[0, 1, 2], [0, 2, 3]]]
    x = np.linspace(-radius, radius, 2_000_001)
    found = drop_oracle.all_lowest(plane, SHAPES[name], [(0.3, -0.7), (30.0, 0.0)], FLOOR)
    assert found == pytest.approx([0.3 * slope + (slope * x - height(np.abs(x))).max(), FLOOR], abs=NEAR)
    beside = 0.4 * radius
    edge = np.array([[(-20, 0, -20 * slope), (20, 0, 20 * slope), (0, 0, -40)]])
    r = np.hypot(x, beside)
    expected = np.where(r <= radius, slope * x - height(np.minimum(r, radius)), FLOOR).max()
    assert drop_oracle.lowest(edge, SHAPES[name], 0.0, beside, FLOOR) == pytest.approx(expected, abs=NEAR)


def test_a_corner():
    """The top of a needle: a ball's tip is below it, by the sphere."""
    needle = np.array([[(0, 0, 5), (1e-6, 0, -60), (0, 1e-6, -60)]])
    for beside in (0.0, 1.0, 2.9):
        assert drop_oracle.lowest(needle, SHAPES["ball"], beside, 0.0, FLOOR) == pytest.approx(
            5 - (3 - math.sqrt(9 - beside**2)), abs=NEAR
        )
    assert drop_oracle.lowest(needle, SHAPES["ball"], 3.001, 0.0, FLOOR) == FLOOR


def test_a_tool_that_is_wider_or_narrower_is_seen(monkeypatch):
    for diameter in (6.01, 5.99):
        wrong = drop_oracle.tool_of(Shape(diameter, 3))
        monkeypatch.setattr(drop_oracle, "tool_of", lambda shape, wrong=wrong: wrong)
        with pytest.raises(AssertionError):
            test_a_plane_and_an_edge("ball", 2.0)
