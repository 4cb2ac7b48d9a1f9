# SPDX-License-Identifier: GPL-2.0-or-later
"""The segments of a first path that are travelled again: where they begin and end.

Called by levels.py.  Source: CN105492980 figure 13.

The map's needles are a cell apart.  At the side of a path, stock that lies between them may be there a little before
and behind the pieces that meet any: a tool of radius r takes the last of a strip of width w only when its axis is
sqrt(2 r w) further.  So a segment has MARGIN_CELLS, and behind it that for a strip as wide as a cell, more than the
pieces that meet something.  Lengths mm.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats
    from chipwise.rewrite.links import Links

NEAR_PIECES = 6  # segments with fewer pieces between them are travelled as one
MARGIN_CELLS = 1.0


def segments(left: Bools, s: Floats, cell: float, radius: float) -> list[tuple[int, int]]:
    """[(a, b)]: first and last point of the segments of a path where something is left, none beside another.

    left (n,) bool: of the pieces of n + 1 points; s (n + 1,): arc length at the points; cell: mm, radius: of the tool.
    """
    index = np.flatnonzero(left)
    if not len(index):
        return []
    before, behind = MARGIN_CELLS * cell, MARGIN_CELLS * cell + math.sqrt(2 * radius * cell)
    found: list = []
    for part in np.split(index, np.flatnonzero(np.diff(index) > NEAR_PIECES) + 1):
        first, last = int(part[0]), int(part[-1]) + 1
        a = min(max(first - 1, 0), max(int(s.searchsorted(s[first] - before, side="right")) - 1, 0))
        b = max(min(last + 1, len(left)), min(int(s.searchsorted(s[last] + behind)), len(left)))
        if found and a <= found[-1][1]:
            a = found.pop()[0]
        found.append((a, b))
    return found


def with_links(
    parts: list[tuple[int, int]], points: Floats, s: Floats, most: float, links: Links
) -> list[tuple[int, int]]:
    """The same segments, begun up to `most` (mm) earlier if a traverse comes down there, but not where they begin; the
    last one goes on to the end of the path if that is no further and no traverse goes there.  points (n + 1, 3); links:
    a Links in the stock as it is."""
    result, free = [], 0
    for a, b in parts:
        begin = a
        while begin > free and s[a] - s[begin] <= most and not _comes_down(links, points[begin]):
            begin -= 1
        if s[a] - s[begin] <= most and (begin == free or _comes_down(links, points[begin])):
            a = begin
        result.append((a, b))
        free = b
    a, b = result[-1]
    end = len(points) - 1
    if b < end and s[end] - s[b] <= most and not links.is_clear(points[b], points[end]):
        result[-1] = a, end
    return result


def _comes_down(links: Links, point: Floats) -> bool:
    return links.wall(point[:2]) <= point[2]
