# SPDX-License-Identifier: GPL-2.0-or-later
"""Offset of a contour by a tool: centre paths, rough shapes, inaccessible regions.

Called by the cycles G77, G78 (one contour) and G79 (a pocket with islands); the only
module of this package they need besides contour.py and paths.py.  Source: JP H07-47256,
Fig. 2: offset, delete what is reversed, offset back by minus the radius.

Departure: the patent finds what to delete by the direction of each element; here the raw
offset is cut wherever it meets itself, and every slice is judged against the whole
contour.  docs/design/geometry.md says why that finds everything.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from chipwise.geometry.base import elements, search, winding
from chipwise.geometry.offset import slices as slicing
from chipwise.geometry.base.contour import ContourError, refuse_meeting, reverse
from chipwise.geometry.base.intersect import meetings
from chipwise.geometry.base.clearance import ClearanceCheck, gouge_depths, gouge_depths_beside, make_clearance_check
from chipwise.geometry.offset.paths import chains_to_paths, point_contact
from chipwise.geometry.offset.raw import Chain, make_chain, raw_offset
from chipwise.geometry.offset.rough import rough_shapes
from chipwise.geometry.offset.sharp import sharpen
from chipwise.geometry.offset.stitch import stitch
from chipwise.geometry.offset.sunk import Sunk, afloat
from chipwise.geometry.base.tolerances import DEPTH_MM, NODE_MM, POINT_CONTACT_MM
from chipwise.geometry.offset.touch import make_finish, make_touch
from chipwise.geometry.offset.inaccessible import inaccessible

RIGHT, LEFT = 1, -1


@dataclass(frozen=True, eq=False)
class OffsetResult:
    """What a tool of `radius` (mm) can do along `contours` on `side`.

    paths: ClosedPath, OpenPath and PointContact, in contour order, each in the direction of
    the contour; sharp_paths: the same with sharp corners where that is safe; rough: one
    RoughShape per path; inaccessible: InaccessibleRegion and
    InaccessibleSegment; loose: number of slice runs with a dead end (0 unless rounding
    defeated the kernel; their motion is left out).
    """

    contours: tuple
    side: int
    radius: float
    paths: tuple
    loose: int

    def source_lines(self, path):
        """Source line (n,) int of every element of one of the paths."""
        return np.concatenate([c.line for c in self.contours])[path.feet.finish]

    @cached_property
    def _touch(self):
        finish = make_finish(self.contours)
        return finish, make_touch(finish, self.paths)

    @cached_property
    def rough(self):
        return tuple(rough_shapes(*self._touch, self.paths, self.side, self.radius))

    @cached_property
    def inaccessible(self):
        return inaccessible(*self._touch, self.paths, self.side, self.radius)

    @cached_property
    def sharp_paths(self):
        return sharpen(self.paths, make_clearance_check(self.contours), self.side, self.radius)


def offset_contour(contour, side, radius):
    """OffsetResult of one contour with the tool RIGHT or LEFT of it."""
    if side not in (RIGHT, LEFT):
        raise ValueError(f"side {side!r} is neither RIGHT (1) nor LEFT (-1)")
    return _offset((contour,), side, _checked(radius))


def offset_pocket(boundary, islands, distance):
    """OffsetResult of a pocket: inward of a closed boundary, outward of closed islands.

    The contours may run either way round; paths run counter-clockwise along the boundary
    and clockwise about islands.  Contours that meet each other are refused, and islands
    outside the boundary or within one another.
    """
    loops = [_turned(boundary, True)] + [_turned(island, False) for island in islands]
    _refuse_meetings(loops)
    _refuse_misplaced(loops)
    return _offset(tuple(loops), LEFT, _checked(distance))


@dataclass(frozen=True, eq=False)
class Pocket:
    """The free area inside a boundary and outside islands, ready for many rings.

    contours: the boundary counter-clockwise, the islands clockwise; mixed: some of them meet,
    lie outside the boundary or within one another, so that being clear of all of them does
    not yet mean being in the free area.
    """

    contours: tuple
    clearance_check: ClearanceCheck
    chain: Chain
    meeting: bool
    known: dict = field(default_factory=dict, repr=False)
    sunk: Sunk = field(default_factory=Sunk, repr=False)


def make_pocket(boundary, islands):
    """Pocket of closed contours that may touch, cross or hold one another."""
    loops = [_turned(boundary, True)] + [_turned(island, False) for island in islands]
    meeting = False
    try:
        _refuse_meetings(loops)
        _refuse_misplaced(loops)
    except ContourError:
        meeting = True
    return Pocket(tuple(loops), make_clearance_check(loops), make_chain(loops), meeting)


def pocket_ring(pocket, distance):
    """OffsetResult of a Pocket at a distance, each from the original contours; kept, so that
    asking again costs nothing.  Where contours meet, only its paths mean anything."""
    distance = _checked(distance)
    if distance not in pocket.known:
        pocket.known[distance] = _offset(pocket.contours, LEFT, distance, pocket)
    return pocket.known[distance]


def _checked(radius):
    radius = float(radius)
    if not np.isfinite(radius) or radius <= 0.0:
        raise ValueError(f"offset {radius} mm is not a number larger than 0; use the tool radius plus the allowance")
    return radius


def refuse_open(contour):
    """Raise ContourError for the outline of a pocket or island that is open."""
    if not contour.closed:
        first, last = contour.line[0], contour.line[-1]
        e = contour.elements
        (x, y), gap = e.start[0].tolist(), float(np.hypot(*(e.end[-1] - e.start[0])))
        raise ContourError(
            "not connected",
            (last, first),
            f"a pocket outline is open: line {last}"
            f" ends {{gap}} from where line {first} starts; end it at X{{x}} Y{{y}}",
            (x, y),
            gap=gap,
            x=x,
            y=y,
        )


def _turned(contour, ccw):
    """The closed contour, counter-clockwise or clockwise."""
    refuse_open(contour)
    return contour if (elements.area(contour.elements) > 0.0) == ccw else reverse(contour)


def _refuse_meetings(loops):
    """Loops that cross or touch one another."""
    finish = make_finish(loops)
    tree = search.build(*elements.boxes(finish.elements))
    met = meetings(finish.elements, finish.length, *search.pairs(tree, NODE_MM))
    bad = np.flatnonzero(finish.owner[met.a] != finish.owner[met.b])
    if len(bad):
        k = bad[0]
        refuse_meeting(finish.line[met.a[k]], finish.line[met.b[k]], met.point[k])


def _refuse_misplaced(loops):
    """Islands outside the boundary, or within another island."""
    for k, island in enumerate(loops[1:], 1):
        for m, other in enumerate(loops):
            point = island.elements.start[:1]
            inside = m != k and winding.numbers(other.elements, point)[0] != 0
            if m != k and inside != (m == 0):
                line, about = island.line[0], other.line[0]
                where = "outside the boundary" if m == 0 else "within the island"
                raise ContourError(
                    "misplaced island",
                    (line, about),
                    f"the island of line {line} "
                    f"lies {where} of line {about}; place islands side by side "
                    "within the boundary",
                    tuple(point[0]),
                )


def _offset(contours, side, radius, pocket=None):
    clearance_check = pocket.clearance_check if pocket else make_clearance_check(contours)
    chain = pocket.chain if pocket else make_chain(contours)
    raw = raw_offset(chain, side, radius)
    if pocket:
        raw = afloat(pocket.sunk, clearance_check, chain, raw, radius)
    if not len(raw.elements):
        return OffsetResult(
            contours, side, radius, _point_contacts(contours, clearance_check, raw.point_contacts, side, radius), 0
        )
    every = slicing.cut(raw)
    kept, depth = slicing.keep_clear(clearance_check, chain, raw, every, radius)
    if pocket and pocket.meeting:
        kept, depth = _in_free_area(clearance_check, raw, kept, depth)
    stitched = stitch(raw, kept, depth, side, radius)
    made = tuple(chains_to_paths(chain, raw, kept, stitched))
    if all(c.closed for c in contours):
        lone = np.concatenate((_lone_nodes(clearance_check, chain, raw, every, kept, radius), raw.point_contacts))
        made += _point_contacts(contours, clearance_check, lone, side, radius, made)
    return OffsetResult(contours, side, radius, made, len(stitched.loose))


def _in_free_area(clearance_check, raw, kept, depth):
    """Clear slices inside the boundary and in no island.

    Contours that cross keep the tool out of what they share by no distance: far inside an
    island a slice along the wall is clear of both.  Winding numbers tell: 1 for the boundary
    about it, -1 for each island.  No corner is missing: if contours cross, the free area
    has an inner corner, which needs no rolling arc, and what lies hidden behind another
    contour is further away than that.
    """
    free = winding.numbers(clearance_check.finish, slicing.middles(raw, kept)) == 1
    return slicing.take(kept, free), depth[free]


def _lone_nodes(clearance_check, chain, raw, every, kept, radius):
    """Nodes (m, 2) mm that no kept slice touches and no near element rules out."""
    lone = np.ones(len(every.point), bool)
    lone[kept.node0] = lone[kept.node1] = False
    source = chain.finish[raw.source[every.raw]]
    for node in (every.node0, every.node1):
        ask = np.flatnonzero(lone[node])
        gouging = gouge_depths_beside(clearance_check, every.point[node[ask]], source[ask], radius) > DEPTH_MM
        lone[node[ask[gouging]]] = False
    return every.point[lone]


def _on_side(contours, side, point):
    """Those of points (m, 2) that lie on the tool's side of closed contours.  At a cusp the
    raw offset may touch the right distance on the wrong side."""
    if not len(point):
        return point
    finish = elements.join([c.elements for c in contours])
    ccw = elements.area(contours[0].elements) > 0.0
    wanted = int(ccw) if side == LEFT else int(ccw) - 1
    return point[winding.numbers(finish, point) == wanted]


def _point_contacts(contours, clearance_check, point, side, radius, paths=()):
    """PointContacts where the tool fits at one of the points (m, 2) and no path comes."""
    point = point[gouge_depths(clearance_check, point, radius) <= DEPTH_MM]
    taken = [p.elements.start for p in paths]
    fresh = []
    for p in point:
        if not any(np.min(np.hypot(*(e - p).T)) <= POINT_CONTACT_MM for e in taken):
            fresh.append(p)
            taken.append(p[None])
    return tuple(
        point_contact(clearance_check.finish, p, radius, side)
        for p in _on_side(contours, side, np.array(fresh).reshape(-1, 2))
    )
