# SPDX-License-Identifier: GPL-2.0-or-later
"""Heights of the levels of roughing: no more than the depth of cut apart, and such that their passes are short.

Called by passes.py.  Stock of one height is cut in equal levels or D apart.  Where the stock has steps (a casting, the
end that a drill has left) a grid from its highest place may take a thin slice from a long lower one: so grids that
begin at the lower tops are compared, too.  The length of the passes is estimated on a place in the middle of each
piece.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator

from chipwise.errors import CycleError
from chipwise.turning.profile_function import Graph, Interval, clip, highest, lowest, value

MAX_LEVELS = 400
ROUNDING_MM = 1e-6
THIN = 0.2  # of the depth of cut: a last level that is thinner is avoided unless it saves SAVING
SAVING = 0.03  # of the length of the passes
TOPS = 3  # lower tops that are compared
LONG = 0.1  # of the interval: a flat top is at least so long
FLAT = 0.001  # mm per mm
CELLS = 4  # places on a piece, at most


def levels(reach: Graph, contact: Graph, interval: Interval, depth: float) -> tuple[float, list[float]]:
    """(top of the stock in an interval, heights of the cuts below it, from above): `depth` apart at most.  Graphs of
    positions; mm."""
    a, b = interval
    if b - a > 4 * ROUNDING_MM:  # a wall at the end belongs to what is beside
        a, b = a + ROUNDING_MM, b - ROUNDING_MM
    surface, floor = clip(contact, a, b), clip(reach, a, b)
    high, low = highest(surface, a, b), min(map(lowest, floor))
    count = _count(high - low, depth)
    if count > MAX_LEVELS:
        raise CycleError(
            f"the depth of cut {{d}} makes {count} levels, more than {MAX_LEVELS}", "use a larger D", d=depth
        )
    found = _grids(high, low, depth, _tops(surface, low, high))
    if len(found) == 1:
        return high, found[0]
    places = list(_places(surface, floor, b - a))
    return high, min(found, key=lambda grid: _length(grid, high, places) * (1.0 + SAVING * _thin(grid, depth)))


def _count(height: float, depth: float) -> int:
    return max(math.ceil(height / depth - 1e-9), 1)


def _tops(surface: Graph, low: float, high: float) -> list[float]:
    """Heights of the longest flat pieces of the surface below its top."""
    lengths: dict[float, float] = {}
    least = LONG * (surface[-1].z1 - surface[0].z0)
    for p in surface:
        if p.r == 0.0 and abs(p.slope) <= FLAT:
            x = round(max(value(p, p.z0), value(p, p.z1)), 6) + ROUNDING_MM
            lengths[x] = lengths.get(x, 0.0) + p.z1 - p.z0
    long = [x for x, length in lengths.items() if length > least and low < x < high - 2 * ROUNDING_MM]
    return sorted(long, key=lambda x: -lengths[x])[:TOPS]


def _grids(high: float, low: float, depth: float, tops: list[float]) -> list[list[float]]:
    """Lists of levels: from the top, and from each lower top; D apart, and equal if the last one would be thin."""
    found = []
    for top in [high, *tops]:
        above = _count(high - top, depth) if top < high else 0
        begin = [high + (top - high) * k / above for k in range(1, above + 1)]
        count = _count(top - low, depth)
        found.append(begin + [max(top - k * depth, low) for k in range(1, count + 1)])
        if count > 1 and top - low - (count - 1) * depth < THIN * depth:
            found.append(begin + [top + (low - top) * k / count for k in range(1, count)] + [low])
    return found


def _thin(grid: list[float], depth: float) -> bool:
    """Whether the last level is thin."""
    return len(grid) > 1 and grid[-2] - grid[-1] < THIN * depth


def _places(surface: Graph, floor: Graph, length: float) -> Iterator[tuple[float, float, float]]:
    """(mm along Z, height of the surface, height of the floor) of places between."""
    i = j = 0
    while i < len(surface) and j < len(floor):
        p, q = surface[i], floor[j]
        z0, z1 = max(p.z0, q.z0), min(p.z1, q.z1)
        if z1 > z0:
            count = min(int(CELLS * (z1 - z0) / length * len(floor)) + 1, 4 * CELLS)
            for k in range(count):
                z = z0 + (z1 - z0) * (k + 0.5) / count
                yield (z1 - z0) / count, value(p, z), value(q, z)
        if p.z1 <= q.z1:
            i += 1
        else:
            j += 1


def _length(grid: list[float], high: float, places: Iterable[tuple[float, float, float]]) -> float:
    """mm of passes: a place is passed by each level that ends below its surface and begins above its floor."""
    heights = [-c for c in grid]
    begins = [-high, *heights[:-1]]
    return sum(
        along * (bisect_left(begins, -low - ROUNDING_MM) - bisect_right(heights, -up + ROUNDING_MM))
        for along, up, low in places
        if up - low > ROUNDING_MM
    )
