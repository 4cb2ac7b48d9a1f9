# SPDX-License-Identifier: GPL-2.0-or-later
"""Passes of one tool: roughing in levels, finishing along the profile, facing, plunging.

Called by steps.py.  Works on graphs of positions (reach.py): `reach`, the lowest positions allowed, and `contact`, those at
which the tool touches the stock.  Every feed is on or above `reach`; every rapid is above `contact` by the clearance, or leaves
along a place that has just been cut.

A level at height c follows max(reach, c), so that it climbs the shoulder it ends at by one level, and enters a valley along
its wall.  The stock's contact after it is min(contact, max(reach, c)) exactly, because reach is made by the tool itself.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from chipwise.errors import CycleError
from chipwise.turning import transverse
from chipwise.turning.graph import above, at, clip, flat, highest, lower, segment, upper, value
from chipwise.turning.levels import levels

ROUNDING_MM = 1e-6
SHORT_MM = 1e-7         # of a shorter move only rounding is left
ARC_MM = 0.002          # a shorter arc is a line: one whose printed ends are equal would be a full circle to LinuxCNC
THIN = 0.8              # of what a step may leave: ends of cuts on slopes are left for the finish
SLOT_MM, ONE_MM = 0.05, 0.002   # positions of a grooving tool in a groove hardly wider than it; in one as wide as it
WALL_MM = 2e-4          # within so much the walls of such a groove are
MERGE_MM = 2.0          # of two parts of a finish with so little between them one is made


class NoRoom(CycleError):
    """A tool cannot go where it should: another one may."""


@dataclass(frozen=True)
class Move:
    """kind "rapid", "feed", "arc" or "thread"; end (z, x) of the nose's centre, mm; of an arc centre (z, x) and direction; of a thread mm per
    revolution of the spindle."""

    kind: str
    z: float
    x: float
    centre: tuple = ()
    ccw: bool = False
    pitch: float = 0.0


@dataclass(frozen=True)
class Work:
    """What the passes of one step share.

    reach, contact      graphs of positions
    block               graph: positions that no rapid may go through beside contact (barrier, holder on stock)
    start               (z, x) where the step begins and ends, clear of everything
    roof                mm: no position is above (a boring bar's far side); inf outside
    clearance           mm
    given, near         graph: positions that touch the blank, or what a drill has left of it; mm of feed before a surface that is below it: this plan
                        has made it, with an insert, and it is where the plan has it
    faced               the stock is such a surface from this Z on; inf: its end is the blank's
    stock, nose         graph before the step, and mm: a climb ends where the widest place of the nose has passed the stock
    tool                LatheTool, None where only levels are cut
    lean, tooth         mm per mm by which the edge at the wall leans away from it; mm that may stay there after each level, 0 for nothing
    """

    reach: list
    contact: list
    block: list
    start: tuple
    roof: float = math.inf
    clearance: float = 0.5
    given: tuple = ()
    near: float = 0.2
    faced: float = math.inf
    stock: tuple = ()
    nose: float = 0.0
    lean: float = math.inf
    tooth: float = 0.0
    tool: object = None


class Path:
    """Moves of a step in the making; z, x: where the tool is."""

    def __init__(self, work):
        self.work, self.moves = work, []
        self.cut, self.cut_at = [], []          # path graph of every part that was fed; how many moves there were then
        self.transverse, self.columns = [], 0   # (z0, z1) of what was cut in columns; how many of them
        self.z, self.x = work.start

    def rapid(self, z, x):
        if abs(z - self.z) > SHORT_MM or abs(x - self.x) > SHORT_MM:
            self._limit(x)
            self.moves.append(Move("rapid", z, x))
            self.z, self.x = z, x

    def feed(self, z, x):
        if abs(z - self.z) > SHORT_MM or abs(x - self.x) > SHORT_MM:
            self._limit(x)
            self.moves.append(Move("feed", z, x))
            self.z, self.x = z, x

    def thread(self, z, x, pitch):
        """A move in step with the spindle."""
        self._limit(x)
        self.moves.append(Move("thread", z, x, pitch=pitch))
        self.z, self.x = z, x

    def _limit(self, x):
        if x > self.work.roof + ROUNDING_MM:
            raise NoRoom("the boring bar would touch the far side of the bore: it is {wide} too wide",
                         "use a smaller bar, or drill a larger hole", wide=x - self.work.roof)

    def follow(self, path, z1, z0):
        """Feed along a graph from z1 to the left to z0, walls included."""
        for p in reversed(clip(path, z0, z1)):
            self._along(p, p.z1, p.z0, p.side > 0)
        self.has_cut(clip(path, z0, z1))

    def back(self, path, z0, z1):
        """Feed along a graph from z0 to the right to z1, walls included."""
        for p in clip(path, z0, z1):
            self._along(p, p.z0, p.z1, p.side < 0)
        self.has_cut(clip(path, z0, z1))

    def _along(self, p, start, end, ccw):
        """Feed along a piece."""
        if abs(value(p, start) - self.x) > 1e-9 or start != self.z:
            self.feed(start, value(p, start))
        x = value(p, end)
        if p.r == 0.0 or math.hypot(end - self.z, x - self.x) < ARC_MM:
            self.feed(end, x)
        else:
            self._limit(x)
            self.moves.append(Move("arc", end, x, (p.zr, p.xr), ccw))
            self.z, self.x = end, x

    def has_cut(self, graph):
        """The path along a graph is behind the tool."""
        self.cut.append(graph)
        self.cut_at.append(len(self.moves))

    def link(self, now, z, x):
        """To (z, x) by rapids above all that is left (graph `now`)."""
        high = max(self._height(now, min(z, self.z), max(z, self.z), x), self.x)
        self.rapid(self.z, high)
        self.rapid(z, high)
        self.rapid(z, x)

    def home(self, now):
        """Back to where the step began."""
        self.link(now, *self.work.start)

    def _height(self, now, z0, z1, x):
        """Of a rapid between two places: above all between them.  At the places themselves walls are touched at most."""
        z0, z1 = z0 + ROUNDING_MM, z1 - ROUNDING_MM
        found = max(highest(now, z0, z1), highest(self.work.block, z0, z1)) if z1 > z0 else -math.inf
        return max(x, found + self.work.clearance)

    def enter(self, now, path, z):
        """To the right end z of a cut along `path`, without touching what is left but by feed."""
        gap = self.work.clearance
        x = value(clip(path, z - 1.0, z)[-1], z)
        here = highest(now, z, z)
        beyond = max(highest(now, z + ROUNDING_MM, z + gap), highest(path, z, z + gap), highest(self.work.block, z, z + gap))
        made = here < highest(self.work.given, z, z) - ROUNDING_MM
        if here > x + ROUNDING_MM and beyond <= x + ROUNDING_MM:
            self.link(now, z + (self.work.near if made or z >= self.work.faced else gap), x)
        else:
            high = max(here, x) + (self.work.near if made else gap)
            self.link(now, z, min(max(high, x), max(self.work.roof, x)))
        self.feed(z, x)

    def can_leave(self, path, b):
        """Whether a move to the upper right is over what has just been cut, where a cut along `path` that began at b has ended, and over what is
        beyond b."""
        gap = self.work.clearance
        end, beyond = self.z + gap, upper(self.work.contact, self.work.block)
        below = [*clip(path, self.z + ROUNDING_MM, min(b, end)), *clip(beyond, max(b, self.z + ROUNDING_MM), end)]
        return not above(below, [segment(self.z, self.x, end, self.x + gap)], ROUNDING_MM) and self.x + gap <= self.work.roof

    def leave(self, path, b):
        """Away from the work, if it can be."""
        if self.can_leave(path, b):
            self.rapid(self.z + self.work.clearance, self.x + self.work.clearance)


def worth(regions, least):
    """Regions of above() that are higher than `least` mm and larger than its square: the others are rounding beside walls."""
    return [r for r in regions if r[3] > least and r[2] > least * least]


def rough(work, zone, depth, least):
    """Path of the levels from the top of the stock down to reach, within zone (z0, z1); intervals with less than `least` mm on
    them are left out.  None if nothing is to be cut.

    Each region has levels from its own top, so that no place is passed more often than its stock is deep.  Of all regions the highest
    level is next: elsewhere the stock is never higher than that by more than `depth` (reach.reachable_in_levels)."""
    contact = clip(work.contact, *zone)
    regions = [_Region(a, b, *levels(work.reach, contact, (a, b), depth))
               for a, b, _, _ in worth(above(contact, clip(work.reach, *zone), ROUNDING_MM), least)]
    if not regions:
        return None
    path, now = Path(work), work.contact
    cuts = sorted(((level, -k) for k, region in enumerate(regions) for level in region.heights), reverse=True)
    for c, k in cuts:
        a, b, top, heights = regions[-k]
        floor = upper(work.reach, [flat(a, b, c)])
        higher = min((level for level in heights if level > c), default=top)
        left = math.inf                     # end of what has been cut in columns at this level
        for z0, z1, _, _ in reversed(worth(above(clip(now, a, b), floor, ROUNDING_MM), min(least, 0.5 * (higher - c)))):
            columns = transverse.choose(work, now, (a, b), 0.5 * (z0 + z1), depth) if z1 - z0 < higher - heights[-1] and z1 <= left else None
            if columns:
                now, left = transverse.cut(path, now, columns), columns[-1].z
            elif z1 <= left:
                _cut(path, now, floor, *_thick_part(clip(now, z0, z1), floor, min(THIN * min(least, 0.5 * (higher - c)), work.tooth), (z0, z1)))
        now = [*clip(now, -math.inf, a), *lower(clip(now, a, b), clip(floor, a, b)), *clip(now, b, math.inf)]
    return path


def _thick_part(now, floor, thin, interval):
    """The interval without its ends where less than `thin` mm is left above the floor: a step that finishes takes them."""
    found = above(now, floor, thin) if thin > ROUNDING_MM else []
    return (found[0][0], found[-1][1]) if found else interval


class _Region(NamedTuple):
    """An interval (z0, z1) with stock: its top and the levels below, mm."""

    z0: float
    z1: float
    top: float
    heights: list


def _cut(path, now, floor, a, b):
    """One cut from b to a along a graph, with its entry, the shoulder at its end, and the exit."""
    path.enter(now, floor, b)
    path.follow(floor, b, a)
    wall = at(clip(floor, a - 1.0, a), a)
    if wall is not None:
        _climb(path, wall, highest(clip(now, a, b), a, a), path.can_leave(floor, b))
    path.leave(floor, b)


def _climb(path, wall, level, aside):
    """Up a wall to the level before, or to where nothing is left of the stock: what the edge leaves there leans away from it.

    aside: the tool could leave the wall at once; then a tooth may stay there, else all teeth above are taken: it goes up by rapid."""
    work = path.work
    x = min(wall, highest(work.stock, path.z - work.nose, path.z))
    if aside or not work.tooth:
        x = min(x, level)
    if x > path.x + ROUNDING_MM and not (aside and work.lean * (x - path.x) <= work.tooth - ROUNDING_MM):
        path.feed(path.z, x)


def finish(work, zone, least):
    """Path along reach where the stock is above it by more than `least`, None if it is nowhere."""
    reach, contact = clip(work.reach, *zone), clip(work.contact, *zone)
    parts = []
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


def face(work, levels, x_from, x_to):
    """Path of facing cuts at the positions `levels` (mm, from the right), each from x_from towards the axis to x_to."""
    path, gap = Path(work), work.clearance
    for z in levels:
        path.link(upper(work.contact, [flat(z - 1.0, levels[0] + 1.0, x_from)]), z, x_from + gap)
        path.feed(z, x_to)
        path.has_cut([flat(z, max(levels[0] + gap, work.contact[-1].z1), x_to)])
        path.rapid(z + gap, x_to)
        path.rapid(z + gap, x_from + gap)
    return path


def plunge(work, zone, width, least, slots_only=False):
    """Path of plunges of a grooving tool, side by side by `width`, then along reach; one in a slot, a groove hardly wider than the tool.  None if
    nothing is to be cut."""
    contact, reach = clip(work.contact, *zone), clip(work.reach, *zone)
    slots = [r for r in above(contact, reach, least) if _is_slot(work, r, least)]
    wide = [] if slots_only else [r for r in worth(above(contact, reach, ROUNDING_MM), least) if not any(r[0] < s[1] and s[0] < r[1] for s in slots)]
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
            path.link(work.contact, z, surface + gap)
            path.feed(z, bottom)
            path.rapid(z, surface + gap)
        if slot:
            _plunge_slot(path, a, b)
            continue
        path.link(work.contact, b, highest(work.contact, b, b) + gap)
        path.feed(b, value(clip(work.reach, a, b)[-1], b))
        path.follow(work.reach, b, a)
        path.rapid(path.z, max(path.x, highest(work.contact, a, a) + gap))
    return path


def _is_slot(work, region, least):
    """Whether a region of positions is narrow and has walls on both sides."""
    a, b = region[:2]
    low = highest(work.reach, 0.5 * (a + b), 0.5 * (a + b)) + least
    return WALL_MM < b - a < SLOT_MM and highest(work.reach, a - WALL_MM, a) > low and highest(work.reach, b, b + WALL_MM) > low


def _plunge_slot(path, a, b):
    """One plunge, in the middle of positions that are nearly one; else down at b, along the bottom, and up at a."""
    work, gap = path.work, path.work.clearance
    first, last = (0.5 * (a + b),) * 2 if b - a <= ONE_MM else (b - ROUNDING_MM, a + ROUNDING_MM)
    surface = max(highest(work.contact, a, b), highest(work.block, a, b)) + gap
    path.link(work.contact, first, surface)
    path.feed(first, value(clip(work.reach, a, first)[-1], first))
    path.follow(work.reach, first, last) if last < first else path.has_cut([flat(first - ROUNDING_MM, first, path.x)])
    path.feed(last, surface)
