# SPDX-License-Identifier: GPL-2.0-or-later
"""The motion planner's queue is read on the machine: the checks of who owns its memory and whether it runs let the real
one through."""

import pytest

from support.operate import operate

pytestmark = pytest.mark.machine
PROGRAM = "G21 G90\nG0 X-5 Y-5 Z5\nG0 Z-2\nF300\n"


@pytest.mark.parametrize("ini", ["mill.ini", "mill_inch.ini"])
def test_the_path_ahead_is_known(tmp_path, ini):
    """In a feed at constant velocity, and while the operator has paused it."""
    *_, moving, _pause, paused, _abort, said = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", "G21"],
            ["mdi", "M250 P0 Q0 R-10 I40 J40 K10"],
            ["start", "G21 G90\nG0 X0 Y0 Z5\nF30\nG1 X20\nG1 Y20\nM2\n"],
            ["until", "motion.motion-type", ">", 1.5],
            ["sleep", 0.5],
            ["over", 0.5, "stock-tracker.0.path-known"],
            ["pause"],
            ["over", 0.3, "stock-tracker.0.path-known"],
            ["abort"],
            ["errors"],
        ],
        ini=ini,
    )
    assert moving == [[1, 1]] and paused == [[1, 1]] and said == []


def test_a_check_that_fails_is_said(tmp_path):
    """Motion's memory and pins differ: unknown, once on the screen while M251 is on, and not while it is off."""
    program = f"{PROGRAM}G1 X20\nG1 Y20\n"
    *_, off, quiet, _mdi, _start, _sleep, known, said = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", "G21"],
            ["mdi", "M250 P0 Q0 R-10 I40 J40 K10"],
            ["hal", "unlinkp", "stock-tracker.0.distance-to-go"],
            ["hal", "setp", "stock-tracker.0.distance-to-go", "0.123"],
            ["start", program + "M2\n"],
            ["finish"],
            ["pins", "stock-tracker.0.path-refused"],
            ["errors"],
            ["mdi", "M250 P0 Q0 R-10 I40 J40 K10"],
            ["start", program.replace("F300", "M251 Q9\nF300") + "M2\n"],
            ["sleep", 6],
            ["pins", "stock-tracker.0.path-known"],
            ["errors", "pins of motion"],
        ],
        timeout=120,
    )
    assert (off, known) == (["7"], ["FALSE"]) and not [text for text in quiet if "path ahead" in text]
    assert len([text for text in said if "memory and pins of motion differ" in text]) == 1
