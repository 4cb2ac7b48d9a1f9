# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs nobody here wrote, on the real LinuxCNC, judged by tests/support/judge.py; and a program that uses nothing
of ours.

All ten and all conditions: bench/bench_claims.py.  Here are two: loops of arcs, and corners with blends.
"""

import re

import numpy as np
import pytest

from support import ROOT, claims, foreign, foreign_post
from support import judge as judging
from chipwise.headless import runner

pytestmark = pytest.mark.machine

SPEED = 6.0


def measured(name, condition, tmp_path, seed=1):
    program = foreign.programs(seed)[name]
    found = claims.measure(program, condition, tmp_path, SPEED)[0]
    print(claims.line_of(found), found["places"])
    return program, found


@pytest.mark.parametrize(
    "name, condition", [("fusion_adaptive", claims.Condition()), ("freecad_pocket", claims.Condition())]
)
def test_the_claims_on_a_foreign_program(name, condition, tmp_path):
    """Never above 102 % of the rate in 10 ms, no stop, no moment without stock, and the volume is right."""
    program, found = measured(name, condition, tmp_path)
    assert found["finished"] and found["errors"] == [] and found["lost"] == 0
    assert found["own_error"] < 0.001
    assert found["peak_10ms"] <= 1.02 and found["over_share"] == 0.0, found["places"]
    assert found["mean"] > 0.95
    assert (
        abs(found["rate_mean_off"]) < 0.01 and abs(found["rate_peak_off"]) < 0.01
    )  # of the summary, against the judge
    assert found["volume_off"] == pytest.approx(0.0, abs=0.003)
    assert found["rapid_volume"] < 0.01 and found["stops"] == 0 and found["fallback_s"] == 0.0
    # and the same run against a target 3 % lower, or with its tools 3 % wider, is refused
    log = dict(np.load(tmp_path / f"{name}-held.npz"))
    run, tools, target = claims.told(program, log)
    swept = judging.sweep(run, program.blank, tools)
    assert judging.judge(run, program.blank, tools, 0.97 * target, swept).over_share > 0.2
    wider = [judging.Tool(1.03 * tool.diameter, tool.corner, tool.angle) for tool in tools]
    assert judging.judge(run, program.blank, wider, target).peak_10ms > 1.02


# --- parabolic blends ----------------------------------------------------------------------------

CHAIN = """X12.9183 Y10.5983
X13.5868 Y10.8017
X14.3589 Y11.2050
X15.2009 Y11.7432
X16.0721 Y12.3378
X16.9288 Y12.9043
X17.7288 Y13.3613
X18.4355 Y13.6385
X19.0221 Y13.6839
X19.4741 Y13.4693
X19.7905 Y12.9932
X19.9845 Y12.2807
X20.0816 Y11.3813
X20.1173 Y10.3633
X20.1334 Y9.3076""".splitlines()


def test_without_arc_blends(tmp_path):
    """[TRAJ]ARC_BLEND_ENABLE = 0: LinuxCNC adds the velocities of two segments in a blend, and no override acts on it
    (34 % above the target before)."""
    text = "\n".join(
        [
            "G21 G90 G17 G40 G94 G64 P0.01",
            "T1 M6",
            "M250 P0 Q0 R-9.3 I47 J33 K9.3",
            "S9000 M3",
            "F600",
            "M251 P2 Q6 E3600",
            "G0 Z4",
            f"G0 {CHAIN[0]}",
            "G1 Z-4.188 F500",
            *(f"G1 {place}" for place in CHAIN[1:]),
            "G0 Z4",
            "M252",
            "M2",
            "",
        ]
    )
    program = foreign_post.Program(
        "chain", text, judging.Blank.corners((0, 0, -9.3), (47, 33, 0)), {1: (judging.Tool(6.0), 0.0)}
    )
    found = claims.measure(program, claims.Condition(arc_blends=False), tmp_path, SPEED)[0]
    assert found["finished"] and found["errors"] == [] and found["lost"] == 0
    assert found["peak_10ms"] <= 1.02 and found["over_share"] == 0.0, found["places"]
    assert found["mean"] > 0.85 and found["own_error"] < 0.005, found


# --- a program that uses nothing of ours ---------------------------------------------------------

PLAIN = """
G21 G90 G17 G94 G91.1 G61
T1 M6
G43 H1
S2000 M3
F900
G0 X-20 Y5 Z20
G64 P0.05
G1 X60 Z4
X90 Y20
G3 X70 Y40 I-20 F1500
G2 X50 Y60 J20
G1 X49.1 Y60.3
X48.4 Y60.9 F700
X48 Y61.8
X20 Y30 Z1
G91 G1 X5 Y-3
X2 Y-2 F2400
G90
G98 G81 X10 Y10 Z-2 R2 F300
X20
G83 X30 Y12 Z-5 R2 Q2
G80
G61
G1 X60 Y30 F1200
X62 Y34
G64
X70 Y30
X80 Y38
X120 Y20
G0 Z30
G0 X0 Y0
M2
"""


def plain_ini(tmp_path, package):
    """The headless sample mill, with chipwise or with nothing of it but the sampler and the display."""
    table, geometry = ROOT / "configs" / "mill.tbl", ROOT / "configs" / "tools.toml"
    text = claims.ini_text(claims.Condition(), table, geometry)
    if not package:
        text = re.sub(r"^(REMAP|TOPLEVEL|PATH_PREPEND|HALFILE = .*/chipwise\.hal).*\n", "", text, flags=re.M)
        text = re.sub(r"^\[(CHIPWISE|PYTHON)\]\n(?:(?!\[).*\n)*", "", text, flags=re.M)
        assert not re.search(r"^[^#\n]*(REMAP|chipwise\.hal|CHIPWISE\]|TOPLEVEL)", text, flags=re.M)
    ini = tmp_path / f"plain-{package}.ini"
    ini.write_text(text)
    return ini


FIRST = PLAIN.splitlines().index("G0 X-20 Y5 Z20") + 1


def moves(log):
    """Rows in which something moves, behind the first move: position, kind of motion, line, tool length.

    How the first move starts depends on whether the task has sent the second one yet (the planner takes half the
    acceleration until then).  It ends at rest (G61) with all others in the queue, so nothing after it does; the rests
    between depend on the task's timing.
    """
    at = np.column_stack([log[axis] for axis in "xyz"])
    moving = np.append(False, np.abs(np.diff(at, axis=0)).max(axis=1) > 0.0) & (log["line"] > FIRST)
    return np.column_stack([at[moving], log["motion_type"][moving], log["line"][moving], log["tool_offset_z"][moving]])


def same(one, other):
    return one.shape == other.shape and np.abs(one - other).max() <= 1e-6  # the log's last digit


def test_a_plain_program_runs_as_without_the_package(tmp_path):
    """Servo period by servo period; and the comparison sees one sample off by two digits, one missing and one
    doubled."""
    program, found = tmp_path / "plain.ngc", {}
    program.write_text(PLAIN)
    for package in (True, False):
        log = tmp_path / f"{package}.npz"
        summary = runner.run_headless(
            str(program), runner.Machine(str(plain_ini(tmp_path, package))), speed=2.0, log=str(log), timeout=300.0
        )
        assert summary["finished"] and summary["errors"] == [], summary
        data = dict(np.load(log))
        assert (np.diff(data["sample"]) == 1).all(), "servo periods lost: no verdict"
        found[package] = moves(data)
    ours, theirs = found[True], found[False]
    assert len(ours) > 10000 and set(ours[:, 3]) == {1.0, 2.0, 3.0}
    assert same(ours, theirs), (ours.shape, theirs.shape)
    off = ours.copy()
    off[5000, 1] += 2e-5
    assert not same(off, theirs)
    assert not same(np.delete(ours, 7000, axis=0), theirs)
    assert not same(np.insert(ours, 7000, ours[7000], axis=0), theirs)
