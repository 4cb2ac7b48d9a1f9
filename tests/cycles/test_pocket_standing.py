# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 P4 from the stock as it stands: a larger tool before, a stop in the middle, levels; what counts as cleared."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support import hole_oracle
from support.begun_pocket import begun, length, place, standing, stock_after, verdict
from support.pocket_judge import random_request
from support.pocket_random import rectangle
from support.pocket_requests import request, walked
from support.random_cases import random_count

from chipwise.cycles import pocket as cycle
from chipwise.errors import CycleError
from chipwise.geometry.base.elements import make_lines

BOX = (rectangle(0, 0, 44, 30),)
AS_IT_STANDS = "P4 starts from the stock as it stands"


def small(loops=BOX, **fields):
    return request(loops, strategy=4, **fields)


def large(loops, **fields):
    return walked(request(loops, tool_radius=5.0, step=4.0, **fields))


def said(one):
    return [note.text for note in cycle.pocket_plan(one).notes if note.text.startswith(AS_IT_STANDS)]


@pytest.mark.parametrize(
    "loops, shape, most",
    [
        ((rectangle(0, 0, 22, 30),), BOX, 0.65),  # half of it
        (BOX, BOX, 0.30),
    ],
)  # its corners are left
def test_a_smaller_tool_cuts_what_a_larger_one_has_left(loops, shape, most):
    before, one = large(loops), small(shape)
    found, moves = verdict(begun(one, before, 5.0), before, 5.0)
    assert found.faults == [] and found.most < 10.0 and found.full == 0.0
    assert length(moves) < most * length(walked(one))


def test_a_cycle_that_was_aborted_goes_on():
    one = small(depth_step=2.5)
    all_moves = walked(one)
    before = all_moves[: int(0.75 * len(all_moves))]  # in the second level
    again = begun(one, before, 3.0)
    found, moves = verdict(again, before, 3.0)
    assert found.faults == [] and found.most < 10.0
    assert length(moves) < 0.62 * length(all_moves)
    levels = sorted({round(e.b[2], 6) for e in moves if e.kind != "rapid" and e.a[2] == e.b[2]})
    assert levels == [-4.0, -1.5]  # the first level: its walls, beside which the map has cells with a wall in them
    upper = [e for e in moves if e.kind != "rapid" and e.b[2] == e.a[2] == -1.5]
    assert length(upper) < 1.4 * 2 * (38 + 24)


def test_a_level_at_which_nothing_stands_is_left_out():
    one = small(depth_step=2.5)
    before = large((rectangle(-15, -15, 59, 45),), bottom=-2.0)
    moves = walked(begun(one, before, 5.0))
    assert {round(e.b[2], 6) for e in moves if e.kind != "rapid" and e.a[2] == e.b[2]} == {-4.0}
    assert said(begun(one, before, 5.0)) == [AS_IT_STANDS + ", 50 % of the pocket is cleared already"]


def test_solid_stock_is_the_plan_of_the_preview():
    one, before = small(), large((rectangle(12, 8, 32, 22),), bottom=-3.9)  # 0.1 mm above the level
    assert cycle.pocket_plan(begun(one, before, 5.0)).moves == cycle.pocket_plan(one).moves
    assert said(begun(one, before, 5.0)) == []


def test_other_strategies_do_not_ask():
    one, before = request(BOX), large(BOX)
    assert cycle.pocket_plan(begun(one, before, 5.0)).moves == cycle.pocket_plan(one).moves


def test_work_coordinates_that_are_shifted_and_turned():
    """Conventional, so the pocket is mirrored, too."""
    where, before, one = place((-37.03, 12.3, -5.0), 0.4), large((rectangle(0, 0, 22, 30),)), small(climb=False)
    found, moves = verdict(begun(one, before, 5.0, where), before, 5.0)
    assert found.faults == []
    assert length(moves) < 0.65 * length(walked(one))


def test_what_counts_as_cleared_is_never_more_than_what_is():
    """Around a slot: within it by no more than a cell and a half, and a cell outside of the map is stock."""
    before = walked(request((rectangle(0, 0, 40, 16),), tool_radius=8.0, step=8.0, start=(8.0, 8.0, 1.0)))
    where = place((3.17, -2.2, 1.0), 0.3)
    stock = standing(stock_after(before, 8.0, where, 0.25), where)
    contour = make_lines(
        np.array([(0, 0), (40, 0), (40, 16), (0, 16)], float), np.array([(40, 0), (40, 16), (0, 16), (0, 0)], float)
    )
    chain = stock.cleared(contour, -4.0, 3.0)
    ends = np.concatenate((chain.start, chain.end))
    gap = np.hypot(np.maximum(np.maximum(8.0 - ends[:, 0], ends[:, 0] - 32.0), 0.0), ends[:, 1] - 8.0)
    assert 4.6 < gap.max() <= 5.0
    assert len(stock.cleared(contour, -4.1, 3.0)) == 0
    assert len(stock.within((100.0, 100.0), (110.0, 110.0), 3.0).cleared(contour, -4.0, 3.0)) == 0
    part = stock.within((0.0, 0.0), (40.0, 16.0), 3.0).cleared(contour, -4.0, 3.0)
    assert part.start == pytest.approx(chain.start) and part.end == pytest.approx(chain.end)


@pytest.mark.parametrize("seed", range(7100, 7100 + random_count(10)))
def test_random_pockets_that_were_begun(seed):
    rng, one = np.random.default_rng([seed, 991]), random_request(seed, 4)
    one = replace(one, step=min(one.step, 0.8 * one.tool_radius), depth_step=None)
    radius = one.tool_radius * (float(rng.uniform(1.1, 1.6)) if rng.random() < 0.4 else 1.0)
    try:
        first = one if radius == one.tool_radius else replace(one, tool_radius=radius, strategy=0, step=0.8 * radius)
        before = hole_oracle.walk(cycle.pocket_plan(first).moves, first.start)
    except CycleError:
        pytest.skip("the tool fits nowhere")
    before = before[: int(rng.uniform(0.1, 0.95) * len(before))] if first is one else before
    where = place(tuple(rng.uniform(-40.0, 40.0, 3)), float(rng.choice([0.0, 0.3, 1.9])))
    found, moves = verdict(begun(one, before, radius, where, float(rng.choice([0.1, 0.25, 0.4]))), before, radius, seed)
    assert found.faults == []
    assert length(moves) < 1.1 * length(walked(one)) + 4 * math.pi * radius
