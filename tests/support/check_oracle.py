# SPDX-License-Identifier: GPL-2.0-or-later
"""An oracle for the offline sweep, written apart: fine needles on a grid of their own, moves in tiny steps, numpy only.

Depth of a move: how far the highest needle that the tool meets, made smaller by `skin` all over, reaches above its tip.

A step across the axis that is not longer than the skin (steep moves, moves of micrometres) would cut a needle at the rim before the
smaller tool comes to it.  There the smaller tool cuts what it meets, and the whole one follows LAG behind.
"""

import numpy as np

STEP = 0.03         # mm in XY
STEP_Z = 0.02       # mm
LAG = 0.05          # mm in XY, more than any skin
STILL = 1e-6        # mm in XY: a move along the axis


def profile(tool, r):
    """Height (mm) of the cutting edge above the tip at r <= radius.  tool: (diameter, corner radius, tip angle)."""
    diameter, corner, tip = tool
    radius = diameter / 2
    if tip:
        half = np.radians(tip / 2)
        touch = corner * np.cos(half)
        cone = corner * (1 - np.sin(half)) + (r - touch) / np.tan(half)
        return np.where(r < touch, corner - np.sqrt(np.maximum(corner ** 2 - r ** 2, 0)), cone)
    over = np.maximum(r - (radius - corner), 0)
    return corner - np.sqrt(np.maximum(corner ** 2 - over ** 2, 0))


def _smaller(tool, x, y, z, skin):
    """(tool, x, y, z): a tool that is smaller by a skin all over, and where its tip is."""
    diameter, corner, tip = tool
    lift = skin / np.sin(np.radians(tip / 2)) if tip and not corner else skin
    return (diameter - 2 * skin, max(corner - skin, 0.0), tip), x, y, z + lift


class Needles:
    """A box of stock `low` .. `high` (mm)."""

    def __init__(self, low, high, spacing):
        self.low, self.high, self.spacing = low, high, spacing
        x, y = (np.arange(low[k] + 0.37 * spacing, high[k], spacing) for k in (0, 1))
        self.x, self.y = np.meshgrid(x, y)
        self.z = np.full(self.x.shape, float(high[2]))
        self.seen = {}          # by skin: heights as the smaller tool finds them, and steps that the whole tool has still to follow

    def volume(self):
        """mm3 left."""
        return (self.z - self.low[2]).sum() * self.spacing ** 2

    def _window(self, x, y, radius):
        """Slices of the needles near a place."""
        first = [int(np.clip((v - radius - self.low[k]) / self.spacing - 2, 0, None)) for k, v in enumerate((x, y))]
        last = [int(np.clip((v + radius - self.low[k]) / self.spacing + 2, 0, None)) for k, v in enumerate((x, y))]
        return slice(first[1], last[1]), slice(first[0], last[0])

    def move(self, tool, start, end, skin):
        """Cut a straight move; -> its depth for each of the skins (mm)."""
        start, end = np.asarray(start, float), np.asarray(end, float)
        flat = np.hypot(*(end - start)[:2])
        count = int(max(np.ceil(flat / STEP), np.ceil(abs(end[2] - start[2]) / STEP_Z), 1))
        for s in skin:
            if flat < STILL or flat / count >= 2 * s:
                self.seen.pop(s, None)
            else:
                self.seen.setdefault(s, (self.z.copy(), []))
        depth = [0.0] * len(skin)
        for k in range(1, count + 1):
            x, y, z = start + (end - start) * k / count
            for i, s in enumerate(skin):
                heights, waiting = self.seen.get(s, (self.z, None))
                near = self._window(x, y, tool[0] / 2)
                r = np.hypot(self.x[near] - x, self.y[near] - y)
                depth[i] = max(depth[i], self._meets(tool, r, heights[near], z, s))
                if waiting is not None:
                    self._follow(tool, (x, y, z), flat / count, s)
            self._cut(self.z, tool, x, y, z)
        return depth

    def _follow(self, tool, place, advance, skin):
        """A step of the smaller tool, and those of the whole one that are due LAG behind."""
        heights, waiting = self.seen[skin]
        self._cut(heights, *_smaller(tool, *place, skin))
        waiting.append([0.0, tool, place])
        for step in waiting:
            step[0] += advance
        while waiting and waiting[0][0] > LAG:
            _, whole, behind = waiting.pop(0)
            self._cut(heights, whole, *behind)

    def _cut(self, heights, tool, x, y, z):
        near, radius = self._window(x, y, tool[0] / 2), tool[0] / 2
        r, own = np.hypot(self.x[near] - x, self.y[near] - y), heights[near]
        inside = r <= radius
        floor = np.maximum(z + profile(tool, np.minimum(r, radius)), self.low[2])
        own[inside] = np.minimum(own, floor)[inside]

    def _meets(self, tool, r, heights, z, skin):
        smaller, _, _, lifted = _smaller(tool, 0.0, 0.0, z, skin)
        edge = lifted + profile(smaller, np.minimum(r, smaller[0] / 2))
        met = (r < smaller[0] / 2) & (heights > np.maximum(edge, self.low[2] + skin))
        return float(heights[met].max() - z) if met.any() else 0.0
