# SPDX-License-Identifier: GPL-2.0-or-later
"""A region cut back from its edge, with as few corners as that allows.  Called by geometry/pocket/concentric.py.
mm."""

import math

import numpy as np
from shapely.geometry import LineString, Polygon
from shapely.geometry.polygon import orient
from shapely.ops import polygonize, unary_union

from chipwise.geometry.base import polygons


def inner_polygons(outline, holes, distance, straying):
    """What lies further inside than `distance` (mm), with as few corners as that allows.

    outline, holes: (n, 2) float, mm, the outline counter-clockwise, holes clockwise; they may touch or cross by
    rounding.  straying: the result keeps `distance` but may stay up to this much (mm) further away.
    Returns [(outline (n, 2) counter-clockwise, [holes (m, 2) clockwise])], without closing points.
    """
    region = Polygon(outline, holes)
    if not region.is_valid:
        region = _wound_once([outline, *holes])
    shrunk = region.buffer(-distance - 0.5 * straying, join_style=2)
    simple = shrunk.simplify(0.5 * straying)
    if not simple.is_valid:
        simple = shrunk
    found = []
    for part in polygons.parts(simple):
        part = orient(part)
        if part.area > polygons.SLIVER_AREA:
            found.append((np.array(part.exterior.coords)[:-1], [np.array(r.coords)[:-1] for r in part.interiors]))
    return found


def _wound_once(rings):
    """The region that rings (n, 2) which cross each other wind about exactly once."""
    closed = [np.concatenate((ring, ring[:1])) for ring in rings]
    faces = polygonize(unary_union([LineString(ring) for ring in closed if len(ring) > 2]))
    return unary_union([face for face in faces if _winding(closed, face.representative_point().coords[0]) == 1])


def _winding(closed, point):
    """How often closed rings (n, 2) wind about a point (x, y)."""
    turns = 0.0
    for ring in closed:
        x, y = (ring - point).T
        turns += np.sum(np.arctan2(x[:-1] * y[1:] - y[:-1] * x[1:], x[:-1] * x[1:] + y[:-1] * y[1:]))
    return round(turns / (2.0 * math.pi))
