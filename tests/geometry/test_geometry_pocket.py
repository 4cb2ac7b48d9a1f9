# SPDX-License-Identifier: GPL-2.0-or-later
"""Pockets with islands, and rings of offsets as a pocket cycle asks for them."""

import math

import numpy as np
import pytest

from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import make_contour, reverse
from chipwise.geometry.offset.kernel import offset_pocket
from support.contour_judge import count_from_environment, seed_from_environment
from support.contour_oracle import from_elements, gouge, missing_of_loops, nearest, worst_gap
from support.island_random import random_islands
from support.contour_shapes import circle, corners, path_length, polygon

SQUARE = polygon((0, 0), (40, 0), (40, 40), (0, 40))


@pytest.mark.parametrize("boundary", [SQUARE, reverse(SQUARE)])
@pytest.mark.parametrize("ccw", [True, False])
def test_square_with_round_island(boundary, ccw):
    outer, inner = offset_pocket(boundary, [circle(5, (20, 20), ccw)], 3).paths
    assert corners(outer) == {(3, 3), (37, 3), (37, 37), (3, 37)}
    assert elements.area(outer.elements) > 0  # counter-clockwise
    assert path_length(inner) == pytest.approx(2 * math.pi * 8)
    assert elements.area(inner.elements) < 0  # clockwise


def test_island_ring_merges_with_the_boundary_ring():
    (merged,) = offset_pocket(SQUARE, [circle(5, (9, 20))], 3).paths
    assert nearest(from_elements(merged.elements), np.array([[17.0, 20.0]]))[0] < 1e-9
    assert elements.area(merged.elements) > 0


def test_island_exactly_two_radii_from_the_wall():
    paths = offset_pocket(SQUARE, [circle(5, (11, 20))], 3).paths
    every = [el for p in paths for el in from_elements(p.elements)]
    assert nearest(every, np.array([[3.0, 20.0]]))[0] < 1e-9


def test_nothing_left():
    assert offset_pocket(SQUARE, [circle(12, (20, 20))], 15).paths == ()


def test_rings_end_when_the_pocket_is_filled():
    lengths = []
    for k in range(1, 12):
        paths = offset_pocket(SQUARE, [circle(5, (20, 20))], 2.0 * k).paths
        lengths.append(sum(path_length(p) for p in paths))
    # the last centre stands at (a, a) in a corner: a = sqrt(2) (20 - a) - 5, a = 9.64
    assert all(lengths[:4]) and not any(lengths[4:])


def test_inaccessible_island_is_a_hole_of_the_region_about_it():
    result = offset_pocket(SQUARE, [circle(5, (20, 20))], 15)
    (region,) = result.inaccessible
    assert region.area == pytest.approx(1600 - 25 * math.pi)
    assert len(region.holes) == 1 and region.holes[0].radius.tolist() == [5]


def test_random_pockets():
    first = seed_from_environment()
    islands = 0
    for seed in range(first, first + max(count_from_environment(150) // 3, 1)):
        loops, distance = random_islands(seed)
        contours = [make_contour(parts) for parts in loops]
        islands += len(loops) - 1
        result = offset_pocket(contours[0], contours[1:], distance)
        shapes = [(from_elements(c.elements), True) for c in result.contours]
        every = [el for shape, _ in shapes for el in shape]
        path = [el for p in result.paths for el in from_elements(p.elements)]
        name = f"pocket CHIPWISE_SEED={seed}"
        assert result.loose == 0, name
        assert gouge(every, distance, path, 0.1) < 1e-6, name
        assert missing_of_loops(shapes, -1, distance, path) == [], name
        for p in result.paths:
            assert worst_gap(from_elements(p.elements), True) < 1e-9, name
        assert all(u.area > 0 for u in result.inaccessible), name
    assert islands > 0
