"""Pockets with islands, and rings of offsets as a pocket cycle asks for them."""
import math

import numpy as np
import pytest

from chipwise.geometry import elements
from chipwise.geometry.contour import ArcElement, LineElement, make_contour, reverse
from chipwise.geometry.offset import offset_pocket
from contour_judge import count_from_environment, seed_from_environment
from contour_oracle import from_elements, gouge, missing_of_loops, nearest, winding, worst_gap
from contour_random import bulged, filleted, simple
from contour_shapes import circle, corners, path_length, polygon

SQUARE = polygon((0, 0), (40, 0), (40, 40), (0, 40))


@pytest.mark.parametrize("boundary", [SQUARE, reverse(SQUARE)])
@pytest.mark.parametrize("ccw", [True, False])
def test_square_with_round_island(boundary, ccw):
    outer, inner = offset_pocket(boundary, [circle(5, (20, 20), ccw)], 3).paths
    assert corners(outer) == {(3, 3), (37, 3), (37, 37), (3, 37)}
    assert elements.area(outer.elements) > 0                  # counter-clockwise
    assert path_length(inner) == pytest.approx(2 * math.pi * 8)
    assert elements.area(inner.elements) < 0                  # clockwise


def test_island_ring_merges_with_the_boundary_ring():
    merged, = offset_pocket(SQUARE, [circle(5, (9, 20))], 3).paths
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


def test_unreached_island_is_a_hole_of_the_region_about_it():
    result = offset_pocket(SQUARE, [circle(5, (20, 20))], 15)
    region, = result.unreachable
    assert region.area == pytest.approx(1600 - 25 * math.pi)
    assert len(region.holes) == 1 and region.holes[0].radius.tolist() == [5]


def random_pocket(seed):
    """(loops of parts: boundary first, distance)."""
    rng = np.random.default_rng([seed, 4])
    while True:
        parts = filleted(rng)[0] if rng.random() < 0.5 else bulged(rng)
        if simple(parts):
            break
    shape = from_elements(make_contour(parts).elements)
    loops, taken = [parts], shape
    for _ in range(12):
        size = math.exp(rng.uniform(math.log(1.0), math.log(8.0)))
        island = bulged(rng, size=size, most=7)
        island = shifted(island, rng.uniform(-20, 20, 2))
        if not simple(island, 1e-3 * size):
            continue
        made = from_elements(make_contour(island).elements)
        edge = np.concatenate([np.stack([np.array(el[1:3])]) for el in made])
        dense = np.concatenate([curve_points(el) for el in made])
        if (winding(shape, edge) != 0).all() and nearest(taken, dense).min() > 0.05 \
                and all((winding(from_elements(make_contour(other).elements), edge) == 0).all()
                        for other in loops[1:]):
            loops.append(island)
            taken = taken + made
    return loops, math.exp(rng.uniform(math.log(0.2), math.log(6.0)))


def curve_points(el):
    from contour_oracle import point
    return point(el, np.linspace(0.0, 1.0, 60))


def shifted(parts, by):
    def move(p):
        return (p[0] + by[0], p[1] + by[1])
    return [ArcElement(move(q.start), move(q.end), move(q.centre), q.ccw, q.line)
            if isinstance(q, ArcElement) else LineElement(move(q.start), move(q.end), q.line)
            for q in parts]


def test_random_pockets():
    first = seed_from_environment()
    islands = 0
    for seed in range(first, first + max(count_from_environment(150) // 3, 1)):
        loops, distance = random_pocket(seed)
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
        assert all(u.area > 0 for u in result.unreachable), name
    assert islands > 0
