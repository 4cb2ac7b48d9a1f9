# SPDX-License-Identifier: GPL-2.0-or-later
"""G79: words -> the fields of a PocketRequest.  Called by codes.py through session.run_cycle."""

from chipwise.glue import shape
from chipwise.pattern import mirroring

WORDS = "qdikplzrjeh"

# D without a word, in tool diameters.
STEP_SHARE = 0.4


def order(state):
    """The order of G79 for session.run_cycle: State -> Order."""
    state.check_words(WORDS)
    return state.order("pocket", _words(state), shape.job(state, shape.sub_number(state)))


def _words(state):
    """Words of the line -> fields of a PocketRequest (mm), all but the loops."""
    diameter = state.tool_diameter()
    clearance, bottom = state.heights()
    state.chop_size()               # checks H0: a pocket leaves no slug, so there is nothing to chop
    step = state.length("d")
    return dict(
        bottom=bottom, clearance=clearance, tool_radius=diameter / 2,
        step=STEP_SHARE * diameter if step is None else step, close_gap=state.settings["CLOSE_GAP"],
        side_allowance=state.length("i") or 0.0, floor_allowance=state.length("k") or 0.0, strategy=state.number("p") or 0,
        direction=float(state.number("l") or 0), climb=state.turns_clockwise() != mirroring.mirrored,
        traverse_clearance=state.settings["TRAVERSE_CLEARANCE"], ramp_angle=state.ramp_angle(), start=state.position(), **state.depth_step(), **state.feeds())
