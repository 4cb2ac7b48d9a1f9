# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 P4 as a cycle: whole plans by the oracle of pockets and the judge of engagement; levels, sides, what it says."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support import engagement_judge, pocket_oracle
from support.engagement_shapes import polygon
from support.pocket_judge import case_of, random_request, verdict
from support.pocket_random import circle, rectangle
from support.pocket_requests import faults, request, walked

from chipwise.cycles import pocket as cycle
from chipwise.cycles import pocket_engage
from chipwise.geometry.pocket import engage_proof

NOMINAL = math.acos(1.0 - 2.4 / 3.0)


def asked(loops=(rectangle(0, 0, 24, 18),), **fields):
    return request(loops, strategy=4, step=2.4, tool_radius=3.0, **fields)


@pytest.mark.parametrize("climb", [True, False])
def test_levels_of_a_pocket_with_an_island(climb):
    one = asked(
        (rectangle(0, 0, 24, 20), circle(1.5, (12.0, 10.0))),
        depth_step=2.5,
        floor_allowance=0.5,
        side_allowance=0.2,
        climb=climb,
    )
    assert faults(one) == []
    moves = walked(one)
    levels = sorted({round(e.b[2], 6) for e in moves if e.kind != "rapid" and e.a[2] == e.b[2]})
    assert levels == [-3.5, -1.25]
    levels_of = [
        [(e.kind, e.a[:2], e.b[:2]) for e in moves if e.kind != "rapid" and e.a[2] == e.b[2] and abs(e.b[2] - z) < 1e-6]
        for z in levels
    ]
    assert levels_of[0] == levels_of[1]  # one path, level by level


def test_the_stock_is_on_the_other_side_without_climb():
    """Along the wall at the end: the boundary counter-clockwise with climb, clockwise without."""
    for climb, sense in ((True, 1), (False, -1)):
        at_wall = [
            e
            for e in walked(asked(climb=climb))
            if e.kind == "feed" and abs(e.a[1] - 3.0) < 1e-3 and abs(e.b[1] - 3.0) < 1e-3 and e.a[2] == e.b[2]
        ]
        assert sum(e.b[0] - e.a[0] for e in at_wall) * sense > 12.0


def test_engagement_of_the_moves():
    one = asked()
    found = engagement_judge.engagement(walked(one), one.bottom, 3.0, 0.3, without=(0, 1))
    assert found.percentile(0.99) < NOMINAL + math.radians(3.0) and found.most < NOMINAL + math.radians(10.0)
    slots = engagement_judge.engagement(walked(request()), one.bottom, 3.0, 0.5)
    assert slots.length(2.5) > 10.0  # P0: the judge sees its first ring and its corners


def test_the_tool_does_not_stand_on_a_wall_as_it_goes_up():
    """Nor comes down on one, in a pocket with room."""
    one = asked()
    moves, case = walked(one), case_of(one)
    up = [e.a[:2] for e in moves if e.a[2] == one.bottom and e.b[2] > one.clearance - 1e-6]
    down = [e.b[:2] for e in moves if e.a[2] > one.bottom + 0.1 and e.b[2] == one.bottom]
    assert len(up) == 1 and (pocket_oracle.clearance(case.loops, np.array(up + down)) >= case.distance + 0.1).all()


def test_rapids_across_are_lifted_and_never_beside_stock():
    one = asked()
    moves = walked(one)
    across = [
        e
        for e in moves
        if e.kind == "rapid" and max(e.a[2], e.b[2]) < one.clearance - 1e-6 and math.dist(e.a[:2], e.b[:2]) > 0.01
    ]
    assert len(across) > 10
    assert max(e.b[2] for e in across) == pytest.approx(one.bottom + pocket_engage.LIFT_MM)
    assert faults(one) == []


@pytest.mark.parametrize("seed", [11, 23])
def test_random_pockets(seed):
    one = random_request(seed, 4)
    found, plan = verdict(replace(one, step=min(one.step, 0.8 * one.tool_radius)), seed, 1500)
    assert found == [] and plan is not None


def test_a_corner_is_named():
    plan = cycle.pocket_plan(asked((polygon([(0, 0), (40, 0), (0, 25)]),)))
    text, lengths = plan.notes[-1]
    assert (
        text.startswith("the engagement is above that of D in ")
        and text.endswith(" degrees at X{x} Y{y}")
        and set(lengths) == {"x", "y"}
    )


def test_a_narrow_slot_is_named_and_cut_at_less_feed():
    one = asked((rectangle(0, 0, 30, 6.2),))
    plan = cycle.pocket_plan(one)
    text, lengths = plan.notes[-1]
    assert (
        text.startswith("P4 cannot keep the engagement of D in 1 narrow place (up to 180 degrees) and feeds less there")
        and lengths["mm"] > 10.0
    )
    assert faults(one) == []
    slots = [
        e
        for e in walked(one)
        if e.kind != "rapid" and e.a[2] == e.b[2] == one.bottom and math.dist(e.a[:2], e.b[:2]) > 2.0
    ]
    slowest = min(m.feed for m in plan.moves if getattr(m, "feed", None) and m.z is None)
    assert slots and slowest == pytest.approx(one.feed * 2.4 / 6.0, rel=0.01)


@pytest.mark.parametrize("loop", [rectangle(0, 0, 30, 6.2), rectangle(0, 0, 30, 7.0)])
def test_the_full_width_is_named_with_its_millimetres(loop):
    """As the judge reads it; nothing is said of a slot in which the tool keeps off it."""
    one = asked((loop,))
    told = [
        lengths
        for text, lengths in cycle.pocket_plan(one).notes
        if text.startswith("the tool cuts its full width over {mm} in 1 place, the longest over {most} from")
    ]
    found = engagement_judge.engagement(walked(one), one.bottom, 3.0, 0.1).length(engage_proof.FULL)
    assert (
        sum(lengths["mm"] for lengths in told) == pytest.approx(found, abs=0.2)
        and len(told) == (found > 0.0)
        and found in (0.0, pytest.approx(18.0, abs=0.2))
    )


@pytest.mark.parametrize("width, entry", [(6.2, "ramp"), (6.0004, "plunge")])
def test_a_region_without_room_for_a_helix(width, entry):
    one = asked((rectangle(0, 0, 30 if entry == "ramp" else 6.0004, width),))
    assert faults(one) == []
    assert len(cycle.pocket_plan(one).plunges) == (entry == "plunge")


def test_the_same_request_is_the_same_plan():
    first = cycle.pocket_plan(asked()).moves
    again = cycle.pocket_plan.__wrapped__(asked()).moves
    assert first == again and np.isfinite([m.x for m in first if m.x is not None]).all()
