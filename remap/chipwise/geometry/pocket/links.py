# SPDX-License-Identifier: GPL-2.0-or-later
"""Links at the level from one Track of a machinable region to the next, over ground that the Tracks before have
cleared.

Called by cycles/pocket.py for every strategy but P4, which makes its own.  Lengths mm.

A link is tried straight, then back along the Track that has just ended (which is cleared, whatever lies beside it) with
as few bends as its ground allows, then along all of the path (path_graph.py) and by a search over the region.  All that
the tool sweeps on a line that no Track ran is asked for, exactly (engage_ground.py).  Where the traverse clearance is
at the tool's side the middle of a line is a rapid.
"""

import math
from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base import chains, elements, search
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.base.tolerances import NODE_MM
from chipwise.geometry.pocket import engage_links
from chipwise.geometry.pocket.engage_ground import Ground
from chipwise.geometry.pocket.engage_starts import Grid
from chipwise.geometry.pocket.machinable import clear_segment
from chipwise.geometry.pocket.path_graph import along
from chipwise.geometry.pocket.rounded import EASED_DEEPEST
from chipwise.geometry.pocket.shortest import over_raster

# A start this near to the path so far lies on it. mm; far below what a stock model or a chip can tell.
ON_PATH_MM = 1e-4

# The clearance is looked for along a line at places so far apart. mm
SPACING_MM = 0.3

# A route leads by every so many places of the grid, across and up; by all of them where it does not lead through.
COARSE = 2

# Nearer to the border than this a line is asked for exactly. mm
NEAR_MM = 0.02

# A link along the path is not compared with others if it takes this much of the time that a straight line would.
SHORT = 2.0

# A link along the path that takes longer is a lift: up, across, and down at the feed of a plunge. s
MOST_S = 4.0

# From a place of a raster to its neighbours, and how far that is.
NEIGHBOURS = tuple((i, j, math.hypot(i, j)) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j)

# A region below this area (mm2) is a line or a place: there is nothing to link over.
NO_AREA_MM2 = 1e-6


@dataclass(frozen=True, eq=False)
class Piece:
    """Elements of a link, at the feed at the level, or lines of rapids lifted a little."""

    elements: Elements
    rapid: bool = False


def known_starts(tracks):
    """For each Track whether what the tool covers at its start is cleared at this level: it lies on an earlier one, or
    the Track says so."""
    path, known, done = elements.join([track.elements for track in tracks]), [], 0
    for track in tracks:
        gap = elements.distances(path, np.arange(done), np.broadcast_to(track.start, (done, 2)))
        known.append(bool(done) and (track.cleared or float(gap.min()) <= ON_PATH_MM))
        done += len(track.elements)
    return known


def linked(region, tracks, radius, clearance, feed_mm_s):
    """For each Track the Pieces that lead to its start from the end of the one before; None: the tool has to lift, as
    the start is in stock, or no route was found."""
    known = known_starts(tracks)
    if not any(known) or region.area < NO_AREA_MM2:
        return [None] * len(tracks)
    linker, found = _Linker(region, radius, clearance, feed_mm_s), [None]
    for before, track, is_known in zip(tracks, tracks[1:], known[1:]):
        linker.add(before)
        found.append(linker.link(before, track.start) if is_known else None)
    return found


class _Linker:
    """The ground of a region while its Tracks are cut."""

    def __init__(self, region, radius, clearance, feed_mm_s):
        self.region, self.clearance, self.feed_mm_s = region, clearance, feed_mm_s
        self.ground, self._grid = Ground(region.contours, radius), None
        self.done, self.bridges, self.looked = [], [], 0

    def add(self, track):
        """A Track is cut."""
        self.ground.clear(track.elements)
        self.done.append(track.elements)

    def link(self, before, to):
        """Pieces from the end of a Track to a place; None."""
        here = before.end
        if math.dist(here, to) <= NODE_MM:
            return ()
        if self._free(here, to):
            return self._paced([chains.line(here, to)])
        route = self._back(before, to) or self._found(here, to)
        return None if route is None else self._paced(route)

    def _found(self, a, b):
        """Elements along the path or over cleared ground, whichever is good enough first: along the path if that is
        short, by a coarse search, along the path at all, by a fine search; None."""
        known = self._along(a, b)
        taken = math.inf if known is None else self._seconds(known)
        if taken <= SHORT * math.dist(a, b) / self.feed_mm_s:
            return known
        return self._searched(a, b, COARSE) or (known if taken <= MOST_S else self._searched(a, b, 1))

    def _back(self, before, to):
        """Back along a Track to the place of it nearest to another place, and straight there; None."""
        back, (gap, at) = _back(before, to)
        if gap > ON_PATH_MM and not self._free(at, to):
            return None
        return self._shortened(back, True) + ([chains.line(at, to)] if gap > ON_PATH_MM else [])

    def _along(self, here, to):
        """Along the path of all Tracks so far; None where their paths do not touch."""
        path = elements.join((*self.done, *self._bridged()))
        gap, index, t = chains.nearest(path, to)
        at = to if gap <= ON_PATH_MM else chains.point(path, index, t)
        chain = None if gap > ON_PATH_MM and not self._free(at, to) else along(path, here, at, ON_PATH_MM)
        if chain is None or not len(chain):
            return None
        return self._shortened(chain, True) + ([chains.line(at, to)] if gap > ON_PATH_MM else [])

    def _bridged(self):
        """Lines to the path from ends of Tracks beside it: in corners that are arcs."""
        path, count = elements.join(self.done), np.cumsum([len(chain) for chain in self.done])
        fresh, near_mm = np.arange(self.looked, len(self.done)), EASED_DEEPEST * self.ground.radius
        self.looked = len(self.done)
        end = path.end[count[fresh] - 1]
        which, element = search.near_points(search.build(*elements.boxes(path)), end, np.full(len(end), near_mm))
        first = count[fresh] - [len(self.done[k]) for k in fresh.tolist()]
        earlier = element < first[which]
        which, element = which[earlier], element[earlier]
        gap = elements.distances(path, element, end[which])
        order = np.lexsort((gap, which))
        order = order[np.unique(which[order], return_index=True)[1]]  # the nearest of each
        for k in order[(gap[order] > ON_PATH_MM) & (gap[order] <= near_mm)].tolist():
            a, nearest = end[which[k]], elements.take(path, [element[k]])
            b = chains.point(nearest, *chains.nearest(nearest, a)[1:])
            self.bridges += [chains.line(a, b)] if self._free(a, b) else []
        return self.bridges

    def _seconds(self, route):
        """What single elements take, with the rapids on them."""
        return sum(
            engage_links.rapid_seconds(length) + engage_links.STOP_S if piece.rapid else length / self.feed_mm_s
            for piece in self._paced(route)
            for length in [float(elements.lengths(piece.elements).sum())]
        )

    def _free(self, a, b):
        """Whether the tool meets nothing on a straight line."""
        return self.ground.swept(chains.line(a, b), -engage_links.RIM_MM, engage_links.FINE_MM) and self._within(a, b)

    def _within(self, a, b):
        """Whether a straight line keeps in the region: by strides as long as the distance of the border, exactly if
        that comes too near."""
        length, far = math.dist(a, b), 0.0
        while far < length:
            depth = float(self.ground.depth((a + (b - a) * (far / length))[None])[0])
            if depth < NEAR_MM:
                return clear_segment(self.region, a, b)
            far += depth
        return True

    def _shortened(self, chain, is_cleared):
        """A chain in single elements, lines instead of as much of it as they can be; None where one is not over cleared
        ground.  is_cleared: the tool has been all along the chain."""
        found, k, count = [], 0, len(chain)
        while k < count:
            last = count
            while last > k + 1 and not self._free(chain.start[k], chain.end[last - 1]):
                last = k + (last - k) // 2
            if last > k + 1:
                found.append(chains.line(chain.start[k], chain.end[last - 1]))
            elif is_cleared or self._free(chain.start[k], chain.end[k]):
                found.append(elements.take(chain, np.array([k])))
            else:
                return None
            k = max(last, k + 1)
        return found

    def _searched(self, a, b, step):
        """Lines over cleared ground, around what stands, by every so many places of the grid; None."""
        if self._grid is None:
            self._grid = Grid(self.region, self.ground)
        self._grid.refresh()
        place, free = self._grid.point[::step, ::step], self._grid.cleared[::step, ::step]
        first, last = (self._seen(end, place, free) for end in (a, b))
        route = None if first is None or last is None else over_raster(free, first, last, NEIGHBOURS)
        if route is None:
            return None
        points = np.array([a, *(place[at] for at in route), b])
        return self._shortened(elements.make_lines(points[:-1], points[1:]), False)

    def _seen(self, end, place, free):
        """Indices of the nearest free place that a straight line leads to; None."""
        known = np.argwhere(free)
        for k in np.argsort(np.hypot(*(place[free] - end).T), kind="stable")[: engage_links.NEAREST]:
            if self._free(end, place[tuple(known[k])]):
                return tuple(known[k].tolist())
        return None

    def _paced(self, route):
        """Pieces of single elements: the middle of a line is a rapid where that is quicker."""
        return tuple(
            piece for e in route for piece in ([Piece(e)] if e.is_arc[0] else self._with_rapid(e.start[0], e.end[0]))
        )

    def _with_rapid(self, a, b):
        count = max(1, math.ceil(math.dist(a, b) / SPACING_MM))
        place = a + (b - a) * np.linspace(0.0, 1.0, count + 1)[:, None]
        first, last = _longest(self.ground.rim(place, -self.clearance))
        length = math.dist(a, b) * max(last - first, 0) / count
        rapid = chains.line(place[first], place[last])
        if engage_links.rapid_seconds(length) + engage_links.STOP_S >= length / self.feed_mm_s or not self.ground.swept(
            rapid, self.clearance, engage_links.FINE_MM
        ):
            return [Piece(chains.line(a, b))]
        return (
            [Piece(chains.line(a, place[first]))] * (first > 0)
            + [Piece(rapid, True)]
            + [Piece(chains.line(place[last], b))] * (last < count)
        )


def _longest(flags):
    """(first, last) index of the longest row of True; (0, 0) where none is."""
    edge = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(int)))
    first, last = edge[::2], edge[1::2] - 1
    k = int(np.argmax(last - first)) if len(first) else None
    return (0, 0) if k is None else (int(first[k]), int(last[k]))


def _back(track, to):
    """(the chain back along a Track from its end to the place of it nearest to another, (distance between both, the
    place))."""
    chain = track.elements
    gap, index, t = chains.nearest(chain, to)
    length = float(elements.lengths(chain)[index])
    rest = elements.take(chain, np.arange(index + 1, len(chain)))
    if t * length <= ON_PATH_MM or (1.0 - t) * length > ON_PATH_MM:
        rest = elements.join((chains.segment(chain, index, 0.0 if t * length <= ON_PATH_MM else t, 1.0), rest))
    return elements.reverse(rest), (gap, rest.start[0] if len(rest) else track.end)
