# SPDX-License-Identifier: GPL-2.0-or-later
"""Regions of a pocket that the tool cannot enter.

Called by cycles/pocket.py for the operator's message.  The small rest in an inner corner, which
every round tool leaves, is not one of them: a region counts where it reaches further than a tool
radius beyond the tool's edge (corners sharper than 60 degrees do).
"""

from dataclasses import dataclass

from chipwise.geometry.base import polygons
from chipwise.geometry.base import chains

# How coarsely arcs are flattened for the report. mm
SAGITTA_MM = 0.01

# Area, in squares of the tool radius, below which a region is rounding.
SMALLEST = 1e-3


@dataclass(frozen=True)
class InaccessibleArea:
    """area mm2; x, y mm: a position inside it."""

    area: float
    x: float
    y: float


def inaccessible(pocket, regions, distance):
    """Tuple of InaccessibleArea, the largest first; distance: tool radius plus side allowance, mm."""
    loops = [polygons.area_region(chains.flat(c.elements, SAGITTA_MM)) for c in pocket.contours]
    free = loops[0] if len(loops) == 1 else polygons.subtract(loops[0], polygons.joined(loops[1:]))
    areas = [_area(region) for region in regions]
    if areas:
        entered = polygons.joined([part for area in areas for part in area])
        rest = polygons.subtract(free, polygons.grown(entered, distance, SAGITTA_MM))
        far = polygons.grown(entered, 2.0 * distance, SAGITTA_MM)
    else:
        rest, far = free, None
    found = []
    for part in polygons.large_parts(rest, SMALLEST * distance**2):
        if far is None or polygons.large_parts(polygons.subtract(part, far), SMALLEST * distance**2):
            found.append(InaccessibleArea(polygons.area_of(part), *polygons.point_in(part)))
    return tuple(sorted(found, key=lambda u: -u.area))


def _area(region):
    """A machinable region as regions: its area, and its boundary as a thin line where it has none."""
    outline = chains.flat(region.boundary, SAGITTA_MM)
    found = [polygons.kerfs([outline], SAGITTA_MM, SAGITTA_MM)]
    if len(outline) > 3 and region.area > 0.0:
        found.append(polygons.area_region(outline, [chains.flat(h, SAGITTA_MM) for h in region.holes]))
    return found
