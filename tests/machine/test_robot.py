# SPDX-License-Identifier: GPL-2.0-or-later
"""The simulated robot in the real LinuxCNC: one sub at four stations, judged by the joints of every servo period and an
own chain of rotations (tests/support/puma_oracle.py); and what it cannot do, refused before it moves."""

import json
import os
import subprocess
import tomllib

import numpy as np
import pytest

from chipwise.headless import runner
from support import ROOT
from support.headless_rig import SLOW_MOTION
from support.puma_oracle import about, tip

pytestmark = pytest.mark.machine

CONFIGS = ROOT / "configs"
DISPLAY = ROOT / "tests" / "support" / "robot_display.py"


def sampler(count):
    """HAL lines that sample so many joints."""
    nets = "".join(f"net sampled-{k} joint.{k}.pos-cmd => sampler.0.pin.{k}\n" for k in range(count))
    return f"loadrt sampler depth=300000 cfg={'f' * count}\n{nets}addf sampler.0 servo-thread\n"


SUB = [
    "o100 sub",
    "G0 X0 Y0 Z40",
    "G0 Z5",
    "G1 Z-1 F900",
    "X40",
    "G3 X40 Y30 J15",
    "G1 X0",
    "Y0",
    "G0 Z40",
    "o100 endsub",
]


def machine(tmp_path, programs, stations=None, edits=(), before=":", count=6):
    """(answer of each program, joints (n, count) of every servo period).  edits: more of sed, on robot.ini; before: a
    shell command in configs/."""
    (tmp_path / "sampler.hal").write_text(sampler(count))
    paths = []
    for k, text in enumerate(programs):
        paths.append(str(tmp_path / f"{k}.ngc"))
        (tmp_path / f"{k}.ngc").write_text(text)
    edits = [
        *edits,
        f"s#^DISPLAY = .*#DISPLAY = {DISPLAY}#",
        "s#^OPEN_FILE.*##",
        f"s#^COMM_TIMEOUT = .*#{SLOW_MOTION}#",
        f"s#^HALFILE = .*#&\\nHALFILE = {tmp_path}/sampler.hal#",
    ]
    if stations:
        (tmp_path / "stations.toml").write_text(stations)
        edits.append(f"s#^STATIONS = .*#STATIONS = {tmp_path}/stations.toml#")
    script = (
        f"cd {CONFIGS} && {before} && sed "
        + " ".join(f"-e '{edit}'" for edit in edits)
        + " robot.ini > scripted.ini && linuxcnc -r scripted.ini"
    )
    env = dict(
        os.environ,
        CHIPWISE_PROGRAMS=json.dumps(paths),
        CHIPWISE_ANSWERS=str(tmp_path / "answers.json"),
        CHIPWISE_SAMPLES=str(tmp_path / "joints.txt"),
    )
    env.pop("DISPLAY", None)
    done = subprocess.run(
        [runner.SANDBOX, "--timeout", "900", "--speed", "4", "--", "sh", "-c", script],
        env=env,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert (tmp_path / "answers.json").exists(), done.stdout[-3000:]
    answers = json.loads((tmp_path / "answers.json").read_text())
    assert len(answers) == len(programs), done.stdout[-3000:]
    rows = [line.split() for line in (tmp_path / "joints.txt").read_text().splitlines() if line[:1] in "-0123456789"]
    return answers, np.array([row[1:] for row in rows if len(row) == count + 1], float)


def frames():
    """{station: (matrix, origin)} by cross products of the points that are in the file."""
    found = {}
    for number, points in tomllib.loads((CONFIGS / "robot_stations.toml").read_text())["station"].items():
        one, two, three = (np.array(points[q], float) for q in "123")
        x = (two - one) / np.linalg.norm(two - one)
        z = np.cross(x, three - one)
        z /= np.linalg.norm(z)
        found[int(number)] = np.column_stack([x, np.cross(z, x), z]), one
    return found


def off_the_outline(points):
    """Distance (mm) of points in a station from the path of SUB at and below its Z5."""
    x, y, z = points.T
    flat = [
        np.hypot(np.maximum(np.maximum(-x, x - 40), 0), y),
        np.hypot(np.maximum(np.maximum(-x, x - 40), 0), y - 30),
        np.hypot(x, np.maximum(np.maximum(-y, y - 30), 0)),
        np.where(x >= 40, np.abs(np.hypot(x - 40, y - 15) - 15), np.inf),
    ]
    level = np.hypot(np.min(flat, axis=0), z + 1)
    return np.minimum(level, np.hypot(np.hypot(x, y), np.maximum(np.maximum(-1 - z, z - 40), 0)))


def test_one_sub_at_four_stations(tmp_path):
    """0.001 mm at every servo period, the tool square to each station; the last one is upside down."""
    (answer,), joints = machine(tmp_path, [(ROOT / "nc_files" / "stations.ngc").read_text()])
    assert not [text for text in answer["errors"] if "chipwise" not in text or "refuse" in text], answer["errors"]
    places, tools = (np.array(part) for part in zip(*(tip(row) for row in joints)))
    for number, (matrix, origin) in frames().items():
        local = (places - origin) @ matrix
        square = np.abs(np.array([tool for tool in tools]) - matrix @ about("x", 180)).max(axis=(1, 2)) < 1e-6
        cut = square & (local[:, 2] < 5) & (np.abs(local[:, 0] - 27) < 60) & (np.abs(local[:, 1] - 15) < 60)
        assert cut.sum() > 500, number
        assert off_the_outline(local[cut]).max() < 0.001, (number, off_the_outline(local[cut]).max())
        print(f"station {number}: {cut.sum()} periods, {off_the_outline(local[cut]).max():.2e} mm off")
        for corner in ((0, 0, -1), (40, 0, -1), (55, 15, -1), (40, 30, -1), (0, 30, -1)):
            assert np.linalg.norm(local[cut] - corner, axis=1).min() < (0.03 if corner[0] else 0.001), (
                number,
                corner,
            )  # it stops in the corners at X0
    assert frames()[4][0][2, 2] < -0.9
    assert tip(answer["joints"])[0] == pytest.approx(frames()[4][0] @ (0, 0, 40) + frames()[4][1], abs=1e-3)


def program(*lines):
    return "\n".join([*SUB, "G21 G90 G17 G40 G49 G61 F900", *lines, "M2", ""])


def test_what_the_robot_cannot_do(tmp_path):
    """Beyond a joint's limit, through a singularity, a tool length, a turned work offset: refused, and no joint has
    moved."""

    def level(x, y, z):
        return f"1 = [{x}, {y}, {z}]\n2 = [{x + 100}, {y}, {z}]\n3 = [{x}, {y + 80}, {z}]\n"

    stations = (
        "[station.1]\n"
        + level(680, 0, 0)
        + "[station.3]\n1 = [430, 20, 320]\n2 = [530, 20, 320]\n3 = [430, -60, 320]\n"
        "[station.4]\n" + level(450, 0, -100)
    )
    cases = [
        (program("G75 Q100 P1"), "line 5 of the sub, copy 1: joint 2 would be at -80"),
        (program("G75 Q100 P3"), "too fast, or near a singularity"),
        (program("G43.1 Z20", "G75 Q100 P4"), "a tool length is on (G43)"),
        (program("G49", "G10 L2 P1 A5", "G75 Q100 P4"), "the work offset of A is not 0"),
        (program("G10 L2 P1 A0", "G75 Q100 X680"), "joint 2 would be at -80"),
        (program("G75 Q100 P4"), ""),
    ]
    answers, joints = machine(tmp_path, [text for text, _words in cases], stations)
    home = [0, -70, 10, 0, 60, 0]
    for (_text, words), answer in zip(cases[:-1], answers):
        assert any(words in text for text in answer["errors"]), (words, answer["errors"])
        assert answer["joints"] == pytest.approx(home, abs=1e-5)
    assert not [text for text in answers[-1]["errors"] if "chipwise" in text] and answers[-1][
        "joints"
    ] != pytest.approx(home, abs=1)
    assert tip(answers[-1]["joints"])[0] == pytest.approx((450, 0, -60), abs=1e-3)


def test_the_robot_without_a_screen(tmp_path):
    """configs/robot_headless.ini runs the four stations and ends above the last one."""
    env = {
        **os.environ,
        "CHIPWISE_PROGRAM": str(ROOT / "nc_files" / "stations.ngc"),
        "CHIPWISE_TIMEOUT": "3000",
        "CHIPWISE_SUMMARY": str(tmp_path / "summary.json"),
        "CHIPWISE_LOG": str(tmp_path / "log.npz"),
    }
    done = subprocess.run(
        [
            runner.SANDBOX,
            *("--timeout", "900", "--speed", "4", "--"),
            *runner.start_command(str(CONFIGS / "robot_headless.ini"), {}, 4.0),
        ],
        env=env,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == 0, done.stdout[-3000:]
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["finished"] and summary["errors"] == []
    rows = np.load(tmp_path / "log.npz")
    matrix, origin = frames()[4]
    assert [rows[axis][-1] for axis in "xyz"] == pytest.approx(matrix @ (0, 0, 40) + origin, abs=1e-3)


# ---- a table that tilts and turns ------------------------------------------------------------------------------------

PIVOT, OFFSET, LENGTH = np.array([15.0, -7.0, -30.0]), np.array([0.0, 20.0, 10.0]), 35.0
TABLE_HAL = "sed -e '/pumakins/d' -e '/joint.5/d' ../hal/robot.hal > table.hal" + "".join(
    f" && echo '{line}' >> table.hal"
    for line in [
        *(f"setp xyzac-trt-kins.{axis}-rot-point {value}" for axis, value in zip("xyz", PIVOT)),
        *(f"setp xyzac-trt-kins.{axis}-offset {value}" for axis, value in zip("yz", OFFSET[1:])),
        "net tool-length motion.tooloffset.z xyzac-trt-kins.tool-offset",
    ]
)
TABLE = [
    "s#^HALFILE = .*#HALFILE = table.hal#",
    "s#^KINEMATICS.*#KINEMATICS = xyzac-trt-kins#",
    "s#^JOINTS = .*#JOINTS = 5#",
    "s#^COORDINATES.*#COORDINATES = X Y Z A C#",
    "s#^TOOL_POSE.*#TOOL_POSE = 0 0 0#",
    "s#^HOME_*O*F*F*S*E*T* = .*##",
    "s#^M\\([IA][NX]\\)_LIMIT = -*[0-9]*#&0#",
    "/JOINT_3/,/JOINT_4/s#^M\\(..\\)_LIMIT = \\(-*\\).*#M\\1_LIMIT = \\260#",
]


def tip_on_table(joints):
    """(tip on the part (n, 3), direction of the tool there (n, 3)) of joints X Y Z A C."""
    places, tools = [], []
    for row in joints:
        back = about("z", -row[4]) @ about("x", -row[3])
        places.append(
            PIVOT + about("z", -row[4]) @ (about("x", -row[3]) @ (row[:3] - (0, 0, LENGTH) - PIVOT - OFFSET) + OFFSET)
        )
        tools.append(back[:, 2])
    return np.array(places), np.array(tools)


def test_a_tilting_table_turns_with_the_station(tmp_path):
    """xyzac-trt-kins, a tool with a length: 0.001 mm on the part at every servo period, the tool square to each
    station; too steep is refused."""

    def station(number, turn, lean, origin):
        matrix = about("z", turn) @ about("x", lean)
        points = [
            (np.array(origin) + matrix @ np.array(point, float)).tolist()
            for point in ((0, 0, 0), (100, 0, 0), (0, 80, 0))
        ]
        return matrix, f"[station.{number}]\n" + "".join(f"{k} = {point}\n" for k, point in enumerate(points, 1))

    places = {1: (15, 8, (10, 20, 0)), 2: (30, 40, (-20, 5, 10)), 3: (-120, 25, (30, -10, 5))}
    made = {number: station(number, *place) for number, place in places.items()}
    stations = "".join(text for _matrix, text in [*made.values(), station(9, 10, 75, (0, 0, 0))])
    run = "\n".join(
        [*SUB, "G21 G90 G17 G40 G61 F900", f"G43.1 Z{LENGTH}", "G0 Z60", *(f"G75 Q100 P{k}" for k in made), "M2", ""]
    )
    steep = "\n".join([*SUB, "G21 G90 G17 G40 G61 F900", f"G43.1 Z{LENGTH}", "G0 Z60", "G75 Q100 P9", "M2", ""])
    answers, joints = machine(tmp_path, [run, steep], stations, TABLE, TABLE_HAL, 5)
    assert not [text for text in answers[0]["errors"] if "chipwise" in text], answers[0]["errors"]
    tips, tools = tip_on_table(joints)
    for number, (matrix, _text) in made.items():
        local = (tips - np.array(places[number][2])) @ matrix
        cut = (
            (np.abs(tools - matrix[:, 2]).max(axis=1) < 1e-6)
            & (np.abs(local[:, 2] - 1) < 4)
            & (np.abs(local[:, 0] - 27) < 60)
            & (np.abs(local[:, 1] - 15) < 60)
        )
        assert cut.sum() > 500, number
        print(f"station {number}: {cut.sum()} periods, {off_the_outline(local[cut]).max():.2e} mm off")
        assert off_the_outline(local[cut]).max() < 0.001
        assert np.linalg.norm(local[cut] - (55, 15, -1), axis=1).min() < 0.03
    assert any("joint 3 would be at" in text and "beyond its limit" in text for text in answers[1]["errors"]), answers[
        1
    ]["errors"]
    assert answers[1]["joints"][3:5] == pytest.approx(answers[0]["joints"][3:5], abs=1e-6)
