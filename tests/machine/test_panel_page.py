# SPDX-License-Identifier: GPL-2.0-or-later
"""`chipwise panel` beside a real LinuxCNC that cuts: the right numbers and heights, and what happens when one of the
two dies."""

import csv
import json
import math
import os

import pytest

from chipwise import version
from chipwise.headless import runner
from support.operate import CELL_MM, operate, printed

pytestmark = pytest.mark.machine

URL = "http://127.0.0.1:8250"
CLIENT = os.path.join(runner.ROOT, "tests", "support", "panel_client.py")
# A slot 6 mm wide and 4 mm deep along Y20: 24 mm2, so 6 cm3/min are 250 mm/min.
SLOT = (
    "G21 G90 G64 P0.01\nT1 M6\nM250 P0 Q0 R-10 I60 J40 K10\nS1000 M3\nF600\nG0 X-10 Y20 Z5\nG1 Z-4\nM251 P1 Q6\n"
    "G1 X50\nG0 Z5\nM2\n"
)
PLACES = ["10,20", "10,16.5", "55,20"]  # in the slot, beside it, before it
PANELS = 'for p in $(pgrep -f "[c]hipwise panel"); do echo $p; done'
KILL = f'for p in $({PANELS}); do kill -9 $p; done; while [ "$({PANELS})" ]; do sleep 0.1; done'
GONE = f'for i in $(seq 6000); do [ -z "$({PANELS})" ] && exit 0; sleep 0.1; done; exit 1'
AGAIN = (
    f"{runner.ROOT}/bin/chipwise panel >/dev/null 2>&1 & for i in $(seq 3000); do {CLIENT} {URL} 0 2>/dev/null && "
    f"exit 0; sleep 0.1; done; exit 1"
)
X = "axis.x.pos-cmd"
UNTIL = "for i in $(seq 3000); do {} && break; sleep 0.1; done"


def look(seconds=0.5, *awaited):
    return ["program", CLIENT, URL, str(seconds), *awaited, *PLACES]


def looks_of(path):
    """(state, heights) of a look within the slot, the s that the panel was late at most.

    At the look before the tip was past the first place, too: the tiles come behind a look's state."""
    seen = json.loads(path.read_text())
    for (before, _heights), (state, heights) in zip(seen["looks"], seen["looks"][1:]):
        if state["stock"] and before["tip"][0] > 14 and 20 < state["tip"][0] < 48:
            return state, heights, seen["gap_s"]
    raise AssertionError([state["tip"] for state, _heights in seen["looks"]])


def check_log(path, program, late_s):
    """The row of the one tool."""
    with open(path, newline="", encoding="utf-8") as file:
        (tool,) = csv.DictReader(file)
    assert (tool["tool"], tool["reference_cm3_min"], tool["stops"], tool["program"]) == ("1", "6.0", "0", program)
    # each tool's times are those of the panel's looks: at both ends of the slot one may be late
    cutting_s, slowed_s = float(tool["cutting_s"]), float(tool["slowed_s"])
    assert cutting_s == pytest.approx(12.5, abs=1.25 + late_s) and slowed_s == pytest.approx(12.5, abs=1.25 + late_s)
    assert float(tool["mean_cm3_min"]) == pytest.approx(
        60 * float(tool["removed_cm3"]) / cutting_s, rel=0.02
    ) and float(tool["mean_cm3_min"]) == pytest.approx(6, rel=0.05 + late_s / 12.5)
    assert float(tool["diameter_mm"]) == 6


def test_numbers_and_heights_while_it_cuts(tmp_path):
    """250 mm/min: 12.5 s for a panel that is late."""
    seen = tmp_path / "seen.json"
    watch = f"{CLIENT} {URL} run {seen} {' '.join(PLACES)} </dev/null >/dev/null 2>&1 &"
    answers = operate(
        tmp_path,
        [
            ["start_line"],  # the panel is there
            ["program", "sh", "-c", f"{watch} {UNTIL.format(f'[ -s {seen} ]')}"],
            ["start", SLOT.replace("Y20 Z5", "Y20 Z5 M0")],
            ["until paused"],
            ["until", "chipwise-monitor.program-running", "=", 1],  # sums and log begin, and miss nothing of the cut
            look(0.5, "runs"),
            ["resume"],
            ["finish"],
            look(),
            ["program", "sh", "-c", f"{UNTIL.format(f'grep -q [0-9]}}$ {seen}')}; {PANELS}"],
        ],
        speed=1,
        edit=f"s#^PANEL = yes#PANEL = yes\\nPANEL_LOG = {tmp_path}/load.csv#",
    )
    (state, heights, late_s), after = looks_of(seen), printed(answers[8])
    print(f"looks are {late_s:.2f} s apart at most")
    assert state["mrr"] == pytest.approx(6000, rel=0.05) and state["target"] == 6000 and state["mode"] == "limit"
    assert (
        state["limited_by"] == "stock"
        and state["background"] == "limited"
        and state["tool"] == 1
        and state["tool_diameter"] == 6
    )
    assert state["current_vel"] == pytest.approx(250 / 60, rel=0.05) and state["override"] == pytest.approx(
        250 / 600, rel=0.05
    )
    assert state["area"] == pytest.approx(24, rel=0.05) and state["depth"] == pytest.approx(4, abs=1e-6)
    assert state["task"]["running"] and state["line"] == 9 and state["alarms"] == []
    assert state["run"]["mean"] == pytest.approx(6000, rel=0.1) and 5900 < state["run"]["peak"] < 6400
    assert any(
        place == pytest.approx([-10, 20, -4], abs=0.1) for place in after["path"]
    )  # the page draws on from there to the tip
    assert state["tip"][1:] == pytest.approx([20, -4], abs=0.01) and state["tip"][0] > 20
    rows, columns = math.ceil(40 / CELL_MM), math.ceil(60 / CELL_MM)
    assert after["map"] == dict(epoch=1, rows=rows, columns=columns, cell=CELL_MM, x=0, y=0, bottom=-10, top=0)
    assert heights == pytest.approx([-4, 0, 0], abs=2e-4)
    assert after["heights"] == pytest.approx([-4, 0, 0], abs=2e-4) and not after["state"]["task"]["running"]
    assert after["state"]["removed"] == pytest.approx(24 * 50 + 4 * 3**2 * 3.14159 / 2, rel=0.01)
    saved = after["state"]["run"]["saved"]  # 50 mm at 250 for 600 mm/min, from the edge of the stock on
    assert saved == pytest.approx(-(50 / (250 / 60) - 50 / 10), rel=0.15)
    assert answers[7] == [] and len(answers[9][1].split()) == 1
    check_log(tmp_path / "load.csv", state["task"]["program"], late_s)


def test_the_stock_before_a_program(tmp_path):
    """A program without a stock of its own begins with that of the last one; the same program with its M250 again with
    a whole one."""
    other = "G21 G90\nF600\nG0 Z5\nG0 X0\nM0\nG1 X50\nM2\n"
    answers = operate(
        tmp_path,
        [
            ["start", SLOT],
            ["finish"],
            look(),  # the panel has seen what the first one has left, however late it is, and then the others run
            ["start", other],
            ["until paused"],
            look(),
            ["resume"],
            ["finish"],
            ["start", SLOT.replace("G1 X50", "G1 X10\nM0\nG1 X50")],
            ["until paused"],
            look(),
            ["abort"],
        ],
    )
    assert (
        printed(answers[5])["before"] == math.ceil(40 / CELL_MM) * math.ceil(60 / CELL_MM)
        and printed(answers[10])["before"] == 0
    )


# Two holes, a slot with the volumetric feed and its end without, and a slot of another tool
OPERATIONS = (
    "G21 G90 G64 P0.01\nT1 M6\nM250 P0 Q0 R-10 I60 J40 K10\nS1000 M3\nF600\nG0 X30 Y20 Z5\nG13 X30 Y20 I8 Z-3 R1\n"
    "G13 X12 Y12 I6 Z-3 R1\n"
    "G0 X-10 Y36\nG1 Z-2\nM251 P1 Q6\nG1 X50\nM252\nG1 X58 F60\nG0 Z5\nT2 M6\nG0 X-10 Y28\nG1 Z-1\nG1 X20 F200\nG0 Z5\n"
    "M2\n"
)


def test_the_log_of_operations(tmp_path):
    answers = operate(
        tmp_path,
        [["start", OPERATIONS], ["finish"], look(), ["pins", "stock-tracker.0.removed-volume"]],
        speed=1,
        edit=f"s#^PANEL = yes#PANEL = yes\\nPANEL_LOG = {tmp_path}/load.csv#",
    )
    assert answers[1] == []
    with open(tmp_path / "load_operations.csv", newline="", encoding="utf-8") as file:
        every = list(csv.DictReader(file))
    # a busy computer looks late: what was cut until then counts for the operation after it, which can be one in air,
    # whose peak is 0
    rows = [row for row in every if float(row["peak_cm3_min"]) > 0]
    assert [(row["code"], row["line"], row["tool"], row["mode"]) for row in rows] == [
        ("G13", "7", "1", "off"),
        ("G13", "8", "1", "off"),
        ("", "12", "1", "limit"),
        ("", "14", "1", "off"),
        ("", "19", "2", "off"),
    ]
    assert [row["operation"] for row in every] == list("1234567"[: len(every)]) and {
        row["complete"] for row in every
    } == {"yes"}
    slot, end = rows[2:4]
    assert (slot["reference_cm3_min"], slot["limited_by"], end["reference_cm3_min"], end["limited_by"]) == (
        "6.0",
        "stock",
        "",
        "nothing",
    )
    # so the mean can be lower, and the peak not
    assert (
        float(slot["peak_cm3_min"]) == pytest.approx(6, rel=0.1)
        and float(end["mean_cm3_min"]) < float(slot["mean_cm3_min"]) < 6.6
    )
    for row in rows:
        assert float(row["mean_cm3_min"]) == pytest.approx(
            60 * float(row["removed_cm3"]) / float(row["cutting_s"]), rel=0.03
        ), row
    assert sum(float(row["removed_cm3"]) for row in every) == pytest.approx(float(answers[3][0]) / 1000, rel=0.02)


def test_a_rapid_into_stock_is_an_alarm(tmp_path):
    program = SLOT.replace("G0 Z5\nM2", "G0 Y35\nM2")
    answers = operate(
        tmp_path,
        [
            ["start", program],
            ["until", "chipwise-guard.0.stop", ">", 0.5],
            look(0.5, "alarm"),
            ["abort"],
            look(0.5, "ended"),
        ],
        edit="s/^PANEL = yes/PANEL = yes\\nPANEL_TOKEN = correct-horse-7/",
    )
    (alarm,) = printed(answers[2])["state"]["alarms"]
    assert alarm["active"] and alarm["what"].startswith("rapid stopped") and alarm["line"] == 10 and alarm["tool"] == 1
    assert alarm["remedy"].startswith("press Stop") and printed(answers[2])["state"]["background"] == "alarm"
    (alarm,) = printed(answers[4])["state"]["alarms"]
    assert not alarm["active"] and not alarm["cleared"]


def test_the_panel_is_killed(tmp_path):
    """LinuxCNC goes on; `chipwise panel` in a shell serves again."""
    answers = operate(
        tmp_path,
        [
            ["start", SLOT],
            ["until", X, ">", 5],
            look(0),
            ["program", "sh", "-c", KILL],
            ["finish"],
            ["position"],
            ["program", "sh", "-c", AGAIN],
        ],
    )
    printed(answers[2])
    assert answers[3] == [0, ""] and answers[4] == [] and answers[5] == pytest.approx([50, 20, 5])
    assert printed(answers[6])["state"]["removed"] > 1000


def test_linuxcnc_is_killed(tmp_path):
    """The panel ends by itself, though nobody asks it to."""
    answers = operate(
        tmp_path, [["start", SLOT], ["until", X, ">", 5], look(0), ["kill", "rtapi_app"], ["program", "sh", "-c", GONE]]
    )
    assert answers[4][0] == 0


def test_without_a_panel(tmp_path):
    answers = operate(
        tmp_path, [["program", "sh", "-c", PANELS], ["start_line"]], edit="s/^PANEL = yes/PANEL = no/", home=False
    )
    assert answers == [[0, ""], f"chipwise: version {version()} is running"]


def test_without_a_setting_the_page_is_there_and_the_operator_reads_where(tmp_path):
    answers = operate(tmp_path, [["start_line"], look(), ["errors"]], edit="/^PANEL = yes/d")
    assert answers[0] == f"chipwise: version {version()} is running; stock, load and alarms are at {URL}"
    assert printed(answers[1])["state"]["task"]["state"] == "on" and answers[2] == []


def test_the_port_is_taken(tmp_path):
    """LinuxCNC starts and runs all the same; the log has the reason and the remedy."""
    taken = "import socket; socket.create_connection(('127.0.0.1', 8250))"
    taker = (
        "{ /usr/bin/python3 -m http.server 8250 --bind 127.0.0.1 >/dev/null 2>&1 & "
        f'until /usr/bin/python3 -c "{taken}" 2>/dev/null; do sleep 0.1; done; }}'
    )
    answers = operate(tmp_path, [["start_line"], ["mdi", "G0 X1"], ["program", "sh", "-c", GONE]], before=taker)
    words = (
        "the panel cannot use port 8250 of 127.0.0.1: Address already in use; end the program that uses it, or set "
        "[CHIPWISE]PANEL_PORT to a free one"
    )
    assert (
        answers[0] == f"chipwise: version {version()} is running; {words}" and answers[1] == [] and answers[2][0] == 0
    )
    assert "chipwise: " + words in (tmp_path / "linuxcnc.txt").read_text()
