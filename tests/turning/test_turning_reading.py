# SPDX-License-Identifier: GPL-2.0-or-later
"""What chipwise turn reads as text: words and modes of the program, tool tables of other people."""
import pytest

from chipwise import cli
from chipwise.errors import CycleError
from chipwise.turning.request import read_request
from chipwise.turning.tool import TableTool, read_table

HEAD = "G21 G18 G8 G94 G97 S500 M3\n"


@pytest.mark.parametrize("before, feed", [("F120\n", 120.0), ("G20 F4\n", 101.6), ("F120\nG1 F80\n", 80.0), ("F120\nG26 Q1 F90\n", 90.0)])
def test_the_feed_in_force_is_that_of_roughing(before, feed):
    assert read_request(HEAD + before + "G26 Q100\n").words["F"] == pytest.approx(feed)


@pytest.mark.parametrize("before", ["", "F0.2\nG20\n", "F120\nG95\n", "F120\nF#1\n", "O7 sub\nF120\nO7 endsub\n"])
def test_a_feed_of_another_unit_does_not_count(before):
    with pytest.raises(CycleError, match="no feed F above 0"):
        read_request(HEAD + before + "G26 Q100\n")


@pytest.mark.parametrize("line", ["T1 P1 D0.8 I85 J5 Q2 X1.5 Z-2", "t1 p1 d.8 i85. j5 q2 x1.5 z-2 ;T9 D7", "T1\tP1\tD8e-1\tI8.5E1 J0.5e+1 Q2.0 X+1.5 Z-2"])
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
    text = ("(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=30,ZMIN=-60,ZMAX=0)\n(LATHE,ROUGH=1,FINISH=2)\n" + HEAD
            + "G26 Q100 F100\n{}M2\nO100 sub\nG0 X8 Z0\nG1 X10 Z-20\nO100 endsub\n")
    (tmp_path / "part.ngc").write_text(text.format("G27 Q100 L3 F100\n"))
    assert cli.main(["turn", str(tmp_path / "part.ngc")]) == 1
    assert "the plan of line 4 only; G26 or G27 is also in line 5" in capsys.readouterr().err
    (tmp_path / "part.ngc").write_text(text.format(""))
    assert cli.main(["turn", str(tmp_path / "part.ngc")]) == 1
    assert not capsys.readouterr().err
