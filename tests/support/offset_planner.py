# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC's external offset of three axes as its manual describes it, to judge components/core/axis_offset.c against.

Written from the description (External Axis Offsets; a planner that limits velocity and acceleration and ends without
overshoot), apart from the core.  tests/machine/test_tracer_run.py has the real one.
"""

import math

import numpy as np

PERIOD_S = 0.001


class Planner:
    """A machine that is on and homed; one step() a servo period.  mm."""

    def __init__(self, acceleration, velocity, count):
        self.acceleration, self.most, self.count = np.array(acceleration, float), np.array(velocity, float), count
        self.offset, self.velocity, self.request = np.zeros(3), np.zeros(3), np.zeros(3)
        self.counts = np.zeros(3, int)
        self.is_on = self.is_homed = True
        self.limit = np.array([np.inf] * 3)

    def switch(self, is_on):
        """Off: the place is kept; on: the offset counts as 0."""
        if is_on and not self.is_on:
            self.offset[:] = self.velocity[:] = self.request[:] = 0.0
        self.is_on = is_on

    def wanted(self, axis):
        """The velocity from which it still ends at the request."""
        distance, gain = self.request[axis] - self.offset[axis], self.acceleration[axis] * PERIOD_S
        if abs(distance) <= self.acceleration[axis] * PERIOD_S**2 * 1e-3:
            return 0.0
        return math.copysign(
            min(math.sqrt(2 * self.acceleration[axis] * abs(distance) + gain**2) - gain, self.most[axis]), distance
        )

    def step(self, counts):
        """Moves, then takes the counts of the period before."""
        if self.is_on:
            for axis in range(3):
                change = self.acceleration[axis] * PERIOD_S
                self.velocity[axis] += min(max(self.wanted(axis) - self.velocity[axis], -change), change)
                self.offset[axis] += self.velocity[axis] * PERIOD_S
                if self.offset[axis] > self.limit[axis]:
                    self.offset[axis], self.velocity[axis] = self.limit[axis], 0.0
            if self.is_homed:
                self.request += (np.array(counts) - self.counts) * self.count
        self.counts = np.array(counts)
