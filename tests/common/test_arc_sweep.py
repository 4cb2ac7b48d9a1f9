# SPDX-License-Identifier: GPL-2.0-or-later
"""geometry/base/arc_sweep.py, and each reader of arcs: almost straight arcs are short, as LinuxCNC's motion runs
them."""

import math
import random

import numpy as np
import pytest

from chipwise.geometry.base.arc_sweep import FUZZ, arc_sweep, chord_angle
from chipwise.geometry.base.contour import ArcElement as Arc, LineElement as Line, make_contour
from chipwise.geometry.base.elements import lengths
from chipwise.pattern.isometry import arc_points
from chipwise.rewrite.path_moves import chords
from chipwise.rewrite.edits import Move
from chipwise.rewrite.program import Circle
from chipwise.program.records import ARC

CHORD_MM = 3.413  # of the long arcs


def on_circle(radius, angle):
    return radius * math.cos(angle), radius * math.sin(angle)


@pytest.mark.parametrize("scale", [1.0, 1 / 25.4])
def test_closed_forms(scale):
    for turns in (1, -1, 3, -3):
        sign, whole = math.copysign(1, turns), 2 * math.pi * (abs(turns) - 1)
        for angle in (1e-6, 0.3, 1.0, math.pi / 2, math.pi, 4.0, 6.28):
            end = on_circle(20.0, sign * angle)
            assert arc_sweep((20.0, 0.0), end, (0.0, 0.0), turns, scale) == pytest.approx(
                sign * (angle + whole), abs=1e-12
            )
        assert arc_sweep((20.0, 0.0), (20.0, 0.0), (0.0, 0.0), turns, scale) == pytest.approx(
            sign * (2 * math.pi + whole)
        )
        near = (20.0, sign * 0.5 * FUZZ / scale)
        assert abs(arc_sweep((20.0, 0.0), near, (0.0, 0.0), turns, scale)) == pytest.approx(2 * math.pi + whole)


@pytest.mark.parametrize("radius", [10.0**k for k in range(5, 13)])
def test_almost_straight(radius):
    """The length of the arc is that of its chord, in both directions and wherever its centre is."""
    rng = random.Random(int(math.log10(radius)))
    for _ in range(20):
        direction, turns = rng.uniform(-math.pi, math.pi), rng.choice((1, -1))
        start = (rng.uniform(-100, 100), rng.uniform(-100, 100))
        end = (start[0] + CHORD_MM * math.cos(direction), start[1] + CHORD_MM * math.sin(direction))
        side = direction + turns * math.pi / 2  # the centre, on the left of a counter-clockwise one
        centre = (start[0] + radius * math.cos(side), start[1] + radius * math.sin(side))
        assert abs(arc_sweep(start, end, centre, turns)) * radius == pytest.approx(CHORD_MM, rel=1e-3)
        for points in (
            arc_points((*start, 0.0), (*end, 0.0), (*centre, 0.0), 2, turns, 0.002),
            chords((*start, 0.0), Move(ARC, (*end, 0.0), None, Circle(1, (*centre, 0.0), turns))),
        ):
            assert np.hypot(*(points[-1, :2] - end)) == 0.0
            off = (points[:, 0] - start[0]) * math.sin(direction) - (points[:, 1] - start[1]) * math.cos(direction)
            assert np.abs(off).max() < CHORD_MM**2 / 8 / radius + 1e-3 * radius * 1e-12 + 1e-6


def test_chords_are_near_enough():
    for radius in (1e-3, 1.0, 50.0, 1e6, 1e9, 1e13, 1e17):
        angle = chord_angle(radius, 0.002)
        assert 0 < angle <= 2 * math.pi and 2 * radius * math.sin(angle / 4) ** 2 <= 0.002 * (1 + 1e-9)


def test_a_contour():
    """An edge of 10 mm as an arc of R 7278 km; and an arc that is too short to be one."""
    side = [Arc((60.0, 50.0), (60.0, 60.0), (-7278164.337, 50.0), True, 2)]
    for middle in (
        side,
        [Line((60.0, 50.0), (60.0, 60.0), 2)],
        [*side, Arc((60.0, 60.0), (60.0, 60.0 + 5e-7), (50.0, 60.0), True, 3)],
    ):
        made = make_contour(
            [
                Line((0.0, 0.0), (60.0, 0.0), 1),
                Line((60.0, 0.0), (60.0, 50.0), 1),
                *middle,
                Line(middle[-1].end, (0.0, 60.0), 4),
                Line((0.0, 60.0), (0.0, 0.0), 5),
            ]
        )
        assert made.closed and lengths(made.elements).sum() == pytest.approx(240.0, abs=1e-5)
