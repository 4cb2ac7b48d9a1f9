# SPDX-License-Identifier: GPL-2.0-or-later
"""An oracle for G12/G13, written apart from the package: numpy only, no shapely, none of the package's geometry.

It takes elements - what the tool did, from the moves or from LinuxCNC's canonical calls - and judges them:
  outside()       how far a kerf reaches outside the hole
  wall_gap()      how far any point of the wall is from being touched
  loose_pieces()  raster, flood fill: what is no longer joined to the stock, and the circle each piece fits in
  grid_pieces()   the same without a raster, exact, for kerfs that are full chords
  rapid_faults()  rapids below the clearance plane that are not straight up or down
Each has been seen to fail: tests/cycles/test_hole.py feeds sabotaged traces.
"""

import math
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Element:
    """One motion. kind: rapid, feed or arc; a, b: (x, y, z) from and to, mm; arcs: centre and sense, one turn."""

    kind: str
    a: tuple
    b: tuple
    centre: tuple = None
    ccw: bool = True

    @property
    def sweep(self):
        """(start angle, signed angle), rad; equal ends: a full turn."""
        t0 = math.atan2(self.a[1] - self.centre[1], self.a[0] - self.centre[0])
        t1 = math.atan2(self.b[1] - self.centre[1], self.b[0] - self.centre[0])
        turn = (t1 - t0) % (2 * math.pi) if self.ccw else -((t0 - t1) % (2 * math.pi))
        if math.dist(self.a[:2], self.b[:2]) < 1e-5:
            turn = 2 * math.pi if self.ccw else -2 * math.pi
        return t0, turn

    @property
    def radius(self):
        return math.dist(self.a[:2], self.centre)


def walk(moves, start):
    """Moves of a cycle -> elements."""
    here, elements = tuple(start), []
    for move in moves:
        there = tuple(old if new is None else new for old, new in zip(here, (move.x, move.y, move.z)))
        kind = {"Rapid": "rapid", "Line": "feed", "Arc": "arc"}[type(move).__name__]
        extra = {"centre": (move.cx, move.cy), "ccw": move.ccw} if kind == "arc" else {}
        elements.append(Element(kind, here, there, **extra))
        here = there
    return elements


def cuts(elements, at_depth=None):
    """Feed motions; with at_depth only those that end at that depth or below (mm)."""
    return [e for e in elements if e.kind != "rapid" and (at_depth is None or e.b[2] <= at_depth + 1e-4)]


def distance(element, x, y):
    """Distance (mm) of points, arrays x and y, from an element's path in the plane."""
    (ax, ay), (bx, by) = element.a[:2], element.b[:2]
    if element.kind == "arc":
        cx, cy = element.centre
        t0, turn = element.sweep
        angle = np.arctan2(y - cy, x - cx)
        along = np.mod(angle - t0, 2 * np.pi) if turn > 0 else np.mod(t0 - angle, 2 * np.pi)
        ends = np.minimum(np.hypot(x - ax, y - ay), np.hypot(x - bx, y - by))
        return np.where(along <= abs(turn) + 1e-9, np.abs(np.hypot(x - cx, y - cy) - element.radius), ends)
    dx, dy = bx - ax, by - ay
    length2 = dx * dx + dy * dy
    if length2 == 0:
        return np.hypot(x - ax, y - ay)
    t = np.clip(((x - ax) * dx + (y - ay) * dy) / length2, 0, 1)
    return np.hypot(x - ax - t * dx, y - ay - t * dy)


def points_on(element, count=721):
    """Points along an element, (n, 2)."""
    if element.kind != "arc":
        return np.array([element.a[:2], element.b[:2]])
    t0, turn = element.sweep
    t = t0 + turn * np.linspace(0, 1, count)
    return np.column_stack(
        [element.centre[0] + element.radius * np.cos(t), element.centre[1] + element.radius * np.sin(t)]
    )


def outside(elements, centre, radius, tool_radius):
    """How far (mm) any kerf reaches outside the hole; negative: stays inside by that much."""
    reach = [np.hypot(*(points_on(e) - centre).T).max() for e in cuts(elements)]
    return max(reach) + tool_radius - radius


def wall_gap(elements, centre, radius, tool_radius, depth, count=720):
    """Largest distance (mm) between a point of the wall and the kerf at final depth; 0 or less: all of it is cut."""
    t = np.linspace(0, 2 * np.pi, count, endpoint=False)
    x, y = centre[0] + radius * np.cos(t), centre[1] + radius * np.sin(t)
    nearest = np.full(count, np.inf)
    for element in cuts(elements, depth):
        nearest = np.minimum(nearest, distance(element, x, y))
    return float((nearest - tool_radius).max())


def enclosing_diameter(points):
    """Diameter of the smallest circle around (n, 2) points: Elzinga and Hearn's dual climb, exact.

    Another algorithm than the package's (Welzl): grow from two points, swap in the farthest one outside.
    """
    points = np.unique(np.asarray(points, float), axis=0)
    if len(points) < 2:
        return 0.0
    support = [points[0], points[np.argmax(np.hypot(*(points - points[0]).T))]]
    for _ in range(1000):
        centre, r = _circle_of(support)
        away = np.hypot(*(points - centre).T)
        worst = int(np.argmax(away))
        if away[worst] <= r + 1e-9 * max(1.0, r):
            break
        trial = support + [points[worst]]
        options = []
        for keep in _subsets(trial):
            c, rr = _circle_of(keep)
            if all(np.hypot(*(p - c)) <= rr + 1e-9 * max(1.0, rr) for p in trial):
                options.append((rr, keep))
        support = min(options, key=lambda item: item[0])[1]
    return 2 * r


def _subsets(points):
    """All subsets of two or three."""
    n = len(points)
    for i in range(n):
        for j in range(i):
            yield [points[i], points[j]]
            for k in range(j):
                yield [points[i], points[j], points[k]]


def _circle_of(points):
    """(centre, radius) on two points as diameter or through three."""
    if len(points) == 2:
        return (points[0] + points[1]) / 2, float(np.hypot(*(points[0] - points[1]))) / 2
    a, b, c = points
    m = 2 * np.array([b - a, c - a])
    if abs(np.linalg.det(m)) < 1e-14:
        return np.zeros(2), float("inf")
    centre = np.linalg.solve(m, [b @ b - a @ a, c @ c - a @ a])
    return centre, float(np.hypot(*(a - centre)))


def label(mask):
    """4-connected components of a boolean array by runs and union-find -> (labels, count); 0 is background."""
    parent = [0]

    def find(i):
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    labels = np.zeros(mask.shape, int)
    above = []
    for row in range(mask.shape[0]):
        edges = np.flatnonzero(np.diff(np.concatenate(([0], mask[row].view(np.int8), [0]))))
        runs, k = [], 0
        for start, stop in zip(edges[::2], edges[1::2]):
            mine = 0
            while k < len(above) and above[k][1] <= start:
                k += 1
            j = k
            while j < len(above) and above[j][0] < stop:
                other = find(above[j][2])
                if mine and other != mine:
                    parent[max(mine, other)] = min(mine, other)
                mine = min(mine, other) if mine else other
                j += 1
            if not mine:
                mine = len(parent)
                parent.append(mine)
            labels[row, start:stop] = mine
            runs.append((start, stop, mine))
        above = runs
    roots = np.array([find(i) for i in range(len(parent))])
    names, inverse = np.unique(roots, return_inverse=True)
    return inverse[labels], len(names) - 1


class Raster:
    """Stock around a hole as cells; cut it, then look at what is loose."""

    def __init__(self, centre, radius, tool_radius, cell):
        self.cell, self.tool_radius = cell, tool_radius
        n = int(math.ceil((radius + 3 * cell) / cell))
        axis = np.arange(-n, n + 1) * cell
        self.x, self.y = np.meshgrid(centre[0] + axis, centre[1] + axis)
        self.solid = np.ones(self.x.shape, bool)

    def cut(self, element):
        """Remove what the tool meets on an element."""
        pts = points_on(element)
        grow = self.tool_radius + self.cell
        (x0, y0), (x1, y1) = pts.min(axis=0) - grow, pts.max(axis=0) + grow
        columns = np.flatnonzero((self.x[0] >= x0) & (self.x[0] <= x1))
        rows = np.flatnonzero((self.y[:, 0] >= y0) & (self.y[:, 0] <= y1))
        if len(columns) and len(rows):
            part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
            self.solid[part] &= distance(element, self.x[part], self.y[part]) > self.tool_radius

    def loose(self):
        """Diameters (mm, cell centres) of the pieces that touch no edge of the raster."""
        labels, _ = label(self.solid)
        joined = set(np.unique(np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])))
        flat = labels.ravel()
        order = np.argsort(flat, kind="stable")
        bounds = np.flatnonzero(np.diff(flat[order])) + 1
        sizes = []
        for group in np.split(order, bounds):
            if flat[group[0]] == 0 or flat[group[0]] in joined:
                continue
            rows, columns = np.divmod(group, labels.shape[1])
            ends = [group[0]]
            firsts = np.flatnonzero(np.diff(rows)) + 1
            ends = np.concatenate([group[np.concatenate(([0], firsts))], group[np.concatenate((firsts - 1, [-1]))]])
            sizes.append(enclosing_diameter(np.column_stack([self.x.ravel()[ends], self.y.ravel()[ends]])))
        return sizes


def loose_pieces(elements, centre, radius, tool_radius, depth, cell):
    """Sizes (mm) of the loose pieces after everything is cut; each is up to about 1.4 cells too small."""
    raster = Raster(centre, radius, tool_radius, cell)
    for element in cuts(elements, depth):
        raster.cut(element)
    return raster.loose()


def largest_loose_ever(elements, centre, radius, tool_radius, depth, cell, arc_parts=12):
    """Size of the largest piece that is loose at any time: looked at after each line and each part of an arc."""
    raster, worst = Raster(centre, radius, tool_radius, cell), 0.0
    for element in cuts(elements, depth):
        for part in split(element, arc_parts):
            raster.cut(part)
            worst = max([worst] + raster.loose())
    return worst


def split(element, parts):
    """An arc in equal parts; a line as it is."""
    if element.kind != "arc":
        return [element]
    t0, turn = element.sweep
    z = element.b[2]
    ends = [
        (
            element.centre[0] + element.radius * math.cos(t0 + turn * k / parts),
            element.centre[1] + element.radius * math.sin(t0 + turn * k / parts),
            z,
        )
        for k in range(parts + 1)
    ]
    return [replace(element, a=p, b=q) for p, q in zip(ends, ends[1:])]


def grid_pieces(elements, centre, radius, tool_radius, depth):
    """Exact sizes (mm) of the pieces left by full chords and the circle: cells cut off by the slug's circle."""
    lines = [e for e in cuts(elements, depth) if e.kind == "feed" and math.dist(e.a[:2], e.b[:2]) > 1e-6]
    slug = radius - 2 * tool_radius
    if slug <= 0:
        return []
    gaps = []
    for axis in (0, 1):
        at = sorted({round(e.a[axis] - centre[axis], 6) for e in lines if abs(e.a[axis] - e.b[axis]) < 1e-6})
        low, spans = -slug, []
        for offset in at:
            if offset - tool_radius > low:
                spans.append((low, offset - tool_radius))
            low = max(low, offset + tool_radius)
        if low < slug:
            spans.append((low, slug))
        gaps.append(spans)
    return [
        enclosing_diameter(shape) for x in gaps[0] for y in gaps[1] if (shape := _cell_outline(x, y, slug)) is not None
    ]


def _cell_outline(x, y, radius):
    """Points that enclose (rectangle x by y) within a disc about 0: corners, crossings, and the arc every degree/4."""
    points = [(u, v) for u in x for v in y if math.hypot(u, v) <= radius]
    for u in x:
        if abs(u) < radius:
            v = math.sqrt(radius * radius - u * u)
            points += [(u, w) for w in (v, -v) if y[0] <= w <= y[1]]
    for v in y:
        if abs(v) < radius:
            u = math.sqrt(radius * radius - v * v)
            points += [(w, v) for w in (u, -u) if x[0] <= w <= x[1]]
    t = np.radians(np.arange(0, 360, 0.25))
    arc = radius * np.column_stack([np.cos(t), np.sin(t)])
    inside = (arc[:, 0] >= x[0]) & (arc[:, 0] <= x[1]) & (arc[:, 1] >= y[0]) & (arc[:, 1] <= y[1])
    points = np.array(points + [tuple(p) for p in arc[inside]]).reshape(-1, 2)
    return points if len(points) > 1 else None


def rapid_faults(elements, clearance):
    """Rapids that go sideways below the clearance plane, or down below it."""
    faults = []
    for e in elements:
        sideways = math.dist(e.a[:2], e.b[:2]) > 1e-6
        if e.kind == "rapid" and ((sideways and min(e.a[2], e.b[2]) < clearance - 1e-4) or (e.b[2] < clearance - 1e-4)):
            faults.append(e)
    return faults
