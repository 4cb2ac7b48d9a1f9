# SPDX-License-Identifier: GPL-2.0-or-later
"""The holder of surface_plan() against the stock as it is cut, judged by needles apart, and the messages about holder
and flutes."""

import dataclasses

import numpy as np
import pytest
from support import surface_cases, surface_judge
from support.random_cases import random_count, random_seed

from chipwise.clib.height_map import Shape
from chipwise.cycles.surface import surface_plan
from chipwise.errors import CycleError
from chipwise.surface.links import Obstacles

START = surface_cases.START
TOOL = Shape(4, 1, 0, 10, 7)  # bull-nose, 7 mm out of a holder of 10 mm
BEYOND = 3.5  # mm of stock around the model that is looked at: the plan knows 4


@pytest.fixture(scope="module")
def waves(tmp_path_factory):
    return surface_cases.write_stl(tmp_path_factory.mktemp("model") / "waves.stl", surface_cases.waves(20, 12.0))


def request(file, **fields):
    return surface_cases.request(
        file, **{"tool": TOOL, "step": 1.5, "tolerance": 0.02, "stock_top": 3.0, "cell": 0.2, **fields}
    )


def in_holder(plan, r):
    """mm by which a needle is in the holder at most, on any move, cut by the moves before it."""
    needles, at, deepest = surface_judge.grid(plan.low, plan.high, r.stock_top, 0.5, BEYOND), np.array(START), 0.0
    for move in plan.moves:
        if type(move).__name__ == "Blend":
            continue
        new = np.array([old if value is None else value for old, value in zip(at, (move.x, move.y, move.z))], float)
        for x, y, z in np.append(surface_judge.along(move, at, new)[::8], [new], axis=0):
            near = np.hypot(needles.xy[:, 0] - x, needles.xy[:, 1] - y) <= r.tool.holder_diameter / 2
            deepest = max(deepest, float((needles.height[near] - z - r.tool.stick_out).max(initial=0.0)))
        needles.follow([move], at, r.tool)
        at = new
    return deepest


def notes_of(plan):
    return [str(CycleError(note.text, **note.lengths)) for note in plan.notes]


@pytest.mark.parametrize("link, depth", [(0, None), (1, 3.0), (2, 3.0), (2, None)])
def test_the_holder_is_clear_of_the_stock(waves, link, depth):
    """The stock reaches 3 mm above hills whose valleys are 13 mm below it: near the edges, and everywhere without
    levels, the tool is kept up."""
    rng = np.random.default_rng(random_seed())
    for _case in range(random_count(1)):
        r = request(waves, link=link, depth=depth, direction=float(rng.choice([0, 90, rng.integers(0, 360)])))
        plan = surface_plan(r)
        assert in_holder(plan, r) <= surface_judge.RIDGE, (random_seed(), r)
        assert [("stock beside the holder keeps the tool up to" in note) for note in notes_of(plan)].count(True) == 1
        gouge, _rest = surface_judge.gouge_and_rest(
            plan.moves,
            START,
            surface_cases.waves(20, 12.0),
            dataclasses.replace(r.tool, holder_diameter=0.0),
            plan.low[2],
            20,
            1,
        )
        assert gouge <= 1e-3


def test_the_judge_sees_a_holder_in_the_stock(waves, monkeypatch):
    monkeypatch.setattr(Obstacles, "held_up", lambda _self, curve: (curve, 0.0, (0.0, 0.0)))
    r = request(waves, depth=3.01)
    assert in_holder(surface_plan(r), r) > 1.0


def test_a_clear_holder_changes_nothing(waves):
    """Not even the arcs."""
    r = request(waves, link=1, depth=3.0)
    long, none = (
        surface_plan(dataclasses.replace(r, tool=dataclasses.replace(TOOL, **more)))
        for more in (dict(stick_out=14.0), dict(holder_diameter=0.0))
    )
    assert long.moves == none.moves and not long.notes and any(type(move).__name__ == "PlaneArc" for move in long.moves)


@pytest.mark.parametrize(
    "fields, said",
    [
        (dict(flute_length=5.0), True),
        (dict(flute_length=14.0), False),
        (dict(), False),
        (dict(flute_length=5.0, depth=3.0), False),
    ],
)
def test_cuts_deeper_than_the_flutes_are_named(waves, fields, said):
    plan = surface_plan(request(waves, tool=dataclasses.replace(TOOL, holder_diameter=0.0), **fields))
    assert [("deep, the flutes are 5 mm long; rough in levels first" in note) for note in notes_of(plan)] == [
        True
    ] * said
