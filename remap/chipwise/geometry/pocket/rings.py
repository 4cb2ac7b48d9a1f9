"""P0, contour-parallel: rings a step-over apart, each from the original contours, inside out.

Called by cycles/pocket.py as a strategy (tracks.py says what that is).  Arcs stay arcs.

Why a step-over up to the tool radius leaves nothing: whoever walks from a point of the Field
straight to its nearest wall meets each ring after exactly the difference of the two distances.
So every point lies within a step-over of the ring outside it.  Beyond the tool radius
the corners between rings are left, and leftovers.py gives them their own moves.

Order.  The Field at ring k+1 lies within the Field at ring k: a tree, whose leaves are the
deepest places.  A leaf's ring is cut in the full; every other ring meets stock of one
step-over, because the rings inside it are cut before.  From any place of an inner ring one of
the outer rings is exactly a step-over away, so the way there is a short slant ahead, within
the cleared area's edge.  To the next leaf leads a straight slot where one fits, at the full width but
shorter than a ramp through the whole depth; the tool lifts only where none does, and between rings
about different islands.
"""
from dataclasses import dataclass

import numpy as np

from .. import elements, search
from ..tolerances import NODE_MM
from . import runs
from .fields import clear_way, clear_ways, fields_at, inside
from .tracks import Field, along, make_track

# Lengths ahead, in step-overs, at which the next ring is met: the longest that fits, else none. The longer,
# the more slowly the cut widens.
SLANTS = (4.0, 3.0, 2.0, 1.0, 0.5)

# A ring this much further than a step-over is not next to where the tool is.
BESIDE = 1.02

# Longest way at feed through cleared area, in tool radii, before lifting is the shorter one.
TRAVEL = 12.0

# Longest slot, in tool radii, from a ring already cut to the next deepest ring, instead of another
# ramp through the whole depth.
SLOT = 10.0

# Places on an element that a way may start from, and how many are tried for a clear one.
SAMPLES, TRIES, SLOT_TRIES = (0.0, 0.25, 0.5, 0.75), 8, 40


@dataclass(frozen=True, eq=False)
class _Node:
    """A Field at one ring, its loops in the direction of travel, and the Fields within it."""
    field: Field
    loops: tuple
    children: list


class _Way:
    """The Tracks of the Field `root` so far, the loops cut and where the tool is; here is None before
    the first one."""

    def __init__(self, root):
        self.root = root
        self.done, self.parts, self.flags, self.here = [], [], [], None
        self.cut = []                             # (loop, Field of its ring), in cutting order

    def lift(self, to):
        """Ends the Track; the next starts at a place (2,) mm."""
        if self.parts:
            self.done.append(make_track(elements.join(self.parts), np.concatenate(self.flags)))
        self.parts, self.flags, self.here = [], [], to

    def go(self, run, cutting=True):
        """Adds Elements that start here."""
        self.parts.append(run)
        self.flags.append(np.full(len(run), cutting))
        self.here = run.end[-1]

    def line(self, to, cutting=True):
        """Adds a line, where there is any way to go."""
        if np.hypot(*(to - self.here)) > NODE_MM:
            self.go(runs.line(self.here, to), cutting)

    def travel(self, to, field, radius):
        """To a place already cut: at feed inside a Field that is cleared where that is short, else
        through the air."""
        near = self.parts and np.hypot(*(to - self.here)) <= TRAVEL * radius
        if near and clear_way(field, self.here, to):
            self.line(to, False)
        else:
            self.lift(to)

    def tracks(self):
        self.lift(None)
        return tuple(self.done)


def contour_parallel(field, radius, step, direction, climb):
    """Tracks of a Field, rings `step` mm apart.  direction (rad) plays no part."""
    way = _Way(field)
    _cut(way, _tree(field, radius, step, climb), radius, step)
    return way.tracks()


def _tree(field, radius, step, climb):
    """The rings of a Field as a tree."""
    root = _node(field, climb)
    level, count = [root], 0
    while level:
        count += 1
        found = fields_at(field.pocket, field.distance + count * step)
        found = [f for f in found if f.area > 0.0 or len(f.boundary) > 1]
        level = _placed(found, level, climb) if found else []
    _prune(root, radius, step)
    return root


def _node(field, climb):
    return _Node(field, tuple(along(loop, climb) for loop in field.contours), [])


def _placed(found, parents, climb):
    """Nodes of Fields, each hung below the one of parents that holds it; others belong to
    another Field of the pocket."""
    point = np.array([f.boundary.start[0] for f in found])
    nodes, owner = [_node(f, climb) for f in found], np.full(len(found), -1)
    for k, parent in enumerate(parents):
        owner[inside(parent.field, point) & (owner < 0)] = k
    for node, k in zip(nodes, owner.tolist()):
        if k >= 0:
            parents[k].children.append(node)
    return [node for node, k in zip(nodes, owner.tolist()) if k >= 0]


def _prune(node, radius, step):
    """Takes away leaves not worth a plunge: the ring about them reaches all they would cut.  No
    place in a leaf is deeper than its outline's length over 2 pi."""
    for child in node.children:
        _prune(child, radius, step)
    node.children[:] = [c for c in node.children if c.children or step + sum(
        np.sum(elements.lengths(loop)) for loop in c.loops) / (2.0 * np.pi) > radius]


def _cut(way, node, radius, step):
    """A node: what lies within it first, then its own loops, the nearest first."""
    waiting = list(node.children)
    while waiting:
        _cut(way, waiting.pop(_nearest(way.here, [c.loops[0] for c in waiting])), radius, step)
    left, cut = list(node.loops), [(loop, c.field) for c in node.children for loop in c.loops]
    while left:
        k, place = _beside(way, node, cut, left, radius, step)
        loop = left.pop(k)
        way.line(runs.point(loop, *place))
        way.go(runs.rotated(loop, *place))
        cut.append((loop, node.field))
        way.cut.append(cut[-1])


def _nearest(here, loops):
    """Index of the loop nearest to a place."""
    if here is None or len(loops) == 1:
        return 0
    return runs.least([runs.nearest(loop, here)[0] for loop in loops])


def _beside(way, node, cut, left, radius, step):
    """(index of the loop to cut next, place to meet it at), with the tool brought beside it: where
    it is, through cleared area, through the air, along a slot, or in the solid."""
    if way.here is not None:
        gaps = [runs.nearest(loop, way.here)[0] for loop in left]
        k = runs.least(gaps)
        if way.parts and gaps[k] <= BESIDE * step:
            place = _met(way.here, node.field, left[k], step)
            if place is not None:
                return k, place
        found = _pair(way.here, cut, left, BESIDE * step, node.field)
        if found is not None:
            way.travel(*found[1:], radius)
            return found[0], _met(way.here, node.field, left[found[0]], step)
        found = _slot(way, left, SLOT * radius)
        if found is not None:
            way.travel(*found[2:], radius)
            return found[:2]
    else:
        k = 0
    longest = runs.least(-elements.lengths(left[k]))
    way.lift(runs.point(left[k], longest, 0.5))
    return k, (longest, 0.5)


def _pair(here, cut, left, reach, field):
    """(index of a loop, place, Field of that place): a place on a loop already cut, at most `reach`
    (mm) from a loop that is left, with a clear way there, the nearest of them; or None."""
    best = (np.inf,)
    for k, other in enumerate(left):
        tree = search.build(*elements.boxes(other))
        for loop, owner in cut:
            places, gap = _near(loop, other, tree, reach)
            cost = np.hypot(*(places - here).T) + gap
            for m in runs.rising(cost)[:TRIES]:
                if cost[m] >= best[0] - runs.SNAP_MM:
                    break
                if clear_way(field, places[m], runs.point(other, *runs.nearest(other, places[m])[1:])):
                    best = (cost[m], k, places[m], owner)
                    break
    return best[1:] or None


def _slot(way, left, reach):
    """(index of a loop, place on it, place, Field of that place): from a loop already cut straight to
    a loop that is left, inside the whole Field and not longer than `reach` (mm); or None."""
    best = (np.inf,)
    for k, other in enumerate(left):
        index = np.repeat(np.arange(len(other)), 2)
        t = np.tile(SAMPLES[::2], len(other))
        ends = elements.point_at(other, index, t)
        for loop, owner in way.cut:
            places = elements.point_at(loop, np.arange(len(loop)), np.zeros(len(loop)))
            gap = np.hypot(*(places[:, None] - ends).transpose(2, 0, 1))
            cost = np.where(gap <= reach, gap + 0.5 * np.hypot(*(places - way.here).T)[:, None], np.inf)
            order = runs.rising(cost.ravel())[:SLOT_TRIES]
            order = order[cost.ravel()[order] < best[0] - runs.SNAP_MM]
            if not len(order):
                continue
            m, n = np.unravel_index(order, cost.shape)
            ok = np.flatnonzero(clear_ways(way.root, places[m], ends[n]))
            if len(ok):
                first = ok[0]
                best = (cost[m[first], n[first]], k, (int(index[n[first]]), float(t[n[first]])),
                        places[m[first]], owner)
    return best[1:] or None


def _near(loop, other, tree, reach):
    """Places (m, 2) on a loop that lie within reach (mm) of another loop, and how far (m,)."""
    index = np.repeat(np.arange(len(loop)), len(SAMPLES))
    places = elements.point_at(loop, index, np.tile(SAMPLES, len(loop)))
    who, leaf = search.near_points(tree, places, np.full(len(places), reach))
    if not len(who):
        return places[:0], np.zeros(0)
    gap = elements.distances(other, leaf, places[who])
    first = np.flatnonzero(np.concatenate(([True], who[1:] != who[:-1])))
    least = np.minimum.reduceat(gap, first)
    ok = least <= reach
    return places[who[first[ok]]], least[ok]


def _met(here, field, loop, step):
    """Where a loop is met: ahead of its place nearest to here, as far as the slant there is clear;
    None where no slant is."""
    gap, index, t = runs.nearest(loop, here)
    if gap <= runs.SNAP_MM:
        return runs.snapped(loop, index, t)
    total = float(np.sum(elements.lengths(loop)))
    at = runs.along_of(loop, index, t)
    ahead = [s * step for s in SLANTS if s * step <= 0.3 * total]
    places = [runs.snapped(loop, *runs.place_at(loop, at + a)) for a in ahead]
    places.append(runs.snapped(loop, index, t))
    points = np.array([runs.point(loop, *p) for p in places])
    clear = clear_ways(field, here, points)
    return places[int(np.argmax(clear))] if clear.any() else None
