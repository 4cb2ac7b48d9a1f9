# SPDX-License-Identifier: GPL-2.0-or-later
"""The watch over the override (watchdog.h): what a machine that follows it does never trips it, M52 P0 does."""

import math

import numpy as np
import pytest

from chipwise.clib import core
from support.random_cases import random_seed

DT, ACCEL, CEILING, F = 0.001, 500.0, 50.0, 10.0


class Machine:
    """A planner with one axis: it goes for override x requested velocity at `accel`, braking maybe weaker."""

    def __init__(self, follows=True, override=1.0, braking=0.43):
        self.watch, self.velocity, self.scale = core.Watchdog(), 0.0, 1.0
        self.follows, self.override, self.braking = follows, override, braking
        self.inhibit = False

    def step(self, scale, **changes):
        """-> not stopped; the scale acts a period later."""
        goal = self.override * CEILING * (self.scale if self.follows else 1.0) * (not self.inhibit)
        low, high = self.velocity - self.braking * ACCEL * DT, self.velocity + ACCEL * DT
        self.velocity = min(max(goal, low), high)
        self.scale = scale
        values = core.WatchdogIn(
            feed_mode=2,
            motion=2,
            programmed_vel_mm_s=F,
            requested_vel_mm_s=CEILING,
            override_share=scale,
            current_vel_mm_s=self.velocity,
            acceleration_mm_s2=ACCEL,
            max_override_share=1.5,
            period_s=DT,
        )
        for name, value in changes.items():
            setattr(values, name, value)
        return core.follows_override(self.watch, values)


def test_it_is_seen_in_time():
    """From standstill: tripped as soon as the velocity passes what 150 % of F would be."""
    machine = Machine(follows=False)
    for _ in range(200):
        if not machine.step(0.1):
            break
    assert machine.velocity <= 1.5 * F * 1.02 + 7 * ACCEL * DT
    assert not core.follows_override(
        machine.watch, core.WatchdogIn(feed_mode=2, motion=2)
    )  # kept while a move is there
    assert core.follows_override(machine.watch, core.WatchdogIn(feed_mode=2, motion=0))  # and let go with it


def test_it_stops_and_stays_stopped():
    machine = Machine(follows=False)
    for _ in range(2000):
        machine.inhibit = not machine.step(0.1)
    assert machine.velocity == 0.0 and machine.inhibit


@pytest.mark.parametrize("override", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("braking", [0.3, 0.43, 1.0])
def test_a_machine_that_follows_is_never_stopped(override, braking):
    """Random overrides, jumping and drifting, braking at any strength LinuxCNC has."""
    random = np.random.default_rng(random_seed())
    machine, scale = Machine(override=override, braking=braking), 1.0
    for _ in range(20000):
        if random.random() < 0.02:
            scale = random.random()
        scale = float(np.clip(scale + random.normal(0, 0.01), 0.001, 1))
        assert machine.step(scale)


def test_what_is_not_judged():
    """No ceiling, other motions, a move that follows the spindle."""
    for changes in (
        dict(programmed_vel_mm_s=0.0),
        dict(programmed_vel_mm_s=CEILING),
        dict(motion=1),
        dict(motion=4),
        dict(feed_mode=0, programmed_vel_mm_s=0.0),
        dict(feed_mode=0, programmed_vel_mm_s=CEILING),
    ):
        machine = Machine(follows=False)
        assert all(machine.step(0.01, **changes) for _ in range(300)), changes
    machine = Machine(follows=False)
    assert machine.step(0.1, current_vel_mm_s=0.0, is_index_enabled=1)
    assert all(machine.step(0.1, current_vel_mm_s=30.0) for _ in range(2000))
    machine.step(0.1, current_vel_mm_s=0.0)  # a tap turns round
    assert all(machine.step(0.1, current_vel_mm_s=30.0) for _ in range(200))
    for _ in range(150):
        machine.step(0.1, current_vel_mm_s=0.0)  # it has ended
    assert not all(machine.step(0.1, current_vel_mm_s=30.0) for _ in range(50))


def test_a_ceiling_left_over_is_judged_in_mode_0():
    """E-stop has ended the feed, LinuxCNC still has the ceiling in the place of F."""
    machine = Machine(follows=False)
    assert not all(machine.step(F / CEILING, feed_mode=0) for _ in range(300))
    machine = Machine()
    assert all(machine.step(F / CEILING, feed_mode=0) for _ in range(300))


def test_told():
    """Somebody has read it from the status: at once, but only where it matters."""
    assert not Machine().step(1.0, is_adaptive_off=1)
    assert Machine().step(1.0, is_adaptive_off=1, programmed_vel_mm_s=0.0)
    assert Machine().step(1.0, is_adaptive_off=1, motion=1)


def test_hostile():
    """After any numbers: once nothing moves it lets go, and it sees the next ignored override as before."""
    odd = [math.nan, math.inf, -math.inf, -1.0, 0.0, 1e308, 5e-324, 10.0]
    random = np.random.default_rng(random_seed())
    watch = core.Watchdog()
    for _ in range(2000):
        for _ in range(10):
            core.follows_override(watch, core.WatchdogIn(2, 2, *(odd[random.integers(len(odd))] for _ in range(7))))
        assert core.follows_override(watch, core.WatchdogIn(feed_mode=2, motion=0))
        for follows in (True, False):
            machine = Machine(follows)
            machine.watch = watch
            assert all([machine.step(0.1) for _ in range(60)]) == follows
            assert core.follows_override(watch, core.WatchdogIn(feed_mode=2, motion=0))


class Soft(Machine):
    """The same with a planner that bounds the jerk, and told so or not."""

    def __init__(self, jerk, told=True, **how):
        super().__init__(**how)
        self.jerk, self.gain, self.told = jerk, 0.0, told

    def step(self, scale, **changes):
        goal = self.override * CEILING * (self.scale if self.follows else 1.0) * (not self.inhibit)
        wanted = math.copysign(min(math.sqrt(2 * self.jerk * abs(goal - self.velocity)), ACCEL), goal - self.velocity)
        self.gain += min(max(wanted - self.gain, -self.jerk * DT), self.jerk * DT)
        self.velocity = max(0.0, self.velocity + self.gain * DT)
        self.scale = scale
        values = core.WatchdogIn(
            feed_mode=2,
            motion=2,
            programmed_vel_mm_s=F,
            requested_vel_mm_s=CEILING,
            override_share=scale,
            current_vel_mm_s=self.velocity,
            acceleration_mm_s2=ACCEL,
            max_override_share=1.0,
            period_s=DT,
            max_jerk_mm_s3=self.jerk if self.told else 0.0,
        )
        return core.follows_override(self.watch, values)


def drops(machine):
    """Full speed, then braked to F: -> False as soon as that counts as an ignored override."""
    return all([machine.step(1.0) for _ in range(1500)] + [machine.step(0.1) for _ in range(1500)])


@pytest.mark.parametrize("jerk", [1000.0, 3000.0, 20000.0])
def test_braking_that_builds_up_is_no_ignored_override(jerk):
    assert drops(Soft(jerk))
    random, machine, scale = np.random.default_rng(random_seed()), Soft(jerk), 1.0
    for _ in range(20000):
        scale = random.random() if random.random() < 0.01 else scale
        assert machine.step(scale)


def test_the_check_sees_a_jerk_not_told():
    assert not drops(Soft(1000.0, told=False))


@pytest.mark.parametrize("jerk", [1000.0, 3000.0, 20000.0])
def test_an_ignored_override_is_seen_with_a_bounded_jerk(jerk):
    machine = Soft(jerk, follows=False)
    assert not all(machine.step(0.1) for _ in range(1500))


class Blends(Machine):
    """A planner that goes from segment to segment by parabolic blends (tp/tp.c, tpUpdateBlend): off the first at its
    own acceleration, onto the second at that one's, up to what the override allows there; current-vel is the sum of
    both."""

    def __init__(self, first=0.23, second=0.5, told=True, **how):
        super().__init__(**how)
        self.first, self.second, self.told = first * ACCEL, second * ACCEL, told
        self.rest = 0.0  # velocity on the segment that is left

    def blend(self):
        """The next segment begins; the first is the one the tool is on."""
        self.rest, self.velocity = self.velocity, 0.0

    def step(self, scale, **changes):
        goal = self.override * CEILING * (self.scale if self.follows else 1.0) * (not self.inhibit)
        accel = self.second if self.rest > 0.0 else self.first
        self.rest = max(0.0, self.rest - self.first * DT)
        self.velocity = min(max(goal, self.velocity - accel * DT), self.velocity + accel * DT)
        self.scale = scale
        told = (
            dict(blend_vel_mm_s=min(self.rest, self.velocity), braking_mm_s2=min(self.first, self.second))
            if self.told
            else {}
        )
        values = core.WatchdogIn(
            feed_mode=2,
            motion=2,
            programmed_vel_mm_s=F,
            requested_vel_mm_s=CEILING,
            override_share=scale,
            current_vel_mm_s=self.rest + self.velocity,
            acceleration_mm_s2=ACCEL,
            max_override_share=1.5,
            period_s=DT,
            **told,
        )
        return core.follows_override(self.watch, values)


def blended(machine, scale=0.6, periods=400):
    """At the override's velocity into a blend, and through it -> (never stopped, largest velocity)."""
    good = all([machine.step(scale) for _ in range(600)])
    machine.blend()
    fastest = 0.0
    for _ in range(periods):
        good = machine.step(scale) and good
        fastest = max(fastest, machine.rest + machine.velocity)
    return good, fastest


@pytest.mark.parametrize("override", [1.0, 1.5])
def test_a_parabolic_blend_is_no_ignored_override(override):
    """An arc of weak braking into a line: for 0.2 s the sum is up to 1.5 times what the override allows."""
    good, fastest = blended(Blends(override=override))
    assert good and fastest > 1.3 * override * 0.6 * CEILING


def test_the_check_sees_a_blend_not_told():
    assert not blended(Blends(override=1.5, told=False))[0]


def test_random_blends_and_overrides():
    """With the least braking of LinuxCNC's segments: 0.5 x 0.5 x (1 - what a bend in the path takes of it, 0.71 at
    most)."""
    random = np.random.default_rng(random_seed())
    machine, scale = Blends(override=1.5), 1.0
    for _ in range(20000):
        if random.random() < 0.01:
            scale = random.random()
        if random.random() < 0.005 and machine.rest == 0.0:
            machine.first, machine.second = random.uniform(0.073, 0.5, 2) * ACCEL
            machine.blend()
        assert machine.step(scale)


@pytest.mark.parametrize("periods", [0, 50, 200])
def test_an_ignored_override_is_seen_in_a_blend(periods):
    """Adaptive feed is switched off `periods` into a blend: seen before the segment that speeds up is faster than the
    rule says."""
    machine = Blends(override=1.0)
    assert blended(machine, 0.1, periods)[0]
    machine.follows = False
    for _ in range(300):
        if not machine.step(0.1):
            break
    assert machine.velocity <= 1.5 * F * 1.02 + 7 * ACCEL * DT
    assert not machine.step(0.1)


def test_a_blend_hides_half_of_the_velocity_at_most():
    """Whatever the pin says: twice what is explained is too fast."""
    for told in (math.nan, math.inf, -1.0, 1e308):
        machine = Machine(follows=False)
        assert not all(machine.step(0.1, blend_vel_mm_s=told, braking_mm_s2=told) for _ in range(300)), told
