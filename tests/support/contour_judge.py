# SPDX-License-Identifier: GPL-2.0-or-later
"""The verdict on one offset, shared by the random tests and bench/offset_bench.py.

Run by itself it judges a replay file again:
    tools/judge contour build/replay_filleted_17.json
"""

import json
import os
import sys
from pathlib import Path

import numpy as np

from support import ROOT
from support import contour_oracle as oracle
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import ArcElement, LineElement, make_contour
from chipwise.geometry.offset.kernel import offset_contour
from chipwise.geometry.offset.inaccessible import InaccessibleRegion
from support.contour_random import backwards
from support.random_cases import random_count

# What a verdict lets pass, mm.  The targets are 0.001 mm of gouge and 0.01 mm2 lost; the
# kernel is held to its own error bounds.
GOUGE_MM, ROUND_TRIP_MM = 1e-6, 1e-6


def seed_from_environment():
    """First case number: CHIPWISE_SEED, default 0."""
    return int(os.environ.get("CHIPWISE_SEED", "0"))


def count_from_environment(default):
    """CHIPWISE_RANDOM_COUNT, else the share of the default (random_cases.py)."""
    return random_count(default)


def verdict(parts, side, radius):
    """List of what is wrong with the offset of parts; empty when nothing is."""
    try:
        contour = make_contour(parts)
        result = offset_contour(contour, side, radius)
    except Exception as error:  # any alarm is a finding
        return [f"alarm: {error!r}"]
    return judged(contour, side, radius, result)


def judged(contour, side, radius, result):
    """The verdict on a result at hand."""
    shape = oracle.from_elements(contour.elements)
    loops = [oracle.from_elements(p.elements) for p in result.paths]
    path = [el for loop in loops for el in loop]
    found = [f"{result.loose} dead ends"] if result.loose else []
    gouge = oracle.gouge(shape, radius, path, 0.1)
    if gouge > GOUGE_MM:
        found.append(f"gouge {gouge:.3g} mm")
    lost = oracle.missing(shape, contour.closed, side, radius, path)
    if lost:
        found.append(f"lost {sum(x for x, _ in lost):.3g} mm of path, first at {lost[0][1]}")
    for p, loop in zip(result.paths, loops):
        if oracle.worst_gap(loop, p.closed) > 1e-9:
            found.append("path not connected")
    found += _rough_verdict(shape, side, contour.closed, result)
    if contour.closed and loops:
        found += _region_verdict(shape, side, radius, loops, result)
    return found


def _rough_verdict(shape, side, closed, result):
    found = []
    for rough in result.rough:
        edge = oracle.from_elements(rough.elements)
        if edge and oracle.worst_gap(edge, rough.closed) > 1e-6:
            found.append("rough shape not connected")
        if edge and closed:
            depth = oracle.inside_material(shape, side, edge, 0.3)
            if depth > ROUND_TRIP_MM:
                found.append(f"rough shape {depth:.3g} mm inside the finish shape")
    return found


def _region_verdict(shape, side, radius, loops, result):
    """Random points, in the whole and about each region: reached or in one region."""
    rng = np.random.default_rng(len(shape))
    every = np.concatenate([oracle.point(el, np.array([0.0, 0.5])) for el in shape])
    low, high = every.min(axis=0) - radius, every.max(axis=0) + radius
    points = [rng.uniform(low, high, (150, 2))]
    regions = [u for u in result.inaccessible if isinstance(u, InaccessibleRegion)]
    for region in regions:
        low, high = region.boundary.start.min(axis=0), region.boundary.start.max(axis=0)
        points.append(rng.uniform(low - 0.2 * (high - low), high + 0.2 * (high - low), (12, 2)))
    wrong, most = oracle.wrongly_named(
        shape, side, radius, loops, [oracle.from_elements(u.boundary) for u in regions], np.concatenate(points)
    )
    found = [f"{len(wrong)} points named wrongly, first {wrong[0]}"] if len(wrong) else []
    return found + (["inaccessible regions overlap"] if most > 1 else [])


def signature(result, reverse):
    """What must not depend on where and which way a contour starts."""
    paths = sorted(
        (
            type(p).__name__,
            float(elements.lengths(p.elements).sum()),
            (-1.0 if reverse else 1.0) * elements.area(p.elements) if p.closed else 0.0,
        )
        for p in result.paths
    )
    areas = sorted(u.area for u in result.inaccessible if isinstance(u, InaccessibleRegion) and u.area > 1e-4)
    return paths, areas, result.loose


def same(a, b, tolerance=1e-3):
    return (
        len(a[0]) == len(b[0])
        and len(a[1]) == len(b[1])
        and a[2] == b[2] == 0
        and all(
            p[0] == q[0] and abs(p[1] - q[1]) < tolerance and abs(p[2] - q[2]) < tolerance for p, q in zip(a[0], b[0])
        )
        and all(abs(p - q) < tolerance for p, q in zip(a[1], b[1]))
    )


def variants(parts, side, radius):
    """(number judged, findings): backwards and from every vertex, against the original."""
    base, found, count = None, [], 0
    for back in (False, True):
        run = backwards(parts) if back else list(parts)
        for k in range(len(run)):
            count += 1
            try:
                result = offset_contour(make_contour(run[k:] + run[:k]), -side if back else side, radius)
                mark = signature(result, back)
            except Exception as error:
                found.append(f"alarm, backwards {back}, from {k}: {error!r}")
                continue
            base = base or mark
            if not same(base, mark):
                found.append(f"differs, backwards {back}, from {k}: {base} / {mark}")
    return count, found


def write_replay(kind, seed, parts, side, radius, found):
    """Store a failing case; returns the path of the file."""
    rows = [
        dict(
            start=[float(v) for v in q.start],
            end=[float(v) for v in q.end],
            line=q.line,
            **(dict(centre=[float(v) for v in q.centre], ccw=bool(q.ccw)) if isinstance(q, ArcElement) else {}),
        )
        for q in parts
    ]
    folder = ROOT / "build"
    folder.mkdir(exist_ok=True)
    path = folder / f"replay_{kind}_{seed}.json"
    path.write_text(json.dumps(dict(kind=kind, seed=seed, side=side, radius=radius, found=found, parts=rows), indent=1))
    return path


def read_replay(path):
    """(parts, side, radius) of a replay file."""
    case = json.loads(Path(path).read_text())
    parts = [
        ArcElement(tuple(r["start"]), tuple(r["end"]), tuple(r["centre"]), r["ccw"], r["line"])
        if "centre" in r
        else LineElement(tuple(r["start"]), tuple(r["end"]), r["line"])
        for r in case["parts"]
    ]
    return parts, case["side"], case["radius"]


if __name__ == "__main__":
    case_parts, case_side, case_radius = read_replay(sys.argv[1])
    for line in verdict(case_parts, case_side, case_radius) + variants(case_parts, case_side, case_radius)[1]:
        print(line)
