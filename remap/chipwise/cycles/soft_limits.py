# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether the machine reaches a pattern: every point of every copy within the soft limits, before anything moves.
Pure; mm.

Called by cycles/pattern.py.  LinuxCNC checks the end of each move when it is queued, while the ones before it run
already, and not where an arc bulges: there it stops in the cut.

 1. A point is within the limits if each of its machine coordinates is, tool length included.
 2. A line is, if both of its ends are.  An arc is, if its ends are and the points of it where a coordinate is largest
    or smallest, and chords of it, which a tilted helix needs.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.errors import CycleError
from chipwise.pattern.isometry import Isometry, arc_extremes, arc_points
from chipwise.pattern.recorded import ARC

CHORD = 0.002  # mm; of a helix that is tilted
SLACK = 1e-6  # mm; positions are rounded to less


@dataclass(frozen=True)
class Travel:
    """matrix, shift: from work coordinates to positions of the axes; limits: (name, lowest, highest) of X, Y and Z;
    rotary: of A, B and C, and the work offset, degrees."""

    matrix: tuple
    shift: tuple
    limits: tuple
    rotary: tuple = ()

    def check(self, recorded, points, start, place: Isometry, copy: int):
        """Raise CycleError for the first point of a copy that is out of reach.

        points: of recorded (k, 3); start: before them; place: Isometry from the pattern to work coordinates; copy: from
        1.
        """
        onto = Isometry(self.matrix, self.shift).after(place)
        low, high = (np.array([limit[side] for limit in self.limits]) for side in (1, 2))
        ends = onto.points(points[recorded.ends])
        beyond = _beyond(ends, low, high).any(axis=1)
        for k in self._arcs_to_look_at(recorded, points, start, onto, (low, high)):
            before = start if k == 0 else points[recorded.ends[k - 1]]
            extremes = self._extremes(recorded.moves[k], before, points, recorded.ends[k], onto)
            outside = _beyond(extremes, low, high).any(axis=1)
            if outside.any() and not beyond[: k + 1].any():
                self._refuse(recorded.moves[k], extremes[int(np.argmax(outside))], copy)
        if beyond.any():
            k = int(np.argmax(beyond))
            self._refuse(recorded.moves[k], ends[k], copy)

    def check_turns(self, recorded, senses, copy: int):
        """Raise CycleError for the first angle that is beyond a limit; senses: of Isometry."""
        for k, (name, low, high, offset) in enumerate(self.rotary):
            for step in recorded.moves if k in recorded.turns else ():
                angle = senses[k] * step.abc[k] + offset
                if not low - SLACK <= angle <= high + SLACK:
                    where = f"line {step.source} of the sub" if step.source else "the sub"
                    raise CycleError(
                        f"{where}, copy {copy}: {name} would be at {angle:g} degrees, beyond its limit of "
                        f"{low if angle < low else high:g}",
                        "turn the work back before, or change the work offset",
                    )

    @staticmethod
    def _arcs_to_look_at(recorded, points, start, onto, limits):
        """Indexes of the arcs whose whole circle is not within the limits."""
        arcs = [k for k, step in enumerate(recorded.moves) if step.kind == ARC]
        if not arcs:
            return []
        at = recorded.ends[arcs]
        before = np.vstack([np.array(start)[None], points[recorded.ends]])[arcs]
        reach = (np.linalg.norm(points[at] - points[at + 1], axis=1) + np.linalg.norm(before - points[at + 1], axis=1))[
            :, None
        ]
        middle = onto.points(points[at + 1])
        far = (_beyond(middle - reach, *limits) | _beyond(middle + reach, *limits)).any(axis=1)
        return [arcs[i] for i in np.flatnonzero(far)]

    @staticmethod
    def _extremes(step, before, points, at, onto):
        """Points of an arc where one of the machine's coordinates is largest or smallest, on the machine: (n, 3)."""
        arc = before, points[at], points[at + 1], step.axis, step.turns
        return onto.points(np.vstack([arc_extremes(*arc, np.array(onto.matrix)), arc_points(*arc, CHORD)]))

    def _refuse(self, step, point, copy):
        """Raise the error of a point that is beyond a limit."""
        for (name, low, high), value in zip(self.limits, point.tolist()):
            if not low - SLACK <= value <= high + SLACK:
                where = f"line {step.source} of the sub" if step.source else "the sub"
                raise CycleError(
                    f"{where}, copy {copy}: {name} would be at {{value}}, beyond its limit of {{limit}}",
                    "shift the pattern or the work offset",
                    value=value,
                    limit=low if value < low else high,
                )


def _beyond(points, low, high):
    return (points < low - SLACK) | (points > high + SLACK)
