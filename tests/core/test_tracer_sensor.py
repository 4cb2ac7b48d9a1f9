# SPDX-License-Identifier: GPL-2.0-or-later
"""A sensor that lies: each kind is seen, and the stylus, deflected as it really is, stays within its range.

Kinds at random moments: test_tracer_faults.c."""

import ctypes as C

import numpy as np
import pytest

from chipwise.clib import core, layout
from support.random_cases import random_seed
from support.tracer_rig import FAR, FAULT, PERIOD_S, SETTINGS, STATE, SURFACE, Rig

RANGE_MM = SETTINGS["range_mm"]
IDLE = 200  # periods at rest, in which the noise is seen
END = (STATE.DONE, STATE.FAULT, STATE.OVER_RANGE)


class Head:
    """The loop of tracer_loop.c with `spoil(reading, period)` between stylus and tracer; `period` counts from the first
    contact."""

    def __init__(self, model=None, at=(-15, 0, 3), **settings):
        self.rig = Rig(at, model, **settings)
        self.out, self.worst_mm, self.inside = layout.TracerOut(), 0.0, layout.TracerIn()
        self.inside.feed_share, self.inside.period_s = 1.0, PERIOD_S

    def step(self, spoil, period, enabled=1):
        rig, library, now = self.rig, core.library(), (C.c_double * 3)()
        library.chip_stylus_step(C.byref(rig.stylus), C.byref(rig.model), rig.p, self.inside.deflection_mm, now)
        self.inside.deflection_mm[:] = spoil(np.array(self.inside.deflection_mm), period)
        self.inside.position_mm[:], self.inside.is_enabled = rig.p, enabled
        library.chip_tracer_step(C.byref(rig.tracer), C.byref(rig.settings), C.byref(self.inside), C.byref(self.out))
        speed = np.linalg.norm(self.out.velocity_mm_s)
        self.worst_mm = max(self.worst_mm, np.linalg.norm(now))
        assert np.linalg.norm(now) <= RANGE_MM + speed * PERIOD_S, (period, np.linalg.norm(now))
        for i in range(3):
            rig.p[i] += PERIOD_S * self.out.velocity_mm_s[i]

    def run(self, spoil, periods=3000):
        """-> periods from the first contact to the end, or `periods`; the head rests there."""
        for _ in range(IDLE):
            self.step(lambda reading, _: reading, 0, 0)
        period = 0
        while period < periods and self.out.state_number not in END:
            self.step(spoil if period else lambda reading, _: reading, period)
            period += period > 0 or self.out.state_number == STATE.TRACE
        for _ in range(100 if self.out.state_number in END else 0):
            self.step(spoil, period)
        assert self.out.state_number not in END or np.linalg.norm(self.out.velocity_mm_s) == 0.0
        return period

    @property
    def fault(self):
        return self.out.fault_number


def frozen_from(start, axes=(0, 1, 2)):
    held = {}

    def spoil(reading, period):
        if period >= start:
            first = held.setdefault("reading", reading.copy())
            reading[list(axes)] = first[list(axes)]
        return reading

    return spoil


@pytest.mark.parametrize("noise", [0.0, 0.0005])
def test_a_broken_cable(noise):
    """0.3 mm to 0 in a period: a fault in this period, where the head was 0.8 mm deep in the model before."""
    head = Head({"noise_mm": noise})
    assert head.run(lambda reading, period: reading * (period < 400)) == 401
    assert head.fault == FAULT.SENSOR_JUMP and head.worst_mm < 0.32


def test_a_point_over_an_edge_falls_faster_than_the_head():
    """A stylus without a ball leaves an edge at once: it looks like a broken cable."""
    head = Head({"surface_number": SURFACE.STEP, "size_mm": 5.0, "ball_mm": 0.0})
    head.run(lambda reading, _: reading)
    assert head.fault == FAULT.SENSOR_JUMP


@pytest.mark.parametrize("noise", [0.0, 0.0005])
def test_a_frozen_sensor(noise):
    """On a flat model, where the deflection is the same for good: seen in 40 periods; with noise in 4."""
    head = Head({"noise_mm": noise})
    assert head.run(frozen_from(600)) < 600 + (6 if noise else 40)
    assert head.fault == FAULT.FROZEN and head.worst_mm < 0.32


def test_a_frozen_sensor_before_a_wall():
    """At the highest feed, 0.2 mm before the ball meets a wall."""
    for noise in (0.0, 0.0005):
        head = Head({"noise_mm": noise, "surface_number": SURFACE.CORNER}, feed_mm_s=1e4)
        held = {}

        def spoil(reading, _, held=held, head=head):
            return held.setdefault("reading", reading.copy()) if head.rig.p[0] > -1.2 else reading

        head.run(spoil)
        assert head.fault == FAULT.FROZEN, noise


def test_one_axis_stands_still():
    """X alone, which a flat model never moves: its noise is missing, before there is a wall."""
    head = Head({"noise_mm": 0.0005, "surface_number": SURFACE.CORNER})
    assert head.run(frozen_from(300, (0,))) < 306 and head.fault == FAULT.FROZEN


def test_an_inverted_axis():
    """X has the wrong sign: against a wall the deflection contradicts the head."""
    head = Head({"noise_mm": 0.0005, "surface_number": SURFACE.CORNER}, feed_mm_s=40.0)
    head.run(lambda reading, _: reading * (-1.0, 1.0, 1.0))
    assert head.fault in (FAULT.CONTRADICTS, FAULT.TOO_FAR)


def test_a_weak_sensor():
    """A third of the deflection: seen while it is built up at the landing."""
    head = Head({"noise_mm": 0.0005})
    for _ in range(4000):
        head.step(lambda reading, _: reading / 3.0, 0)
    assert head.fault == FAULT.CONTRADICTS


def test_air_is_not_traced():
    """An amplifier that is dead but for its noise, at the deflection asked for: nothing answers the swing.  Alive,
    nothing is seen."""
    random = np.random.default_rng(random_seed())
    for dead_from, fault in ((600, FAULT.FROZEN), (10000, FAULT.NO_FAULT)):
        head = Head({"noise_mm": 0.0005}, feed_mm_s=5.0, gain_hz=100.0)
        head.run(
            lambda reading, period, dead_from=dead_from: (
                reading if period < dead_from else (-0.04, 0.0, 0.297) + random.normal(0, 0.0005, 3)
            ),
            4500,
        )
        assert head.fault == fault, dead_from


def test_a_deflection_in_the_air():
    """A zero that has moved slowly shows in the retract: the deflection stays as the head leaves the model."""
    head = Head({"noise_mm": 0.0005}, window_max_mm=(-5, 20, FAR), feed_mm_s=5.0)
    head.run(lambda reading, period: reading + (0.0, 0.0, 0.0001 * min(period, 2000)))
    assert head.fault == FAULT.CONTRADICTS


@pytest.mark.parametrize("step_mm", [0.0005, 0.002])
def test_a_sensor_with_steps(step_mm):
    """A digital sensor without noise on a flat model: the same reading for long, and no fault; the deflection is held
    to the swing."""
    head = Head({"noise_mm": 0.0})
    head.run(lambda reading, _: np.round(reading / step_mm) * step_mm)
    assert head.out.state_number == STATE.DONE and head.worst_mm < 0.32
