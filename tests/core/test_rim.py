# SPDX-License-Identifier: GPL-2.0-or-later
"""The rim of a stock that does not fill its outer cells: boxes whose sizes are not multiples of the cell, boxes turned
against the axes.  The truths are areas of rectangles and, for the turned box, the same cut in an upright one."""

import math

import numpy as np
import pytest

from chipwise.clib import core
from chipwise.stock import shared

HIGH = 0.0
SIZES = [(20.13, 15.07), (20.01, 15.24), (20.24, 15.01), (20.125, 15.0)]
LIMIT = {0.1: 0.001, 0.25: 0.003}
FACE, DOWN, LEVELS = 1.0, 1.5, 3


def path(points, step):
    """The chain through points in steps, as a servo period makes them; step None: whole moves."""
    points = np.array(points, float)
    if step is None:
        return points
    out = [points[:1]]
    for a, b in zip(points, points[1:]):
        count = max(1, math.ceil(np.linalg.norm(b - a) / step))
        out.append(a + (b - a) * (np.arange(count) + 1)[:, None] / count)
    return np.concatenate(out)


def cut(stock, tool, points, step=0.37):
    cutter = core.Cutter(stock, tool, points[0])
    for point in path(points, step)[1:]:
        cutter.to(point)


def face(size, depth, tool=6.0):
    """A raster over all of the box."""
    rows, points = np.arange(0.0, size[1] + tool, 0.6 * tool), []
    for i, y in enumerate(rows):
        ends = (-tool, size[0] + tool)
        points += [(ends[i % 2], y, -depth), (ends[1 - i % 2], y, -depth)]
    return points


def slots(size, depth):
    """One along X in the middle of the box, one along Y over its far side (x from size - 5)."""
    x = size[0] - 2.0
    return [(-5, 7, -depth), (size[0] + 5, 7, -depth)], [(x, -5, -depth), (x, size[1] + 5, -depth)]


def removed(size):
    """mm3 of face and slots."""
    plan = 6.0 * size[0] + 5.0 * size[1] - 6.0 * 5.0
    return size[0] * size[1] * FACE + LEVELS * DOWN * plan


@pytest.mark.parametrize("cell", LIMIT)
@pytest.mark.parametrize("size", SIZES)
def test_faced_and_cut_deeper(size, cell):
    low, high, tool = (0.0, 0.0, -8.0), (*size, HIGH), core.Tool(6)
    stock = core.Stock(low, high, cell)
    cut(stock, tool, face(size, FACE))
    assert stock.head.removed == pytest.approx(size[0] * size[1] * FACE, rel=LIMIT[cell])
    for level in range(1, LEVELS + 1):
        for slot in slots(size, FACE + level * DOWN):
            cut(stock, tool, slot)
    assert stock.head.removed == pytest.approx(removed(size), rel=LIMIT[cell])
    assert stock.head.removed + stock.volume() == pytest.approx(size[0] * size[1] * 8.0, rel=2e-5)


@pytest.mark.parametrize("tool", [(6, 0, 0), (6, 3, 0), (10, 2, 0), (8, 0, 90), (6, 0.5, 20)])
@pytest.mark.parametrize("cell", [0.1, 0.25])
def test_all_of_it_is_cut_away(tool, cell):
    """Layer by layer with any tool down to its bottom: what is left is what the tool's end leaves, nothing of the
    rim."""
    size, tool = SIZES[0], core.Tool(*tool)
    low, high = (0.0, 0.0, -2.0), (*size, HIGH)
    stock = core.Stock(low, high, cell)
    for depth in (0.3, 0.9, 1.7, 2.0):
        cut(stock, core.Tool(2 * tool.radius), face(size, 0.5 * depth, tool.radius))
        cut(stock, tool, face(size, depth, tool.radius))
    cut(stock, core.Tool(2 * tool.radius), face(size, 2.0, tool.radius))
    assert stock.head.removed == pytest.approx(size[0] * size[1] * 2.0, rel=2e-5)
    assert stock.volume() < 1e-3


# --- boxes turned against the axes -----------------------------------------------------------------------------------

TURNS = (90.0, -90.0, 180.0, 45.0, 30.0, -12.34, 1e-3, 217.0, 400.0)


@pytest.mark.parametrize("degrees", TURNS)
@pytest.mark.parametrize("cell", LIMIT)
def test_turned_box(degrees, cell):
    """Its volume, and the same job as in an upright box, turned with it: volumes and areas."""
    size, angle, tool = SIZES[0], math.radians(degrees), core.Tool(6)
    c, s = math.cos(angle), math.sin(angle)
    middle = np.array([0.5 * size[0], 0.5 * size[1]])

    def turned(points):
        points = np.array(points, float)
        flat = points[:, :2] - middle
        return np.column_stack(
            [middle[0] + c * flat[:, 0] - s * flat[:, 1], middle[1] + s * flat[:, 0] + c * flat[:, 1], points[:, 2]]
        )

    stock = core.Stock((0.0, 0.0, -8.0), (*size, HIGH), cell, turn=angle)
    assert stock.volume() == pytest.approx(size[0] * size[1] * 8.0, rel=2e-5)
    assert core.library().chip_stock_sound(stock.address, cell, cell, stock.head.capacity)
    cut(stock, tool, turned(face(size, FACE)))
    for level in range(1, LEVELS + 1):
        for slot in slots(size, FACE + level * DOWN):
            cut(stock, tool, turned(slot))
    assert stock.head.removed == pytest.approx(removed(size), rel=LIMIT[cell])
    beside = turned(
        [[size[0] + 0.6 * cell, 0.3 * size[1], -2.0], [-cell, -cell, -2.0], [0.5 * size[0], size[1] + cell, -2.0]]
    )
    for x, y, _z in beside:
        assert stock.above(x, y, -8.0) < 2.0  # no stock beside it
    assert stock.above(*turned([[5.0, 12.0, 0.0]])[0][:2], -8.0) == pytest.approx(8.0 - FACE)


def test_cells_of_a_turned_rim():
    """Every cell's share as 100 x 100 points of it find it."""
    low, high, angle = (0.0, 0.0, 0.0), (7.3, 4.1, 1.0), math.radians(23.0)
    stock = core.Stock(low, high, 0.5, turn=angle)
    head, found = stock.head, shared.mean_heights(stock.cells, stock.head)
    fine = (np.arange(100) + 0.5) / 100 * 0.5
    for iy in range(head.ny):
        for ix in range(head.nx):
            x = head.x0 + 0.5 * ix + fine[None, :] - 0.5 * high[0]
            y = head.y0 + 0.5 * iy + fine[:, None] - 0.5 * high[1]
            u, v = math.cos(angle) * x + math.sin(angle) * y, math.cos(angle) * y - math.sin(angle) * x
            share = ((np.abs(u) <= 0.5 * high[0]) & (np.abs(v) <= 0.5 * high[1])).mean()
            assert found[iy, ix] == pytest.approx(share, abs=0.003), (ix, iy)


@pytest.mark.parametrize("turn", [math.nan, math.inf, -math.inf, 1e300])
def test_a_turn_that_is_none(turn):
    stock = core.Stock((0, 0, 0), (5, 5, 1), 0.25, capacity=10000)
    with pytest.raises(core.CoreError):
        stock.define((0, 0, 0), (5, 5, 1), turn=turn)
    assert stock.volume() == pytest.approx(25.0)
    with pytest.raises(core.CoreError):  # it fits upright, not turned
        core.Stock((0, 0, 0), (20, 5, 1), 0.25, capacity=82 * 22).define((0, 0, 0), (20, 5, 1), turn=0.5)


def test_filled_in_parts_as_at_once():
    at_once = core.Stock((0, 0, -3), (20.1, 11.3, 0), 0.25, turn=0.7)
    lib, parts = core.library(), core.Stock((0, 0, -3), (1, 1, 0), 0.25, capacity=at_once.head.capacity)
    low, high = (core.C.c_double * 3)(0, 0, -3), (core.C.c_double * 3)(20.1, 11.3, 0)
    assert lib.chip_stock_define_turned(parts.address, low, high, 0, 0.7) == 0
    calls = 0
    while not lib.chip_stock_fill(parts.address, 100):
        calls += 1
    assert calls > 50 and np.array_equal(parts.cells, at_once.cells)


@pytest.mark.parametrize("cell", LIMIT)
@pytest.mark.parametrize("degrees", [0.0, 17.0, 45.0, -63.0])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_tools_edge_within_a_cell_of_the_rim(side, degrees, cell):
    """Along the far side with the tool's edge a little inside or outside of it, from within the block (side 1) or
    beside it (-1), in two depths: what it takes is known to a fortieth of a cell, and nothing is taken beside the
    block."""
    size, angle, tool = SIZES[0], math.radians(degrees), core.Tool(6)
    middle, c, s = np.array([0.5 * size[0], 0.5 * size[1]]), math.cos(angle), math.sin(angle)

    def at(x, y, z):
        dx, dy = x - middle[0], y - middle[1]
        return middle[0] + c * dx - s * dy, middle[1] + s * dx + c * dy, z

    for part in np.arange(-1.2, 1.2, 0.1):
        stock = core.Stock((0.0, 0.0, -8.0), (*size, HIGH), cell, turn=angle)
        x = size[0] + part * cell - side * 3.0
        for depth in (1.0, 2.5):
            cut(stock, tool, [at(x, -5.0, -depth), at(x, size[1] + 5.0, -depth)])
        width = (6.0 - max(part * cell, 0.0)) if side > 0 else max(-part * cell, 0.0)
        allowed = 0.025 * cell * size[1] * 2.5
        assert stock.head.removed == pytest.approx(width * size[1] * 2.5, abs=allowed), part


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("beyond", [0.0, 1.0, 2.1])
def test_area_along_the_rim(size, beyond):
    """A slot along Y at the far side, its outer edge `beyond` mm outside: the second and third depth too."""
    low, high, tool = (0.0, 0.0, -8.0), (*size, HIGH), core.Tool(6)
    stock = core.Stock(low, high, 0.25)
    cut(stock, tool, face(size, FACE))
    x = size[0] + beyond - 3.0
    for level in range(1, LEVELS + 1):
        z = -FACE - level * DOWN
        cutter, areas = core.Cutter(stock, tool, (x, -5.0, z)), []
        for y in np.arange(-5.0, size[1] - 4.0, 0.05):
            cutter.to((x, y, z))
            if y > 4.0:
                areas.append(stock.section(tool, (x, y, z), (0, 1, 0))[0])
        cut(stock, tool, [(x, size[1] - 4.0, z), (x, size[1] + 5.0, z)])
        areas = np.array(areas) / ((6.0 - beyond) * DOWN)
        assert abs(areas.mean() - 1.0) < 0.01 and areas.std() < 0.02, (level, areas.mean(), areas.std())
