# SPDX-License-Identifier: GPL-2.0-or-later
"""The lowest tip of a tool over a model: components/offline/drop_cutter.c from Python.

Called by surface/links.py, cycles/surface.py and check/part.py.  All lengths mm, in the model's coordinates.
"""

import ctypes as C
import math

import numpy as np

from chipwise.clib import layout
from chipwise.clib.library import library

NOTHING = layout.DROP_NOTHING
MAX_BINS = 4_000_000
ENTRIES = 8  # of the bins' lists, per triangle, before the bins become larger
RADIUS_SHARE = 6  # bins are not smaller than the tool's radius divided by this


class Mesh:
    """A model's triangles in bins for tools of about `radius` (mm)."""

    def __init__(self, model, radius):
        self.low, self._keep = model.low, [model.triangles, model.top]
        size = np.maximum(model.high[:2] - model.low[:2], 1e-3)
        bin_mm = max(
            math.sqrt(2.0 * size[0] * size[1] / len(model.triangles)),
            radius / RADIUS_SHARE,
            math.sqrt(size[0] * size[1] / MAX_BINS),
            float(size.max()) / MAX_BINS,
        )
        self._c = layout.DropMesh(
            n=len(model.triangles), triangle=model.triangles.ctypes.data, top=model.top.ctypes.data
        )
        while True:
            self._c.bin = bin_mm
            self._c.nx, self._c.ny = (int(v // bin_mm) + 1 for v in size)
            entries = library().chip_drop_entries(C.byref(self._c))
            if entries <= ENTRIES * len(model.triangles) + 1000 or self._c.nx * self._c.ny == 1:
                break
            bin_mm *= 2.0
        self._fill(self._c.nx * self._c.ny, entries)

    def _fill(self, bins, entries):
        for name, array in (
            ("first", np.zeros(bins + 1, np.int32)),
            ("member", np.zeros(entries, np.int32)),
            ("bin_top", np.zeros(bins, np.float32)),
            ("seen", np.zeros(self._c.n, np.uint32)),
        ):
            setattr(self._c, name, array.ctypes.data)
            self._keep.append(array)
        library().chip_drop_fill(C.byref(self._c))

    def heights(self, tool, xy, floor):
        """The lowest tip at each of xy (n, 2), floor where nothing is met -> (n,).  tool: layout.DropTool."""
        xy = np.ascontiguousarray(np.asarray(xy, np.float64) - self.low[:2])
        z = np.full(len(xy), floor - self.low[2])
        library().chip_drop_points(C.byref(self._c), C.byref(tool), len(xy), xy.ctypes.data, z.ctypes.data)
        return z + self.low[2]

    def excess(self, tool, start, end, least):
        """How far the lowest tip rises above each of n segments, start (n, 3) to end (n, 3) -> ((n,) mm, (n,) share of
        the segment).  Only more than `least` is looked for; less reads as `least`."""
        start, end = (np.ascontiguousarray(np.asarray(v, np.float64).reshape(-1, 3) - self.low) for v in (start, end))
        found, share = np.full(len(start), float(least)), np.empty(len(start))
        library().chip_drop_excess(
            C.byref(self._c),
            C.byref(tool),
            len(start),
            start.ctypes.data,
            end.ctypes.data,
            found.ctypes.data,
            share.ctypes.data,
        )
        return found, share


def drop_tool(shape, allowance=0.0):
    """layout.DropTool of a check.sweep.Shape, grown all over by `allowance` (mm): an offset tool, whose tip is that
    much lower."""
    return layout.DropTool(
        shape.diameter / 2.0 + allowance,
        min(shape.corner_radius, shape.diameter / 2.0) + allowance,
        math.radians(shape.tip_angle) / 2.0,
    )


class Probe:
    """Tool and holder over a model: what the tip may reach, not below `floor`.

    mesh       Mesh
    shape      check.sweep.Shape
    allowance  mm, left on the model all over
    floor      mm; the tip goes no lower
    """

    def __init__(self, mesh, shape, allowance=0.0, floor=-1e6):
        self._mesh, self.floor = mesh, floor
        self._parts = [(drop_tool(shape, allowance), allowance)]  # the tool, and how far its tip is above the part's
        self.radius = shape.diameter / 2.0
        if shape.holder_diameter > shape.diameter and shape.stick_out > 0.0:
            self._parts.append(
                (layout.DropTool(shape.holder_diameter / 2.0 + allowance, allowance, 0.0), allowance - shape.stick_out)
            )

    @property
    def has_holder(self):
        return len(self._parts) > 1

    def heights(self, xy):
        """(n, 2) -> (n,): the lowest tip."""
        tool, *holder = (self._mesh.heights(part, xy, self.floor - up) + up for part, up in self._parts)
        return np.maximum(tool, holder[0]) if holder else tool

    def raised(self, xy):
        """(n, 2) -> (n,): how far the holder keeps the tool above the model."""
        tool, *holder = (self._mesh.heights(part, xy, self.floor - up) + up for part, up in self._parts)
        return np.maximum(holder[0] - tool, 0.0) if holder else np.zeros(len(tool))

    def excess(self, start, end, least):
        """As Mesh.excess, of tool and holder; the floor counts as a part of the model."""
        start, end = np.asarray(start, np.float64).reshape(-1, 3), np.asarray(end, np.float64).reshape(-1, 3)
        lower = np.minimum(start[:, 2], end[:, 2])
        found, share = np.maximum(least, self.floor - lower), np.where(start[:, 2] <= end[:, 2], 0.0, 1.0)
        for part, up in self._parts:
            rise, at = self._mesh.excess(part, start - (0.0, 0.0, up), end - (0.0, 0.0, up), least)
            found, share = np.where(rise > found, rise, found), np.where(rise > found, at, share)
        return found, share
