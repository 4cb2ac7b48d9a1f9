# SPDX-License-Identifier: GPL-2.0-or-later
"""The lowest tip of a tool over triangles by brute force: an oracle for the drop cutter that shares nothing with it.

The profile is written down from what the tools are (ball: sphere, bull-nose: torus, ..), and the maximum of z - g(r)
over each triangle is searched on grids of points of it that shrink around the best (drop_oracle.c).  Called by
tests/surface, tests/cycles, tests/machine, tests/oracles and surface_judge.py.
"""

import ctypes as C
import math
from functools import lru_cache

import numpy as np

from support import ROOT

LIBRARY = ROOT / "build" / "tests" / "support" / "drop_oracle.so"


def profile(shape):
    """g(r) of a check.sweep.Shape: mm above the tip at r mm from the axis."""
    radius, corner, half = (
        shape.diameter / 2,
        min(shape.corner_radius, shape.diameter / 2),
        math.radians(shape.tip_angle) / 2,
    )

    def height(r):
        if half:  # a sphere of the corner's radius in a cone
            touch = corner * math.cos(half)
            sphere = corner - np.sqrt(np.maximum(corner**2 - r**2, 0))
            cone = corner - corner / math.sin(half) + r / math.tan(half)
            return np.where(r <= touch, sphere, cone)
        inner = np.maximum(r - (radius - corner), 0)
        return corner - np.sqrt(np.maximum(corner**2 - inner**2, 0))

    return height, radius


class Tool(C.Structure):
    """struct tool of tool_profile.h."""

    _fields_ = [(name, C.c_double) for name in ("radius", "corner", "touch", "foot", "tangent")]


def tool_of(shape):
    """profile() of a tool, as the C files have it."""
    radius, half = shape.diameter / 2, math.radians(shape.tip_angle) / 2
    corner = min(shape.corner_radius, radius)
    if not half:
        return Tool(radius, corner, -1.0, 0.0, 1.0)
    return Tool(radius, corner, corner * math.cos(half), corner - corner / math.sin(half), math.tan(half))


@lru_cache(maxsize=None)
def library():
    found, p = C.CDLL(str(LIBRARY)), C.c_void_p
    found.drop_lowest.argtypes, found.drop_lowest.restype = [p, p, C.c_long, p, C.c_long, C.c_double, p], None
    return found


def all_lowest(triangles, shape, axes, floor):
    """(n, 3, 3), (m, 2) -> (m,): the lowest tip over all triangles with the axis at each of these, mm, or the floor."""
    triangles = np.ascontiguousarray(np.asarray(triangles, float).reshape(-1, 3, 3))
    axes = np.ascontiguousarray(np.asarray(axes, float).reshape(-1, 2))
    tips = np.empty(len(axes))
    library().drop_lowest(
        C.byref(tool_of(shape)),
        triangles.ctypes.data,
        len(triangles),
        axes.ctypes.data,
        len(axes),
        floor,
        tips.ctypes.data,
    )
    return tips


def lowest(triangles, shape, x, y, floor):
    """all_lowest() of one place."""
    return float(all_lowest(triangles, shape, (x, y), floor)[0])
