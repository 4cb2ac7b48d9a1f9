"""G77 / G78: words -> ContourRequest -> moves.  Called by codes.py through session.run_cycle."""

import math

from chipwise import report, subs
from chipwise.cycles.contour import ContourRequest, contour_plan
from chipwise.errors import CycleError
from chipwise.geometry.contour import ContourError
from chipwise.glue import shape

ROUGH_WORDS = "qpidljerzkh"
FINISH_WORDS = "qpijerzkh"


def plan_of(finish):
    """The plan of G77 (finish False) or G78 (finish True) for session.run_cycle: State -> moves."""
    return lambda state: _plan(state, finish)


def _plan(state, finish):
    """Moves of the line; what the operator should know goes to the state."""
    state.check_words(FINISH_WORDS if finish else ROUGH_WORDS)
    words = _words(state, finish)
    found = shape.read(state)
    try:
        plan = contour_plan(ContourRequest(shape=_one_loop(found), **words))
    except ContourError as error:
        raise subs.shape_error(found, error) from error
    for text, lengths in plan.notes:
        state.say(text, **lengths)
    if finish and state.interp.task:
        report.record("contour", chopped=plan.chop.chopped, pieces=plan.chop.pieces,
                      largest_piece_mm=plan.chop.largest_piece)
    return plan.moves


def _one_loop(found):
    """The only loop of a subs.Shape."""
    if len(found.loops) > 1:
        subs.one_contour(found)     # raises
    return found.loops[0]


def _words(state, finish):
    """Words of the line -> fields of a ContourRequest (mm), all but the shape."""
    side = state.number("p")
    if side is None:
        raise CycleError("word P (side of the tool) is missing", "add P41 (tool left of the contour) or P42 (right)")
    diameter = state.tool_diameter()
    clearance, bottom = state.heights()
    depth_step = state.length("j")
    passes = state.number("l")
    chop_size = state.chop_size()
    return dict(
        side=side, tool_radius=diameter / 2, bottom=bottom, clearance=clearance, allowance=state.length("i") or 0.0,
        passes=1 if passes is None else passes, step=state.length("d"),
        depth_step=state.flute_length() if depth_step is None else depth_step,
        approach=state.length("k"), angle=math.radians(state.approach_angle()), feed=state.feed(), close_gap=state.settings["CLOSE_GAP"],
        plunge_feed=state.plunge_feed(), start=state.position(), finish=finish, chop_size=chop_size if finish else 0.0)
