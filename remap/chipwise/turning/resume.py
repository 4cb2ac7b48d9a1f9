# SPDX-License-Identifier: GPL-2.0-or-later
"""A part that was stopped: planned from what is left of it; and the stages of a plan, which stock_file.py keeps for the
next time.

Called by g26_plan.py and resume/lathe.py.  The stock of a file is used only for the same program, part, blank and work
offset, and never twice without an answer: a part that the operator has been asked about and has not confirmed counts as
another one.  In doubt the plan begins with the whole blank, which is safe: it cuts air where stock is gone.
"""

import math
import time
from dataclasses import dataclass, replace
from typing import NamedTuple

from chipwise.errors import CycleError
from chipwise.turning import stock_file
from chipwise.turning.profile_function import clip, flat, value
from chipwise.turning.stock_file import Key, Stage
from chipwise.turning.plan import Plan, make_plan
from chipwise.turning.profile import Profile
from chipwise.turning.state import Order

MOST_PIECES = 20_000  # of graphs in a file; of more stages every second one is kept, every third ..
ON_AXIS_MM = 1e-4  # what is not higher is what a nose leaves on the axis
WHOLE = "the whole blank is planned"

Marks = list[tuple[int, int]]  # (moves that have been made, number of the stage), ..


@dataclass(frozen=True)
class Choice:
    """plan; stage: the Stage that it begins with, None for the blank; changed: s, when that was written; notes:
    CycleErrors, for the operator."""

    plan: Plan
    stage: Stage | None = None
    changed: float = 0.0
    notes: tuple[CycleError, ...] = ()


def choose(order: Order, path: str, key: Key) -> Choice:
    """Choice for an Order: from the stock that the file `path` has, else from the blank.  key: kept.Key; path "":
    there is no file.

    Raises CycleError where the whole blank cannot be planned either."""
    try:
        found = stock_file.read(path) if path else None
    except CycleError as error:
        return _whole(order, CycleError(error.problem, f"{error.remedy}; {WHOLE}"))
    if found is None or not found.begun:
        return Choice(make_plan(order))
    why = stock_file.difference(found.key, key) or (
        "nobody has confirmed that it is in the chuck" if found.asked else ""
    )
    if why:
        return _whole(order, CycleError("the stock of the stopped part is not used: {why}", WHOLE, why=why))
    try:
        plan = make_plan(replace(order, blank=blank_of(found.stage)))
    except CycleError as error:
        return _whole(
            order,
            CycleError(f"what is left of the stopped part cannot be planned: {error.problem}", WHOLE, **error.values),
        )
    if not any(step.needed for step in plan.steps):
        return _whole(order, CycleError("the part that was stopped is finished", WHOLE))
    return Choice(
        plan,
        found.stage,
        found.changed,
        (CycleError("planned from what the step {step} has left", step=found.stage.step),),
    )


def _whole(order: Order, note: CycleError) -> Choice:
    """Choice of the whole blank, and why."""
    return Choice(make_plan(order), notes=(note,))


def question(stage: Stage, changed: float) -> CycleError:
    """What the operator is asked before a plan that begins with a stage is carried out, as a CycleError.  changed: s,
    when that was written."""
    when = time.strftime("%Y-%m-%d %H:%M", time.localtime(changed))
    return CycleError(
        "the part that was stopped on {when} in the step {step} goes on from there",
        "press Resume if it is in the chuck as it was, else press Stop, and Start for another blank",
        when=when,
        step=stage.step,
    )


def blank_of(stage: Stage) -> Profile:
    """Profile of the stock of a stage."""
    end = max((p.z1 for p in stage.outside if max(value(p, p.z0), value(p, p.z1)) > ON_AXIS_MM), default=-math.inf)
    outside = clip(stage.outside, -math.inf, end)
    if not outside:
        raise CycleError("no stock is left", "clamp another blank")
    return Profile(outside, clip(stage.bore, -math.inf, end), outside[0].z0, end, stage.threads)


class Stages(NamedTuple):
    """stages: [Stage], the first is the beginning; marks: {number of a step: ((moves that have been made, number of the
    stage), ..)}, the end of the step last."""

    stages: list[Stage]
    marks: dict[int, Marks]


def stages(plan: Plan, begun: str = "") -> Stages:
    """Stages of a plan whose blank is what the step `begun` has left, "" for a blank that is whole."""
    blank = plan.order.blank
    stock = {False: blank.outside, True: blank.bore or [flat(blank.z0, blank.z1, 0.0)]}
    threads, every = tuple(blank.threads), _every(plan)
    found = [Stage(begun, stock[False], stock[True], threads)]
    marks: dict[int, Marks] = {}
    for number, step in enumerate(plan.steps, 1):
        if not step.needed:
            continue
        marks[number] = []
        for count, graph in step.cuts[every - 1 : -1 : every]:
            now = {**stock, step.used_tool.inside: graph}
            marks[number].append((count, len(found)))
            found.append(Stage(step.name, now[False], now[True], threads))
        stock = step.after
        threads += tuple(
            t for t in plan.order.part.threads if step.name.startswith("thread") and t.inside == step.used_tool.inside
        )
        marks[number].append((len(step.moves), len(found)))
        found.append(Stage(step.name, stock[False], stock[True], threads))
    return Stages(found, marks)


def _every(plan: Plan) -> int:
    """Of how many cuts one is kept."""
    pieces = sum(len(graph) for step in plan.steps for _, graph in step.cuts)
    return max(math.ceil(pieces / MOST_PIECES), 1)
