# SPDX-License-Identifier: GPL-2.0-or-later
"""Judges one program: reads it, assumes what it does not name, and simulates it (simulate.py), again where that is needed -> Result.

Called by run.py and setup/measure.py.
"""

import contextlib
import copy
import functools
import time

from chipwise.program import post_comments
from chipwise.check.assume import Assumption, Unknown, assume, compare, halves, surveyed
from chipwise.check import extra_needles
from chipwise.check import rules
from chipwise.check.findings import MACHINE, Finding
from chipwise.program.program_file import TOOL, UNCHECKED, Lacking, Missing, Unfinished, Unreadable
from chipwise.program.reader import CPU_S, LENGTHS, Reader
from chipwise.check.result import Result
from chipwise.check.simulate import Simulation, TooCoarse
from chipwise.errors import CycleError, unnamed
from chipwise.settings import load_settings
from chipwise.tool_data.geometry import load_tools

MOST_LACKING = 50           # tools and axes that a machine lacks


def check(program, machine, stock=None, cell=None, progress=None, cpu_s=CPU_S, assumes=False, tool=None, diameter=None,
          simulated=Simulation, completes=False, confirmed=None, **limits):
    """Result of one program.

    machine: reader.Machine; stock: (low, high) mm in work coordinates or None; cell: mm, default [CHIPWISE]CELL, smaller
    if a tool needs it; progress: called with the number of the line that is being simulated; assumes: whether a stock and tools
    that the program does not name are assumed; tool, diameter (mm): of the one in the spindle at the beginning, then; simulated: makes the
    Simulation of its arguments; confirmed: function of program and settings, the setup/job.py Job of its set-up or None; completes: whether a program is judged on a machine that lacks its tools or rotary axes, which is a finding then.
    """
    def answer(machine):
        made = functools.partial(simulated, job=confirmed(program, load_settings(machine.ini))) if confirmed else simulated
        return _answer(program, machine, stock, cell, progress, cpu_s, assumes, tool, diameter, made, limits)

    try:
        try:
            return answer(machine)
        except Lacking as error:
            if not completes:
                raise
            machine, lacks = completed(program, machine, error, cpu_s, limits)
            result = answer(machine)
            result.findings.kept[:0] = lacks
            return result
    except Unreadable as error:
        result = Result(program, error=(str(error), error.line), state=error.state, unit=machine.unit)
        if isinstance(error, Unknown):
            result.survey(error.survey)
        return result
    except CycleError as error:
        return Result(program, error=(unnamed(error.text()), 0), state=UNCHECKED)


def completed(program, machine, error, cpu_s, limits):
    """-> (a Machine with the tools and rotary axes for lack of which LinuxCNC refuses the program, [Finding] of each).  error: the first Lacking."""
    found = []
    while error:
        machine, is_tool = copy.copy(machine), error.kind == TOOL
        if is_tool:
            machine.added = (*machine.added, error.name)
        else:
            machine.axis_mask |= 1 << LENGTHS.index(error.name)
        found.append(Finding(MACHINE, error.line, error.line, error.name if is_tool else 0, axis="" if is_tool else error.name))
        error = _lacking(program, machine, cpu_s, limits) if len(found) < MOST_LACKING else None
    return machine, found


def _lacking(program, machine, cpu_s, limits):
    """The Lacking with which LinuxCNC refuses a program, or None."""
    try:
        with Reader(program, machine, cpu_s=cpu_s, judged=False, **limits) as reader:
            for _block in reader:
                pass
    except Lacking as error:
        return error
    except (Unreadable, CycleError):
        pass                                    # who judges it says so
    return None


def _answer(program, machine, stock, cell, progress, cpu_s, assumes, tool, diameter, simulated, limits):
    """The Result of check().  Raises Unreadable, CycleError."""
    def read(stock):
        return Reader(program, machine, stock, cpu_s=cpu_s, clamps=True, **limits)
    try:
        result = _judged(program, machine, read, stock, cell, progress, cpu_s, None, simulated)
        if assumes:
            _compare_comments(program, machine, result)
        return result
    except Missing as error:
        if not assumes or not machine.has_y:       # a lathe's program has no stock that a mill could cut
            raise
        first, progress = halves(progress)
        assumption = assume(surveyed(read(None), machine, first), program, machine, error.line, bool(stock), tool, diameter)
        return _judged(program, machine, read, (assumption.low, assumption.high) if assumption.low else stock, cell, progress, cpu_s, assumption, simulated)


def _compare_comments(program, machine, result):
    """Note tools that the program's comments describe otherwise than the tool table."""
    used = {tool.number: tool.diameter for tool in result.tools.values() if tool.diameter > 0}
    with contextlib.suppress(OSError):
        found = Assumption()
        compare(found, post_comments.read(program, machine.unit_mm), used, machine.unit)
        result.notes += ([0, text] for text in found.notes)


def _judged(program, machine, read, stock, cell, progress, cpu_s, assumption, simulated):
    """Result; with smaller cells, and with needles, where they are needed.  read(stock) -> Reader."""
    settings = load_settings(machine.ini)
    tools = load_tools(settings.path("TOOL_GEOMETRY"))
    wanted, needles = cell or settings["CELL"], {}
    while True:
        simulation = simulated(program, machine, wanted, settings, tools, needles, assumption)
        try:
            result = _run(simulation, read(stock), progress, cpu_s)
            needles = extra_needles.needles(simulation.doubts, simulation.segments, result.cell)
            if not needles:
                break
        except TooCoarse as error:
            wanted = rules.finer_cell(simulation.map, cell, *error.args)
    look = simulation.second_look()
    if look:
        look[1](_run(look[0], read(stock), None, cpu_s))
    return result


def _run(simulation, reader, progress, cpu_s):
    """Read and simulate to the end, in cpu_s of computing time of this process from now on: it may have worked before."""
    end = time.process_time() + cpu_s
    with reader:
        blocks = iter(reader)
        following = next(blocks, None)
        while following is not None:
            block, following = following, next(blocks, None)
            simulation.take(block, following is None)
            if time.process_time() > end:
                raise Unfinished(f"the check needs more than {cpu_s:g} s of computing time",
                                 "use a larger --cell, or raise --time-limit", int(block[-1, 1]))
            if progress:
                progress(int(block[-1, 1]))
        simulation.carries_stock = reader.carries_stock
        return simulation.finish(reader.messages, reader.notes)
