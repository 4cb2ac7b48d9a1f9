# SPDX-License-Identifier: GPL-2.0-or-later
"""`chipwise resume` of a copy of cells that was made part by part while the tool cut: some rows are older than
others."""

import numpy as np
import pytest

from chipwise.resume import run as resume
from support.resume_case import SAME_MM, SAME_MM3, SAME_SHARE, Case, feed_left
from support.resume_oracle import apart
from support.resume_programs import SUBS


@pytest.fixture(name="case", scope="module")
def make_case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("older")
    (folder / "subs.ngc").write_text(SUBS)
    return Case(folder, folder / "subs.ngc")


@pytest.mark.parametrize(
    "x, points, y, above",
    [
        (45, 60, 38.0, False),
        (45, 60, 37.4, False),
        (47, 100, 38.0, False),
        (47, 100, 42.2, True),
        (47, 200, 37.4, False),
        (47, 18, 43.0, True),
    ],
)
def test_rows_that_are_older_are_cut(case, x, points, y, above):
    """x: of the tool in the third slot (y 40 mm) at the stop; the rows below or above `y` are `points` of 4 ms
    older."""
    index = next(k for k, at in enumerate(case.run.points) if at[2] < -3.9 and at[0] > x and abs(at[1] - 40) < 0.01)
    stock = case.run.new_stock()
    removed = case.run.cut(stock, 0, index - points)
    older = np.array(stock.cells_and_ring)
    removed += case.run.cut(stock, index - points, index)
    row, width, volume = int(y / stock.head.cell) + 1, stock.head.nx + 2, stock.volume()
    rows = slice(row, None) if above else slice(0, row)
    stock.cells_and_ring.reshape(-1, width)[rows] = older.reshape(-1, width)[rows]
    assert stock.volume() > volume + 0.1
    case.keep(stock, removed, index)
    made = case.job.finish(case.job.of_kept(resume.Order()), resume.Order())
    cut, met, fed = case.resumed(made.data, stock)
    assert (
        max(apart(case.whole, cut)) < SAME_MM
        and abs(cut.volume() - case.whole.volume()) < SAME_MM3 + SAME_SHARE * case.volume
    )
    assert met < 1e-3 and -0.5 < fed - feed_left(case, index) < 5.0
