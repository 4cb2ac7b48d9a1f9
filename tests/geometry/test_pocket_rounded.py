# SPDX-License-Identifier: GPL-2.0-or-later
"""The rounded corners of P0 to P3, and the links between rings of P0: tangent, inside, nothing left."""

import math

import numpy as np
import pytest
from support.engagement_shapes import SHAPES
from support.random_cases import random_count, random_seed
from support.pocket_judge import random_request
from support.pocket_tracks_oracle import Cleared, broken, outside, residue, too_far_apart

from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.base.elements import make_lines
from chipwise.geometry.pocket.concentric import concentric
from chipwise.geometry.pocket.links import known_starts
from chipwise.geometry.pocket.machinable import inside, machinable_regions, split
from chipwise.geometry.pocket import scan
from chipwise.geometry.pocket.oneway import one_way
from chipwise.geometry.pocket.rings import contour_parallel
from chipwise.geometry.pocket.rounded import CORNER, DEEPEST, FLAT, RADII, TAKEN, eased, rounded, smoothed
from chipwise.geometry.pocket.wall_arcs import Walls
from chipwise.geometry.pocket.zigzag import zigzag

RADIUS, STEP = 3.0, 2.4
SAME_MM, SAME_RAD = 1e-6, 1e-6
PLACES_MM = 0.2  # between the places of a ring's inside that are asked


def bends(chain, closed=True):
    """Turn to the left (n,) rad from each element of a chain to the next."""
    index = np.arange(len(chain))
    out, onto = (elements.tangent_at(chain, index, np.full(len(chain), t)) for t in (1.0, 0.0))
    onto = np.roll(onto, -1, axis=0)
    turn = np.arctan2(out[:, 0] * onto[:, 1] - out[:, 1] * onto[:, 0], (out * onto).sum(axis=1))
    return turn if closed else turn[:-1]


def reach(chain, places):
    """Distance (m,) mm of places from a chain."""
    count = len(chain)
    gap = elements.distances(chain, np.tile(np.arange(count), len(places)), np.repeat(places, count, axis=0))
    return gap.reshape(-1, count).min(axis=1)


def faults(loop, made, region):
    """What is wrong with a ring's rounded contour; region: the ring's inside."""
    wrong = []
    if np.abs(np.roll(made.start, -1, axis=0) - made.end).max() > SAME_MM:
        wrong.append("not connected")
    known = np.append(np.sort(np.abs(bends(loop))), math.inf)
    new = [turn for turn in np.abs(bends(made)) if turn > SAME_RAD and np.abs(known - turn).min() > SAME_RAD]
    if new:
        wrong.append(f"a bend of {max(new):.3g} rad is new")
    low, high = loop.start.min(axis=0), loop.start.max(axis=0)
    axes = [np.arange(a, b, PLACES_MM) for a, b in zip(low, high)]
    places = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    places = places[inside(region, places)]
    if len(places) and (reach(made, places) > np.maximum(reach(loop, places), DEEPEST * RADIUS) + SAME_MM).any():
        wrong.append("a place is too far from the ring")
    middle = elements.point_at(made, np.arange(len(made)), np.full(len(made), 0.5))
    off = reach(loop, middle) > SAME_MM
    if off.any() and not inside(region, middle[off]).all():
        wrong.append("an arc leaves the ring")
    return wrong


def rings(loops):
    """(contour, ring) of all rings a step-over apart, but for the wall."""
    contours, found = [make_contour(parts) for parts in loops], []
    for wall in split(contours[0], contours[1:], RADIUS):
        for number in range(1, 4):
            for ring in machinable_regions(wall.pocket, RADIUS + number * STEP):
                if ring.area > 0.0:
                    found += [(contour, ring) for contour in ring.contours]
    return found


def test_a_square_gets_four_arcs():
    corner = np.array(((0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)))
    made = rounded(make_lines(corner, np.roll(corner, -1, axis=0)), RADIUS)
    size = RADII[0] * RADIUS
    assert made.is_arc.sum() == 4 and np.allclose(made.radius[made.is_arc], size)
    assert np.abs(bends(made)).max() < SAME_RAD
    assert elements.lengths(made).sum() == pytest.approx(80.0 - 4 * (2.0 - math.pi / 2) * size, abs=1e-9)


def test_corners_to_the_right_and_flat_ones_stay():
    corner = np.array(((0.0, 0.0), (0.0, 20.0), (20.0, 20.0), (20.0, 0.0)))
    loop = make_lines(corner, np.roll(corner, -1, axis=0))
    assert rounded(loop, RADIUS) is loop


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_rings_of_the_shapes(name):
    for contour, ring in rings(SHAPES[name]):
        assert faults(contour, rounded(contour, RADIUS), ring) == []


def test_rings_of_random_pockets():
    count, arcs = random_count(20), 0
    for seed in range(random_seed() + 52000, random_seed() + 52000 + count):
        for contour, ring in rings(random_request(seed, 0).loops):
            made = rounded(contour, RADIUS)
            arcs += made.is_arc.sum() - contour.is_arc.sum()
            assert faults(contour, made, ring) == [], seed
    assert arcs > 0


def test_the_judge_sees_an_arc_that_is_too_wide():
    contour, ring = rings(SHAPES["rectangle"])[0]
    assert faults(contour, rounded(contour, 4 * RADIUS), ring) == ["a place is too far from the ring"]
    assert faults(contour, elements.take(contour, np.arange(1, len(contour))), ring) != []


def test_links_from_ring_to_ring_are_tangent():
    """In the circle all are but the first: a ring of 2.8 mm is too tight for arcs to the next."""
    contours = [make_contour(parts) for parts in SHAPES["circle"]]
    (region,) = split(contours[0], (), RADIUS)
    walls = Walls(region, RADIUS, True, 0.3)
    (track,) = contour_parallel(region, RADIUS, STEP, 0.0, True, walls)
    (plain,) = contour_parallel(region, RADIUS, STEP, 0.0, True)
    bent, straight = ((np.abs(bends(one.elements, False)) > CORNER).sum() for one in (track, plain))
    assert bent <= 1 and straight > 10


def all_kept(arcs, corner):
    return np.full(len(corner), True)


def test_lines_with_corners_to_both_sides():
    points = np.array(((0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (40.0, 20.0), (40.0, 0.0)))
    made, index = smoothed(points, [], 1.0, 0.75, 0.1, all_kept)
    deep = 0.1 / (math.sqrt(2.0) - 1.0)
    assert np.allclose(made.radius[made.is_arc], (0.75, deep, deep))
    assert np.abs(bends(made, False)).max() < SAME_RAD and index.tolist() == [0, 0, 1, 1, 2, 2, 3]
    assert np.allclose(made.end[:-1], made.start[1:]) and np.allclose(reach(made, points[[2, 3]]), 0.1)
    assert smoothed(points, [1, 2, 3, 4], 1.0, 0.75, 0.1, all_kept)[0].is_arc.sum() == 0
    assert smoothed(points, [], 1.0, 0.75, 0.1, lambda arcs, corner: corner[:, 1] > 10.0)[0].is_arc.sum() == 2


def test_short_lines_become_arcs_alone():
    angle = np.linspace(0.0, 1.5 * math.pi, 16)
    points = 10.0 * np.column_stack((np.cos(angle), np.sin(angle)))
    made, _ = smoothed(points, [], 1.0, 0.75, 0.24, all_kept)
    assert made.is_arc.sum() == 14 and len(made) == 16 and (made.radius[made.is_arc] > 9.0).all()


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_closed_paths_of_the_shapes(name):
    contours = [make_contour(parts) for parts in SHAPES[name]]
    for region in split(contours[0], contours[1:], RADIUS):
        for climb in (True, False):
            plain, tracks = (
                concentric(region, RADIUS, STEP, 0.0, climb, walls)
                for walls in (None, Walls(region, RADIUS, climb, 0.3))
            )
            job = Cleared(region, tracks, RADIUS)
            assert broken(job) + outside(job) + too_far_apart(job, STEP, 1.0) + residue(job, 1.0) == []
            sharp, bent = (
                (np.abs(bends(elements.join([t.elements for t in one]), False)) > FLAT).sum() for one in (tracks, plain)
            )
            assert sharp < (0.7 if bent > 20 else 1.01) * bent


def test_rows_with_corners_to_both_sides():
    points = np.array(((0.0, 0.0), (20.0, 0.0), (20.0, 1.5), (0.0, 1.5), (0.0, 3.0), (20.0, 3.0)))
    line = make_lines(points[:-1], points[1:])
    (made,) = eased([line], points[[3]], RADIUS, 1.0, all_kept)
    radius = TAKEN * 1.5  # nearly half of the line between two rows
    assert np.allclose(made.radius[made.is_arc], radius) and np.allclose(made.end[:-1], made.start[1:])
    assert np.allclose(np.sign(made.sweep[made.is_arc]), (1.0, 1.0, -1.0))
    assert np.allclose(np.abs(bends(made, False)[np.abs(bends(made, False)) > SAME_RAD]), math.pi / 2)
    assert np.allclose(reach(made, points), np.array((0, 1, 1, 0, 1, 0)) * (math.sqrt(2.0) - 1.0) * radius)
    (flat,) = eased([line], points[[0]], RADIUS, 0.2, all_kept)
    assert np.allclose(flat.radius[flat.is_arc], 0.5 * radius)
    assert not eased([line], points, RADIUS, 1.0, all_kept)[0].is_arc.any()
    lower = eased([line], points[[0]], RADIUS, 1.0, lambda arcs, corner: corner[:, 1] < 1.0)
    assert lower[0].is_arc.sum() == 1
    first, last = eased([line, elements.reverse(line)], points[[0]], RADIUS, 1.0, all_kept)
    assert first.is_arc.sum() == last.is_arc.sum() == 4 and np.allclose(last.start[0], line.end[-1])


@pytest.mark.parametrize("strategy, most", ((one_way, 0.8), (zigzag, 0.3)))
@pytest.mark.parametrize("name", sorted(set(SHAPES) - {"slot"}))  # no row of the slot ends before the walls
def test_rows_of_the_shapes(name, strategy, most, monkeypatch):
    contours = [make_contour(parts) for parts in SHAPES[name]]
    for region in split(contours[0], contours[1:], RADIUS):
        for climb in (True, False):
            walls = [Walls(region, RADIUS, climb, 0.3) for _ in range(2)]
            tracks = strategy(region, RADIUS, STEP, 0.3, climb, walls[0])
            with monkeypatch.context() as patch:
                patch.setattr(scan, "eased", lambda parts, *_: parts)
                plain = strategy(region, RADIUS, STEP, 0.3, climb, walls[1])
            job = Cleared(region, tracks, RADIUS)
            assert broken(job) + outside(job) + residue(job, 1.0) == []
            assert sum(known_starts(tracks)) == sum(known_starts(plain))
            rounded_, sharp = (
                sum((np.abs(bends(track.elements, False)) > CORNER).sum() for track in one if not track.wall)
                for one in (tracks, plain)
            )
            assert rounded_ <= most * sharp and sharp > 10
