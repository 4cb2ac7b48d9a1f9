"""The judge: how deep a tool at a given centre would cut into the WHOLE finish shape.

Called by offset.py, slices.py and sharp.py.  This is what the patent lacks, which compares an
element only with itself, and LinuxCNC's compensation, which looks at the next moves.
"""
from dataclasses import dataclass

import numpy as np

from . import elements, lines, search
from .elements import Elements
from .intersect import meetings
from .tolerances import DEPTH_MM


@dataclass(frozen=True, eq=False)
class Judge:
    """finish: all n elements of the finish shape; tree over their boxes; beside (n, 5) int:
    each element with its two neighbours on either side."""
    finish: Elements
    tree: search.BoxTree
    beside: np.ndarray


def make_judge(contours):
    """Judge over several contours."""
    finish = elements.join([c.elements for c in contours])
    beside, first = [], 0
    for contour in contours:
        n = len(contour.elements)
        index = np.arange(n)[:, None] + np.arange(-2, 3)
        beside.append(first + (index % n if contour.closed else np.clip(index, 0, n - 1)))
        first += n
    return Judge(finish, search.build(*elements.boxes(finish)), np.concatenate(beside))


def depths(judge, point, radius):
    """Depth (m,) mm by which a tool of `radius` at point (m, 2) overlaps the contour line;
    0 where it stays clear."""
    who, leaf = search.near_points(judge.tree, point, np.full(len(point), radius))
    result = np.zeros(len(point))
    if len(who):
        gap = elements.distances(judge.finish, leaf, point[who])
        first = np.flatnonzero(np.concatenate(([True], who[1:] != who[:-1])))
        nearest = np.minimum.reduceat(gap, first)
        result[who[first]] = np.maximum(radius - nearest, 0.0)
    return result


def depths_beside(judge, point, index, radius):
    """As depths, but only into finish element index (m,) and its near neighbours: cheap,
    and enough to throw out most slices."""
    near = judge.beside[index]
    gap = elements.distances(judge.finish, near.ravel(), np.repeat(point, near.shape[1], axis=0))
    return np.maximum(radius - gap.reshape(near.shape).min(axis=1), 0.0)


def clear_lines(judge, start, end, radius):
    """Which straight ways (m,) bool from start to end (m, 2) mm a tool of `radius` can go.

    Exact: a line is nearest to an element at one of their four ends, at the foot of an
    arc's centre on the line, or where they cross.
    """
    middle, span = 0.5 * (start + end), 0.5 * np.hypot(*(end - start).T)
    way, leaf = search.near_points(judge.tree, middle, span + radius)
    e, ways = judge.finish, elements.make_lines(start, end)
    t = np.clip(lines.parameter(e.centre[leaf], start[way], end[way]), 0.0, 1.0)
    foot = start[way] + (end - start)[way] * t[:, None]
    gaps = [elements.distances(e, leaf, p) for p in (start[way], end[way], foot)] \
        + [elements.distances(ways, way, p) for p in (e.start[leaf], e.end[leaf])]
    clear = np.ones(len(start), bool)
    clear[way[np.min(gaps, axis=0) < radius - DEPTH_MM]] = False
    both = elements.join((e, ways))
    met = meetings(both, elements.lengths(both), leaf, len(e) + way)
    clear[np.maximum(met.a, met.b) - len(e)] = False
    return clear
