# SPDX-License-Identifier: GPL-2.0-or-later
"""What chipwise turn reads as text: words and modes of the program, tool tables of other people."""

import json

import pytest

from chipwise import cli
from chipwise.errors import CycleError
from chipwise.turning.request import read_request
from chipwise.turning.tool import TableTool, read_table

HEAD = "G21 G18 G8 G94 G97 S500 M3\n"


@pytest.mark.parametrize(
    "before, feed", [("F120\n", 120.0), ("G20 F4\n", 101.6), ("F120\nG1 F80\n", 80.0), ("F120\nG26 Q1 F90\n", 90.0)]
)
def test_the_feed_in_force_is_that_of_roughing(before, feed):
    assert read_request(HEAD + before + "G26 Q100\n").words["F"] == pytest.approx(feed)


@pytest.mark.parametrize("before", ["", "F0.2\nG20\n", "F120\nG95\n", "F120\nF#1\n", "O7 sub\nF120\nO7 endsub\n"])
def test_a_feed_of_another_unit_does_not_count(before):
    with pytest.raises(CycleError, match="no feed F above 0"):
        read_request(HEAD + before + "G26 Q100\n")


@pytest.mark.parametrize(
    "line",
    [
        "T1 P1 D0.8 I85 J5 Q2 X1.5 Z-2",
        "t1 p1 d.8 i85. j5 q2 x1.5 z-2 ;T9 D7",
        "T1\tP1\tD8e-1\tI8.5E1 J0.5e+1 Q2.0 X+1.5 Z-2",
    ],
)
def test_numbers_of_a_tool_table_are_read_as_linuxcnc_reads_them(tmp_path, line):
    """strtod(): an exponent belongs to the number; I8.5E1 was 8.5 degrees."""
    (tmp_path / "lathe.tbl").write_text("; tools\n\n" + line + "\n")
    assert read_table(str(tmp_path / "lathe.tbl")) == {1: TableTool(0.8, 85.0, 5.0, 2, 1.5, -2.0)}


@pytest.mark.parametrize("line", ["T1 P1 Dnan I85 J5 Q2", "T1 P1 D0.8 I85 J5 Q2 Xinf", "T1 P1 D0,8 I85 J5 Q2"])
def test_a_line_of_a_tool_table_that_is_not_numbers_is_named(tmp_path, line):
    (tmp_path / "lathe.tbl").write_text(line + "\n")
    with pytest.raises(CycleError, match="cannot be read"):
        read_table(str(tmp_path / "lathe.tbl"))


def test_a_second_g26_is_named(tmp_path, capsys):
    """One plan is made; the operator hears of the other."""
    text = (
        "(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=30,ZMIN=-60,ZMAX=0)\n(LATHE,ROUGH=1,FINISH=2)\n"
        + HEAD
        + "G26 Q100 F100\n{}M2\nO100 sub\nG0 X8 Z0\nG1 X10 Z-20\nO100 endsub\n"
    )
    (tmp_path / "part.ngc").write_text(text.format("G27 Q100 L3 F100\n"))
    assert cli.main(["turn", str(tmp_path / "part.ngc")]) == 1
    assert "the plan of line 4 only; G26 or G27 is also in line 5" in capsys.readouterr().err
    (tmp_path / "part.ngc").write_text(text.format(""))
    assert cli.main(["turn", str(tmp_path / "part.ngc")]) == 1
    assert not capsys.readouterr().err


PART = (
    "(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=30,ZMIN=-60,ZMAX=0)\n(LATHE,ROUGH=1,FINISH=2)\n"
    + HEAD
    + "{before}G26 Q100 F100\nM2\nO100 sub\n{sub}O100 endsub\n"
)


@pytest.fixture
def turn(tmp_path, capsys):
    """(text, options) -> (status, steps as data or None, messages)."""

    def run(text, *options):
        (tmp_path / "part.ngc").write_text(text)
        status = cli.main(["turn", str(tmp_path / "part.ngc"), "--json", str(tmp_path / "plan.json"), *options])
        said = capsys.readouterr().err
        return status, None if status == 2 else json.loads((tmp_path / "plan.json").read_text())["steps"], said

    return run


def test_a_parameter_that_the_program_sets_is_asked_for(turn):
    """LinuxCNC reads an unset #100 as 0: X#100 was a cone to the axis, planned without a word."""
    sub, number = "G0 X8 Z0\nG1 X{x} Z-20\nG1 Z-30\n", PART.format(before="", sub="G0 X8 Z0\nG1 X12 Z-20\nG1 Z-30\n")
    wanted = turn(number)[1]
    for name, option in (("#100", "100=12"), ("#<_wide>", "_wide=12")):
        text = PART.format(before=f"{name}=12\n", sub=sub.format(x=name))
        status, _, said = turn(text)
        assert (
            status == 2 and f"--set {option.partition('=')[0]}=" in said and "line 9" in said and said.count("\n") == 1
        ), said
        assert turn(text, "--set", option)[1] == wanted
    assert turn(number, "--set", "100")[0] == 2


@pytest.mark.parametrize(
    "sub, right",
    [
        ("#31=12\nG0 X8 Z0\nG1 X#31 Z-20\nG1 Z-30\n", True),
        ("#1=12\nG0 X8 Z0\nG1 X#1 Z-20\nG1 Z-30\n", True),
        ("G0 X8 Z0\nG1 X12 Z-20 (#100)\nG1 Z-30\n", True),
        ("#1=31\nG0 X8 Z0\nG1 X#[30+1] Z-20\nG1 Z-30\n", False),
        ("G0 X8 Z0\n#31=[#31+12]\nG1 X#31 Z-20\nG1 Z-30\n", False),
        ("G0 X8 Z0\nG1 X12 Z[-20+#5422]\nG1 Z-30\n", False),
        ("G0 X8 Z0\nO200 call\nG1 Z-30\nO100 endsub\nO200 sub\nG1 X#100 Z-20\nO200 endsub\nO300 sub\nG1 X2\n", False),
    ],
)
def test_parameters_that_the_sub_sets_itself_are_known(turn, sub, right):
    status, _, said = turn(PART.format(before="#100=12\n", sub=sub).replace("G1 X2\nO100 endsub", "G1 X2\nO300 endsub"))
    assert (status == 1) == right, said
    assert right or "has its value only when the program runs" in said


def test_modes_before_g26_are_those_of_the_sub(turn):
    arc = "G0 X8 Z0\nG1 Z-18\nG2 X10 Z-20 I{} K{}\nG1 Z-30\n"
    assert (
        turn(PART.format(before="G90\\n", sub=arc.format(2, 0)))[1]
        == turn(PART.format(before="G90.1\n", sub=arc.format(10, -18)))[1]
    )
    status, _, said = turn(PART.format(before="G91\n", sub=arc.format(2, 0)))
    assert status == 2 and "G91 is on" in said and "program G90 before" in said
    assert turn(PART.format(before="G91\nG90\n", sub=arc.format(2, 0)))[0] == 1
