# SPDX-License-Identifier: GPL-2.0-or-later
"""Inaccessible regions, and their edges at necks that the tool enters from both sides.

Called by inaccessible.py.  Where two or more tool edges bound one region they may cross:
the tool reaches into the neck from one side beyond where it came from the other.  The
region then falls into parts.  Its edges are cut where they cross, what the tool covers from
anywhere on its paths is dropped, and the rest is chained again.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from chipwise.geometry.base import arcs, elements
from chipwise.geometry.offset import nodes
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.base.intersect import meetings
from chipwise.geometry.base.lines import cross
from chipwise.geometry.base.tolerances import NODE_MM


@dataclass(frozen=True, eq=False)
class InaccessibleRegion:
    """Stock between the finish shape and what the tool can reach.

    area mm2; lines: source lines of the finish elements on its edge; boundary: closed run
    of Elements, made when asked for from `index` into `pool`, which all regions share;
    holes: islands of a pocket inside the region, chains of Elements.
    """

    area: float
    lines: tuple
    pool: Elements = field(repr=False)
    index: np.ndarray = field(repr=False)
    holes: tuple = ()

    @cached_property
    def boundary(self):
        return elements.take(self.pool, self.index)


def areas(everything, members):
    """Signed area (mm2) of every list of elements, all at once."""
    if not members:
        return []
    index = np.concatenate([np.array(m, int) for m in members])
    first = np.cumsum([0] + [len(m) for m in members[:-1]])
    origin = np.repeat(everything.start[index[first]], [len(m) for m in members], axis=0)
    part = 0.5 * cross(everything.start[index] - origin, everything.end[index] - origin) + arcs.segment_area(
        everything.radius[index], everything.sweep[index]
    )
    return np.add.reduceat(part, first).tolist()


def disentangled(loop, lines, paths, side, radius):
    """InaccessibleRegions of a closed run (k elements) whose edges may cross; lines: source
    line of each element, None for a tool edge.  A run the other way round encloses what
    the tool reaches from both sides, not from neither."""
    edge = np.array([line is None for line in lines])
    cut, origin = _cut(loop, np.flatnonzero(edge))
    if len(cut) > len(loop):
        clear = ~edge[origin] | ~_covered(cut, paths, radius)
        cut, origin = elements.take(cut, clear), origin[clear]
    chains = _chained(cut)
    return [
        InaccessibleRegion(
            -side * area, tuple(sorted({lines[origin[k]] for k in chain} - {None})), cut, np.array(chain)
        )
        for chain, area in zip(chains, areas(cut, chains))
    ]


def _cut(loop, edges):
    """The run with its tool edges (e,) int cut where they cross, and the index in the run
    that each piece comes from."""
    a, b = np.triu_indices(len(edges), 1)
    length = elements.lengths(loop)
    met = meetings(loop, length, edges[a], edges[b])
    count = len(loop)
    owner = np.concatenate((np.arange(count), np.arange(count), met.a, met.b))
    t = np.concatenate((np.zeros(count), np.ones(count), met.t_a, met.t_b))
    point = np.concatenate((loop.start, loop.end, met.point, met.point))
    order = np.lexsort((t, owner))
    owner, t, point = owner[order], t[order], point[order]
    here = np.flatnonzero((owner[1:] == owner[:-1]) & ((t[1:] - t[:-1]) * length[owner[1:]] > NODE_MM))
    index, t0, t1 = owner[here], t[here], t[here + 1]
    return Elements(
        point[here],
        point[here + 1],
        loop.centre[index],
        loop.radius[index],
        loop.start_angle[index] + t0 * loop.sweep[index],
        loop.sweep[index] * (t1 - t0),
    ), index


def _covered(e, paths, radius):
    """Which elements (n,) bool the tool covers, by their middles, from anywhere on paths."""
    every = elements.join([path.elements for path in paths])
    count = len(every)
    middle = elements.point_at(e, np.arange(len(e)), np.full(len(e), 0.5))
    gap = elements.distances(every, np.tile(np.arange(count), len(e)), np.repeat(middle, count, axis=0))
    return gap.reshape(len(e), count).min(axis=1) < radius - 2.0 * NODE_MM


def _chained(e):
    """Lists of elements joined end to start to loops that pass no node twice; runs that do
    not close are left out.  Every step uses up an element."""
    number = nodes.number(np.concatenate((e.start, e.end)))[0].tolist()
    count = len(e)
    leaving = {}
    for k in reversed(range(count)):
        leaving.setdefault(number[k], []).append(k)
    chains = []
    for first in number[:count]:
        chain, here = [], first
        while leaving.get(here):
            chain.append(leaving[here].pop())
            here = number[count + chain[-1]]
            begin = next((k for k, m in enumerate(chain) if number[m] == here), None)
            if begin is not None:
                chains.append(chain[begin:])
                del chain[begin:]
    return chains
