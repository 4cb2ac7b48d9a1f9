# SPDX-License-Identifier: GPL-2.0-or-later
"""The cycle of G77 and G78 without an interpreter: known cases, random contours, refusals, sabotage."""

import dataclasses
import math

import numpy as np
import pytest

from support import contour_cycle_oracle as oracle
from support.contour_cycle_judge import judge, polygon, random_request, request
from support.random_cases import random_count, random_seed, write_replay
from support.contour_oracle import from_elements
from support.hole_oracle import walk

from chipwise.cycles import contour as cycle
from chipwise.cycles.contour import contour_plan, radial_distances
from chipwise.errors import CycleError
from chipwise.geometry.base.contour import ArcElement, ContourError, make_contour
from chipwise.moves import Arc, Line


def done(r):
    """(plan, elements) of a request, judged."""
    plan = contour_plan(r)
    elements = walk(plan.moves, r.start)
    return plan, elements, *judge(r, elements)


# ---- known cases -------------------------------------------------------------------------------------------------


def test_a_rounded_square_from_inside():
    """Arcs stay arcs: at each depth nine elements and two half circles; one plunge place, used at each depth."""
    plan, elements, _slants, plunges = done(request(depth_step=3.0))
    assert plan.notes == ()
    for z in (-2 / 3, -10 / 3, -6.0):
        flat = [e for e in elements if e.kind != "rapid" and e.a[2] == e.b[2] == pytest.approx(z)]
        assert len(flat) == 9 + 2
        assert sum(e.kind == "arc" for e in flat) == 4 + 2
    assert len({p[:2] for p in plunges}) == 1 and len(plunges) == 3
    assert plunges[0][:2] == pytest.approx((20.0, 9.0))  # two tool radii beside the path, at the contour's own start
    assert sum(e.kind == "rapid" for e in elements) == 3  # over it, down to R; up at the end


def test_feeds():
    plan = contour_plan(request(approach=2.0))
    for move in plan.moves:
        if isinstance(move, Line):
            assert move.feed == (
                200.0 if move.x is None else pytest.approx(400.0) if move.z == -6.0 else 600.0
            )  # 30 degrees: 200 / sin 30
        elif isinstance(move, Arc):
            assert move.feed == 600.0


def test_radial_passes_come_from_the_outside_in():
    """Three passes at every depth, the stock side first, each the parallel of the finish shape itself."""
    r = request(side=42, passes=3, step=2.0, allowance=0.5, depth_step=4.0)
    _plan, elements, _slants, _plunges = done(r)
    finish = from_elements(make_contour(list(r.shape)).elements)
    assert radial_distances(r) == [7.5, 5.5, 3.5]
    seen = []
    for e in elements:
        if e.kind == "feed" and e.a[2] == e.b[2] and math.dist(e.a[:2], e.b[:2]) > 12:
            gap = oracle.shape_oracle.nearest(finish, np.array([np.mean([e.a[:2], e.b[:2]], axis=0)]))[0]
            seen.append((round(e.a[2], 3), round(float(gap), 3)))
    order = list(dict.fromkeys(seen))
    assert order == [(-2.0, 7.5), (-2.0, 5.5), (-2.0, 3.5), (-6.0, 7.5), (-6.0, 5.5), (-6.0, 3.5)]


def test_direction_is_the_contours():
    """Left of a counter-clockwise contour: the path runs counter-clockwise."""
    plan = contour_plan(request())
    arcs = [m for m in plan.moves if isinstance(m, Arc)]
    assert all(arc.ccw for arc in arcs)


def test_slanted_approach_and_mirrored_departure():
    """K2 at 30 degrees: PA 2 mm above Pi and 2/tan 30 beside it; the same way out."""
    plan, elements, slants, plunges = done(request(approach=2.0, depth_step=4.0))
    assert [(dz, down) for dz, _angle, _off, down in slants] == [
        (pytest.approx(2.0), True),
        (pytest.approx(2.0), False),
    ] * 2
    assert plan.notes == ()
    first = next(e for e in elements if e.kind == "feed")
    assert first.b == pytest.approx((20.0, 3.0 + 2.0 / math.tan(math.pi / 6), 0.0))  # PA of the pass at Z-2
    assert all(p[2] > 3.0 + 3.4 for p in plunges)


def test_rapid_to_pa_where_pa_is_above_the_clearance_plane():
    _plan, elements, slants, plunges = done(request(approach=10.0, angle=math.radians(60)))
    assert plunges == [] and len(slants) == 2
    rapid = [e for e in elements if e.kind == "rapid"]
    assert rapid[1].b == pytest.approx((20.0, 3.0 + 10.0 / math.tan(math.radians(60)), 4.0))


def test_approach_at_90_degrees_goes_straight_down():
    _plan, elements, slants, _plunges = done(request(approach=2.0, angle=math.pi / 2))
    assert slants == []


@pytest.mark.parametrize("degrees, feed", [(10, 600.0), (30, 200.0 / 0.5), (45, 200.0 / math.sqrt(0.5)), (90, 200.0)])
def test_the_approach_is_not_faster_down_than_the_plunge_feed(degrees, feed):
    plan = contour_plan(request(approach=2.0, angle=math.radians(degrees), feed=600.0, plunge_feed=200.0))
    down = next(m for m in plan.moves if isinstance(m, Line) and m.z == -6.0)
    assert down.feed == pytest.approx(feed)


def test_no_room_for_the_slant_is_told():
    """A slot hardly wider than the tool: no way across."""
    slot = polygon((0.0, 0.0), (13.0, 0.0), (13.0, 7.0), (0.0, 7.0))
    plan = contour_plan(request(slot, approach=5.0))
    assert [text for text, _ in plan.notes if "slanted approach" in text]
    judge(dataclasses.replace(request(slot), approach=None), walk(plan.moves, (0.0, 0.0, 20.0)))


def test_start_at_an_inside_corner_moves_to_where_there_is_room():
    _plan, _elements, _slants, plunges = done(request(polygon((0.0, 0.0), (50.0, 0.0), (50.0, 40.0), (0.0, 40.0))))
    assert len(plunges) == 1 and plunges[0][2] >= 9.0 - 1e-6


def test_open_contour():
    shape = polygon((0.0, 0.0), (30.0, 0.0), (40.0, 10.0), closed=False)
    _plan, elements, _slants, plunges = done(request(shape, depth_step=4.0))
    assert len(plunges) == 2
    assert all(p[:2] == pytest.approx((0.0, 9.0)) for p in plunges)


def test_a_neck_parts_the_path():
    """Two chambers joined by a neck of 4 mm: the tool of 6 mm cuts each in turn, up and across between them."""
    shape = polygon(
        (0.0, 0.0),
        (30.0, 0.0),
        (30.0, 13.0),
        (50.0, 13.0),
        (50.0, 0.0),
        (80.0, 0.0),
        (80.0, 30.0),
        (50.0, 30.0),
        (50.0, 17.0),
        (30.0, 17.0),
        (30.0, 30.0),
        (0.0, 30.0),
    )
    plan, elements, _slants, plunges = done(request(shape, finish=True, depth_step=4.0))
    assert len({p[:2] for p in plunges}) == 2 and len(plunges) == 4
    (neck, lengths), (corners, sizes) = plan.notes
    assert "does not fit in one place (line 3, 9; {area} stays uncut)" in neck and lengths["d"] == 6.0
    assert lengths["area"] == pytest.approx(20.0 * 4.0, abs=12.0)
    assert corners == "8 inside corners keep the tool's radius of {r} (line 1, 2, 4, 5, 6, 7, 8, 10, ..)"
    assert sizes == {"r": 3.0}


def test_roughing_says_nothing_of_what_it_leaves():
    sharp = polygon((0.0, 0.0), (50.0, 0.0), (50.0, 40.0), (0.0, 40.0))
    assert contour_plan(request(sharp)).notes == ()
    assert contour_plan(request(sharp, finish=True)).notes != ()


def test_spot():
    """A hole that fits the tool exactly: straight down in its middle."""
    circle = (ArcElement((3.0, 0.0), (3.0, 0.0), (0.0, 0.0), True, 1),)
    plan = contour_plan(request(circle))
    elements = walk(plan.moves, (0.0, 0.0, 20.0))
    assert [e.b for e in elements if e.kind == "feed"] == [pytest.approx((0.0, 0.0, -6.0))]


@pytest.mark.parametrize("late", [(0.0, 0.0), (0.0, 1e-9), (1e-9, 0.0), (-1e-9, 1e-9)])
def test_rounding_does_not_choose_the_entry(late):
    """Four sides are equally long but for what a change of units does to a corner: entered in the middle of the
    first."""
    corners = [(0.0, 0.0), (40.0, 0.0), (40.0, 40.0), (0.0, 40.0)]
    for corner in range(4):
        moved = [(x + late[0], y + late[1]) if k == corner else (x, y) for k, (x, y) in enumerate(corners)]
        elements = walk(contour_plan(request(polygon(*moved), finish=True)).moves, (0.0, 0.0, 20.0))
        assert next(e.a for e in elements if e.kind == "arc")[:2] == pytest.approx((20.0, 9.0), abs=1e-6)


def test_full_circle_outside():
    circle = (ArcElement((10.0, 0.0), (10.0, 0.0), (0.0, 0.0), True, 1),)
    _plan, elements, _slants, _plunges = done(request(circle, side=42))
    assert sum(e.kind == "arc" for e in elements) <= 4


def test_slug_is_chopped_first_and_left_through_an_open_kerf():
    plan, elements, _slants, _plunges = done(request(finish=True, chop_size=8.0))
    assert plan.chop.chopped and plan.chop.largest_piece < 8.0
    arcs = [k for k, e in enumerate(elements) if e.kind == "arc"]
    lead = elements[arcs[0]]
    assert lead.a[:2] == pytest.approx(lead.b[:2])  # the lead circle as a whole
    assert not any(e.kind == "feed" and math.dist(e.a[:2], e.b[:2]) > 30 for e in elements[arcs[0] :])
    assert not contour_plan(request(finish=True)).chop.chopped
    assert not contour_plan(request(finish=True, side=42, chop_size=8.0)).chop.chops
    assert not contour_plan(request(finish=False, chop_size=8.0)).chop.chops


# ---- refused -------------------------------------------------------------------------------------------------------

REFUSED = [
    (dict(side=40), "side P40 is neither 41 nor 42; use P41 (tool left of the contour) or P42 (right)"),
    (dict(tool_radius=0.0), "tool diameter 0 mm is not above 0 mm"),
    (dict(allowance=-0.1), "allowance I-0.1 mm is negative"),
    (dict(bottom=2.0), "final depth Z2 mm is not below the clearance plane R2 mm"),
    (dict(feed=0.0), "no feed is set"),
    (dict(plunge_feed=-1.0), "plunge feed E-1 mm/min is not above 0"),
    (dict(depth_step=0.0), "depth per pass J0 mm is not above 0"),
    (dict(depth_step=0.001), "depth per pass J0.001 mm needs more than 1000 passes"),
    (dict(passes=0), "L0 radial passes are not from 1 to 200"),
    (dict(passes=2000), "L2000 radial passes are not from 1 to 200"),
    (dict(passes=2), "L2 radial passes without a step D; add D of at most 6 mm"),
    (
        dict(passes=2, step=7.0),
        "radial step D7 mm is larger than the tool (6 mm) and would leave ridges; use D up to 6 mm",
    ),
    (dict(step=-1.0), "radial step D-1 mm is not above 0"),
    (dict(approach=0.0), "approach height K0 mm is not above 0"),
    (dict(angle=0.0), "approach angle 0 is not above 0 and up to 90 degrees"),
    (dict(tool_radius=25.0), "the tool (50 mm) fits nowhere on this side of the contour"),
    (dict(tool_radius=19.0, allowance=5.0), "use a smaller tool, or less allowance, or the other side"),
]


@pytest.mark.parametrize("changes, message", REFUSED, ids=[m[:30] for _, m in REFUSED])
def test_refused(changes, message):
    with pytest.raises(CycleError) as caught:
        contour_plan(request(**changes))
    assert message in str(caught.value)


def test_a_contour_that_crosses_itself_names_both_lines():
    with pytest.raises(ContourError) as caught:
        contour_plan(request(polygon((0.0, 0.0), (10.0, 10.0), (10.0, 0.0), (0.0, 10.0))))
    assert caught.value.lines == (1, 3)


# ---- random --------------------------------------------------------------------------------------------------------


def test_random_contours():
    """Every promise, on random contours; at most a few fit no tool, and most of the rest come in as asked."""
    count, refused, told = random_count(25), 0, 0
    for seed in range(random_seed(), random_seed() + count):
        r = random_request(seed)
        try:
            plan = contour_plan(r)
        except CycleError as error:
            assert "fits nowhere" in str(error)
            refused += 1
            continue
        told += any("no clearance" in text for text, _ in plan.notes)
        try:
            _slants, plunges = judge(r, walk(plan.moves, r.start))
            if r.finish and not any("finished wall" in text for text, _ in plan.notes):
                assert all(gap > r.tool_radius + r.allowance + 0.01 * r.tool_radius for *_, gap in plunges)
        except AssertionError as error:
            path = write_replay(f"contour_cycle_{seed}", repr(r))
            raise AssertionError(f"CHIPWISE_SEED={seed} CHIPWISE_RANDOM_COUNT=1: {error}; {path}") from error
    assert refused < count / 3
    assert told < count / 2


# ---- the oracle must be able to fail ---------------------------------------------------------------------------------


def test_oracle_sees_a_gouge():
    r = request()
    elements = walk(contour_plan(r).moves, r.start)
    assert judge(r, elements)
    bad = [dataclasses.replace(e, a=(e.a[0] + 0.002, *e.a[1:]), b=(e.b[0] + 0.002, *e.b[1:])) for e in elements]
    with pytest.raises(AssertionError):
        judge(r, bad)


def test_oracle_sees_a_path_left_out():
    r = request(depth_step=3.0)
    elements = walk(contour_plan(r).moves, r.start)
    for number, e in enumerate(elements):
        if e.kind != "rapid" and e.a[2] == e.b[2] and math.dist(e.a[:2], e.b[:2]) > 25:
            with pytest.raises(AssertionError):
                judge(r, elements[:number] + elements[number + 1 :])


def test_oracle_sees_a_low_rapid_and_a_wrong_slant():
    r = request(approach=3.0)
    elements = walk(contour_plan(r).moves, r.start)
    for change in (
        lambda e: dataclasses.replace(e, kind="rapid") if e.kind == "feed" else e,
        lambda e: dataclasses.replace(e, a=(e.a[0] + 0.3, *e.a[1:])) if e.a[2] > e.b[2] else e,
    ):
        with pytest.raises(AssertionError):
            judge(r, [change(e) for e in elements])


def test_approaches_are_judged_against_the_whole_contour(monkeypatch):
    """Without that judgement the oracle finds gouges: it is needed, and the oracle sees it."""

    def everywhere(self, point, *rest):
        return np.ones(len(point), bool)

    monkeypatch.setattr(cycle.LeadInClearance, "for_lead", everywhere)
    monkeypatch.setattr(cycle.LeadInClearance, "for_slant", everywhere)
    monkeypatch.setattr(cycle.LeadInClearance, "for_free_slant", everywhere)
    contour_plan.cache_clear()
    bad = 0
    for seed in range(random_seed(), random_seed() + 15):
        r = random_request(seed)
        try:
            judge(r, walk(contour_plan(r).moves, r.start))
        except CycleError:
            continue
        except AssertionError:
            bad += 1
    contour_plan.cache_clear()
    assert bad > 1
