# SPDX-License-Identifier: GPL-2.0-or-later
"""Passes of one tool: roughing in levels, finishing along the profile, facing, plunging.

Called by steps.py.  Works on graphs of positions (reach.py): `reach`, the lowest positions allowed, and `contact`,
those at which the tool touches the stock.  Every feed is on or above `reach`; every rapid is above `contact` by the
clearance, or leaves along a place that has just been cut.

A level at height c follows max(reach, c), so that it climbs the shoulder it ends at by one level, and enters a valley
along its wall.  The stock's contact after it is min(contact, max(reach, c)) exactly, because reach is made by the tool
itself.
"""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from chipwise.turning import transverse
from chipwise.turning.profile_function import (
    Graph,
    Interval,
    Region,
    above,
    at,
    clip,
    flat,
    highest,
    lower,
    upper,
    value,
)
from chipwise.turning.levels import levels
from chipwise.turning.path import ROUNDING_MM, Path, Work

THIN = 0.8  # of what a step may leave: ends of cuts on slopes are left for the finish
SLOT_MM, ONE_MM = 0.05, 0.002  # positions of a grooving tool in a groove hardly wider than it; in one as wide as it
WALL_MM = 2e-4  # within so much the walls of such a groove are
MERGE_MM = 2.0  # of two parts of a finish with so little between them one is made


def worth(regions: Iterable[Region], least: float) -> list[Region]:
    """Regions of above() that are higher than `least` mm and larger than its square: the others are rounding beside
    walls."""
    return [r for r in regions if r[3] > least and r[2] > least * least]


def rough(work: Work, zone: Interval, depth: float, least: float) -> Path | None:
    """Path of the levels from the top of the stock down to reach, within zone (z0, z1); intervals with less than
    `least` mm on them are left out.  None if nothing is to be cut.

    Each region has levels from its own top, so that no place is passed more often than its stock is deep.  Of all
    regions the highest level is next: elsewhere the stock is never higher than that by more than `depth`
    (reach.reachable_in_levels)."""
    contact = clip(work.contact, *zone)
    regions = [
        _Region(a, b, *levels(work.reach, contact, (a, b), depth))
        for a, b, _, _ in worth(above(contact, clip(work.reach, *zone), ROUNDING_MM), least)
    ]
    if not regions:
        return None
    path, now = Path(work), work.contact
    cuts = sorted(((level, -k) for k, region in enumerate(regions) for level in region.heights), reverse=True)
    for c, k in cuts:
        a, b, top, heights = regions[-k]
        floor = upper(work.reach, [flat(a, b, c)])
        higher = min((level for level in heights if level > c), default=top)
        left = math.inf  # end of what has been cut in columns at this level
        for z0, z1, _, _ in reversed(worth(above(clip(now, a, b), floor, ROUNDING_MM), min(least, 0.5 * (higher - c)))):
            columns = (
                transverse.choose(work, now, (a, b), 0.5 * (z0 + z1), depth)
                if z1 - z0 < higher - heights[-1] and z1 <= left
                else None
            )
            if columns:
                now, left = transverse.cut(path, now, columns), columns[-1].z
            elif z1 <= left:
                _cut(
                    path,
                    now,
                    floor,
                    *_thick_part(
                        clip(now, z0, z1), floor, min(THIN * min(least, 0.5 * (higher - c)), work.tooth), (z0, z1)
                    ),
                )
        now = [*clip(now, -math.inf, a), *lower(clip(now, a, b), clip(floor, a, b)), *clip(now, b, math.inf)]
    return path


def _thick_part(now: Graph, floor: Graph, thin: float, interval: Interval) -> Interval:
    """The interval without its ends where less than `thin` mm is left above the floor: a step that finishes takes
    them."""
    found = above(now, floor, thin) if thin > ROUNDING_MM else []
    return (found[0][0], found[-1][1]) if found else interval


class _Region(NamedTuple):
    """An interval (z0, z1) with stock: its top and the levels below, mm."""

    z0: float
    z1: float
    top: float
    heights: list[float]


def _cut(path: Path, now: Graph, floor: Graph, a: float, b: float) -> None:
    """One cut from b to a along a graph, with its entry, the shoulder at its end, and the exit."""
    path.enter(now, floor, b)
    path.follow(floor, b, a)
    wall = at(clip(floor, a - 1.0, a), a)
    if wall is not None:
        _climb(path, wall, highest(clip(now, a, b), a, a), path.can_leave(b) is not None)
    path.leave(b)


def _climb(path: Path, wall: float, level: float, aside: bool) -> None:
    """Up a wall to the level before, or to where nothing is left of the stock: what the edge leaves there leans away
    from it.

    aside: the tool could leave the wall at once; then a tooth may stay there, else all teeth above are taken: it goes
    up by rapid."""
    work = path.work
    x = min(wall, highest(work.stock, path.z - work.nose, path.z))
    if aside or not work.tooth:
        x = min(x, level)
    if x > path.x + ROUNDING_MM and not (aside and work.lean * (x - path.x) <= work.tooth - ROUNDING_MM):
        path.feed(path.z, x)


def finish(work: Work, zone: Interval, least: float) -> Path | None:
    """Path along reach where the stock is above it by more than `least`, None if it is nowhere."""
    reach, contact = clip(work.reach, *zone), clip(work.contact, *zone)
    parts: list[Interval] = []
    for a, b, _, _ in worth(above(contact, reach, ROUNDING_MM), least):
        if parts and a - parts[-1][1] < MERGE_MM:
            parts[-1] = (parts[-1][0], b)
        else:
            parts.append((a, b))
    if not parts:
        return None
    path, now = Path(work), work.contact
    for a, b in reversed(parts):
        _cut(path, now, work.reach, a, b)
    return path


def face(work: Work, levels: Sequence[float], x_from: float, x_to: float) -> Path:
    """Path of facing cuts at the positions `levels` (mm, from the right), each from x_from towards the axis to x_to."""
    path, gap = Path(work), work.clearance
    path.now = upper(path.now, [flat(levels[-1] - 1.0, levels[0] + 1.0, x_from)])
    for z in levels:
        path.link(z, x_from + gap)
        path.feed(z, x_to)
        path.has_cut([flat(z, max(levels[0] + gap, work.contact[-1].z1), x_to)])
        path.rapid(z + gap, x_to)
        path.rapid(z + gap, x_from + gap)
    return path


def plunge(work: Work, zone: Interval, width: float, least: float, slots_only: bool = False) -> Path | None:
    """Path of plunges of a grooving tool, side by side by `width`, then along reach; one in a slot, a groove hardly
    wider than the tool.  None if nothing is to be cut."""
    contact, reach = clip(work.contact, *zone), clip(work.reach, *zone)
    slots = [r for r in above(contact, reach, least) if _is_slot(work, r, least)]
    wide = (
        []
        if slots_only
        else [
            r
            for r in worth(above(contact, reach, ROUNDING_MM), least)
            if not any(r[0] < s[1] and s[0] < r[1] for s in slots)
        ]
    )
    regions = sorted(slots + wide)
    if not regions:
        return None
    path, gap = Path(work), work.clearance
    for a, b, _, height in reversed(regions):
        slot = (a, b, _, height) in slots
        count = max(math.ceil((b - a) / width), 1)
        for k in range(0 if slot else count + 1):
            z = b + (a - b) * k / count
            bottom, surface = highest(work.reach, z, z), highest(work.contact, z, z)
            if surface <= bottom + least:
                continue
            path.link(z, surface + gap)
            path.feed(z, bottom)
            if k:
                path.lowered(
                    [flat(z, z + (b - a) / count, highest(work.reach, z, z + (b - a) / count) + 2 * work.nose)]
                )
            path.leave(z)
        if slot:
            _plunge_slot(path, a, b)
            continue
        path.link(b, highest(path.now, b, b) + gap)
        path.feed(b, value(clip(work.reach, a, b)[-1], b))
        path.follow(work.reach, b, a)
        path.leave(b)
    return path


def _is_slot(work: Work, region: Region, least: float) -> bool:
    """Whether a region of positions is narrow and has walls on both sides."""
    a, b = region[:2]
    low = highest(work.reach, 0.5 * (a + b), 0.5 * (a + b)) + least
    return (
        WALL_MM < b - a < SLOT_MM
        and highest(work.reach, a - WALL_MM, a) > low
        and highest(work.reach, b, b + WALL_MM) > low
    )


def _plunge_slot(path: Path, a: float, b: float) -> None:
    """One plunge, in the middle of positions that are nearly one; else down at b, along the bottom, and up at a."""
    work, gap = path.work, path.work.clearance
    first, last = (0.5 * (a + b),) * 2 if b - a <= ONE_MM else (b - ROUNDING_MM, a + ROUNDING_MM)
    surface = max(highest(work.contact, a, b), highest(work.block, a, b)) + gap
    path.link(first, surface)
    path.feed(first, value(clip(work.reach, a, first)[-1], first))
    path.follow(work.reach, first, last) if last < first else path.has_cut([flat(first - ROUNDING_MM, first, path.x)])
    path.feed(last, surface)
