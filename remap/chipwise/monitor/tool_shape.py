# SPDX-License-Identifier: GPL-2.0-or-later
"""The tool in the spindle as the pins describe it.  Called by spindle_tool.py, shadow.py and set_up.py."""

from dataclasses import dataclass

from chipwise.tool_data.bending import largest_force, lacking, stiffness
from chipwise.tool_data.geometry import tool_geometry


@dataclass(frozen=True)
class Cutting:
    """What the edges of a tool bear; 0: unknown."""

    flutes: int = 0
    max_rate: float = 0.0  # mm3/min
    max_chip: float = 0.0  # mm
    min_chip: float = 0.0  # mm


@dataclass(frozen=True)
class Shank:
    """What is behind the edges; 0: unknown."""

    stick_out: float = 0.0  # machine units
    holder_diameter: float = 0.0  # machine units
    max_force: float = 0.0  # N
    stiffness: float = 0.0  # N/mm
    unbent: str = ""  # what the limit of its bending lacks, in words


@dataclass(frozen=True)
class Tool:
    """The tool in the spindle for the pins: machine units and degrees; 0: unknown."""

    diameter: float = 0.0
    corner_radius: float = 0.0
    tip_angle: float = 0.0
    flute_length: float = 0.0
    cutting: Cutting = Cutting()
    shank: Shank = Shank()


def tool_shape(number, diameter, path, units):
    """Tool for the pins: number and diameter (machine units) of LinuxCNC, the rest from the file
    `path`, whose lengths are mm; `units`: machine units per mm.  Raises CycleError."""
    if number <= 0 or not diameter > 0:
        return Tool()
    geometry = tool_geometry(path, number)
    if geometry is None:
        return Tool(diameter)
    radius = (geometry.corner_radius or 0.0) * units
    corner = {"ball": diameter / 2, "bull": radius, "tapered-ball": radius}.get(geometry.shape, 0.0)
    tip = geometry.tip_angle if geometry.shape in ("vee", "tapered-ball") else 0.0
    cutting = Cutting(
        geometry.flutes or 0, geometry.max_removal_rate or 0.0, geometry.chip_load or 0.0, geometry.chip_least or 0.0
    )
    shank = Shank(
        (geometry.stick_out or 0.0) * units,
        (geometry.holder_diameter or 0.0) * units,
        largest_force(diameter / units, geometry),
        stiffness(diameter / units, geometry.stick_out, geometry.material),
        lacking(geometry),
    )
    return Tool(diameter, corner, tip or 0.0, (geometry.flute_length or 0.0) * units, cutting, shank)
