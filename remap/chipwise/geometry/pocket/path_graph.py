# SPDX-License-Identifier: GPL-2.0-or-later
"""The shortest run along a path that the tool has been along, from one place of it to another.

Called by links.py, for links where nothing shorter is found.  Lengths mm.

Every end of an element is a node of a graph, and lies on all elements that it touches.  An element joins the nodes on
it, one after the other, and is run either way.  So two Tracks hang together where an end of one lies on the other.
"""

import numpy as np

from chipwise.geometry.base import chains, elements, search
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.pocket.shortest import shortest

# The end of an element this near to the start of the next is the same node. mm
SAME_MM = 1e-6

# A longer path is not searched. elements
MOST = 20_000


def along(path: Elements, here, to, near_mm):
    """Elements from here to a place, both on the path (within near_mm), along the path; None where it does not hang
    together."""
    if len(path) > MOST:
        return None
    ends = np.append(np.hypot(*(path.end[:-1] - path.start[1:]).T) > SAME_MM, True)
    node = np.concatenate((path.start, path.end[ends], [here], [to]))
    joints = _joints(path, node, near_mm)
    found = shortest(len(node) - 2, len(node) - 1, lambda at: joints.get(at, ()), lambda _at: 0.0)
    return None if found is None else _chain(path, found[1])


def _joints(path, node, near_mm):
    """{node: [(length, node, (element, t here, t there))]}: along which elements nodes lead to one another."""
    which, element = search.near_points(
        search.build(*elements.boxes(path)), node, np.full(len(node), near_mm + chains.SNAP_MM)
    )
    touching = elements.distances(path, element, node[which]) <= near_mm
    which, element = which[touching], element[touching]
    at_start, at_end = (np.hypot(*(node[which] - ends[element]).T) <= near_mm for ends in (path.start, path.end))
    between = ~at_start & ~at_end
    t = np.concatenate(
        (
            np.zeros(at_start.sum()),
            np.ones(at_end.sum()),
            elements.parameters(path, element[between], node[which[between]]),
        )
    )
    which = np.concatenate([which[part] for part in (at_start, at_end, between)])
    element = np.concatenate([element[part] for part in (at_start, at_end, between)])
    order = np.lexsort((which, t, element))
    which, element = which[order], element[order]
    t = t[order]
    size = elements.lengths(path)[element[1:]] * np.diff(t)
    found: dict[int, list] = {}
    for k in np.flatnonzero(element[1:] == element[:-1]).tolist():
        a, b = int(which[k]), int(which[k + 1])
        e, length = int(element[k]), float(size[k])
        found.setdefault(a, []).append((length, b, (e, float(t[k]), float(t[k + 1]))))
        found.setdefault(b, []).append((length, a, (e, float(t[k + 1]), float(t[k]))))
    return found


def _chain(path, route):
    """Elements of the pieces of a route; pieces of one element that follow one another are one."""
    merged: list[tuple] = []
    for e, low, high in route:
        if low != high and merged and merged[-1][0] == e and merged[-1][2] == low:
            merged[-1] = (e, merged[-1][1], high)
        elif low != high:
            merged.append((e, low, high))
    parts = [elements.take(path, np.arange(0))]
    for e, low, high in merged:
        part = chains.segment(path, e, min(low, high), max(low, high))
        parts.append(part if low < high else elements.reverse(part))
    return elements.join(parts)
