# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise filter with a model or a job file: the program that cuts it, or nothing and why."""

import os
import subprocess

import pytest

from support import ROOT, surface_cases
from support.rewrite_rig import make_machine

JOB = 'model = "part.stl"\nlink = 1\n[[cut]]\ntool = 4\nstep = 2\n'
WAVES = surface_cases.stl_bytes(surface_cases.waves(12, 15.0))


@pytest.fixture(name="ini")
def make_ini(tmp_path):
    path = make_machine(tmp_path / "machine")
    path.write_text(path.read_text().replace("[CHIPWISE]\n", "[CHIPWISE]\nFILTER_TIME = 60\n", 1))
    return path


def run(ini, path):
    """-> status, text on standard output, lines on standard error but progress, percents."""
    clean = {key: value for key, value in os.environ.items() if key not in ("INI_FILE_NAME", "AXIS_PROGRESS_BAR")}
    done = subprocess.run(
        [ROOT / "bin" / "chipwise", "filter", "--ini", ini, path],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        env=clean,
        timeout=300,
        check=False,
    )
    lines = done.stderr.splitlines()
    assert "Traceback" not in done.stderr and "internal error" not in done.stderr
    percents = [int(line.partition("=")[2]) for line in lines if line.startswith("FILTER_PROGRESS=")]
    return (
        done.returncode,
        done.stdout,
        "\n".join(line for line in lines if not line.startswith("FILTER_PROGRESS=")),
        percents,
    )


@pytest.mark.parametrize("name", ["part.toml", "part.stl", "part.STL"])
def test_a_job_and_a_model_with_a_job_beside_it(ini, tmp_path, name):
    """The program is that of `chipwise surface`."""
    (tmp_path / ("part.STL" if name.endswith("STL") else "part.stl")).write_bytes(WAVES)
    (tmp_path / "part.toml").write_text(JOB.replace("part.stl", "part.STL") if name.endswith("STL") else JOB)
    status, program, said, percents = run(ini, tmp_path / name)
    assert (
        status == 0 and "it is made into a program (tool 4: " in said and percents == sorted(set(percents)) and percents
    )
    subprocess.run(
        [ROOT / "bin" / "chipwise", "surface", tmp_path / "part.toml", "-o", tmp_path / "out.ngc", "--ini", ini],
        check=True,
        capture_output=True,
    )
    assert program == (tmp_path / "out.ngc").read_text() and program.endswith("M5\nM2\n")


@pytest.mark.parametrize(
    "files, name, text",
    [
        (
            {"part.stl": WAVES},
            "part.stl",
            "it is not opened: no tool is in the spindle to cut the model with; load one, or write a job file "
            "part.toml beside it",
        ),
        (
            {"part.stl": b"\xff\xd8\xff" + bytes(200), "part.toml": JOB.encode()},
            "part.stl",
            "part.stl: the file is a JPEG picture",
        ),
        ({"part.toml": JOB.encode()}, "part.toml", "part.stl: No such file"),
        ({"part.toml": b"tool = 4\n"}, "part.toml", "the job file has no [[cut]]"),
        ({"part.toml": b"\xff"}, "part.toml", "it is not opened: part.toml"),
        ({}, "part.toml", "No such file"),
        (
            {"part.stl": WAVES, "part.toml": JOB.replace("step = 2", "step = 99").encode()},
            "part.stl",
            "step-over D99 mm is larger than the tool",
        ),
        (
            {"part.stl": WAVES, "part.toml": JOB.replace("step = 2", "step = -1").encode()},
            "part.stl",
            "--step -1 is not a length above 0",
        ),
    ],
)
def test_what_is_not_opened(ini, tmp_path, files, name, text):
    for file, content in files.items():
        (tmp_path / file).write_bytes(content)
    status, program, said, _percents = run(ini, tmp_path / name)
    assert (status, program) == (2, "") and text in said, said


def test_more_than_the_time(ini, tmp_path):
    """The process that plans is ended, and the model itself is never opened as a program."""
    ini.write_text(ini.read_text().replace("FILTER_TIME = 60", "FILTER_TIME = 2"))
    (tmp_path / "part.stl").write_bytes(surface_cases.stl_bytes(surface_cases.waves(300, 200.0)))
    (tmp_path / "part.toml").write_text(JOB.replace("step = 2", "step = 0.02"))
    status, program, said, _percents = run(ini, tmp_path / "part.stl")
    assert (
        (status, program) == (2, "")
        and "it is not opened: it takes more than 2 s to plan; raise [CHIPWISE]FILTER_TIME, or use `chipwise surface`"
        in said
    )


def test_the_tool_in_the_spindle(tmp_path, ini, monkeypatch):
    """Without a job file: a cut with the tool that LinuxCNC has, named in the message."""
    from chipwise.program.reader import Machine
    from chipwise.filter import model, work
    from chipwise.tool_data.table import diameter_of

    monkeypatch.setattr(work, "spindle_tool", lambda: 4)
    (tmp_path / "part.stl").write_bytes(WAVES)
    (tmp_path / "out").mkdir()
    found = model.made(str(tmp_path / "part.stl"), str(ini), str(tmp_path / "out"), lambda share: None)
    assert (
        found.status == 0
        and not found.warns
        and "step-over 0.1 of its diameter; a job file part.toml beside it" in found.notes[0][0]
    )
    with open(found.path) as program:
        assert (
            f"(tool 4, step-over {0.1 * diameter_of(Machine(str(ini)).table, 4):.4g}, direction 0, link 1)"
            in program.read()
        )


def test_a_drawing_is_shown_as_contour_subs(tmp_path):
    """The program of chipwise import; a damaged drawing is not opened, and says why."""
    from chipwise.filter import model
    from support import drawings

    path = drawings.write("gaps", tmp_path)
    (tmp_path / "out").mkdir()
    found = model.made(str(path), "", str(tmp_path / "out"), lambda share: None)
    with open(found.path, encoding="utf-8") as file:
        text = file.read()
    assert "o100 sub" in text and "o99 if [#<_task> EQ 0]" in text and found.status == 0
    assert found.notes[-1] == (
        "it is shown as contour subs (O100) and moves nothing; `chipwise import` makes a file of them",
        False,
    )
    path.write_text("damaged")
    found = model.made(str(path), "", str(tmp_path / "out"), lambda share: None)
    assert found.status == 2 and "it is not opened: the file cannot be read as a DXF drawing" in found.notes[0][0]
