# SPDX-License-Identifier: GPL-2.0-or-later
"""An oracle for the offline sweep, written apart: fine needles on a grid of their own, moves in tiny steps; the loops
over needles are in check_oracle.c, which shares nothing with the product.

Depth of a move: how far the highest needle that the tool meets, made smaller by `skin` all over, reaches above its tip.

A step across the axis that is not longer than the skin (steep moves, moves of micrometres) would cut a needle at the
rim before the smaller tool comes to it.  There the smaller tool cuts what it meets, and the whole one follows LAG
behind.
"""

import ctypes as C
from functools import lru_cache

import numpy as np

from support import ROOT

LIBRARY = ROOT / "build" / "tests" / "support" / "check_oracle.so"
STEP = 0.03  # mm in XY
STEP_Z = 0.02  # mm
LAG = 0.05  # mm in XY, more than any skin
STILL = 1e-6  # mm in XY: a move along the axis


def profile(tool, r):
    """Height (mm) of the cutting edge above the tip at r <= radius.  tool: (diameter, corner radius, tip angle)."""
    diameter, corner, tip = tool
    radius = diameter / 2
    if tip:
        half = np.radians(tip / 2)
        touch = corner * np.cos(half)
        cone = corner * (1 - np.sin(half)) + (r - touch) / np.tan(half)
        return np.where(r < touch, corner - np.sqrt(np.maximum(corner**2 - r**2, 0)), cone)
    over = np.maximum(r - (radius - corner), 0)
    return corner - np.sqrt(np.maximum(corner**2 - over**2, 0))


class Grid(C.Structure):
    """struct needles of check_oracle.c."""

    _fields_ = [
        ("low", C.c_double * 3),
        ("spacing", C.c_double),
        ("x", C.c_void_p),
        ("y", C.c_void_p),
        ("columns", C.c_long),
        ("rows", C.c_long),
    ]


class Edge(C.Structure):
    """struct edge of check_oracle.c."""

    _fields_ = [(name, C.c_double) for name in ("radius", "corner", "touch", "foot", "tangent")]


@lru_cache(maxsize=None)
def library():
    found, d, p = C.CDLL(str(LIBRARY)), C.c_double, C.c_void_p
    found.needles_cut.argtypes, found.needles_cut.restype = [p, p, p, d, d, d], None
    found.needles_meet.argtypes, found.needles_meet.restype = [p, p, p, d, d, d, d, d], d
    found.needles_move.argtypes, found.needles_move.restype = [p, p, p, p, p, C.c_long, C.c_long, p, p, p, p], None
    return found


@lru_cache(maxsize=None)
def edge_of(tool):
    """profile() of a tool, as the C file has it."""
    diameter, corner, tip = tool
    if not tip:
        return Edge(diameter / 2, corner, -1.0, 0.0, 1.0)
    half = np.radians(tip / 2)
    return Edge(diameter / 2, corner, corner * np.cos(half), corner * (1 - np.sin(half)), np.tan(half))


def _smaller(tool, skin):
    """(tool, mm that its tip is higher): a tool that is smaller by a skin all over."""
    diameter, corner, tip = tool
    lift = skin / np.sin(np.radians(tip / 2)) if tip and not corner else skin
    return (diameter - 2 * skin, max(corner - skin, 0.0), tip), float(lift)


class Needles:
    """A box of stock `low` .. `high` (mm)."""

    def __init__(self, low, high, spacing):
        self.low, self.high, self.spacing = low, high, spacing
        x, y = (np.arange(low[k] + 0.37 * spacing, high[k], spacing) for k in (0, 1))
        self.x, self.y = np.meshgrid(x, y)
        self.z = np.full(self.x.shape, float(high[2]))
        self._places = x, y  # the grid has their addresses
        self._grid = Grid(tuple(map(float, low)), spacing, x.ctypes.data, y.ctypes.data, len(x), len(y))
        # by skin: heights as the smaller tool finds them, and steps that the whole tool has still to follow
        self.seen = {}

    def volume(self):
        """mm3 left."""
        return (self.z - self.low[2]).sum() * self.spacing**2

    def move(self, tool, start, end, skin):
        """Cut a straight move; -> its depth for each of the skins (mm)."""
        tool = tuple(map(float, tool))
        start, end = np.asarray(start, float), np.asarray(end, float)
        flat = np.hypot(*(end - start)[:2])
        count = int(max(np.ceil(flat / STEP), np.ceil(abs(end[2] - start[2]) / STEP_Z), 1))
        for s in skin:
            if flat < STILL or flat / count >= 2 * s:
                self.seen.pop(s, None)
            else:
                self.seen.setdefault(s, (self.z.copy(), []))
        return (
            self._steps(tool, start, end - start, count, skin)
            if self.seen
            else self._whole(tool, start, end - start, count, skin)
        )

    def _whole(self, tool, start, travel, count, skin):
        """All steps at once; no tool follows behind."""
        smaller, lifts = zip(*(_smaller(tool, s) for s in skin)) if skin else ((), ())
        depth, many = np.zeros(len(skin)), C.c_double * len(skin)
        start, travel = (np.ascontiguousarray(v) for v in (start, travel))
        library().needles_move(
            C.byref(self._grid),
            self._heights(self.z),
            C.byref(edge_of(tool)),
            start.ctypes.data,
            travel.ctypes.data,
            count,
            len(skin),
            (Edge * len(skin))(*map(edge_of, smaller)),
            many(*lifts),
            many(*skin),
            depth.ctypes.data,
        )
        return depth.tolist()

    def _steps(self, tool, start, travel, count, skin):
        flat = np.hypot(*travel[:2])
        depth = [0.0] * len(skin)
        for k in range(1, count + 1):
            place = (start + travel * k / count).tolist()
            for i, s in enumerate(skin):
                heights, waiting = self.seen.get(s, (self.z, None))
                depth[i] = max(depth[i], self._meets(tool, heights, place, s))
                if waiting is not None:
                    self._follow(tool, place, flat / count, s)
            self._cut(self.z, tool, *place)
        return depth

    def _follow(self, tool, place, advance, skin):
        """A step of the smaller tool, and those of the whole one that are due LAG behind."""
        heights, waiting = self.seen[skin]
        smaller, lift = _smaller(tool, skin)
        self._cut(heights, smaller, *place[:2], place[2] + lift)
        waiting.append([0.0, tool, place])
        for step in waiting:
            step[0] += advance
        while waiting and waiting[0][0] > LAG:
            _, whole, behind = waiting.pop(0)
            self._cut(heights, whole, *behind)

    def _heights(self, heights):
        assert heights.shape == self.x.shape and heights.dtype == float and heights.flags.c_contiguous
        return heights.ctypes.data

    def _cut(self, heights, tool, x, y, z):
        library().needles_cut(C.byref(self._grid), self._heights(heights), C.byref(edge_of(tool)), x, y, z)

    def _meets(self, tool, heights, place, skin):
        smaller, lift = _smaller(tool, skin)
        return library().needles_meet(
            C.byref(self._grid), self._heights(heights), C.byref(edge_of(smaller)), *place, place[2] + lift, skin
        )
