# SPDX-License-Identifier: GPL-2.0-or-later
"""The segments of cuts that the stock needs, and the order in which they are cut.

Called by cycles/surface.py.  All lengths mm; a cut is a curve.Curve over a straight track.
Source: CN105492980 [0045]: where the stock has been cut already no pass is made.
Departs from it: the stock is a height map that every planned cut is taken out of, not the contour of a slice.

    1. A cut is looked at in steps not longer than a cell; HeightMap.needed says which of them lower the stock.
    2. Segments less than BRIDGE apart are one: to lift the tool takes longer.  Each begins and ends a step early and
       late, because between two needles nothing is known.
    3. Segments of neighbouring tracks that overlap are one region.  A region is cut as a whole, the nearest one next,
       so the path from segment to segment is short; within it the order of the tracks keeps climb cuts climb cuts.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.surface.curve import Curve, on_arcs

BRIDGE = 1.0  # mm along the cut
WALL = 0.01  # run of a step over its rise: what is as steep as this is a wall


@dataclass(frozen=True)
class Segment:
    """track: number of its track; low, high: mm in the direction of the tracks; curve: curve.Curve"""

    track: int
    low: float
    high: float
    curve: Curve


def clipped(curve, level):
    """A Curve that goes no lower than `level` (mm)."""
    chain, z = curve.points, curve.points[:, 2]
    k = np.flatnonzero((z[:-1] < level) != (z[1:] < level))
    share = (level - z[k]) / (z[k + 1] - z[k])
    new = chain[k] + share[:, None] * (chain[k + 1] - chain[k])
    found, centre = (
        np.insert(chain, k + 1, _at_level(new, curve.centre[k + 1], chain[k + 1], level), axis=0),
        np.insert(curve.centre, k + 1, curve.centre[k + 1], axis=0),
    )
    found[:, 2] = np.maximum(found[:, 2], level)
    is_level = np.append(False, (found[:-1, 2] == level) & (found[1:, 2] == level))
    centre[is_level] = np.nan
    keep = np.append(~(is_level[:-1] & is_level[1:]), True)  # of a level part only the ends are kept
    return Curve(found[keep], centre[keep])


def _at_level(points, centre, ends, level):
    """Points (n, 3) of chords, at a height `level`, moved along it onto the arcs about centre (n, 3) that lead to ends
    (n, 3)."""
    points = points.copy()
    off = points[:, :2] - centre[:, :2]
    now = np.hypot(off[:, 0], off[:, 1])
    there = np.sqrt(np.maximum(((ends - centre) ** 2).sum(axis=1) - (level - centre[:, 2]) ** 2, 0.0))
    moves = now > 1e-9  # not those of lines, whose centre is NaN
    points[moves, :2] = (centre[:, :2] + off * (there / np.maximum(now, 1e-9))[:, None])[moves]
    points[:, 2] = level
    return points


def steps(chain, longest):
    """Places along a chain, as edge and share of it, at most `longest` (mm) apart -> (n,)."""
    counts = np.maximum(np.ceil(np.linalg.norm(np.diff(chain, axis=0), axis=1) / longest - 1e-9), 1).astype(int)
    edge = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)) / np.repeat(counts, counts)
    return np.append(edge + share, float(len(counts)))


def points_at(chain, places):
    """Places -> (n, 3)."""
    edge = np.minimum(places.astype(int), len(chain) - 2)
    return chain[edge] + (places - edge)[:, None] * (chain[edge + 1] - chain[edge])


def _part(curve, first, last):
    """The Curve from a place to another one."""
    between = np.arange(int(np.floor(first)) + 1, int(np.ceil(last)))
    edge = np.minimum(np.array([first, last]).astype(int), len(curve.points) - 2)
    edge[1] = int(np.ceil(last)) - 1
    centre = curve.centre[edge + 1]
    ends = on_arcs(
        points_at(curve.points, np.array([first, last])),
        centre,
        np.linalg.norm(curve.points[edge + 1] - centre, axis=1),
    )
    return Curve(
        np.concatenate([ends[:1], curve.points[between], ends[1:]]),
        np.concatenate([np.full((1, 3), np.nan), curve.centre[between], centre[1:]]),
    )


def segments(stock, tool, curve, least, track=0, direction=(1.0, 0.0)):
    """The Segments of a Curve that lower the stock.

    stock      check.sweep.HeightMap; nothing is cut
    tool       layout.DropTool
    least      mm: stock that reaches no more than this above what the whole chain leaves may stay
    track      number of its track; direction: (2,) unit vector of all tracks
    """
    curve = curve if len(curve.points) > 1 else Curve.straight(np.repeat(curve.points, 2, axis=0))
    chain = curve.points
    places = steps(chain, stock.cell)
    points = points_at(chain, places)
    wanted = stock.needed(tool, points[:-1], points[1:], least)
    if not wanted.any():
        return []
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    turns = np.diff(np.concatenate([[0], wanted.astype(np.int8), [0]]))
    first, last = np.flatnonzero(turns == 1), np.flatnonzero(turns == -1)
    apart = along[first[1:]] - along[last[:-1]] > BRIDGE
    first, last = first[np.concatenate([[True], apart])], last[np.concatenate([apart, [True]])]
    first, last = _widened(points, first, last)
    far = points[:, :2] @ np.asarray(direction)
    return [
        Segment(track, *sorted((float(far[a]), float(far[b]))), _part(curve, places[a], places[b]))
        for a, b in zip(first, last)
    ]


def _widened(points, first, last):
    """Segments that begin at points[first] and end at points[last], a step longer at both ends.  Not up a wall: there
    it cuts nothing, and a Segment that begins on its step down a wall begins at the foot of it."""
    step = np.diff(points, axis=0)
    wall = np.append(np.hypot(step[:, 0], step[:, 1]) < WALL * np.abs(step[:, 2]), False)
    low = wall[first] & (last - first > 1)
    early, late = ~low & (first > 0) & ~wall[first - 1], (last < len(step)) & ~wall[last]
    return first + low - early, last + late


def _neighbours(parts):
    """For each of the Segments the numbers of those of the track before it that it overlaps."""
    by_track, found = {}, []
    for k, one in enumerate(parts):
        by_track.setdefault(one.track, []).append(k)
    for one in parts:
        found.append(
            [k for k in by_track.get(one.track - 1, ()) if parts[k].low <= one.high and one.low <= parts[k].high]
        )
    return found


def _regions(before):
    """The number of its region for each Segment, from _neighbours()."""
    owner = list(range(len(before)))

    def root(k):
        while owner[k] != k:
            owner[k] = owner[owner[k]]
            k = owner[k]
        return k

    for k, others in enumerate(before):
        for other in others:
            owner[root(k)] = root(other)
    return np.array([root(k) for k in range(len(before))])


def in_order(parts, at):
    """Segments region by region, the next one with the nearest start; at: (x, y) of the tool, or None.

    A region is cut branch by branch: after a Segment the one beside it on the next track, unless another branch has to
    be cut before that, because it leads to it, too.
    """
    if not parts:
        return []
    before = _neighbours(parts)
    after, waits = [[] for _ in parts], np.array([len(one) for one in before])
    for k, others in enumerate(before):
        for other in others:
            after[other].append(k)
    region, starts = _regions(before), np.array([one.curve.points[0, :2] for one in parts])
    found, now = [], None
    ready = waits == 0
    left = np.bincount(region, minlength=len(parts))
    while len(found) < len(parts):
        here = [] if now is None else [k for k in after[now] if ready[k]]
        if not here:
            here = (
                np.flatnonzero(ready & (region == region[now]))
                if now is not None and left[region[now]]
                else np.flatnonzero(ready)
            )
        now = int(here[0] if at is None else here[int(np.hypot(*(starts[here] - at).T).argmin())])
        found.append(parts[now])
        at, ready[now] = parts[now].curve.points[-1, :2], False
        left[region[now]] -= 1
        for k in after[now]:
            waits[k] -= 1
            ready[k] = waits[k] == 0
    return found
