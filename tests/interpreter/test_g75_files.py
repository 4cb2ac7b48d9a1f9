# SPDX-License-Identifier: GPL-2.0-or-later
"""G75 reads its sub anew whenever anything that the sub may use has changed: the planner's process lives as long as
LinuxCNC, files do not."""

import os
import re

import pytest

from chipwise.contour_sub.job import Job
from chipwise.pattern.job import PatternJob
from chipwise.pattern.run import read_pattern
from support import ROOT, canon

CALLS = {
    "call": ("o300 call", "o300 sub\nG1 X{x} F100\no300 endsub\n"),
    "M98": ("M98 P300", "O300\nG1 X{x} F100\nM99\nM2\n"),
    "a pattern": ("G75 Q300", "o300 sub\nG1 X{x} F100\no300 endsub\n"),
    "an expression": ("o[200 + 100] call", "o300 sub\nG1 X{x} F100\no300 endsub\n"),
    "a contour": ("G77 Q300 P41 Z-1 R1 D1 F100", "o300 sub\nG0 X0 Y0\nG1 X{x}\nY20\nX0\nY0\no300 endsub\n"),
}


def job_of(folder, call, tool=(1, 2.0)):
    """A sub O100 with a call in it, in an INI file whose SUBROUTINE_PATH and tool table are the folder's."""
    ini = canon.write_ini(folder)
    text = re.sub(r"(?m)^SUBROUTINE_PATH *=.*$", f"SUBROUTINE_PATH = {folder}", ini.read_text())
    ini.write_text(re.sub(r"(?m)^TOOL_TABLE *=.*$", f"TOOL_TABLE = {folder / 'own.tbl'}", text))
    (folder / "own.tbl").write_text("T1 P1 D2\nT5 P5 D4\n")
    program = folder / "program.ngc"
    program.write_text(f"o100 sub\nG0 X0 Y0 Z5\n{call}\nG0 Z9\no100 endsub\nM2\n")
    return PatternJob(
        Job(program=str(program), sub=100, ini=str(ini), position=(0.0, 0.0, 5.0), tool=tool, feed=100.0),
        spindle=(3, 1000.0),
    )


def write(path, text, at):
    """A file with a time of change of its own."""
    path.write_text(text)
    os.utime(path, (at, at))


def reach(job):
    return float(read_pattern(job).points[:, 0].max())


@pytest.mark.parametrize("how", sorted(CALLS))
def test_a_file_that_is_called(how, tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT / "configs")
    call, text = CALLS[how]
    job = job_of(tmp_path, call)
    found = []
    for at, x in ((1_700_000_000, 30), (1_700_000_100, 42)):
        write(tmp_path / "300.ngc", text.format(x=x), at)
        found.append(reach(job))
    assert found[1] - found[0] == pytest.approx(12, abs=1e-6), found


def test_the_tool_table(tmp_path, monkeypatch):
    """A radius of D is that of the table as it is now."""
    monkeypatch.chdir(ROOT / "configs")
    job = job_of(tmp_path, "G42 D5 G1 X10 Y10 F100\nG1 X10 Y40\nG40 G1 X0")
    found = []
    for at, diameter in ((1_700_000_000, 4), (1_700_000_100, 5)):
        write(tmp_path / "own.tbl", f"T1 P1 D2\nT5 P5 D{diameter}\n", at)
        found.append(reach(job))
    assert found[1] - found[0] == pytest.approx(0.5, abs=1e-6), found
