# SPDX-License-Identifier: GPL-2.0-or-later
"""Which loops of a drawing are pockets and which are islands, in whatever order they were drawn.

Called by cycles/pocket.py and drawing/data.py.  A loop that lies in no other is the boundary of a pocket, what lies in
it directly is an island, what lies in an island is a pocket again, and so on.  A loop that was drawn twice counts once.
Loops that cross do not hold one another: what crosses a boundary that was drawn before it is an island of it, and
islands that cross are one.  So nothing in an island is cut, unless a loop within it says so.
"""

from dataclasses import dataclass

from chipwise.geometry.base import chains, loops as chain_loops, polygons
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.offset.kernel import refuse_open

# How coarsely arcs are flattened to compare areas. mm
SAGITTA_MM = 1e-3

# A loop lies in another if no more than this share of it is outside, and no more than a gap's width along its outline:
# what touches from inside is not a crossing.  What touches from outside reaches in by less than a gap everywhere; by
# its area, along a whole outline, it might be a tip, and a tool would cut it off.
OUTSIDE_SHARE = 0.1


@dataclass(frozen=True, eq=False)
class Nested:
    """pockets: ((boundary, (island, ..)), ..) in the order of the drawing; doubled: ((contour, the one that it
    repeats), ..); crossing: ((island, the boundary that it crosses), ..); links: parts that only lead from loop to
    loop."""

    pockets: tuple
    doubled: tuple = ()
    crossing: tuple = ()
    links: tuple = ()


def nested(drawn, close_mm):
    """Nested of chains of parts.  Raises ContourError for one that is not closed."""
    found = [chain_loops.split(parts, close_mm) for parts in drawn]
    contours = [make_contour(list(loop), close_mm) for loops, _ in found for loop in loops]
    for contour in contours:
        refuse_open(contour)
    links = tuple(part for _, left in found for part in left)
    return sort(contours, close_mm, links)


def without_doubled(contours, close_mm):
    """The contours but those that repeat an earlier one."""
    again = {id(contour) for contour, _ in sort(contours, close_mm).doubled}
    return tuple(contour for contour in contours if id(contour) not in again)


def sort(contours, close_mm, links=()):
    """Nested of closed contours."""
    if len(contours) == 1:
        return Nested(((contours[0], ()),), links=links)
    regions = [polygons.area_region(chains.flat(contour.elements, SAGITTA_MM)) for contour in contours]
    size = [polygons.area_of(region) for region in regions]
    slack = [min(OUTSIDE_SHARE * area, close_mm * float(contour.length.sum())) for area, contour in zip(size, contours)]
    doubled, inside, crossed = {}, [set() for _ in contours], [set() for _ in contours]
    for k, m in sorted((k, m) for k, others in enumerate(polygons.meeting_boxes(regions)) for m in others if m < k):
        if k in doubled or m in doubled:
            continue
        part = polygons.shared(regions[k], regions[m])
        shared = polygons.area_of(part)
        if size[k] + size[m] - 2.0 * shared <= slack[k]:
            doubled[k] = m
            continue
        small, large = (k, m) if size[k] < size[m] else (m, k)
        if size[small] - shared <= slack[small]:
            inside[small].add(large)
        elif shared > slack[small] or _reaches_in(part, (regions[k], regions[m]), close_mm):
            crossed[k].add(m)
            crossed[m].add(k)
    kept = [k for k in range(len(contours)) if k not in doubled]
    inside, crossed = ({k: sets[k] - set(doubled) for k in kept} for sets in (inside, crossed))
    pockets, crossing = _roles(kept, size, inside, crossed)
    return Nested(
        tuple((contours[b], tuple(contours[i] for i in islands)) for b, islands in pockets),
        tuple((contours[k], contours[m]) for k, m in sorted(doubled.items())),
        tuple((contours[k], contours[m]) for k, m in crossing),
        links,
    )


def _reaches_in(part, both, close_mm):
    """Whether one of two loops reaches into the other by more than a gap: `part` is what both have."""
    return polygons.area_of(part) > 0.0 and polygons.reaches_beyond(part, both, close_mm + SAGITTA_MM)


def _roles(kept, size, inside, crossed):
    """([(boundary, [island, ..]), ..], [(island, boundary crossed by it), ..]) as numbers."""
    parent, is_island, crossing = {}, {}, []
    for k in sorted(kept, key=lambda k: (len(inside[k]), k)):
        parent[k] = min(inside[k], key=lambda m: size[m], default=None)
        is_island[k] = parent[k] is not None and not is_island[parent[k]]
        if not is_island[k]:
            over = [m for m in sorted(crossed[k]) if is_island.get(m) is False]
            if over:
                is_island[k] = True
                crossing.append((k, over[0]))
    pockets = [
        (b, [k for k in kept if is_island[k] and (parent[k] == b or k in crossed[b])]) for b in kept if not is_island[b]
    ]
    return pockets, crossing
