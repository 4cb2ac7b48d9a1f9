# SPDX-License-Identifier: GPL-2.0-or-later
"""Shifted paths with fewer moves (rewrite/merge_moves.py): never lower, never beside, and no other line between two
moves is passed over."""

import random

import numpy as np
import pytest

from chipwise.program.reader import Machine
from chipwise.clib.height_map import Shape
from chipwise.rewrite import merge_moves, path_moves
from chipwise.rewrite import run
from chipwise.rewrite.program import read
from chipwise.rewrite.run import Order
from support.random_cases import random_count, random_seed
from support.rewrite_rig import HEAD, make_machine, verdict


@pytest.fixture(scope="module", name="ini")
def fixture_ini(tmp_path_factory):
    return make_machine(tmp_path_factory.mktemp("fewer") / "mill")


def drawn(rng):
    """(text, ends) of feed moves as CAM programs have them: short ones on lines at any angle, curves, arcs, turns, and
    lines between them."""
    x, y, angle, lines, ends = 20.0, 20.0, rng.uniform(0, 360), [], []
    for _ in range(rng.randint(3, 9)):
        kind, bend = rng.choice(["line", "line", "curve", "arc", "back"]), rng.choice([0.05, 3.0, 20.0])
        angle += 180 if kind == "back" else rng.choice([0, 0, 0, rng.uniform(-170, 170)])
        step, digits, feed = rng.choice([0.05, 0.1, 0.5, 3.0]), rng.choice([3, 4, 6]), rng.choice([300, 300, 450])
        for _ in range(1 if kind == "arc" else rng.randint(1, 60)):
            angle += bend if kind == "curve" else 0
            x, y = (round(v + step * f(np.radians(angle)), digits) for v, f in ((x, np.cos), (y, np.sin)))
            lines.append(
                (f"G2 X{x} Y{y} R{step * rng.choice([1, 9999])} " if kind == "arc" else f"G1 X{x} Y{y} ") + f"F{feed}"
            )
            ends.append((x, y))
            if rng.random() < 0.05:
                lines.append(rng.choice(["M8", "(a remark)", "G4 P0.1", "M9", f"G1 X{x} Y{y} (MSG, here)"]))
    return (
        HEAD
        + "M250 P0 Q0 R-40 I100 J100 K40\nT1 M6\nS9000 M3\nG0 X20 Y20 Z5\nG1 Z-1 F100\n"
        + "\n".join(lines)
        + "\nG0 Z5\nM2\n"
    )


def heights(rng, s):
    """Amounts of shift: level, slopes, hills, and none at all on some parts."""
    knots = np.linspace(0, s[-1], rng.randint(2, 9))
    amount = np.interp(s, knots, [rng.choice([0.0, 2.0, rng.uniform(0, 9)]) for _ in knots])
    return amount + (amount > 0) * rng.choice([0.0, 0.02, 0.5]) * np.sin(s / rng.uniform(0.5, 9)) ** 2


def test_random_paths(ini, tmp_path):
    gone = all_points = 0
    for case in range(random_count(40)):
        rng = random.Random(f"fewer {random_seed() + case}")
        name = tmp_path / "a.ngc"
        name.write_text(drawn(rng))
        program = read(str(name), Machine(str(ini)))
        feeds = np.flatnonzero(
            (program.kind != 0) & (np.abs(np.diff(program.end, axis=0, prepend=program.end[:1])[:, :2]).max(axis=1) > 0)
        )
        points = np.concatenate((program.start(int(feeds[0]))[None], program.end[feeds]))
        body = path_moves.Body(points, feeds, [])
        path = points + np.outer(heights(rng, merge_moves.shift.along(points)), (0, 0, 1))
        dropped = np.array([rng.random() < 0.02 and 0 < k < len(path) - 1 for k in range(len(path))])
        path[dropped] = np.nan
        most = merge_moves.beside(rng.choice([Shape(6.0), Shape(6.0, 3.0), Shape(6.0, 0.0, 90.0)]))
        found = merge_moves.with_fewer(program, body, path, most)
        check(program, body, path, found, most, case)
        gone += np.count_nonzero(np.isnan(found[:, 2])) - np.count_nonzero(dropped)
        all_points += len(path)
    assert 0.2 * all_points < gone < 0.9 * all_points


def check(program, body, path, found, most, case):
    """What with_fewer() promises, point by point."""
    where, had = ~np.isnan(found[:, 2]), ~np.isnan(path[:, 2])
    assert (had | ~where).all() and where[[0, -1]].all(), case
    here = had & ~(path[:, 2] > body.points[:, 2] + 1e-9)
    assert (found[here] == path[here]).all(), case  # the first path's own places stay
    kept = np.flatnonzero(where)
    assert (found[kept, :2] == path[kept, :2]).all(), case
    for a, b in zip(kept[:-1].tolist(), kept[1:].tolist()):
        inner = np.flatnonzero(had[a + 1 : b]) + a + 1
        if not len(inner):
            continue
        along_it, p = found[b, :2] - found[a, :2], path[inner, :2] - found[a, :2]
        length = np.hypot(*along_it)
        share = p @ along_it / length**2
        assert (np.diff([0.0, *share, 1.0]) > 0).all(), case
        assert np.abs(along_it[0] * p[:, 1] - along_it[1] * p[:, 0]).max() / length < most + 1e-6, case
        higher = found[a, 2] + share * (found[b, 2] - found[a, 2]) - path[inner, 2]
        assert higher.min() > -1e-6 and higher.max() < merge_moves.HIGHER_MM + 1e-6, (case, higher.min(), higher.max())
        moves = body.move[a:b]
        assert (
            len(set(program.feed[moves])) == 1
            and (np.diff(program.line[moves]) <= 1).all()
            and (program.kind[moves] == 1).all()
        ), case


def wavy(between=""):
    """A line 80 mm long in moves of 0.1 mm, 18 mm deep at most; between: a line in its middle."""
    rows = [f"X{k / 10:.1f} Z{-16 + 2 * np.sin(k / 70):.4f}" for k in range(1, 801)]
    rows.insert(403, between)
    return (
        HEAD
        + "M250 P0 Q-10 R-40 I80 J20 K40\nT1 M6\nS8000 M3\nG0 X-5 Y0 Z5\nG0 Z-15\nG1 X0 Z-16 F300\n"
        + "\n".join(rows)
        + "\nG0 Z5\nM2\n"
    )


def test_a_shifted_row_is_shorter(tmp_path, ini):
    """800 moves are shifted to less than 120, and travelled again at their own places."""
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(wavy())
    after.write_bytes(run.rewritten(str(before), Order(), lambda share: None, Machine(str(ini)))[0])
    moves = [line for line in after.read_text().splitlines() if line.startswith("G1")]
    assert 800 < len(moves) < 920, len(moves)
    over, more, left, _rapid = verdict(before, after, ini)
    assert over <= 0.006 and more <= 0.25 and left <= 0.25


@pytest.mark.parametrize("between", ("M8", "G4 P0.2", "M64 P1", "F400", "(MSG, half)", "X40.35 Z-16.9918 (MSG, half)"))
def test_what_stands_between_two_moves_comes_where_it_did(tmp_path, ini, between):
    """The tool is where the program had it when the line is run."""
    before = tmp_path / "a.ngc"
    before.write_text(wavy(between))
    lines = run.rewritten(str(before), Order(), lambda share: None, Machine(str(ini)))[0].decode().splitlines()
    said = between[between.find("(") :] if "(" in between else between
    at = lines.index(said) if said in lines else next(k for k, line in enumerate(lines) if between in line)
    last = next(line for line in reversed(lines[:at]) if line.startswith("G1"))
    assert "X40.3" in last.split(), last
