# SPDX-License-Identifier: GPL-2.0-or-later
"""The side force of round ends and cones in rows beside each other, level and on a slope, against the edges one by one
in a stock without cells
(support/judge_force.py): the largest of a turn is there where an edge comes into the stock."""

import itertools
import math

import numpy as np
import pytest

from chipwise.clib import core, layout
from support import judge_force
from support.judge import Blank, Tool, ball

MC = 0.25
BOX = (-20.0, -20.0, -10.0), (20.0, 20.0, 0.0)
LOW, HIGH = -0.05, 0.06  # error of one place, a share of the force; cells of a 16th to a 48th of the tool
MEAN = 0.03  # and of the mean of the places


def errors(tool, cell, row, fall, edges=2, depth=3.0, count=4):
    """Errors at random places and directions of a row that is `row` mm beside another one, down a slope whose sine is
    `fall`."""
    rng, found, level = np.random.default_rng(1), [], math.sqrt(1.0 - fall * fall)
    for _ in range(count):
        turn, place = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(-1.0, 1.0, 2) * cell
        c, s = math.cos(turn), math.sin(turn)

        def at(x, y, c=c, s=s, place=place):
            return (place[0] + c * x - s * y, place[1] + s * x + c * y, -depth - fall / level * x)

        path = np.array([(*at(-8.0, -row), *at(8.0, -row)), (*at(-6.0, 0.0), *at(0.0, 0.0))])
        rows = judge_force.places(Blank.corners(*BOX), [tool], [edges], MC, path, np.zeros(2, np.int32), 0.45)
        back = rows[-1, 0] - np.linalg.norm(path[:, 3:] - path[:, :3], axis=1).sum()
        stock, cutter = (
            core.Stock(*BOX, cell),
            core.Tool(tool.diameter, tool.corner, tool.angle).limit(force_weight=1.0, exponent=MC, edges=edges),
        )
        core.Cutter(stock, cutter, at(-8.0, -row)).to(at(8.0, -row))
        force, _mean = stock.side_force(cutter, at(back * level, 0.0), (level * c, level * s, -fall), core.UNCUT)
        found.append(layout.FORCE_RADIAL * force / rows[-1, 1] - 1.0)
    return np.array(found)


@pytest.mark.parametrize("fall", [0.002, 0.1, -0.1, 0.3])
@pytest.mark.parametrize(
    "tool, cell", [(ball(3.175), 0.1), (Tool(6.0, 0.5, 20.0), 0.125), (Tool(12.7, 0.0, 60.0), 0.25)]
)
def test_rows(tool, cell, fall):
    for row in (0.5, 1.0):
        found = errors(tool, cell, row, fall)
        assert LOW < found.min() and found.max() < HIGH and abs(found.mean()) < MEAN, (row, found)


@pytest.mark.parametrize("row, low", [(0.3, -0.5), (0.6, -0.21), (0.8, -0.08), (1.0, -0.05), (1.2, -0.04)])
def test_thin_rows_of_a_large_ball(row, low):
    """Where a row is narrower than a tenth of a ball its force is read too low (docs/design/feed_law.md): no lower than
    this."""
    found = errors(ball(12.0), 0.125, row, 0.0, edges=4, depth=1.9, count=4)
    assert low < found.min() and found.max() < HIGH, found


@pytest.mark.parametrize("tool", [Tool(10.0), Tool(10.0, 2.0), ball(6.0), Tool(12.7, 0.0, 60.0), Tool(6.0, 0.5, 20.0)])
@pytest.mark.parametrize("before", [(0.9, 0.0, -0.4), (0.0, 0.0, -1.0), (1.0, 0.0, 0.3)])
def test_a_section_says_nothing_of_the_one_before(tool, before):
    """Level rows, slopes and plunges read by one tool after a ramp or a plunge in full stock are what a new tool
    reads."""
    stock = core.Stock(*BOX, 0.25)
    slot = core.Tool(tool.diameter, tool.corner, tool.angle)
    core.Cutter(stock, slot, (-20.0, 0.0, -3.0)).to((20.0, 0.0, -3.0))

    def new():
        made = core.Tool(tool.diameter, tool.corner, tool.angle)
        return made.limit(chip_weight=1.0, power_weight=1.0, force_weight=1.0, exponent=MC, edges=4)

    used = new()
    for side, direction in itertools.product((0.6, 2.0, 6.0), ((1.0, 0.0, 0.0), (0.995, 0.0, -0.1), (0.0, 0.0, -1.0))):
        place = (0.0, side, -3.2)
        stock.side_force(used, (0.0, 10.0, -4.0), before, core.UNCUT)
        found, expected = (stock.side_force(each, place, direction, core.UNCUT) for each in (used, new()))
        assert expected[0] > 0.0 and found == expected, (side, direction)
