"""What a tool can do in a pocket whose contours meet, as far as it can be told: paths exactly, regions in chords.

Called by cli/contour.py.  offset.py names rough shapes and unreachable regions from the places where the tool touches
the contours; where contours cross each other these are no longer the edge of the free area, so here the regions are
polygons: the free area less what the tool covers from anywhere it may be.
"""
from dataclasses import dataclass

import numpy as np

from .. import elements, regions
from ..elements import Elements, make_lines
from ..necks import UnreachableRegion
from ..offset import pocket_ring
from . import runs
from .fields import fields_at

# How coarsely arcs are flattened. mm
SAGITTA_MM = 1e-3

# A part that is nowhere wider than this is rounding of the chords. mm
SLIVER_MM = 6.0 * SAGITTA_MM


@dataclass(frozen=True, eq=False)
class MixedResult:
    """As OffsetResult; there are no rough shapes, and the regions' edges are lines."""
    paths: tuple
    unreachable: tuple
    rough: tuple = ()
    loose: int = 0


def offset_mixed(pocket, distance):
    """MixedResult of a Pocket (offset.py) for a tool that keeps `distance` (mm) from its contours."""
    ring = pocket_ring(pocket, distance)
    loops = [regions.area_region(runs.flat(c.elements, SAGITTA_MM)) for c in pocket.contours]
    rest = regions.subtract(loops[0], regions.joined(loops[1:])) if loops[1:] else loops[0]
    for field in fields_at(pocket, distance):
        rest = regions.subtract(rest, _covered(field, distance))
    wide = [part for part in regions.large_parts(rest) if not regions.shrink(part, 0.5 * SLIVER_MM).is_empty]
    return MixedResult(ring.paths, tuple(_region(pocket, part) for part in wide), loose=ring.loose)


def _covered(field, distance):
    """Region that the tool reaches from a Field."""
    outline = runs.flat(field.boundary, SAGITTA_MM)
    if len(outline) < 4 or field.area <= 0.0:
        return regions.kerfs([outline], distance, SAGITTA_MM)
    inner = regions.area_region(outline, [runs.flat(hole, SAGITTA_MM) for hole in field.holes])
    return regions.grown(inner, distance, SAGITTA_MM)


def _region(pocket, part):
    """UnreachableRegion of a polygon."""
    outline, *holes = (_closed_run(ring) for ring in regions.rings(part))
    return UnreachableRegion(regions.area_of(part), _lines(pocket, outline), outline, np.arange(len(outline)),
                             tuple(holes))


def _closed_run(ring) -> Elements:
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
