# SPDX-License-Identifier: GPL-2.0-or-later
"""How far a program feeds, and how far it takes the axes, against their soft limits, with the work offset and the tool
lengths that are in force.

Called by simulate.py; the limits count if the machine of the user is named.  LinuxCNC refuses a move that ends beyond a
limit (machine/limits.py).  mm, machine coordinates.

While all numbers of the work offset are 0 the operator still has to touch off: what goes too far is a note then, unless
the program goes farther than the axis at any offset.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chipwise.check.findings import LIMIT, Finding, known
from chipwise.errors import format_length

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats
    from chipwise.check.findings import Findings
    from chipwise.program.records import Frame

SLACK_MM = 1e-3  # of a limit


class Extents:
    """How far the tip goes in feed moves: take(), then corners().  In the work coordinates of the first of them."""

    def __init__(self) -> None:
        self._frame: Frame | None = None
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)

    def take(self, feeds: Bools, start: Floats, places: Floats, frame: Frame) -> None:
        """Moves from start (3,) along places (n, 3), mm; feeds (n,) bool: which count; frame: records.Frame."""
        if feeds.any():
            first = self._frame = self._frame or frame
            ends = np.append(feeds, False) | np.append(False, feeds)  # of start and places: where a feed begins or ends
            work = np.column_stack(first.to_work(np.concatenate((start[None], places))[ends].T))
            self._low, self._high = np.minimum(self._low, work.min(axis=0)), np.maximum(self._high, work.max(axis=0))

    def corners(self) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
        """(low, high) mm; None without any."""
        return (tuple(self._low.tolist()), tuple(self._high.tolist())) if self._frame else None


class Travel:
    """A program under way.  limits: machine.limits.axis_limits()."""

    def __init__(self, limits: tuple[tuple[str, float, float], ...]) -> None:
        self._limits = [(low, high) for _name, low, high in limits]
        self.length = np.zeros(3)  # of the tool in force
        self._ends: dict[tuple[int, int], Finding] = {}  # by axis and side
        self._untouched = True

    def take(self, block: Floats, frame: Frame, tool: int, segments: int) -> None:
        """Moves (n, WIDTH) of the tip.  frame: records.Frame; segments: before them."""
        self._untouched = self._untouched and not any((*frame.offset, *frame.g92))
        places = block[:, 2:5] + self.length
        for axis, ends in enumerate(((places[:, k].argmin(), places[:, k].argmax()) for k in range(3))):
            for side, index in enumerate(ends):
                place, had = float(places[index, axis]), self._ends.get((axis, side))
                if had is None or (place > known(had.value) if side else place < known(had.value)):
                    line = int(block[index, 1])
                    work, machine = (
                        tuple(map(float, p)) for p in (frame.to_work(block[index, 2:5]), block[index, 2:5])
                    )
                    self._ends[axis, side] = Finding(
                        LIMIT,
                        line,
                        line,
                        tool,
                        work,
                        place,
                        self._limits[axis][side],
                        1,
                        segments + int(index),
                        machine,
                        "XYZ"[axis],
                    )

    def finish(self, findings: Findings, notes: list[list[int | str]], unit: str) -> None:
        """Add what goes too far to findings.Findings or to notes."""
        for axis in range(3):
            if (axis, 0) not in self._ends:
                continue
            low, high = self._limits[axis]
            lowest, highest = (self._ends[axis, side] for side in (0, 1))
            first, last = known(lowest.value), known(highest.value)
            beyond = [one for one, over in ((lowest, low - first), (highest, last - high)) if over > SLACK_MM]
            if not beyond:
                continue
            if self._untouched and last - first <= high - low + SLACK_MM:
                notes.append(
                    [
                        beyond[0].line,
                        f"{self._said(axis, first, last, unit)}, and no work offset is set: touch off before you run "
                        f"it",
                    ]
                )
            else:
                for one in beyond:
                    findings.add(one)

    def _said(self, axis: int, first: float, last: float, unit: str) -> str:
        low, high, lowest, highest = (
            format_length(round(value, 3), unit) for value in (*self._limits[axis], first, last)
        )
        return f"{'XYZ'[axis]} goes from {lowest} to {highest} in machine coordinates, its limits are {low} and {high}"
