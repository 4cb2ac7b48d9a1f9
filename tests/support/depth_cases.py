# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves in a small stock for the tests of the proof of depths (components/offline/depth_proof.c), and what is left of
it by brute force."""

from types import SimpleNamespace

import numpy as np

from chipwise.program.records import FEED, STOCK, TOOL
from chipwise.rewrite import depth_proof
from chipwise.tool_data.geometry import ToolGeometry
from support.check_oracle import Needles, profile
from support.random_cases import random_seed

LOW, HIGH = (0.0, 0.0, -12.0), (14.0, 12.0, 0.0)
SPACING = 0.05  # mm, of the oracle's needles


def program_of(places, tool, kinds=None, low=LOW, high=HIGH, shape=0):
    """What depths.py reads of a Program: moves from the first of the places (n, 3) to the others with one tool
    (diameter, corner, tip)."""
    places = np.array(places, float)
    events = [
        SimpleNamespace(kind=STOCK, at=0, line=1, values=(shape, 0.0, *low, *high)),
        SimpleNamespace(kind=TOOL, at=0, line=2, values=(1, tool[0])),
    ]
    end = places[1:]
    return SimpleNamespace(
        end=end,
        start=lambda k: places[k],
        kind=np.full(len(end), FEED) if kinds is None else np.array(kinds),
        line=np.arange(len(end)) + 3,
        events=events,
        known_from=0,
    )


def geometry_of(tool, flute):
    diameter, corner, tip = tool
    shape = "vee" if tip else "ball" if corner == diameter / 2 else "bull" if corner else "flat"
    return {
        1: ToolGeometry(
            shape=shape, corner_radius=corner if shape == "bull" else None, tip_angle=tip or None, flute_length=flute
        )
    }


def witnesses(places, tool, flute, **more):
    return depth_proof.too_deep(program_of(places, tool, **more), geometry_of(tool, flute), 0.25, 0.0)


def left_at(x, y, places, tool, low=LOW, high=HIGH):
    """Height of the stock at a place after moves along the places: thousands of positions of the tool."""
    height = high[2] if low[0] <= x <= high[0] and low[1] <= y <= high[1] else low[2]
    for a, b in zip(places[:-1], places[1:]):
        along = a + (b - a) * np.linspace(0, 1, 4001)[:, None]
        r = np.hypot(along[:, 0] - x, along[:, 1] - y)
        inside = r <= tool[0] / 2
        if inside.any():
            height = min(height, float((along[inside, 2] + profile(tool, r[inside])).min()))
    return height


def random_path(seed):
    """(tool, places) of ten random moves."""
    rng = np.random.default_rng([random_seed(), seed])
    diameter = rng.choice([3.0, 4.0, 6.0])
    tool = [(diameter, 0.0, 0.0), (diameter, diameter / 2, 0.0), (diameter, 0.5, 0.0), (diameter, 0.0, 90.0)][seed % 4]
    places = [np.array([-4.0, rng.uniform(0, 12), 2.0])]
    for _ in range(10):
        there = np.array([rng.uniform(-3, 17), rng.uniform(-3, 15), rng.uniform(-9, 1)])
        kind = rng.integers(5)
        if kind == 0:
            there[2] = places[-1][2]
        elif kind == 1:
            there[:2] = places[-1][:2]
        elif kind == 2 and len(places) > 1:
            there = places[-2].copy()
        elif kind == 3:
            there[1:] = places[-1][1:]
        places.append(there)
    return tool, places


def random_case(seed):
    """(tool, places, depth of each move by the needles)."""
    tool, places = random_path(seed)
    needles = Needles(LOW, HIGH, SPACING)
    return tool, places, [needles.move(tool, a, b, (0.005,))[0] for a, b in zip(places[:-1], places[1:])]
