# SPDX-License-Identifier: GPL-2.0-or-later
"""The cells that a turning tool takes (support/turning_cut.c) against the same in numpy."""

from types import SimpleNamespace

import numpy as np
import pytest

from support import turning_cut
from support.random_cases import random_count, random_seed

BLANK = (8.0, -12.0, 0.0)  # mm: radius, Z of its ends
TOOLS = {
    "outside": SimpleNamespace(d=0.8, i=85.0, j=5.0, q=2, point=0.0),
    "inside": SimpleNamespace(d=0.4, i=275.0, j=355.0, q=3, point=0.0),
    "drill": SimpleNamespace(d=5.0, q=7, point=118.0),
}


def taken(cells, origin, mask, at):
    """How many cells a tool takes with the middle of its nose in a cell: padded, so that nothing is outside."""
    (rows, columns), (high, wide) = cells.shape, mask.shape
    room = np.zeros((rows + 2 * high, columns + 2 * wide), bool)
    room[high : high + rows, wide : wide + columns] = cells
    k, i = at[0] - origin[0] + high, at[1] - origin[1] + wide
    if not (0 <= k <= rows + high and 0 <= i <= columns + wide):
        return 0
    here = room[k : k + high, i : i + wide]
    count = int((here & mask).sum())
    here &= ~mask
    cells[:] = room[high : high + rows, wide : wide + columns]
    return count


@pytest.mark.parametrize("name", TOOLS)
def test_the_cells_that_a_tool_takes(name):
    """At random places, beside and partly outside of the section as well, one after the other."""
    rng, tool, cell, cuts = np.random.default_rng(random_seed()), TOOLS[name], 0.1, 0
    section = turning_cut.Section(BLANK, cell)
    origin, mask = turning_cut._mask(tool, cell)
    r = 0.0 if tool.point else tool.d / 2
    dx, dz = (0, 0) if tool.point else turning_cut.CENTRE[tool.q]
    for number in range(random_count(200, 40)):
        if number % 5 == 0:
            section.cells[:] = rng.random(section.cells.shape) < 0.7
            cells = section.cells.copy()
        z, x = rng.uniform(-18, 6), rng.uniform(-12, 14)
        at = int(round((x + dx * r) / cell)), int(round((z + dz * r - section.z0) / cell))
        found, wanted = section.cut(0, tool, z, x), taken(cells, origin, mask, at)
        assert found == pytest.approx(wanted * cell * cell, abs=1e-12) and np.array_equal(section.cells, cells)
        cuts += wanted > 0
    assert cuts > 5


def test_a_row_that_is_shorter_is_seen(monkeypatch):
    extent = turning_cut._extent
    monkeypatch.setattr(turning_cut, "_extent", lambda cells: extent(cells) - (0, 1))
    with pytest.raises(AssertionError):
        test_the_cells_that_a_tool_takes("outside")
