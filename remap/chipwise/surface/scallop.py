# SPDX-License-Identifier: GPL-2.0-or-later
"""Parallel tracks at the distances that a scallop height allows.

Called by cycles/surface.py.  All lengths mm.
Source: the scallop of a ball on a plane is R - sqrt(R^2 - (w / 2)^2), w the distance of the cuts along the surface
(textbooks on sculptured surface machining); here the same for any profile g of tool.h and any slope.

    1. Between two tracks d apart, at one station, the tips are T0 and T1, and the tip of a cut in the middle would be
       at Tm: all three are lowest tips of the model, so its curvature and what the tool cannot reach are in them.
    2. Along the track the tip moves on a slope a.  Beside the track, at u, it leaves S(u) = min over s of a s +
       g(sqrt(s^2 + u^2)) above it.
    3. What the cut in the middle would still take away is the scallop: the largest min(T0 + S(p), T1 + S(p - d)) - Tm -
       S(p - d/2), where both are equal or where the reach of one of them ends; times the cosine of the surface's slope
       it is a height along the normal.
    4. Stations steeper than STEEPEST do not count: beside a wall there is no step-over that leaves no scallop.
"""

import math

import numpy as np

from chipwise.surface import raster

STEEPEST = 0.1  # cosine of the slope: 84 degrees
SAFE = 0.95  # of the scallop: between two stations it may be larger
PATH_SHARE = 0.25  # of the scallop, at most, for the tolerance of the path
LEAST_STEP = 0.01  # of the tool's diameter
TRIES = 12
# Cells from the top of a ridge to a needle of the map: the largest of 20,000 places of a line in 180 directions (the
# median is 0.10).  Smaller: links may touch ridges as thin as that.  Larger: links above steep tools are higher than
# they need be.
NEEDLE_CELLS = 0.54
STATIONS = 1500
_SLOPES, _ANGLES, _ALONG, _HALVINGS = np.linspace(0.0, 10.0, 101), 257, 129, 30


class Profile:
    """S(u) of a tool on a slope [2].  shape: check.sweep.Shape"""

    def __init__(self, shape):
        self.radius = shape.diameter / 2
        u = self.radius * np.sin(np.linspace(0.0, np.pi / 2, _ANGLES))
        self._table = np.empty((len(_SLOPES), _ANGLES))
        for k, reach in enumerate(np.sqrt(np.maximum(self.radius**2 - u**2, 0.0))):
            s = reach * np.sin(np.linspace(-np.pi / 2, 0.0, _ALONG))
            self._table[:, k] = (_SLOPES[:, None] * s + _height(shape, np.minimum(np.hypot(s, u[k]), self.radius))).min(
                axis=1
            )

    def left(self, u, slope):
        """S (n,) at u (n,) on slopes (n,); u within the radius."""
        across = np.arcsin(np.clip(np.abs(u) / self.radius, 0.0, 1.0)) * ((_ANGLES - 1) / (np.pi / 2))
        along = np.clip(np.abs(slope), 0.0, _SLOPES[-1]) / _SLOPES[1]
        i, j = np.minimum(along.astype(int), len(_SLOPES) - 2), np.minimum(across.astype(int), _ANGLES - 2)
        v, w = along - i, across - j
        t = self._table
        return (1 - v) * ((1 - w) * t[i, j] + w * t[i, j + 1]) + v * ((1 - w) * t[i + 1, j] + w * t[i + 1, j + 1])


def _height(shape, r):
    """The profile g(r) of tool.h."""
    corner, radius = min(shape.corner_radius, shape.diameter / 2), shape.diameter / 2
    if shape.tip_angle:
        half = math.radians(shape.tip_angle) / 2
        touch = corner * math.cos(half)
        arc = corner - np.sqrt(np.maximum(corner**2 - np.minimum(r, touch) ** 2, 0.0))
        return arc + np.maximum(r - touch, 0.0) / math.tan(half)
    return corner - np.sqrt(np.maximum(corner**2 - np.maximum(r - (radius - corner), 0.0) ** 2, 0.0))


def unseen(shape, step, cell):
    """How much (mm) the ridge between two cuts `step` apart may be above the map of such cells."""
    half = min(step, shape.diameter) / 2
    top, seen = _height(shape, np.array([half, max(0.0, half - NEEDLE_CELLS * cell)]))
    return float(top - seen)


def between(profile, first, middle, last, apart, spacing):
    """The largest scallop (mm along the normal) between two tracks `apart` mm [3]; first, middle, last (n,): tips at
    stations `spacing` mm apart along them."""
    radius, d = profile.radius, apart
    slope = np.gradient(middle, spacing) if len(middle) > 1 else np.zeros(1)
    cosine = 1.0 / np.sqrt(1.0 + slope**2 + ((last - first) / d) ** 2)
    low, high = np.full(len(first), d - radius), np.full(len(first), radius)
    for _ in range(_HALVINGS):
        p = (low + high) / 2
        above = first + profile.left(p, slope) > last + profile.left(p - d, slope)
        low, high = np.where(above, low, p), np.where(above, p, high)
    p = (low + high) / 2

    def cut_at(p, left):
        return left - middle - profile.left(p - d / 2, slope)

    found = cut_at(p, np.minimum(first + profile.left(p, slope), last + profile.left(p - d, slope)))
    for p, tip, off in (
        (np.full(len(first), radius), last, d),
        (np.full(len(first), d - radius), first, 0.0),
    ):  # where one reaches no further
        found = np.maximum(found, cut_at(p, tip + profile.left(p - off, slope)))
    found = np.where(cosine < STEEPEST, 0.0, np.maximum(found, 0.0) * cosine)
    return float(found.max(initial=0.0))


class Stations:
    """Tips of a tool at stations along tracks over the rectangle low .. high, that go in a direction (degrees)."""

    def __init__(self, probe, shape, low, high, degrees):
        self.probe, self.profile, self.least = probe, Profile(shape), LEAST_STEP * shape.diameter
        self.low, self.high = np.asarray(low[:2]), np.asarray(high[:2])
        self.width = raster.width_of(low, high, degrees)
        self.side = np.array([-1.0, 1.0]) * raster.direction_of(degrees)[::-1]
        along = np.array(raster.direction_of(degrees))
        half = (np.abs(along) * (self.high - self.low)).sum() / 2
        count = max(3, min(STATIONS, math.ceil(2 * half / max(shape.diameter / 12, 1e-3))))
        places = np.linspace(-half, half, count)
        self.spacing = places[1] - places[0]
        self.middle = (np.asarray(low[:2], float) + np.asarray(high[:2], float)) / 2
        self.along = places[:, None] * along

    def tips(self, offset):
        """(heights (n,), which are on the rectangle (n,)) of the track at an offset (mm) from the middle."""
        points = self.middle + offset * self.side + self.along
        inside = ((points >= self.low - 1e-9) & (points <= self.high + 1e-9)).all(axis=1)
        return self.probe.heights(points), inside

    def across(self, step, scallop, most):
        """Where the tracks are, mm from the middle, rising: neither more than `step` nor more than a scallop apart ->
        (n,), or None if they are more than `most`."""
        width, target = self.width, SAFE * scallop
        found, d = [-width / 2], min(step, width)
        here = self.tips(found[0])
        while found[-1] < width / 2 - 1e-9:
            if len(found) >= most:
                return None
            room = width / 2 - found[-1]
            d, here = self._next(found[-1], here, min(d, room), min(step, room), target)
            found.append(found[-1] + d if d < room else width / 2)
        return np.array(found)

    def _next(self, at, here, d, most, target):
        """(the distance of the next track, its tips()): the largest of a few tries whose scallop is small enough, or
        the least.  at, here: place and tips() of the one before; d: the first try."""
        good, low, high, (first, inside) = None, 0.0, most, here
        for _ in range(TRIES):
            there, also = self.tips(at + d)
            half, _inside = self.tips(at + d / 2)
            use = inside | also
            found = between(self.profile, first[use], half[use], there[use], d, self.spacing) if use.any() else 0.0
            if found <= target:
                good, low = (d, (there, also)), d
            else:
                high = d
            wish = d * min(1.5, max(0.5, 0.98 * math.sqrt(target / found))) if found > 0.0 else high
            wish = min(max(wish, self.least), high)
            if good and (wish <= 1.05 * low or high <= 1.05 * low):
                return good
            if not good and d <= self.least:
                return d, (there, also)
            d = wish if low < wish < high or wish == high == most else (low + high) / 2
        return good or (self.least, self.tips(at + self.least))
