# SPDX-License-Identifier: GPL-2.0-or-later
"""Random stations and the points that make them.  Used by tests/stations/test_frame.py and bench/bench_pattern.py."""

import math
import random

import numpy as np

from chipwise.errors import CycleError
from chipwise.stations.frame import frame_of


def rotation(r):
    """A random rotation by quaternions, uniform in space."""
    q = np.array([r.gauss(0, 1) for _ in range(4)])
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def local_points(r, more):
    """Points of a station in its own coordinates, up to 300 mm apart."""
    angle = math.radians(r.uniform(8, 172))
    side = r.uniform(20, 300)
    found = {1: (0, 0, 0), 2: (r.uniform(20, 300), 0, 0), 3: (side * math.cos(angle), side * math.sin(angle), 0)}
    return found | {4 + k: (r.uniform(-300, 300), r.uniform(-300, 300), 0) for k in range(more)}


def case(seed):
    """(matrix, origin, local points, points of the machine)."""
    r = random.Random(f"station {seed}")
    matrix, origin = rotation(r), np.array([r.uniform(-900, 900) for _ in range(3)])
    local = local_points(r, r.choice((0, 0, 1, 4)))
    return matrix, origin, local, {number: tuple(matrix @ np.array(p, float) + origin) for number, p in local.items()}


def off(found, matrix, origin, place):
    return float(np.linalg.norm(np.array(found.matrix) @ place + found.origin - matrix @ place - origin))


def shares_of_bound(seed, noise, tries=30):
    """How far three places, up to 300 mm away along each axis, are off when every point is off by `noise` (mm) in a
    direction of its own, over the bound that is predicted: a list."""
    matrix, origin, _local, points = case(seed)
    r, shares = random.Random(f"noise {seed}"), []
    places = [np.array([r.uniform(-300, 300) for _ in range(3)]) for _ in range(3)]
    bounds = [frame_of(points).predicted_error(place, noise) for place in places]
    for _ in range(tries):
        moved = {}
        for number, point in points.items():
            direction = np.array([r.gauss(0, 1) for _ in range(3)])
            moved[number] = tuple(np.array(point) + noise * direction / np.linalg.norm(direction))
        try:
            found = frame_of(moved)
        except CycleError:
            continue  # the points are near a limit
        shares += [off(found, matrix, origin, place) / bound for place, bound in zip(places, bounds)]
    return shares
