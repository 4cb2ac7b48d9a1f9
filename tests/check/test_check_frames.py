# SPDX-License-Identifier: GPL-2.0-or-later
"""Arcs directly behind a change of the work coordinates: the tool has stayed where it was."""

import numpy as np
import pytest

from chipwise.program.reader import Machine, Reader
from chipwise.program.records import ARC, CIRCLE
from support.rewrite_rig import make_machine

HEAD = "G21 G90 G17 G40 G49 G80 G94\nG10 L2 P2 X5 Y-3 Z1 R30\nT1 M6\nF100\nG0 X10 Y2 Z3\n"
CHANGES = [
    "",
    "G55",
    "G92 X3 Y-7 Z2",
    "G10 L2 P1 X4 Y4 Z-1 R20",
    "G92 X1 Y1\nG1 X5\nG92.1",
    "G10 L20 P1 X0 Y0 Z0",
    "G55\nG1 X1\nG92 X9\nG54",
]


@pytest.mark.parametrize("change", CHANGES)
def test_an_arc_behind_a_change(tmp_path, change):
    program = tmp_path / "a.ngc"
    program.write_text(HEAD + change + "\nG91 G2 X10 Y10 I10 J0\nG90 G0 Z50\nM2\n")
    with Reader(str(program), Machine(str(make_machine(tmp_path / "mill"))), written=True) as reader:
        records = np.concatenate(list(reader))
    circle = int(np.flatnonzero(records[:, 0] == CIRCLE)[0])
    centre = records[circle, 3:6]
    chords = records[circle + 1 :][records[circle + 1 :, 0] == ARC, 2:5]
    before = records[:circle][records[:circle, 0] < ARC][-1, 2:5]
    assert len(chords) > 30
    for place in (before, *chords):
        assert np.hypot(*(place - centre)[:2]) == pytest.approx(10, abs=1e-6)
        assert place[2] == pytest.approx(before[2], abs=1e-6)
    assert np.abs(np.diff(chords, axis=0)).max() < 0.5  # all the way round, not across
