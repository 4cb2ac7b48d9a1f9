# SPDX-License-Identifier: GPL-2.0-or-later
"""An axis without MAX_ACCELERATION: LinuxCNC gives it 1 mm/s2, and the guard has to know how soon it brakes."""

import pytest

from support.operate import operate

pytestmark = pytest.mark.machine

WITHOUT_Z = "/^.AXIS_Z/,/^$/{/MAX_ACCELERATION/d}"  # sed
PINS = [
    "pins",
    "ini.z.max_acceleration",
    "stock-tracker.0.acceleration-z",
    "stock-tracker.0.removed-volume",
    "chipwise-guard.0.stop",
]


def test_a_traverse_of_a_slow_axis_stops_before_the_stock(tmp_path):
    """From Z25 the axis has 7 mm/s where it has to begin to brake, 12 mm before the stock."""
    answers = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", "M250 P0 Q0 R-10 I60 J40 K10"],
            ["mdi", "G0 X20 Y20 Z25"],
            ["open text", "G21 G90\nT1 M6\nG0 Z-5\nM2\n"],
            ["run_until_stopped", 120],
            ["position"],
            PINS,
        ],
        edit=WITHOUT_Z,
    )
    stopped, position, (linuxcnc, ours, removed, guard) = answers[4:]
    print("stopped at", position, "acceleration", linuxcnc, ours, "removed", removed)
    assert float(linuxcnc) == 1.0, "LinuxCNC has another default now"
    assert stopped is True and guard == "TRUE" and float(removed) == 0.0
    assert 0.0 < position[2] < 15.0 and float(ours) == 1.0
