# SPDX-License-Identifier: GPL-2.0-or-later
"""Which feed of a turning program cuts: the half section as cells, which a tool takes away where it really is.

Called by tests/turning and bench/bench_turning.py.  turning_oracle.py keeps heights, where a tool at the foot of a wall has taken all that is
above it, too: it sees no cut where a tool climbs along a face and cuts all of its length.  Here the insert is nose and wedge between its edges.
"""
import math

import numpy as np

from support.turning_oracle import CENTRE, moves

CELL = 0.025        # mm
REACH = 4.0         # mm of the edges that count: more than a depth of cut
THIN = 2            # cells: a feed that takes less on its length is in the air, rounding to cells included


class Section:
    """Cells of the half section: z from z0, x from the axis; True is material."""

    def __init__(self, blank, cell=CELL):
        self.cell, radius, self.z0, z1 = cell, blank[0], blank[1] - 2.0, blank[2] + 2.0
        self.cells = np.zeros((int(radius / cell) + 8, int((z1 - self.z0) / cell) + 1), dtype=bool)
        self.cells[:int(round(radius / cell)), int(round((blank[1] - self.z0) / cell)):int(round((blank[2] - self.z0) / cell))] = True
        self.masks = {}

    def cut(self, number, tool, z, x):
        """Area (mm2) that the tool takes with its controlled point at (z, x)."""
        if number not in self.masks:
            self.masks[number] = _mask(tool, self.cell)
        origin, whole = self.masks[number]
        r = 0.0 if tool.point else tool.d / 2
        dx, dz = (0, 0) if tool.point else CENTRE[tool.q]
        k, i = int(round((x + dx * r) / self.cell)) - origin[0], int(round((z + dz * r - self.z0) / self.cell)) - origin[1]
        a, b = max(k, 0), max(i, 0)
        here = self.cells[a:max(k + whole.shape[0], 0), b:max(i + whole.shape[1], 0)]
        if not here.any():
            return 0.0
        there = slice(a - k, a - k + here.shape[0]), slice(b - i, b - i + here.shape[1])
        taken = here & whole[there]
        here &= ~taken
        return float(np.count_nonzero(taken)) * self.cell * self.cell


def _mask(tool, cell):
    """((row, column) of the nose's centre, cells of the tool)."""
    wide = max(REACH, tool.d / 2 + 0.2) if tool.point else REACH
    n = int(wide / cell)
    far = 4 * n if tool.point else n
    u, v = np.meshgrid((np.arange(-n, far) + 0.5) * cell, (np.arange(-n, n) + 0.5) * cell)       # z to the right, x upwards
    if tool.point:
        rise = math.tan(math.radians(tool.point) / 2)
        return (n, n), (v >= -cell) & (v <= tool.d / 2) & (u >= np.abs(v) / rise)
    low, high = sorted(a % 360 for a in (tool.i, tool.j))
    angle = np.degrees(np.arctan2(v, u)) % 360
    edges = [(math.cos(math.radians(a)), math.sin(math.radians(a))) for a in (low, high)]
    nearest = [np.where(u * c + v * s > 0, np.abs(v * c - u * s), np.hypot(u, v)) for c, s in edges]
    return (n, n), ((angle >= low) & (angle <= high)) | (np.minimum(*nearest) <= tool.d / 2)


def lengths(text, unit, blank, tools, cell=CELL):
    """{"feed", "air": feed that cuts nothing, "rapid": rapids that cut} of a program, mm; (tool number, "feed" or "air"): those of a tool."""
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
