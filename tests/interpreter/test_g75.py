# SPDX-License-Identifier: GPL-2.0-or-later
"""G75 through LinuxCNC's interpreter: a sub run as a pattern, against what the sub does by itself
(tests/support/pattern_oracle.py)."""

import json
import math
import random
import tempfile

import numpy as np
import pytest

from support import canon, pattern_oracle
from support.pattern_oracle import SUB, calls_to_moves, compare, moves_of, random_sub, transformed
from support.random_cases import random_count, random_seed

HEAD = "G90 G64 G94 G17 G40\nT1 M6\nS5000 M3\nF600\n"


def program(calls, sub=SUB, start="G0 X3 Y-4 Z7", unit="G21", before=""):
    """A program that calls the sub, or G75, between two comments."""
    return "\n".join([*sub, HEAD + unit, before, start, "(begin)", *calls, "(end)", "M2", ""])


def back(point, mirror, degrees, shift):
    """The point that becomes this one."""
    w = complex(point[0] - shift[0], point[1] - shift[1])
    w *= complex(math.cos(math.radians(-degrees)), math.sin(math.radians(-degrees)))
    return (-w.real if mirror in (1, 3) else w.real, -w.imag if mirror in (2, 3) else w.imag, point[2] - shift[2])


def plain(sub, start, unit="G21", scale=1.0):
    """Moves of the sub, called from a position."""
    where = "G0 " + " ".join(f"{letter}{value / scale:.9f}" for letter, value in zip("XYZ", start))
    return moves_of(program(["o100 call"], sub, where, unit))[0]


def random_words(r):
    """(words, mirror, degrees, shift) of one copy."""
    mirror = r.choice((0, 1, 2, 3))
    degrees = r.choice((0.0, 90.0, -180.0, 270.0, round(r.uniform(-400, 400), 4)))
    shift = tuple(round(r.uniform(-50, 50), 4) for _ in range(3))
    return (f"H{mirror} R{degrees:g} X{shift[0]} Y{shift[1]} Z{shift[2]}", mirror, float(f"{degrees:g}"), shift)


def arcs_stay(sub, degrees):
    return degrees % 90.0 == 0.0 or not any("G18" in text or "G19" in text for text in sub)


@pytest.mark.parametrize("case", range(random_count(24)))
def test_random_subs(case, tmp_path):
    seed = random_seed() + case
    r = random.Random(f"g75 {seed}")
    words, mirror, degrees, shift = random_words(r)
    sub = random_sub(seed, cycles=mirror in (0, 3))  # a cycle in a mirrored pattern plans the other hand
    if not arcs_stay(sub, degrees):
        words, degrees = words.replace(f"R{degrees:g}", "R90"), 90.0
    start = (3.0, -4.0, 7.0 + shift[2])
    text = program([f"G75 Q100 {words}"], sub, f"G0 X3 Y-4 Z{start[2]:.6f}")
    (tmp_path / "replay.ngc").write_text(text)
    try:
        found = moves_of(text)[0]
        compare(
            found, plain(sub, back(start, mirror, degrees, shift)), lambda p: transformed(p, mirror, degrees, shift)
        )
    except AssertionError as error:
        raise AssertionError(f"CHIPWISE_SEED={seed} {words}, {tmp_path / 'replay.ngc'}: {error}") from error


def test_compare_can_fail():
    found = moves_of(program(["G75 Q100 X5 R30"]))[0]
    own = plain(SUB, back((3, -4, 7), 0, 30, (5, 0, 0)))
    compare(found, own, lambda p: transformed(p, 0, 30, (5, 0, 0)))
    for wrong in ((0, 30.0001, (5, 0, 0)), (1, 30, (5, 0, 0)), (0, 30, (5, 0, 1e-5))):
        with pytest.raises(AssertionError):
            compare(found, own, lambda p, w=wrong: transformed(p, *w))


@pytest.mark.parametrize(
    "words, start, place_of",
    [
        (
            "X4 Y-3 H1 R10 L4 I30.5 J-7 K25",
            (3.0, -4.0, 7.0),
            lambda c: (1, 10.0 + c * 25, (4 + c * 30.5, -3 - c * 7.0, 0.0)),
        ),
        # the sub's first X, 10, is by chance that of the tool before the first and before the second copy
        ("L4 I40 J-1 K90", (10.0, -4.0, 7.0), lambda c: (0, 90.0 * c, (40.0 * c, -1.0 * c, 0.0))),
    ],
    ids=["any", "X by chance"],
)
def test_copies(words, start, place_of):
    """Copy c: rotated by R + c K, shifted by X + c I, Y + c J; each begins where the one before it has ended."""
    found = moves_of(program([f"G75 Q100 {words}"], start=f"G0 X{start[0]:g} Y{start[1]:g} Z{start[2]:g}"))[0]
    at, expected = start, []
    for c in range(4):
        place = place_of(c)
        moves = plain(SUB, back(at, *place))
        for move in moves:
            move.points = transformed(move.points, *place)
        expected += moves
        at = expected[-1].points[-1]
    compare(found, expected, lambda p: p)


@pytest.mark.parametrize("first", ["G0 X10", "G91 G0 X2 Y1\nG90", "G0 Z6\nG0 Y4"])
def test_a_start_that_is_inherited(first):
    """A coordinate that the sub leaves alone is that of the tool, in every copy."""
    sub = ["o100 sub", *first.split("\n"), "G1 Z-1", "G3 I2 J1", "G0 Z7", "o100 endsub"]
    found = moves_of(program(["G75 Q100 R30 L3 K40 I5"], sub))[0]
    at, expected = (3.0, -4.0, 7.0), []
    for c in range(3):
        place = 0, 30.0 + 40 * c, (5.0 * c, 0.0, 0.0)
        moves = plain(sub, back(at, *place))
        for move in moves:
            move.points = transformed(move.points, *place)
        expected += moves
        at = expected[-1].points[-1]
    compare(found, expected, lambda p: p)


@pytest.mark.parametrize("machine", ["mm", "in"])
@pytest.mark.parametrize("unit", ["G21", "G20"])
def test_units_of_machine_and_program(machine, unit):
    scale = 25.4 if unit == "G20" else 1.0
    found = moves_of(program(["G75 Q100 X2.5 Y-1 R33 H2"], SUB, "G0 X3 Y-4 Z7", unit), machine=machine)[0]
    shift = (2.5 * scale, -scale, 0.0)
    expected = plain(SUB, back((3 * scale, -4 * scale, 7 * scale), 2, 33, shift), unit, scale)
    compare(found, expected, lambda p: transformed(p, 2, 33, shift))


def test_g91_counts_the_shift_from_the_tool():
    found = moves_of(
        program(["G91", "G75 Q100 X2 Y1", "G90"], ["o100 sub", "G90 G0 X1 Y1", "G1 Z-1", "G0 Z7", "o100 endsub"])
    )[0]
    assert found[0].points[-1] == pytest.approx((3 + 2 + 1, -4 + 1 + 1, 7))


def test_offsets_and_rotation():
    """G54 with R and G92: the pattern lies in work coordinates."""
    before = "G10 L2 P1 X11 Y-5 Z2 R17\nG92 X1 Y2"
    found, trace = moves_of(program(["G75 Q100 X4 R20 H1"], before=before, start="G92.1\nG92 X1 Y2 Z0\nG0 X3 Y-4 Z7"))
    assert not trace.error
    own = moves_of(program(["G75 Q100 X4 R20 H1"]))[0]
    calls = json.loads(trace.output.splitlines()[-1])["calls"]
    compare(calls_to_moves(calls), own, lambda p: p)  # the canonical calls are in work coordinates


def test_planes_under_an_odd_angle_become_chords():
    sub = [
        "o100 sub",
        "G0 X10 Y0",
        "G0 Z2",
        "G1 Z0",
        "G18 G2 X30 Z0 I10 K0",
        "G19 G3 Y20 Z0 J10 K0",
        "G17 G0 Z7",
        "o100 endsub",
    ]
    quarter = moves_of(program(["G75 Q100 R90"], sub))[0]
    assert [m.kind for m in quarter] == ["rapid", "rapid", "feed", "arc", "arc", "rapid"] and [
        m.plane for m in quarter
    ][3:5] == [2, 3]
    found = moves_of(program(["G75 Q100 R20"], sub))[0]
    points = np.array([m.points[-1] for m in found if m.kind == "feed"][1:])
    unturned = transformed(points, 0, -20, (0, 0, 0))
    first = unturned[unturned[:, 0] < 30 - 1e-9]
    assert np.allclose(np.hypot(first[:, 0] - 20, first[:, 2]), 10, atol=1e-6) and np.allclose(
        first[:, 1], 0, atol=1e-6
    )
    corners = np.vstack([[(10, 0, 0)], first, [(30, 0, 0)]])
    sag = 10 - np.hypot(*((corners[1:, k] + corners[:-1, k]) / 2 - centre for k, centre in ((0, 20), (2, 0))))
    assert 0.001 < sag.max() <= 0.002 + 1e-9 and len(first) > 60


@pytest.mark.parametrize("cycle, ccw", [("G12", False), ("G13", True)])
@pytest.mark.parametrize("mirror, keeps", [(0, True), (1, True), (2, True), (3, True)])
def test_holes_keep_their_hand(cycle, ccw, mirror, keeps):
    """A mirrored climb cut would be a conventional one."""
    sub = ["o100 sub", "G0 X10 Y5 Z5", f"{cycle} I5 Z-2 R1 F300", "o100 endsub"]
    trace = moves_of(program([f"G75 Q100 H{mirror}"], sub))[1]
    turned = {e.ccw for e in trace.between("begin", "end") if e.kind == "arc"}
    assert ccw in turned if keeps else ccw not in turned
    plainly = moves_of(program(["o100 call"], sub))[1].between("begin", "end")
    assert sum(e.ccw == ccw for e in trace.between("begin", "end") if e.kind == "arc") == sum(
        e.ccw == ccw for e in plainly if e.kind == "arc"
    )


SQUARE = ["o300 sub", "G0 X0 Y0", "G1 X30", "G1 Y20", "G1 X0", "G1 Y0", "o300 endsub"]


def area(elements, depth):
    """Signed area (mm2) of the closed path at the final depth; positive for counter-clockwise."""
    points = [e.a for e in elements if e.kind != "rapid" and e.a[2] == e.b[2] == depth]
    return sum(p[0] * q[1] - q[0] * p[1] for p, q in zip(points, points[1:] + points[:1])) / 2


@pytest.mark.parametrize("side", [41, 42])
@pytest.mark.parametrize("mirror", [1, 2, 3])
def test_contours_keep_their_hand(side, mirror):
    """The finished contour lies mirrored, and is cut in the direction in which the plain one is."""
    sub = [*SQUARE, "o100 sub", "G0 X-10 Y-10 Z5", f"G78 Q300 P{side} Z-3 R2 F300 H0", "o100 endsub"]
    found = moves_of(program([f"G75 Q100 H{mirror}"], sub))[1].between("begin", "end")
    own = moves_of(program(["o100 call"], sub))[1].between("begin", "end")
    assert area(found, -3.0) == pytest.approx(area(own, -3.0), abs=1e-3) and abs(area(own, -3.0)) > 300
    xs, ys = ([e.b[k] for e in found if e.kind != "rapid" and e.b[2] == -3.0] for k in (0, 1))
    assert (max(xs) < 15) == (mirror in (1, 3)) and (max(ys) < 10) == (mirror in (2, 3))


def test_codes_keep_their_places():
    """Spindle, coolant and dwell of the sub, in every copy; the sub's own line numbers."""
    sub = [
        "o100 sub",
        "G0 X1",
        "S900 M4",
        "M8",
        "G1 Z-1 M7",
        "G4 P0.25",
        "G1 X5",
        "M9",
        "G0 Z7 M3 S5000",
        "o100 endsub",
    ]
    trace = moves_of(program(["G75 Q100 L2 I10"], sub))[1]
    calls = json.loads(trace.output.splitlines()[-1])["calls"]
    begin = next(k for k, c in enumerate(calls) if c[0] == "comment" and c[2] == "begin")
    inside = [c for c in calls[begin:] if c[0] in ("rapid", "feed", "dwell")]
    assert [c[0] for c in inside] == ["rapid", "feed", "dwell", "feed", "rapid"] * 2
    assert [c[1] for c in inside] == [2, 5, 6, 7, 9] * 2
    run = canon.run_rs274(program(["G75 Q100 L2 I10"], sub)).output
    once = (
        "STRAIGHT_TRAVERSE SET_SPINDLE_SPEED START_SPINDLE_COUNTER FLOOD_ON MIST_ON STRAIGHT_FEED DWELL STRAIGHT_FEED "
        "FLOOD_OFF SET_SPINDLE_SPEED START_SPINDLE_CLOCK STRAIGHT_TRAVERSE"
    ).split()
    order = [name for line in run.splitlines() for name in set(once) if name in line]
    assert order[-24:] == once * 2


def test_modes_afterwards():
    """Whatever the sub sets ends with it."""
    sub = [
        "o100 sub",
        "G91 G20 G18 G0 X0.1",
        "G90 G21 G17",
        "G91.1 G99",
        "G0 X4 Y4",
        "G18 G91 G1 X2 F77",
        "o100 endsub",
    ]
    for before in ("G90 G21", "G91 G20"):
        text = program(["(before)", "G75 Q100 X3", "(after)"], sub, before=before + "\nG1 F300")
        trace = moves_of(text)[1]
        assert trace.modes("before") == trace.modes("after")


def test_patterns_in_patterns():
    """Two levels: the outer one's transformation after the inner one's."""
    sub = [*SUB, "o400 sub", "G75 Q100 X30 R20", "G0 X0 Y0", "o400 endsub"]
    found = moves_of(program(["G75 Q400 Y10 H1"], sub, "G0 X3 Y14 Z7"))[0]
    first = plain(SUB, back(back((3, 14, 7), 1, 0, (0, 10, 0)), 0, 20, (30, 0, 0)))
    compare(found[:-1], first, lambda p: transformed(transformed(p, 0, 20, (30, 0, 0)), 1, 0, (0, 10, 0)))
    assert found[-1].points[-1] == pytest.approx((0, 10, 5))


def test_the_flutes_and_the_stock_of_the_caller_count():
    """A cycle without J: the passes are those of a call at the pattern's place."""
    sub = ["o100 sub", "G0 X10 Y5", "G13 I5 Z-8 R20 F300", "o100 endsub"]
    stock, tools = "T2 M6\nM250 P-20 Q-20 R-10 I50 J50 K10\n", {1: 2.0, 2: 3.0}
    for up, before in ((0, stock), (3, stock), (0, "T2 M6\n")):
        lifted = [line.replace("Z-8 R20", f"Z{-8 + up} R{20 + up}") for line in sub]
        found = moves_of(program([f"G75 Q100 Z{up}"], sub, "G0 X3 Y-4 Z30", before=before), tools=tools)[0]
        own = moves_of(program(["o100 call"], lifted, "G0 X3 Y-4 Z30", before=before), tools=tools)[0]
        compare(found, own, lambda p: p)
    assert len(own) > len(moves_of(program(["o100 call"], sub, "G0 X3 Y-4 Z30", before=stock), tools=tools)[0])


def test_a_pattern_of_itself_ends():
    trace = canon.run_preview(
        program(["G75 Q100"], ["o100 sub", "G0 X1", "G75 Q100 X1", "o100 endsub"]), timeout=300
    )  # 17 processes
    assert "sub O100 is called by patterns more than 8 deep; see whether it calls itself" in trace.error


def test_a_sub_that_does_not_end():
    """The planner is lent less computing time than the sub may take; its process has a limit of its own."""
    trace = canon.run_preview(
        program(["G75 Q100"], ["o100 sub", "G0 X1", "o101 while [1]", "o101 endwhile", "o100 endsub"]), timeout=300
    )
    assert (
        "the sub does not end within 5 s of computing time (loops and calls: line 3); correct the loop's condition"
        in trace.error
    ), trace.error


BAD = [
    ("G75", "word Q (number of the sub"),
    ("G75 Q7", "there is no sub O7"),
    ("G75 Q100 L0", "L0 is not a number of copies"),
    ("G75 Q100 H4", "H4 is not a mirror"),
    ("G75 Q100 P3", "station P3 is not taught"),
    ("G75 Q100 I5", "I, J and K are for more than one copy"),
    ("G75 Q100 D5", "word D is not used here"),
    ("G18\nG75 Q100", "the plane is not G17"),
    ("G93\nG75 Q100 F5", "inverse time feed (G93) is on"),
]


@pytest.mark.parametrize("line, message", BAD)
def test_refused_words(line, message):
    trace = canon.run_preview(program([line]))
    assert message in trace.error and not trace.after("begin"), trace.error


BAD_LINES = [
    ("G28", "G28 moves in machine coordinates"),
    ("G53 G0 X1", "G53 moves in machine coordinates"),
    ("G10 L2 P1 X0", "G10 changes an offset"),
    ("G92 X0", "G92 changes an offset"),
    ("G55", "G55 changes an offset"),
    ("G43 H1", "G43 changes an offset"),
    ("G38.2 Z-5 F10", "G38.2 probes"),
    ("G33.1 Z-5 K1", "G33.1 taps in step with the spindle"),
    ("G84 Z-9 R1", "G84 taps in step"),
    ("G74 Z-9 R1", "G74 taps in step"),
    ("G95", "G95 sets a mode"),
    ("G64 P0.1 (msg, fast)", "G64 is on a line with a message; put it on a line of its own"),
    ("M101", "M101 is not allowed in a pattern"),
    ("M62 P1", "M62 is not allowed"),
    ("M6 T1", "M6 is not allowed"),
    ("M250", "M250 is not allowed"),
    ("G0 X#5420", "#5420 reads the machine"),
    ("G0 X#<_abs_x>", "#<_abs_x> reads the machine"),
    ("G0 X#<_hal[motion.analog-in-00]>", "reads the machine"),
    ("G[50 + 3] G0 X1", "is a code that only the machine knows"),
    ("M2", "M2 is not allowed"),
    ("G0 X[1/0]", "divide by zero"),
    ("o200 call", "the sub O200 that it calls is missing; write it from O200 sub"),
    ("M98 P200", "the sub O200 that it calls is missing"),
    ("G1 X5 QQ", "line 3 of program.ngc"),
    ("G13 I99 Z-1 K3 F100", "G13: "),
]


@pytest.mark.parametrize("line, message", BAD_LINES)
def test_refused_subs(line, message):
    """The sub's line and the reason; nothing moves."""
    trace = canon.run_preview(program(["G75 Q100"], ["o100 sub", "G0 X1 Y1", line, "o100 endsub"]))
    assert message in trace.error and "sub O100, line 3 of program.ngc" in trace.error, trace.error
    assert not trace.after("begin")


def test_an_error_in_the_first_line_of_a_sub():
    """It has the line of the sub, not that of the call."""
    trace = canon.run_preview(program(["G75 Q100"], ["o100 sub", "(a comment)", "G0 X#<_nowhere>", "o100 endsub"]))
    assert "sub O100, line 3 of program.ngc: Named parameter #<_nowhere> not defined" in trace.error, trace.error


def test_a_folder_of_any_name(tmp_path, monkeypatch):
    """Program, and all that its processes write, in a folder with blanks, brackets and characters beyond ASCII."""
    folder = tmp_path / "Teile (neu) #1 %s für Öl"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    found, expected = moves_of(program(["G75 Q100 X5 R30 L2 I40"]))[0], plain(SUB, back((3, -4, 7), 0, 30, (5, 0, 0)))
    assert len(found) == 2 * len(expected)
    compare(found[: len(expected)], expected, lambda p: transformed(p, 0, 30, (5, 0, 0)))


def test_copies_that_would_cut_to_each_other():
    cut_first = ["o100 sub", "G1 X5 F100", "G0 Z7", "o100 endsub"]
    assert not canon.run_preview(program(["G75 Q100"], cut_first)).error
    assert "copy 2 begins with a cut: line 2" in canon.run_preview(program(["G75 Q100 L2 I9"], cut_first)).error
    low = ["o100 sub", "G0 X5 Y5", "G1 Z-3 F100", "o100 endsub"]
    assert (
        "the sub ends at Z-3 mm of the pattern, no higher than its cuts at Z-3 mm"
        in canon.run_preview(program(["G75 Q100 L2 I9"], low)).error
    )
    lifted = ["o100 sub", "G0 Z7", "G0 X5 Y5", "G1 Z-3 F100", "o100 endsub"]
    assert not canon.run_preview(program(["G75 Q100 L2 I9"], lifted)).error


def said(text):
    """The package's messages in a run."""
    return [
        line
        for line in canon.run_rs274(text).output.splitlines()
        if "are mirrored, climb cuts become conventional" in line
    ]


def test_mirrored_cuts_of_the_sub_itself_are_named():
    """A control that mirrors makes a climb cut conventional; the operator hears of it.  Cycles keep their hand, so
    nothing is said of them."""
    hole = ["o100 sub", "G0 X10 Y5 Z5", "G13 I5 Z-2 R1 F300", "o100 endsub"]
    assert said(program(["G75 Q100 H1"])) and "line 5 of the sub" in said(program(["G75 Q100 H1"]))[0]
    assert (
        not said(program(["G75 Q100 H3"]))
        and not said(program(["G75 Q100 R180"]))
        and not said(program(["G75 Q100 H1"], hole))
    )


def test_named_parameters_reach_the_sub():
    sub = ["o100 sub", "G0 X#<_odd> Y#31", "G1 Z-1 F100", "o100 endsub"]
    found = moves_of(program(["#<_odd> = 4.25", "#31 = 2.5", "G75 Q100 X10"], sub))[0]
    assert found[0].points[-1] == pytest.approx((14.25, 2.5, 7))


def test_oracle_sees_the_planes():
    assert {
        move.plane
        for move in plain(
            ["o100 sub", "G0 X1", "G18 G2 X5 Z7 I2 K0", "G19 G2 Y-2 Z7 J-1 K0", "G17 G2 X7 Y-2 I1 J0", "o100 endsub"],
            (0, 0, 7),
        )
        if move.kind == "arc"
    } == {1, 2, 3}
    assert pattern_oracle.SHARES[-1] == 1.0
