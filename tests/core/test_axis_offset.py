# SPDX-License-Identifier: GPL-2.0-or-later
"""External offsets without lag (axis_offset.h) against a planner written from LinuxCNC's description, with what stops
them."""

import math

import numpy as np
import pytest

from support.offset_planner import PERIOD_S, Planner
from support.offset_rig import FAULT, SETTINGS, STATE, Rig
from support.random_cases import random_count, random_seed, write_replay

LATE = 2  # periods from a position to the offset, as LinuxCNC reads its pins
EXACT_MM = 5e-6  # a count is 1e-6 mm, and its rounding is a velocity for a period
A = SETTINGS["acceleration_mm_s2"][0]


def walk(generator, periods, most=80.0, accel=0.95 * A):
    """Positions (n, 3) mm whose velocity wanders within `accel` of each axis, and rests in the end."""
    velocity, goal, rows, at = np.zeros(3), np.zeros(3), [np.zeros(3)], np.zeros(3)
    for k in range(1, periods):
        if generator.random() < 0.01:
            goal = generator.uniform(-most, most, 3) * (generator.random(3) < 0.7)
        if k > periods - 400:
            goal = np.zeros(3)
        velocity = velocity + np.clip(goal - velocity, -accel * PERIOD_S, accel * PERIOD_S)
        at = at + velocity * PERIOD_S
        rows.append(at)
    return np.array(rows)


def straight(speed, periods, accel=0.95 * A):
    """Positions (n, 3) mm along X, from rest to `speed` and on."""
    velocity = np.minimum(np.arange(periods) * accel * PERIOD_S, speed)
    return np.column_stack([np.cumsum(velocity) * PERIOD_S, np.zeros(periods), np.zeros(periods)])


def test_two_periods_behind_whatever_the_movement():
    for number in range(random_count(5)):
        generator = np.random.default_rng([random_seed(), number])
        positions = walk(generator, 3000)
        rig = Rig()
        offsets = rig.follow(positions)
        miss = np.abs(offsets[LATE:] - positions[:-LATE] + positions[0]).max()
        kept = write_replay("axis_offset", positions.tolist()) if miss >= EXACT_MM else ""
        assert miss < EXACT_MM, f"CHIPWISE_SEED={random_seed()} case {number}: {miss:.2e} mm, positions in {kept}"
        assert rig.states[-1] == (STATE.FOLLOW, FAULT.NO_FAULT) and rig.changes() <= A * (1 + 1e-9)


def test_the_request_is_ahead_by_the_lag_of_the_planner():
    """50 mm/s at 450 mm/s2: 2.83 mm, and the offset is where it should be all the same."""
    rig = Rig()
    positions = straight(50.0, 1500)
    offsets = rig.follow(positions)
    assert rig.leads[-1] == pytest.approx(50.0**2 / (2 * A) + 50.0 * PERIOD_S, abs=1e-5)
    assert np.abs(offsets[LATE:] - positions[:-LATE] + positions[0]).max() < EXACT_MM


@pytest.mark.parametrize("what", ["permit", "request"])
def test_a_stop_brakes_and_holds(what):
    rig = Rig()
    rig.follow(straight(40.0, 600))
    rig.signals(**{what: 0})
    begin = rig.offsets[-1][0]
    rig.run(400)
    assert rig.states[-1] == (STATE.HOLD, FAULT.NO_FAULT) and not rig.out.is_enabled and rig.out.is_off
    assert rig.offsets[-1][0] - begin == pytest.approx(40.0**2 / (2 * A) + 40.0 * PERIOD_S * 1.5, abs=0.1)
    assert rig.changes() <= A * (1 + 1e-9) and np.abs(rig.velocities[-1]).max() < 1e-3
    held = rig.offsets[-1]
    rig.signals(permit=1)
    rig.run(1500, (500.0, 0, 0))
    assert (
        np.abs(rig.offsets[-1] - held).max() < 1e-5 and rig.states[-1][0] == STATE.HOLD
    )  # it does not begin again by itself
    rig.signals(request=0)
    rig.run(2)
    rig.follow(straight(10.0, 100) + (500, 0, 0))
    assert rig.states[-1] == (STATE.FOLLOW, FAULT.NO_FAULT)


@pytest.mark.parametrize("late_s, state", [(0.0, STATE.FOLLOW), (0.9, STATE.FOLLOW), (1.1, STATE.HOLD)])
def test_permit_may_come_a_second_later(late_s, state):
    rig = Rig()
    rig.signals(permit=0, request=1)
    rig.run(round(late_s / PERIOD_S) + 1)
    rig.signals(permit=1)
    rig.run(5)
    assert rig.states[-1][0] == state


def test_machine_off_keeps_the_place_and_counts_from_0():
    rig = Rig()
    rig.follow(straight(40.0, 600))
    rig.signals(machine=0)
    rig.run(50)
    assert rig.states[-1] == (STATE.HOLD, FAULT.NO_FAULT) and not rig.out.is_enabled
    rig.signals(machine=1)
    rig.run(1500, (3.0, 0, 0))
    assert np.abs(rig.offsets[-1]).max() == 0.0 and rig.out.is_cleared
    rig.signals(request=0)
    rig.run(2)
    positions = straight(10.0, 300)
    offsets = rig.follow(positions)
    assert np.abs(offsets[LATE:] - positions[:-LATE] + positions[0]).max() < EXACT_MM


@pytest.mark.parametrize("case", ["slower planner", "faster planner", "not homed", "soft limit"])
def test_a_planner_that_does_not_follow_is_a_fault(case):
    """Seen before the offset is off by more than a tenth of a millimetre."""
    share = {"slower planner": 0.8, "faster planner": 1.3}.get(case, 1.0)
    rig = Rig(Planner(share * np.array(SETTINGS["acceleration_mm_s2"]), SETTINGS["max_vel_mm_s"], SETTINGS["count_mm"]))
    rig.planner.is_homed = case != "not homed"
    if case == "soft limit":
        rig.planner.limit[0] = 5.0
    positions = straight(50.0, 600)
    offsets = rig.follow(positions)
    end = next(k for k, state in enumerate(rig.states) if state[0] == STATE.FAULT)
    assert rig.states[end] == (STATE.FAULT, FAULT.ASTRAY)
    begin = len(rig.states) - len(offsets)
    if case != "soft limit":
        assert np.abs(offsets[LATE : end - begin] - positions[: end - begin - LATE] + positions[0]).max() < 0.1
    rig.run(500)
    assert not rig.out.is_enabled and np.abs(rig.velocities[-1]).max() < 1e-3
    rig.signals(request=0)
    rig.run(2)
    assert rig.states[-1] == (STATE.HOLD, FAULT.NO_FAULT)


def test_a_position_faster_than_the_axes_is_a_fault():
    """Twice A: LinuxCNC's own is never passed, and it stops once 1 mm is missing."""
    rig = Rig()
    rig.follow(straight(80.0, 1000, accel=2 * A))
    assert (STATE.FAULT, FAULT.BEHIND) in rig.states and rig.changes() <= A * (1 + 1e-9)


def test_an_offset_of_more_counts_than_there_are_is_a_fault():
    """2e9 counts of 1e-9 mm are 2 mm."""
    rig = Rig(Planner(SETTINGS["acceleration_mm_s2"], SETTINGS["max_vel_mm_s"], 1e-9), count_mm=1e-9)
    rig.follow(straight(10.0, 400))
    assert (STATE.FAULT, FAULT.TOO_FAR) in rig.states and 1.5 < np.abs(rig.offsets[-1]).max() < 2.2


def test_clear_goes_up_first():
    rig = Rig()
    down = straight(30.0, 900)[:, 0]
    rig.follow(np.column_stack([down / 3, down / 2, -down]))
    rig.signals(request=0)
    rig.run(400)
    begin = len(rig.offsets)
    rig.signals(clear=1)
    rig.run(4000, None, 0.0)
    path = np.array(rig.offsets[begin:])
    moved = np.abs(path[:, :2] - path[0, :2]).max(axis=1) > 1e-3
    assert abs(path[np.argmax(moved), 2]) < 1e-3  # X and Y move only when Z is up
    line = path[moved & (np.abs(path[:, 0]) > 0.1)]
    assert np.ptp(line[:, 0] / line[:, 1]) < 1e-3  # along a straight line
    assert rig.out.is_cleared and not rig.out.is_off and np.abs(path[-1]).max() < 1e-6
    assert np.abs(np.array(rig.velocities[begin:])).max() <= 20.0 * (1 + 1e-6) and rig.changes() <= A * (1 + 1e-9)


def test_clear_goes_down_last():
    rig = Rig()
    up = straight(30.0, 900)[:, 0]
    rig.follow(np.column_stack([up, up, up]))
    rig.signals(request=0)
    rig.run(400)
    begin = len(rig.offsets)
    rig.signals(clear=1)
    rig.run(6000)
    path = np.array(rig.offsets[begin:])
    moved = np.abs(path[:, 2] - path[0, 2]) > 1e-3
    assert np.abs(path[np.argmax(moved), :2]).max() < 1e-3 and rig.out.is_cleared


@pytest.mark.parametrize(
    "deflections, fault",
    [
        ((0.3, 0.25, 0.1, 0.0, 0.0), FAULT.NO_FAULT),
        ((0.0, 0.0, 0.35), FAULT.COLLISION),
        ((0.3, 0.0, 0.0, 0.31), FAULT.COLLISION),
        ((0.0, math.nan), FAULT.COLLISION),
    ],
)
def test_a_deflection_on_the_way_back(deflections, fault):
    """That of the beginning may fall; one that grows stops the axes."""
    rig = Rig()
    rig.follow(straight(30.0, 900))
    rig.signals(request=0)
    rig.run(400)
    rig.signals(clear=1)
    for deflection in deflections:
        rig.run(60, None, deflection)
    assert rig.out.fault_number == fault
    if fault:
        rig.run(400)
        assert np.abs(rig.velocities[-1]).max() < 1e-3 and rig.changes() <= A * (1 + 1e-9)


def test_settings_and_inputs_that_cannot_be():
    for name, value in (
        ("acceleration_mm_s2", (450, math.nan, 450)),
        ("acceleration_mm_s2", (0, 450, 450)),
        ("max_vel_mm_s", (90, 90, math.inf)),
        ("count_mm", 0.0),
        ("clear_vel_mm_s", -1.0),
        ("max_astray_mm", math.nan),
        ("max_behind_mm", 0.0),
        ("contact_mm", math.inf),
    ):
        rig = Rig(**{name: value})
        rig.follow(straight(30.0, 100))
        assert rig.states[-1] == (STATE.FAULT, FAULT.SETTINGS) and np.abs(rig.offsets[-1]).max() == 0.0, name
    for value in (math.nan, math.inf, 1e300):
        rig = Rig()
        rig.follow(straight(30.0, 300))
        rig.run(1, (value, 0, 0))
        assert rig.states[-1] == (STATE.FAULT, FAULT.NOT_FINITE)
        rig.run(400)
        assert np.abs(rig.velocities[-1]).max() < 1e-3 and rig.changes() <= A * (1 + 1e-9)


def test_hostile_numbers():
    """Every input at random: the counts stay within 2e9, LinuxCNC's planner within A; sound again, it follows."""
    hostile = [0.0, -0.0, 1e-300, 1e-9, 0.3, 1e5, -1e6, 1e9, 1e18, 1e300, math.inf, -math.inf, math.nan]
    for number in range(random_count(5)):
        generator = np.random.default_rng([random_seed(), 1, number])
        rig, at = Rig(), np.zeros(3)
        for _ in range(200):
            rig.signals(
                request=int(generator.random() < 0.9),
                permit=int(generator.random() < 0.95),
                clear=int(generator.random() < 0.1),
            )
            value = hostile[generator.integers(len(hostile))]
            rig.settings.max_astray_mm = value if generator.random() < 0.05 else 5e-4
            rig.settings.acceleration_mm_s2[1] = value if generator.random() < 0.05 else A
            at = at + generator.uniform(-0.05, 0.05, 3)
            rig.step(np.where(generator.random(3) < 0.05, value, at), value if generator.random() < 0.1 else 0.0)
            assert np.abs(list(rig.out.counts)).max() <= 2e9 and np.isfinite(list(rig.axes.velocity_mm_s)).all(), (
                f"CHIPWISE_SEED={random_seed()} case {number}"
            )
        assert rig.changes() <= A * (1 + 1e-9), f"CHIPWISE_SEED={random_seed()} case {number}"
        rig.settings.max_astray_mm, rig.settings.acceleration_mm_s2[1] = 5e-4, A
        rig.signals(request=0, permit=1, clear=0)
        rig.run(500, (0, 0, 0))
        rig.follow(straight(10.0, 100))
        assert rig.states[-1] == (STATE.FOLLOW, FAULT.NO_FAULT), f"CHIPWISE_SEED={random_seed()} case {number}"
