# SPDX-License-Identifier: GPL-2.0-or-later
"""Paths of constant engagement: the C functions against closed forms and brute force, the path by the exact judge of
support."""

import math

import numpy as np
import pytest
from support import engagement_judge
from support.engagement_shapes import SHAPES
from support.pocket_random import rectangle

from chipwise.geometry.pocket.engage_ground import SLACK, Ground, fitted, patches, rows_of, rule
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.base.elements import make_arcs, make_lines
from chipwise.geometry.pocket import engage, engage_links as links, engage_needles, engage_proof
from chipwise.geometry.pocket.machinable import split

RADIUS, STEP = 3.0, 2.4
STUCK = 2  # CHIP_ENGAGE_STUCK
NOMINAL = math.acos(1.0 - STEP / RADIUS)
STEEP = 0.5  # sine of the angle to a wall


def region(name):
    contours = [make_contour(parts) for parts in SHAPES[name]]
    (found,) = split(contours[0], contours[1:], RADIUS)
    return found


def planned(name):
    return engage.planned(region(name), engage.Cut(RADIUS, STEP, 25.0, 0.2))


def judged(segments):
    """Engagement along the feeds but the entry, by the judge."""
    feeds = [segment for segment in segments if segment.kind in ("entry", "cut", "feed")]
    rows = np.concatenate([rows_of(segment.elements) for segment in feeds])
    asked = np.concatenate([np.full(len(segment.elements), segment.kind != "entry") for segment in feeds])
    return engagement_judge.Engagement(engagement_judge.exact(rows, asked, RADIUS, 0.3))


def line(*points):
    points = np.array(points, float)
    return make_lines(points[:-1], points[1:])


# ---- the judge -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("width", [0.5, 1.5, 2.4, 3.0, 4.5])
def test_the_judge_knows_the_angle_of_a_side_cut(width):
    slot = rows_of(line((0, 0), (40, 0)))
    beside = rows_of(line((0, -width), (40, -width)))
    found = engagement_judge.exact(np.concatenate((slot, beside)), [False, True], RADIUS)
    middle = found[(found[:, 1] > 10) & (found[:, 1] < 30)]
    assert middle[:, 4] == pytest.approx(math.acos(1 - width / RADIUS), abs=1e-6)


def test_the_judge_reads_half_a_turn_in_solid_stock():
    arc = make_arcs(
        np.array([[10.0, 0.0]]), np.array([[0.0, 10.0]]), np.zeros((1, 2)), np.array([10.0]), np.array([math.pi / 2])
    )
    found = engagement_judge.exact(rows_of(arc), [True], RADIUS)
    assert found[20:, 4] == pytest.approx(math.pi, abs=1e-6)


# ---- ground ----------------------------------------------------------------------------------------------------------


def test_engagement_as_the_judge_reads_it():
    found, rng = region("island"), np.random.default_rng(1)
    ground = Ground(found.contours, RADIUS)
    inner = rng.uniform(8.0, 52.0, (8, 2))
    chain = line(*inner)
    ground.clear(chain)
    pose = np.column_stack((rng.uniform(8.0, 52.0, (40, 2)), rng.uniform(0.0, 6.28, 40)))
    ahead = make_lines(pose[:, :2] - 1e-6 * np.column_stack((np.cos(pose[:, 2]), np.sin(pose[:, 2]))), pose[:, :2])
    for k in range(len(pose)):
        told = engagement_judge.exact(
            np.concatenate((rows_of(chain), rows_of(elements.take(ahead, [k])))), [False] * len(chain) + [True], RADIUS
        )[-1, 4]
        fresh = Ground(found.contours, RADIUS)
        fresh.clear(chain)
        assert fresh.along(elements.take(ahead, [k]), 1.0)[0, 3] == pytest.approx(
            told, abs=0.12
        )  # its slack at both ends


@pytest.mark.parametrize("seed", range(6))
def test_cleared_is_what_a_segment_is_near_to(seed):
    """Paths of short arcs and lines that go on from one another, as traces are, over the places of a raster."""
    rng, found = np.random.default_rng(seed), region("island")
    ground = Ground(found.contours, RADIUS)
    place = np.stack(np.meshgrid(*(np.arange(4.0, 56.0, 0.37),) * 2), axis=-1).reshape(-1, 2)
    gap = np.full(len(place), np.inf)
    for _ in range(4):
        heading = np.cumsum(rng.normal(0.0, rng.choice((0.0, 0.05, 0.4)), 80)) + rng.uniform(-3.0, 3.0)
        step = rng.choice((0.02, 0.15, 1.0), 80)[:, None] * np.column_stack((np.cos(heading), np.sin(heading)))
        point = rng.uniform(10.0, 50.0, 2) + np.cumsum(step, axis=0)
        chain = line(*point) if rng.random() < 0.3 else fitted(np.column_stack((point, heading)), 1e-4)
        ground.clear(chain)
        for k in range(len(chain)):
            gap = np.minimum(gap, elements.distances(chain, np.full(len(place), k), place))
        sure = np.abs(gap - RADIUS * (1.0 - SLACK)) > 1e-9
        cleared = ground.rim(place, RADIUS)
        assert np.array_equal(cleared[sure], (gap < RADIUS * (1.0 - SLACK))[sure])
        assert 0 < cleared.sum() < len(place)


@pytest.mark.parametrize("seed", range(4))
def test_patches_hang_together(seed):
    wanted = np.random.default_rng(seed).random((9, 14)) < 0.35
    found = patches(wanted)
    number = np.zeros(wanted.shape, int)
    for k, patch in enumerate(found, 1):
        number[tuple(patch.T)] = k
    assert np.array_equal(number > 0, wanted) and sum(map(len, found)) == wanted.sum() and len(found) > 2
    (i, j), one = np.nonzero(wanted), number[wanted]
    beside = np.maximum(abs(i[:, None] - i), abs(j[:, None] - j)) == 1
    assert (one[:, None] == one)[beside].all()  # none goes on in another
    for k in range(1, len(found) + 1):
        joined = beside[np.ix_(one == k, one == k)] | np.eye((one == k).sum(), dtype=bool)
        assert (np.linalg.matrix_power(joined.astype(float), len(joined)) > 0.0).all()  # and each is in one piece
    assert patches(np.zeros((3, 4), bool)) == []


def test_depth_in_the_region():
    found = region("island")
    ground, point = Ground(found.contours, RADIUS), np.random.default_rng(2).uniform(-2.9, 62.9, (4000, 2))
    x, y = point.T
    inside = np.min([x - 3, 57 - x, y - 3, 57 - y], axis=0)
    outside = -np.hypot(np.maximum(0, np.maximum(3 - x, x - 57)), np.maximum(0, np.maximum(3 - y, y - 57)))
    box = np.where(inside >= 0, inside, outside)
    assert ground.depth(point) == pytest.approx(np.minimum(box, np.hypot(x - 30, y - 30) - 7.0), abs=1e-9)


def test_a_rib_thinner_than_the_tool_is_seen_under_it():
    ground = Ground(region("rectangle").contours, RADIUS)
    for y in (10.0, 16.05):  # a rib of 0.05 mm between two slots
        ground.clear(line((5, y), (50, y)))
    across = line((20, 10), (20, 16.05))
    assert not ground.swept(across, -0.004, 0.01)
    assert ground.swept(line((20, 10), (30, 10)), -0.004, 0.01) and not ground.swept(
        line((20, 10), (30, 10)), 0.2, 0.01
    )
    ground.clear(line((5, 13), (50, 13)))
    assert ground.swept(across, 0.0, 0.01)


def test_what_is_left_is_found():
    found = region("slot")
    ground = Ground(found.contours, RADIUS)
    ground.clear(elements.join(found.contours))
    assert ground.left(0.02)[0] == 0.0
    fresh = Ground(found.contours, RADIUS)
    fresh.clear(elements.take(found.contours[0], np.arange(len(found.contours[0]) - 1)))
    area, place = fresh.left(0.02)
    assert area > 0.3 and Ground(found.contours, RADIUS).depth(place[None])[0] > -RADIUS


def test_fitted_arcs_stay_by_the_poses():
    angle = np.linspace(0.0, 9.0, 400)
    radius = 4.0 + 0.7 * angle
    point = np.column_stack((radius * np.cos(angle), radius * np.sin(angle)))
    heading = angle + np.arctan2(radius, 0.7)
    chain = fitted(np.column_stack((point, heading)), 3e-4)
    assert len(chain) < 100 and np.hypot(*(chain.end[:-1] - chain.start[1:]).T).max() < 1e-12
    gap = np.min([elements.distances(chain, np.full(len(point), k), point) for k in range(len(chain))], axis=0)
    assert gap.max() <= 3e-4 + 1e-9
    out, onto = (elements.tangent_at(chain, np.arange(len(chain)), np.full(len(chain), t)) for t in (1.0, 0.0))
    assert (out[:-1] * onto[1:]).sum(axis=1).min() > 1.0 - 1e-6


# ---- the path --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rho", [1.25, 0.4])
def test_a_trace_keeps_its_angle_and_leaves_room(rho):
    """From cleared ground towards a wall, under many angles: it turns onto the wall, and is nowhere over it, between
    its steps either."""
    stuck = deepest = over = 0
    for angle in np.linspace(-1.3, 0.4, 6):
        ground = Ground(region("rectangle").contours, RADIUS)
        along, left = np.array(((math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))))
        start = np.array((30.0, 6.5)) - along
        for aside in range(0, 13, 2):
            ground.clear(line(start + aside * left - 14.0 * along, start + aside * left + along))
        steps, why = ground.trace((*start, angle), rule(NOMINAL, rho, 0.0, 0.15, 2.4), True, 160)
        over = max(over, steps[:, 3].max() - NOMINAL)
        chain = fitted(np.vstack([[(*start, angle)], steps[:, :3]]), 1e-5)
        index = np.repeat(np.arange(len(chain)), 9)
        deepest = max(
            deepest, -ground.depth(elements.point_at(chain, index, np.tile(np.linspace(0, 1, 9), len(chain)))).min()
        )
        stuck += bool(why & STUCK)
    assert stuck == 0 and deepest < 6e-4 and over < 0.17


def into_walls(name, rho, count=20):
    """(mm of the deepest dip into a wall, paths whose cut ended steeply in front of one) of traces from places with
    room, stock on their right."""
    found, rng = region(name), np.random.default_rng(1)
    low, high = (f(part, axis=0) for f, part in zip((np.min, np.max), elements.boxes(found.boundary)))
    point = rng.uniform(low, high, (400, 2))
    deepest = stuck = 0
    for place in point[Ground(found.contours, RADIUS).depth(point) > 3.0 * rho][:count]:
        ground, angle = Ground(found.contours, RADIUS), rng.uniform(0.0, 2.0 * math.pi)
        along, left = np.array(((math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))))
        for aside in STEP * np.arange(1, 16):
            ground.clear(line(place + aside * left - 4.0 * along, place + aside * left + 40.0 * along))
        steps, why = ground.trace((*place, angle), rule(NOMINAL, rho, 0.0, min(0.15, 0.5 * rho), 2.4), True, 400)
        chain = fitted(np.vstack([[(*place, angle)], steps[:, :3]]), 1e-6)
        index = np.repeat(np.arange(len(chain)), 17)
        deepest = max(
            deepest,
            -ground.depth(elements.point_at(chain, index, np.tile(np.linspace(0.0, 1.0, 17), len(chain)))).min(),
        )
        (x, y), heading = steps[-1, :2], steps[-1, 2]
        before, at = ground.depth(np.array([(x - 0.01 * math.cos(heading), y - 0.01 * math.sin(heading)), (x, y)]))
        stuck += bool(why & STUCK) and before - at > 0.01 * STEEP and steps[-1, 3] > 0.0
    return deepest, stuck


@pytest.mark.parametrize("name, rho", [("rectangle", 1.25), ("island", 0.4)])
def test_a_trace_can_turn_away_from_every_wall(name, rho):
    deepest, stuck = into_walls(name, rho)
    assert stuck == 0 and deepest < 6e-4


@pytest.mark.parametrize("name, rho", [("L", 0.4), ("star", 0.1)])
def test_a_trace_does_not_dip_into_a_wall_between_its_steps(name, rho):
    assert into_walls(name, rho)[0] < 6e-4  # three times what it may touch


@pytest.mark.parametrize("name", ["island", "star"])
def test_whether_a_link_stays_in_the_region(name):
    """Against places of it 0.02 mm apart."""
    ground, rng = Ground(region(name).contours, RADIUS), np.random.default_rng(3)
    low, high = (f(np.concatenate([c.start for c in region(name).contours]), axis=0) for f in (np.min, np.max))
    stayed = 0
    for _ in range(300):
        pose = np.column_stack((rng.uniform(low, high, (2, 2)), rng.uniform(-3.0, 3.0, 2)))
        for link in (make_lines(pose[:1, :2], pose[1:, :2]), fitted(pose, 1.0)):
            least = min(
                ground.depth(elements.point_at(link, np.full(n, k), np.linspace(0.0, 1.0, n))).min()
                for k, length in enumerate(elements.lengths(link))
                for n in (int(length / 0.02) + 2,)
            )
            if abs(least) > 0.02:
                assert links.inside(ground, link) == (least > 0.0), (pose, least)
                stayed += least > 0.0
    assert stayed > 10


def test_places_with_a_clearance_as_the_ground_grows():
    planner = engage.Planner(region("rectangle"), engage.Cut(RADIUS, STEP, 25.0, 0.2))
    for y in (10.0, 14.0, 18.0):
        planner.ground.clear(line((10, y), (40, y)))
        planner.grid.refresh()
        found, fresh = (
            planner.grid.roomy(0.2),
            planner.ground.rim(planner.grid.point.reshape(-1, 2), -0.2).reshape(planner.grid.cleared.shape),
        )
        assert np.array_equal(found, fresh & planner.grid.cleared & (planner.grid.depth >= 0.2)) and found.any() == (
            y > 10.0
        )


def test_a_corner_is_left_on_an_arc():
    """At the end of a path that heads for the wall by 5 degrees, on ground too narrow for an arc along it."""
    planner = engage.Planner(region("rectangle"), engage.Cut(RADIUS, STEP, 25.0, 0.2))
    for y in (37.0, 36.0, 34.0, 32.0):
        planner.ground.clear(line((40, y), (57, y)))
    planner.grid.refresh()
    for pose, backwards in (((56.9, 37.0, math.radians(175)), False), ((41.0, 37.0, math.radians(185)), True)):
        link = links.link_out(planner.ground, planner.grid, pose, 0.2, backwards)
        assert len(link) == 1 and link.is_arc[0] and links.inside(planner.ground, link)
        end, at = (link.start[0], 1.0) if backwards else (link.end[0], 0.0)
        assert planner.ground.rim(end[None], -0.2)[0]
        along = elements.tangent_at(link, np.array([0]), np.array([at]))[0]
        assert along @ (math.cos(pose[2]), math.sin(pose[2])) > math.cos(0.21)


def test_the_tool_leaves_a_wall_before_it_goes_up():
    """Of a wall that is run all around: over its seam, and away on an arc tangent to it."""
    planner = engage.Planner(region("circle"), engage.Cut(RADIUS, STEP, 25.0, 0.2, overlap=0.3))
    (wall,) = planner.walls
    planner.ground.clear(wall.contour)
    planner.ground.clear(
        make_arcs(
            np.array([[19.6, 0.0]]),
            np.array([[19.6, 0.0]]),
            np.zeros((1, 2)),
            np.array([19.6]),
            np.array([2 * math.pi]),
        )
    )
    planner.pose = (19.6, 0.0, math.pi / 2)
    planner._along_wall(wall.contour)
    run = planner.segments[-1].elements
    assert elements.lengths(run).sum() == pytest.approx(44 * math.pi + 0.3, abs=1e-6)
    planner._over((0.0, 0.0))
    off, up = planner.segments[-2:]
    assert off.kind == "feed" and up.kind == "over" and np.array_equal(up.elements.start[0], off.elements.end[-1])
    assert off.elements.is_arc.all() and planner.ground.depth(up.elements.start)[0] >= 0.2 - 1e-6
    before, after = (
        elements.tangent_at(e, np.array([k]), np.array([t]))[0]
        for e, k, t in ((run, len(run) - 1, 1.0), (off.elements, 0, 0.0))
    )
    assert before @ after > 1.0 - 1e-9


def test_the_tool_does_not_go_down_onto_a_rib():
    """No link leads to a place with a rib of 0.05 mm under the tool: it cannot be gone to from above either."""
    planner = engage.Planner(region("rectangle"), engage.Cut(RADIUS, STEP, 25.0, 0.2))
    for y in (10.0, 16.05):
        planner.ground.clear(line((5, y), (50, y)))
    planner.pose = (10.0, 10.0, 0.0)
    assert not planner._go((20.0, 13.0, 0.0)) and planner.segments == []
    planner.ground.clear(line((19, 13), (21, 13)))
    assert planner._go((20.0, 13.0, 0.0)) and planner.segments


@pytest.mark.parametrize("name", ["rectangle", "slot", "circle"])
def test_engagement_of_a_whole_pocket(name):
    segments = planned(name)
    found, proof = judged(segments), engage_proof.prove(region(name), segments, RADIUS, NOMINAL)
    assert found.percentile(0.99) < NOMINAL + math.radians(3) and found.most < NOMINAL + math.radians(10)
    assert found.length(engagement_judge.FULL) == 0.0
    assert proof.left_mm2 == 0.0 and proof.gouge < 1e-3 and proof.rapid_at is None and proof.plunge_at is None
    assert not proof.over or found.most > NOMINAL + engage_proof.OVER - 0.1


def test_the_certificate_names_a_slot():
    """The ring along a wall in solid stock is a full slot, and the middle is left."""
    found = region("rectangle")
    proof = engage_proof.prove(found, [engage.Segment("cut", found.boundary)], RADIUS, NOMINAL)
    assert proof.longest[3] > engage_proof.FULL and proof.longest[2] > 40.0 and proof.left_mm2 > 500.0


def test_the_certificate_names_a_rapid_and_a_descent_in_stock():
    found = region("rectangle")
    first, away = line((10, 10), (20, 10)), line((20, 10), (40, 30))
    segments = [
        engage.Segment("cut", first),
        engage.Segment("rapid", away),
        engage.Segment("cut", line((40, 30), (45, 30))),
    ]
    assert engage_proof.prove(found, segments, RADIUS, NOMINAL).rapid_at == (20.0, 10.0)
    segments[1] = engage.Segment("over", away)
    assert engage_proof.prove(found, segments, RADIUS, NOMINAL).plunge_at == (40.0, 30.0)


def test_needles_between_paths_are_run_over():
    """A rib of 0.1 mm between two sweeps."""
    part = split(make_contour(rectangle(0, 0, 24, 20)), [], 3.0)[0]
    one = engage.Planner(part, engage.Cut(3.0, 2.4, 25.0, 0.2))
    for y in (3.0, 9.1, 14.0, 17.0):
        one.ground.clear(line((3.0, y), (21.0, y)))
    for x in (3.0, 21.0):
        one.ground.clear(line((x, 3.0), (x, 17.0)))
    one.pose = (3.0, 3.0, 0.0)
    before, _ = one.ground.left(engage_proof.FINE_MM)
    engage_needles.clear(one)
    after, place = one.ground.left(engage_proof.FINE_MM)
    assert before > 0.5 and after == 0.0, place
    cuts = [s.elements for s in one.segments if s.kind == "cut"]
    assert 1 < len(cuts) < 20 and all((one.ground.depth(c.end) >= -1e-6).all() for c in cuts)
