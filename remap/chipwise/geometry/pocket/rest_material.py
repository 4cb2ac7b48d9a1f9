# SPDX-License-Identifier: GPL-2.0-or-later
"""What the Tracks of a machinable region leave, and the Tracks that take it: corners between wide rings.

Called by cycles/pocket.py after any strategy.  Polygons by geometry/base/polygons.py, drawn so that
nothing left is overlooked: a kerf is drawn too narrow by SAGITTA_MM.

Because the last Tracks run every contour of the machinable region, everything within a tool radius of those
is cut.  So whatever is left lies inside the machinable region, and the tool may be anywhere on it: a piece
that fits a circle of the tool's radius is gone when the tool has been at that circle's centre.
"""

import numpy as np

from chipwise.geometry.base import elements, polygons
from chipwise.geometry.base.enclosing_circle import enclosing_circle
from chipwise.geometry.base import chains
from chipwise.geometry.pocket.machinable import allowed, clear_segment
from chipwise.geometry.pocket.tracks import make_track

# How much too small kerfs are drawn. mm; also how coarsely arcs are flattened.
SAGITTA_MM = 1e-3

# Side, in tool radii, of the squares that larger rest material is cut into: half the diagonal is
# 0.71 radii, so the tool clears one from its middle.
CELL = 1.0

# Smallest area worth a look, in squares of the tool radius: rounding along kerfs.
SMALLEST = 1e-9


def rest_parts(region, tracks, radius):
    """Connected regions (polygons.py) of a machinable region that no Track reaches."""
    if not tracks or not region.area > SMALLEST * radius * radius:
        return []
    area = polygons.area_region(
        chains.flat(region.boundary, SAGITTA_MM), [chains.flat(hole, SAGITTA_MM) for hole in region.holes]
    )
    kerfs = polygons.kerfs([chains.flat(t.elements, SAGITTA_MM) for t in tracks], radius - SAGITTA_MM, SAGITTA_MM)
    return polygons.large_parts(polygons.subtract(area, kerfs), SMALLEST * radius * radius)


def rest_tracks(region, tracks, radius):
    """Tracks for everything the given ones left inside the tool's reach."""
    centres = [np.array(s) for s in _centres(rest_parts(region, tracks, radius), radius)]
    centres = [s[allowed(region, s)] for s in centres]  # never trust a polygon with a wall
    centres = [s for s in centres if len(s)]
    if not centres:
        return ()
    path = elements.join([t.elements for t in tracks])
    return tuple(_tour(region, centres, path, tracks[-1].end, radius))


def _centres(parts, radius):
    """Tool centres (m, 2) that clear the parts, those of one part in a row."""
    found = []
    for part in parts:
        x, y, size = enclosing_circle(polygons.outline_points(part))
        if size <= 2.0 * (radius - 2.0 * SAGITTA_MM):
            found.append([(x, y)])
            continue
        found.append(
            [enclosing_circle(polygons.outline_points(cell))[:2] for cell in polygons.cells(part, CELL * radius)]
        )
    return found


def _tour(region, groups, path, here, radius):
    """Groups of centres, the nearest next, joined by lines where the machinable region allows."""
    groups, points, made = list(groups), None, []
    while groups:
        ends = np.array([(g[0], g[-1]) for g in groups])
        gap = np.hypot(*np.moveaxis(ends - here, 2, 0))
        k, last = np.unravel_index(chains.least(gap), gap.shape)
        group = groups.pop(k)[:: -1 if last else 1]
        for centre in group:
            if points is None or not clear_segment(region, points[-1], centre):
                made += _track(points)
                points = _from(region, path, centre)
            points.append(centre)
        here = points[-1]
    return made + _track(points)


def _from(region, path, centre):
    """The position on paths already cut from which a centre is reached by a straight line."""
    _, index, t = chains.nearest(path, centre)
    position = chains.point(path, index, t)
    return [position] if clear_segment(region, position, centre) else [centre]


def _track(points):
    """Track through points, in a list."""
    if not points:
        return []
    points = np.array(points if len(points) > 1 else points * 2)
    return [make_track(elements.make_lines(points[:-1], points[1:]))]
