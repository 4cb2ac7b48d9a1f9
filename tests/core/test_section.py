# SPDX-License-Identifier: GPL-2.0-or-later
"""The section area dV/ds while the tool cuts, in servo steps, against closed forms."""

import math

import numpy as np
import pytest

from chipwise.clib import core
from support import reference_stock as reference
from support import stock_cases

CASES = {case.name: case for case in stock_cases.cases()}
MEAN = 0.01  # allowed mean error, share of the truth
SPREAD = {"side": 0.04}  # allowed standard deviation; else:
SPREAD_ELSE = 0.02

# Load seen when a groove is gone through once more, share of the full groove; the truth is 0.
# A cell's mean height lies above the bottom of a narrow groove: measured 2.7, 5.8 and 25.6 %.
MOST_FALSE = {(6, 3, 0): 0.04, (8, 0, 90): 0.08, (6, 0.5, 20): 0.3}


def check(name, through):
    case = CASES[name]
    mean, spread = stock_cases.measured(case, 0.25, through)
    good = abs(mean) <= MEAN and spread <= SPREAD.get(case.kind, SPREAD_ELSE)
    assert good, f"{name} through {through}: mean error {100 * mean:.2f} %, deviation {100 * spread:.2f} %"


@pytest.mark.parametrize("name", CASES)
def test_section(name):
    check(name, "section")


@pytest.mark.parametrize(
    "name",
    [
        name
        for name, case in CASES.items()
        if case.kind in ("slot", "plunge", "arc", "chain") or " 10 % 0 deg" in name or "31 deg" in name
    ],
)
def test_through_the_look_ahead(name):
    check(name, "ahead")


@pytest.mark.parametrize("depth", (0.05, 0.1, 0.2, 0.5))
@pytest.mark.parametrize("tool", ((6, 3, 0), (10, 2, 0), (8, 0, 90)))
def test_shallow(tool, depth):
    """A small depth, at which a part of one band of the tool is all that touches."""
    stock = core.Stock(stock_cases.LOW, stock_cases.HIGH, 0.25)
    area, _ = stock.section(core.Tool(*tool), (0.13, -0.07, -depth), (math.cos(0.3), math.sin(0.3), 0.0))
    assert area == pytest.approx(stock_cases.front_area(tool, depth), rel=MEAN)


def test_wrong_tool_is_seen():
    """Sabotage: a core tool 2 % too thick fails the check of slots, arcs and plunges."""
    for name in ("slot flat 17 deg", "ramp flat 2 deg down, 31 deg", "plunge flat", "arc flat 3 R"):
        mean, _ = stock_cases.measured(CASES[name], 0.25, "section", 0.02 * CASES[name].tool[0])
        assert abs(mean) > MEAN, name


@pytest.mark.parametrize("shape", [(6, 0, 0), (6, 3, 0), (8, 0, 90), (6, 0.5, 20)])
def test_slot_against_the_reference(shape):
    """The truth of the cases, checked itself: volume per mm of the needle model, 4 deviations."""
    stock = reference.ReferenceStock((-8, -5, -4), (8, 5, 0), 0.03)
    tool = reference.ReferenceTool(*shape)
    stock.move(tool, (-5, 0, -2), (0, 0, -2))
    want = stock.section(tool, (0, 0, -2), (1, 0, 0), 3.0)
    # what a path of 3 mm adds is an outline of two fronts
    chance = stock.error_mm3(4 * shape[0], 2.0) / 3.0
    assert stock_cases.front_area(tuple(shape), 2.0) == pytest.approx(want, abs=4 * chance + 0.003 * want)


def test_side_truth_against_the_reference():
    stock = reference.ReferenceStock((-10, -6, -4), (10, 6, 0), 0.05)
    tool = reference.ReferenceTool(6, 3, 0)
    stock.move(tool, (-12, -1.5, -2), (12, -1.5, -2))
    stock.move(tool, (-12, 0, -2), (0, 0, -2))
    want = stock.section(tool, (0, 0, -2), (1, 0, 0), 3.0)
    chance = stock.error_mm3(24, 2.0) / 3.0
    assert stock_cases.side_area((6, 3, 0), 2.0, 1.5) == pytest.approx(want, abs=4 * chance + 0.003 * want)


@pytest.mark.parametrize("shape", [(6, 0, 0), (6, 3, 0), (10, 2, 0), (8, 0, 90), (6, 0.5, 20)])
def test_nothing_to_meet(shape):
    """Above the stock, beside it, behind the cut: no load; never negative, never NaN."""
    stock, tool = core.Stock((-10, -10, -5), (10, 10, 0), 0.25), core.Tool(*shape)
    assert stock.section(tool, (0, 0, 0.1), (1, 0, 0)) == (0.0, 0.0)
    assert stock.section(tool, (30, 0, -2), (1, 0, 0)) == (0.0, 0.0)
    cutter = core.Cutter(stock, tool, (-15, 0, -2))
    cutter.to((15, 0, -2))
    false = stock.section(tool, (0, 0, -2), (-1, 0, 0))[0] / stock_cases.front_area(shape, 2.0)
    assert false < MOST_FALSE.get(shape, 0.02)
    random = np.random.default_rng(3)
    for _ in range(500):
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)
        area, depth = stock.section(tool, random.uniform(-13, 13, 3), direction)
        assert 0.0 <= area < 2 * tool.radius * 18 + math.pi * tool.radius**2
        assert 0.0 <= depth <= 18.1


def test_turned_by_a_quarter():
    """The load does not know the axes: equal to 1e-6 under quarter turns and mirrors."""
    tool = core.Tool(6, 1, 0)
    areas = []
    for turn in ((1, 0, 0, 1), (0, -1, 1, 0), (-1, 0, 0, 1), (0, 1, 1, 0)):
        matrix = np.array(turn, float).reshape(2, 2)

        def at(x, y, z):
            return (*(matrix @ [x, y]), z)

        stock = core.Stock((-10, -10, -5), (10, 10, 0), 0.25)
        cutter = core.Cutter(stock, tool, at(-8, -3, -2))
        cutter.to(at(8, -3, -2))
        core.Cutter(stock, tool, at(-8, 0, -2)).to(at(1, 0.4, -2))
        heading = np.array([9, 0.4]) / math.hypot(9, 0.4)
        areas.append(stock.section(tool, at(1, 0.4, -2), (*(matrix @ heading), 0))[0])
    assert np.ptp(areas) < 2e-3 * areas[0]


@pytest.mark.parametrize("shape", [(6, 0, 0), (6, 3, 0), (10, 2, 0), (8, 0, 90), (6, 0.5, 20)])
def test_through_the_bottom(shape):
    """What reaches out of the stock's bottom meets nothing; what is cut through gives no load."""
    stock, tool = core.Stock((-10, -10, -5), (10, 10, 0), 0.25), core.Tool(*shape)
    cutter = core.Cutter(stock, tool, (-15, 0, -8))
    cutter.to((0, 0, -8))
    want = stock_cases.front_area(shape, 8.0) - stock_cases.front_area(shape, 3.0)
    area, depth = stock.section(tool, (1, 0, -8), (1, 0, 0))
    assert area == pytest.approx(want, rel=MEAN)
    assert depth == pytest.approx(8.0)
    cutter.to((15, 0, -8))
    assert stock.section(tool, (0, 0, -8), (1, 0, 0))[0] < max(0.02, MOST_FALSE.get(shape, 0.0)) * want


def beside_a_thin_wall(cell, gap, turn, heading):
    """A stock with a groove that leaves a wall `gap` mm thick along a third of the front of a 6 mm tool, which has come
    round a corner of `turn` rad and stands at (0, 0); -> (stock, tool)."""
    stock, tool, depth, radius = core.Stock((-14, -14, -6), (14, 14, 0), cell), core.Tool(6.0), 4.2, 3.0
    ring = heading + np.radians(np.arange(-60.0, -15.0, 0.5))
    line = np.arange(8.0, -0.01, -0.02)
    for path in (
        (2 * radius + gap) * np.column_stack([np.cos(ring), np.sin(ring)]),
        -np.outer(line, (math.cos(heading - turn), math.sin(heading - turn))),
    ):
        cutter = core.Cutter(stock, tool, (*path[0], 1.0))
        for place in path:
            cutter.to((*place, -depth))
        cutter.to((*path[-1], 1.0))
    return stock, tool


@pytest.mark.parametrize("heading", [0.3, 1.02])
@pytest.mark.parametrize("cell, gap", [(0.1, 0.25), (0.1, 0.6), (0.25, 0.6)])
def test_a_wall_of_the_stock_before_a_tool_that_has_turned(cell, gap, heading):
    """The samples behind a corner are taken again when the tool has come round it: nearly all of the front loses the
    wall at once, and they see where.  Within half a cell, as all jumps, and 4 %; the truth has cells of 0.02 mm.  Moved
    ahead as a whole the front read 20 % low."""
    (stock, tool), (fine, _) = (beside_a_thin_wall(side, gap, 0.54, heading) for side in (cell, 0.02))
    step, direction = 0.02, (math.cos(heading), math.sin(heading), 0.0)
    stations = np.arange(0.5 * cell, 1.2, step)
    tips = [(s * direction[0], s * direction[1], -4.2) for s in stations]
    met = [stock.section(tool, tip, direction, s)[0] for tip, s in zip(tips, stations)]
    true = [fine.section(tool, tip, direction, max(0.1, s))[0] for tip, s in zip(tips, stations)]
    near = round(0.5 * cell / step)
    for n, area in enumerate(met):
        around = true[max(0, n - near) : n + near + 1]
        assert 0.96 * min(around) < area < 1.04 * max(around), (stations[n], area, around)
