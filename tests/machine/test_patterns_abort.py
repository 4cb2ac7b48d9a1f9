# SPDX-License-Identifier: GPL-2.0-or-later
"""G75 and what is left of it: nothing after an abort at any line of the sub; and on the lathe, threads included, in the
real LinuxCNC."""

import os
import random

import pytest

from support.operate import operate

pytestmark = pytest.mark.machine

# every mode that a sub may set, each in force for some of its lines
SUB = [
    "o100 sub",
    "G0 X10 Y5",
    "G0 Z4",
    "G64 P0.5",
    "G1 Z-1 F700",
    "G20 G1 X1",
    "G21 G91 G1 Y8",
    "G90 G18 G3 X30 Z-1 R4 F500",
    "G17 G61",
    "S500 M3 M8",
    "G1 X12 Y9",
    "G41.1 D1 G1 X8",
    "G1 Y20",
    "G40 G1 X4",
    "G99 G81 X6 Z-2 R1",
    "G80 M9",
    "G0 Z9",
    "o100 endsub",
]
MOVING = (2, 3, 5, 6, 7, 8, 11, 12, 13, 14, 15, 17)  # lines of SUB that move


def program(call):
    return "\n".join(
        [
            *SUB,
            "T1 M6",
            "G21 G90 G17 G40 G49 G61 G94 G98 F600",
            "S500 M3",
            "G0 X100 Y60 Z30",
            call,
            "G1 X100 F100",
            "M2",
            "",
        ]
    )


def lines_to_stop_at():
    """All of them with CHIPWISE_ABORTS=0, else so many, 4 without it."""
    count = int(os.environ.get("CHIPWISE_ABORTS", "4"))
    return (
        sorted(random.Random(int(os.environ.get("CHIPWISE_SEED", "7134"))).sample(MOVING, count))
        if count
        else list(MOVING)
    )


def test_nothing_is_left_after_an_abort_at_any_line(tmp_path):
    """Codes, speed and offsets are those of a program with a plain move in its place; the next program does what it
    says.

    F and the tolerances are the program's, or what LinuxCNC makes of them when a traverse is aborted: 0.  The program's
    are 600, and 100 in its last line, which a busy computer may come to before the abort; 700 and 500 are the sub's."""
    lines = lines_to_stop_at()
    steps = [
        ["start", program("G1 X300 F600")],
        ["until", "motion.program-line", "=", len(SUB) + 5],
        ["abort"],
        ["modes"],
        ["errors"],
    ]
    for line in lines:
        steps += [
            ["start", program("G75 Q100 X40 Y30 R30 H1 L3 I25 K7")],
            ["until", "motion.program-line", "=", line],
            ["abort"],
            ["modes"],
            ["errors"],
        ]
    steps += [
        ["start", program("G75 Q100 X40 Y30")],
        ["finish"],
        ["position"],
        ["modes"],
        ["mdi", "G1 X101 F100"],
        ["position"],
    ]
    answers = operate(tmp_path, steps, timeout=150 + 20 * len(lines))
    plain = answers[3]
    for k, line in enumerate(lines):
        _started, _there, _aborted, modes, errors = answers[5 + 5 * k : 10 + 5 * k]
        assert modes[0][1:] == plain[0][1:] and modes[1] == plain[1] and modes[3:] == plain[3:], (
            line,
            modes,
            plain,
        )  # G0 or G1 is that of the line
        (feed, speed, *tolerances), (_feed, plain_speed, *plain_tolerances) = modes[2], plain[2]
        assert feed in (0, 600, 100) and speed == plain_speed, (line, modes)
        assert all(value in (0, before) for value, before in zip(tolerances, plain_tolerances)), (line, modes)
        assert not errors, (line, errors)
    finished, place, _modes, said, after = answers[-5:]
    assert not finished and not said
    assert place == pytest.approx([100, 50, 9], abs=1e-6) and after == pytest.approx([101, 50, 9], abs=1e-6)


TURNED = [
    "o100 sub",
    "G0 X40 Z2",
    "G1 X36 F900",
    "G1 Z-6",
    "G2 X40 Z-8 R2",
    "G0 X50",
    "G0 Z4",
    "o100 endsub",
    "o101 sub",
    "G0 X36",
    "G0 Z3",
    "G33 Z-9 K1.5",
    "G0 X50",
    "G0 Z4",
    "o101 endsub",
]


def test_a_lathe_runs_patterns(tmp_path):
    """configs/lathe.ini: profiles along Z, one mirrored, then threads in step with the spindle; diameters; no word Y
    reaches the task."""
    text = "\n".join(
        [
            *TURNED,
            "G18 G21 G7 G90 G94 G40 G61",
            "S300 M3",
            "G0 X60 Z10",
            "G75 Q100 Z-20 L3 J-15",
            "G75 Q100 Z-80 H2",
            "G75 Q101 X-2 L2 J-40",
            "M2",
            "",
        ]
    )
    bad = "\n".join([*TURNED, "G18 G21 G7 G90 G94", "S300 M3", "G0 X60 Z10", "G75 Q101 H2", "M2", ""])
    answers = operate(
        tmp_path,
        [
            ["start", text],
            ["until", "axis.z.pos-cmd", "<", -57.9],
            ["until", "axis.z.pos-cmd", "<", -83.9],
            ["until", "axis.z.pos-cmd", "<", -48.9],
            ["finish"],
            ["position"],
            ["start", bad],
            ["finish"],
            ["position"],
            ["messages"],
        ],
        ini="lathe.ini",
    )
    _started, *_passed, errors, place, _bad, refused, stays, messages = answers
    assert not errors and place == pytest.approx([24, 0, -36], abs=1e-6)
    assert any(
        "line 12 of the sub cuts a thread, and Z is mirrored" in text for text in refused
    ) and stays == pytest.approx([30, 0, 10], abs=1e-6)
    assert any("of the sub on are mirrored: the tool has to cut in that direction" in text for text in messages)
