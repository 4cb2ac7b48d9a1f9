# SPDX-License-Identifier: GPL-2.0-or-later
"""A slow, obvious stock model in numpy: the judge of the C core in the tests.

Who calls it: tests/core/, bench/bench_accuracy.py.  Nothing here calls the C core or repeats
its formulas:

1. A tool is a solid given by an inside-test: a union of cylinder, sphere, torus and cone.
   Its lower surface over a distance from the axis is found by halving that test in Z.
2. The stock is a cloud of vertical needles, one in every fine cell, at a random place in
   its cell (seeded), so that no edge can run along the grid and every share of a cell is
   counted without bias.
3. A move is a dense row of tool positions; at each, every needle under the tool is
   shortened to the tool's surface.
4. Load is the difference of two volumes over a short distance.

Error of a volume, one standard deviation: 0.41 h^2 depth sqrt(outline / h), for needles h
apart and an outline of the given length (each outline cell is hit or missed by chance);
`error_mm3` says it.  Lengths mm, angles degrees, volumes mm3.
"""

from __future__ import annotations

import math

import numpy as np

HALVINGS = 60  # of the inside-test in Z: exhausts a double
LEVEL_STEP = 0.002  # mm between positions of a sloping move: half of it is the error in Z
PROFILE_POINTS = 4001  # radii at which the lower surface is tabulated


def _cylinder(radius, bottom):
    return lambda r, z: (r <= radius) & (z >= bottom)


def _sphere(radius, centre_z):
    return lambda r, z: r**2 + (z - centre_z) ** 2 <= radius**2


def _torus(major, minor, centre_z):
    return lambda r, z: (r - major) ** 2 + (z - centre_z) ** 2 <= minor**2


def _cone(apex_z, half_angle, from_z, to_z):
    """Tip down; half_angle in rad between axis and side."""
    return lambda r, z: (z >= from_z) & (z <= to_z) & (r <= (z - apex_z) * math.tan(half_angle))


class ReferenceTool:
    """Solid of a mill: flat (no corner, no tip angle), ball (corner = radius), bull (corner),
    vee (tip angle), tapered ball (both)."""

    def __init__(self, diameter, corner=0.0, tip_angle=0.0):
        self.radius = radius = diameter / 2.0
        self.corner, self.tip_angle = corner, tip_angle
        if tip_angle:
            half = math.radians(tip_angle / 2.0)
            apex = corner - corner / math.sin(half)  # of the cone that touches the tip sphere
            touch = corner - corner * math.sin(half)  # height of the circle where it does
            top = apex + radius / math.tan(half)  # where the cone reaches the shank
            self._solids = [_sphere(corner, corner), _cone(apex, half, touch, top), _cylinder(radius, top)]
            self.top = top
        else:
            self._solids = [
                _cylinder(radius, corner),
                _cylinder(radius - corner, 0.0),
                _torus(radius - corner, corner, corner),
            ]
            self.top = corner
        r = radius * np.sin(np.linspace(0.0, math.pi / 2.0, PROFILE_POINTS))  # dense at the rim
        self._r, self._z = r, self.surface(r)

    def inside(self, r, z):
        """Whether points (r from the axis, z above the tip) lie in the tool."""
        met = np.zeros(np.broadcast(r, z).shape, bool)
        for solid in self._solids:
            met |= solid(r, z)
        return met

    def surface(self, r):
        """Lowest z inside the tool at r (n,), by halving the inside-test."""
        r = np.asarray(r, float)
        low = np.full(r.shape, -1e-9)
        high = np.full(r.shape, self.top + self.corner + 1.0)
        for _ in range(HALVINGS):
            mid = 0.5 * (low + high)
            met = self.inside(r, mid)
            high = np.where(met, mid, high)
            low = np.where(met, low, mid)
        return high

    def height(self, r):
        """The same from the table (n,); infinite beside the tool."""
        return np.where(r <= self.radius, np.interp(r, self._r, self._z), np.inf)


class ReferenceStock:
    """Needles over the box low..high, `spacing` mm apart."""

    def __init__(self, low, high, spacing=0.05, seed=1):
        self.low, self.high = np.array(low, float), np.array(high, float)
        size = self.high - self.low
        nx, ny = (max(1, math.ceil(size[i] / spacing - 1e-9)) for i in (0, 1))
        self.step = np.array([size[0] / nx, size[1] / ny])
        random = np.random.default_rng(seed)
        self.x = self.low[0] + (np.arange(nx)[None, :] + random.random((ny, nx))) * self.step[0]
        self.y = self.low[1] + (np.arange(ny)[:, None] + random.random((ny, nx))) * self.step[1]
        self.z = np.full((ny, nx), self.high[2])

    def volume(self):
        """Volume left, mm3."""
        return float((self.z - self.low[2]).sum() * self.step[0] * self.step[1])

    def removed(self):
        """Volume cut so far, mm3."""
        return float(np.prod(self.high - self.low)) - self.volume()

    def error_mm3(self, outline, depth):
        """One standard deviation of a volume whose outline is `outline` mm long, `depth` mm deep."""
        h = float(self.step.max())
        return 0.41 * h * h * depth * math.sqrt(outline / h)

    def touch(self, tool, tip):
        """Takes away what the tool covers at one position."""
        x, y, z = tip
        if z >= self.high[2]:
            return
        first = np.floor((np.array([x, y]) - tool.radius - self.low[:2]) / self.step).astype(int)
        last = np.ceil((np.array([x, y]) + tool.radius - self.low[:2]) / self.step).astype(int)
        first, last = np.maximum(first, 0), np.maximum(last, 0)
        window = np.s_[first[1] : last[1], first[0] : last[0]]
        if not self.z[window].size:
            return
        r = np.hypot(self.x[window] - x, self.y[window] - y)
        surface = np.maximum(z + tool.height(r), self.low[2])
        np.minimum(self.z[window], surface, out=self.z[window])

    def move(self, tool, start, end, step=None):
        """Cuts a straight move, positions `step` mm apart (default: the needles' distance) and
        at most LEVEL_STEP in Z; a plunge needs its two ends only."""
        start, end = np.array(start, float), np.array(end, float)
        step = step or float(self.step.max())
        across = math.hypot(*(end - start)[:2])
        count = max(1, math.ceil(across / step))
        if across > 0.0:
            count = max(count, math.ceil(abs(end[2] - start[2]) / LEVEL_STEP))
        for i in range(count + 1):
            self.touch(tool, start + (end - start) * (i / count))

    def path(self, tool, points, step=None):
        """Cuts a chain of straight moves through points (n, 3)."""
        for start, end in zip(points[:-1], points[1:]):
            self.move(tool, start, end, step)

    def section(self, tool, tip, direction, ahead=0.4, step=None):
        """dV/ds in mm2 at a tip that everything before has been cut up to: the volume the next
        `ahead` mm take, over their length [4].  Cuts them."""
        before = self.volume()
        tip, direction = np.array(tip, float), np.array(direction, float)
        self.move(tool, tip, tip + ahead * direction, step)
        return (before - self.volume()) / ahead
