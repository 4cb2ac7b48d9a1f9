# SPDX-License-Identifier: GPL-2.0-or-later
"""G22 and G23: boxes that no tool of G26 and G27 enters, as far as a run and its preview both know them.

Called by codes.py through session.run_steps, by session.begin, and by glue/turning.py.  A barrier is where the machine
is, not where the work coordinates are: it is kept in machine coordinates of the tool's tip, so an offset that changes
later leaves it in place.  As with the top of the stock (program/known_stock.py), the interpreter keeps it, and it ends
with the program.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from chipwise.errors import CycleError
from chipwise.turning.request import FAR_MM, box

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.program.interp import Interp, Waits
    from chipwise.turning.profile_function import Box

COUNT = "_chipwise>barriers"  # no program can write it: to LinuxCNC's parser a name ends at ">"
MOST = 20
WORDS = "xzik"


def _name(number: int, column: int) -> str:
    return f"_chipwise>barrier_{number}_{column}"


def _count(interp: Interp) -> int:
    return int(interp.params[COUNT]) if COUNT in interp.params.globals() else 0


def on(state: State) -> Waits:
    """G22.  X has come as a radius already (LinuxCNC halves X alone under G7)."""
    state.check_words(WORDS)
    x, z = state.needed("x", "corner of the barrier"), state.needed("z", "corner of the barrier")
    half = 0.5 if state.interp.params["_lathe_diameter_mode"] else 1.0
    corners = box(x, z, half * (state.length("i") or 0.0), state.length("k"))
    if not all(map(math.isfinite, corners)) or max(abs(value) for value in corners) > FAR_MM:
        raise CycleError("a corner of the barrier is farther than {most} from zero", "correct X Z I K", most=FAR_MM)
    number = _count(state.interp)
    if number >= MOST:
        raise CycleError(f"there are {MOST} barriers already", "end them with G23")
    to_machine = shift(state)
    for column, value in enumerate(corners):
        state.interp.params[_name(number, column)] = value + to_machine[column // 2]
    state.interp.params[COUNT] = number + 1
    yield from ()


def off(state: State) -> Waits:
    """G23."""
    state.check_words("")
    forget(state.interp)
    yield from ()


def shift(state: State) -> tuple[float, float]:
    """(z, x) mm from work coordinates to machine coordinates of the tip."""
    x, _, z = state.machine_point((0.0, 0.0, 0.0))
    return z, x


def forget(interp: Interp) -> None:
    """No barrier is in force."""
    parameters = interp.sub_context[0].named_params
    for name in [name for name in interp.params.globals() if name.startswith("_chipwise>barrier")]:
        del parameters[name]


def in_work_coordinates(state: State) -> tuple[Box, ...]:
    """((z0, z1, x0, x1), ..) mm of the barriers in force."""
    params, (z, x) = state.interp.params, shift(state)
    rows = ([params[_name(number, column)] for column in range(4)] for number in range(_count(state.interp)))
    return tuple((z0 - z, z1 - z, x0 - x, x1 - x) for z0, z1, x0, x1 in rows)
