# SPDX-License-Identifier: GPL-2.0-or-later
"""Chains as people and CAD programs draw them: taken apart into closed loops, without spikes.

Called by contour_sub/read.py and geometry/pocket/nesting.py.  Works on the parts of
a chain, LineElement and ArcElement, each of which starts where the one before ends.

A chain is walked once.  Whenever it comes back to a place where it has been, what lies between is a loop and is taken
out.  So loops that share their first point, loops joined by G1 and a boundary with a bridge to its island fall apart
into what was drawn.  What is left must be links from loop to loop, one part each.
"""

import math

from chipwise.geometry.base.contour import ContourError
from chipwise.geometry.base.spikes import there_and_back
from chipwise.geometry.base.tolerances import FULL_CIRCLE_MM, NODE_MM

# A chain that comes back after less than this many gaps that may be closed has drawn a fine curve, not a loop.
LEAST_GAPS = 10.0


def split(parts, close_mm):
    """(loops, links): the closed loops of a chain, tuples of parts, and the parts that only lead from one loop to
    another.

    A chain that is one loop, or closes none, is its only loop.  Raises ContourError for parts that hang on a loop.
    """
    close_mm = max(close_mm, 10.0 * NODE_MM)
    walk = _Walk(close_mm)
    for part in parts:
        walk.add(part)
    loops = tuple(loop for loop in walk.loops if not walk.is_bridge(loop))
    links = (
        *(part for loop in walk.loops if walk.is_bridge(loop) for part in loop),
        *(part for _, part in walk.left()),
    )
    if len(loops) < 2 and not links or not loops:
        return (tuple(parts),), ()
    if walk.left():
        _refuse_loose(walk, loops, close_mm)
    return loops, links


def _refuse_loose(walk, loops, close_mm):
    """Raise ContourError for what is left of a chain, but single parts from loop to loop."""
    left, ends = walk.left(), [end for loop in loops for part in loop for end in (part.start, part.end)]
    loose = [
        part
        for part, end in ((left[0][1], left[0][1].start), (left[-1][1], left[-1][1].end))
        if min(math.dist(end, other) for other in ends) > close_mm
    ]
    loose += [
        part for (before, _), (k, part) in zip(left, left[1:]) if not any(before < joint <= k for joint in walk.joints)
    ]
    for part in loose[:1]:
        raise ContourError(
            "not connected",
            (part.line, part.line),
            f"line {part.line} leads to a closed loop or away from it and is not a part of it; use G0 between loops",
            part.start,
        )


class _Walk:
    """loops: what the chain has closed so far; open: the parts since then."""

    def __init__(self, close_mm):
        self.close_mm, self.loops, self.open = close_mm, [], []
        self._length, self._lengths, self._cells = 0.0, [], {}
        self._bridges = set()  # id() of them
        self.joints = {0}  # numbers of open parts at whose start a loop was taken out

    def add(self, part):
        """The next part of the chain."""
        self._cells.setdefault(self._cell(part.start), []).append(len(self.open))
        self.open.append(part)
        self._lengths.append(self._length)
        self._length += _length(part)
        full = hasattr(part, "centre") and math.dist(part.start, part.end) <= FULL_CIRCLE_MM
        first = len(self.open) - 1 if full else self._last_at(part.end)
        if first is not None:
            self._take(first)

    def left(self):
        """[(number, part)] of the open parts, without those that are no longer than a gap: rests of spikes at the
        corner where a loop closed."""
        return [(k, part) for k, part in enumerate(self.open) if _length(part) > self.close_mm]

    def is_bridge(self, loop):
        """Whether a loop runs there and back on itself, from another loop."""
        return id(loop) in self._bridges

    def _cell(self, point):
        return round(point[0] / self.close_mm), round(point[1] / self.close_mm)

    def _last_at(self, point):
        """The newest open part that starts at a point, far enough back to be the start of a loop."""
        x, y = self._cell(point)
        near = [
            k
            for dx in (-1, 0, 1)
            for dy in (-1, 0, 1)
            for k in self._cells.get((x + dx, y + dy), ())
            if math.dist(self.open[k].start, point) <= self.close_mm
            and self._length - self._lengths[k] > LEAST_GAPS * self.close_mm
        ]
        return max(near, default=None)

    def _take(self, first):
        """The open parts from `first` on are a loop."""
        loop = tuple(self.open[first:])
        for k in range(first, len(self.open)):
            self._cells[self._cell(self.open[k].start)].remove(k)
        self._length, self.joints = self._lengths[first], {k for k in self.joints if k < first} | {first}
        del self.open[first:], self._lengths[first:]
        if there_and_back(loop, self.close_mm) and any(_meets(loop, other, self.close_mm) for other in self.loops):
            self._bridges.add(id(loop))
        self.loops.append(loop)


def _meets(loop, other, close_mm):
    """Whether two loops share an end of a part."""
    return any(math.dist(p.start, q.start) <= close_mm for p in loop for q in other)


def _length(part):
    if not hasattr(part, "centre"):
        return math.dist(part.start, part.end)
    radius = math.dist(part.start, part.centre)
    if math.dist(part.start, part.end) <= FULL_CIRCLE_MM:
        return 2.0 * math.pi * radius
    a, b = (math.atan2(p[1] - part.centre[1], p[0] - part.centre[0]) for p in (part.start, part.end))
    return radius * ((b - a if part.ccw else a - b) % (2.0 * math.pi))
