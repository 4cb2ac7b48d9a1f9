# SPDX-License-Identifier: GPL-2.0-or-later
"""The moves of one sub at many places: those of the first are computed one by one (isometry.py), later ones as arrays
of numbers.  Pure; mm.

Called by cycles/pattern.py.  Two places have the same moves, with other numbers, if the isometry makes the same of the
axes X, Y and Z: then arcs turn alike in the same planes, and rotary axes turn in the same sense.  Arcs that become
chords are computed one by one everywhere.
"""

import numpy as np

from chipwise.moves import Copy, Move
from chipwise.pattern.isometry import Isometry, moved
from chipwise.pattern.recorded import ARC, Recorded, Step


class Copier:
    """Places a sub again and again; chord: as in isometry.moved()."""

    def __init__(self, chord: float) -> None:
        self._chord = chord
        self._recorded: Recorded | None = None
        self._places: dict = {}  # (axes, mirrors) of an isometry: moves at the first of its places
        self._rows = np.zeros((0, 2), int)

    def moves(self, recorded: Recorded, points, start, isometry: Isometry) -> list:
        """The moves of a sub under an isometry, or the Copy that they are; recorded, points, start: as in
        isometry.moved()."""
        if recorded is not self._recorded:
            self._recorded, self._places, self._rows = recorded, {}, _rows_of(recorded)
        key = isometry.axes, isometry.mirrors
        if key in self._places:
            images = isometry.points(points)
            return [Copy(self._places[key], images[self._rows].reshape(-1, 6))]
        found: list[Move] = moved(recorded, points, start, isometry, self._chord)
        if all(isometry.axes[step.axis] for step in recorded.moves if step.kind == ARC):
            self._places[key] = tuple(found)
        return found


def _rows_of(recorded):
    """Of each step: the rows of Recorded.points with its end and its centre (steps, 2); of a step without one any
    row."""
    rows, at = np.zeros((len(recorded.steps), 2), int), 0
    for k, step in enumerate(recorded.steps):
        if isinstance(step, Step):
            rows[k] = at, at + (step.kind == ARC)
            at += 2 if step.kind == ARC else 1
    return rows
