# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise try: the motion of a program as the machine of an INI file would make it, whichever rs274 is installed."""

import math
import os
import shutil
import signal
import subprocess
from pathlib import Path

import pytest

from chipwise.program import rs274
from support.canon import parse_rs274, run_preview, same_path

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = "T3 M6\n{unit} G90 G0 X0 Y0 Z{z} F{feed}\n(begin)\nG13 X{x} Y0 I{radius} Z-{z}\n(end)\nM2\n"
MM = PROGRAM.format(unit="G21", x=20, z=5, radius=9, feed=600)
INCH = PROGRAM.format(unit="G20", x=0.8, z=0.2, radius=0.36, feed=24)


def chipwise_try(program, *options, **changed):
    return chipwise_run("try", program, *options, **changed)


def chipwise_run(command, program, *options, cwd=ROOT, **environment):
    return subprocess.run(
        [ROOT / "bin/chipwise", command, program, *options],
        cwd=cwd,
        text=True,
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=300,
    )


@pytest.fixture
def program(tmp_path):
    def write(text):
        path = tmp_path / "program.ngc"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize("machine, ini, diameter", [("mm", "mill", 10.0), ("in", "mill_inch", 10.0)])
@pytest.mark.parametrize("text", [MM, INCH], ids=["G21", "G20"])
def test_the_motion_is_that_of_the_machine(program, machine, ini, diameter, text):
    """In all four combinations of units, against the preview's interpreter with the tool given in mm."""
    table = (ROOT / "configs" / f"{ini}.tbl").read_text()
    listed = next(line for line in table.splitlines() if line.startswith("T3 "))
    size = float(listed.split(" D")[1].split()[0]) * (1.0 if machine == "mm" else 25.4)
    assert size == pytest.approx(diameter, abs=0.01)
    done = chipwise_try(program(text), "--ini", str(ROOT / "configs" / f"{ini}.ini"))
    assert done.returncode == 0, done.stderr
    wanted = run_preview(text, {3: size}, machine=machine).between("begin", "end")
    assert len(wanted) > 4
    same_path(parse_rs274(done.stdout).between("begin", "end"), wanted, 2e-4 if text is MM else 4e-3)


def test_the_unit_is_measured():
    """An inch machine is one in every version; a metric one is what the installed rs274 makes of it."""
    assert rs274.tool_table_unit("inch") == 25.4
    assert rs274.tool_table_unit("mm") in (1.0, 25.4)


def test_a_tool_table_is_scaled_in_its_lengths_only():
    text = "T3 P12 D10 X-1.5 Y+.5 Z25.4 A30 B1 I45 J-45 Q2 ; mill D10, X1\n; D1\n"
    assert rs274.scaled_table(text, 1 / 25.4) == (
        "T3 P12 D0.393700787 X-0.059055118 Y0.019685039 Z1.000000000 A30 B1 I45 J-45 Q2 ; mill D10, X1\n; D1\n"
    )
    assert rs274.scaled_table(text, 1.0) == text


def copied_machine(folder):
    """A machine of one's own: INI file with #INCLUDE, relative paths, its own tools and tool geometry."""
    text = (ROOT / "configs/mill.ini").read_text()
    before, _, rest = text.partition("REMAP = ")
    _, _, rest = rest.partition("\n\n[EMCMOT]")
    (folder / "machine.ini").write_text(
        (before + "#INCLUDE codes.inc\n\n[EMCMOT]" + rest).replace("= remap", f"= {ROOT}/remap")
    )
    shutil.copy(ROOT / "configs/chipwise_codes.inc", folder / "codes.inc")
    (folder / "mill.tbl").write_text("T3 P3 D4 Z30 ; thin\n")
    (folder / "tools.toml").write_text("[tool.3]\nflute_length = 2\n")
    return folder / "machine.ini"


def test_a_machine_with_includes_from_another_folder(program, tmp_path):
    folder, home = tmp_path / "machine", tmp_path / "home"
    folder.mkdir()
    home.mkdir()
    ini = copied_machine(folder)
    (home / ".tool.mmap").write_text("of a running LinuxCNC")
    before = sorted(os.listdir(folder))
    done = chipwise_try(program(MM), "--ini", str(ini), cwd="/", HOME=str(home))
    assert done.returncode == 0, done.stderr
    hole = parse_rs274(done.stdout).between("begin", "end")
    radii = [math.dist(e.b[:2], (20, 0)) for e in hole if e.kind == "arc"]
    assert max(radii) == pytest.approx(9 - 2, abs=1e-3)  # the tool of 4 mm
    assert len({round(e.b[2], 3) for e in hole if e.kind == "arc"}) >= 3  # flutes of 2 mm: levels
    assert sorted(os.listdir(folder)) == before
    assert os.listdir(home) == [".tool.mmap"] and (home / ".tool.mmap").read_text() == "of a running LinuxCNC"


def test_ctrl_c_ends_it_without_a_traceback(program):
    """A terminal sends it to all processes: rs274 with Python in it, and that one's planner, print nothing."""
    endless = program("G21\nO100 while [1]\nG1 X1 F100\nX0 F200\nO100 endwhile\nM2\n")
    work = subprocess.Popen(
        [ROOT / "bin/chipwise", "try", endless],
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # ignored below a background shell
    while "STRAIGHT_FEED" not in work.stdout.readline():
        pass
    os.killpg(work.pid, signal.SIGINT)
    _out, said = work.communicate(timeout=300)
    assert (work.returncode, said.strip()) == (130, "executing"), said


def test_what_cannot_be_tried_is_said(program, tmp_path):
    good = program("G21 G0 X1\nM2\n")
    done = chipwise_try(tmp_path / "none.ngc")
    said = "No such file or directory; name a G-code program that can be read"
    assert (done.returncode, done.stderr) == (2, f"chipwise: {tmp_path}/none.ngc: {said}\n")
    done = chipwise_try(tmp_path)
    said = "it is not a regular file; name a G-code program that can be read"
    assert (done.returncode, done.stderr) == (2, f"chipwise: {tmp_path}: {said}\n")
    done = chipwise_try(good, "--ini", "/no/such.ini")
    said = "INI file /no/such.ini: No such file or directory; name the machine's INI file with --ini"
    assert (done.returncode, done.stderr) == (2, f"chipwise: {said}\n")
    (tmp_path / "bad.ini").write_text("[TRAJ]\nLINEAR_UNITS = cubit\n[EMCIO]\nTOOL_TABLE = t.tbl\n")
    (tmp_path / "t.tbl").write_text("T1 P1 D1\n")
    done = chipwise_try(good, "--ini", str(tmp_path / "bad.ini"))
    assert done.returncode == 2
    assert done.stderr.startswith("chipwise: [TRAJ]LINEAR_UNITS = cubit is not a unit; use mm or inch")
    for line, message in (
        (
            "[EMCIO]\nTOOL_TABLE = none.tbl",
            f"[EMCIO]TOOL_TABLE {tmp_path}/none.tbl cannot be read: No such file or directory; correct the INI file",
        ),
        (
            "#INCLUDE none.inc",
            f"#INCLUDE {tmp_path}/none.inc cannot be read: No such file or directory; correct the INI file",
        ),
        ("[CHIPWISE]\nCELL = fine", "[CHIPWISE]CELL = fine is not a length from 0.01 to 10 mm; correct the INI file"),
    ):
        (tmp_path / "bad.ini").write_text(line + "\n")
        done = chipwise_try(good, "--ini", str(tmp_path / "bad.ini"))
        assert (done.returncode, done.stderr) == (2, f"chipwise: {message}\n")
    done = chipwise_try(good, PATH="/nowhere")
    assert (done.returncode, done.stderr) == (
        2,
        "chipwise: LinuxCNC's rs274 is not on the PATH; install linuxcnc-uspace\n",
    )
    done = chipwise_try(program("G21 F100\nG13 I5 Z-1\nM2\n"))
    assert done.returncode == 1
    assert "chipwise: G13" in done.stderr and "Traceback" not in done.stderr


LINES = "G21 G90 F100\nG1 X1\nM2\n"


@pytest.mark.parametrize(
    "content, said",
    [
        (b"", "it is empty; name a G-code program"),
        (LINES.encode("utf-16"), "it is not a text file; name a G-code program"),
        (
            LINES.encode("utf-8-sig"),
            "it begins with a byte order mark, which LinuxCNC refuses; save it as UTF-8 without one (line 1)",
        ),
        (
            LINES.replace("\n", "\r").encode(),
            "its lines end with CR alone, so LinuxCNC reads it as one line; save it with LF or CR LF at the ends "
            "(line 1)",
        ),
    ],
)
def test_a_file_that_linuxcnc_cannot_use_is_said_in_one_line(content, said, tmp_path):
    """Nothing of rs274's own words."""
    path = tmp_path / "program.ngc"
    path.write_bytes(content)
    done = chipwise_try(path)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", f"chipwise: {path}: {said}\n")


def test_an_ini_file_that_linuxcnc_cannot_use(program, tmp_path):
    good = program(LINES)
    for content, said in (
        (b"", "it has no section"),
        (b"\n\n", "it has no section"),
        ((ROOT / "configs/mill.ini").read_text().encode("utf-16"), "it is not a text file"),
        (b"[TRAJ]\rLINEAR_UNITS = mm\r", "its lines end with CR alone, so LinuxCNC reads it as one line"),
    ):
        (tmp_path / "bad.ini").write_bytes(content)
        for command, name in (("try", ""), ("check", "check: "), ("setup", "setup: ")):
            done = chipwise_run(command, good, "--ini", str(tmp_path / "bad.ini"))
            message = f"{name}INI file {tmp_path}/bad.ini: {said}; name the machine's INI file with --ini"
            assert done.returncode == 2 and done.stderr.startswith(f"chipwise: {message}"), done.stderr
            assert done.stderr.count("\n") == 1 and done.stdout == ""
