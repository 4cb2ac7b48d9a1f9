# SPDX-License-Identifier: GPL-2.0-or-later
"""The raw offset: every element moved by the tool radius, and the joins between them.

Called by kernel.py.  Source: JP H07-47256, Fig. 3 (offset of canonical forms).  Arcs that
vanish (radius <= 0) are deleted at once, as in Fig. 4, step 23.

Departures: the patent joins every pair of neighbours at their intersection; here a convex
corner gets the arc the tool rolls about it, and a concave one nothing, because slices.py
finds that intersection together with all others.  Only where a concave corner is so slight
that its gap lies within the depth tolerance, a short link closes it.

An open contour is offset as the closed, flat loop there and back again: forward on the
wanted side, half a circle about the end, backward on the other side, half a circle about
the start.  The parts that belong to the wanted side are marked `forward`.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.offset.canonical import canonical, offset_right
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.base.lines import cross, dot
from chipwise.geometry.base.tolerances import CUSP_RAD, NODE_MM, slight_corner_gap

# Kinds of raw elements; from LINK on they only close gaps.
ELEMENT, CORNER, LINK, SHRUNK = 0, 1, 2, 3


@dataclass(frozen=True, eq=False)
class Chain:
    """Finish elements as closed loops, ready to be offset.

    elements: n of them (open contours twice); following (n,) int: index of the next;
    finish (n,) int: index of the finish element each is or goes back over; forward (n,)
    bool; cap (n,) bool: the joint after this element is an end of an open contour.
    """

    elements: Elements
    following: np.ndarray
    finish: np.ndarray
    forward: np.ndarray
    cap: np.ndarray


@dataclass(frozen=True, eq=False)
class Raw:
    """k elements of the raw offset.

    elements; kind (k,) ELEMENT, CORNER (rolls about the end of `source`), LINK (closes the
    gap at the end of `source`) or SHRUNK (represents the whole of a vanished arc);
    source (k,) int: index into the chain; points (m, 2) mm: centres of arcs whose radius
    is the tool radius exactly.
    """

    elements: Elements
    kind: np.ndarray
    source: np.ndarray
    point_contacts: np.ndarray


def make_chain(contours):
    """Chain of several contours, their elements counted through."""
    parts, following, finish, forward, cap = [], [], [], [], []
    first = first_finish = 0
    for contour in contours:
        n = len(contour.elements)
        index = np.arange(n)
        loop = [contour.elements]
        back = [index]
        if not contour.closed:
            loop.append(elements.reverse(contour.elements))
            back.append(index[::-1])
        m = n * len(loop)
        parts += loop
        following.append(first + (np.arange(m) + 1) % m)
        finish.append(first_finish + np.concatenate(back))
        forward.append(np.arange(m) < n)
        ends = np.zeros(m, bool)
        if not contour.closed:
            ends[[n - 1, m - 1]] = True
        cap.append(ends)
        first, first_finish = first + m, first_finish + n
    return Chain(elements.join(parts), *(np.concatenate(p) for p in (following, finish, forward, cap)))


def raw_offset(chain, side, radius):
    """Raw offset of a chain by radius (mm) to the right (side +1) or left (side -1)."""
    e = chain.elements
    moved, gone = _moved(e, side * radius)
    joints = _joints(chain, moved, side, radius)
    shrunk = _links(moved.start, moved.end, np.flatnonzero(gone), radius, SHRUNK)
    whole = np.flatnonzero(~gone)
    parts = [(elements.take(moved, whole), ELEMENT, whole), shrunk, *joints]
    source = np.concatenate([part[2] for part in parts])
    kind = np.concatenate([np.full(len(part[2]), part[1]) for part in parts])
    order = np.lexsort((kind != ELEMENT, source))
    point = np.abs(e.radius + np.sign(e.sweep) * side * radius) <= NODE_MM
    return Raw(
        elements.take(elements.join([part[0] for part in parts]), order),
        kind[order],
        source[order],
        e.centre[e.is_arc & point],
    )


def _moved(e, distance):
    """Elements moved to the right by distance, and which of them have vanished."""
    form = offset_right(canonical(e), distance)
    shift = form.normal * distance
    angle = np.stack((e.start_angle, e.start_angle + e.sweep), axis=1)
    spoke = np.stack((np.cos(angle), np.sin(angle)), axis=2) * form.radius[:, None, None]
    arc = e.is_arc[:, None]
    start = np.where(arc, e.centre + spoke[:, 0], e.start + shift)
    end = np.where(arc, e.centre + spoke[:, 1], e.end + shift)
    gone = e.is_arc & (form.radius <= NODE_MM)
    return Elements(start, end, e.centre, form.radius, e.start_angle, e.sweep), gone


def _joints(chain, moved, side, radius):
    """Rolling arcs at convex corners and links at the slightest concave corners."""
    e, after = chain.elements, chain.following
    here = np.arange(len(e))
    turn = _turns(chain, side)
    gap = moved.start[after] - moved.end
    wide = np.hypot(gap[:, 0], gap[:, 1]) > 0.5 * NODE_MM
    roll = np.flatnonzero((side * turn > 0.0) & (wide | chain.cap))
    vertex = e.end[roll]
    corners = elements.make_arcs(
        moved.end[roll], moved.start[after[roll]], vertex, np.full(len(roll), radius), turn[roll]
    )
    slight = here[(side * turn <= 0.0) & wide]
    return (corners, CORNER, roll), _links(moved.end, moved.start[after], slight, radius)


def _links(start, end, index, radius, kind=LINK):
    """Straight links from start to end at `index`, if the gap is slight."""
    gap = np.hypot(*(end[index] - start[index]).T)
    index = index[(gap > 0.5 * NODE_MM) & (gap <= slight_corner_gap(radius))]
    return elements.make_lines(start[index], end[index]), kind, index


def _turns(chain, side):
    """Turn (n,) rad in (-pi, pi] from each element into the next, positive to the left."""
    e, after = chain.elements, chain.following
    here = np.arange(len(e))
    out = elements.tangent_at(e, here, np.ones(len(e)))
    into = elements.tangent_at(e, after, np.zeros(len(e)))
    turn = np.arctan2(cross(out, into), dot(out, into))
    back = np.flatnonzero((np.abs(turn) > np.pi - CUSP_RAD) & ~chain.cap)
    turn[back] = np.copysign(turn[back], _cusp_sides(e, back, after[back]))
    return np.where(chain.cap, side * np.pi, turn)


def _cusp_sides(e, index, after):
    """Side to which the contour turns at a cusp, where the tangents only say "back": the
    side on which the next element leaves, +1 left."""
    length = elements.lengths(e)
    step = 0.5 * np.minimum(length[index], length[after])
    before = elements.point_at(e, index, 1.0 - step / length[index])
    beyond = elements.point_at(e, after, step / length[after])
    vertex = e.end[index]
    return np.where(cross(vertex - before, beyond - vertex) >= 0.0, 1.0, -1.0)
