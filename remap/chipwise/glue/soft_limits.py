# SPDX-License-Identifier: GPL-2.0-or-later
"""What of the machine limits a pattern or a turned part: soft limits, and where work coordinates lie.  Called by
glue/pattern.py, glue/turning.py.

Only in the task: a preview, `chipwise try` and `chipwise check` may have other work offsets than the machine.
"""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING

import emccanon

from chipwise import ini
from chipwise.machine import limits
from chipwise.pattern.job import DEPTH

if TYPE_CHECKING:
    from chipwise.glue.state import State


def of(state: State) -> dict[str, tuple] | None:
    """What a cycles.travel.Travel is made of, as a dict; None where they are not known or do not count."""
    path = ini.file_name()
    if not state.interp.task or os.environ.get(DEPTH, "0") != "0" or not path:
        return None
    angle = math.radians(state.interp.rotation_xy)
    c, s = math.cos(angle), math.sin(angle)
    tip = state.machine_point((0.0, 0.0, 0.0))
    rotary = zip(limits.rotary_limits(path), ("AA", "BB", "CC"))
    return {
        "rotary": tuple(
            (*limit, getattr(state.interp, f"{axis}_origin_offset") + getattr(state.interp, f"{axis}_axis_offset"))
            for limit, axis in rotary
        ),
        "matrix": ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)),
        "shift": tuple(a + b for a, b in zip(tip, tool_offset(state))),
        "limits": limits.axis_limits(path),
    }


def lathe(state: State) -> tuple:
    """((name, low, high), ..) mm of Z and X; () where they are not known or do not count."""
    path = ini.file_name()
    if not state.interp.task or not path:
        return ()
    x, _, z = limits.axis_limits(path)
    return z, x


def tool_offset(state: State) -> list[float]:
    """X, Y and Z of G43, mm."""
    return [
        state.unit_mm * value
        for value in (
            emccanon.GET_EXTERNAL_TOOL_LENGTH_XOFFSET(),
            emccanon.GET_EXTERNAL_TOOL_LENGTH_YOFFSET(),
            emccanon.GET_EXTERNAL_TOOL_LENGTH_ZOFFSET(),
        )
    ]
