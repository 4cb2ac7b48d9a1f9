# SPDX-License-Identifier: GPL-2.0-or-later
"""The contour of the tests of G77 and G78, as a sub, as elements and as requests, and programs round it.  Called by
tests/interpreter/test_g77_g78*.py."""

import re

from support.contour_cycle_judge import request
from support.canon import run_preview

from chipwise.geometry.base.contour import ArcElement, LineElement

# An L with a fillet of 4 in its inner corner (12 24) and one of 2 outside, a tool of 6 mm; from 0 0 20.
SUB = """o100 sub
G0 X0 Y0
G1 X40
G1 Y10
G3 X38 Y12 I-2 J0
G1 X16
G2 X12 Y16 I0 J4
G1 Y40
G1 X0
G1 Y0
o100 endsub
"""
SHAPE = (
    LineElement((0.0, 0.0), (40.0, 0.0), 3),
    LineElement((40.0, 0.0), (40.0, 10.0), 4),
    ArcElement((40.0, 10.0), (38.0, 12.0), (38.0, 10.0), True, 5),
    LineElement((38.0, 12.0), (16.0, 12.0), 6),
    ArcElement((16.0, 12.0), (12.0, 16.0), (16.0, 16.0), False, 7),
    LineElement((12.0, 16.0), (12.0, 40.0), 8),
    LineElement((12.0, 40.0), (0.0, 40.0), 9),
    LineElement((0.0, 40.0), (0.0, 0.0), 10),
)
TOOLS = {1: 6.0, 3: 12.0}
ROUGH = "G77 Q100 P42 I0.5 L2 D2.5 Z-6 R2 J4 F600 E200"
FINISH = "G78 Q100 P42 K2 Z-6 R2 J4 F600 E200"
WORDS = dict(shape=SHAPE, side=42, depth_step=4.0)
ROUGH_REQUEST = request(allowance=0.5, passes=2, step=2.5, **WORDS)
FINISH_REQUEST = request(approach=2.0, finish=True, **WORDS)


def inch(text):
    """Lengths of words and coordinates in inch; P, Q, L and line numbers stay."""
    return re.sub(r"\b([XYZIJKRDEF])(-?[\d.]+)", lambda m: f"{m[1]}{float(m[2]) / 25.4:.9f}", text)


def program(line, sub=SUB, unit="G21", before="", after="", start="G0 X0 Y0 Z20"):
    """A program with the sub in front; comments mark what the line did."""
    if unit == "G20":
        line, sub, start = inch(line), inch(sub), inch(start)
    return f"T1 M6\n{before}\n{sub}{unit} {start}\n(begin)\n{line}\n(end)\n{after}\nM2\n"


def rough_and_finish():
    """The trace of both on a metric machine in a metric program: what all others must equal."""
    trace = run_preview(program(f"{ROUGH}\n(middle)\n{FINISH}"), TOOLS)
    assert trace.error == ""
    return trace
