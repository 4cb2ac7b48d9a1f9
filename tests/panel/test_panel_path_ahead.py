# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the tool is on the path of a program: random programs, run at random speeds and looked at as the page does,
against where it really is."""

import itertools
import math
import os
import random

import numpy as np
import pytest

from chipwise.check import drawn_path
from chipwise.check.drawn_path import Thinner
from chipwise.panel.path_window import anywhere, follow

ROUNDS = int(os.environ.get("CHIPWISE_PANEL_ROUNDS", 30))


def random_program(chance):
    """[(x, y, z), rapid, line] of a program: zigzags, circles, passes at several heights over the same line, plunges; a
    line has one move or many."""
    moves, line, at = [((0.0, 0.0, 10.0), True, 1)], 1, [0.0, 0.0, 10.0]

    def go(x, y, z, rapid, new=True):
        nonlocal line, at
        line += new
        at = [x, y, z]
        moves.append(((x, y, z), rapid, line))

    for _ in range(chance.randrange(2, 6)):
        kind, z = chance.choice(("zigzag", "circle", "passes")), -chance.uniform(0.5, 6)
        go(chance.uniform(-50, 50), chance.uniform(-50, 50), 10.0, True)
        go(at[0], at[1], z, False)
        if kind == "zigzag":
            own = chance.random() < 0.5
            for k in range(chance.randrange(2, 9)):
                go(at[0] + chance.uniform(20, 60) * (-1) ** k, at[1], z, False, own)
                go(at[0], at[1] + chance.uniform(2.5, 5), z, False, own)
        elif kind == "circle":
            x, y, r = at[0], at[1], chance.uniform(2, 30)
            count = max(8, int(r * chance.uniform(5, 40)))
            line += 1
            for k in range(1, count + 1):
                go(
                    x + r * (math.cos(2 * math.pi * k / count) - 1),
                    y + r * math.sin(2 * math.pi * k / count),
                    z,
                    False,
                    False,
                )
        else:
            x, far = at[0], chance.uniform(10, 60)
            for k in range(1, 4):
                go(x + far, at[1], z * k, False)
                go(x, at[1], z * k + 8, True)
        go(at[0], at[1], 10.0, True)
    return moves


def made(moves, **options):
    thinner, points = Thinner(**options), np.array([move[0] for move in moves])
    for first in range(0, len(moves), 997):
        part = moves[first : first + 997]
        thinner.add(
            points[first : first + 997], np.array([move[1] for move in part]), np.array([move[2] for move in part])
        )
    return thinner.path()


def walk(moves, chance):
    """Yield (tip, line, s, reach) as looks find them: s is the length of the whole path, reach that of a machine of
    that speed."""
    s, speed, dt, since = 0.0, 20.0, 0.1, 0.0
    due = speed * dt
    for (start, _r, _l), (end, _rapid, line) in itertools.pairwise(moves):
        length, at = math.dist(start, end), 0.0
        while at + due - since <= length:
            at += due - since
            since = 0.0
            yield (
                tuple(a + (b - a) * at / length for a, b in zip(start, end)),
                line,
                s + at,
                2.0 + 1.5 * max(speed, 60.0) * dt,
            )
            speed = chance.choice((1.0, 10.0, 20.0, 60.0))
            due = speed * dt * chance.uniform(0.8, 1.5)
        since += length - at
        s += length


@pytest.mark.parametrize("seed", range(ROUNDS))
@pytest.mark.parametrize("lines", [True, False])
def test_the_tool_is_followed(seed, lines):
    """The place is never more than 1.5 mm of path from the true one; without lines it may be on another move through
    there."""
    chance = random.Random(seed)
    moves = random_program(chance)
    path, done = made(moves), 0.0
    for tip, line, s, reach in walk(moves, chance):
        found = follow(path, done, tip, line if lines else 0, reach)
        assert found is not None and found >= done, f"seed {seed}, {s:.2f} of {path.s[-1]:.2f}"
        done = found
        assert abs(done - s) < (1.5 if lines else 30.0), f"seed {seed}: {done:.2f} for {s:.2f}"
    assert path.s[-1] - done < 10


@pytest.mark.parametrize("seed", range(ROUNDS))
def test_it_is_found_again(seed):
    """Run from line: the tool is in the middle of a program of which every line has its own place."""
    chance = random.Random(seed)
    moves = random_program(chance)
    path = made(moves)
    tips = list(walk(moves, chance))
    for tip, line, s, _reach in chance.sample(tips, min(20, len(tips))):
        found = anywhere(path, 0.0, tip, line)
        k = path.after(found)
        assert (
            path.low[min(k, len(path.s) - 1)] <= line + 1
            and math.isclose(found, s, abs_tol=1.5)
            or _twice(moves, tip, line)
        ), f"seed {seed}: {found:.2f} for {s:.2f}"
    assert anywhere(path, 0.0, (0.0, 0.0, 400.0), 0) is None and follow(path, 0.0, (3.0, 99.0, 400.0), 0, 1e9) is None


def _twice(moves, tip, line):
    """Whether a line goes near a place more than once."""
    near = 0
    for (start, _r, _l), (end, _rapid, own) in itertools.pairwise(moves):
        along = np.subtract(end, start)
        t = np.clip(np.dot(np.subtract(tip, start), along) / max(np.dot(along, along), 1e-12), 0, 1)
        near += own == line and np.linalg.norm(np.subtract(tip, start) - t * along) < 1.2
    return near > 1


@pytest.mark.parametrize("seed", range(ROUNDS))
def test_thinned(seed):
    """No point of the program is further from the path than its step; every line of the program is on it; the ends of
    long moves stay."""
    chance = random.Random(seed)
    moves = random_program(chance)
    most = chance.choice((50, 400_000))
    path = made(moves, most=most)
    assert len(path.points) <= most and path.step == pytest.approx(
        drawn_path.STEP_MM * 2 ** round(math.log2(path.step / drawn_path.STEP_MM))
    )
    assert (path.step == drawn_path.STEP_MM) >= (most > 50) and np.allclose(
        path.points[[0, -1]], [moves[0][0], moves[-1][0]], atol=1e-4
    )
    kept = path.points.astype(float)
    for point, _rapid, line in moves:
        near = np.linalg.norm(kept - point, axis=1) <= path.step + 1e-3
        assert near.any(), f"seed {seed}: {point}"
        assert path.low.min() <= line <= path.high.max()
    for corner in [
        end[0] for a, b in itertools.pairwise(moves) if math.dist(a[0], b[0]) > 2 * path.step for end in (a, b)
    ]:
        assert np.linalg.norm(kept - corner, axis=1).min() < 1e-3, f"seed {seed}"
    assert path.s[-1] <= sum(math.dist(a[0], b[0]) for a, b in itertools.pairwise(moves)) + 0.01


def test_a_million_moves():
    """They become no more than MOST_POINTS, and no point is far from one that is kept."""
    turn = np.arange(1_000_000) * 0.005
    radius = 5 + turn * 0.02
    points = np.stack((radius * np.cos(turn), radius * np.sin(turn), -turn * 1e-3), axis=1)
    thinner = Thinner()
    for first in range(0, len(points), 4096):
        thinner.add(
            points[first : first + 4096],
            np.zeros(len(points[first : first + 4096]), bool),
            np.arange(first, first + len(points[first : first + 4096])),
        )
    path = thinner.path()
    assert (
        200_000 < len(path.points) <= drawn_path.MOST_POINTS
        and path.low[1] <= 1
        and path.high[-1] == 999_999
        and path.step <= 0.8
    )
    done = follow(path, path.s[200_000] - 3, path.points[200_000], 0, 20.0)
    assert done == pytest.approx(path.s[200_000], abs=0.3)


@pytest.mark.parametrize("holes", [300, 700, 5000])
def test_many_holes(holes):
    """As many changes of feed and traverse as there is room for, or more: the bound holds, no point is far from one
    that is kept, and where there is room each change is kept."""
    place = np.arange(holes)
    top = np.stack((place % 50 * 10.0, place // 50 * 10.0, np.full(holes, 2.0)), axis=1)
    bottom = top - (0.0, 0.0, 12.0)
    points, rapid, thinner = np.stack((top, bottom, top), axis=1), np.array([True, False, True]), Thinner(2000)
    for first in range(0, holes, 100):
        part = points[first : first + 100].reshape(-1, 3)
        thinner.add(part, np.tile(rapid, len(part) // 3), np.arange(len(part)) + 3 * first)
    path = thinner.path()
    assert len(path.points) <= 2000 and (path.low[0], path.high[-1]) == (0, 3 * holes - 1)
    off = [float(np.linalg.norm(path.points - point, axis=1).min()) for point in points.reshape(-1, 3)]
    assert max(off) <= path.step + 1e-3
    if holes < 500:
        assert np.count_nonzero(np.diff(path.rapid)) == 2 * holes and max(off) < 1e-3
    length = np.linalg.norm(np.diff(points.reshape(-1, 3), axis=0), axis=1).sum()
    assert path.step <= 2 * length / (
        0.75 * 2000
    )  # no coarser than the bound makes it: of 3/4 of the points, to the next doubling


@pytest.mark.parametrize("points", [0, 1])
def test_no_path(points):
    thinner = Thinner()
    thinner.add(np.zeros((points, 3)), np.zeros(points, bool), np.ones(points))
    assert thinner.path() is None
