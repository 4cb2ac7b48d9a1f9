# SPDX-License-Identifier: GPL-2.0-or-later
"""The sums of a program (run_sums.h): times, mean, peak, time saved; what begins and ends them; hostile numbers."""

import math

import numpy as np
import pytest

from chipwise.clib import core
from support.feed_cases import given, hostile
from support.random_cases import random_seed

PERIOD_S = 0.001


class Program:
    """Sums, period by period, at an area (mm2) and a velocity (mm/s); lost: share of the reading that the map loses."""

    def __init__(self):
        self.sums, self.removed = core.RunSums(), 0.0

    def step(self, seconds, area=0.0, velocity=10.0, running=True, lag=0.0, lost=1.0, **values):
        for _ in range(round(seconds / PERIOD_S)):
            self.removed += lost * area * velocity * PERIOD_S
            core.add_period(
                self.sums,
                given(section_area_mm2=area, current_vel_mm_s=velocity, depth_mm=3.0, **values),
                running,
                self.removed - lag,
            )
        return self.sums.program

    def rest(self, seconds, running):
        return self.step(seconds, velocity=0.0, running=running, motion=0)


def test_times_mean_and_peak():
    """1 s in air, 2 s at 6 mm2, 0.5 s at 12 mm2, at 10 mm/s; F is 10, 5 s long at twice F."""
    program = Program()
    program.step(1.0)
    program.step(2.0, 6.0)
    found = program.step(0.5, 12.0)
    assert (found.run_s, found.air_s, found.cut_s) == pytest.approx((3.5, 1.0, 2.5)) and found.saved_s == pytest.approx(
        0.0, abs=1e-9
    )
    assert core.run_mean(program.sums) == pytest.approx(
        (2 * 60 + 0.5 * 120) / 2.5
    ) and found.peak_mm3_s == pytest.approx(120.0)
    assert program.step(5.0, velocity=20.0).saved_s == pytest.approx(5.0)
    assert program.step(5.0, velocity=5.0).saved_s == pytest.approx(2.5)
    assert program.step(1.0, velocity=20.0, feed_mode=0).saved_s == pytest.approx(2.5)
    assert program.step(1.0, velocity=20.0, feed_override_share=2.0).saved_s == pytest.approx(2.5)


def test_a_thin_reading_cuts_if_the_map_loses_it():
    """Below 0.01 mm2, or narrower than 0.01 mm over the depth of 3 mm: a sliver, or a wall that was cut before."""
    for area in (0.002, 0.009, 0.029):
        program = Program()
        assert program.step(0.9, area).cut_s == pytest.approx(0.5, abs=0.01)  # half a second at a time
        program.step(0.1, area)
        program.rest(0.1, True)
        assert program.sums.program.cut_s == pytest.approx(1.0) and program.sums.program.air_s == 0.0
        program = Program()
        program.step(1.0, area, lost=0.4)
        found = program.rest(0.1, True)
        assert found.cut_s == 0.0 and found.air_s == pytest.approx(1.0)
    program = Program()
    assert program.step(1.0, 0.031, lost=0.0).cut_s == pytest.approx(1.0)
    assert program.step(1.0, 0.0009).cut_s == pytest.approx(1.0)


def test_what_a_cut_before_leaves_in_the_map_is_no_sliver():
    """The map loses the end of a cut some periods late, while the tool follows a wall that was cut before."""
    program = Program()
    program.step(1.0, 6.0, lag=0.5)
    program.step(0.005, 0.02, lost=0.0, lag=0.5)
    program.step(1.0, 0.02, lost=0.0)
    found = program.rest(0.1, True)
    assert found.cut_s == pytest.approx(1.0) and found.air_s == pytest.approx(1.005)


def test_a_plunge_begins_where_the_map_loses():
    """0.2 s in which the reading rises towards the top of the stock are air but for 20 periods; level moves count as
    they read."""
    for direction, cut in ((-1.0, 0.5 + 0.02), (0.0, 0.7)):
        program = Program()
        program.step(0.3, dir_z=direction)
        for _ in range(200):
            program.step(PERIOD_S, 4.0, lost=0.0, dir_z=direction)
        found = program.step(0.5, 8.0, dir_z=direction)
        assert found.cut_s == pytest.approx(cut, abs=0.0021) and found.cut_s + found.air_s == pytest.approx(1.0)
    program = Program()
    program.step(0.3)
    program.step(2.0, 4.0, lost=0.0, dir_z=-1.0)  # it never arrives
    found = program.rest(0.1, True)
    assert found.cut_s == 0.0 and found.air_s == pytest.approx(2.3)


def test_a_short_spike_is_no_peak():
    """A period at ten times the area is a tenth of the window's mean; windows with a traverse do not count."""
    program = Program()
    program.step(0.1, 6.0)
    program.step(0.001, 60.0)
    assert program.step(0.1, 6.0).peak_mm3_s == pytest.approx(60.0 * 1.9)
    short = Program()
    short.step(0.009, 6.0)
    short.rest(0.1, True)
    assert short.sums.program.peak_mm3_s == 0.0


def test_begins_with_the_program():
    """Reported 15 ms late, nothing is lost; what MDI did before does not count; the end leaves the sums, a new start
    clears them."""
    program = Program()
    program.step(2.0, 6.0, running=False)
    program.rest(0.5, False)
    program.step(0.015, 6.0, running=False)
    found = program.step(0.985, 6.0)
    assert found.cut_s == pytest.approx(1.0) and core.run_mean(program.sums) == pytest.approx(60.0)
    program.rest(0.5, False)
    program.step(3.0, 6.0, running=False)
    assert program.sums.program.cut_s == pytest.approx(1.0)
    program.rest(0.5, False)
    assert program.rest(0.5, True).cut_s == 0.0 and program.sums.program.run_s == pytest.approx(0.5)


def test_another_stock_is_no_volume():
    """A new stock sets the volume back; a restored one brings its own, while nothing moves."""
    program = Program()
    program.step(1.0, 6.0)
    program.rest(0.1, True)
    program.removed = 0.0
    program.rest(0.1, True)
    program.removed = 5000.0
    program.rest(0.1, True)
    program.step(1.0, 6.0)
    assert core.run_mean(program.sums) == pytest.approx(60.0, rel=1e-3)  # the very first period has none before it


@pytest.mark.parametrize("spoilt", [True, False])
def test_hostile(spoilt):
    """Whatever comes in, every sum stays finite and within its bound."""
    random, sums = np.random.default_rng(random_seed()), core.RunSums()
    for k in range(5000):
        values = hostile(random)
        values.pop("last")
        now = given(**values)
        now.current_vel_mm_s = random.choice([math.nan, math.inf, -5.0, 1e300, 10.0])
        removed = random.choice([math.nan, math.inf, -math.inf, 1e300, -1.0, float(k)]) if spoilt else float(k)
        core.add_period(sums, now, bool(k % 97), removed)
        found = sums.program
        for name in ("run_s", "cut_s", "air_s", "fed_s", "saved_s", "volume_mm3", "peak_mm3_s"):
            value = getattr(found, name)
            assert math.isfinite(value) and abs(value) <= 1e15 and (value >= 0 or name == "saved_s"), name
        assert math.isfinite(core.run_mean(sums))


def test_the_time_that_a_tool_rubs():
    """2 edges at 100 1/s and 10 mm/s: 0.05 mm a tooth; while it cuts, and only if chip and smallest chip are known."""
    known = {"flutes": 2.0, "spindle_speed_rps": 100.0, "max_chip_mm": 0.1, "min_chip_mm": 0.01}
    program = Program()
    program.step(1.0, chip_share_now=0.1, **known)  # air
    program.step(1.0, 6.0, chip_share_now=0.5, **known)  # 0.025 mm
    program.step(1.0, 6.0, chip_share_now=0.0, **known)  # not known
    assert program.sums.program.rub_s == 0.0
    program.step(0.5, 6.0, chip_share_now=0.1, **known)  # 0.005 mm
    program.step(0.2, 6.0, velocity=1.5, chip_share_now=1.0, **known)
    assert program.sums.program.rub_s == pytest.approx(0.7)
    for less in (
        {"min_chip_mm": 0.0},
        {"flutes": 0.0},
        {"spindle_speed_rps": 0.0},
        {"min_chip_mm": math.nan},
        {"chip_share_now": math.nan},
        {"min_chip_mm": -1.0},
    ):
        program.step(0.3, 6.0, **known | {"chip_share_now": 0.1} | less)
    assert program.sums.program.rub_s == pytest.approx(0.7)
    program.rest(0.2, False)
    assert program.step(0.1, 6.0, chip_share_now=0.1, **known).rub_s == pytest.approx(0.1)
