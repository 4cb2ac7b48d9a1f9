# SPDX-License-Identifier: GPL-2.0-or-later
"""G75: path modes and threads of the sub, and what a sub that it calls may not hold, by the canonical calls that rs274
prints."""

import re

import pytest

from support import canon

HEAD = "G90 G94 G17 G40 G21\nT1 M6\nS500 M3\nF600\n"
_CALL = re.compile(r"N\S*\s+([A-Z0-9_]+)\((.*)\)\s*$")


def program(calls, sub, before="G64 P0.02 Q0.01", start="G0 X3 Y-4 Z7"):
    return "\n".join([*sub, HEAD, before, start, "(begin)", *calls, "(end)", "M2", ""])


def calls(text):
    """(name, arguments) of the canonical calls between the comments begin and end; lengths as the program has them."""
    run = canon.run_rs274(text)
    assert not run.error, run.error
    found = [match.groups() for match in map(_CALL.search, run.output.splitlines()) if match]
    first, last = found.index(("COMMENT", '"begin"')), found.index(("COMMENT", '"end"'))
    return found[first + 1 : last]


def path_modes(found):
    """Text of the path modes, and "cut" for each straight cut, in order."""
    names = []
    for name, words in found:
        if name == "SET_MOTION_CONTROL_MODE":
            mode, _comma, tolerance = words.replace("CANON_", "").partition(",")
            names.append(f"{mode} {float(tolerance or 0):g}")
        elif name == "SET_NAIVECAM_TOLERANCE":
            names[-1] += f" {float(words):g}"
        elif name == "STRAIGHT_FEED":
            names.append("cut")
    return names


def test_the_path_mode_of_a_sub_is_that_of_its_moves():
    """Each cut has the mode that the sub has set; before the next copy, and afterwards, it is the program's, P and Q
    too."""
    sub = [
        "o100 sub",
        "G0 X10 Y2",
        "G1 Z-1",
        "G64 P0.5",
        "G1 X20",
        "G61",
        "G1 Y9",
        "G61.1 G1 X5",
        "G64 P0.25 Q0.125 G1 Y1",
        "G0 Z7",
        "o100 endsub",
    ]
    own = "CONTINUOUS 0.02 0.01"
    one = [
        "cut",
        "CONTINUOUS 0.5 0.5",
        "cut",
        "EXACT_PATH 0",
        "cut",
        "EXACT_STOP 0",
        "cut",
        "CONTINUOUS 0.25 0.125",
        "cut",
        own,
    ]
    assert path_modes(calls(program(["G75 Q100 L2 I40 R30"], sub))) == one * 2
    assert path_modes(calls(program(["G75 Q100"], sub, before="G61")))[-1] == "EXACT_PATH 0"


def test_a_path_mode_counts_in_the_unit_of_its_line():
    """P of a sub in inch, of an expression too, called in mm."""
    sub = ["o100 sub", "G0 X10 Y2", "G20 G64 P[0.01 * 2]", "G1 X1", "G21 G64 P0.3", "G1 X30", "G0 Z7", "o100 endsub"]
    assert path_modes(calls(program(["G75 Q100"], sub)))[:4] == [
        "CONTINUOUS 0.508 0.508",
        "cut",
        "CONTINUOUS 0.3 0.3",
        "cut",
    ]


def test_a_pattern_in_a_pattern_has_its_own_path_mode():
    inner = ["o200 sub", "G0 X1", "G64 P0.4", "G1 X9", "G0 Z7", "o200 endsub"]
    outer = ["o100 sub", "G0 X0 Y0", "G61", "G1 X2", "G75 Q200 X10", "G1 X3", "o100 endsub"]
    own = "CONTINUOUS 0.02 0.01"
    assert path_modes(calls(program(["G75 Q100 Y5"], [*inner, *outer]))) == [
        "EXACT_PATH 0",
        "cut",
        "CONTINUOUS 0.4 0.4",
        "cut",
        "EXACT_PATH 0",
        "cut",
        own,
    ]
    assert path_modes(
        calls(program(["G75 Q300 Y5"], [*inner, "o300 sub", "G0 X0", "G75 Q200", "G1 X2", "o300 endsub"]))
    ) == ["CONTINUOUS 0.4 0.4", "cut", own, "cut", own]


def threads(found):
    """(K, start, end) of each cut that is in step with the spindle."""
    pitch, here, cuts = None, None, []
    for name, words in found:
        if name.startswith("START_SPEED_FEED_SYNC"):
            pitch = float(words.split(",")[-2])
        elif name == "STOP_SPEED_FEED_SYNCH":
            pitch = None
        elif name in ("STRAIGHT_FEED", "STRAIGHT_TRAVERSE"):
            there = [float(word) for word in words.split(",")[:3]]
            if pitch:
                cuts.append((pitch, here, there))
            here = there
    return cuts


@pytest.mark.parametrize(
    "words, place",
    [("R90 X5", lambda x, y: (5 - y, x)), ("H1", lambda x, y: (-x, y)), ("H3 Y2", lambda x, y: (-x, 2 - y))],
)
def test_threads_go_with_the_pattern(words, place):
    """Start and end are transformed, the path per turn stays; G33 sloping, by an expression, and all passes of G76."""
    sub = [
        "o100 sub",
        "G0 X10 Y2",
        "G0 Z2",
        "#1 = 1.25",
        "G33 Z-8 K#1",
        "G0 X12",
        "G0 Z3",
        "G33 X14 Z-6 K[#1 * 2]",
        "G0 Z7",
        "G0 X8 Y1",
        "G18 G76 P1.5 Z-9 I-1 J0.2 K0.9 Q29.5",
        "G17 G0 Z7",
        "o100 endsub",
    ]
    own = threads(calls(program(["o100 call"], sub)))
    found = threads(calls(program([f"G75 Q100 {words}"], sub)))
    assert (
        [pitch for pitch, *_ in own[:2]] == [1.25, 2.5] and len(own) > 5 and {pitch for pitch, *_ in own[2:]} == {1.5}
    )
    assert len(found) == len(own)
    for (pitch, *ends), (own_pitch, *own_ends) in zip(found, own):
        assert pitch == own_pitch
        for end, own_end in zip(ends, own_ends):
            assert end == pytest.approx((*place(*own_end[:2]), own_end[2]), abs=2e-4)  # rs274 prints 4 decimals


def test_a_thread_in_a_pattern_in_a_pattern():
    """Its K is not the K of the inner G75."""
    sub = [
        "o200 sub",
        "G0 X1",
        "G33 Z-5 K1.75",
        "G0 Z7",
        "o200 endsub",
        "o100 sub",
        "G0 X0",
        "G75 Q200 L2 K30",
        "o100 endsub",
    ]
    assert [pitch for pitch, *_ in threads(calls(program(["G75 Q100 X1"], sub)))] == [1.75, 1.75]


def test_a_thread_in_inch():
    sub = ["o100 sub", "G0 X1", "G20", "G33 Z-0.5 K0.05", "G21 G0 Z7", "o100 endsub"]
    assert threads(calls(program(["G75 Q100 X1"], sub)))[0][0] == pytest.approx(1.27)


@pytest.mark.parametrize(
    "line, words",
    [("G33 Z-5", "K word"), ("G18 G76 P1 Z-9 I-1 J0.1 K0.5 L2 E1", "G76 with L has tapered passes; leave L out")],
)
def test_threads_that_are_refused(line, words):
    trace = canon.run_preview(program(["G75 Q100"], ["o100 sub", "G0 X1", line, "G0 Z7", "o100 endsub"]))
    assert words in trace.error and "line 3 of program.ngc" in trace.error, trace.error


@pytest.mark.parametrize(
    "line, words",
    [
        ("G92 X0", "G92 changes an offset"),
        ("G53 G0 X1", "G53 moves in machine coordinates"),
        ("G43.1 Z2", "G43.1 changes an offset"),
        ("G95 F0.1", "G95 sets a mode"),
        ("M62 P1", "M62 is not allowed"),
    ],
)
def test_a_sub_that_the_sub_calls_is_looked_at_too(line, words):
    sub = ["o200 sub", "G1 X9", line, "o200 endsub", "o100 sub", "G0 X1", "o200 call", "G0 Z7", "o100 endsub"]
    trace = canon.run_preview(program(["G75 Q100"], sub))
    assert words in trace.error and "line 3 of program.ngc" in trace.error and not trace.after("begin"), trace.error
