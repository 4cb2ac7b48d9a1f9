# SPDX-License-Identifier: GPL-2.0-or-later
"""The path of one step in the making: moves, and contact with what is left, for links that keep clear of it.

Called by passes.py, sides.py, drilling.py, thread.py, steps.py and state.py.  A rapid keeps `beside` from stock at all
sides, or goes away from it where a cut has ended; what cannot be farther from it is a feed.
"""

import math
from dataclasses import dataclass
from typing import Literal

from chipwise.errors import CycleError
from chipwise.turning.profile_function import (
    Graph,
    Interval,
    Piece,
    Place,
    above,
    clip,
    highest,
    lower,
    segment,
    upper,
    value,
)
from chipwise.turning.tool import LatheTool

ROUNDING_MM = 1e-6
SHORT_MM = 1e-7  # of a shorter move only rounding is left
ARC_MM = 0.002  # a shorter arc is a line: one whose printed ends are equal would be a full circle to LinuxCNC
BESIDE_MM = 0.2  # TRAVERSE_CLEARANCE of a machine that does not say it
LEAVES = (
    (1.0, 0.43),
    (2.0, 0.94),
    (3.0, 1.25),
)  # rise of a rapid away from the work, and of the stock below it at most: 20 degrees between them


Kind = Literal["rapid", "feed", "arc", "thread"]


class NoRoom(CycleError):
    """A tool cannot go where it should: another one may."""


@dataclass(frozen=True)
class Move:
    """kind "rapid", "feed", "arc" or "thread"; end (z, x) of the nose's centre, mm; of an arc centre (z, x) and
    direction; of a thread mm per revolution of the spindle."""

    kind: Kind
    z: float
    x: float
    centre: tuple[float, ...] = ()
    ccw: bool = False
    pitch: float = 0.0


@dataclass(frozen=True)
class Work:
    """What the passes of one step share.

    reach, contact      graphs of positions
    block               graph: positions that no rapid may go through beside contact (barrier, holder on stock)
    start               (z, x) where the step begins and ends, clear of everything
    roof                mm: no position is above (a boring bar's far side); inf outside
    clearance, beside   mm: of an approach; that a rapid keeps from stock
    touch               graph as contact, of the insert without its relief and of what reliefs have left; () for contact
    given, near         graph: positions that touch the blank, or what a drill has left of it; mm of feed before a
                        surface that is below it: this plan has made it, with an insert, and it is where the plan has it
    faced               the stock is such a surface from this Z on; inf: its end is the blank's
    stock, nose         graph before the step, and mm: a climb ends where the widest place of the nose has passed the
                        stock
    tool                LatheTool, None where only levels are cut
    lean, tooth         mm per mm by which the edge at the wall leans away from it; mm that may stay there after each
                        level, 0 for nothing
    """

    reach: Graph
    contact: Graph
    block: Graph
    start: Place
    roof: float = math.inf
    clearance: float = 0.5
    touch: Graph = ()
    given: Graph = ()
    near: float = BESIDE_MM
    beside: float = BESIDE_MM
    faced: float = math.inf
    stock: Graph = ()
    nose: float = 0.0
    lean: float = math.inf
    tooth: float = 0.0
    tool: LatheTool | None = None


class Path:
    """Moves of a step in the making; z, x: where the tool is."""

    def __init__(self, work: Work) -> None:
        self.work = work
        self.moves: list[Move] = []
        self.cut: list[Graph] = []  # path graph of every part that was fed
        self.cut_at: list[int] = []  # how many moves there were then
        self.transverse: list[Interval] = []  # what was cut in columns
        self.columns = 0  # how many of them
        self.z, self.x = work.start
        self.now = list(work.touch or work.contact)  # contact with what is left

    def rapid(self, z: float, x: float) -> None:
        if abs(z - self.z) > SHORT_MM or abs(x - self.x) > SHORT_MM:
            self._limit(x)
            self.moves.append(Move("rapid", z, x))
            self.z, self.x = z, x

    def feed(self, z: float, x: float) -> None:
        if abs(z - self.z) > SHORT_MM or abs(x - self.x) > SHORT_MM:
            self._limit(x)
            self.moves.append(Move("feed", z, x))
            self.z, self.x = z, x

    def thread(self, z: float, x: float, pitch: float) -> None:
        """A move in step with the spindle."""
        self._limit(x)
        self.moves.append(Move("thread", z, x, pitch=pitch))
        self.z, self.x = z, x

    def _limit(self, x: float) -> None:
        if x > self.work.roof + ROUNDING_MM:
            raise NoRoom(
                "the boring bar would touch the far side of the bore: it is {wide} too wide",
                "use a smaller bar, or drill a larger hole",
                wide=x - self.work.roof,
            )

    def follow(self, path: Graph, z1: float, z0: float) -> None:
        """Feed along a graph from z1 to the left to z0, walls included."""
        for p in reversed(clip(path, z0, z1)):
            self._along(p, p.z1, p.z0, p.side > 0)
        self.has_cut(clip(path, z0, z1))

    def back(self, path: Graph, z0: float, z1: float) -> None:
        """Feed along a graph from z0 to the right to z1, walls included."""
        for p in clip(path, z0, z1):
            self._along(p, p.z0, p.z1, p.side < 0)
        self.has_cut(clip(path, z0, z1))

    def _along(self, p: Piece, start: float, end: float, ccw: bool) -> None:
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

    def has_cut(self, graph: Graph) -> None:
        """The path along a graph is behind the tool."""
        self.cut.append(graph)
        self.cut_at.append(len(self.moves))
        if graph:
            self.lowered(graph)

    def lowered(self, graph: Graph) -> None:
        """Contact is at most this graph now."""
        a, b = graph[0].z0, graph[-1].z1
        self.now = [*clip(self.now, -math.inf, a), *lower(clip(self.now, a, b), graph), *clip(self.now, b, math.inf)]

    def link(self, z: float, x: float) -> None:
        """To (z, x) by rapids above all that is left, by feed where they would be too near to it."""
        self._approach(z, x)
        self.feed(z, x)

    def _approach(self, z: float, x: float) -> None:
        """To z and down to x, or to where a rapid has to end above it.  Under a roof the move across may have to be a
        feed."""
        least, most = max(self._height(min(z, self.z), max(z, self.z), x), self.x), self.work.roof
        high = max(least, min(max(self._free(self.z, z), least), most))
        self.feed(self.z, min(max(self.x, self._free(self.z, self.z)), high))
        self.rapid(self.z, high)
        if high < self._free(self.z, z) - ROUNDING_MM:
            self.feed(z, high)
        self.rapid(z, high)
        self.rapid(z, min(max(x, self._free(z, z)), high))

    def home(self) -> None:
        """Back to where the step began."""
        if not self.cut:
            self.now = []
        self.link(*self.work.start)

    def _height(self, z0: float, z1: float, x: float) -> float:
        """Of a rapid between two places, no lower than x: above all between them.  At the places themselves walls are
        touched at most."""
        z0, z1 = z0 + ROUNDING_MM, z1 - ROUNDING_MM
        found = max(highest(self.now, z0, z1), highest(self.work.block, z0, z1)) if z1 > z0 else -math.inf
        return max(x, found + self.work.clearance)

    def _free(self, z0: float, z1: float) -> float:
        """Height above which a rapid between two places is clear of all that is left, beside them, too."""
        aside = max(self.work.beside - ROUNDING_MM, 0.0)
        return highest(self.now, min(z0, z1) - aside, max(z0, z1) + aside) + self.work.beside

    def enter(self, now: Graph, path: Graph, z: float) -> None:
        """To the right end z of a cut along `path`, without touching what is left (graph `now`) but by feed."""
        gap = self.work.clearance
        x = value(clip(path, z - 1.0, z)[-1], z)
        here = highest(now, z, z)
        beyond = max(
            highest(now, z + ROUNDING_MM, z + gap), highest(path, z, z + gap), highest(self.work.block, z, z + gap)
        )
        made = here < highest(self.work.given, z, z) - ROUNDING_MM
        if here > x + ROUNDING_MM and beyond <= x + ROUNDING_MM:
            self._approach(z + (self.work.near if made or z >= self.work.faced else gap), x)
        else:
            high = max(here, x) + (self.work.near if made else gap)
            self._approach(z, min(max(high, x), max(self.work.roof, x)))
        self.feed(z, x)

    def can_leave(self, b: float) -> float | None:
        """Rise (mm per mm) of a move to the upper right that goes away from what is left where a cut that began at b
        has ended; None: it would not."""
        gap, beside = self.work.clearance, self.work.beside
        end = self.z + gap
        holder = upper(
            clip(self.work.block, max(b, self.z + ROUNDING_MM), end), clip(self.work.reach, self.z + ROUNDING_MM, end)
        )
        for rise, most in LEAVES:
            high = self.x + gap * rise
            below = [segment(self.z, self.x, end, self.x + gap * most), *self._below_beside(rise, most)]
            if (
                high <= self.work.roof
                and not above(clip(self.now, self.z + ROUNDING_MM, end + beside), below, ROUNDING_MM)
                and not above(holder, [segment(self.z, self.x, end, high)], ROUNDING_MM)
            ):
                return rise
        return None

    def _below_beside(self, rise: float, most: float) -> list[Piece]:
        """Graph, from where a move away with this rise would end: stock below it is `beside` from the move, or has at
        most the rise `most`, and is `beside` below its end."""
        gap, beside = self.work.clearance, self.work.beside
        apart = beside * math.hypot(1.0, rise) / rise  # along Z
        top = gap * rise - beside

        def height(along: float) -> float:
            return min(top, max(most * along, rise * (along - apart)))

        bends = (rise * apart / (rise - most), top / most, apart + top / rise)
        places = [gap, *sorted(place for place in bends if gap < place < gap + beside), gap + beside]
        return [
            segment(self.z + a, self.x + height(a), self.z + b, self.x + height(b))
            for a, b in zip(places, places[1:])
            if b > a
        ]

    def leave(self, b: float) -> None:
        """Away from the work, if it can be."""
        rise = self.can_leave(b)
        if rise is not None:
            self.rapid(self.z + self.work.clearance, self.x + self.work.clearance * rise)
