# SPDX-License-Identifier: GPL-2.0-or-later
"""The rapids of G12, G13, G77, G78 and G79 keep the clearance from stock at their side: the rule of bin/chipwise check
on what they plan."""

import random

import numpy as np
import pytest

from chipwise.check import rules
from chipwise.program import records
from chipwise.clib.height_map import HeightMap, Shape
from chipwise.cycles import contour, hole, pocket
from chipwise.errors import CycleError
from chipwise.geometry.pocket.strategies import NAMES
from support import hole_oracle as trace
from support.contour_cycle_judge import random_request as random_contour
from support.flute_oracle import points_along
from support.hole_judge import random_case as random_hole
from support.pocket_judge import random_request
from support.pocket_random import rectangle
from support.pocket_requests import request
from support.random_cases import random_count, random_seed

CLEARANCE, CHORD = 0.2, 0.05  # mm


def beside(moves, start, radius, bottom, cell=0.25):
    """([(number of the rapid, mm)] of those beside stock, which is as high as Z0 and reaches far beyond the moves, how
    many were asked about)."""
    walked = trace.walk(moves, start)
    places, kinds, owner = [], [], []
    for number, element in enumerate(walked):
        points = (
            [element.b]
            if element.kind == "rapid"
            else points_along(element, 1.0 if element.kind != "arc" else CHORD)[1:]
        )
        places += list(map(tuple, points))
        kinds += [records.RAPID if element.kind == "rapid" else records.FEED] * len(points)
        owner += [number] * len(points)
    places, kinds = np.array(places), np.array(kinds)
    cuts = places[places[:, 2] < 0]
    cell = min(cell, radius / 4)
    low, high = cuts.min(axis=0) - 4 * radius, cuts.max(axis=0) + 4 * radius
    stock = HeightMap((low[0], low[1], bottom - 1), (high[0], high[1], 0.0), cell)
    judged, _ = rules.near_stock(np.array(start, float), places, kinds, 0.0, np.inf)
    met = stock.cut(Shape(2 * radius), start, places, judged, CLEARANCE)
    return [(owner[k], float(met["beside"][k])) for k in np.flatnonzero(met["beside"] >= 0.0)], int(judged.sum())


@pytest.mark.parametrize("strategy", sorted(NAMES))
def test_pockets(strategy):
    for case in range(random_count(2)):
        seed = 7_000 + random_seed() + case
        asked = random_request(seed, strategy)
        found, _ = beside(pocket.pocket_plan(asked).moves, asked.start, asked.tool_radius, asked.bottom)
        assert not found, (seed, found)


def test_holes_and_contours():
    """Some with approaches and chops: a rapid is never below R."""
    for case in range(random_count(4)):
        seed = 7_000 + random_seed() + case
        asked = random_hole(random.Random(seed))
        assert not beside(hole.hole_plan(asked).moves, asked.start, asked.tool_radius, asked.bottom)[0], seed
        try:
            asked = random_contour(seed)
            plan = contour.contour_plan(asked)
        except CycleError:
            continue  # a tool that fits nowhere
        assert not beside(plan.moves, asked.start, asked.tool_radius, asked.bottom)[0], seed


def test_a_rapid_goes_down_in_the_middle_of_a_cleared_level_only():
    """Three levels of a pocket, entered in its middle; the wall of a slot that is as wide as the tool is beside it
    everywhere."""
    wide = request(bottom=-9.0, depth_step=3.1)
    found, asked = beside(pocket.pocket_plan(wide).moves, wide.start, 3.0, -9.0)
    assert not found and asked >= 2  # it goes down to the second and third level
    slot = request((rectangle(0, 0, 40, 6.1),), bottom=-9.0, depth_step=3.1)
    plan = pocket.pocket_plan(slot)
    assert min(e.b[2] for e in trace.walk(plan.moves, slot.start) if e.kind == "rapid") >= 1.0
    assert beside(plan.moves, slot.start, 3.0, -9.0)[0] == []


def test_the_rule_sees_a_rapid_beside_a_wall():
    """Without the rule the same pocket has some: a start of a track that is known is beside rows to come."""
    asked = request(strategy=1, bottom=-9.0, depth_step=3.1, traverse_clearance=0.0)
    plan = pocket.pocket_plan(asked)
    moves = [
        m
        if getattr(m, "feed", None) is None or m.x is not None or m.y is not None
        else type(plan.moves[0])(x=None, y=None, z=m.z)
        for m in plan.moves
    ]  # every feed straight down becomes a rapid
    assert beside(moves, asked.start, 3.0, -9.0)[0]
