# SPDX-License-Identifier: GPL-2.0-or-later
"""The rapids of G24 keep the clearance from stock at their side: the rule of bin/chipwise check on plans of random
surfaces, in levels and after another tool.

CHIPWISE_RANDOM_COUNT=20 CHIPWISE_SEED=7 tools/test tests/cycles/test_surface_traverses.py
"""

import dataclasses

import numpy as np

from chipwise.check import rules
from chipwise.program import records
from chipwise.clib.height_map import HeightMap, Shape
from chipwise.cycles.surface import surface_plan
from support import surface_cases, surface_judge
from support.random_cases import random_count, random_seed

START, CLEARANCE, CELL = (-10.0, -10.0, 30.0), 0.2, 0.1  # mm


def model(rng):
    """Triangles of waves, or of blocks with walls on a plate, 20 to 30 mm wide."""
    size = rng.uniform(20, 30, 2)
    if rng.random() < 0.5:
        x, y = (np.linspace(0, s, 30) for s in size)
        return surface_cases.terrain(
            x,
            y,
            rng.uniform(1, 3)
            * np.sin(rng.uniform(0.2, 0.6) * x + rng.uniform(0, 6))[None, :]
            * np.cos(rng.uniform(0.2, 0.6) * y)[:, None],
        )
    blocks = [(low, low + rng.uniform(4, 9, 2)) for low in rng.uniform(1, 11, (rng.integers(1, 4), 2))]
    return np.concatenate(
        [
            surface_cases.box((0, 0, -5), (*size, 0)),
            *(surface_cases.box((*a, 0), (*b, rng.uniform(1, 4))) for a, b in blocks),
        ]
    )


def random_request(rng, file, number):
    d = float(rng.uniform(3, 6))
    tool = [Shape(d), Shape(d, d / 2), Shape(d, d / 6), Shape(d, d / 6, 20)][rng.integers(0, 4)]
    made = surface_cases.request(
        file,
        stamp=(number,),
        tool=tool,
        step=float(rng.uniform(0.2, 0.5)) * d,
        start=START,
        direction=float(rng.integers(0, 360)),
        relief=float(rng.choice([0.1, 0.3, 1.0])),
        link=int(rng.integers(0, 3)),
        cell=float(rng.choice([0.1, 0.2])),
        tolerance=0.02,
        depth=float(rng.uniform(0.8, 2.5)) if rng.random() < 0.7 else None,
        stock_top=float(rng.uniform(4.1, 7)),
        traverse_clearance=CLEARANCE,
    )
    if rng.random() < 0.7:
        return made
    before = dataclasses.replace(made, tool=Shape(2 * d), step=0.6 * d, depth=None)
    return dataclasses.replace(made, depth=None, least=0.1, link=int(rng.integers(1, 3)), earlier=(before,))


def near_stock(request, lowered=0.0):
    """([mm of each rapid that is nearer to stock than the clearance], how many were asked about); lowered: mm by which
    all rapids are lower."""
    plan, found, asked = surface_plan(request), [], 0
    stock = HeightMap((*plan.low[:2], plan.low[2] - 1), (*plan.high[:2], request.stock_top), CELL)
    for one in (*request.earlier, request):
        made = surface_judge.positions(surface_plan(one).moves, START)
        places = np.concatenate([(points[-1:] - (0, 0, lowered)) if rapid else points[1:] for rapid, points in made])
        kinds = np.concatenate(
            [[records.RAPID] if rapid else np.full(len(points) - 1, records.FEED) for rapid, points in made]
        )
        judged, _ = rules.near_stock(np.array(START), places, kinds, request.stock_top, np.inf)
        met = stock.cut(one.tool, np.array(START), places, judged, CLEARANCE)
        found += met["beside"][met["beside"] >= 0.0].tolist() + [0.0] * int(
            ((met["depth"] > 0.02) & (kinds == records.RAPID)).sum()
        )
        asked += int(judged.sum())
    return found, asked


def cases(tmp_path, count):
    for case in range(count):
        rng = np.random.default_rng([random_seed(), case])
        yield case, random_request(rng, surface_cases.write_stl(tmp_path / f"{case}.stl", model(rng)), case)


def test_links_of_surfaces(tmp_path):
    asked = 0
    for case, request in cases(tmp_path, random_count(4)):
        found, count = near_stock(request)
        assert not found, (case, found, request)
        asked += count
    assert asked > 10


def test_a_link_leaves_a_wall_level(tmp_path):
    """In levels, with P2: straight up beside a wall, and away from it. A link went down by 3 degrees there, 0.005 mm
    from the wall."""
    rng = np.random.default_rng([9311, 1])
    found, asked = near_stock(random_request(rng, surface_cases.write_stl(tmp_path / "wall.stl", model(rng)), 1))
    assert asked and not found


def test_the_rule_sees_rapids_that_are_lower(tmp_path):
    _, request = next(cases(tmp_path, 1))
    assert near_stock(dataclasses.replace(request, link=1, earlier=(), least=None, depth=1.5), 1.0)[0]
