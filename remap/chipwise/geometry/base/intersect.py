# SPDX-License-Identifier: GPL-2.0-or-later
"""Where elements meet: crossings, touches, and ends that lie on another element.

Called by contour.py (does the finish shape cross itself) and slices.py (where to cut the
raw offset).  Elements that lie on one another are reported by their ends, so no case of
its own is needed for overlaps.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base import arcs, lines
from chipwise.geometry.base.elements import Elements, point_at
from chipwise.geometry.base.tolerances import NODE_MM


@dataclass(frozen=True, eq=False)
class Meetings:
    """k common points: a, b (k,) int elements; t_a, t_b (k,) parameters; point (k, 2) mm."""

    a: np.ndarray
    b: np.ndarray
    t_a: np.ndarray
    t_b: np.ndarray
    point: np.ndarray


def parameters(e: Elements, index, point):
    """Parameter (m,) of point (m, 2) on element index (m,), unclipped."""
    t = lines.parameter(point, e.start[index], e.end[index])
    arc = np.flatnonzero(e.is_arc[index])
    if len(arc):
        which = index[arc]
        t[arc] = arcs.angle_parameter(point[arc], e.centre[which], e.start_angle[which], e.sweep[which])
    return t


def _on_element(e, length, index, t):
    """Whether parameter t (m,) lies on element index (m,), NODE_MM beyond its ends."""
    slack = NODE_MM / length[index]
    return (t >= -slack) & (t <= 1.0 + slack)


def _crossings(e, length, a, b):
    """Meetings of the carriers of pairs a, b (m,), kept where they lie on both elements."""
    arc_a, arc_b = e.is_arc[a], e.is_arc[b]
    found_a, found_b, found_t, found_u, found_p = [], [], [], [], []

    def keep(i, j, t, u, point):
        ok = _on_element(e, length, i, t) & _on_element(e, length, j, u)
        for store, value in zip((found_a, found_b, found_t, found_u, found_p), (i, j, t, u, point)):
            store.append(value[ok])

    both = np.flatnonzero(~arc_a & ~arc_b)
    i, j = a[both], b[both]
    t, u = lines.intersect_lines(e.start[i], e.end[i], e.start[j], e.end[j])
    keep(i, j, t, u, e.start[i] + (e.end[i] - e.start[i]) * t[:, None])

    one = np.flatnonzero(arc_a != arc_b)
    i, j = a[one], b[one]
    line, arc = np.where(e.is_arc[i], j, i), np.where(e.is_arc[i], i, j)
    for point in arcs.intersect_line_circle(e.start[line], e.end[line], e.centre[arc], e.radius[arc]):
        keep(line, arc, parameters(e, line, point), parameters(e, arc, point), point)

    two = np.flatnonzero(arc_a & arc_b)
    i, j = a[two], b[two]
    for point in arcs.intersect_circles(e.centre[i], e.radius[i], e.centre[j], e.radius[j]):
        keep(i, j, parameters(e, i, point), parameters(e, j, point), point)
    return [np.concatenate(part) for part in (found_a, found_b, found_t, found_u, found_p)]


def _ends_on(e, a, b):
    """Meetings where an end of a (m,) lies on b (m,), within NODE_MM."""
    found = []
    for point, t_a in ((e.start, 0.0), (e.end, 1.0)):
        p = point[a]
        near = np.flatnonzero(_box_near(e, b, p))
        i, j, p = a[near], b[near], p[near]
        t = np.clip(parameters(e, j, p), 0.0, 1.0)
        off = p - point_at(e, j, t)
        close = lines.dot(off, off) <= NODE_MM**2
        found.append((i[close], j[close], np.full(np.count_nonzero(close), t_a), t[close], p[close]))
    return [np.concatenate(part) for part in zip(*found)]


def _box_near(e, index, point):
    """Cheap test before the exact one: near the carrier line's or circle's band."""
    v = point - e.centre[index]
    ring = np.abs(np.hypot(v[:, 0], v[:, 1]) - e.radius[index]) <= 2.0 * NODE_MM
    along, off = e.end[index] - e.start[index], point - e.start[index]
    band = lines.cross(along, off) ** 2 <= 4.0 * NODE_MM**2 * lines.dot(along, along) + NODE_MM**4
    return np.where(e.is_arc[index], ring, band)


def meetings(e: Elements, length, a, b):
    """All common points of element pairs a, b (m,); length (n,) mm of the elements."""
    parts = (_crossings(e, length, a, b), _ends_on(e, np.concatenate((a, b)), np.concatenate((b, a))))
    i, j, t, u, point = (np.concatenate(part) for part in zip(*parts))
    return Meetings(i, j, np.clip(t, 0.0, 1.0), np.clip(u, 0.0, 1.0), point)
