# SPDX-License-Identifier: GPL-2.0-or-later
"""The offline functions of the library where their arguments end: no memory, nothing to do, more than there is room
for."""

import ctypes as C
import math

import numpy as np
import pytest

from chipwise.clib.height_map import HeightMap, Shape
from chipwise.rewrite.depth_proof import FOUND, TOOL
from chipwise.clib import layout
from chipwise.clib.library import library

BOX = layout.ProofStock(7.0, 6.0, 7.0, 6.0, 1.0, 0.0, -12.0, 0.0, 0, 0)
PLACES = np.array([(-5, 6, -8), (20, 6, -8), (20, 9, -8), (-5, 9, -8)], float)


def table(*tools):
    """TOOL records of (radius, corner, half angle, limit)."""
    found = np.zeros(len(tools), TOOL)
    found["clearance"] = -1.0
    for row, tool in zip(found, tools):
        row["radius"], row["corner"], row["half_angle"], row["limit"] = tool
    return found


def proved(tools, numbers, cell=0.25, room=400, squares=1000000):
    """chip_prove_depths() of PLACES, the tool of each move -> (count, squares left, witnesses)."""
    numbers, found, left = np.array(numbers, np.int32), np.zeros(max(room, 1), FOUND), C.c_int64(squares)
    path = layout.ProofPath(PLACES[0].ctypes.data, PLACES[1:].ctypes.data, numbers.ctypes.data, len(numbers))
    count = library().chip_prove_depths(
        C.byref(BOX), tools.ctypes.data, len(tools), C.byref(path), cell, C.addressof(left), found.ctypes.data, room
    )
    return count, left.value, found[: max(count, 0)]


FLAT = (3.0, 0.0, 0.0, 5.0)


def test_a_proof_without_memory_says_so():
    """Cells of 0.1 um: the map would take a petabyte."""
    assert proved(table(FLAT), [0, 0, 0], cell=1e-7)[0] == -1
    assert library().chip_proof_open(C.byref(BOX), table(FLAT).ctypes.data, 1, 1e-7) is None
    library().chip_proof_close(None)


def test_a_proof_ends_with_its_room_and_its_squares():
    every, left, _found = proved(table(FLAT), [0, 0, 0])
    assert every > 20 and left > 0
    count, left, found = proved(table(FLAT), [0, 0, 0], room=5)
    assert count == 5 and left > 0 and set(found["move"].tolist()) == {0}
    assert proved(table(FLAT), [0, 0, 0], squares=1)[1] <= 0
    assert proved(table(FLAT), [], room=5)[0] == 0


@pytest.mark.parametrize(
    "other", [(3.0, 1.0, 0.0, 5.0), (3.0, 0.0, 0.7, 5.0), (2.5, 0.0, 0.0, 5.0), (3.0, 0.0, 0.0, 5.0)]
)
def test_a_move_is_joined_to_one_of_the_same_tool(other):
    """The second move begins within what the first has cut, unless it is another tool's: then it is judged at its
    beginning, too."""
    count, _left, found = proved(table(FLAT, other), [0, 1, 1])
    assert count > 0 and 0 in found["move"]


def test_a_path_that_is_taken_back_without_a_mark_stays():
    proof = library().chip_proof_open(C.byref(BOX), table(FLAT).ctypes.data, 1, 0.25)
    library().chip_proof_back(proof)
    numbers, found, left = np.zeros(3, np.int32), np.zeros(400, FOUND), C.c_int64(1000000)
    path = layout.ProofPath(PLACES[0].ctypes.data, PLACES[1:].ctypes.data, numbers.ctypes.data, 3)
    count = library().chip_proof_add(proof, C.byref(path), C.addressof(left), found.ctypes.data, 400)
    library().chip_proof_close(proof)
    assert count == proved(table(FLAT), [0, 0, 0])[0]


def test_more_cut_cells_than_there_was_room_for():
    """Ramps that each cut parts of a thousand cells, and what is to come is not known: as many witnesses as where it
    is, each as high."""
    rng = np.random.default_rng(5)
    places = np.vstack(
        (np.column_stack((rng.uniform(0, 14, 300), rng.uniform(0, 12, 300), rng.uniform(-1.5, 0.2, 300))), PLACES)
    )
    numbers = np.full(len(places) - 1, ~0, np.int32)
    numbers[-3:] = 0
    path = layout.ProofPath(places[0].ctypes.data, places[1:].ctypes.data, numbers.ctypes.data, len(numbers))
    tools, found = table((3.0, 1.0, 0.0, 5.0)), np.zeros((2, 400), FOUND)
    left = [C.c_int64(1000000), C.c_int64(1000000)]
    proof = library().chip_proof_open(C.byref(BOX), tools.ctypes.data, 1, 0.05)
    count = library().chip_proof_add(proof, C.byref(path), C.addressof(left[0]), found[0].ctypes.data, 400)
    library().chip_proof_close(proof)
    other = library().chip_prove_depths(
        C.byref(BOX), tools.ctypes.data, 1, C.byref(path), 0.05, C.addressof(left[1]), found[1].ctypes.data, 400
    )
    assert count == other > 20
    assert np.allclose(np.sort(found[0]["height"][:count]), np.sort(found[1]["height"][:count]), atol=0.02)


def test_routes_and_times_of_nothing():
    seconds = library().chip_traverse_seconds
    points = np.zeros((300, 3))
    points[:, 0] = np.arange(300)
    assert seconds(0, points.ctypes.data, 100.0, 500.0, 0.0) == seconds(1, points.ctypes.data, 100.0, 500.0, 0.0) == 0.0
    assert seconds(300, points.ctypes.data, 100.0, 500.0, 0.0) == seconds(256, points.ctypes.data, 100.0, 500.0, 0.0)
    route = np.zeros((40, 2))
    for count in (0, 1, layout.ROUTE_POINTS + 1):
        assert library().chip_traverse_improve(C.byref(layout.Lane()), count, route.ctypes.data, 0) == 1e9
    one = np.array([0.0, 10.0, 10.0])
    most, accel, corner, peak, took = (
        np.array([5.0, 0.0, 5.0]),
        np.full(3, 500.0),
        np.zeros(3),
        np.zeros(3),
        np.zeros(3),
    )
    speed = C.c_double(0.0)
    total = library().chip_height_times(
        3,
        one.ctypes.data,
        most.ctypes.data,
        accel.ctypes.data,
        corner.ctypes.data,
        peak.ctypes.data,
        C.byref(speed),
        took.ctypes.data,
    )
    assert math.isfinite(total) and total == pytest.approx(took.sum()) and took[0] == 0.0 and took[2] > 2.0
    assert library().chip_chain_fit(0, None, None, None, None, None, None, None) == 0


def test_a_drop_cutter_without_triangles():
    mesh, tool, heights = layout.DropMesh(), layout.DropTool(3.0, 0.0, 0.0), np.array([-5.0, -7.0])
    first, bin_top = np.zeros(2, np.int32), np.array([-1e30], np.float32)
    mesh.bin, mesh.nx, mesh.ny, mesh.first, mesh.bin_top = 1.0, 1, 1, first.ctypes.data, bin_top.ctypes.data
    library().chip_drop_points(C.byref(mesh), C.byref(tool), 2, np.zeros((2, 2)).ctypes.data, heights.ctypes.data)
    assert heights.tolist() == [-5.0, -7.0]


def test_searches_are_numbered_anew_after_four_billion():
    """One triangle at Z-3: found by a search before the number starts again, and by two after."""
    mesh, tool, heights = layout.DropMesh(), layout.DropTool(0.5, 0.0, 0.0), np.full(3, -9.0)
    triangle = np.array([0, 0, -3, 4, 0, -3, 0, 4, -3], np.float32)
    first, member, top, seen = (
        np.array([0, 1], np.int32),
        np.zeros(1, np.int32),
        np.array([-3.0], np.float32),
        np.ones(1, np.uint32),
    )
    mesh.n, mesh.triangle, mesh.bin, mesh.nx, mesh.ny = 1, triangle.ctypes.data, 10.0, 1, 1
    mesh.first, mesh.member, mesh.top, mesh.bin_top = (array.ctypes.data for array in (first, member, top, top))
    mesh.seen = seen.ctypes.data
    mesh.stamp = 2**32 - 2
    library().chip_drop_points(C.byref(mesh), C.byref(tool), 3, np.full((3, 2), 1.0).ctypes.data, heights.ctypes.data)
    assert heights.tolist() == [-3.0] * 3 and mesh.stamp == 2


def test_the_map_s_borders():
    """A row of more cells than are kept, a tool beside the map, needles without stock, traverses that are not
    judged."""
    wide = HeightMap((0, 0, -5), (1000, 2, 0), 0.2)
    met = wide.cut(Shape(990), (500, -600, -1), np.array([(500, 1, -1)], float))
    assert met["depth"][0] == pytest.approx(1.0, abs=0.13) and wide.volume() < 1000 * 2 * 5
    stock = HeightMap((0, 0, -5), (20, 20, 0), 0.25)
    far = stock.cut(
        Shape(6, holder_diameter=20, stick_out=8), (50, 50, -3), np.array([(60, 50, -3), (60, 50, 5)], float)
    )
    assert far["volume"].sum() == 0.0 and far["holder"].max() == 0.0
    judged = np.array([False, True])
    met = stock.cut(
        Shape(6), (10, -10, -3), np.array([(10, 30, -3), (10, -10, -3)], float), judged=judged, clearance=0.5
    )
    assert met["volume"][0] > 0 and met["beside"][0] == -1.0 and met["beside"][1] >= 0.0
    stock.add_needles(np.array([(-1.0, 10.0), (5.0, 10.0), (15.0, 10.0)]))
    assert not stock.is_clear(Shape(6), 1.0, (12, 7, -3), (12, 13, -3))
