# SPDX-License-Identifier: GPL-2.0-or-later
"""The drop cutter (components/offline/drop_cutter.c) against brute force, against itself along segments, and against
opencamlib.

The oracle (support/drop_oracle.py) searches points of the triangles, so it is never above the true height; on a ridge,
as a bull-nose tool has one, its search ends up to 0.0007 mm below.
"""

import math

import numpy as np
import pytest
from support import drop_oracle, second_oracles, surface_cases
from support.random_cases import random_count, random_seed, write_replay

from chipwise.clib.height_map import Shape
from chipwise.clib import drop_cutter

SHAPES = {
    "flat": Shape(6),
    "ball": Shape(6, 3),
    "bull": Shape(6, 0.5),
    "nearly ball": Shape(6, 2.9),
    "vee": Shape(6, 0, 60),
    "tapered": Shape(6, 1, 20),
    "blunt tapered": Shape(6, 1, 90),
}
FLOOR = -50.0
ORACLE = 1e-3  # mm: the accuracy asked of a point


def random_triangles(rng, case):
    """A few triangles of 0.1 to 10 mm about the axis; every fourth case level, every fourth vertical."""
    size = 10 ** rng.uniform(-1, 1)
    triangles = rng.uniform(-4, 4, (rng.integers(1, 8), 1, 3)) + rng.uniform(-size, size, (1, 3, 3)) * rng.choice(
        [-1, 1], (1, 3, 3)
    )
    triangles = triangles + rng.uniform(-size, size, triangles.shape)
    if case % 4 == 1:
        triangles[:, :, 2] = triangles[:, :1, 2]
    if case % 4 == 2:
        triangles[:, 2, :2] = triangles[:, 1, :2]
    return triangles


@pytest.mark.parametrize("name", SHAPES)
def test_points_against_brute_force(name):
    shape, seed = SHAPES[name], random_seed()
    rng = np.random.default_rng(seed)
    for case in range(random_count(10)):
        model = surface_cases.model_of(random_triangles(rng, case))
        real = surface_cases.triangles_of(model)
        xy = rng.uniform(-5, 5, (6, 2))
        z = drop_cutter.Mesh(model, 3.0).heights(drop_cutter.drop_tool(shape), xy, FLOOR)
        for (x, y), found in zip(xy, z):
            expected = drop_oracle.lowest(real, shape, x, y, FLOOR)
            if not expected - 1e-9 <= found <= expected + ORACLE:
                path = write_replay(f"drop_{name}_{case}", {"seed": seed, "x": x, "y": y, "triangles": real.tolist()})
                raise AssertionError(
                    f"{name} at X{x:.4f} Y{y:.4f}: {found}, brute force {expected}; seed {seed}, {path}"
                )


@pytest.mark.parametrize("name", SHAPES)
def test_closed_forms(name):
    """On a plane of 30 degrees the profile's point of that slope touches; beside a wall's edge nothing does."""
    shape = SHAPES[name]
    height, radius = drop_oracle.profile(shape)
    slope = math.tan(math.radians(30))
    plane = surface_cases.model_of(
        [
            [(-50, -50, -50 * slope), (50, -50, 50 * slope), (50, 50, 50 * slope)],
            [(-50, -50, -50 * slope), (50, 50, 50 * slope), (-50, 50, -50 * slope)],
        ]
    )
    r = np.linspace(0, radius, 200_001)
    expected = (slope * r - height(r)).max()
    found = drop_cutter.Mesh(plane, 3.0).heights(drop_cutter.drop_tool(shape), [(0.3, 0.2), (7.0, -3.0)], FLOOR)
    assert found == pytest.approx([expected + 0.3 * slope, expected + 7 * slope], abs=2e-5)
    wall = surface_cases.model_of([[(0, -9, 0), (0, 9, 0), (0, 0, 10)]])
    beside = drop_cutter.Mesh(wall, 3.0).heights(
        drop_cutter.drop_tool(shape), [(-radius - 1e-6, 0), (radius + 1e-6, 0)], FLOOR
    )
    assert (beside == FLOOR).all()


def test_inside_out_and_doubled_triangles_change_nothing():
    rng = np.random.default_rng(5)
    triangles = rng.uniform(-5, 5, (20, 3, 3))
    xy = rng.uniform(-5, 5, (50, 2))
    there = drop_cutter.Mesh(surface_cases.model_of(triangles), 3.0).heights(
        drop_cutter.drop_tool(SHAPES["bull"]), xy, FLOOR
    )
    twice = np.concatenate([triangles[:, ::-1], triangles, triangles[:, :1].repeat(3, axis=1)])
    again = drop_cutter.Mesh(surface_cases.model_of(twice), 3.0).heights(
        drop_cutter.drop_tool(SHAPES["bull"]), xy, FLOOR
    )
    assert again == pytest.approx(there, abs=1e-5)  # mm: float32 coordinates


@pytest.mark.parametrize("name", SHAPES)
def test_excess_is_the_largest_between_points(name):
    """Along segments of 0.05 to 8 mm: never less than at 2,001 points of them, and reached at the share that is
    said."""
    shape, rng = SHAPES[name], np.random.default_rng(random_seed())
    tool = drop_cutter.drop_tool(shape)
    for case in range(random_count(25)):
        model = surface_cases.model_of(random_triangles(rng, case))
        mesh = drop_cutter.Mesh(model, 3.0)
        start = rng.uniform(-5, 5, 3)
        end = start + rng.uniform(-1, 1, 3) * 10 ** rng.uniform(-1.3, 0.9)
        excess, share = mesh.excess(tool, start, end, -30.0)
        at = np.linspace(0, 1, 2001)[:, None]
        points = start + at * (end - start)
        over = mesh.heights(tool, points[:, :2], -1e5) - points[:, 2]
        place = start + share[0] * (end - start)
        if over.max() <= -30.0:
            assert excess[0] == -30.0
            continue
        assert excess[0] >= over.max() - 2e-7, (name, case)
        beside = place[:2] + 1e-9 * np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)])  # at a wall: on its side
        assert excess[0] == pytest.approx(mesh.heights(tool, beside, -1e5).max() - place[2], abs=1e-3), (name, case)


def test_allowance_is_an_offset_all_over():
    """A sphere with an allowance is a larger sphere."""
    model = surface_cases.model_of(surface_cases.sphere(10.0, 200))
    probe = drop_cutter.Probe(drop_cutter.Mesh(model, 3.0), Shape(6, 3), allowance=0.5, floor=FLOOR)
    xy = np.random.default_rng(2).uniform(-7, 7, (100, 2))
    expected = np.sqrt(13.5**2 - (xy**2).sum(axis=1)) - 3
    assert probe.heights(xy) == pytest.approx(expected, abs=0.005)  # mm: the sphere's facets


def test_holder_keeps_the_tool_up():
    """A tool 5 mm out of a holder of 20 mm beside a wall 12 mm high."""
    wall = surface_cases.model_of(surface_cases.box((0, 0, 0), (10, 10, 12)))
    probe = drop_cutter.Probe(drop_cutter.Mesh(wall, 3.0), Shape(6, 0, 0, 20, 5), floor=0.0)
    assert probe.heights([(-5, 5), (-9.9, 5), (-10.1, 5)]) == pytest.approx([7, 7, 0])
    assert probe.raised([(-5, 5), (-10.1, 5)]) == pytest.approx([7, 0])
    assert probe.excess([(-20, 5, 1)], [(-8, 5, 1)], 0.0)[0] == pytest.approx([6], abs=1e-6)


def test_against_opencamlib():
    """Within 0.001 mm at 300 points of a wavy model, ball and bull-nose."""
    ocl, reason = second_oracles.load("opencamlib")
    if ocl is None:
        pytest.skip(reason)
    model = surface_cases.model_of(surface_cases.waves(20))
    xy = np.random.default_rng(3).uniform(5, 35, (300, 2))
    for shape in (Shape(6, 3), Shape(6, 1)):
        expected = surface_cases.opencamlib_heights(ocl, surface_cases.triangles_of(model), shape, xy, FLOOR)
        found = drop_cutter.Mesh(model, 3.0).heights(drop_cutter.drop_tool(shape), xy, FLOOR)
        assert np.abs(found - expected).max() <= 1e-3
