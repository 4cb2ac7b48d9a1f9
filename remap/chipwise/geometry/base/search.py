# SPDX-License-Identifier: GPL-2.0-or-later
"""Box tree over the elements of a contour: which are near which.

Called by contour.py, clearance.py, slices.py, sharp.py and rings.py.  Elements that follow one another lie near
one another, so the tree is built bottom-up over runs of FAN consecutive boxes; there is
no cell size to choose, and one huge element among thousands of tiny ones costs nothing.
Every query descends level by level with whole arrays.
"""
from dataclasses import dataclass

import numpy as np

FAN = 4

# Points asked at once: bounds the memory, a matter of speed only.
CHUNK = 8192

# The square of a distance may be this much larger than by the boxes: rounding. As a share, and mm2
SLACK, SLACK_MM2 = 1e-6, 1e-8


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


def near_gaps(tree, measure, point, reach):
    """Distance (m,) mm from each of points (m, 2) to the nearest leaf, inf where none lies within reach (m,) mm.

    measure(leaf, point) gives distances (k,) mm of leaves (k,) to points (k, 2).  Exact: a box is left out only if
    another one lies nearer with all it holds, so the number of leaves measured hardly grows with their number.
    """
    gap = np.full(len(point), np.inf)
    for first in range(0, len(point), CHUNK):
        part = slice(first, first + CHUNK)
        who, leaf = _nearest_leaves(tree, point[part], reach[part])
        if len(who):
            begins = _begins(who)
            gap[first + who[begins]] = np.minimum.reduceat(measure(leaf, point[part][who]), begins)
    return gap


def _begins(who):
    """Where each run of equal numbers begins."""
    return np.flatnonzero(np.concatenate(([True], who[1:] != who[:-1])))


def _nearest_leaves(tree, point, reach):
    """Of the pairs of near_points() those that can be the nearest of their point."""
    count = len(tree.levels[-1][0])
    who, node = np.repeat(np.arange(len(point)), count), np.tile(np.arange(count), len(point))
    most, (x, y) = reach * reach, np.ascontiguousarray(point.T)
    for depth in range(len(tree.levels) - 1, -1, -1):
        (low_x, low_y), (high_x, high_y) = (np.ascontiguousarray(side.T) for side in tree.levels[depth])
        left, right, down, up = low_x[node] - x[who], x[who] - high_x[node], low_y[node] - y[who], y[who] - high_y[node]
        if len(who):
            begins = _begins(who)
            far = np.minimum(left, right) ** 2 + np.minimum(down, up) ** 2
            far = np.minimum.reduceat(far, begins) * (1.0 + SLACK) + SLACK_MM2
            most[who[begins]] = np.minimum(most[who[begins]], far)
        off_x, off_y = np.maximum(np.maximum(left, right), 0.0), np.maximum(np.maximum(down, up), 0.0)
        hit = np.flatnonzero(off_x * off_x + off_y * off_y < most[who])
        who, node = who[hit], node[hit]
        if depth:
            child, exists = _children(node, len(tree.levels[depth - 1][0]))
            who, node = np.repeat(who, FAN)[exists.ravel()], child[exists]
    return who, node


def pairs(tree, margin):
    """Pairs (a, b), a < b, of leaves whose boxes lie within margin (mm) of each other."""
    count = len(tree.levels[-1][0])
    a, b = np.triu_indices(count)
    for depth in range(len(tree.levels) - 1, -1, -1):
        low, high = tree.levels[depth]
        low, high = np.ascontiguousarray(low.T) - margin, np.ascontiguousarray(high.T)
        hit = np.flatnonzero((low[0][a] <= high[0][b]) & (low[0][b] <= high[0][a])
                             & (low[1][a] <= high[1][b]) & (low[1][b] <= high[1][a]))
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
