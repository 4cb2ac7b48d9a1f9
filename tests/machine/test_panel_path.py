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
# 1.9 s; the dwell is for the first looks
CIRCLE = "G21 G90 G64 P0.01\nG4 P6\nG3 X45 Y20 I-15 J0 F3000\nM2\n"


@pytest.mark.parametrize("look_s", [1.0, 3.0])
def test_a_circle_is_round(look_s, tmp_path):
    *_, (status, said), errors = operate(
        tmp_path,
        [["mdi", "G0 X45 Y20 Z5"], ["start", CIRCLE], ["program", sys.executable, LOOKS, str(look_s)], ["finish"]],
        speed=1,
    )
    assert status == 0 and errors == [], said
    found = json.loads(said.splitlines()[-1])
    assert (
        off_circle(found["points"], RADIUS, CENTRE) <= 0.02 and 30 < len(found["points"]) < 200 and found["looks"] < 15
    ), found
