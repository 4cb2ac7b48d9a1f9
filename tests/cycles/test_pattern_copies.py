# SPDX-License-Identifier: GPL-2.0-or-later
"""Copies of a pattern as arrays of numbers: their lines are those of the moves computed one by one, which
tests/interpreter/test_g75.py has judged."""

import json
import math
import random
import re

import numpy as np
import pytest

from chipwise import gcode_lines
from chipwise.cycles.pattern import PatternRequest, pattern_plan
from chipwise.errors import CycleError
from chipwise.moves import Copy
from chipwise.pattern.copies import Copier
from chipwise.pattern.isometry import moved, placed, placed_in_zx
from chipwise.pattern.recorded import ARC, FEED, RAPID, THREAD, Code, Recorded, Step
from support.random_cases import random_count, random_seed, write_replay

CHORD = 1.0  # mm: few chords
_NUMBER = re.compile(r"-?\d+\.\d+")


def random_recorded(r, lathe):
    """A sub of any kind of step; some end where they begin."""
    turning, abc = not lathe and r.random() < 0.3, (0.0, 0.0, 0.0)
    steps, at = [], [1.0, 0.0 if lathe else 2.0, 3.0]
    for line in range(1, r.randint(4, 30)):
        kind = r.choice((RAPID, FEED, FEED, ARC, ARC, THREAD, "code", "still", "turn"))
        feed = r.choice((100.0, 250.0))
        if kind == "code":
            steps.append(Code(r.choice(("M8", "G4 P0.5", "M3 S100 (50%)")), line))
            continue
        if kind == "turn" and turning:
            abc = tuple(round(angle + r.uniform(-9, 9), 3) for angle in abc)
        elif kind not in ("still", "turn"):
            at = [r.uniform(-30, 30), 0.0 if lathe else r.uniform(-30, 30), r.uniform(-30, 30)]
        more = dict(source=line, own=line, abc=abc if turning else None)
        if kind == ARC:
            axis = 1 if lathe else r.randrange(3)
            steps.append(
                Step(
                    ARC,
                    line,
                    tuple(at),
                    feed,
                    tuple(r.uniform(-9, 9) for _ in range(3)),
                    axis,
                    r.choice((-2, -1, 1, 3)),
                    **more,
                )
            )
        elif kind == THREAD:
            steps.append(Step(THREAD, line, tuple(at), pitch=r.uniform(0.1, 2), **more))
        else:
            steps.append(Step(kind if kind in (RAPID, FEED) else FEED, line, tuple(at), feed, **more))
    first = Step(
        r.choice((RAPID, ARC)),
        0,
        (1.0, 0.0 if lathe else 2.0, 3.0),
        100.0,
        (4.0, 5.0, 6.0),
        1 if lathe else 2,
        1,
        abc=(0.0, 0.0, 0.0) if turning else None,
    )
    return Recorded((first, *steps), (), (0.0, 0.0, 9.0))


def random_places(r, lathe, count):
    """Isometries in which arcs of all planes stay arcs, and some in which they do not."""
    odd = r.random() < 0.2
    for _ in range(count):
        shift = tuple(round(r.uniform(-90, 90), 4) for _ in range(3))
        mirror = r.randrange(4)
        degrees = round(r.uniform(-360, 360), 3) if odd else 90.0 * r.randrange(-3, 4)
        yield placed_in_zx(mirror, (shift[0], 0.0, shift[2])) if lathe else placed(mirror, degrees, shift)


def alike(found, wanted, decimals):
    """AssertionError where rows of lines._lines() differ by more than a unit in the last decimal."""
    assert len(found) == len(wanted), (len(found), len(wanted))
    for (a, text, feed), (b, other, other_feed) in zip(found, wanted):
        assert (type(a), a.line, feed) == (type(b), b.line, other_feed), (text, other)
        assert _NUMBER.sub("", text) == _NUMBER.sub("", other), (text, other)
        off = [abs(float(x) - float(y)) for x, y in zip(_NUMBER.findall(text), _NUMBER.findall(other))]
        assert max(off, default=0.0) < 1.5 * 10**-decimals, (text, other)


def both_ways(seed):
    """(rows of Copies, rows of moves one by one, how many Copies, decimals) of a random pattern."""
    r = random.Random(f"copies {seed}")
    lathe = r.random() < 0.25
    recorded, copier, copies, single = random_recorded(r, lathe), Copier(CHORD), [], []
    unit_mm, decimals, axes = r.choice((1.0, 25.4)), r.choice((6, 9)), "XZ" if lathe else "XYZABC"
    for isometry in random_places(r, lathe, 9):
        start = tuple(r.uniform(-9, 9) for _ in range(3))
        points = recorded.points.copy()
        k = r.choice((0, 2))
        points[0, k] = start[k]  # a coordinate that the sub does not program
        copies += copier.moves(recorded, points, start, isometry)
        single += moved(recorded, points, start, isometry, CHORD)
    start = (1.0, 0.0, 2.0)
    return (
        list(gcode_lines._lines(copies, start, unit_mm, decimals, axes)),
        list(gcode_lines._lines(single, start, unit_mm, decimals, axes)),
        sum(isinstance(move, Copy) for move in copies),
        decimals,
    )


@pytest.mark.parametrize("case", range(random_count(200)))
def test_copies_are_the_moves_one_by_one(case):
    seed = random_seed() + case
    found, wanted, _copies, decimals = both_ways(seed)
    try:
        alike(found, wanted, decimals)
    except AssertionError as error:
        path = write_replay(
            f"pattern-copies-{seed}",
            {"seed": seed, "found": [row[1] for row in found], "wanted": [row[1] for row in wanted]},
        )
        raise AssertionError(f"CHIPWISE_SEED={seed}, {path}: {error}") from error


def test_most_are_copies():
    """Otherwise the test above compares nothing."""
    counts = [both_ways(seed)[2] for seed in range(60)]
    assert sum(counts) > 60 and any(count == 0 for count in counts)


def test_the_comparison_can_fail():
    found, wanted, _copies, decimals = both_ways(3)
    for k, (move, text, feed) in list(enumerate(found))[:20]:
        number = _NUMBER.search(text)
        if number:
            wrong = text.replace(number[0], f"{float(number[0]) + 3 * 10**-decimals:.{decimals}f}", 1)
            with pytest.raises(AssertionError):
                alike([*found[:k], (move, wrong, feed), *found[k + 1 :]], wanted, decimals)
    with pytest.raises(AssertionError):
        alike(found[:-1], wanted, decimals)


def test_a_copy_fills_more_than_a_chunk():
    """Long copies are divided at a traverse, as single moves are; the path mode of a chunk begins it."""
    steps = [Code("G64 P0.01"), Step(RAPID, 0, (0.0, 0.0, 9.0))]
    for k in range(1500):
        steps += [Step(RAPID, 0, (float(k), 0.0, 9.0)), Step(FEED, 0, (float(k), 1.0, -1.0), 100.0)]
    recorded, copier = Recorded(tuple(steps), (), (0.0, 0.0, 9.0), path=True), Copier(CHORD)
    moves = [
        move
        for k in range(3)
        for move in copier.moves(recorded, recorded.points, (0.0, 0.0, 9.0), placed(0, 0.0, (0.0, 5.0 * k, 0.0)))
    ]
    assert [isinstance(move, Copy) for move in moves[-2:]] == [True, True]
    chunks = gcode_lines.chunks(moves, (0.0, 0.0, 9.0), 1.0)
    sizes = [sum(text.count("\n") + 1 for _feed, text, *_ in chunk) for chunk in chunks]
    assert len(chunks) >= 4 and max(sizes) <= gcode_lines.CHUNK_MOVES + 3
    assert all(chunk[0][1].startswith("G64 P0.01") for chunk in chunks)


@pytest.mark.parametrize("copies, refused", [(250, False), (251, True), (100_000, True)])
def test_too_many_moves_are_known_after_two_copies(copies, refused, monkeypatch):
    """100,000 copies of a sub are not placed before the plan is refused; four moves each, 1,000 in all are allowed."""
    steps = (
        Step(RAPID, 0, (1.0, 2.0, 9.0)),
        Step(FEED, 0, (1.0, 2.0, -1.0), 100.0),
        Step(FEED, 0, (5.0, 2.0, -1.0), 100.0),
        Step(RAPID, 0, (5.0, 2.0, 9.0)),
    )
    placed_ones, place = [], Copier.moves
    monkeypatch.setattr(Copier, "moves", lambda *arguments: placed_ones.append(1) or place(*arguments))
    request = PatternRequest(
        shift=(0.0, 0.0, 0.0), start=(3.0, 4.0, 10.0), chord=CHORD, most_moves=1000, copies=copies, step=(7.0, 0.0)
    )
    try:
        plan = pattern_plan(request, lambda start, abc, mirrored: Recorded(steps, (), start, abc))
        assert not refused and plan.report().figures["moves"] == 4 * copies == sum(
            len(getattr(move, "moves", "1")) for move in plan.moves
        )
    except CycleError as error:
        assert refused and "the pattern has more than 1000 moves" in str(error) and len(placed_ones) <= 3, error


def test_a_place_that_is_not_finite_stays_visible():
    """A number that no control reads must not be rounded away."""
    recorded = Recorded(
        (Step(RAPID, 0, (0.0, 0.0, 1.0)), Step(FEED, 0, (math.nan, 0.0, 1.0), 100.0)), (), (0.0, 0.0, 9.0)
    )
    copier = Copier(CHORD)
    moves = [
        move
        for _ in range(2)
        for move in copier.moves(recorded, recorded.points, (0.0, 0.0, 9.0), placed(0, 0.0, (0.0, 0.0, 0.0)))
    ]
    texts = [text for _move, text, _feed in gcode_lines._lines(moves, (0.0, 0.0, 9.0), 1.0)]
    assert sum("nan" in text for text in texts) == 2, json.dumps(texts)
    assert np.isnan(recorded.points).any()
