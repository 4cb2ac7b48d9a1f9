# SPDX-License-Identifier: GPL-2.0-or-later
"""G75 beyond the soft limits in the real LinuxCNC: refused before the first move, under offsets, rotation and tool
length."""

import pytest

from support.operate import operate

pytestmark = pytest.mark.machine

# mill.ini: X -50..350, Y -50..250, Z -60..90
SUB = ["o100 sub", "G0 X0 Y0", "G0 Z5", "G1 Z-1 F900", "G3 X0 Y20 J10", "G0 Z5", "o100 endsub"]
LENGTH = 17.25


def program(call, *before):
    return "\n".join([*SUB, "G21 G90 G17 G40 F900", *before, call, "M2", ""])


def test_refused_before_anything_moves(tmp_path):
    """The arc's ends are within the limits, its bulge is not; then in Y by the rotation, in Z by the tool; then just
    within, and that runs."""
    cases = [
        (
            program("G75 Q100 X345 Y40"),
            "line 5 of the sub, copy 1: axis X would be at 355 mm, beyond its limit of 350 mm",
        ),
        (
            program("G75 Q100 X300 Y40 L8 I7"),
            "line 5 of the sub, copy 7: axis X would be at 352 mm, beyond its limit of 350 mm",
        ),
        (
            program("G75 Q100 X241 Y-40", "G10 L2 P1 R90"),
            "line 5 of the sub, copy 1: axis Y would be at 251 mm, beyond its limit of 250 mm",
        ),
        (
            program("G20\nG75 Q100 X4 Y1 Z2.75", "G10 L2 P1 R0"),
            "line 3 of the sub, copy 1: axis Z would be at 8.42913 in, beyond its limit of 3.54331 in",
        ),
        (
            program("G75 Q100 X20 Y40 Z69"),
            "line 3 of the sub, copy 1: axis Z would be at 91.25 mm, beyond its limit of 90 mm",
        ),
    ]
    steps = [["mdi", "T1 M6"], ["mdi", f"G43.1 Z{LENGTH}"], ["mdi", "G0 X20 Y30 Z10"], ["position"]]
    for text, _words in cases:
        steps += [["start", text], ["finish"], ["position"], ["messages"]]
    steps += [["start", program("G75 Q100 X339.9 Y40", "G10 L2 P1 R0")], ["finish"], ["position"]]
    answers = operate(tmp_path, steps)
    home = answers[3]
    for k, (_text, words) in enumerate(cases):
        _started, found, place, said = answers[4 + 4 * k : 8 + 4 * k]
        assert any(words in text for text in [*(found or []), *said]), (words, found, said)
        assert place == pytest.approx(home, abs=1e-9)
    assert answers[-1][:2] == pytest.approx((339.9, 60), abs=1e-6) and not answers[-2]
