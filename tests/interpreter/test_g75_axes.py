# SPDX-License-Identifier: GPL-2.0-or-later
"""G75 on a machine with rotary axes: where the tool is on the turned part, mirrored and shifted.

The oracle turns every point of the path back by the angle of the axis, so it sees the part's own coordinates; G75's
isometries and senses are not in it.  A shift along the axis moves the pattern on the part; so the cases that turn A are
shifted in X, those that turn C in Z.
"""

import json
import math
import random

import numpy as np
import pytest

from support import canon
from support.random_cases import random_count, random_seed

FOUR = {"A": 0, "B": 1, "C": 2}
SHARES = np.linspace(0, 1, 5)[1:]


@pytest.fixture(name="options", params=["A"])
def _options(request, tmp_path, monkeypatch):
    return options_of(request.param, tmp_path, monkeypatch)


def options_of(letter, tmp_path, monkeypatch):
    """Options of run_preview() for the mill with another axis."""
    ini = canon.write_ini(tmp_path, COORDINATES=f"X Y Z {letter}")
    monkeypatch.setenv("AXIS_MASK", str(7 | 8 << FOUR[letter]))
    return {"ini": ini}


def program(calls, sub, start="G0 X3 Y-4 Z7", unit="G21", before=""):
    return "\n".join(
        [*sub, "G90 G94 G17 G40\nT1 M6\nS5000 M3\nF600\n" + unit, before, start, "(begin)", *calls, "(end)", "M2", ""]
    )


def path_of(text, options):
    """[(kind, places (n, 3), angles (n,))] of the moves between begin and end, points at SHARES of each straight move,
    the end of an arc."""
    trace = canon.run_preview(text, **options)
    assert not trace.error, trace.error
    here, abc, to, inside, found = np.zeros(3), np.zeros(3), np.zeros(3), False, []
    for kind, _line, *n in json.loads(trace.output.splitlines()[-1])["calls"]:
        if kind == "comment":
            inside = n[0] == "begin" or inside and n[0] != "end"
        elif kind == "abc":
            to = np.array(n)
        elif kind in ("rapid", "feed", "arc"):
            end = np.array(n[:3])
            shares = SHARES[-1:] if kind == "arc" else SHARES
            if inside and (np.abs(end - here).max() > 1e-8 or np.abs(to - abc).max() > 1e-8 or kind == "arc"):
                found.append((kind, here + (end - here) * shares[:, None], abc + (to - abc) * shares[:, None]))
            here, abc = end, to
    return found


def on_the_part(path, axis):
    """[(kind, points (n, 3) of the part)]: turned back about the axis."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    found = []
    for kind, places, angles in path:
        t, points = np.radians(angles[:, axis]), places.copy()
        points[:, a] = places[:, a] * np.cos(t) + places[:, b] * np.sin(t)
        points[:, b] = places[:, b] * np.cos(t) - places[:, a] * np.sin(t)
        found.append((kind, points))
    return found


def same(found, own, transform):
    assert [kind for kind, _ in found] == [kind for kind, _ in own]
    for k, ((_, mine), (_, other)) in enumerate(zip(found, own)):
        off = float(np.abs(mine - transform(other)).max())
        assert off < 1e-6, f"move {k} is {off:.3g} mm off: {mine[-1]}, not {transform(other)[-1]}"


def wrapped(seed, letter):
    """A sub that turns the axis: alone, with straight cuts, with arcs."""
    r = random.Random(f"wrapped {seed}")
    body = [f"G0 X{r.uniform(-9, 9):.3f} Y{r.uniform(-9, 9):.3f} {letter}{r.uniform(-60, 60):.3f}", "G0 Z12"]
    for _ in range(r.randint(2, 6)):
        body += [
            r.choice(
                [
                    f"G1 X{r.uniform(-9, 9):.3f} {letter}{r.uniform(-90, 90):.3f} F{r.uniform(100, 900):.2f}",
                    f"G1 {letter}{r.uniform(-90, 90):.3f}",
                    f"G1 X{r.uniform(-9, 9):.3f} Y{r.uniform(-9, 9):.3f} Z{r.uniform(9, 11):.3f}",
                    "G2 I2 J1",
                    f"G91 G3 X1.5 Y1.5 J1.5 {letter}{r.uniform(-9, 9):.3f}\nG90",
                ]
            )
        ]
    return ["o100 sub", *"\n".join(body).split("\n"), "G0 Z20", "o100 endsub"]


@pytest.mark.parametrize("case", range(random_count(6)))
def test_a_part_that_is_turned_is_mirrored_and_shifted(case, tmp_path, monkeypatch):
    seed = random_seed() + case
    r = random.Random(f"turned part {seed}")
    letter, mirror, shift = r.choice("AAABC"), r.choice((0, 1, 2, 3)), round(r.uniform(-20, 20), 3)
    axis, half = FOUR[letter], r.choice((0, 180))
    along, signs = "XYZ"[axis], np.array([-1 if mirror in (1, 3) else 1, -1 if mirror in (2, 3) else 1, 1])
    signs = signs * (np.array([-1, -1, 1]) if half else 1)
    options, sub = options_of(letter, tmp_path, monkeypatch), wrapped(seed, letter)
    offset = np.eye(3)[axis] * shift
    text = program([f"G75 Q100 H{mirror} R{half} {along}{shift}"], sub, "G0 X3 Y-4 Z27")
    (tmp_path / "replay.ngc").write_text(text)
    begin = signs * (np.array([3, -4, 27]) - offset)
    own = on_the_part(
        path_of(program(["o100 call"], sub, f"G0 X{begin[0]:.6f} Y{begin[1]:.6f} Z{begin[2]:.6f}"), options), axis
    )
    try:
        same(on_the_part(path_of(text, options), axis), own, lambda p: p * signs + offset)
    except AssertionError as error:
        raise AssertionError(
            f"CHIPWISE_SEED={seed} {letter} H{mirror} R{half}, {tmp_path / 'replay.ngc'}: {error}"
        ) from error


SUB = ["o100 sub", "G0 X10 Y2 A30", "G0 Z9", "G1 X20 A-15 F300", "G1 A40", "G0 Z20", "o100 endsub"]


def test_the_oracle_can_fail(options):
    own, found = (on_the_part(path_of(program([call], SUB), options), 0) for call in ("o100 call", "G75 Q100 X5"))
    same(found[1:], own[1:], lambda p: p + np.array([5, 0, 0]))
    for wrong in ([5, 1e-5, 0], [4.9999, 0, 0]):
        with pytest.raises(AssertionError):
            same(found[1:], own[1:], lambda p, w=wrong: p + np.array(w))


def test_angles_under_every_mirror(options):
    """H1 leaves A, H2 and H3 change its sense; inch, G91 and a work offset of A change nothing of it."""
    for words, sense in (
        ("", 1),
        ("H1", 1),
        ("H2", -1),
        ("H3", -1),
        ("R180", -1),
        ("R180 H2", 1),
        ("G91", 1),
        ("G20", 1),
        ("G10", 1),
    ):
        text = {
            "G91": program(["G91", "G75 Q100 X1", "G90"], ["o100 sub", "G90", *SUB[1:]]),
            "G20": program(["G75 Q100"], SUB, "G0 X.1 Y.1 Z.3", "G20"),
            "G10": program(["G75 Q100"], SUB, before="G10 L2 P1 A5 R17\nG92 X1"),
        }.get(words) or program([f"G75 Q100 {words}"], SUB)
        ends = [round(angles[-1][0], 6) for _kind, _places, angles in path_of(text, options)]
        assert list(dict.fromkeys(ends)) == [sense * 30, sense * -15, sense * 40], words


def test_copies_begin_where_the_axis_is(options):
    """A sub that does not begin with A: the second copy begins with the angle that the first has ended with."""
    sub = ["o100 sub", "G0 X10 Y2", "G0 Z9", "G91 G1 A20 F300", "G90 G0 Z20", "o100 endsub"]
    found = path_of(program(["G75 Q100 L4 I30 H2"], sub, "G0 X3 Y-4 Z27 A7"), options)
    ends = [angles[-1][0] for _kind, _places, angles in found]
    assert ends[-1] == pytest.approx(7 - 4 * 20)


@pytest.mark.parametrize(
    "call, words",
    [
        (
            "G75 Q100 R30",
            "line 2 of the sub turns axis A, and the pattern is turned so that this is another axis of the part; use "
            "R0 or R180",
        ),
        ("G75 Q100 L2 I5 K90", "turns axis A, and the pattern is turned"),
        ("G75 Q101", "word B is an axis that a pattern does not move: the machine has none"),
    ],
)
def test_refused(options, call, words):
    trace = canon.run_preview(program([call], [*SUB, "o101 sub", "G0 X1 B5", "o101 endsub"]), **options)
    assert words in trace.error and not trace.after("begin"), trace.error


def test_a_sub_that_turns_nothing_leaves_the_axis(options):
    """It may be rotated by any angle, and A stays."""
    sub = ["o100 sub", "G0 X10 Y2", "G1 Z-1", "G0 Z20", "o100 endsub"]
    found = path_of(program(["G75 Q100 R30 L2 I9"], sub, "G0 X3 Y-4 Z27 A12"), options)
    assert {angles[-1][0] for _kind, _places, angles in found} == {12.0} and math.isclose(
        found[0][1][-1][0], 10 * math.cos(math.pi / 6) - 1, abs_tol=1e-9
    )


def test_a_mirrored_sub_that_turns_is_not_reversed(options):
    """Its chains stay as they are, and the operator hears of it."""
    sub = ["o100 sub", "G0 X0 Y0 A0", "G0 Z9", "G1 X20 A10 F300", "G1 X0 A0", "G0 Z20", "o100 endsub"]
    text = program(["#<_chipwise_keep_climb> = 1", "G75 Q100 H2"], sub)
    assert "(turns an axis)" in canon.run_preview(text, **options).output
    ends = [round(angles[-1][0], 6) for _kind, _places, angles in path_of(text, options)]
    assert list(dict.fromkeys(ends)) == [0, -10] and ends[-1] == 0


@pytest.mark.parametrize("letter, bit", [("U", 6), ("V", 7), ("W", 8)])
def test_a_sub_that_moves_u_v_or_w_is_refused(letter, bit, tmp_path, monkeypatch):
    """With the line; an axis that is not programmed stays where it is."""
    monkeypatch.setenv("AXIS_MASK", str(7 | 1 << bit))
    options = {"ini": canon.write_ini(tmp_path, COORDINATES=f"X Y Z {letter}")}
    trace = canon.run_preview(
        program(["G75 Q100 X5"], ["o100 sub", "G0 X1 Y1", f"G1 {letter}5", "o100 endsub"]), **options
    )
    assert (
        f"sub O100, line 3 of program.ngc: word {letter} is an axis that a pattern does not move; use X, Y and Z"
        in trace.error
        and not trace.after("begin")
    ), trace.error
    trace = canon.run_preview(
        program(["G75 Q100 X5"], ["o100 sub", "G0 X1 Y1", "G1 X4", "o100 endsub"], start=f"G0 X3 Y-4 Z7 {letter}2"),
        **options,
    )
    assert not trace.error and trace.after("begin"), trace.error


def test_a_sub_that_moves_an_axis_of_the_tool_is_refused(tmp_path, monkeypatch):
    """A turns the tool of a robot: the sub may not move it, and hears why."""
    monkeypatch.setenv("AXIS_MASK", "7")
    trace = canon.run_preview(
        program(["G75 Q100 X5"], ["o100 sub", "G0 X1 Y1", "G1 A5", "o100 endsub"]),
        ini=canon.write_ini(tmp_path, COORDINATES="X Y Z"),
    )
    assert (
        "sub O100, line 3 of program.ngc: word A is an axis that a pattern does not move: the machine has none, or "
        "[CHIPWISE]TOOL_POSE turns the tool "
        "with it; use X, Y and Z"
    ) in trace.error and not trace.after("begin"), trace.error
