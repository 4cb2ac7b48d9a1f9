# SPDX-License-Identifier: GPL-2.0-or-later
"""Levels of a cycle without J on a running LinuxCNC: from the stock of the program's own M250, as in its preview."""

import pytest

from support.operate import operate

pytestmark = pytest.mark.machine

STOCK = "M250 P0 Q0 R-30 I80 J60 K30"
HOLE = "G21 G90 G17 G64 P0.01\nT1 M6\n{}\nS10000 M3\nG0 X30 Y30 Z27\nG13 X30 Y30 I8 Z-18 R26 F300 E6000\nM2\n"
ONE_PASS, FROM_R = (
    -18.0,
    26 - 44 / 3,
)  # Z of the first pass, with flutes of 20 mm: to the floor, or a third of the way from R
LINE = 4  # behind M250
HEIGHT = "axis.z.pos-cmd"
FIRST_PASS = [["until", HEIGHT, "<", 12], ["over", 2, HEIGHT], ["finish"]]  # a pass takes 9 s


def test_the_stock_counts_where_the_preview_knows_it(tmp_path):
    program = tmp_path / "hole.ngc"
    program.write_text(HOLE.format(STOCK))
    steps = [
        ["mdi", STOCK],
        ["start", HOLE.format("")],
        *FIRST_PASS,  # a stock of MDI: no preview shows it
        ["start", HOLE.format(STOCK)],
        *FIRST_PASS,
        ["start", HOLE.format("")],
        *FIRST_PASS,  # nor that of the program before
        ["mdi", STOCK],
        ["open", str(program)],
        ["run_from", LINE],
        *FIRST_PASS,
    ]
    answers = operate(tmp_path, steps)
    said = [(step, answer) for step, answer in zip(steps, answers) if step[0] in ("mdi", "finish") and answer]
    assert said == []
    found = [answer[0][0] for step, answer in zip(steps, answers) if step[0] == "over"]
    assert found == pytest.approx([FROM_R, ONE_PASS, FROM_R, ONE_PASS], abs=0.01)
