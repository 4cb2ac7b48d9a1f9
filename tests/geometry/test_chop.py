# SPDX-License-Identifier: GPL-2.0-or-later
"""geometry/slug/disc.py, line_order.py, base/enclosing_circle.py: enclosing circles, the number of parts, the order of
the lines."""

import itertools
import math
import random

import pytest

from chipwise.geometry.base import polygons
from chipwise.geometry.base import enclosing_circle
from chipwise.geometry.slug import disc, line_order
from support.chop_oracle import travel
from support.random_cases import random_count, random_seed
from support.hole_oracle import enclosing_diameter


def naive_order(groups):
    """The patent's own order, each line in the rising sense."""
    return disc.flat_segments(groups)


@pytest.mark.parametrize(
    "points, diameter",
    [
        ([], 0),
        ([(3, 4)], 0),
        ([(0, 0), (3, 4)], 5),
        ([(0, 0), (1, 0), (2, 0)], 2),
        ([(0, 0), (4, 0), (0, 3)], 5),  # right angle: the hypotenuse
        ([(math.cos(a), math.sin(a)) for a in (0.1, 2.2, 4.3)], 2),  # around the centre: circumscribed circle
        ([(0, 0), (1, 0), (1, 1), (0, 1)], math.sqrt(2)),
    ],
)
def test_enclosing_circle_closed_form(points, diameter):
    assert enclosing_circle.enclosing_circle(points)[2] == pytest.approx(diameter, abs=1e-12)


def test_enclosing_circle_against_another_algorithm():
    rng = random.Random(random_seed())
    for _ in range(random_count(300)):
        points = [(rng.gauss(0, 5), rng.gauss(0, 2)) for _ in range(rng.randint(2, 40))]
        x, y, diameter = enclosing_circle.enclosing_circle(points)
        assert diameter == pytest.approx(enclosing_diameter(points), rel=1e-7)
        assert all(math.hypot(px - x, py - y) <= diameter / 2 + 1e-9 for px, py in points)


@pytest.mark.parametrize(
    "d, h, n", [(4.99, 5, 1), (5, 5, 2), (9.99, 5, 2), (10, 5, 3), (20, 5, 5), (20, 8, 3), (9, 0, 1)]
)
def test_patent_parts(d, h, n):
    assert disc.patent_parts(d, h) == n


def test_thin_cutter_needs_more_parts_than_the_patent():
    """d 50, H 5, tool 0.8: pitch 4.545, cell 3.745 across, diagonal 5.297 mm: above H."""
    assert disc.patent_parts(50, 5) == 11
    cell = 50 / 11 - 0.8
    assert cell * math.sqrt(2) > 5
    assert disc.choose_parts(50, 0.4, 5) == 12
    assert (50 / 12 - 0.8) * math.sqrt(2) < 5


def test_parts_are_the_fewest_that_keep_the_promise():
    """Against the plain search: the whole disc, every n from the patent's on, every piece measured."""
    rng = random.Random(random_seed())
    raised = 0
    for _ in range(max(1, random_count(500) // 8)):
        tool_radius = rng.uniform(0.2, 2)
        d = tool_radius * rng.uniform(4.1, 60)
        h = d * rng.uniform(0.12, 0.9)
        slug = polygons.outer_disc(0, 0, d / 2 - 2 * tool_radius, disc.SAGITTA)
        n = disc.patent_parts(d, h)
        while (
            disc.largest_piece(slug, disc.flat_segments(disc.disc_lines(0, 0, d / 2, tool_radius, n)), tool_radius)
            >= h - disc.PIECE_MARGIN
        ):
            n += 1
        assert disc.choose_parts(d, tool_radius, h) == n, (d, tool_radius, h)
        raised += n > disc.patent_parts(d, h)
    assert raised > 0 or random_count(500) < 100


@pytest.mark.parametrize("d, tool_radius, h, n", [(100, 0.1, 0.05, 501), (200, 0.5, 0.9, 201), (200, 0.05, 2, 133)])
def test_extreme_sizes_end_soon(d, tool_radius, h, n):
    assert disc.choose_parts(d, tool_radius, h) == n


def test_no_slug_no_lines():
    assert disc.choose_parts(12, 3, 5) == 1


def test_pieces_are_never_computed_too_small():
    """An uncut disc: its polygon's circle is at least the disc, and at most the sagitta larger on each side."""
    for radius in (0.5, 5, 80):
        size = disc.largest_piece(polygons.outer_disc(3, 4, radius, disc.SAGITTA), [], 1)
        assert 2 * radius <= size <= 2 * (radius + disc.SAGITTA) + 1e-9


def test_one_kerf_halves_a_square():
    square = polygons.polygon_region([(0, 0), (10, 0), (10, 10), (0, 10)])
    sizes = sorted(map(enclosing_circle.piece_size, polygons.pieces(square, [((5, -2), (5, 12))], 1)))
    assert sizes == pytest.approx([math.hypot(4, 10)] * 2)


def brute_force(groups, start, end):
    """Shortest travel over every order and sense in which lines of a group stay together: all permutations."""
    best = math.inf
    for sequence in (groups, groups[::-1]):
        for orders in itertools.product(*(itertools.permutations(range(len(g))) for g in sequence)):
            lines = [g[i][0] for g, order in zip(sequence, orders) for i in order]
            for flips in itertools.product((False, True), repeat=len(lines)):
                path = [(b, a) if flip else (a, b) for (a, b), flip in zip(lines, flips)]
                best = min(best, travel(path, start, end, lambda s: s[0], lambda s: s[1]))
    return best


@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.parametrize("start", [(0, 0), (-30, 4), (12, 25)])
def test_order_is_the_shortest_of_all(n, start):
    groups = disc.disc_lines(0, 0, 10, 1, n)
    path = line_order.order_lines(groups, start, (0, 0))
    length = travel(path, start, (0, 0), lambda s: s[0], lambda s: s[1])
    assert length == pytest.approx(brute_force(groups, start, (0, 0)), abs=1e-6)


@pytest.mark.parametrize("n", [2, 3, 5, 9, 16])
def test_order_beats_the_patents(n):
    groups = disc.disc_lines(0, 0, 25, 1, n)
    path = line_order.order_lines(groups, (-40, 0), (0, 0))
    ends = dict(entry_of=lambda s: s[0], exit_of=lambda s: s[1])
    naive = travel(naive_order(groups), (-40, 0), (0, 0), **ends)
    ours = travel(path, (-40, 0), (0, 0), **ends)
    assert ours <= naive + 1e-9 if n == 2 else ours < 0.75 * naive
    assert sorted(map(sorted, path)) == sorted(map(sorted, disc.flat_segments(groups)))
