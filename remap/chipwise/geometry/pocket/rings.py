# SPDX-License-Identifier: GPL-2.0-or-later
"""P0, contour-parallel: rings a step-over apart, each from the original contours, inside out.

Called by strategies.py and concentric.py as a strategy (tracks.py says what that is).  Arcs stay arcs.  Corners of all
rings but the wall are rounded (rounded.py), and the links from ring to ring are tangent where they have room
(wall_arcs.py).

Why a step-over up to the tool radius leaves nothing: whoever walks from a point of the machinable region
straight to its nearest wall meets each ring after exactly the difference of the two distances.
So every point lies within a step-over of the ring outside it.  Beyond the tool radius
the corners between rings are left, and rest_material.py gives them their own moves.

Order.  The machinable region at ring k+1 lies within the machinable region at ring k: a tree, whose leaves are the
deepest positions.  A leaf's ring is cut in the full; every other ring meets stock of one
step-over, because the rings inside it are cut before.  From any position of an inner ring one of
the outer rings is exactly a step-over away, so the way there is a short slant ahead, within
the cleared area's edge.  To the next leaf leads a straight slot where one fits, at the full width but
shorter than a ramp through the whole depth; the tool lifts only where none does, and between rings
about different islands.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from chipwise.geometry.base import elements, search
from chipwise.geometry.base.tolerances import NODE_MM
from chipwise.geometry.base import chains
from chipwise.geometry.pocket.machinable import clear_segment, clear_segments, machinable_regions, inside
from chipwise.geometry.pocket.rounded import rounded
from chipwise.geometry.pocket.tracks import MachinableRegion, along, make_track

# Lengths ahead, in step-overs, at which the next ring is met: the longest that fits, else none. The longer,
# the more slowly the cut widens.
SLANTS = (2.5, 2.0, 1.5, 1.0, 0.5)

# A ring this much further than a step-over is not next to where the tool is.
BESIDE = 1.02

# Longest move at feed through cleared area, in tool radii, before lifting is the shorter one.
TRAVEL = 12.0

# Longest slot, in tool radii, from a ring already cut to the next deepest ring, instead of another
# ramp through the whole depth.
SLOT = 10.0

# Slots compared at once: bounds the memory, a matter of speed only.
AT_ONCE = 200_000

# Positions on an element that a link may start from, and how many are tried for a clear one.
SAMPLES, TRIES, SLOT_TRIES = (0.0, 0.25, 0.5, 0.75), 8, 40


@dataclass(frozen=True, eq=False)
class _Node:
    """A machinable region at one ring, its loops in the direction of travel, and the machinable regions within it."""

    region: MachinableRegion
    loops: tuple
    children: list


class _Toolpath:
    """The Tracks of the machinable region `root` so far, the loops cut and where the tool is; here is None before
    the first one."""

    def __init__(self, root, walls=None):
        self.root, self.walls = root, walls
        self.done, self.parts, self.flags, self.here = [], [], [], None
        self.cut = []  # (loop, machinable region of its ring), in cutting order

    def lift(self, to):
        """Ends the Track; the next starts at a position (2,) mm."""
        if self.parts:
            self.done.append(make_track(elements.join(self.parts), np.concatenate(self.flags)))
        self.parts, self.flags, self.here = [], [], to

    def go(self, chain, cutting=True):
        """Adds Elements that start here."""
        self.parts.append(chain)
        self.flags.append(np.full(len(chain), cutting))
        self.here = chain.end[-1]

    def line(self, to, cutting=True):
        """Adds a line if there is any way to go."""
        if np.hypot(*(to - self.here)) > NODE_MM:
            self.go(chains.line(self.here, to), cutting)

    def travel(self, to, region, radius):
        """To a position already cut: at feed inside a machinable region that is cleared where that is short, else
        through the air."""
        near = self.parts and np.hypot(*(to - self.here)) <= TRAVEL * radius
        if near and clear_segment(region, self.here, to):
            self.line(to, False)
        else:
            self.lift(to)

    def heading(self):
        """Of the path that ends here; None where none does."""
        if not self.parts:
            return None
        last = self.parts[-1]
        return chains.heading(last, len(last) - 1, 1.0)

    def ring(self, loop, position, step, is_wall):
        """All of a ring, from a position of it that the tool can go straight to."""
        if is_wall:
            self.go(self._onto(loop, position, step))
            return
        found = self._smooth(loop, step)
        if found is None:
            self.line(chains.point(loop, *position))
        else:
            self.go(found[0])
            position = found[1]
        self.go(chains.rotated(loop, *position))

    def _smooth(self, loop, step):
        """(chain, position): two arcs tangent to the path so far and to a ring; None."""
        if self.walls is None or not self.parts:
            return None
        return self.walls.beside(self.here, self.heading(), loop, step)

    def _onto(self, loop, position, step):
        """The chain onto a finished wall, along it and off it; from here, but for a start in the solid."""
        found = self.walls.onto(self.here, self.heading(), loop, step)
        if found is not None:
            return elements.join((found[0], self.walls.finished(chains.rotated(loop, *found[1]))))
        ring = chains.rotated(loop, *position)
        if not self.parts and np.hypot(*(ring.start[0] - self.here)) <= NODE_MM:
            found = self.walls.from_solid(ring)
            return self.walls.finished(ring) if found is None else elements.join((found[0], self.walls.finished(ring)))
        self.line(ring.start[0])
        return self.walls.finished(ring)

    def tracks(self):
        self.lift(None)
        return tuple(self.done)


def contour_parallel(region, radius, step, direction, climb, walls=None):
    """Tracks of a machinable region, rings `step` mm apart.  direction (rad) plays no part."""
    toolpath = _Toolpath(region, walls)
    _cut(toolpath, _tree(region, radius, step, climb), radius, step)
    return toolpath.tracks()


def _tree(region, radius, step, climb):
    """The rings of a machinable region as a tree."""
    root = _Node(region, tuple(along(loop, climb) for loop in region.contours), [])
    level, count = [root], 0
    while level:
        count += 1
        found = machinable_regions(region.pocket, region.distance + count * step)
        found = [f for f in found if f.area > 0.0 or len(f.boundary) > 1]
        level = _placed(found, level, climb, radius) if found else []
    _prune(root, radius, step)
    return root


def _node(region, climb, radius):
    """A ring within another: its corners are rounded."""
    return _Node(region, tuple(along(rounded(loop, radius), climb) for loop in region.contours), [])


def _placed(found, parents, climb, radius):
    """Nodes of machinable regions, each hung below the one of parents that holds it; others belong to
    another machinable region of the pocket."""
    point = np.array([f.boundary.start[0] for f in found])
    nodes, owner = [_node(f, climb, radius) for f in found], np.full(len(found), -1)
    for k, parent in enumerate(parents):
        owner[inside(parent.region, point) & (owner < 0)] = k
    for node, k in zip(nodes, owner.tolist()):
        if k >= 0:
            parents[k].children.append(node)
    return [node for node, k in zip(nodes, owner.tolist()) if k >= 0]


def _prune(node, radius, step):
    """Takes away leaves not worth a plunge: the ring about them reaches all they would cut.  No
    position in a leaf is deeper than its outline's length over 2 pi."""
    for child in node.children:
        _prune(child, radius, step)
    node.children[:] = [
        c
        for c in node.children
        if c.children or step + sum(np.sum(elements.lengths(loop)) for loop in c.loops) / (2.0 * np.pi) > radius
    ]


def _cut(toolpath, node, radius, step):
    """A node: what lies within it first, then its own loops, the nearest first."""
    waiting = list(node.children)
    while waiting:
        _cut(toolpath, waiting.pop(_nearest(toolpath.here, [c.loops[0] for c in waiting])), radius, step)
    left, cut = list(node.loops), [(loop, c.region) for c in node.children for loop in c.loops]
    while left:
        k, position = _beside(toolpath, node, cut, left, radius, step)
        loop = left.pop(k)
        toolpath.ring(loop, position, step, toolpath.walls is not None and node.region is toolpath.root)
        cut.append((loop, node.region))
        toolpath.cut.append(cut[-1])


def _nearest(here, loops):
    """Index of the loop nearest to a position."""
    if here is None or len(loops) == 1:
        return 0
    return chains.least([chains.nearest(loop, here)[0] for loop in loops])


def _beside(toolpath, node, cut, left, radius, step):
    """(index of the loop to cut next, position to meet it at), with the tool brought beside it: where
    it is, through cleared area, through the air, along a slot, or in the solid."""
    if toolpath.here is not None:
        gaps = [chains.nearest(loop, toolpath.here)[0] for loop in left]
        k = chains.least(gaps)
        if toolpath.parts and gaps[k] <= BESIDE * step:
            position = _met(toolpath.here, node.region, left[k], step)
            if position is not None:
                return k, position
        found = _pair(toolpath.here, cut, left, BESIDE * step, node.region)
        if found is not None:
            toolpath.travel(*found[1:], radius)
            return found[0], _met(toolpath.here, node.region, left[found[0]], step)
        found = _slot(toolpath, left, SLOT * radius)
        if found is not None:
            toolpath.travel(*found[2:], radius)
            return found[:2]
    else:
        k = 0
    longest = chains.least(-elements.lengths(left[k]))
    toolpath.lift(chains.point(left[k], longest, 0.5))
    return k, (longest, 0.5)


def _pair(here, cut, left, reach, region):
    """(index of a loop, position, machinable region of that position): a position on a loop already cut, at most
    `reach`
    (mm) from a loop that is left, with a clear link there, the nearest of them; or None."""
    best = (np.inf,)
    for k, other in enumerate(left):
        tree = search.build(*elements.boxes(other))
        for loop, owner in cut:
            positions, gap = _near(loop, other, tree, reach)
            cost = np.hypot(*(positions - here).T) + gap
            for m in chains.rising(cost)[:TRIES]:
                if cost[m] >= best[0] - chains.SNAP_MM:
                    break
                if clear_segment(region, positions[m], chains.point(other, *chains.nearest(other, positions[m])[1:])):
                    best = (cost[m], k, positions[m], owner)
                    break
    return best[1:] or None


def _slot(toolpath, left, reach):
    """(index of a loop, position on it, position, machinable region of that position): from a loop already cut straight
    to a loop that is left, inside the whole machinable region and not longer than `reach` (mm); or None."""
    best = (np.inf,)
    for k, other in enumerate(left):
        index = np.repeat(np.arange(len(other)), 2)
        t = np.tile(SAMPLES[::2], len(other))
        ends = elements.point_at(other, index, t)
        tree = search.build(*elements.boxes(other))
        for loop, owner in toolpath.cut:
            positions = elements.point_at(loop, np.arange(len(loop)), np.zeros(len(loop)))
            cost, m, n = _shortest(positions, ends, toolpath.here, reach, partial(_gaps, other, tree))
            wanted = cost < best[0] - chains.SNAP_MM
            cost, m, n = cost[wanted], m[wanted], n[wanted]
            if not len(cost):
                continue
            ok = np.flatnonzero(clear_segments(toolpath.root, positions[m], ends[n]))
            if len(ok):
                first = ok[0]
                best = (cost[first], k, (int(index[n[first]]), float(t[n[first]])), positions[m[first]], owner)
    return best[1:] or None


def _shortest(positions, ends, here, reach, gaps):
    """The SLOT_TRIES cheapest slots from positions (a, 2) to ends (b, 2), not longer than `reach` (mm): cost (k,) mm,
    rising; indices (k,), (k,).  gaps(positions, reach) gives the least length (a,) mm that a slot from each can
    have."""
    half_gap = 0.5 * np.hypot(*(positions - here).T)
    least, order = half_gap, np.arange(len(positions))
    if len(positions) * len(ends) > AT_ONCE:
        least = half_gap + gaps(positions, np.full(len(positions), reach + chains.SNAP_MM))
        order = np.argsort(least, kind="stable")
        order = order[np.isfinite(least[order])]
    size = max(1, AT_ONCE // len(ends))
    cost, flat = np.zeros(0), np.zeros(0, int)
    for first in range(0, len(order), size):
        if len(cost) == SLOT_TRIES and least[order[first]] > cost[-1] + 2.0 * chains.SNAP_MM:
            break
        rows = np.sort(order[first : first + size])
        gap = np.hypot(*(positions[rows, None] - ends).transpose(2, 0, 1))
        more = np.where(gap <= reach, gap + half_gap[rows, None], np.inf).ravel()
        near = np.flatnonzero(np.isfinite(more))
        cost = np.concatenate((cost, more[near]))
        flat = np.concatenate((flat, rows[near // len(ends)] * len(ends) + near % len(ends)))
        order_of = np.lexsort((flat, np.round(cost / chains.SNAP_MM)))[:SLOT_TRIES]
        cost, flat = cost[order_of], flat[order_of]
    return cost, flat // len(ends), flat % len(ends)


def _gaps(loop, tree, positions, reach):
    """Distance (m,) mm from positions (m, 2) to a loop with its tree; inf beyond reach (m,) mm."""
    return search.near_gaps(tree, loop, positions, reach)


def _near(loop, other, tree, reach):
    """Positions (m, 2) on a loop that lie within reach (mm) of another loop, and how far (m,)."""
    index = np.repeat(np.arange(len(loop)), len(SAMPLES))
    positions = elements.point_at(loop, index, np.tile(SAMPLES, len(loop)))
    gap = _gaps(other, tree, positions, np.full(len(positions), reach))
    ok = gap <= reach
    return positions[ok], gap[ok]


def _met(here, region, loop, step):
    """Where a loop is met: ahead of its position nearest to here, as far as the slant there is clear;
    None where no slant is."""
    gap, index, t = chains.nearest(loop, here)
    if gap <= chains.SNAP_MM:
        return chains.snapped(loop, index, t)
    total = float(np.sum(elements.lengths(loop)))
    at = chains.station_of(loop, index, t)
    ahead = [s * step for s in SLANTS if s * step <= 0.3 * total]
    positions = [chains.snapped(loop, *chains.position_at(loop, at + a)) for a in ahead]
    positions.append(chains.snapped(loop, index, t))
    points = np.array([chains.point(loop, *p) for p in positions])
    clear = clear_segments(region, here, points)
    return positions[int(np.argmax(clear))] if clear.any() else None
