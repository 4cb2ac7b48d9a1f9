# SPDX-License-Identifier: GPL-2.0-or-later
"""Levels of the cycles without J: random cases before columns written apart; the rule itself; and the oracle's own
failures."""

import dataclasses
import math
import random

import pytest

from chipwise.cycles import hole, pocket
from chipwise.cycles.chop_lines import depth_levels
from chipwise.cycles.contour import contour_plan
from chipwise.errors import CycleError
from chipwise.geometry.base.contour import ContourError
from support import contour_cycle_judge, hole_judge, pocket_judge
from support.flute_oracle import deepest
from support.hole_oracle import walk
from support.random_cases import random_count, random_seed

SMALL = 1e-6  # mm; of the rule: as EQUAL of the cycles
CELLS = 5  # of a tool's radius


def heights(rng):
    """Words of depth: R, Z, the flute length and the top of the stock, mm, from far below Z to far above R."""
    bottom = -rng.uniform(1, 12)
    clearance = bottom + rng.uniform(0.5, 30)
    return dict(
        bottom=bottom,
        clearance=clearance,
        depth_step=rng.uniform(2, 15),
        stock_top=bottom + rng.uniform(-0.2, 1.2) * (clearance - bottom),
    )


def hole_case(rng, seed):
    kind = rng.choice(({}, {"chop_size": 9.0}, {"finished": 11.0, "step": 2.2}))
    words = {**dict(radius=rng.uniform(4, 10), tool_radius=2.0, chop_size=0.0), **kind}
    words["radius"] = min(words["radius"], words.get("finished", 10.0))
    return hole_judge.request(**words, **heights(rng))


def contour_case(rng, seed):
    r = contour_cycle_judge.random_request(seed)
    return dataclasses.replace(r, chop_size=8.0 * r.tool_radius if r.finish else 0.0, **heights(rng))


def pocket_case(rng, seed):
    return dataclasses.replace(pocket_judge.random_request(seed, rng.randrange(4)), **heights(rng))


CASES = {"hole": hole_case, "contour": contour_case, "pocket": pocket_case}
PLANS = {"hole": hole.hole_plan, "contour": contour_plan, "pocket": pocket.pocket_plan}


def planned(name, rng, seed):
    """(request, plan); None for one that cannot be done."""
    r = CASES[name](rng, seed)
    try:
        return r, PLANS[name](r)
    except (CycleError, ContourError):
        return None


def passes(plan):
    return len({move.z for move in plan.moves if move.z is not None})


@pytest.mark.parametrize("name", CASES)
def test_no_pass_is_deeper_in_the_stock_than_the_flutes(name, capsys):
    rng, count, judged, saved, worst = random.Random(f"{random_seed()} {name}"), random_count(12), 0, 0, -math.inf
    for number in range(count):
        found = planned(name, rng, random_seed() + number)
        if found is None:
            continue
        r, plan = found
        plain = PLANS[name](dataclasses.replace(r, stock_top=None))
        saved += passes(plan) < passes(plain)
        elements = walk(plan.moves, r.start)
        top = min(r.stock_top, r.clearance)
        contact, lowest = deepest(elements, top, r.tool_radius, r.tool_radius / CELLS)
        over = contact - r.depth_step
        worst, judged = max(worst, over), judged + 1
        assert over <= SMALL, f"seed {random_seed()}, {name} {number}: {over:.4f} mm deeper than the flutes"
        assert lowest == pytest.approx(min(top, r.bottom + getattr(r, "floor_allowance", 0.0)), abs=1e-9)
    with capsys.disabled():
        print(f"\n{judged} of {count} {name} cases, {saved} with fewer passes; deepest {worst:.4f} mm above the flutes")
    assert judged >= count // 2


def test_levels_of_random_heights():
    """Never more passes than from R, never a step above the flutes, unchanged if nothing is saved, and as few as can
    be."""
    rng, fewer = random.Random(random_seed()), 0
    for _ in range(random_count(3000)):
        h = heights(rng)
        before = depth_levels(h["clearance"], h["bottom"], h["depth_step"])
        levels = depth_levels(h["clearance"], h["bottom"], h["depth_step"], h["stock_top"])
        top = min(h["stock_top"], h["clearance"])
        least = max(1, math.ceil((top - h["bottom"]) / h["depth_step"] - SMALL))
        assert len(levels) == min(least, len(before))
        assert levels[-1] == h["bottom"]
        assert max(a - b for a, b in zip([top, *levels], levels)) <= h["depth_step"] * (1 + SMALL)
        assert levels == before or levels[0] <= max(top, h["bottom"])
        if len(levels) == len(before):
            assert levels == before
        fewer += len(levels) < len(before)
    assert fewer


def test_a_region_above_the_stock_takes_no_pass():
    assert depth_levels(20, -8, 10) == pytest.approx([20 - 28 / 3, 20 - 56 / 3, -8])
    assert depth_levels(20, -8, 10, 0) == [-8]
    assert depth_levels(20, -18, 10, 0) == [-9, -18]
    assert depth_levels(20, -8, 10, -30) == [-8]  # only air
    assert depth_levels(1, -8, 10, 0) == depth_levels(1, -8, 10)
    assert depth_levels(1, -16, 8.5, 0) == [-7.5, -16]  # nothing is saved: as from R
    assert depth_levels(-4, -8, 3, 0) == depth_levels(-4, -8, 3)  # R inside a pocket that is open already
    assert depth_levels(5, -8, None, 0) == [-8]


def test_the_oracle_sees_a_pass_that_is_too_deep():
    r = hole_judge.request(chop_size=0.0, clearance=12.0, bottom=-6.0, depth_step=6.5, stock_top=0.0, tool_radius=2.0)
    elements = walk(hole.hole_plan(r).moves, r.start)
    assert deepest(elements, 0.0, 2.0, 0.25)[0] == pytest.approx(6.0)
    assert deepest(elements, 4.0, 2.0, 0.25)[0] == pytest.approx(10.0)  # the stock is higher than M250 has said
    one = walk(hole.hole_plan(dataclasses.replace(r, bottom=-9.0, depth_step=None)).moves, r.start)
    assert deepest(one, 0.0, 2.0, 0.25)[0] == pytest.approx(9.0)
