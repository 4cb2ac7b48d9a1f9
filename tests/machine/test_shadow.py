# SPDX-License-Identifier: GPL-2.0-or-later
"""A stock that is assumed for a loaded program ([CHIPWISE]SHADOW): it is cut, nothing acts on it, the machine moves as
without chipwise."""

import numpy as np
import pytest

from chipwise.clib import core
from support.headless_rig import WITH_LOG, motion_rows
from support.operate import BOX, operate

pytestmark = pytest.mark.machine

# A traverse in the middle of what is assumed: with M250 the guard stops it.  G61 for the first move: else it begins
# half as fast if the task has sent the second one in time, as a blend.
PROGRAM = """(T1 D=6. CR=0. - ZMIN=-4. - flat end mill)
G21 G90
T1 M6
G61 G0 X0 Y0 Z5
G64 P0.01
G1 Z-4 F600
G1 X30 F900
G2 X30 Y20 I0 J10
G1 X0
G0 X0 Y10
G0 X20
G0 Z5
M2
"""
STATE = [
    "pins",
    "stock-tracker.0.stock-defined",
    "stock-tracker.0.certain",
    "stock-tracker.0.removed-volume",
    "chipwise-guard.0.reason",
    "volumetric-feed.0.air-time",
    "volumetric-feed.0.cut-time",
]
SHADOW = WITH_LOG + "\ns/^KEEP_STOCK = .*/KEEP_STOCK = no\\nSHADOW = {}/"


def test_it_is_cut_and_nothing_acts(tmp_path):
    """The stock is there when the program is loaded, and is cut; the rows are those of a machine without it; M251 finds
    no stock; M250 is certain."""
    path = tmp_path / "part.ngc"
    path.write_text(PROGRAM)
    home, ran = ["mdi", "G0 X-10 Y-10 Z20"], ["log", str(path)]
    off = operate(tmp_path, [home, ran, STATE, ["messages"], home, ran], edit=SHADOW.format("no"), speed=1)
    on = operate(
        tmp_path,
        [
            home,
            ["open", str(path)],
            ["messages", "a stock is assumed"],
            STATE,
            ran,
            STATE,
            home,
            ran,
            STATE,
            home,
            ["mdi", "M251 Q6"],
            ["mdi", BOX],
            STATE,
            ran,
        ],
        edit=SHADOW.format("yes"),
        speed=1,
    )
    _, (errors, log_off), none, quiet, _, (_, second_off) = off
    assert none[:2] == ["FALSE", "FALSE"] and errors == [] and not any("assumed" in text for text in quiet)
    _, _, said, before, (errors, log_on), after, _, (_, second_on), goes_on, _, m251, _, certain, stopped = on
    assert said == [
        "chipwise: part.ngc: a stock is assumed from its path, from -3 -3 -4 to 33 23 0 mm, and nothing acts on it; "
        "define it with M250"
    ]
    assert before[:3] == ["TRUE", "FALSE", "0"] and errors == []
    assert after[:2] == ["TRUE", "FALSE"] and after[3] == "0"
    assert float(after[2]) > 2000 and float(after[4]) > 0 and float(after[5]) > 1
    assert goes_on[:3] == after[:3]  # the same path in the same stock
    assert any("no stock is defined" in text for text in m251)
    assert stopped == "failed: a guard has stopped the program (line 10)"
    assert certain[:3] == ["TRUE", "TRUE", "0"]
    rows = [motion_rows(log) for log in (log_off, second_off, log_on, second_on)]
    assert len(rows[0]) > 5000
    for other in rows[1:]:
        assert len(other) == len(rows[0]) and np.abs(other - rows[0]).max() == 0.0


def _file(folder, name, body, head="T1 M6"):
    path = folder / name
    path.write_text(f"G21 G90\n{head}\nS5000 M3\nG0 X0 Y0 Z5\n{body}\nG0 Z5\nM2\n")
    return str(path)


def _second_volume():
    """mm3 that deeper.ngc cuts behind rough.ngc, by the core in one stock that is large enough from the beginning."""
    stock, volumes = core.Stock((-3, -3, -6), (33, 11.5, 0), 0.1), []
    for diameter, path in ((6.0, [(0, 0, -4), (30, 0, -4)]), (3.0, [(0, 0, -6), (30, 0, -6), (30, 10, -6)])):
        cutter = core.Cutter(stock, core.Tool(diameter), (0, 0, 5))
        for place in path:
            cutter.to(place)
        cutter.run()
        volumes.append(stock.volume())
    return volumes[0] - volumes[1]


def _one_file_a_tool(rough, deeper, level, unknown):
    """Steps: each file is opened, and what is removed is looked at."""
    removed = [
        "pins",
        "stock-tracker.0.stock-defined",
        "stock-tracker.0.certain",
        "stock-tracker.0.removed-volume",
        "chipwise-monitor.parts",
    ]
    new_part = [
        ["hal", "setp", "chipwise-monitor.new-part", "1"],
        ["until", "chipwise-monitor.parts", ">", 0],
        ["hal", "setp", "chipwise-monitor.new-part", "0"],
    ]
    return [
        ["mdi", "T0 M6"],
        ["open", rough],
        ["messages", "rough.ngc: "],
        ["log", rough],
        removed,
        ["open", deeper],
        ["messages", "deeper.ngc goes on"],
        removed,
        ["log", deeper],
        removed,
        ["open", level],
        ["messages", "level.ngc: "],
        removed,
        *new_part,
        removed,
        ["open", deeper],
        ["messages", "deeper.ngc: a stock"],
        removed,
        ["open", level],
        ["messages", "level.ngc: "],
        ["mdi", "G10 L2 P1 X100"],
        ["until", "stock-tracker.0.stock-defined", "=", 0],
        ["mdi", "T0 M6"],
        ["open", unknown],
        ["messages", "unknown.ngc: no stock"],
        ["mdi", "T1 M6"],
        ["messages", "unknown.ngc: a stock"],
        removed,
    ]


def test_one_file_a_tool(tmp_path):
    """The second file goes on in the stock of the first, though it is deeper and wider; New part makes it whole; a file
    without a depth ends it at another offset only; a file with an unknown tool asks for it, and has its stock as soon
    as the tool is in the spindle."""
    rough, deeper = (
        _file(tmp_path, "rough.ngc", "G1 Z-4 F900\nX30"),
        _file(tmp_path, "deeper.ngc", "G1 Z-6 F900\nX30\nY10", "T2 M6"),
    )
    level, unknown = (
        _file(tmp_path, "level.ngc", "G0 Z0\nG1 X30 F900"),
        _file(tmp_path, "unknown.ngc", "G1 Z-2 F900\nX40 Y2", ""),
    )
    answers = operate(tmp_path, _one_file_a_tool(rough, deeper, level, unknown), edit=SHADOW.format("yes"), speed=1)
    first, said, before, after = answers[4], answers[6], answers[7], answers[9]
    assert first[:2] == ["TRUE", "FALSE"] and float(first[2]) == pytest.approx(30 * 6 * 4 + np.pi * 9 * 4, rel=0.01)
    assert (
        said[-1]
        == "chipwise: deeper.ngc goes on in the assumed stock of rough.ngc, which is larger now; press New part for "
        "another one"
    )
    assert before[:2] == ["TRUE", "FALSE"] and float(before[2]) == pytest.approx(float(first[2]), abs=1e-3)
    assert float(after[2]) - float(before[2]) == pytest.approx(_second_volume(), rel=0.01)
    assert (
        "level.ngc: no stock is assumed: no stock is defined, and the program feeds at one height only"
        in answers[11][-1]
        and answers[12][:3] == after[:3]
    )
    assert answers[16][0] == "TRUE" and answers[16][3] == "1"
    assert "deeper.ngc: a stock is assumed from its path" in answers[18][-1] and answers[19][:3] == [
        "TRUE",
        "FALSE",
        "0",
    ]
    assert answers[26][-1] == (
        "chipwise: unknown.ngc: no stock is assumed: no tool is in the spindle (tool 0), and the program's comments "
        "name none; "
        "call the tool with T.. M6 first, or give it a D in the tool table"
    )
    assert answers[-1][:3] == ["TRUE", "FALSE", "0"]
