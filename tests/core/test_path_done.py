# SPDX-License-Identifier: GPL-2.0-or-later
"""components/core/path_done.c: the line through the points that are kept is where the tip has been."""

import math
import random

import numpy as np
import pytest

from chipwise.clib import layout
from chipwise.stock.path_done import PathDone
from support.panel_circle import circle, off_circle
from support.panel_rig import Kept
from support.random_cases import random_count, random_seed, write_replay

STRIP = layout.PATH_DONE_STRIP


def kept_points(points):
    """What is kept of a path, with the tip at its end."""
    kept = Kept()
    kept.go(points)
    return np.array([*PathDone(memoryview(kept.done), 0).since(0)[0], points[-1]])


def distance(point, line):
    """From a point to a polyline, mm."""
    first, step = line[:-1], np.diff(line, axis=0)
    share = np.clip(((point - first) * step).sum(1) / np.maximum((step**2).sum(1), 1e-30), 0.0, 1.0)
    return float(np.linalg.norm(first + share[:, None] * step - point, axis=1).min())


def wander(generator):
    """A path of lines, arcs, helices, turns back and pauses, a point a period."""
    at, heading, points = np.array([10.0, 20.0, -3.0]), 0.0, [np.array([10.0, 20.0, -3.0])]
    for _ in range(generator.randint(2, 12)):
        what, step = generator.choice(("line", "arc", "corner", "back", "pause")), generator.choice((0.003, 0.03, 0.2))
        if what == "pause":
            points += [at.copy()] * 5
            continue
        heading += {"corner": generator.uniform(-math.pi, math.pi), "back": math.pi}.get(what, 0.0)
        bend = step / generator.choice((0.3, 2.0, 40.0, -5.0)) if what == "arc" else 0.0
        rise = generator.choice((0.0, 0.0, 0.3, -1.0))
        for _ in range(generator.randint(1, 300)):
            heading += bend
            at = at + step * np.array([math.cos(heading), math.sin(heading), rise])
            points.append(at)
    return np.array(points)


def test_random_paths():
    """Never farther than two halves of a strip from where the tip was, in both directions."""
    seed = random_seed()
    for case in range(random_count(60)):
        path = wander(random.Random(f"{seed}/{case}"))
        line = kept_points(path)
        off = max(distance(point, line) for point in path[::3])
        back = max(distance(point, path) for point in (line[:-1] + line[1:]) / 2)
        if max(off, back) > 2 * STRIP + layout.PATH_DONE_LEAST:
            pytest.fail(
                f"path {case} of seed {seed}: {off:.3f} {back:.3f} mm; "
                f"{write_replay('path_done', {'seed': seed, 'case': case})}"
            )


def test_a_line_is_two_points():
    path = np.linspace((0.0, 0.0, 0.0), (300.0, 200.0, -5.0), 20000)
    assert np.allclose(kept_points(path), path[[0, -1]])


@pytest.mark.parametrize("radius", [0.3, 2.0, 20.0, 200.0])
def test_an_arc_is_within_a_quarter_of_the_strip(radius):
    line = kept_points(circle(radius, 10.0))
    assert off_circle(line, radius) < STRIP / 4 + 0.005
    assert len(line) < 2 * math.pi * radius / math.sqrt(2 * radius * STRIP) + 3


def test_a_turn_back_is_kept():
    out = np.linspace((0.0, 0.0, 0.0), (10.0, 0.0, 0.0), 101)
    assert np.allclose(kept_points(np.vstack([out, out[::-1][1:]])), [out[0], out[-1], out[0]])


def test_not_finite_and_lost():
    kept = Kept()
    kept.go(
        [
            (0.0, 0.0, 0.0),
            (1.0, 0.0, 0.0),
            (math.nan, 0.0, 0.0),
            (math.inf, 0.0, 0.0),
            (5.0, 5.0, 0.0),
            (1e300, -1e300, 1e300),
            (5.0, 5.0, 0.0),
        ]
    )
    points, count = PathDone(memoryview(kept.done), 0).since(0)
    assert count >= 2 and np.isfinite(np.array(kept.done.point[:count])).all()
    assert points[:2].tolist() == [[0.0, 0.0, 0.0], [5.0, 5.0, 0.0]]


def test_what_another_program_counts_moves_nothing():
    kept = Kept()
    kept.go([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
    kept.done.count = 2**63 + 17
    kept.go([(1.0, 1.0, 0.0)])
    assert kept.done.count == 2


def test_a_point_that_is_overwritten_meanwhile_is_left_out():
    """The tracker keeps as many as the ring has while a reader copies it: the oldest of the copy are new ones."""
    kept = Kept()
    size = layout.PATH_DONE_POINTS
    kept.go([(k % 2, float(k), 0.0) for k in range(size + 500)])

    class Late(PathDone):
        looks = 0

        @property
        def count(self):
            self.looks += 1
            if self.looks == 2:
                kept.go([(k % 2, float(k), 0.0) for k in range(size + 500, size + 800)])
            return super().count

    late = Late(memoryview(kept.done), 0)
    points, count = late.since(0)
    assert np.all(np.diff(points[:, 1]) == 1.0) and points[-1, 1] == count - 1 and len(points) == size - 301
