# SPDX-License-Identifier: GPL-2.0-or-later
"""Sums of graphs and tool parts against their definition, sampled: walls, gaps, slivers, arcs on both sides."""

import math
import random

import numpy as np
import pytest

from chipwise.turning import profile_function
from chipwise.turning import reach
from support.random_cases import random_count, random_seed, write_replay

STEP = 0.002


def random_graph(rng):
    """Pieces from the left: lines and arcs from 0.0001 to 3 mm wide, with walls and gaps."""
    z, x, pieces = 0.0, rng.uniform(2, 10), []
    for _ in range(rng.randint(1, 25)):
        width, kind = rng.choice((0.01, 0.1, 1.0, 3.0)) * rng.random() + 1e-4, rng.random()
        z += rng.random() if kind < 0.15 else 0.0
        x = rng.uniform(2, 10) if kind < 0.4 else x
        to = x if kind < 0.2 else max(x + rng.uniform(-1, 1), 1.0)
        arc = _arc(rng, z, x, width, to) if rng.random() < 0.35 else None
        pieces.append(arc or profile_function.segment(z, x, z + width, to))
        z, x = z + width, to
    return pieces


def _arc(rng, z, x, width, to):
    chord = math.hypot(width, to - x)
    r = chord * rng.uniform(0.51, 3.0)
    h = math.sqrt(r * r - chord * chord / 4) * rng.choice((-1, 1))
    c = z + width / 2 - h * (to - x) / chord, (x + to) / 2 + h * width / chord
    above, below = x - c[1], to - c[1]
    return profile_function.Piece(z, z + width, *c, 0.0, r, 1 if above > 0 else -1) if above * below > 1e-3 else None


def samples(f):
    """(n, 2) points of a graph, ends of pieces included, about STEP apart."""
    found = []
    for p in f:
        if p.r:
            a, b = (math.atan2(profile_function.value(p, z) - p.xr, z - p.zr) for z in (p.z0, p.z1))
            turns = np.linspace(a, b, max(int(abs(b - a) * p.r / STEP), 1) + 1)
            found.append(np.column_stack((p.zr + p.r * np.cos(turns), p.xr + p.r * np.sin(turns))))
        else:
            ends = np.array([(z, profile_function.value(p, z)) for z in (p.z0, p.z1)])
            found.append(ends[0] + np.linspace(0, 1, int(math.dist(*ends) / STEP) + 2)[:, None] * (ends[1] - ends[0]))
    return np.concatenate(found)


def highest(f, z):
    return max((profile_function.value(p, z) for p in f if p.z0 <= z <= p.z1), default=-math.inf)


@pytest.mark.parametrize("k", range(random_count(30)))
def test_disc_and_window_are_maxima(k):
    seed = random_seed() * 100_003 + k
    rng = random.Random(seed)
    f = random_graph(rng)
    r, u0 = rng.choice((0.05, 0.4, 2.0)), rng.uniform(-3, 1)
    u1 = u0 + rng.uniform(0.01, 10)
    replay = write_replay(
        f"turning_graph_{seed}", {"seed": seed, "graph": [list(p) for p in f], "r": r, "window": [u0, u1]}
    )
    points, disc, window = samples(f), reach.disc(f, r), reach.window(f, u0, u1)
    for _ in range(150):
        z = rng.uniform(f[0].z0 - u1, f[-1].z1 - u0)
        within = np.abs(points[:, 0] - z) < r
        sampled = (
            (points[within, 1] + np.sqrt(r * r - (points[within, 0] - z) ** 2)).max() if within.any() else -math.inf
        )
        assert highest(disc, z) >= sampled - 1e-7, f"seed {seed}, {replay}: disc {r} at {z}"
        inside = (points[:, 0] >= z + u0) & (points[:, 0] <= z + u1)
        low = points[inside, 1].max() if inside.any() else -math.inf
        assert highest(window, z) >= low - 1e-7, f"seed {seed}, {replay}: window at {z}"
        assert highest(window, z) <= _most(points, z + u0 - STEP, z + u1 + STEP) + STEP, (
            f"seed {seed}, {replay}: window at {z}"
        )
    for (
        p
    ) in disc:  # every place of the result is one at which the disc touches the region, and none at which it is farther
        z = 0.5 * (p.z0 + p.z1)
        gap = np.hypot(points[:, 0] - z, points[:, 1] - profile_function.value(p, z)).min()
        assert r - 1e-7 <= gap <= r + 1e-3, f"seed {seed}, {replay}: disc {r} at {z}"
    replay.unlink()


def _most(points, z0, z1):
    inside = (points[:, 0] >= z0) & (points[:, 0] <= z1)
    return points[inside, 1].max() if inside.any() else -math.inf


def test_the_samples_see_a_wrong_sum():
    f = [profile_function.segment(0.0, 1.0, 2.0, 2.0), profile_function.segment(2.0, 2.0, 4.0, 1.0)]
    points = samples(f)
    peak = highest(reach.disc(f, 0.5), 2.0)
    gaps = [np.hypot(points[:, 0] - 2.0, points[:, 1] - peak - more).min() for more in (-0.002, 0.0, 0.002)]
    assert gaps[0] < 0.5 - 1e-7 and 0.5 - 1e-7 <= gaps[1] <= 0.5 + 1e-3 < gaps[2]
