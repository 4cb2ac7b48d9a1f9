# SPDX-License-Identifier: GPL-2.0-or-later
"""The raw offset cut where it meets itself, and the slices that stay clear.

Called by kernel.py.  Between two cuts a slice lies either wholly outside the contour
line widened by the tool radius or wholly inside it, because the edge of the widened line
is made of raw offset elements.  So a few points of a slice decide, judged against the
whole contour.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base import elements, search
from chipwise.geometry.offset import nodes
from chipwise.geometry.base.intersect import meetings
from chipwise.geometry.base.clearance import gouge_depths, gouge_depths_beside
from chipwise.geometry.base.tolerances import DEPTH_MM, NODE_MM

# Parameters of a slice at which it is judged: the middle first, the rest if that is clear.
MIDDLE, OTHERS = 0.5, (0.07, 0.31, 0.93)


@dataclass(frozen=True, eq=False)
class Slices:
    """m slices of raw elements in the order of travel.

    raw (m,) int; t0, t1 (m,) parameters on it; node0, node1 (m,) int node numbers; point
    (k, 2) mm: the nodes.
    """

    raw: np.ndarray
    t0: np.ndarray
    t1: np.ndarray
    node0: np.ndarray
    node1: np.ndarray
    point: np.ndarray


def cut(raw):
    """All slices of a raw offset."""
    e, count = raw.elements, len(raw.elements)
    length = elements.lengths(e)
    met = meetings(e, length, *search.pairs(search.build(*elements.boxes(e)), NODE_MM))
    index = np.arange(count)
    where = np.concatenate((e.start, e.end, met.point))
    number, point = nodes.number(where)
    at_meeting = number[2 * count :]
    owner = np.concatenate((index, index, met.a, met.b))
    t = np.concatenate((np.zeros(count), np.ones(count), met.t_a, met.t_b))
    node = np.concatenate((number[: 2 * count], at_meeting, at_meeting))
    order = np.lexsort((t, owner))
    owner, t, node = owner[order], t[order], node[order]
    here = np.flatnonzero(owner[1:] == owner[:-1])
    long = (t[here + 1] - t[here]) * length[owner[here]]
    here = here[(long > 4.0 * NODE_MM) | (node[here] != node[here + 1]) & (long > 0.0)]
    return Slices(owner[here], t[here], t[here + 1], node[here], node[here + 1], point)


def take(slices, index):
    """The slices at index, nodes unchanged."""
    return Slices(
        slices.raw[index], slices.t0[index], slices.t1[index], slices.node0[index], slices.node1[index], slices.point
    )


def _at(raw, slices, share):
    """Points (m, 2) mm at a share of the way along each slice."""
    t = slices.t0 + share * (slices.t1 - slices.t0)
    return elements.point_at(raw.elements, slices.raw, t)


def middles(raw, slices):
    """The middle (m, 2) mm of each slice."""
    return _at(raw, slices, MIDDLE)


def keep_clear(clearance_check, chain, raw, slices, radius):
    """Slices that stay clear of the whole contour, and the depth (m,) mm of each."""
    source = chain.finish[raw.source[slices.raw]]
    middle = _at(raw, slices, MIDDLE)
    kept = np.flatnonzero(gouge_depths_beside(clearance_check, middle, source, radius) <= DEPTH_MM)
    depth = gouge_depths(clearance_check, middle[kept], radius)
    ok = depth <= DEPTH_MM
    kept, depth = kept[ok], depth[ok]
    slices = take(slices, kept)
    others = np.concatenate([_at(raw, slices, share) for share in OTHERS])
    deepest = gouge_depths(clearance_check, others, radius).reshape(len(OTHERS), -1).max(axis=0)
    depth = np.maximum(depth, deepest)
    ok = depth <= DEPTH_MM
    return take(slices, ok), depth[ok]
