# SPDX-License-Identifier: GPL-2.0-or-later
"""G75: inverse time (G93) in the sub, and F of moves that only turn an axis, by the feeds that the preview's
interpreter gets.

The oracle is the word itself: a move under G93 F takes 1/F minutes, whatever the pattern does with it; a move that only
turns has F degrees a minute in both units.
"""

import json
import math
import random

import numpy as np
import pytest

from support import canon
from support.pattern_oracle import Move, calls_to_moves, moves_of
from support.random_cases import random_count, random_seed

HEAD = "G90 G94 G17 G40 G21\nT1 M6\nS500 M3\nF600\n"


def program(calls, sub, start="G0 X3 Y-4 Z7", unit="G21"):
    return "\n".join([*sub, HEAD + unit, start, "(begin)", *calls, "(end)", "G1 X1 Y1", "(then)", "M2", ""])


def inverse(seed, plane="G17"):
    """(lines of a sub of more than ten moves under G93, F of each)."""
    r, lines, words = random.Random(f"inverse {seed}"), ["o100 sub", "G0 X5 Y5 Z5", "G93"], []
    for _ in range(14):
        words.append(round(r.uniform(0.3, 40.0), 4))
        if r.random() < 0.4:
            x = r.uniform(2, 9)
            z, k = (f"Z{r.uniform(-1, 1):.4f}", "J") if plane == "G17" else ("", "K")
            lines.append(f"G91 {plane} G{r.choice('23')} X{2 * x:.4f} {z} I{x:.4f} {k}0 F{words[-1]}")
        else:
            lines.append(f"G90 G1 X{r.uniform(-9, 9):.4f} Y{r.uniform(-9, 9):.4f} Z{r.uniform(-3, 3):.4f} F{words[-1]}")
    return [*lines, "G90 G17 G94 G0 Z9", "G1 X1 Y1 F222", "G0 Z9", "o100 endsub"], words


def minutes(start, move):
    """A move's length over its feed; an arc's by its points, which the oracle's arc of 8 parts has exactly for a circle
    or a helix of one angle."""
    points = np.vstack([start, move.points])
    if move.kind == "feed":
        return float(np.linalg.norm(points[-1] - points[0])) / move.feed
    plane = [0, 1] if move.plane == 1 else [0, 2]
    along = 2 if move.plane == 1 else 1
    first, middle, last = points[0][plane], points[4][plane], points[8][plane]
    a, b, c = np.linalg.norm(middle - first), np.linalg.norm(last - middle), np.linalg.norm(last - first)
    area = abs(float((middle - first)[0] * (last - first)[1] - (middle - first)[1] * (last - first)[0]) / 2)
    radius = a * b * c / (4 * area)
    chord = float(np.linalg.norm(points[1][plane] - points[0][plane]))
    turn = 8 * 2 * math.asin(min(1.0, chord / 2 / radius))
    return math.hypot(radius * turn, float(points[-1][along] - points[0][along])) / move.feed


def times(moves, start):
    """Minutes of each cut."""
    found, here = [], np.array(start)
    for move in moves:
        if move.feed is not None:
            found.append(minutes(here, move))
        here = move.points[-1]
    return found


@pytest.mark.parametrize("case", range(random_count(2)))
@pytest.mark.parametrize("words", ["", "H1", "H2 R33.3 X20 Z-2", "H3 R-90 Y7"])
@pytest.mark.parametrize("unit", ["G21", "G20"])
def test_each_move_takes_the_time_of_its_word(case, words, unit):
    """More than ten F under G93 with F remapped, which LinuxCNC 2.9 ends a program at."""
    sub, inverses = inverse(random_seed() + case)
    sub[1:1] = ["G21"]
    moves, trace = moves_of(program([f"G75 Q100 {words}"], sub, unit=unit, start="G0 X0.1 Y-0.2 Z0.3"))
    scale = 25.4 if unit == "G20" else 1.0
    found = times(moves, (0.1 * scale, -0.2 * scale, 0.3 * scale))
    assert found[:-1] == pytest.approx([1 / word for word in inverses], rel=1e-5), (random_seed() + case, sub)
    assert [move.feed for move in moves if move.feed][-1] == pytest.approx(222, rel=1e-6)
    assert trace.modes("then")[1] == trace.modes("begin")[1] and 940 in trace.modes("end")[0]


def test_arcs_that_become_chords_take_the_same_time():
    sub, _words = inverse(random_seed(), "G18")
    own, chords = (
        times(moves_of(program([f"G75 Q100 {words}"], sub, start="G0 X5 Y5 Z7"))[0], (5, 5, 7)) for words in ("", "R20")
    )
    assert len(chords) > 2 * len(own) and sum(chords) == pytest.approx(sum(own), rel=1e-4)


def test_what_cannot_be_under_g93():
    for line, message in (("G93 G1 X5", "F"), ("G93\nG12 I3 Z-1 F5", "G93")):
        trace = canon.run_preview(program(["G75 Q100"], ["o100 sub", "G0 X1 Y1", line, "o100 endsub"]))
        assert trace.error.startswith("G75: ") or "chipwise: G75" in trace.error, trace.error
        assert message in trace.error and "sub O100, line" in trace.error and not trace.after("begin"), trace.error
    trace = canon.run_preview(program(["G95 F0.1\nG75 Q100"], ["o100 sub", "G0 X1 Y1", "G93 G1 X5 F2", "o100 endsub"]))
    assert "G95" in trace.error, trace.error


@pytest.mark.parametrize(
    "sub, words",
    [
        (["G21 F300", "G1 A90", "G93", "G1 A120 F6", "G1 A60 F3"], [300, 30 * 6, 60 * 3]),
        (["G20", "F10", "G1 A90", "G1 X1", "G1 A30 F20"], [10, None, 20]),
    ],
)
@pytest.mark.parametrize("unit", ["G21", "G20"])
def test_f_of_a_move_that_only_turns_is_degrees(tmp_path, monkeypatch, sub, words, unit):
    """In a sub of one unit, called from a program of the other: rs274's canonical number is degrees a minute."""
    monkeypatch.setenv("AXIS_MASK", "15")
    options = {"ini": canon.write_ini(tmp_path, COORDINATES="X Y Z A")}
    text = program(
        ["G75 Q100"], ["o100 sub", "G0 X0.5 A0", *sub, "G0 Z9", "o100 endsub"], unit=unit, start="G0 X0 Y0 Z1"
    )
    trace = canon.run_preview(text, **options)
    assert not trace.error, trace.error
    scale = 25.4 if unit == "G20" else 1.0  # preview_probe.py takes every F for inches a minute
    feed, abc, turned, inside, found = 0.0, (0, 0, 0), False, False, []
    for kind, _line, *n in json.loads(trace.output.splitlines()[-1])["calls"]:
        if kind == "comment":
            inside = n[0] == "begin" or inside and n[0] != "end"
        elif kind == "F":
            feed = n[0]
        elif kind == "abc":
            turned, abc = tuple(n) != abc, tuple(n)
        elif kind == "feed" and inside:
            found.append(feed / scale if turned else None)
            turned = False
        elif kind == "rapid":
            turned = False
    assert found == [None if word is None else pytest.approx(word) for word in words]


def test_the_oracle_measures_arcs():
    calls = [["comment", 0, "begin"], ["F", 1, 60.0], ["arc", 1, 0.0, 2.0, 0.0, 0.0, 1.0, 1]]
    moves = calls_to_moves(calls)
    assert minutes(np.zeros(3), moves[0]) * 60 == pytest.approx(math.pi, rel=1e-9) and isinstance(moves[0], Move)
