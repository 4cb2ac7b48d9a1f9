# SPDX-License-Identifier: GPL-2.0-or-later
"""The guards on a running LinuxCNC stop nothing that is sound: the programs of the repository, moves along the stock,
and a pocket."""

import os

import numpy as np
import pytest

from chipwise.headless import runner
from support.guard_runs import HEAD, SPEED, log_of
from support.demo_runs import DEMOS, GROUP, demo_run
from support.operate import Shared
from support.headless_rig import WITH_LOG

pytestmark = pytest.mark.machine

QUIET = {
    machine: Shared("quiet guards, " + machine, ini=machine + ".ini", edit=WITH_LOG, speed=SPEED)
    for machine in ("mill", "mill_inch")
}


def alarms(log):
    """Rows of a log in which a guard would stop the machine."""
    return np.flatnonzero((log["rapid_contact"] != 0) | (log["flute_excess"] != 0))


def check_quiet(log):
    rows = alarms(log)
    assert len(rows) == 0, (
        f"{len(rows)} alarms, the first at line {log['line'][rows[0]]}, x {log['x'][rows[0]]:.3f} "
        f"y {log['y'][rows[0]]:.3f} z {log['z'][rows[0]]:.3f}"
    )


def test_the_checker_sees_an_alarm():
    log = {name: np.zeros(5) for name in ("rapid_contact", "flute_excess", "line", "x", "y", "z")}
    check_quiet(log)
    log["rapid_contact"][3] = 1
    with pytest.raises(AssertionError, match="1 alarms"):
        check_quiet(log)


# stations.ngc is a robot's (tests/machine/test_robot.py), turning_*.ngc a lathe's (tests/turning), probe_grid.ngc a sub
PROGRAMS = sorted(
    name
    for name in os.listdir(os.path.join(runner.ROOT, "nc_files"))
    if name.endswith(".ngc") and not name.startswith(("turning", "stations", "probe_grid"))
)


def ran_quietly(answer):
    """The log of a program (step "log") that ran to its end without an error and without an alarm."""
    errors, path = answer
    assert errors == []
    log = log_of(path)
    check_quiet(log)
    return log


@pytest.mark.parametrize(
    "name, machine",
    [
        pytest.param(
            name,
            machine,
            marks=pytest.mark.scene(QUIET[machine], [["log", os.path.join(runner.ROOT, "nc_files", name)]]),
        )
        for machine in QUIET
        for name in PROGRAMS
        if machine != "mill" or name.removesuffix(".ngc") not in DEMOS
    ],
)
def test_no_false_alarm_on_our_programs(answers, name, machine):
    ran_quietly(*answers)


@pytest.mark.parametrize("name", DEMOS)
@pytest.mark.together(GROUP)
def test_no_false_alarm_on_a_demo(name):
    """The rest of our programs on the metric mill."""
    summary, log = demo_run(name)
    assert summary["finished"] and summary["errors"] == [], summary
    check_quiet(log)


SANE = {
    "own slot, back and forth, and a second pass deeper than the flutes": """
G0 X-10 Y20 Z5
G0 Z-4
G1 X50
G0 X-10
G0 X45
G0 Z5
G0 X-10
G0 Z-8
G1 X50
G0 X-8
G0 Z5
""",
    "a turned slot and its retraces": """
G0 X-8 Y3 Z5
G0 Z-5
G1 X50 Y33
G0 X-8 Y3
G0 X50 Y33
G0 Z0.3
G0 X30 Y10
""",
    "clearances of a tenth": """
G0 X-3.1 Y20 Z5
G0 Z-3
G0 Z0.1
G0 X30
G0 X50 Y5
G0 X-3.1 Y-3.1
G0 Z-5
G0 X-3.1 Y43.1
G0 X63.1
G0 Z0.05
G0 X10 Y10
""",
    "down to the surface itself": """
G0 X20 Y20 Z10
G0 Z0
G0 Z10
G0 X-3 Y20
G0 Z-5
G0 Z10
""",
    "canned cycles": """
G0 X10 Y10 Z5
G98 G81 X10 Y10 Z-6 R0.5
X20
G99 G83 X30 Y20 Z-9 R0.2 Q2
X40
G73 X50 Y20 Z-9 R0.2 Q2
G82 X10 Y30 Z-4 R0.1 P0.1
G85 X20 Y30 Z-4 R0.1
G80
G0 Z5
""",
    "tool change and probing": """
G0 X10 Y10 Z5
G1 Z-4
G1 X40
G0 Z5
T3 M6
G43
G0 X25 Y10
G1 Z-2
G1 X30
G0 Z5
T2 M6
G0 X25 Y10
G0 Z-3.9
G0 X38
G0 X12
G0 Z5
G38.3 Z-0.5 F100
G0 Z10
""",
    "G64 without tolerance": """
G64
G0 X-40 Y20 Z5
G0 Z-4
G1 X50
G0 X-40
G0 Y80
G0 X-40 Y-40
G0 Z20
G0 X30 Y20
G0 Z1
G1 Z-3
G0 Z20
""",
    "a pocket and traverses in it": """
G0 X30 Y20 Z5
G13 X30 Y20 I4 K14 Q4 Z-6 R0.5 J3 E600
G0 Z-5.9
G0 X40
G0 X20
G0 X30 Y10
G0 Y30
G0 Z5
""",
}


@pytest.mark.parametrize("what", SANE, ids=[name.replace(" ", "_") for name in SANE])
@pytest.mark.scene(QUIET["mill"], lambda what: [["log", HEAD + "G0 Z20" + SANE[what] + "M2\n"]])
def test_no_false_alarm(answers, what):
    ran_quietly(*answers)


def pocket_paths(mode):
    """Traverses 1 mm above the floor of a pocket of 50 mm by 30 mm, to within 0.3 to 2 mm of its walls, each ending
    otherwise:  down to the floor and on by feed, or by feed at once (before which LinuxCNC stops)."""
    lines = [mode, "G0 X30 Y20 Z-5"]
    for gap in (0.3, 0.7, 2.0):
        x, y = 22 - gap, 12 - gap
        for dx, dy in ((x, -y), (x, y), (-x, y), (-x, -y), (0, y), (x, 0), (0, -y), (x, y), (-x, -y)):
            across, back = f"G0 X{30 + dx:.3f} Y{20 + dy:.3f}", f"G1 X{30 + dx / 2:.3f} Y{20 + dy / 2:.3f}"
            lines += [across, "G0 Z-6", back, "G0 Z-5", across, back]
    return "\n".join(lines) + "\n"


def pocket_cleared():
    """Two levels of rows 4 mm apart and the outline; T1, 6 mm."""
    lines = ["F3000", "G0 X8 Y8 Z1"]
    for z in (-3, -6):
        lines.append(f"G1 Z{z}")
        for row, y in enumerate(range(8, 33, 4)):
            lines += [f"G1 Y{y}", f"G1 X{8 if row % 2 else 52}"]
        lines += ["G1 X8", "G1 Y8", "G1 X52", "G1 Y32", "G0 Z1", "G0 X8 Y8", f"G0 Z{z + 1}"]
    return "\n".join(lines) + "\n"


def across_a_pocket(modes):
    return [
        ["log", HEAD + "G0 Z20\n" + pocket_cleared() + "".join(pocket_paths(mode) for mode in modes) + "G0 Z20\nM2\n"]
    ]


@pytest.mark.parametrize("modes", [("G64 P0.01", "G61"), ("G64 P0.1", "G64")])
@pytest.mark.scene(QUIET["mill"], across_a_pocket)
def test_no_false_alarm_across_a_pocket(answers, modes):
    """The tool brakes towards a wall at 100 mm/s and stands or turns just before it; the guard is on and stops nothing.
    As it begins to brake two periods show less than the planner does: one traverse in ten was stopped for braking too
    weakly."""
    data = ran_quietly(*answers)
    low = (data["motion_type"] == 1) & (data["z"] < -4.9)
    assert data["velocity"][low].max() > 99.0  # at the rapid's speed inside the pocket
    assert np.diff(data["removed_volume"])[low[1:]].max() < 1e-3  # and none of them met stock
