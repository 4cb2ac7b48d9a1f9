# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise-headless on the simulated mill: what it runs, reports and refuses."""

import json
import os
import re
import subprocess
import time

import numpy as np
import pytest

from chipwise.headless import runner
from support.headless_rig import headless_ini, own_ini

pytestmark = pytest.mark.machine

SPEED = 4  # LinuxCNC drops a command that motion does not answer within COMM_TIMEOUT, 30 s of this clock
KEYS = {
    "program",
    "finished",
    "cycle_s",
    "volume_mm3",
    "rate_target",
    "rate_mean",
    "rate_peak",
    "over_target_share",
    "holes_chopped",
    "largest_piece_mm",
    "stock",
    "errors",
}
SQUARE = "G21 G90 G17 G40\nG0 X10 Y10 Z20\nF1200\nG1 X60\nG2 X60 Y30 I0 J10\nG1 X10\nM2\n"


def run(tmp_path, text, **options):
    program = tmp_path / "program.ngc"
    program.write_text(text)
    options.setdefault("speed", SPEED)
    options.setdefault("timeout", 1200)  # s of the machine; a busy computer needs many of them to start
    return runner.run_headless(str(program), **options)


def test_program_runs_to_its_end(tmp_path):
    """50 mm + a half circle of 10 mm + 50 mm at 20 mm/s, after the rapids."""
    log = str(tmp_path / "log.npz")
    summary = run(tmp_path, SQUARE, log=log)
    assert summary["exit_status"] == 0
    assert set(summary) == KEYS | {"exit_status"}
    assert summary["program"] == "program.ngc"
    assert summary["finished"] is True
    assert summary["errors"] == [] and summary["stock"] is None
    feed_s = (50 + np.pi * 10 + 50) / 20
    rapid_s = 70 / 100 + 100 / 500  # Z from 90 to 20 at 100 mm/s, 500 mm/s2
    data = np.load(log)
    # by the servo clock: what the display program adds at both ends depends on how busy the machine is
    moving = np.flatnonzero(data["velocity"] > 0)
    moving_s = (moving[-1] - moving[0] + 1) * 0.001
    assert moving_s == pytest.approx(feed_s + rapid_s, abs=0.5)
    assert summary["cycle_s"] >= moving_s
    assert data["period"] == 0.001
    assert data["units_per_mm"] == 1.0
    assert len(data["sample"]) == pytest.approx(summary["cycle_s"] / 0.001, abs=1)
    assert (np.diff(data["sample"]) == 1).all()
    end = [data[axis][-1] for axis in "xyz"]
    assert end == pytest.approx([10, 30, 20], abs=1e-5)
    assert set(data["motion_type"]) >= {1, 2, 3}
    # the clock is honest at this speed: the log's positions move at the logged velocity
    step = np.sqrt(sum(np.diff(data[axis]) ** 2 for axis in "xyz")) / 0.001
    assert np.abs(step - data["velocity"][1:]).max() < 0.5
    assert step.max() < 100.5


def test_log_as_csv(tmp_path):
    log = tmp_path / "log.csv"
    run(tmp_path, "G21 G90 F600\nG1 X5\nM2\n", log=str(log))
    header = log.read_text().split("\n", 1)[0].split(",")
    assert header[:4] == ["sample", "x", "y", "z"]
    assert np.loadtxt(str(log), delimiter=",", skiprows=1).shape[1] == len(header)


def test_tool_change_and_pause_need_nobody(tmp_path):
    summary = run(tmp_path, "G21 G90 F1000\nT1 M6\nG43\nG0 Z80\nM0\nG1 X5\nT2 M6\nM30\n")
    assert (summary["exit_status"], summary["finished"]) == (0, True)


@pytest.mark.parametrize(
    "text, words",
    [
        ("G21 G90 F1000\nG0 X5\nG1 X9999\nM2\n", "exceed X's positive limit"),
        ("G21 G90\nG0 X5\nG1 X6\nM2\n", "zero feed rate"),
        ("G21 G90\nG0 X5\nQ\nM2\n", ""),
        ("G21 G90\nG0 X5\n", "program end"),
    ],
)
def test_operator_error_is_reported(tmp_path, text, words):
    summary = run(tmp_path, text)
    assert summary["exit_status"] == 1
    assert summary["finished"] is False
    assert any(words in error for error in summary["errors"])


def test_endless_program_is_given_up(tmp_path):
    """After the time-out; a busy computer may need more than 25 s of its own to start LinuxCNC."""
    for timeout in (100, 400, 1600):
        summary = run(tmp_path, "G21 G90 F6000\nO1 while [1]\nG1 X50\nG1 X0\nO1 endwhile\nM2\n", timeout=timeout)
        assert summary["exit_status"] == 1
        assert summary["finished"] is False
        if "end of program" in summary["errors"][0]:
            break
    assert "end of program" in summary["errors"][0]


def test_missing_program(tmp_path):
    summary = runner.run_headless(str(tmp_path / "none.ngc"), speed=SPEED, timeout=300)
    assert summary["exit_status"] == 1
    assert "none.ngc does not exist" in summary["errors"][0]


@pytest.mark.parametrize(
    "settings, words",
    [
        ({}, "no program; LinuxCNC starts this as its display"),
        (
            {"CHIPWISE_PROGRAM": "x.ngc", "CHIPWISE_TIMEOUT": "soon"},
            "CHIPWISE_TIMEOUT is soon; it has to be a number of seconds above 0",
        ),
    ],
)
def test_started_by_hand(root, settings, words):
    """Without LinuxCNC and what it wants: the summary says so, nothing is traced back."""
    env = {key: value for key, value in os.environ.items() if not key.startswith("CHIPWISE_")} | settings
    done = subprocess.run([root / "bin" / "chipwise-headless"], env=env, text=True, capture_output=True, timeout=300)
    assert done.returncode == 1 and done.stderr == ""
    assert words in json.loads(done.stdout)["errors"][0]


def test_killed_task_does_not_hang_it(tmp_path):
    """milltask is killed while the program runs; the display program notices."""
    program = tmp_path / "long.ngc"
    program.write_text("G21 G90 F60\nG1 X300\nM2\n")
    summary_path = tmp_path / "summary.json"
    cutting = '[ "$(halcmd getp motion.motion-type 2>/dev/null)" = 2 ]'
    script = "linuxcnc -r %s & main=$!; until %s; do sleep 0.1; done; kill -9 $(pidof milltask); wait $main" % (
        runner.HEADLESS,
        cutting,
    )
    env = dict(os.environ, CHIPWISE_PROGRAM=str(program), CHIPWISE_TIMEOUT="600", CHIPWISE_SUMMARY=str(summary_path))
    env.pop("DISPLAY", None)
    done = subprocess.run(
        [runner.SANDBOX, "--timeout", "600", "--", "sh", "-c", script],
        env=env,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == 1, done.stdout
    summary = json.loads(summary_path.read_text())
    assert summary["finished"] is False
    assert "task has ended" in summary["errors"][0]


def test_report_of_the_cycles_reaches_the_summary(tmp_path):
    """The task inherits the environment; only the real run counts, not a preview."""
    (tmp_path / "toplevel.py").write_text("import remap\n")
    (tmp_path / "remap.py").write_text(
        "import sys\nsys.path.insert(0, %r)\n"
        "from chipwise import report\n"
        "def m405(self, **words):\n"
        "    if self.task:\n"
        '        report.record("hole", chopped=True, largest_piece_mm=words["q"])\n'
        "    return 0\n" % os.path.join(runner.ROOT, "remap")
    )
    ini = own_ini(
        tmp_path,
        PYTHON="TOPLEVEL = %s/toplevel.py\nPATH_PREPEND = %s" % (tmp_path, tmp_path),
        RS274NGC="REMAP = M405 modalgroup=10 argspec=q python=m405",
    )
    summary = run(tmp_path, "G21 G90 F600\nM405 Q3.5\nG1 X1\nM405 Q2\nM2\n", machine=runner.Machine(ini))
    assert summary["errors"] == []
    assert summary["holes_chopped"] == 2
    assert summary["largest_piece_mm"] == 3.5


SLOTS = """G21 G90 G17 G40 G64 P0.01
T1 M6
M3 S10000
M52 P1
M250 P0 Q0 R-10 I40 J60 K10
F1200
M251 Q3.6 P2 E3000
G0 X-10 Y20 Z10
G0 Z-3
G1 X50
G0 Z10
G0 X-10 Y24
G0 Z-3
G1 X50
M252
G0 Z10
M2
"""


@pytest.mark.parametrize("machine", ["mill", "mill_inch"])
def test_figures_of_a_known_cut(tmp_path, machine):
    """A 6 mm tool, 40 mm of stock, 3 mm deep: a full slot and one 4 mm beside it."""
    ini = headless_ini(tmp_path, machine)
    log = str(tmp_path / "log.npz")
    summary = run(tmp_path, SLOTS, machine=runner.Machine(ini), log=log)
    assert (summary["exit_status"], summary["errors"]) == (0, []), summary["errors"]
    assert summary["volume_mm3"] == pytest.approx((6 + 4) * 40 * 3, rel=0.005) and summary["stock"] == "program"
    assert summary["rate_target"] == pytest.approx(3600)
    assert summary["rate_mean"] == pytest.approx(3600, rel=0.03)
    assert summary["over_target_share"] < 0.05
    assert np.load(log)["units_per_mm"] == pytest.approx(1 if machine == "mill" else 1 / 25.4)


UNKNOWN = "G21 G90 G64 P0.01\nT1 M6\nG0 X-40 Y20 Z5\nG1 Z-3 F600\nX30\nG0 Z5\nM2\n"  # without M250


def test_a_program_as_it_is_and_set_up(tmp_path):
    """It is started when the monitor has read it: on the stock that is assumed, and with the set-up beside it, which
    raises the feed above F."""
    assumed = run(tmp_path, UNKNOWN)
    assert (assumed["exit_status"], assumed["errors"], assumed["stock"]) == (0, [], "assumed")
    assert assumed["volume_mm3"] == pytest.approx(70 * 6 * 3 + np.pi * 9 * 3, rel=0.02)
    done = subprocess.run(
        [
            os.path.join(runner.ROOT, "bin", "chipwise"),
            "setup",
            str(tmp_path / "program.ngc"),
            "--ini",
            runner.HEADLESS,
            "--yes",
            "--stock",
            "-10",
            "0",
            "-10",
            "40",
            "40",
            "0",
        ],
        text=True,
        capture_output=True,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode == 0, done.stderr
    job = run(tmp_path, UNKNOWN, log=str(tmp_path / "log.npz"))
    assert (job["exit_status"], job["errors"], job["stock"]) == (0, [], "job")
    assert 0.9 * 6 * 3 * 600 < job["rate_peak"] < 1.02 * 6 * 3 * 600
    log = np.load(tmp_path / "log.npz")
    assert log["velocity"][(log["motion_type"] == 2) & (log["x"] < -20)].max() == pytest.approx(
        20.0, rel=0.01
    )  # twice F, in air


GUARDED = {
    # what: (program, words of the message)
    "a traverse into stock": ("G0 Z-5\nG0 X30\n", "rapid stopped"),
    "longer than the flutes": ("G0 Z-9\nF600\nG1 X30\n", "flutes 5.00 mm long"),
}


@pytest.mark.parametrize("what", GUARDED)
def test_a_stop_by_a_guard_ends_the_run(tmp_path, what):
    """With the message, at once, and not with 0; nobody is there to press Stop."""
    moves, words = GUARDED[what]
    (tmp_path / "tools.toml").write_text("[tool.1]\nflute_length = 5\n")
    timeout = 600
    begun = time.monotonic()
    summary = run(
        tmp_path,
        "G21 G90 G64 P0.01\nT1 M6\nM250 P0 Q0 R-10 I40 J40 K10\nG0 X-10 Y20\n" + moves + "M2\n",
        timeout=timeout,
        machine=runner.Machine(settings={"TOOL_GEOMETRY": str(tmp_path / "tools.toml")}),
    )
    print("took %.1f s, cycle %.1f s" % (time.monotonic() - begun, summary["cycle_s"]))
    assert summary["exit_status"] == 1 and summary["finished"] is False
    assert len(summary["errors"]) == 2, summary["errors"]
    assert words in summary["errors"][0]
    assert re.search(r"a guard has stopped the program \(line [0-9]+\)", summary["errors"][1])
    assert summary["cycle_s"] < 0.1 * timeout


def test_a_stop_by_a_guard_with_a_dead_monitor(tmp_path):
    """No message can come: the run ends all the same and names guard and line."""
    program = tmp_path / "program.ngc"
    program.write_text("G21 G90\nT1 M6\nM250 P0 Q0 R-10 I40 J40 K10\nG0 X-10 Y20\nG0 Z-5\nF300\nG1 X-4\nG0 X30\nM2\n")
    summary_path = tmp_path / "summary.json"
    script = (
        'linuxcnc -r %s & main=$!; while ! [ "$(halcmd getp stock-tracker.0.ready)" = TRUE ]; do sleep 0.1; done; '
        % runner.HEADLESS
        + """kill -9 $(halcmd show comp | awk '$3 == "chipwise-monitor" {print $4}'); wait $main"""
    )
    env = dict(os.environ, CHIPWISE_PROGRAM=str(program), CHIPWISE_TIMEOUT="600", CHIPWISE_SUMMARY=str(summary_path))
    env.pop("DISPLAY", None)
    subprocess.run(
        [runner.SANDBOX, "--timeout", "600", "--speed", "4", "--", "sh", "-c", script],
        env=env,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    summary = json.loads(summary_path.read_text())
    assert summary["finished"] is False and "a guard has stopped the program (line 8)" in summary["errors"][-1], summary


def test_samples_that_a_late_reader_loses_are_said(tmp_path):
    """LinuxCNC's counter of samples leaves out what a full buffer lost; the log's facts and a line on stderr do not."""
    hal, log, said = (tmp_path / name for name in ("small.hal", "log.npz", "said.txt"))
    with open(os.path.join(runner.ROOT, "hal/headless.hal")) as handle:
        hal.write_text(re.sub(r"depth=\d+", "depth=5", handle.read()))
    ini = own_ini(tmp_path)
    with open(ini) as handle:
        text = handle.read().replace(f"{runner.ROOT}/hal/headless.hal", str(hal))
    with open(ini, "w") as handle:
        handle.write(text)
    run(tmp_path, SQUARE, machine=runner.Machine(ini), log=str(log), output=str(said))
    with np.load(log) as found:
        lost, sample = int(found["overruns"]), found["sample"]
    assert lost > 0 and np.diff(sample).max() == 1
    assert f"chipwise-headless: {lost} samples lost" in said.read_text()
