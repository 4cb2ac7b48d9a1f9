# SPDX-License-Identifier: GPL-2.0-or-later
"""G75 with #<_chipwise_keep_climb>: closed chains of a mirrored sub run backwards (tests/support/climb_oracle.py
measures the climb)."""

import re

import numpy as np
import pytest

from support import canon, climb_oracle, pattern_oracle
from support.pattern_oracle import moves_of
from support.random_cases import random_count, random_seed

HEAD = "G90 G64 G94 G17 G40 G21\nT1 M6\nS5000 M3\nF600\n"
KEEP = "#<_chipwise_keep_climb> = 1\n"
RADIUS, START = 1.0, (3.0, -4.0, 7.0)
RING = [
    "o100 sub",
    "G0 X0 Y0",
    "G0 Z2",
    "G1 Z-1 F100",
    "G1 X5 F300",
    "G3 X0 Y5 I-5 J0",
    "G1 Y0",
    "G0 Z7",
    "o100 endsub",
]


def program(call, sub, before=KEEP, start=START):
    where = "G0 " + " ".join(f"{letter}{value:.6f}" for letter, value in zip("XYZ", start))
    return "\n".join([*sub, HEAD + before + where, "(begin)", call, "(end)", "M2", ""])


def flipped(start, mirror):
    return (-start[0] if mirror == 1 else start[0], -start[1] if mirror == 2 else start[1], start[2])


@pytest.fixture(autouse=True)
def fine_arcs(monkeypatch):
    monkeypatch.setattr(pattern_oracle, "SHARES", np.linspace(0.0, 1.0, 33)[1:])


def cut(call, sub, before, start):
    return climb_oracle.cut(moves_of(program(call, sub, before, start))[0], start, climb_oracle.disc(9.5), RADIUS)


@pytest.mark.parametrize("case", range(random_count(4)))
def test_the_climb_share_and_the_part(case, tmp_path):
    """Mirrored with it: the share of the plain sub, the mirrored stock and its volume.  Without it: the other share."""
    seed, mirror = random_seed() + case, 1 + case % 2
    sub = climb_oracle.random_profile(seed)
    (tmp_path / "replay.ngc").write_text(program(f"G75 Q100 H{mirror}", sub))
    where = f"CHIPWISE_SEED={seed} H{mirror}, {tmp_path / 'replay.ngc'}"
    share, volume, heights = cut("o100 call", sub, "", START)
    kept = cut(f"G75 Q100 H{mirror}", sub, KEEP, flipped(START, mirror))
    lost = cut(f"G75 Q100 H{mirror}", sub, "", flipped(START, mirror))
    assert volume > 50, where
    assert kept[0] == pytest.approx(share, abs=0.04) and lost[0] == pytest.approx(1 - share, abs=0.04), where
    assert kept[1] == pytest.approx(volume, rel=0.01), where
    image = np.flip(heights, 2 - mirror)
    assert (np.abs(kept[2] - image) > 1e-6).mean() < 2e-4, where  # rounding at the rim of the tool


def test_the_share_is_one_or_the_other():
    """A ring round a blank, 0.5 mm in: all climb, all conventional when mirrored, all climb again."""
    sub = ["o100 sub", "G0 X15 Y0", "G0 Z2", "G1 Z-2 F100", "X10 F300", "G2 I-10", "G1 X15", "G0 Z7", "o100 endsub"]
    assert cut("o100 call", sub, "", START)[0] > 0.9 and cut("G75 Q100 H1", sub, "", START)[0] < 0.1
    assert cut("G75 Q100 H1", sub, KEEP, START)[0] > 0.9


def path(text):
    return [(move.kind, *np.round(move.points[-1], 6) + 0.0) for move in moves_of(text)[0]]


def test_what_is_emitted():
    """The plunge and its place stay; each element runs from its end to its beginning; lines are those of the
    element."""
    assert path(program("G75 Q100 H1", RING)) == [
        ("rapid", 0, 0, 7),
        ("rapid", 0, 0, 2),
        ("feed", 0, 0, -1),
        ("feed", 0, 5, -1),
        ("arc", -5, 0, -1),
        ("feed", 0, 0, -1),
        ("rapid", 0, 0, 7),
    ]
    moves = moves_of(program("G75 Q100 H1", RING))[0]
    assert [move.line for move in moves] == [2, 3, 4, 7, 6, 5, 8]
    assert np.allclose(np.hypot(*moves[4].points[:, :2].T), 5) and (moves[4].points[:, 0] < 1e-9).all()


@pytest.mark.parametrize("call", ["G75 Q100", "G75 Q100 H3", "G75 Q100 R90"])
def test_what_is_not_mirrored_is_not_reversed(call):
    assert path(program(call, RING)) == path(program(call, RING, ""))


def test_the_setting_of_the_machine():
    assert path(program("G75 Q100 H1", RING)) != path(program("G75 Q100 H1", RING, ""))
    found = moves_of(program("G75 Q100 H1", RING, ""), KEEP_CLIMB="yes")[0]
    assert [tuple(m.points[-1]) for m in found] == [
        tuple(m.points[-1]) for m in moves_of(program("G75 Q100 H1", RING))[0]
    ]
    off = moves_of(program("G75 Q100 H1", RING, "#<_chipwise_keep_climb> = 0\n"), KEEP_CLIMB="yes")[0]
    assert [tuple(m.points[-1]) for m in off] == [
        tuple(m.points[-1]) for m in moves_of(program("G75 Q100 H1", RING, ""))[0]
    ]


def said(text):
    return [line for line in canon.run_rs274(text).output.splitlines() if "climb cuts become conventional" in line]


LEFT = [
    (["G1 X5 F300", "G1 Y5"], "lines 5-6 (open)"),
    (["G1 X5 Z-2 F300", "G1 Y5 Z-3", "G1 X0 Y0 Z-1"], "lines 5-7 (changes Z)"),
    (["G3 X0 Y0 I2 J0 Z-3 F300"], "lines 5 (changes Z)"),
    (["G18 G3 X4 I2 K0 F300", "G17"], "lines 5 (changes Z)"),
    (["G1 X5 F300", "G1 Y5 F200", "G1 X0 Y0"], "lines 5-7 (two feeds)"),
    (["G33 X5 K1", "G1 Y5 F300", "G1 X0 Y0"], "lines 5 (in step with the spindle), 6-7 (open)"),
    (["G1 X5 F300", "M8", "G1 Y5", "G1 X0 Y0"], "lines 5 (open), 7-8 (open)"),
    (["G1 X5 F300", "G4 P0.1", "G1 X0"], "lines 5 (open), 7 (open)"),
]


@pytest.mark.parametrize("body, words", LEFT)
def test_what_cannot_be_reversed_is_left_and_named(body, words):
    sub = [*RING[:4], *body, "G0 Z7", "o100 endsub"]
    text = program("G75 Q100 H1", sub)
    assert path(text) == path(program("G75 Q100 H1", sub, ""))
    assert said(text) and words + " of the sub are mirrored and not reversed" in said(text)[0]


def test_many_of_them_are_one_message():
    body = [line for k in range(9) for line in (f"G0 X{k}", "G1 Y1 F300", "G0 Y0")]
    found = said(program("G75 Q100 H1", [*RING[:4], *body, "G0 Z7", "o100 endsub"]))
    assert len(found) == 1 and found[0].count("(open)") == 5 and "and 4 more" in found[0]


def test_after_a_ramp_the_closed_level_part_is_reversed():
    sub = [*RING[:3], "G1 X5 Z-1 F300", "G1 Y5", "G1 X0", "G1 X5 Y0", "G0 Z7", "o100 endsub"]
    assert path(program("G75 Q100 H1", sub))[2:6] == [
        ("feed", -5, 0, -1),
        ("feed", 0, 5, -1),
        ("feed", -5, 5, -1),
        ("feed", -5, 0, -1),
    ]
    assert "lines 4 (changes Z) of the sub" in said(program("G75 Q100 H1", sub))[0]


@pytest.mark.parametrize("gap, closed", [(0.004, True), (0.009, True), (0.02, False)])
def test_a_gap_of_micrometres(gap, closed):
    """Within CLOSE_GAP: the tool goes over it, and is in the end where the sub leaves it."""
    sub = [*RING[:6], f"G1 X0 Y{gap}", *RING[7:]]
    found = path(program("G75 Q100 H1", sub))
    assert bool(said(program("G75 Q100 H1", sub))) != closed
    assert found[-1] == ("rapid", 0, gap, 7) and found[-2] == ("feed", 0, gap, -1)
    assert (found[3] == ("feed", 0, gap, -1)) == closed


def test_cycles_and_patterns_inside():
    """A cycle plans the other hand already; a pattern in a pattern reverses by what becomes of it in the end."""
    hole = ["o100 sub", "G0 X10 Y5 Z5", "G13 I5 Z-2 R1 F300", "o100 endsub"]
    assert path(program("G75 Q100 H1", hole)) == path(program("G75 Q100 H1", hole, ""))
    inner = [*RING, "o400 sub", "G75 Q100 {}", "G0 Z7", "o400 endsub"]
    for outer, words, reverses in (("H1", "", True), ("H1", "H1", False), ("", "H1", True), ("H2", "H1", False)):
        sub = [line.format(words) for line in inner]
        kept, plain = (path(program(f"G75 Q400 {outer}", sub, before)) for before in (KEEP, ""))
        assert (kept != plain) == reverses, (outer, words)
        assert bool(said(program(f"G75 Q400 {outer}", sub, ""))) == reverses and not said(
            program(f"G75 Q400 {outer}", sub)
        ), (outer, words)


def test_copies_and_compensation():
    sub = [
        "o100 sub",
        "G0 X-9 Y0",
        "G0 Z-1",
        "G42.1 D2 G1 X-5 F300",
        "G1 Y5",
        "X5",
        "Y-5",
        "X-5",
        "Y0",
        "G40 G1 X-9",
        "G0 Z7",
        "o100 endsub",
    ]
    text = program("G75 Q100 H1 L3 I30 K15", sub)
    assert len(path(text)) == len(path(program("G75 Q100 H1 L3 I30 K15", sub, ""))) and path(text) != path(
        program("G75 Q100 H1 L3 I30 K15", sub, "")
    )
    assert not said(text)


def test_inch():
    text = program("G75 Q100 H1", ["o100 sub", "G20", *RING[1:-1], "o100 endsub"], start=(3, -4, 30))
    assert [move.line for move in moves_of(text, machine="in")[0]][3:6] == [8, 7, 6]


@pytest.mark.parametrize("value", ["2", "-1", "0.5"])
def test_refused(value):
    trace = canon.run_preview(program("G75 Q100 H1", RING, f"#<_chipwise_keep_climb> = {value}\n"))
    assert re.search(rf"_chipwise_keep_climb> = {value} is neither 0 nor 1", trace.error) and not trace.after("begin")
