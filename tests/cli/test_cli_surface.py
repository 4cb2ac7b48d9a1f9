# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise surface: a program from a model, or a message and nothing written."""
import json
import os
import re
import signal
import subprocess

import numpy as np
import pytest
from support import ROOT, surface_cases, surface_judge
from support.canon import run_rs274

from chipwise.check.sweep import Shape
from chipwise.moves import Line, Rapid

OLD = "an older program\n"


def surface(*arguments, env=None):
    return subprocess.run([ROOT / "bin" / "chipwise", "surface", *map(str, arguments)], text=True, stdin=subprocess.DEVNULL, capture_output=True,
                          env={**os.environ, "INI_FILE_NAME": "", **(env or {})}, timeout=60, check=False)


@pytest.fixture
def model(tmp_path):
    return surface_cases.write_stl(tmp_path / "part.stl", surface_cases.waves(15, 20.0))


def moves_of(text, tools):
    """The moves LinuxCNC makes of a program, and where they begin: above the first cut."""
    trace = run_rs274(text, tools)
    assert not trace.error, trace.error
    elements = [e for e in trace.elements if e.a != e.b][2:]
    return [(Rapid if e.kind == "rapid" else Line)(*e.b) for e in elements], elements[0].a


def test_the_program_cuts_the_model(model, tmp_path):
    done = surface(model, "-o", tmp_path / "out.ngc", "--tool", 4, "--step", 1, "--direction", 45, "--link", 1, "--json", tmp_path / "out.json")
    assert done.returncode == 0, done.stderr
    text, figures = (tmp_path / "out.ngc").read_text(), json.loads((tmp_path / "out.json").read_text())
    assert re.search(r"^T4 M6$", text, re.M) and text.endswith("M5\nM2\n")
    assert re.fullmatch(r".*out\.ngc: (\d+) cuts, (\d+) moves from (\d+) points\n", done.stdout)
    assert figures["cuts"] > 20 and figures["moves"] * 3 > figures["cuts"] and figures["seconds"] < 20
    moves, start = moves_of(text, {4: 6.0})
    deepest, highest = surface_judge.gouge_and_rest(moves, start, surface_cases.waves(15, 20.0), Shape(6, 3), -10.0, 25, 1)
    assert deepest <= 1.1e-3 and highest <= 0.011 + 1e-3        # mm; four decimals
    needles = surface_judge.Needles((0, 0), (20, 20), figures["high"][2], 2000, 1)
    assert max(needles.follow(moves, start, Shape(6, 3))) <= surface_judge.RIDGE
    shares = [int(line.partition("=")[2]) for line in done.stderr.splitlines()]
    assert shares == sorted(shares) and shares[-1] <= 99 and "FILTER_PROGRESS=" in done.stderr


def test_inch_machine_and_placing(model, tmp_path):
    """Lengths are inches there, the model stays mm."""
    done = surface(model, "-o", tmp_path / "out.ngc", "--tool", 4, "--step", 0.06, "--ini", ROOT / "configs" / "mill_inch.ini", "--scale", 2,
                   "--at", 1, 2, 0, "--clearance", 0.5, "--json", tmp_path / "out.json")
    assert done.returncode == 0, done.stderr
    assert "G20 G17" in (tmp_path / "out.ngc").read_text() and "G0 Z0.5000" in (tmp_path / "out.ngc").read_text()
    figures = json.loads((tmp_path / "out.json").read_text())
    assert figures["low"][:2] == pytest.approx([25.4, 50.8], abs=1e-4) and figures["high"][:2] == pytest.approx([65.4, 90.8], abs=1e-4)


def test_picture(tmp_path):
    values = np.linspace(0, 65535, 60)[None, :].repeat(50, axis=0)
    (tmp_path / "depth.png").write_bytes(surface_cases.png_bytes(values))
    done = surface(tmp_path / "depth.png", "-o", tmp_path / "out.ngc", "--tool", 1, "--step", 1, "--pixel", 0.5, "--depth", 3, "--json", tmp_path / "o.json")
    figures = json.loads((tmp_path / "o.json").read_text())
    assert done.returncode == 0 and figures["low"] == [0, 0, -3] and figures["high"] == [29.5, 24.5, 0]


@pytest.mark.parametrize("content, text", [(b"", "is empty"), (b"\xff\xd8\xff" + bytes(200), "JPEG"), (b"G0 X0\n", "neither STL nor PNG"),
                                           (surface_cases.stl_bytes(surface_cases.waves(9))[:900], "is cut off")])
def test_a_bad_model_leaves_the_old_program(tmp_path, content, text):
    (tmp_path / "part.stl").write_bytes(content)
    (tmp_path / "out.ngc").write_text(OLD)
    began = sum(os.times()[2:4])            # s of computing of the commands before
    done = surface(tmp_path / "part.stl", "-o", tmp_path / "out.ngc", "--tool", 4, "--step", 1)
    assert done.returncode == 2 and text in done.stderr and done.stderr.startswith("chipwise: surface: ") and sum(os.times()[2:4]) - began < 2
    assert (tmp_path / "out.ngc").read_text() == OLD and sorted(p.name for p in tmp_path.iterdir()) == ["out.ngc", "part.stl"]


@pytest.mark.parametrize("arguments, text", [
    (["--step", "9"], "step-over D9 mm is larger than the tool (6 mm)"), (["--step", "0"], "--step 0 is not a length above 0"),
    (["--step", "nan"], "--step nan is not"), (["--step", "1", "--tool", "77"], "tool 77 is not in the tool table"), (["--step", "1", "--tool", "0"], "--tool 0"),
    (["--step", "1", "--link", "5"], "link P5 is not known"), (["--step", "1", "--feed", "-1"], "--feed -1 is not a number above 0"),
    (["--step", "1", "--direction", "1.5"], "invalid int value"), (["--step", "1", "--clearance", "-3"], "is below the top of the model"),
    (["--step", "1", "--scale", "0"], "--scale 0"), (["--step", "1", "--ini", "/nowhere.ini"], "INI file /nowhere.ini"), ([], "--step")])
def test_options_that_cannot_be_meant(model, tmp_path, arguments, text):
    tool = [] if "--tool" in arguments else ["--tool", "4"]
    done = surface(model, "-o", tmp_path / "out.ngc", *tool, *arguments)
    assert done.returncode == 2 and text in done.stderr and "Traceback" not in done.stderr
    assert not (tmp_path / "out.ngc").exists()


def test_the_model_is_never_overwritten(model):
    before = open(model, "rb").read()
    done = surface(model, "-o", model, "--tool", 4, "--step", 1)
    assert done.returncode == 2 and "is the model itself" in done.stderr and open(model, "rb").read() == before


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_stopped(tmp_path, how):
    """A large model under way: stopped at once, the old program is still there."""
    model = surface_cases.write_stl(tmp_path / "part.stl", surface_cases.waves(225, 100.0))
    (tmp_path / "out.ngc").write_text(OLD)
    work = subprocess.Popen([ROOT / "bin" / "chipwise", "surface", model, "-o", tmp_path / "out.ngc", "--tool", "4", "--step", "0.2"],
                            stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, env={**os.environ, "INI_FILE_NAME": ""},
                            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))     # ignored below a background shell
    assert "FILTER_PROGRESS" in work.stderr.readline()
    work.send_signal(how)
    assert work.wait(60) != 0
    assert (tmp_path / "out.ngc").read_text() == OLD and "Traceback" not in work.stderr.read()
    work.stderr.close()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.ngc", "part.stl"]
