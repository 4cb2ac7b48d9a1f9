# SPDX-License-Identifier: GPL-2.0-or-later
"""Offsets with closed-form answers, and the degenerate shapes the patent lacks."""

import math

import numpy as np
import pytest

from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import ArcElement, make_contour, reverse
from chipwise.geometry.offset.kernel import LEFT, RIGHT, offset_contour
from chipwise.geometry.offset.paths import ClosedPath, OpenPath, PointContact
from chipwise.geometry.offset.inaccessible import InaccessibleRegion, InaccessibleSegment
from support.contour_oracle import from_elements, gouge, inside_material, missing, nearest, worst_gap
from support.contour_shapes import circle, corners, path_length, polygon, rounded_square, run, slot

SQUARE = polygon((0, 0), (20, 0), (20, 20), (0, 20))


def sound(contour, side, radius):
    """The result, after the oracle has found nothing wrong with it."""
    result = offset_contour(contour, side, radius)
    shape = from_elements(contour.elements)
    path = [el for p in result.paths for el in from_elements(p.elements)]
    assert result.loose == 0
    assert gouge(shape, radius, path) < 1e-6
    assert missing(shape, contour.closed, side, radius, path) == []
    for p, rough in zip(result.paths, result.rough):
        assert worst_gap(from_elements(p.elements), p.closed) < 1e-9
        assert worst_gap(from_elements(rough.elements), rough.closed) < 1e-6
        if contour.closed:
            assert inside_material(shape, side, from_elements(rough.elements)) < 1e-6
    return result


def test_square_inside_and_outside():
    (inside,) = sound(SQUARE, LEFT, 3).paths
    assert isinstance(inside, ClosedPath)
    assert corners(inside) == {(3, 3), (17, 3), (17, 17), (3, 17)}
    (outside,) = sound(SQUARE, RIGHT, 3).paths
    assert path_length(outside) == pytest.approx(80 + 2 * math.pi * 3)
    assert outside.elements.is_arc.sum() == 4


def test_square_rough_shape_and_regions():
    result = sound(SQUARE, LEFT, 3)
    # each corner keeps r^2 (1 - pi/4)
    assert [u.area for u in result.inaccessible] == pytest.approx([9 * (1 - math.pi / 4)] * 4)
    assert [u.lines for u in result.inaccessible] == [(1, 2), (2, 3), (3, 4), (1, 4)]
    assert elements.area(result.rough[0].elements) == pytest.approx(400 - 36 + 9 * math.pi)
    assert all(isinstance(u, InaccessibleRegion) for u in result.inaccessible)


def test_rough_shape_offset_again_gives_the_path():
    result = sound(SQUARE, LEFT, 3)
    e, rough = result.paths[0].elements, result.rough[0].elements
    parts = [
        ArcElement(tuple(rough.start[k]), tuple(rough.end[k]), tuple(rough.centre[k]), bool(rough.sweep[k] > 0), k + 1)
        if rough.sweep[k]
        else line(rough.start[k], rough.end[k], k + 1)
        for k in range(len(rough))
    ]
    (again,) = sound(make_contour(parts), LEFT, 3).paths
    assert corners(again) == corners(result.paths[0])
    assert path_length(again) == pytest.approx(float(elements.lengths(e).sum()), abs=1e-6)


def path_length_of(e):
    return float(elements.lengths(e).sum())


def line(a, b, number):
    from chipwise.geometry.base.contour import LineElement

    return LineElement(tuple(a), tuple(b), number)


@pytest.mark.parametrize("start", range(4))
@pytest.mark.parametrize("back", [False, True])
def test_square_from_every_vertex_and_backwards(start, back):
    points = [(0, 0), (20, 0), (20, 20), (0, 20)]
    contour = polygon(*points[start:], *points[:start])
    contour, side = (reverse(contour), RIGHT) if back else (contour, LEFT)
    (path,) = sound(contour, side, 3).paths
    assert corners(path) == {(3, 3), (17, 3), (17, 17), (3, 17)}
    assert (elements.area(path.elements) < 0) == back  # in the contour's direction


@pytest.mark.parametrize(
    "side, ccw, expected", [(LEFT, True, 3), (RIGHT, True, 7), (LEFT, False, 7), (RIGHT, False, 3)]
)
def test_full_circle(side, ccw, expected):
    result = sound(circle(5, ccw=ccw), side, 2)
    (path,) = result.paths
    assert path.elements.radius.tolist() == pytest.approx([expected])
    assert abs(path.elements.sweep[0]) == pytest.approx(2 * math.pi)
    assert (path.elements.sweep[0] > 0) == ccw
    assert result.inaccessible == ()
    assert result.rough[0].elements.radius.tolist() == pytest.approx([5])


def test_circle_too_small_and_just_fitting():
    nothing = offset_contour(circle(5), LEFT, 5.001)
    assert nothing.paths == () and nothing.rough == ()
    (region,) = nothing.inaccessible
    assert region.area == pytest.approx(25 * math.pi) and region.lines == (1,)
    (contact,) = offset_contour(circle(5), LEFT, 5).paths
    assert isinstance(contact, PointContact) and contact.centre == pytest.approx((0, 0))
    assert offset_contour(circle(5), LEFT, 5).inaccessible == ()


def test_square_that_fits_the_tool_exactly():
    result = offset_contour(SQUARE, LEFT, 10)
    (contact,) = result.paths
    assert contact.centre == pytest.approx((10, 10))
    assert [u.area for u in result.inaccessible] == pytest.approx([100 - 25 * math.pi] * 4)
    too_large = offset_contour(SQUARE, LEFT, 10.001)
    assert too_large.paths == () and too_large.inaccessible[0].area == pytest.approx(400)


def test_slot_of_exactly_the_tool_diameter():
    """Slices lie exactly on one another; the path runs there and back, nothing is lost."""
    result = sound(slot(20, 6), LEFT, 3)
    (path,) = result.paths
    assert corners(path) == {(-10, 0), (10, 0)} and path_length(path) == pytest.approx(40)
    assert result.inaccessible == ()
    assert offset_contour(slot(20, 6), LEFT, 3.001).paths == ()
    (wider,) = sound(slot(20, 6), LEFT, 2.999).paths
    assert path_length(wider) == pytest.approx(40 + 2 * math.pi * 0.001)


@pytest.mark.parametrize("radius", [1, 2, 3])
def test_fillet_at_and_about_the_tool_radius(radius):
    result = sound(rounded_square(20, 2), LEFT, radius)
    (path,) = result.paths
    assert path.elements.is_arc.sum() == (4 if radius < 2 else 0)
    if radius <= 2:
        assert result.inaccessible == ()
    else:
        assert [u.lines for u in result.inaccessible] == [(1, 2, 3), (3, 4, 5), (5, 6, 7), (1, 7, 8)]
        assert sum(u.area for u in result.inaccessible) == pytest.approx((9 - 4) * (4 - math.pi))


DUMBBELL = polygon(
    (0, 0), (20, 0), (20, 8), (40, 8), (40, 0), (60, 0), (60, 20), (40, 20), (40, 12), (20, 12), (20, 20), (0, 20)
)


def test_neck_narrower_than_the_tool_splits_the_path():
    result = sound(DUMBBELL, LEFT, 3)
    assert len(result.paths) == len(result.rough) == 2
    neck = [u for u in result.inaccessible if u.lines == (3, 9)]
    assert len(neck) == 1
    # 4 wide, 20 long, less the two caps of the tool at the mouths: chord 4, radius 3
    half = math.asin(2 / 3)
    cap = 9 * (half - math.sin(half) * math.cos(half))
    assert neck[0].area == pytest.approx(80 - 2 * cap)


def test_neck_of_exactly_the_tool_diameter():
    result = sound(DUMBBELL, LEFT, 2)
    (path,) = result.paths
    assert nearest(from_elements(path.elements), np.array([[30.0, 10.0]]))[0] < 1e-9
    assert len(result.inaccessible) == 8


def test_short_neck_entered_from_both_sides():
    """Two tool edges cross within the neck: what is left are two separate slivers."""
    shape = polygon(
        (0, 0), (20, 0), (20, 8), (21, 8), (21, 0), (41, 0), (41, 20), (21, 20), (21, 12), (20, 12), (20, 20), (0, 20)
    )
    result = sound(shape, LEFT, 3)
    assert len(result.paths) == 2
    slivers = [u for u in result.inaccessible if u.lines in ((3,), (9,))]
    assert len(slivers) == 2 and slivers[0].area == pytest.approx(slivers[1].area)


def test_several_reversed_elements_in_a_row():
    """A fine round floor of chords, all smaller than the tool, between two walls."""
    t = np.linspace(math.pi, 2 * math.pi, 13)
    floor = [(4 + 4 * math.cos(a), 4 * math.sin(a)) for a in t]
    shape = polygon((0, 30), *floor, (8, 30), closed=False)
    result = sound(shape, LEFT, 4.5)
    assert result.paths == ()
    wide = polygon((-30, 30), (-20, 0), *floor, (28, 0), (38, 30), closed=False)
    result = sound(wide, LEFT, 6)
    (path,) = result.paths
    (region,) = [u for u in result.inaccessible if len(u.lines) > 6]
    assert isinstance(path, OpenPath) and region.area > 10


def test_loop_reaching_across_the_contour():
    """A finger from the opposite wall comes within the tool radius of this one."""
    shape = polygon((0, 0), (40, 0), (40, 30), (22, 30), (22, 3), (18, 3), (18, 30), (0, 30))
    result = sound(shape, LEFT, 4)
    assert len(result.paths) == 2
    open_wall = run((0, 0), ("L", 40, 0), ("L", 40, 30), ("L", 22, 30), ("L", 22, 3), ("L", 18, 3))
    result = sound(open_wall, LEFT, 4)
    kinds = [type(p) for p in result.paths]  # up to the finger's end, and the far chamber
    assert kinds == [OpenPath, ClosedPath]


def test_spike_inward_and_outward():
    """A needle of 0.2 degrees: rolled about at its tip outside, a slit inside."""
    shape = polygon((0, 0), (40, 0), (40, 20), (20.03, 20), (20, 10), (19.97, 20), (0, 20))
    assert len(sound(shape, LEFT, 2).paths) == 1
    result = sound(shape, RIGHT, 2)
    (path,) = result.paths
    # the tool cannot enter the slit: one region, depth 10, width 0.06 at its mouth
    assert [u.area for u in result.inaccessible] == pytest.approx([0.5 * 0.06 * 10], abs=1e-2)


def test_cusp_between_tangent_arcs():
    """Two arcs that leave one point in the same direction: a tip of angle zero."""
    shape = run(
        (0, 0), ("A", 10, 10, 0, 10, True), ("L", 10, 20), ("L", -20, 20), ("L", -20, 0), ("A", 0, 0, -10, -5000, False)
    )
    for side in (LEFT, RIGHT):
        sound(shape, side, 2)
    tip = run(
        (0, 0),
        ("A", 6, 6, 0, 6, True),
        ("L", 6, 30),
        ("L", -30, 30),
        ("L", -30, -30),
        ("L", 10, -30),
        ("L", 10, 10),
        ("A", 0, 0, 0, 10, False),
    )
    for side in (LEFT, RIGHT):
        sound(tip, side, 1.5)


@pytest.mark.parametrize("bend", [0, 1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, -1e-7, -1e-5, -1e-3])
def test_nearly_tangent_neighbours(bend):
    """Line into arc with a bend (rad) from nothing to clearly there, both senses."""
    c, s = math.cos(bend), math.sin(bend)
    end = (20 + 8 * math.sin(math.pi / 2 + bend) + 0.0, 8 * c + 8 * math.sin(bend))
    centre = (20 - 8 * s, 8 * c)
    end = (centre[0] + 8, centre[1])
    shape = run((0, 0), ("L", 20, 0), ("A", *end, *centre, True), ("L", end[0], 40), ("L", 0, 40), close=True)
    for side in (LEFT, RIGHT):
        for radius in (1, 5, 7.9):
            assert len(sound(shape, side, radius).paths) == 1


def test_concentric_arcs_exactly_two_radii_apart():
    """A ring-shaped gallery as wide as the tool between two chambers."""
    shape = run(
        (10, 0),
        ("A", -10, 0, 0, 0, True),
        ("L", -10, -20),
        ("L", -4, -20),
        ("L", -4, 0),
        ("A", 4, 0, 0, 0, False),
        ("L", 4, -20),
        ("L", 10, -20),
        close=True,
    )
    result = sound(shape, LEFT, 3)
    (path,) = result.paths
    assert nearest(from_elements(path.elements), np.array([[0.0, 7.0]]))[0] < 1e-9
    assert len(sound(shape, LEFT, 3.01).paths) == 0
    assert len(sound(shape, LEFT, 2.9).paths) == 1


def test_arc_touching_the_opposite_path_in_one_point():
    """A bump whose top stands exactly two radii from the opposite wall."""
    shape = run((0, 0), ("L", 15, 0), ("A", 25, 0, 20, 0, False), ("L", 40, 0), ("L", 40, 9), ("L", 0, 9), close=True)
    for radius, count in ((2 - 1e-5, 1), (2 + 1e-5, 2)):
        assert len(sound(shape, LEFT, radius).paths) == count
    assert len(sound(shape, LEFT, 2).paths) in (1, 2)


@pytest.mark.parametrize("off", [-1e-5, -1e-7, -1e-8, -1e-10, 0, 1e-10, 1e-8, 1e-7, 1e-5])
def test_walls_about_two_radii_apart(off):
    """Through the tolerance: both chambers are always there, whatever becomes of the neck."""
    shape = polygon(
        (0, 0),
        (20, 0),
        (20, 8),
        (40, 8),
        (40, 0),
        (60, 0),
        (60, 20),
        (40, 20),
        (40, 12 + off),
        (20, 12 + off),
        (20, 20),
        (0, 20),
    )
    result = sound(shape, LEFT, 2)
    path = [el for p in result.paths for el in from_elements(p.elements)]
    assert nearest(path, np.array([[2.0, 2.0], [58.0, 18.0]])).max() < 1e-9
    if off >= 0:
        assert nearest(path, np.array([[30.0, 10.0]]))[0] < 1e-5


def test_tiny_elements_between_large_ones():
    shape = run(
        (0, 0),
        ("L", 20, 0),
        ("A", 20.00001, 0.00001, 20, 0.00001, True),
        ("L", 20.00001, 20),
        ("L", 20.000005, 20.000002),
        ("L", 0, 20),
        close=True,
    )
    for side in (LEFT, RIGHT):
        assert len(sound(shape, side, 3).paths) == 1


def test_open_contour_both_sides():
    wall = run((0, 0), ("L", 20, 0), ("L", 20, 10), ("A", 30, 20, 30, 10, False), ("L", 50, 20))
    (left,) = sound(wall, LEFT, 3).paths
    assert isinstance(left, OpenPath)
    assert left.elements.start[0] == pytest.approx((0, 3))
    assert left.elements.end[-1] == pytest.approx((50, 23))
    (right,) = sound(wall, RIGHT, 3).paths
    assert right.elements.start[0] == pytest.approx((0, -3))
    assert right.elements.end[-1] == pytest.approx((50, 17))


def test_open_contour_backwards_is_the_same_path_backwards():
    wall = run((0, 0), ("L", 20, 0), ("L", 20, 10), ("A", 30, 20, 30, 10, False), ("L", 50, 20))
    (there,) = sound(wall, LEFT, 3).paths
    (back,) = sound(reverse(wall), RIGHT, 3).paths
    assert back.elements.start[::-1] == pytest.approx(there.elements.end, abs=1e-9)


def test_open_hook_closing_on_itself():
    """The free end comes within the tool radius of the inside path: it ends there."""
    hook = run((0, 0), ("L", 30, 0), ("L", 30, 30), ("L", 0, 30), ("L", 0, 4))
    result = sound(hook, LEFT, 3)
    assert all(gap > 3 - 1e-6 for p in result.paths for gap in nearest(from_elements(hook.elements), p.elements.start))
    (before,) = [u for u in result.inaccessible if isinstance(u, InaccessibleSegment)]
    assert before.lines == (1,) and path_length_of(before.elements) == pytest.approx(math.sqrt(8))


def test_single_line_and_single_arc():
    (path,) = sound(run((0, 0), ("L", 10, 0)), RIGHT, 2).paths
    assert path.elements.start[0] == pytest.approx((0, -2))
    (path,) = sound(run((5, 0), ("A", 0, 5, 0, 0, True)), LEFT, 2).paths
    assert path.elements.radius.tolist() == pytest.approx([3])
    assert sound(run((5, 0), ("A", 0, 5, 0, 0, True)), LEFT, 6).paths == ()


def test_sharp_corners_by_choice():
    result = sound(SQUARE, RIGHT, 3)
    (path,) = result.sharp_paths
    assert corners(path) == {(-3, -3), (23, -3), (23, 23), (-3, 23)}
    assert not path.elements.is_arc.any()


def test_sharp_corner_stays_round_where_the_tip_would_gouge():
    """A thin post stands 8.5 from the corner along its diagonal: the rolling arc (5 from the
    corner, 3.5 from the post) already fails with R 5, passes with R 4; its tip, 5.66 out,
    comes within 2.84 of the post."""

    def walls(out):
        d = out / math.sqrt(2.0)
        return polygon((0, 0), (20, 0), (20, 20), (60, 20), (60, -40), (20 + d, -d), closed=False)

    free = sound(walls(30), RIGHT, 4).sharp_paths[0]
    assert not free.elements.is_arc.any()
    tight = sound(walls(8.5), RIGHT, 4)
    assert tight.sharp_paths[0].elements.is_arc.any()
    assert (
        gouge(
            from_elements(walls(8.5).elements), 4, [el for p in tight.sharp_paths for el in from_elements(p.elements)]
        )
        < 1e-6
    )


def test_paths_name_their_source_lines():
    result = sound(SQUARE, RIGHT, 3)
    assert result.source_lines(result.paths[0]).tolist() == [1, 1, 2, 2, 3, 3, 4, 4]
    assert result.source_lines(result.sharp_paths[0]).tolist() == [2, 3, 4, 1]


def test_very_sharp_corners_stay_round():
    needle = polygon((0, 0), (30, 1), (0, 2))
    (path,) = sound(needle, RIGHT, 2).sharp_paths
    assert path.elements.is_arc.any()


def test_ten_offsets_do_not_drift():
    """Every ring comes from the original: ring k of a circle-cornered square is exact."""
    for k in range(1, 11):
        (path,) = sound(rounded_square(60, 25), LEFT, 2.0 * k).paths
        radius = 25 - 2.0 * k
        assert path_length(path) == pytest.approx(4 * 10 + 2 * math.pi * radius, abs=1e-9)
