"""From an Order to its Outcome: the part of a cycle's work that takes time.  Pure; mm.

Called by planner_runner.py, a process apart from the interpreter: all that a plan may depend on is in the Order.
"""

from chipwise import subs
from chipwise.cycles import contour, contour_chop, hole, pocket
from chipwise.errors import CycleError
from chipwise.geometry.contour import ContourError
from chipwise.lines import chunks
from chipwise.order import Outcome

_CACHING = (hole, contour, contour_chop, pocket, subs)


def forget():
    """Give back the memory of earlier plans."""
    for module in _CACHING:
        for function in vars(module).values():
            if hasattr(function, "cache_clear"):
                function.cache_clear()


def make(order):
    """The Outcome of an Order.  Raises CycleError where it cannot be done."""
    moves, notes, records = _CYCLES[order.cycle](order)
    messages = tuple(CycleError(text, code=order.code, **lengths).text(order.unit) for text, lengths in notes)
    return Outcome(chunks(moves, order.start, order.unit_mm), messages, records)


def _hole(order):
    request = hole.HoleRequest(**order.fields)
    moves, records = hole.hole_moves(request), ()
    if order.report:                # of very many pieces the largest takes longer than the rest of the plan
        parts = hole.chop_parts(request)
        records = (("hole", dict(chopped=parts > 1, pieces=parts, largest_piece_mm=hole.largest_piece(request))),)
    return moves, (), records


def _contour(order):
    shape = subs.read_shape(order.job)
    if len(shape.loops) > 1:
        subs.one_contour(shape)     # raises
    try:
        plan = contour.contour_plan(contour.ContourRequest(shape=shape.loops[0], **order.fields))
    except ContourError as error:
        raise subs.shape_error(shape, error) from error
    records = (("contour", dict(chopped=plan.chop.chopped, pieces=plan.chop.pieces,
                                largest_piece_mm=plan.chop.largest_piece)),)
    return plan.moves, plan.notes, records if order.fields["finish"] else ()


def _pocket(order):
    shape = subs.read_shape(order.job)
    try:
        plan = pocket.pocket_plan(pocket.PocketRequest(loops=shape.loops, **order.fields))
    except ContourError as error:
        raise subs.shape_error(shape, error) from error
    return plan.moves, plan.notes, (("pocket", dict(
        regions=plan.fields, plunges=len(plan.plunges), unreached_mm2=[round(u.area, 3) for u in plan.unreached])),)


_CYCLES = {"hole": _hole, "contour": _contour, "pocket": _pocket}
