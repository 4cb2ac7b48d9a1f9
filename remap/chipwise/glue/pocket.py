# SPDX-License-Identifier: GPL-2.0-or-later
"""G79: words -> the fields of a PocketRequest.  Called by codes.py through session.run_cycle."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from chipwise.clib import layout
from chipwise.glue import program_run, shape
from chipwise.glue.registers import status_now
from chipwise.order import MapPlace
from chipwise.pattern import mirroring

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.order import Order

WORDS = "qdikplzrjeh"

# D without a word, in tool diameters.
STEP_SHARE = 0.4

# P of the strategy that starts from the stock as it stands.
ENGAGE = 4


def order(state: State) -> Order:
    """The order of G79 for session.run_cycle: State -> Order."""
    state.check_words(WORDS)
    fields = _words(state)
    if starts_from_stock(state):
        fields["map"] = MapPlace(
            int(layout.STOCK_MAGIC), state.machine_point((0.0, 0.0, 0.0)), math.radians(state.interp.rotation_xy)
        )
    return state.order("pocket", fields, shape.job(state, shape.sub_number(state)))


def starts_from_stock(state: State) -> bool:
    """Whether the cycle starts from the map, for which the machine has to be at rest: P4 in a run with a certain stock
    and no fault.  What may be a line that run from line skips must not wait, and starts from solid stock as in the
    preview."""
    if state.number("p") != ENGAGE or not state.interp.task or program_run.may_be_skipped():
        return False
    _mode, certain, fault = status_now(state)
    return certain and not fault


def _words(state: State) -> dict[str, object]:
    """Words of the line -> fields of a PocketRequest (mm), all but the loops."""
    diameter = state.tool_diameter()
    clearance, bottom = state.heights()
    state.chop_size()  # checks H0: a pocket leaves no slug, so there is nothing to chop
    step = state.length("d")
    return dict(
        bottom=bottom,
        clearance=clearance,
        tool_radius=diameter / 2,
        step=STEP_SHARE * diameter if step is None else step,
        close_gap=state.settings["CLOSE_GAP"],
        side_allowance=state.length("i") or 0.0,
        floor_allowance=state.length("k") or 0.0,
        strategy=state.number("p") or 0,
        direction=float(state.number("l") or 0),
        climb=state.turns_clockwise() != mirroring.mirrored,
        traverse_clearance=state.settings["TRAVERSE_CLEARANCE"],
        seam_overlap=state.seam_overlap(),
        ramp_angle=state.ramp_angle(),
        start=state.position(),
        **state.depth_step(),
        **state.feeds(),
    )
