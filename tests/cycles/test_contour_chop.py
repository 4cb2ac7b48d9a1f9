# SPDX-License-Identifier: GPL-2.0-or-later
"""geometry/slug/slug.py and cycles/contour_chop.py: random contours before an oracle written apart, known shapes,
order.

CHIPWISE_RANDOM_COUNT and CHIPWISE_SEED; bench/bench_chop.py judges 500 and more.
"""

import math

import numpy as np
import pytest

from support import chop_judge
from support import chop_oracle as oracle
from support import hole_oracle
from chipwise.cycles import contour_chop, hole
from chipwise.geometry.base import polygons
from chipwise.geometry.slug import grid, slug
from chipwise.geometry.base.contour import ArcElement
from support.chop_judge import SQUARE, Chopped, chop_case, outline, verdict
from support.random_cases import random_count
from support.contour_judge import seed_from_environment

ELL = [(0.0, 0.0), (36.0, 0.0), (36.0, 14.0), (14.0, 14.0), (14.0, 40.0), (0.0, 40.0)]


def ring(radius, centre=(0.0, 0.0), line=1):
    start = (centre[0] + radius, centre[1])
    return [ArcElement(start, start, centre, True, line)]


def turned(points, degrees):
    a = math.radians(degrees)
    return [(x * math.cos(a) - y * math.sin(a), x * math.sin(a) + y * math.cos(a)) for x, y in points]


# ---- random contours ---------------------------------------------------------------------------------------------


def test_random_contours():
    first, chopped = seed_from_environment(), 0
    for seed in range(first, first + random_count(18)):
        kind, loops, radius, chop_size = chop_case(seed)
        done = Chopped(loops, radius, chop_size)
        found, _ = verdict(done)
        assert not found, f"tools/judge chop {seed}: {kind}: {found}"
        chopped += done.plan.chopped
    assert chopped > 0


def test_random_contours_while_they_are_cut():
    first = seed_from_environment()
    for seed in range(first, first + max(1, random_count(18) // 4)):
        kind, loops, radius, chop_size = chop_case(seed, small=True)
        found, _ = verdict(Chopped(loops, radius, chop_size, depth_step=(None, 3.0)[seed % 2]), stages=True)
        assert not found, f"tools/judge chop small {seed}: {kind}: {found}"


def largest_meanwhile(seed):
    """(complaints, size of the largest piece ever loose / H) of a case a third as large."""
    _, loops, radius, chop_size = chop_case(seed, small=True)
    found, figures = verdict(Chopped(loops, radius, chop_size), stages=True)
    return found, figures["ever"] / chop_size


def test_a_pass_begun_just_behind_a_line_leaves_a_spur(monkeypatch):
    """Case 2003: 1.009 H before."""
    found, share = largest_meanwhile(2003)
    assert not found and share < 1.0
    monkeypatch.setattr(chop_judge, "from_line_end", lambda path, segments, radius: path)
    assert "loose on the way" in str(largest_meanwhile(2003)[0])


def test_a_piece_does_not_fall_with_the_rim_a_thin_bridge_holds(monkeypatch):
    """Case 2056: 1.003 H before."""
    found, share = largest_meanwhile(2056)
    assert not found and share < 1.0
    monkeypatch.setattr(polygons, "released_with_rim", lambda *args: [])
    monkeypatch.setattr(contour_chop, "_cached_plan", contour_chop._cached_plan.__wrapped__)
    assert "loose on the way" in str(largest_meanwhile(2056)[0])


@pytest.mark.parametrize("seed", range(0, 30, 5))
def test_where_the_pass_begins(seed):
    """A tool diameter and a bridge away from each line but one it lies on, or straight down in the open kerf of a
    line."""
    _, loops, radius, chop_size = chop_case(seed, small=True)
    done = Chopped(loops, radius, chop_size)
    for path in done.paths if len(loops) == 1 and done.plan.chopped else []:
        led_in = path[0][0] == "A" and abs(path[0][7]) > 6.28  # a full circle, then half of it
        place, gaps = path[1][3:5] if led_in else path[0][1:3], []
        for (ax, ay), (bx, by) in done.plan.segments:
            n2 = (bx - ax) ** 2 + (by - ay) ** 2
            t = min(max(((place[0] - ax) * (bx - ax) + (place[1] - ay) * (by - ay)) / n2, 0.0), 1.0)
            far = math.dist(place, (ax + t * (bx - ax), ay + t * (by - ay)))
            gaps.append(far)
        beside = [far for far in gaps if far > 0.0011]
        at_a_line = len(beside) < len(gaps)
        assert min(beside, default=math.inf) > 2 * radius + grid.BRIDGE - 1e-6 or (at_a_line and not led_in)


# ---- known shapes ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [0.0, 17.0, 30.0, 45.0, 80.0])
def test_square_in_any_direction(degrees):
    """Slug 36 mm (tool 2): 4 x 4 parts of 9.5 - 2 = 7.5 mm have a diagonal of 10.607 mm; 3 x 5 one of 13.0."""
    done = Chopped([outline(*turned(SQUARE, degrees))], 1.0, 10.65)
    (chop,) = done.plan.chops
    assert len(chop.segments) == 6 and chop.pieces == 16
    assert chop.largest == pytest.approx(7.5 * math.sqrt(2), abs=0.01)
    assert math.degrees(chop.angle) % 90 == pytest.approx(degrees, abs=0.01)
    assert verdict(done)[0] == []


def test_narrow_slug_takes_one_group():
    """A slot of 9 mm with a 2 mm tool leaves a bar of 5 mm: only lines across, though three along it would clear it."""
    done = Chopped([outline((0.0, 0.0), (80.0, 0.0), (80.0, 9.0), (0.0, 9.0))], 1.0, 12.0)
    (chop,) = done.plan.chops
    assert {tuple(np.round(abs(np.subtract(*segment)), 3)) for segment in chop.segments} == {(0.0, 7.0)}
    # 76 mm of slug, n parts of 78 / n - 2, diagonal with 5 mm below 11.99: n = 7
    assert len(chop.segments) == 6 and verdict(done)[0] == []


def test_lines_end_one_tool_radius_inside():
    done = Chopped([outline(*ELL)], 2.0, 9.0)
    for segment in done.plan.chops[0].segments:
        assert oracle.outside(done.finish, [("L", *segment[0], *segment[1])], 2.0) == pytest.approx(0.0, abs=1e-3)


def test_round_contour_takes_no_more_lines_than_the_hole():
    for diameter, tool, h in ((50, 0.8, 5), (40, 3, 8), (30, 1, 8), (60, 6, 12)):
        done = Chopped([ring(diameter / 2)], tool / 2, h)
        request = hole.HoleRequest(
            x=0,
            y=0,
            bottom=-1,
            clearance=1,
            radius=diameter / 2,
            ccw=True,
            tool_radius=tool / 2,
            feed=1,
            plunge_feed=1,
            start=(0, 0, 1),
            chop_size=h,
        )
        assert len(done.plan.chops[0].segments) <= 2 * (hole.chop_parts(request) - 1)
        assert verdict(done)[0] == []


def test_ring_about_an_island():
    """The slug is a ring of 1.5 mm; the island stays whole and does not count as a slug."""
    done = Chopped([ring(8.0), ring(4.5, line=2)], 0.5, 5.0)
    (chop,) = done.plan.chops
    assert chop.pieces >= 8 and chop.largest < 5.0
    assert verdict(done, stages=True)[0] == []


def test_small_slug_is_left_whole():
    done = Chopped([ring(6.0)], 1.0, 8.1)  # slug of 8 mm
    assert not done.plan.chopped and done.plan.pieces == 1 and done.moves == ()
    assert done.plan.largest_piece == pytest.approx(8.0, abs=0.01)
    assert Chopped([ring(6.0)], 1.0, 8.0).plan.chopped


def test_never_chop():
    done = Chopped([outline(*SQUARE)], 1.0, 0.0)
    assert not done.plan.chopped and done.plan.largest_piece == pytest.approx(36 * math.sqrt(2), abs=0.02)


def test_no_slug():
    assert Chopped([ring(2.0)], 1.0, 1.0).plan.chops == ()
    assert Chopped([ring(1.0)], 1.0, 1.0).plan.chops == ()  # the tool fits once
    bar = outline((0.0, 0.0), (80.0, 0.0), (80.0, 8.0), (0.0, 8.0))
    assert Chopped([bar], 2.0, 12.0).plan.chops == ()  # twice the tool wide: nothing is left between


def test_chop_size_too_small_for_the_tool_clears():
    done = Chopped([outline(*SQUARE)], 3.0, 0.3)
    assert done.plan.too_small and done.plan.cleared and done.plan.pieces == 0 and done.plan.largest_piece == 0.0
    # 28 mm of slug and a tool of 6: lines at most 5.98 apart
    assert len(done.plan.chops[0].segments) == 5
    assert oracle.final_pieces(done.finish, [el for line in done.lines() + done.paths for el in line], 3.0) == []


def dumbbell(neck):
    """Two squares of 16 mm joined by a channel 12 mm long and `neck` wide."""
    h = neck / 2
    return outline(
        (0.0, -8.0),
        (16.0, -8.0),
        (16.0, -h),
        (28.0, -h),
        (28.0, -8.0),
        (44.0, -8.0),
        (44.0, 8.0),
        (28.0, 8.0),
        (28.0, h),
        (16.0, h),
        (16.0, 8.0),
        (0.0, 8.0),
    )


@pytest.mark.parametrize("neck, paths, slugs", [(1.5, 2, 2), (3.0, 1, 2), (4.5, 1, 1)])
def test_necks(neck, paths, slugs):
    """Tool 2 mm: a neck it does not enter, one it clears, one that leaves a bar of 0.5 mm."""
    done = Chopped([dumbbell(neck)], 1.0, 9.0)
    assert len(done.boundaries) == paths and len(done.plan.chops) == slugs
    assert verdict(done)[0] == []


def test_path_that_touches_itself():
    """A channel exactly as wide as the tool: the path runs there and back on itself."""
    done = Chopped([dumbbell(2.0)], 1.0, 9.0)
    assert len(done.plan.chops) == 2 and verdict(done)[0] == []


def test_sense_of_the_contour_does_not_matter():
    forward, backward = (Chopped([outline(*points)], 1.0, 8.0).plan.chops[0] for points in (ELL, ELL[::-1]))
    assert forward.pieces == backward.pieces
    assert np.allclose(np.sort(np.ravel(forward.segments)), np.sort(np.ravel(backward.segments)))


# ---- thin bridges ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bridge, breaks", [(0.09, True), (0.11, False), (1.0, False)])
def test_what_hangs_on_a_thin_bridge_may_break(bridge, breaks):
    """A tongue of 10 x 4 mm in a window of 20 x 10, held by a bridge 1 mm long."""
    frame = polygons.polygon_region([(-3, -3), (23, -3), (23, 13), (-3, 13)], [[(0, 0), (20, 0), (20, 10), (0, 10)]])
    tongue = polygons.polygon_region([(1, 5), (11, 5), (11, 9), (1, 9)])
    bar = polygons.box(-1, 6, 2, 6 + bridge)
    stock = frame.union(tongue).union(bar)
    loose = polygons.badly_held(stock, polygons.box(0, 0, 20, 10), grid.BRIDGE)
    sizes = [hole_oracle.enclosing_diameter(outline) for outline in loose]
    assert bool(sizes) == breaks
    if breaks:  # the tongue with its bridge
        assert max(sizes) == pytest.approx(
            hole_oracle.enclosing_diameter([(0, 6), (0, 6.09), (11, 5), (11, 9)]), abs=0.3
        )


def test_two_bodies_on_a_thin_bridge_count_as_one():
    """Large, because the bridge may hold; not held, because it may break."""
    window = polygons.polygon_region([(-3, -3), (23, -3), (23, 13), (-3, 13)], [[(0, 0), (20, 0), (20, 10), (0, 10)]])
    bodies = polygons.box(1, 4, 7, 6).union(polygons.box(9, 4, 15, 6)).union(polygons.box(6, 5, 10, 5.02))
    loose = polygons.badly_held(window.union(bodies), polygons.box(0, 0, 20, 10), grid.BRIDGE)
    assert max(map(hole_oracle.enclosing_diameter, loose)) == pytest.approx(math.hypot(14, 2), abs=1e-3)


def test_a_grid_that_leaves_a_large_piece_on_a_bridge_is_not_taken(monkeypatch):
    """Without the rule, in case 30 a third as large, every piece fits when all is cut, but one cell, 1.07 mm with H
    1.046, hangs on a bridge of 0.05 mm between the ends of two lines until the contour is cut.  The flood fill sees it
    fall."""
    _, loops, radius, chop_size = chop_case(30, small=True)
    kept = Chopped(loops, radius, chop_size)
    assert verdict(kept, stages=True)[0] == []
    monkeypatch.setattr(grid.Grid, "held", lambda self, parts, groups, size: True)
    monkeypatch.setattr(contour_chop, "_cached_plan", contour_chop._cached_plan.__wrapped__)
    free = Chopped(loops, radius, chop_size)
    assert len(free.plan.chops[0].segments) < len(kept.plan.chops[0].segments)
    assert verdict(free)[0] == []
    assert "loose on the way" in str(verdict(free, stages=True)[0])


def test_no_fins():
    """Strips and cells are as thick as a bridge, or not there."""
    for seed in range(0, 60, 5):
        _, loops, radius, chop_size = chop_case(seed)
        for chop in Chopped(loops, radius, chop_size).plan.chops:
            for group in chop.groups:
                across = np.array(
                    (-math.sin(chop.angle), math.cos(chop.angle))
                    if group is chop.groups[0]
                    else (math.cos(chop.angle), math.sin(chop.angle))
                )
                at = [float(np.dot(line[0][0], across)) for line in group]
                gaps = np.diff(at) - 2 * radius
                assert np.all((gaps >= grid.BRIDGE - 1e-6) | (gaps <= -grid.OVERLAP + 1e-6))


# ---- moves -------------------------------------------------------------------------------------------------------


def test_each_line_to_full_depth_before_the_next():
    done = Chopped([outline(*SQUARE)], 1.0, 10.65, depth_step=3.0)
    depth, plunges = [], 0
    for e in done.line_elements:
        if e.kind == "rapid":
            if depth:
                assert depth == pytest.approx([2 - 8 / 3, 2 - 16 / 3, -6.0])
                plunges += 1
            depth = []
        elif e.a[:2] == e.b[:2]:
            depth.append(e.b[2])
    assert plunges == 6 and done.line_elements[-1].b[2] == done.request.clearance


def test_entry_stays_off_the_wall():
    """A tool radius along the line, so that on a line square to the wall no plunge touches the finished wall."""
    done = Chopped([outline(*SQUARE)], 1.0, 10.65)
    for e in done.elements:
        if e.kind == "feed" and e.a[:2] == e.b[:2]:
            assert oracle.outside(done.finish, [("L", *e.a[:2], *e.b[:2])], 1.0) < -0.9


def test_order_saves_travel():
    done = Chopped([outline(*ELL)], 0.5, 5.0)
    ends = lambda s: s[0], lambda s: s[1]
    ordered = slug.order_chops(done.plan.chops, (0.0, 0.0), (0.0, 0.0), *ends)
    travel = oracle.travel
    plain = done.plan.chops[0].segments
    assert sorted(map(sorted, ordered)) == sorted(map(sorted, plain))
    assert travel(ordered, (0, 0), (0, 0), *ends) < 0.6 * travel(plain, (0, 0), (0, 0), *ends)


def test_plan_is_cached_by_value():
    a, b = Chopped([outline(*ELL)], 1.0, 8.0), Chopped([outline(*ELL)], 1.0, 8.0)
    assert a.plan is b.plan and a.moves == b.moves
