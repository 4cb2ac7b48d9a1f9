# SPDX-License-Identifier: GPL-2.0-or-later
"""An assumed stock that goes on in a larger box: never less than is there, and what was cut stays cut."""

import math
import random

import numpy as np
import pytest

from chipwise.monitor.joined_stock import around, join, turned
from chipwise.clib import core, layout
from chipwise.stock.shared import SharedStock, mean_heights
from support.random_cases import random_count

ROOM = (0.1, 0.25, 2_000_000)


def taken(stock):
    return SharedStock(memoryview(stock._block)).take()


def cut(stock, turn, middle, path, diameter=6.0):
    """A flat tool along places (x, y, z) of the upright box."""
    places = [(*np.add(turned(np.subtract(place[:2], middle), turn), middle), place[2]) for place in path]
    cutter = core.Cutter(stock, core.Tool(diameter), places[0])
    for place in places[1:]:
        cutter.to(place)
    cutter.run()


def heights(stock):
    return mean_heights(stock.cells, stock.head)


def at(stock, values, x, y):
    head = stock.head
    return values[int((y - head.y0) / head.cell), int((x - head.x0) / head.cell)]


@pytest.mark.parametrize("cell", [0.1, 0.133333333])  # 40 mm have 301 cells of 0.133333333: the last one is empty
@pytest.mark.parametrize(
    "low, high",
    [
        ((0, 0, -10), (60, 40, 0)),
        ((-11.3, -4.7, -14), (71.9, 40, 0)),
        ((0, 0, -12), (40, 30, 0)),
        ((5, 5, -3), (55, 30, 2)),
    ],
)
def test_the_cut_of_before_is_there(low, high, cell):
    """The same slot in the larger box from the beginning is the truth: equal in the old box, and never lower."""
    old = ((0.0, 0.0, -10.0), (40.0, 30.0, 0.0))
    first = core.Stock(*old, core.CellSides(0.25, cell), 1_000_000)
    slot = [(-9, 14.07, -4.2), (30.11, 14.07, -4.2), (30.11, 25, -4.2)]
    cut(first, 0.0, (0, 0), slot)
    box = around(old, (tuple(map(float, low)), tuple(map(float, high))), 0.0)
    assert np.allclose(box, (tuple(map(min, old[0], low)), tuple(map(max, old[1], high))))
    joined = join(*taken(first), box, 0.0, (cell, 0.25, 1_000_000))
    head = joined.head
    truth = core.Stock((head.x0, head.y0, box[0][2]), box[1], head.cell, 1_000_000)
    cut(truth, 0.0, (0, 0), [place if place[0] > 0 else (0.0 - 3.0, *place[1:]) for place in slot])
    difference = heights(joined) - heights(truth)
    assert (head.z_min, head.z_max) == (box[0][2], box[1][2]) and head.nx >= (box[1][0] - box[0][0]) / head.cell - 1
    x, y = (first + (np.arange(n) + 0.5) * head.cell for first, n in ((head.x0, head.nx), (head.y0, head.ny)))
    inside = (np.abs(x - 20) < 20 - head.cell)[None, :] & (np.abs(y - 15) < 15 - head.cell)[:, None]
    assert np.abs(difference[inside]).max() < 2e-3 * (head.z_max - head.z_min)
    assert difference[:, x > 0].min() > -1e-3
    outside = (x > 40 + head.cell)[None, :] | (y > 30 + head.cell)[:, None]
    assert np.abs(difference[outside]).max(initial=0.0) < 1e-6


def test_a_bottom_that_was_cut_through_is_there_in_a_deeper_box():
    old = ((0.0, 0.0, -5.0), (40.0, 30.0, 0.0))
    first = core.Stock(*old, 0.25, 400_000)
    cut(first, 0.0, (0, 0), [(-9, 15, -5), (60, 15, -5)])
    joined = join(*taken(first), around(old, ((0.0, 0.0, -9.0), (40.0, 30.0, 1.0)), 0.0), 0.0, (0.25, 0.25, 400_000))
    found = heights(joined)
    assert at(joined, found, 20, 15) == pytest.approx(-5, abs=1e-3) and at(joined, found, 20, 25) == 1.0
    assert at(joined, found, 39.9, 15) == pytest.approx(-5, abs=1e-3)  # also at its edge


@pytest.mark.parametrize("seed", range(9310, 9310 + random_count(12)))
def test_random_boxes_and_turns_never_lose_material(seed):
    """Turned, with a map that has no room for the old cells, or with it: at random places the joined stock is as high
    as the old one, and as the new top where nothing was cut."""
    rng = random.Random(seed)
    turn = rng.choice([0.0, rng.uniform(-1, 1)])
    old = ((0.0, 0.0, -8.0), (rng.uniform(20, 40), rng.uniform(15, 30), 0.0))
    old = tuple(tuple(float(v) for v in corner) for corner in old)
    first = core.Stock(*old, core.CellSides(0.25, 0.1), 400_000, turn=turn)
    middle = [(a + b) / 2 for a, b in zip(old[0][:2], old[1][:2])]
    y = rng.uniform(6, old[1][1] - 6)
    cut(first, turn, middle, [(-9, y, -3), (old[1][0] - 8, y, -3)])
    low = [rng.uniform(-12, 4), rng.uniform(-12, 4), rng.uniform(-12, -6)]
    high = [rng.uniform(25, 55), rng.uniform(20, 45), rng.choice([0.0, 1.5])]
    box = around(old, (tuple(low), tuple(high)), turn)
    joined = join(*taken(first), box, turn, (0.1, 0.25, rng.choice([150_000, 2_000_000])))
    before, after, head = heights(first), heights(joined), joined.head
    step = max(head.cell, first.head.cell)
    for _ in range(400):
        flat = rng.uniform(-8, 50), rng.uniform(-8, 40)
        place = np.add(turned(np.subtract(flat, middle), turn), middle)
        if not all(
            a + 1.5 * step < v < b - 1.5 * step for v, a, b in zip(turned(place, -turn), *(turned_box(box, turn)))
        ):
            continue
        in_old = all(a + 2 * step < v < b - 2 * step for v, a, b in zip(flat, old[0][:2], old[1][:2]))
        beyond = not all(a - 2 * step < v < b + 2 * step for v, a, b in zip(flat, old[0][:2], old[1][:2]))
        had = at(first, before, *place) if in_old else None
        now = at(joined, after, *place)
        slot = abs(flat[1] - y) < 3 - 2.5 * step and flat[0] < old[1][0] - 8
        if beyond or (in_old and abs(flat[1] - y) > 3 + 2.5 * step):
            assert now == pytest.approx(head.z_max, abs=1e-6), (seed, flat)
        elif in_old and slot:
            assert had - 1e-3 <= now <= had + 2e-3 * (head.z_max - head.z_min) + 1e-3, (seed, flat)


def turned_box(box, turn):
    """(low, high) in X, Y of a box that is turned about its own middle, in its own directions."""
    low, high = box
    middle = turned([(a + b) / 2 for a, b in zip(low[:2], high[:2])], -turn)
    half = [(b - a) / 2 for a, b in zip(low[:2], high[:2])]
    return [m - h for m, h in zip(middle, half)], [m + h for m, h in zip(middle, half)]


def test_the_box_around_two_that_are_turned():
    """Both boxes in their own directions: one from 0 to 10, the other from 5 to 30, turned by a quarter."""
    turn = math.pi / 2

    def placed(low, high):
        middle = turned([(a + b) / 2 for a, b in zip(low, high)], turn)
        half = [(b - a) / 2 for a, b in zip(low, high)]
        return (*(m - h for m, h in zip(middle, half)), -5.0), (*(m + h for m, h in zip(middle, half)), 0.0)

    found = around(placed((0, 0), (10, 10)), placed((5, 2), (30, 6)), turn)
    wanted = placed((0, 0), (30, 10))
    assert np.allclose(found[0], wanted[0]) and np.allclose(found[1], wanted[1])


def test_no_room():
    first = core.Stock((0, 0, -5), (40, 30, 0), 0.25, 30_000)
    with pytest.raises(core.CoreError):
        join(*taken(first), ((0.0, 0.0, -5.0), (4000.0, 30.0, 0.0)), 0.0, (0.25, 0.25, 30_000))
    assert layout.RIM
