#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise import against DXF drawings that people have drawn: bench/import_drawings.py FILE|FOLDER ..  Prints a table
and what is wrong.

The oracle takes ezdxf's paths in short chords, joins their ends by a tree of points, and has shapely's even-odd area of
the rings of a layer.  A drawing is right if the area of all layers is within 0.1 % of that, as the oracle has no ring:
none; said if import refuses it, or names what is open, crosses or is unclear; else it is wrong.
"""

import math
import sys
import time
from collections import Counter, defaultdict
from pathlib import Path

import ezdxf
import ezdxf.path
import numpy as np
import roots  # noqa: F401
from ezdxf import recover, units
from scipy.spatial import cKDTree
from shapely.geometry import Polygon

from chipwise.errors import CycleError
from chipwise.importing.run import imported

SHARE, TOLERANCE, CHORD = 1e-3, 0.01, 1e-4  # share of the area; mm
MIL = 0.0254  # ezdxf converts no mil
KINDS = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "LWPOLYLINE", "POLYLINE")


def chains(document, mm):
    """{layer: [points (n, 2) mm]} of what is drawn on layers that are on."""
    hidden = {
        layer.dxf.name.lower()
        for layer in document.layers
        if layer.is_off() or layer.is_frozen() or not layer.dxf.get("plot", 1)
    }
    found = defaultdict(list)

    def take(entity, parent):
        layer = entity.dxf.get("layer", "0")
        layer = parent if layer == "0" and parent is not None else layer
        if layer.lower() in hidden or layer.lower() == "defpoints" or entity.dxf.get("invisible", 0):
            return
        if entity.dxftype() == "INSERT":
            for one in entity.multi_insert() if entity.mcount > 1 else (entity,):
                for part in one.virtual_entities():
                    take(part, layer)
        elif entity.dxftype() in KINDS:
            path = ezdxf.path.make_path(entity)
            if len(path):
                found[layer].append(np.array([(p.x, p.y) for p in path.flattening(CHORD / mm, segments=16)]) * mm)

    for entity in document.modelspace():
        take(entity, None)
    return found


def once(lines):
    """Without chains drawn twice."""
    kept, seen = [], set()
    for p in lines:
        if np.hypot(*np.diff(p, axis=0).T).sum() < TOLERANCE:
            continue
        ends = sorted((tuple(np.round(p[0], 2)), tuple(np.round(p[-1], 2))))
        key = (*ends, round(float(np.hypot(*np.diff(p, axis=0).T).sum()), 2), *np.round(p.mean(axis=0), 1))
        if key not in seen:
            seen.add(key)
            kept.append(p)
    return kept


def rings(lines):
    """Closed rings of chains whose ends meet two by two."""
    closed = [p for p in lines if math.dist(p[0], p[-1]) < TOLERANCE and len(p) > 3]
    lines = [p for p in lines if not (math.dist(p[0], p[-1]) < TOLERANCE and len(p) > 3)]
    if not lines:
        return closed
    tree = cKDTree(np.array([end for p in lines for end in (p[0], p[-1])]))
    near = [[j for j in tree.query_ball_point(tree.data[i], TOLERANCE) if j != i] for i in range(2 * len(lines))]
    left = set(range(len(lines)))
    while left:
        k = left.pop()
        ring, at = [lines[k]], 2 * k + 1
        while len(near[at]) == 1:
            at = near[at][0]
            if at // 2 == k:
                closed.append(np.concatenate(ring))
                break
            if at // 2 not in left:
                break
            left.discard(at // 2)
            ring.append(lines[at // 2] if at % 2 == 0 else lines[at // 2][::-1])
            at ^= 1
    return closed


def oracle(path):
    """mm2 of all layers, even-odd; None where ezdxf cannot read it."""
    try:
        document = ezdxf.readfile(path)
    except Exception:
        document = recover.readfile(path)[0]
    code = document.header.get("$INSUNITS", 0)
    mm = (
        MIL
        if code == 9
        else 1.0 / units.conversion_factor(units.MM, code)
        if code
        else 25.4
        if document.header.get("$MEASUREMENT", 1) == 0
        else 1.0
    )
    total = 0.0
    for lines in chains(document, mm).values():
        total += drawn(rings(once(lines)))
    return total


def drawn(loops):
    """mm2 that is cleared: even-odd by nesting, where loops of one kind that overlap are one."""
    shapes = sorted((Polygon(ring).buffer(0) for ring in loops), key=lambda shape: -shape.area)
    area, roles = Polygon(), []
    for shape in shapes:
        holders = [island for other, island in roles if other.buffer(TOLERANCE).contains(shape)]
        island = bool(holders) and not holders[-1]
        roles.append((shape, island))
        area = area.difference(shape) if island else area.union(shape)
    return area.area


def judged(path):
    """(verdict, share of the area by which it differs, what is said)."""
    try:
        found = imported(str(path), TOLERANCE, 1.0)
    except CycleError as error:
        return "refused", 0.0, str(error)
    try:
        wanted = oracle(str(path))
    except Exception as error:  # of the oracle: the drawing is not judged
        return "not judged", 0.0, repr(error)
    got = sum(area for layer in found.layers for area in layer.areas)
    off = abs(got - wanted) / max(wanted, 1e-9) if wanted or got else 0.0
    if off <= SHARE:
        return "right", off, ""
    return "said" if found.doubtful else "wrong", off, f"{got:.3f} mm2 instead of {wanted:.3f}"


def main(names):
    paths = [
        path for name in names for path in (sorted(Path(name).rglob("*.dxf")) if Path(name).is_dir() else [Path(name)])
    ]
    count, worst, longest = Counter(), 0.0, 0.0
    for path in paths:
        before = time.process_time()
        verdict, off, text = judged(path)
        count[verdict] += 1
        longest = max(longest, time.process_time() - before)
        worst = max(worst, off) if verdict == "right" else worst
        if verdict != "right":
            print(f"{path.name}: {verdict} {text}", flush=True)
    print(
        f"{len(paths)} drawings: {dict(count)}; largest error of an area {100 * worst:.3f} %, longest {longest:.1f} s "
        f"with the oracle"
    )


if __name__ == "__main__":
    main(sys.argv[1:])
