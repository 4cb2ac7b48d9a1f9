# SPDX-License-Identifier: GPL-2.0-or-later
"""Soft limits of a turned part: the extremes of the written program, sampled, decide whether a limit beside them is
left."""

import random

import pytest

from chipwise.errors import CycleError
from chipwise.turning import soft_limits
from support.random_cases import random_count, random_seed
from support.turning_oracle import moves
from support.turning_random import random_case
from support.turning_rig import planned

FAR = 1e4
NEAR = 0.001  # mm; a chord of 0.005 rad of an arc of 100 mm is 0.0003 mm off


def extremes(text, unit):
    """(lowest, highest) of Z and of X of a written program, mm."""
    points = [p for _, _, found in moves(text, unit, angle=0.005) for p in found]
    return [(min(p[k] for p in points), max(p[k] for p in points)) for k in (0, 1)]


def refused(plan, limits, zero, offsets):
    """The message of travel.check(), "" if all is within."""
    try:
        soft_limits.check([(n, s) for n, s in enumerate(plan.steps, 1) if s.needed], limits, zero, offsets)
    except CycleError as error:
        return error.text()
    return ""


@pytest.mark.parametrize("k", range(random_count(8)))
def test_a_limit_counts_from_the_extremes_of_the_path_on(k, tmp_path):
    """Work offsets and tool offsets shift them."""
    rng = random.Random(random_seed() * 1_009 + k)
    plan, request, _, text = planned(random_case(rng), tmp_path)
    found = extremes(text, request.scale)
    zero, offset = (rng.uniform(-300, 100), rng.uniform(-20, 20)), (rng.uniform(-80, 80), rng.uniform(-30, 30))
    offsets = {s.tool.number: offset for s in plan.steps if s.needed}
    if not offsets:
        return
    at = [[value + z + o for value in pair] for pair, z, o in zip(found, zero, offset)]
    for axis, name in enumerate(("axis Z", "axis X")):
        for low, high, words in (
            (at[axis][0] - NEAR, FAR, ""),
            (at[axis][0] + NEAR, FAR, f"{name} would be at"),
            (-FAR, at[axis][1] + NEAR, ""),
            (-FAR, at[axis][1] - NEAR, f"{name} would be at"),
        ):
            limits = [("axis Z", -FAR, FAR), ("axis X", -FAR, FAR)]
            limits[axis] = (name, low, high)
            said = refused(plan, limits, zero, offsets)
            assert (words in said) if words else not said, (k, low, high, said)


def test_only_the_tool_that_leaves_the_limits_is_named(tmp_path):
    plan, *_ = planned(random_case(random.Random(3), "D55", 0.3), tmp_path)
    numbers = sorted({s.tool.number for s in plan.steps if s.needed})
    assert len(numbers) > 1
    offsets = {n: (0.0, -200.0 if n == numbers[-1] else 0.0) for n in numbers}
    said = refused(plan, (("axis Z", -FAR, FAR), ("axis X", -50.0, FAR)), (0.0, 0.0), offsets)
    assert f"with T{numbers[-1]}, beyond its limit of -50 mm" in said and said.startswith("chipwise: step ")
