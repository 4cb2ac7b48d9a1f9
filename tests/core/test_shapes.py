# SPDX-License-Identifier: GPL-2.0-or-later
"""Shapes of stock: the cylinder's cells against its closed form and against fine sampling."""

import numpy as np
import pytest

from chipwise.clib import core
from chipwise.stock import shared


def heights(stock):
    return shared.mean_heights(stock.cells, stock.head)


@pytest.mark.parametrize("radius, cell", [(25.0, 0.25), (7.3, 0.25), (0.4, 0.25), (12.345, 0.1), (3.0, 7.0)])
def test_volume_of_a_cylinder(radius, cell):
    stock = core.Stock((3.0 - radius, -radius, -8.0), (3.0 + radius, radius, 2.0), cell, shape=1)
    assert stock.volume() == pytest.approx(np.pi * radius**2 * 10.0, rel=2e-5)
    assert heights(stock)[0, 0] == pytest.approx(-8.0, abs=10 if cell > 0.2 * radius else 1e-3)


def test_an_ellipse_where_the_box_is_not_square():
    stock = core.Stock((0, 0, 0), (60, 20, 5), 0.25, shape=1)
    assert stock.volume() == pytest.approx(np.pi * 30 * 10 * 5, rel=2e-5)


@pytest.mark.parametrize("radius", [5.1, 4.9])
def test_cells_of_the_rim(radius):
    """Every cell's share as 200 x 200 points find it."""
    stock = core.Stock((-radius, -radius, 0), (radius, radius, 1), 0.5, shape=1)
    found = heights(stock)
    ny, nx = found.shape
    at = (np.arange(200) + 0.5) / 200 * 0.5
    for iy in range(ny):
        for ix in range(nx):
            x, y = at[None, :] + ix * 0.5 - radius, at[:, None] + iy * 0.5 - radius
            assert found[iy, ix] == pytest.approx((x * x + y * y < radius * radius).mean(), abs=2e-3)


def test_a_slot_through_a_cylinder():
    """6 mm wide through the middle, 2 mm deep: closed form of a disc's strip."""
    radius, half = 20.0, 3.0
    stock = core.Stock((-radius, -radius, -10), (radius, radius, 0), 0.25, shape=1)
    cutter = core.Cutter(stock, core.Tool(2 * half), (-30, 0, -2))
    strip = 2 * (half * np.sqrt(radius**2 - half**2) + radius**2 * np.arcsin(half / radius))
    assert cutter.to((30, 0, -2)) == pytest.approx(2 * strip, rel=2e-3)


def test_filled_in_parts_as_at_once():
    lib, low, high = core.library(), core._vec((-9, -9, 0)), core._vec((9, 9, 4))
    whole, parts = (core.Stock((-9, -9, 0), (9, 9, 4), 0.25, shape=1) for _ in range(2))
    lib.chip_stock_define_shape(parts.address, low, high, 1)
    calls = 1
    while not lib.chip_stock_fill(parts.address, 100):
        calls += 1
    assert calls > 30 and np.array_equal(whole.cells, parts.cells)
