# SPDX-License-Identifier: GPL-2.0-or-later
"""The moves of a planned cycle against the clamps in force: its traverses are led over or round them, and a cycle that
comes too near to one all the same is refused before it moves.

Made by planner/program_clamps.py; planner/plans.py asks it.  mm, work coordinates.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from chipwise.clib.height_map import Shape
from chipwise.clamps.distance import bodies, near
from chipwise.cycles.detour import BLEND_MM, Detour
from chipwise.errors import CycleError, format_place
from chipwise.moves import PATH, Arc, Blend, Code, Copy, PlaneArc, Rapid
from chipwise.pattern.isometry import arc_points

CHORD = 0.002  # mm, of arcs
SLACK_MM = 1e-6  # of the clearance
_ABOUT = {"G17": 2, "G18": 1, "G19": 0}


@dataclass(frozen=True)
class Obstacles:
    """clamps: Clamps in work coordinates; clearance: mm; tool: Shape of the one in the spindle; limits: fields of a
    cycles.soft_limits.Travel, None: not known."""

    clamps: tuple
    clearance: float
    tool: Shape
    limits: Any = None

    def clear(self, moves, start, unit, plane=None, keep=False):
        """The moves from start (3,) on, with traverses that keep clear of the clamps.  plane: height from which on a
        traverse meets no stock, None: of the highest traverse; keep: traverses stay above the path they have, if that
        is possible.  Raises CycleError as refuse()."""
        if not self._touching(*_path(moves, start)[0::2]):
            return moves
        moves = tuple(one for move in moves for one in (_singly(move) if isinstance(move, Copy) else (move,)))
        places, _kinds, owners = _path(moves, start)
        near_moves = {k for _d, k, *_ in self._touching(places, owners)}
        if plane is None:
            plane = max((move.z for move in moves if isinstance(move, Rapid) and move.z is not None), default=start[2])
        found = tuple(_Links(self, start, plane, keep, unit).followed(moves, near_moves))
        self.refuse(found, start, unit)
        return found

    def _touching(self, places, owners):
        """[(mm, index of the move, index of the chord, Clamp, Body, place)] of what comes too near."""
        found = []
        for clamp in self.clamps:
            for body in bodies(self.tool):
                index, distance, share = near(clamp, body, places[:-1], places[1:], self.clearance - SLACK_MM)
                for k, d, s in zip(index.tolist(), distance.tolist(), share):
                    found.append((d, owners[k], k, clamp, body, places[k] + s * (places[k + 1] - places[k])))
        return found

    def refuse(self, moves, start, unit):
        """Raise CycleError for the one of the moves, from start (3,) on, that comes nearest to a clamp, and nearer than
        the clearance.  unit: "mm" or "in"."""
        places, kinds, owners = _path(moves, start)
        found = self._touching(places, owners)
        if found:
            distance, _move, k, clamp, body, place = min(found, key=lambda one: one[0])
            what = f"a {'traverse' if kinds[k] else 'cut'} of the {body.name}"
            x, y, z = format_place(place.round(3), unit).split()
            if distance > 0:
                raise CycleError(
                    f"{what} comes within {{d}} of {clamp.name} at X{x} Y{y} Z{z}, CLAMP_CLEARANCE is {{c}}",
                    "move the clamp or the cut, or use a higher R",
                    d=distance,
                    c=self.clearance,
                )
            raise CycleError(
                f"{what} meets {clamp.name} at X{x} Y{y} Z{z}", "move the clamp or the cut, or use a higher R"
            )


class _Links:
    """Goes through the moves of a plan and puts other traverses in place of some."""

    def __init__(self, obstacles, start, plane, keep, unit):
        self.here, self.plane, self.keep, self.unit = tuple(map(float, start)), plane, keep, unit
        self.detour = Detour(obstacles.clamps, obstacles.clearance, obstacles.tool, obstacles.limits)
        self.mode, self.abc = Blend(None), None

    def followed(self, moves, near_moves):
        """The moves; near_moves: indexes of those that come too near to a clamp."""
        k = 0
        while k < len(moves):
            end = k
            while end < len(moves) and isinstance(moves[end], Rapid) and moves[end].abc == self.abc:
                end += 1
            if end == k:
                end = k + 1
                yield moves[k]
            else:
                yield from self._link(moves[k:end]) if near_moves.intersection(range(k, end)) else moves[k:end]
            for move in moves[k:end]:
                self._pass(move)
            k = end

    def _pass(self, move):
        if isinstance(move, Blend) or isinstance(move, Code) and move.text.startswith(PATH):
            self.mode = move
        elif not isinstance(move, Code):
            self.here, self.abc = _end(move, self.here), move.abc

    def _link(self, run):
        """Traverses in place of those of a run."""
        places = [self.here]
        for move in run:
            places.append(_end(move, places[-1]))
        start, end = places[0], places[-1]
        if not (self.detour.is_free(start) and self.detour.is_free(end)):
            return run  # refuse() names it
        along = [place[:2] for place in places[1:-1]] if self.keep else None
        route = self.detour.route(start, end, max(self.plane, *(place[2] for place in places)), along)
        if route is None:
            x, y, z = format_place(np.round(end, 3), self.unit).split()
            raise CycleError(
                f"no traverse leads past the clamps to X{x} Y{y} Z{z} within the limits of the axes",
                "move a clamp, or use a shorter tool",
            )
        line = run[-1].line
        return (Blend(BLEND_MM, line), *(Rapid(*place, line, self.abc) for place in route), self.mode)


def _end(move, here):
    """(x, y, z) where a move that begins at here ends."""
    return tuple(old if new is None else float(new) for new, old in zip((move.x, move.y, move.z), here))


def _singly(copy):
    """The moves of a Copy, each for itself."""
    for move, row in zip(copy.moves, copy.places.tolist()):
        if isinstance(move, PlaneArc):
            move = replace(move, end=tuple(row[:3]), centre=tuple(row[3:]))
        elif isinstance(move, Arc):
            move = replace(move, x=row[0], y=row[1], z=row[2], cx=row[3], cy=row[4])
        elif not isinstance(move, (Code, Blend)):
            move = replace(move, x=row[0], y=row[1], z=row[2])
        yield move


def _path(moves, start):
    """Moves -> (places (n + 1, 3) from start on, with chords for arcs; whether each of the n is a traverse, index of
    its move)."""
    here, found, kinds, owners = tuple(start), [np.array([start], float)], [], []

    def add(k, move, end, centre):
        nonlocal here
        points = np.array([end], float)
        if centre is not None:
            axis = _ABOUT[move.plane] if isinstance(move, PlaneArc) else 2
            points = arc_points(here, end, centre, axis, move.turns if move.ccw else -move.turns, CHORD)
        found.append(points)
        kinds.extend([isinstance(move, Rapid)] * len(points))
        owners.extend([k] * len(points))
        here = tuple(end)

    for k, move in enumerate(moves):
        if isinstance(move, Copy):
            for own, row in zip(move.moves, move.places):
                if not isinstance(own, (Code, Blend)):
                    add(k, own, tuple(row[:3]), tuple(row[3:]) if isinstance(own, (Arc, PlaneArc)) else None)
        elif not isinstance(move, (Code, Blend)):
            end = tuple(old if new is None else new for new, old in zip((move.x, move.y, move.z), here))
            centre = (
                (move.cx, move.cy, here[2])
                if isinstance(move, Arc)
                else tuple(move.centre)
                if isinstance(move, PlaneArc)
                else None
            )
            add(k, move, end, centre)
    return np.concatenate(found), kinds, owners
