# SPDX-License-Identifier: GPL-2.0-or-later
"""What an operator reads when a code refuses, whatever is in the way: one message, its line, no traceback."""

import os
import subprocess

import pytest

from chipwise.program.rs274 import tool_table_unit
from support.canon import ROOT, run_rs274, split_line, write_ini, write_tools

SUB = "o100 sub\nG0 X0 Y0\nG1 X50\nY20\nX0\nY0\no100 endsub\n"
TOOLS = {1: 6.0}


def error_of(program, **settings):
    trace = run_rs274(program, TOOLS, **settings)
    assert "Traceback" not in trace.output
    return trace.error, trace.error_line


def test_a_refusal_names_its_line():
    """AXIS names the line it has read last: 0, 6 or 3 for an error in line 9."""
    before = "T1 M6\nG21 G0 X0 Y0 Z20\n"
    for line in (
        "G12 I5 Z-6 R2",
        "G77 Q100 P41 Z-6 R2",
        "G78 Q9 P41 Z-6 R2 F100",
        "G79 Q100 Z6 R2 F100",
        "M250 P0",
        "M251 P9 Q1",
    ):
        text, number = error_of(SUB + before + line + "\nM2\n")
        assert text.startswith(f"chipwise: {line.split()[0]}: ") and number == 10, line


def test_a_refusal_in_a_file_of_its_own_names_the_file(tmp_path):
    (tmp_path / "part.ngc").write_text("o<part> sub\nG1 X1 F100\nG12 I5 R2\no<part> endsub\n")
    ini = write_ini(tmp_path)
    ini.write_text(ini.read_text().replace("[RS274NGC]", f"[RS274NGC]\nSUBROUTINE_PATH = {tmp_path}", 1))
    trace = run_rs274("T1 M6\nG21\no<part> call\nM2\n", TOOLS, ini=ini)
    assert trace.error.endswith("word Z (final depth) is missing; add Z")
    assert " (line 3 of part.ngc)" in trace.output and trace.error_line == 3


@pytest.mark.parametrize(
    "comment", ["BOX,{x}=1", "{BOX}", "BOX,XMIN={", "CYLINDER,AXIS={0}", "BOX,XMIN=1,{XMAX!r}=2", "}"]
)
def test_braces_in_a_workpiece_comment(comment):
    text, number = error_of(f"T1 M6\nG21\n(WORKPIECE,{comment})\nM250\nM2\n")
    assert text.startswith("chipwise: M250: WORKPIECE comment: ") and "internal error" not in text and number == 4


@pytest.mark.parametrize("code", ["M250", "G77 Q100 P41 Z-6 R2 F100"])
def test_a_path_that_is_not_utf8(tmp_path, code):
    folder = os.path.join(os.fsencode(tmp_path), b"caf\xe9")
    os.mkdir(folder)
    path = os.path.join(folder, b"part.ngc")
    with open(path, "w", encoding="utf-8") as program:
        program.write(f"{SUB}T1 M6\nG21 G0 X0 Y0 Z9\n{code}\nM2\n")
    table = write_tools(tmp_path, TOOLS, tool_table_unit("mm"))
    run = subprocess.run(
        [
            b"rs274",
            b"-g",
            b"-i",
            os.fsencode(write_ini(tmp_path)),
            b"-t",
            os.fsencode(table),
            b"-v",
            os.fsencode(tmp_path / "t.var"),
            path,
        ],
        cwd=ROOT,
        env={**os.environ, "HOME": str(tmp_path)},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=300,
        check=False,
    )
    said = [line for line in run.stderr.decode(errors="replace").splitlines() if line.startswith("chipwise")]
    assert [split_line(line) for line in said] == [
        (f"chipwise: {code.split()[0]}: the path of the program is not valid UTF-8; rename the file or its folder", 10)
    ]


def test_an_unknown_setting_with_braces(tmp_path):
    ini = write_ini(tmp_path)
    ini.write_text(ini.read_text().replace("\n[CHIPWISE]\n", "\n[CHIPWISE]\n{CELL} = 1\n", 1))
    text, _ = error_of("T1 M6\nG21 G0 Z9\nG12 I5 Z-6 R2 F100\nM2\n", ini=ini)
    assert text.startswith("chipwise: G12: [CHIPWISE]{CELL} is not a setting; use one of ")


@pytest.mark.parametrize(
    "diameter, typed", [(8.0, ".315"), (6.0, ".2362"), (10.0, ".3937"), (6.35, ".25"), (3.0, ".1181"), (12.0, ".4724")]
)
def test_a_step_of_the_tools_diameter_typed_in_inch(diameter, typed):
    """Four decimals of an inch may round a metric diameter up; the step is the tool's then, and not refused."""
    sub = SUB.replace("X50", "X2").replace("Y20", "Y2")
    for line in (
        f"G79 Q100 Z-.2 R.1 F20 D{typed}",
        f"G77 Q100 P42 Z-.2 R.1 F20 L3 D{typed}",
        f"G13 I.5 K1.4 Q{typed} Z-.2 R.1 F20",
    ):
        text, _ = run_rs274(f"{sub}T1 M6\nG20 G0 X0 Y0 Z1\n{line}\nM2\n", {1: diameter}).error, None
        assert text == "", line


def test_a_step_a_hundredth_above_the_tool_is_refused():
    assert (
        "step-over D8.01 mm is larger than the tool (8 mm)"
        in run_rs274(f"{SUB}T1 M6\nG21 G0 X0 Y0 Z9\nG79 Q100 Z-2 R1 F200 D8.01\nM2\n", {1: 8.0}).error
    )


def test_areas_in_program_units():
    """A slot that the tool does not fit into, 10 by 2 mm and 0.4 by 0.08 in."""
    sub = "o100 sub\nG0 X0 Y0\nG1 X30\nY10\nX40\nY12\nX30\nY30\nX0\nY0\no100 endsub\n"
    for unit, scale, shown in (("G21", 1.0, "mm2 stay"), ("G20", 1 / 25.4, "in2 stay")):
        shape = "".join(
            line[0] + f"{float(line[1:]) * scale:.6f}\n" if line[0] in "XY" else line + "\n"
            for line in sub.splitlines()
        )
        shape = shape.replace("G1 X30", f"G1 X{30 * scale:.6f}")
        said = run_rs274(
            f"{shape}T1 M6\n{unit} G0 X0 Y0 Z1\nG78 Q100 P41 Z{-2 * scale:.5f} R{scale:.5f} F{200 * scale:.3f}\nM2\n",
            TOOLS,
        ).output
        assert "does not fit in one place (line 5, 6, 7; " in said and shown in said, said[-600:]


@pytest.mark.parametrize("line, words", [("M252 P1", "words are F"), ("M253 P1 Q2", "words are P F")])
def test_the_words_of_an_m_code_are_named(line, words):
    assert (
        error_of(f"T1 M6\n{line}\nM2\n")[0]
        == f"chipwise: {line[:4]}: word {line.split()[-1][0]} is not used here; {words}"
    )


@pytest.mark.parametrize(
    "line, words",
    [
        ("M250 P0 Q0 R-10 I0.0004 J20 K10", "the stock has 0.0004 mm in X, less than 0.001 mm; give it a larger size"),
        (
            "M250 P0 Q0 R-10 I20 J20 K99999999",
            "a corner of the stock is at Z99999989 mm of the machine, more than 1000000 mm from its zero",
        ),
        (
            "M250 P0 Q-2000000 R-10 I20 J20 K10",
            "a corner of the stock is at Y-2000000 mm of the machine, more than 1000000 mm from its zero",
        ),
        (
            "(WORKPIECE,BOX,XMIN=0,YMIN=0,ZMIN=-5,XMAX=10,YMAX=10,ZMAX=5,XMIN=3)\nM250",
            "WORKPIECE comment: XMIN is given twice; give it once",
        ),
    ],
)
def test_a_stock_that_the_tracker_would_refuse(line, words):
    assert error_of(f"T1 M6\nG21\n{line}\nM2\n")[0].startswith(f"chipwise: M250: {words}")


def test_a_line_of_a_cycle_that_linuxcnc_refuses(tmp_path):
    """The reason in its own words. Python, for which what the interpreter raises is not an exception, has others."""
    (tmp_path / "own.py").write_text(
        "import remap\nfrom chipwise.glue import emit\n"
        "emit.emit = lambda interp, number, chunk: interp.execute('G2 X1 Y1 I0.00001 J0')\n"
    )
    ini = write_ini(tmp_path)
    ini.write_text(ini.read_text().replace(f"TOPLEVEL = {ROOT}/remap/toplevel.py", f"TOPLEVEL = {tmp_path}/own.py"))
    text, number = error_of("T1 M6\nG21 G0 X0 Y0 Z20\nG12 I5 Z-6 R2 F100\nM2\n", ini=ini)
    assert text.startswith("chipwise: G12: internal error: Zero-radius arc: start=") and number == 3
