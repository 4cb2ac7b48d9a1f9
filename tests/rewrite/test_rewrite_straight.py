# SPDX-License-Identifier: GPL-2.0-or-later
"""Lines that are written a batch at a time (rewrite/straight_text.py) against the same lines written one by one."""

import io
import random
from types import SimpleNamespace

import numpy as np
import pytest

from chipwise.program.reader import Machine
from chipwise.program.records import ARC, FEED, RAPID
from chipwise.rewrite import straight_text, text
from chipwise.rewrite.edits import Edits, Move, Table
from chipwise.rewrite.move_text import MoveText
from chipwise.rewrite.program import Circle, read
from chipwise.rewrite.text import Writer
from support.random_cases import random_count, random_seed
from support.rewrite_rig import HEAD, make_machine

LINES = 60
BETWEEN = (
    "G20",
    "G21",
    "G91",
    "G90",
    "G54",
    "G55",
    "F77",
    "G0 X1\nG1 X2",
    "G81 X3 Y4 Z-1 R2 F90\nX4\nG80\nG1 X1 F300",
    "G1 X2 Y1 Z0 F300 (a remark)",
)


@pytest.fixture(scope="module", name="machine")
def fixture_machine(tmp_path_factory):
    return Machine(str(make_machine(tmp_path_factory.mktemp("straight") / "mill")))


def random_text(rng):
    lines = [HEAD.strip(), "G10 L2 P2 X3.3 Y-1.7 Z0.125 R30", "T1 M6", "S900 M3", "G0 X0 Y0 Z5", "G1 Z0 F300"]
    for n in range(LINES):
        lines += [rng.choice(BETWEEN)] if rng.random() < 0.1 else []
        lines.append(
            f"{rng.choice(['', '', 'G1 ', f'N{n} '])}X{rng.uniform(0, 9):.3f} Y{rng.uniform(0, 9):.3f} "
            f"Z{rng.uniform(-2, 0):.4f}"
        )
    return "\n".join([*lines, "G21 G90 G54 G80", "M2"]) + "\n"


def random_moves(rng):
    """Moves, some of them to the place of the one before, few of them arcs."""
    result = []
    for _ in range(rng.choice([0, 1, 1, 1, 2, 4])):
        end = (
            result[-1].end
            if result and rng.random() < 0.2
            else tuple(rng.choice([1.0, rng.uniform(-9, 9)]) for _ in range(3))
        )
        kind = rng.choice([RAPID, FEED, FEED, FEED])
        result.append(Move(kind, end, None if kind == RAPID else rng.choice([300.0, 450.0])))
    if result and rng.random() < 0.05:
        result.append(Move(ARC, (2.0, 1.0, 0.0), 300.0, Circle(1, (2.0, 0.0, 0.0), -0.3)))
    return result


def random_edits(rng, program):
    edits, steps = Edits(), sorted(rng.sample(range(2, program.steps - 1), program.steps * 3 // 4))
    lists = [random_moves(rng) for _ in steps]
    edits.instead.put(
        steps,
        np.cumsum([0, *map(len, lists)]),
        Table.joined([Table.of(one) for one in lists]),
        rng.choice([None, "shifted"]),
    )
    for step in rng.sample(steps, 3):
        edits.after[step] = [Move(FEED, (1.0, 2.0, 3.0), 300.0)]
    return edits


def one_by_one(numbers, frame, table, feed, end):
    """long_lines(), with a MoveText."""
    words_of = MoveText(frame, SimpleNamespace(units=20 if numbers.inch else 21), (0.0, 0.0, 0.0)).words
    for move in table:
        words = words_of(move)
        if words and move.kind != RAPID and feed != move.feed:
            words.append("F" + numbers.feed(move.feed))
            feed = move.feed
        yield " ".join(words) + end * bool(words), feed


def test_batches_are_written_as_single_lines_are(machine, tmp_path, monkeypatch):
    batched = 0
    for case in range(random_count(12)):
        rng = random.Random(f"straight {random_seed() + case}")
        path = tmp_path / f"{case}.ngc"
        path.write_text(random_text(rng))
        program = read(str(path), machine)
        edits = random_edits(rng, program)
        with monkeypatch.context() as patch:
            patch.setattr(straight_text.StraightLines, "has", lambda self, step: False)
            patch.setattr(text, "long_lines", one_by_one)
            wanted = io.BytesIO()
            Writer(program, edits, wanted).write()
        with monkeypatch.context() as patch:
            patch.setattr(straight_text, "BATCH", rng.choice([1, 7, 4096]))
            found = io.BytesIO()
            writer = Writer(program, edits, found)
            writer.write()
            assert found.getvalue() == wanted.getvalue(), (random_seed(), case)
        batched += sum(writer._straight.has(step) for step in edits.instead.steps.tolist())
    assert batched > random_count(12) * 10
