# SPDX-License-Identifier: GPL-2.0-or-later
"""Run a program through LinuxCNC's preview interpreter (module gcode) and print its canonical calls as JSON.

    preview_probe.py PROGRAM UNITS_PER_MM TOOL_TABLE PARAMETER_FILE

The preview is what AXIS shows; unlike the program rs274 it can be a metric machine, and it hands out full doubles.
Environment: INI_FILE_NAME, HOME (an own one: it gets a tool table, ~/.tool.mmap), AXIS_MASK (7 without it),
BLOCK_DELETE (1: on). Lengths are printed in mm.
"""

import ctypes
import json
import os
import sys

import gcode


class Recorder:
    """The canon object: appends one list per call."""

    def __init__(self, units, tools, parameter_file):
        self.units, self.tools, self.parameter_file = units, tools, parameter_file
        self.calls, self.line, self.loaded = [], 0, (0, 0.0)
        self.mode, self.turned = None, (0.0, 0.0, 0.0)

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda *arguments: None

    def next_line(self, code):
        self.line = code.sequence_number
        self.mode = {
            "gcodes": list(code.gcodes),
            "feed": code.feed_rate,
            "spindle": (code.spindle, code.speed),
            "coolant": (code.mist, code.flood),
        }

    def note(self, kind, *numbers):
        self.calls.append([kind, self.line, *numbers])

    def turn(self, abc):
        """Before a move, where A, B or C is another one at its end."""
        if abc != self.turned:
            self.turned = abc
            self.note("abc", *abc)

    def straight_traverse(self, x, y, z, *rest):
        self.turn(rest[:3])
        self.note("rapid", x * 25.4, y * 25.4, z * 25.4)

    def straight_feed(self, x, y, z, *rest):
        self.turn(rest[:3])
        self.note("feed", x * 25.4, y * 25.4, z * 25.4)

    def arc_feed(self, x, y, cx, cy, turn, z, *rest):
        self.turn(rest[:3])
        self.note("arc", x * 25.4, y * 25.4, z * 25.4, cx * 25.4, cy * 25.4, turn)

    def tool_offset(self, x, y, z, *rest):
        self.note("tool offset", x * 25.4, y * 25.4, z * 25.4)

    def set_plane(self, plane):
        self.note("plane", plane)

    def dwell(self, seconds):
        self.note("dwell", seconds)

    def set_feed_rate(self, rate):
        self.note("F", rate * 25.4)

    def set_g5x_offset(self, index, x, y, z, *rest):
        self.note("g5x", x * 25.4, y * 25.4, z * 25.4)

    def set_g92_offset(self, x, y, z, *rest):
        self.note("g92", x * 25.4, y * 25.4, z * 25.4)

    def set_xy_rotation(self, angle):
        self.note("rotation", angle)

    def comment(self, text):
        self.note("comment", text, self.mode)

    def message(self, text):
        self.note("message", text)

    def change_tool(self, word):
        """Of its index in the table, or in LinuxCNC 2.10 of its number."""
        by_number = hasattr(ctypes.CDLL(gcode.__file__), "_Z11CHANGE_TOOLv")
        self.loaded = next(
            (tool for index, tool in self.tools.items() if word == (tool[0] if by_number else index)), (0, 0.0)
        )

    def get_tool(self, pocket):
        number, diameter, *offset = self.loaded if pocket == 0 else self.tools.get(pocket, (-1, 0.0))
        x, z = offset or (0.0, 0.0)
        return (number, x, 0.0, z) + (0.0,) * 6 + (diameter, 0.0, 0.0, 0)

    def get_external_length_units(self):
        return self.units

    def get_external_angular_units(self):
        return 1.0

    def get_axis_mask(self):
        return int(os.environ.get("AXIS_MASK", "7"))

    def get_block_delete(self):
        return os.environ.get("BLOCK_DELETE") == "1"

    def check_abort(self):
        return False


def read_table(path):
    """Tool table -> {index: (tool number, diameter, X and Z offset)}; indexes count the lines from 1, as the
    interpreter does."""
    tools = {}
    with open(path, encoding="utf-8") as lines:
        for line in lines:
            words = {word[0]: word[1:] for word in line.partition(";")[0].split()}
            if "T" in words:
                tools[len(tools) + 1] = (int(words["T"]), *(float(words.get(letter, "0")) for letter in "DXZ"))
    return tools


def main():
    program, units, table, parameter_file = sys.argv[1:5]
    tooldata = ctypes.CDLL("libtooldata.so.0")  # loaded by gcode already, which expects a task to have filled it
    for plain, mangled, values in (
        ("tool_mmap_creator", "_Z17tool_mmap_creatorPK13EMC_TOOL_STATi", (None, 0)),
        ("tooldata_load", "_Z13tooldata_loadPKcPPc", (table.encode(), None)),
    ):
        (getattr(tooldata, plain, None) or getattr(tooldata, mangled))(*values)  # LinuxCNC 2.10, or 2.9
    canon = Recorder(float(units), read_table(table), parameter_file)
    result, line = gcode.parse(program, canon, "G21", "G0")
    error = gcode.strerror(result) if result > gcode.MIN_ERROR else ""
    print(json.dumps({"calls": canon.calls, "error": error, "error_line": line}))


if __name__ == "__main__":
    main()
