# SPDX-License-Identifier: GPL-2.0-or-later
"""What shifting a body has left of the first path, travelled again level by level until the first path itself has been
cut.

Called by flute.py, whose [4] this is.  Source: CN105492980 [0088]..[0093], figure 13.

A level is one round:
 1. Try: what of the first path has not been travelled where it is, is cut in a window of the map, and the window is put
    back.
 2. What has met material is left (R4).  If nothing has, the body is done.
 3. The segments of R4, or the whole body, are shifted as the body itself was, and cut.  Between two of them the tool
    goes up to where the program last travelled, across, and down to a gap above what it has cut.

Lengths mm, machine coordinates of the tool's tip.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Callable

import numpy as np

from chipwise.clib.height_map import MET
from chipwise.program.reader import Unreadable
from chipwise.rewrite import path_moves, shift
from chipwise.rewrite.edits import Table
from chipwise.rewrite.links import OVER_MM
from chipwise.rewrite.segments import segments, with_links
from chipwise.rewrite.trial_proof import OVER_STOCK_MM

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats, Records
    from chipwise.rewrite.flute import Ground
    from chipwise.rewrite.program import Program
    from chipwise.rewrite.sections import Window

LEFT_DEPTH = 0.15  # cells of depth, or of a cell's height, less than read_back.py's HEIGHT_CELLS, and
LEFT_SHARE = 0.005  # cells of mean height across the tool, below which nothing is left to travel again for
MOST_LEVELS = 1000  # of one body


class Levels:
    """Of one path_moves.Body in a flute.Ground, after the path `moved` (n, 3) has been cut in its place.

    At the begin of each round:
     - the map is as everything that is written leaves it, and the tip is at `at` (3,);
     - done[k]: segment k of the first path has been travelled where it is, so nothing of it is left;
     - a round after the first has made what the first path would still meet less, in volume or in its greatest depth
       (`had`), or the body is refused.  Each is bounded below, and MOST_LEVELS bounds the rounds.
    """

    def __init__(self, program: Program, ground: Ground, body: path_moves.Body, moved: Floats) -> None:
        self.program, self.ground, self.body = program, ground, body
        self.s = shift.along(body.points)
        self.done, self.at = unshifted(body.points, moved), moved[-1]
        self.count, self.had = 1, (math.inf, math.inf)
        self.written: list[Table] = []  # Tables of moves
        self.segments, self.feed = 0, 0.0  # how many, and their length

    def run(self, shifted: Callable[[path_moves.Body], Floats], whole: bool = False) -> None:
        """shifted: function of a Body -> its path (n, 3) in the stock as it is, which is cut; whole: the whole body
        each time.  Raises Unreadable."""
        window = self.ground.window(self.body.points)
        while not self.done.all():
            left, now = self._tried(window)
            less = now[0] < self.had[0] or now[1] < self.had[1]
            too_deep = now[1] > self.ground.tool.flutes + OVER_MM
            if not left.any() or not (less or too_deep):
                return
            for a, b in [(0, len(left))] if whole else self._parts(left):
                self._travel(a, b, shifted)
            self.count += 1
            if self.count > MOST_LEVELS or not less:
                raise Unreadable(
                    f"the flutes of tool {self.ground.tool.number} are too short, and shifting the path does not help",
                    "take a tool with longer flutes",
                    int(self.program.line[self.body.move[0]]),
                )
            self.had = now

    def _parts(self, left: Bools) -> list[tuple[int, int]]:
        """[(first, last)]: points of the segments that are travelled again; left (n - 1,) bool: where something is
        left."""
        ground, diameter = self.ground, self.ground.tool.shape.diameter
        return with_links(
            segments(left, self.s, ground.stock.cell, ground.radius), self.body.points, self.s, diameter, ground.links
        )

    def _travel(self, a: int, b: int, shifted: Callable[[path_moves.Body], Floats]) -> None:
        """The segment from point a to point b: the link to it, and its path."""
        part = path_moves.Body(self.body.points[a : b + 1], self.body.move[a:b], [], entered=True)
        link = self.ground.links.to_segment(self.at, part, self.body)  # in the stock as it is before the segment is cut
        path = shifted(part)
        self.done[a:b] |= unshifted(part.points, path)
        self.written += [Table.of(link(path[0, 2])), path_moves.moves_along(self.program, part, path)[0]]
        self.at = path[-1]
        self.segments += 1
        self.feed += length_of(path[~np.isnan(path[:, 2])])

    # ---- what is left ------------------------------------------------------------------------------------------------

    def _tried(self, window: Window) -> tuple[Bools, tuple[float, float]]:
        """((n - 1,) bool: where something is left, (volume mm3, greatest depth mm) that the first path would meet).
        The map is as before."""
        window.keep()
        met, left, deepest = self._first_path()
        if not left.any():
            left = self._left_bit_by_bit(met, window) & ~self.done
        window.restore()
        return left, (float(met["volume"].sum(dtype=np.float64)), deepest)

    def _first_path(self) -> tuple[Records, Bools, float]:
        """Cuts what has not been done of the first path; -> (MET records (n - 1,), (n - 1,) bool: where something is
        left, how deep it is)."""
        ground, points = self.ground, self.body.points
        places, goes, segment = path_moves.without(points, self.done, ground.stock.z_max + OVER_STOCK_MM)
        met = np.zeros(len(self.done), MET)
        met[segment[goes]] = ground.cut(places[0], places[1:])[goes]
        left, deepest = self._left(met), float(met["depth"].max())
        found = ground.proof.too_deep(ground.tool, places, goes & ~(left | self.done)[segment])
        if len(found):
            move = segment[found["move"]]
            left[move] = True
            deepest = max(deepest, float((found["height"] - points[move, 2]).max()))
        return met, left & ~self.done, deepest

    def _left(self, met: Records) -> Bools:
        """(n - 1,) bool: pieces that still meet material, more than the ridges between the model's steps."""
        cell, length = self.ground.stock.cell, np.sqrt((np.diff(self.body.points, axis=0) ** 2).sum(axis=1))
        share = met["volume"] / (cell * self.ground.tool.shape.diameter * np.maximum(length, 1e-9))
        return (met["depth"] > cell) | ((met["depth"] > LEFT_DEPTH * cell) & (share > LEFT_SHARE))

    def _left_bit_by_bit(self, met: Records, window: Window) -> Bools:
        """(n - 1,) bool: pieces that lower a cell, though each of them by little, which the proof would find too high
        without them."""
        points, reach = self.body.points, self.ground.radius + self.ground.piece
        left = np.zeros(len(points) - 1, bool)
        for place in window.left(LEFT_DEPTH * self.ground.stock.cell, self.ground.final()):
            left |= np.hypot(*(points[:-1, :2] - place).T) < reach
        return left & (met["volume"] > 0.0)


def length_of(points: Floats) -> float:
    """mm, of a path (n, 3)."""
    return float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum())


def unshifted(points: Floats, path: Floats) -> Bools:
    """(n - 1,) bool: segments of points (n, 3) that a path (n, 3) travels where they are: nothing is left of them."""
    here = path[:, 2] <= points[:, 2] + 1e-9  # a bridged point is NaN
    return here[:-1] & here[1:]
