# SPDX-License-Identifier: GPL-2.0-or-later
"""The judge: how deep a tool at a given centre would cut into the WHOLE finish shape.

Called by kernel.py, slices.py and sharp.py.  This is what the patent lacks, which compares an
element only with itself, and LinuxCNC's compensation, which looks at the next moves.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base import elements, lines, search
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.base.intersect import meetings
from chipwise.geometry.base.tolerances import DEPTH_MM


@dataclass(frozen=True, eq=False)
class ClearanceCheck:
    """finish: all n elements of the finish shape; tree over their boxes; beside (n, 5) int:
    each element with its two neighbours on either side."""

    finish: Elements
    tree: search.BoxTree
    beside: np.ndarray


def make_clearance_check(contours):
    """ClearanceCheck over several contours."""
    finish = elements.join([c.elements for c in contours])
    beside, first = [], 0
    for contour in contours:
        n = len(contour.elements)
        index = np.arange(n)[:, None] + np.arange(-2, 3)
        beside.append(first + (index % n if contour.closed else np.clip(index, 0, n - 1)))
        first += n
    return ClearanceCheck(finish, search.build(*elements.boxes(finish)), np.concatenate(beside))


def gouge_depths(clearance_check, point, radius):
    """Depth (m,) mm by which a tool of `radius` at point (m, 2) overlaps the contour line;
    0 where it stays clear."""
    gap = search.near_gaps(clearance_check.tree, clearance_check.finish, point, np.full(len(point), radius))
    return np.maximum(radius - gap, 0.0)


def gouge_depths_beside(clearance_check, point, index, radius):
    """As depths, but only into finish element index (m,) and its near neighbours: cheap,
    and enough to throw out most slices."""
    near = clearance_check.beside[index]
    gap = elements.distances(clearance_check.finish, near.ravel(), np.repeat(point, near.shape[1], axis=0))
    return np.maximum(radius - gap.reshape(near.shape).min(axis=1), 0.0)


def clear_lines(clearance_check, start, end, radius):
    """Which straight moves (m,) bool from start to end (m, 2) mm a tool of `radius` can go.

    Exact: a line is nearest to an element at one of their four ends, at the foot of an
    arc's centre on the line, or where they cross.
    """
    middle, span = 0.5 * (start + end), 0.5 * np.hypot(*(end - start).T)
    which, leaf = search.near_points(clearance_check.tree, middle, span + radius)
    e, segments = clearance_check.finish, elements.make_lines(start, end)
    t = np.clip(lines.parameter(e.centre[leaf], start[which], end[which]), 0.0, 1.0)
    foot = start[which] + (end - start)[which] * t[:, None]
    gaps = [elements.distances(e, leaf, p) for p in (start[which], end[which], foot)] + [
        elements.distances(segments, which, p) for p in (e.start[leaf], e.end[leaf])
    ]
    clear = np.ones(len(start), bool)
    clear[which[np.min(gaps, axis=0) < radius - DEPTH_MM]] = False
    both = elements.join((e, segments))
    met = meetings(both, elements.lengths(both), leaf, len(e) + which)
    clear[np.maximum(met.a, met.b) - len(e)] = False
    return clear
