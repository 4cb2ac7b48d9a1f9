# SPDX-License-Identifier: GPL-2.0-or-later
"""A clamp: a box, turned about Z, or a cylinder along Z.  Machine coordinates, mm, degrees.  Called by comment.py, distance.py and check/clamps.py."""

import math
from dataclasses import dataclass

import numpy as np

from chipwise.shape_comment import CYLINDER


@dataclass(frozen=True)
class Clamp:
    """low, high (3,): corners; of a cylinder those of the box around it.  turn: of a box about its middle.  name: for the operator."""

    shape: int
    turn: float
    low: tuple
    high: tuple
    name: str

    @property
    def top(self):
        return self.high[2]

    @property
    def bottom(self):
        return self.low[2]

    @property
    def middle(self):
        return (self.low[0] + self.high[0]) / 2, (self.low[1] + self.high[1]) / 2

    @property
    def reach(self):
        """mm from the middle to its farthest point, seen from above."""
        wide, deep = self.high[0] - self.low[0], self.high[1] - self.low[1]
        return wide / 2 if self.shape == CYLINDER else math.hypot(wide, deep) / 2

    def across(self, x, y):
        """Distances (mm) of places x, y (arrays) from it, seen from above; negative inside, where it is that of a line of its outline.  A convex
        function of the place."""
        x, y = x - self.middle[0], y - self.middle[1]
        if self.shape == CYLINDER:
            return np.hypot(x, y) - self.reach
        if self.turn:
            c, s = math.cos(math.radians(self.turn)), math.sin(math.radians(self.turn))
            x, y = x * c + y * s, y * c - x * s
        dx, dy = np.abs(x) - (self.high[0] - self.low[0]) / 2, np.abs(y) - (self.high[1] - self.low[1]) / 2
        return np.hypot(np.maximum(dx, 0.0), np.maximum(dy, 0.0)) + np.minimum(np.maximum(dx, dy), 0.0)
