# SPDX-License-Identifier: GPL-2.0-or-later
"""Judges one program: reads it, assumes what it does not name, and simulates it (simulate.py), again where that is
needed -> Result.

Called by run.py and setup/measure.py.
"""

from __future__ import annotations

import contextlib
import copy
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from chipwise.program import post_comments
from chipwise.check.assume import Assumption, Named, Unknown, assume, compare, halves, surveyed
from chipwise.check import extra_needles
from chipwise.check import rules
from chipwise.check.findings import MACHINE, Finding
from chipwise.program.program_file import TOOL, UNCHECKED, Lacking, Missing, Unfinished, Unreadable
from chipwise.program.reader import CPU_S, LENGTHS, Reader
from chipwise.check.result import Result
from chipwise.check.simulate import Case, Simulation, TooCoarse
from chipwise.errors import CycleError, unnamed
from chipwise.settings import load_settings
from chipwise.tool_data.geometry import load_tools

if TYPE_CHECKING:
    from chipwise.check.assume import Progress
    from chipwise.check.clamps import Job
    from chipwise.clib.arrays import Corners, Floats
    from chipwise.program.reader import Machine
    from chipwise.settings import Settings

MOST_LACKING = 50  # tools and axes that a machine lacks


@dataclass(frozen=True)
class Checking:
    """How a program is checked."""

    stock: Corners | None = None  # (low, high), mm in work coordinates
    cell: float | None = None  # mm, None: [CHIPWISE]CELL; smaller where a tool needs it
    cpu_s: float = CPU_S  # of computing time
    limits: dict = field(default_factory=dict)  # of its Reader, besides cpu_s
    assumes: bool = False  # whether a stock and tools that the program does not name are assumed
    tool: int | None = None  # then: of the one in the spindle at the beginning
    diameter: float | None = None  # mm, of that tool
    completes: bool = (
        False  # whether it is judged on a machine that lacks its tools or rotary axes, which is a finding then
    )
    simulated: Callable[[Case, float, dict[int, Floats]], Simulation] = Simulation  # makes it of its arguments
    confirmed: Callable[[str, Settings], Job | None] | None = (
        None  # of program and settings: the setup/job.py Job of its set-up or None
    )


def check(
    program: str, machine: Machine, stock: Corners | None = None, progress: Progress | None = None, **options: Any
) -> Result:
    """Result of one program.

    machine: reader.Machine; progress: called with the number of the line that is being simulated; stock, options: the
    fields of a Checking.
    """
    how = Checking(stock, **options)
    try:
        try:
            return _Check(program, machine, how, progress).result()
        except Lacking as error:
            if not how.completes:
                raise
            machine, lacks = completed(program, machine, error, how)
            result = _Check(program, machine, how, progress).result()
            result.findings.kept[:0] = lacks
            return result
    except Unreadable as error:
        result = Result(program, error=(str(error), error.line), state=error.state, unit=machine.unit)
        if isinstance(error, Unknown):
            result.survey(error.survey)
        return result
    except CycleError as error:
        return Result(program, error=(unnamed(error.text()), 0), state=UNCHECKED)


def completed(program: str, machine: Machine, error: Lacking, how: Checking) -> tuple[Machine, list[Finding]]:
    """-> (a Machine with the tools and rotary axes for lack of which LinuxCNC refuses the program, [Finding] of each).
    error: the first Lacking."""
    found: list[Finding] = []
    lacks: Lacking | None = error
    while lacks:
        machine, is_tool = copy.copy(machine), lacks.kind == TOOL
        if is_tool:
            machine.added = (*machine.added, lacks.name)
        else:
            machine.axis_mask |= 1 << LENGTHS.index(lacks.name)
        found.append(
            Finding(MACHINE, lacks.line, lacks.line, lacks.name if is_tool else 0, axis="" if is_tool else lacks.name)
        )
        lacks = _lacking(program, machine, how) if len(found) < MOST_LACKING else None
    return machine, found


def _lacking(program: str, machine: Machine, how: Checking) -> Lacking | None:
    """The Lacking with which LinuxCNC refuses a program, or None."""
    try:
        with Reader(program, machine, cpu_s=how.cpu_s, judged=False, **how.limits) as reader:
            for _block in reader:
                pass
    except Lacking as error:
        return error
    except (Unreadable, CycleError):
        pass  # who judges it says so
    return None


class _Check:
    """One program on one machine; how: a Checking."""

    def __init__(self, program: str, machine: Machine, how: Checking, progress: Progress | None) -> None:
        self.program, self.machine = program, machine
        self.how, self.progress = how, progress

    def result(self) -> Result:
        """The Result of check().  Raises Unreadable, CycleError."""
        program, machine = self.program, self.machine
        how = self.how
        job = how.confirmed(program, load_settings(machine.ini)) if how.confirmed else None
        try:
            result = self._judged(how.stock, self.progress, None, job)
            if how.assumes:
                _compare_comments(program, machine, result)
            return result
        except Missing as error:
            if not how.assumes or not machine.has_y:  # a lathe's program has no stock that a mill could cut
                raise
            first, second = halves(self.progress)
            assumption = assume(
                surveyed(self._read(None), machine, first),
                program,
                machine,
                error.line,
                Named(bool(how.stock), how.tool, how.diameter),
            )
            stock = (assumption.low, assumption.high) if assumption.low and assumption.high else how.stock
            return self._judged(stock, second, assumption, job)

    def _read(self, stock: Corners | None) -> Reader:
        return Reader(self.program, self.machine, stock, cpu_s=self.how.cpu_s, clamps=True, **self.how.limits)

    def _judged(
        self, stock: Corners | None, progress: Progress | None, assumption: Assumption | None, job: Job | None
    ) -> Result:
        """Result; with smaller cells, and with needles, where they are needed.  job: of the set-up, None: without
        one."""
        settings = load_settings(self.machine.ini)
        tools = load_tools(settings.path("TOOL_GEOMETRY"))
        case = Case(self.program, self.machine, settings, tools, assumption, job)
        wanted: float = self.how.cell or settings["CELL"]
        needles: dict[int, Floats] = {}
        while True:
            simulation = self.how.simulated(case, wanted, needles)
            try:
                result = _run(simulation, self._read(stock), progress, self.how.cpu_s)
                needles = extra_needles.needles(simulation.doubts, simulation.segments, result.cell)
                if not needles:
                    break
            except TooCoarse as error:
                wanted = rules.finer_cell(error.stock, self.how.cell, error.line, error.tool, error.diameter)
        look = simulation.second_look()
        if look:
            _run(look[0], self._read(stock), None, self.how.cpu_s)
            look[1]()
        return result


def _compare_comments(program: str, machine: Machine, result: Result) -> None:
    """Note tools that the program's comments describe otherwise than the tool table."""
    used = {tool.number: tool.diameter for tool in result.tools.values() if tool.diameter > 0}
    with contextlib.suppress(OSError):
        found = Assumption()
        compare(found, post_comments.read(program, machine.unit_mm), used, machine.unit)
        result.notes += ([0, text] for text in found.notes)


def _run(simulation: Simulation, reader: Reader, progress: Progress | None, cpu_s: float) -> Result:
    """Read and simulate to the end, in cpu_s of computing time of this process from now on: it may have worked
    before."""
    end = time.process_time() + cpu_s
    with reader:
        blocks = iter(reader)
        following = next(blocks, None)
        while following is not None:
            block, following = following, next(blocks, None)
            simulation.take(block, following is None)
            if time.process_time() > end:
                raise Unfinished(
                    f"the check needs more than {cpu_s:g} s of computing time",
                    "use a larger --cell, or raise --time-limit",
                    int(block[-1, 1]),
                )
            if progress:
                progress(int(block[-1, 1]))
        simulation.carries_stock = reader.carries_stock
        return simulation.finish(reader.messages, reader.notes)
