# SPDX-License-Identifier: GPL-2.0-or-later
"""What the glue asks the planner for, and what it gets: plain values, to be sent between processes."""

import pickle
from dataclasses import dataclass
from typing import Any, Iterable, Iterator, Optional, Union

from chipwise.gcode_lines import AXES


@dataclass(frozen=True)
class Order:
    """A cycle to be planned.

    cycle       "hole", "contour" or "pocket": a function of planner/plans.py
    code        "G13", for messages
    fields      fields of the cycle's request, mm; without its shape
    job         contour_sub.job.Job of the contour sub, None where the cycle has none
    unit        "mm" or "in": the program's; unit_mm: mm of it
    start       (x, y, z) mm, of the tool
    memory_mb   how much memory the plan may take
    report      whether somebody wants the report
    targets     whether somebody wants the contour
    clamps      ClampsAsked: where the planner finds the clamps, None: the cycle knows none
    axes        letters of the machine's axes, of X Y Z A B C
    """

    cycle: str
    code: str
    fields: dict
    unit: str
    unit_mm: float
    start: tuple
    memory_mb: int
    job: Any = None
    report: bool = False
    targets: bool = False
    clamps: Optional["ClampsAsked"] = None
    axes: str = AXES


@dataclass(frozen=True)
class ClampsAsked:
    """Where the planner finds the clamps that a cycle keeps clear of (planner/program_clamps.py).

    set_up      number of M256, 0: none; file: path of the set-ups
    program     path of the program that runs, "" without one; line: the one that is executed; since: the one of its
                last M256, 0: none
    ini, jobs   path of the INI file, folder of the job files
    now         (units, coordinate system, fields of a program.records.Frame) in force
    systems     fields of a Frame for each of the nine coordinate systems, as LinuxCNC's table has them
    clearance   mm; limits: as in cycles.obstacles.Obstacles
    diameter    mm, of the tool, 0: not known; geometry: path of [CHIPWISE]TOOL_GEOMETRY, number of the tool
    """

    set_up: int
    file: str
    program: str
    line: int
    since: int
    ini: str
    jobs: str
    now: tuple
    systems: tuple
    clearance: float
    diameter: float
    geometry: tuple
    limits: Any = None


@dataclass(frozen=True)
class MapPlace:
    """Where the planner finds the stock as it stands: field "map" of a pocket that starts from it.

    key     of the shared memory with the tracker's map
    origin  (x, y, z) of the work coordinates, mm, machine coordinates
    turn    rad: of the work coordinates
    """

    key: int
    origin: tuple
    turn: float


class Packed:
    """Chunks as the planner sends them to the task, each pickled for itself: the task takes one apart when it executes
    it.

    A plan may have 500,000 rows.  To make them all at once would keep the task from serving Stop for a third of a
    second and more.
    """

    def __init__(self, chunks: Iterable[tuple]) -> None:
        self._packed = tuple(pickle.dumps(chunk) for chunk in chunks)

    def __iter__(self) -> Iterator[tuple]:
        return map(pickle.loads, self._packed)

    def __len__(self) -> int:
        return len(self._packed)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, (tuple, Packed)) and tuple(self) == tuple(other)


@dataclass(frozen=True)
class Outcome:
    """A cycle that is planned.

    chunks     lines.chunks(): what to execute; between two of them the tool may rest
    turning    turning.blocks.Turning for glue/turning.py, of G26 and G27
    messages   for the operator
    report     (kind, figures) for report.record(), None if nobody wants it
    targets    loops of points (x, y, z), mm, work coordinates: the contour, at the depth of the cycle; () if nobody
               wants it
    """

    chunks: Union[tuple, Packed]
    messages: tuple = ()
    report: Optional[tuple] = None
    turning: Any = None
    targets: tuple = ()
