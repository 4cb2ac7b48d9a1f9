# SPDX-License-Identifier: GPL-2.0-or-later
"""`chipwise resume` at random stops: the place, what is cut in the end, the approach.  The oracle is
support/resume_oracle.py."""

import random

import numpy as np
import pytest

from chipwise.resume import place as places
from chipwise.resume import run as resume
from chipwise.resume import descent, stocks, walk
from support import ROOT
from support.random_cases import random_count, random_seed
from support.resume_case import SAME_MM, SAME_MM3, SAME_SHARE, Case, feed_left
from support.resume_case import stations as case_stations
from support.resume_oracle import PERIOD_S, apart
from support.resume_programs import OWN, SAMPLES

pytestmark = [
    pytest.mark.xdist_group("resume_places"),  # each case is made once
    pytest.mark.usefixtures("forked_readers"),
]

ALONG_MM = 0.001  # of the stop
SAG_MM = 0.0025  # chords of arcs
LAG_S = 0.8  # between the cells that were saved and a crash


@pytest.fixture(name="case", scope="module", params=[*SAMPLES, *OWN])
def make_case(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("resume")
    if request.param in OWN:
        path = folder / f"{request.param.split()[0]}.ngc"
        path.write_text(OWN[request.param])
        return Case(folder, path)
    return Case(folder, ROOT / "nc_files" / f"{request.param}.ngc")


def stations(case, count, name):
    return case_stations(case, count, f"{name} {random_seed()} {case.path.name}")


def test_the_place(case):
    """To 0.001 mm along the path, as the tool was there when the last cells were saved."""
    for index, stock, removed in stations(case, random_count(25), "place"):
        case.keep(stock, removed, index)
        found = case.job.of_kept(resume.Order())
        at = descent.point(found.path, found.at)
        k = min(found.at.segment, len(found.path.move) - 1)
        step = found.path.end[k] - found.path.start(k)
        off = at - case.run.points[index]
        along = abs(float(off @ step)) / max(float(np.linalg.norm(step)), 1e-9)
        assert along < ALONG_MM and np.linalg.norm(off) < SAG_MM, (index, found.at, off)


def test_what_is_cut_in_the_end(case):
    """The stock of the whole program; no traverse meets any; cells that are older or newer than the tool's place do no
    harm."""
    rng, added = random.Random(f"end {case.path.name}"), []
    for index, stock, removed in stations(case, random_count(2), "end"):
        older = index - rng.choice(
            [0, int(LAG_S / PERIOD_S), 12, -1, -2, -12]
        )  # the tip of a note may be on either side of the cells
        tip = min(max(older, 1), len(case.run.points) - 1)
        case.keep(stock, removed, tip)
        made = case.job.finish(case.job.of_kept(resume.Order()), resume.Order())
        cut, met, fed = case.resumed(made.data, stock)
        higher, lower = apart(case.whole, cut)
        assert max(higher, lower) < SAME_MM, (index, tip, higher, lower, made.data.decode())
        assert abs(cut.volume() - case.whole.volume()) < SAME_MM3 + SAME_SHARE * case.volume
        assert met < 1e-3, (index, met)
        added.append(fed - feed_left(case, min(index, tip)))
    assert not added or min(added) > -0.5, added  # nothing is left out


def test_a_note_that_is_a_little_newer_than_the_cells(case):
    """It goes on a little before."""
    for index, stock, removed in stations(case, random_count(5), "newer"):
        case.keep(stock, removed, min(index + 2, len(case.run.points) - 1))
        found = case.job.of_kept(resume.Order())
        off = np.linalg.norm(descent.point(found.path, found.at) - case.run.points[index])
        assert found.removed == removed and off < 25.0, (index, off)


def test_a_cut_that_is_left_out_is_seen(case):
    """The oracle and the product's own comparison, both."""
    index, stock, removed = list(stations(case, 3, "left out"))[0]
    found = stocks.Kept(stocks.head_of(stock, removed), np.array(stock.cells_and_ring), None, "")
    path = walk.path_of(case.program, case.machine, case.geometry, stocks.first_move(case.program, found.head))
    wanted, _undone = walk.evidence(path, case.program, found)
    later = int(np.searchsorted(np.cumsum(wanted), wanted.sum() - 1e-6))
    with pytest.raises(resume.Unreadable, match="mm3"):
        places.prove(path, case.program, found, places.Place(later, 0.0), wanted)
    higher, _lower = apart(case.whole, stock)
    assert higher > SAME_MM or stock.volume() - case.whole.volume() > SAME_MM3 + SAME_SHARE * case.volume
