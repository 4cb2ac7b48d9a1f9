# SPDX-License-Identifier: GPL-2.0-or-later
"""G75 on the robot: joint limits, reach and singularities along all chords, against tests/support/reach_oracle.py."""

import random
import re

import numpy as np
import pytest

from chipwise.errors import CycleError
from chipwise.machine.kinematics import Kinematics
from chipwise.stations.pose import abc_of, in_station, matrix_of
from support import puma_oracle
from support.random_cases import random_count, random_seed
from support.reach_oracle import DOWN, HOME, PINS, judged


def test_the_module_is_the_chain():
    """Forward: position and orientation; inverse: joints that have the same pose."""
    robot, r = Kinematics("pumakins", PINS), np.random.default_rng(7)
    assert robot.pins() == [name for name, _value in PINS]
    for _ in range(200):
        joints = r.uniform([-100, -80, -60, -90, -80, -90], [100, 40, 60, 90, 80, 90])
        pose, (place, tool) = robot.forward(joints), puma_oracle.tip(joints)
        assert pose[:3] == pytest.approx(place, abs=1e-9) and matrix_of(pose[3:6]) == pytest.approx(tool, abs=1e-9)
        again = robot.forward(robot.follow([pose], joints)[0][:6])
        assert again[:3] == pytest.approx(place, abs=1e-4) and matrix_of(again[3:6]) == pytest.approx(tool, abs=1e-6)


def test_a_pin_changes_the_arm():
    long = Kinematics("pumakins", [("pumakins.A2", 310.0), *PINS[1:]]).forward((0,) * 6)
    assert long[0] - Kinematics("pumakins", PINS).forward((0,) * 6)[0] == pytest.approx(10)


@pytest.mark.parametrize("case", range(random_count(50)))
def test_angles_of_an_orientation(case):
    """The same rotation, whole turns nearest to where the tool is."""
    r = random.Random(f"abc {random_seed() + case}")
    abc = [r.uniform(-180, 180), r.choice((90, -90, r.uniform(-90, 90))), r.uniform(-180, 180)]
    near = [r.uniform(-400, 400) for _ in range(3)]
    found = abc_of(matrix_of(abc), near)
    assert matrix_of(found) == pytest.approx(matrix_of(abc), abs=1e-9)
    assert abs(found[0] - near[0]) <= 180 + 1e-9 and abs(found[2] - near[2]) <= 180 + 1e-9
    assert in_station(matrix_of((0, 0, 90)), DOWN, (180, 0, 80)) == pytest.approx((180, 0, 90))


@pytest.mark.parametrize(
    "name, words",
    [
        ("nokins", "there is no kinematics module nokins in"),
        ("motmod", "the kinematics module motmod cannot be used here"),
    ],
)
def test_a_module_that_is_none(name, words):
    with pytest.raises(CycleError, match=re.escape(words)):
        Kinematics(name)


@pytest.mark.parametrize("case", range(random_count(30)))
def test_random_programs(case):
    """What the oracle cannot follow is refused, by line, joint and value; what it follows with room to spare is not."""
    seed = random_seed() + case
    verdict, said = judged(seed, wild=case % 2 == 1)
    if verdict == "bad":
        assert re.search(
            r"line \d+ of the sub, copy 1: (joint \d would (be at|turn at) \S+|the robot does not reach X\S+)", said
        ), f"CHIPWISE_SEED={seed}: not found"
    if verdict == "good":
        assert not said, f"CHIPWISE_SEED={seed}: {said}"
    assert case % 2 == 1 or verdict != "bad", "comfortable stations are bad ones"


def test_units_of_the_machine():
    """In an inch machine the kinematics are in inch: the same joints."""
    inch = tuple((name, value / 25.4) for name, value in PINS)
    pose = Kinematics("pumakins", PINS).forward(HOME)
    small = Kinematics("pumakins", inch).follow([[*pose[:3] / 25.4, *pose[3:]]], HOME)[0][:6]
    assert small == pytest.approx(HOME, abs=1e-5)
