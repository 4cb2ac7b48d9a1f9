# SPDX-License-Identifier: GPL-2.0-or-later
"""The steps in C of the needles that judge depths (support/check_oracle.py), against all needles in numpy at each
step."""

import numpy as np
import pytest

from support import check_oracle
from support.check_oracle import STEP, STEP_Z, Needles, profile
from support.random_cases import random_seed

LOW, HIGH = (0.0, 0.0, -6.0), (9.0, 7.0, 0.0)
TOOLS = {
    "flat": (3.0, 0.0, 0.0),
    "ball": (4.0, 2.0, 0.0),
    "bull": (4.0, 0.5, 0.0),
    "cone": (3.0, 0.0, 90.0),
    "round cone": (4.0, 0.7, 60.0),
}
SKINS = {"level": (0.012, 0.001), "steep": (0.02,)}


def stamped(needles, heights, tool, place):
    """Heights after a tool has stood at a place."""
    r = np.hypot(needles.x - place[0], needles.y - place[1])
    return np.where(
        r <= tool[0] / 2,
        np.minimum(heights, np.maximum(place[2] + profile(tool, np.minimum(r, tool[0] / 2)), LOW[2])),
        heights,
    )


def met(needles, heights, tool, place, skin):
    diameter, corner, tip = tool
    smaller = diameter - 2 * skin, max(corner - skin, 0.0), tip
    lift = skin / np.sin(np.radians(tip / 2)) if tip and not corner else skin
    r = np.hypot(needles.x - place[0], needles.y - place[1])
    edge = place[2] + lift + profile(smaller, np.minimum(r, smaller[0] / 2))
    hit = (r < smaller[0] / 2) & (heights > np.maximum(edge, LOW[2] + skin))
    return float(heights[hit].max() - place[2]) if hit.any() else 0.0


@pytest.mark.parametrize("shape", TOOLS)
def test_every_step_is_that_of_all_needles(shape):
    tool, rng = TOOLS[shape], np.random.default_rng(random_seed())
    needles, here = Needles(LOW, HIGH, 0.1), np.array([-3.0, 3.0, 1.0])
    own, seen = needles.z.copy(), 0
    for _ in range(8):
        there = np.array([rng.uniform(-2, 11), rng.uniform(-2, 9), rng.uniform(-7, 1)])
        there[2] = (
            here[2] + np.clip(there[2] - here[2], -1, 1) * STEP_Z / STEP * np.hypot(*(there - here)[:2]) / 2
        )  # its steps are as long as STEP
        count, wanted = int(np.ceil(np.hypot(*(there - here)[:2]) / STEP)), [0.0, 0.0]
        for k in range(1, count + 1):
            place = here + (there - here) * k / count
            wanted = [max(depth, met(needles, own, tool, place, skin)) for depth, skin in zip(wanted, SKINS["level"])]
            own = stamped(needles, own, tool, place)
        assert needles.move(tool, here, there, SKINS["level"]) == pytest.approx(wanted, abs=1e-9), (shape, here, there)
        assert np.allclose(needles.z, own, rtol=0, atol=1e-9) and not needles.seen
        seen += max(wanted) > 0.5
        here = there
    assert seen >= 2 and (own < 0).sum() > 500


@pytest.mark.parametrize("shape", TOOLS)
def test_a_step_at_a_time_is_all_steps_at_once(shape):
    """Steep moves, before which a smaller tool may have gone, meet and cut the same as the others."""
    tool, (one, two, three) = TOOLS[shape], (Needles(LOW, HIGH, 0.1) for _ in range(3))
    for start, end in (((-3, 2, -1), (11, 4, -2)), ((11, 4, -3), (-3, 1, -4)), ((4, 3, 2), (4.4, 3.1, -5))):
        start, travel = np.array(start, float), np.subtract(end, start).astype(float)
        depth = one._whole(tool, start, travel, 400, SKINS["level"])
        assert two._steps(tool, start, travel, 400, SKINS["level"]) == depth and max(depth) > (
            0.5 if abs(travel[0]) > 1 else 0.01
        )
        three.move(tool, start, end, SKINS["steep"])
        assert three.seen
        assert np.array_equal(one.z, two.z) and (one.z < 0).any()


def test_a_wrong_step_is_seen(monkeypatch):
    """A tool 1 % wider cuts other needles."""
    edge = check_oracle.edge_of
    wider = edge((3.03, 0.0, 0.0))
    monkeypatch.setattr(check_oracle, "edge_of", lambda tool: wider)
    with pytest.raises(AssertionError):
        test_every_step_is_that_of_all_needles("flat")
