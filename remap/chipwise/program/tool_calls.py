# SPDX-License-Identifier: GPL-2.0-or-later
"""What LinuxCNC's interpreter calls about tools, as TOOL and LENGTH records.  Called by reader_runner.py, whose Canon
has the job, the tool table and _event()."""

from chipwise.program.records import LENGTH, TOOL
from chipwise.program.canon import INCH


class ToolCalls:
    """Part of a Canon: job, exact, tools (ToolTable), spindle (the numbers of get_tool() of the tool in it)."""

    def change_tool(self, word):
        self.spindle = self.tools.called(word)
        self._tool_event()

    def _tool_event(self, number=None):
        """The tool in the spindle; number: of one that is assumed."""
        number, had = (max(0, self.spindle[0]), self.spindle[10]) if number is None else (number, 0.0)
        self._event(
            TOOL, number, had / self.job["units_per_mm"] if had > 0 else self.job["diameters"].get(str(number), 0.0)
        )

    def tool_offset(self, *offsets):
        if self.job["judged"] and not self.exact:
            self._event(LENGTH, *(value * INCH for value in offsets[:3]))

    def change_tool_number(self, word):
        self.change_tool(word)

    def get_tool(self, index):
        return self.spindle if index == 0 else self.tools.entry(index)
