# SPDX-License-Identifier: GPL-2.0-or-later
"""The moves that are foreseen for a program with edits against those that LinuxCNC's interpreter reads from its
text."""

import re
from dataclasses import replace

import numpy as np
import pytest

from chipwise.program.reader import Machine
from chipwise.program.records import ARC, FEED
from chipwise.rewrite import expected_program, read_back as proof
from chipwise.rewrite import flute
from chipwise.rewrite.edits import Edits, Move, original
from chipwise.rewrite.program import read
from chipwise.rewrite.run import read_back, written
from chipwise.tool_data.geometry import load_tools
from support.random_cases import random_count, random_seed
from support.rewrite_rig import deep_program, make_machine

CELL = 0.5
KINDS = {
    "plain": (lambda text: text),
    "offset": (lambda text: text.replace("M250", "G10 L2 P1 X1.23456 Y-7.7 Z3.3 R0\nM250", 1)),
    "incremental": (lambda text: text.replace("M250", "G91.1\nM250", 1) + "G91\n"),
    "centres": (lambda text: text.replace("M250", "G90.1\nM250", 1)),
}


@pytest.fixture(scope="module", name="ini")
def fixture_ini(tmp_path_factory):
    return make_machine(tmp_path_factory.mktemp("foreseen") / "mill")


def trial(path, ini, **options):
    """(Program, Edits, Program of the new text) of one trial."""
    machine = Machine(str(ini))
    program = read(str(path), machine)
    folder = path.parent / "new"
    folder.mkdir(exist_ok=True)
    edits, _ = flute.rewrite(program, load_tools(str(ini.parent / "tools.toml")), flute.Order(CELL, **options))
    return (
        program,
        edits,
        read_back(written(folder, program, edits), lambda name: read(name, machine)) if edits else None,
    )


@pytest.mark.parametrize("case", range(random_count(8)))
def test_random_programs_make_the_moves_that_are_foreseen(ini, tmp_path, case):
    seed, kind = random_seed() + case, list(KINDS)[case % len(KINDS)]
    path = tmp_path / f"{seed}.ngc"
    path.write_text(KINDS[kind](deep_program(seed)))
    program, edits, after = trial(path, ini, reserve=0.06 * (case % 2))
    if not edits:
        return
    found = expected_program.foreseen(program, edits)
    assert len(found.kind) == len(after.kind), f"{kind}, seed {seed}, {path}"
    assert np.abs(found.end - after.end).max() <= expected_program.SAME_MM, f"{kind}, seed {seed}, {path}"
    assert expected_program.same_moves(found, after), f"{kind}, seed {seed}, {path}"
    proof.same_feeds(found, after)


def raised(program):
    """Edits that raise each step by 1 mm.  Each but an arc begins with a move to where the step before ends: not one on
    the same line."""
    edits, before = Edits(), None
    for step in range(program.steps):
        move = original(program, step)
        x, y, z = move.end
        move = move._replace(
            end=(x, y, z + 1.0),
            circle=move.circle and replace(move.circle, centre=tuple(np.add(move.circle.centre, (0, 0, 1.0)))),
        )
        edits.instead[step] = [move] if before is None or move.kind == ARC else [Move(FEED, before.end, 100.0), move]
        before = move
    return edits


def test_parts_of_any_size_make_the_same_moves(ini, tmp_path, monkeypatch):
    """To the last bit: arcs that begin where a part ends, moves that go nowhere there, tools between parts."""
    path = tmp_path / "parts.ngc"
    path.write_text(
        "G21 G90 G17 G40 G49 G80 G94\nM250 P0 Q0 R-40 I60 J50 K40\nT1 M6\nS8000 M3\nG0 X-10 Y25 Z5\nG1 Z-3 F200\n"
        "G2 X30 Y25 Z-2 R21 F400\n"
        "G3 X70 Y25 R30\nG0 Z5\nT2 M6\nS8000 M3\nG81 X10 Y10 Z-2 R1 F100\nX20 Z-3\nG80\nG0 Z5\nM2\n"
    )
    program = read(str(path), Machine(str(ini)))
    edits = raised(program)
    whole = expected_program.foreseen(program, edits)
    once = np.count_nonzero(np.diff(program.line[program.first[:-1]]) == 0)
    assert once > 3 and len(whole.kind) == len(program.kind) + program.steps - 1 - len(program.circles) - once
    arcs = np.flatnonzero((whole.kind == ARC) & (np.roll(whole.kind, 1) != ARC))
    assert np.abs(np.diff(whole.end[:, 2])[arcs - 1]).max() < 0.1  # they begin at the raised end of the step before
    for size in (1, 2, 3, 7):
        monkeypatch.setattr(expected_program, "PART_STEPS", size)
        one = expected_program.foreseen(program, edits)
        assert one.events == whole.events, size
        for name in ("kind", "line", "end", "feed"):
            a, b = getattr(one, name), getattr(whole, name)
            assert a.dtype == b.dtype and a.tobytes() == b.tobytes(), f"{name}, {size} steps"


def slot(ini, folder, text):
    """foreseen() of a slot in one line of text, and its Program read back."""
    path = folder / "slot.ngc"
    path.write_text("G21 G90 G17 G40 G49 G80 G94\nM250 P0 Q0 R-40 I60 J50 K40\nT1 M6\nS8000 M3\n" + text + "\nM2\n")
    program, edits, after = trial(path, ini)
    return expected_program.foreseen(program, edits), after


@pytest.mark.parametrize(
    "text",
    [
        "G0 X-10 Y25 Z5\nG1 Z-30 F200\nX70 F400\nG0 Z5",
        "G0 X-10 Y25 Z5\nG91\nG1 Z-35 F200\nX80 F400\nG0 Z35\nG90",
        "G20\nG0 X-0.4 Y1 Z0.2\nG1 Z-1.2 F8\nG3 X2.7 Y1 I1.55 J1 F16\nG0 Z0.2",
        "G0 X-10 Y25 Z5\nG1 Z-30 F200\nG2 X30 Y25 Z-26 R21 F400\nG3 X70 Y25 R30\nG0 Z5",
        "G0 X-10 Y25 Z5\nG1 Z-30 F200\nX70 F400\nG0 Z5\nT3 M6\nS8000 M3\nG0 X-12 Y8 Z5\nG1 Z-4 F100\nX70\nG0 Z5",
    ],
)
def test_modes_units_arcs_and_tools_are_foreseen(ini, tmp_path, text):
    found, after = slot(ini, tmp_path, text)
    assert len(found.kind) > 8 and expected_program.same_moves(found, after)
    assert bool(re.search("G[23] X", text)) == bool((found.kind == ARC).any())


def test_other_moves_tools_or_kinds_are_not_the_same(ini, tmp_path):
    found, after = slot(
        ini,
        tmp_path,
        "G0 X-10 Y25 Z5\nG1 Z-30 F200\nX70 F400\nG0 Z5\nT3 M6\nS8000 M3\nG0 X-12 Y8 Z5\nG1 Z-4 F100\nX70\nG0 Z5",
    )
    for wrong in ("end", "kind", "tool", "at", "one less"):
        one = expected_program.Foreseen(
            found.kind.copy(),
            found.line,
            found.end.copy(),
            found.feed,
            [type(e)(e.at, e.kind, e.line, list(e.values)) for e in found.events],
        )
        if wrong == "end":
            one.end[7, 1] += 1e-4
        elif wrong == "kind":
            one.kind[7] = 1 - one.kind[7]
        elif wrong == "tool":
            one.events[-1].values[0] += 1
        elif wrong == "at":
            one.events[-1].at += 1
        else:
            one.kind, one.end = one.kind[:-1], one.end[:-1]
        assert not expected_program.same_moves(one, after), wrong


@pytest.mark.parametrize(
    "wrong, says", [(lambda f: f * 1.00001, "instead of"), (lambda f: f - 0.1, "instead of"), (lambda f: f - 0.02, "")]
)
def test_another_f_is_seen(ini, tmp_path, wrong, says):
    """But not the last digit, which is rounded down, and not where F means nothing."""
    found, after = slot(ini, tmp_path, "G0 X-10 Y25 Z5\nG1 Z-30 F200\nX70 F400\nG0 Z5")
    proof.same_feeds(found, after)
    k = int(np.flatnonzero(found.kind != 0)[-1])
    after.feed[k] = wrong(after.feed[k])
    if says:
        with pytest.raises(proof.Different, match=f"^a move of line 7 has F .* {says} 400$"):
            proof.same_feeds(found, after)
    proof.same_feeds(found, after, without=[7] if says else ())
