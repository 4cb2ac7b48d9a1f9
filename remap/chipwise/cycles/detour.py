# SPDX-License-Identifier: GPL-2.0-or-later
"""A route for the tool over or round clamps, from one place to another.  Called by obstacles.py.  Pure; mm, work
coordinates.

Source: none.  At one height of the tip a clamp is a box or circle, larger by the widest part of the tool that is level
with it and by the clearance, and the higher the tip, the smaller it is.  So a place that is free stays free straight
up.  A route goes straight up, across at one height, and straight down: at the highest height there is one if there is
one at all, and the shortest of the heights at which a clamp ends is taken.  Across, the shortest route leads along
corners of the clamps; A* looks at these, and at an edge only when it is reached.
"""

import heapq
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from chipwise.clamps.distance import bodies
from chipwise.pattern.isometry import Isometry
from chipwise.stock.shape_comment import CYLINDER

MARGIN_MM = (
    0.02  # that corners of the route keep besides the clearance, and heights over a clamp: blends of BLEND_MM cut them
)
BLEND_MM = 0.01
SLACK_MM = 5e-7  # of the clearance
CORNER_SIDES = 4  # of the polygon for a quarter of a turn
EQUAL_MM = 1e-9


@dataclass(frozen=True)
class Level:
    """What is not free at one height of the tip.  grown: [(Clamp, mm by which it is larger)]."""

    grown: tuple

    def blocked(self, a, b):
        """(n,) bool: whether lines a to b, (n, 2), come into one."""
        found = np.zeros(len(a), bool)
        for clamp, by in self.grown:
            found |= _distance(clamp, a, b) < by - SLACK_MM
        return found

    def corners(self):
        """(k, 2) places round them."""
        found = [_outline(clamp, by + MARGIN_MM) for clamp, by in self.grown]
        return np.concatenate(found) if found else np.zeros((0, 2))


@dataclass(frozen=True)
class Detour:
    """clamps, clearance, tool: as in Obstacles; limits: fields of a Travel, None: not known."""

    clamps: tuple
    clearance: float
    tool: Any
    limits: Any = None

    def level(self, z):
        """The Level at a height of the tip."""
        grown = []
        for clamp in self.clamps:
            by = [
                min(self.clearance * (1 + b) + a + b * (clamp.top - z) for a, b in body.lines)
                for body in bodies(self.tool)
                if body.begins + z - clamp.top < self.clearance - SLACK_MM
            ]
            if by:
                grown.append((clamp, max(by)))
        return Level(tuple(grown))

    def is_free(self, place):
        """Whether the tool may be at a place (x, y, z)."""
        at = np.array([place[:2]], float)
        return not self.level(place[2]).blocked(at, at)[0]

    def route(self, start, end, base, along=None):
        """[(x, y, z)] of the shortest route from start to end, across at `base` or above, without start; None if
        there is none.  along: places (x, y) of a route across, between start and end, that is taken if it is free at
        any height."""
        across, best, length = np.array([start[:2], *(along or ()), end[:2]], float), None, math.inf
        heights = self._heights(base)
        for z in heights if along is not None else ():
            if not self.level(z).blocked(across[:-1], across[1:]).any():
                return _told(start, across, z, end)
        for z in heights:
            up = 2 * z - start[2] - end[2]
            if up + math.dist(across[0], across[-1]) >= length:
                break
            places = self._across(self.level(z), across[0], across[-1], z)
            total = math.inf if places is None else up + float(np.hypot(*np.diff(places, axis=0).T).sum())
            if total < length:
                best, length = _told(start, places, z, end), total
        return best

    def _heights(self, base):
        """Rising: the base, where a part of the tool is over a clamp, and the highest."""
        highest = self.limits["limits"][2][2] - self.limits["shift"][2] if self.limits else math.inf
        over = [
            clamp.top + self.clearance - body.begins + MARGIN_MM for clamp in self.clamps for body in bodies(self.tool)
        ]
        ends = [highest] if math.isfinite(highest) else []
        return [base, *sorted({z for z in over + ends if base < z <= highest})]

    def _across(self, level, first, last, z):
        """(k, 2) from first to last at a level; None if they are not connected."""
        if not level.blocked(first[None], last[None])[0]:
            return np.array([first, last])
        corners = level.corners()
        corners = corners[~level.blocked(corners, corners) & self._reached(corners, z)]
        return _shortest(np.concatenate(([first, last], corners)), level)

    def _reached(self, places, z):
        if not self.limits:
            return np.ones(len(places), bool)
        machine = Isometry(self.limits["matrix"], self.limits["shift"]).points(
            np.column_stack((places, np.full(len(places), z)))
        )
        low, high = (np.array([limit[side] for limit in self.limits["limits"]]) for side in (1, 2))
        return ((machine >= low) & (machine <= high))[:, :2].all(axis=1)


def _told(start, places, z, end):
    """[(x, y, z)] of a route across at z."""
    return [(*map(float, start[:2]), z), *((x, y, z) for x, y in places[1:].tolist()), tuple(map(float, end))]


def _shortest(nodes, level):
    """(k, 2) of the shortest route from nodes[0] to nodes[1] over some of the others; None if there is none."""
    ahead = np.hypot(*(nodes - nodes[1]).T)
    best, before = np.full(len(nodes), math.inf), np.full(len(nodes), -1)
    best[0], done, heap = 0.0, np.zeros(len(nodes), bool), [(float(ahead[0]), 0)]
    while heap:
        k = heapq.heappop(heap)[1]
        if done[k]:
            continue
        done[k] = True
        if k == 1:
            route = [1]
            while route[-1]:
                route.append(int(before[route[-1]]))
            return nodes[route[::-1]]
        far = best[k] + np.hypot(*(nodes - nodes[k]).T)
        others = np.flatnonzero(~done & (far < best - EQUAL_MM))
        others = others[~level.blocked(np.broadcast_to(nodes[k], (len(others), 2)), nodes[others])]
        best[others], before[others] = far[others], k
        for other in others.tolist():
            heapq.heappush(heap, (float(far[other] + ahead[other]), other))
    return None


def _turned(clamp, places):
    """Places (n, 2) from the middle of a clamp, along its sides."""
    c, s = math.cos(math.radians(clamp.turn)), math.sin(math.radians(clamp.turn))
    x, y = places[:, 0] - clamp.middle[0], places[:, 1] - clamp.middle[1]
    return np.column_stack((x * c + y * s, y * c - x * s))


def _halves(clamp):
    return 0.0 if clamp.shape == CYLINDER else (clamp.high[0] - clamp.low[0]) / 2, 0.0 if clamp.shape == CYLINDER else (
        clamp.high[1] - clamp.low[1]
    ) / 2


def _outline(clamp, by):
    """Corners of a polygon round a clamp that is larger by so much; each side of it touches that."""
    half, radius = _halves(clamp), by + (clamp.reach if clamp.shape == CYLINDER else 0.0)
    angles = (np.arange(4 * CORNER_SIDES) + 0.5) * math.pi / 2 / CORNER_SIDES
    x, y = np.cos(angles), np.sin(angles)
    far = radius / math.cos(math.pi / 4 / CORNER_SIDES)
    x, y = np.sign(x) * half[0] + far * x, np.sign(y) * half[1] + far * y
    c, s = math.cos(math.radians(clamp.turn)), math.sin(math.radians(clamp.turn))
    return np.column_stack((clamp.middle[0] + x * c - y * s, clamp.middle[1] + x * s + y * c))


def _distance(clamp, a, b):
    """(n,) mm of lines a to b, (n, 2), from a clamp seen from above; 0 or less if they meet it."""
    a, b = _turned(clamp, a), _turned(clamp, b)
    half = np.array(_halves(clamp))
    found = np.minimum(*(np.hypot(*np.maximum(np.abs(p) - half, 0.0).T) for p in (a, b)))
    step = b - a
    square = np.maximum((step**2).sum(axis=1), 1e-300)
    for corner in np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * half:
        share = np.clip(((corner - a) * step).sum(axis=1) / square, 0.0, 1.0)
        found = np.minimum(found, np.hypot(*(a + share[:, None] * step - corner).T))
    with np.errstate(divide="ignore", invalid="ignore"):
        sides = np.stack([(-half - a) / step, (half - a) / step])  # where the line crosses the sides
    still = step == 0.0
    inside = np.abs(a) <= half
    enter = np.where(still, np.where(inside, -np.inf, np.inf), sides.min(axis=0)).max(axis=1)
    leave = np.where(still, np.where(inside, np.inf, -np.inf), sides.max(axis=0)).min(axis=1)
    found[(enter <= leave) & (enter <= 1.0) & (leave >= 0.0)] = 0.0
    return found - (clamp.reach if clamp.shape == CYLINDER else 0.0)
