# SPDX-License-Identifier: GPL-2.0-or-later
"""Random drawings of loops within loops, as people hand them over, and what a G79 of them must cut, by shapely alone.

drawing(seed)   chains of parts: loops nested up to four deep in any order, direction and start; some drawn twice, some
                joined by G1, some that begin in one place, some with spikes; and the even-odd region of what was meant
judge(moves, ..) what the tool sweeps against that region, over the whole area: areas, deepest gouge, widest rest
judge_drawing() the same of drawing(seed), with finer chords where they matter
Each has been seen to fail: tests/geometry/test_nesting.py feeds sabotaged moves.  Lengths mm.
"""

import math
from typing import NamedTuple

import numpy as np
from shapely.geometry import LineString, Polygon
from shapely.ops import unary_union
from shapely.prepared import prep

from chipwise.geometry.base.contour import ArcElement, LineElement
from support import hole_oracle as trace

SAGITTA = 1e-4  # of chords for arcs
# where two arcs cross at a flat angle, chords move the crossing by ten times their sagitta: such a drawing is judged
# again
FINE_SAGITTA = 1e-5
GAP = 0.01  # that a chain may have, and length of a spike
FINEST, FURTHEST = 1e-4, 1e3  # of the distances that are measured
LEAST_AREA = 1e-9  # mm2: what is smaller is rounding of shapely

# What a verdict may be, exclusive: the target for areas, as a share; chords of the judge.
SHARE, GOUGE_MM, REST_MM = 1e-3, 1e-3, 1e-3


class _Line:
    """Numbers the lines of a sub."""

    def __init__(self):
        self.number = 0

    def next(self):
        self.number += 1
        return self.number


def drawing(seed, sagitta=SAGITTA):
    """(chains of parts, shapely region to be cleared, number of pockets in it)."""
    rng = np.random.default_rng([seed, 45])
    loops, region, pockets = [], Polygon(), 0
    for k in range(int(rng.integers(1, 4))):
        found = _nest(rng, 40.0 * k, 0.0, 18.0, 0)
        loops += found
        for parts, depth in found:
            points = loop_points(parts, sagitta)
            region, pockets = region.symmetric_difference(Polygon(points)), pockets + (depth % 2 == 0)
    rng.shuffle(loops)
    return _chains(rng, [parts for parts, _ in loops]), region, pockets


def _nest(rng, x, y, size, depth):
    """[(parts, depth)] of a loop about a place that fits a circle of `size`, and of what lies in it."""
    kind = int(rng.integers(0, 3))
    if kind == 0:
        parts = [ArcElement((x + size, y), (x + size, y), (x, y), True, 0)]
        inner = size
    else:
        corners = int(rng.integers(4, 8))
        angle = rng.random() + 2 * np.pi * np.arange(corners) / corners
        points = [(x + size * math.cos(a), y + size * math.sin(a)) for a in angle]
        inner = size * math.cos(math.pi / corners)
        parts = [_side(rng, p, q, (x, y), kind == 2) for p, q in zip(points, points[1:] + points[:1])]
        if any(isinstance(part, ArcElement) for part in parts):
            inner *= 0.94
    found = [(parts, depth)]
    if depth < 3:
        count = int(rng.integers(0, 3)) if depth else int(rng.integers(1, 3))
        each = inner * (0.82 if count == 1 else 0.4)
        for k in range(count if each > 1.5 else 0):
            out = 0.0 if count == 1 else inner * 0.5
            turn = math.pi * k + rng.random()
            found += _nest(
                rng,
                x + out * math.cos(turn),
                y + out * math.sin(turn),
                each * rng.uniform(0.85, 1.0) if count == 1 else each,
                depth + 1,
            )
    return found


def _side(rng, p, q, middle, bowed):
    """A line, or an arc that bows outward by a fifth of its chord."""
    if not bowed or rng.random() < 0.5:
        return LineElement(p, q, 0)
    chord, rise = math.dist(p, q), -0.05 * math.dist(p, q)
    radius = (chord**2 / 4 + rise**2) / (2 * abs(rise))
    m = ((p[0] + q[0]) / 2, (p[1] + q[1]) / 2)
    out = ((m[0] - middle[0]) / math.dist(m, middle), (m[1] - middle[1]) / math.dist(m, middle))
    far = radius - abs(rise)
    return ArcElement(p, q, (m[0] + far * out[0], m[1] + far * out[1]), False, 0)


def _turned(rng, parts):
    """The loop in a random direction, begun at a random corner."""
    if rng.random() < 0.5:
        parts = [
            ArcElement(p.end, p.start, p.centre, not p.ccw, 0)
            if isinstance(p, ArcElement)
            else LineElement(p.end, p.start, 0)
            for p in reversed(parts)
        ]
    k = int(rng.integers(0, len(parts)))
    return [*parts[k:], *parts[:k]]


def _spiked(rng, parts):
    """The loop with a line drawn past its corner and back, if it has a line."""
    k = next((k for k, p in enumerate(parts) if isinstance(p, LineElement)), None)
    if k is None or rng.random() < 0.7:
        return parts
    p, length = parts[k], rng.uniform(0.2, 0.99) * GAP
    far = math.dist(p.start, p.end)
    tip = tuple(e + length * (e - s) / far for s, e in zip(p.start, p.end))
    return [*parts[:k], LineElement(p.start, tip, 0), LineElement(tip, p.end, 0), *parts[k + 1 :]]


def _chains(rng, loops):
    """Loops as they come from a drawing."""
    chains, single = [], False
    for loop in loops:
        chain = _spiked(rng, _turned(rng, loop))
        before_is_single, single = single, rng.random() > 0.15
        if not single:
            again = _turned(rng, loop)
            if rng.random() < 0.5:
                chains.append(again)
            elif again[0].start == chain[0].start:
                chain = chain + again  # both begin in one place, without G0
        if chains and single and before_is_single and rng.random() < 0.3:
            before = chains.pop()
            chain = before + [LineElement(before[-1].end, chain[0].start, 0)] + chain
            if rng.random() < 0.3:  # and back again
                chain.append(LineElement(chain[-1].end, before[-1].end, 0))
        chains.append(chain)
    line = _Line()
    return tuple(
        tuple(
            ArcElement(p.start, p.end, p.centre, p.ccw, line.next())
            if isinstance(p, ArcElement)
            else LineElement(p.start, p.end, line.next())
            for p in chain
        )
        for chain in chains
    )


def loop_points(parts, sagitta=SAGITTA):
    found = []
    for p in parts:
        found += arc_points(p.start, p.end, p.centre, p.ccw, sagitta) if isinstance(p, ArcElement) else [p.start]
    return found


def arc_points(start, end, centre, ccw, sagitta=SAGITTA):
    """Points on an arc without its end."""
    radius = math.dist(start, centre)
    a, b = (math.atan2(p[1] - centre[1], p[0] - centre[0]) for p in (start, end))
    turn = (b - a if ccw else a - b) % (2 * math.pi)
    turn = 2 * math.pi if math.dist(start, end) < 1e-9 else turn
    count = max(4, math.ceil(turn / (2 * math.acos(1 - min(sagitta / radius, 1)))))
    return [
        (
            centre[0] + radius * math.cos(a + (turn if ccw else -turn) * k / count),
            centre[1] + radius * math.sin(a + (turn if ccw else -turn) * k / count),
        )
        for k in range(count)
    ]


def quarter(radius, sagitta=SAGITTA):
    """Chords of a quarter of a circle."""
    return math.ceil(0.25 * math.pi / math.acos(1.0 - min(sagitta / radius, 0.1)))


def cut_pieces(moves, start, radius, floor, sagitta=SAGITTA):
    """What the tool sweeps on each move at the floor."""
    found = []
    for e in trace.walk(moves, start):
        if (
            e.kind != "rapid"
            and max(e.a[2], e.b[2]) < floor + 1e-6
            and (e.kind == "arc" or math.dist(e.a[:2], e.b[:2]) > 0)
        ):
            points = (
                [*arc_points(e.a[:2], e.b[:2], e.centre, e.ccw, sagitta), e.b[:2]]
                if e.kind == "arc"
                else [e.a[:2], e.b[:2]]
            )
            half = (
                len(points) // 2 if points[0] == points[-1] else 0
            )  # GEOS leaves a hole in the middle of what a small circle sweeps
            found += [
                LineString(part).buffer(radius, quarter(radius, sagitta))
                for part in ((points[: half + 1], points[half:]) if half else (points,))
            ]
    return found


def united(pieces, allowed):
    """The union of pieces, each of which lies in a region that is allowed.  GEOS sometimes loses a hole where very many
    edges nearly meet: then it is made again in parts."""
    for size in (len(pieces), 40, 7):
        found = unary_union([unary_union(pieces[k : k + size]) for k in range(0, len(pieces), size)])
        if found.difference(allowed).area <= LEAST_AREA:
            return found
    raise AssertionError("shapely makes no union of what was cut")


class Verdict(NamedTuple):
    """Of what moves cut at the floor, over the whole area.

    left      share of the area the tool can clear that was not cleared
    beyond    area cut beyond it, as a share of it
    gouge     mm, how far the place that is cut deepest into a wall or an island lies from the pocket
    rest      mm, how far the place that is left and lies furthest from all that is cut lies from it: half the width of
              a rib
    """

    left: float
    beyond: float
    gouge: float
    rest: float

    @property
    def right(self):
        """Whether what is drawn is cut and nothing else."""
        return max(self.left, self.beyond) < SHARE and self.gouge < GOUGE_MM and self.rest < REST_MM


def judge_drawing(moves, request, seed):
    """Verdict on moves of drawing(seed); by finer chords where the usual ones find something."""
    found = judge(moves, request, drawing(seed)[1])
    return found if found.right else judge(moves, request, drawing(seed, FINE_SAGITTA)[1], FINE_SAGITTA)


def judge(moves, request, region, sagitta=SAGITTA):
    """Verdict on moves; region: shapely, what was drawn to be cleared."""
    radius = request.tool_radius
    pieces, near = (
        cut_pieces(moves, request.start, radius, request.bottom, sagitta),
        region.buffer(0.5 * GOUGE_MM, quarter(GOUGE_MM)),
    )
    right = prep(near)
    outside = unary_union([piece for piece in pieces if not right.contains(piece)])
    cut = united(pieces, near.union(outside))
    reach = region.buffer(-radius, quarter(radius, sagitta)).buffer(radius, quarter(radius, sagitta))
    gouge = furthest(cut if outside.is_empty else outside, region)
    return Verdict(
        reach.difference(cut).area / reach.area, cut.difference(reach).area / reach.area, gouge, furthest(reach, cut)
    )


def furthest(a, b):
    """The distance (mm) from region b of the point of region a that is furthest from it, to 0.1 um; 0 if b holds a."""
    low, high = 0.0, FINEST
    while high < FURTHEST and a.difference(b.buffer(high, quarter(high))).area > LEAST_AREA:
        low, high = high, 2.0 * high
    while low and high - low > FINEST:
        middle = 0.5 * (low + high)
        low, high = (
            (middle, high) if a.difference(b.buffer(middle, quarter(middle))).area > LEAST_AREA else (low, middle)
        )
    return low
