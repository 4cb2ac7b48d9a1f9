# SPDX-License-Identifier: GPL-2.0-or-later
"""geometry/pocket/shortest.py against lengths that are lowered until none can be (Bellman, Ford)."""

import math
import random

import numpy as np
import pytest

from chipwise.geometry.pocket.shortest import over_raster, shortest
from support.random_cases import random_count, random_seed

NEIGHBOURS = tuple((i, j, math.hypot(i, j)) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j)


def lengths(lines, nodes, first):
    """Length from the first node to each, along lines (a, b, length) to and fro."""
    far = dict.fromkeys(range(nodes), math.inf) | {first: 0.0}
    for _ in range(nodes):
        for a, b, length in lines:
            far[a], far[b] = min(far[a], far[b] + length), min(far[b], far[a] + length)
    return far


@pytest.mark.parametrize("case", range(random_count(20)))
def test_over_a_graph(case):
    rng = random.Random(f"{random_seed()} {case}")
    nodes = rng.randint(2, 25)
    lines = [(rng.randrange(nodes), rng.randrange(nodes), rng.uniform(0.0, 9.0)) for _ in range(rng.randint(0, 50))]
    joints = {}
    for k, (a, b, length) in enumerate(lines):
        joints.setdefault(a, []).append((length, b, (k, a, b)))
        joints.setdefault(b, []).append((length, a, (k, b, a)))
    far = lengths(lines, nodes, 0)
    for last in range(nodes):
        found = shortest(0, last, lambda at: joints.get(at, ()), lambda _at: 0.0)
        assert (found is None) == math.isinf(far[last]), (random_seed(), case, last)
        if found:
            at, pieces = found
            assert at[0] == 0 and at[-1] == last and [piece[1:] for piece in pieces] == list(zip(at, at[1:]))
            assert sum(lines[piece[0]][2] for piece in pieces) == pytest.approx(far[last], abs=1e-9)


@pytest.mark.parametrize("case", range(random_count(20)))
def test_over_a_raster(case):
    rng = np.random.default_rng([random_seed(), case])
    free = rng.random((rng.integers(2, 9), rng.integers(2, 9))) > rng.uniform(0.1, 0.6)
    free[0, 0] = free[-1, -1] = True
    columns, rows = free.shape
    lines = [
        (i * rows + j, (i + di) * rows + j + dj, size)
        for i, j in np.argwhere(free).tolist()
        for di, dj, size in NEIGHBOURS
        if 0 <= i + di < columns and 0 <= j + dj < rows and free[i + di, j + dj]
    ]
    far = lengths(lines, free.size, 0)[free.size - 1]
    route = over_raster(free, (0, 0), (columns - 1, rows - 1), NEIGHBOURS)
    assert (route is None) == math.isinf(far), (random_seed(), case)
    if route:
        assert route[0] == (0, 0) and route[-1] == (columns - 1, rows - 1) and all(free[at] for at in route)
        assert sum(math.dist(a, b) for a, b in zip(route, route[1:])) == pytest.approx(far, abs=1e-9)
