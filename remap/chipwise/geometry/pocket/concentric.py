# SPDX-License-Identifier: GPL-2.0-or-later
"""P3: clear a machinable region along closed paths about a base line, from convex polygons.

Called by strategies.py as a strategy (tracks.py).  Source: the abstract on area machining by
convex polygons.  Its steps, with its symbols:
1. the arcs of the offset curve OFC are replaced by chords (inner_polygons.py);
2. the area is divided into convex polygons PGi (convex.py);
3. the base line BL joins their centroids Wi and the middle points Mi of their common edges, spokes
   lead from it to the corners (baseline.py);
4. every spoke is divided in equal parts; the points of the same number make a closed path CPTk;
5. the tool runs along BL, the closed paths from inside out, and at last along OFC.

Departures: the polygon stays a little inside the curve (STRAYING), so that no chord leaves the machinable region.
The number of parts follows from the step-over instead of being given.  Narrow branches keep fewer
paths, and holes have paths of their own (baseline.py, 3 and 4).  With Walls the corners of closed paths are rounded
(rounded.py), but for those in which one begins or ends.

No residue up to a step-over of the tool radius: a point of the machinable region is never further from the next
path than the step-over.  Above that a sharp turn may leave its outer corner to rest_material.py; it
seldom does, because most positions are covered more closely than the widest one.
"""

import math

import numpy as np

from chipwise.errors import CycleError

from chipwise.geometry.base import elements
from chipwise.geometry.base.inner_polygons import inner_polygons
from chipwise.geometry.base import chains
from chipwise.geometry.pocket.baseline import BaseLine
from chipwise.geometry.pocket.convex import Partition
from chipwise.geometry.pocket.rings import contour_parallel
from chipwise.geometry.pocket.rounded import RADII, smoothed
from chipwise.geometry.pocket.scan import OVERLAP_SHARE
from chipwise.geometry.pocket.tracks import along, make_track

# The polygon may stay this share of the step-over away from the outline: half of it chords, half
# corners left out.
STRAYING = 0.1

# More closed paths are a slip of the finger and would stall the preview.
MAX_RINGS = 500

# The tool follows the base line back through its own slot for at most this many tool radii before
# lifting is shorter.
TRAVEL = 8.0

# From one closed path to the next the tool goes slantwise, over at least this many times the
# step-over: straight out it would cut its full width.
SLANT = 3.0

# An arc in a corner of a closed path may be away from the corner by this share of STRAYING, to any side.
ROUNDED = 0.5

# Points of a path nearer than this are one. mm
SAME_MM = 1e-6


def concentric(region, radius, step, direction, climb, walls=None):
    """Tracks of a machinable region, closed paths at most `step` mm apart.  direction (rad) plays no part."""
    limit = min(step, 2.0 * radius * (1.0 - OVERLAP_SHARE))
    straying = STRAYING * limit
    flat = [chains.flat(contour, 0.5 * straying)[:-1] for contour in region.contours]
    parts = [Partition(*part) for part in _polygons(flat, 0.5 * straying)]
    if not all(part.convex() for part in parts):
        return contour_parallel(region, radius, step, direction, climb, walls)
    toolpath = _Toolpath(region, climb, straying, walls)
    for part in parts:
        toolpath.closing = part is parts[-1]
        _clear(toolpath, part, radius, limit, limit - straying)
    return toolpath.finished() if walls is None else walls.led(toolpath.finished())


def _polygons(flat, share):
    outer = flat[0]
    if len(outer) < 3:
        return []
    return inner_polygons(outer, flat[1:], share, share)


class _Toolpath:
    """The Tracks so far and the contours still to run.  closing: contours may be run now, because
    nothing but closed paths of other contours comes after them."""

    def __init__(self, region, climb, straying, walls):
        self.climb, self.straying, self.closing, self.walls = climb, straying, False, walls
        self.tracks, self.points, self.flags, self.here, self.rounds = [], [], [], None, False
        self.seams = []  # indices of points of this Track where closed paths begin and end
        self.contours = [along(contour, climb) for contour in region.contours]
        self.left = set(range(len(self.contours)))
        self.ends = []  # per fan: last points before the contour, tips, both (n, 2)

    def lift(self, to=None, rounds=True):
        """Ends the Track; the next one begins at `to` (2,) mm.  rounds: its corners may be rounded."""
        self._end()
        self.here, self.rounds = to, rounds and self.walls is not None

    def _end(self, *parts):
        """Ends the Track with runs of elements."""
        lines = self._lines() if self.points else None
        parts = ([] if lines is None else [lines]) + [(part, np.full(len(part), True)) for part in parts]
        if parts:
            chain, flags = zip(*parts)
            self.tracks.append(make_track(elements.join(chain), np.concatenate(flags)))
        self.points, self.flags, self.seams, self.here = [], [], [], None

    def seam(self):
        """A closed path begins or ends here: its corner stays, as routes back lead through it."""
        self.seams.append(sum(map(len, self.points)) - 1)

    def _lines(self):
        """(Elements, flags (n,) bool) of the lines of this Track, its corners rounded if walls are given."""
        points, flags = np.concatenate(self.points), np.concatenate(self.flags)
        if not self.rounds:
            return elements.make_lines(points[:-1], points[1:]), flags
        size = min(RADII[1] * self.walls.radius, self.straying / STRAYING)
        chain, index = smoothed(points, self.seams, self.walls.side, size, ROUNDED * self.straying, self.walls.keeps)
        return chain, flags[index]

    def go(self, points, cutting=True):
        """Adds lines from here along points (n, 2); points on the same position count once."""
        points = np.concatenate((self.here[None], points))
        keep = np.hypot(*np.diff(points, axis=0).T) > SAME_MM
        cutting = np.broadcast_to(cutting, len(keep))[keep]
        points = points[np.concatenate(([True], keep))]
        if len(cutting):
            self.points.append(points[1:] if self.points else points)
            self.flags.append(cutting)
        self.here = points[-1]

    def heading(self):
        """Of the path that ends here; None where none does."""
        if not self.points:
            return None
        last = np.concatenate(self.points[-2:])[-2:]
        x, y = (last[1] - last[0]).tolist()
        return math.atan2(y, x)

    def contour(self, tip):
        """Goes on to a tip and runs the contour nearest to it, if it is still to run."""
        positions = [chains.nearest(loop, tip) for loop in self.contours]
        k = min(range(len(positions)), key=lambda n: positions[n][0])
        if k not in self.left or positions[k][0] > 2.0 * self.straying:
            return
        self.left.discard(k)
        loop = chains.rotated(self.contours[k], *positions[k][1:])
        arcs = (
            None if self.walls is None else self.walls.onto(self.here, self.heading(), loop, math.dist(self.here, tip))
        )
        if arcs is None:
            self.go(np.stack((tip, loop.start[0])))
        loop = loop if arcs is None else chains.rotated(loop, *arcs[1])
        if self.walls is not None:
            loop = self.walls.finished(loop)
        self._end(*([] if arcs is None else [arcs[0]]), loop)

    def finished(self):
        """All Tracks.  Contours still to run begin beside a closed path, or anywhere."""
        self.lift()
        for k in sorted(self.left, reverse=True):
            loop, n = self.contours[k], len(self.contours[k])
            if self.ends:
                inner, tips = (np.concatenate(part) for part in zip(*self.ends))
                gap = elements.distances(loop, np.tile(np.arange(n), len(tips)), np.repeat(tips, n, axis=0))
                spoke = int(np.argmin(gap.reshape(-1, n).min(axis=1)))
                self.lift(self._on_path(inner[spoke]))
                self.contour(tips[spoke])
            if k in self.left:
                self.tracks.append(make_track(loop, wall=True))
        return tuple(self.tracks)

    def _on_path(self, place):
        """The place of the Tracks nearest to another one: an arc in a corner does not lead through the corner."""
        if self.walls is None or not self.tracks:
            return place
        path = elements.join([track.elements for track in self.tracks])
        gap, index, t = chains.nearest(path, place)
        return place if gap <= SAME_MM else chains.point(path, index, t)


def _clear(toolpath, partition, radius, limit, gap):
    """Base line and closed paths of one polygon, and the contours if they may be run now."""
    partition.slimmer()
    partition.merged()
    line = BaseLine(partition)
    for nodes, cutting in line.walks(TRAVEL * radius):
        if len(nodes) > 1:
            toolpath.lift(line.node[nodes[0]], False)  # closed paths begin at its corners
            toolpath.go(line.node[nodes[1:]], cutting)
    for fan in line.fans():
        parts, every = line.divided(fan, gap)
        if parts > MAX_RINGS:
            raise CycleError(f"step-over D{{d}} needs more than {MAX_RINGS} rings", "use a larger D", d=limit)
        tip = _closed_paths(toolpath, fan, parts, every, gap)
        if toolpath.closing:
            toolpath.contour(tip)
    toolpath.lift()


def _closed_paths(toolpath, fan, parts, every, gap):
    """All closed paths of a fan, inside out, joined by slants; returns the tip of the last one's
    start.  every (n,): which of them each spoke keeps."""
    turned = slice(None, None, 1 if toolpath.climb else -1)
    base, every = fan.base[turned], every[turned]
    spoke, kept = fan.tip[turned] - base, int(every.min())
    first = int(np.argmin(np.where(every == kept, np.hypot(*spoke.T), np.inf)))
    base, spoke, every = (np.roll(part, -first, axis=0) for part in (base, spoke, every))
    toolpath.ends.append((base + spoke * (1.0 - every / parts)[:, None], base + spoke))
    toolpath.lift(base[0])
    start, level = 0, 0
    for k in range(parts % kept or kept, parts, kept):
        on = np.flatnonzero((parts - k) % every == 0)
        on = np.roll(on, -int(np.searchsorted(on, start)))
        ring = base[on] + spoke[on] * (k / parts)
        ahead, share = _slant(ring, every[on] == kept, SLANT * gap)
        levels = level + (k - level) * share
        toolpath.go((base[on] + spoke[on] * levels[:, None] / parts)[: ahead + 1])
        toolpath.seam()
        toolpath.go(np.roll(ring, -ahead, axis=0))
        toolpath.go(ring[ahead : ahead + 1])
        toolpath.seam()
        start, level = int(on[ahead]), k
    return base[start] + spoke[start]


def _slant(ring, allowed, length):
    """(index, share (n,)) of the first allowed point of a closed path at least `length` (mm) ahead of
    its start, and how far along the way there each point is; index 0 where the path is too short."""
    upto = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(ring, axis=0).T))))
    far = np.flatnonzero(allowed & (upto >= length) & (upto <= 0.5 * upto[-1]))
    if not len(far):
        return 0, np.ones(len(ring))
    return int(far[0]), np.minimum(upto / upto[far[0]], 1.0)
