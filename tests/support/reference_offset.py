# SPDX-License-Identifier: GPL-2.0-or-later
"""The patent's own procedure: offset, delete reversed elements, offset back.

Called by tests and by readers: it is the plain form of what offset.py does for shapes
whose errors stay between neighbours.  Source: JP H07-47256, Figs. 2 to 6; the step
numbers of its flow charts are in the code.

It knows only neighbours, as the patent does.  Where those do not meet it returns
NoMeeting instead of a path; a path that gouges some other element is not noticed here.
offset.py has neither limit.

Departures: "left" is an offset to the right by minus the radius; an arc counts as reversed
also where its ends changed places, which the patent checks for lines only.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base import arcs, lines
from chipwise.geometry.offset.canonical import Canonical, canonical, offset_right
from chipwise.geometry.base.contour import Contour
from chipwise.geometry.base.elements import Elements, join, make_arcs, make_lines
from chipwise.geometry.base.intersect import parameters
from chipwise.geometry.base.tolerances import NODE_MM


@dataclass(frozen=True, eq=False)
class PatentOffset:
    """path: tool centre path; rough: rough shape; kept, deleted: finish element indices."""

    path: Elements
    rough: Elements
    kept: tuple
    deleted: tuple


@dataclass(frozen=True)
class NoMeeting:
    """Elements a and b (finish indices) became neighbours and have no common point."""

    a: int
    b: int


def patent_offset(contour: Contour, side, radius):
    """PatentOffset of a contour with the tool right (side +1) or left (-1), or NoMeeting."""
    form = canonical(contour.elements)
    moved = offset_right(form, side * radius)  # 12, 101..105
    every = list(range(len(contour.elements)))
    bare = _ends_moved(contour.elements, form, moved)
    first = _joints(moved, every, contour.closed, bare)  # 106, 107
    deleted = [k for k in every if _vanished(moved, k)]  # 22, 23
    if not isinstance(first, NoMeeting):
        deleted = [k for k in every if k in deleted or _reversed(contour, k, *first[k])]  # 24
    kept = [k for k in every if k not in deleted]
    joints = _joints(moved, kept, contour.closed, bare)  # 25, 26
    if isinstance(joints, NoMeeting):
        return joints
    back = offset_right(moved, -side * radius)  # 14
    ends = {k: (_foot(moved, k, a, side * radius), _foot(moved, k, b, side * radius)) for k, (a, b) in joints.items()}
    rough = _joints(back, kept, contour.closed, ends)  # 15
    if isinstance(rough, NoMeeting):
        return rough
    return PatentOffset(_run(moved, kept, joints), _run(back, kept, rough), tuple(kept), tuple(deleted))


def _ends_moved(e, form, moved):
    """Start and end of every element moved along its own normals."""
    shift = moved.distance - form.distance
    ends = {}
    for k in range(len(e)):
        if form.turn[k] == 0.0:
            step = form.normal[k] * shift[k]
            ends[k] = (e.start[k] + step, e.end[k] + step)
        else:
            scale = moved.radius[k] / form.radius[k]
            ends[k] = tuple(e.centre[k] + scale * (p - e.centre[k]) for p in (e.start[k], e.end[k]))
    return ends


def _foot(form, k, point, distance):
    """The point at `distance` to the left of a point on form k."""
    if form.turn[k] == 0.0:
        return point - form.normal[k] * distance
    outward = (point - form.centre[k]) / form.radius[k]
    return form.centre[k] + outward * (form.radius[k] - form.turn[k] * distance)


def _joints(form, kept, closed, ends):
    """{k: (start, end)} of kept forms, from the intersections of neighbours."""
    joints = {k: list(ends[k]) for k in kept}
    pairs = list(zip(kept, kept[1:] + kept[:1]))
    for a, b in pairs if closed else pairs[:-1]:
        point = _meeting(form, a, b, ends[a][1], ends[b][0])
        if point is None:
            return NoMeeting(a, b)
        joints[a][1] = joints[b][0] = point
    return {k: tuple(joint) for k, joint in joints.items()}


def _meeting(form: Canonical, a, b, end_a, start_b):
    """The common point of forms a and b nearest to where both would end, or None."""
    if np.hypot(*(end_a - start_b)) <= NODE_MM:
        return 0.5 * (end_a + start_b)
    found = [p for p in _common(form, a, b) if np.all(np.isfinite(p))]
    middle = 0.5 * (end_a + start_b)
    return min(found, key=lambda p: np.hypot(*(p - middle)), default=None)


def _common(form, a, b):
    """Common points, (2,) each, nan where none, of the carriers of forms a and b."""
    if form.turn[a] == 0.0 and form.turn[b] == 0.0:
        (start, end), (start_b, end_b) = _two_points(form, a), _two_points(form, b)
        t, _ = lines.intersect_lines(start, end, start_b, end_b)
        return start + t[:, None] * (end - start)
    if form.turn[a] != 0.0 and form.turn[b] != 0.0:
        return arcs.intersect_circles(form.centre[[a]], form.radius[[a]], form.centre[[b]], form.radius[[b]])[:, 0]
    line, arc = (b, a) if form.turn[a] != 0.0 else (a, b)
    return arcs.intersect_line_circle(*_two_points(form, line), form.centre[[arc]], form.radius[[arc]])[:, 0]


def _two_points(form, k):
    """Two points (1, 2) a millimetre apart on the line of form k, in travel order."""
    normal = form.normal[[k]]
    start = normal * form.distance[k]
    return start, start + np.stack((-normal[:, 1], normal[:, 0]), axis=1)


def _vanished(form, k):
    return form.turn[k] != 0.0 and form.radius[k] <= 0.0


def _reversed(contour, k, start, end):
    """Whether the moved element runs from start to end against the finish element."""
    e = contour.elements
    if not e.is_arc[k]:
        return float(np.dot(end - start, e.end[k] - e.start[k])) <= 0.0
    t = parameters(e, np.array([k, k]), np.array([start, end]))
    return abs(e.sweep[k]) < 2.0 * np.pi and t[1] <= t[0]


def _run(form, kept, joints):
    """Elements between the joints."""
    made = []
    for k in kept:
        start, end = (np.array(p)[None] for p in joints[k])
        if form.turn[k] == 0.0:
            made.append(make_lines(start, end))
            continue
        centre, ccw = form.centre[[k]], np.array([form.turn[k] > 0.0])
        full = np.hypot(*(end - start).T) <= NODE_MM
        sweep = arcs.sweep_from_ends(start, end, centre, ccw, full)
        made.append(make_arcs(start, end, centre, form.radius[[k]], sweep))
    return join(made)
