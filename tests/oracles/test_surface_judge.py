# SPDX-License-Identifier: GPL-2.0-or-later
"""The lowest edge of a tool over needles, and what moves take off them (support/surface_judge.c), against the profile
of drop_oracle.py in numpy."""

import numpy as np
import pytest

from chipwise.clib.height_map import Shape
from support import drop_oracle, surface_judge
from support.random_cases import random_seed

SHAPES = {
    "flat": Shape(6),
    "ball": Shape(6, 3),
    "bull": Shape(6, 1),
    "cone": Shape(6, 0, 90),
    "round cone": Shape(6, 0.7, 60),
}


def in_numpy(xy, points, shape):
    height, radius = drop_oracle.profile(shape)
    r = np.linalg.norm(xy[:, None] - points[None, :, :2], axis=2)
    return np.where(r <= radius, points[None, :, 2] + height(np.minimum(r, radius)), np.inf).min(axis=1, initial=np.inf)


def cases(rng):
    """(needles, tips): a few, many, none, and a needle at the radius."""
    for needles, tips in ((400, 50), (1, 300), (300, 1), (0, 5), (5, 0)):
        yield (
            rng.uniform(0, 20, (needles, 2)),
            np.column_stack((rng.uniform(0, 20, (tips, 2)), rng.uniform(-5, 1, tips))),
        )
    yield np.array([[3.0, 0.0], [3.001, 0.0], [0.0, 0.0]]), np.array([[0.0, 0.0, -1.0]])


@pytest.mark.parametrize("shape", SHAPES)
def test_the_lowest_edge(shape):
    seen = 0
    for xy, points in cases(np.random.default_rng(random_seed())):
        found, wanted = surface_judge.lowest_edge(xy, points, SHAPES[shape]), in_numpy(xy, points, SHAPES[shape])
        assert found.shape == wanted.shape and np.array_equal(np.isinf(found), np.isinf(wanted))
        assert np.allclose(found[np.isfinite(found)], wanted[np.isfinite(wanted)], rtol=0, atol=1e-12)
        seen += np.isfinite(wanted).sum()
    assert seen > 300


@pytest.mark.parametrize("shape", SHAPES)
def test_what_a_move_takes(shape):
    """Bits of 1, 7 and all points of a move, one after the other; without a cut the needles stay."""
    rng, seen = np.random.default_rng(random_seed()), 0
    for size, count in ((1, 30), (7, 30), (30, 30), (5, 1)):
        needles = surface_judge.Needles((0, 0), (20, 20), 0.0, 500, int(rng.integers(1000)))
        height = needles.height = rng.uniform(-3, 1, 500)
        points = np.linspace(rng.uniform(0, 20, 3) - (0, 0, 22), rng.uniform(0, 20, 3) - (0, 0, 22), count)
        for cuts in (False, True):
            before, found = height.copy(), needles.taken(points, SHAPES[shape], size, cuts)
            wanted, left = [], before.copy()
            for first in range(0, max(1, count - 1), size):
                under = in_numpy(needles.xy, points[first : first + size + 1], SHAPES[shape])
                wanted.append(max(0.0, (left - under).max()))
                left = np.minimum(left, under) if cuts else left
            assert np.allclose(found, wanted, rtol=0, atol=1e-12) and np.allclose(
                needles.height, left, rtol=0, atol=1e-12
            )
            assert (needles.height != before).any() == cuts
            seen += (found > 0).sum()
    assert seen > 20


def test_a_tool_that_is_wider_is_seen(monkeypatch):
    tool = surface_judge.tool_of(Shape(6.01))
    monkeypatch.setattr(surface_judge, "tool_of", lambda shape: tool)
    with pytest.raises(AssertionError):
        test_the_lowest_edge("flat")
    with pytest.raises(AssertionError):
        test_what_a_move_takes("flat")
