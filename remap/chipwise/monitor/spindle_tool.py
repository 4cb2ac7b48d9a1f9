# SPDX-License-Identifier: GPL-2.0-or-later
"""The tool in the spindle -> pins: the part of worker.py's Monitor that follows it.

Its number comes from LinuxCNC's status, its shape from the file [CHIPWISE]TOOL_GEOMETRY; a change of either is seen at
the next look.
"""

import os

from chipwise.host.clock import patience
from chipwise.errors import CycleError, unnamed
from chipwise.monitor.tool_shape import Tool, tool_shape
from chipwise.monitor.watcher import Watcher
from chipwise.tool_data.geometry import tool_geometry

DIFFER_S = 1.0  # tool numbers of HAL and status that differ for longer are a property of the machine


class SpindleTool(Watcher):
    """The base of the Monitor."""

    def __init__(self, linuxcnc, component, settings):
        super().__init__(linuxcnc, component, settings)
        self.said_tool = self.noted_tool = None
        self.noted_rates = set()
        self.machine_tool = 0  # iocontrol.0.tool-number, before the last look at the status
        self.differ_since = None  # since when the tool numbers of HAL and status differ

    def acknowledge_tool(self, machine_tool, number, now):
        """The machine's own tool number, read before the status, -> tool-followed, once the status has the same number
        some ms later.  Two numbers that differ for DIFFER_S are a property of the machine."""
        if machine_tool == number:
            self.differ_since = None
        elif self.differ_since is None or self.differ_since[0] != (machine_tool, number):
            self.differ_since = (machine_tool, number), now
        if self.differ_since is None or now - self.differ_since[1] > patience(DIFFER_S):
            self.component["tool-followed"] = machine_tool

    def follow_tool(self, now):
        """Tool in the spindle -> pins; after any error the tool is unknown."""
        try:
            self.describe_tool()
        except Exception:
            self.show_tool(self.status.tool_in_spindle, Tool())
            raise
        finally:
            self.acknowledge_tool(self.machine_tool, self.status.tool_in_spindle, now)

    def describe_tool(self):
        """Tool in the spindle -> pins; an error in its description is reported once."""
        tool = self.status.tool_table[0]
        number = self.status.tool_in_spindle
        path = self.settings.path("TOOL_GEOMETRY")
        try:
            shape = tool_shape(number, tool.diameter, path, self.units)
            self.said_tool = None
            self.note_unknown_tool(number, path)
            self.note_old_rate(number, path)
        except CycleError as error:
            shape = Tool()
            if self.said_tool != str(error):
                self.said_tool = str(error)
                self.say(unnamed(error) + "; the feed is at most F")
        self.show_tool(number, self.as_set_up(number, shape))

    def show_tool(self, number, shape):
        pins = self.component
        pins["tool-number"] = number
        pins["tool-corner-radius"] = shape.corner_radius
        pins["tool-tip-angle"] = shape.tip_angle
        pins["tool-flute-length"] = shape.flute_length
        cutting, shank = shape.cutting, shape.shank
        pins["tool-stick-out"], pins["tool-holder-diameter"] = shank.stick_out, shank.holder_diameter
        pins["tool-flutes"], pins["max-chip"] = cutting.flutes, cutting.max_chip or self.default_chip(number, shape)
        pins["min-chip"], pins["tool-max-rate"] = cutting.min_chip, cutting.max_rate
        pins["max-force"], pins["tool-stiffness"] = shank.max_force, shank.stiffness
        self.note_bending(number, shape)
        pins["tool-diameter"] = shape.diameter

    def as_set_up(self, _number, shape):
        """A tool that the tool table lacks as the program's set-up or comments describe it."""
        return shape

    def default_chip(self, _number, _shape):
        """mm of a tool without chip_load; 0: none."""
        return 0.0

    def note_bending(self, _number, _shape):
        """Tell what the limit of a tool's bending lacks."""

    def note_unknown_tool(self, number, path):
        """A tool that is not in the geometry file is treated as a flat end mill: reported once per tool change."""
        unknown = bool(path) and number > 0 and tool_geometry(path, number) is None
        if unknown and self.noted_tool != number:
            self.inform(
                f"{os.path.basename(path)}: tool {number} is missing and treated as a flat end mill of unknown flute "
                f"length; add [tool.{number}] if that is wrong"
            )
        self.noted_tool = number if unknown else None

    def note_old_rate(self, number, path):
        """A tool in the spindle whose rate is in the old unit: reported once for each."""
        geometry = tool_geometry(path, number) if path and number > 0 else None
        if geometry and geometry.note and geometry.note not in self.noted_rates:
            self.noted_rates.add(geometry.note)
            self.inform(geometry.note)
