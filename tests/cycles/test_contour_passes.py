# SPDX-License-Identifier: GPL-2.0-or-later
"""G77 with several radial passes: chamber by chamber, from the outside in, open paths to and fro."""

import dataclasses
import math

import numpy as np
import pytest
import shapely.geometry as geometry

from support import contour_passes_judge as judge
from support.contour_cycle_judge import judge as keeps, polygon, random_request, request, rounded_square
from support.contour_oracle import from_elements, nearest, point
from support.hole_oracle import walk
from support.random_cases import random_count, random_seed

from chipwise.cycles import contour as cycle
from chipwise.cycles.contour import contour_plan, radial_distances
from chipwise.errors import CycleError
from chipwise.geometry.base import elements as runs
from chipwise.geometry.base.contour import make_contour

# Three chambers in a row, 30 x 30 mm; the necks of 9 mm let only the inner pass of a tool of 6 mm through.
CHAMBERS = (
    (0, 0),
    (30, 0),
    (30, 10),
    (40, 10),
    (40, 0),
    (70, 0),
    (70, 10),
    (80, 10),
    (80, 0),
    (110, 0),
    (110, 30),
    (80, 30),
    (80, 19),
    (70, 19),
    (70, 30),
    (40, 30),
    (40, 19),
    (30, 19),
    (30, 30),
    (0, 30),
)
ROW = request(polygon(*[(float(x), float(y)) for x, y in CHAMBERS]), passes=4, step=2.0, depth_step=4.0)

# A wall with two bends, open.
WALL = request(
    polygon((0.0, 0.0), (40.0, 0.0), (55.0, 15.0), (80.0, 15.0), closed=False),
    side=42,
    passes=3,
    step=2.0,
    depth_step=4.0,
)


def done(r):
    """(elements, finish shape, distances, whether it is closed), kept to every promise of the cycle."""
    elements, contour = walk(contour_plan(r).moves, r.start), make_contour(list(r.shape))
    keeps(r, elements)
    return elements, from_elements(contour.elements), radial_distances(r), contour.closed


def least_entries(r):
    """entries() of the judge for a closed contour."""
    contour = make_contour(list(r.shape))
    outline = geometry.Polygon(
        np.concatenate([point(view, np.linspace(0.0, 1.0, 200)[:-1]) for view in from_elements(contour.elements)])
    ).buffer(0)
    inside = (runs.area(contour.elements) > 0.0) == (r.side == 41)
    levels = 1 if r.depth_step is None else math.ceil((r.clearance - r.bottom) / r.depth_step - 1e-6)
    return judge.entries(outline, inside, radial_distances(r), levels)


def test_chambers_are_finished_one_after_the_other():
    """Three entries a level: a chamber's three outer passes follow one another, and the pass through the necks the last
    chamber."""
    elements, finish, distances, closed = done(ROW)
    assert least_entries(ROW) == 6
    assert judge.lifts(elements) == 5
    assert judge.too_early(elements, finish, distances, closed) == []
    seen = []
    for e in elements:
        if e.kind == "feed" and e.a[2] == e.b[2] and math.dist(e.a[:2], e.b[:2]) > 8:
            middle = np.mean([e.a[:2], e.b[:2]], axis=0)
            seen.append((int(middle[0] // 37), round(float(nearest(finish, middle[None])[0]), 3)))
    first = [one for one in dict.fromkeys(seen) if one[1] in distances][:9]
    assert [d for _, d in first] == [9.0, 7.0, 5.0] * 3 and sorted(c for c, _ in first) == [0] * 3 + [1] * 3 + [2] * 3
    assert [c for c, _ in first] == [first[k - k % 3][0] for k in range(9)]


def test_parted_by_the_inner_pass_each_chamber_goes_to_full_depth():
    """Necks narrower than the tool: one entry a chamber."""
    r = dataclasses.replace(ROW, tool_radius=4.6, step=1.5)
    elements, finish, distances, closed = done(r)
    assert least_entries(r) == 3 and judge.lifts(elements) == 2
    assert judge.too_early(elements, finish, distances, closed) == []


@pytest.mark.parametrize("side", [41, 42])
def test_one_chamber_is_entered_once(side):
    r = request(rounded_square(60.0, 5.0), side=side, passes=4, step=2.0, depth_step=2.0)
    elements, finish, distances, closed = done(r)
    assert judge.lifts(elements) == 0
    assert (
        judge.too_early(elements, finish, distances, closed) == []
        and judge.through(elements, finish, distances, 3.0) < 0.05
    )


def directions(elements):
    """(z, distance, +1 along the first element of the wall, -1 against it) of each pass there."""
    found = []
    for e in elements:
        if e.kind == "feed" and e.a[2] == e.b[2] and abs(e.a[1] - e.b[1]) < 1e-6 and abs(e.b[0] - e.a[0]) > 30:
            found.append((round(e.a[2], 3), round(-e.a[1], 3), int(math.copysign(1, e.b[0] - e.a[0]))))
    return found


def test_open_passes_keep_the_direction_of_the_sub():
    elements, *_ = done(WALL)
    assert {one[2] for one in directions(elements)} == {1}
    assert judge.lifts(elements) == 5


def test_open_passes_to_and_fro_are_entered_once():
    """Six passes: each begins at the end at which the tool is; none is left out or cut out of turn."""
    elements, finish, distances, closed = done(dataclasses.replace(WALL, to_and_fro=True))
    assert directions(elements) == [
        (-2.0, 7.0, 1),
        (-2.0, 5.0, -1),
        (-2.0, 3.0, 1),
        (-6.0, 7.0, -1),
        (-6.0, 5.0, 1),
        (-6.0, 3.0, -1),
    ]
    assert judge.lifts(elements) == 0
    assert (
        judge.too_early(elements, finish, distances, closed) == []
        and judge.through(elements, finish, distances, 3.0) < 2.0
    )


def test_one_pass_in_depths_to_and_fro():
    r = dataclasses.replace(WALL, passes=1, step=None, to_and_fro=True, approach=1.0)
    elements, *_ = done(r)
    assert [one[2] for one in directions(elements)] == [1, -1]
    assert judge.lifts(elements) == 0


def test_random_contours_are_cut_from_the_outside_in():
    """Every promise, whatever the order."""
    count = random_count(6)
    for seed in range(random_seed(), random_seed() + count):
        r = random_request(seed)
        r = dataclasses.replace(
            r,
            passes=3,
            step=0.8 * r.tool_radius,
            finish=False,
            depth_step=6.0,
            approach=None,
            to_and_fro=bool(seed % 2),
        )
        try:
            elements, finish, distances, closed = done(r)
        except CycleError as error:
            assert "fits nowhere" in str(error)
            continue
        assert judge.too_early(elements, finish, distances, closed) == [], (
            f"CHIPWISE_SEED={seed} CHIPWISE_RANDOM_COUNT=1"
        )


# ---- the judge must be able to fail ----------------------------------------------------------------------------------


def test_the_judge_sees_passes_that_are_out_of_turn(monkeypatch):
    """Pass by pass, as it was: too many lifts.  From the inside out: each pass meets what the next should have cut."""

    def planned(chambers):
        monkeypatch.setattr(cycle, "chambers", chambers)
        contour_plan.cache_clear()
        found = done(ROW)
        contour_plan.cache_clear()
        return found

    elements, finish, distances, closed = planned(
        lambda radial, step, normals: [[path for paths in radial for path in paths]]
    )
    assert judge.lifts(elements) > 5 and judge.too_early(elements, finish, distances, closed) == []
    elements, finish, distances, closed = planned(
        lambda radial, step, normals: [[path for paths in radial[::-1] for path in paths]]
    )
    assert len(judge.too_early(elements, finish, distances, closed)) > 50


def test_the_judge_sees_a_link_through_stock():
    elements, finish, distances, closed = done(request(rounded_square(60.0, 5.0), passes=4, step=2.0))
    far = next(k for k, e in enumerate(elements) if e.kind == "arc")
    across = dataclasses.replace(
        elements[far], kind="feed", a=(29.0, 30.0, elements[far].a[2]), b=(31.0, 30.0, elements[far].a[2])
    )
    assert judge.through([*elements[:far], across, *elements[far:]], finish, distances, 3.0) > 20.0
