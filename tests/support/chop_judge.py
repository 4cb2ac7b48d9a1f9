# SPDX-License-Identifier: GPL-2.0-or-later
"""Random closed inside contours for the chop, and the verdict on one: shared by test_contour_chop.py,
test_chop_oracle.py and bench/bench_chop.py.

Run by itself it judges a case again:   tools/judge chop SEED [SEED ..]
"""

import math
import sys
import time
from types import SimpleNamespace

import numpy as np

from support import chop_oracle as oracle
from support import hole_oracle
from chipwise.cycles import contour as contour_cycle, contour_chop
from chipwise.cycles.chop_lines import depth_levels
from chipwise.cycles.lead_in import ChopKerfs
from chipwise.cycles.mover import Mover
from chipwise.geometry.base import chains, elements
from chipwise.geometry.base.contour import ArcElement, LineElement, make_contour
from chipwise.geometry.offset.kernel import LEFT, RIGHT, offset_contour, offset_pocket
from chipwise.geometry.offset.paths import PointContact
from support.contour_oracle import from_elements
from support.contour_random import contour_case, grid

OUTSIDE_MM = 0.001  # the target: no kerf further outside the contour

KINDS = ("filleted", "bulged", "slot", "bent slot", "grid", "island")
SQUARE = [(0.0, 0.0), (40.0, 0.0), (40.0, 40.0), (0.0, 40.0)]


def outline(*points):
    """A closed loop of lines."""
    return [LineElement(p, points[(k + 1) % len(points)], k + 1) for k, p in enumerate(points)]


def from_line_end(path, segments, tool_radius):
    """A closed path from the first chop line's end on it, as it is if there is none: for paths run without a
    lead-in."""
    index, t = ChopKerfs(segments, tool_radius).line_ends(path)
    return chains.rotated(path, int(index[0]), float(t[0])) if len(index) else path


def scaled(parts, by):
    """Parts scaled about the origin."""

    def at(p):
        return tuple(float(v) * by for v in p)

    return [
        ArcElement(at(q.start), at(q.end), at(q.centre), q.ccw, q.line)
        if isinstance(q, ArcElement)
        else LineElement(at(q.start), at(q.end), q.line)
        for q in parts
    ]


def _bent_slot(rng, radius_tool):
    """An arc of a ring, its ends half circles; by chance straight."""
    width = radius_tool * rng.uniform(2.2, 14)
    middle = width * rng.uniform(0.6, 6)
    turn = rng.uniform(0.4, 4.5)
    inner, outer, a = middle - width / 2, middle + width / 2, rng.uniform(0, 2 * math.pi)

    def at(r, angle):
        return (r * math.cos(angle), r * math.sin(angle))

    p = [at(outer, a), at(outer, a + turn), at(inner, a + turn), at(inner, a)]
    return [
        ArcElement(p[0], p[1], (0.0, 0.0), True, 1),
        ArcElement(p[1], p[2], at(middle, a + turn), True, 2),
        ArcElement(p[2], p[3], (0.0, 0.0), False, 3),
        ArcElement(p[3], p[0], at(middle, a), True, 4),
    ]


def _straight_slot(rng, radius_tool):
    """An obround slot in any direction."""
    half = radius_tool * rng.uniform(1.05, 8)
    reach, a = half * rng.uniform(0.3, 12), rng.uniform(0, 2 * math.pi)
    u, v = np.array((math.cos(a), math.sin(a))), np.array((-math.sin(a), math.cos(a)))
    p = [tuple(s * reach * u + t * half * v) for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return [
        LineElement(p[0], p[1], 1),
        ArcElement(p[1], p[2], tuple(reach * u), True, 2),
        LineElement(p[2], p[3], 3),
        ArcElement(p[3], p[0], tuple(-reach * u), True, 4),
    ]


def _with_islands(rng):
    """A ring, or a filleted polygon, with one to three round islands."""
    size = rng.uniform(15, 40)
    count = int(rng.integers(1, 4))
    islands = []
    for k in range(count):
        a, far = 2 * math.pi * k / count + rng.uniform(0, 1), 0.0 if count == 1 else size * 0.5
        c = (far * math.cos(a) + rng.uniform(-2, 2), far * math.sin(a) + rng.uniform(-2, 2))
        r = size * rng.uniform(0.05, 0.6 if count == 1 else 0.2)
        islands.append([ArcElement((c[0] + r, c[1]), (c[0] + r, c[1]), c, True, 100 + k)])
    if rng.random() < 0.5:
        return [[ArcElement((size, 0.0), (size, 0.0), (0.0, 0.0), True, 1)]] + islands
    p = [(size, size), (-size, size * rng.uniform(0.9, 1.3)), (-size * 1.1, -size), (size, -size)]
    return [[LineElement(p[k], p[(k + 1) % 4], k + 1) for k in range(4)]] + islands


def chop_case(seed, small=False):
    """Case number `seed`: (kind, loops of parts: boundary, islands .., tool radius, chop size), mm.

    small: shapes a third as large, for the flood fill.
    """
    rng = np.random.default_rng([seed, 7134])
    kind = KINDS[seed % len(KINDS)]
    radius = math.exp(rng.uniform(math.log(0.3), math.log(4.0)))
    if kind in ("filleted", "bulged"):
        loops = [contour_case(int(rng.integers(1 << 30)), kind)[0]]
    elif kind == "grid":
        loops = [scaled(grid(rng, int(rng.integers(3, 20))), radius * rng.uniform(1.9, 9))]
    elif kind == "island":
        loops = _with_islands(rng)
    else:
        loops = [(_straight_slot if kind == "slot" else _bent_slot)(rng, radius)]
    chop_size = math.exp(rng.uniform(math.log(2.5), math.log(30.0)))
    if small:
        loops = [scaled(loop, 1 / 3) for loop in loops]
        radius, chop_size = max(radius / 3, 0.25), chop_size / 3
    return kind, loops, radius, chop_size


class Chopped:
    """A case planned: finish loops and paths as tuples, plan, moves."""

    def __init__(self, loops, radius, chop_size, depth_step=None):
        contours = [make_contour(parts) for parts in loops]
        inside = LEFT if elements.area(contours[0].elements) > 0 else RIGHT
        result = (
            offset_pocket(contours[0], contours[1:], radius)
            if len(contours) > 1
            else offset_contour(contours[0], inside, radius)
        )
        paths = [p.elements for p in result.paths if not isinstance(p, PointContact)]
        whole = [c for c in result.contours]
        outer_sense = math.copysign(1.0, elements.area(whole[0].elements))
        around = [elements.area(p) * outer_sense < 0 for p in paths]
        self.boundaries = [p for p, island in zip(paths, around) if not island]
        self.islands = [p for p, island in zip(paths, around) if island]
        self.radius, self.chop_size = radius, chop_size
        self.finish = [from_elements(c.elements) for c in whole]
        self.paths = [from_elements(p) for p in self.boundaries + self.islands]
        begin = time.process_time()
        self.plan = contour_chop.chop_plan(self.boundaries, self.islands, radius, chop_size)
        self.plan_s = time.process_time() - begin
        self.request = SimpleNamespace(
            bottom=-6.0,
            clearance=2.0,
            tool_radius=radius,
            feed=600.0,
            plunge_feed=200.0,
            start=(0.0, 0.0, 20.0),
            end=tuple(paths[0].start[0]) if paths else (0.0, 0.0),
            depth_step=depth_step,
        )
        mover = Mover(self.request)
        contour_chop.cut_chops(mover, self.plan, self.request.end, radius, depth_levels(2.0, -6.0, depth_step))
        self.moves = tuple(mover.moves)
        self.elements = self.line_elements = hole_oracle.walk(self.moves, self.request.start)
        if len(contours) == 1 and self.plan.chopped:
            self._whole_cycle(tuple(loops[0]), 41 if inside == LEFT else 42)
        elif self.plan.chopped:
            self.paths = [
                from_elements(from_line_end(p, self.plan.segments, radius)) for p in self.boundaries + self.islands
            ]

    def _whole_cycle(self, shape, side):
        """Lines and contour as G78 cuts them, leads and all."""
        r = self.request
        plan = contour_cycle.contour_plan.__wrapped__(
            contour_cycle.ContourRequest(
                shape,
                side,
                r.tool_radius,
                r.bottom,
                r.clearance,
                r.feed,
                r.plunge_feed,
                r.start,
                depth_step=r.depth_step,
                finish=True,
                chop_size=self.chop_size,
            )
        )
        assert plan.chop.segments == self.plan.segments
        self.moves = plan.moves
        self.elements = hole_oracle.walk(plan.moves, r.start)
        self.paths = self._runs()[len(self.plan.segments) :]

    def lines(self):
        """The motions of each line at full depth."""
        return self._runs()[: len(self.plan.segments)]

    def _runs(self):
        """The motions at full depth from rapid to rapid."""
        made, now = [], []
        for e in self.elements:
            if e.kind == "rapid":
                made, now = (made + [now], []) if now else (made, now)
            elif max(e.a[2], e.b[2]) <= self.request.bottom + 1e-9:
                now += oracle.tuples([e])
        return made + [now] if now else made


def verdict(chopped, lines=None, paths=None, stages=False):
    """(list of what is wrong, {figure: value}); lines and paths may be given instead of the cycle's own."""
    c = chopped
    lines = c.lines() if lines is None else lines
    paths = c.paths if paths is None else paths
    cuts = [el for line in lines for el in line]
    found, figures = [], {"outside": -math.inf, "largest": 0.0, "ever": 0.0}
    if cuts:
        figures["outside"] = oracle.outside(c.finish, cuts, c.radius)
        if figures["outside"] > OUTSIDE_MM:
            found.append(f"kerf {figures['outside']:.5f} mm outside the contour")
    sizes = oracle.final_pieces(c.finish, cuts + [el for loop in paths for el in loop], c.radius)
    figures["largest"] = max(sizes, default=0.0)
    if figures["largest"] >= c.chop_size:
        found.append(f"piece of {figures['largest']:.4f} mm, H {c.chop_size:.4f}")
    if figures["largest"] > c.plan.largest_piece + 1e-3:
        found.append(f"piece of {figures['largest']:.4f} mm, planned {c.plan.largest_piece:.4f}")
    if hole_oracle.rapid_faults(c.elements, c.request.clearance):
        found.append("rapid below the clearance plane")
    if stages and cuts:
        figures["ever"] = oracle.largest_loose_ever(c.finish, lines, paths, c.radius)
        if figures["ever"] >= c.chop_size:
            found.append(f"piece of {figures['ever']:.4f} mm loose on the way, H {c.chop_size:.4f}")
    return found, figures


if __name__ == "__main__":
    small = "small" in sys.argv
    for name in sys.argv[1:]:
        if name != "small":
            kind, loops, radius, chop_size = chop_case(int(name), small)
            done = Chopped(loops, radius, chop_size)
            print(
                name,
                kind,
                f"r {radius:.4f} H {chop_size:.4f}",
                [
                    (
                        len(chop.segments),
                        chop.parts,
                        round(math.degrees(chop.angle), 2),
                        chop.pieces,
                        round(chop.largest, 3),
                    )
                    for chop in done.plan.chops
                ],
                *verdict(done, stages=small),
            )
