# SPDX-License-Identifier: GPL-2.0-or-later
"""nc_files/chop_contour.ngc through LinuxCNC's interpreter: no loose piece reaches the chop size."""

import math
from pathlib import Path

from support import chop_oracle
from support.canon import run_preview

PROGRAM = Path(__file__).resolve().parents[2] / "nc_files" / "chop_contour.ngc"
PLATE = [("L", 0, 0, 190, 0), ("L", 190, 0, 190, 70), ("L", 190, 70, 0, 70), ("L", 0, 70, 0, 0)]
CHOP_SIZE, RADIUS = 18.0, 3.0


def test_no_piece_reaches_the_chop_size():
    trace = run_preview(PROGRAM.read_text(), tools={1: 2 * RADIUS})
    assert trace.error == ""
    cuts = [e for e in trace.elements if e.kind != "rapid" and e.b[2] < -6.0]
    sizes = chop_oracle.final_pieces([PLATE], chop_oracle.tuples(cuts), RADIUS)
    assert len(sizes) > 10 and 0.5 * CHOP_SIZE < max(sizes) < CHOP_SIZE
    without = [cut for cut in cuts if cut is not longest_chop_line(cuts)]
    assert max(chop_oracle.final_pieces([PLATE], chop_oracle.tuples(without), RADIUS)) > CHOP_SIZE


def longest_chop_line(cuts):
    """The longest straight cut before the first arc: one of the angle's own chop lines."""
    first = next(k for k, e in enumerate(cuts) if e.kind == "arc")
    return max(cuts[:first], key=lambda e: math.dist(e.a[:2], e.b[:2]))
