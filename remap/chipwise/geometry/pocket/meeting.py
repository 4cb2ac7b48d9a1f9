# SPDX-License-Identifier: GPL-2.0-or-later
"""What a tool can do in a pocket whose contours meet, as far as it can be computed: paths exactly, regions in chords.

Called by drawing/data.py.  kernel.py names rough shapes and inaccessible regions from the positions where the tool
touches the contours; if contours cross each other these are no longer the edge of the free area, so here the regions
are polygons: the free area less what the tool covers from anywhere it may be.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base import elements, polygons
from chipwise.geometry.base.elements import Elements, make_lines
from chipwise.geometry.offset.necks import InaccessibleRegion
from chipwise.geometry.offset.kernel import pocket_ring
from chipwise.geometry.base import chains
from chipwise.geometry.pocket.machinable import machinable_regions

# How coarsely arcs are flattened. mm
SAGITTA_MM = 1e-3

# A part that is nowhere wider than this is rounding of the chords. mm
SLIVER_MM = 6.0 * SAGITTA_MM


@dataclass(frozen=True, eq=False)
class MeetingResult:
    """As OffsetResult; there are no rough shapes, and the regions' edges are lines."""

    paths: tuple
    inaccessible: tuple
    rough: tuple = ()
    loose: int = 0


def offset_meeting(pocket, distance):
    """MixedResult of a Pocket (kernel.py) for a tool that keeps `distance` (mm) from its contours."""
    ring = pocket_ring(pocket, distance)
    loops = [polygons.area_region(chains.flat(c.elements, SAGITTA_MM)) for c in pocket.contours]
    rest = polygons.subtract(loops[0], polygons.joined(loops[1:])) if loops[1:] else loops[0]
    for region in machinable_regions(pocket, distance):
        rest = polygons.subtract(rest, _covered(region, distance))
    wide = [part for part in polygons.large_parts(rest) if not polygons.shrink(part, 0.5 * SLIVER_MM).is_empty]
    return MeetingResult(ring.paths, tuple(_region(pocket, part) for part in wide), loose=ring.loose)


def _covered(region, distance):
    """Region that the tool reaches from a machinable region."""
    outline = chains.flat(region.boundary, SAGITTA_MM)
    if len(outline) < 4 or region.area <= 0.0:
        return polygons.kerfs([outline], distance, SAGITTA_MM)
    inner = polygons.area_region(outline, [chains.flat(hole, SAGITTA_MM) for hole in region.holes])
    return polygons.grown(inner, distance, SAGITTA_MM)


def _region(pocket, part):
    """InaccessibleRegion of a polygon."""
    outline, *holes = (_closed_chain(ring) for ring in polygons.rings(part))
    return InaccessibleRegion(
        polygons.area_of(part), _lines(pocket, outline), outline, np.arange(len(outline)), tuple(holes)
    )


def _closed_chain(ring) -> Elements:
    points = np.array(ring, float)[:, :2]
    return make_lines(points[:-1], points[1:])


def _lines(pocket, outline):
    """Source lines of the contour elements that run along an outline: near the middle of one of its lines."""
    middle, found = 0.5 * (outline.start + outline.end), set()
    for contour in pocket.contours:
        for k, line in enumerate(contour.line):
            gap = elements.distances(contour.elements, np.full(len(middle), k), middle)
            if np.min(gap) <= 2.0 * SAGITTA_MM:
                found.add(int(line))
    return tuple(sorted(found))
