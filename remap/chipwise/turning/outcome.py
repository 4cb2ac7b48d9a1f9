# SPDX-License-Identifier: GPL-2.0-or-later
"""G26 and G27 in the planner's process: from an Order of glue/turning.py to what glue/turning.py executes and says.

Called by plans.py.  The plan is that of `chipwise turn` for the same program.
"""

from dataclasses import dataclass

from chipwise.errors import CycleError
from chipwise.ini import Ini
from chipwise.lines import CHUNK_MOVES
from chipwise.order import Outcome
from chipwise.settings import load_settings
from chipwise.turning import text
from chipwise.turning.blocks import Turning, blocks, spindle_line
from chipwise.turning.plan import make_plan
from chipwise.turning.read_part import Machine, make_order
from chipwise.turning.request import read_program, read_roles

LEAD = "chipwise: "


@dataclass(frozen=True)
class TurnRequest:
    """request: Request, complete; program: path, "" in MDI; number: of the only step to make, 0 for all; only_say: H1."""

    request: object
    program: str = ""
    number: int = 0
    only_say: bool = False
    most_moves: int = 0


def make(order):
    """Outcome of an Order.  Raises CycleError."""
    asked = TurnRequest(**order.fields)
    request, program = asked.request, read_program(asked.program)
    request.roles = read_roles(program)
    machine = Machine(Ini(order.job.ini), load_settings(order.job.ini), order.job.ini)
    plan = make_plan(make_order(order.job, program, request, machine, machine.steps))
    if asked.number > len(plan.steps):
        raise CycleError(f"there is no step L{asked.number}: the plan has {len(plan.steps)}", "use G26 H1 to see the plan")
    said = tuple(f"{LEAD}{order.code}: {line}" for line in _said(plan, request, machine, asked))
    if asked.only_say:
        return Outcome((), said)
    chosen = [b for b in blocks(plan, request) if asked.number in (0, b.number)]
    if sum(len(b.lines) for b in chosen) > asked.most_moves:
        raise CycleError(f"the plan has more than {asked.most_moves} moves", "use a larger D, or raise [CHIPWISE]PLAN_MOVES")
    if asked.number:
        chosen = [b._replace(change=True, back=True) for b in chosen]
    return Outcome((), said, turning=Turning(tuple((b, _chunks(b)) for b in chosen), tuple(v / request.scale for v in plan.safe),
                                             spindle_line(request)))


def _said(plan, request, machine, asked):
    """Lines for the operator: the whole plan for H1, else what is going to be done."""
    if asked.only_say:
        return [" ".join(line.split()) for line in text.report(plan, request, machine.rapid_mm_s)]
    if asked.number:
        step = plan.steps[asked.number - 1]
        return [f"step {asked.number}, {step.name}: " + (f"T{step.tool.number}, {step.why}" if step.needed else f"not needed: {step.why}")]
    return [text.summary(plan, request, machine.rapid_mm_s)]


def _chunks(block):
    """Chunks of rows (feed, lines), as lines.chunks() makes them: each begins at a rapid."""
    found, now = [], []
    for line in block.lines:
        if len(now) >= CHUNK_MOVES and line.startswith("G0 "):
            found.append(now)
            now = []
        now.append(line)
    return tuple(((block.feed, "\n".join(rows)),) for rows in [*found, now] if rows)
