# SPDX-License-Identifier: GPL-2.0-or-later
"""The tool in the spindle as the pins describe it.  Called by spindle_tool.py, shadow.py and set_up.py."""

from chipwise.tool_data.bending import largest_force, lacking, stiffness
from chipwise.tool_data.geometry import tool_geometry


class Tool:
    """The tool in the spindle for the pins: machine units and degrees, mm3/min; 0: unknown."""

    def __init__(self, diameter=0.0, corner_radius=0.0, tip_angle=0.0, flute_length=0.0, flutes=0, max_rate=0.0, max_chip=0.0, min_chip=0.0,
                 stick_out=0.0, holder_diameter=0.0, max_force=0.0, stiffness=0.0, unbent=''):
        self.diameter = diameter
        self.corner_radius = corner_radius
        self.tip_angle = tip_angle
        self.flute_length = flute_length
        self.flutes = flutes
        self.max_rate = max_rate
        self.max_chip, self.min_chip = max_chip, min_chip       # mm
        self.stick_out, self.holder_diameter = stick_out, holder_diameter
        self.max_force, self.stiffness = max_force, stiffness   # N, N/mm
        self.unbent = unbent            # what the limit of its bending lacks, in words


def tool_shape(number, diameter, path, units):
    """Tool for the pins: number and diameter (machine units) of LinuxCNC, the rest from the file
    `path`, whose lengths are mm; `units`: machine units per mm.  Raises CycleError."""
    if number <= 0 or not diameter > 0:
        return Tool()
    geometry = tool_geometry(path, number)
    if geometry is None:
        return Tool(diameter)
    corner = {'ball': diameter / 2, 'bull': (geometry.corner_radius or 0.0) * units,
              'tapered-ball': (geometry.corner_radius or 0.0) * units}.get(geometry.shape, 0.0)
    tip = geometry.tip_angle if geometry.shape in ('vee', 'tapered-ball') else 0.0
    return Tool(diameter, corner, tip or 0.0, (geometry.flute_length or 0.0) * units, geometry.flutes or 0,
                geometry.max_removal_rate or 0.0, geometry.chip_load or 0.0, geometry.chip_least or 0.0,
                (geometry.stick_out or 0.0) * units, (geometry.holder_diameter or 0.0) * units, largest_force(diameter / units, geometry),
                stiffness(diameter / units, geometry.stick_out, geometry.material), lacking(geometry))
