# SPDX-License-Identifier: GPL-2.0-or-later
"""The angles of a tilting table in a station, against LinuxCNC's own kinematics modules: the direction in which joint Z
moves the tip on the part."""

import math
import random

import numpy as np
import pytest

from chipwise.machine.kinematics import Kinematics
from chipwise.stations.pose import TABLES, matrix_of, table_axis, table_in_station
from support.random_cases import random_count, random_seed

OPEN = ((-math.inf, math.inf),) * 3


def axis_of(module, abc):
    """The tool's axis on the part, by forward kinematics."""
    robot, axes = Kinematics(module), TABLES[module]
    joints = [1.0, 2.0, 3.0, abc["ABC".index(axes[0])], abc[2]]
    return robot.forward([*joints[:2], joints[2] + 1.0, *joints[3:]])[:3] - robot.forward(joints)[:3]


@pytest.mark.parametrize("module", sorted(TABLES))
@pytest.mark.parametrize("case", range(random_count(20)))
def test_the_tool_is_square_to_the_station(module, case):
    """The axis is the module's, it is the station's Z, and of all solutions in range the nearest is taken."""
    r = random.Random(f"table {module} {random_seed() + case}")
    axes = TABLES[module]
    abc = [r.uniform(-180, 180) for _ in range(3)]
    assert table_axis(axes, abc) == pytest.approx(axis_of(module, abc), abs=1e-9)
    station, near = matrix_of([r.uniform(-180, 180) for _ in range(3)]), [r.uniform(-400, 400) for _ in range(3)]
    found = table_in_station(axes, station, (0, 0, 0), near, OPEN)
    assert axis_of(module, found) == pytest.approx(station[:, 2], abs=1e-9)
    tilting = "AB".index(axes[0])
    other = list(found)
    other[tilting], other[2] = -found[tilting], found[2] + (180 if found[2] < near[2] else -180)
    assert axis_of(module, other) == pytest.approx(station[:, 2], abs=1e-9)
    assert max(abs(a - b) for a, b in zip(found, near)) <= max(abs(a - b) for a, b in zip(other, near)) + 1e-9
    ranges = [OPEN[0]] * 3
    ranges[tilting] = (0.0, 180.0) if found[tilting] < 0 else (-180.0, 0.0)
    assert table_in_station(axes, station, (0, 0, 0), near, ranges)[tilting] == pytest.approx(-found[tilting], abs=1e-9)
    assert found[1 - tilting] == near[1 - tilting]


@pytest.mark.parametrize("module", sorted(TABLES))
def test_a_level_station_leaves_the_turn(module):
    """However it is turned about Z: only the tool's axis counts."""
    for turn in (0, 30, -170):
        found = table_in_station(TABLES[module], matrix_of((0, 0, turn)), (0, 0, 0), (7.0, 8.0, 77.0), OPEN)
        assert found["AB".index(TABLES[module][0])] == 0 and found[2] == 77.0


def test_a_tool_that_leans_in_a_level_station():
    assert table_in_station("AC", np.eye(3), (20, 0, 35), (0, 0, 0), OPEN) == pytest.approx((20, 0, 35))
    assert table_in_station("BC", np.eye(3), (0, -20, 35), (0, 0, 0), OPEN) == pytest.approx((0, -20, 35))
