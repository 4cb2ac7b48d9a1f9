# SPDX-License-Identifier: GPL-2.0-or-later
"""Edits in arrays against lists and dictionaries, and moves along a path of single segments against those of pieces."""

import random
from types import SimpleNamespace

import numpy as np

from chipwise.program.records import ARC, FEED, RAPID
from chipwise.rewrite import path_moves
from chipwise.rewrite.edits import BATCH, ByStep, Edits, Move, Table
from chipwise.rewrite.program import Circle
from support.random_cases import random_count, random_seed


def random_moves(rng, most=6):
    def one():
        kind, end = rng.choice([RAPID, FEED, ARC]), tuple(rng.uniform(-9, 9) for _ in range(3))
        return Move(
            kind,
            end,
            None if kind == RAPID else rng.uniform(1, 900),
            Circle(1, (rng.random(), 0.0, 1.0), 1.0) if kind == ARC else None,
        )

    return [one() for _ in range(rng.randint(0, most))]


def test_a_table_has_the_moves_it_is_made_of():
    for case in range(random_count(20)):
        rng = random.Random(f"table {random_seed() + case}")
        lists = [random_moves(rng, rng.choice([6, BATCH + 9])) for _ in range(rng.randint(0, 4))]
        table, moves = Table.joined([Table.of(one) for one in lists]), sum(lists, [])
        assert list(table) == moves and len(table) == len(moves), case
        index = np.array(rng.sample(range(len(moves)), len(moves) // 2), int)
        assert list(table.take(index)) == [moves[k] for k in index], case
        first = rng.randint(0, len(moves))
        assert list(table.part(first, len(moves))) == moves[first:], case


def test_what_is_put_by_step_is_there():
    for case in range(random_count(20)):
        rng = random.Random(f"steps {random_seed() + case}")
        made, wanted, notes = ByStep(), {}, {}
        for _ in range(rng.choice([3, 30, 3 * BATCH])):
            steps = sorted(rng.sample(range(9999), rng.randint(1, 4)))
            lists = [random_moves(rng) for _ in steps]
            note = rng.choice([None, "a", "b"])
            made.put(steps, np.cumsum([0, *map(len, lists)]), Table.joined([Table.of(one) for one in lists]), note)
            wanted.update(zip(steps, lists))
            notes.update(dict.fromkeys(steps, note))
            if rng.random() < 0.01:
                assert len(made) == len(wanted)  # it is merged here, too
        assert made.steps.tolist() == sorted(wanted), case
        for step in rng.sample(range(9999), 500):
            found = made.get(step)
            assert (found if found is None else list(found)) == wanted.get(step) and made.note(step) == notes.get(
                step
            ), (case, step)


def test_moves_come_step_by_step_those_behind_a_step_last():
    rng = random.Random(random_seed())
    edits, wanted = Edits(), []
    lists = {step: (random_moves(rng), random_moves(rng)) for step in rng.sample(range(50), 30)}
    for step, (instead, after) in lists.items():
        edits.instead[step], edits.after[step] = instead, after
    for step in sorted(lists):
        wanted += [(step, move) for move in lists[step][0] + lists[step][1]]
    steps, table = edits.moves()
    assert list(zip(steps.tolist(), table)) == wanted
    assert edits and edits.changed() == set(lists) and not Edits() and len(Edits().moves()[1]) == 0


def test_single_segments_become_the_moves_that_pieces_become():
    for case in range(random_count(20)):
        rng = np.random.default_rng([random_seed(), case])
        n = 60
        points = np.cumsum(rng.uniform(0.1, 1, (n + 1, 3)), axis=0)
        path = points + [0, 0, 1] * np.repeat(rng.uniform(0, 3, 13), 5)[: n + 1, None]
        path[1 + rng.choice(n - 1, 9, replace=False)] = np.nan
        step = np.cumsum(rng.random(n) < rng.choice([0.5, 0.95, 1.0]))
        program = SimpleNamespace(step=step, feed=rng.uniform(1, 900, n), circle=np.full(n + 1, -1))
        body = path_moves.Body(points, np.arange(n), [])
        table, spans = path_moves.moves_along(program, body, path)
        bounds = [0, *(np.flatnonzero(np.diff(step)) + 1).tolist(), n]
        other, others = path_moves._pieces(program, body, path, bounds, [-1] * (len(bounds) - 1))
        assert list(table) == list(other) and spans.tolist() == others.tolist(), case
        assert 20 < len(table) < n


def test_steps_on_a_line_are_one_move():
    for case in range(random_count(20)):
        rng = np.random.default_rng([random_seed(), case, 2])
        points, bounds = np.cumsum(rng.uniform(0.1, 1, (61, 3)), axis=0), np.arange(0, 61, 6)
        s = path_moves.shift.along(points)
        path = np.column_stack((points[:, :2], np.interp(s, s[bounds], rng.uniform(0, 9, 11))))
        path[rng.integers(1, 60), 2] += rng.choice([1e-4, 3e-4, np.nan])
        path[rng.integers(0, 10) * 6 + 3, 2] += rng.choice([1e-4, 3e-4])
        parts = [slice(a, b + 1) for a, b in zip(bounds[:-1], bounds[1:])]
        wanted = [
            path_moves.kept_points(path_moves.shift.along(points[own]), path[own, 2]) == [0, 6]
            and not np.isnan(path[own, 2]).any()
            for own in parts
        ]
        assert path_moves._lines(points, path[:, 2], bounds).tolist() == wanted and 6 < sum(wanted), case
