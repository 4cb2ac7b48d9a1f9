# SPDX-License-Identifier: GPL-2.0-or-later
"""The whole plan: order in, steps and what stays out.

Called by cli/turn.py.

    plan = make_plan(Order(part, blank, tools, ..))
    plan.steps          Step, needed or not, in the stored order
    plan.residue        Residue of the part: where, how much, which lines of the sub

Raises CycleError for whatever cannot be shown to be safe; nothing is planned then.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from chipwise.errors import CycleError
from chipwise.turning.profile_function import Piece, Place, above, clip, flat, negative, value
from chipwise.turning.path import Kind
from chipwise.turning.state import ORDER, Order, State, Step
from chipwise.turning.steps import REPEATED, STEPS

MISSING_MM = 0.01  # the blank may be smaller than the part by so much
THICK_MM = (
    0.3  # a tool that could not go somewhere is a reason to refuse the plan if more than that is left on its side
)
RESIDUE_MM = 0.003  # thinner residue is not listed, nor of a smaller area than its square


@dataclass(frozen=True)
class Residue:
    """Stock that no step has taken: range, area mm2, largest thickness mm, side, lines of the sub."""

    z0: float
    z1: float
    area: float
    height: float
    inside: bool
    lines: tuple[int, ...]


@dataclass(frozen=True)
class Plan:
    """order; steps; residue: (Residue, ..); stock: {inside: graph} at the end; safe: (z, x) mm where tools are
    changed."""

    order: Order
    steps: tuple[Step, ...]
    residue: tuple[Residue, ...]
    stock: dict[bool, list[Piece]]
    safe: Place


def make_plan(order: Order) -> Plan:
    """Plan of an Order.  Raises CycleError."""
    for name in order.order:
        if name not in STEPS:
            raise CycleError(f"{name} is not a step", "use " + ", ".join(ORDER))
    _check(order)
    state = State(order)
    steps: list[Step] = []
    for name in order.order:
        try:
            for step in _made(state, name):
                step.after = dict(state.stock)
                steps.append(step)
        except CycleError as error:
            raise _of_step(order, len(steps) + 1, name, error) from error
    residue = tuple(_residue(state))
    for name, tool, failure in state.failed:
        if any(r.inside == tool.inside and r.height > THICK_MM for r in residue):
            raise _of_step(order, [s.name for s in steps].index(name) + 1, name, failure)
    return Plan(order, tuple(steps), residue, state.stock, (state.safe_z, state.safe_x))


def _made(state: State, name: str) -> Iterator[Step]:
    """The Steps of a name: rest machining, finishing and grooving are repeated as long as another tool reaches more."""
    step = STEPS[name](state, name)
    yield step
    while name in REPEATED and step.needed:  # each tool once: State.made
        step = STEPS[name](state, name)
        if step.needed:
            yield step


def _of_step(order: Order, number: int, name: str, error: CycleError) -> CycleError:
    """A CycleError with its step."""
    return CycleError(f"step {number}, {name}: {error.problem}", error.remedy, **error.values).across(order.diameter)


def _check(order: Order) -> None:
    """Refuse a blank that is smaller than the part, and a part inside of a barrier."""
    part, blank = order.part, order.blank
    if blank.z0 > part.z0 + MISSING_MM or blank.z1 < part.z1 - MISSING_MM:
        raise CycleError(
            "the blank ends at Z{a} and Z{b}, the part at Z{c} and Z{d}",
            "the blank has to hold the part",
            a=blank.z0,
            b=blank.z1,
            c=part.z0,
            d=part.z1,
        )
    for name, wanted, given in (("outside", part.outside, blank.outside), ("inside", part.bore, blank.bore)):
        missing = above(wanted, given, MISSING_MM) if wanted and given else []
        if missing:
            z0, z1, _, height = missing[0]
            raise CycleError(
                f"the blank is smaller than the part {name} by {{h}} from Z{{a}} to Z{{b}}",
                "correct the blank or the part",
                h=height,
                a=z0,
                b=z1,
            )
    for z0, z1, x0, x1 in order.barriers:
        inside = [p for p in clip(part.outside, z0, z1) if p.z1 > z0 and p.z0 < z1]
        if inside and x1 > 0:
            raise CycleError(
                "the part goes into a barrier, from Z{a} to Z{b}",
                "clamp it farther back, or correct G22",
                a=max(z0, part.z0),
                b=min(z1, part.z1),
            )


def _residue(state: State) -> Iterator[Residue]:
    """Residues outside and inside, from the right."""
    for inside, wanted in ((False, state.order.part.outside + _hole_in_front(state)), (True, state.order.part.bore)):
        stock = clip(state.stock[inside], state.order.part.z0, math.inf)
        for z0, z1, area, height in reversed(above(stock, wanted)):
            if height > RESIDUE_MM and area > RESIDUE_MM**2:
                lines = sorted({p.line for p in clip(wanted, z0, z1) if p.line})
                yield Residue(z0, z1, area, height, inside, tuple(lines))


def _hole_in_front(state: State) -> list[Piece]:
    """Graph of what may be in front of the face: nothing but the hole, to the axis where there is none.  Facing has cut
    it off: there it is as at its end."""
    face, hole = state.order.part.z1, state.stock[True]
    end = hole[-1].z1 if hole else -math.inf
    return [
        *negative(clip(hole, face, math.inf)),
        flat(max(face, end), state.domain[1], -value(hole[-1], end) if hole else 0.0),
    ]


def total_length(steps: Iterable[Step]) -> float:
    """Feed length (mm) of steps."""
    return sum(length for step in steps for kind, length in lengths(step) if kind != "rapid")


def lengths(step: Step) -> list[tuple[Kind, float]]:
    """[(kind, mm)] of a step's moves."""
    z, x = step.start
    found: list[tuple[Kind, float]] = []
    for m in step.moves:
        chord = math.hypot(m.z - z, m.x - x)
        if m.kind == "arc":
            r = math.hypot(z - m.centre[0], x - m.centre[1])
            chord = 2 * r * math.asin(min(chord / (2 * r), 1.0))
        found.append((m.kind, chord))
        z, x = m.z, m.x
    return found
