# SPDX-License-Identifier: GPL-2.0-or-later
"""Plans on the simulated lathe, as a written program and as G26: LinuxCNC follows the path, spindle, tool changes and
feed per revolution included."""

import json
import os
import subprocess

import numpy as np
import pytest

from chipwise import cli
from chipwise.headless import runner
from chipwise.ini import Ini
from chipwise.settings import load_settings
from chipwise.turning.plan import make_plan
from chipwise.turning.read_part import Machine, job_of, make_order
from chipwise.turning.request import read_request
from chipwise.turning.times import times
from support import ROOT
from support.operate import operate
from support.turning_oracle import moves
from support.turning_paths import distances

pytestmark = pytest.mark.machine
LATHE = os.path.join(ROOT, "configs", "lathe_headless.ini")
HOME = (100.0, 100.0)  # z, x where configs/lathe.ini begins, and changes tools


@pytest.mark.parametrize(
    "name, code",
    [("turning_half", "written"), ("turning_half", "G26"), ("turning_flange", "G26"), ("turning_shaft", "G26")],
)
def test_linuxcnc_follows_the_plan(tmp_path, capsys, name, code):
    log = tmp_path / "log.npz"
    drawn, program, plan = (
        os.path.join(ROOT, "nc_files", name + ".ngc"),
        tmp_path / "turned.ngc",
        tmp_path / "plan.json",
    )
    assert cli.main(["turn", drawn, "-o", str(program), "--json", str(plan)]) == 1
    capsys.readouterr()
    on_the_lathe(drawn if code == "G26" else program, log, 5)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["finished"] and summary["errors"] == []
    rows = np.load(log)
    path = np.array(
        [
            HOME,
            *(
                p
                for _, _, points in moves(f"G0 X{HOME[1]} Z{HOME[0]}\n" + program.read_text(), 1.0, HOME, 0.02)
                for p in points
            ),
        ]
    )
    moving = np.column_stack((rows["z"], rows["x"]))[rows["motion_type"] > 0]
    assert distances(moving[:: max(len(moving) // 4000, 1)], path).max() < 0.001
    assert np.hypot(*(moving[-1] - HOME)) < 0.001
    check_times(json.loads(plan.read_text()), spent_on(drawn, LATHE), rows)
    feeds = np.array([points[-1] for _, kind, points in moves(program.read_text(), 1.0) if kind == "feed"])
    assert (
        distances(feeds[:: max(len(feeds) // 200, 1)], moving[::5]).max() < 0.06
    )  # every part of it has been travelled
    if name == "turning_shaft":
        check_thread(rows, 1.5, 800 / 60, -1.3, -14.0, 8)


def spent_on(drawn, ini):
    """Times of the plan of a program whose tools are changed at HOME."""
    machine = Machine(Ini(ini), load_settings(ini), ini)
    with open(drawn) as file:
        text = file.read()
    request = read_request(text, machine.startup)
    return times(
        make_plan(make_order(job_of(drawn, request, machine), text, request, machine)), request, machine.motion, HOME
    )


def check_times(plan, spent, rows):
    """The time of the plan is that in which the axes move; travel to the tool changes is named apart in a plan without
    a machine."""
    period, moving = float(rows["period"]), np.hypot(np.gradient(rows["x"]), np.gradient(rows["z"])) > 1e-9
    took = moving.sum() * period
    print(
        f"planned {spent.total:.1f} s, moved {took:.1f} s; {spent.travel:.1f} s of travel, {spent.changes} tool changes"
    )
    assert abs(spent.total - took) < 0.05 * took
    assert plan["time_s"] == pytest.approx(sum(s["time_s"] for s in plan["steps"])) == pytest.approx(sum(spent.steps))
    assert plan["travel_s"] is None and plan["tool_changes"] == spent.changes > 0


def check_thread(rows, pitch, turns_per_s, z1, z0, count):
    """The passes of the shaft's thread are in step with the spindle: the same pitch all along it, the same phase in
    every pass."""
    z, x, period = rows["z"], rows["x"], float(rows["period"])
    time, speed = rows["sample"] * period, np.gradient(rows["z"]) / period
    cutting = (
        (z < z1) & (z > z0) & (np.abs(speed + pitch * turns_per_s) < 0.2 * pitch * turns_per_s) & (x < 10.0) & (x > 9.0)
    )
    assert (
        count * (z1 - z0) / (pitch * turns_per_s) * 0.98
        < cutting.sum() * period
        < count * (z1 - z0) / (pitch * turns_per_s) * 1.02
    )
    turns = (
        time[cutting] * turns_per_s + z[cutting] / pitch
    )  # of the spindle, less those that the thread has: one number but for whole turns
    phase = np.angle(np.exp(2j * np.pi * (turns - turns[0]))) / (2 * np.pi)
    print(f"thread: pitch and phase within {pitch * np.ptp(phase):.4f} mm")
    assert pitch * np.ptp(phase) < 0.01


def on_the_lathe(program, log, speed=4):
    """Run a program on the simulated lathe, with the log of its servo periods."""
    environment = {
        **os.environ,
        "CHIPWISE_PROGRAM": str(program),
        "CHIPWISE_TIMEOUT": "3000",
        "CHIPWISE_SUMMARY": str(log.with_name("summary.json")),
        "CHIPWISE_LOG": str(log),
    }
    done = subprocess.run(
        [
            os.path.join(ROOT, "bin", "chipwise-sandbox"),
            "--speed",
            str(speed),
            "--timeout",
            "600",
            "--",
            *runner.start_command(LATHE, {}, speed),
        ],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=700,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-2000:]


def test_two_starts_are_half_a_turn_apart(tmp_path):
    """M20 x 1.5 with two starts in LinuxCNC: in step with the spindle all along, and every second pass half a turn of
    the other ones."""
    text = (
        "(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=20,ZMIN=-60,ZMAX=0)\n(LATHE,THREAD=8)\nG21 G18 G8 G95 G97 S400 M3\n"
        "G26 Q100 F0.4\nM2\nO100 sub\nG0 X8.2 Z0\n"
        "G1 X10 Z-1.8\nG1 Z-14 (THREAD,PITCH=1.5,STARTS=2)\nG1 X8.85 Z-16\nG1 Z-19.2\nG1 X10\nG1 Z-30\nO100 endsub\n"
    )
    program, log = tmp_path / "two.ngc", tmp_path / "log.npz"
    program.write_text(
        text + "O101 sub\nG0 X8.2 Z0\nG1 X10 Z-1.8\nG1 Z-14\nG1 X8.85 Z-16\nG1 Z-19.2\nG1 X10\nG1 Z-60\nO101 endsub\n"
    )
    program.write_text(program.read_text().replace("G26 Q100", "G26 Q100 P101"))
    on_the_lathe(program, log)
    rows, lead, turns_per_s = np.load(log), 3.0, 400 / 60
    z, x, period = rows["z"], rows["x"], float(rows["period"])
    speed = np.gradient(z) / period
    cutting = (
        (z < -1.3)
        & (z > -14.0)
        & (np.abs(speed + lead * turns_per_s) < 0.02 * lead * turns_per_s)
        & (x < 10.0)
        & (x > 9.0)
    )
    turns = rows["sample"][cutting] * period * turns_per_s + z[cutting] / lead
    begins = np.flatnonzero(np.diff(np.flatnonzero(cutting), prepend=-9) > 1)
    phases = [np.unwrap(2 * np.pi * part) / (2 * np.pi) for part in np.split(turns, begins[1:])]
    assert len(phases) == 16
    assert all(lead * np.ptp(phase) < 0.01 for phase in phases)
    middles = [np.median(phase) for phase in phases]
    for before, after in zip(
        middles, middles[1:]
    ):  # on a busy computer the log loses a period now and then: 0.007 of a turn
        assert abs((after - before) % 1.0 - 0.5) < 0.02, middles


def test_the_check_of_a_thread_sees_a_pass_out_of_phase():
    """Eight passes of 20 mm/s, 25 turns of the spindle apart; one of them 1/50 of a turn late."""

    def rows(late):
        z = np.concatenate(
            [
                np.where(np.arange(1875) < 1000, -0.02 * np.arange(1875) - 0.02 * (-late if k == 5 else 0), 1.0)
                for k in range(8)
            ]
        )
        return {"z": z, "x": np.full(len(z), 9.5), "sample": np.arange(len(z)), "period": 0.001}

    check_thread(rows(0.0), 1.5, 800 / 60, -1.3, -14.0, 8)
    with pytest.raises(AssertionError):
        check_thread(rows(1.5), 1.5, 800 / 60, -1.3, -14.0, 8)


def part(more="", code="G26 Q100 I0.3 D1 F200 E100"):
    return (
        f"(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=30,ZMIN=-60,ZMAX=0)\n(LATHE,ROUGH=1)\nG21 G18 G8 G94 G97 S500 M3\n"
        f"{more}\n{code}\nM2\n"
        "O100 sub\nG0 X8 Z0\nG1 Z-20\nO100 endsub\n"
    )


CHUCK, WHOLE = "G22 X20 Z-19", "part goes into a barrier"


def test_a_barrier_ends_with_its_program_and_stop_works(tmp_path):
    """What outlives a program, an abort, E-stop: no barrier; the machine goes on with the next program."""
    steps = [
        ["start", part(CHUCK)],
        ["finish"],
        ["position"],  # refused, nothing has moved
        ["start", part(CHUCK, "")],
        ["finish"],  # a barrier that the program leaves
        ["start", part("", "G26 Q100 D1 F200 H1")],
        ["finish"],  # is not there for the next one
        ["mdi", CHUCK],
        ["start", part("", "G26 Q100 D1 F200 H1")],
        ["finish"],  # nor is one of MDI
        ["start", part("", "G26 Q100 I0.3 D1 F60")],
        ["until", "motion.motion-type", "=", 2],
        ["abort"],
        ["errors"],
        ["start", part("", "G26 Q100 I0.3 D1 F60")],
        ["finish"],  # refused beside the work
        ["mdi", "G0 X100"],
        ["mdi", "G0 Z100"],
        ["start", part("", "G27 Q100 D1 F200 L2")],
        ["finish"],
        ["start", part("", "G26 Q100 I0.3 D1 F60")],
        ["until", "motion.motion-type", "=", 2],
        ["estop"],
        ["on"],
        ["errors"],
        ["mdi", "G0 X100 Z100"],
        ["mdi", "G0 X50"],
        ["position"],
        ["messages"],
    ]
    found = operate(tmp_path, steps, ini="lathe.ini")
    refused, place, left, next_one, after_mdi, aborted, beside = (found[k] for k in (1, 2, 4, 6, 9, 13, 15))
    assert len(refused) == 1 and WHOLE in refused[0] and "(line 5)" in refused[0]
    assert place == pytest.approx([100.0, 0.0, 100.0], abs=1e-6)
    assert left == [] and next_one == [] and after_mdi == [] and aborted == []
    assert len(beside) == 1 and "the tool is beside the work at Z" in beside[0]
    assert found[19] == [] and found[-2] == pytest.approx([50.0, 0.0, 100.0], abs=1e-6)
    assert any("not needed: the part has no bore" in text for text in found[-1])
