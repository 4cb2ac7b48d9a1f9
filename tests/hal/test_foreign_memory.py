"""Shared memory that is not what its key promises: a stale or foreign block at motion's key or at the map's, another program that
writes into the map.  Nothing crashes; what cannot be believed is not used, and the fault says so."""
import subprocess
import sys

import pytest

import halrig

sys.path.insert(0, str(halrig.HERE))
PYTHON = "/usr/bin/python3"
MAP_KEY = 0x43575354

TRACKER = """
loadrt threads name1=servo period1=1000000
loadrt stock_tracker cell=0.25 size_x=60 size_y=40
addf stock-tracker.0 servo
setp stock-tracker.0.acceleration 500
setp stock-tracker.0.tool-diameter 6
setp stock-tracker.0.enable 1
setp stock-tracker.0.motion-type 2
setp stock-tracker.0.min-z -10
setp stock-tracker.0.max-x 60
setp stock-tracker.0.max-y 40
setp stock-tracker.0.define 1
start
loadusr -w sleep 0.5
getp stock-tracker.0.path-known
getp stock-tracker.0.ready
getp stock-tracker.0.fault-code
"""


@pytest.fixture(scope="session")
def foreign_motion(tmp_path_factory):
    """The program of foreign_motion.c."""
    program = tmp_path_factory.mktemp("foreign") / "foreign_motion"
    subprocess.run(["gcc", "-DULAPI", "-I/usr/include/linuxcnc", "-w", "-o", program, halrig.HERE / "foreign_motion.c"], check=True)
    return program


def hal(where, text, shell):
    """HAL commands in a sandbox, with `shell` before halrun; -> (words it printed, all of the output)."""
    (where / "test.hal").write_text(text)
    done = halrig.halrun([], where, shell=f"{shell} halrun -f test.hal; echo status $?")
    lines = [line for line in done.stdout.splitlines() if line in ("TRUE", "FALSE") or line.lstrip("-").isdigit() or line.startswith("status")]
    return lines, done.stdout


@pytest.mark.parametrize("fill, stay", [("plausible", ""), ("plausible", "stay"), ("running", "stay"), ("noise", "stay"), ("open", "stay")])
def test_a_block_at_motions_key_that_is_not_motions(tmp_path, foreign_motion, fill, stay):
    """The way ahead is predicted; rtapi_app lives."""
    begin = f"{foreign_motion} {fill} {stay} > said {'&' if stay else ';'} while ! grep -q ready said; do sleep 0.05; done;"
    lines, out = hal(tmp_path, TRACKER, begin)
    assert lines == ["FALSE", "TRUE", "0", "status 0"], out


MOTION = """
loadrt threads name1=servo period1=1000000
loadrt trivkins
loadrt tpmod
loadrt homemod
loadrt motmod servo_period_nsec=1000000 num_joints=3
addf motion-command-handler servo
addf motion-controller servo
"""


def test_motion_is_unloaded(tmp_path):
    """Its queue is gone with it: the tracker, which runs on, does not look there any more."""
    text = MOTION + TRACKER.replace("loadrt threads name1=servo period1=1000000", "") + """
unloadrt motmod
start
loadusr -w sleep 0.3
getp stock-tracker.0.path-known
getp stock-tracker.0.ready
"""
    lines, out = hal(tmp_path, text, "")
    assert lines == ["FALSE", "TRUE", "0", "FALSE", "TRUE", "status 0"], out
