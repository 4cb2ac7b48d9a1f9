# SPDX-License-Identifier: GPL-2.0-or-later
"""The moves of a planned cycle against the clamps in force: a cycle that comes too near to one is refused before it moves.

Made by glue/clamps.py, called by planner/plans.py.  mm, work coordinates.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.clib.height_map import Shape
from chipwise.clamps.distance import bodies, near
from chipwise.errors import CycleError, format_place
from chipwise.moves import Arc, Blend, Code, Copy, PlaneArc, Rapid
from chipwise.pattern.isometry import arc_points

CHORD = 0.002               # mm, of arcs
SLACK_MM = 1e-6             # of the clearance
_ABOUT = {"G17": 2, "G18": 1, "G19": 0}


@dataclass(frozen=True)
class Obstacles:
    """clamps: Clamps in work coordinates; clearance: mm; tool: Shape of the one in the spindle."""

    clamps: tuple
    clearance: float
    tool: Shape

    def refuse(self, moves, start, unit):
        """Raise CycleError for the one of the moves, from start (3,) on, that comes nearest to a clamp, and nearer than the clearance.  unit: "mm" or "in"."""
        places, kinds = _path(moves, start)
        worst = None
        for clamp in self.clamps:
            for body in bodies(self.tool):
                index, distance, share = near(clamp, body, places[:-1], places[1:], self.clearance - SLACK_MM)
                if len(index) and (worst is None or distance.min() < worst[0]):
                    one = int(distance.argmin())
                    k = int(index[one])
                    worst = float(distance[one]), k, clamp, body, places[k] + share[one] * (places[k + 1] - places[k])
        if worst:
            distance, k, clamp, body, place = worst
            what = f"a {'traverse' if kinds[k] else 'cut'} of the {body.name}"
            x, y, z = format_place(place.round(3), unit).split()
            if distance > 0:
                raise CycleError(f"{what} comes within {{d}} of {clamp.name} at X{x} Y{y} Z{z}, CLAMP_CLEARANCE is {{c}}", "move the clamp or the cut, or use a higher R",
                                 d=distance, c=self.clearance)
            raise CycleError(f"{what} meets {clamp.name} at X{x} Y{y} Z{z}", "move the clamp or the cut, or use a higher R")


def _path(moves, start):
    """Moves -> (places (n + 1, 3) from start on, with chords for arcs; whether each of the n is a traverse)."""
    here, found, kinds = tuple(start), [np.array([start], float)], []

    def add(move, end, centre):
        nonlocal here
        points = np.array([end], float)
        if centre is not None:
            axis = _ABOUT[move.plane] if isinstance(move, PlaneArc) else 2
            points = arc_points(here, end, centre, axis, move.turns if move.ccw else -move.turns, CHORD)
        found.append(points)
        kinds.extend([isinstance(move, Rapid)] * len(points))
        here = tuple(end)
    for move in moves:
        if isinstance(move, Copy):
            for own, row in zip(move.moves, move.places):
                if not isinstance(own, (Code, Blend)):
                    add(own, tuple(row[:3]), tuple(row[3:]) if isinstance(own, (Arc, PlaneArc)) else None)
        elif not isinstance(move, (Code, Blend)):
            end = tuple(old if new is None else new for new, old in zip((move.x, move.y, move.z), here))
            centre = (move.cx, move.cy, here[2]) if isinstance(move, Arc) else tuple(move.centre) if isinstance(move, PlaneArc) else None
            add(move, end, centre)
    return np.concatenate(found), kinds
