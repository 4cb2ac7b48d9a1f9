# SPDX-License-Identifier: GPL-2.0-or-later
"""G77 / G78: words -> the fields of a ContourRequest.  Called by codes.py through session.run_cycle."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Callable

from chipwise.errors import CycleError
from chipwise.glue import shape
from chipwise.pattern import mirroring

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.order import Order

ROUGH_WORDS = "qpidljerzkh"
FINISH_WORDS = "qpijerzkh"

OTHER_SIDE = {41.0: 42.0, 42.0: 41.0}  # of a contour in the other direction


def order_of(finish: bool) -> Callable[[State], Order]:
    """The order of G77 (finish False) or G78 (finish True) for session.run_cycle: State -> Order."""
    return lambda state: _order(state, finish)


def _order(state: State, finish: bool) -> Order:
    """The Order of the line."""
    state.check_words(FINISH_WORDS if finish else ROUGH_WORDS)
    return state.order("contour", _words(state, finish), shape.job(state, shape.sub_number(state)))


def _words(state: State, finish: bool) -> dict[str, object]:
    """Words of the line -> fields of a ContourRequest (mm), all but the shape."""
    side = state.number("p")
    if side is None:
        raise CycleError("word P (side of the tool) is missing", "add P41 (tool left of the contour) or P42 (right)")
    diameter = state.tool_diameter()
    clearance, bottom = state.heights()
    passes = state.number("l")
    chop_size = state.chop_size()
    return dict(
        side=OTHER_SIDE.get(side, side) if mirroring.mirrored else side,
        backwards=mirroring.mirrored,
        tool_radius=diameter / 2,
        bottom=bottom,
        clearance=clearance,
        allowance=state.length("i") or 0.0,
        passes=1 if passes is None else passes,
        step=state.length("d"),
        approach=state.length("k"),
        angle=math.radians(state.approach_angle()),
        close_gap=state.settings["CLOSE_GAP"],
        start=state.position(),
        finish=finish,
        to_and_fro=not finish and state.to_and_fro(),
        chop_size=chop_size if finish else 0.0,
        **state.depth_step(),
        **state.feeds(),
    )
