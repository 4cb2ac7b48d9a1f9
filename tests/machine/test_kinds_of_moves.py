# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves of every kind between cuts under M251: whatever sets their feed, their velocity is right, and the map has what
they cut."""

import numpy as np
import pytest

from chipwise.headless import runner
from support import rate_oracle
from support.headless_rig import SPINDLE, headless_ini, with_spindle
from support.operate import operate
from support.slot import BEGIN, FEED, OVERRIDE_IGNORED, RADIUS, SLOT_VEL, VELOCITY, VOLUME, values

pytestmark = pytest.mark.machine

SPEED = 10


def test_moves_that_follow_the_spindle(tmp_path):
    """G33 and G33.1 at 20 mm/s with F 5 mm/s and the override far down: the pitch, and no ignored override."""
    program = BEGIN.replace("S10000", "S600") + (
        "G0 X-10 Y20 Z5\nG0 Z-2\nG33 X70 K2\nG0 Z10\nG33.1 Z-1 K2\nG33 Z8 K2\nG1 X60 F300\nM252\nM2\n"
    )
    _start, _type, over, end, last = operate(
        tmp_path,
        [
            ["start", program],
            ["until", VOLUME, ">", 200],
            ["over", 1.0, VELOCITY, FEED, OVERRIDE_IGNORED],
            ["finish"],
            ["pins", OVERRIDE_IGNORED, "motion.feed-inhibit"],
        ],
        edit=with_spindle(tmp_path),
    )
    velocity, feed, ignored = over
    assert velocity == pytest.approx([20.0, 20.0], rel=0.05) and feed[0] < 0.2 and ignored == [0, 0]
    assert end == []
    assert values(last) == [0.0, 0.0]


EVERY_KIND = (
    BEGIN.replace("S10000", "S600")
    + """G0 X-10 Y4 Z5
G0 Z-2
G33 X70 K2
G0 Z5
G0 X-10 Y12
G0 Z-2
G95 F0.5
G1 X30
G93
G1 X50 F12
G4 P1.5
G94 F240
G1 X70
G0 Z5
G0 X-10 Y20
G0 Z-2
G38.3 X30
G0 Z5
G0 X-4 Y32
G0 Z1
G18
G76 P1 Z-3 I1 J0.2 R1 K0.5 Q0 H0
G17
G0 Z5
M252
M2
"""
)
# code: (y, x from, x to, mm/s), where all of the tool is in the stock
KINDS = {
    "G33": (4, 5, 55, 20.0),
    "G95": (12, 5, 28, 5.0),
    "G93": (12, 32, 48, 4.0),
    "G94": (12, 52, 56, SLOT_VEL),
    "G38": (20, 5, 28, 4.0),
    "G76": (32, -3, -2, 10.0),
}


def test_every_kind_of_move_is_in_the_map(tmp_path):
    """G33, G76 (the spindle sets the feed), G95, G93 and G38 (F as it is) between cuts under M251 P2: each at its own
    velocity, no alarm, not even in a dwell in stock, where the queue of motion is empty, and the volume is that of the
    path in the log, counted by needles that know nothing of the tracker."""
    program, log, spindle = tmp_path / "every.ngc", tmp_path / "log.npz", tmp_path / "spindle.hal"
    program.write_text(EVERY_KIND)
    spindle.write_text(SPINDLE[1])
    summary = runner.run_headless(
        str(program),
        runner.Machine(headless_ini(tmp_path, "mill", str(spindle))),
        speed=SPEED,
        log=str(log),
        timeout=900,
    )
    assert summary["finished"] and summary["errors"] == [], summary
    with np.load(log) as stored:
        row = {name: stored[name] for name in stored.files}
    for what, (y, first, last, expected) in KINDS.items():
        moving = (
            (np.abs(row["y"] - y) < 1e-3)
            & (row["x"] > first)
            & (row["x"] < last)
            & (row["motion_type"] > 1)
            & (row["velocity"] > 0.5 * expected)
        )
        assert moving.sum() > 50, what
        found = np.median(row["velocity"][moving])
        print(f"{what}: {found:.3f} mm/s")
        assert found == pytest.approx(expected, rel=0.04), what  # G76 catches up with the spindle
    counted = rate_oracle.removed_total(
        row["x"],
        row["y"],
        row["z"] - row["tool_offset_z"],
        ((0.0, 0.0, -10.0), (60.0, 40.0, 0.0)),
        rate_oracle.OracleTool(RADIUS),
    )
    print(f"removed {summary['volume_mm3']:.1f} mm3, by needles {counted}")
    assert summary["volume_mm3"] == pytest.approx(counted, rel=0.004)
    assert not row["rapid_contact"].any() and not row["flute_excess"].any()


def test_moves_keep_their_line_numbers(tmp_path):
    """An F on the line of a move (F is remapped), in a program and in a subroutine: the line is that of the move, which
    the operator sees, from which the program is started again, and which a guard names."""
    text = (
        BEGIN
        + "G0 X-10 Y20 Z20\nG1 X0 F900\nG1 Y30 F1200\nO1 sub\nG1 X10 F1000\nG1 Y20\nO1 endsub\nO1 call\nG1 X20 F1100\n"
        "M252\nM2\n"
    )
    program, log = tmp_path / "lines.ngc", tmp_path / "log.npz"
    program.write_text(text)
    summary = runner.run_headless(str(program), speed=SPEED, log=str(log), timeout=900)
    assert summary["finished"] and summary["errors"] == [], summary
    lines = text.splitlines()
    with np.load(log) as stored:
        x, y, line = stored["x"], stored["y"], stored["line"]
    for (x0, x1), (y0, y1), wanted in (
        ((-9, -1), (19, 21), "G1 X0 F900"),
        ((-1, 1), (21, 29), "G1 Y30 F1200"),
        ((1, 9), (29, 31), "G1 X10 F1000"),
        ((9, 11), (21, 29), "G1 Y20"),
        ((11, 19), (19, 21), "G1 X20 F1100"),
    ):
        rows = (x > x0) & (x < x1) & (y > y0) & (y < y1)
        assert set(line[rows]) == {lines.index(wanted) + 1}, wanted
