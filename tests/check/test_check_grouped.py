# SPDX-License-Identifier: GPL-2.0-or-later
"""Findings of one cause are one line in the text, the report and the log of the filter; --json has each."""

import html
import re

import numpy as np

from chipwise.check import page
from chipwise.check.drawing import Drawing
from chipwise.check.findings import CLEARANCE, FLUTE, RAPID, Finding, Findings, grouped, grouped_notes
from chipwise.check.result import Result
from chipwise.cli.check import report

DEPTHS = [10.5, 11.0, 14.25, 12.0, 10.2, 10.9, 11.7, 13.0]
SAID = (
    "8 findings, the worst in line 13: cuts 14.25 mm deep at X2 Y0 Z-14.25, the flutes are 10 mm long; take smaller "
    "steps in Z, or a tool with "
    "longer flutes"
)


def result():
    """Eight cuts of tool 1 that are too deep, with a traverse between them, and two of tool 2."""
    found = Result("a.ngc", cell=0.5, moves=30)
    found.findings = Findings()
    for k, depth in enumerate(DEPTHS):
        found.findings.add(Finding(FLUTE, 9 + 2 * k, 9 + 2 * k, 1, (float(k), 0.0, -depth), depth, 10.0))
        if k == 4:
            found.findings.add(Finding(RAPID, 18, 18, 1, (0.0, 0.0, -1.0), 4.0))
    for line in (30, 40):
        found.findings.add(Finding(FLUTE, line, line, 2, (0.0, 0.0, -9.0), 9.0, 8.0))
    found.notes = [[5, "a note"], [7, "another"], [8, "a note"]]
    found.load = (0.5, np.array([0.0, 6000.0]))
    found.drawing = Drawing(0.5, (0.0, 0.0, -10.0), np.zeros((4, 4), np.float32), np.zeros((4, 4), np.float32))
    return found


def test_the_text():
    lines = list(report(result()))
    assert lines[0] == "a.ngc: 11 findings"
    assert lines[1:3] == ["  lines 5 to 8, 2 times: a note", "  line 7: another"]
    assert lines[3:] == [
        f"  lines 9 to 23, tool 1: {SAID}",
        "  line 18, tool 1: a traverse meets 4 mm of stock at X0 Y0 Z-1; retract higher, or use G1",
        *(
            f"  line {n}, tool 2: cuts 9 mm deep at X0 Y0 Z-9, the flutes are 8 mm long; take smaller steps in Z, or a "
            f"tool with longer "
            "flutes"
            for n in (30, 40)
        ),
    ]


def test_the_report_has_the_same_rows():
    text = page.page([result()])
    rows = [
        [html.unescape(cell) for cell in re.findall(r"<td>(.*?)</td>", row)]
        for row in text.partition("<h3>Findings</h3>")[2].splitlines()
        if "<td>" in row
    ]
    assert [row[:3] for row in rows] == [
        ["flute", "9 to 23", "1"],
        ["rapid", "18", "1"],
        ["flute", "30", "2"],
        ["flute", "40", "2"],
    ]
    assert rows[0][3:] == ["2 0 -14.25", SAID]


def test_json_has_each():
    assert len(result().json()["findings"]) == 11 and len(result().json()["notes"]) == 3


def test_the_worst_traverse_beside_stock_is_the_nearest():
    near = [Finding(CLEARANCE, n, n, 1, (0.0, 0.0, 0.0), value, 0.2) for n, value in ((1, 0.15), (2, 0.05), (3, 0.1))]
    (group,) = grouped(near)
    assert group.worst.line == 2 and group.lines == (1, 3)


def test_many_are_counted_whole():
    """What is not printed is counted in findings."""
    found = result()
    for n in range(25):
        found.findings.add(Finding(RAPID, 100 + n, 100 + n, 10 + n, None, 1.0))
    lines = list(report(found))
    assert lines[0] == "a.ngc: 36 findings" and lines[-1] == "  and 9 more; --json has all" and len(lines) == 3 + 20 + 1


def test_notes():
    assert grouped_notes([]) == [] and grouped_notes([[1, "x"], [1, "y"]]) == ["line 1: x", "line 1: y"]
