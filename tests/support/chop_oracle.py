# SPDX-License-Identifier: GPL-2.0-or-later
"""An oracle for the chop of contours, written apart from the package: nothing of it is imported.

It takes the finish shape as loops of plain tuples (contour_oracle.py), boundary first, then islands, and what the tool
does as motions in the same tuples, in their order, and judges:
  outside()        how far a kerf reaches beyond the finish shape, by exact distances
  final_pieces()   the loose pieces at the end: shapely, finer than the package draws, kerfs with their round ends
  Stage            stock as cells, flood fill: the pieces that are loose at any time
Each has been seen to fail: tests/oracles/test_chop_oracle.py feeds sabotaged motions.
"""

import math

import numpy as np
from shapely.geometry import LineString, Polygon
from shapely.ops import unary_union

from support.contour_oracle import distance, length, nearest, point, radius_of, samples, winding
from support.hole_oracle import enclosing_diameter, label

# Chords this far off the arcs (mm), and corners to a quarter of a kerf's round end: finer than the package's.
SAGITTA, QUARTER = 2e-4, 48

# What is thinner than this is a chip, however long (docs/design/chop.md). mm
HAIR = 0.01

# Cells (mm) of the flood fill. A bridge thinner than a cell may not be seen and none thicker than 1.42 cells is missed:
# with 0.066 mm every bridge the package relies on, 0.1 mm and more, is seen.
CELL = 0.066


def tuples(elements):
    """Motions of hole_oracle.walk that cut in the plane -> plain tuples."""
    made = []
    for e in elements:
        if e.kind == "rapid" or math.dist(e.a[:2], e.b[:2]) < 1e-9 and e.kind != "arc":
            continue
        made.append(("A", *e.a[:2], *e.b[:2], *e.centre, e.sweep[1]) if e.kind == "arc" else ("L", *e.a[:2], *e.b[:2]))
    return made


def drawn(loop, sagitta=SAGITTA):
    """Points (n, 2) along a loop of tuples, arcs in chords."""
    found = []
    for el in loop:
        count = 1
        if el[0] == "A":
            step = 2 * math.acos(max(1 - sagitta / radius_of(el), 0.5))
            count = max(1, math.ceil(abs(el[7]) / step))
        found.append(point(el, np.arange(count) / count))
    found.append(point(loop[-1], np.array([1.0])))
    return np.concatenate(found)


def outside(finish, motions, tool_radius, step=0.05):
    """How far (mm) a kerf reaches beyond the finish shape; below 0 it stays inside by that much."""
    p = samples(motions, step)
    every = [el for loop in finish for el in loop]
    gap = nearest(every, p)
    turns = [winding(loop, p) != 0 for loop in finish]
    inside = turns[0] & ~np.logical_or.reduce(turns[1:] + [np.zeros(len(p), bool)])
    return float(np.max(np.where(inside, tool_radius - gap, tool_radius + gap)))


def final_pieces(finish, motions, tool_radius):
    """Sizes (mm) of what is loose when all motions are cut: what is left of the shape and does not touch its edge."""
    shape = Polygon(drawn(finish[0]), [drawn(loop) for loop in finish[1:]])
    if not shape.is_valid:
        shape = shape.buffer(0)
    kerfs = [LineString(drawn([el])).buffer(tool_radius, QUARTER) for el in motions]
    left = shape.difference(unary_union(kerfs))
    edge = shape.boundary
    sizes = []
    for part in getattr(left, "geoms", [left]):
        if part.area > 1e-6 and part.distance(edge) > 2e-3 and not part.buffer(-HAIR / 2).is_empty:
            sizes.append(enclosing_diameter(np.array(part.convex_hull.exterior.coords)))
    return sizes


class Stage:
    """Stock in and around the shape as cells: cut it motion by motion, ask what is loose."""

    def __init__(self, finish, tool_radius, cell=CELL):
        edge = np.concatenate([drawn(loop, 1e-2) for loop in finish])
        low, high = edge.min(axis=0) - 3 * cell, edge.max(axis=0) + 3 * cell
        x, y = (np.arange(low[k], high[k] + cell, cell) for k in (0, 1))
        self.x, self.y = np.meshgrid(x, y)
        self.radius, self.cell = tool_radius, cell
        self.solid = np.ones(self.x.shape, bool)
        self.held = np.zeros(self.x.shape, bool)
        self.held[[0, -1], :] = self.held[:, [0, -1]] = True
        for loop in finish[1:]:
            part = self._about(drawn(loop, 1e-2), 0.0)
            p = np.stack((self.x[part].ravel(), self.y[part].ravel()), axis=1)
            self.held[part] |= (winding(loop, p) != 0).reshape(self.x[part].shape)

    def _about(self, points, more):
        (x0, y0), (x1, y1) = points.min(axis=0) - more, points.max(axis=0) + more
        columns = np.flatnonzero((self.x[0] >= x0) & (self.x[0] <= x1))
        rows = np.flatnonzero((self.y[:, 0] >= y0) & (self.y[:, 0] <= y1))
        return (
            np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
            if len(rows) and len(columns)
            else np.s_[0:0, 0:0]
        )

    def cut(self, el):
        """Remove what the tool meets on a motion."""
        part = self._about(drawn([el], 1e-2), self.radius + 0.02)
        p = np.stack((self.x[part].ravel(), self.y[part].ravel()), axis=1)
        self.solid[part] &= (distance(el, p) > self.radius).reshape(self.x[part].shape)

    def loose(self, later=None):
        """Sizes (mm, between cell centres) of the loose pieces; of each only what `later`, a mask, leaves of it."""
        labels, count = label(self.solid)
        firm = np.zeros(count + 1, bool)
        firm[labels[self.held & self.solid]] = True
        firm[0] = True
        mask = ~firm[labels]
        if later is not None:
            mask &= later
        rows, columns = np.nonzero(mask)
        names = labels[rows, columns]
        sizes = []
        for name in np.unique(names):
            mine = names == name
            r, c = rows[mine], columns[mine]
            first = np.flatnonzero(np.concatenate(([True], r[1:] != r[:-1])))
            last = np.append(first[1:], len(r)) - 1
            ends = np.concatenate((first, last))
            sizes.append(enclosing_diameter(np.stack((self.x[0, c[ends]], self.y[r[ends], 0]), axis=1)))
        return sizes


def cut_up(loop, step):
    """Motions in parts no longer than `step`, mm."""
    made = []
    for el in loop:
        n = max(1, math.ceil(length(el) / step))
        p = point(el, np.linspace(0.0, 1.0, n + 1))
        made += [(el[0], *a, *b, *el[5:7], *(w / n for w in el[7:])) for a, b in zip(p, p[1:])]
    return made


def largest_loose_ever(finish, lines, paths, tool_radius, cell=CELL):
    """Size of the largest piece that is loose after any line, or anywhere on the way along the paths.

    lines   motions of each line, a list of lists; paths: closed loops in the order they are cut
    Along a path a piece counts without what the tool takes off it in the next 2.5 radii of travel: where the tool
    breaks through to the kerf ahead, a spur is still on the piece that the tool is just removing.
    """
    stage, worst = Stage(finish, tool_radius, cell), 0.0
    for line in lines:
        for el in line:
            stage.cut(el)
        worst = max([worst] + stage.loose())
    ahead = Stage(finish, tool_radius, cell)
    ahead.solid = stage.solid.copy()
    for loop in paths:
        steps = cut_up(loop, tool_radius / 2)
        for k in range(len(steps) + 5):
            if k < len(steps):
                ahead.cut(steps[k])
            if k >= 5:
                stage.cut(steps[k - 5])
                if k % 3 == 0:
                    worst = max([worst] + stage.loose(ahead.solid))
    return worst


def travel(path, start, end, entry_of, exit_of):
    """Length (mm) of the rapid moves that directed segments need, from start over all of them to end."""
    length, here = 0.0, start
    for segment in path:
        length += math.dist(here, entry_of(segment))
        here = exit_of(segment)
    return length + math.dist(here, end)
