# SPDX-License-Identifier: GPL-2.0-or-later
"""An oracle for the offline sweep, written apart: fine needles on a grid of their own, moves in tiny steps, numpy only.

Depth of a move: how far the highest needle that the tool meets, made smaller by `skin` all over, reaches above its tip.
"""

import numpy as np

STEP = 0.03         # mm in XY
STEP_Z = 0.02       # mm


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


class Needles:
    """A box of stock `low` .. `high` (mm)."""

    def __init__(self, low, high, spacing):
        self.low, self.high, self.spacing = low, high, spacing
        x, y = (np.arange(low[k] + 0.37 * spacing, high[k], spacing) for k in (0, 1))
        self.x, self.y = np.meshgrid(x, y)
        self.z = np.full(self.x.shape, float(high[2]))

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
        radius = tool[0] / 2
        count = int(max(np.ceil(np.hypot(*(end - start)[:2]) / STEP), np.ceil(abs(end[2] - start[2]) / STEP_Z), 1))
        depth = [0.0] * len(skin)
        for k in range(1, count + 1):
            x, y, z = start + (end - start) * k / count
            near = self._window(x, y, radius)
            r, heights = np.hypot(self.x[near] - x, self.y[near] - y), self.z[near]
            for i, s in enumerate(skin):
                depth[i] = max(depth[i], self._meets(tool, r, heights, z, s))
            inside = r <= radius
            floor = np.maximum(z + profile(tool, np.minimum(r, radius)), self.low[2])
            heights[inside] = np.minimum(heights, floor)[inside]
        return depth

    def _meets(self, tool, r, heights, z, skin):
        diameter, corner, tip = tool
        smaller = (diameter - 2 * skin, max(corner - skin, 0.0), tip)
        lift = skin / np.sin(np.radians(tip / 2)) if tip and not corner else skin
        edge = z + lift + profile(smaller, np.minimum(r, diameter / 2 - skin))
        met = (r < diameter / 2 - skin) & (heights > np.maximum(edge, self.low[2] + skin))
        return float(heights[met].max() - z) if met.any() else 0.0
