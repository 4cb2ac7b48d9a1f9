# SPDX-License-Identifier: GPL-2.0-or-later
"""Walls that run along the path are read where they are: thin cuts beside a wall, straight and bent, at any angle to
the cells.

The truths are closed forms: a strip of constant width; a ring between two circles, of which the tool takes (r1^2 -
r0^2) / 2 per radian.
"""

import math

import numpy as np
import pytest

from chipwise.clib import core

DIAMETER, DEPTH, CELL = 8.0, 7.53, 0.25  # mm
MEAN = 0.01  # of the truth;
SPREAD = 0.01  # interpolated walls have a deviation of 0.019 if straight, 0.031 if bent,
WORST = 0.03  # and single readings 0.11 off


def off(areas, truth):
    return np.array(areas) / truth - 1.0


def straight(angle, width):
    """Errors of readings along a strip `width` mm wide that lies at an angle (rad) to the cells, at eight distances
    from them."""
    tool, found = core.Tool(DIAMETER), []
    c, s = math.cos(angle), math.sin(angle)

    def at(along, beside):
        return c * along - s * beside, s * along + c * beside, -DEPTH

    for shift in np.linspace(0.0, CELL, 8, endpoint=False):
        stock = core.Stock((-20, -20, -10), (20, 20, 0), CELL)
        core.Cutter(stock, tool, at(-30, shift)).to(at(30, shift))
        found += [
            stock.section(tool, at(u, shift - width), (c, s, 0.0), core.UNCUT)[0] for u in np.arange(-2.0, 2.0, 0.11)
        ]
    return off(found, width * DEPTH)


def bent(radius, width, side, shift):
    """Errors of readings along an arc of `radius` mm round (shift, 0): side 1 takes a ring inside the cut before, -1
    outside."""
    tool, inner = core.Tool(DIAMETER), DIAMETER / 2.0
    stock = core.Stock((-40, -40, -10), (40, 40, 0), CELL)
    before = radius + side * width
    path = [(before * math.cos(a) + shift, before * math.sin(a), -DEPTH) for a in np.arange(-0.7, 2.3, 0.004)]
    cutter = core.Cutter(stock, tool, path[0])
    for tip in path[1:]:
        cutter.to(tip)
    truth = width * (radius - side * inner + side * 0.5 * width) / radius * DEPTH
    angles = np.arange(0.0, 0.5 * math.pi, 0.013)
    return off(
        [
            stock.section(
                tool,
                (radius * math.cos(a) + shift, radius * math.sin(a), -DEPTH),
                (-math.sin(a), math.cos(a), 0.0),
                core.UNCUT,
                1.0 / radius,
            )[0]
            for a in angles
        ],
        truth,
    )


def check(errors, what):
    assert abs(errors.mean()) < MEAN and errors.std() < SPREAD and np.abs(errors).max() < WORST, (
        f"{what}: mean {100 * errors.mean():.2f} %, deviation {100 * errors.std():.2f} %, worst "
        f"{100 * np.abs(errors).max():.1f} %"
    )


@pytest.mark.parametrize("width", (0.334, 0.55, 1.9))
@pytest.mark.parametrize("angle", (0.0, 0.07, 0.29, 0.63, 2.2))
def test_straight(angle, width):
    check(straight(angle, width), f"{width} mm at {angle} rad")


@pytest.mark.parametrize("side", (1, -1))
@pytest.mark.parametrize("radius, width", ((24.0, 0.334), (9.3, 0.5), (17.0, 1.3)))
def test_bent(radius, width, side):
    for shift in (0.0, 0.087):
        check(bent(radius, width, side, shift), f"{width} mm at {radius} mm, side {side}")


@pytest.mark.parametrize("rim", (0.0, 0.02, 0.119, 0.2))
def test_along_the_rim(rim):
    """A strip between the tool's edge and the rim of the stock, which ends anywhere in a cell."""
    stock, tool, width = core.Stock((-30, -20, -10), (rim, 20, 0), CELL), core.Tool(DIAMETER), 1.1
    found = [
        stock.section(tool, (rim + DIAMETER / 2.0 - width, y, -DEPTH), (0.0, -1.0, 0.0), core.UNCUT)[0]
        for y in np.arange(-5.0, 5.0, 0.17)
    ]
    check(off(found, width * DEPTH), f"rim {rim} mm into a cell")


def test_a_shift_is_seen():
    """Sabotage: a wall 0.02 mm beside its place is more than is allowed."""
    with pytest.raises(AssertionError):
        check((straight(0.07, 0.334) + 1.0) * 0.354 / 0.334 - 1.0, "shifted")
