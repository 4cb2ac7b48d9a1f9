# SPDX-License-Identifier: GPL-2.0-or-later
"""Curves of one layer -> closed loops, open chains, and where ends do not meet.  Called by run.py.  mm.

1. What is drawn twice is dropped: equal parts, and lines that lie in other lines.  Curves that are closed by themselves
   stay whole.
2. Ends nearer than the tolerance are one place.  Where two ends meet, the curves are joined; where more do, nobody
   knows how to go on, and what ends there stays apart.
"""

import math
from collections import defaultdict
from dataclasses import dataclass, field

from chipwise.geometry.base.contour import backwards, turned
from chipwise.importing.drawn import line


@dataclass
class Joined:
    """closed, open: [[part, ..], ..]; gaps: number of those that were closed; widest: mm; branches: places where more
    than two ends meet; doubled: number of parts left out."""

    closed: list = field(default_factory=list)
    open: list = field(default_factory=list)
    gaps: int = 0
    widest: float = 0.0
    branches: list = field(default_factory=list)
    doubled: int = 0


def joined(curves, tolerance):
    """Joined of chains of parts."""
    found, left = Joined(), []
    for parts in curves:
        if _is_closed(parts, tolerance):
            found.closed.append(parts)
        else:
            left.append(parts)
    left, found.doubled = _once(left, tolerance)
    ends = _Ends(left, tolerance)
    used: set = set()
    for start in [(k, side) for k in range(len(left)) for side in (0, 1) if len(ends.at(k, side)) != 2] + [
        (k, 0) for k in range(len(left))
    ]:
        if start[0] not in used:
            _follow(left, ends, start, used, found, tolerance)
    found.branches = ends.branches()
    return found


def _is_closed(parts, tolerance):
    """Whether a curve returns to its start; a single line or arc only as a full circle."""
    if len(parts) == 1:
        return hasattr(parts[0], "centre") and math.dist(parts[0].start, parts[0].end) <= 1e-6
    long = sum(math.dist(part.start, part.end) for part in parts)
    return math.dist(parts[-1].end, parts[0].start) <= tolerance < 0.25 * long


class _Ends:
    """Ends of curves by place."""

    def __init__(self, curves, tolerance):
        self._points = [(curve[0].start, curve[-1].end) for curve in curves]
        cells: dict = defaultdict(list)
        parent: dict = {}
        for k, pair in enumerate(self._points):
            for side, point in enumerate(pair):
                key = (k, side)
                parent[key] = key
                x, y = (math.floor(v / tolerance) for v in point)
                for other in [o for dx in (-1, 0, 1) for dy in (-1, 0, 1) for o in cells[x + dx, y + dy]]:
                    if math.dist(self.point(*other), point) <= tolerance:
                        parent[_root(parent, key)] = _root(parent, other)
                cells[x, y].append(key)
        self._place, self._at = {key: _root(parent, key) for key in parent}, defaultdict(list)
        for key, place in self._place.items():
            self._at[place].append(key)

    def point(self, k, side):
        return self._points[k][side]

    def at(self, k, side):
        """The ends at the place of an end, itself with them."""
        return self._at[self._place[k, side]]

    def branches(self):
        return [self.point(*keys[0]) for keys in self._at.values() if len(keys) > 2]


def _root(parent, key):
    while parent[key] != key:
        parent[key] = parent[parent[key]]
        key = parent[key]
    return key


def _follow(curves, ends, start, used, found, tolerance):
    """The chain from an end, put where it belongs."""
    chain: list = []
    (k, side), first = start, None
    while k not in used:
        used.add(k)
        first = (k, side) if first is None else first
        parts = curves[k] if side == 0 else backwards(curves[k])
        chain += _bridge(chain, parts, found)
        here = (k, 1 - side)
        others = [end for end in ends.at(*here) if end != here]
        if len(others) != 1:
            break
        k, side = others[0]
    if len(ends.at(*first)) == 2 and (k, side) == first and math.dist(chain[-1].end, chain[0].start) <= tolerance:
        _note_gap(found, chain[-1].end, chain[0].start)
        found.closed.append(chain)
    else:
        found.open.append(chain)


def _note_gap(found, end, start):
    gap = math.dist(end, start)
    if gap > 1e-6:
        found.gaps, found.widest = found.gaps + 1, max(found.widest, gap)


def _bridge(chain, parts, found):
    """Parts with their first one moved onto the end of a chain: a line is, before an arc stands a short line."""
    if not chain:
        return parts
    end, first = chain[-1].end, parts[0]
    _note_gap(found, end, first.start)
    if math.dist(end, first.start) <= 1e-9:
        return parts
    if hasattr(first, "centre"):
        return [line(end, first.start), *parts]
    return [line(end, first.end), *parts[1:]]


def _once(curves, tolerance):
    """(curves without what lies in others, number of parts left out)."""
    known: dict = defaultdict(list)
    kept, left = [], 0
    for parts in curves:
        if len(parts) == 1 and hasattr(parts[0], "centre"):
            part = parts[0]
            key = tuple(round(v / max(tolerance, 1e-3) / 4) for v in part.centre)
            if any(_same_arc(part, other, tolerance) for other in known[key]):
                left += 1
                continue
            known[key].append(part)
        kept.append(parts)
    inside = _contained(
        [parts[0] if len(parts) == 1 and not hasattr(parts[0], "centre") else None for parts in kept], tolerance
    )
    return [parts for k, parts in enumerate(kept) if k not in inside], left + len(inside)


def _same_arc(part, other, tolerance):
    if part.ccw != other.ccw:
        part = turned(part)
    return (
        max(math.dist(part.start, other.start), math.dist(part.end, other.end), math.dist(part.centre, other.centre))
        <= tolerance
    )


def _contained(lines, tolerance):
    """Numbers of lines that lie in another one; of equal ones the later."""
    rows = defaultdict(list)
    for k, part in enumerate(lines):
        if part is not None:
            angle = math.atan2(part.end[1] - part.start[1], part.end[0] - part.start[0]) % math.pi
            rows[round(angle / 1e-2) % round(math.pi / 1e-2)].append(k)
    found = set()
    for numbers in rows.values():
        order = sorted(numbers, key=lambda k: (-math.dist(lines[k].start, lines[k].end), k))
        boxes = [_box(lines[k], tolerance) for k in order]
        alive: list = []
        for k, box in zip(order, boxes):
            x, y = lines[k].start
            if any(
                b[0] <= x <= b[2] and b[1] <= y <= b[3] and _lies_in(lines[k], lines[m], tolerance) for m, b in alive
            ):
                found.add(k)
            else:
                alive.append((k, box))
    return found


def _box(part, tolerance):
    xs, ys = zip(part.start, part.end)
    return min(xs) - tolerance, min(ys) - tolerance, max(xs) + tolerance, max(ys) + tolerance


def _lies_in(part, other, tolerance):
    """Whether both ends of a line are on another one."""
    (ax, ay), (bx, by) = other.start, other.end
    length = math.dist(other.start, other.end)
    for x, y in (part.start, part.end):
        along, off = (
            ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length,
            abs((x - ax) * (by - ay) - (y - ay) * (bx - ax)) / length,
        )
        if off > tolerance or not -tolerance <= along <= length + tolerance:
            return False
    return True
