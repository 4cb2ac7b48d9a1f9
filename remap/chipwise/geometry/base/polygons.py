# SPDX-License-Identifier: GPL-2.0-or-later
"""Regions of the work plane and what kerfs leave of them.  inner_polygons.py and this file have every call of shapely.

Called by geometry/slug/ and geometry/pocket/.  mm, work coordinates.  Works with shapely 1.8
(Debian 12) and 2 (Debian 13): only calls that both have, no array functions.

A promise about loose pieces ("none reaches H") is kept only if no piece is computed too small.  So a region that
becomes pieces is described from outside (its polygon holds the true arc), a kerf from inside.
"""

import math
from typing import NamedTuple

from shapely import affinity
from shapely.geometry import LineString, MultiPoint, Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import polygonize, polylabel, unary_union
from shapely.prepared import prep
from shapely.validation import make_valid

# A loose bit below this area has no size that matters and is what rounding leaves along a kerf. mm2
SLIVER_AREA = 1e-9

# Corners per quarter turn of a kerf's round end. Drawn inside the true arc: 16 lose 0.12 % of the radius.
CAP_CORNERS = 16


# A kerf that ends at the wall is drawn so much short of it at most; what is joined to the part by less is not joined.
# mm
WALL_GAP = 0.004


def outer_disc(cx, cy, radius, sagitta):
    """A polygon around the disc: it holds every point of the disc and reaches at most `sagitta` (mm) beyond.

    cx, cy, radius: mm.  A corner lies at 0 degrees, the number of corners is a multiple of 4.
    """
    half_angle = math.acos(radius / (radius + sagitta))
    corners = 4 * max(4, math.ceil(math.pi / half_angle / 4))
    reach = radius / math.cos(math.pi / corners)
    return Polygon(
        [
            (cx + reach * math.cos(2 * math.pi * k / corners), cy + reach * math.sin(2 * math.pi * k / corners))
            for k in range(corners)
        ]
    )


def polygon_region(outline, holes=()):
    """A region from an outline and islands, each (n, 2) float, mm; closed or not."""
    return Polygon(outline, holes)


def loop_regions(outlines, islands=()):
    """Regions of closed loops: outlines and islands, each (n, 2) float, mm, corners of a polygon.

    A loop that touches itself, as the centre path does in a slot as wide as the tool, falls into the faces it goes
    round.  Returns one region per face, islands cut out of it; loops without area give none.
    """
    faces = [face for loop in outlines for face in _faces(loop)]
    blocks = [block for loop in islands for block in _faces(loop)]
    if blocks:
        faces = [part for face in faces for part in parts(face.difference(unary_union(blocks)))]
    return [face for face in faces if face.area > SLIVER_AREA]


def _faces(loop):
    """The polygons a closed loop goes round."""
    face = Polygon(loop) if len(loop) > 2 else Polygon()
    if face.is_valid:
        return [face] if not face.is_empty else []
    ring = LineString([*loop, loop[0]])
    return [part for part in polygonize(unary_union([ring]))]


def parts(shape):
    """The polygons of any shapely result."""
    if shape.is_empty:
        return []
    if shape.geom_type == "Polygon":
        return [shape]
    return [part for one in getattr(shape, "geoms", ()) for part in parts(one)]


def shrink(region, distance):
    """The region without everything nearer to its edge than `distance` (mm); may fall apart."""
    return region.buffer(-distance, CAP_CORNERS)


def grow(region, distance):
    """The region with everything nearer to it than `distance` (mm), its round corners drawn from inside."""
    return region.buffer(distance, CAP_CORNERS)


def rotated(region, angle):
    """The region turned about the origin by an angle, rad, counter-clockwise."""
    return affinity.rotate(region, angle, origin=(0.0, 0.0), use_radians=True)


def outside_ring(region):
    """Corners (n, 2) of the outer edge of a connected region, mm, the first one again at the end."""
    return list(region.exterior.coords)


def rings(region):
    """All edges of a connected region, the outer one first."""
    return [list(ring.coords) for ring in (region.exterior, *region.interiors)]


def hull(region):
    """Corners of the convex hull: they have the same smallest circle as the region."""
    corners = MultiPoint(list(region.exterior.coords)).convex_hull
    return list(corners.exterior.coords if corners.geom_type == "Polygon" else corners.coords)


def clipped(region, low_x, low_y, high_x, high_y):
    """The connected parts of a region within a rectangle, mm."""
    return [part for part in parts(region.intersection(box(low_x, low_y, high_x, high_y))) if part.area > SLIVER_AREA]


def without(region, segments, half_width, inner=None):
    """The region without straight kerfs: ((x0, y0), (x1, y1)) and half width, mm; and without a region inside it."""
    kerfs = [LineString(segment).buffer(half_width, CAP_CORNERS) for segment in segments]
    if inner is not None and not inner.is_empty:
        region, kerfs = region.difference(inner), [kerf.difference(inner) for kerf in kerfs]
    return region.difference(unary_union(kerfs)) if kerfs else region


def badly_held(stock, waste, thickness, reaching=0.0):
    """What may break off the stock where a bridge thinner than `thickness` (mm) cannot be trusted.

    stock   all material there is; waste: the region in which none is held from outside
    A part of the stock is firm if it reaches out of the waste and stays joined to there when its edge is cut back by
    half the thickness.  Returns the hulls of all other parts that have a body: each with everything that hangs on
    it, bridges of any thickness counted as holding, so that it is as large as it may be.  Those are left out whose
    bounding box has a diagonal below `reaching`, mm.
    """
    bodies = parts(stock.buffer(-thickness / 2, CAP_CORNERS))
    inside = prep(waste)
    loose = [body for body in bodies if inside.contains(body)]
    if not loose:
        return []
    firm = [body for body in bodies if not inside.contains(body)]
    rest = stock.intersection(waste)
    if firm:
        rest = rest.difference(unary_union(firm).buffer(thickness / 2 * 1.01, CAP_CORNERS))
    large = [part for part in parts(rest) if diagonal(part) >= reaching]
    return [hull(part) for part in large if any(body.intersects(part) for body in loose)]


def released_with_rim(stock, waste, path, half_width, thickness, reaching=0.0):
    """What may fall while a pass along the wall is cut, with material that the rest of the pass would still take off.

    stock, waste, thickness, reaching   as badly_held; path: the region whose edge the tool's centre follows, within
    half_width (mm) of the waste's edge
    A body that holds firmly to some positions of the wall, and to others by bridges thinner than `thickness` only,
    falls when the last firm one is cut, if the thin ones break inside the wall.  Only firm bridges that its own body
    reaches count: what another body holds may break off it.  Returns hulls.
    """
    bodies = [
        body for part in parts(stock.buffer(-thickness / 2, CAP_CORNERS)) for body in parts(part.intersection(waste))
    ]
    edge, found, wall = waste.boundary, [], _WallPass(path, half_width, thickness)
    firm = [body for body in bodies if body.distance(edge) < WALL_GAP]
    band = waste.buffer(-WALL_GAP).difference(waste.buffer(-thickness / 2))
    for region in parts(stock.intersection(waste.buffer(-WALL_GAP))):
        mine = [body for body in firm if body.intersects(region)] if diagonal(region) >= reaching else []
        contacts = parts(region.intersection(band)) if mine else []
        for body in mine:
            held = [contact for contact in contacts if contact.intersects(body)]
            if len(held) < len(contacts):
                found += wall.fallen(region, body, [b for b in mine if b is not body], held)
    return [hull(part) for part in found if diagonal(part) >= reaching]


class _WallPass(NamedTuple):
    """A pass along a wall, as in released_with_rim()."""

    path: BaseGeometry
    half_width: float
    thickness: float

    def fallen(self, region, body, others, held):
        """The parts of a region that fall with a body when the pass has cut its contacts `held`; other bodies broken
        off."""
        over = self.path.boundary.intersection(unary_union(held).buffer(self.half_width + self.thickness))
        taken = [over.buffer(self.half_width, CAP_CORNERS)]
        taken += [other.buffer(self.thickness / 2 * 1.01, CAP_CORNERS) for other in others]
        return [part for part in parts(region.difference(unary_union(taken))) if part.intersects(body)]


def bounds(region):
    """(min_x, min_y, max_x, max_y) of a region, mm; None where empty."""
    return None if region.is_empty else region.bounds


def chords(region, axis, at):
    """Where the straight line x = at (axis 0) or y = at (axis 1) runs inside the region.

    Returns a list of (low, high), mm, along the other axis, in rising order.
    """
    if region.is_empty:
        return []
    limits = region.bounds
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
    return [
        hull(part)
        for part in parts(without(region, segments, half_width))
        if part.area > SLIVER_AREA and diagonal(part) >= reaching
    ]


def diagonal(region):
    """Diagonal (mm) of the region's bounding box: no point is farther from another."""
    low_x, low_y, high_x, high_y = region.bounds
    return math.hypot(high_x - low_x, high_y - low_y)


def inner_radius(region, tolerance):
    """Radius (mm) of a circle inside a connected region, the largest one within about `tolerance`."""
    try:
        centre = polylabel(region, tolerance)
    except Exception:  # shapely 1.8 raises what GEOS calls the fault of a needle's centroid
        return 0.0
    return centre.distance(region.boundary)


# ---- pockets: what is left, in polygons -------------------------------------------------------------------------

# Points of a path that become one kerf: long paths that cross themselves are slow to widen at once.
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
    return shape if shape.is_valid else unary_union(parts(make_valid(shape)))


def arc_corners(radius, sagitta):
    """Corners per quarter turn of a disc of `radius` (mm) drawn inside the true one within `sagitta` (mm)."""
    return max(4, math.ceil(math.pi / 4 / math.acos(1 - min(sagitta / radius, 1.0))))


def kerfs(paths, half_width, sagitta):
    """Everything nearer than `half_width` (mm) to paths, each (n, 2) float; drawn inside within `sagitta`."""
    corners, drawn = arc_corners(half_width, sagitta), []
    for path in paths:
        for first in range(0, max(len(path) - 1, 1), KERF_POINTS):
            points = path[first : first + KERF_POINTS + 1]
            drawn.append((LineString(points) if len(points) > 1 else Point(points[0])).buffer(half_width, corners))
    return unary_union(drawn)


def subtract(region, taken):
    """A region less another."""
    return region.difference(taken)


def joined(regions):
    """One region from several."""
    return unary_union(list(regions))


def large_parts(region, smallest=SLIVER_AREA):
    """The connected parts of a region larger than `smallest` (mm2)."""
    return [part for part in parts(region) if part.area > smallest]


def outline_points(region):
    """Corners (n, 2) of a connected region's outline, mm."""
    return [(x, y) for x, y, *_ in region.exterior.coords]


def cells(region, size):
    """A region cut by a square grid of `size` (mm): its parts, row by row to and fro."""
    low_x, low_y, high_x, high_y = region.bounds
    columns, rows = (max(1, math.ceil((high - low) / size)) for low, high in ((low_x, high_x), (low_y, high_y)))
    found = []
    for row in range(rows):
        for column in range(columns) if row % 2 == 0 else range(columns - 1, -1, -1):
            x, y = low_x + column * size, low_y + row * size
            found += large_parts(region.intersection(box(x, y, x + size, y + size)))
    return found


def grown(region, distance, sagitta):
    """A region and everything nearer to it than `distance` (mm)."""
    return region.buffer(distance, arc_corners(distance, sagitta))


def area_of(region):
    """mm2"""
    return region.area


def point_in(region):
    """(x, y) mm of a point inside a region."""
    point = region.representative_point()
    return point.x, point.y


def meeting_boxes(regions):
    """For each region the set of numbers of the others whose bounding boxes meet its own."""
    box = [region.bounds if not region.is_empty else (math.inf, math.inf, -math.inf, -math.inf) for region in regions]
    order = sorted(range(len(box)), key=lambda k: box[k][0])
    found, open_ones = [set() for _ in box], []
    for k in order:
        open_ones = [m for m in open_ones if box[m][2] >= box[k][0]]
        for m in open_ones:
            if box[m][1] <= box[k][3] and box[k][1] <= box[m][3]:
                found[k].add(m)
                found[m].add(k)
        open_ones.append(k)
    return found


def shared(region, other):
    """What two regions have in common."""
    return region.intersection(other)


def reaches_beyond(part, edges, depth):
    """Whether a part that regions have in common reaches further than `depth` (mm) from the edge of one of them."""
    around = part.envelope.buffer(2.0 * depth)
    return any(not part.difference(grow(one.boundary.intersection(around), depth)).is_empty for one in edges)
