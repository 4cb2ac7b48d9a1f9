# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise rewrite --feed: F = UQ x LC / VC (JP3131045) written into programs, the path unchanged."""

import math
import re

import numpy as np
import pytest

from chipwise.program.reader import Machine
from chipwise.rewrite import read_back
from chipwise.rewrite import feed
from chipwise.rewrite.program import read
from support.rewrite_rig import HEAD, make_machine, rewrite

STOCK = "M250 P0 Q0 R-40 I100 J60 K40\n"
SLOT = HEAD + STOCK + "T3 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG0 Z-2\nN50 G1 X110 F400 (the slot)\nG0 Z5\nM2\n"


def rewritten(tmp_path, machine, text, *options):
    """-> (Program before, Program after, text after)."""
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(text)
    done = rewrite(before, after, machine, *options)
    assert done.status == 0, done.errors
    reader = Machine(str(machine))
    return read(str(before), reader), read(str(after), reader), after.read_text()


def feed_at(program, x):
    """F of the feed move along X that covers a place."""
    for move in np.flatnonzero(program.kind != 0).tolist():
        a, b = sorted((program.start(move)[0], program.end[move][0]))
        if a < x < b:
            return program.feed[move]
    raise AssertionError(x)


def test_the_law_in_a_slot(tmp_path, machine):
    """10 mm wide, 2 mm deep: F = Q / 20 mm2; in the air the programmed F stays."""
    one, two, text = rewritten(tmp_path, machine, SLOT, "--feed", "12")
    read_back.same_path(one, two)
    assert feed_at(two, 50) == pytest.approx(12000 / 20, rel=0.015)
    assert feed_at(two, -8) == feed_at(two, 108) == 400
    assert "N50 G1 X110 F400  the slot" in text  # as a comment above its parts
    assert text.startswith(HEAD + STOCK) and text.endswith("G0 Z5\nM2\n")


def test_between_two_bounds_f_is_kept(tmp_path, machine):
    """[0013]: F400 in this slot is 8 cm3/min."""
    one, two, text = rewritten(tmp_path, machine, SLOT, "--feed", "9", "--lower", "7")
    assert feed_at(two, 50) == 400
    assert "F400" in text
    _, two, _ = rewritten(tmp_path, machine, SLOT, "--feed", "20", "--lower", "10")
    assert feed_at(two, 50) == pytest.approx(10000 / 20, rel=0.03)  # the nearest to F whose rate lies between
    _, two, _ = rewritten(tmp_path, machine, SLOT, "--feed", "5", "--lower", "1")
    assert feed_at(two, 50) == pytest.approx(5000 / 20, rel=0.03)


def test_nothing_to_change_keeps_every_byte(tmp_path, machine):
    text = SLOT.replace("G0 X-10", "G0 X-4").replace("\nM2\n", "\r\nM2").replace("X110", "X-3.5")
    one, two, after = rewritten(tmp_path, machine, text, "--feed", "9", "--lower", "0.1")
    assert (tmp_path / "b.ngc").read_bytes() == (tmp_path / "a.ngc").read_bytes()


def test_ceiling_and_tool_limit(tmp_path, machine):
    text = SLOT.replace("Z-2", "Z-0.05")
    _, two, _ = rewritten(tmp_path, machine, text, "--feed", "12", "--ceiling", "700")
    assert two.feed[two.kind != 0].max() == 700
    _, two, _ = rewritten(tmp_path, machine, text, "--feed", "1000")
    assert two.feed[two.kind != 0].max() <= 100 * 60 + 1  # MAX_VELOCITY of the machine's axes
    tools = (
        (machine.parent / "tools.toml").read_text().replace("flute_length = 100", "flute_length = 100\nmax_rate = 4")
    )
    limited = make_machine(tmp_path / "limited", tools=tools)
    _, two, _ = rewritten(tmp_path, limited, SLOT, "--feed", "12")
    assert feed_at(two, 50) == pytest.approx(4000 / 20, rel=0.03)


def test_arcs_are_divided_as_arcs_and_modes_are_kept(tmp_path, machine):
    body = (
        "T3 M6\nS8000 M3\nG0 X-10 Y10 Z5\nG0 Z-1\nG1 X20 F500\nG2 X40 Y30 R20\nG91 G3 X20 Y-20 I20 J0\nG90 G1 X110\n"
        "G0 Z5\n"
        "G0 X110 Y10\nZ-1\nG90.1 G2 X60 Y30 I85 J20\nG91.1 G18 G0 X20 Z2\nG1 Z-1 F300\nG2 X40 I10 K0\nG17 G0 Z5\nM2\n"
    )
    one, two, text = rewritten(tmp_path, machine, HEAD + STOCK + body, "--feed", "6", "--lower", "2")
    read_back.same_path(one, two)
    chords = [line for line in text.splitlines() if re.match(r"G[23] ", line)]
    assert len(chords) > 8
    arcs = (one.kind == 2).sum(), (two.kind == 2).sum()
    assert arcs[1] >= arcs[0]  # none became straight lines


def test_inch_g91_cycles_and_lone_words(tmp_path, machine):
    body = (
        "T3 M6\nS8000 M3\nG0 X10 Y10 Z5\nG81 X20 Y50 Z-5 R2 F100\nX40\nX60 (third)\nG80\nG20\nG1 X1 Y1 Z0.1 F30\n"
        "Z-0.1\nX2\nG91 X0.5\nY0.2\nG90 G21\nF500\nX90\nG0 Z5\nM2\n"
    )
    one, two, text = rewritten(tmp_path, machine, HEAD + STOCK + body, "--feed", "3")
    read_back.same_path(one, two)
    rate(two, 3000)
    assert "G80" in text and text.count("chipwise: ") >= 4


def rate(program, most):
    """The needles' own volume, move by move, never above the rate by more than the model's error."""
    from support.check_oracle import Needles

    stock = next(event for event in program.events if len(event.values) >= 8 and event.kind == 4)
    needles, worst = Needles(stock.values[2:5], stock.values[5:8], 0.1), 0.0
    for move in range(len(program.kind)):
        before = needles.volume()
        start, end = program.start(move), program.end[move]
        needles.move((10.0, 0.0, 0.0), start, end, (0.004,))
        length = math.dist(start, end)
        if program.kind[move] != 0 and length > 2.0:
            worst = max(worst, (before - needles.volume()) / length * program.feed[move])
    assert worst <= 1.06 * most, worst


def test_a_loop_is_written_out_and_a_contour_sub_is_not(tmp_path, machine):
    loop = (
        HEAD + STOCK + "T3 M6\nS8000 M3\no1 repeat [2]\nG0 X-10 Y30 Z5\nG0 Z-2\nG1 X110 F400\nG0 Z5\no1 endrepeat\nM2\n"
    )
    one, two, after_text = rewritten(tmp_path, machine, loop, "--feed", "3")
    read_back.same_path(one, two)
    assert "(chipwise: written out: o1 repeat [2])" in after_text and "\no1" not in after_text
    across = [
        m
        for m in np.flatnonzero(two.kind != 0).tolist()
        if min(two.start(m)[0], two.end[m][0]) < 50 < max(two.start(m)[0], two.end[m][0])
    ]
    assert two.feed[across].tolist() == [pytest.approx(3000 / 20, rel=0.015), 400]  # the second time in the air
    text = (
        HEAD + STOCK + "T1 M6\nS8000 M3\no7 sub\nG0 X20 Y20\nG1 X60\nY45\nX20\nY20\no7 endsub\nG0 X0 Y0 Z5\n"
        "G79 Q7 Z-2 R1 D2 F600\nG0 Z5\nM2\n"
    )
    one, two, after_text = rewritten(tmp_path, machine, text, "--feed", "4")
    read_back.same_path(one, two)
    assert "(chipwise: divided: G79 Q7" in after_text


def test_comments_that_do_something_stay(tmp_path, machine):
    text = SLOT.replace("(the slot)", "(MSG, the slot) " + "(x" + 200 * "y" + ")")
    _one, _two, after = rewritten(tmp_path, machine, text, "--feed", "12")
    assert "\n(MSG, the slot)\n" in after and max(map(len, after.splitlines())) < 200


def test_grouped():
    groups, last = feed.grouped(np.array([100.0, 101, 102]))
    assert groups == [(3, last)] and last == pytest.approx(3 / (1 / 100 + 1 / 101 + 1 / 102))
    assert feed.grouped(np.array([100.0, 101, 102]), own=100.5) == ([(3, 100.5)], 100.5)
    assert feed.grouped(np.array([100.0, 200, 200])) == ([(1, 100.0), (2, 200.0)], 200.0)
    assert feed.grouped(np.array([102.0, 102.0]), 100.0) == ([(2, 100.0)], 100.0)  # not too fast, hardly too slow: kept
    assert feed.grouped(np.array([99.0]), 100.0) == ([(1, 99.0)], 99.0)


def test_the_proof_sees_another_path(tmp_path, machine):
    one, two, _ = rewritten(tmp_path, machine, SLOT, "--feed", "12")
    for change in (lambda p: p.end.__setitem__((1, 0), p.end[1, 0]), lambda p: p.end.__iadd__(0.0)):
        change(two)
        read_back.same_path(one, two)
    last = len(two.end) - 2
    for axis, off in ((0, 0.01), (1, -0.002), (2, 0.5)):
        two.end[last, axis] += off
        with pytest.raises(read_back.Different):
            read_back.same_path(one, two)
        two.end[last, axis] -= off


@pytest.mark.parametrize("plane, words", [("G17", "X110 Y30 Z-2 I{0} J{1}"), ("G18", "X110 Y30 Z-2 I{0} K{1}")])
def test_a_wide_arc_is_divided_on_the_arc(tmp_path, machine, plane, words):
    """Its chords are longer than the pieces: their middles are 2 um off it."""
    text = SLOT.replace(
        "N50 G1 X110 F400 (the slot)", f"{plane}\n{'G2' if plane == 'G17' else 'G3'} {words.format(60, -300)} F400\nG17"
    )
    one, two, out = rewritten(tmp_path, machine, text, "--feed", "12")
    read_back.same_path(one, two)
    arcs = two.end[two.kind == 2]
    radius = np.hypot(arcs[:, 0] - 50, arcs[:, 1] - 30 + 300 if plane == "G17" else arcs[:, 2] + 2 + 300)
    assert np.abs(radius - math.hypot(60, 300)).max() < 1e-4 and len(re.findall(r"^G[23] X", out, re.M)) > 3


@pytest.mark.parametrize("traverse", ["G0 Z5 F900", "G28 Z5 F900"])
def test_a_traverse_with_an_f_changes_f(tmp_path, machine, traverse):
    """The move behind it has the same rate as the one before: its F has to be written once more."""
    text = (
        HEAD
        + STOCK
        + f"T3 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG28.1\nG0 Z-2\nG1 X20 F400\nX50\n{traverse}\nG0 Z-2\nG1 X80\nG0 Z5\nM2\n"
    )
    _, two, out = rewritten(tmp_path, machine, text, "--feed", "12", "--split", "30")
    assert "divided" not in out
    assert feed_at(two, 40) == pytest.approx(600, rel=0.015) and feed_at(two, 70) == feed_at(two, 40)


@pytest.mark.parametrize("before", ["G1 X30 F400", "G1 X20 F400\nG2 X30 I5"])
def test_a_thread_keeps_its_lines(tmp_path, machine, before):
    """A line of G33 gets neither an F nor a G1, and the moves behind it have their own F."""
    text = (
        HEAD + STOCK + f"T3 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG0 Z-2\n{before}\nG33 X50 K0.1\nX60 K0.2\nG1 X90\nG0 Z5\nM2\n"
    )
    one, two, out = rewritten(tmp_path, machine, text, "--feed", "12")
    read_back.same_path(one, two)
    assert "\nG33 X50 K0.1\nX60 K0.2\n" in out
    assert feed_at(two, 10) == pytest.approx(600, rel=0.03) == feed_at(two, 80)


@pytest.mark.parametrize("comp", ["G41.1 D6", "G42.1 D4"])
def test_cutter_compensation_is_refused(tmp_path, machine, comp):
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(
        HEAD + STOCK + f"T3 M6\nS8000 M3\nG0 X-20 Y20 Z5\nG0 Z-2\n{comp} G1 X-10 Y30 F400\nX110\nG40 Y50\nG0 Z5\nM2\n"
    )
    done = rewrite(before, after, machine, "--feed", "3")
    assert (
        done.status == 2
        and "cutter compensation is on (G41, G42); write" in done.errors
        and re.search("line [89][)]$", done.errors)
    ), done.errors
    assert not after.exists()


@pytest.mark.parametrize("home", ["G28 Z9", "G30 Z9", "G0 G53 Z9"])
def test_a_line_of_its_own_motion_stays(tmp_path, machine, home):
    """Behind a changed move; the line behind it still has to repeat G1."""
    text = HEAD + STOCK + f"T3 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG0 Z-2\nG1 X50 F400\nG2 X70 I10\n{home}\nM2\n"
    one, two, out = rewritten(tmp_path, machine, text, "--feed", "12")
    read_back.same_path(one, two)
    assert f"\n{home}\n" in out


def test_the_motion_mode_behind_g28(tmp_path, machine):
    text = HEAD + STOCK + "T3 M6\nS8000 M3\nG0 X-10 Y30 Z9\nG28.1\nG1 Z-2 F400\nX50\nG28 Z9\nX-20 Y50\nM2\n"
    one, two, out = rewritten(tmp_path, machine, text, "--feed", "12")
    read_back.same_path(one, two)
    assert "\nG28 Z9\n" in out


@pytest.mark.parametrize(
    "body, said",
    [
        ("G7\nG1 X220 F400\nG8", "X is a diameter (G7); write the program with G8 (line 8)"),
        ("G1 X0 F400\nG5 I0 J3 P0 Q-3 X30 Y30", "they are those of G5; write them as G0 to G3 (line 8)"),
    ],
)
def test_other_motion_is_refused(tmp_path, machine, body, said):
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(HEAD + STOCK + f"T3 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG0 Z-2\n{body}\nG0 Z5\nM2\n")
    done = rewrite(before, after, machine, "--feed", "3")
    assert done.status == 2 and done.errors.endswith(said), done.errors
    assert not after.exists()
