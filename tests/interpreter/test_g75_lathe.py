# SPDX-License-Identifier: GPL-2.0-or-later
"""G75 on a lathe: X and Z, against what the sub does by itself, mirrored and shifted point by point.  The interpreter
has no Y word."""

import random
import re

import numpy as np
import pytest

from support import ROOT, canon
from support.pattern_oracle import compare, moves_of
from support.random_cases import random_count, random_seed

SUB = [
    "o100 sub",
    "G0 X40 Z2",
    "G1 X30 F200",
    "Z-12",
    "G2 X33 Z-15 I3 K0",
    "G3 X37 Z-19 R4",
    "G1 X46",
    "G0 X60 Z5",
    "o100 endsub",
]
DIAMETERS = [
    "o100 sub",
    "G90 G0 X80 Z2",
    "G1 X60 F200",
    "Z-12",
    "G2 X66 Z-15 I3 K0",
    "G3 X74 Z-19 R4",
    "G1 X92",
    "G0 X120 Z5",
    "o100 endsub",
]


@pytest.fixture(name="lathe")
def _lathe(tmp_path, monkeypatch):
    """Options of moves_of() for configs/lathe.ini."""
    text = (ROOT / "configs" / "lathe.ini").read_text().replace("= remap", f"= {ROOT / 'configs' / 'remap'}")
    (tmp_path / "lathe.ini").write_text(text)
    monkeypatch.setenv("AXIS_MASK", "5")
    return {"ini": tmp_path / "lathe.ini"}


def program(calls, sub, head="G21 G8 G90", start="G0 X70 Z9"):
    return "\n".join([*sub, "G18 G94 G40\nT1 M6\nS500 M3\nF300", head, start, "(begin)", *calls, "(end)", "M2", ""])


def placed(points, mirror, shift):
    """Points (n, 3) mirrored and shifted in X and Z."""
    return np.array(
        [
            (x * (-1 if mirror in (1, 3) else 1) + shift[0], y, z * (-1 if mirror in (2, 3) else 1) + shift[1])
            for x, y, z in np.atleast_2d(points)
        ]
    )


def plain(lathe, sub, at, mirror, shift, head="G21 G8 G90"):
    """Moves of the sub, called from the place that becomes `at` (mm, radius)."""
    x, z = (at[0] - shift[0]) * (-1 if mirror in (1, 3) else 1), (at[1] - shift[1]) * (-1 if mirror in (2, 3) else 1)
    scale, twice = (25.4 if "G20" in head else 1.0), (2.0 if "G7" in head else 1.0)
    return moves_of(program(["o100 call"], sub, head, f"G90 G0 X{x / scale * twice:.9f} Z{z / scale:.9f}"), **lathe)[0]


def random_sub(seed):
    """Lines, arcs and threads of a turned profile, diameters or radii."""
    r = random.Random(f"lathe pattern {seed}")
    body, x, z = ["G0 X60 Z3"], 60.0, 3.0
    for _ in range(r.randint(3, 9)):
        kind = r.randrange(5)
        if kind == 0:
            x = x - r.uniform(0, 2)
            body.append(f"G1 X{x:.4f} F{r.uniform(50, 400):.3f}")
        elif kind == 1:
            z = z - r.uniform(0.5, 8)
            body.append(f"G1 Z{z:.4f}")
        elif kind == 2:
            size = r.uniform(1, 4)
            body += [f"G91 G{r.choice('23')} X0 Z{-2 * size:.4f} R{size * r.uniform(1.05, 2):.5f}", "G90"]
            z -= 2 * size
        elif kind == 3:
            body += [f"G91 G{r.choice('23')} I{r.uniform(-3, 3):.4f} K{r.uniform(1, 3):.4f}", "G90"]
        else:
            body += [f"G33 Z{z - 5:.4f} K{r.uniform(0.5, 2):.4f}", f"G0 X{x + 9:.4f}", f"G0 Z{z:.4f}", f"G1 X{x:.4f}"]
    return ["o100 sub", *body, "G0 X80", "G0 Z9", "o100 endsub"]


@pytest.mark.parametrize("case", range(random_count(6)))
def test_random_subs(case, lathe, tmp_path):
    """Mirrors and shifts, metric and inch, diameter and radius."""
    seed = random_seed() + case
    r, sub = random.Random(f"lathe words {seed}"), random_sub(seed)
    mirror = r.choice((0, 1)) if any("G33" in line for line in sub) else r.choice((0, 1, 2, 3))
    shift, diameter, inch = (
        (round(r.uniform(-9, 9), 3), round(r.uniform(-30, 30), 3)),
        r.random() < 0.5,
        r.random() < 0.3,
    )
    if inch:
        sub = [sub[0], "G21", *sub[1:-1], "G20", sub[-1]]
    scale, twice, head = (
        (25.4 if inch else 1.0),
        (2 if diameter else 1),
        f"G90 G{7 if diameter else 8} G{20 if inch else 21}",
    )
    words = f"H{mirror} X{shift[0] * twice / scale:.9f} Z{shift[1] / scale:.9f}"
    text = program([f"G75 Q100 {words}"], sub, head, f"G0 X{70 * twice / scale:.9f} Z{9 / scale:.9f}")
    (tmp_path / "replay.ngc").write_text(text)
    try:
        compare(
            moves_of(text, **lathe)[0],
            plain(lathe, sub, (70, 9), mirror, shift, head),
            lambda p: placed(p, mirror, shift),
        )
    except AssertionError as error:
        raise AssertionError(f"CHIPWISE_SEED={seed} {words}, {tmp_path / 'replay.ngc'}: {error}") from error


def test_compare_can_fail(lathe):
    found, own = moves_of(program(["G75 Q100 H2 X3"], SUB), **lathe)[0], plain(lathe, SUB, (70, 9), 2, (3, 0))
    compare(found, own, lambda p: placed(p, 2, (3, 0)))
    for wrong in ((0, (3, 0)), (2, (3, 1e-5)), (3, (3, 0))):
        with pytest.raises(AssertionError):
            compare(found, own, lambda p, w=wrong: placed(p, *w))


def test_copies_go_along_x_and_z(lathe):
    """I in X, as a radius under G7 too, and J in Z."""
    found = moves_of(program(["G75 Q100 X4 Z-1 L3 I1.5 J-25"], DIAMETERS, "G21 G7 G90", "G0 X140 Z9"), **lathe)[0]
    at, expected = (70.0, 9.0), []
    for c in range(3):
        shift = (2 + 1.5 * c, -1 - 25.0 * c)
        moves = plain(lathe, DIAMETERS, at, 0, shift, "G21 G7 G90")
        for move in moves:
            move.points = placed(move.points, 0, shift)
        expected += moves
        at = tuple(expected[-1].points[-1][[0, 2]])
    compare(found, expected, lambda p: p)


def test_g91_offsets_and_modes(lathe):
    """G91 counts from the tool; a pattern lies in work coordinates; afterwards the modes are what they were."""
    found = moves_of(
        program(
            ["G91", "G75 Q100 X10 Z1", "G90"],
            ["o100 sub", "G90 G0 X1 Z1", "G1 Z-1", "G0 X9", "o100 endsub"],
            "G21 G7 G90",
            "G0 X140 Z9",
        ),
        **lathe,
    )[0]
    assert found[0].points[-1] == pytest.approx((70 + 5 + 0.5, 0, 9 + 1 + 1))
    moved = moves_of(
        program(["G75 Q100 X4 H2"], SUB, "G10 L2 P1 X11 Z-5\nG21 G8 G90", "G92.1\nG92 X1 Z2\nG0 X70 Z9"), **lathe
    )[0]
    compare(moved, moves_of(program(["G75 Q100 X4 H2"], SUB), **lathe)[0], lambda p: p)
    for head in ("G21 G7 G91", "G20 G8 G90", "G21 G7 G90 G95"):
        trace = moves_of(
            program(
                ["(before)", "G75 Q100 Z3", "(after)"],
                DIAMETERS if "G7 " in head else [SUB[0], "G90", *SUB[1:]],
                head + " F0.3",
                "G90 G0 X7 Z9\n" + head,
            ),
            **lathe,
        )[1]
        assert trace.modes("before") == trace.modes("after")
        assert {180, 70 if "G7" in head else 80} <= set(trace.modes("after")[0])


def test_g41_and_feed_per_revolution(lathe):
    """Nose compensation is resolved before the mirror; F is mm per revolution as it was."""
    sub = ["o100 sub", "G0 X40 Z5", "G41", "G1 X30 Z0 F0.2", "Z-20", "X40 Z-30", "G40 G0 X60", "G0 Z5", "o100 endsub"]
    head = "G21 G8 G90 G95 F0.3"
    found, own = (
        moves_of(program(["G75 Q100 H2 Z4"], sub, head), **lathe)[0],
        plain(lathe, sub, (70, 9), 2, (0, 4), head),
    )
    compare(found, own, lambda p: placed(p, 2, (0, 4)))
    assert {round(move.feed, 6) for move in found if move.feed} == {0.2} and min(
        abs(move.points[-1][0] - 30) for move in own
    ) > 0.1


@pytest.mark.parametrize(
    "call, words",
    [
        (
            "G75 Q100 R90",
            "R on a machine without Y: the tool does not turn with the pattern; leave it out; half a turn is H3",
        ),
        ("G75 Q100 L2 K5", "K on a machine without Y"),
        ("G75 Q100 P3", "station P3 on a machine without Y"),
        ("G17\nG75 Q100", "the plane is not G18"),
        ("G75 Q100 Y5", "Bad character 'y' used"),
        ("G75 Q101 H2", "line 13 of the sub cuts a thread, and Z is mirrored: it would have the other hand"),
        ("G75 Q101 H3", "cuts a thread, and Z is mirrored"),
        ("G75 Q102", "an arc of G17 leaves the plane of a lathe"),
        ("G75 Q102 L2 J-9", "an arc of G17"),
        ("G75 Q103 L2 J-9", "copy 2 begins with a cut"),
        ("G75 Q104 L2 J-9", "the sub ends at Z-12 mm, 30 mm from the axis, among its own cuts"),
    ],
)
def test_refused(lathe, call, words):
    subs = [
        *SUB,
        "o101 sub",
        "G0 X20",
        "G0 Z3",
        "G33 Z-9 K1",
        "G0 X60 Z5",
        "o101 endsub",
        "o102 sub",
        "G0 X40 Z2",
        "G17 G2 I3",
        "G18 G0 Z5",
        "o102 endsub",
        "o103 sub",
        "G1 X40 Z2",
        "G0 X60",
        "o103 endsub",
        "o104 sub",
        "G0 X40 Z2",
        "G1 X30 F200",
        "Z-12",
        "o104 endsub",
    ]
    trace = canon.run_preview(program(call.split("\n"), subs), **lathe)
    assert words in trace.error and not trace.after("begin"), trace.error


def test_a_thread_keeps_its_pitch_and_the_operator_hears_of_mirrored_cuts(lathe):
    sub = ["o100 sub", "G0 X20", "G0 Z3", "G33 Z-9 K1.5", "G1 X22", "G0 X60 Z5", "o100 endsub"]
    run = canon.run_rs274(program(["G75 Q100 H1 L2 J-30"], sub), **lathe)
    assert len(re.findall(r"START_SPEED_FEED_SYNC\w*\(.*\b1\.50*,", run.output)) == 2, run.output[-2000:]
    assert "the cuts from line 5 of the sub on are mirrored: the tool has to cut in that direction" in run.output
