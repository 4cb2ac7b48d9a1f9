# SPDX-License-Identifier: GPL-2.0-or-later
"""G75 with P: a sub in a station, against what the sub does by itself, carried there by the station's own rotation
matrix."""

import json
import math
import random
import subprocess

import numpy as np
import pytest

from support import canon
from support.pattern_oracle import SUB, compare, moves_of, random_sub
from support.random_cases import random_count, random_seed

HEAD = "G90 G64 G94 G17 G40\nT1 M6\nS5000 M3\nF600\nG21\n"


def program(call, start, sub=SUB, before=""):
    where = "G0 " + " ".join(f"{letter}{value:.9f}" for letter, value in zip("XYZ", start))
    return "\n".join([*sub, HEAD + before, where, "(begin)", call, "(end)", "M2", ""])


def turned(tilt, about, turn):
    """A rotation by `tilt` degrees about a level axis, after one by `turn` about Z."""
    t, a, z = (math.radians(v) for v in (tilt, about, turn))
    axis = np.array([math.cos(a), math.sin(a), 0.0])
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    lean = np.eye(3) + math.sin(t) * k + (1 - math.cos(t)) * k @ k
    return lean @ np.array([[math.cos(z), -math.sin(z), 0], [math.sin(z), math.cos(z), 0], [0, 0, 1]])


def taught(path, matrix, origin, number=7):
    """The file of a station from exact points."""
    points = {1: (0, 0, 0), 2: (150, 0, 0), 3: (20, 120, 0)}
    lines = [f"{q} = {(matrix @ np.array(p, float) + origin).tolist()}" for q, p in points.items()]
    path.write_text(f"[station.{number}]\n" + "\n".join(lines) + "\n")
    return str(path)


def both(tmp_path, matrix, origin, sub=SUB, words="", before=""):
    """(moves of the pattern, moves of the sub alone, the trace)."""
    stations = taught(tmp_path / "stations.toml", matrix, origin)
    start = (3.0, -4.0, 60.0)
    found, trace = moves_of(program(f"G75 Q100 P7 {words}", start, sub, before), STATIONS=stations)
    own = moves_of(program("o100 call", matrix.T @ (np.array(start) - origin), sub))[0]
    return found, own, trace


@pytest.mark.parametrize("case", range(random_count(8)))
def test_random_subs_in_a_level_station(case, tmp_path):
    """Arcs of G17 stay arcs."""
    r = random.Random(f"station {random_seed() + case}")
    matrix, origin = turned(0, 0, r.uniform(-180, 180)), np.array([r.uniform(-80, 80) for _ in range(3)])
    sub = [text for text in random_sub(random_seed() + case)]
    if any("G18" in text or "G19" in text for text in sub):
        matrix = turned(0, 0, 90.0 * r.randrange(4))
    found, own, _trace = both(tmp_path, matrix, origin, sub)
    compare(found, own, lambda p: np.atleast_2d(p) @ matrix.T + origin)


def test_a_tilted_station(tmp_path):
    """Lines are exact, arcs become chords within CHORD, and a message says so."""
    matrix, origin = turned(23.5, 40, -70), np.array([11.0, -7.5, -3.0])
    found, own, trace = both(tmp_path, matrix, origin)
    ends = np.array([matrix @ m.points[-1] + origin for m in own])
    points = np.array([m.points[-1] for m in found])
    for end in ends:
        assert np.linalg.norm(points - end, axis=1).min() < 1e-6
    arc = next(m for m in own if m.kind == "arc")
    chords = [m for m in found if m.line == arc.line]
    assert len(chords) > 20 and all(m.kind == "feed" for m in chords)
    local = (np.array([m.points[-1] for m in chords]) - origin) @ matrix
    assert np.abs(np.hypot(local[:, 0] - 20, local[:, 1] - 7) - 5).max() < 1e-6 and np.abs(local[:, 2] + 1).max() < 1e-6
    middles = (local[1:] + local[:-1]) / 2
    assert 5 - np.hypot(middles[:, 0] - 20, middles[:, 1] - 7).min() <= 0.002
    assert "station 7 is tilted by 23.50 degrees, and the tool's axis stays as it is" in trace.output


def test_work_offsets_do_not_move_a_station(tmp_path):
    """A station is a place of the machine: under another G54 with R and G92 the tool goes to the same place."""
    matrix, origin = turned(0, 0, 30), np.array([40.0, 10.0, -5.0])
    stations = taught(tmp_path / "stations.toml", matrix, origin)
    ends = []
    for before in ("", "G10 L2 P1 X11 Y-5 Z2 R17\nG92 X1 Y2 Z3"):
        trace = canon.run_preview(program("G75 Q100 P7", (3, -4, 60), SUB, before), STATIONS=stations)
        assert not trace.error, trace.error
        ends.append([e.b for e in trace.between("begin", "end")])
    assert np.abs(np.array(ends[0])[1:] - np.array(ends[1])[1:]).max() < 1e-6  # the first move keeps the Z of the tool


def test_the_words_count_in_the_station(tmp_path):
    """Shift, rotation, mirror and copies are in the station's coordinates."""
    matrix, origin = turned(0, 0, 90), np.array([40.0, 10.0, -5.0])
    stations = taught(tmp_path / "stations.toml", matrix, origin)
    sub = ["o100 sub", "G0 X1 Y0", "G1 Z-1", "G0 Z9", "o100 endsub"]
    found = moves_of(program("G75 Q100 P7 X5 Y2 L2 I30 R90", (3, -4, 60), sub), STATIONS=stations)[0]
    # in the station: (5, 2) + (0, 1), then 30 farther along X; the station's X is the machine's Y
    assert found[0].points[-1][:2] == pytest.approx((40 - 3, 10 + 5)) and found[3].points[-1][:2] == pytest.approx(
        (40 - 3, 10 + 35)
    )


@pytest.mark.parametrize(
    "call, content, words",
    [
        ("G75 Q100 P8", None, "station P8 is not taught; teach its points with M255 P8 Q1, Q2 and Q3"),
        ("G75 Q100 P1000", None, "station P1000 is not from 1 to 999"),
        ("G75 Q100 P1.5", None, "station P1.5 is not from 1 to 999"),
        ("G75 Q100 P-1", None, "station P-1 is not from 1 to 999"),
        ("G75 Q100 P7", "[station.7]\n1 = [0, 0, 0]\n2 = [9, 0, 0]\n", "station P7: point 3 is not taught"),
        (
            "G75 Q100 P7",
            "[station.7]\n1 = [0, 0, 0]\n2 = [90, 0, 0]\n3 = [200, 1, 0]\n",
            "station P7: point 3 is 0.3 degrees from the line",
        ),
        (
            "G75 Q100 P7",
            "[station.7]\n1 = [0, 0, 0]\n2 = [0, 90, 0]\n3 = [90, 0, 0]\n",
            "station P7 is tilted by 180.0 degrees, more than 85: the tool's axis stays as it is; see whether points 2 "
            "and 3 are interchanged",
        ),
        ("G75 Q100 P7", "x = [", "stations.toml: is not TOML"),
    ],
)
def test_refused(tmp_path, call, content, words):
    path = tmp_path / "stations.toml"
    if content:
        path.write_text(content)
    else:
        taught(path, np.eye(3), np.zeros(3))
    trace = canon.run_preview(program(call, (3, -4, 60)), STATIONS=str(path))
    assert words in trace.error and trace.error.startswith("chipwise: G75: ") and not trace.between("begin", "begin")


def test_a_station_in_a_pattern_is_refused(tmp_path):
    stations = taught(tmp_path / "stations.toml", np.eye(3), np.zeros(3))
    sub = [*SUB, "o101 sub", "G0 Z50", "G75 Q100 P7", "G0 Z50", "o101 endsub"]
    trace = canon.run_preview(program("G75 Q101 X5", (3, -4, 60), sub), STATIONS=stations)
    assert "station P7 in a sub that is run as a pattern" in trace.error


def test_m255_teaches_nothing_in_the_preview(tmp_path):
    path = tmp_path / "stations.toml"
    trace = canon.run_preview(program("M255 P3 Q1", (3, -4, 60)), STATIONS=str(path))
    assert not trace.error and not path.exists()


@pytest.mark.parametrize(
    "call, words",
    [
        ("M255 Q1", "word P (station) is missing; add P"),
        ("M255 P1", "word Q (point) is missing; add Q"),
        ("M255 P0 Q1", "station P0 is not from 1 to 999; use P1 to P999"),
        ("M255 P1 Q100", "point Q100 is not from 1 to 99; use Q1 to Q99"),
        ("M255 P1 Q1 H2", "H2 is neither H0 nor H1"),
        ("M255 P1 Q1 R2", "word R is not used here; words are P Q H F"),
    ],
)
def test_m255_words(call, words):
    trace = canon.run_preview(program(call, (3, -4, 60)))
    assert trace.error.startswith("chipwise: M255: " + words), trace.error


@pytest.mark.parametrize("height", [-5.0, 3.25])
def test_a_level_station_knows_the_stock_as_a_shift_does(tmp_path, height):
    """A cycle without J counts its passes, of 4 mm, from the top of M250's stock, wherever the pattern lies."""
    tools = tmp_path / "tools.toml"
    tools.write_text("[tool.1]\nflute_length = 4\n")
    stations = taught(tmp_path / "stations.toml", np.eye(3), np.array([40.0, 10.0, height]))
    sub = ["o100 sub", "G0 X0 Y0", "G0 Z5", "G13 X0 Y0 I6 Z-9 R2", "G0 Z5", "o100 endsub"]
    stock = "M250 P0 Q0 R-20 I80 J80 K20\n"
    found = [
        moves_of(program(f"G75 Q100 {words}", (3, -4, 60), sub, stock), STATIONS=stations, TOOL_GEOMETRY=tools)[0]
        for words in ("P7", f"X40 Y10 Z{height}", f"X40 Y10 Z{height + 9}")
    ]
    compare(found[0], found[1], lambda p: p)
    assert len(found[0]) != len(found[2])  # higher up there are other passes


def test_a_tilted_station_knows_no_stock(tmp_path):
    matrix = turned(10, 0, 0)
    sub = ["o100 sub", "G0 X0 Y0", "G0 Z5", "G13 X0 Y0 I6 Z-9 R2", "G0 Z5", "o100 endsub"]
    stations = taught(tmp_path / "stations.toml", matrix, np.array([40.0, 10.0, 30.0]))
    with_stock, without = (
        moves_of(program("G75 Q100 P7", (3, -4, 60), sub, stock), STATIONS=stations)[0]
        for stock in ("M250 P0 Q0 R-20 I80 J80 K20\n", "")
    )
    compare(with_stock, without, lambda p: p)


def test_check_finds_the_stations_of_the_machine(tmp_path):
    """chipwise check reads the program with a copy of the INI file elsewhere; the relative path means the same."""
    (tmp_path / "mill.tbl").write_text((canon.ROOT / "configs" / "mill.tbl").read_text())
    ini = canon.write_ini(tmp_path, STATIONS="stations.toml")
    taught(tmp_path / "stations.toml", np.eye(3), np.array([40.0, 10.0, 0.0]))
    sub = ["o100 sub", "G0 X0 Y0", "G0 Z5", "G1 Z-1", "G1 X20", "G0 Z5", "o100 endsub"]
    (tmp_path / "part.ngc").write_text(program("G75 Q100 P7", (3, 4, 60), sub, "M250 P0 Q0 R-20 I80 J80 K20\n"))
    out = tmp_path / "out.json"
    done = subprocess.run(
        [
            str(canon.ROOT / "bin" / "chipwise"),
            "check",
            str(tmp_path / "part.ngc"),
            "--ini",
            str(ini),
            "--json",
            str(out),
        ],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode in (0, 1), done.stderr
    tool = json.loads(out.read_text())["programs"][0]["tools"][0]
    assert tool["volume_mm3"] == pytest.approx(20 * 6 + math.pi * 9, rel=0.01)


def test_the_robot_turns_its_tool(tmp_path):
    """The preview of configs/robot.ini: A B C of the four stations, one with its Z axis down; none on a mill."""
    done = subprocess.run(
        [
            str(canon.ROOT / "bin" / "chipwise"),
            "try",
            str(canon.ROOT / "nc_files" / "stations.ngc"),
            "--ini",
            str(canon.ROOT / "configs" / "robot.ini"),
        ],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
    )
    turns = [
        tuple(map(float, line.rpartition("(")[2].rstrip(")").split(",")[3:]))
        for line in done.stdout.splitlines()
        if "STRAIGHT_" in line
    ]
    assert list(dict.fromkeys(turns)) == [(180, 0, 0), (180, 0, 90), (180, -30, 0), (340, 0, 0)], done.stdout[-500:]


@pytest.mark.parametrize(
    "sub, words",
    [
        (["o100 sub", "G1 X5 F100", "G0 Z50", "o100 endsub"], "the pattern begins with a cut: line"),
        (SUB, "the machine has no axes A, B and C"),
    ],
)
def test_what_a_robot_refuses(tmp_path, sub, words):
    stations = taught(tmp_path / "stations.toml", turned(40, 0, 0), np.zeros(3))
    text = (
        (canon.ROOT / "configs" / "robot.ini")
        .read_text()
        .replace("../nc_files", str(canon.ROOT / "nc_files"))
        .replace("robot_stations.toml", stations)
        .replace("= remap", f"= {canon.ROOT}/configs/remap")
    )
    if "axes" in words:
        text = text.replace("COORDINATES = X Y Z A B C", "COORDINATES = X Y Z")
    (tmp_path / "robot.ini").write_text(text)
    (tmp_path / "robot.tbl").write_text("T1 P1 D6 Z0\n")
    (tmp_path / "part.ngc").write_text("\n".join([*sub, "G21 G90 G17 G40 F600", "G75 Q100 P7", "M2", ""]))
    done = subprocess.run(
        [str(canon.ROOT / "bin" / "chipwise"), "try", str(tmp_path / "part.ngc"), "--ini", str(tmp_path / "robot.ini")],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
    )
    assert words in done.stdout + done.stderr, done.stdout + done.stderr
