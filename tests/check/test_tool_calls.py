# SPDX-License-Identifier: GPL-2.0-or-later
"""Which tool of the table a tool change loads: LinuxCNC 2.9 names it by its index in the table, 2.10 by its number."""

import pytest

from support.check_runs import HEAD, STOCK, chipwise_check, mill_with_tools

canon = pytest.importorskip("chipwise.program.canon", reason="no LinuxCNC for this Python")

NUMBERS = {0: 40, 1: 40, 2: 3, 3: 2, 4: 7}  # index: number of the tool; 0 is the spindle


class Table(canon.ToolTable):
    """A tool table without LinuxCNC's."""

    def __init__(self, by_number, random):
        self._by_number, self._random = by_number, random

    def entry(self, index):
        return canon.tool_entry(NUMBERS[index], 1.0) if index in NUMBERS else canon.NO_TOOL


@pytest.mark.parametrize(
    "by_number, random, word, number",
    [
        (False, False, 2, 3),
        (True, False, 2, 2),
        (False, False, 4, 7),
        (True, False, 7, 7),
        (True, False, 4, -1),
        (False, False, 0, -1),
        (True, False, 0, -1),
        (False, True, 0, 40),
        (True, True, 0, -1),
        (True, True, 40, 40),
    ],
)
def test_the_tool_is_found_by_what_this_linuxcnc_gives(by_number, random, word, number):
    assert Table(by_number, random).called(word)[0] == number


def test_a_tool_whose_place_in_the_table_is_not_its_number(tmp_path):
    """The tool that this LinuxCNC loads, in a table that is not sorted."""
    machine = mill_with_tools(tmp_path)
    (machine.parent / "mill.tbl").write_text("T7 P1 D4\nT3 P2 D6\nT2 P3 D8\n")
    text = HEAD + STOCK + "T3 M6\nF300\nG43 H3\nG0 X10 Y10\nG0 Z5\nG1 Z-1\nG1 X60\nG0 Z5\nM2\n"
    _status, out, _err, report = chipwise_check(tmp_path, {"part.ngc": text}, machine=machine)
    assert [(tool["tool"], tool["diameter_mm"]) for tool in report["programs"][0]["tools"]] == [(3, 6.0)], out
