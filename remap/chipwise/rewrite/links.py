# SPDX-License-Identifier: GPL-2.0-or-later
"""Links between the segments of a path that are travelled again: up, across, and down to a gap above what has been cut.

Called by flute.py and levels.py.  The height across is the one at which the program itself last travelled: it is clear
of clamps that no model knows.  A traverse keeps the clearance from stock at its side, and a cell more, because the
needles of the map are so far apart; depth_proof.py proves it.  If it cannot, it goes above the stock, and the rest of
the way down is fed.  Lengths mm, machine coordinates of the tool's tip.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Callable, Sequence

from chipwise.program.records import FEED, RAPID
from chipwise.rewrite import sections
from chipwise.rewrite.edits import Move

if TYPE_CHECKING:
    from chipwise.clib.arrays import Floats
    from chipwise.clib.height_map import HeightMap
    from chipwise.rewrite.path_moves import Body
    from chipwise.rewrite.program import Program

OVER_MM = 0.005  # stock less high than that is not met
ACROSS_MM = 1e-6  # shorter travel across the axis is ignored
GAP_MM = 1.0  # above what has been cut, where a traverse ends and a feed begins


class Links:
    """stock, tool: those of the section; travel: Z of the program's last traverse, None before the first; clearance:
    mm."""

    stock: HeightMap
    tool: sections.Tool

    def __init__(self, program: Program, clearance: float) -> None:
        self.program, self.clearance = program, clearance
        self.travel: float | None = None
        lead = program.known_from
        self._first = float(program.end[lead - 1, 2]) if lead and abs(program.end[lead - 1, 2]) > 1e-9 else -math.inf

    def _safe(self) -> float:
        """Z of links: the height of the program's last traverse, else above the stock and not below where the program
        has begun."""
        return self.travel if self.travel is not None else max(self._first, self.stock.z_max + GAP_MM)

    def _feed(self, move: int) -> float:
        return float(self.program.feed[move])

    def _plunge_feed(self, body: Body) -> float:
        """That of the program's own path down to the body; without one the body's."""
        down = [m for m in body.lead if self.program.kind[m] != RAPID]
        return min(self._feed(m) for m in (*down, int(body.move[0])))

    def _beside(self) -> float:
        """mm that traverses keep from what the map shows."""
        return self.clearance + self.stock.cell

    def wall(self, place: Floats | Sequence[float]) -> float:
        """Z down to which a traverse may come at a place (x, y): no higher stock is at its side."""
        return sections.highest(self.stock, place[0], place[1], self.tool.shape.diameter / 2 + self._beside())

    def is_clear(self, start: Floats | Sequence[float], end: Floats | Sequence[float]) -> bool:
        """Whether a traverse from start to end (3,) is in the clear."""
        return self.stock.is_clear(self.tool.shape, self._beside(), start, end)

    def to_segment(self, at: Floats, part: Body, body: Body) -> Callable[[float], list[Move]]:
        """From a place to the beginning of a segment in the stock as it is; -> function of the height there ->
        Moves."""
        x, y = part.points[0, :2]
        feed = self._plunge_feed(body)
        if math.hypot(at[0] - x, at[1] - y) <= ACROSS_MM:
            return lambda z: [Move(FEED, (x, y, z), feed)] if abs(at[2] - z) > 1e-9 else []
        over = self._over(at, x, y, body)
        return lambda z: [*over(z), Move(FEED, (x, y, z), feed)]

    def _over(self, at: Floats, x: float, y: float, body: Body) -> Callable[[float], list[Move]]:
        """Up, across and down to a gap above what is there; -> function of the height there -> Moves."""
        safe = self._clear(at, (x, y), max(self._safe(), at[2]))
        floor, wall = (
            sections.highest(self.stock, x, y, self.tool.shape.diameter / 2 - 0.004),
            self.wall((x, y)),
        )  # before the segment is cut
        across = [Move(RAPID, (at[0], at[1], safe)), Move(RAPID, (x, y, safe))]

        def moves(z: float) -> list[Move]:
            return across + self._down((x, y), safe, max(floor, z) + GAP_MM, wall, self._feed(int(body.move[0])))

        return moves

    def _down(self, place: tuple[float, float], above: float, z: float, wall: float, feed: float) -> list[Move]:
        """Moves down from a height to another, fed where stock is at the tool's side, which is up to `wall`."""
        free = max(z, wall)
        free += GAP_MM if free > z else 0.0
        moves = [Move(RAPID, (*place, free))] if free < above else []
        return moves + ([Move(FEED, (*place, z), feed)] if z < min(free, above) else [])

    def lead_down(self, place: list[float], above: float, z: float, wall: float, feed: float) -> list[Move]:
        """Moves down from `above` to z in place of a traverse of the program itself there; wall: as in wall()
        before."""
        if z >= wall:
            return [Move(RAPID, (*place, z))]
        free = wall + GAP_MM
        return [*([Move(RAPID, (*place, free))] if free < above else []), Move(FEED, (*place, z), feed)]

    def _clear(self, at: Floats, place: tuple[float, float], safe: float) -> float:
        """`safe`, or above the stock where a traverse there would be too near to it."""
        return safe if self.is_clear((*at[:2], safe), (*place, safe)) else max(safe, self.stock.z_max + GAP_MM)

    def _is_absolute(self, move: int) -> bool:
        """Whether a move ends at the same place wherever it begins: not under G91, nor in a block, which may have G91
        in it."""
        step = int(self.program.step[move])
        modes = self.program.modes_on(step)
        return modes.distance == 90 and not modes.unclear and self.program.block_of(step) is None

    def back(self, at: Floats, place: Floats, end: int, section_end: int, body: Body) -> list[Move]:
        """From the last segment to where the first path's body ends."""
        if math.hypot(at[0] - place[0], at[1] - place[1]) <= ACROSS_MM:
            return [Move(FEED, tuple(place), self._plunge_feed(body))] if abs(at[2] - place[2]) > 1e-9 else []
        moves = self._over(at, place[0], place[1], body)(place[2])
        follows = self.program.end[end] if end < section_end else None
        if (
            follows is not None
            and self._is_absolute(end)
            and self.program.kind[end] == RAPID
            and follows[2] > place[2] + GAP_MM
            and math.hypot(follows[0] - place[0], follows[1] - place[1]) <= ACROSS_MM
            and (follows[2] >= moves[1].end[2] or follows[2] >= self.wall(place))
        ):
            return moves[:2]  # the program goes up there anyway
        return [*moves, Move(FEED, tuple(place), self._plunge_feed(body))]
