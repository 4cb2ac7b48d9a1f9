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


@pytest.mark.parametrize("where", ["the program", "a file"])
def test_lines_that_block_delete_leaves_out(where, tmp_path, monkeypatch):
    """As a call of the sub would run them, also in the contour of a cycle and in a sub that the sub calls: with block
    delete on, lines that begin with / are not read."""
    sub = (
        "o100 sub\nG0 X1 Y2 Z5\n{0}G1 Z-1 F90\n{0} X5\nG1 Y9\no200 call\n{0}N7 G12 I3 Z-1 R2 F80\nG79 Q300 Z-1 R2\n"
        "G0 Z5\no100 endsub\n"
    )
    other = "o200 sub\nG1 X7\n{0}G1 X8 Y1\no200 endsub\n"
    contour = "o300 sub\nG0 X30 Y0\nG1 X50\nY20\n{0}X40 Y12\nX30\nY0\no300 endsub\n"

    def ends(text, switch):
        monkeypatch.setenv("BLOCK_DELETE", switch)
        parts = [text(part) for part in (sub, other, contour)]
        if where == "a file":
            for number, part in zip((100, 200, 300), parts):
                (tmp_path / f"{number}.ngc").write_text(part)
            parts = []
        program = "".join(parts) + "T1 M6\nS900 M3\nG0 X0 Y0 Z9\n(begin)\nG75 Q100 H1 R30\n(end)\nM2\n"
        trace = canon.run_preview(program, SUBROUTINE_PATH=str(tmp_path))
        assert trace.error == ""
        return [tuple(round(v, 6) for v in e.b) for e in canon.ends_of(trace.between("begin", "end"))]

    def without(part):
        return "".join(line + "\n" for line in part.splitlines() if not line.startswith("{0}"))

    read, left_out = ends(lambda part: part.format(""), "0"), ends(without, "0")
    assert read != left_out
    assert ends(lambda part: part.format("/"), "0") == read
    assert ends(lambda part: part.format("/"), "1") == left_out
