"""What the Tracks of a Field leave, and the Tracks that take it: corners between wide rings.

Called by cycles/pocket.py after any strategy.  Polygons by geometry/regions.py, drawn so that
nothing left is overlooked: a kerf is drawn too narrow by SAGITTA_MM.

Because the last Tracks run every contour of the Field, everything within a tool radius of those
is cut.  So whatever is left lies inside the Field, and the tool may stand on all of it: a piece
that fits a circle of the tool's radius is gone when the tool has been at that circle's centre.
"""
import numpy as np

from .. import elements, regions
from ..chop import enclosing_circle
from . import runs
from .fields import allowed, clear_way
from .tracks import make_track

# How much too small kerfs are drawn. mm; also how coarsely arcs are flattened.
SAGITTA_MM = 1e-3

# Side, in tool radii, of the squares that larger leftovers are cut into: half the diagonal is
# 0.71 radii, so the tool clears one from its middle.
CELL = 1.0

# Smallest area worth a look, in squares of the tool radius: rounding along kerfs.
SMALLEST = 1e-9


def left_parts(field, tracks, radius):
    """Connected regions (regions.py) of a Field that no Track reaches."""
    if not tracks or not field.area > SMALLEST * radius * radius:
        return []
    area = regions.area_region(runs.flat(field.boundary, SAGITTA_MM),
                               [runs.flat(hole, SAGITTA_MM) for hole in field.holes])
    kerfs = regions.kerfs([runs.flat(t.elements, SAGITTA_MM) for t in tracks],
                          radius - SAGITTA_MM, SAGITTA_MM)
    return regions.large_parts(regions.subtract(area, kerfs), SMALLEST * radius * radius)


def leftovers(field, tracks, radius):
    """Tracks for everything the given ones left inside the tool's reach."""
    spots = [np.array(s) for s in _spots(left_parts(field, tracks, radius), radius)]
    spots = [s[allowed(field, s)] for s in spots]     # never trust a polygon with a wall
    spots = [s for s in spots if len(s)]
    if not spots:
        return ()
    way = elements.join([t.elements for t in tracks])
    return tuple(_tour(field, spots, way, tracks[-1].end, radius))


def _spots(parts, radius):
    """Tool centres (m, 2) that clear the parts, those of one part in a row."""
    found = []
    for part in parts:
        x, y, size = enclosing_circle(regions.outline_points(part))
        if size <= 2.0 * (radius - 2.0 * SAGITTA_MM):
            found.append([(x, y)])
            continue
        found.append([enclosing_circle(regions.outline_points(cell))[:2]
                      for cell in regions.cells(part, CELL * radius)])
    return found


def _tour(field, groups, way, here, radius):
    """Groups of spots, the nearest next, joined by lines where the Field allows."""
    groups, points, made = list(groups), None, []
    while groups:
        ends = np.array([(g[0], g[-1]) for g in groups])
        gap = np.hypot(*np.moveaxis(ends - here, 2, 0))
        k, last = np.unravel_index(runs.least(gap), gap.shape)
        group = groups.pop(k)[::-1 if last else 1]
        for spot in group:
            if points is None or not clear_way(field, points[-1], spot):
                made += _track(points)
                points = _from(field, way, spot)
            points.append(spot)
        here = points[-1]
    return made + _track(points)


def _from(field, way, spot):
    """The place on ways already cut from which a spot is reached by a straight line."""
    _, index, t = runs.nearest(way, spot)
    place = runs.point(way, index, t)
    return [place] if clear_way(field, place, spot) else [spot]


def _track(points):
    """Track through points, in a list."""
    if not points:
        return []
    points = np.array(points if len(points) > 1 else points * 2)
    return [make_track(elements.make_lines(points[:-1], points[1:]))]
