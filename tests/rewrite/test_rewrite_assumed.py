# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise rewrite on programs that name no stock or no tool: what it assumes is said, and makes nothing less
safe."""

import re

import pytest

from support import forked
from support.check_runs import CHIPWISE, mill_with_tools

# a groove 2 mm deep below Z0, a tool that only a comment names
PART = (
    "(T1 D=6. CR=0. - ZMIN=-2. - flat end mill)\nG21 G90 G94 G17\nG0 X0 Y0 Z5\nG1 Z-2 F100\nG1 X40 F300\n"
    "G1 Y20 F300\nG1 X30 F120\nG0 Z5\nM2\n"
)
STOCK = ("--stock", "-10", "-10", "-4", "60", "40", "0")


@pytest.fixture(name="machine")
def make_machine(tmp_path):
    return mill_with_tools(tmp_path)


def rewrite(tmp_path, machine, text, *options):
    """-> (exit status, what is said, the new text)."""
    (tmp_path / "part.ngc").write_text(text)
    out = tmp_path / "out.ngc"
    done = forked.run([CHIPWISE, "rewrite", tmp_path / "part.ngc", "-o", out, "--ini", machine, *options], timeout=300)
    return done.returncode, done.stdout + done.stderr, out.read_text() if out.exists() else None


def feeds(text):
    return [float(value) for value in re.findall(r"F([\d.]+)", re.sub(r"\([^)]*\)", "", text))]


def test_on_an_assumed_stock_f_is_lowered_and_never_raised(tmp_path, machine):
    status, said, text = rewrite(tmp_path, machine, PART, "--feed", "2")
    assert (
        status == 0
        and "--stock -3 -3 -2 43 23 0" in said
        and "tool 1, 6 mm, from a comment" in said
        and "no F is raised" in said
    )
    assert max(feeds(text)) < 190  # mm/min: 2 cm3/min of a slot of 12 mm2 is 167
    status, said, text = rewrite(tmp_path, machine, PART, "--feed", "30")
    assert status == 0 and max(feeds(text)) <= 300 and text == PART
    # the same with all named: it is raised
    status, said, text = rewrite(tmp_path, machine, PART, "--feed", "30", *STOCK, "--tool-diameter", "6")
    assert status == 0 and max(feeds(text)) > 2000 and "no F is raised" not in said


def test_no_flutes_are_respected_in_a_stock_that_nobody_has_named(tmp_path, machine):
    deep = PART.replace("G1 Z-2 F100", "G0 X-10\nG0 Z-30\nG1 X0 F100")
    status, said, text = rewrite(tmp_path, machine, deep, "--flute", "--tool", "1")
    assert (
        status == 2
        and text is None
        and "in the assumed stock, its flutes are" in said
        and "name the stock with --stock" in said
    )
    status, said, text = rewrite(tmp_path, machine, PART, "--flute")
    assert status == 0 and text == PART and "the flutes are long enough everywhere in it" in said


def test_the_stock_of_the_program_wins_with_a_word(tmp_path, machine):
    own = PART.replace("G0 X0 Y0", "T1 M6\nM250 P-10 Q-10 R-4 I70 J50 K4\nG0 X0 Y0")
    status, said, _text = rewrite(tmp_path, machine, own, "--feed", "2", *STOCK)
    assert status == 0 and "--stock is not used: the program defines its stock with M250" in said


def test_both_missing_things_are_asked_for_at_once(tmp_path, machine):
    text = "G21 G90\nG0 X0 Y0 Z0\nG1 X10 F100\nM2\n"
    status, said, _text = rewrite(tmp_path, machine, text, "--feed", "2")
    assert (
        status == 2
        and "no tool is in the spindle (tool 0)" in said
        and "--tool-diameter D, and add M250, or name the stock with --stock X0" in said
    )
    status, said, _text = rewrite(tmp_path, machine, text, "--feed", "2", "--tool-diameter", "6")
    assert status == 2 and "its depth is not known" in said and "--stock X0" in said
