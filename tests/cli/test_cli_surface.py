# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise surface: a program from a model, or a message and nothing written."""

import json
import os
import re
import resource
import signal
import subprocess

import numpy as np
import pytest
from support import ROOT, forked, surface_cases, surface_judge
from support.canon import run_rs274

from chipwise.clib.height_map import Shape
from chipwise.moves import Line, Rapid

OLD = "an older program\n"


def surface(*arguments, env=None, most_bytes=None):
    command, env = (
        [forked.CHIPWISE, "surface", *map(str, arguments)],
        {**os.environ, "INI_FILE_NAME": "", **(env or {})},
    )
    if most_bytes is None:
        return forked.run(command, env=env, timeout=300)
    return subprocess.run(
        command,
        text=True,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        env=env,
        timeout=300,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes)),
    )


@pytest.fixture
def model(tmp_path):
    return surface_cases.write_stl(tmp_path / "part.stl", surface_cases.waves(15, 20.0))


def moves_of(text, tools):
    """The moves LinuxCNC makes of a program, and where they begin: above the first cut."""
    trace = run_rs274(text, tools)
    assert not trace.error, trace.error
    elements = [e for e in trace.elements if e.a != e.b][2:]
    return [(Rapid if e.kind == "rapid" else Line)(*e.b) for e in elements], elements[0].a


def without_lead_ins(moves):
    """The moves with each feed move that follows a rapid made a rapid: it comes down to its cut at a slant."""
    return moves[:1] + [Rapid(b.x, b.y, b.z) if isinstance(a, Rapid) else b for a, b in zip(moves, moves[1:])]


def test_the_program_cuts_the_model(model, tmp_path):
    done = surface(
        model,
        "-o",
        tmp_path / "out.ngc",
        "--tool",
        4,
        "--step",
        1,
        "--direction",
        45,
        "--link",
        1,
        "--json",
        tmp_path / "out.json",
        env={"AXIS_PROGRESS_BAR": "1"},
    )  # as the filter of a GUI
    assert done.returncode == 0, done.stderr
    text, figures = (tmp_path / "out.ngc").read_text(), json.loads((tmp_path / "out.json").read_text())
    assert re.search(r"^T4 M6$", text, re.M) and text.endswith("M5\nM2\n")
    assert re.fullmatch(r".*out\.ngc: (\d+) cuts, (\d+) moves from (\d+) points\n", done.stdout)
    assert (
        figures["cuts"] > 20
        and figures["arcs"] == 0
        and figures["moves"] * 3 > figures["cuts"]
        and figures["seconds"] < 20
    )
    moves, start = moves_of(text, {4: 6.0})
    judged = surface_cases.waves(15, 20.0), Shape(6, 3), -10.0, 25, 1
    deepest, _highest = surface_judge.gouge_and_rest(moves, start, *judged)
    _deepest, highest = surface_judge.gouge_and_rest(without_lead_ins(moves), start, *judged)
    assert deepest <= 1.1e-3 and highest <= 0.011 + 1e-3  # mm; four decimals
    needles = surface_judge.Needles((0, 0), (20, 20), figures["high"][2], 2000, 1)
    assert max(needles.follow(moves, start, Shape(6, 3))) <= surface_judge.RIDGE
    shares = [int(line.partition("=")[2]) for line in done.stderr.splitlines()]
    assert shares == sorted(shares) and shares[-1] <= 99 and "FILTER_PROGRESS=" in done.stderr


def test_a_full_disk(model, tmp_path):
    """Here no file may be longer than 1000 bytes: the old one is kept, nothing else is left, and the file is named with
    a remedy."""
    (tmp_path / "out.ngc").write_text(OLD)
    before = sorted(os.listdir(tmp_path))
    done = surface(model, "-o", tmp_path / "out.ngc", "--tool", 4, "--step", 3, most_bytes=1000)
    assert (done.returncode, done.stderr.splitlines()[-1]) == (
        2,
        f"chipwise: surface: {tmp_path / 'out.ngc'}: File too large; name a file in a folder of yours that has room",
    )
    assert (tmp_path / "out.ngc").read_text() == OLD and sorted(os.listdir(tmp_path)) == before


def test_inch_machine_and_placing(model, tmp_path):
    """Lengths are inches there, the model stays mm."""
    done = surface(
        model,
        "-o",
        tmp_path / "out.ngc",
        "--tool",
        4,
        "--step",
        0.06,
        "--ini",
        ROOT / "configs" / "mill_inch.ini",
        "--scale",
        2,
        "--at",
        1,
        2,
        0,
        "--clearance",
        0.5,
        "--json",
        tmp_path / "out.json",
    )
    assert done.returncode == 1 and "the flutes are 0.59055 in long" in done.stdout, (
        done.stderr
    )  # 15 mm; the cuts are 18 mm deep
    assert "G20 G17" in (tmp_path / "out.ngc").read_text() and "G0 Z0.5000" in (tmp_path / "out.ngc").read_text()
    figures = json.loads((tmp_path / "out.json").read_text())
    assert figures["low"][:2] == pytest.approx([25.4, 50.8], abs=1e-4) and figures["high"][:2] == pytest.approx(
        [65.4, 90.8], abs=1e-4
    )


def test_scallop(model, tmp_path):
    """A smaller scallop takes more cuts; --step is then the largest step-over and may be left out."""
    cuts = []
    for arguments in (["--scallop", 0.1], ["--scallop", 0.02], ["--scallop", 0.1, "--step", 0.3]):
        done = surface(model, "-o", tmp_path / "out.ngc", "--tool", 4, *arguments, "--json", tmp_path / "out.json")
        assert done.returncode == 0 and f"scallop {arguments[1]}" in (tmp_path / "out.ngc").read_text(), done.stderr
        cuts.append(json.loads((tmp_path / "out.json").read_text())["cuts"])
    assert cuts[1] > 1.8 * cuts[0] and cuts[2] > 20 / 0.3


def test_cell(model, tmp_path):
    """The default is that of the settings; other cells give other links."""
    programs = []
    for arguments in ([], ["--cell", 0.25], ["--cell", 0.1]):
        done = surface(model, "-o", tmp_path / "out.ngc", "--tool", 4, "--step", 2, "--link", 1, *arguments)
        assert done.returncode == 0, done.stderr
        programs.append((tmp_path / "out.ngc").read_text())
    assert programs[0] == programs[1] != programs[2]


def test_picture(tmp_path):
    values = np.linspace(0, 65535, 60)[None, :].repeat(50, axis=0)
    (tmp_path / "depth.png").write_bytes(surface_cases.png_bytes(values))
    done = surface(
        tmp_path / "depth.png",
        "-o",
        tmp_path / "out.ngc",
        "--tool",
        1,
        "--step",
        1,
        "--pixel",
        0.5,
        "--depth",
        3,
        "--json",
        tmp_path / "o.json",
    )
    figures = json.loads((tmp_path / "o.json").read_text())
    assert done.returncode == 0 and figures["low"] == [0, 0, -3] and figures["high"] == [29.5, 24.5, 0]


@pytest.mark.parametrize(
    "content, text",
    [
        (b"", "is empty"),
        (b"\xff\xd8\xff" + bytes(200), "JPEG"),
        (b"G0 X0\n", "neither STL nor PNG nor a height map"),
        (surface_cases.stl_bytes(surface_cases.waves(9))[:900], "is cut off"),
    ],
)
def test_a_bad_model_leaves_the_old_program(tmp_path, content, text):
    (tmp_path / "part.stl").write_bytes(content)
    (tmp_path / "out.ngc").write_text(OLD)
    began = sum(os.times()[2:4])  # s of computing of the commands before
    done = surface(tmp_path / "part.stl", "-o", tmp_path / "out.ngc", "--tool", 4, "--step", 1)
    assert (
        done.returncode == 2
        and text in done.stderr
        and done.stderr.startswith("chipwise: surface: ")
        and sum(os.times()[2:4]) - began < 2
    )
    assert (tmp_path / "out.ngc").read_text() == OLD and sorted(p.name for p in tmp_path.iterdir()) == [
        "out.ngc",
        "part.stl",
    ]


@pytest.mark.parametrize(
    "arguments, text",
    [
        (["--step", "9"], "step-over D9 mm is larger than the tool (6 mm)"),
        (["--step", "0"], "--step 0 is not a length above 0"),
        (["--step", "nan"], "--step nan is not"),
        (["--step", "1", "--tool", "77"], "tool 77 is not in the tool table"),
        (["--step", "1", "--tool", "0"], "--tool 0"),
        (["--step", "1", "--link", "5"], "link P5 is not known"),
        (["--step", "1", "--feed", "-1"], "--feed -1 is not a number above 0"),
        (["--step", "1", "--direction", "1.5"], "invalid int value"),
        (["--step", "1", "--clearance", "-3"], "is below the top of the model"),
        (["--step", "1", "--scale", "0"], "--scale 0"),
        (["--step", "1", "--scale", "2e6"], "--scale 2e+06 is not a number above 0, up to 1000000"),
        (["--step", "1", "--scale", "1e6"], "the model reaches"),
        (["--step", "1", "--floor", "-200000"], "--floor -200000 is not a length from -100000, up to 100000"),
        (["--step", "1", "--cell", "0"], "--cell 0 is not a length above 0"),
        (["--step", "1", "--cell", "0.001"], "cell 0.001 mm is not from 0.01 mm to 10 mm; correct --cell"),
        (["--step", "1", "--ini", "/nowhere.ini"], "INI file /nowhere.ini"),
        ([], "--step"),
    ],
)
def test_options_that_cannot_be_meant(model, tmp_path, arguments, text):
    tool = [] if "--tool" in arguments else ["--tool", "4"]
    done = surface(model, "-o", tmp_path / "out.ngc", *tool, *arguments)
    assert done.returncode == 2 and text in done.stderr and "Traceback" not in done.stderr
    assert not (tmp_path / "out.ngc").exists()


def test_the_model_is_never_overwritten(model):
    before = open(model, "rb").read()
    done = surface(model, "-o", model, "--tool", 4, "--step", 1)
    assert done.returncode == 2 and "is the model itself" in done.stderr and open(model, "rb").read() == before


def test_the_figures_do_not_overwrite_the_program(model, tmp_path):
    done = surface(model, "-o", tmp_path / "out.ngc", "--tool", 4, "--step", 1, "--json", tmp_path / "." / "out.ngc")
    assert (
        done.returncode == 2
        and "-o and --json are the same file" in done.stderr
        and not (tmp_path / "out.ngc").exists()
    )


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_stopped(tmp_path, how):
    """A large model under way: stopped at once, the old program is still there."""
    model = surface_cases.write_stl(tmp_path / "part.stl", surface_cases.waves(225, 100.0))
    (tmp_path / "out.ngc").write_text(OLD)
    work = subprocess.Popen(
        [ROOT / "bin" / "chipwise", "surface", model, "-o", tmp_path / "out.ngc", "--tool", "4", "--step", "0.05"],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        env={**os.environ, "INI_FILE_NAME": "", "AXIS_PROGRESS_BAR": "1"},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # ignored below a background shell
    assert "FILTER_PROGRESS" in work.stderr.readline()
    work.send_signal(how)
    assert work.wait(300) != 0
    assert (tmp_path / "out.ngc").read_text() == OLD and "Traceback" not in work.stderr.read()
    work.stderr.close()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.ngc", "part.stl"]


JOB = """model = "part.stl"
link = 1
[[cut]]
tool = 3
step = 2.5
rough = 2
allowance = 0.3
[[cut]]
tool = 4
step = 1
[[cut]]
tool = 4
step = 0.4
direction = 90
rest = 0.1
link = 2
"""


def test_job(model, tmp_path):
    """Roughing, finishing and rest in one program: nothing is gouged, no traverse meets stock, and the command of one
    cut is the same."""
    (tmp_path / "part.toml").write_text(JOB)
    done = surface(tmp_path / "part.toml", "-o", tmp_path / "out.ngc", "--json", tmp_path / "out.json")
    assert done.returncode == 0, done.stderr
    text, parts = (tmp_path / "out.ngc").read_text(), json.loads((tmp_path / "out.json").read_text())["parts"]
    assert re.findall(r"^T(\d+) M6$", text, re.M) == ["3", "4", "4"] and text.count("M5\n") == 3 and len(parts) == 3
    assert "levels 2" in text and "rest 0.1" in text and parts[2]["feed_mm"] < parts[1]["feed_mm"]
    needles = surface_judge.Needles((0, 0), (20, 20), parts[0]["high"][2], 1000, 1)
    head, programs = "\n".join(text.splitlines()[:2]) + "\n", text.split("M5\n")[:3]
    for program, tool, shape in zip(programs, (3, 4, 4), (Shape(10), Shape(6, 3), Shape(6, 3))):
        moves, start = moves_of(head + program + "M2\n", {tool: shape.diameter})
        assert max(needles.follow(moves, start, shape)) <= surface_judge.RIDGE
        deepest, _highest = surface_judge.gouge_and_rest(
            moves, start, surface_cases.waves(15, 20.0), shape, -10.0, 10, 1
        )
        assert deepest <= 1.1e-3
    alone = surface(
        model, "-o", tmp_path / "alone.ngc", "--tool", 3, "--step", 2.5, "--rough", 2, "--allowance", 0.3, "--link", 1
    )
    assert alone.returncode == 0
    assert [line for line in (tmp_path / "alone.ngc").read_text().splitlines() if line.startswith("G1")] == [
        line for line in programs[0].splitlines() if line.startswith("G1")
    ]


@pytest.mark.parametrize(
    "change, text",
    [
        (("[[cut]]", "[[cuts]]"), "the job file has no [[cut]]"),
        (("step = 1\n", ""), "step of cut 2 is missing"),
        (("tool = 3", "tool = 3.5"), "which is not a whole number"),
        (("rest = 0.1", "rest = nan"), "rest = nan of cut 3, which is not a number"),
        (("rest = 0.1", "rests = 0.1"), "rests of cut 3 is not a key"),
        (("rest = 0.1", "rest = -1"), "--rest -1 is not a length above 0"),
        (("link = 1", "link ="), "part.toml: Invalid value"),
        (("part.stl", "none.stl"), "none.stl: No such file"),
        (("link = 1", "output = 'x'"), "output is not a key"),
        (("rough = 2", "cell = 0.1"), "cell of cut 1 is not a key"),
        (("allowance", "at = [1, 2, 3]\nallowance"), "at of cut 1 is not a key"),
        (("rough = 2", "rough = 0.001"), "more than 1000 levels"),
    ],
)
def test_bad_jobs(model, tmp_path, change, text):
    assert change[0] in JOB
    (tmp_path / "part.toml").write_text(JOB.replace(change[0], change[1], 3 if "cuts" in change[1] else 1))
    (tmp_path / "out.ngc").write_text(OLD)
    done = surface(tmp_path / "part.toml", "-o", tmp_path / "out.ngc")
    assert done.returncode == 2 and text in done.stderr and done.stderr.count("Traceback") == 0, done.stderr
    assert (tmp_path / "out.ngc").read_text() == OLD


def test_options_beside_a_job_and_files_that_are_none(model, tmp_path):
    (tmp_path / "part.toml").write_text(JOB)
    (tmp_path / "bad.toml").write_bytes(b"\xff\xfe")
    for arguments, text in (
        (["part.toml", "--tool", 3], "--tool is given beside a job file"),
        (["bad.toml"], "bad.toml: "),
        (["no.toml"], "no.toml: No such file"),
    ):
        done = surface(tmp_path / arguments[0], "-o", tmp_path / "out.ngc", *arguments[1:])
        assert done.returncode == 2 and text in done.stderr and "Traceback" not in done.stderr, done.stderr
    done = surface(tmp_path / "part.toml", "-o", tmp_path / "part.toml")
    assert (
        done.returncode == 2 and "is the job file itself" in done.stderr and (tmp_path / "part.toml").read_text() == JOB
    )
