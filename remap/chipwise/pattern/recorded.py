# SPDX-License-Identifier: GPL-2.0-or-later
"""What a sub does when it runs: straight moves, arcs, threads, and codes between them.  mm, mm/min, degrees, work
coordinates.

Made by run.py from what runner.py prints; transformed by isometry.py.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Optional

import numpy as np

RAPID, FEED, ARC, THREAD = "rapid", "feed", "arc", "thread"
AXIS_OF_PLANE = {"G17": 2, "G18": 1, "G19": 0}  # the axis an arc of that plane turns about
SAME_DEGREES = 1e-9  # rounding of the interpreter
PLANE_OF_AXIS = {axis: plane for plane, axis in AXIS_OF_PLANE.items()}


@dataclass(frozen=True)
class Step:
    """One move.

    kind     RAPID, FEED, ARC or THREAD: in step with the spindle (G33, the passes of G76)
    line     of the file that holds the sub, 0 if it is another file's
    end      (x, y, z)
    feed     of a cutting move
    centre   (x, y, z) of an arc, at the height of its start along the axis it turns about
    axis     index of that axis
    turns    of an arc: started turns, negative for clockwise about the axis
    own      of a cut that the sub programs itself: its line in the file of the sub; 0 of a traverse or a cycle
    source   line of the file that the interpreter has read it from, 0 if not known
    abc      (A, B, C) at its end, of a sub that turns an axis; None of all others
    pitch    of a thread: mm of its path per revolution
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
    abc: Optional[tuple] = None
    pitch: float = 0.0


@dataclass(frozen=True)
class Code:
    """A line that moves nothing, as "M3 S8000", "G4 P0.5" or "G64 P0.02"."""

    text: str
    line: int = 0


@dataclass(frozen=True)
class Recorded:
    """steps: of Step and Code, in order; messages: what the sub has for the operator; start: (x, y, z) of the run; abc:
    (A, B, C) of its start; path: whether it sets the path mode (G61, G64)."""

    steps: tuple
    messages: tuple
    start: tuple
    abc: tuple = (0.0, 0.0, 0.0)
    path: bool = False

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
        return next(
            (
                step.own
                for step, was in zip(self.moves, before)
                if step.own and (step.kind == ARC or step.end[:2] != was[:2])
            ),
            0,
        )

    @cached_property
    def turns(self):
        """The axes it turns: {index of A, B or C: the first Step that does}."""
        found = {}
        for step in self.moves:
            for k, (now, was) in enumerate(zip(step.abc or (), self.abc)):
                if abs(now - was) > SAME_DEGREES:
                    found.setdefault(k, step)
        return found

    @cached_property
    def thread(self):
        """The first thread, None without one."""
        return next((step for step in self.moves if step.kind == THREAD), None)

    @cached_property
    def cuts(self):
        """Which moves cut: (moves,)."""
        return np.array([step.kind != RAPID for step in self.moves], bool)
