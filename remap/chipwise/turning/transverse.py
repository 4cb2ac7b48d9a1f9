# SPDX-License-Identifier: GPL-2.0-or-later
"""Roughing in columns instead of levels: cuts towards the axis (in a bore away from it), side by side along Z.

Called by passes.py, at each level for what is left of an interval.  Source: the abstract on determining machining steps
for a lathe: a range has its direction.  Columns are chosen where they are shorter than levels and the tool can cut
them:

- the shape is open to the right: it does not rise there, so each column has one free side
- the front edge leans away from the wall that a column makes
- the holder is clear of all that is there at that time

A column at z = c is fed down to `reach`, and then along reach to the column before.  To the right of c nothing is left
above reach then; to the left, contact with what is left is nowhere higher than before.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from chipwise.turning.profile_function import (
    Graph,
    Interval,
    Piece,
    above,
    clip,
    flat,
    highest,
    lowest,
    moved,
    top,
    value,
)
from chipwise.turning.path import Path, Work
from chipwise.turning.reach import HOLDER_MM, holder_height
from chipwise.turning.tool import LatheTool

ROUNDING_MM = 1e-6
RISE_MM = 0.1  # of the shape to the right, at most: what the back edge leaves of a cylinder
RAPID = 0.1  # mm of feed that a mm of rapid counts
RETURN_MM = (
    1.0  # of feed that the return of a cut counts besides: three rapids that start and stop, about half a second
)
SAMPLES = 24  # places at which the levels are counted
DEEP = 0.5  # of its width: a range is deeper on average, else its upper part is cut along Z first
BETTER = 0.95  # of the levels' cost: columns of nearly the same length are not worth the change


class Column(NamedTuple):
    """One cut: at z down from x_from to x_to, then along reach to z_right; mm, positions of the nose's centre."""

    z: float
    x_from: float
    x_to: float
    z_right: float


def choose(work: Work, now: Graph, interval: Interval, z: float, depth: float) -> list[Column] | None:
    """[Column] for the stock around z within an interval, from the right; None where levels are shorter, or where
    columns cannot be cut.

    now: graph of contact with what is left; depth: mm."""
    if work.tool is None or math.isinf(work.tool.lean):
        return None
    a, b = next(
        ((a, b) for a, b, _, _ in above(clip(now, *interval), clip(work.reach, *interval), ROUNDING_MM) if a <= z <= b),
        (0.0, 0.0),
    )
    b -= ROUNDING_MM  # a sliver at the end is of what is beside
    surface, floor = clip(now, a, b), clip(work.reach, a, b)
    if b - a <= 4 * ROUNDING_MM or not _open(floor):
        return None
    found, depths = _columns(surface, floor, a, b, depth), _depths(surface, floor)
    if sum(depths) / SAMPLES < DEEP * (b - a) or max(c.x_from for c in found) + work.clearance > work.roof:
        return None
    if _cost(work, found, floor) > BETTER * _cost_of_levels(work, surface, floor, depths, depth):
        return None
    return found if _holder_clear(work, work.tool, now, found) else None


def _open(floor: Graph) -> bool:
    """Whether a graph does not rise to the right."""
    low = math.inf
    for p in floor:
        low = min(low, value(p, p.z0))
        if top(p, p.z0, p.z1) - low > RISE_MM:
            return False
        low = min(low, lowest(p))
        if value(p, p.z1) - low > RISE_MM:
            return False
    return True


def _columns(surface: Graph, floor: Graph, a: float, b: float, depth: float) -> list[Column]:
    """Columns of equal width, at most depth, from the right."""
    count = max(math.ceil((b - a) / depth - 1e-9), 1)
    places = [b + (a - b) * k / count for k in range(count)] + [a]
    found = []
    for right, z in zip(places, places[1:]):
        piece = clip(floor, z, right)[0]
        found.append(Column(z, max(highest(surface, z, z), highest(floor, z, z)), value(piece, piece.z0), right))
    return found


def _cost(work: Work, columns: Sequence[Column], floor: Graph) -> float:
    """mm of feed that columns count: down, and along the floor once, its walls included."""
    down = sum(c.x_from - c.x_to for c in columns)
    walls = sum(abs(value(p, p.z1) - value(q, q.z0)) for p, q in zip(floor, floor[1:]))
    return down * (1.0 + RAPID) + len(columns) * (work.near + RETURN_MM) + sum(map(_length, floor)) + walls


def _depths(surface: Graph, floor: Graph) -> list[float]:
    """mm of stock at places that are equally spaced."""
    a, b = floor[0].z0, floor[-1].z1
    return [
        highest(surface, z, z) - highest(floor, z, z)
        for z in (a + (b - a) * (k + 0.5) / SAMPLES for k in range(SAMPLES))
    ]


def _cost_of_levels(work: Work, surface: Graph, floor: Graph, depths: Sequence[float], depth: float) -> float:
    """The same of levels: a place is passed as often as its stock is deep, slopes and, where a tooth would be too
    thick, walls once."""
    a, b = floor[0].z0, floor[-1].z1
    along = (b - a) / SAMPLES * sum(math.ceil(d / depth - 1e-9) for d in depths)
    deep = highest(surface, a + ROUNDING_MM, b - ROUNDING_MM) - min(map(lowest, floor))
    climbs = deep if work.lean * depth > work.tooth else 0.0
    return (
        along * (1.0 + RAPID)
        + math.ceil(deep / depth - 1e-9) * (work.near + RETURN_MM)
        + sum(map(_length, floor))
        - (b - a)
        + climbs
    )


def _length(p: Piece) -> float:
    """mm along a piece."""
    chord = math.hypot(p.z1 - p.z0, value(p, p.z1) - value(p, p.z0))
    return chord if p.r == 0.0 else 2 * p.r * math.asin(min(0.5 * chord / p.r, 1.0))


def _holder_clear(work: Work, tool: LatheTool, now: Graph, columns: Sequence[Column]) -> bool:
    """Whether the holder is clear of what is left while each column is cut.

    Stock is at least a nose radius below the positions that touch it, and beside a column at least a nose radius to the
    left of its z: between, no higher than the centre of the nose.  Below the back edge a strip of a column's width may
    be left."""
    b = columns[0].z_right
    if not math.isinf(tool.right) and tool.right * (b - columns[-1].z) / len(columns) > tool.holder_up - HOLDER_MM:
        return False
    for z, _, x_to, right in columns:
        aside = z - tool.nose
        standing = [
            *clip(now, aside + min(tool.holder_left, 0.0) - 1.0, aside),
            flat(aside, z, x_to + tool.nose),
            *clip(work.reach, z, b),
            *clip(now, b + 2 * ROUNDING_MM, max(b, right + tool.holder_right) + 1.0),
        ]
        touching = moved(holder_height(standing, tool), 0.0, HOLDER_MM - tool.nose)
        if above(clip(touching, z, right), clip(work.reach, z, right), ROUNDING_MM):
            return False
    return True


def cut(path: Path, now: Graph, columns: Sequence[Column]) -> list[Piece]:
    """Cut the columns; -> contact with what is left."""
    work, (a, b), left = path.work, (columns[-1].z, columns[0].z_right), list(now)
    for z, x_from, x_to, right in columns:
        made = x_from < highest(work.given, z, z) - ROUNDING_MM
        path.link(z, x_from + (work.near if made else work.clearance))
        path.feed(z, x_to)
        path.back(work.reach, z, right)
        path.leave(b)
        left = [*clip(left, -math.inf, z), *clip(work.reach, z, b), *clip(left, b, math.inf)]
    path.transverse.append((a, b))
    path.columns += len(columns)
    return left
