# SPDX-License-Identifier: GPL-2.0-or-later
"""The page of `chipwise panel` in a real browser, beside a real LinuxCNC that cuts: numbers, colours, alarms, token,
languages."""

import os

import pytest

from chipwise.headless import runner
from support import panel_browser
from support.operate import operate, printed

pytestmark = [
    pytest.mark.machine,
    pytest.mark.together("panel browser"),
    pytest.mark.skipif(panel_browser.missing() != "", reason=panel_browser.missing() or "a browser"),
]

URL, TOKEN = "http://127.0.0.1:8250", "correct-horse-7"
BROWSER = os.path.join(runner.ROOT, "tests", "support", "panel_browser.py")
# A slot 6 mm wide and 4 of 10 mm deep along the middle of 60 x 40 mm; 24 mm2 at 0.1 cm3/min are 4.17 mm/min: 6 min 50
# s, longer than a visit on a busy computer.  What is before M251 is so slow that the panel sees it on one.
RATE, AREA, BEFORE = 0.1, 24, 150  # cm3/min, mm2, mm/min
CUT = (
    "G21 G90 G64 P0.01\nT1 M6\nM250 P0 Q0 R-10 I60 J40 K10\nS1000 M3\nF600\nG0 X-10 Y20 Z5\nG1 Z-4\nG1 X35 F150\n"
    "M251 P1 Q0.1\nG1 X64 F600\n"
    "G78 Q100 P42 Z-4 R5\nM2\no100 sub\nG0 X10 Y5\nG1 X50\nG1 Y30\nG1 X10\nG1 Y5\no100 endsub\n"
)
INTO_STOCK = "G21 G90\nG0 Z5\nG0 X30 Y35\nG0 Z-2\nM2\n"
TOUCH_PX = 9 / 25.4 * 96  # 9 mm


def visit(tmp_path):
    folder = tmp_path / "visit"
    folder.mkdir(mode=0o777)
    folder.chmod(0o777)
    return ["program", BROWSER, URL, str(folder), TOKEN]


@pytest.fixture(scope="module")
def visits(tmp_path_factory):
    """Two: while it cuts, and after a guard has stopped a rapid."""
    folder = tmp_path_factory.mktemp("panel")
    first, second = visit(folder), visit(tmp_path_factory.mktemp("panel"))
    answers = operate(
        folder,
        [
            ["start", CUT],
            ["until", "axis.x.pos-cmd", ">", 35.5],
            first,
            ["abort"],
            ["start", INTO_STOCK],
            ["until", "chipwise-guard.0.stop", ">", 0.5],
            second,
            ["abort"],
        ],
        speed=1,
        timeout=1800,
        edit=f"s/^PANEL = yes/PANEL = yes\\nPANEL_TOKEN = {TOKEN}/",
    )
    return printed(answers[2]), printed(answers[6])


def number(text):
    return float(text.split()[0])


def test_numbers(visits):
    figures, state = visits[0]["figures"], visits[0]["state"]
    assert number(figures["rate"]) == pytest.approx(RATE, rel=0.05) and figures["rate"].endswith("cm3/min")
    assert figures["target"] == "0.100 cm3/min" and (figures["mode"], figures["limit"]) == ("limit", "stock here")
    assert number(figures["override"]) == pytest.approx(100 * RATE * 1000 / AREA / 600, abs=0.5) and number(
        figures["area"]
    ) == pytest.approx(AREA, rel=0.05)
    assert (figures["depth"], figures["tool"], figures["line"]) == ("4.00 mm", "1: 6.00 mm", "10")
    assert (
        figures["status"] == "Slower than F" and visits[0]["background"] == "limited" and figures["rights"] == "Locked"
    )
    assert figures["program"] == state["task"]["program"] != ""
    german = visits[1]["german"]
    assert (german["status"], german["mode"]) == ("Alarm", "aus")


def test_the_log(visits):
    """Line 8 without M251, then line 10 with it; the program of the second visit cuts nothing, and is stopped."""
    log = visits[0]["log"]
    (tool,) = log["tools"]
    now, before = log["operations"]
    assert (tool[0], tool[1]) == ("1: 6.00", "0.100") and (before[:4], now[:4]) == (
        ["1", "8", "1", "-"],
        ["2", "10", "1", "0.100"],
    )
    full = (
        AREA * BEFORE / 1000
    )  # cm3/min, in the stock from X-3 to X35; the panel's first look at a cut may count from X-10 on
    braking = full * 0.3 / number(now[7])  # 0.3 s, until the machine has slowed down
    assert (
        0.8 * RATE < number(now[4]) < 1.07 * RATE + braking
        and 0.9 * full * 35 / 45 < number(before[4]) < 1.05 * full
        and now[8] == "stock here"
        and before[8] == "nothing"
    )
    assert log["overflow"] == [1024, 768] and log["stock"]
    (stopped,) = visits[1]["log"]["operations"]
    assert stopped[1:4] == ["4", "1", "-"] and stopped[-1] == "1"


@pytest.mark.parametrize("which", ["column", "flat_column"])
def test_colours(visits, which):
    """Along the middle column: 40 mm of stock, of which 6 are cut 4 of 10 mm deep."""
    assert visits[1]["webgl"] and visits[1]["flat"]
    uncut, cut = panel_browser.parts(visits[1][which], "light", [0.0, 0.4])
    assert uncut > 60 and cut / (uncut + cut) == pytest.approx(6 / 40, abs=0.03), (uncut, cut)
    assert panel_browser.parts(visits[1][which], "light", [0.7]) < [3]  # another depth has another colour


@pytest.mark.parametrize("which", ["run_column", "flat_run_column"])
def test_before_and_after_the_program(visits, which):
    """The first visit is in a program that defines its own stock, the second in one that begins with the slot and cuts
    nothing."""
    assert visits[0][which] is None
    now, before = visits[1][which]
    assert panel_browser.parts(now, "light", [0.4]) < [3]
    uncut, cut = panel_browser.parts(before, "light", [0.0, 0.4])
    assert uncut > 60 and cut / (uncut + cut) == pytest.approx(6 / 40, abs=0.03)
    assert panel_browser.parts(now, "light", [0.0])[0] == pytest.approx(uncut + cut, abs=6)


@pytest.mark.parametrize("which", ["ahead", "flat_ahead"])
def test_path_ahead_and_contour(visits, which):
    """While it cuts along the slot its end is the next point; the contour of G78 is where it will be cut.  A guard has
    stopped the second one."""
    cutting, stopped = (visit[which] for visit in visits)
    assert cutting["points"][:4] == pytest.approx([64, 20, -4, 0], abs=1e-3)
    (contour,), path, drawn = cutting["contours"], 0, 1
    assert sorted({tuple(point) for point in contour}) == [(10, 5, -4), (10, 30, -4), (50, 5, -4), (50, 30, -4)]
    assert cutting["with"][path] > 50 and cutting["without"][path] < 5, cutting
    assert cutting["with"][drawn] > cutting["without"][drawn] + 300, cutting  # walls in the shade are as dark
    assert cutting["hidden"] == 0 and cutting["shown"] > 8
    assert stopped["points"] == pytest.approx([30, 35, -2, 1], abs=1e-3) and stopped["contours"] == []


def test_an_alarm_and_the_token(visits):
    found = visits[1]
    (alarm,) = found["alarms"]
    assert "rapid stopped" in alarm and "press Stop" in alarm and "Line 4, Tool 1" in alarm
    assert found["background"] == "alarm"
    wrong, right, rights = found["token"]
    assert wrong.startswith("the token is not the one of") and right == "" and rights == "Unlocked"
    assert found["after_clear"] == found["alarms"]  # its cause is still there
    assert visits[0]["alarms"] == []


def test_fits_the_screen_and_the_finger(visits):
    for found in visits:
        assert found["overflow"] == [1024, 768]
        small = [(name, wide, high) for name, wide, high in found["targets"] if min(wide, high) < TOUCH_PX]
        assert not small and len(found["targets"]) >= 5


def test_no_complaints_of_the_browser(visits):
    for found in visits:
        assert [text for text in found["messages"] if "403" not in text] == []


def test_times(visits):
    """They are measured, each with the one clock of this computer; how long they may be is a matter of bench_panel on a
    quiet one."""
    for found in visits:
        assert found["first_ms"] > 0 and len(found["late_ms"]) > 6 and min(found["late_ms"]) >= 0
