"""Regions of the work plane and what kerfs leave of them: every shapely call of the package stands here.

Called by geometry/chop.py (and later by the contour cycles).  mm, work coordinates.  Works with shapely 1.8
(Debian 12) and 2 (Debian 13): only calls that both have, no array functions.

A promise about loose pieces ("none reaches H") is kept only if no piece is computed too small.  So a region that
becomes pieces is described from outside (its polygon holds the true arc), a kerf from inside.
"""

import math

from shapely.geometry import LineString, MultiPoint, Point, Polygon
from shapely.ops import unary_union
from shapely.validation import make_valid

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


# ---- pockets: what is left, in polygons -------------------------------------------------------------------------

# Points of a way that become one kerf: long ways that cross themselves are slow to widen at once.
KERF_POINTS = 40


def area_region(outline, holes=()):
    """A region from an outline and holes, each (n, 2) float, mm, that may touch themselves or one another, or run there
    and back on themselves.  One loop at a time: make_valid() of all together takes touching holes for area."""
    shape = Polygon(outline, holes)
    if shape.is_valid:
        return shape
    return _valid(outline).difference(unary_union([_valid(hole) for hole in holes]))


def _valid(outline):
    """The area within one loop."""
    shape = Polygon(outline)
    return shape if shape.is_valid else unary_union(_parts(make_valid(shape)))


def arc_corners(radius, sagitta):
    """Corners per quarter turn of a disc of `radius` (mm) drawn inside the true one within `sagitta` (mm)."""
    return max(4, math.ceil(math.pi / 4 / math.acos(1 - min(sagitta / radius, 1.0))))


def kerfs(ways, half_width, sagitta):
    """Everything nearer than `half_width` (mm) to ways, each (n, 2) float; drawn inside within `sagitta`."""
    corners, drawn = arc_corners(half_width, sagitta), []
    for way in ways:
        for first in range(0, max(len(way) - 1, 1), KERF_POINTS):
            points = way[first:first + KERF_POINTS + 1]
            drawn.append((LineString(points) if len(points) > 1 else Point(points[0])).buffer(half_width, corners))
    return unary_union(drawn)


def subtract(region, taken):
    """A region less another."""
    return region.difference(taken)


def joined(regions):
    """One region from several."""
    return unary_union(list(regions))


def parts(region, smallest=SLIVER_AREA):
    """The connected parts of a region larger than `smallest` (mm2)."""
    return [part for part in _parts(region) if part.area > smallest]


def outline_points(region):
    """Corners (n, 2) of a connected region's outline, mm."""
    return [(x, y) for x, y, *_ in region.exterior.coords]


def cells(region, size):
    """A region cut by a square grid of `size` (mm): its parts, row by row to and fro."""
    low_x, low_y, high_x, high_y = region.bounds
    columns, rows = (max(1, math.ceil((high - low) / size)) for low, high in ((low_x, high_x), (low_y, high_y)))
    found = []
    for row in range(rows):
        for column in (range(columns) if row % 2 == 0 else range(columns - 1, -1, -1)):
            x, y = low_x + column * size, low_y + row * size
            found += parts(region.intersection(box(x, y, x + size, y + size)))
    return found


def grown(region, distance, sagitta):
    """A region and everything nearer to it than `distance` (mm)."""
    return region.buffer(distance, arc_corners(distance, sagitta))


def area_of(region):
    """mm2"""
    return region.area


def place_in(region):
    """(x, y) mm of a point inside a region."""
    point = region.representative_point()
    return point.x, point.y
