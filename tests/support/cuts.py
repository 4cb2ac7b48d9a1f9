# SPDX-License-Identifier: GPL-2.0-or-later
"""Cuts of known volume for the stock model.

Who calls it: tests/core/test_stock.py, bench/bench_accuracy.py.  `KNOWN` are closed forms of one
layer; chains of moves (raster, helix) are compared with the reference model.
Lengths mm, volumes mm3.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from chipwise.clib import core
from support import reference_stock as reference

LOW, HIGH = (-14.03, -13.02, -6.0), (13.98, 14.01, 0.0)
PI = math.pi


def _turned(points, degrees):
    a = math.radians(degrees)
    c, s = math.cos(a), math.sin(a)
    p = np.array(points, float)
    return np.column_stack([c * p[:, 0] - s * p[:, 1], s * p[:, 0] + c * p[:, 1], p[:, 2]])


@functools.lru_cache(maxsize=None)
def _taper_groove(diameter, corner, tip, depth, length):
    """Profile area x length + volume of the tip, both by fine strips of the solid in height."""
    tool = reference.ReferenceTool(diameter, corner, tip)
    r = np.linspace(0.0, tool.radius, 200001)
    z = tool.surface(r)
    r, z = r[z <= depth], z[z <= depth]
    gap = depth - 0.5 * (z[1:] + z[:-1])
    return 2.0 * np.sum(gap * np.diff(r)) * length + PI * np.sum(gap * np.diff(r**2))


def _faced_then_deeper():
    """A row of known(): all of the stock is faced, then its right rim is cut deeper."""
    low, high = np.array(LOW[:2]), np.array(HIGH[:2])  # no multiple of a cell: its rim cells are faced, then cut deeper
    rows, face = np.arange(low[1], high[1] + 6.0, 4.0), []
    for i, y in enumerate(rows):
        ends = (low[0] - 4.0, high[0] + 4.0)
        face += [[ends[i % 2], y, -1.0], [ends[1 - i % 2], y, -1.0]]
    side = [[high[0] - 2.0, low[1] - 4.0], [high[0] - 2.0, high[1] + 4.0]]
    lift = [[*face[-1][:2], 1.0], [*side[0], 1.0]]
    deeper = [[*side[(level + k) % 2], z] for level, z in enumerate((-2.0, -3.5, -5.0)) for k in (0, 1)]
    return (
        "faced to the rim, then deeper",
        (6, 0, 0),
        np.array(face + lift + deeper),
        float(np.prod(high - low)) * 1.0 + 5.0 * (high[1] - low[1]) * 4.0,
    )


def known():
    """(name, tool, points (n, 3), volume)."""
    for angle in (0, 17, 31, 45, 73):
        yield (
            f"slot {angle} deg",
            (6, 0, 0),
            _turned([[-6, 0, -2], [6, 0, -2]], angle),
            2 * (6 * 12 + 9 * PI),
        )  # depth x stadium
        yield (
            f"ramp {angle} deg",
            (6, 0, 0),
            _turned([[-6, 0, 0], [6, 0, -2]], angle),
            3 * 12 * 2 + 9 * PI * 2,
        )  # R L d + pi R^2 d
        yield (
            f"ball groove {angle} deg",
            (6, 3, 0),
            _turned([[-6, 0, -3], [6, 0, -3]], angle),
            4.5 * PI * 12 + 18 * PI,
        )  # half cylinder + half ball
        yield (
            f"vee groove {angle} deg",
            (8, 0, 90),
            _turned([[-6, 0, -3], [6, 0, -3]], angle),
            9 * 12 + 9 * PI,
        )  # h^2 L + pi h^3 / 3
        yield (
            f"tapered groove {angle} deg",
            (6, 0.5, 20),
            _turned([[-6, 0, -4], [6, 0, -4]], angle),
            _taper_groove(6, 0.5, 20, 4, 12),
        )
    yield _faced_then_deeper()
    at = np.array([0.13, -0.07])
    for name, tool, volume in (
        ("flat", (6, 0, 0), 27 * PI),
        ("ball", (6, 3, 0), 18 * PI),  # half ball, 3 deep
        ("vee", (8, 0, 90), 9 * PI),
    ):
        yield f"plunge {name}", tool, np.array([[*at, 1], [*at, -3]]), volume
    # raster: rows 3 mm apart, linked at alternating ends
    passes = [[(-8 if (i + j) % 2 == 0 else 8), -6 + 3.0 * i, -2.0] for i in range(5) for j in (0, 1)]
    for angle in (0, 17, 45):
        yield (f"raster pocket {angle} deg", (6, 0, 0), _turned(passes, angle), 2 * (16 * 18 + _raster_ends()))


def _raster_ends():
    """Plan area beyond both ends of five rows of a 6 mm tool 3 mm apart: an outer half disc, two
    gaps filled by the link (3 x 3) and two with a cusp between two discs, at each end."""
    cusp = 1.5 * math.sqrt(9 - 1.5**2) + 9 * math.asin(0.5)
    return 2 * (4.5 * PI + 2 * 9 + 2 * cusp)


def helix(radius=4.0, pitch=1.0, turns=3, chord=0.1):
    count = round(2 * PI * radius * turns / chord)
    a = np.linspace(0.0, 2 * PI * turns, count + 1)
    return np.column_stack([radius * np.cos(a), radius * np.sin(a), -pitch * a / (2 * PI)])


def helix_volume(radius=4.0, pitch=1.0, turns=3, tool_radius=3.0):
    """Flat tool going down `turns` turns, hole open in the middle if radius > tool radius.  Every
    column is cut by the last pass over it; at polar radius r the tool covers it until the angle
    t_end less a - acos(...) of the last turn: mean depth by integration over the plan."""
    n, m = 3000, 1440
    inner = radius - tool_radius
    r = inner + (np.arange(n) + 0.5) / n * 2 * tool_radius
    phi = np.arange(m) / m * 2 * PI
    end = 2 * PI * turns
    half = np.arccos(np.clip((r * r + radius**2 - tool_radius**2) / (2 * r * radius), -1, 1))
    # last tool angle <= end that covers (r, phi): latest a = phi + half + 2 pi k <= end, or end
    last = np.mod(end - (phi[None, :] + half[:, None]), 2 * PI)
    last = np.where(last > 2 * PI - 2 * half[:, None], 0.0, last)  # end lies within the cover
    depth = pitch * (end - last) / (2 * PI)
    return float((depth * r[:, None]).sum() * (2 * tool_radius / n) * (2 * PI / m))


def core_volume(tool, points, cell, diameter_error=0.0, low=LOW, high=HIGH):
    """Removed volume by the core; diameter_error (mm) is sabotage."""
    stock = core.Stock(low, high, cell)
    cutter = core.Cutter(stock, core.Tool(tool[0] + diameter_error, *tool[1:]), points[0])
    for point in points[1:]:
        cutter.to(point)
    return stock.head.removed


def reference_volume(tool, points, spacing=0.04, low=LOW, high=HIGH, seed=1):
    stock = reference.ReferenceStock(low, high, spacing, seed)
    stock.path(reference.ReferenceTool(*tool), np.array(points, float))
    return stock.removed()
