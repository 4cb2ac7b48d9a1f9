# SPDX-License-Identifier: GPL-2.0-or-later
"""M256 and the cycles: one that comes nearer to a clamp of the set-up than CLAMP_CLEARANCE is refused by its name, and moves nothing."""
import math
import random

import pytest

from chipwise.clib.height_map import Shape
from chipwise.clamps.clamp import Clamp
from chipwise.cycles.obstacles import Obstacles
from chipwise.errors import CycleError
from chipwise.moves import Arc, Line, Rapid
from support import canon, clamp_oracle

SET_UP = "[set_up.2.clamp.jaw]\nbox = [40, -12, -20, 60, -2, 8]\n[set_up.2.clamp.stop]\ncylinder = [0, 60, -20, 30, 10]\n[set_up.3]\n"
HEAD = "G21 G90 G64 G94 G17 G40 G54\nT1 M6\nS5000 M3\nF600\n"
SUB = "o200 sub\nG0 X5 Y-20\nG0 Z2\nG1 Z-1 F100\nG1 Y-14\nG0 Z20\no200 endsub\no100 sub\nG0 X20 Y2\nG1 X80\nY30\nX20\nY2\no100 endsub\n"


def run(text, tmp_path, **settings):
    path = tmp_path / "clamps.toml"
    path.write_text(SET_UP)
    return canon.run_preview(SUB + HEAD + text + "\nM2\n", tools={1: 6.0}, CLAMPS=str(path), **settings)


REFUSED = {
    "M256 P2\nG0 X50 Y5 Z20\nG13 X50 Y5 I9 Z-3 R10": "G13: a cut of the tool meets clamp jaw of set-up 2 at X",
    "M256 P2\nG0 X50 Y9 Z20\nG13 X50 Y6.5 I8 Z-3 R10": "G13: a cut of the tool comes within 0.5 mm of clamp jaw of set-up 2 at X",
    "M256 P2\nG0 X50 Y-7 Z8.5\nG13 X50 Y20 I6 Z-3 R5": "G13: a traverse of the tool comes within 0.5 mm of clamp jaw of set-up 2",
    "G10 L2 P1 X0 Y-5 R0\nM256 P2\nG0 X50 Y20 Z20\nG79 Q100 Z-2 R15": "G79: a cut of the tool meets clamp jaw of set-up 2",
    "G10 L2 P1 X0 Y0 R90\nM256 P2\nG0 X5 Y-50 Z20\nG13 X5 Y-50 I9 Z-3 R10": "G13: a cut of the tool meets clamp jaw of set-up 2 at X-1 Y-",
    "G20\nM256 P2\nG0 X2 Y0.2 Z1\nG13 X2 Y0.2 I0.3 Z-0.1 R0.5": "G13: a cut of the tool meets clamp jaw of set-up 2 at X",
    "M256 P2\nG0 X0 Y0 Z20\nG75 Q200 L4 I12": "G75: a cut of the tool meets clamp jaw of set-up 2 at X",
    "M256 P9": "M256: there is no set-up P9 of clamps; there are 2, 3",
}
ALLOWED = [
    "M256 P2\nG0 X0 Y0 Z20\nG75 Q200 L3 I12",
    "M256 P2\nM256 P0\nG0 X50 Y5 Z20\nG13 X50 Y5 I9 Z-3 R10",
    "M256 P3\nG0 X50 Y5 Z20\nG13 X50 Y5 I9 Z-3 R10",
    "M256 P2\nG0 X50 Y10 Z20\nG13 X50 Y7.01 I8 Z-3 R10",
    "M256 P2\nG0 X50 Y-30 Z5\nG13 X50 Y20 I6 Z-3 R5",
    "M256 P2\nG0 X50 Y-30 Z9.001\nG13 X50 Y20 I6 Z-3 R9.001",
]


@pytest.mark.parametrize("text", REFUSED)
def test_a_cycle_into_a_clamp_is_refused(tmp_path, text):
    trace = run(text, tmp_path)
    assert trace.error.startswith("chipwise: " + REFUSED[text]), trace.error
    assert len(trace.elements) <= 2         # the move to the place before it


@pytest.mark.parametrize("text", ALLOWED)
def test_one_that_keeps_clear_is_not(tmp_path, text):
    trace = run(text, tmp_path)
    assert not trace.error and len(trace.elements) > 3


def test_random_moves_against_a_sampled_sweep():
    """Arcs of both senses, helices and lines, seen from turned work coordinates."""
    rng, refused = random.Random(3), 0
    for _ in range(150):
        low = [rng.uniform(-20, 0) for _ in range(3)]
        high = [a + rng.uniform(2, 20) for a in low]
        turn, origin = rng.choice([0, 90, 30.5]), [rng.uniform(-5, 5) for _ in range(3)]
        clamp = Clamp(0, 0.0, tuple(low), tuple(high), "box").seen_from(origin, turn)
        start, end = ([rng.uniform(-25, 25) for _ in range(3)] for _ in range(2))
        move, path = Line(*end), clamp_oracle.line(start, end)
        if rng.random() < 0.5:
            ccw, centre, sweep = rng.random() < 0.5, [rng.uniform(-20, 20) for _ in range(2)], rng.uniform(0.5, 6)
            radius, first = math.dist(start[:2], centre), math.atan2(start[1] - centre[1], start[0] - centre[0])
            angles = [first + (sweep if ccw else -sweep) * k / 2000 for k in range(2001)]
            path = clamp_oracle.np.array([(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a), start[2] + (end[2] - start[2]) * k / 2000)
                                          for k, a in enumerate(angles)])
            move = Arc(path[-1][0], path[-1][1], centre[0], centre[1], ccw, end[2])
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        to_machine = [(x * c - y * s + origin[0], x * s + y * c + origin[1], z + origin[2]) for x, y, z in path]
        box = {"corners": [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])], "top": high[2]}
        near = clamp_oracle.nearest({"shape": "ball", "diameter": 8.0}, "tool", box, clamp_oracle.np.array(to_machine))
        if abs(near - 1.0) < 0.06:
            continue
        try:
            Obstacles((clamp,), 1.0, Shape(8.0, 4.0)).refuse((move, Rapid(z=100.0)), start, "mm")
            assert near > 1.0, (start, move, near)
        except CycleError as error:
            refused += 1
            assert near < 1.0 and "a cut of the tool" in error.text(), (start, move, near)
    assert 30 < refused < 120
