# SPDX-License-Identifier: GPL-2.0-or-later
"""Resume on the page of `chipwise panel` in a real browser, beside a real LinuxCNC: stopped in mid-cut, gone on with,
and the stock in the end.

The program is stopped at a tenth of its feed, so that a busy computer is not too late for it.
"""

import re

import numpy as np
import pytest

from chipwise.headless import runner
from support import panel_browser
from support.operate import operate, printed
from support.resume_case import SAME_MM
from support.resume_oracle import outside

pytestmark = [
    pytest.mark.machine,
    pytest.mark.together("panel browser"),
    pytest.mark.skipif(panel_browser.missing() != "", reason=panel_browser.missing() or "a browser"),
]

URL, TOKEN = "http://127.0.0.1:8250", "correct-horse-7"
REMOVED = "stock-tracker.0.removed-volume"
PART = """\
o<slot> sub
G0 X#1 Y8
G1 Z-#2 F600
Y32 F1200
G3 X[#1+6] I3 J0
G1 Y8
G0 Z5
o<slot> endsub
G21 G90 G17 G40 G49 G54 G80 G94
G64 P0.01
M250 P0 Q0 R-20 I80 J40 K20
T1 M6
S8000 M3
F600
G0 Z5
o<slot> call [8] [2]
o<slot> call [26] [3]
o<slot> call [44] [2.5]
o<slot> call [62] [3.5]
M2
"""
SLOTS_MM2, DEPTHS_MM = 2 * 24 * 6 + np.pi * 3 * 6, (2, 3, 2.5, 3.5)  # walls and ends of the slots overlap by little
LESS = 0.35 * SLOTS_MM2 * sum(DEPTHS_MM)


def _steps(folder, part, browser, kept):
    """The whole program; then stopped, looked at while the work is elsewhere, and gone on with by the page."""
    visit = ["program", f"{runner.ROOT}/tests/support/resume_visit.py", URL, str(browser), TOKEN]
    plan = ["program", f"{runner.ROOT}/bin/chipwise", "resume", str(part), "--plan"]
    return [
        ["open", str(part)],
        ["run_from", 0],
        ["finish"],
        ["map", str(folder / "whole.npy")],
        ["feed override", 0.1],
        ["run_from", 0],
        ["until", REMOVED, "<", 1],
        ["until", REMOVED, ">", LESS],
        ["abort"],
        ["kept", str(kept / "kept.journal")],
        ["feed override", 1],
        ["errors"],
        ["mdi", "G10 L2 P1 X1.5"],
        plan,
        ["mdi", "G10 L2 P1 X0"],
        visit,
        ["pins", REMOVED],
        ["run_from", 0],
        ["finish"],
        ["map", str(folder / "end.npy")],
    ]


def _judge_page(found, before):
    """What the page has said; before: mm3 that the whole program removes.  -> mm3 of the stopped one, as the page knows
    them."""
    first = found["said"][0]
    assert found["program"] == "part.ngc" and first.startswith("The stock is that of kept.journal, with "), found
    stopped, off = (
        float(re.search(pattern, text)[1])
        for pattern, text in zip((r"with (\d+) mm3", r"([\d.]+) mm off the path"), found["said"])
    )
    assert LESS - 1 < stopped < 0.98 * before and off < 0.02, found
    assert "Nothing moves until you start it" in found["plan"] and found["done"].startswith("It is written and open"), (
        found
    )
    assert found["overflow"] == [1024, 768] and [text for text in found["messages"] if "403" not in text] == []
    return stopped


def test_stopped_and_gone_on_with_on_the_page(tmp_path):
    part, browser, kept = (tmp_path / name for name in ("part.ngc", "browser", "kept"))
    part.write_text(PART)
    for folder in (browser, kept):
        folder.mkdir()
    for folder in (tmp_path, browser, kept):
        folder.chmod(0o777)
    answers = operate(
        tmp_path,
        _steps(tmp_path, part, browser, kept),
        speed=1,
        timeout=1500,
        edit=f"s#^PANEL = yes#PANEL = yes\\nPANEL_TOKEN = {TOKEN}#; s#^STOCK_DIR = .*#STOCK_DIR = {kept}#; "
        f"s#^KEEP_STOCK = .*#KEEP_STOCK = yes#",
    )
    assert answers[2] == answers[11] == []
    status, words = answers[13]
    assert status == 2 and "work offsets are those of then" in words, words
    stopped = _judge_page(printed(answers[15]), answers[3][0])
    assert float(answers[16][0]) == pytest.approx(stopped, abs=1.0)  # nothing has moved
    assert (tmp_path / "part.resume.ngc").read_text().startswith("(chipwise resume: goes on with part.ngc in line ")
    assert answers[18] == []  # no guard has stopped the new program
    higher, lower = outside(np.load(tmp_path / "whole.npy"), np.load(tmp_path / "end.npy"))
    assert max(higher, lower) < SAME_MM and answers[19][0] == pytest.approx(answers[3][0], rel=2e-4, abs=1.0), (
        higher,
        lower,
        answers[19],
        answers[3],
    )
