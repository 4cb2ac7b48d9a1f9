# SPDX-License-Identifier: GPL-2.0-or-later
"""Depths of a path that is still sought: the proof in parts, with paths taken back, against the proof of the whole;
paths that need no repeat."""

import numpy as np
import pytest

from chipwise.program.reader import Machine
from chipwise.clib.height_map import HeightMap
from chipwise.rewrite import depth_proof, sections, trial_proof
from chipwise.rewrite import flute, run
from chipwise.rewrite.program import read
from chipwise.rewrite.run import Order
from chipwise.tool_data.geometry import load_tools
from support.depth_cases import HIGH, LOW, geometry_of, left_at, random_path, witnesses
from support.random_cases import random_count, random_seed
from support.rewrite_rig import HEAD, make_machine

FLUTE = 4.0  # mm


def parts_of(tool, expected=None):
    """A Sought of the stock with one tool, and the tool.  expected: places (n, 3) along which it is known that moves
    will come, or None."""
    own = sections.tool_of(1, tool[0], geometry_of(tool, FLUTE))
    path = (
        None
        if expected is None
        else depth_proof.Path(
            np.array(expected[0], float),
            np.array(expected[1:], float),
            np.zeros(len(expected) - 1, np.int32),
            np.arange(len(expected) - 1),
        )
    )
    return trial_proof.Sought(HeightMap(LOW, HIGH, 0.25), [own], path and (lambda: path)), own


def other_paths(rng):
    """Some paths that lead nowhere, through all of the stock."""
    return [rng.uniform((-3, -3, -11), (17, 15, 1), (int(rng.integers(2, 30)), 3)) for _ in range(int(rng.integers(3)))]


@pytest.mark.parametrize("known", (False, True))
def test_in_parts_as_in_one(known):
    """The same moves are too deep, in a stock of the same heights, whatever was tried and taken back between them, and
    whether or not it was known which moves would come."""
    seen = 0
    for case in range(random_count(12, least=12)):
        tool, places = random_path(case + 200)
        rng, places = np.random.default_rng([random_seed(), case]), np.array(places)
        expected = {w.line - 3 for w in witnesses(places, tool, FLUTE)}
        proof, own = parts_of(tool, places if known else None)
        at, found = 0, set()
        while at < len(places) - 1:
            for path in other_paths(rng):
                proof.too_deep(own, path)
            end = min(at + int(rng.integers(1, 5)), len(places) - 1)
            if rng.random() < 0.3:
                proof.follow(own, places[at], places[at + 1 : end + 1])
                expected -= set(range(at, end))
            else:
                met = proof.too_deep(own, places[at : end + 1])
                found |= set((at + met["move"]).tolist())
                for w in met[:3]:
                    height = left_at(w["x"], w["y"], places[: at + int(w["move"]) + 1], tool)
                    assert height == pytest.approx(w["height"], abs=0.005), (case, w)
                proof.keep()
            at = end
        assert found == expected, (case, random_seed())
        seen += len(found)
    assert seen > random_count(12, least=12)


def test_what_is_lower_than_expected_is_too_deep_all_the_same():
    """Cells that were settled may have a witness more, and never one less."""
    seen = 0
    for case in range(random_count(12, least=12)):
        tool, places = random_path(case + 300)
        places = np.array(places)
        expected = places + (0, 0, np.random.default_rng([random_seed(), case]).uniform(0.5, 6))
        wanted, (proof, own) = {w.line - 3 for w in witnesses(places, tool, FLUTE)}, parts_of(tool, expected)
        found = set(proof.too_deep(own, places)["move"].tolist())
        assert found >= wanted, (case, random_seed())
        seen += len(wanted)
    assert seen > random_count(12, least=12)


def test_moves_that_are_not_asked_for_cut():
    tool = (6.0, 0.0, 0.0)
    proof, own = parts_of(tool)
    slot = np.array([(-5.0, 6, -8), (20, 6, -8)])
    assert len(proof.too_deep(own, slot)) and not len(proof.too_deep(own, slot, np.array([False])))
    proof.keep()
    assert not len(proof.too_deep(own, slot))


def test_too_many_walls_are_left_to_the_end(monkeypatch):
    monkeypatch.setattr(trial_proof, "SQUARES", 10)
    proof, own = parts_of((6.0, 0.0, 0.0))
    proof.too_deep(own, np.array([(-5, 6, -8), (20, 6, -8.0)]))
    assert proof.is_off
    proof.keep()
    proof.follow(own, (0, 0, 0), np.zeros((3, 3)))
    assert not len(proof.too_deep(own, np.array([(-5, 6, -8), (20, 6, -8.0)])))


def test_holes_are_known(tmp_path, monkeypatch):
    """Behind a hole that was drilled before a slot, or in the slot's own section, a path finds nothing there, although
    it is lower than was expected."""
    monkeypatch.setattr(flute, "Sought", lambda stock, tools, _expected: trial_proof.Sought(stock, tools))
    ini = make_machine(tmp_path / "mill")
    program = tmp_path / "holes.ngc"
    program.write_text(
        HEAD + "M250 P0 Q0 R-40 I80 J30 K40\nT3 M6\nS8000 M3\nG0 X20 Y15 Z5\nG1 Z-35 F100\nG0 Z5\nT1 M6\nG0 X-10 Y15\n"
        "G0 Z-14\nG1 X90 F300\nG0 Z5\nX60 Y7\nG1 Z-35 F100\nG0 Z5\nX-10 Y24\nG0 Z-14\nG1 X90\nG0 Z5\nM2\n"
    )
    shifter = flute.Shifter(
        read(str(program), Machine(str(ini))), load_tools(str(ini.parent / "tools.toml")), flute.Order(0.375)
    )
    shifter.run()
    assert shifter.figures.bodies == 2
    for x, y, radius in ((20, 15, 5.0), (60, 7, 3.0)):
        found = shifter.ground.proof.too_deep(
            shifter.ground.tool, np.array([(x - 12.0, y, -34.0), (x + 12.0, y, -34.0)])
        )
        away = np.hypot(found["x"] - x, found["y"] - y)
        assert len(away) > 20 and away.min() > radius - 0.1 and away.min() < radius + 0.3


def rows(count, apart, tool):
    """A zigzag in moves of 0.1 mm that is one to three flutes deep, in rows so near to each other that most strips
    between them are between the cells."""
    lines = [HEAD + "M250 P0 Q0 R-40 I40 J30 K40", f"T{tool} M6", "S8000 M3", "G0 X5 Y3 Z5", "G1 Z-9 F300"]
    for row in range(count):
        x = np.linspace(5, 25, 201)[:: 1 if row % 2 == 0 else -1]
        lines += [f"X{u:.3f} Y{3 + apart * row:.4f} Z{-20 + 6 * np.sin(u / 5) + 0.3 * row:.4f}" for u in x]
    return "\n".join([*lines, "G0 Z5", "M2", ""])


@pytest.mark.parametrize("tool", (1, 2, 4))
def test_no_repeat_for_strips_between_the_cells(tmp_path, monkeypatch, tool):
    """What lies between the cells is found while the path is shifted: the first new program is proved."""
    ini = make_machine(tmp_path / "mill")
    program = tmp_path / "rows.ngc"
    program.write_text(rows(6, 0.113, tool))
    monkeypatch.setattr(run, "REPEATS", 1)
    data, said = run.rewritten(str(program), Order(), lambda share: None, Machine(str(ini)))
    assert "levels" in said and len(data) > program.stat().st_size


def test_a_bridge_that_leaves_a_corner(tmp_path, monkeypatch):
    """Points are bridged where a shifted zigzag turns back, and the corner of the stock stays: the path is proved again
    behind its bridges.

    The traverse down beside that corner, which the map does not show, becomes a feed move."""
    ini = make_machine(tmp_path / "mill")
    program = tmp_path / "corner.ngc"
    lines = [HEAD + "M250 P0 Q93 R-40 I100 J7 K40", "T1 M6", "S8000 M3", "G0 X0 Y96 Z5", "G1 Z-14 F300"]
    for row in range(960, 980):
        x = np.linspace(0.1, 20, 200) if row % 2 == 0 else np.linspace(20, 0, 201)
        lines += [f"X{u:.3f} Y{0.1 * row:.3f} Z{-24 + 10 * np.sin(u / 9) * np.cos(row / 40):.4f}" for u in x]
    program.write_text("\n".join([*lines, "G0 Z5", "M2", ""]))
    monkeypatch.setattr(run, "REPEATS", 1)
    data, said = run.rewritten(str(program), Order(), lambda share: None, Machine(str(ini)))
    assert "levels" in said and b"\nG0 Y96\nG1 Z-10.99493 F300\n" in data
