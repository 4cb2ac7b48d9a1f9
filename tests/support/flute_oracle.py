# SPDX-License-Identifier: GPL-2.0-or-later
"""How high stock stands above the tip while a cycle cuts, written apart from the package: numpy columns, no levels.

The stock is a field of columns of one height.  The tool is a disc that goes along the elements (hole_oracle.Element) in
small steps; it takes every column under it down to its tip.  An element is judged in the stock that was there before it
began.  Columns in the outermost cell of the disc are cut but do not count: two passes along one path are sampled at
other places, and leave less than that between them.
"""

import math

import numpy as np

RIM_CELLS = 1.0


def points_along(element, spacing):
    """(n, 3) positions from start to end."""
    a, b = np.array(element.a, float), np.array(element.b, float)
    if element.kind == "arc":
        t0, turn = element.sweep
        count = max(2, math.ceil(max(abs(turn) * element.radius, abs(b[2] - a[2])) / spacing) + 1)
        t = np.linspace(0, 1, count)
        angle = t0 + turn * t
        x = element.centre[0] + element.radius * np.cos(angle)
        y = element.centre[1] + element.radius * np.sin(angle)
        return np.stack((x, y, a[2] + (b[2] - a[2]) * t), axis=1)
    count = max(2, math.ceil(math.dist(a, b) / spacing) + 1)
    return a + (b - a) * np.linspace(0, 1, count)[:, None]


class Columns:
    """The stock under a cycle."""

    def __init__(self, elements, top, tool_radius, cell):
        """top: height of the stock everywhere, mm."""
        ends = np.array([p for e in elements for p in (e.a, e.b)])
        reach = max([e.radius * 2 for e in elements if e.kind == "arc"], default=0.0) + tool_radius + cell
        self.cell, self.reach = cell, tool_radius / cell
        self.low = ends[:, :2].min(axis=0) - reach
        size = np.ceil((ends[:, :2].max(axis=0) + reach - self.low) / cell).astype(int) + 1
        self.height = np.full(tuple(size), float(top))

    def under(self, point):
        """The columns under the tool at a point (x, y, z): a view of them, and the distance of each from its axis,
        cells."""
        here = (np.asarray(point[:2]) - self.low) / self.cell
        reach = self.reach
        first, last = np.ceil(here - reach).astype(int), np.floor(here + reach).astype(int) + 1
        field = self.height[first[0] : last[0], first[1] : last[1]]
        across = np.hypot(
            *(np.arange(first[k], last[k]).reshape(-1 if k == 0 else 1, 1 if k == 0 else -1) - here[k] for k in (0, 1))
        )
        return field, across

    def contact(self, point):
        """How high stock under the tool stands above its tip, mm."""
        field, across = self.under(point)
        return float(np.max(field[across <= self.reach - RIM_CELLS] - point[2], initial=0.0))

    def cut(self, point):
        field, across = self.under(point)
        inside = across <= self.reach
        field[inside] = np.minimum(field[inside], point[2])


def deepest(elements, top, tool_radius, cell):
    """(highest stock above the tip in a move across, Z of the lowest column), mm; traverses cut nothing and meet
    nothing."""
    columns, worst = Columns(elements, top, tool_radius, cell), -math.inf
    for element in elements:
        if element.kind == "rapid":
            continue
        across = element.kind == "arc" or math.dist(element.a[:2], element.b[:2]) > 1e-9
        points = points_along(element, cell)
        if across:
            worst = max(worst, *map(columns.contact, points))
        for point in points:
            columns.cut(point)
    return worst, float(columns.height.min())
