# SPDX-License-Identifier: GPL-2.0-or-later
"""A clamp: a box, turned about Z, or a cylinder along Z.  Machine coordinates, mm, degrees.  Called by set_ups.py,
setup/job.py and check/clamps.py."""

import math
from dataclasses import dataclass, replace

import numpy as np

from chipwise.stock.shape_comment import CYLINDER

SAME = 1e-6  # mm, degrees


@dataclass(frozen=True)
class Clamp:
    """low, high (3,): corners; of a cylinder those of the box around it.  turn: of a box about its middle.  name: for
    the operator."""

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

    def seen_from(self, origin, turn):
        """The Clamp in coordinates whose origin (3,) and turn about Z (degrees) are those in the coordinates of this
        one."""
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        x, y = self.middle[0] - origin[0], self.middle[1] - origin[1]
        x, y = x * c + y * s, y * c - x * s
        half = (self.high[0] - self.low[0]) / 2, (self.high[1] - self.low[1]) / 2
        return replace(
            self,
            turn=self.turn - turn,
            low=(x - half[0], y - half[1], self.low[2] - origin[2]),
            high=(x + half[0], y + half[1], self.high[2] - origin[2]),
        )

    @classmethod
    def of_row(cls, row):
        """From a row, perhaps as JSON gave it."""
        shape, turn, low, high, name = row
        return cls(shape, turn, tuple(low), tuple(high), name)

    @property
    def row(self):
        """Its fields, for JSON."""
        return [self.shape, self.turn, self.low, self.high, self.name]

    @classmethod
    def seen_from_above(cls, row, name):
        """From a row of stock/clamp_table.py, which has no lower end."""
        shape, turn, (x, y), (half_x, half_y), top = row
        return cls(shape, turn, (x - half_x, y - half_y, top), (x + half_x, y + half_y, top), name)

    def is_where(self, other):
        """Whether it is as large as another one, at the same place; but for the lower end."""
        return (
            self.shape == other.shape
            and math.isclose(self.turn, other.turn, abs_tol=SAME)
            and all(
                math.isclose(a, b, abs_tol=SAME)
                for one, two in ((self.low[:2], other.low[:2]), (self.high, other.high))
                for a, b in zip(one, two)
            )
        )

    def on_machine(self, frame):
        """The Clamp in machine coordinates, of one in work coordinates; frame: program/records.py."""
        place = frame.to_machine([(a + b) / 2 for a, b in zip(self.low, self.high)])
        half = [(b - a) / 2 for a, b in zip(self.low, self.high)]
        return replace(
            self,
            turn=self.turn + math.degrees(frame.turn),
            low=tuple(float(p - h) for p, h in zip(place, half)),
            high=tuple(float(p + h) for p, h in zip(place, half)),
        )

    def across(self, x, y):
        """Distances (mm) of places x, y (arrays) from it, seen from above; negative inside, where it is that of a line
        of its outline.  A convex function of the place."""
        x, y = x - self.middle[0], y - self.middle[1]
        if self.shape == CYLINDER:
            return np.hypot(x, y) - self.reach
        if self.turn:
            c, s = math.cos(math.radians(self.turn)), math.sin(math.radians(self.turn))
            x, y = x * c + y * s, y * c - x * s
        dx, dy = np.abs(x) - (self.high[0] - self.low[0]) / 2, np.abs(y) - (self.high[1] - self.low[1]) / 2
        return np.hypot(np.maximum(dx, 0.0), np.maximum(dy, 0.0)) + np.minimum(np.maximum(dx, dy), 0.0)
