# SPDX-License-Identifier: GPL-2.0-or-later
"""Places of the walls that paths of constant engagement have not visited, and chains along them.

Called by engage.py.  Lengths mm.
"""

import math

import numpy as np

from chipwise.geometry.pocket.engage_ground import slack
from chipwise.geometry.base import chains, elements
from chipwise.geometry.base.elements import Elements

# Spacing of the places that are asked for, in tool radii; places nearer than the second number are one.
ASKED, JOINED = 0.01, 2.0

# A place within this of the path has been visited: the radius of the ground that is the path itself.
VISITED_MM = 9e-4

# Elements up to this long are left out, arcs up to this long are lines. mm
NOTHING_MM, SHORT_MM = 1e-6, 0.005


class Wall:
    """A closed contour of a region, and which places of it the path has been at so far."""

    def __init__(self, contour, radius):
        self.contour, self.radius = contour, radius
        length = elements.lengths(contour)
        self.total = float(length.sum())
        count = np.maximum(2, np.ceil(length / (ASKED * radius)).astype(int)) if self.total > 0.0 else np.zeros(0, int)
        self.index = np.repeat(np.arange(len(count)), count)
        self.share = np.concatenate([np.arange(n) / n for n in count] or [np.empty(0)])
        self.station = (np.cumsum(length) - length)[self.index] + length[self.index] * self.share
        self.point = elements.point_at(contour, self.index, self.share)
        self.visited = np.zeros(len(self.station), bool)

    def chains(self, ground, track, place=None, within=math.inf):
        """Chains along the contour that hold all of its places that the path (track) has not visited.  With a
        place, those that begin further from it than `within`, or are longer than that, may be left out."""
        waiting = np.flatnonzero(~self.visited)
        self.visited[waiting] = track.rim(self.point[waiting], track.radius)
        missing = np.flatnonzero(~self.visited)
        if not len(missing):
            return []
        if len(missing) == len(self.station):
            open_at = np.flatnonzero(ground.rim(self.point, slack(self.radius)))  # it begins where the tool can get to
            return [
                chains.rotated(self.contour, int(self.index[open_at[0]]), float(self.share[open_at[0]]))
                if len(open_at)
                else self.contour
            ]
        first, begin, end = _ranges(self.station, missing, self.total, JOINED * self.radius)
        if place is not None:
            gap = np.hypot(*(self.point[first] - place).T)
            near = (gap < within + NOTHING_MM) & (np.minimum(end - begin, self.total) < within + NOTHING_MM)
            begin, end = begin[near], end[near]
        return [_between(self.contour, self.total, a, b) for a, b in zip(begin.tolist(), end.tolist())]


def _ranges(station, missing, total, joined):
    """(number of the place where each begins, from, to: mm along the contour), each from the place before to the place
    after what is missing."""
    n = len(station)
    before, after = station[missing - 1], station[(missing + 1) % n]
    before[missing == 0] -= total
    after[missing == n - 1] += total
    parted = np.flatnonzero(before[1:] - after[:-1] > joined) + 1
    first, last = np.concatenate(([0], parted)), np.concatenate((parted, [len(missing)])) - 1
    place, begin, end = missing[first] - 1, before[first], after[last]
    if len(begin) > 1 and begin[0] + total - end[-1] <= joined:
        place[0], begin[0] = place[-1], begin[-1] - total
        place, begin, end = place[:-1], begin[:-1], end[:-1]
    return place, begin, end


def _between(contour, total, a, b):
    """The chain from a to b mm along a closed contour; all of it if they meet."""
    if b - a >= total:
        return contour
    (i, s), (j, t) = chains.position_at(contour, a), chains.position_at(contour, b)
    if i == j and t > s:
        return chains.segment(contour, i, s, t)
    parts = [chains.segment(contour, i, s, 1.0)] if s < 1.0 else []
    k = (i + 1) % len(contour)
    while k != j:
        parts.append(elements.take(contour, np.array([k])))
        k = (k + 1) % len(contour)
    if t > 0.0:
        parts.append(chains.segment(contour, j, 0.0, t))
    return elements.join(parts)


def beginning(chain, length):
    """The first mm of a chain, or all of it."""
    each = elements.lengths(chain)
    upto = np.cumsum(each)
    k = int(np.searchsorted(upto, length))
    if k == len(chain):
        return chain
    return elements.join(
        (
            elements.take(chain, np.arange(k)),
            chains.segment(chain, k, 0.0, 1.0 - float(upto[k] - length) / float(each[k])),
        )
    )


def nearest(chain, point):
    """(index, t) of the place of a chain nearest to a point."""
    gap = elements.distances(chain, np.arange(len(chain)), np.broadcast_to(point, (len(chain), 2)))
    k = int(np.argmin(gap))
    t = np.linspace(0.0, 1.0, 33)
    at = elements.point_at(chain, np.full(len(t), k), t)
    return k, float(t[int(np.argmin(np.hypot(*(at - point).T)))])


def sound(chain):
    """A chain without elements of no length, and with lines for arcs so short that rounding could make full circles of
    them."""
    chord = np.hypot(*(chain.end - chain.start).T)
    keep = (chord > NOTHING_MM) | (np.abs(chain.sweep) > math.pi)
    arc = chain.is_arc & ((chord >= SHORT_MM) | (np.abs(chain.sweep) > math.pi))
    chain = elements.take(
        Elements(
            chain.start,
            chain.end,
            np.where(arc[:, None], chain.centre, 0.0),
            np.where(arc, chain.radius, 0.0),
            chain.start_angle,
            np.where(arc, chain.sweep, 0.0),
        ),
        keep,
    )
    return chain
