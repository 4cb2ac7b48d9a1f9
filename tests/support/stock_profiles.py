# SPDX-License-Identifier: GPL-2.0-or-later
"""Straight passes beside and above each other, whose section area is the area between two profiles.

Who calls it: tests/core/test_profiles.py, bench/bench_accuracy.py.  All passes of a case go along one line through the
whole block, so what a pass takes per mm is the area, seen along the line, between what the passes before have left and
the tool's own outline.  Both come from the reference tool (an inside-test of the solid); nothing here knows of cells,
bands or a map.  Lengths mm, areas mm2.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from chipwise.clib import core
from support.reference_stock import ReferenceTool

LOW, HIGH = (-45.03, -45.07, -26.0), (45.06, 45.02, 0.0)
STEP = 0.05  # mm, of a servo period at 50 mm/s
STEADY = 10.0  # mm read, from the middle on
DIRECTIONS = (0.0, 31.0, 73.0)


@dataclass(frozen=True)
class Pass:
    tool: tuple  # diameter, corner, tip angle
    offset: float  # mm to the left of the line
    depth: float  # mm of the tip


@dataclass(frozen=True)
class Case:
    name: str
    kind: str  # deeper, beside, steps, stairs
    before: tuple  # of Pass
    now: Pass


@functools.lru_cache(maxsize=None)
def reference_tool(tool):
    return ReferenceTool(*tool)


def left_by(passes, y):
    """Height of the stock's top at y (n,) after the passes, mm."""
    top = np.zeros_like(y)
    for one in passes:
        tool = reference_tool(one.tool)
        r = np.abs(y - one.offset)
        surface = np.where(r <= tool.radius, tool.surface(np.minimum(r, tool.radius)) - one.depth, np.inf)
        top = np.minimum(top, surface)
    return np.maximum(top, LOW[2])


@functools.lru_cache(maxsize=None)
def truth(case):
    """mm2 per mm of travel."""
    radius = case.now.tool[0] / 2.0
    y = case.now.offset + radius * (2.0 * (np.arange(40000) + 0.5) / 40000 - 1.0)
    return float(np.maximum(0.0, left_by(case.before, y) - left_by((case.now,), y)).sum() * 2.0 * radius / y.size)


FLAT, BALL, BULL, VEE60, VEE90, TAPER = (
    (6.0, 0.0, 0.0),
    (6.0, 3.0, 0.0),
    (10.0, 2.0, 0.0),
    (8.0, 0.0, 60.0),
    (8.0, 0.0, 90.0),
    (6.0, 0.5, 20.0),
)
TOOLS = {
    "flat D1": (1.0, 0.0, 0.0),
    "flat D6": FLAT,
    "flat D25": (25.0, 0.0, 0.0),
    "ball D3.175": (3.175, 1.5875, 0.0),
    "ball D6": BALL,
    "ball D16": (16.0, 8.0, 0.0),
    "bull D10": BULL,
    "bull D25": (25.0, 3.0, 0.0),
    "vee 30": (6.0, 0.0, 30.0),
    "vee 60": VEE60,
    "vee 90": VEE90,
    "vee 120": (12.0, 0.0, 120.0),
    "taper D6": TAPER,
    "taper D8": (8.0, 1.0, 15.0),
}
DEPTH = {"flat D1": 0.5, "ball D3.175": 1.5, "vee 30": 4.0, "vee 120": 2.5, "taper D6": 3.0, "taper D8": 4.0}


def deeper():
    """Second and third depth in a slot of the tool's own width."""
    for name, tool in TOOLS.items():
        step = DEPTH.get(name, 2.0)
        for level in (2, 3):
            yield Case(
                f"{name}, depth {level}",
                "deeper",
                tuple(Pass(tool, 0.0, step * n) for n in range(1, level)),
                Pass(tool, 0.0, step * level),
            )


def beside():
    """A pass beside an equal one, at part of the tool's width at its depth."""
    for name, tool in TOOLS.items():
        depth = DEPTH.get(name, 2.0)
        r = np.linspace(0.0, tool[0] / 2.0, 4001)
        width = 2.0 * float(r[reference_tool(tool).surface(r) <= depth].max())
        for part in (15, 40, 70):
            yield Case(
                f"{name}, {part} % beside", "beside", (Pass(tool, 0.0, depth),), Pass(tool, width * part / 100.0, depth)
            )


def steps():
    """A step of one to three cells beside a raster of the same step: finishing."""
    for name in ("ball D3.175", "ball D6", "ball D16", "flat D6", "bull D10", "taper D6"):
        for step in (0.25, 0.37, 0.5, 0.75):
            for depth in (1.0, 17.0) if name == "ball D3.175" else (3.0,):
                rows = tuple(Pass(TOOLS[name], -step * n, depth) for n in range(6, 0, -1))
                yield Case(f"{name}, steps {step:g}, {depth:g} deep", "steps", rows, Pass(TOOLS[name], 0.0, depth))


def stairs():
    """Second and third depth beside a wall, and beside what another tool has left."""
    for name, tool in TOOLS.items():
        d, t = tool[0], DEPTH.get(name, 2.0)
        yield Case(
            f"{name}, second depth beside a slot",
            "stairs",
            (Pass(tool, 0.0, t), Pass(tool, 0.3 * d, t), Pass(tool, 0.0, 2 * t)),
            Pass(tool, 0.3 * d, 2 * t),
        )
        yield Case(
            f"{name}, along a step of another tool",
            "stairs",
            (Pass((10.0, 0.0, 0.0), -5.0, t),),
            Pass(tool, 0.11 * d, 1.5 * t),
        )


def cases():
    for make in (deeper, beside, steps, stairs):
        yield from make()


def along(angle, offset, at):
    a = math.radians(angle)
    return (0.13 + at * math.cos(a) - offset * math.sin(a), -0.07 + at * math.sin(a) + offset * math.cos(a))


def measured(case, angle, cell=0.25, through="section"):
    """(mean error, standard deviation), both over the truth, along the case in one direction."""
    stock = core.Stock(LOW, HIGH, cell)
    heading = (math.cos(math.radians(angle)), math.sin(math.radians(angle)), 0.0)
    for one in case.before:
        cutter = core.Cutter(stock, core.Tool(*one.tool), (*along(angle, one.offset, -75.0), -one.depth))
        cutter.to((*along(angle, one.offset, 75.0), -one.depth))
    tool, areas = core.Tool(*case.now.tool), []
    last = (*along(angle, case.now.offset, -75.0), -case.now.depth)
    cutter, ahead = core.Cutter(stock, tool, last), core.Lookahead(stock, tool)
    begin = -6.0 - tool.radius if through == "ahead" else -2.0
    last = (*along(angle, case.now.offset, begin), -case.now.depth)
    cutter.to(last)
    for n in range(1, round((STEADY - begin) / STEP) + 1):
        at = begin + n * STEP
        tip = (*along(angle, case.now.offset, at), -case.now.depth)
        cutter.to(tip)
        if through == "ahead":
            ahead.step(last, tip, 0.001, 4.0, 100)
            last = tip
            if at > 0.0 and n % 3 == 0:
                areas.append(ahead.profile(4.0).area)
        elif at > 0.0 and n % 3 == 0:
            areas.append(stock.section(tool, tip, heading)[0])
    error = np.array(areas) / truth(case) - 1.0
    return float(error.mean()), float(error.std())
