# SPDX-License-Identifier: GPL-2.0-or-later
"""Box tree over the elements of a contour: which are near which.

Called by contour.py, clearance.py, slices.py, sharp.py and rings.py.  Elements that follow one another lie near
one another, so the tree is built bottom-up over runs of FAN consecutive boxes; there is
no cell size to choose, and one huge element among thousands of tiny ones costs nothing.
Queries of pairs descend level by level with whole arrays; the nearest
element is found by components/offline/nearest_element.c.
"""

import ctypes as C
from dataclasses import dataclass

import numpy as np

from chipwise.clib import layout
from chipwise.clib.library import library

FAN = layout.TREE_FAN


@dataclass(frozen=True, eq=False)
class BoxTree:
    """levels: from the leaves up, each a pair of (m, 2) arrays low, high in mm."""

    levels: tuple


def build(low, high):
    """Tree over boxes low, high (n, 2) mm."""
    levels = [(low, high)]
    while len(levels[-1][0]) > FAN:
        low, high = levels[-1]
        first = np.arange(0, len(low), FAN)
        levels.append((np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)))
    return BoxTree(tuple(levels))


def _children(node, count):
    """Children (m, FAN) of nodes (m,) on a level of `count`, and which of them exist."""
    child = node[:, None] * FAN + np.arange(FAN)
    return child, child < count


def near_points(tree, point, reach):
    """Pairs (point index, leaf index), sorted by point, of boxes nearer than reach (m,) to
    point (m, 2)."""
    who = np.repeat(np.arange(len(point)), len(tree.levels[-1][0]))
    node = np.tile(np.arange(len(tree.levels[-1][0])), len(point))
    reach2 = reach * reach
    for depth in range(len(tree.levels) - 1, -1, -1):
        low, high = tree.levels[depth]
        p = point[who]
        off = np.maximum(low[node] - p, p - high[node])
        np.maximum(off, 0.0, out=off)
        hit = np.flatnonzero(off[:, 0] ** 2 + off[:, 1] ** 2 < reach2[who])
        who, node = who[hit], node[hit]
        if depth:
            child, exists = _children(node, len(tree.levels[depth - 1][0]))
            who, node = np.repeat(who, FAN)[exists.ravel()], child[exists]
    return who, node


def near_gaps(tree, e, point, reach):
    """Distance (m,) mm from each of points (m, 2) to the nearest of Elements e, whose boxes are the leaves of the tree:
    exact if it is below reach (m,) mm, else not below it, or inf."""
    first = np.cumsum([0] + [len(low) for low, _ in tree.levels])
    kept = [
        np.ascontiguousarray(a, float)
        for a in (
            np.concatenate([low for low, _ in tree.levels]),
            np.concatenate([high for _, high in tree.levels]),
            e.start,
            e.end,
            e.centre,
            e.radius,
            e.middle,
            e.cos_half,
        )
    ]
    kept.append(np.ascontiguousarray(e.is_arc, np.uint8))
    c_tree = layout.ElementTree(len(e), len(tree.levels), first.ctypes.data, *(a.ctypes.data for a in kept))
    point, reach, gap = np.ascontiguousarray(point, float), np.ascontiguousarray(reach, float), np.empty(len(point))
    library().chip_nearest_gaps(C.byref(c_tree), len(point), point.ctypes.data, reach.ctypes.data, gap.ctypes.data)
    return gap


def pairs(tree, margin):
    """Pairs (a, b), a < b, of leaves whose boxes lie within margin (mm) of each other."""
    count = len(tree.levels[-1][0])
    a, b = np.triu_indices(count)
    for depth in range(len(tree.levels) - 1, -1, -1):
        low, high = tree.levels[depth]
        low, high = np.ascontiguousarray(low.T) - margin, np.ascontiguousarray(high.T)
        hit = np.flatnonzero(
            (low[0][a] <= high[0][b])
            & (low[0][b] <= high[0][a])
            & (low[1][a] <= high[1][b])
            & (low[1][b] <= high[1][a])
        )
        a, b = a[hit], b[hit]
        if depth:
            a, b = _child_pairs(a, b, len(tree.levels[depth - 1][0]))
    apart = a != b
    return a[apart], b[apart]


def _child_pairs(a, b, count):
    """All pairs of children of node pairs, each unordered pair once."""
    step_a, step_b = (s.ravel() for s in np.mgrid[0:FAN, 0:FAN])
    child_a = a[:, None] * FAN + step_a
    child_b = b[:, None] * FAN + step_b
    wanted = (child_a <= child_b) & (child_b < count)
    return child_a[wanted], child_b[wanted]
