# SPDX-License-Identifier: GPL-2.0-or-later
"""Cuts whose section area is known in closed form, and how well the core meets it.

Who calls it: tests/core/test_section.py, bench/bench_accuracy.py.

A case is a path of the tool in steps as a servo period makes them (0.05 mm), what was cut
before, and the true area at every step.  The truth of a tool that is not flat is the
integral of (n . d)+ over the reference tool's surface, summed here point by point in plan
coordinates; it knows nothing of bands or of a map.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field

import numpy as np

from chipwise.clib import core
from support.reference_stock import ReferenceTool

STEP = 0.05  # mm, of a servo period at 50 mm/s
LOW, HIGH = (-32.0, -32.0, -8.0), (32.0, 32.0, 0.0)
DIRECTIONS = (0, 17, 31, 45, 73)
FLAT, BALL, BULL = (6.0, 0.0, 0.0), (6.0, 3.0, 0.0), (10.0, 2.0, 0.0)
TOOLS = {"flat": FLAT, "ball": BALL, "bull": BULL}
DEPTH = {"flat": 2.0, "ball": 3.0, "bull": 3.0}


@dataclass
class Case:
    name: str
    kind: str  # slot, side, ramp, plunge, arc, chain
    tool: tuple  # diameter, corner, tip angle
    path: np.ndarray  # (n, 3) mm
    area: object  # function -> true area of the step that ends there, (n,) or one for all, mm2
    steady: np.ndarray  # (n,) bool: the truth holds
    before: list = field(default_factory=list)  # paths (n, 3) cut before

    @functools.cached_property
    def truth(self):
        """(n,) mm2; computed when it is asked for: pytest only wants names when it collects."""
        return np.broadcast_to(self.area(), len(self.path))


@functools.lru_cache(maxsize=None)
def front_area(tool, depth, slope=0.0):
    """dV/ds of a tool with its tip `depth` mm under a flat top, moving along +X and down by
    `slope` (rad): the sum of (n . d)+ over its surface below the stock, in plan coordinates."""
    reference = ReferenceTool(*tool)
    level, fall = math.cos(slope), math.sin(slope)
    reach = float(np.interp(depth, reference._z, reference._r)) if tool[1] or tool[2] else reference.radius
    edge = reach * np.sin(np.arange(401) / 400.0 * math.pi / 2.0)
    r, width = 0.5 * (edge[1:] + edge[:-1]), np.diff(edge)
    rise = np.diff(reference.surface(edge))
    c = np.cos((np.arange(720) + 0.5) / 720.0 * 2.0 * math.pi)
    flux = np.maximum(0.0, rise[:, None] * c[None, :] * level + width[:, None] * fall) * r[:, None]
    wall = max(0.0, depth - float(reference.surface(np.array([reference.radius]))[0]))
    return float(flux.sum() * 2.0 * math.pi / 720.0) + 2.0 * reference.radius * wall * level


@functools.lru_cache(maxsize=None)
def side_area(tool, depth, width):
    """dV/ds of a straight pass `width` mm beside an equal one: the area between the tool's
    outline and what the pass before left, seen along the path."""
    reference = ReferenceTool(*tool)
    u = (np.arange(20000) + 0.5) / 20000.0 * 2.0 * reference.radius - reference.radius
    height = reference.surface(np.abs(u))
    beside = np.abs(u + width)
    left = np.where(beside <= reference.radius, reference.surface(np.minimum(beside, reference.radius)), np.inf)
    left = np.minimum(left, depth)
    return float(np.maximum(0.0, left - height).sum() * 2.0 * reference.radius / u.size)


def _line(start, end):
    start, end = np.array(start, float), np.array(end, float)
    count = max(1, round(np.linalg.norm(end - start) / STEP))
    return start + (end - start) * np.linspace(0.0, 1.0, count + 1)[:, None]


def _straight(angle, length, z, offset=0.0, drop=0.0):
    a = math.radians(angle)
    u, side = np.array([math.cos(a), math.sin(a)]), np.array([-math.sin(a), math.cos(a)])
    centre = np.array([0.13, -0.07]) + offset * side
    return _line([*(centre - u * length / 2), z], [*(centre + u * length / 2), z - drop])


def _full_area(name):
    """-> function: the area of a tool of TOOLS in a slot."""
    tool = TOOLS[name]
    return functools.partial(front_area, tool, DEPTH[name]) if name != "flat" else lambda: tool[0] * DEPTH[name]


def _case(name, kind, tool, path, area, settle, before=()):
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    steady = (run > settle) & (run < run[-1] - 1e-9)
    return Case(name, kind, tool, path, area, steady, list(before))


def slots():
    for name, tool in TOOLS.items():
        area = _full_area(name)
        for angle in DIRECTIONS:
            yield _case(f"slot {name} {angle} deg", "slot", tool, _straight(angle, 20, -DEPTH[name]), area, 6)


def sides(parts=(10, 25, 50, 75, 90)):
    for name, tool in TOOLS.items():
        for part in parts:
            width = tool[0] * part / 100.0
            for angle in DIRECTIONS:
                area = functools.partial(side_area, tool, DEPTH[name], width)
                yield _case(
                    f"side {name} {part} % {angle} deg",
                    "side",
                    tool,
                    _straight(angle, 22, -DEPTH[name], width),
                    area,
                    8,
                    [_straight(angle, 40, -DEPTH[name])],
                )


def ramps():
    for name, tool in TOOLS.items():
        for degrees in (2, 10, 30):
            for angle in (0, 31, 45):
                length = 24 if degrees < 30 else 10
                drop = length * math.tan(math.radians(degrees))
                path = _straight(angle, length, -0.5, 0, drop)
                area = functools.partial(_ramp_area, tool, path[:, 2], math.radians(degrees))
                yield _case(f"ramp {name} {degrees} deg down, {angle} deg", "ramp", tool, path, area, 6)


def _ramp_area(tool, z, slope):
    samples = np.linspace(z[0], z[-1], 30)
    return np.interp(-z, -samples, [front_area(tool, -level, slope) for level in samples])


def plunges():
    for name, tool in TOOLS.items():
        path = _line([0.13, -0.07, 0.0], [0.13, -0.07, -5.0])
        yield _case(f"plunge {name}", "plunge", tool, path, functools.partial(_plunge_area, tool, path[:, 2]), 0.5)


def _plunge_area(tool, z):
    reference = ReferenceTool(*tool)
    r = np.linspace(0, reference.radius, 4001)
    g = reference.surface(r)
    reach = np.array([r[g <= -level + 1e-12].max(initial=0.0) for level in z])
    return math.pi * reach**2


def _arc(radius, turns, z, step=STEP, start=0.3):
    count = round(2.0 * math.pi * radius * turns / step)
    a = start + np.linspace(0.0, 2.0 * math.pi * turns, count + 1)
    return np.column_stack([radius * np.cos(a), radius * np.sin(a), np.full(a.shape, z)])


def arcs():
    """Slots along arcs of 1..20 tool radii: an annulus of the tool's width, so D x depth per mm."""
    for name in ("flat", "ball"):
        tool = TOOLS[name]
        area = _full_area(name)
        for times in (1, 1.5, 2, 3, 5, 8):
            radius = times * tool[0] / 2.0
            yield _case(
                f"arc {name} {times:g} R",
                "arc",
                tool,
                _arc(radius, 0.45, -DEPTH[name]),
                area,
                min(6.0, 0.3 * radius * math.pi),
            )
        for times in (12, 20):  # too large for a full view: a piece through the middle
            radius = times * tool[0] / 2.0
            path = _arc(radius, 30.0 / (2 * math.pi * radius), -DEPTH[name])
            yield _case(f"arc {name} {times:g} R", "arc", tool, path - [*path[:, :2].mean(axis=0), 0.0], area, 6)


def chains():
    """0.1 mm chords of an arc, cut in servo steps within each chord."""
    for name in ("flat", "ball"):
        tool = TOOLS[name]
        area = _full_area(name)
        for times in (2, 5):
            corners = _arc(times * tool[0] / 2.0, 0.45, -DEPTH[name], 0.1)
            path = np.concatenate([corners[:1]] + [_line(a, b)[1:] for a, b in zip(corners, corners[1:])])
            yield _case(f"chain {name} {times:g} R", "chain", tool, path, area, 6)


def cases():
    for make in (slots, sides, ramps, plunges, arcs, chains):
        yield from make()


def measured(case, cell=0.25, through="section", diameter_error=0.0):
    """(mean error, standard deviation), both over the mean truth, of the core along a case.
    through: "section" reads Stock.section at the tip, "ahead" goes through the look-ahead.
    diameter_error (mm) gives the core a wrong tool: the check must then fail."""
    stock = core.Stock(LOW, HIGH, cell)
    tool = core.Tool(case.tool[0] + diameter_error, *case.tool[1:])
    for toolpath in case.before:
        cutter = core.Cutter(stock, tool, toolpath[0])
        cutter.to(toolpath[-1])
    cutter, ahead = core.Cutter(stock, tool, case.path[0]), core.Lookahead(stock, tool)
    areas = np.zeros(len(case.path))
    for i in range(1, len(case.path)):
        start, end = case.path[i - 1], case.path[i]
        cutter.to(end)
        if through == "ahead":
            ahead.step(start, end, 0.001, 4.0, 8)
            areas[i] = ahead.profile(4.0).area
        elif case.steady[i] and i % 3 == 0:
            areas[i] = stock.section(tool, end, (end - start) / np.linalg.norm(end - start))[0]
    read = case.steady & ((np.arange(len(areas)) % 3 == 0) | (through == "ahead"))
    error = (areas - case.truth)[read]
    scale = case.truth[case.steady].mean()
    return float(error.mean() / scale), float(error.std() / scale)
