# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 of drawings as they come: loops in any order and depth, drawn twice, joined, with spikes.  By an exact judge of
areas."""

import math
from dataclasses import replace

import pytest
from shapely.geometry import Point, Polygon
from shapely.ops import unary_union

from chipwise.cycles import pocket as cycle
from chipwise.errors import CycleError
from chipwise.geometry.base.contour import ArcElement, ContourError, LineElement, make_contour
from chipwise.geometry.base.loops import split
from chipwise.geometry.pocket.strategies import NAMES
from chipwise.moves import Arc, Line
from support.nesting_random import GAP, GOUGE_MM, REST_MM, SHARE, cut_pieces, drawing, judge, judge_drawing
from support.pocket_random import circle, rectangle
from support.pocket_requests import BOX, request
from support.random_cases import random_count, random_seed, write_replay

CORNERS = [(0, 0), (60, 0), (60, 40), (0, 40), (0, 0)]
ISLAND = [(20, 10), (30, 10), (30, 20), (20, 20), (20, 10)]


def chain(*points):
    """Lines from point to point, with numbers from 1."""
    return tuple(LineElement(a, b, k) for k, (a, b) in enumerate(zip(points, points[1:]), 1))


def region(*loops):
    """Even-odd region of polygons."""
    found = Polygon()
    for loop in loops:
        found = found.symmetric_difference(Polygon(loop))
    return found


def notes(asked):
    return texts(cycle.pocket_plan(asked))


def texts(plan):
    """Of all notes but the one on the full width."""
    return [note.text for note in plan.notes if "full width" not in note.text]


@pytest.mark.parametrize("strategy", sorted(set(NAMES) & {0, 1, 2, 3}))
def test_random_nestings(strategy):
    """What is drawn is cut, within 0.1 % of its area, and nothing else."""
    first = random_seed()
    for seed in range(first, first + random_count(3)):
        chains = drawing(seed)[0]
        asked = request(
            chains, tool_radius=0.4, step=0.5, bottom=-1.0, strategy=strategy, direction=20.0, close_gap=GAP
        )
        found = judge_drawing(cycle.pocket_plan(asked).moves, asked, seed)
        if not found.right:
            write_replay(f"nesting_{seed}_P{strategy}", {"seed": seed, "strategy": strategy, "found": found})
        assert found.right, (seed, found)


def test_a_neck_where_chords_move_a_crossing():
    """Two arcs leave a neck 0.02 mm narrower than the tool, and what the tool's centre reaches ends where their offsets
    cross at six degrees: chords of 0.0001 mm move that place by 0.0014 mm.  Judged again with finer ones, nothing is
    left; what a shorter path leaves is found by them, too."""
    chains, meant, _ = drawing(7293)
    asked = request(chains, tool_radius=0.4, step=0.5, bottom=-1.0, direction=20.0, close_gap=GAP)
    moves = cycle.pocket_plan(asked).moves
    assert judge(moves, asked, meant).rest > REST_MM
    assert judge_drawing(moves, asked, 7293).right
    assert not judge_drawing(moves[:-8], asked, 7293).right


def test_the_judge_sees_a_pocket_left_out_and_a_wall_cut():
    two = region(CORNERS, [(x + 100, y) for x, y in CORNERS])
    asked = request((BOX,))
    found = judge(cycle.pocket_plan(asked).moves, asked, two)
    assert found.left > 0.49 and found.gouge == 0.0 and found.rest == pytest.approx(100.0, abs=0.1)
    small = region([(0, 0), (60, 0), (60, 39.99), (0, 39.99)])
    assert judge(cycle.pocket_plan(asked).moves, asked, small).gouge == pytest.approx(0.01, abs=1e-3)


def test_the_judge_looks_at_the_whole_area():
    """An island that is cut away as a whole: what is cut beyond the pocket has its outline on that of the pocket.  And
    a rib 0.02 mm wide that is left: 0.03 % of the area."""
    asked, pin = request((BOX,)), [(29.5, 19.5), (30.5, 19.5), (30.5, 20.5), (29.5, 20.5)]
    found = judge(cycle.pocket_plan(asked).moves, asked, region(CORNERS, pin))
    assert found.gouge == pytest.approx(0.5, abs=1e-3) and found.beyond < SHARE
    moves = [
        Line(x=10.0, y=10.0, z=-4.0, feed=600.0),
        Line(x=50.0, y=10.0, z=-4.0, feed=600.0),
        Line(x=50.0, y=16.02, z=-4.0, feed=600.0),
        Line(x=10.0, y=16.02, z=-4.0, feed=600.0),
    ]
    whole = Polygon([(10, 7), (50, 7), (50, 19.02), (10, 19.02)])
    found = judge(moves, replace(asked, start=(10.0, 10.0, -4.0)), whole)
    assert found.rest == pytest.approx(0.01, abs=2e-3) and found.left < 3 * SHARE


def test_the_judge_has_no_hole_in_a_small_circle():
    """A region 0.12 mm wide: the tool goes round on a circle of 0.06 mm."""
    moves = [Arc(x=10.06, y=10.0, cx=10.0, cy=10.0, ccw=True, feed=600.0)]
    assert unary_union(cut_pieces(moves, (10.06, 10.0, -1.0), 1.5, -1.0)).area == pytest.approx(
        math.pi * 1.56**2, rel=SHARE
    )


@pytest.mark.parametrize("strategy", sorted(set(NAMES) & {0, 1, 2, 3}))
def test_a_second_pocket_and_a_pocket_in_an_island_are_cut(strategy):
    """Both were dropped without a word."""
    second = [(x + 100, y) for x, y in CORNERS]
    low, high = [(8, 8), (52, 8), (52, 32), (8, 32)], [(15, 12), (45, 12), (45, 28), (15, 28)]
    loops = (rectangle(15, 12, 45, 28), rectangle(100, 0, 160, 40), rectangle(8, 8, 52, 32), BOX)
    asked = request(loops, strategy=strategy)
    assert cycle.pocket_plan(asked).regions == 3
    left, beyond, gouge, _ = judge(cycle.pocket_plan(asked).moves, asked, region(CORNERS, second, low, high))
    assert max(left, beyond) < SHARE and gouge < 1e-3


def test_an_island_before_its_boundary():
    islands = (rectangle(10, 10, 25, 20), circle(6, (45, 20)))
    after, before = (cycle.pocket_plan(request(loops)) for loops in ((BOX, *islands), (*islands, BOX)))
    assert after.moves == before.moves and texts(before) == []


def test_doubled_loops_count_once():
    other_way = tuple(replace(part, start=part.end, end=part.start, line=9) for part in reversed(BOX[2:] + BOX[:2]))
    once = cycle.pocket_plan(request((BOX,)))
    for loops in ((BOX, BOX), (BOX, other_way), (BOX + BOX,)):
        again = cycle.pocket_plan(request(loops))
        assert again.moves == once.moves
        assert [text.partition(" repeats ")[2] for text in texts(again)] == ["the one of line 1 and counts once"]
    a, b = (circle(20, (0, 0), ccw) for ccw in (True, False))
    assert "repeats" in notes(request((a, b)))[0] and "(and 1 more)" in notes(request((a, b, a)))[0]


@pytest.mark.parametrize(
    "points, words",
    [
        ((*CORNERS, *ISLAND), "line 5 leads from one loop to another with G1 and is not a wall"),
        ((*CORNERS, *ISLAND, (0, 0)), "line 5 leads from one loop to another with G1 and is not a wall (and 1 more)"),
        (
            ((0, 0), (60, 0), (60, 40), *ISLAND, (60, 40), (0, 40), (0, 0)),
            "line 3 leads from one loop to another with G1 and is not a wall (and 1 more)",
        ),
    ],
)
def test_loops_joined_by_g1(points, words):
    asked = request((chain(*points),))
    assert notes(asked) == [words]
    left, beyond, gouge, _ = judge(cycle.pocket_plan(asked).moves, asked, region(CORNERS, ISLAND))
    assert max(left, beyond) < SHARE and gouge < 1e-3


def test_a_spike_where_a_loop_closes():
    """The loop is closed at the tip already, so the way back from it is left, which does not count as a link."""
    spiked = (*CORNERS[:-1], (0, -0.008), (0, 0))
    asked = request((chain(*spiked, *ISLAND),), close_gap=GAP)
    assert notes(asked)[-1] == "line 6 leads from one loop to another with G1 and is not a wall"
    found = judge(cycle.pocket_plan(asked).moves, asked, region(CORNERS, ISLAND))
    assert max(found.left, found.beyond) < SHARE and found.gouge < GOUGE_MM
    assert notes(request((chain(*spiked),), close_gap=GAP)) == []


def test_loops_that_start_in_one_point():
    inner = [(0, 0), (20, 3), (20, 20), (3, 20), (0, 0)]
    for loops in ((chain(*CORNERS, *inner[1:]),), (chain(*CORNERS), chain(*inner)), (chain(*inner), chain(*CORNERS))):
        asked = request(loops)
        left, beyond, gouge, _ = judge(cycle.pocket_plan(asked).moves, asked, region(CORNERS, inner))
        assert max(left, beyond) < SHARE and gouge < 1e-3 and not any("line" in note for note in notes(asked))


def test_an_island_across_the_wall():
    """As the bar in nc_files/pocket.ngc: drawn after the boundary, it is an island without a word."""
    asked = request((BOX, rectangle(50, 30, 80, 60)))
    assert not [note for note in notes(asked) if "line" in note]
    left, beyond, *_ = judge(
        cycle.pocket_plan(asked).moves,
        asked,
        Polygon(CORNERS).difference(Polygon([(50, 30), (80, 30), (80, 60), (50, 60)])),
    )
    assert max(left, beyond) < SHARE


@pytest.mark.parametrize("strategy", sorted(NAMES))
def test_an_island_whose_tip_alone_is_across_the_wall(strategy):
    """0.05 mm of a bar of 30 x 30 mm: along its outline that is less than a gap's width, at its tip it is more."""
    tip = [(59.95, 20), (90, 5), (90, 35)]
    asked = replace(request((BOX, chain(*tip, tip[0]))), strategy=strategy)
    shape = Polygon(CORNERS).difference(Polygon(tip))
    left, beyond, gouge, *_ = judge(cycle.pocket_plan(asked).moves, asked, shape)
    assert max(left, beyond) < SHARE and gouge < 1e-3


def test_pockets_that_touch_are_two():
    """Side by side, 0.001 mm into one another."""
    beside = [(59.999, 0), (99.999, 0), (99.999, 40), (59.999, 40)]
    asked = request((BOX, chain(*beside, beside[0])))
    assert cycle.pocket_plan(asked).regions == 2


@pytest.mark.parametrize(
    "points",
    [
        [(0, 0), (60, 0), (60.009, 0), (60, 0), (60, 40), (0, 40), (0, 0)],
        [(0, 0), (60.009, 0), (60, 0), (60, 40), (0, 40), (0, 0)],
        [(0, 0), (60, 0), (60, 40), (0, 40), (0, -0.009), (0, 0)],
        [(0, 0), (30, 0), (30, 0.009), (30.001, 0), (60, 0), (60, 40), (0, 40), (0, 0)],
    ],
)
def test_spikes_are_dropped_as_gaps_are(points):
    contour = make_contour(chain(*points), GAP)
    assert contour.closed and contour.length.sum() == pytest.approx(200.0, abs=0.02)
    asked = request((chain(*points),), close_gap=GAP)
    assert max(judge(cycle.pocket_plan(asked).moves, asked, Polygon(CORNERS))[:2]) < SHARE


def test_a_spike_after_an_arc():
    arc = ArcElement((20.0, 0.0), (-20.0, 0.0), (0.0, 0.0), True, 1)
    parts = (
        arc,
        LineElement((-20.0, 0.0), (-20.0, -0.008), 2),
        LineElement((-20.0, -0.008), (-20.0, 0.0), 3),
        LineElement((-20.0, 0.0), (20.0, 0.0), 4),
    )
    assert list(make_contour(parts, GAP).line) == [1, 4]


def test_a_longer_spike_is_named():
    with pytest.raises(ContourError) as error:
        make_contour(chain((0, 0), (60.5, 0), (60, 0), (60, 40), (0, 40), (0, 0)), GAP)
    assert (
        str(error.value)
        == "the contour crosses or touches itself: line 1 meets line 2 at X60 mm Y0 mm; draw them apart"
    )


@pytest.mark.parametrize(
    "points, lines",
    [
        (((0, 0), (60, 0), (0, 0)), "1 to 2"),
        (((0, 0), (60, 0), (20, 0), (0, 0)), "1 to 3"),
        (((0, 0), (60, 0), (60, 40), (60, 0), (0, 0)), "2 to 3"),
    ],
)
def test_there_and_back_has_no_inside(points, lines):
    for loops in ((chain(*points),), (BOX, chain(*points))):
        with pytest.raises(ContourError) as error:
            cycle.pocket_plan(request(loops))
        assert (
            str(error.value)
            == f"the loop of lines {lines} runs there and back on itself and has no inside; draw its outline"
        )


@pytest.mark.parametrize("chord", [1e-4, 1e-3, 2e-3])
@pytest.mark.parametrize("ccw", [True, False])
def test_a_circle_of_nearly_a_turn_and_a_short_arc(chord, ccw):
    """As posts write a circle: the short arc goes on, it does not lead back."""
    angle = (-1.0 if ccw else 1.0) * chord / 12.0
    ends = (12.0, 0.0), (12.0 * math.cos(angle), 12.0 * math.sin(angle))
    circle = tuple(ArcElement(*pair, (0.0, 0.0), ccw, k) for k, pair in enumerate((ends, ends[::-1]), 1))
    for loops in ((circle,), (circle[::-1],)):
        asked = request(loops, close_gap=GAP)
        assert max(judge(cycle.pocket_plan(asked).moves, asked, Point(0, 0).buffer(12.0, 256))[:2]) < SHARE


def test_a_line_beside_a_loop_is_named():
    """A lead-in or lead-out drawn with G1."""
    for points, line in (((-5, -5), *CORNERS), 1), ((*CORNERS, (-5, -5)), 5):
        with pytest.raises(ContourError) as error:
            cycle.pocket_plan(request((chain(*points),)))
        assert (
            str(error.value)
            == f"line {line} leads to a closed loop or away from it and is not a part of it; use G0 between loops"
        )


def test_a_fine_curve_is_one_loop():
    """Elements shorter than the gap that may be closed make no loops of their own."""
    parts = chain(*CORNERS[:3], *((60 - 0.004 * k, 40.0) for k in range(1, 200)), *CORNERS[3:])
    assert split(parts, GAP) == ((parts,), ())


def test_nowhere_is_still_refused():
    with pytest.raises(CycleError, match="fits nowhere in the pocket"):
        cycle.pocket_plan(request((rectangle(0, 0, 3, 3), rectangle(10, 0, 13, 3))))
