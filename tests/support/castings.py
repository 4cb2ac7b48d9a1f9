# SPDX-License-Identifier: GPL-2.0-or-later
"""Random castings whose surface is known, touched on a grid by a probe with an error."""

import math

import numpy as np

from chipwise.blank import heights as blank

CELL = 1.0
MOST_ABOVE = 0.03  # of the volume
CASES = 200


class Casting:
    """A casting of random waves, humps, hollows and tilt, touched on a grid by a probe with an error."""

    def __init__(self, seed, spacing=None):
        rng = np.random.default_rng(seed)
        self.wide, self.deep = rng.uniform(60.0, 160.0, 2)
        self.base, self.tilt, self.error = (
            rng.uniform(25.0, 60.0),
            rng.uniform(-0.02, 0.02, 2),
            rng.uniform(0.005, 0.05),
        )
        self.waves = [
            (rng.uniform(0.1, 1.0), rng.uniform(40.0, 160.0), *rng.uniform(0.0, 2 * math.pi, 2))
            for _ in range(rng.integers(2, 6))
        ]
        self.humps = [
            (rng.uniform(-1.5, 2.0), rng.uniform(0.0, self.wide), rng.uniform(0.0, self.deep), rng.uniform(12.0, 30.0))
            for _ in range(rng.integers(0, 5))
        ]
        found = rng.uniform(4.0, 8.0)
        spacing = spacing or found
        x, y = np.meshgrid(
            np.linspace(0, self.wide, int(self.wide / spacing) + 1),
            np.linspace(0, self.deep, int(self.deep / spacing) + 1),
        )
        turn = rng.permutation(x.size)
        self.points = np.column_stack(
            (x.ravel(), y.ravel(), (self.z(x, y) + rng.uniform(-self.error, self.error, x.shape)).ravel())
        )[turn]
        px, py = np.meshgrid(np.arange(CELL / 2, self.wide, CELL), np.arange(CELL / 2, self.deep, CELL))
        self.places = np.column_stack((px.ravel(), py.ravel()))
        self.high = float(self.z(x, y).max()) + 3.0

    def z(self, x, y):
        """Of the truth."""
        z = self.base + self.tilt[0] * x + self.tilt[1] * y
        for height, length, turn, phase in self.waves:
            z = z + height * np.sin(2 * math.pi / length * (x * math.cos(turn) + y * math.sin(turn)) + phase)
        for height, cx, cy, size in self.humps:
            z = z + height * np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / (2 * size**2))
        return z

    def highest(self):
        """Of the truth in each cell: at five by five places."""
        steps = np.linspace(-0.5, 0.5, 5) * CELL
        x, y = self.places.T
        return np.max(
            [self.z(np.clip(x + a, 0, self.wide), np.clip(y + b, 0, self.deep)) for a in steps for b in steps], axis=0
        )

    def found(self):
        return blank.heights(self.points, self.places, 0.0, self.high, self.error, CELL)

    def volume(self):
        """Of the truth, mm3: some four by four places a square millimetre."""
        x, y = np.meshgrid(
            (np.arange(int(self.wide * 4)) + 0.5) * self.wide / int(self.wide * 4),
            (np.arange(int(self.deep * 4)) + 0.5) * self.deep / int(self.deep * 4),
        )
        return float(self.z(x, y).mean()) * self.wide * self.deep
