# SPDX-License-Identifier: GPL-2.0-or-later
"""One-way, zigzag and concentric clearing (geometry/pocket): rows, sequence, region, residue."""

import math

import numpy as np
import pytest

from chipwise.errors import CycleError
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.pocket import scan as scanning
from chipwise.geometry.pocket.baseline import BaseLine
from chipwise.geometry.pocket.concentric import concentric
from chipwise.geometry.pocket.convex import Partition
from chipwise.geometry.pocket.convex_cuts import centroid
from chipwise.geometry.pocket.machinable import split
from chipwise.geometry.pocket.oneway import one_way
from chipwise.geometry.pocket.tracks import make_track
from chipwise.geometry.pocket.zigzag import zigzag
from chipwise.geometry.base.inner_polygons import inner_polygons
from support.computing import least_s
from support.random_cases import random_count, random_seed
from support.contour_oracle import length
from support.contour_shapes import circle, polygon, rounded_square
from support.pocket_tracks_oracle import (
    Cleared,
    broken,
    chords,
    contours_missed,
    entries,
    outside,
    residue,
    too_far_apart,
)
from support.island_random import random_islands

STRATEGIES = (one_way, zigzag, concentric)
STRAIGHT = (one_way, zigzag)
R = 3.0


def rectangle(width=40.0, height=26.0):
    """Machinable region of a rectangle from (3, 3), 34 x 20 mm for the default size."""
    (field,) = split(polygon((0, 0), (width, 0), (width, height), (0, height)), (), R)
    return field


def with_islands():
    """Machinable region with two holes and a bay."""
    boundary = polygon((0, 0), (60, 0), (60, 50), (36, 50), (36, 36), (28, 36), (28, 50), (0, 50))
    islands = [circle(4, (14, 18)), polygon((38, 12), (48, 14), (46, 22))]
    (field,) = split(boundary, islands, R)
    return field


def random_job(seed):
    """(fields, radius, step, direction, climb) number `seed`."""
    rng = np.random.default_rng([seed, 11])
    loops, radius = random_islands(seed)
    radius = min(max(radius, 0.5), 4.0)
    contours = [make_contour(parts) for parts in loops]
    direction = rng.choice([0.0, 0.5 * math.pi, math.pi, rng.uniform(0.0, 2.0 * math.pi)])
    return (
        split(contours[0], contours[1:], radius),
        radius,
        radius * rng.choice([0.5, 0.8, 1.2, 2.0]),
        float(direction),
        bool(rng.integers(2)),
    )


# --- closed form ------------------------------------------------------------


def test_rows_of_a_rectangle():
    job = Cleared(rectangle(), zigzag(rectangle(), R, 4.0, 0.0, True), R)
    rows = chords(job, 0.0)
    assert [round(-y, 6) for y, _ in rows] == [-19, -15, -11, -7]  # 20 mm in five gaps of 4
    assert [sense for _, sense in rows] == [1, -1, 1, -1]


def test_one_way_follows_the_sequence_of_the_abstract():
    tracks = one_way(rectangle(), R, 5.0, 0.0, True)
    left, right, rows = 3.0, 37.0, (18.0, 13.0, 8.0)  # climb: from the top down

    def points(track):
        return [tuple(np.round(p, 6)) for p in (*track.elements.start, track.end)]

    p = [(left, y) for y in rows]
    q = [(right, y) for y in rows]
    head = [(right, 23.0), (left, 23.0), p[0]]
    assert points(tracks[0]) == [p[0], q[0], *head, p[1], q[1], q[0]]
    assert points(tracks[1]) == [p[1], p[2], q[2], q[1]]
    assert points(tracks[2]) == [p[2], (left, 3.0), (right, 3.0), q[2]]
    assert len(tracks) == 4 and tracks[3].length == pytest.approx(2 * (34 + 20))


def test_conventional_is_the_mirror_image_of_climb():
    field = with_islands()
    (mirrored,) = split(
        polygon(*((-x, y) for x, y in ((0, 0), (60, 0), (60, 50), (36, 50), (36, 36), (28, 36), (28, 50), (0, 50)))),
        [circle(4, (-14, 18)), polygon(*((-x, y) for x, y in ((38, 12), (48, 14), (46, 22))))],
        R,
    )
    for strategy in STRAIGHT:
        one = strategy(field, R, 2.5, 0.0, True)
        two = strategy(mirrored, R, 2.5, math.pi, False)
        assert [t.length for t in one] == pytest.approx([t.length for t in two])
        for a, b in zip(one[:-3], two):
            assert a.start * (-1, 1) == pytest.approx(b.start, abs=1e-6)
            assert a.end * (-1, 1) == pytest.approx(b.end, abs=1e-6)


def test_a_turned_pocket_with_turned_rows_is_cut_the_same_way():
    corners = np.array([(0, 0), (50, 0), (50, 20), (24, 30), (0, 30)], float)
    turn = 0.7
    matrix = np.array(((math.cos(turn), math.sin(turn)), (-math.sin(turn), math.cos(turn))))
    (one,) = split(polygon(*map(tuple, corners)), (), R)
    (two,) = split(polygon(*map(tuple, corners @ matrix)), (), R)
    for strategy in STRATEGIES:
        first, second = strategy(one, R, 2.0, 0.0, False), strategy(two, R, 2.0, turn, False)
        assert sum(t.length for t in first) == pytest.approx(sum(t.length for t in second), rel=1e-6)


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_arcs_of_the_contours_stay_arcs(strategy):
    (field,) = split(rounded_square(40, 10), [circle(5, (20, 20))], R)
    tracks = strategy(field, R, 2.0, 0.0, True)
    turned = sum(abs(t.elements.sweep).sum() for t in tracks[-2:])
    assert turned == pytest.approx(4.0 * math.pi)


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_fields_of_no_area(strategy):
    (slot,) = split(polygon((0, 0), (20, 0), (20, 6), (0, 6)), (), R)
    (contact,) = split(polygon((0, 0), (6, 0), (6, 6), (0, 6)), (), R)
    assert sum(t.length for t in strategy(slot, R, 2.0, 0.3, True)) == pytest.approx(28.0)
    assert sum(t.length for t in strategy(contact, R, 2.0, 0.3, True)) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_absurd_step(strategy):
    with pytest.raises(CycleError):
        strategy(rectangle(), R, 1e-5, 0.0, True)


# --- the division into convex polygons ---------------------------------------


def test_a_rectangle_has_its_base_line_in_the_middle():
    """10 x 40 mm: the ends are cut off so that no edge is further than half the width away."""
    partition = Partition(np.array(((0, 0), (40, 0), (40, 10), (0, 10)), float), [])
    assert partition.slimmer() == pytest.approx(5.0)
    partition.merged()
    line = BaseLine(partition)
    assert line.node[:, 1] == pytest.approx(5.0)


def test_base_line_joins_centroids_and_middle_points():
    partition = Partition(np.array(((0, 0), (20, 0), (20, 10), (8, 10), (8, 30), (0, 30)), float), [])
    line = BaseLine(partition)
    assert len(partition.polygons) == 2
    first, second = (centroid(partition.corners(q)) for q in partition.polygons)
    assert {tuple(p) for p in line.node.tolist()} == {first, second, (4.0, 10.0)}
    assert sorted((first, second)) == [(4.0, 20.0), (10.0, 5.0)]


def partition_faults(partition, area):
    """What is wrong with a division."""
    wrong, edges, total = [], {}, 0.0
    for polygon_ in partition.polygons:
        p = partition.array(polygon_)
        a, b = p - np.roll(p, 1, axis=0), np.roll(p, -1, axis=0) - p
        if (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] < -1e-5 * np.hypot(*a.T) * np.hypot(*b.T)).any():
            wrong.append("not convex")
        total += 0.5 * float(p[:, 0] @ np.roll(p[:, 1], -1) - p[:, 1] @ np.roll(p[:, 0], -1))
        for k, (u, inner) in enumerate(polygon_):
            edges[u, polygon_[(k + 1) % len(polygon_)][0]] = inner
    if abs(total - area) > 1e-6 * area:
        wrong.append("area")
    if any(inner != ((v, u) in edges) for (u, v), inner in edges.items()):
        wrong.append("an edge without its other side")
    return wrong


def star(rng, n, size, at=(0.0, 0.0)):
    angle = np.sort(rng.uniform(0, 2 * math.pi, n))
    r = size * rng.uniform(0.3, 1.0, n)
    p = np.stack((r * np.cos(angle), r * np.sin(angle)), axis=1)
    return (p if p[:, 0] @ np.roll(p[:, 1], -1) > p[:, 1] @ np.roll(p[:, 0], -1) else p[::-1]) + at


def test_random_divisions():
    import shapely.geometry

    done = 0
    for seed in range(random_seed(), random_seed() + random_count(40, least=40)):
        rng = np.random.default_rng([seed, 12])
        outline = star(rng, int(rng.integers(3, 40)), 30.0)
        holes = [
            star(rng, int(rng.integers(3, 9)), rng.uniform(1, 5), rng.uniform(-15, 15, 2))[::-1]
            for _ in range(int(rng.integers(0, 6)))
        ]
        shape = shapely.geometry.Polygon(outline, holes)
        if not shape.is_valid or not all(shapely.geometry.Polygon(h).is_valid for h in holes):
            continue
        done += 1
        partition = Partition(outline, holes)
        assert partition_faults(partition, shape.area) == [], f"CHIPWISE_SEED={seed}"
        partition.slimmer()
        partition.merged()
        assert partition_faults(partition, shape.area) == [], f"CHIPWISE_SEED={seed}"
    assert done > 0
    partition.polygons.pop()
    assert partition_faults(partition, shape.area)  # seen to fail


def test_inner_polygons_keep_their_distance():
    """A square with a hole crossing its edge by rounding and a loop turned inside out."""
    square = np.array(((0, 0), (20, 0), (20, 20), (0, 20)), float)
    hole = np.array(((-1e-4, 8), (-1e-4, 12), (4, 12), (4, 8)), float)
    ((outline, holes),) = inner_polygons(square, [hole], 0.1, 0.1)
    assert holes == []
    assert 0.1 <= outline[:, 1].min() <= 0.2 and 0.1 <= outline[:, 0].min() <= 0.2
    assert not ((outline > (-1, 8.5)) & (outline < (4, 11.5))).all(axis=1).any()
    knot = np.array(((0, 0), (20, 0), (20, 20), (9.9, 20), (10.1, 20.1), (0, 20)), float)
    ((outline, _),) = inner_polygons(knot, [], 0.1, 0.1)
    assert outline[:, 1].max() <= 19.95 and outline[:, 0].max() > 19.7


# --- random pockets -----------------------------------------------------------


def faults(job, strategy, step, direction, climb, cell):
    """Everything wrong with what a strategy made of a region."""
    wrong = broken(job) + outside(job) + contours_missed(job, climb)
    if strategy is concentric:
        return wrong + too_far_apart(job, step, cell)
    wrong += residue(job, cell)
    senses = {sense for _, sense in chords(job, direction)}
    if strategy is one_way and not senses <= {1}:
        wrong.append("a cut against the direction")
    if strategy is zigzag and entries(job) != [0]:
        wrong.append(f"entries at tracks {entries(job)}")
    return wrong


def test_random_pockets():
    islands = 0
    for seed in range(random_seed(), random_seed() + random_count(10)):
        fields, radius, step, direction, climb = random_job(seed)
        for field in fields:
            islands += len(field.holes)
            size = math.sqrt(max(field.area, 1e-3))
            for strategy in STRATEGIES:
                job = Cleared(field, strategy(field, radius, step, direction, climb), radius)
                cell = max(size / 45.0, 0.25 * radius)
                found = faults(job, strategy, step, direction, climb, cell)
                assert not found, f"{strategy.__name__} CHIPWISE_SEED={seed}: {found}"
    assert islands or random_count(10) < 8


def test_one_way_cuts_every_stretch_of_wall_once():
    """Apart from the closing round, rows and wall add up to the rows and each contour once."""
    for field in (rectangle(), with_islands()):
        tracks = one_way(field, R, 2.2, 0.4, True)[: -len(field.contours)]
        job = Cleared(field, tracks, R)
        u = np.array((math.cos(0.4), math.sin(0.4)))
        rows = sum(
            length(el)
            for el in job.every
            if el[0] == "L" and abs((el[3] - el[1]) * u[1] - (el[4] - el[2]) * u[0]) < 1e-9 * length(el)
        )
        wall = sum(length(el) for c in job.contours for el in c)
        assert sum(t.length for t in tracks) == pytest.approx(rows + wall)


def test_concentric_leaves_little():
    """Step-over up to 1.6 radii: at most 0.2 % of the raster is left for rest_tracks()."""
    for seed in range(4):
        fields, radius, _, _, climb = random_job(random_seed() + seed)
        for field in fields:
            tracks = concentric(field, radius, 1.6 * radius, 0.0, climb)
            found = residue(Cleared(field, tracks, radius), max(math.sqrt(field.area) / 45.0, 0.1 * radius))
            if found:
                left, _, _, _, total = found[0].split(",")[0].split()
                assert int(left) <= 0.002 * int(total) + 1, found


def test_planning_time():
    """200 elements and three islands, offset and strategy: 300 ms."""
    boundary, islands = big_pocket()
    for strategy in STRATEGIES:

        def plan(strategy=strategy):
            for field in split(boundary, islands, 2.0):
                strategy(field, 2.0, 1.6, 0.3, True)

        assert least_s(plan, 0.3)[1] < 0.3, strategy.__name__


def big_pocket():
    """(boundary of 200 lines and fillets, three islands)."""
    from support.contour_random import ArcElement, LineElement

    parts, n = [], 50
    for k in range(n):
        x0, x1 = 4.0 * k, 4.0 * k + 4.0
        y = 0.0 if k % 2 else -1.5
        parts.append(LineElement((x0 + 0.5, y), (x1 - 0.5, y), len(parts) + 1))
        if k < n - 1:
            up = y < -1.0
            turn = (x1, y + 0.5 if up else y - 0.5)
            parts.append(ArcElement((x1 - 0.5, y), turn, (x1 - 0.5, turn[1]), up, len(parts) + 1))
            y2 = 0.0 if up else -1.5
            before = (x1, y2 - 0.5 if up else y2 + 0.5)
            parts.append(LineElement(turn, before, len(parts) + 1))
            parts.append(ArcElement(before, (x1 + 0.5, y2), (x1 + 0.5, before[1]), not up, len(parts) + 1))
    right, left = (4.0 * n - 0.5, 60.0), (0.5, 60.0)
    parts.append(LineElement((4.0 * n - 0.5, 0.0), right, len(parts) + 1))
    parts.append(LineElement(right, left, len(parts) + 1))
    parts.append(LineElement(left, (0.5, -1.5), len(parts) + 1))
    islands = [circle(9, (40, 30)), polygon((80, 20), (110, 24), (96, 42)), circle(12, (150, 30))]
    return make_contour(parts), islands


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_the_same_job_gives_the_same_tracks(strategy):
    one, two = (strategy(with_islands(), R, 2.2, 0.4, True) for _ in range(2))
    assert all((a.elements.start == b.elements.start).all() for a, b in zip(one, two))


# --- every check seen to fail --------------------------------------------------


def test_checks_see_what_is_wrong():
    field, step, cell = with_islands(), 5.5, 0.3
    tracks = list(one_way(field, R, step, 0.0, True))

    def found(tracks, strategy=one_way):
        return faults(Cleared(field, tracks, R), strategy, step, 0.0, True, cell)

    assert found(tracks) == []
    assert any("left" in w for w in found(tracks[:3] + tracks[4:]))  # a row left out
    moved = make_track(shifted(tracks[5].elements, (0.01, 0.01)))
    assert any("outside" in w for w in found(tracks[:5] + [moved] + tracks[6:]))
    back = make_track(elements.reverse(tracks[4].elements))
    assert any("against" in w for w in found(tracks[:4] + [back] + tracks[5:]))
    assert any("contour" in w for w in found(tracks[:-1]))  # no closing round
    wrong_way = make_track(elements.reverse(tracks[-1].elements))
    assert any("contour" in w for w in found(tracks[:-1] + [wrong_way]))
    torn = make_track(elements.take(tracks[0].elements, np.array([0, 2])))
    assert any("jumps" in w for w in found([torn] + tracks[1:]))


def shifted(e, by):
    return elements.Elements(e.start + by, e.end + by, e.centre + by, e.radius, e.start_angle, e.sweep)


def test_checks_see_a_wide_gap_and_an_entry():
    field = with_islands()
    tracks = concentric(field, R, 2.0, 0.0, True)
    assert too_far_apart(Cleared(field, tracks, R), 2.0, 0.3) == []
    base = make_track(elements.take(tracks[0].elements, np.arange(3)))
    assert too_far_apart(Cleared(field, [base, *tracks[-1:]], R), 2.0, 0.3)
    rows = zigzag(field, R, 2.0, 0.0, True)
    assert entries(Cleared(field, rows, R)) == [0]
    assert entries(Cleared(field, rows[::-1], R)) != [0]


def test_a_row_on_an_edge_is_moved_off_it():
    rows = scanning.spread_rows(np.array([0.0, 5.0, 10.0]), 5.5)
    assert len(rows) == 1 and abs(rows[0] - 5.0) == pytest.approx(scanning.CLEAR_MM)
    rows = scanning.spread_rows(np.array([0.0, 5.0, 10.0]), 5.0)  # no room to move: one more
    assert len(rows) == 2 and np.diff(np.concatenate(([0], rows, [10]))).max() <= 5.0
