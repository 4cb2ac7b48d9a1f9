# SPDX-License-Identifier: GPL-2.0-or-later
"""G12 / G13: words -> the fields of a HoleRequest.  Called by codes.py through session.run_cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Callable

from chipwise.pattern import mirroring

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.order import Order

WORDS = "xyzrijkqeh"


def order_of(ccw: bool) -> Callable[[State], Order]:
    """The order of G12 (ccw False) or G13 (ccw True) for session.run_cycle: State -> Order."""
    return lambda state: state.order("hole", _fields(state, ccw != mirroring.mirrored))


def _fields(state: State, ccw: bool) -> dict[str, object]:
    """Words of the line -> fields of a HoleRequest (mm)."""
    state.check_words(WORDS)
    diameter = state.tool_diameter()
    x, y = state.place()
    clearance, bottom = state.heights()
    return dict(
        x=x,
        y=y,
        bottom=bottom,
        clearance=clearance,
        radius=state.needed("i", "radius of the hole"),
        finished=state.length("k"),
        step=state.length("q"),
        ccw=ccw,
        tool_radius=diameter / 2,
        chop_size=state.chop_size(),
        start=state.position(),
        **state.depth_step(),
        **state.feeds(),
    )
