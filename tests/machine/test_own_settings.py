# SPDX-License-Identifier: GPL-2.0-or-later
"""Settings that a program or MDI makes by #<_chipwise_..>: those of the run before do not change the next."""

import numpy as np
import pytest

from support.operate import operate

pytestmark = pytest.mark.machine

VOLUME = "stock-tracker.0.removed-volume"
HOLE = "G21 G90 G17\nT1 M6\nM250 P70 Q70 R-3 I60 J60 K3\nF3000\nG0 X100 Y100 Z5\nG13 X100 Y100 I20 Z-3 R1\nM2\n"
CHOPPED = HOLE.replace("G13", "#<_chipwise_chop_size> = 12\nG13")
AFTERWARDS = HOLE.replace("M2\n", "#<_chipwise_chop_size> = 12\nM2\n")  # set when no code of ours comes any more
CONDITION = HOLE.replace("T1", "o1 if [#31 GT 0]\n#<_chipwise_chop_size> = 12\no1 endif\nT1")
NO_GUARD = "s/^GUARD_RAPID = .*/GUARD_RAPID = no/"


def volumes(tmp_path, *steps):
    """mm3 that each program of the steps has removed: a chopped hole is the ring and the grid of kerfs."""
    wanted = []
    for step in steps:
        wanted += [step] if isinstance(step, list) else [["start", step], ["finish"], ["pins", VOLUME]]
    answers = operate(tmp_path, wanted, edit=NO_GUARD)
    assert [answer for step, answer in zip(wanted, answers) if step[0] in ("mdi", "finish") and answer] == []
    return [float(answer[0]) for step, answer in zip(wanted, answers) if step[0] == "pins"]


def test_a_run_knows_only_its_own_settings(tmp_path):
    """The same file after a program, after MDI with and without a code of ours, after itself: each time what its
    preview shows."""
    setting = ["mdi", "#<_chipwise_chop_size> = 12"]
    seen = volumes(
        tmp_path,
        HOLE,
        CHOPPED,
        HOLE,
        setting,
        HOLE,
        setting,
        ["mdi", "M252"],
        HOLE,
        AFTERWARDS,
        AFTERWARDS,
        HOLE,
        ["mdi", "#31 = 1"],
        CONDITION,
        ["mdi", "#31 = 0"],
        CONDITION,
    )
    print([round(v) for v in seen])
    plain, chopped = seen[0], seen[1]
    ring = np.pi * (20**2 - 14**2) * 3
    assert ring < plain < 1.1 * ring and chopped > 1.5 * ring  # the ring and its lead-in; and the kerfs
    assert seen[2:] == pytest.approx([plain, plain, plain, plain, plain, plain, chopped, plain], rel=1e-3)


def test_settings_in_mdi(tmp_path):
    """In MDI a setting stays for the lines that follow; what a program has set is not that of MDI, nor of an inch
    program."""
    hole = ["mdi", "G13 X100 Y100 I20 Z-3 R1 F3000"]
    answers = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", "G0 X100 Y100 Z5"],
            ["mdi", "#<_chipwise_chop_size> = -1"],
            hole,
            hole,
            ["start", CHOPPED.replace("= 12", "= 12\n#<_chipwise_allowance> = 5")],
            ["finish"],
            hole,
            ["mdi", "#<_chipwise_chopsize> = 3"],
            hole,
            hole,
        ],
        edit=NO_GUARD,
    )
    negative = "chop size -1 mm is negative"
    assert [len(a) for a in (answers[3], answers[4], answers[7], answers[9], answers[10])] == [1, 1, 0, 1, 0], answers
    assert negative in answers[3][0] and negative in answers[4][0]
    assert "#<_chipwise_chopsize> is not known" in answers[9][0]
