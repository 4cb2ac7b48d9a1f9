# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 as a pure cycle: random pockets against the oracle, regions, rings, order, refusals."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest

from support import pocket_oracle as oracle
from chipwise.cycles import pocket as cycle
from chipwise.errors import CycleError
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import ArcElement, ContourError, LineElement, make_contour
from chipwise.geometry.offset.kernel import make_pocket, pocket_ring
from chipwise.geometry.pocket import machinable, rest_material
from chipwise.geometry.pocket.strategies import NAMES, STRATEGIES
from chipwise.geometry.pocket.tracks import MachinableRegion, make_track
from chipwise.moves import Arc, Line
from support.reference_stock import ReferenceStock, ReferenceTool
from support.pocket_requests import BOX, request, walked, faults
from support.random_cases import random_count, random_seed, write_replay
from support.pocket_judge import case_of, random_request, verdict
from support.pocket_random import circle, rectangle


# ---- random pockets ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("strategy", sorted(NAMES))
def test_random_pockets(strategy):
    """No gouge, no residue, no rapid through stock, every wall run, no steep entry; some of them full of islands that
    touch, cross and overlap."""
    first = random_seed()
    for seed in range(first, first + random_count(5)):
        found, _ = verdict(random_request(seed, strategy), seed)
        if found:
            write_replay(f"pocket_{seed}_P{strategy}", {"seed": seed, "strategy": strategy, "faults": found})
        assert found == [], f"tools/judge pocket {seed} {strategy}"


@pytest.mark.parametrize("strategy", sorted(NAMES))
def test_the_reference_stock_agrees(strategy):
    """Needles cut by every move, rapids too: none stands above the floor where the tool reaches; no wall is touched."""
    loops = (rectangle(0, 0, 18, 14), circle(2, (7, 7)))
    asked = request(loops, tool_radius=1.5, step=2.4, bottom=-1.0, clearance=0.2, ramp_angle=20.0, strategy=strategy)
    stock, tool = ReferenceStock((-2, -2, -2), (20, 16, 0.2), 0.15), ReferenceTool(3.0)
    for e in walked(asked):
        stock.path(tool, oracle.on_path(e, 0.15))
    x, y = np.meshgrid(np.arange(stock.z.shape[1]), np.arange(stock.z.shape[0]))
    p = np.stack((stock.x[y, x].ravel(), stock.y[y, x].ravel()), axis=1)
    z = stock.z.ravel()
    loops = case_of(asked).loops
    inside = oracle.free(loops, p)
    assert z[~inside & (oracle.clearance(loops, p) > 1e-3)].min() == 0.2  # walls and island whole
    corner = np.minimum(p, (18, 14) - p).max(axis=1) < 1.5  # what a round tool leaves
    assert np.abs(z[inside & ~corner] + 1.0).max() < 1e-9


# ---- regions -----------------------------------------------------------------------------------------------------


def area_at(loops, distance):
    contours = [make_contour(parts) for parts in loops]
    return sum(f.area for f in machinable.split(contours[0], contours[1:], distance))


def test_islands_that_meet_are_one():
    """Against the same shape drawn as one contour."""
    whole = area_at((BOX, rectangle(20, 10, 40, 30)), 3.0)
    assert area_at((BOX, rectangle(20, 10, 30, 30), rectangle(30, 10, 40, 30)), 3.0) == pytest.approx(whole, abs=1e-6)
    assert area_at((BOX, rectangle(20, 10, 32, 30), rectangle(25, 10, 40, 30)), 3.0) == pytest.approx(whole, abs=1e-6)
    assert area_at((BOX, rectangle(20, 10, 40, 30), rectangle(25, 15, 35, 25)), 3.0) == pytest.approx(whole, abs=1e-6)
    assert area_at((BOX, rectangle(20, 10, 40, 30), rectangle(90, 10, 95, 25)), 3.0) == pytest.approx(whole, abs=1e-6)


@pytest.mark.parametrize("low", [-5.0, 0.0])
def test_an_island_across_the_wall(low):
    """The wall with a bump: same area as one outline, wherever the island ends outside."""
    p = [(0, 0), (20, 0), (20, 15), (30, 15), (30, 0), (60, 0), (60, 40), (0, 40)]
    bump = tuple(LineElement(p[k], p[(k + 1) % 8], k + 1) for k in range(8))
    assert area_at((BOX, rectangle(20, low, 30, 15)), 3.0) == pytest.approx(area_at((bump,), 3.0), abs=1e-6)


@pytest.mark.parametrize("strategy", [1, 2])
@pytest.mark.parametrize("climb", [True, False])
def test_rows_keep_from_a_round_island_wherever_its_circle_begins(strategy, climb):
    """A whole turn has two turning points for the rows, whatever its first angle and their direction."""
    for begin in np.radians(np.arange(0, 360, 72)):
        p = (30.0 + 8.0 * math.cos(begin), 20.0 + 8.0 * math.sin(begin))
        for direction, ccw in ((241.0, False), (15.0, True), (100.0, False)):
            loops = (BOX, (ArcElement(p, p, (30.0, 20.0), ccw, 9),))
            asked = request(loops, strategy=strategy, direction=direction, climb=climb)
            assert oracle.gouge(case_of(asked), walked(asked), 0.5) <= oracle.TOLERANCE, (begin, direction)


def test_random_order_and_direction_of_loops_change_nothing():
    rng = random.Random(random_seed())
    loops = [rectangle(10, 10, 25, 20), circle(6, (25, 18)), circle(4, (50, 36))]
    whole = area_at((BOX, *loops), 2.0)
    for _ in range(5):
        rng.shuffle(loops)
        turned = [
            tuple(replace(q, start=q.end, end=q.start) for q in reversed(parts))
            if isinstance(parts[0], LineElement)
            else parts
            for parts in loops
        ]
        assert area_at((BOX, *turned), 2.0) == pytest.approx(whole, abs=1e-6)


def dumbbell(neck):
    """Two chambers of 30 x 40 and a passage of 10 mm length between them."""
    low, high = 20 - neck / 2, 20 + neck / 2
    p = [
        (0, 0),
        (30, 0),
        (30, low),
        (40, low),
        (40, 0),
        (70, 0),
        (70, 40),
        (40, 40),
        (40, high),
        (30, high),
        (30, 40),
        (0, 40),
    ]
    return tuple(LineElement(p[k], p[(k + 1) % 12], k + 1) for k in range(12))


@pytest.mark.parametrize("neck, count", [(8.0, 1), (6.0, 1), (5.9, 2), (2.0, 2)])
@pytest.mark.parametrize("strategy", sorted(NAMES))
def test_necks_divide_a_pocket(neck, count, strategy):
    asked = request((dumbbell(neck),), strategy=strategy)
    assert cycle.pocket_plan(asked).regions == count
    assert faults(asked) == []


def test_regions_the_tool_cannot_enter_are_named():
    assert cycle.pocket_plan(request((dumbbell(6.0),))).inaccessible == ()
    (passage,) = cycle.pocket_plan(request((dumbbell(5.9),))).inaccessible
    assert 30 < passage.x < 40 and passage.area < 59
    assert cycle.pocket_plan(request()).inaccessible == ()  # the rest in a square corner does not count
    p = [(0, 0), (30, 0), (30, 18), (60, 18), (60, 22), (30, 22), (30, 40), (0, 40)]
    slot = tuple(LineElement(p[k], p[(k + 1) % 8], k + 1) for k in range(8))
    plan = cycle.pocket_plan(request((slot,)))
    (region,) = plan.inaccessible
    assert region.area == pytest.approx(30 * 4, abs=6) and 30 < region.x < 60 and 18 < region.y < 22
    text, lengths = plan.notes[0]
    assert text.startswith("1 region of the pocket cannot be entered by this tool and stays uncut, the largest (")
    assert lengths == {"area": region.area, "x": region.x, "y": region.y}


def test_a_pocket_that_just_fits_the_tool():
    asked = request((rectangle(0, 0, 6, 30),), strategy=0)
    plan = cycle.pocket_plan(asked)
    assert plan.regions == 1 and faults(asked) == []
    tight = request((rectangle(0, 0, 6, 6),))
    plan = cycle.pocket_plan(tight)
    assert plan.plunges == ((3.0, 3.0),) and len(plan.notes) == 1


# ---- contour-parallel --------------------------------------------------------------------------------------------


def test_rings_of_a_rectangle():
    """Closed form: rings k D inside 54 x 34, each 2 (w + h) - 8 k D long, less the corners of those between the wall
    and the last, which are arcs of half the tool radius; one Track, all of it beside the last."""
    (field,) = machinable.split(make_contour(BOX), [], 3.0)
    (track,) = STRATEGIES[0](field, 3.0, 2.4, 0.0, True)
    rings = [2 * (54 + 34) - 8 * 2.4 * k for k in range(8) if 34 - 4.8 * k > 0]
    corners = 4 * (len(rings) - 2) * (2 - math.pi / 2) * 1.5
    links = track.length - (sum(rings) - corners)
    slant = math.hypot(1.0, 4.0) * 2.4
    assert 0 < links <= len(rings) * slant + 2.4
    arcs = track.elements.is_arc
    assert set(track.elements.radius[arcs]) == {1.5}
    assert np.abs(track.elements.sweep[arcs]).sum() == pytest.approx((len(rings) - 2) * 2 * math.pi)


def test_rings_keep_arcs():
    moves = cycle.pocket_plan(request((circle(20, (0, 0)),))).moves
    lines = [m for m in moves if isinstance(m, Line) and m.z is None]
    assert sum(isinstance(m, Arc) for m in moves) > 6 and len(lines) <= 8  # lines only from ring to ring


def test_every_ring_comes_from_the_original():
    """The ring at 9 mm of a circle of 20: exactly 11 mm from the centre, and found without the ones before it."""
    pocket = make_pocket(make_contour(circle(20, (5, 5))), [])
    (path,) = pocket_ring(pocket, 9.0).paths
    assert np.hypot(*(path.elements.start - 5).T) == pytest.approx(11.0, abs=1e-12)
    assert list(pocket.known) == [9.0]


@pytest.mark.parametrize("share", [0.5, 0.7, 0.9, 1.0])
def test_wide_steps_leave_nothing(share):
    """Corners between rings: with their own moves from half the diameter on, and only then."""
    asked = request((rectangle(0, 0, 50, 50), circle(5, (20, 20))), step=6 * share)
    assert faults(asked) == []
    (field,) = machinable.split(*[make_contour(asked.loops[0]), [make_contour(asked.loops[1])]], 3.0)
    tracks = STRATEGIES[0](field, 3.0, min(6 * share, 5.97), 0.0, True)
    assert bool(rest_material.rest_parts(field, tracks, 3.0)) == (share > 0.5)


@pytest.mark.parametrize("climb", [True, False])
@pytest.mark.parametrize("strategy", sorted(NAMES))
def test_the_wall_is_cut_as_the_spindle_turns(strategy, climb):
    """Climb with M3: counter-clockwise along the boundary, clockwise about islands; the other way with M4."""
    loops = (BOX, circle(6, (30, 20)))
    (field,) = machinable.split(*[make_contour(loops[0]), [make_contour(loops[1])]], 3.0)
    tracks = STRATEGIES[strategy](field, 3.0, 2.4, 0.0, climb)
    every = elements.join([t.elements for t in tracks])
    middle = elements.point_at(every, np.arange(len(every)), np.full(len(every), 0.5))
    last = np.flatnonzero((np.abs(middle[:, 1] - 3) < 1e-9) & (every.sweep == 0.0))[-1]
    assert (every.end[last, 0] > every.start[last, 0]) == climb
    about = np.flatnonzero(every.is_arc & (np.abs(every.radius - 9) < 1e-9))[-1]
    assert (every.sweep[about] < 0) == climb


def test_the_same_request_gives_the_same_moves():
    asked = request((BOX, circle(6, (30, 20))))
    first = cycle.pocket_plan(asked)
    assert cycle.pocket_plan(replace(asked)) is first
    cycle.pocket_plan.cache_clear()
    cycle._pockets.cache_clear()
    assert cycle.pocket_plan(asked).moves == first.moves


# ---- refused -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "changes, text",
    [
        (dict(step=7.2), "step-over D7.2 mm is larger than the tool (6 mm); use D up to 6 mm"),
        (dict(step=0.0), "step-over D0 mm is not above 0; use D above 0, up to 6 mm"),
        (dict(step=0.01), "step-over D0.01 mm needs more than 1000 paths side by side; use a larger D"),
        (dict(side_allowance=-1.0), "side allowance I-1 mm is negative; use I of 0 or more"),
        (dict(floor_allowance=-1.0), "floor allowance K-1 mm is negative; use K of 0 or more"),
        (dict(strategy=5), "strategy P5 is not known; use P0, P1, P2, P3 or P4"),
        (
            dict(strategy=4, step=3.1),
            "step-over D3.1 mm is above half the tool diameter (6 mm), which is the most of P4; use D up to 3 mm, or "
            "P0",
        ),
        (
            dict(bottom=1.0),
            "final depth Z1 mm with the floor allowance K0 mm is not below the clearance plane R1 mm; use a deeper Z, "
            "a smaller K or a higher R",
        ),
        (
            dict(floor_allowance=5.0),
            "final depth Z-4 mm with the floor allowance K5 mm is not below the clearance plane R1 mm; use a "
            "deeper Z, a smaller K or a higher R",
        ),
        (dict(feed=0.0), "no feed is set; give F on this line or before"),
        (dict(plunge_feed=0.0), "plunge feed E0 mm/min is not above 0; use E above 0, or leave it out for F/2"),
        (dict(depth_step=0.0), "depth per pass J0 mm is not above 0; use J above 0"),
        (
            dict(depth_step=1e-4),
            "depth per pass J0.0001 mm needs more than 1000 passes from R to Z; use a larger J, or correct Z; without "
            "J it is the flute length",
        ),
        (dict(tool_radius=0.0), "tool diameter 0 mm is not above 0 mm; load a tool with a diameter"),
        (dict(tool_radius=25.0), "the tool (50 mm) fits nowhere in the pocket; use a smaller tool"),
        (
            dict(loops=(BOX, rectangle(-1, -1, 61, 41))),
            "the tool (6 mm) fits nowhere in the pocket; use a smaller tool",
        ),
    ],
)
def test_refused(changes, text):
    loops = changes.pop("loops", (BOX,))
    with pytest.raises(CycleError) as error:
        cycle.pocket_plan(request(loops, **changes))
    assert str(error.value) == "chipwise: " + text


@pytest.mark.parametrize(
    "parts, kind", [(BOX[:3], "not connected"), ((LineElement((0, 0), (1, 0), 1),), "not connected")]
)
def test_an_open_loop_is_no_pocket(parts, kind):
    with pytest.raises(ContourError) as error:
        cycle.pocket_plan(request((parts,)))
    assert error.value.kind == kind


def test_rest_tracks_find_what_a_bad_strategy_leaves():
    """A strategy that runs the walls only: everything else becomes rest material, and they clear it."""
    (field,) = machinable.split(make_contour(BOX), [], 3.0)
    assert isinstance(field, MachinableRegion)
    walls = (make_track(field.boundary),)
    assert sum(part.area for part in rest_material.rest_parts(field, walls, 3.0)) == pytest.approx(48 * 28, rel=1e-3)
    more = rest_material.rest_tracks(field, walls, 3.0)
    assert rest_material.rest_parts(field, walls + more, 3.0) == []


@pytest.mark.parametrize("strategy", sorted(NAMES))
def test_tracks_have_no_gaps(strategy):
    """Every element of a Track starts where the one before ended, and arcs fit both of their ends."""
    for seed in range(6):
        asked = random_request(seed, strategy)
        contours = [make_contour(parts) for parts in asked.loops]
        for field in machinable.split(contours[0], contours[1:], asked.tool_radius):
            for track in cycle.region_tracks(field, asked):
                e = track.elements
                assert np.hypot(*(e.start[1:] - e.end[:-1]).T).max(initial=0.0) < 1e-6
                for p in (e.start, e.end):
                    off = np.hypot(*(p - e.centre).T) - e.radius
                    assert np.abs(off[e.is_arc]).max(initial=0.0) < 1e-6
