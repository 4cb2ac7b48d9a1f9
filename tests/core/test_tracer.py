# SPDX-License-Identifier: GPL-2.0-or-later
"""Profiling control (tracer.h) against the model of a stylus: the deflection it holds, its limits, and what ends a
trace.

Deflections are judged as they were, without the sensor's delay and noise."""

import math

import numpy as np
import pytest

from support.tracer_rig import FAR, FAULT, LIMIT, MODE, PERIOD_S, SETTINGS, STATE, SURFACE, Rig, error, tracing

SLOPE = math.sqrt(0.5)
LANDING_S = 0.05  # after first contact the deflection builds up to eps0
NOISE_MM = 0.0005


def ends(rig, state, fault=FAULT.NO_FAULT, seconds=30.0):
    """Run to the end; -> rows."""
    rows = rig.until(STATE.DONE, STATE.FAULT, STATE.OVER_RANGE, seconds=seconds)
    assert (rows["state"][-1], rows["fault"][-1]) == (state, fault)
    return rows


def slope(rise=1, **settings):
    return Rig((-15, 0, -15 * rise + 3), {"normal": (-SLOPE * rise, 0, SLOPE), "noise_mm": NOISE_MM}, **settings)


def ball(radius, feed, periods, hollow=False):
    """The path of the ball's centre has `radius`, whatever the stylus."""
    width, size = 0.75 * radius, radius + (1 if hollow else -1)
    return Rig(
        (-width, 0, -0.4 * radius if hollow else radius + 2),
        {"surface_number": SURFACE.BOWL if hollow else SURFACE.BALL, "size_mm": size, "delay_periods": periods},
        feed_mm_s=feed,
        dead_time_s=periods * PERIOD_S,
        pick_mm=0.5,
        window_min_mm=(-width, -1, -FAR),
        window_max_mm=(width, 1, FAR),
    )


# ---- deflection held -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rise", [1, -1])
def test_slope(rise):
    """45 degrees at 1000 mm/min with friction 0.15: 0.005 mm, landing included."""
    rows = ends(slope(rise), STATE.DONE)
    assert np.percentile(error(tracing(rows)), 99) < 0.005
    assert abs(rows["friction_share"][-1] - math.sin(math.atan(0.15))) < 0.005
    assert rows["position_mm"][:, 0].max() < 20.0


def test_slope_at_a_low_gain():
    """Gain 100 with friction in the normal has 0.025 mm; without it 0.005 once friction is known, 0.15 s."""
    rows = ends(slope(gain_hz=100.0), STATE.DONE)
    assert np.percentile(error(tracing(rows, 0.15)), 99) < 0.005


def test_friction_on_a_ball():
    """The estimate is that of the model, on either side of a ball of R 5."""
    rig = Rig(
        (-3.5, 0, 7),
        {"surface_number": SURFACE.BALL, "size_mm": 4},
        window_min_mm=(-3.5, -1, -FAR),
        window_max_mm=(3.5, 1, FAR),
        feed_mm_s=15.0,
    )
    rows = tracing(ends(rig, STATE.DONE), 0.35)
    assert np.abs(rows["friction_share"] - math.sin(math.atan(0.15))).max() < 0.01


def test_friction_with_dead_time():
    """A sensor 20 periods late, a feed that changes: the position of then counts."""
    rig = Rig(
        (-3.5, 0, 7),
        {"surface_number": SURFACE.BALL, "size_mm": 4, "delay_periods": 20},
        dead_time_s=20 * PERIOD_S,
        feed_mm_s=10.0,
        window_min_mm=(-3.5, -1, -FAR),
        window_max_mm=(3.5, 1, FAR),
    )
    rows = tracing(ends(rig, STATE.DONE), 0.45)
    assert np.abs(rows["friction_share"] - math.sin(math.atan(0.15))).max() < 0.01


def test_the_ball_behind_a_slow_drive():
    """Dead time of the drive alone: position and deflection are of the same moment, and so is the ball."""
    rows = tracing(ends(Rig((-15, 0, 3), dead_time_s=0.004, drive_time_s=0.004), STATE.DONE))
    assert np.abs(rows["seen_ball_mm"] - rows["ball_mm"]).max() < 1e-9


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_the_override_acts_on_every_movement(share):
    """Approach, trace, retract and return have that share of their velocity; 0 rests, also in contact."""
    rig = Rig(
        (-8, -4, 16),
        {"surface_number": SURFACE.BALL, "size_mm": 14},
        mode_number=MODE.ONE_WAY,
        pick_mm=4.0,
        gain_hz=400.0,
        window_min_mm=(-8, -4, -FAR),
        window_max_mm=(8, 4, FAR),
    )
    seen = {}
    for _ in range(400):
        rows = rig.run(0.05)
        state = int(rows["state"][-1])
        if (
            (rows["state"] == state).all()
            and state not in seen
            and state in (STATE.APPROACH, STATE.TRACE, STATE.RETRACT, STATE.RETURN)
        ):
            full = np.linalg.norm(rows["velocity_mm_s"][-1])
            rig.feed_share = share
            slow = rig.run(0.15)
            rig.feed_share = 1.0
            if (slow["state"] == state).all():
                seen[state] = np.linalg.norm(slow["velocity_mm_s"][-1]) / full
    assert len(seen) == 4 and max(seen.values()) < share + 0.2, seen
    assert share or max(seen.values()) < 1e-3, seen


def test_bend_at_a_low_gain():
    """R 3 at a gain of 50: a normal velocity that is missing would show as an error of 0.012 mm or more."""
    rig = Rig(
        (-15, 0, 0),
        {"surface_number": SURFACE.CYLINDER, "size_mm": 2},
        mode_number=MODE.CONTOUR,
        approach_dir=(1, 0, 0),
        gain_hz=50.0,
        friction_share=0.148,
    )
    assert np.percentile(error(tracing(ends(rig, STATE.DONE), 0.2)), 99) < 0.005


def test_heading_with_dead_time():
    """R 3 with a sensor 10 periods late: a heading that is late too would be off by 4 degrees, an error of 0.02 mm."""
    rig = Rig(
        (-15, 0, 0),
        {"surface_number": SURFACE.CYLINDER, "size_mm": 2, "delay_periods": 10},
        mode_number=MODE.CONTOUR,
        approach_dir=(1, 0, 0),
        dead_time_s=10 * PERIOD_S,
        feed_mm_s=20.0,
        friction_share=0.148,
    )
    assert np.percentile(error(tracing(ends(rig, STATE.DONE), 0.2)), 99) < 0.005


def test_no_velocity_above_its_limit():
    rig = Rig(
        (-15, 0, 3), {"surface_number": SURFACE.CORNER}, feed_mm_s=1e4, max_vel_mm_s=25.0, soft_max_mm=(FAR, FAR, 15.0)
    )
    rows = ends(rig, STATE.FAULT, FAULT.SOFT_LIMIT)
    speed = np.linalg.norm(rows["velocity_mm_s"], axis=1)
    assert 24.0 < speed.max() <= 25.0 * (1 + 1e-9) and (speed <= rows["velocity_limit_mm_s"] * (1 + 1e-9)).all()


@pytest.mark.parametrize("hollow", [False, True])
@pytest.mark.parametrize("radius, feed, periods, most", [(10, 50, 0, 0.005), (3, 20, 3, 0.003)])
def test_ball(radius, feed, periods, most, hollow):
    """Lines over a ball, 0.2 s after the landing: from 0.05 s after the beginning of each on, in which the stylus
    sticks first, and whole."""
    rows = ends(ball(radius, feed, periods, hollow), STATE.DONE)
    trace = rows["state"] == STATE.TRACE
    settled = np.convolve(trace, np.ones(50))[: len(rows)] == 50
    settled[: np.argmax(trace) + 200] = False
    assert settled.sum() > 300
    assert np.percentile(error(rows[settled]), 99) < most
    assert np.percentile(error(rows[np.argmax(trace) + 200 :][trace[np.argmax(trace) + 200 :]]), 99) < most


@pytest.mark.parametrize("share", [0.3, 1.0])
@pytest.mark.parametrize("delay, accel, reach, radius", [(0, 300, 5.0, 0), (3, 2000, 0.5, 3), (10, 8000, 1.5, 1)])
@pytest.mark.parametrize("angle", [45, 60, 90])
def test_inside_corner(angle, delay, accel, reach, radius, share):
    """Into a wall at the highest velocity there is: no over-range; the trace goes on up the wall."""
    rig = Rig(
        (-15, 0, 5),
        {"surface_number": SURFACE.CORNER, "angle_deg": angle, "delay_periods": delay, "ball_mm": radius},
        feed_mm_s=1e5,
        max_vel_mm_s=1e5,
        acceleration_mm_s2=accel,
        range_mm=reach,
        dead_time_s=delay * PERIOD_S,
        max_jump_mm=2.0,
        approach_vel_mm_s=5.0,
        soft_max_mm=(FAR, FAR, 15.0),
    )
    limit = math.sqrt(2 * accel * (reach - 0.3))
    rig.settings.feed_mm_s = share * limit
    rows = ends(rig, STATE.FAULT, FAULT.SOFT_LIMIT)
    late = delay * PERIOD_S + PERIOD_S
    exact = accel * (math.sqrt(late**2 + 2 * 0.6 * (reach - 0.3) / accel) - late)
    fastest = np.linalg.norm(rows["velocity_mm_s"], axis=1).max()
    assert min(share * limit, exact) * 0.9 < fastest <= exact * (1 + 1e-9) < limit
    assert rows["measured_mm"].max() < 0.3 + 0.9 * (reach - 0.3)


def test_a_loop_at_the_limit_of_its_gain_is_stable():
    """An asked-for gain of 1e5 is held to 0.75 / (dead time + period), and the deflection rests."""
    for periods in (0, 3, 10):
        rig = Rig((0, 0, 3), {"delay_periods": periods}, gain_hz=1e5, dead_time_s=periods * PERIOD_S, feed_mm_s=0.0)
        rows = rig.run(3.0)
        assert rows["gain_hz"][-1] == pytest.approx(0.75 / ((periods + 1) * PERIOD_S))
        assert error(rows[-500:]).max() < 1e-4


# ---- paths ---------------------------------------------------------------------------------------------------------


def test_lines_to_and_fro():
    """Each line at its place, the window kept, the ball on the model."""
    rig = Rig(
        (-8, -4, 12),
        {"surface_number": SURFACE.BALL, "size_mm": 14},
        pick_mm=2.0,
        feed_mm_s=40.0,
        window_min_mm=(-8, -4, -FAR),
        window_max_mm=(8, 4, FAR),
    )
    rows = ends(rig, STATE.DONE)
    assert rows["lines"][-1] == 5
    middle = tracing(rows)
    middle = middle[np.abs(middle["position_mm"][:, 0]) < 5]
    for place in (-4, -2, 0, 2, 4):
        line = middle[np.abs(middle["position_mm"][:, 1] - place) < 0.5]
        assert len(line) > 100 and np.abs(line["position_mm"][:, 1] - place).max() < 0.02, place
    assert np.abs(rows["position_mm"][:, 0]).max() < 8.001
    assert np.abs(np.linalg.norm(middle["ball_mm"], axis=1) - 15.0).max() < 1e-9


def test_lines_one_way():
    rig = Rig(
        (-8, -4, 16),
        {"surface_number": SURFACE.BALL, "size_mm": 14},
        mode_number=MODE.ONE_WAY,
        pick_mm=2.0,
        window_min_mm=(-8, -4, -FAR),
        window_max_mm=(8, 4, FAR),
    )
    rows = ends(rig, STATE.DONE)
    assert rows["lines"][-1] == 5
    along = tracing(rows)
    along = along[np.abs(along["position_mm"][:, 0]) < 6]
    assert along["velocity_mm_s"][:, 0].min() > 0.0
    back = rows[rows["state"] == STATE.RETURN]
    assert len(back) and np.linalg.norm(back["deflection_mm"], axis=1).max() == 0.0


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(
    "surface, length", [(SURFACE.CYLINDER, 2 * math.pi * 9.7), (SURFACE.BOX, 64 + 2 * math.pi * 0.7)]
)
def test_contour(surface, length, direction):
    """Three laps at three heights, each 360 degrees and not much more."""
    rig = Rig(
        (-15, 0, 0),
        {"surface_number": surface, "size_mm": 9 if surface == SURFACE.CYLINDER else 8},
        mode_number=MODE.CONTOUR,
        direction_sign=direction,
        approach_dir=(1, 0, 0),
        pick_mm=-1.0,
        window_min_mm=(-20, -20, -2.5),
    )
    rows = ends(rig, STATE.DONE)
    assert rows["lines"][-1] == 3
    traced = tracing(rows)
    for height in (0, -1, -2):
        lap = traced[np.abs(traced["position_mm"][:, 2] - height) < 0.2]
        steps = np.linalg.norm(np.diff(lap["position_mm"], axis=0), axis=1)
        assert steps[steps < 0.1].sum() == pytest.approx(length, rel=0.03)
    assert np.percentile(error(traced[50:]), 99) < 0.005


def test_partial():
    """Between the window's sides, to and fro, one height below the other."""
    rig = Rig(
        (-15, 0, 0),
        {"surface_number": SURFACE.CYLINDER, "size_mm": 9},
        mode_number=MODE.PARTIAL,
        approach_dir=(1, 0, 0),
        pick_mm=-1.0,
        window_min_mm=(-20, -7, -2.5),
        window_max_mm=(20, 7, 10),
    )
    rows = ends(rig, STATE.DONE)
    assert rows["lines"][-1] == 3 and np.abs(rows["position_mm"][:, 1]).max() < 7.0
    assert tracing(rows)["position_mm"][:, 0].max() < 0.0
    assert rows["ball_mm"][:, 1].min() < -6.5


# ---- what ends a trace ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("feed", [10, 40, 70])
@pytest.mark.parametrize("radius", [0.5, 1.0])
def test_step_down(feed, radius):
    """5 mm down: followed, or left and landed on; never over-range."""
    rig = Rig((-15, 0, 3), {"surface_number": SURFACE.STEP, "size_mm": 5.0, "ball_mm": radius}, feed_mm_s=feed)
    rows = ends(rig, STATE.DONE)
    low = rows[(rows["position_mm"][:, 0] > 5) & (rows["state"] == STATE.TRACE)]
    assert len(low) and np.abs(low["ball_mm"][:, 2] + 5.0 - radius).max() < 1e-9
    assert np.percentile(error(low[100:]), 99) < 0.005
    if feed == 70:
        assert (rows["state"] == STATE.LOST).any()


def test_nothing_below_the_edge():
    """A step of 100 mm: the steps back to the model is `lost_mm`, then it is a fault, and the head rests."""
    rig = Rig(
        (-15, 0, 3), {"surface_number": SURFACE.STEP, "size_mm": 100.0, "ball_mm": 0.5}, feed_mm_s=70, lost_mm=0.5
    )
    rig.model.angle_deg = 0.0
    rows = ends(rig, STATE.FAULT, FAULT.NO_CONTACT)
    lost = rows[rows["state"] == STATE.LOST]["position_mm"]
    assert 0.4 < np.linalg.norm(lost - lost[0], axis=1).max() < 0.6
    assert np.abs(rig.run(0.5)["velocity_mm_s"][-1]).max() == 0.0


def test_overhang():
    """A line that goes round below a ball stops."""
    rows = ends(Rig((0, 0, 12), {"surface_number": SURFACE.BALL, "size_mm": 9}), STATE.FAULT, FAULT.BELOW)
    assert rows["ball_mm"][:, 2].min() > -5.0


def test_nothing_within_the_search():
    rows = ends(Rig((0, 0, 50), search_mm=3.0), STATE.FAULT, FAULT.NO_CONTACT)
    assert 46.9 < rows["position_mm"][-1, 2] < 47.1


def rests(rig, rows):
    """After a fault: no velocity above that of before, braking with A, at rest for good."""
    before = np.linalg.norm(rows["velocity_mm_s"][-1])
    after = rig.run(1.0)
    speed = np.linalg.norm(after["velocity_mm_s"], axis=1)
    assert (np.diff(speed) <= 1e-12).all() and speed[0] <= before + 1e-12
    assert speed[-1] == 0.0 and (after["state"] == rows["state"][-1]).all()
    assert (rig.run(0.01, enabled=0)["state"] == STATE.IDLE).all()


def test_over_range():
    """The model comes towards the head by 2 mm: OVER_RANGE, and it stays."""
    rig = Rig((-15, 0, 3), max_jump_mm=5.0)
    rig.run(0.5)
    rig.model.at_mm[2] += 2.0
    rows = ends(rig, STATE.OVER_RANGE, FAULT.TOO_FAR)
    assert rows["measured_mm"][-1] >= 1.5
    rests(rig, rows)


def test_sensor_jump():
    rig = Rig((-15, 0, 3))
    rig.run(0.5)
    rig.model.at_mm[2] += 0.6
    rests(rig, ends(rig, STATE.FAULT, FAULT.SENSOR_JUMP))


def test_position_jump():
    rig = Rig((-15, 0, 3))
    rig.run(0.5)
    rig.p[1] += 0.6
    rests(rig, ends(rig, STATE.FAULT, FAULT.POSITION_JUMP))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300])
@pytest.mark.parametrize("what", ["position", "deflection"])
def test_not_finite(what, value):
    """One period of nonsense ends the trace; every velocity stays finite."""
    rig = Rig((-15, 0, 3))
    rig.run(0.5)
    p, surface = rig.p[0], rig.model.normal[2]
    if what == "position":
        rig.p[0] = value
        rig.model.surface_number = -1
        rig.model.normal[:] = (0, 0, 1)
    else:
        rig.model.noise_mm = 0.0
        rig.stylus.deflection_mm[0][0] = value
        rig.model.delay_periods = (rig.stylus.newest + 1) % 32
    rows = rig.run(PERIOD_S)
    assert rows["state"][-1] == STATE.FAULT and rows["fault"][-1] == FAULT.NOT_FINITE
    rig.p[0], rig.model.delay_periods, rig.model.normal[2] = p, 0, surface
    rig.stylus.is_touching = 0
    assert np.isfinite(rows["velocity_mm_s"]).all()
    rests(rig, rows)


def test_soft_limit():
    """Up a slope to a soft limit of Z: stops before it."""
    rows = ends(slope(soft_max_mm=(FAR, FAR, 10.0)), STATE.FAULT, FAULT.SOFT_LIMIT)
    assert 9.9 < rows["position_mm"][:, 2].max() < 10.0


def test_settings_that_cannot_be():
    for name, value in (
        ("range_mm", 0.2),
        ("acceleration_mm_s2", math.nan),
        ("gain_hz", 0.0),
        ("mode_number", 9),
        ("scan_axis_number", 2),
        ("direction_sign", 0),
        ("dead_time_s", -1.0),
        ("deflection_mm", math.inf),
        ("approach_dir", (0, 0, 0)),
    ):
        rows = Rig((0, 0, 3), **{name: value}).run(0.1)
        assert (rows["state"] == STATE.FAULT).all() and (rows["fault"] == FAULT.SETTINGS).all(), name
        assert (rows["velocity_mm_s"] == 0.0).all(), name


def test_limited_by():
    """Each limit says so."""
    seen = {limit: False for limit in LIMIT}
    fast = dict(SETTINGS, feed_mm_s=1e4)
    for settings in (dict(feed_mm_s=1e4, max_vel_mm_s=1e4), dict(fast, max_vel_mm_s=20.0), {}, dict(gain_hz=500.0)):
        for surface in (SURFACE.PLANE, SURFACE.CORNER):
            rig = Rig((-15, 0, 3), {"surface_number": surface}, **{**settings, "soft_max_mm": (FAR, FAR, 15.0)})
            for limit in rig.until(STATE.DONE, STATE.FAULT)["limited_by"]:
                seen[LIMIT(int(limit))] = True
    rig = Rig(
        (-15, 0, 0),
        {"surface_number": SURFACE.CYLINDER, "size_mm": 0.5},
        feed_mm_s=70.0,
        mode_number=MODE.CONTOUR,
        approach_dir=(1, 0, 0),
    )
    seen[LIMIT.BEND] = bool((rig.until(STATE.DONE)["limited_by"] == LIMIT.BEND).any())
    assert all(seen.values()), seen
