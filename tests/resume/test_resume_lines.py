# SPDX-License-Identifier: GPL-2.0-or-later
"""Stops in lines that cannot be divided: moves that enter cutter compensation (G41, G42), that are compensated, and
that do more than move."""

import numpy as np
import pytest

from chipwise.resume import stocks
from support.resume_oracle import apart
from support.resume_programs import ARCS
from support.resume_stop import Stop

pytestmark = pytest.mark.usefixtures("forked_readers")

ENTRY, FIRST = 16, 17  # lines of ARCS
SHARES = (0.4, 0.95)
# Behind the move that enters, to the other side of it.
RIGHT = ARCS.replace("G41 D3 G1 X1.6 Y0.9", "G42 D3 G1 X1.6 Y0.9")
MORE = """\
G21 G90 G17 G40 G49 G54 G80 G94
M250 P0 Q0 R-20 I80 J60 K20
T1 M6
S8000 M3
G0 X10 Y10 Z5
G1 Z-3 F200
X50 F500 M8
G3 X50 Y40 I0 J15 M9
G91
G1 X-30 F400 M8
G90
G0 Z5
M2
"""


def stopped_in(stop, line, share):
    """Cut up to a share of what a line moves."""
    own = np.flatnonzero(stop.read.line[stop.run.move] == line)
    stop.cut_to(int(own[int(share * (len(own) - 1))]))
    stop.keep()


def check(stop, **order):
    """The program that goes on, whose stock in the end is that of the uninterrupted run."""
    made = stop.made(**order)
    higher, lower = apart(stop.whole(stocks.head_of(made.stock, 0.0)), stop.final(made.data, made.stock))
    assert max(higher, lower) < 0.06, (higher, lower, made.data.decode())
    return made.data.decode()


@pytest.mark.parametrize("text", [ARCS, RIGHT], ids=["G41", "G42"])
@pytest.mark.parametrize("line", [ENTRY, FIRST])
def test_compensation_of_a_program_in_inch(tmp_path, text, line):
    """It goes on where compensation begins: where the move that enters it ends depends on where that begins."""
    stop = Stop(tmp_path, text)
    for share in SHARES:
        stopped_in(stop, line, share)
        made = check(stop, **({} if line == ENTRY else {"seconds": 0.1, "broke": True}))
        assert made.count("\nN140 G4") == 1, (share, made)


@pytest.mark.parametrize("line", [7, 8, 10], ids=["straight", "arc", "G91"])
def test_lines_that_do_more_than_move(tmp_path, line):
    stop = Stop(tmp_path, MORE)
    text = MORE.splitlines()[line - 1]
    for share in SHARES:
        stopped_in(stop, line, share)
        assert text in check(stop).splitlines(), share
