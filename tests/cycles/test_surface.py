# SPDX-License-Identifier: GPL-2.0-or-later
"""surface_plan() judged by brute force (support/surface_judge.py): gouges, what is left, links, and the abstract's
points."""

import dataclasses
import math

import numpy as np
import pytest
from support import link_judge, surface_cases, surface_judge
from support.random_cases import random_count, random_seed

from chipwise.clib.height_map import Shape
from chipwise.cycles.surface import surface_plan
from chipwise.errors import CycleError
from chipwise.moves import Line, Rapid

TOOLS = {"flat": Shape(6), "ball": Shape(6, 3), "bull": Shape(6, 1), "vee": Shape(6, 0, 60), "tapered": Shape(6, 1, 20)}
GOUGE, ORACLE = 1e-3, 1e-3  # mm: allowed below the model; what the oracle's search may miss
START = surface_cases.START


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    return surface_cases.model_files(tmp_path_factory.mktemp("models"))


def request(file, tool, **fields):
    return surface_cases.request(file, **{"tool": TOOLS[tool], "step": 1.5, **fields})


@pytest.mark.parametrize("tool", TOOLS)
def test_between_points_nothing_is_gouged_and_little_is_left(files, tool):
    """Random directions and links over hills: at most 0.001 mm below, at most the tolerance above."""
    rng = np.random.default_rng(random_seed())
    for case in range(random_count(1)):
        r = request(
            files["waves"],
            tool,
            direction=float(rng.integers(0, 360)),
            link=case % 3,
            tolerance=float(rng.choice([0.01, 0.03])),
            bottom=float(rng.choice([-10, -7])),
        )
        plan = surface_plan(r)
        deepest, highest = surface_judge.gouge_and_rest(
            plan.moves, START, surface_cases.triangles_in(r.file), r.tool, r.bottom, 25, case
        )
        assert deepest <= GOUGE and highest <= r.tolerance + ORACLE, (r, deepest, highest)


@pytest.mark.parametrize("tool", TOOLS)
def test_walls(files, tool):
    """A step with vertical walls, at an odd angle: nothing below the model anywhere."""
    r = request(files["step"], tool, direction=17.0, link=1)
    deepest, _highest = surface_judge.gouge_and_rest(
        surface_plan(r).moves, START, surface_cases.triangles_in(r.file), r.tool, -5.0, 25, 3
    )
    assert deepest <= GOUGE


def test_the_judge_sees_a_gouge(files):
    r = request(files["waves"], "ball")
    moves = [
        dataclasses.replace(move, z=move.z - 0.02) if isinstance(move, Line) else move for move in surface_plan(r).moves
    ]
    assert (
        surface_judge.gouge_and_rest(moves, START, surface_cases.triangles_in(r.file), r.tool, -10.0, 40, 1)[0] > 0.009
    )


@pytest.mark.parametrize("link", [0, 1, 2])
@pytest.mark.parametrize("name, tool", [("waves", "ball"), ("step", "flat"), ("step", "vee")])
def test_no_traverse_meets_stock(files, name, tool, link):
    """3,000 needles of stock that the cuts take away; the box has been full at the beginning."""
    r = request(files[name], tool, link=link, direction=30.0, stock_top=4.5)
    plan = surface_plan(r)
    needles = surface_judge.Needles(plan.low, plan.high, 4.5, 3000, 1)
    depths = needles.follow(plan.moves, START, r.tool)
    assert len(depths) > 2 and max(depths) <= surface_judge.RIDGE
    if link:
        lower = [
            move
            if not isinstance(move, Rapid)
            else dataclasses.replace(move, z=None if move.z is None else move.z - 3.0)
            for move in plan.moves
        ]
        again = surface_judge.Needles(plan.low, plan.high, 4.5, 3000, 1)
        assert max(again.follow(lower, START, r.tool)) > 0.5  # the judge sees it


def test_pick_feed_goes_through_the_points_of_the_abstract(files):
    """Pe, Pa, Pb, Pc, Pd, Ps: relief up, clearance plane, across, relief above the next start, and in at E."""
    r = request(files["waves"], "ball", relief=1.5, clearance=6.0, stock_top=-12.0)
    moves = list(surface_plan(r).moves)
    ends = [k for k, move in enumerate(moves) if isinstance(move, Line) and move.x is None and move.z > moves[k - 1].z]
    assert len(ends) == surface_plan(r).cuts - 1
    for k in ends:
        pe, pa, pb, pc, pd, ps = moves[k - 1 : k + 5]
        assert pa.z == pytest.approx(pe.z + 1.5) and pa.feed == 600
        assert pb == Rapid(z=6.0) and (pc.z, pc.x is None) == (None, False)
        assert isinstance(pd, Rapid) and ps == Line(z=ps.z, feed=200.0)
        assert pd.z >= ps.z + 1.5 - 1e-9
        first = moves[k + 5]
        assert math.hypot(first.x - pc.x, first.y - pc.y) < 2.0


def test_links_over_finished_stock_come_down_to_the_relief(files):
    """Below its top nothing is known to be: with a stock that ends below the model Pd is the relief above Ps."""
    r = request(files["step"], "flat", relief=0.7, clearance=9.0, stock_top=-5.0, link=0)
    moves = surface_plan(r).moves
    plunges = [
        (before.z, move.z)
        for before, move in zip(moves, moves[1:])
        if isinstance(before, Rapid) and isinstance(move, Line)
    ]
    assert plunges and all(a - b == pytest.approx(0.7) for a, b in plunges)


def test_lowest_links_are_lower_and_one_way_cuts_keep_their_hand(files):
    for name in ("waves", "step"):
        heights = []
        for link in (0, 1):
            plan = surface_plan(request(files[name], "ball", link=link, clearance=15.0))
            heights.append([max(corner[2] for corner in one.corners) for one in link_judge.links_of(plan.moves, START)])
        over, lowest = map(np.array, heights)
        assert len(lowest) == len(over) > 10 and (over == 15.0).all()
        assert (lowest <= over).all() and lowest.mean() < over.mean() - 5
    for climb in (True, False):
        plan = surface_plan(request(files["waves"], "ball", climb=climb, start=None))
        y = [move.y for move in plan.moves if isinstance(move, Rapid) and move.y is not None]
        assert y == sorted(y, reverse=climb)
        cuts = [
            b.x - a.x
            for a, b in zip(plan.moves, plan.moves[1:])
            if isinstance(a, Line) and isinstance(b, Line) and None not in (a.x, b.x)
        ]
        assert min(cuts) > 0  # along +X, with the stock on the right when climb


def test_allowance_floor_margin(files):
    r = request(files["waves"], "ball", allowance=0.4, bottom=-6.0, margin=3.0)
    plan = surface_plan(r)
    deepest, highest = surface_judge.gouge_and_rest(
        plan.moves, START, surface_cases.triangles_in(r.file), r.tool, -6.0, 25, 2, allowance=0.4
    )
    assert deepest <= GOUGE and highest <= r.tolerance + ORACLE
    x = [move.x for move in plan.moves if move.x is not None]
    assert min(x) == pytest.approx(-3) and max(x) == pytest.approx(28)


def test_holder_raises_the_tool_and_is_named(files):
    r = dataclasses.replace(request(files["step"], "flat"), tool=Shape(6, 0, 0, 30, 3))
    plan = surface_plan(r)
    assert len(plan.notes) == 1 and "the holder keeps the tool up to 1 mm above the surface" in str(
        CycleError(plan.notes[0].text, **plan.notes[0].lengths)
    )
    assert min(move.z for move in plan.moves if isinstance(move, Line)) == pytest.approx(
        1.0, abs=1e-3
    )  # the holder is over the step everywhere


def test_long_zigzag_has_places_to_rest(files, monkeypatch):
    from chipwise.cycles import surface_moves
    from chipwise.gcode_lines import chunks

    monkeypatch.setattr(surface_moves, "REST_MOVES", 100)
    plan = surface_plan(dataclasses.replace(request(files["waves"], "ball", link=2), most_moves=499_999))
    lifts = [
        k
        for k, move in enumerate(plan.moves)
        if isinstance(move, Line) and move.x is None and move.z > (plan.moves[k - 1].z or 0)
    ]
    assert len(lifts) > 3 and chunks(plan.moves, START, 1.0)


def test_direction_is_that_of_the_cuts(files):
    plan = surface_plan(request(files["waves"], "flat", direction=30.0, stock_top=-12.0))
    for a, b in zip(plan.moves, plan.moves[1:]):
        if (
            isinstance(a, Line)
            and isinstance(b, Line)
            and None not in (a.x, b.x)
            and math.hypot(b.x - a.x, b.y - a.y) > 0.1
        ):
            assert math.degrees(math.atan2(b.y - a.y, b.x - a.x)) == pytest.approx(30, abs=1e-6)


@pytest.mark.parametrize(
    "fields, text",
    [
        (dict(step=0.0), "step-over D0 mm is not above 0"),
        (dict(step=7.0), "is larger than the tool"),
        (dict(allowance=-1.0), "allowance I-1 mm"),
        (dict(relief=-1.0), "tool relief K-1 mm is negative"),
        (dict(link=3), "link P3 is not known"),
        (dict(tolerance=0.0), "tolerance 0 mm"),
        (dict(clearance=-3.0), "clearance plane R-3 mm is below the top of the model"),
        (dict(clearance=3.0, stock_top=4.0), "below the top of the stock (4 mm)"),
        (dict(bottom=9.0, clearance=5.0), "is not below the clearance plane"),
        (dict(feed=0.0), "no feed"),
        (dict(direction=0.5), "not a whole number of degrees"),
        (dict(tool=Shape(0.01), step=0.001), "more than 20000 cuts"),
        (dict(most_moves=300), "moves, more than 300"),
        (dict(file="/nowhere/x.stl"), "x.stl: No such file"),
    ],
)
def test_refused(files, fields, text):
    with pytest.raises(CycleError) as found:
        surface_plan(dataclasses.replace(request(files["waves"], "ball"), **fields))
    assert text in str(found.value)
