"""Regions of the work plane and what kerfs leave of them: every shapely call of the package stands here.

Called by geometry/chop.py (and later by the contour cycles).  mm, work coordinates.  Works with shapely 1.8
(Debian 12) and 2 (Debian 13): only calls that both have, no array functions.

A promise about loose pieces ("none reaches H") is kept only if no piece is computed too small.  So a region that
becomes pieces is described from outside (its polygon holds the true arc), a kerf from inside.
"""

import math

import numpy as np
from shapely.geometry import LineString, MultiPoint, Polygon
from shapely.geometry.polygon import orient
from shapely.ops import polygonize, unary_union

# A loose bit below this area has no size that matters and is what rounding leaves along a kerf. mm2
SLIVER_AREA = 1e-9

# Corners per quarter turn of a kerf's round end. Drawn inside the true arc: 16 lose 0.12 % of the radius.
CAP_CORNERS = 16


def outer_disc(cx, cy, radius, sagitta):
    """A polygon around the disc: it holds every point of the disc and reaches at most `sagitta` (mm) beyond.

    cx, cy, radius: mm.  A corner lies at 0 degrees, the number of corners is a multiple of 4.
    """
    half_angle = math.acos(radius / (radius + sagitta))
    corners = 4 * max(4, math.ceil(math.pi / half_angle / 4))
    reach = radius / math.cos(math.pi / corners)
    return Polygon([(cx + reach * math.cos(2 * math.pi * k / corners), cy + reach * math.sin(2 * math.pi * k / corners))
                    for k in range(corners)])


def polygon_region(outline, holes=()):
    """A region from an outline and islands, each (n, 2) float, mm; closed or not."""
    return Polygon(outline, holes)


def _parts(shape):
    """The polygons of any shapely result."""
    if shape.is_empty:
        return []
    if shape.geom_type == "Polygon":
        return [shape]
    return [part for one in getattr(shape, "geoms", ()) for part in _parts(one)]


def shrink(region, distance):
    """The region without everything nearer to its edge than `distance` (mm); may fall apart."""
    return region.buffer(-distance, CAP_CORNERS)


def bounds(region):
    """(min_x, min_y, max_x, max_y) of a region, mm; None where empty."""
    return None if region.is_empty else region.bounds


def chords(region, axis, at):
    """Where the straight line x = at (axis 0) or y = at (axis 1) runs inside the region.

    Returns a list of (low, high), mm, along the other axis, in rising order.
    """
    limits = bounds(region)
    if limits is None:
        return []
    low, high = limits[1 - axis] - 1.0, limits[3 - axis] + 1.0
    ends = [(at, low), (at, high)] if axis == 0 else [(low, at), (high, at)]
    cut = region.intersection(LineString(ends))
    found = []
    for part in getattr(cut, "geoms", [cut]):
        if part.geom_type == "LineString" and not part.is_empty:
            along = [point[1 - axis] for point in part.coords]
            found.append((min(along), max(along)))
    return sorted(found)


def box(low_x, low_y, high_x, high_y):
    """A rectangle, mm."""
    return Polygon([(low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y)])


def pieces(region, segments, half_width, reaching=0.0):
    """What straight kerfs leave of a region.

    region      a region of this module
    segments    ((x0, y0), (x1, y1)) of each tool path, mm
    half_width  tool radius, mm
    reaching    leave out pieces whose bounding box has a shorter diagonal (mm): they fit any circle of that diameter
    Returns the outlines of the pieces, each a list of (x, y): the corners of its convex hull, which have the same
    enclosing circle as the piece.
    """
    kerfs = [LineString(segment).buffer(half_width, CAP_CORNERS) for segment in segments]
    left = region.difference(unary_union(kerfs)) if kerfs else region
    outlines = []
    for part in _parts(left):
        low_x, low_y, high_x, high_y = part.bounds
        if part.area > SLIVER_AREA and math.hypot(high_x - low_x, high_y - low_y) >= reaching:
            hull = MultiPoint(list(part.exterior.coords)).convex_hull
            ring = hull.exterior.coords if hull.geom_type == "Polygon" else hull.coords
            outlines.append(list(ring))
    return outlines


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
    for part in _parts(simple):
        part = orient(part)
        if part.area > SLIVER_AREA:
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
