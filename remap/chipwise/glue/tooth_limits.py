# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether the feed of the tool in the spindle has limits of its own, so that M251 may do without a rate.  Called by
volumetric.py.

The monitor gives the same figures to the realtime side (monitor/limits.py, tool_shape.py), which has the last word:
while none of them is known there, the spindle standing included, the feed is F (core/feed.h, 15).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipwise.tool_data.bending import largest_force
from chipwise.tool_data.chip_loads import chip_limit
from chipwise.glue import program_run
from chipwise.setup import job
from chipwise.tool_data.materials import material_of_file
from chipwise.tool_data.geometry import tool_geometry

if TYPE_CHECKING:
    from chipwise.glue.state import State


def lacking(state: State) -> str:
    """ "" if the chip, the power or the bending of the tool in the spindle is limited, else what to add.  Raises
    CycleError for a material that cannot be."""
    number = state.interp.tool_table[0].toolno
    geometry = tool_geometry(state.settings.path("TOOL_GEOMETRY"), number)
    if geometry is None or not geometry.flutes:
        return f"flutes and chip_load of tool {number} to [CHIPWISE]TOOL_GEOMETRY"
    if geometry.chip_load:
        return ""
    settings = state.settings
    program = program_run.main_file(state.interp)
    material = material_of_file(
        program, settings["MATERIAL"], settings.path("MATERIALS"), job.material_of(program, settings)
    )
    spindle = settings["SPINDLE_POWER"] or settings["SPINDLE_TORQUE"]
    diameter = state.tool_diameter()
    if material and (
        spindle or largest_force(diameter, geometry) or chip_limit(diameter, geometry, material, settings)
    ):
        return ""
    if not (spindle or settings["DEFAULT_CHIP"]):
        return f"chip_load of tool {number} to [CHIPWISE]TOOL_GEOMETRY"
    return f"chip_load of tool {number} to [CHIPWISE]TOOL_GEOMETRY, or (MATERIAL,NAME=..) to the program"
