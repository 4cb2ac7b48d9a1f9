# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves of a program against clamps: which come nearer to one than CLAMP_CLEARANCE.  Those of CLAMP comments, of the
set-up of M256, and of the set-up that is confirmed for the program.  Called by simulate.py.  mm, machine coordinates of
the tip.

The machine may stand anywhere before X, Y and Z are named: moves up to there are not judged, the one that comes to the
first place at its end only, or, if it goes straight down, from above.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from chipwise.program import records
from chipwise.check.findings import CLAMP, Finding
from chipwise.clib.height_map import Shape
from chipwise.clamps import set_ups
from chipwise.clamps.clamp import Clamp
from chipwise.clamps.distance import bodies, near

if TYPE_CHECKING:
    from chipwise.clib.arrays import Floats
    from chipwise.check.simulate import Simulation
    from chipwise.settings import Settings
    from chipwise.program.records import Frame

SLACK_MM = 1e-6  # of the clearance
NO_TOOL = Shape(0.0)  # of which only the axis is known


class Job(Protocol):
    """What a check uses of the set-up of a program (setup/job.py)."""

    @property
    def material(self) -> str: ...

    def obstacles(self, path: str, frame: Frame) -> tuple[Clamp, ...]: ...


@dataclass(frozen=True)
class Contact:
    """A move that comes too near to a clamp.  part: of the tool; move: its record; place (3,): mm, where it is nearest;
    distance: mm, there."""

    clamp: Clamp
    part: str
    move: Floats
    place: Floats
    distance: float


class Clamps:
    """Those in force, of a program under way."""

    def __init__(self, settings: Settings, job: Job | None = None) -> None:
        """job: setup/job.py's, None: without one."""
        self._job = job
        self._of_job: tuple[Clamp, ...] = ()
        self._clearance, self._file = settings["CLAMP_CLEARANCE"], settings.path("CLAMPS")
        self._clamps: list[Clamp] = []
        self._open: dict[tuple[Clamp, str, int], tuple[int, Finding]] = {}  # number of the last move, what it is in
        self._place: Floats | None = None  # (3,), None before the first move
        self._length, self._moves = np.zeros(3), 0

    def take_event(self, kind: int, line: int, values: list[float]) -> None:
        """A CLAMP or CLAMP_SET_UP record.  Raises CycleError for a set-up that the file does not have."""
        if kind == records.CLAMP_SET_UP:
            self._job = None  # M256 of the program wins
            self._clamps = list(set_ups.clamps_of(self._file, int(values[0]))) if values[0] else []
            return
        shape, turn, *corners = values[:8]
        self._clamps.append(
            Clamp(int(shape), turn, tuple(corners[:3]), tuple(corners[3:]), f"the clamp of line {line}")
        )

    def set_length(self, length: Floats) -> None:
        """Another tool length is in force: the machine stays, the tip is elsewhere.  length (3,)."""
        if self._place is not None:
            self._place = self._place + self._length - length
        self._length = length

    def take(self, block: Floats, known: int, from_above: bool | None, simulation: Simulation) -> None:
        """Moves (n, WIDTH), of which those from `known` on are judged.  from_above: whether the first of these is
        judged straight down to its end, or at its end (False), None: from its start.  simulation: has tool, shape,
        frame, segments, and the findings of its result."""
        if self._job and len(block):
            self._of_job, self._job = self._job.obstacles(self._file, simulation.frame), None
            self._clamps[:0] = self._of_job
        ends = block[:, 2:5]
        starts = np.concatenate(((ends if self._place is None else self._place[None])[:1], ends[:-1]))
        self._place, before = ends[-1].copy(), self._moves
        self._moves += len(block)
        if not self._clamps or known >= len(block):
            return
        if from_above is not None:
            starts[known] = ends[known]
            if from_above:
                starts[known, 2] = max(ends[known, 2], *(clamp.top + 2 * self._clearance for clamp in self._clamps))
        for clamp in self._clamps:
            for body in bodies(simulation.shape or NO_TOOL):
                index, distance, share = near(clamp, body, starts[known:], ends[known:], self._clearance - SLACK_MM)
                for k, far, s in zip((index + known).tolist(), distance.tolist(), share):
                    place = starts[k] + s * (ends[k] - starts[k])
                    self._find(Contact(clamp, body.name, block[k], place, far), before + k, simulation)

    def notes(self) -> list[list[int | str]]:
        """[[line, text]] of the clamps of the set-up."""
        return (
            [[0, f"the clamps of its set-up count: {', '.join(clamp.name for clamp in self._of_job)}"]]
            if self._of_job
            else []
        )

    def _find(self, contact: Contact, number: int, simulation: Simulation) -> None:
        """One move; number: of it, so that moves that follow one another are one finding."""
        tool, clamp, place = simulation.tool, contact.clamp, contact.place
        line, rapid = int(contact.move[1]), int(contact.move[0]) == records.RAPID
        flutes = tool and tool.geometry and tool.geometry.flute_length
        part = contact.part
        if part == "tool" and flutes and place[2] + flutes <= clamp.bottom:
            part = "shank"
        finding = Finding(
            CLAMP,
            line,
            line,
            tool.number if tool else 0,
            tuple(map(float, simulation.frame.to_work(place))),
            contact.distance,
            self._clearance,
            1,
            simulation.segments,
            tuple(map(float, place)),
            subject=f"{'a traverse' if rapid else 'a feed'} of the {part}",
            clamp=clamp.name,
        )
        key = clamp, finding.subject, finding.tool
        last, other = self._open.get(key, (-2, finding))
        if number == last + 1:
            other.line, other.last_line = min(other.line, line), max(other.last_line, line)
            other.segments += 1
            if finding.is_worse(other):
                other.value, other.position, other.machine = finding.value, finding.position, finding.machine
            finding = other
        else:
            simulation.result.findings.add(finding)
        self._open[key] = number, finding
