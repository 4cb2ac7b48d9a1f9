# SPDX-License-Identifier: GPL-2.0-or-later
"""A judge of G77 with several radial passes, written apart from the cycle: what the tool meets, and how often it leaves
the stock.

Called by tests/cycles/test_contour_passes.py.  It takes elements of hole_oracle.walk() and the finish shape as tuples
of contour_oracle.py; areas by shapely.
  too_early()   places of a path run before what lies between it and the stock: it meets more than the step there
  through()     most stock (mm2) that a feed crosses on its line from one path to the next
  lifts()       rapids upwards but the last
  entries()     of a closed contour: how often the tool has to come from above at least, by the regions of the tool's
  centres
"""

import math

import numpy as np
import shapely.geometry as geometry
from shapely.ops import unary_union

from support import contour_oracle as shape_oracle
from support.contour_cycle_oracle import LEVEL, plan_view

SPACING = 0.5  # mm between places that are looked at
NEAR = 2e-3  # mm: a place is on a path
END = 1e-3  # mm: nearest to an end of the shape
CHORDS = 64  # of a quarter circle


def lifts(elements):
    """Rapids upwards below the clearance plane, but the last."""
    return sum(e.kind == "rapid" and e.b[2] > e.a[2] + LEVEL for e in elements[1:-1])


def _feet(finish, p):
    """Distances (m,) of places p (m, 2), the unit vectors (m, 2) away from the shape, and where there is one foot
    alone."""
    h = 1e-5
    step = h * np.array([(1, 0), (-1, 0), (0, 1), (0, -1), (0, 0)])
    gaps = shape_oracle.nearest(finish, (p[:, None] + step).reshape(-1, 2)).reshape(-1, 5)
    away = np.stack((gaps[:, 0] - gaps[:, 1], gaps[:, 2] - gaps[:, 3]), axis=1) / (2 * h)
    return gaps[:, 4], away, np.abs(np.hypot(*away.T) - 1.0) < 1e-4


def _flat(elements):
    """(z, view) of every feed along a level, in its order."""
    return [
        (e.a[2], plan_view(e))
        for e in elements
        if e.kind != "rapid" and abs(e.a[2] - e.b[2]) < LEVEL and plan_view(e) is not None
    ]


def too_early(elements, finish, distances, closed):
    """[(z, x, y)] where a path of one pass is run before the place next to it of the pass that is a step further
    out."""
    found, done = [], {}
    ends = np.array([shape_oracle.point(finish[0], [0.0])[0], shape_oracle.point(finish[-1], [1.0])[0]])
    for z, view in _flat(elements):
        p = shape_oracle.samples([view], SPACING)
        d, away, one = _feet(finish, p)
        number = int(np.argmin([abs(float(np.median(d)) - at) for at in distances]))
        if number:
            far, run = distances[number - 1], done.get((round(z, 4), number - 1), [])
            beside = p + away * (far - d)[:, None]
            one &= (np.abs(d - distances[number]) < 1e-6) & (np.abs(shape_oracle.nearest(finish, beside) - far) < 1e-6)
            if not closed:
                one &= np.hypot(*np.moveaxis((p - away * d[:, None])[:, None] - ends, 2, 0)).min(axis=1) > END
            beside = beside[one]
            early = shape_oracle.nearest(run, beside) > NEAR if len(beside) else []
            found += [(z, *place) for place in beside[early].tolist()] if len(beside) else []
        done.setdefault((round(z, 4), number), []).append(view)
    return found


def _area(view, radius):
    """What a tool sweeps along a view."""
    points = shape_oracle.point(
        view, np.linspace(0.0, 1.0, 2 if view[0] == "L" else 2 + math.ceil(abs(view[7]) / 0.02))
    )
    return geometry.LineString(points).buffer(radius, CHORDS)


def through(elements, finish, distances, radius):
    """mm2 of stock that the tool meets at most on a straight feed from path to path: neither its ends nor its middle
    are on a pass."""
    worst, done = 0.0, {}
    for z, view in _flat(elements):
        area, key = _area(view, radius), round(z, 4)
        run = done.setdefault(key, [])
        gaps = shape_oracle.nearest(finish, shape_oracle.point(view, [0.02, 0.5, 0.98]))
        on = [min(abs(gap - d) for d in distances) < NEAR for gap in gaps]
        if view[0] == "L" and not any(on):
            worst = max(worst, area.buffer(-0.02).difference(unary_union(run)).area)
        run.append(area)
    return worst


def entries(polygon, inside, distances, levels):
    """How often the tool comes from above at least: once for each region of tool centres of the inner pass that has no
    parts further out, else for each such part on each level."""
    far = max(distances) + 1.0
    box = geometry.box(*polygon.bounds).buffer(4 * far)
    found = []
    for d in distances:
        region = polygon.buffer(-d, CHORDS) if inside else box.difference(polygon.buffer(d, CHORDS))
        found.append([part for part in getattr(region, "geoms", [region]) if part.area > 1e-6])
    total = 0
    for chamber in found[-1]:
        leaves = sum(
            chamber.intersects(part)
            and not any(part.contains(other.representative_point()) for other in (found[k - 1] if k else []))
            for k, parts in enumerate(found)
            for part in parts
        )
        total += 1 if leaves == 1 else leaves * levels
    return total
