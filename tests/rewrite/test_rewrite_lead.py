# SPDX-License-Identifier: GPL-2.0-or-later
"""What is unknown before a program's first height, and cells too large for a tool: rewrite judges them as check
does."""

import re

import pytest

from support.rewrite_rig import HEAD, check_status, rewrite

STOCK = "M250 P0 Q0 R-30 I100 J60 K40\n"  # its top is 10 mm above machine zero
LEAD = (
    "T1 M6\nS8000 M3\nG0 X-10 Y30\nX110\nX-10 Y30 Z15\nG0 Z-2\nG1 X110 F400\nG0 Z15\nM2\n"  # 12 mm deep, D6, flutes 12
)
DEEP = LEAD.replace("Z-2\n", "Z-3\n")


def test_a_traverse_at_an_unknown_height_cuts_nothing(tmp_path, machine):
    """To the interpreter the first traverses are at machine zero, through the stock; the machine may stand anywhere."""
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(HEAD + STOCK + LEAD)
    assert "unchanged" in rewrite(before, after, machine, "--flute").said
    before.write_text(HEAD + STOCK + DEEP)
    assert check_status(before, machine)[0] == 1
    assert "2 levels" in rewrite(before, after, machine, "--flute").said
    assert check_status(after, machine)[0] == 0
    before.write_text(HEAD + STOCK + DEEP)
    assert rewrite(before, after, machine, "--feed", "10").status == 0
    feeds = [float(f) for f in re.findall(r"F([\d.]+)", after.read_text())]
    assert min(feeds) == pytest.approx(10000 / (6 * 13), rel=0.02)  # of the slot, not of what a traverse has left


@pytest.mark.parametrize("kind", (["--flute"], ["--feed", "5"]))
def test_cells_too_large_for_the_tool(tmp_path, machine, kind):
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(HEAD + STOCK + LEAD)
    done = rewrite(before, after, machine, *kind, "--cell", "5")
    assert done.status == 2 and "less than 4 cells" in done.errors and not after.exists()
    before.write_text(HEAD + LEAD)
    done = rewrite(before, after, machine, *kind, "--stock", "0", "0", "-30", "90000", "60000", "10")
    assert done.status == 2 and "too small for a stock of this size" in done.errors
    before.write_text(HEAD + STOCK + LEAD.replace("X110 F400", "X200000 F400"))
    done = rewrite(before, after, machine, *kind)
    assert done.status == 2 and "more than 100 m from machine zero" in done.errors


def test_a_lone_carriage_return_ends_no_line(tmp_path, machine):
    """LinuxCNC's lines end with a line feed: the numbers of the lines are those of the interpreter."""
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_bytes((HEAD + "(one\rtwo)\n" + STOCK + DEEP).encode())
    done = rewrite(before, after, machine, "--flute")
    assert done.status == 0, done.errors
    assert b"(one\rtwo)\n" in after.read_bytes() and check_status(after, machine)[0] == 0
