# SPDX-License-Identifier: GPL-2.0-or-later
"""What a sub does when it runs: straight moves, arcs, and codes between them.  mm, mm/min, work coordinates.

Made by run.py from what runner.py prints; transformed by isometry.py.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

RAPID, FEED, ARC = "rapid", "feed", "arc"
AXIS_OF_PLANE = {"G17": 2, "G18": 1, "G19": 0}      # the axis an arc of that plane turns about
PLANE_OF_AXIS = {axis: plane for plane, axis in AXIS_OF_PLANE.items()}


@dataclass(frozen=True)
class Step:
    """One move.

    kind     RAPID, FEED or ARC
    line     of the file that holds the sub, 0 if it is another file's
    end      (x, y, z)
    feed     of a cutting move
    centre   (x, y, z) of an arc, at the height of its start along the axis it turns about
    axis     index of that axis
    turns    of an arc: started turns, negative for clockwise about the axis
    own      of a cut that the sub programs itself: its line in the file of the sub; 0 of a traverse or a cycle
    source   line of the file that the interpreter has read it from, 0 if not known
    """

    kind: str
    line: int
    end: tuple
    feed: float = 0.0
    centre: tuple = ()
    axis: int = 2
    turns: int = 0
    own: int = 0
    source: int = 0


@dataclass(frozen=True)
class Code:
    """A line that moves nothing, as "M3 S8000" or "G4 P0.5"."""

    text: str
    line: int = 0


@dataclass(frozen=True)
class Recorded:
    """steps: of Step and Code, in order; messages: what the sub has for the operator; start: (x, y, z) of the run."""

    steps: tuple
    messages: tuple
    start: tuple

    @cached_property
    def moves(self):
        """The Steps alone."""
        return [step for step in self.steps if isinstance(step, Step)]

    @cached_property
    def points(self):
        """All ends and centres in order: (k, 3)."""
        points = []
        for step in self.moves:
            points += [step.end, step.centre] if step.kind == ARC else [step.end]
        return np.array(points, float).reshape(-1, 3)

    @cached_property
    def ends(self):
        """Index of each move's end in points: (moves,)."""
        widths = [2 if step.kind == ARC else 1 for step in self.moves]
        return np.cumsum([0, *widths[:-1]])

    @cached_property
    def own_cut(self):
        """Line of the first cut across that no cycle makes, 0 without one."""
        before = [self.start, *(step.end for step in self.moves)]
        return next((step.own for step, was in zip(self.moves, before) if step.own and (step.kind == ARC or step.end[:2] != was[:2])), 0)

    @cached_property
    def cuts(self):
        """Which moves cut: (moves,)."""
        return np.array([step.kind != RAPID for step in self.moves], bool)
