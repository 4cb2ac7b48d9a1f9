# SPDX-License-Identifier: GPL-2.0-or-later
"""A line typed in the page of `chipwise panel` in a real browser, beside a real LinuxCNC: shown at its field, drawn,
run by MDI or refused."""

import json
import math

import pytest

from chipwise.headless import runner
from support import panel_browser
from support.operate import BOX, operate, printed

pytestmark = [
    pytest.mark.machine,
    pytest.mark.together("panel browser"),
    pytest.mark.skipif(panel_browser.missing() != "", reason=panel_browser.missing() or "a browser"),
]

URL, TOKEN = "http://127.0.0.1:8250", "correct-horse-7"
BROWSER = f"{runner.ROOT}/tests/support/panel_browser.py"
DISC = math.pi * 8**2 * 3  # mm3: the tool goes down in the middle
HOLE = ["G13", "30,20,8,-3,1,,,,,600"]
LONG = "G21 G90 G54\nG1 Z11 F2\nM2\n"  # 10 mm up: five minutes
TOUCH_PX = 9 / 25.4 * 96  # 9 mm


def entry(folder, *lines):
    own = folder / f"browser{len(list(folder.glob('browser*')))}"
    own.mkdir(mode=0o777)
    own.chmod(0o777)
    return ["program", BROWSER, URL, str(own), TOKEN, json.dumps(lines)]


def check_tools(still, cutting, file, flute_length):
    """Tool 1 is changed at rest, in the file and in the stock tracker; with reasons where it is not."""
    number, zero, saved = still["said"]
    assert (
        number == "Flute length: x is not a number; write it with a point: 12.5"
        and "flute_length = 0 is not a length above 0 mm" in zero
    )
    assert (
        saved == "Tool 1: saved in tools.toml"
        and still["rows"][0] == ["1", "flat", "-", "-", "21.5", "2", "12", *["-"] * 6]
        and len(still["rows"]) == 8
    )
    assert "the tool is not changed: a program or a command is under way" in cutting["said"][2]
    for one in (still, cutting):
        assert one["overflow"] == [1024, 768] and not [
            target for target in one["targets"] if min(target[1:]) < TOUCH_PX
        ]
    lines = (
        open(f"{runner.ROOT}/configs/tools.toml", encoding="utf-8")
        .read()
        .replace("flute_length = 20", "flute_length = 21.5", 1)
    )
    assert (
        file[0] == 0
        and file[1].startswith(lines.rstrip())
        and ".bak" in file[1]
        and float(flute_length[0]) == pytest.approx(21.5)
    )


def _lines(folder):
    """Steps: lines on the page at rest, while another one runs, and in chops."""
    return [
        ["mdi", "G21 G90 G54 T1 M6"],
        ["mdi", "G10 L2 P1 X0 Y0 Z-20"],
        ["mdi", "G0 X5 Y5 Z8"],
        ["mdi", BOX],
        ["pins", "stock-tracker.0.removed-volume"],
        entry(folder, ["G13", "30,20,0,-3"], ["G13", "30,20,2,-3"], HOLE),
        ["until", "stock-tracker.0.removed-volume", ">", 0.995 * DISC],
        ["finish"],
        ["pins", "stock-tracker.0.removed-volume"],
        ["start", LONG],
        ["until", "axis.z.pos-cmd", ">", -18.9],
        entry(folder, HOLE),
        ["abort"],
        ["sleep", 1],
        ["pins", "stock-tracker.0.removed-volume"],
        ["mdi", BOX],
        entry(folder, [*HOLE, "6"]),
        ["until", "stock-tracker.0.removed-volume", ">", 0.95 * DISC],
        ["program", "sh", "-c", "cat tools.toml; ls"],
        ["pins", "stock-tracker.0.tool-flute-length"],
    ]


def _judge_lines(lines):
    """Those at rest; -> the one that ran."""
    locked, wrong, small, hole = lines
    assert not locked["run"] and "field 3, I (radius): 0 is not above 0" in wrong["says"] and not wrong["run"]
    assert [row.split()[:3] for row in wrong["wrong"]] == [["3", "I", "radius,"]] and len(wrong["rows"]) == 11
    assert (
        "radius I2 mm is not larger than the tool radius 3 mm" in small["says"]
        and small["wrong"][0].startswith("3 I")
        and not small["run"]
    )
    assert hole["line"] == "G13 X30 Y20 I8 Z-3 R1 F600" and hole["drawn"] > 100 and hole["says"].startswith("cuts: ")
    assert hole["run"] and hole["ran"] == "running; Stop on the screen of LinuxCNC ends it" and not hole["wrong"]
    return hole


def test_lines_of_the_page(tmp_path):
    answers = operate(
        tmp_path, _lines(tmp_path), speed=1, timeout=900, edit=f"s/^PANEL = yes/PANEL = yes\\nPANEL_TOKEN = {TOKEN}/"
    )
    found = printed(answers[5])
    hole = _judge_lines(found["lines"])
    assert float(answers[8][0]) - float(answers[4][0]) == pytest.approx(DISC, rel=0.005)
    assert found["overflow"] == [1024, 768] and not [
        text for text in found["messages"] if "403" not in text and "/tool " not in text
    ]
    assert len(found["targets"]) > 10 and not [one for one in found["targets"] if min(one[1:]) < TOUCH_PX]
    for one in printed(answers[11])["lines"][1:]:
        assert "a program or a command is under way" in one["says"] and not one["run"] and one["line"]
    assert answers[8] == answers[14]
    check_tools(found["tools"], printed(answers[11])["tools"], *answers[18:20])
    for refused in printed(answers[11])["guards"]:
        assert refused[0] == "Guard of flutes: on" and "program or a command is under way" in refused[1]
    chopped = printed(answers[16])["lines"][-1]
    assert (
        chopped["line"] == "#<_chipwise_chop_size>=6 " + hole["line"]
        and "chop lines: " in chopped["says"]
        and chopped["ran"].startswith("running")
    )
    assert found["guards"] == [
        ["Guard of flutes: off", ""],
        ["Guard of flutes: on", ""],
    ]  # the pin, as the server reads it
