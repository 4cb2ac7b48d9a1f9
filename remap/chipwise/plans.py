# SPDX-License-Identifier: GPL-2.0-or-later
"""From an Order to its Outcome: the part of a cycle's work that takes time.  Pure; mm.

Called by planner_runner.py, a process apart from the interpreter: all that a plan may depend on is in the Order.
"""

from chipwise.contour_sub import find, read
from chipwise.cycles import contour, contour_chop, hole, pocket
from chipwise.cycles.plan import CyclePlan
from chipwise.errors import CycleError
from chipwise.geometry.base.contour import ContourError
from chipwise.lines import chunks
from chipwise.order import Order, Outcome

_CACHING = (hole, contour, contour_chop, pocket, find, read)


def forget() -> None:
    """Give back the memory of earlier plans."""
    for module in _CACHING:
        for function in vars(module).values():
            if hasattr(function, "cache_clear"):
                function.cache_clear()


def make(order: Order) -> Outcome:
    """The Outcome of an Order.  Raises CycleError if it cannot be done."""
    plan = _CYCLES[order.cycle](order)
    messages = tuple(CycleError(text, code=order.code, **lengths).text(order.unit) for text, lengths in plan.notes)
    report = plan.report() if order.report and plan.report else None
    return Outcome(chunks(plan.moves, order.start, order.unit_mm), messages, report)


def _hole(order: Order) -> CyclePlan:
    return hole.hole_plan(hole.HoleRequest(**order.fields))


def _contour(order: Order) -> CyclePlan:
    shape = read.read_shape(order.job)
    if len(shape.loops) > 1:
        read.one_contour(shape)     # raises
    try:
        return contour.contour_plan(contour.ContourRequest(shape=shape.loops[0], **order.fields))
    except ContourError as error:
        raise read.shape_error(shape, error) from error


def _pocket(order: Order) -> CyclePlan:
    shape = read.read_shape(order.job)
    try:
        return pocket.pocket_plan(pocket.PocketRequest(loops=shape.loops, **order.fields))
    except ContourError as error:
        raise read.shape_error(shape, error) from error


_CYCLES = {"hole": _hole, "contour": _contour, "pocket": _pocket}
