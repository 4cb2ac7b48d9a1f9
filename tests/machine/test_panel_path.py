# SPDX-License-Identifier: GPL-2.0-or-later
"""The path done on the page of a machine that traces a circle while the page looks once a second, or less."""

import json
import os
import sys

import pytest

from chipwise.headless import runner
from support.operate import operate
from support.panel_circle import off_circle

pytestmark = pytest.mark.machine

LOOKS = os.path.join(runner.ROOT, "tests", "support", "panel_slow_looks.py")
RADIUS, CENTRE = 15.0, (30.0, 20.0)
# 1.9 s; the pause is for the first look
CIRCLE = "G21 G90 G64 P0.01\nM0\nG3 X45 Y20 I-15 J0 F3000\nM2\n"


@pytest.mark.parametrize("look_s", [1.0, 3.0])
def test_a_circle_is_round(look_s, tmp_path):
    tmp_path.chmod(0o777)
    there = "for i in $(seq 6000); do [ -e {} ] && exit 0; sleep 0.1; done; exit 1"
    looks = f"{sys.executable} {LOOKS} {look_s} {tmp_path} > {tmp_path}/said 2>&1 & {there.format(tmp_path / 'began')}"
    *_, (began, _), _resume, errors, (ended, _) = operate(
        tmp_path,
        [
            ["mdi", "G0 X45 Y20 Z5"],
            ["start", CIRCLE],
            ["until paused"],
            ["program", "sh", "-c", looks],
            ["resume"],
            ["finish"],
            ["program", "sh", "-c", there.format(tmp_path / "seen")],
        ],
        speed=1,
    )
    assert began == ended == 0 and errors == [], (tmp_path / "said").read_text()
    found = json.loads((tmp_path / "seen").read_text())
    assert (
        off_circle(found["points"], RADIUS, CENTRE) <= 0.02 and 30 < len(found["points"]) < 200 and found["looks"] < 15
    ), found
