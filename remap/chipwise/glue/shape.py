# SPDX-License-Identifier: GPL-2.0-or-later
"""The contour sub of a line's Q word, as the interpreter would run it there.  Called by glue/contour.py,
glue/pocket.py.

The planner reads it by contour_sub/read.py; here stands only what the sub may read of the interpreter that calls it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import emccanon

from chipwise.contour_sub.job import Job
from chipwise.errors import CycleError
from chipwise.glue import named
from chipwise.glue.state import path_of
from chipwise import ini

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.program.interp import Interp

NUMBERED = range(31, 5400)  # user parameters, probe results, homes, coordinate systems; 1 to 30 are the sub's own
COUNTING = ("_line", "_call_level", "_remap_level", "_task")  # LinuxCNC's own, other at every call and never handed on


def sub_number(state: State) -> int:
    """The word Q as a number of an O-sub."""
    value = state.number("q")
    if value is None:
        raise CycleError("word Q (number of the sub) is missing", "add Q")
    if value != int(value) or value < 0:
        raise CycleError(f"Q{value:g} is not the number of a sub", "use the number of an O-sub: Q100 for O100 sub")
    return int(value)


def job(state: State, sub: int) -> Job:
    """Job for a sub called where the line stands."""
    interp = state.interp
    names = [name for name in named.global_names(interp) if name not in COUNTING and not set("[>") & set(name)]
    tool = interp.tool_table[0]
    return Job(
        program=tuple(_programs(interp)),
        sub=sub,
        ini=ini.file_name(),
        unit=state.unit,
        incremental=state.incremental,
        ijk_absolute=interp.ijk_distance_mode == 0,
        position=state.position(),
        feed=interp.feed_rate,
        machine_unit=1.0 / emccanon.GET_EXTERNAL_LENGTH_UNITS(),
        tool=(tool.toolno, tool.diameter),
        numbered=tuple((n, interp.params[n]) for n in NUMBERED if interp.params[n] != 0.0),
        named=tuple((name, interp.params[name]) for name in sorted(names)),
        close_gap=state.settings["CLOSE_GAP"],
        block_delete=bool(emccanon.GET_BLOCK_DELETE()),
    )


def _programs(interp: Interp) -> dict[str, None]:
    """The file of the line, then the files of those who called it."""
    seen = [path_of(interp)]
    for level in range(interp.call_level, -1, -1):
        try:
            seen.append(interp.sub_context[level].filename)
        except Exception:  # not offered by every version, or a path that is not UTF-8
            break
    return dict.fromkeys(path for path in seen if path)
