# SPDX-License-Identifier: GPL-2.0-or-later
"""The segments of cuts that the stock needs, and the order in which they are cut.

Called by cycles/surface.py.  All lengths mm; a cut is a chain (k, 3) over a straight track.
Source: CN105492980 [0045]: where the stock has been cut already no pass is made.
Departs from it: the stock is a height map that every planned cut is taken out of, not the contour of a slice.

    1. A cut is looked at in steps not longer than a cell; HeightMap.needed says which of them lower the stock.
    2. Segments less than BRIDGE apart are one: to lift the tool takes longer.  Each begins and ends a step early and late, because
       between two needles nothing is known.
    3. Segments of neighbouring tracks that overlap are one region.  A region is cut as a whole, the nearest one next, so the path
       from segment to segment is short; within it the order of the tracks keeps climb cuts climb cuts.
"""

from dataclasses import dataclass

import numpy as np

BRIDGE = 1.0                # mm along the cut


@dataclass(frozen=True)
class Segment:
    """track: number of its track; low, high: mm in the direction of the tracks; chain (k, 3)"""

    track: int
    low: float
    high: float
    chain: np.ndarray


def clipped(chain, level):
    """A chain that goes no lower than `level` (mm)."""
    z = chain[:, 2]
    k = np.flatnonzero((z[:-1] < level) != (z[1:] < level))
    share = (level - z[k]) / (z[k + 1] - z[k])
    found = np.insert(chain, k + 1, chain[k] + share[:, None] * (chain[k + 1] - chain[k]), axis=0)
    found[:, 2] = np.maximum(found[:, 2], level)
    keep = np.ones(len(found), bool)            # of a level part only the ends are kept
    keep[1:-1] = ~((found[:-2, 2] == level) & (found[1:-1, 2] == level) & (found[2:, 2] == level))
    return found[keep]


def _steps(chain, longest):
    """Places along a chain, as edge and share of it, at most `longest` (mm) apart -> (n,)."""
    counts = np.maximum(np.ceil(np.linalg.norm(np.diff(chain, axis=0), axis=1) / longest - 1e-9), 1).astype(int)
    edge = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)) / np.repeat(counts, counts)
    return np.append(edge + share, float(len(counts)))


def _points(chain, places):
    """Places -> (n, 3)."""
    edge = np.minimum(places.astype(int), len(chain) - 2)
    return chain[edge] + (places - edge)[:, None] * (chain[edge + 1] - chain[edge])


def _part(chain, first, last):
    """The chain from a place to another one."""
    between = np.arange(int(np.floor(first)) + 1, int(np.ceil(last)))
    ends = _points(chain, np.array([first, last]))
    return np.concatenate([ends[:1], chain[between], ends[1:]])


def segments(stock, tool, chain, least, track=0, direction=(1.0, 0.0)):
    """The Segments of a chain that lower the stock.

    stock      check.sweep.HeightMap; nothing is cut
    tool       layout.DropTool
    least      mm: stock that reaches no more than this above what the whole chain leaves may stay
    track      number of its track; direction: (2,) unit vector of all tracks
    """
    chain = chain if len(chain) > 1 else np.repeat(chain, 2, axis=0)
    places = _steps(chain, stock.cell)
    points = _points(chain, places)
    wanted = stock.needed(tool, points[:-1], points[1:], least)
    if not wanted.any():
        return []
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    turns = np.diff(np.concatenate([[0], wanted.astype(np.int8), [0]]))
    first, last = np.flatnonzero(turns == 1), np.flatnonzero(turns == -1)
    apart = along[first[1:]] - along[last[:-1]] > BRIDGE
    first, last = first[np.concatenate([[True], apart])], last[np.concatenate([apart, [True]])]
    first, last = np.maximum(first - 1, 0), np.minimum(last + 1, len(places) - 1)
    far = points[:, :2] @ np.asarray(direction)
    return [Segment(track, *sorted((float(far[a]), float(far[b]))), _part(chain, places[a], places[b])) for a, b in zip(first, last)]


def regions(parts):
    """Lists of Segments of neighbouring tracks that overlap; each in the order it was given in."""
    owner = list(range(len(parts)))

    def root(k):
        while owner[k] != k:
            owner[k] = owner[owner[k]]
            k = owner[k]
        return k

    by_track = {}
    for k, one in enumerate(parts):
        by_track.setdefault(one.track, []).append(k)
    for track, mine in by_track.items():
        for k in mine:
            for other in by_track.get(track + 1, ()):
                if parts[k].low <= parts[other].high and parts[other].low <= parts[k].high:
                    owner[root(other)] = root(k)
    found = {}
    for k, one in enumerate(parts):
        found.setdefault(root(k), []).append(one)
    return list(found.values())


def in_order(parts, at):
    """Segments region by region, the next one with the nearest start; at: (x, y) of the tool, or None."""
    left, found = regions(parts), []
    while left:
        starts = np.array([region[0].chain[0, :2] for region in left])
        nearest = 0 if at is None else int(np.hypot(*(starts - at).T).argmin())
        found += left.pop(nearest)
        at = found[-1].chain[-1, :2]
    return found
