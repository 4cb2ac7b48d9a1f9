# SPDX-License-Identifier: GPL-2.0-or-later
"""Canonical forms and the patent's procedure, on the figures of JP H07-47256."""

import math

import numpy as np
import pytest

from chipwise.geometry.offset.canonical import canonical, offset_right
from chipwise.geometry.offset.kernel import LEFT, RIGHT, offset_contour
from support.reference_offset import NoMeeting, patent_offset
from support.contour_shapes import polygon, run


def test_line_form_is_right_normal_and_signed_distance():
    # Travel +x along y = 3: the normal to the right is -y, the origin lies right of travel.
    form = canonical(polygon((0, 3), (10, 3), closed=False).elements)
    assert form.normal[0] == pytest.approx((0, -1))
    assert form.distance[0] == pytest.approx(-3)
    # Travel -x along y = 3: the origin lies left of travel, the distance is positive.
    form = canonical(polygon((10, 3), (0, 3), closed=False).elements)
    assert form.normal[0] == pytest.approx((0, 1))
    assert form.distance[0] == pytest.approx(3)


def test_line_form_of_a_slanted_line():
    # x + y = sqrt(2) * 5 is 5 from the origin; going down right keeps the origin on the right.
    s = 5 * math.sqrt(2)
    form = canonical(polygon((0, s), (s, 0), closed=False).elements)
    assert form.normal[0] == pytest.approx((-math.sqrt(0.5), -math.sqrt(0.5)))
    assert form.distance[0] == pytest.approx(-5)


@pytest.mark.parametrize("side, line, ccw, cw", [(RIGHT, 2, 7, 3), (LEFT, -2, 3, 7)])
def test_offset_of_forms(side, line, ccw, cw):
    # Right: Ve + L, CCW r0 + L, CW r0 - L; left the other way round (L = 2, r0 = 5).
    straight = canonical(polygon((0, 0), (10, 0), closed=False).elements)
    assert offset_right(straight, side * 2.0).distance[0] == pytest.approx(line)
    for turn, radius in ((True, ccw), (False, cw)):
        arc = canonical(run((5, 0), ("A", 0, 5 if turn else -5, 0, 0, turn)).elements)
        moved = offset_right(arc, side * 2.0)
        assert moved.radius[0] == pytest.approx(radius)
        assert moved.turn[0] == (1 if turn else -1)


def test_offset_radius_may_come_out_negative():
    arc = canonical(run((5, 0), ("A", 0, 5, 0, 0, True)).elements)
    assert offset_right(arc, -8.0).radius[0] == pytest.approx(-3)


def figure(middle):
    """EL1 along x, EL2 the inside corner, EL3 along y; the tool goes left of them."""
    return run((0, 0), ("L", 17, 0), middle, ("L", 20, 20))


CHAMFER, ARC = ("L", 20, 3), ("A", 20, 3, 17, 3, True)


@pytest.mark.parametrize("middle", [CHAMFER, ARC], ids=["inside chamfer", "inside arc"])
def test_figures_5_and_6(middle):
    """R = 10: EL2 is deleted, P1 = (10, 10), the rough shape's corner is (20, 0)."""
    made = patent_offset(figure(middle), LEFT, 10.0)
    assert made.deleted == (1,) and made.kept == (0, 2)
    assert made.path.end[0] == pytest.approx((10, 10))
    assert made.path.start[1] == pytest.approx((10, 10))
    assert made.rough.start == pytest.approx(np.array([(0, 0), (20, 0)]))
    assert made.rough.end == pytest.approx(np.array([(20, 0), (20, 20)]))


@pytest.mark.parametrize("middle", [CHAMFER, ARC], ids=["inside chamfer", "inside arc"])
def test_kernel_agrees_with_the_patent_on_its_figures(middle):
    made, kernel = patent_offset(figure(middle), LEFT, 10.0), offset_contour(figure(middle), LEFT, 10.0)
    (path,) = kernel.paths
    assert path.elements.start == pytest.approx(made.path.start)
    assert path.elements.end == pytest.approx(made.path.end)
    # and closes the corner by the tool's own edge instead of a point it cannot cut
    assert kernel.rough[0].elements.radius.tolist() == pytest.approx([0, 10, 0])
    assert kernel.inaccessible[0].lines == (1, 2, 3)


@pytest.mark.parametrize("middle, kept", [(CHAMFER, 3), (ARC, 3)])
def test_nothing_is_deleted_where_the_tool_fits(middle, kept):
    made = patent_offset(figure(middle), LEFT, 2.0)
    assert made.deleted == () and len(made.path) == kept
    # offset back: the finish shape itself
    assert made.rough.start == pytest.approx(figure(middle).elements.start)
    assert made.rough.end == pytest.approx(figure(middle).elements.end)


def test_arc_of_exactly_the_tool_radius_is_deleted():
    made = patent_offset(figure(ARC), LEFT, 3.0)
    assert made.deleted == (1,)
    assert made.path.end[0] == pytest.approx((17, 3))


def test_two_reversed_in_a_row():
    shape = run((0, 0), ("L", 16, 0), ("L", 18.5, 1), ("L", 20, 3), ("L", 20, 20))
    made = patent_offset(shape, LEFT, 10.0)
    assert made.deleted == (1, 2)
    assert made.path.end[0] == pytest.approx((10, 10))


def test_neighbours_that_do_not_meet_are_named():
    # A dead-end between parallel walls: floor and end arcs go, the walls never meet.
    shape = run((0, 0), ("L", 20, 0), ("L", 20, 4), ("L", 0, 4))
    assert patent_offset(shape, LEFT, 3.0) == NoMeeting(0, 2)
    # the kernel says the same by an empty path on that side
    assert offset_contour(shape, LEFT, 3.0).paths == ()


def test_patent_alone_gouges_across_the_contour():
    """Why the kernel exists: a wall opposite, not a neighbour, is within the tool radius."""
    shape = run((0, 0), ("L", 20, 0), ("L", 20, 30), ("L", 5, 30), ("L", 5, 6), ("L", 0, 6))
    made = patent_offset(shape, LEFT, 4.0)
    assert not isinstance(made, NoMeeting)
    from support.contour_oracle import from_elements, gouge

    finish = from_elements(shape.elements)
    assert gouge(finish, 4.0, from_elements(made.path)) > 0.9
    kernel = offset_contour(shape, LEFT, 4.0)
    assert all(gouge(finish, 4.0, from_elements(p.elements)) < 1e-9 for p in kernel.paths)
