# SPDX-License-Identifier: GPL-2.0-or-later
"""Arcs onto and off the finished walls of a machinable region, and how far the tool runs on over the seam.

Called by cycles/pocket.py, which gives Walls to the strategies P0 to P3: rings.py and concentric.py, whose last ring
comes from the ring beside it, and led() for walls that are Tracks of their own.  rings.py takes the arcs from ring to
ring from here, too, and scan.py the region of rows that end before the walls.  Lengths mm, angles rad.

A wall is come onto tangent to it, and left tangent to it: a tool that strikes it square, turns or dwells on it leaves a
mark.  Every arc is asked for by exact distances whether it keeps within the region.  Where none does, the path is as it
is without arcs.
"""

import math
from dataclasses import replace
from functools import cached_property

import numpy as np

from chipwise.geometry.base import chains, elements
from chipwise.geometry.base.elements import make_arcs, make_lines
from chipwise.geometry.pocket.engage_ground import Ground, fitted
from chipwise.geometry.pocket.engage_links import FINE_MM, RIM_MM, inside
from chipwise.geometry.pocket.machinable import clear_segment, inside as within_region, machinable_regions
from chipwise.geometry.pocket.rings import SLANTS

# Radii of arcs onto and off a wall, in tool radii: the first that fits.
ONTO, OFF = (2.0, 1.0, 0.5, 0.25, 0.12, 0.05), (0.5, 0.25, 0.12, 0.05)

# An arc off a wall turns by the first, or the second where that has no room; one onto a wall from cleared ground by one
# of the third. rad
AWAY, LESS_AWAY = math.radians(60.0), math.radians(30.0)
TOWARDS = np.radians((60.0, 90.0, 35.0))

# Most turn of each of the two arcs from a ring beside the wall, and of the arc after a line. rad
BENT, ROUND = math.radians(75.0), math.radians(120.0)

# Places of a wall that are looked at for an arc from cleared ground.
PLACES = 24

# An arc in a corner is looked at in so many places first.
PARTS = 12

# Rows of P1 and P2 end this far (tool radii) before the wall that is run after them.
KEPT = 0.04

# A contour of less area than this (mm2) is a line or a place: there is no side to come from.
NO_AREA_MM2 = 1e-6


class Walls:
    """The finished walls of a machinable region, for a tool that has them on its right (climb) or left."""

    def __init__(self, region, radius, climb, overlap):
        """overlap: mm that the tool runs on over the seam."""
        self.region, self.radius = region, radius
        self.side, self.overlap = 1.0 if climb else -1.0, overlap
        self.kept = KEPT * radius
        self._ground = None

    @property
    def ground(self):
        """The Ground of the region; what led() has cleared, and distances from the border."""
        if self._ground is None:
            self._ground = Ground(self.region.contours, self.radius)
        return self._ground

    # ---- rows that end before a wall ---------------------------------------------------------------------------------

    @cached_property
    def within(self):
        """The machinable region whose rows end before the walls; the region itself if that is not one."""
        found = [
            region
            for region in machinable_regions(self.region.pocket, self.region.distance + self.kept)
            if region.area > NO_AREA_MM2 and within_region(self.region, region.boundary.start[:1])[0]
        ]
        return found[0] if len(found) == 1 else self.region

    # ---- arcs in corners ---------------------------------------------------------------------------------------------

    def keeps(self, arcs, corner):
        """Which (n,) bool of arcs in corners (n, 2) of a path in the region keep within it."""
        sure = self.ground.depth(corner) >= np.hypot(*(arcs.start - corner).T)
        left = np.flatnonzero(~sure)
        if len(left):  # by places so close that what is free about them covers the arc
            t = np.tile((np.arange(PARTS) + 0.5) / PARTS, len(left))
            depth = self.ground.depth(elements.point_at(arcs, np.repeat(left, PARTS), t)).reshape(-1, PARTS)
            sure[left] = depth.min(axis=1) >= 0.5 / PARTS * elements.lengths(arcs)[left]
        for k in np.flatnonzero(~sure):
            sure[k] = inside(self.ground, elements.take(arcs, [k]))
        return sure

    # ---- from a ring beside a wall -----------------------------------------------------------------------------------

    def onto(self, here, heading, loop, step):
        """(chain, (index, t)) from a place beside a closed contour to a place of the contour, tangent to it there;
        None.  heading: of the path that ends here; None: any."""
        gap, index, t = chains.nearest(loop, here)
        if gap <= chains.SNAP_MM or not solid(loop):
            return None
        if heading is None:
            heading = chains.heading(loop, index, t)
        at = _ahead(loop, index, t, step)
        found = self._first_curve(here, heading, loop, at)
        if found is not None:
            return found
        for share in ONTO:
            for position in at:
                chain = self._line_and_arc(here, loop, position, share * self.radius)
                if chain is not None:
                    return chain, position
        return None

    def beside(self, here, heading, loop, step):
        """(chain, (index, t)) of two arcs from a place beside a ring to a place of the ring; None."""
        gap, index, t = chains.nearest(loop, here)
        if gap <= chains.SNAP_MM or not solid(loop):
            return None
        return self._first_curve(here, heading, loop, _ahead(loop, index, t, step))

    def _first_curve(self, here, heading, loop, at):
        """(chain, position) of the first of some positions that two arcs lead to; None."""
        for position in at:
            chain = self._curve(here, heading, loop, position)
            if chain is not None:
                return chain, position
        return None

    def _curve(self, here, heading, loop, position):
        """Two arcs, tangent to the path that ends here, to one another and to the contour; None."""
        end = chains.point(loop, *position)
        chain = fitted(np.array(((*here, heading), (*end, chains.heading(loop, *position)))), 1.0)
        if (
            not len(chain)
            or np.abs(chain.sweep).max() > BENT
            or elements.lengths(chain).sum() > 1.5 * math.dist(here, end)
        ):
            return None
        return chain if inside(self.ground, chain) else None

    def _line_and_arc(self, here, loop, position, radius):
        """A line, and an arc tangent to it and to the contour; None."""
        end, heading = chains.point(loop, *position), chains.heading(loop, *position)
        centre = end + self.side * radius * np.array((-math.sin(heading), math.cos(heading)))
        away = math.dist(centre, here)
        if away <= radius:
            return None
        along = math.atan2(centre[1] - here[1], centre[0] - here[0]) - self.side * math.asin(radius / away)
        touch = here + math.sqrt(away**2 - radius**2) * np.array((math.cos(along), math.sin(along)))
        turn = self.side * (heading - along) % (2.0 * math.pi)
        if turn > ROUND or not clear_segment(self.region, here, touch):
            return None
        arc = make_arcs(touch[None], end[None], centre[None], np.array([radius]), np.array([self.side * turn]))
        chain = (
            arc
            if math.dist(here, touch) <= chains.SNAP_MM
            else elements.join((make_lines(here[None], touch[None]), arc))
        )
        return chain if turn * radius > chains.SNAP_MM and inside(self.ground, arc) else None

    # ---- along a wall and off it -------------------------------------------------------------------------------------

    def finished(self, loop):
        """A closed contour, on over its seam, and off it on an arc."""
        if not solid(loop):
            return loop
        chain = elements.join((loop, *over_seam(loop, self.overlap)))
        return elements.join((chain, *self._off(chain)))

    def _off(self, chain):
        """[the arc off the end of a chain]; nothing where none fits."""
        end, heading = chain.end[-1], chains.heading(chain, len(chain) - 1, 1.0)
        for turn in (AWAY, LESS_AWAY):
            for share in OFF:
                arc = self._arc(end, heading, share * self.radius, turn, False)
                if inside(self.ground, arc):
                    return [arc]
        return []

    def _arc(self, place, heading, radius, turn, onto):
        """The arc of a turn that begins, or ends (onto), at a place with a heading, away from the wall."""
        centre = place + self.side * radius * np.array((-math.sin(heading), math.cos(heading)))
        angle = heading + self.side * ((-turn if onto else turn) - 0.5 * math.pi)
        far = centre + radius * np.array((math.cos(angle), math.sin(angle)))
        start, end = (far, place) if onto else (place, far)
        return make_arcs(start[None], end[None], centre[None], np.array([radius]), np.array([self.side * turn]))

    # ---- walls that are Tracks of their own --------------------------------------------------------------------------

    def led(self, tracks):
        """Tracks, those that are a wall and nothing else with arcs onto and off it."""
        found = []
        for track in tracks:
            if track.wall and solid(track.elements):
                track = self._led(track, found)
            self.ground.clear(track.elements)
            found.append(track)
        return tuple(found)

    def _led(self, track, before):
        """before: the Tracks before."""
        loop = track.elements
        found = self._from_cleared(loop, before[-1].end) if before else self.from_solid(loop)
        arc, loop = found if found is not None else (None, loop)
        start = arc if arc is not None or not before else self._from_path(loop.start[0], before)
        chain = self.finished(loop) if start is None else elements.join((start, self.finished(loop)))
        return replace(
            track, elements=chain, cutting=np.ones(len(chain), bool), cleared=arc is not None and bool(before)
        )

    def _from_path(self, place, before):
        """The line to a place from the nearest place of Tracks; None where it lies on one, or no line leads there."""
        path = elements.join([track.elements for track in before])
        gap, index, t = chains.nearest(path, place)
        start = chains.point(path, *chains.snapped(path, index, t))
        if gap <= chains.SNAP_MM or gap > self.radius or not clear_segment(self.region, start, place):
            return None
        return make_lines(start[None], place[None])

    def from_solid(self, loop):
        """(the arc onto the start of a closed contour, the contour), the widest arc that fits; None."""
        place, heading = loop.start[0], chains.heading(loop, 0, 0.0)
        arcs = (self._arc(place, heading, share * self.radius, TOWARDS[0], True) for share in ONTO[1:])
        arc = next((arc for arc in arcs if inside(self.ground, arc)), None)
        return None if arc is None else (arc, loop)

    def _from_cleared(self, loop, here):
        """(arc, contour from the arc's end): an arc onto a closed contour that begins where all that the tool covers is
        cleared, straight from `here` over cleared ground if there is one; None."""
        total, other = float(elements.lengths(loop).sum()), None
        for station in total * np.arange(PLACES) / PLACES:
            position = chains.snapped(loop, *chains.position_at(loop, station))
            for arc in self._arcs_from_cleared(chains.point(loop, *position), chains.heading(loop, *position)):
                link = make_lines(here[None], arc.start)
                if self.ground.swept(link, -RIM_MM, FINE_MM) and clear_segment(self.region, here, arc.start[0]):
                    return arc, chains.rotated(loop, *position)
                other = other or (arc, position)
        return None if other is None else (other[0], chains.rotated(loop, *other[1]))

    def _arcs_from_cleared(self, place, heading):
        for share in ONTO[1:]:
            for turn in TOWARDS.tolist():
                arc = self._arc(place, heading, share * self.radius, turn, True)
                at = make_lines(arc.start, arc.start)
                if (
                    self.ground.rim(arc.start, RIM_MM)[0]
                    and inside(self.ground, arc)
                    and self.ground.swept(at, -RIM_MM, FINE_MM)
                ):
                    yield arc


def _ahead(loop, index, t, step):
    """Positions of a closed contour ahead of one, the furthest first, as from ring to ring."""
    total, station = float(elements.lengths(loop).sum()), chains.station_of(loop, index, t)
    return [
        chains.snapped(loop, *chains.position_at(loop, station + a * step)) for a in SLANTS if a * step <= 0.3 * total
    ]


def solid(loop):
    """Whether a closed contour has a side to come from."""
    return abs(elements.area(loop)) > NO_AREA_MM2


def over_seam(loop, length):
    """[the first mm of a closed contour], at most all of it; nothing where that is nothing."""
    total = float(elements.lengths(loop).sum())
    if length <= chains.SNAP_MM:
        return []
    if length >= total - chains.SNAP_MM:
        return [loop]
    index, t = chains.snapped(loop, *chains.position_at(loop, length))
    parts = [elements.take(loop, np.arange(index))] + ([chains.segment(loop, index, 0.0, t)] if t > 0.0 else [])
    return [elements.join(parts)] if sum(map(len, parts)) else []
