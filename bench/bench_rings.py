# SPDX-License-Identifier: GPL-2.0-or-later
"""P0 of G79 beside the rings that a program makes of pyclipper's offsets: time, length, lifts; random pockets.

Called by bench/run.py in a small size (prints JSON rows).  In full:

    /usr/bin/python3 bench/bench_rings.py --count 50

The rings beside: offsets of the walls in chords, a step-over apart, those within a ring before it, the nearest first,
each from its place nearest to where the tool is, climb.  From one to the next leads a line at the feed at the level,
whether it is cleared or not, if the tool's centre may be there, and a lift to R if not.  Nothing more: no arcs onto the
walls, no seam.  Both paths are one level, with D of at most the tool radius, F1500 and 500 mm/s2; time as
bench_engagement.py reads it, without the helix.
"""

import argparse
import json
import math
import os
from dataclasses import replace

import numpy as np
import shapely.geometry as shapes
import shapely.ops

from roots import ROOT  # noqa: F401  the path to chipwise
from bench_engagement import FEED, seconds
from rows import row
from support import hole_oracle, second_oracles
from support.pocket_judge import random_request
from chipwise.cycles import pocket as cycle
from chipwise.errors import CycleError
from chipwise.geometry.base import chains
from chipwise.geometry.base.contour import make_contour

# Chords of walls and offsets stray so far; a line may leave the region of the tool's centre by so much. mm
CHORD_MM, BESIDE_MM = 5e-4, 2e-3
# A ring so many step-overs away is the next one.
NEXT = 1.05

UNIT = second_oracles.CLIPPER_UNIT

# P0 / rings, the target for the medians.
MOST = 0.95


def requests(first, count):
    """(seed, PocketRequest) of random pockets, one level, nothing left on walls and floor."""
    for seed in range(first, first + count):
        asked = random_request(seed, 0)
        yield (
            seed,
            replace(
                asked,
                step=min(asked.step, asked.tool_radius),
                bottom=-3.0,
                side_allowance=0.0,
                floor_allowance=0.0,
                depth_step=None,
                climb=True,
                feed=60.0 * FEED,
            ),
        )


def levels_of(clipper, request):
    """[[ring (n, 2) mm, closed, what is not cut yet right of it]] of each distance from the walls."""
    offset = clipper.PyclipperOffset(2.0, CHORD_MM * UNIT)
    walls = [shapes.Polygon(chains.flat(make_contour(loop).elements, CHORD_MM)).buffer(0.0) for loop in request.loops]
    pocket = walls[0].difference(shapely.ops.unary_union(walls[1:])) if walls[1:] else walls[0]
    for part in getattr(pocket, "geoms", (pocket,)):
        for number, ring in enumerate((part.exterior, *part.interiors)):
            points = np.round(np.array(ring.coords)[:-1, :2] * UNIT).astype(int)
            whole = [tuple(point) for point in points.tolist()]
            if clipper.Orientation(whole) != (number == 0):
                whole.reverse()
            offset.AddPath(whole, clipper.JT_ROUND, clipper.ET_CLOSEDPOLYGON)
    found, distance = [], request.tool_radius
    while rings := offset.Execute(-distance * UNIT):
        found.append([np.array([*ring, ring[0]], float) / UNIT for ring in rings])
        distance += request.step
    return found


def region_of(rings):
    """Polygons of the places where the tool's centre may be, from the outermost rings."""
    region = shapes.Polygon()
    for ring in sorted(rings, key=lambda ring: -shapes.Polygon(ring).area):
        region = region.symmetric_difference(shapes.Polygon(ring).buffer(0.0))
    return region.buffer(BESIDE_MM)


def ordered(levels, step, region):
    """[(points of a ring from where it begins, whether a line at the level leads there)]: of the rings whose inner
    neighbours are done the one nearest to the tool; the first is one of the innermost."""
    rings = [(depth, ring, shapes.LineString(ring)) for depth, found in enumerate(levels) for ring in found]
    waits = [
        [n for n, other in enumerate(rings) if other[0] == depth + 1 and line.distance(other[2]) <= NEXT * step]
        for depth, _, line in rings
    ]
    left, here, found = set(range(len(rings))), None, []
    while left:
        ready = [k for k in sorted(left) if not left.intersection(waits[k])]
        best = min(ready, key=lambda k: -rings[k][0] if here is None else _nearest(rings[k][1], here)[0])
        points = _from(rings[best][1], here)
        found.append((points, here is not None and region.contains(shapes.LineString((here, points[0])))))
        here = points[-1]
        left.remove(best)
    return found


def _nearest(ring, here):
    """(distance, index, t) of a place on a ring."""
    a, b = ring[:-1], ring[1:]
    along = b - a
    t = np.clip(((here - a) * along).sum(1) / np.maximum((along**2).sum(1), 1e-30), 0.0, 1.0)
    gap = np.hypot(*(a + t[:, None] * along - here).T)
    k = int(np.argmin(gap))
    return float(gap[k]), k, float(t[k])


def _from(ring, here):
    """A ring from its place nearest to another and round to it."""
    if here is None:
        return ring
    _, k, t = _nearest(ring, here)
    start = ring[k] + t * (ring[k + 1] - ring[k])
    return np.concatenate((start[None], ring[k + 1 :], ring[1 : k + 1], start[None]))


def moves_of(rings, request):
    """Elements of tests/support/hole_oracle.py, from above the first ring."""
    low, high, found, here = request.bottom, request.clearance, [], None
    for points, down in rings:
        start = tuple(points[0].tolist())
        if here is not None and not down:
            found += [
                hole_oracle.Element("rapid", (*here, low), (*here, high)),
                hole_oracle.Element("rapid", (*here, high), (*start, high)),
                hole_oracle.Element("rapid", (*start, high), (*start, low)),
            ]
        places = ([here] if down else []) + points.tolist()
        found += [
            hole_oracle.Element("feed", (*a, low), (*b, low))
            for a, b in zip(places, places[1:])
            if math.dist(a, b) > 1e-9
        ]
        here = tuple(points[-1].tolist())
    return found


def figures(moves, level):
    """(s, mm at the feed at a level, lifts)"""
    length = sum(
        e.radius * abs(e.sweep[1]) if e.kind == "arc" else math.dist(e.a, e.b)
        for e in moves
        if e.kind != "rapid" and max(e.a[2], e.b[2]) < level + 0.1
    )
    lifts = sum(e.kind == "rapid" and e.a[2] < level + 0.1 and e.b[2] > level + 0.5 for e in moves) - 1
    return seconds(moves, level), length, max(lifts, 0)


def compared(clipper, asked):
    """(figures of P0, figures of the rings) of a pocket; None where the tool does not fit."""
    try:
        plan = cycle.pocket_plan(asked)
    except CycleError:
        return None
    levels = levels_of(clipper, asked)
    if not levels:
        return None
    rings = ordered(levels, asked.step, region_of(levels[0]))
    ours = figures(hole_oracle.walk(plan.moves, asked.start), asked.bottom)
    return ours, figures(moves_of(rings, asked), asked.bottom)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=int(os.environ.get("CHIPWISE_RANDOM_COUNT") or 6))
    parser.add_argument("--seed", type=int, default=int(os.environ.get("CHIPWISE_SEED") or 45000))
    parser.add_argument("--all", action="store_true", help="a line for each pocket")
    given = parser.parse_args()
    clipper, missing = second_oracles.load("pyclipper")
    if clipper is None:
        print("rings: skipped:", missing)
        return
    ratios, lengths, lifts = [], [], [0, 0]
    for seed, asked in requests(given.seed, given.count):
        found = compared(clipper, asked)
        if found is None:
            continue
        (ours, ours_mm, ours_lifts), (theirs, theirs_mm, theirs_lifts) = found
        ratios.append(ours / theirs)
        lengths.append(ours_mm / theirs_mm)
        lifts = [lifts[0] + ours_lifts, lifts[1] + theirs_lifts]
        if given.all:
            print(
                f"seed {seed}: {ours:.1f} s, {theirs:.1f} s, {ours_mm:.0f} mm, {theirs_mm:.0f} mm, {ours_lifts} and "
                f"{theirs_lifts} lifts",
                flush=True,
            )
    note = f"median of {len(ratios)} pockets, {min(ratios):.2f} to {max(ratios):.2f}"
    print(json.dumps(row("P0 / rings of pyclipper: time", round(float(np.median(ratios)), 3), "x", note, MOST)))
    print(
        json.dumps(row("P0 / rings of pyclipper: length", round(float(np.median(lengths)), 3), "x", note.split(",")[0]))
    )
    print(json.dumps(row("lifts: P0", lifts[0], "", f"rings {lifts[1]}")))


if __name__ == "__main__":
    main()
