# SPDX-License-Identifier: GPL-2.0-or-later
"""The times of `chipwise check` against closed forms: how LinuxCNC's planner stops, and joins two moves."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from support.check_runs import HEAD, STOCK, chipwise_check
from chipwise.program import records
from chipwise.check.path_part import PathPart
from chipwise.check.times import Timer

ACCEL, SPEED = 500.0, 100.0  # mm/s2, mm/s


def seconds(points, kinds, feed=50.0, path=0.01, first=None, mode=None, volume=None):
    """(s at F, s under M251) of a path from points[0] on, whose end nothing follows."""
    timer = Timer(SimpleNamespace(speeds=[SPEED] * 3, accels=[ACCEL] * 3, max_override=1.0))
    timer.path = path
    if mode:
        timer.set_feed_mode(*mode)
    points = np.array(points, float)
    steps = np.diff(points, axis=0)
    n = len(steps)
    part = PathPart(
        np.array(kinds),
        np.arange(1, n + 1),
        np.full(n, feed),
        steps,
        np.linalg.norm(steps, axis=1),
        np.zeros(n) if volume is None else volume,
        np.zeros(n) if first is None else first,
    )
    timer.spend(part, None, True)
    return timer.load.end, timer.load_volumetric.end


def rest_to_rest(length, speed, accel):
    return length / speed + speed / accel if length > speed**2 / accel else 2.0 * math.sqrt(length / accel)


@pytest.mark.parametrize("path, share", [(0.01, 0.5), (records.EXACT_PATH, 1.0), (records.EXACT_STOP, 1.0)])
def test_a_move_that_nothing_follows_has_half_the_acceleration_under_g64(path, share):
    assert seconds([(0, 0, 0), (0, 0, 10)], [records.RAPID], path=path)[0] == pytest.approx(
        rest_to_rest(10.0, SPEED, share * ACCEL), rel=1e-6
    )


def test_exact_stop_and_exact_path_stop_at_corners_and_exact_path_passes_tangents():
    corner, line = [(0, 0, 0), (10, 0, 0), (10, 10, 0)], [(0, 0, 0), (10, 0, 0), (20, 0, 0)]
    kinds = [records.FEED] * 2
    two, one = 2.0 * rest_to_rest(10.0, 50.0, ACCEL), rest_to_rest(20.0, 50.0, ACCEL)
    for path in (records.EXACT_PATH, records.EXACT_STOP):
        assert seconds(corner, kinds, path=path)[0] == pytest.approx(two, rel=1e-6)
    # one tangent move after the other: lines differ, so they are two moves; G61 passes, at the 0.1 % that the joint
    # costs
    assert seconds(line, kinds, path=records.EXACT_PATH)[0] == pytest.approx(one, rel=1e-3)
    assert seconds(line, kinds, path=records.EXACT_STOP)[0] == pytest.approx(two, rel=1e-6)


def test_a_larger_tolerance_is_faster_and_a_turn_back_stops():
    corner = [(0, 0, 0), (10, 0, 0), (10, 10, 0)]
    kinds = [records.FEED] * 2
    times = [seconds(corner, kinds, path=path)[0] for path in (records.EXACT_STOP, 0.001, 0.01, 0.1, 1.0)]
    assert times[1] > times[2] > times[3] > times[4]
    back = rest_to_rest(10.0, 50.0, ACCEL) + rest_to_rest(10.0, 50.0, 0.5 * ACCEL)
    assert seconds([(0, 0, 0), (10, 0, 0), (0, 0, 0)], kinds)[0] == pytest.approx(back, rel=1e-6)


def test_between_g0_and_a_feed_the_path_stops():
    through = [(0, 0, 0), (10, 0, 0), (20, 0, 0)]
    stops = rest_to_rest(10.0, SPEED, ACCEL) + rest_to_rest(10.0, 50.0, 0.5 * ACCEL)
    assert seconds(through, [records.RAPID, records.FEED])[0] == pytest.approx(stops, rel=1e-6)


def test_a_full_slot_under_m251_takes_its_volume_over_the_rate_wherever_traverses_are():
    """100 mm of 1 mm segments; the window of the first millimetre begins behind the traverse."""
    points = [(-0.5, 0, 0)] + [(k, 0, 0) for k in range(101)]
    volume = np.concatenate(([0.0], np.full(100, 10.0)))  # mm3 a mm
    kinds = [records.RAPID] + [records.FEED] * 100
    speed = 6000.0 / 60.0 / 10.0  # mm/s: 10
    wanted = rest_to_rest(0.5, SPEED, ACCEL) + 100.0 / speed + speed / ACCEL / 2
    assert seconds(points, kinds, mode=(2, 6000.0, 0.0, 6000.0), volume=volume)[1] == pytest.approx(wanted, rel=0.003)


def test_what_is_not_in_the_times_is_named(tmp_path):
    body = HEAD + STOCK + "T1 M6\nS1000 M3\nG0 X-10 Y30 Z5\nG0 Z-4\nG1 X110 F600\nG0 Z5\nG4 P1.5\nM2\n"
    _status, out, _err, report = chipwise_check(tmp_path, {"part.ngc": body})
    assert "not in the times: 1 tool change, starts of the spindle, the move to the first place, dwells (1.5 s)" in out
    (program,) = report["programs"]
    assert program["tool_changes"] == 1 and program["dwell_s"] == 1.5
    # the move to the first place, 500 mm and more, adds nothing
    far = chipwise_check(tmp_path, {"part.ngc": body.replace("G0 X-10 Y30 Z5", "G0 X-10 Y30 Z5 (the same place)")})[3]
    assert far["programs"][0]["tools"][0]["planned_s"] == program["tools"][0]["planned_s"]


def test_motion_stops_for_the_spindle_and_the_coolant(tmp_path):
    """A retract in two moves takes longer if the coolant is switched off between them: rest to rest, at half the
    acceleration."""
    body = HEAD + STOCK + "T1 M6\nG0 X-10 Y30 Z5\nG0 Z-4\nG1 X110 F600\nG0 Z5\n{}G0 Z15\nM2\n"
    through, stopped = (
        chipwise_check(tmp_path, {"part.ngc": body.format(code)})[3]["programs"][0]["tools"][0]["planned_s"]
        for code in ("", "M9\n")
    )
    assert stopped == pytest.approx(through, abs=1e-6), "M9 changes nothing where coolant is off"
    on = (
        chipwise_check(tmp_path, {"part.ngc": body.replace("G0 X-10", "M8\nG0 X-10").format(code)})[3]["programs"][0][
            "tools"
        ][0]["planned_s"]
        for code in ("", "M9\n")
    )
    through, stopped = on
    assert stopped > through + 0.05
