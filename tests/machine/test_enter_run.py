# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise enter --run on a running LinuxCNC: a line is planned from where the tool is, cut, or refused with nothing
moved."""

import math

import pytest

from support.operate import BOX, operate

pytestmark = pytest.mark.machine

HOLE = "G13 X30 Y20 I8 Z-3 R1 F600"
WHOLE = math.pi * 8**2 * 3  # mm3
DATA = "30,20,8,-3,1,,,,,600\n"


def test_run(tmp_path):
    steps = [
        ["mdi", "G21 G90 G54 T1 M6"],
        ["mdi", "G10 L2 P1 X0 Y0 Z-20"],
        ["mdi", "G0 X5 Y5 Z8"],
        ["mdi", BOX],
        ["pins", "stock-tracker.0.removed-volume"],
        ["enter", DATA, "G13", "--run"],
        ["until", "stock-tracker.0.removed-volume", ">", 0.1 * WHOLE],
        ["finish"],
        ["pins", "stock-tracker.0.removed-volume"],
        ["position"],
        ["enter", DATA, "G13", "--run", "--unit", "in"],
        ["mdi", "G91"],
        ["enter", DATA, "G13", "--run"],
        ["mdi", "G90"],
        ["enter", "30,20,2,-3,1\n", "G13", "--run"],
        ["position"],
        ["off"],
        ["enter", DATA, "G13", "--run"],
        ["estop"],
        ["enter", DATA, "G13", "--run"],
    ]
    answers = operate(tmp_path, steps)
    before, made, finished, after, there = answers[4], answers[5], *answers[7:10]
    assert made[:2] == [0, HOLE + "\n"] and made[2].endswith("running; Stop on the screen of LinuxCNC ends it\n"), made
    assert finished == [] and float(after[0]) - float(before[0]) == pytest.approx(WHOLE, rel=0.003)
    refused = [answers[k] for k in (10, 12, 14, 17, 19)]
    assert all(status == 1 and out == "" for status, out, _error in refused), refused
    for (_status, _out, error), words in zip(
        refused,
        (
            "it is in in and LinuxCNC in mm",
            "G91 is active",
            "radius I2 mm is not larger than the tool radius 3 mm",
            "the machine is off",
            "the machine is in E-stop",
        ),
    ):
        assert words in error, (words, error)
    assert answers[15] == there
