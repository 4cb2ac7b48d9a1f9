# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the tool touches the finish shape along its centre paths.

Called by rough.py and inaccessible.py.  A segment is a piece of the finish shape that the
tool touches without a break; between two segments the tool stands at an inner corner of
its path, and its own edge, an arc of the tool radius, spans from one to the other.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.base.lines import cross, dot
from chipwise.geometry.base.tolerances import BACK_MM, CUSP_RAD, SAME_FOOT_MM


@dataclass(frozen=True, eq=False)
class Finish:
    """All finish elements of a call: elements; first, count (c,) int per contour; owner (n,)
    int contour of each; upto (n,) mm length of contour before each; length (n,) mm; total
    (c,) mm; closed (c,) bool; line (n,) int."""

    elements: Elements
    first: np.ndarray
    count: np.ndarray
    owner: np.ndarray
    upto: np.ndarray
    length: np.ndarray
    total: np.ndarray
    closed: np.ndarray
    line: np.ndarray


@dataclass(frozen=True, eq=False)
class Touch:
    """m path elements in order, and the corners after them.

    path (m,) int; finish, t0, t1 (m,) feet; following (m,) int, -1 at an open end;
    corner (m,) bool: the path has an inner corner after this element; step (m,) mm along
    the contour from its last foot to the next one's first, unless there is a corner;
    point (m, 2) mm end of the element, the tool centre at that corner.
    """

    path: np.ndarray
    finish: np.ndarray
    t0: np.ndarray
    t1: np.ndarray
    following: np.ndarray
    corner: np.ndarray
    step: np.ndarray
    point: np.ndarray


def make_finish(contours):
    """Finish of several contours, elements counted through as in raw.make_chain."""
    count = np.array([len(c.elements) for c in contours])
    length = np.concatenate([c.length for c in contours])
    upto = np.concatenate([np.cumsum(c.length) - c.length for c in contours])
    return Finish(
        elements.join([c.elements for c in contours]),
        np.cumsum(count) - count,
        count,
        np.repeat(np.arange(len(contours)), count),
        upto,
        length,
        np.array([c.length.sum() for c in contours]),
        np.array([c.closed for c in contours]),
        np.concatenate([c.line for c in contours]),
    )


def make_touch(finish, paths):
    """Touch of all paths."""
    if not len(paths):
        none = np.zeros(0, int)
        return Touch(none, none, none * 1.0, none * 1.0, none, none > 0, none * 1.0, np.zeros((0, 2)))
    size = [len(p.elements) for p in paths]
    path = np.repeat(np.arange(len(paths)), size)
    following = np.arange(1, len(path) + 1)
    last = np.cumsum(size) - 1
    for k, (end, n) in enumerate(zip(last, size)):
        following[end] = end + 1 - n if paths[k].closed else -1
    foot, t0, t1 = (np.concatenate([getattr(p.feet, name) for p in paths]) for name in ("finish", "t0", "t1"))
    at0 = finish.upto[foot] + t0 * finish.length[foot]
    at1 = finish.upto[foot] + t1 * finish.length[foot]
    step = at0[following] - at1
    ring = finish.owner[foot]
    total = np.where(finish.closed[ring], finish.total[ring], np.inf)
    with np.errstate(invalid="ignore"):
        step = np.where(np.isfinite(total), step - total * np.round(step / total), step)
    same = (ring[following] == ring) & (step <= SAME_FOOT_MM) & (step >= -BACK_MM)
    return Touch(
        path, foot, t0, t1, following, ~same & (following >= 0), step, np.concatenate([p.elements.end for p in paths])
    )


def foot_points(finish, index, t):
    """Points (m, 2) mm of the finish shape at parameters t of elements index."""
    e = finish.elements
    point = elements.point_at(e, index, t)
    return np.where((t == 0.0)[:, None], e.start[index], np.where((t == 1.0)[:, None], e.end[index], point))


def segments(finish, index, t0, t1):
    """Elements of the finish shape from t0 to t1, backwards where t1 < t0."""
    e = finish.elements
    return Elements(
        foot_points(finish, index, t0),
        foot_points(finish, index, t1),
        e.centre[index],
        e.radius[index],
        e.start_angle[index] + t0 * e.sweep[index],
        e.sweep[index] * (t1 - t0),
    )


def corner_arcs(finish, touch, corner, side, radius):
    """The tool's edge at corners (k,) int: arcs from the foot before to the foot after."""
    after = touch.following[corner]
    start = foot_points(finish, touch.finish[corner], touch.t1[corner])
    end = foot_points(finish, touch.finish[after], touch.t0[after])
    centre = touch.point[corner]
    a, b = start - centre, end - centre
    turn = np.arctan2(cross(a, b), dot(a, b)) * -side
    turn = np.where(turn < -CUSP_RAD, turn + 2.0 * np.pi, turn) * -side
    return elements.make_arcs(start, end, centre, np.full(len(corner), radius), turn)
