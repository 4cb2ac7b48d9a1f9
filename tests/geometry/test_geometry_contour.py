# SPDX-License-Identifier: GPL-2.0-or-later
"""What is a contour and what is refused, naming both elements."""

import math

import pytest

from chipwise.geometry.base.contour import ArcElement, ContourError, LineElement, make_contour
from chipwise.geometry.offset.kernel import LEFT, offset_contour, offset_pocket
from support.contour_shapes import circle, polygon, run


def refused(parts, kind, lines):
    with pytest.raises(ContourError) as caught:
        make_contour(parts)
    assert caught.value.kind == kind
    assert caught.value.lines == lines
    assert all(str(line) in str(caught.value) for line in lines)
    return caught.value


def chain(points, first_line=10):
    return [LineElement(a, b, first_line + k) for k, (a, b) in enumerate(zip(points, points[1:]))]


def test_crossing_names_both_lines_and_the_place():
    error = refused(chain([(0, 0), (10, 10), (10, 0), (0, 10), (0, 0)]), "crosses itself", (10, 12))
    assert error.point == pytest.approx((5, 5))
    assert "X5 mm Y5 mm" in str(error)


def test_line_through_arc():
    parts = [
        ArcElement((10, 0), (-10, 0), (0, 0), True, 3),
        LineElement((-10, 0), (0, 5), 4),
        LineElement((0, 5), (0, 20), 5),
    ]
    refused(parts, "crosses itself", (3, 5))


def test_touching_is_refused():
    refused(chain([(0, 0), (10, 0), (10, 10), (5, 0), (0, 10), (0, 0)]), "crosses itself", (10, 12))


def test_way_back_over_itself_is_refused():
    refused(chain([(0, 0), (10, 0), (4, 0), (4, 5)]), "crosses itself", (10, 11))


def test_a_circle_within_a_longer_run_comes_back_to_its_start():
    refused(
        [ArcElement((5, 0), (5, 0), (0, 0), True, 7), LineElement((5, 0), (0, 0), 8), LineElement((0, 0), (-9, 0), 9)],
        "crosses itself",
        (7, 8),
    )


def test_gap_names_both_lines():
    refused([LineElement((0, 0), (10, 0), 21), LineElement((10, 0.1), (10, 10), 24)], "not connected", (21, 24))


@pytest.mark.parametrize("centre", [(5, 1), (0, 0)], ids=["unequal radii", "no radius"])
def test_impossible_arc(centre):
    refused([LineElement((-5, 0), (0, 0), 1), ArcElement((0, 0), (10, 0.5), centre, True, 2)], "impossible arc", (1, 2))


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_not_finite(bad):
    refused([LineElement((0, 0), (10, 0), 1), LineElement((10, 0), (10, bad), 2)], "not finite", (1, 2))
    refused([LineElement((0, 0), (10, 0), 1), ArcElement((10, 0), (10, 5), (bad, 2.5), True, 2)], "not finite", (1, 2))


def test_nothing():
    refused([], "empty", ())
    refused([LineElement((1, 1), (1, 1), 5)], "empty", ())


@pytest.mark.parametrize("radius", [0.0, -1.0, math.nan, math.inf])
def test_radius(radius):
    with pytest.raises(ValueError, match="offset"):
        offset_contour(polygon((0, 0), (9, 0), (9, 9)), LEFT, radius)


def test_small_gaps_and_roundings_are_closed():
    contour = make_contour(
        [
            LineElement((0, 0), (10, 0), 1),
            ArcElement((10.0004, 0), (10, 6.0001), (10, 3.0003), True, 2),
            LineElement((10, 6), (0, 6), 3),
            LineElement((0, 6), (0, 0.0005), 4),
        ]
    )
    assert contour.closed
    e = contour.elements
    assert (e.start[1:] == e.end[:-1]).all() and (e.end[-1] == e.start[0]).all()
    first = math.hypot(*(e.start[1] - e.centre[1]))
    assert first == pytest.approx(e.radius[1], abs=1e-12)
    assert math.hypot(*(e.end[1] - e.centre[1])) == pytest.approx(e.radius[1], abs=1e-12)


def test_long_arc_that_does_not_fit_one_circle_becomes_two():
    contour = run((10, 0), ("A", 0, -10.004, 0, 0, True), ("L", 30, -20))
    assert contour.line.tolist() == [1, 1, 2]
    e = contour.elements
    assert sum(e.sweep[:2]) == pytest.approx(1.5 * math.pi, abs=2e-3)
    assert (e.end[0] == e.start[1]).all()


def test_open_and_closed():
    assert not polygon((0, 0), (10, 0), (10, 10), closed=False).closed
    assert polygon((0, 0), (10, 0), (10, 10)).closed
    assert circle(3).closed
    assert not run((0, 0), ("L", 10, 0)).closed


def test_pocket_refuses_crossing_and_open_loops():
    square = polygon((0, 0), (20, 0), (20, 20), (0, 20))
    with pytest.raises(ContourError) as caught:
        offset_pocket(square, [circle(4, (19, 10), line=77)], 1.0)
    assert caught.value.kind == "crosses itself" and 77 in caught.value.lines
    with pytest.raises(ContourError) as caught:
        offset_pocket(polygon((0, 0), (9, 0), (9, 9), closed=False), [], 1.0)
    assert caught.value.kind == "not connected"


@pytest.mark.parametrize(
    "island", [circle(3, (40, 10), line=77), circle(1, (10, 10), line=77)], ids=["outside", "nested"]
)
def test_pocket_refuses_misplaced_islands(island):
    square = polygon((0, 0), (20, 0), (20, 20), (0, 20))
    with pytest.raises(ContourError) as caught:
        offset_pocket(square, [circle(4, (10, 10), line=55), island], 1.0)
    assert caught.value.kind == "misplaced island" and caught.value.lines[0] in (55, 77)
