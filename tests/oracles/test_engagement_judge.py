# SPDX-License-Identifier: GPL-2.0-or-later
"""The judge of engagement (support/judge_engagement.c) against closed forms, and on what G79 does."""

import math

import numpy as np
import pytest
from support import engagement_judge
from support.pocket_requests import request, walked

RADIUS = 3.0


def lines(*points):
    """Rows of lines through points."""
    points = np.array(points, float)
    return np.column_stack((points[:-1], points[1:], np.zeros((len(points) - 1, 3))))


@pytest.mark.parametrize("width", [0.5, 1.5, 2.4, 3.0, 4.5])
def test_a_side_cut_has_the_angle_of_its_width(width):
    both = np.concatenate((lines((0, 0), (40, 0)), lines((0, -width), (40, -width))))
    found = engagement_judge.exact(both, [False, True], RADIUS)
    middle = found[(found[:, 1] > 10) & (found[:, 1] < 30)]
    assert len(middle) > 100 and middle[:, 4] == pytest.approx(math.acos(1 - width / RADIUS), abs=1e-6)


@pytest.mark.parametrize("turn", [math.pi / 2, -math.pi / 2])
def test_solid_stock_is_half_a_turn_on_lines_and_arcs(turn):
    arc = np.array([[10.0, 0.0, 0.0, math.copysign(10.0, turn), 0.0, 0.0, turn]])
    for rows in (lines((0, 0), (15, 0)), arc):
        assert engagement_judge.exact(rows, [True], RADIUS)[5:, 4] == pytest.approx(math.pi, abs=1e-6)


def test_a_ring_round_a_ring_has_the_angle_of_two_circles():
    """Two circles of the path, 2 mm apart: the rim of the tool leaves the cleared disc at an angle by the cosine
    rule."""
    inner, outer = (np.array([[r, 0.0, r, 0.0, 0.0, 0.0, 2 * math.pi]]) for r in (8.0, 10.0))
    found = engagement_judge.exact(np.concatenate((inner, outer)), [False, True], RADIUS)
    cleared, at = 8.0 + RADIUS, 10.0
    inside = math.acos(
        (at**2 + RADIUS**2 - cleared**2) / (2 * at * RADIUS)
    )  # at the centre of the tool, from the middle
    middle = found[(found[:, 0] == 1) & (np.abs(found[:, 3] % (2 * math.pi) - 3.0) < 1.0)]
    assert len(middle) > 100 and middle[:, 4] == pytest.approx(math.pi - inside, abs=1e-6)


def test_the_same_path_again_is_in_air():
    twice = np.concatenate((lines((0, 0), (20, 0)), lines((0, 0), (20, 0))))
    assert engagement_judge.exact(twice, [False, True], RADIUS)[5:, 4] == pytest.approx(0.0, abs=1e-3)


def test_rings_have_full_corners_and_climb_beside_them():
    asked = request()
    found = engagement_judge.engagement(walked(asked), asked.bottom, RADIUS, 0.4)
    assert found.length(2.5) > 10.0 and found.most < math.pi + 1e-9
    assert found.percentile(0.5) == pytest.approx(math.acos(1 - asked.step / RADIUS), abs=0.02)
