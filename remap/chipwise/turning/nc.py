# SPDX-License-Identifier: GPL-2.0-or-later
"""A plan as a program in plain G-code: one commented block a step, for machines without chipwise.  Called by
cli/turn.py."""

from collections.abc import Iterator

from chipwise.errors import CycleError, printable
from chipwise.turning.blocks import Block, approach, blocks
from chipwise.turning.plan import Plan
from chipwise.turning.request import Request
from chipwise.turning.state import Step


def program(plan: Plan, request: Request, title: str) -> str:
    """Text of the whole program.  Raises CycleError if the spindle would not turn."""
    if not request.speed or not request.direction:
        raise CycleError("the spindle does not turn at G26", "program S and M3 or M4 before G26", "G26")
    made = {block.number: block for block in blocks(plan, request)}
    lines = [
        f"({_plain(title)})",
        "(X is a radius. Tools are changed where the machine is now: begin with every tool clear of work, chuck and "
        "tailstock.)",
        f"{'G20' if request.unit == 'in' else 'G21'} G18 G8 G40 G49 G61 G80 G90 G91.1",
        "G95" if request.per_rev else "G94",
    ]
    for number, step in enumerate(plan.steps, 1):
        if number in made:
            lines += ["", *_block(made[number], step, request)]
        else:
            lines += ["", f"(step {number}: {step.name}: not needed: {_plain(step.why)})"]
    return "\n".join([*lines, "", *(["G7"] if request.diameter else []), "M5", "M2", ""])


def _plain(text: str) -> str:
    """Text that may be in a comment."""
    return printable(text).replace("(", "[").replace(")", "]")


def _block(block: Block, step: Step, request: Request) -> Iterator[str]:
    """Lines of one step."""
    yield f"(step {block.number}: {step.name}, T{block.tool}: {_plain(step.why)})"
    yield f"({step.direction}, Z{step.z1 / request.scale:.3f} to Z{step.z0 / request.scale:.3f})"
    if block.change:
        yield f"T{block.tool} M6"
        yield "G43"
        yield "#<change_x> = #5420"
        yield "#<change_z> = #5422"
    yield block.spindle
    yield from approach(block)
    yield f"F{block.feed:.6g}"
    yield from block.lines
    yield f"({step.name} ends)"
    if block.back:
        yield "G0 X#<change_x>"
        yield "G0 Z#<change_z>"
