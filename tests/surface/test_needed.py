# SPDX-License-Identifier: GPL-2.0-or-later
"""What a stock needs of a path (components/offline/stock_need.c) against cutting it, and the segments that are made of
it."""

import numpy as np
import pytest
from support import drop_oracle
from support.random_cases import random_count, random_seed

from chipwise.clib.height_map import HeightMap, Shape
from chipwise.surface import needed
from chipwise.surface.curve import Curve
from chipwise.clib.drop_cutter import drop_tool

SHAPES = {
    "flat": Shape(4),
    "ball": Shape(4, 2),
    "bull": Shape(4, 0.5),
    "vee": Shape(4, 0, 60),
    "tapered": Shape(4, 0.5, 20),
}
CELL = 0.3


def hills(rng):
    """A map whose needles are at random heights of 0 to 2 mm in patches."""
    found = HeightMap((0, 0, -5), (20, 12, 2), CELL)
    patch = rng.uniform(0, 2, (5, 7))
    rows, columns = found.height.shape
    found.height[:] = patch[np.arange(rows)[:, None] * 5 // rows, np.arange(columns)[None] * 7 // columns]
    return found


def random_chain(rng):
    start, end = rng.uniform(-2, 14, 2), rng.uniform(6, 22, 2)
    share = np.sort(rng.uniform(0, 1, 7))[:, None]
    return np.column_stack([start + share * (end - start), rng.uniform(-1, 2.5, 7)])


def needles_of(stock):
    """(n, 2) places and (n,) heights."""
    x = stock.x0 + stock._x[None, :] + stock.shift_x[:, None]
    y = stock.y0 + stock.cell * np.arange(stock.ny)[:, None] + stock.shift_y[None, :]
    return np.stack([x, y], axis=2).reshape(-1, 2), stock.height.reshape(-1).astype(float)


def left_by(steps, shape, xy):
    """The lowest that a tool leaves of needles on steps [(from, to)], by brute force."""
    height, radius = drop_oracle.profile(shape)
    found = np.full(len(xy), np.inf)
    for a, b in steps:
        for point in np.linspace(a, b, 12):
            r = np.hypot(*(xy - point[:2]).T)
            found = np.minimum(found, np.where(r <= radius, point[2] + height(np.minimum(r, radius)), np.inf))
    return found


@pytest.mark.parametrize("name", SHAPES)
def test_the_needed_steps_do_what_the_whole_path_does(name):
    """And without any one of the first ten of them a needle stays higher."""
    shape, rng = SHAPES[name], np.random.default_rng(random_seed())
    for case in range(random_count(4)):
        stock, chain, least = hills(rng), random_chain(rng), float(rng.uniform(0.02, 0.5))
        points = needed.points_at(chain, needed.steps(chain, CELL))
        wanted = stock.needed(drop_tool(shape), points[:-1], points[1:], least)
        xy, before = needles_of(stock)
        whole, some = (
            np.maximum(np.minimum(before, left_by(steps, shape, xy)), stock.z_min)
            for steps in (
                list(zip(points[:-1], points[1:])),
                [(a, b) for a, b, w in zip(points[:-1], points[1:], wanted) if w],
            )
        )
        steep = np.abs(np.diff(points[:, 2])).max()  # between the ends of a step the lowest is not searched
        assert (some - whole).max() <= least + 2e-4 + 0.1 * steep, (case, (some - whole).max(), least)
        assert (wanted.any()) == ((before - whole).max() > least + 1e-6) or abs(
            (before - whole).max() - least
        ) < 0.1 * steep
        again = stock.needed(drop_tool(shape), points[:-1], points[1:], least)
        assert (again == wanted).all()  # the room to work in is as it was


def test_nothing_is_needed_in_air_and_one_step_where_the_path_is_flat():
    stock = HeightMap((0, 0, -5), (20, 12, 0), CELL)
    tool = drop_tool(SHAPES["flat"])
    for z, wanted in ((0.01, False), (-0.01, False), (-0.2, True)):
        assert (
            len(needed.segments(stock, tool, Curve.straight(np.array([(-5, 6, z), (25, 6, z)])), 0.05)) == 1
        ) is wanted
    (one,) = needed.segments(stock, tool, Curve.straight(np.array([(-5.0, 6, -1), (25, 6, -1)])), 0.05)
    assert (
        -2 - 3 * CELL <= one.low <= -2 + CELL and 18 - CELL <= one.high <= 20 + CELL
    )  # the flat end is 2 mm ahead of the axis, and its sides are not
    stock.cut(SHAPES["flat"], one.curve.points[0], one.curve.points)
    assert needed.segments(stock, tool, Curve.straight(np.array([(-5.0, 6, -1), (25, 6, -1)])), 0.05) == []


def test_gaps():
    """Two islands of stock: two segments, or one if they are less than BRIDGE apart along the cut."""
    for gap, count in ((6.0, 2), (0.6, 1)):
        stock = HeightMap((0, 0, -5), (20, 4, 0), 0.2)
        tool = SHAPES["ball"]
        xy, _height = needles_of(stock)
        stock.height[(np.abs(xy[:, 0] - 10) < gap / 2).reshape(stock.height.shape)] = -5
        found = needed.segments(stock, drop_tool(tool), Curve.straight(np.array([(-5.0, 2, -1), (25, 2, -1)])), 0.05)
        assert len(found) == count
        assert all((part.curve.points[:, 2] == -1).all() for part in found)


def test_clipped():
    chain = Curve.straight(np.array([(0.0, 0, 0), (1, 0, 2), (2, 0, 1), (3, 0, 1), (4, 0, -2)]))
    found = needed.clipped(chain, 1.5).points
    assert found == pytest.approx(np.array([(0, 0, 1.5), (0.75, 0, 1.5), (1, 0, 2), (1.5, 0, 1.5), (4, 0, 1.5)]))
    assert (needed.clipped(chain, -5.0).points == chain.points).all()
    assert needed.clipped(chain, 9.0).points == pytest.approx(np.array([(0, 0, 9), (4, 0, 9)]))


def test_regions_are_cut_as_a_whole_and_the_nearest_is_next():
    def part(track, low, high):
        return needed.Segment(track, low, high, Curve.straight(np.array([(low, track, 0.0), (high, track, 0.0)])))

    given = [part(0, 0, 5), part(0, 20, 25), part(1, 3, 8), part(1, 22, 30), part(2, 50, 60), part(3, 7, 9)]
    found = needed.in_order(given, (24.0, 0.0))
    assert [(one.track, one.low) for one in found] == [(0, 20), (1, 22), (2, 50), (3, 7), (0, 0), (1, 3)]
    assert sorted(map(id, found)) == sorted(map(id, given))


def track_part(track, low, high):
    return needed.Segment(
        track, low, high, Curve.straight(np.array([(low, 0.5 * track, 0.0), (high, 0.5 * track, 0.0)]))
    )


def test_a_ring_is_cut_one_branch_after_the_other():
    """The two sides of a ring, each track after track, then what closes it: no cut before those beside it on the track
    before."""
    given = [
        track_part(0, 2, 8),
        *(track_part(k, low, low + 3) for k in (1, 2, 3) for low in (0, 7)),
        track_part(4, 2, 8),
    ]
    found = [(one.track, one.low) for one in needed.in_order(given, (2.0, 0.0))]
    assert found[0] == (0, 2) and found[-1] == (4, 2)
    assert found[1:-1] in (
        [(1, 0), (2, 0), (3, 0), (1, 7), (2, 7), (3, 7)],
        [(1, 7), (2, 7), (3, 7), (1, 0), (2, 0), (3, 0)],
    )


def random_parts(rng):
    """Up to four parts on each of ten tracks, in the order of the tracks."""
    found = []
    for track in range(10):
        ends = np.sort(rng.uniform(0, 30, 2 * rng.integers(0, 5)))
        found += [track_part(track, *pair) for pair in ends.reshape(-1, 2)]
    return found


def test_order_of_random_parts():
    """Each once, none before those beside it on the track before, and a region as a whole."""
    rng = np.random.default_rng(random_seed())
    for case in range(random_count(50)):
        given = random_parts(rng)
        order = needed.in_order(given, None if case % 2 else tuple(rng.uniform(0, 30, 2)))
        assert sorted(map(id, order)) == sorted(map(id, given)), case
        when = {id(one): k for k, one in enumerate(order)}
        beside = [
            (a, b) for a in given for b in given if b.track == a.track + 1 and a.low <= b.high and b.low <= a.high
        ]
        assert all(when[id(a)] < when[id(b)] for a, b in beside), case
        group = {id(one): id(one) for one in given}
        for _ in given:
            for a, b in beside:
                group[id(a)] = group[id(b)] = min(group[id(a)], group[id(b)])
        changes = sum(group[id(a)] != group[id(b)] for a, b in zip(order, order[1:]))
        assert changes == max(0, len(set(group.values())) - 1), case


def test_a_step_longer_but_not_up_a_wall():
    """Stock beside two walls: the part is from foot to foot; where it ends on the level it is a step longer."""
    stock = HeightMap((0, 0, -5), (20, 4, -0.5), 0.2)
    chain = np.array([(-5.0, 2, 2), (5, 2, 2), (5, 2, -1), (15, 2, -1), (15, 2, 2), (25, 2, 2)])
    (one,) = needed.segments(stock, drop_tool(SHAPES["ball"]), Curve.straight(chain), 0.05)
    assert (one.low, one.high) == (5.0, 15.0) and (one.curve.points[:, 2] == -1).all()
    xy, _height = needles_of(stock)
    stock.height[(xy[:, 0] > 10).reshape(stock.height.shape)] = -5
    (one,) = needed.segments(stock, drop_tool(SHAPES["ball"]), Curve.straight(chain), 0.05)
    assert one.low == 5.0 and 10 - 0.4 <= one.high <= 10 + 3 * 0.2
