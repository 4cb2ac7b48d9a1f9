# SPDX-License-Identifier: GPL-2.0-or-later
"""G26 and the soft limits of the simulated lathe: refused before anything moves, or carried out to the end; LinuxCNC
agrees to 0.02 mm."""

import pytest

from support.operate import operate

pytestmark = pytest.mark.machine
PART = """(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=30,ZMIN=-60,ZMAX=0)
(LATHE,ROUGH=1)
G21 G18 G8 G94 G97 S500 M3
G26 Q100 D4 F2000
M2
O100 sub
G0 X8 Z0
G1 Z-20
O100 endsub
"""
LOW = -300.0  # [AXIS_Z]MIN_LIMIT of configs/lathe.ini
END = -20.0  # the tool's tip stays in front of the shoulder that a 0.4 mm nose leaves at the end of the part


def test_a_plan_beyond_a_limit_is_refused_and_one_within_is_carried_out(tmp_path):
    """By the work offset, and by the tool's offset."""
    inside, beyond = LOW - END + 0.01, LOW - END - 0.01
    found = operate(
        tmp_path,
        [
            ["mdi", f"G10 L2 P1 Z{beyond:.4f}"],
            ["start", PART],
            ["finish"],
            ["position"],
            ["mdi", f"G10 L2 P1 Z{inside:.4f}"],
            ["start", PART],
            ["finish"],
            ["position"],
            ["mdi", "G10 L1 P1 Z-0.02"],
            ["start", PART],
            ["finish"],
            ["position"],
            ["start", PART.replace("D4 F2000", "D4 F2000 H1")],
            ["finish"],
            ["messages"],
        ],
        ini="lathe.ini",
    )
    words = (
        "chipwise: G26: step 3, rough outside: axis Z would be at -300.01 mm with T1, beyond its limit of -300 "
        "mm; move the work"
    )
    assert len(found[2]) == 1 and words in found[2][0] and found[6] == []
    assert len(found[10]) == 1 and words in found[10][0]
    for place in (found[3], found[7], found[11]):
        assert place == pytest.approx([100.0, 0.0, 100.0], abs=1e-6)
    assert found[13] == [] and any("axis Z would be at" in text for text in found[14])
