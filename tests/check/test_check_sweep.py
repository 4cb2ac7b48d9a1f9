# SPDX-License-Identifier: GPL-2.0-or-later
"""The offline sweep (components/offline/height_sweep.c) against closed forms and against an oracle of fine needles.

Depth is at most one cell more than the oracle's, and never less but for remains smaller than a cell; check_oracle.py
shares nothing with the sweep.
"""

import math
import os

import numpy as np
import pytest
from support.check_oracle import Needles
from support.random_cases import random_count

from chipwise.clib.height_map import CYLINDER, HeightMap, Shape, times

CELL = 0.25
COUNT = random_count(6)
SEED = int(os.environ.get("CHIPWISE_SEED", "1"))
SKINS = 0.02, 0.001  # mm: the oracle's tool made smaller, for the lower and the upper bound
SLACK = 0.3  # cells below the oracle: the ridge between two needles on a steep slope
LENS = 1.1  # mm late, for cells and radii of 1 mm: (cells^2 x 1.63 / sqrt(2 x radius))^(2/3)
LATE = (
    LENS * CELL ** (4 / 3) * 1.5 ** (-1 / 3)
)  # mm, for the smallest radius here; times the slope of a rise it is in the depth
STEP_OVER = 0.03  # mm, the oracle's step
SELDOM = 0.02  # of the moves may be below,
FAR_SELDOM = 0.01  # and by more than SLACK: what is left of a ridge, smaller than a cell, falls between the needles


def cut(stock, tool, *places):
    return stock.cut(tool, places[0], np.array(places[1:], float))


def test_slot():
    stock = HeightMap((0, 0, -20), (100, 60, 0), 0.1)
    met = cut(stock, Shape(6), (-5, 30, -5), (105, 30, -5))[0]
    assert met["volume"] == pytest.approx(100 * 6 * 5, rel=1e-3)
    assert met["depth"] == pytest.approx(5.0, abs=1e-4)


@pytest.mark.parametrize("angle", [0, 7, 30, 45, 61, 90])
def test_wall_followed_again_is_not_met(angle):
    """A wall in levels: each level counts alone, whatever the wall's direction."""
    stock = HeightMap((-30, -30, -20), (30, 30, 0), CELL)
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    for level in range(1, 7):
        a, b = [(t * 50 * c, t * 50 * s, -3.0 * level) for t in (-1, 1)]
        met = cut(stock, Shape(6), (*a[:2], 5), a, b)
        assert met["depth"].max() == pytest.approx(3.0, abs=0.01)


@pytest.mark.parametrize("angle", [0, 7, 30, 45, 61, 90])
@pytest.mark.parametrize("allowance", [0.02, 0.05, 0.2])
def test_thin_wall_is_met_at_full_depth(angle, allowance):
    """A strip far narrower than a cell, left at a wall, counts with the wall's height."""
    stock = HeightMap((-30, -30, -20), (30, 30, 0), CELL)
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    for level in range(1, 5):
        cut(stock, Shape(6), (-50 * c, -50 * s, 5), (-50 * c, -50 * s, -4.0 * level), (50 * c, 50 * s, -4.0 * level))
    x, y = -s * allowance, c * allowance
    met = cut(stock, Shape(6), (x - 50 * c, y - 50 * s, -16), (x + 50 * c, y + 50 * s, -16))
    assert met["depth"][0] == pytest.approx(16.0, abs=0.01)


def test_plunge_and_helix_are_not_deep():
    """What is below a tool is cut as it comes down; the depth of a plunge is no more than a cell."""
    stock = HeightMap((0, 0, -20), (40, 40, 0), CELL)
    assert 0 < cut(stock, Shape(6), (20, 20, 2), (20, 20, -15))["depth"][0] <= CELL


SHAPES = {"flat": Shape(6), "ball": Shape(6, 3), "bull-nose": Shape(6, 1), "cone": Shape(6, 0, 90)}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("step", [0.002, 0.005, 0.01, 0.03, 0.1, 1.0])
def test_moves_of_micrometres_are_as_deep_as_long_ones(shape, step):
    """Each stamp comes nearer to the stock than the skin is thick: none may be lost."""
    stock = HeightMap((0, 0, -20), (60, 40, 0), CELL)
    y = np.arange(-4.0, -1.0, step)
    met = stock.cut(SHAPES[shape], (30, -4.5, -10), np.column_stack((np.full(len(y), 30.0), y, np.full(len(y), -10.0))))
    assert met["depth"].max() == pytest.approx(10.0, abs=0.01)
    again = stock.cut(
        SHAPES[shape], (30, -4.5, -10), np.column_stack((np.full(len(y), 30.0), y + 0.3 * step, np.full(len(y), -10.0)))
    )
    assert again["depth"][:-3].max(initial=0.0) == 0.0


@pytest.mark.parametrize("step", [0.002, 0.01, 0.03])
@pytest.mark.parametrize("end", [(0, 0, 5), (3, 0, -5)])
def test_no_skin_is_left_where_short_moves_end(step, end):
    """Moves of micrometres spare the skin, and the whole tool follows: behind the move after them no needle under
    it stands higher than its tip."""
    stock = HeightMap((0, 0, -20), (40, 40, 0), 0.1)
    x = np.arange(15, 20, step)
    stock.cut(Shape(6), (15, 20, -5), np.column_stack((x, np.full(len(x), 20.0), np.full(len(x), -5.0))))
    stock.cut(Shape(6), (x[-1], 20, -5), np.array([(x[-1] + end[0], 20 + end[1], end[2])], float))
    u = stock.x0 + np.arange(stock.nx) * stock.cell + stock.shift_x[:, None] - x[-1]
    v = stock.y0 + np.arange(stock.ny)[:, None] * stock.cell + stock.shift_y - 20
    under = u**2 + v**2 < (3 - 1e-5) ** 2
    assert under.sum() > 2500 and stock.height[under].max() == -5.0


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("angle", [45, 60, 75, 80, 85, 88])
@pytest.mark.parametrize("pieces", [1, 40])
def test_a_steep_move_meets_the_wall_beside_it(shape, angle, pieces):
    """20 mm up or down, 0.2 mm beside the stock at its start: the side comes to the wall, and does so on and on."""
    slope = math.tan(math.radians(angle))
    rise = np.linspace(0.0, 1.0, pieces + 1)[:, None]
    for a, b in ((-25.0, -5.0), (-5.0, -25.0)):
        stock = HeightMap((0, 0, -40), (60, 40, 0), CELL)
        path = np.array([30, -3.2, a]) + rise * [0, 20 / slope, b - a]
        depth = stock.cut(SHAPES[shape], path[0], path[1:])["depth"].max()
        truth = 25.0 - 0.2 * slope if a < b else 25.0
        late = 0.06 * slope  # mm: the nearest needle is so far behind the wall's face
        assert truth - late - 0.01 <= depth <= truth + CELL


def test_drill_volume_and_cylinder():
    stock = HeightMap((-20, -20, -10), (20, 20, 0), 0.1, CYLINDER)
    assert stock.volume() == pytest.approx(math.pi * 400 * 10, rel=1e-3)
    met = cut(stock, Shape(8, 4), (0, 0, 1), (0, 0, -6))
    assert met["volume"][0] == pytest.approx(math.pi * 16 * 2 + math.pi * 64 * 2 / 3, rel=5e-3)


def test_cone_volume():
    stock = HeightMap((0, 0, -10), (60, 20, 0), 0.1)
    met = cut(stock, Shape(12, 0, 90), (-10, 10, -4), (70, 10, -4))
    assert met["volume"][0] == pytest.approx(60 * 16, rel=0.01)


def test_turned_box():
    stock = HeightMap((-20, -10, -5), (20, 10, 0), 0.1, turn=30.0)
    assert stock.volume() == pytest.approx(40 * 20 * 5, rel=1e-3)
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    met = cut(stock, Shape(4), (-40 * c, -40 * s, -2), (40 * c, 40 * s, -2))
    assert met["volume"][0] == pytest.approx(40 * 4 * 2, rel=3e-3)


def test_holder():
    stock = HeightMap((0, 0, -30), (60, 60, 0), CELL)
    tool = Shape(6, holder_diameter=30, stick_out=10)
    met = cut(stock, tool, (-40, 30, -8), (30, 30, -8), (30, 30, -12))
    assert met["holder"][0] == 0
    assert met["holder"][1] == pytest.approx(2.0, abs=1e-3)


def test_far_and_hostile_moves():
    stock = HeightMap((0, 0, -5), (10, 10, 0), CELL)
    met = cut(stock, Shape(6), (-1e5, 5, -1), (1e5, 5, -1), (1e5, 1e5, 1e5), (5, 5, -1e5))
    assert met["volume"][0] == pytest.approx(60, rel=0.01)
    assert np.isfinite([met[name] for name in met.dtype.names]).all()


@pytest.mark.parametrize("case", range(COUNT * 4))
def test_moves_straight_along_the_axis_are_cut_as_if_every_step_were(case):
    """The shortcut of plunges and retracts changes no bit: beside them, 5e-324 mm aside, it is not taken."""
    rng = np.random.default_rng(SEED * 1000 + case)
    cell = rng.uniform(0.21, 0.31)
    stocks = [HeightMap((-9.3, -11.1, -20), (10.7, 8.4, 0), cell) for _ in range(2)]
    tool = [Shape(6), Shape(5, 2.5), Shape(6, 1.1), Shape(8, 0.2, 60), Shape(4, holder_diameter=11.0, stick_out=7.7)][
        case % 5
    ]
    places = [np.array((0.0, -20.0, 5.0))]
    for _ in range(14):
        low, y = rng.uniform((-24, -12), (3, 9))
        places += [(0.0, y, 5.0), (0.0, y, low), (0.0, y, max(low, rng.uniform(-20, 5))), (0.0, y, 5.0)]
        if rng.random() < 0.5:
            a, b = rng.uniform((-12, -12, -15), (12, 10, 2), (2, 3))
            places += [(*a[:2], 5.0), a, b, (*b[:2], 5.0)]
    places = np.array(places)
    aside = places.copy()
    upright = (places[:, 0] == 0.0) & (np.arange(len(places)) % 2 == 1)
    aside[upright, 0] = 5e-324
    one, two = (stock.cut(tool, own[0], own[1:]) for stock, own in zip(stocks, (places, aside)))
    assert (one["depth"] > 0.1).sum() > 2 and upright.sum() > 14
    assert (stocks[0].height == stocks[1].height).all() and (one == two).all()


def random_case(seed):
    """(judged, lower, upper, mm that it may be less for a late needle) of the depths of a random program, and the two
    volumes left."""
    rng = np.random.default_rng([SEED, seed])
    diameter = rng.choice([3.0, 4.0, 6.0])
    tool = [(diameter, 0, 0), (diameter, diameter / 2, 0), (diameter, 0.5, 0), (diameter, 0, 90.0)][seed % 4]
    low, high = (0, 0, -12), (14, 12, 0)
    stock, needles = HeightMap(low, high, CELL), Needles(low, high, 0.05)
    here, before, depths = np.array([-2.0, rng.uniform(0, 12), 2.0]), None, []
    for _ in range(12):
        there = np.array([rng.uniform(-3, 17), rng.uniform(-3, 15), rng.uniform(-9, 1)])
        kind = rng.integers(5)
        if kind == 0:
            there[2] = here[2]
        elif kind == 1:
            there[:2] = here[:2]
        elif kind == 2 and before is not None:
            there = before
        elif kind == 3:
            there[1:] = here[1:]
        lower, upper = needles.move(tool, here, there, SKINS)
        late = LATE * max(there[2] - here[2], 0.0) / max(math.dist(here[:2], there[:2]), 1e-6)
        depths.append((float(stock.cut(Shape(*tool), here, there[None])["depth"][0]), lower, upper, late))
        before, here = here, there
    return np.array(depths), stock.volume(), needles.volume()


def verdict(depths):
    """Moves whose judged depth is below the oracle's, and that by more than seldom is allowed; moves more than a cell
    above."""
    judged, lower, upper, late = depths.T
    return (judged < lower - late - 1e-3), (judged < lower - late - SLACK * CELL), (judged > upper + CELL + 1e-3)


def test_random_programs_against_fine_needles():
    cases = [random_case(seed) for seed in range(COUNT)]
    depths = np.concatenate([case[0] for case in cases])
    below, far_below, above = verdict(depths)
    assert not above.any(), depths[above]
    assert below.sum() <= 1 + SELDOM * len(depths), depths[below]
    assert far_below.sum() <= 1 + FAR_SELDOM * len(depths), depths[far_below]
    for _depths, left, truth in cases:
        assert left == pytest.approx(truth, abs=0.005 * 14 * 12 * 12)


@pytest.mark.parametrize("case", range(4 * COUNT))
def test_random_steep_moves_to_a_wall_against_fine_needles(case):
    rng = np.random.default_rng([SEED, case])
    radius, angle, slope = rng.choice([1.5, 3.0]), rng.uniform(-1, 1), math.tan(math.radians(rng.uniform(60, 88)))
    corner = [0.0, radius, 0.5][case % 3]
    gap, inside = rng.uniform(0.05, 0.3), rng.uniform(0.3, 0.5)  # mm before the wall, and in it
    ahead = np.array([math.tan(angle), 1.0]) * (gap + inside)
    rise = slope * math.hypot(*ahead) * (1 if case % 2 else -1)
    here = np.array([rng.uniform(9, 11), -radius - gap, -5.0 - max(rise, 0.0)])
    there = here + (*ahead, rise)
    low, high = (0, 0, -40), (20, 6, 0)
    judged = float(HeightMap(low, high, CELL).cut(Shape(2 * radius, corner), here, there[None])["depth"][0])
    (truth,) = Needles(low, high, 0.1).move((2 * radius, corner, 0.0), here, there, SKINS[:1])
    late = (LENS * CELL ** (4 / 3) * radius ** (-1 / 3) + 0.004) * slope / math.cos(angle)
    early = (0.04 + SKINS[0]) * slope / math.cos(angle)  # the oracle's own needles are late, too
    assert truth > 3.0 and truth - late - SLACK * CELL <= judged <= truth + early + CELL, (judged, truth, late, early)


@pytest.mark.parametrize("angle", [60, 80, 88])
def test_the_oracle_sees_steep_moves_and_moves_of_micrometres(angle):
    """The wall of test_a_steep_move_meets_the_wall_beside_it, and the same contact in level steps of 2 um."""
    slope, skins = math.tan(math.radians(angle)), (0.02, 0.004, 0.001)
    for a, b in ((-25.0, -5.0), (-5.0, -25.0)):
        needles = Needles((20, 0, -40), (40, 10, 0), 0.1)
        found = np.array(needles.move((6, 0, 0), (30, -3.2, a), (30, -3.2 + 20 / slope, b), skins))
        behind = 0.037 + np.array(skins) + STEP_OVER  # mm: the first needles, and the oracle's step
        truth = 25.0 - (0.2 + behind) * slope if a < b else np.full(3, 24.8)
        assert (found >= truth - 0.02).all() and (found <= (25.0 - 0.2 * slope if a < b else 25.0) + 0.02).all()
        again = needles.move((6, 0, 0), (30, -3.2, a), (30, -3.2 + 20 / slope, b), skins)
        assert np.array(again).max() <= 0.02  # what it has cut is not met again
    needles, here, depth = Needles((20, 0, -40), (40, 10, 0), 0.1), np.array([30.0, -3.05, -9.0]), 0.0
    for _ in range(60):
        depth = max(depth, *needles.move((6, 0, 0), here, here + (0, 0.002, 0), skins[:2]))
        here = here + (0, 0.002, 0)
    assert depth == pytest.approx(9.0)


@pytest.mark.parametrize("cell, radius", [(0.1, 1.5), (0.1, 8.0), (CELL, 1.5), (CELL, 3.0), (0.5, 3.0)])
def test_how_late_a_wall_is_met(cell, radius):
    """mm that the tool is in a wall when it meets the first needle: the lens that it has cut is about a cell large."""
    rng, stock, late = np.random.default_rng(SEED), HeightMap((0, 0, -5), (40, 20, 0), cell), []
    whole = stock.height.copy()
    for _ in range(10 * COUNT):
        into = np.arange(-0.02, 1.2 * cell, 0.02 * cell)
        path = np.column_stack(
            (rng.uniform(12, 28) + math.tan(rng.uniform(-1, 1)) * into, into - radius, np.full(len(into), -3.0))
        )
        met = stock.cut(Shape(2 * radius), path[0], path[1:])
        stock.height[...] = whole
        late.append(into[1 + int(np.argmax(met["depth"] > 0.01))])
    assert (
        0.25 * LENS * cell ** (4 / 3) * radius ** (-1 / 3)
        < max(late)
        <= LENS * cell ** (4 / 3) * radius ** (-1 / 3) + 0.004
    )


def test_the_verdict_sees_wrong_depths():
    depths = random_case(0)[0]
    deep = (depths[:, 1] > 1) & (depths[:, 3] < 0.03)
    assert deep.any()
    for expected in (1, 2):
        spoiled = depths[deep].copy()
        spoiled[:, 0] = np.where(expected == 1, depths[deep, 1] - 0.5 * CELL, depths[deep, 2] + 1.1 * CELL)
        assert verdict(spoiled)[expected].all()


def test_times_closed_forms():
    seconds, end = times([100.0], [50.0], [500.0], [0.0], 0.0)
    assert seconds[0] == pytest.approx(100 / 50 + 50 / 500) and end == 0
    seconds, _ = times([1.0], [50.0], [500.0], [0.0], 0.0)  # never reaches F
    assert seconds[0] == pytest.approx(2 * math.sqrt(1.0 / 500))
    whole, _ = times([100.0], [50.0], [500.0], [0.0], 0.0)
    parts, _ = times([0.1] * 1000, [50.0] * 1000, [500.0] * 1000, [1e9] * 999 + [0.0], 0.0)
    assert parts.sum() == pytest.approx(whole.sum(), rel=1e-6)
    stops, _ = times([0.1] * 1000, [50.0] * 1000, [500.0] * 1000, [0.0] * 1000, 0.0)
    assert stops.sum() == pytest.approx(1000 * 2 * math.sqrt(0.1 / 500))


def test_single_needles_in_strips_are_found_and_cut_as_each_alone():
    """The same heights and the same deepest contact as with each needle in a map of its own; in a box there are those
    that are in it."""
    for case in range(COUNT):
        rng = np.random.default_rng([SEED, case, 7])
        places = rng.uniform((-2, -2), (42, 32), (int(rng.choice([1, 40, 900])), 2))
        tool, path = Shape(6.0, float(rng.choice([0.0, 1.0, 3.0]))), rng.uniform((-5, -5, -9), (45, 35, 2), (12, 3))
        stock, own = HeightMap((0, 0, -10), (40, 30, 0), 1.0), HeightMap((0, 0, -10), (40, 30, 0), 1.0)
        stock.add_needles(places)
        own.height[:] = stock.height[:] = stock.z_min
        for low, high in np.sort(rng.uniform(-6, 46, (20, 2, 2)), axis=1):
            inside = ((stock.needles >= low) & (stock.needles <= high)).all(axis=1)
            assert np.sort(stock.needles_in(low, high)).tolist() == np.flatnonzero(inside).tolist(), (SEED, case)
        met, deepest = stock.cut(tool, path[0], path[1:])["depth"], np.zeros(len(path) - 1, np.float32)
        for number in rng.permutation(len(places))[:100] if len(places) > 100 else range(len(places)):
            own.add_needles(stock.needles[[number]])
            deepest = np.maximum(deepest, own.cut(tool, path[0], path[1:])["depth"])
            assert own.needle_height[0] == stock.needle_height[number], (SEED, case)
        assert (met == deepest).all() if len(places) <= 100 else (met >= deepest).all(), (SEED, case)


def test_the_distance_of_traverses_from_stock():
    """A slot of 6 mm, and traverses of a tool of 4 mm in it: 1 mm on each side in its middle, nothing at its wall; up
    the wall and down."""

    def distances(*places, tool=4, clearance=1.5):
        stock = HeightMap((0, 0, -20), (60, 40, 0), CELL)
        cut(stock, Shape(6), (-5, 20, -8), (65, 20, -8))
        met = stock.cut(
            Shape(tool),
            places[0],
            np.array(places[1:], float),
            judged=np.ones(len(places) - 1, bool),
            clearance=clearance,
        )
        return met["beside"].tolist()

    assert distances((10, 20, -7), (50, 20, -7))[0] == pytest.approx(1.0, abs=0.02 + CELL)
    assert distances((10, 20, -7), (50, 20, -7), clearance=0.5)[0] < 0  # no stock is as near
    assert distances((10, 21, -7), (50, 21, -7))[0] == pytest.approx(0.0, abs=0.02)
    assert distances((30, 20, 5), (30, 20, -7))[0] == pytest.approx(
        1.0, abs=0.02 + CELL
    )  # straight down: where it ends
    assert distances((30, 20, -7), (30, 20, 5)) == [-1.0]  # straight up: none
    assert distances((30, 20, 2), (40, 20, 2)) == [-1.0]  # above the stock
    # up at 45 degrees into the wall, away from the one beside it, and steeply beside it
    assert distances((30, 20, -7), (30, 27, 0), clearance=0.5)[0] == pytest.approx(0.0, abs=0.02)
    assert distances((30, 21, -7), (30, 17, -3)) == [-1.0]
    assert distances((30, 21, -7), (30.1, 21, 3)) == [-1.0]
