# SPDX-License-Identifier: GPL-2.0-or-later
"""An oracle for G79, written apart from the package: numpy only, none of the package's geometry.

It takes the parts of the loops as written and what the tool did, and knows a pocket only as a test: a place is free
where it is inside a boundary and outside its islands; the tool may be where it is free and far enough from every
loop.  No offset is computed.
  gouge()      how much nearer to a loop than allowed any cut comes, by exact distances along every move
  Stock        columns at random places all over the box, cut move by move; says which rapids met one, what stands at
               the end where the tool reaches, and the section area along the path
  walls()      places the tool touches a wall from: each must have been visited at final depth
  entries()    feeds that go down: none steeper than the ramp, but the plunges that were announced
Each has been seen to fail: tests/oracles/test_pocket_oracle.py feeds sabotaged moves.  Lengths mm.
"""

import math
from dataclasses import dataclass

import numpy as np

from support import contour_oracle as contour
from support import hole_oracle as trace

# How much of the path a verdict lets pass, mm: the target of 0.001 mm.
TOLERANCE = 1e-3


def shape_of(parts):
    """contour_oracle's tuples of LineElement and ArcElement."""
    found = []
    for part in parts:
        if not hasattr(part, "centre"):
            found.append(("L", *part.start, *part.end))
            continue
        a = math.atan2(part.start[1] - part.centre[1], part.start[0] - part.centre[0])
        b = math.atan2(part.end[1] - part.centre[1], part.end[0] - part.centre[0])
        sweep = (b - a) % (2 * math.pi) if part.ccw else -((a - b) % (2 * math.pi))
        if math.dist(part.start, part.end) < 1e-9:
            sweep = 2 * math.pi if part.ccw else -2 * math.pi
        found.append(("A", *part.start, *part.end, *part.centre, sweep))
    return found


def free(loops, p):
    """Which points (m, 2) lie in a pocket: inside a boundary and in no island that lies in it or crosses it."""
    within = [contour.winding(loop, p) != 0 for loop in loops]
    inside = np.zeros(len(p), bool)
    for boundary, islands in nesting(loops):
        here = within[boundary].copy()
        for island in islands:
            here &= ~within[island]
        inside |= here
    return inside


def nesting(loops):
    """[(number of a boundary, [numbers of its islands])]: by points in and about the loops, half of them as good as on
    an edge."""
    if len(loops) == 1:
        return [(0, [])]
    rng, edge = np.random.default_rng(0), np.concatenate([contour.samples(loop, 0.5, 3) for loop in loops])
    low, high = edge.min(axis=0), edge.max(axis=0)
    p = np.concatenate((low + (high - low) * rng.random((3000, 2)), edge + rng.uniform(-0.05, 0.05, edge.shape)))
    within = np.array([contour.winding(loop, p) != 0 for loop in loops])
    size, shared = within.sum(axis=1), (within[:, None] & within[None]).sum(axis=2)
    inside = (shared == size[:, None]) & (size[:, None] < size[None])  # row in column
    parent = [min(np.flatnonzero(inside[k]), key=lambda m: size[m], default=None) for k in range(len(loops))]
    crossed = (shared > 0) & ~inside & ~inside.T & ~np.eye(len(loops), dtype=bool)
    island = {}
    for k in sorted(range(len(loops)), key=lambda k: (inside[k].sum(), k)):
        island[k] = (
            parent[k] is not None
            and not island[parent[k]]
            or any(island.get(m) is False for m in np.flatnonzero(crossed[k]))
        )
    return [
        (b, [k for k in island if island[k] and (parent[k] == b or crossed[b, k])]) for b in island if not island[b]
    ]


def clearance(loops, p):
    """Distance (m,) of points to the nearest loop."""
    return np.min([contour.nearest(loop, p) for loop in loops], axis=0)


@dataclass
class Case:
    """loops: shapes, sorted by nesting(); radius: tool; distance: radius + side allowance; floor: final depth."""

    loops: list
    radius: float
    distance: float
    floor: float
    top: float


def on_path(element, step):
    """Points (n, 3) along a move, at most `step` apart in the plane, ends included."""
    a, b = np.array(element.a, float), np.array(element.b, float)
    if element.kind != "arc":
        n = max(1, math.ceil(math.dist(a[:2], b[:2]) / step))
        return a + (b - a) * np.linspace(0, 1, n + 1)[:, None]
    start, turn = element.sweep
    n = max(4, math.ceil(element.radius * abs(turn) / step))
    t = np.linspace(0, 1, n + 1)
    return np.column_stack(
        (
            element.centre[0] + element.radius * np.cos(start + turn * t),
            element.centre[1] + element.radius * np.sin(start + turn * t),
            a[2] + (b[2] - a[2]) * t,
        )
    )


def gouge(case, moves, step=0.1):
    """How much (mm) nearer to a loop than allowed, or how far into what is not free, any feed comes."""
    path = np.concatenate([on_path(e, step)[:, :2] for e in moves if e.kind != "rapid"])
    deep = float(np.max(case.distance - clearance(case.loops, path)))
    if deep < 0.5 * case.distance and not free(case.loops, path).all():
        return case.distance
    return deep


def centres(case, rng, count):
    """Places (m, 2) where the tool may stand: random ones, and those that touch a wall (second result)."""
    edge = np.concatenate([contour.samples(loop, 0.5, 3) for loop in case.loops])
    low, high = edge.min(axis=0), edge.max(axis=0)
    p = low + (high - low) * rng.random((count, 2))
    inner = p[(clearance(case.loops, p) >= case.distance) & free(case.loops, p)]
    beside = []
    for loop in case.loops:
        for el in loop:
            t = rng.random(max(3, int(contour.length(el) / 0.7)))
            at = contour.point(el, t)
            ahead = contour.point(el, np.minimum(t + 1e-6, 1.0)) - contour.point(el, np.maximum(t - 1e-6, 0.0))
            ahead /= np.hypot(*ahead.T)[:, None]
            normal = np.column_stack((-ahead[:, 1], ahead[:, 0])) * case.distance
            beside += [at + normal, at - normal]
            corner, angle = contour.point(el, [1.0]), rng.random((12, 1)) * 2 * math.pi
            beside.append(corner + case.distance * np.hstack((np.cos(angle), np.sin(angle))))
    beside = np.concatenate(beside)
    touch = beside[(clearance(case.loops, beside) >= case.distance - 1e-7) & free(case.loops, beside)]
    return inner, touch


class Stock:
    """Columns over the pocket and a margin, their tops at `top` until cut."""

    def __init__(self, case, rng, count=6000):
        inner, touch = centres(case, rng, count // 3)
        stand = np.concatenate((inner, touch))
        angle, out = rng.random(3 * len(stand)) * 2 * math.pi, np.sqrt(rng.random(3 * len(stand)))
        out[::3] = 1.0 - 1e-9  # on the very edge of the tool
        reach = np.repeat(stand, 3, axis=0) + case.radius * (out * np.array((np.cos(angle), np.sin(angle)))).T
        edge = np.concatenate([contour.samples(loop, 0.5, 3) for loop in case.loops])
        low, high = edge.min(axis=0) - case.radius, edge.max(axis=0) + case.radius
        rest = low + (high - low) * rng.random((count, 2))
        self.case, self.touch = case, touch
        self.point = np.concatenate((reach, rest))
        self.reached = np.arange(len(self.point)) < len(reach)  # the tool can get there
        self.height = np.full(len(self.point), case.top)
        self.area = float(np.prod(high - low)) / count  # mm2 of one column of `rest`

    def under(self, element, reach):
        """Indices of columns nearer than `reach` to a move in the plane."""
        box = on_path(element, 1.0)[:, :2]
        low, high = box.min(axis=0) - reach - 1.0, box.max(axis=0) + reach + 1.0
        near = np.flatnonzero(np.all((self.point >= low) & (self.point <= high), axis=1))
        return near[trace.distance(element, *self.point[near].T) <= reach]

    def run(self, moves):
        """Cuts all moves in order.  -> list of rapids that met stock, as (number of the move, mm too deep).  plunged:
        {number of a feed straight down: mm of stock that it met}."""
        met, self.plunged = [], {}
        for number, e in enumerate(moves):
            low = min(e.a[2], e.b[2])
            if low >= self.case.top - 1e-9:
                continue
            if e.kind == "rapid":
                hit = self.height[self.under(e, self.case.radius - TOLERANCE)]
                if len(hit) and hit.max() > low + 1e-6:
                    met.append((number, float(hit.max() - low)))
            elif abs(e.a[2] - e.b[2]) < 1e-9 or math.dist(e.a[:2], e.b[:2]) < 1e-9 and e.kind != "arc":
                if e.a[2] > e.b[2] + 1e-9:
                    hit = self.height[self.under(e, self.case.radius - TOLERANCE)]
                    self.plunged[number] = float(hit.max()) - low if len(hit) else 0.0
                under = self.under(e, self.case.radius + 1e-6)
                self.height[under] = np.minimum(self.height[under], low)
            else:
                self._slope(e)
        return met

    def _slope(self, e):
        """A move that goes down: in steps, each as high as its highest point."""
        path = on_path(e, 0.5)
        for a, b in zip(path[:-1], path[1:]):
            part = trace.Element("feed", tuple(a), tuple(b))
            under = self.under(part, self.case.radius - 0.05 * self.case.radius)
            self.height[under] = np.minimum(self.height[under], max(a[2], b[2]))

    def residue(self):
        """Highest stock (mm) above the floor where the tool reaches, and how many columns stand, and the first."""
        above = np.where(self.reached, self.height - self.case.floor, 0.0)
        bad = np.flatnonzero(above > TOLERANCE)
        return (float(above.max()) if len(above) else 0.0), len(bad), self.point[bad[:1]].tolist()


def walls(case, touch, moves):
    """Largest distance (mm) of a place that touches a wall from every cut at final depth."""
    if not len(touch):
        return 0.0
    gap = np.full(len(touch), np.inf)
    for e in trace.cuts(moves, case.floor):
        if abs(e.a[2] - e.b[2]) < 1e-6:
            np.minimum(gap, trace.distance(e, *touch.T), out=gap)
    return float(gap.max())


def entries(moves, angle, gap, plunges, plunged):
    """Faults of feeds that go down: steeper than `angle` (degrees), or straight down by more than `gap` (mm) of stock
    where no plunge was announced.  plunged: as in Stock.run()."""
    found = []
    for number, e in enumerate(moves):
        fall = e.a[2] - e.b[2]
        if e.kind == "rapid" or fall < 1e-6:
            continue
        along = e.radius * abs(e.sweep[1]) if e.kind == "arc" else math.dist(e.a[:2], e.b[:2])
        if along < 1e-9:
            if min(fall, plunged.get(number, fall)) > gap + 1e-6 and not any(
                math.dist(e.a[:2], p) < 1e-6 for p in plunges
            ):
                found.append((number, "plunge"))
        elif fall > along * math.tan(math.radians(angle)) * (1 + 1e-6) + 1e-6:
            found.append((number, "slope"))
    return found


def judge(case, moves, angle, gap, plunges, seed=0, count=6000):
    """Everything that is wrong, as a list of texts; empty when nothing is."""
    rng = np.random.default_rng([seed, 79])
    found, stock = [], Stock(case, rng, count)
    deep = gouge(case, moves)
    if deep > TOLERANCE:
        found.append(f"gouge {deep:.4g} mm")
    for number, depth in stock.run(moves)[:1]:
        found.append(f"rapid {number} meets {depth:.3g} mm of stock")
    high, left, where = stock.residue()
    if left:
        found.append(f"residue {high:.3g} mm high in {left} of {int(stock.reached.sum())} columns, first at {where}")
    lowest = min(e.b[2] for e in moves)
    if lowest < case.floor - 1e-6:
        found.append(f"floor cut {case.floor - lowest:.3g} mm too deep")
    away = walls(case, stock.touch, moves)
    if away > TOLERANCE:
        found.append(f"wall not run, {away:.3g} mm away")
    found += [f"move {n}: {what}" for n, what in entries(moves, angle, gap, plunges, stock.plunged)[:1]]
    return found
