# SPDX-License-Identifier: GPL-2.0-or-later
"""What is done otherwise for long programs: bodies in parts, lines in one block, paths that are proved where they
are."""

import io
import math
import random
from types import SimpleNamespace

import numpy as np
import pytest

from chipwise.program.reader import Machine, Unreadable
from chipwise.program.records import FEED, RAPID, STOCK, TOOL
from chipwise.rewrite import depth_proof, read_back
from chipwise.rewrite import flute, run
from chipwise.rewrite.source import Lines
from chipwise.tool_data.geometry import ToolGeometry
from support.random_cases import random_seed
from support.rewrite_rig import HEAD, deep_program, verdict

STAIRS = (
    HEAD
    + "M250 P0 Q0 R-40 I80 J40 K40\nT1 M6\nS8000 M3\nG0 X10 Y10 Z5\nG1 Z-20 F100\nX40 F400\nY16 Z-26\nX10\nG3 Y24 J4\n"
    "G1 X40\n"
    "Z-30\nX60\nY10\nG0 Z5\nM2\n"
)


@pytest.mark.parametrize("most", (1, 2))
@pytest.mark.parametrize("text", (STAIRS, deep_program(61), deep_program(90)))
def test_a_body_in_parts(tmp_path, machine, monkeypatch, text, most):
    """Parts of one step, and of two moves: no deeper than the flutes, nothing left, and one range of lines is said."""
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(text)
    monkeypatch.setattr(flute, "MOST_MOVES", most)
    bodies = []
    body = flute.Shifter._body
    monkeypatch.setattr(
        flute.Shifter,
        "_body",
        lambda self, lead, first, end, section_end: (
            bodies.append((first, end)) or body(self, lead, first, end, section_end)
        ),
    )
    data, said = run.rewritten(str(before), run.Order(), lambda share: None, Machine(str(machine)))
    after.write_bytes(data)
    assert any(a[1] == b[0] for a, b in zip(bodies, bodies[1:]))
    assert text is not STAIRS or said.startswith("lines 7 to 11 in 3 levels, lines 13 to 14 in 3 levels;"), said
    over, more, left, _rapid = verdict(before, after, machine)
    assert over <= 0.006 and more <= 0.25 and left <= 0.25


def test_a_program_is_not_refused_for_what_it_becomes(tmp_path, machine, monkeypatch):
    """The limit of a program's bytes does not count for the new one; neither is work lost to its number of moves."""
    before, limit = tmp_path / "a.ngc", len(STAIRS)
    before.write_text(STAIRS)

    def rewritten():
        return run.rewritten(str(before), run.Order(), lambda share: None, Machine(str(machine)), most_bytes=limit)[0]

    data = rewritten()
    assert len(data) > limit
    monkeypatch.setattr(run, "MOST_BYTES", limit)
    with pytest.raises(read_back.Different, match="cannot be read"):
        rewritten()
    monkeypatch.setattr(flute, "MOST_WRITTEN", 20)
    monkeypatch.setattr(depth_proof, "too_deep", None)  # nothing is proved or written by then
    with pytest.raises(Unreadable, match="the new program would have more than 20 moves"):
        rewritten()


def test_a_note_is_said_once(tmp_path, machine):
    """Each changed line stays as a comment; that of the first in a row has the note."""
    before = tmp_path / "a.ngc"
    before.write_text(STAIRS)
    lines = run.rewritten(str(before), run.Order(), lambda share: None, Machine(str(machine)))[0].decode().splitlines()
    notes = [line for line in lines if line.startswith("(")]
    assert notes[:3] == [
        "(chipwise: written out: G1 Z-20 F100)",
        "(chipwise: shifted along the axis: X40 F400)",
        "(was: Y16 Z-26)",
    ], notes


def test_lines_are_those_of_readlines():
    generator = random.Random(random_seed())
    for _ in range(200):
        data = bytes(generator.choice(b"\n\n\rGX1 \xff\xc3\xbc") for _ in range(generator.randrange(40)))
        lines, wanted = Lines(data), io.BytesIO(data).readlines()
        assert list(lines.parts()) == wanted and len(lines) == len(wanted)
        texts = [own.decode("utf-8", "surrogateescape") for own in wanted]
        assert list(lines) == texts and lines[:] == texts and lines[1:] == texts[1:] and lines[-2:] == texts[-2:]
        assert [lines[k] for k in range(-len(texts), len(texts))] == texts * 2 and "".join(lines).encode(
            "utf-8", "surrogateescape"
        ) == data
        with pytest.raises(IndexError):
            lines[len(texts)]


@pytest.mark.parametrize("gap", (1, 2, 3))
def test_moves_without_a_tool_between(gap):
    """The tool is taken out and put in again: what follows begins where its own first move does, and the stock is as it
    was left."""
    low, high = (0.0, 0.0, -30.0), (40.0, 20.0, 0.0)
    cut = [(-5, 10, 5), (-5, 10, -8), (20, 10, -8), (20, 10, 5)]
    away = [(20 + k, -30, 5) for k in range(gap)]
    again = [(-5, 10, 5), (-5, 10, -20), (30, 10, -20), (30, 10, 5)]
    end = np.array([*cut, *away, *again], float)
    kind = np.array([RAPID, RAPID, FEED, RAPID, *[RAPID] * gap, RAPID, RAPID, FEED, RAPID])
    stock = SimpleNamespace(kind=STOCK, at=0, line=1, values=(0, 0.0, *low, *high))
    tools = [
        SimpleNamespace(kind=TOOL, at=at, line=2, values=(number, 6.0)) for at, number in ((0, 1), (4, 0), (4 + gap, 1))
    ]
    program = SimpleNamespace(
        end=end,
        kind=kind,
        line=np.arange(len(end)) + 1,
        events=[stock, *tools],
        known_from=0,
        start=lambda k: end[max(k - 1, 0)],
    )
    geometry = {1: ToolGeometry(shape="flat", flute_length=11.0)}
    found = depth_proof.too_deep(program, geometry, 0.25, 0.0)
    assert found and {w.line for w in found} == {int(program.line[-2])}  # only the second cut, of its own place
    inside = [w for w in found if w.x < 20]  # 8 mm are gone there: 12 mm are left
    assert inside and all(w.depth == pytest.approx(12.0, abs=1e-3) for w in inside if abs(w.y - 10) < 2.5)
    assert max(w.depth for w in found) == pytest.approx(20.0, abs=1e-3)
    assert not depth_proof.too_deep(program, {1: ToolGeometry(shape="flat", flute_length=20.1)}, 0.25, 0.0)


def crest(rows, columns, down):
    """A program of rows 0.1 mm apart over a crest, to and fro, in moves of 0.1 mm; rows, columns: ranges of tenths of a
    millimetre; down: (X, Y) where it goes down."""
    lines = [
        "G21 G90 G17 G40 G49 G80 G94",
        "M250 P0 Q0 R-40 I100 J100 K40",
        "T1 M6",
        "S8000 M3",
        f"G0 X{down[0]} Y{down[1]} Z5",
        "G1 Z-14 F300",
    ]
    for row in rows:
        for k in columns[:: 1 - 2 * (row % 2)]:
            lines.append(f"X{k / 10:.3f} Y{row / 10:.3f} Z{-24 + 10 * math.sin(k / 90) * math.cos(row / 40):.4f}")
    return "\n".join([*lines, "G0 Z5", "M2", ""])


def test_what_is_left_bit_by_bit(tmp_path, machine):
    """Each move over the crest lowers a cell there by little, and all of them together by more than a millimetre."""
    before = tmp_path / "a.ngc"
    before.write_text(crest(range(960, 1000), range(80, 201), (8, 96)))
    assert (
        b"shifted along the axis"
        in run.rewritten(str(before), run.Order(), lambda share: None, Machine(str(machine)))[0]
    )


@pytest.mark.parametrize("most", (700, 2000))
def test_what_is_left_where_two_parts_meet(tmp_path, machine, monkeypatch, most):
    """A part's last rows are lower than their neighbours only when the next part has been cut: they are travelled all
    the same."""
    monkeypatch.setattr(flute, "MOST_MOVES", most)
    before = tmp_path / "a.ngc"
    before.write_text(crest(range(340, 411), range(361, 501), (36, 34)))
    assert (
        b"shifted along the axis"
        in run.rewritten(str(before), run.Order(), lambda share: None, Machine(str(machine)))[0]
    )
