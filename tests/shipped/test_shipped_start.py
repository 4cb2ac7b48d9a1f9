# SPDX-License-Identifier: GPL-2.0-or-later
"""The installed machines without a screen, started by an ordinary user in a terminal; and the fault that kept all of
them from starting."""

import os
import shutil
import subprocess

import pytest

from support import ROOT, buried_tip, samples

pytestmark = pytest.mark.machine

TURNED = """(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=22,ZMIN=-50,ZMAX=0.5)
G21 G18 G7 G95 G90
G96 D3000 S200 M3
G26 Q200 I0.3 D2 E0.3 F0.5
M2

O200 sub
  G0 X0 Z0
  G1 X16
  G1 X18 Z-1
  G1 Z-12
  G1 X22
O200 endsub
"""
AT_A_STATION = """o100 sub
  G0 X0 Y0 Z40
  G0 Z5
  G1 Z-1 F1800
  X20
  G0 Z40
o100 endsub
G21 G90 G17 G40 G49 G61
F1800
G75 Q100 P1
M2
"""


def test_slots(scene):
    """The path ahead is known in every period in which the tool cuts, and the rate stays within 102 %."""
    found = scene("machines.headless", program="slots.ngc")
    summary = found["summary"]
    assert found["status"] == 0 and summary["finished"] and summary["errors"] == [], summary
    assert summary["rate_peak"] <= 1.02 * summary["rate_target"], summary
    assert found["cutting"] > 30000 and found["known"] == found["cutting"], "the path is unknown while the tool cuts"
    assert found["left"] == {}, "these still run after LinuxCNC has ended"


@pytest.mark.parametrize("ini, program", [("lathe_headless.ini", TURNED), ("robot_headless.ini", AT_A_STATION)])
def test_lathe_and_robot(scene, ini, program):
    found = scene("machines.run_program", ini=ini, program=program)
    assert found["status"] == 0 and found["summary"]["finished"] and found["summary"]["errors"] == [], found
    assert found["left"] == {}


def test_tracer_pair(scene):
    """tracer.ini traces, tracer_slave.ini follows it through a network."""
    found = scene("machines.pair")
    assert found["master"][6] == ["0", "0"], found["master"]
    passed, *faults = found["slave"][8]
    assert int(passed) > 1000 and faults == ["0", "0"], found["slave"]
    x, y, z = found["slave"][9]
    assert abs(x - 200) > 0.5 and abs(y - 60) < 50 and abs(z - 30) < 50, found["slave"]  # it has followed


def test_a_sample_of_linuxcnc_with_the_lines_of_readme(scene):
    found = scene("machines.sample", configuration="axis_mm")
    assert samples.verdict(samples.named("axis_mm"), found["result"]) == "", found
    assert found["result"]["during"] == {"stock-tracker.0.path-known": "TRUE"}


@pytest.mark.parametrize(
    "ini, mm, texts",
    [
        ("mill.ini", 1.0, ("5.00 mm", "4.00 mm", "6.00 mm")),
        ("mill_inch.ini", 25.4, ("0.1969 in", "0.1575 in", "0.2362 in")),
    ],
)
def test_a_length_that_cannot_be(scene, ini, mm, texts):
    """The message of realtime reaches the ordinary user's screen, once each time, also at the second start."""
    for answers in scene("machines.buried", ini=ini, mm=mm):
        assert buried_tip.verdict(answers, 1 / mm, texts) == ""


OWNERS = "return is_us(about->shm_perm.uid) && is_us(about->shm_perm.cuid) && (about->shm_perm.mode & 0077) == 0;"
AS_IT_WAS = """uid_t owner = about->shm_perm.uid, maker = about->shm_perm.cuid;
    (void)is_us;
    return (owner == getuid() || owner == geteuid()) && (maker == getuid() || maker == geteuid() || maker == 0)
        && (about->shm_perm.mode & 0077) == 0;"""


def test_a_tracker_that_knows_two_of_three_uids_is_seen(scene, tmp_path):
    """chip_planner_ours() without the saved uid: LinuxCNC does not start, so that every test here fails."""
    sources, modules = tmp_path / "components", tmp_path / "modules"
    shutil.copytree(ROOT / "components", sources)
    modules.mkdir()
    planner = sources / "linuxcnc_planner.c"
    text = planner.read_text()
    assert OWNERS in text
    planner.write_text(text.replace(OWNERS, AS_IT_WAS))
    subprocess.run(
        [ROOT / "tools/make_component.py", ROOT / "components/stock_tracker.comp", sources / "stock_tracker.comp"],
        check=True,
    )
    options = "\\ ".join(f"@{ROOT}/build/{name}" for name in ("motion_headers", "options.module"))
    done = subprocess.run(
        ["halcompile", "--compile", sources / "stock_tracker.comp"],
        cwd=modules,
        text=True,
        capture_output=True,
        env={**os.environ, "MAKEFLAGS": "CC=gcc\\ " + options},
    )
    assert (modules / "stock_tracker.so").exists(), done.stderr
    found = scene("machines.refused", modules=str(modules))
    assert found["status"] != 0 and "another program has opened the shared memory" in found["said"], found["said"]


def test_the_installed_tracker_is_not_refused(scene):
    """The same start with the module as installed: the scene above fails for its reason only."""
    found = scene("machines.refused")
    assert found["status"] == 0 and "another user" not in found["said"], found["said"]
