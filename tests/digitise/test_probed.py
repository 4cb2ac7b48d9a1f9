# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise digitise with a height map of a probing program: a stock that is nowhere below the map and hardly above
it."""

import json

import numpy as np
import pytest

from chipwise.digitise import probed
from chipwise.errors import CycleError
from chipwise.stock import store
from chipwise.surface.height_map_file import HeightMap
from support.digitising import digitise
from support.height_maps import FORMS, X, Y, Z

OFFSET = (-120.5, 33.0, -60.25)


def bilinear(x, y, height, at_x, at_y):
    """Heights of a map at points, by the formula of one patch, a point at a time."""
    found = []
    for px, py in zip(at_x, at_y):
        i = max(k for k in range(len(x) - 1) if x[k] <= px)
        j = max(k for k in range(len(y) - 1) if y[k] <= py)
        s, t = (px - x[i]) / (x[i + 1] - x[i]), (py - y[j]) / (y[j + 1] - y[j])
        found.append(
            (1 - t) * ((1 - s) * height[j, i] + s * height[j, i + 1])
            + t * ((1 - s) * height[j + 1, i] + s * height[j + 1, i + 1])
        )
    return np.array(found)


@pytest.mark.parametrize("name", FORMS)
def test_a_stock_of_each_form(tmp_path, name):
    path, out = tmp_path / "probe.map", tmp_path / "slot3.stock"
    path.write_text(FORMS[name])
    done = digitise(
        path, "-o", out, "--cell", 0.5, "--floor", -70, "--offset", *OFFSET, "--json", tmp_path / "figures.json"
    )
    assert done.returncode == 0, done.stdout
    head, cells = store.read(str(out))
    assert head.low == pytest.approx((X[0] + OFFSET[0], Y[0] + OFFSET[1], -70)) and (head.nx, head.ny) == (100, 60)
    tops = cells["top"][1:-1, 1:-1]
    assert tops.max() == pytest.approx(Z.max() + OFFSET[2], abs=1e-4)
    assert tops[0, 0] >= Z[0, 0] + OFFSET[2] - 1e-4
    assert json.loads((tmp_path / "figures.json").read_text())["points"] == Z.size


@pytest.mark.parametrize("cell", (0.37, 3.1, 17.0))
@pytest.mark.parametrize("even", (True, False))
def test_never_below_the_map_and_never_above_what_is_near(cell, even):
    """Finer and coarser than the points, at 3,000 random places."""
    random = np.random.default_rng(60126)
    x, y = (
        (np.linspace(-2.0, 40.0, 8), np.linspace(1.0, 30.0, 6))
        if even
        else (np.sort(random.uniform(-2, 40, 8)), np.sort(random.uniform(1, 30, 6)))
    )
    height = random.normal(0, 1.5, (6, 8))
    found = probed.cells_of(HeightMap(x, y, height), (1.0, -2.0, 0.5), cell)
    at_x, at_y = random.uniform(x[0], x[-1], 3000), random.uniform(y[0], y[-1], 3000)
    true = bilinear(x, y, height, at_x, at_y) + 0.5
    column, row = ((at_x - x[0]) / cell).astype(int), ((at_y - y[0]) / cell).astype(int)
    assert (found.heights[row, column] >= true - 1e-9).all()
    steepest = (np.abs(np.diff(height, axis=1)).max(axis=0) / np.diff(x)).max() + (
        np.abs(np.diff(height, axis=0)).max(axis=1) / np.diff(y)
    ).max()
    assert (found.heights[row, column] <= true + steepest * cell + 1e-9).all()
    assert (found.x0, found.y0) == pytest.approx((x[0] + 1, y[0] - 2))


def test_inches_and_an_allowance(tmp_path):
    path, out = tmp_path / "probe.xyz", tmp_path / "a.stock"
    path.write_text("0 0 0\n1 0 0\n0 1 0\n1 1 0\n")
    done = digitise(path, "-o", out, "--inch", "--offset", 0, 0, 0, "--allowance", 0.3, "--cell", 0.254, "--floor", -5)
    assert done.returncode == 0, done.stdout
    head, cells = store.read(str(out))
    assert (head.nx, head.ny) == (100, 100) and cells["top"][1:-1, 1:-1] == pytest.approx(0.3)


@pytest.mark.parametrize(
    "options, words",
    (
        ((), "the place of a height map in the machine is not known; give --offset X Y Z"),
        (("--offset", 0, 0, "nan"), "is not from -100000 to 100000"),
        (("--offset", 0, 0, 0, "--ball", 1), "--offset is for a height map"),
        (("--offset", 0, 0, 0, "-o", "a.stl"), "a.stl is made of the log of a tracer: give --ball"),
        (("--offset", 0, 0, 0, "--floor", 3), "the floor 3 mm is not below the lowest point"),
        (("--offset", 0, 0, 0, "--cell", 0.01), "a cell of 0.01 mm is too small for a map of 500 x 300 mm"),
    ),
)
def test_what_is_refused(tmp_path, options, words):
    path = tmp_path / "probe.xyz"
    path.write_text("0 0 0\n500 0 0\n0 300 0\n500 300 0\n")
    done = digitise(path, "-o", tmp_path / "a.stock", *options)
    assert done.returncode == 2 and words in done.stdout and "Traceback" not in done.stdout, done.stdout
    assert not (tmp_path / "a.stock").exists()


def test_another_file_is_no_height_map(tmp_path):
    path = tmp_path / "trace.log"
    path.write_text("1 0.5 0.5 2\n1 0.6 0.5 2\n")
    with pytest.raises(CycleError, match="is not a height map"):
        probed.read(str(path), False)
