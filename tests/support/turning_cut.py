# SPDX-License-Identifier: GPL-2.0-or-later
"""Which feed of a turning program cuts: the half section as cells, which a tool takes away where it really is.

Called by tests/turning and bench/bench_turning.py.  turning_oracle.py keeps heights, where a tool at the foot of a wall
has taken all that is above it, too: it sees no cut where a tool climbs along a face and cuts all of its length.  Here
the insert is nose and wedge between its edges.  What it takes is counted in turning_cut.c.
"""

import ctypes as C
import math
from functools import lru_cache

import numpy as np

from support import ROOT
from support.turning_oracle import CENTRE, moves

LIBRARY = ROOT / "build" / "tests" / "support" / "turning_cut.so"
CELL = 0.025  # mm
REACH = 4.0  # mm of the edges that count: more than a depth of cut
THIN = 2  # cells: a feed that takes less on its length is in the air, rounding to cells included


class Section:
    """Cells of the half section: z from z0, x from the axis; True is material."""

    def __init__(self, blank, cell=CELL):
        self.cell, radius, self.z0, z1 = cell, blank[0], blank[1] - 2.0, blank[2] + 2.0
        self.cells = np.zeros((int(radius / cell) + 8, int((z1 - self.z0) / cell) + 1), dtype=bool)
        self.cells[
            : int(round(radius / cell)),
            int(round((blank[1] - self.z0) / cell)) : int(round((blank[2] - self.z0) / cell)),
        ] = True
        self.masks, self.extents = {}, {}

    def cut(self, number, tool, z, x):
        """Area (mm2) that the tool takes with its controlled point at (z, x)."""
        if number not in self.masks:
            self.masks[number] = _mask(tool, self.cell)
            self.extents[number] = _extent(self.masks[number][1])
        origin, whole = self.masks[number]
        r = 0.0 if tool.point else tool.d / 2
        dx, dz = (0, 0) if tool.point else CENTRE[tool.q]
        k, i = (
            int(round((x + dx * r) / self.cell)) - origin[0],
            int(round((z + dz * r - self.z0) / self.cell)) - origin[1],
        )
        taken = _library().turning_cut(
            C.byref(Cells.of(self.cells)), C.byref(Cells.of(whole)), self.extents[number].ctypes.data, k, i
        )
        return float(taken) * self.cell * self.cell


class Cells(C.Structure):
    """struct cells of turning_cut.c."""

    _fields_ = [("at", C.c_void_p), ("rows", C.c_long), ("columns", C.c_long)]

    @classmethod
    def of(cls, cells):
        assert cells.flags.c_contiguous and cells.dtype == bool
        return cls(cells.ctypes.data, *cells.shape)


@lru_cache(maxsize=None)
def _library():
    found = C.CDLL(str(LIBRARY))
    found.turning_cut.argtypes, found.turning_cut.restype = (
        [C.c_void_p, C.c_void_p, C.c_void_p, C.c_long, C.c_long],
        C.c_long,
    )
    return found


def _extent(cells):
    """(rows, 2): first and last + 1 of the columns in each row that has any."""
    first, last = cells.argmax(axis=1), cells.shape[1] - cells[:, ::-1].argmax(axis=1)
    return np.ascontiguousarray(np.where(cells.any(axis=1)[:, None], np.column_stack((first, last)), 0), dtype=np.int64)


def _mask(tool, cell):
    """((row, column) of the nose's centre, cells of the tool)."""
    wide = max(REACH, tool.d / 2 + 0.2) if tool.point else REACH
    n = int(wide / cell)
    far = 4 * n if tool.point else n
    u, v = np.meshgrid((np.arange(-n, far) + 0.5) * cell, (np.arange(-n, n) + 0.5) * cell)  # z to the right, x upwards
    if tool.point:
        rise = math.tan(math.radians(tool.point) / 2)
        return (n, n), (v >= -cell) & (v <= tool.d / 2) & (u >= np.abs(v) / rise)
    low, high = sorted(a % 360 for a in (tool.i, tool.j))
    angle = np.degrees(np.arctan2(v, u)) % 360
    edges = [(math.cos(math.radians(a)), math.sin(math.radians(a))) for a in (low, high)]
    nearest = [np.where(u * c + v * s > 0, np.abs(v * c - u * s), np.hypot(u, v)) for c, s in edges]
    return (n, n), ((angle >= low) & (angle <= high)) | (np.minimum(*nearest) <= tool.d / 2)


def lengths(text, unit, blank, tools, cell=CELL):
    """{"feed", "air": feed that cuts nothing, "rapid": rapids that cut} of a program, mm; (tool number, "feed" or
    "air"): those of a tool."""
    section, found = Section(blank, cell), {"feed": 0.0, "air": 0.0, "rapid": 0.0}
    for number, kind, points in moves(text, unit):
        step = math.dist(points[0], points[1])
        for z, x in points[1:]:
            cuts = section.cut(number, tools[number], z, x) >= THIN * cell * max(step, cell)
            names = ["feed"] + ["air"] * (not cuts) if kind == "feed" else ["rapid"] * (kind == "rapid" and cuts)
            for name in names:
                found[name] += step
                found[number, name] = found.get((number, name), 0.0) + step
    return found
