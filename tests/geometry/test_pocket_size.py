# SPDX-License-Identifier: GPL-2.0-or-later
"""What makes large pockets quick leaves every path as it was, bit for bit."""

import math
from functools import partial

import numpy as np

from chipwise.geometry.base import chains, elements, search
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.offset import sunk
from chipwise.geometry.offset.kernel import make_pocket, pocket_ring
from chipwise.geometry.pocket import rings
from support.contour_random import contour_case
from support.large_outlines import outline


def bits(result):
    """Everything of the paths of an OffsetResult, as bytes."""
    return [
        (
            type(path),
            *(
                value.tobytes()
                for value in (
                    path.elements.start,
                    path.elements.end,
                    path.elements.centre,
                    path.elements.radius,
                    path.elements.sweep,
                    path.feet.finish,
                    path.feet.t0,
                    path.feet.t1,
                )
            ),
        )
        for path in result.paths
    ]


def ring_bits(contour, step):
    """The rings of a pocket, as many as there are."""
    pocket, found = make_pocket(contour, ()), []
    while not found or found[-1]:
        found.append(bits(pocket_ring(pocket, step * (1 + len(found)))))
    return found, pocket


def random_contours():
    for kind in ("filleted", "bulged"):
        for seed in range(60):
            parts, radius = contour_case(seed, kind)
            contour = make_contour(parts)
            if contour.closed:
                yield contour, 2.0 * radius


def test_rings_are_the_same_without_what_is_sunk(monkeypatch):
    dropped = 0
    shapes = [(make_contour(outline(kind, count)), 6.0) for kind, count in (("coast", 240), ("lobes", 120))]
    for contour, step in shapes + [case for case, _ in zip(random_contours(), range(10))]:
        monkeypatch.setattr(sunk, "FEWEST", math.inf)
        whole, _ = ring_bits(contour, step)
        monkeypatch.setattr(sunk, "FEWEST", 0)
        short, pocket = ring_bits(contour, step)
        assert short == whole
        dropped += sum(int(gone.sum()) for _, gone in pocket.sunk.known)
    assert dropped > 100


def test_rings_in_any_order(monkeypatch):
    """What is sunk at a wide ring is not taken to be at a narrow one."""
    monkeypatch.setattr(sunk, "FEWEST", 0)
    contour = make_contour(outline("coast", 200))
    rising, pocket = ring_bits(contour, 4.0)
    again = make_pocket(contour, ())
    falling = [bits(pocket_ring(again, 4.0 * k)) for k in range(len(rising), 0, -1)][::-1]
    assert falling == rising and any(gone.any() for _, gone in pocket.sunk.known)


def test_nearest_by_the_tree():
    """As by measuring every element."""
    rng = np.random.default_rng(1)
    for seed in range(6):
        e = make_contour(contour_case(seed, "bulged")[0]).elements
        assert e.is_arc.any() and not e.is_arc.all()
        low, high = e.start.min(axis=0) - 3.0, e.start.max(axis=0) + 3.0
        point = np.concatenate(
            (rng.uniform(low, high, (100, 2)), e.start, elements.point_at(e, np.arange(len(e)), np.full(len(e), 0.3)))
        )
        reach = rng.uniform(0.0, 10.0, len(point))
        gap = search.near_gaps(search.build(*elements.boxes(e)), e, point, reach)
        every = np.min([elements.distances(e, np.full(len(point), k), point) for k in range(len(e))], axis=0)
        assert np.array_equal(gap[every < reach], every[every < reach])
        assert np.all(gap[every >= reach] >= reach[every >= reach])


def test_nearest_of_few_and_of_what_is_not_a_number():
    one = elements.make_lines(np.zeros((1, 2)), np.array([[4.0, 0.0]]))
    point = np.array([[1.0, 2.0], [np.nan, 2.0], [7.0, 4.0], [4.0, 9.0]])
    for count in (1, 2, 4, 5, 17):
        e = elements.join(
            [one]
            + [elements.make_lines(np.full((1, 2), 100.0 * k), np.full((1, 2), 100.0 * k)) for k in range(1, count)]
        )
        gap = search.near_gaps(search.build(*elements.boxes(e)), e, point, np.full(4, 6.0))
        assert gap[0] == 2.0 and gap[1] == np.inf and gap[2] == 5.0 and gap[3] >= 6.0
    assert search.near_gaps(search.build(*elements.boxes(one)), one, np.zeros((0, 2)), np.zeros(0)).shape == (0,)


def test_slots_in_parts(monkeypatch):
    """The cheapest slots are the same, however many are compared at once."""
    rng = np.random.default_rng(2)
    for _ in range(8):
        other = make_contour(outline("curve", int(rng.integers(60, 200)))).elements
        tree = search.build(*elements.boxes(other))
        ends = elements.point_at(other, np.repeat(np.arange(len(other)), 2), np.tile((0.0, 0.5), len(other)))
        positions = np.round(rng.uniform(-90, 90, (150, 2)))
        asked = positions, ends, rng.uniform(-50, 50, 2), 25.0, partial(rings._gaps, other, tree)
        monkeypatch.setattr(rings, "AT_ONCE", 10**9)
        whole = rings._shortest(*asked)
        gap = np.hypot(*(positions[:, None] - ends).transpose(2, 0, 1))
        cost = np.where(gap <= 25.0, gap + 0.5 * np.hypot(*(positions - asked[2]).T)[:, None], np.inf).ravel()
        first = chains.rising(cost)[: rings.SLOT_TRIES]
        first = first[np.isfinite(cost[first])]
        assert len(first) == rings.SLOT_TRIES
        assert np.array_equal(whole[0], cost[first]) and np.array_equal(whole[1] * len(ends) + whole[2], first)
        monkeypatch.setattr(rings, "AT_ONCE", 2000)
        assert all(map(np.array_equal, rings._shortest(*asked), whole))
