# SPDX-License-Identifier: GPL-2.0-or-later
"""G26 and G27 in the planner's process: from an Order of glue/turning.py to what glue/turning.py executes and says.

Called by planner/plans.py.  The plan is that of `chipwise turn` for the same program.
"""

import os
from collections.abc import Iterable
from dataclasses import dataclass

from chipwise import order as orders
from chipwise.errors import CycleError
from chipwise.ini import Ini
from chipwise.gcode_lines import CHUNK_MOVES
from chipwise.order import Outcome
from chipwise.settings import load_settings
from chipwise.turning import resume, soft_limits, stock_file
from chipwise.turning import text
from chipwise.turning.blocks import Block, Run, Turning, blocks, spindle_line
from chipwise.turning.plan import Plan
from chipwise.turning.profile_function import Place
from chipwise.turning.read_part import Machine, make_order, tool_notes, with_start
from chipwise.turning.request import Request, read_program, read_roles
from chipwise.turning.resume import Choice, Marks
from chipwise.turning.soft_limits import Limit
from chipwise.turning.stock_file import Key, Record
from chipwise.turning.times import Times, times
from chipwise.turning.tool import read_table

LEAD = "chipwise: "


@dataclass(frozen=True)
class TurnRequest:
    """request: Request, complete; program: path, "" in MDI; number: of the only step to make, 0 for all; only_say: H1;
    zero: (z, x) mm of the work coordinates on the machine; limits: ((name, low, high), ..) of its Z and X, () where
    they do not count; stock: path of the file of the stock, "" for none; keep: write it; home: (z, x) mm where tools
    are changed."""

    request: Request
    program: str = ""
    number: int = 0
    only_say: bool = False
    zero: Place = (0.0, 0.0)
    limits: tuple[Limit, ...] = ()
    stock: str = ""
    keep: bool = False
    home: Place | tuple[()] = ()
    most_moves: int = 0


def make(order: orders.Order) -> Outcome:
    """Outcome of an Order.  Raises CycleError."""
    asked = TurnRequest(**order.fields)
    request, program = asked.request, read_program(asked.program)
    request.roles = read_roles(program)
    machine = Machine(Ini(order.job.ini), load_settings(order.job.ini), order.job.ini)
    try:
        part = make_order(order.job, program, request, machine, machine.steps)
        key = stock_file.key_of(part, asked.program, asked.zero)
        choice = resume.choose(part, asked.stock, key)
    except CycleError as error:
        raise with_start(error, order.job, request.words) from error
    plan = choice.plan
    if asked.number > len(plan.steps):
        raise CycleError(
            f"there is no step L{asked.number}: the plan has {len(plan.steps)}", "use G26 H1 to see the plan"
        )
    sentences = (
        *_texts(order, (*choice.notes, *tool_notes(part, request, machine))),
        *(f"{LEAD}{order.code}: {line}" for line in _sentences(plan, request, machine, asked)),
    )
    try:
        _check_travel(plan, asked, machine)
    except CycleError as error:
        if not asked.only_say:
            raise
        sentences += _texts(order, (error,))
    if asked.only_say:
        return Outcome((), sentences)
    chosen = _chosen(plan, asked)
    marks: dict[int, Marks] = {}
    record = None
    if asked.keep and chosen:
        marks, record, notes = _keep(asked.stock, key, choice)
        sentences += _texts(order, notes)
    question = "".join(_texts(order, (resume.question(choice.stage, choice.changed),))) if choice.stage else ""
    return Outcome(
        (),
        sentences,
        turning=Turning(
            tuple(_run(b, marks.get(b.number, [])) for b in chosen),
            (plan.safe[0] / request.scale, plan.safe[1] / request.scale),
            spindle_line(request),
            record,
            question,
        ),
    )


def _chosen(plan: Plan, asked: TurnRequest) -> list[Block]:
    """The blocks of a plan that are carried out."""
    chosen = [b for b in blocks(plan, asked.request) if asked.number in (0, b.number)]
    if sum(len(b.lines) for b in chosen) > asked.most_moves:
        raise CycleError(
            f"the plan has more than {asked.most_moves} moves", "use a larger D, or raise [CHIPWISE]PLAN_MOVES"
        )
    if asked.number:
        chosen = [b._replace(change=True, back=True) for b in chosen]
    return chosen


def _check_travel(plan: Plan, asked: TurnRequest, machine: Machine) -> None:
    """Raise CycleError if the steps that are carried out leave the soft limits."""
    if not asked.limits:
        return
    steps = [(n, s) for n, s in enumerate(plan.steps, 1) if s.needed and asked.number in (0, n)]
    table = read_table(machine.table)
    offsets = {
        s.used_tool.number: (
            table[s.used_tool.number].z * machine.unit_mm,
            table[s.used_tool.number].x * machine.unit_mm,
        )
        for _, s in steps
    }
    soft_limits.check(steps, asked.limits, asked.zero, offsets)


def _texts(order: orders.Order, notes: Iterable[CycleError]) -> tuple[str, ...]:
    """CycleErrors as the operator reads them."""
    for note in notes:
        note.code = order.code
    return tuple(note.text(order.unit) for note in notes)


def _keep(path: str, key: Key, choice: Choice) -> tuple[dict[int, Marks], Record | None, tuple[CycleError, ...]]:
    """(marks of rest.Stages, kept.Record, notes): the file of a plan is written; without marks and Record where it
    cannot be."""
    found = resume.stages(choice.plan, choice.stage.step if choice.stage else "")
    try:
        return found.marks, stock_file.write(path, key, found.stages), ()
    except OSError as error:
        return (
            {},
            None,
            (
                CycleError(
                    "the stock of a part that is stopped will not be known: {file}: {why}",
                    "make the folder writable, or set [CHIPWISE]TURNING_STOCK",
                    file=os.path.basename(path),
                    why=error.strerror,
                ),
            ),
        )


def _sentences(plan: Plan, request: Request, machine: Machine, asked: TurnRequest) -> list[str]:
    """Lines for the operator: the whole plan for H1, else what is going to be done."""
    if asked.only_say:
        return [" ".join(line.split()) for line in text.report(plan, request, _times(plan, request, machine, asked))]
    if asked.number:
        step = plan.steps[asked.number - 1]
        return [
            f"step {asked.number}, {step.name}: "
            + (f"T{step.used_tool.number}, {step.why}" if step.needed else f"not needed: {step.why}")
        ]
    return [text.summary(plan, request, _times(plan, request, machine, asked))]


def _times(plan: Plan, request: Request, machine: Machine, asked: TurnRequest) -> Times:
    return times(plan, request, machine.motion, asked.home or None)


def _run(block: Block, marks: Marks) -> Run:
    """Run of a block; marks: ((moves that have been made, number of the stage), ..), the last one at its end.

    A chunk begins at a rapid; one that ends a stage where the rapid before it has lifted the tool off the work."""
    found: list[tuple[list[str], int]] = []
    now: list[str] = []
    before, rapid = 0, False
    for k, line in enumerate(block.lines):
        lifted, rapid = rapid, line.startswith("G0 ")
        stage = max((number for count, number in marks if count < k), default=0) if rapid and lifted else 0
        if now and rapid and (stage > before or len(now) >= CHUNK_MOVES):
            found.append((now, stage if stage > before else 0))
            now, before = [], max(stage, before)
        now.append(line)
    found.append((now, marks[-1][1] if marks else 0))
    found = [(rows, stage) for rows, stage in found if rows]
    return Run(block, tuple(((block.feed, "\n".join(rows)),) for rows, _ in found), tuple(stage for _, stage in found))
