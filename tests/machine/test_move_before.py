# SPDX-License-Identifier: GPL-2.0-or-later
"""The move before a code that waits for the machine is made: LinuxCNC holds a move back to join it with the next one
(G64 P)."""

import pytest

from support.operate import BOX, Shared

pytestmark = pytest.mark.machine

MILL = Shared("move before")
HEAD = f"G21 G90 G17 G64 P0.01\nT1 M6\nS1000 M3\nF3000\n{BOX}\nG0 X-10 Y20 Z5\n"
# A plan of more than 0.1 s of computing (glue/task_share.py: WAIT_S).
LONG = "O100 sub\nG0 X0 Y0\nG1 X250\nY180\nX0\nY0\nO100 endsub\n"


def steps(code):
    return [["start", f"{HEAD}G1 Z-4\n{code}\nG1 X-9\nM2\n"], ["finish"], ["pins", "axis.z.pos-cmd"]]


@pytest.mark.scene(MILL, steps)
@pytest.mark.parametrize(
    "code", ["M250 P0 Q0 R-10 I60 J40 K10", "M251 P1 Q6", "M251 P2 Q6 E3000", "M251 P1 Q6\nM252", "M253 P3"]
)
def test_codes_that_wait(code, answers):
    assert answers[1] == [] and float(answers[2][0]) == pytest.approx(-4, abs=1e-6)


@pytest.mark.scene(
    MILL,
    [["start", f"{LONG}{HEAD}G1 Y-30\nG79 Q100 Z-1 D0.1 R2\nM2\n"], ["until", "axis.y.pos-cmd", "<", -29.9], ["abort"]],
)
def test_a_cycle_whose_plan_takes_long(answers):
    assert answers[1] <= -29.9  # a row of the log may be just there
