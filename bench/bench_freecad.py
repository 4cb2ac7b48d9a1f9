# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 P4 beside the adaptive clearing of FreeCAD on nine shapes, in one run: length, time, engagement.

    /usr/bin/python3 bench/bench_freecad.py FOLDER

FOLDER holds FreeCAD's module area.so and libarea-native.so; nothing of FreeCAD is part of chipwise.  Debian 12:
`apt-get download libfreecad-python3-0.20`, `dpkg -x FILE FOLDER`, then FOLDER/usr/lib/freecad-python3/lib.

Both with a tool of 6 mm and a step-over of 2.4 mm, one level, F1500 and 500 mm/s2, judged as bench_engagement.py does,
with the pass along the walls that each has.  FreeCAD's other parameters are those of a new operation of its Path
workbench: tolerance 0.1, keep tool down 3, finishing profile, helix as wide as the tool.  The stock is the box about
the pocket.  Links over cleared ground have no lift, as there.

FreeCAD writes short lines.  A machine that stopped in each bend would be slower than need be, so all of its path at the
level runs on arcs that stay within 0.02 mm of its bends, as with G64.  Times: links at the feed; links as rapids, which
is how FreeCAD writes them, from and to standstill and without a stop; all lines at the feed that meet no stock as
rapids, too, without a stop.  P4's rapids stop at both ends.
"""

import argparse
import ctypes
import importlib.util
import math
import sys
import time
from pathlib import Path

import numpy as np

from roots import ROOT  # noqa: F401  the path to chipwise
from bench_engagement import FEED, RADIUS, STEP, least_length, measured, request, seconds
from support import engagement_judge, hole_oracle
from support.engagement_shapes import SHAPES
from chipwise.geometry.base import chains
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.pocket.rounded import smoothed

TOLERANCE, KEEP_DOWN = 0.1, 3.0  # of a new operation
CHORD_MM = 1e-4  # chords of the outline stray so far, as FreeCAD's own
BESIDE_MM = 10.0  # stock about the pocket
TURN = math.pi / 16  # chords of FreeCAD's helix
BLENDED_MM = 0.02  # from a bend to its arc
LIFTED = 1.0  # its clearance height over the stock; the level is bottom of bench_engagement.request

CASES = ("links at the feed", "links as rapids that stop", "links as rapids", "all air as rapids", "stops in all bends")


def module(folder):
    """FreeCAD's module; or a sentence that says what is missing."""
    files = [Path(folder, name) for name in ("libarea-native.so", "area.so")]
    missing = [file.name for file in files if not file.is_file()]
    if missing:
        return f"{' and '.join(missing)} of FreeCAD not found in {folder}: see the head of bench/bench_freecad.py"
    try:
        ctypes.CDLL(str(files[0]), mode=ctypes.RTLD_GLOBAL)
        spec = importlib.util.spec_from_file_location("area", files[1])
        area = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(area)
    except (OSError, ImportError) as error:
        return f"FreeCAD's module does not load: {error}"
    return area


def planned(area, loops):
    """(regions of FreeCAD's adaptive clearing, s of computing)"""
    walls = [chains.flat(make_contour(loop).elements, CHORD_MM) for loop in loops]
    (x, y), (far_x, far_y) = (
        end(walls[0], axis=0) + beside for end, beside in ((np.min, -BESIDE_MM), (np.max, BESIDE_MM))
    )
    adaptive = area.Adaptive2d()
    adaptive.stepOverFactor = STEP / (2.0 * RADIUS)
    adaptive.toolDiameter = 2.0 * RADIUS
    adaptive.helixRampDiameter = 0.0
    adaptive.keepToolDownDistRatio = KEEP_DOWN
    adaptive.stockToLeave = 0.0
    adaptive.tolerance = TOLERANCE
    adaptive.forceInsideOut = False
    adaptive.finishingProfile = True
    adaptive.opType = area.AdaptiveOperationType.ClearingInside
    stock = [[(x, y), (far_x, y), (far_x, far_y), (x, far_y), (x, y)]]
    begun = time.process_time()
    found = adaptive.Execute(stock, [[tuple(p) for p in wall.tolist()] for wall in walls], lambda paths: False)
    return found, time.process_time() - begun


def moves_of(area, regions, bottom, links):
    """Elements of hole_oracle of FreeCAD's path; links: "feed" or "rapid", over cleared ground."""
    moves, high = [], LIFTED

    def go(kind, *to):
        if math.dist(moves[-1].b if moves else start, to) > 1e-9:
            moves.append(hole_oracle.Element(kind, moves[-1].b if moves else start, to))

    start = (0.0, 0.0, high)
    for region in regions:
        for to in entry(region, bottom):
            if to[2] > 0.0:
                go("rapid", *(moves[-1].b if moves else start)[:2], high)
                go("rapid", *to[:2], high)
            go("feed", *to)
        for kind, points in region.AdaptivePaths:
            for x, y in points:
                if kind == int(area.AdaptiveMotionType.Cutting):
                    if moves[-1].b[2] != bottom:
                        go("feed", *moves[-1].b[:2], bottom)
                    go("feed", x, y, bottom)
                elif kind == int(area.AdaptiveMotionType.LinkClear):
                    if moves[-1].b[2] != bottom:
                        go("rapid", *moves[-1].b[:2], bottom)
                    go(links, x, y, bottom)
                else:
                    go("rapid", *moves[-1].b[:2], high)
                    go("rapid", x, y, high)
        go("rapid", *moves[-1].b[:2], high)
    return moves


def entry(region, bottom):
    """Places of FreeCAD's helix, from above the stock, and once around at the level; a plunge where it has none."""
    (x, y), start = region.HelixCenterPoint, region.StartPoint
    radius = math.dist((x, y), start) - 0.01
    if radius <= 0.0:
        return [(*start, 0.1), (*start, bottom)]
    deep = 2.0 * math.pi * radius * math.tan(math.radians(5.0))  # a turn
    most = -bottom / deep * 2.0 * math.pi
    angle = math.atan2(start[1] - y, start[0] - x) - most - TURN
    turned = np.arange(0.0, most + 2.0 * math.pi, TURN)
    return [
        (x + radius * math.cos(angle + t), y + radius * math.sin(angle + t), max(bottom, bottom * t / most) or 0.1)
        for t in turned.tolist()
    ]


def air_as_rapids(moves, bottom):
    """Moves whose feeds at the level are rapids where they meet no stock."""
    pieces, asked = engagement_judge.pieces_of(moves, bottom)
    rows = engagement_judge.exact(pieces, asked, RADIUS)
    most = np.zeros(len(pieces))
    np.maximum.at(most, rows[:, 0].astype(int), rows[:, 4])
    found, number = [], 0
    for move in moves:
        is_asked = move.kind != "rapid" and abs(move.b[2] - bottom) <= 1e-4 and math.dist(move.a[:2], move.b[:2]) > 0.0
        free = is_asked and asked[number] and most[number] <= engagement_judge.AIR
        number += is_asked
        found.append(hole_oracle.Element("rapid", move.a, move.b) if free else move)
    return found


def blended(moves, bottom):
    """Moves whose lines at the level have arcs in their bends."""
    found, run = [], []
    for move in [*moves, None]:
        if move is not None and move.a[2] == move.b[2] == bottom:
            run.append(move)
            continue
        if run:
            points = np.array([run[0].a[:2], *(one.b[:2] for one in run)])
            chain, line = smoothed(points, [], 1, 0.0, BLENDED_MM, lambda arcs, _corner: np.full(len(arcs), True))
            for k in range(len(chain)):
                a, b = ((*end[k].tolist(), bottom) for end in (chain.start, chain.end))
                arc = (tuple(chain.centre[k].tolist()), bool(chain.sweep[k] > 0.0)) if chain.is_arc[k] else (None,)
                kind = "rapid" if run[line[k]].kind == "rapid" else "arc" if chain.is_arc[k] else "feed"
                found.append(hole_oracle.Element(kind, a, b, *arc))
        found, run = found + ([move] if move is not None else []), []
    return found


def figures(area, loops):
    """Figures of FreeCAD's path of one shape; None where it makes none."""
    bottom, least = request(loops).bottom, least_length(loops)
    regions, planning = planned(area, loops)
    feeds, rapids = (moves_of(area, regions, bottom, links) for links in ("feed", "rapid"))
    if not feeds:
        return None
    found = engagement_judge.engagement(feeds, bottom, RADIUS)
    nominal = math.acos(1 - STEP / RADIUS)
    smooth = [blended(moves, bottom) for moves in (feeds, rapids, air_as_rapids(rapids, bottom))]
    asked = ((smooth[0], True), (smooth[1], False), (smooth[1], True), (smooth[2], True), (rapids, False))
    return dict(
        length=found.length() / least,
        times=[seconds(moves, bottom, through) / (least / FEED) for moves, through in asked],
        p99=math.degrees(found.percentile(0.99) - nominal),
        over=found.length(nominal + math.radians(10)),
        full=found.length(engagement_judge.FULL),
        air=1 - found.length(engagement_judge.AIR) / found.length(),
        planning=planning,
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    area = module(parser.parse_args().folder)
    if isinstance(area, str):
        sys.exit(area)
    print(
        f"shape: P4 length, time, p99, planning; FreeCAD length, time with {', '.join(CASES)}, p99, "
        "mm over 10 degrees, full slot mm, at the feed in the air, planning"
    )
    rows = []
    for name, loops in SHAPES.items():
        ours, theirs = measured(loops, 4), figures(area, loops)
        text = f"{name:20s} {ours['length']:.2f} {ours['time']:.2f} {ours['p99']:.1f} {ours['planning']:.1f} s;"
        if theirs is None:
            print(f"{text} no path of FreeCAD", flush=True)
            continue
        rows.append((ours["length"], ours["time"], theirs["length"], *theirs["times"]))
        print(
            f"{text} {theirs['length']:.2f} {' '.join(f'{t:.2f}' for t in theirs['times'])} "
            f"{theirs['p99']:.1f} {theirs['over']:.1f} {theirs['full']:.1f} {100 * theirs['air']:.0f} % "
            f"{theirs['planning']:.1f} s",
            flush=True,
        )
    middle = np.median(rows, axis=0)
    print(f"medians of {len(rows)}: {' '.join(f'{m:.2f}' for m in middle)}")
    for k, case in enumerate(CASES):
        ratios = [row[1] / row[3 + k] for row in rows]
        print(
            f"time of P4 / FreeCAD, {case}: of the medians {middle[1] / middle[3 + k]:.2f}, "
            f"median of the ratios {np.median(ratios):.2f}, {min(ratios):.2f} to {max(ratios):.2f}"
        )


if __name__ == "__main__":
    main()
