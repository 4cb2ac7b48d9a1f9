"""Regions of a pocket that the tool cannot enter.

Called by cycles/pocket.py for the operator's message.  The small rest in an inner corner, which
every round tool leaves, is not one of them: a region counts where it reaches further than a tool
radius beyond the tool's edge (corners sharper than 60 degrees do).
"""
from dataclasses import dataclass

from .. import regions
from . import runs

# How coarsely arcs are flattened for the report. mm
SAGITTA_MM = 0.01

# Area, in squares of the tool radius, below which a region is rounding.
SMALLEST = 1e-3


@dataclass(frozen=True)
class Unreached:
    """area mm2; x, y mm: a place inside it."""
    area: float
    x: float
    y: float


def unreached(pocket, fields, distance):
    """Tuple of Unreached, the largest first; distance: tool radius plus side allowance, mm."""
    loops = [regions.area_region(runs.flat(c.elements, SAGITTA_MM)) for c in pocket.contours]
    free = loops[0] if len(loops) == 1 else regions.subtract(loops[0], regions.joined(loops[1:]))
    areas = [_area(field) for field in fields]
    if areas:
        entered = regions.joined([part for area in areas for part in area])
        rest = regions.subtract(free, regions.grown(entered, distance, SAGITTA_MM))
        far = regions.grown(entered, 2.0 * distance, SAGITTA_MM)
    else:
        rest, far = free, None
    found = []
    for part in regions.large_parts(rest, SMALLEST * distance ** 2):
        if far is None or regions.large_parts(regions.subtract(part, far), SMALLEST * distance ** 2):
            found.append(Unreached(regions.area_of(part), *regions.place_in(part)))
    return tuple(sorted(found, key=lambda u: -u.area))


def _area(field):
    """A Field as regions: its area, and its boundary as a thin line where it has none."""
    outline = runs.flat(field.boundary, SAGITTA_MM)
    found = [regions.kerfs([outline], SAGITTA_MM, SAGITTA_MM)]
    if len(outline) > 3 and field.area > 0.0:
        found.append(regions.area_region(outline, [runs.flat(h, SAGITTA_MM) for h in field.holes]))
    return found
