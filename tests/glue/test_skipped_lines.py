# SPDX-License-Identifier: GPL-2.0-or-later
"""glue/skipped_lines.py: which of the lines that run from line reads over decides on the stock."""

import pytest

from chipwise.glue.skipped_lines import stock_is_defined_again

FIRST = "M250 P0 Q0 R-10 I60 J40 K10\n"


@pytest.mark.parametrize(
    "between, again",
    [
        ("G0 X1\n", False),
        (FIRST, True),
        ("N20 G4 P1 m 254 P1 (back)\n", True),
        ("M2504\n", False),
        ("M251 Q6\n", False),
        ("(M250)\n", False),
        ("; M250\n", False),
        ("/" + FIRST, False),
        ("o1 sub\nG0 X1\no1 endsub\n" + FIRST, True),
        ("o1 sub\n" + FIRST + "o1 endsub\no1 call\n", False),
        ("o<a> if [#1 GT 0]\n" + FIRST + "o<a> endif\n", False),
        ("o2 if [1]\no3 repeat [2]\no3 endrepeat\n" + FIRST + "o2 endif\n" + FIRST, True),
        ("o4 do\n" + FIRST + "o4 while [0]\n", False),
        ("/o5 if [1]\n" + FIRST, False),
    ],
)
def test_a_later_line_counts_if_it_is_executed(between, again):
    text = "G21\n" + FIRST + between + "G1 X5\n" + FIRST
    assert stock_is_defined_again(text, 2, 3 + between.count("\n")) is again


def test_the_start_line_itself_is_not_skipped():
    assert not stock_is_defined_again(FIRST + FIRST, 1, 2) and stock_is_defined_again(FIRST + FIRST + "M2", 1, 3)
