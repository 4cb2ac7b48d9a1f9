# SPDX-License-Identifier: GPL-2.0-or-later
"""An abort where a cycle has its own path mode, and an E-stop: the next program's corners are those of the mode that is
shown."""

import pytest
from support.operate import operate

pytestmark = pytest.mark.machine

INSIDE = 0.35  # mm: G64 P of the sub, as in the links of G24 P1 with K1
# In the dwell the task waits, so what puts the program's mode back has not been sent to motion yet.
PATTERN = (
    f"o100 sub\nG64 P{INSIDE}\nG1 X10 Y0 F3000\nG1 X20\nG4 P100\nG1 X30\no100 endsub\nG21 G90 G17\nT4 M6\n"
    f"F3000\nG0 X0 Y0 Z15\nG75 Q100\nM2\n"
)
CORNER = "G21 G90 G17\nF3000\nG1 X10 Y10 Z20\nG1 X40\nG1 Y40\nG1 X10\nM2\n"
OURS = CORNER.replace("F3000", "M252\nF3000")
ROUND = [
    ["until", "joint.1.pos-cmd", "<", 10.01],
    ["until", "joint.1.pos-cmd", ">", 10.05],
    ["until", "joint.0.pos-cmd", ">", 30],
    ["abort"],
]  # X where Y begins to move
# so that a corner is as wide as allowed
SLOW = "s#^MAX_LINEAR_VELOCITY = .*#MAX_LINEAR_VELOCITY = 10#;s#^MAX_ACCELERATION = .*#MAX_ACCELERATION = 20#"


def test_an_abort_and_an_estop_leave_no_wide_corners(tmp_path):
    """A program without G61 or G64: its corners are those of the INI file's G64 P0.01.  A wider G64 typed by hand shows
    that wide ones are seen.  When the machine has been switched off, LinuxCNC itself rounds by more than any P,
    although it shows that of the INI file; a program with a code of ours does not."""
    answers = operate(
        tmp_path,
        [
            ["start", PATTERN],
            ["until", "joint.0.pos-cmd", ">", 19.99],
            ["sleep", 0.5],
            ["abort"],
            ["start", CORNER],
            *ROUND,
            ["mdi", f"G64 P{INSIDE}"],
            ["start", CORNER],
            *ROUND,
            ["mdi", "G64 P0.01"],
            ["estop"],
            ["on"],
            ["start", OURS],
            *ROUND,
        ],
        speed=2,
        edit=SLOW,
    )
    after_abort, by_hand, after_estop = answers[7], answers[13], answers[21]
    assert after_abort > 39.9 and by_hand < 39.7 and after_estop > 39.9, (after_abort, by_hand, after_estop)
