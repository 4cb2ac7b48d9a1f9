# SPDX-License-Identifier: GPL-2.0-or-later
"""Levels and rest of surface_plan(), judged by needles of stock (support/surface_judge.py) against the same cuts made
all over."""

import dataclasses

import numpy as np
import pytest
from support import link_judge, surface_cases, surface_judge
from support.random_cases import random_count, random_seed

from chipwise.clib.height_map import Shape
from chipwise.cycles.surface import LEAST_STOCK, surface_plan
from chipwise.errors import CycleError

TOOLS = {"flat": Shape(6), "ball": Shape(6, 3), "bull": Shape(6, 1), "tapered": Shape(4, 1, 20)}
START = surface_cases.START
APART, CELL = 0.4, 0.25  # mm: needles of the judge, of the plan
GOUGE = 1e-3


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    return surface_cases.model_files(tmp_path_factory.mktemp("models"))


def request(file, tool, **fields):
    return surface_cases.request(file, **{"tool": TOOLS.get(tool, tool), "cell": CELL, "tolerance": 0.02, **fields})


def needles_of(plan, top=None):
    return surface_judge.grid(plan.low, plan.high, plan.high[2] if top is None else top, APART)


def left_by(plan, shape, top=None):
    """Needles after a plan, and how deep its rapids were."""
    needles = needles_of(plan, top)
    return needles, needles.follow(plan.moves, START, shape)


CASES = [("waves", "flat", 0), ("waves", "ball", 1), ("step", "bull", 1), ("step", "flat", 2), ("waves", "tapered", 2)]


@pytest.mark.parametrize("name, tool, link", CASES)
def test_levels_leave_what_one_level_leaves(files, name, tool, link):
    """Random depths, directions and steps: no traverse meets stock, nothing deeper than a level is taken, no gouge,
    nothing is left out."""
    rng = np.random.default_rng(random_seed())
    for case in range(random_count(1)):
        r = request(
            files[name],
            tool,
            link=link,
            direction=float(rng.integers(0, 360)),
            depth=float(rng.uniform(0.7, 2.5)),
            step=float(rng.uniform(1.0, 3.0)),
            allowance=float(rng.choice([0, 0.3])),
            stock_top=float(rng.choice([4.2, 7.0])),
        )
        plan = surface_plan(r)
        needles, rapids = left_by(plan, r.tool, r.stock_top)
        assert max(rapids) <= surface_judge.RIDGE, (r, max(rapids))
        _lengths, deepest = surface_judge.feed_figures(needles_of(plan, r.stock_top), plan.moves, START, r.tool)
        assert deepest <= r.depth + LEAST_STOCK + surface_judge.RIDGE, (r, deepest)
        gouge, _rest = surface_judge.gouge_and_rest(
            plan.moves, START, surface_cases.triangles_in(r.file), r.tool, plan.low[2], 25, case, r.allowance
        )
        assert (gouge <= GOUGE) or r.allowance and tool != "ball", (r, gouge)
        whole, _rapids = left_by(surface_plan(dataclasses.replace(r, depth=None, link=0)), r.tool, r.stock_top)
        assert (needles.height - whole.height).max() <= LEAST_STOCK + r.tolerance + surface_judge.RIDGE, r


def test_the_judge_sees_a_deep_cut_and_what_is_left_out(files):
    r = request(files["waves"], "flat", depth=1.0)
    plan = surface_plan(r)
    once = surface_plan(dataclasses.replace(r, depth=None))
    assert surface_judge.feed_figures(needles_of(once), once.moves, START, r.tool)[1] > 2.0
    half = dataclasses.replace(plan, moves=plan.moves[: len(plan.moves) // 2])
    assert (left_by(half, r.tool)[0].height - left_by(plan, r.tool)[0].height).max() > 0.5


def test_levels_are_cut_only_where_there_is_stock(files):
    """What a level has cut is not cut again: the feed in the cut, without entries, is hardly ever in air."""
    r = request(files["step"], "flat", depth=1.0, link=1, direction=30.0)
    plan = surface_plan(r)
    lengths, _deepest = surface_judge.feed_figures(
        surface_judge.grid(plan.low, plan.high, plan.high[2], 0.2, 6.0), plan.moves, START, r.tool
    )
    assert lengths[r.feed][1] <= 0.05 * lengths[r.feed][0], lengths
    again = surface_plan(dataclasses.replace(r, earlier=(r,)))
    assert again.cuts == 0 and all(move.x is None for move in again.moves)
    assert "nothing is cut" in again.notes[-1].text


def deepest_plunge(r):
    """mm that a move straight down takes off a needle."""
    plan, at, deepest = surface_plan(r), START, 0.0
    needles = needles_of(plan, r.stock_top)
    for move in plan.moves:
        new = tuple(old if value is None else value for old, value in zip(at, (move.x, move.y, move.z)))
        before = needles.height.copy()
        needles.follow([move], at, r.tool)
        if type(move).__name__ == "Line" and move.x is None and new[2] < at[2]:
            deepest = max(deepest, (before - needles.height).max())
        at = new
    return deepest


def test_entries_into_full_stock_are_ramps(files):
    """Straight down the tool goes in air, but for 0.1 mm; with 90 degrees into the stock, which the judge sees."""
    r = request(files["waves"], "flat", depth=1.5, link=1, ramp_angle=5.0, stock_top=3.0)
    assert deepest_plunge(r) <= 0.15
    assert deepest_plunge(dataclasses.replace(r, ramp_angle=90.0)) > 1.0


@pytest.mark.parametrize("name, link", [("waves", 1), ("waves", 2), ("step", 0)])
def test_rest_with_a_smaller_tool(files, name, link):
    """After a ball of 6 mm one of 2 mm cuts only where more than 0.08 mm is left, and leaves no more of it than over
    everything.  The plan knows the stock a cell apart: between its needles, at the edges of the rest, up to one needle
    of the judge in a hundred is higher."""
    first = request(files[name], "ball", step=0.6)
    whole = request(files[name], Shape(2, 1), step=0.5, direction=30.0, link=link, earlier=(first,), relief=0.3)
    r = dataclasses.replace(whole, least=0.08)
    plan, all_over = surface_plan(r), surface_plan(dataclasses.replace(whole, link=0))
    needles, after = needles_of(plan), needles_of(plan)
    needles.follow(surface_plan(first).moves, START, first.tool)
    after.height = needles.height.copy()
    after.follow(all_over.moves, START, r.tool)
    rest = needles.height - after.height > 0.08 + r.tolerance
    assert rest.mean() > 0.02  # there is some
    assert max(needles.follow(plan.moves, START, r.tool)) <= surface_judge.RIDGE
    more = needles.height - after.height > 0.08 + r.tolerance + surface_judge.RIDGE
    assert more.mean() <= 0.01 and more.sum() < 0.2 * rest.sum()
    fed, everywhere = (
        sum(np.linalg.norm(p[-1] - p[0]) for is_rapid, p in surface_judge.positions(moves, START) if not is_rapid)
        for moves in (plan.moves, all_over.moves)
    )
    assert 0 < fed < 0.5 * everywhere


def in_air(r, before):
    """Share of the feed moves of a plan that lowers no needle, with all that leads into the cuts; before: needles as
    they are then."""
    needles = surface_judge.grid(r.low, r.high, r.high[2], 0.2)
    needles.height = before.copy()
    lengths, _deepest = surface_judge.feed_figures(needles, r.moves, START, Shape(3, 1.5))
    total, air = (sum(one[k] for one in lengths.values()) for k in (0, 1))
    return air / total


def test_rest_is_hardly_ever_in_air(files):
    """Around a block with vertical walls, whose rest is a ring: one side after the other, without going up the walls.
    One-way cuts have to come in anew each time, which the judge sees."""
    first = request(files["step"], "ball", step=0.5)
    r = request(
        files["step"],
        Shape(3, 1.5),
        step=0.2,
        least=0.05,
        relief=0.3,
        link=2,
        feed=1500.0,
        plunge_feed=600.0,
        earlier=(first,),
    )
    zigzag, one_way = surface_plan(r), surface_plan(dataclasses.replace(r, link=1))
    needles = surface_judge.grid(zigzag.low, zigzag.high, zigzag.high[2], 0.2)
    assert max(needles.follow(surface_plan(first).moves, START, first.tool)) <= surface_judge.RIDGE
    before = needles.height.copy()
    assert in_air(zigzag, before) <= 0.05
    assert in_air(one_way, before) > 0.1
    assert max(needles.follow(zigzag.moves, START, r.tool)) <= surface_judge.RIDGE


def test_stock_before_is_known_to_the_links(files):
    """After roughing the links of finishing are quicker, by another planner, and still meet nothing."""
    rough = request(files["waves"], "flat", depth=1.5, allowance=0.3)
    finish = request(files["waves"], "ball", step=1.0, link=1, clearance=15.0)
    after = dataclasses.replace(finish, earlier=(rough,))
    seconds = [sum(map(link_judge.seconds, link_judge.links_of(surface_plan(r).moves, START))) for r in (finish, after)]
    assert seconds[1] < 0.9 * seconds[0]
    plan = surface_plan(after)
    needles, _rapids = left_by(surface_plan(rough), rough.tool)
    assert max(needles.follow(plan.moves, START, finish.tool)) <= surface_judge.RIDGE


def test_a_larger_tool_after_a_smaller_one(files):
    """The stock then has to reach further than the requests before knew."""
    small = request(files["waves"], Shape(2, 1))
    large = request(files["waves"], Shape(12), step=4.0, depth=2.0, earlier=(small,), margin=2.0)
    plan = surface_plan(large)
    needles, _rapids = left_by(surface_plan(small), small.tool)
    assert max(needles.follow(plan.moves, START, large.tool)) <= surface_judge.RIDGE


@pytest.mark.parametrize(
    "fields, text",
    [
        (dict(depth=0.0), "depth of a level 0 mm is not above 0"),
        (dict(depth=float("nan")), "is not above 0"),
        (dict(depth=0.001), "more than 1000 levels"),
        (dict(least=0.0), "rest of 0 mm is not above 0"),
        (dict(depth=1.0, most_moves=900), "moves, more than 900"),
    ],
)
def test_refused(files, fields, text):
    with pytest.raises(CycleError) as found:
        surface_plan(request(files["waves"], "ball", **fields))
    assert text in str(found.value)
