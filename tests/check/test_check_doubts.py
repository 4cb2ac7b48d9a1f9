# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise check: a move up that comes to a wall between two needles of the map is judged by the place where it
does."""

import math
import random

import numpy as np
import pytest

from chipwise.check import extra_needles
from chipwise.check import answer
from chipwise.program.reader import Machine
from chipwise.clib.height_map import HeightMap
from chipwise.clib import layout
from support import canon, check_oracle
from support.random_cases import random_count, random_seed, write_replay

HEAD = "G21 G90 G17 G40 G49 G80 G94"
FLUTES = 10.0  # mm, of tool 1
SKIN = 0.004  # mm: thinner stock is not judged
LATE = 0.03  # mm at 80 degrees with needles doubts.SPACING_MM apart


def rising(seed, deeper):
    """Program: tool 1 (6 mm) rises into the face of a turned stock, `deeper` (mm) than its flutes at the contact."""
    rng = random.Random(f"doubts {seed}")
    slope = math.tan(math.radians(rng.uniform(55, 80)))
    aside, gap, inside = rng.uniform(-0.6, 0.6), rng.uniform(0.05, 3.0), rng.uniform(0.5, 1.2)
    length = math.hypot(1.0, aside)  # of the path for each mm across the face
    contact = 20.0 - FLUTES - deeper - SKIN * length * slope
    z0, z1 = contact - gap * length * slope, contact + inside * length * slope
    x, turn, origin = rng.uniform(20, 80), rng.uniform(-90, 90), rng.uniform(-33, 33)
    lines = [
        HEAD,
        f"G10 L2 P1 X{origin:.3f} Y7.77 R{turn:.3f}",
        "M250 P0 Q0 R-60 I100 J60 K80",
        "T1 M6",
        "S8000 M3",
        "F400",
        f"G0 X{x:.4f} Y{-3 - gap:.4f} Z25",
        f"G0 Z{z0:.4f}",
        f"G1 X{x + aside * (gap + inside):.4f} Y{-3 + inside:.4f} Z{z1:.4f}",
        "G0 Y-20",
        "G0 Z30",
        "M2",
    ]
    return "\n".join(lines) + "\n"


def judged(text, folder, flutes=FLUTES, corner=0.0, cell=None):
    """chipwise.check.result.Result of a program with tool 1."""
    (folder / "part.ngc").write_text(text)
    (folder / "tools.toml").write_text(f"[tool.1]\nshape = '{'ball' if corner else 'flat'}'\nflute_length = {flutes}\n")
    (folder / "mill.tbl").write_text("T1 P1 D6 Z30\n")
    ini = canon.write_ini(folder, TOOL_GEOMETRY="tools.toml")
    return answer.check(str(folder / "part.ngc"), Machine(str(ini)), cell=cell)


def flutes_of(result):
    """Findings about the flutes; of rising() one besides is true: the traverse of line 8 may come down close beside the
    stock."""
    kept = result.findings.kept
    assert {(found.rule, found.line) for found in kept if found.rule != "flute"} <= {("clearance", 8)}, kept
    return [found for found in kept if found.rule == "flute"]


@pytest.mark.parametrize("case", range(random_count(8)))
def test_a_contact_between_needles(case, tmp_path):
    seed = random_seed() + case
    replay = write_replay(f"doubts_{seed}", {"seed": seed, "text": rising(seed, LATE)})
    result = judged(rising(seed, LATE), tmp_path)
    said = f"seed {seed}, {replay}: {result.error}, {result.findings.kept}"
    assert [found.line for found in flutes_of(result)] == [9], said
    assert FLUTES < flutes_of(result)[0].value <= FLUTES + LATE + 0.05, said
    result = judged(rising(seed, -0.02), tmp_path)
    assert not result.error and not flutes_of(result), f"seed {seed}, {replay}: {result.error}, {result.findings.kept}"
    replay.unlink()


def test_without_needles_of_its_own_it_is_judged_too_low(tmp_path, monkeypatch):
    """Sabotage: some contacts of these programs are then no findings."""
    monkeypatch.setattr(extra_needles, "needles", lambda *_: {})
    assert not all(flutes_of(judged(rising(seed, LATE), tmp_path)) for seed in range(6))


def along_an_arc(off):
    """Program: a groove of the flutes' depth along an arc in short moves, `off` (mm) outside of it, then the next
    level, which rises, as an arc."""

    def place(turn, radius=80.0):
        return f"X{50 + radius * math.sin(turn):.5f} Y{-60 + radius * math.cos(turn):.5f}"

    turns = np.linspace(0.45, -0.45, 200)
    lines = [
        HEAD,
        "M250 P0 Q0 R-60 I100 J60 K80",
        "T1 M6",
        "S8000 M3",
        "F400",
        f"G0 {place(turns[0])} Z25",
        f"G1 Z{20 - FLUTES}",
    ]
    lines += [f"G1 {place(turn, 80 + off)}" for turn in turns[1:]]
    lines += [
        "G0 Z25",
        f"G0 {place(turns[0])}",
        f"G1 Z{20.01 - 2 * FLUTES}",
        f"G3 {place(turns[-1])} Z5 R80",
        "G0 Z30",
        "M2",
    ]
    return "\n".join(lines) + "\n"


def test_the_next_level_along_an_arc_meets_no_wall(tmp_path, monkeypatch):
    """The chords that arcs are judged by lie 0.002 mm beside them: the needles of doubtful moves do not meet that."""
    result = judged(along_an_arc(0.0015), tmp_path)
    assert not result.error and not result.findings.kept, f"{result.error}, {result.findings.kept}"
    add = HeightMap.add_needles
    monkeypatch.setattr(HeightMap, "add_needles", lambda stock, places: add(stock, places, layout.NEEDLE_SKIN))
    assert judged(along_an_arc(0.0015), tmp_path).findings.kept


def test_which_moves_are_in_doubt():
    start = np.array([[0, 0, -9.0], [1, 0, -8.5], [2, 0, -8.0], [3, 0, -7.0], [4, 0, -7.0]])
    end = np.array([[1, 0, -8.5], [2, 0, -8.0], [3, 0, -7.0], [4, 0, -7.0], [5, 0, -8.0]])
    cuts = np.array([True, True, True, True, True])
    found = extra_needles.doubtful(start, end, cuts, np.array([9.0, 9.2, 8.4, 9.9, 9.9]), 10.0)
    assert found.tolist() == [[0, 0, 2, 0, pytest.approx(10.2)]]  # not: within it anyhow, level, down
    assert len(extra_needles.doubtful(start, end, ~cuts, np.full(5, 9.9), 10.0)) == 0
    assert len(extra_needles.doubtful(start, end, cuts, np.full(5, 10.1), 10.0)) == 0  # too deep as judged


def test_places_are_in_the_part_that_is_new():
    rows = np.array([[0.0, 0.0, 0.3, 0.1, 11.0]])
    found = extra_needles.places(rows, 3.0, 0.02)
    across = found @ np.array([-0.1, 0.3]) / math.hypot(0.3, 0.1)
    assert np.hypot(*found.T).min() >= 3 - 0.05 and np.abs(across).max() <= 3.0
    new = 6 * math.hypot(0.3, 0.1) + math.pi * 3 * 0.04  # and a narrow ring of what is not
    assert len(found) * 0.02**2 == pytest.approx(new, rel=0.1)


def test_needles_are_few_where_the_program_is_long():
    rows = np.array([[0.0, 0.0, 0.3, 0.1, 11.0]])
    few, many = (len(extra_needles.needles({0: [(3.0, rows)]}, segments, 0.25)[0]) for segments in (2_000_000, 100))
    assert few < 1500 < many
    assert not extra_needles.needles({0: [(3.0, np.repeat(rows, 5000, axis=0))]}, 2_000_000, 0.25)
    assert not extra_needles.needles({}, 100, 0.25)
    (wide,) = extra_needles.needles({0: [(60.0, rows)]}, 100, 0.25).values()
    assert 100 < len(wide) < extra_needles.MOST


# ---- figures ---------------------------------------------------------------------------------------------------------

FIGURES = "volume peak_rate mean_rate cutting_s feed_s planned_s feed_volume volumetric_s volumetric_planned_s".split()
LONG = 15.0  # mm, flutes of the tools of these programs
# of a volume, with cells of FINE; 0.0007 of it is the stamps' ridge and the oracle's own steps, the rest the cells
VOLUME = 0.003
FINE = 0.1  # mm: 60 cells across the tool; with 24 of 0.25 mm a short groove may be 0.005 off


def near_the_flutes(seed):
    """(program, points (n, 3), corner radius): grooves about as deep as the flutes are long, most of them rising."""
    rng = random.Random(f"figures {seed}")
    corner, x, y = rng.choice((0.0, 3.0)), rng.uniform(8, 14), rng.uniform(22, 38)
    points = [(x, y, -LONG + rng.uniform(0.0, 0.02))]
    for number in range(rng.randint(1, 3)):
        x, y = x + rng.uniform(8, 20), y + rng.uniform(-12, 12)
        points.append(
            (
                x,
                y,
                max(
                    -LONG,
                    min(
                        -8.0,
                        points[-1][2]
                        + (rng.choice((rng.uniform(0.3, 2.0), -0.5)) if number else rng.uniform(0.8, 2.0)),
                    ),
                ),
            )
        )
    lines = [
        HEAD,
        "M250 P0 Q0 R-20 I80 J60 K20",
        "T1 M6",
        "S8000 M3",
        "F600",
        "G0 X%.4f Y%.4f Z5" % points[0][:2],
        "G1 Z%.4f" % points[0][2],
    ]
    lines += ["G1 X%.4f Y%.4f Z%.4f" % point for point in points[1:]] + ["G0 Z5", "M2"]
    points = [(*points[0][:2], 5.0), *points, (*points[-1][:2], 5.0)]
    return "\n".join(lines) + "\n", np.round(points, 4), corner


def both(text, folder, corner, monkeypatch, cell=None):
    """(Result, the same without a second pass, whether there was one)."""
    made, needles = [], extra_needles.needles
    monkeypatch.setattr(extra_needles, "needles", lambda *arguments: made.append(needles(*arguments)) or made[-1])
    result = judged(text, folder, LONG, corner, cell)
    monkeypatch.setattr(extra_needles, "needles", lambda *_: {})
    plain = judged(text, folder, LONG, corner, cell)
    monkeypatch.undo()
    return result, plain, any(made)


def true_volume(points, corner):
    """mm3 that fine needles lose."""
    stock = check_oracle.Needles((0.0, 0.0, -20.0), (80.0, 60.0, 0.0), 0.06)
    before = stock.volume()
    for start, end in zip(points, points[1:]):
        stock.move((6.0, corner, 0.0), start, end, ())
    return before - stock.volume()


@pytest.mark.parametrize("case", range(random_count(1)))
def test_figures_are_those_without_needles_and_right(case, tmp_path, monkeypatch):
    """Volume against fine needles; all figures against the first pass alone."""
    seed = random_seed() + case
    text, points, corner = near_the_flutes(seed)
    replay = write_replay(f"doubts_figures_{seed}", {"seed": seed, "text": text})
    result, plain, twice = both(text, tmp_path, corner, monkeypatch, FINE)
    tool, first = result.tools[1], plain.tools[1]
    said = f"seed {seed}, {replay}: {tool}, without needles {first}"
    assert twice, said
    assert [getattr(tool, name) for name in FIGURES] == [getattr(first, name) for name in FIGURES], said
    assert np.array_equal(result.load[1], plain.load[1]) and tool.volume == pytest.approx(
        true_volume(points, corner), rel=VOLUME
    ), said
    replay.unlink()


def test_figures_of_the_programs_above(tmp_path, monkeypatch):
    for text in (rising(1, LATE), rising(2, -0.02), along_an_arc(0.0015)):
        result, plain, _twice = both(text, tmp_path, 0.0, monkeypatch)
        assert [getattr(result.tools[1], name) for name in FIGURES] == [
            getattr(plain.tools[1], name) for name in FIGURES
        ]


def test_a_closed_form(tmp_path, monkeypatch):
    """A ball as deep as its flutes that rises 1 mm over 20: cylinder and groove, whose floor leans."""
    text = "\n".join(
        [
            HEAD,
            "M250 P0 Q0 R-20 I80 J60 K20",
            "T1 M6",
            "S8000 M3",
            "F600",
            "G0 X10 Y30 Z5",
            "G1 Z-15",
            "G1 X30 Z-14",
            "G0 Z5",
            "M2",
            "",
        ]
    )
    result, _plain, twice = both(text, tmp_path, 3.0, monkeypatch, FINE)
    assert (
        twice
        and result.tools[1].volume == pytest.approx(2045.1, rel=VOLUME)
        and result.tools[1].peak_rate == pytest.approx(51_000, rel=0.02)
    )
