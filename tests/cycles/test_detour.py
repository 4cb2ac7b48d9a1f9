# SPDX-License-Identifier: GPL-2.0-or-later
"""cycles/detour.py and obstacles.py: 300 random cycles among random clamps, before an oracle written apart
(support/clamp_oracle.py, support/detour_oracle.py).

What is planned touches nothing and keeps the clearance.  What is refused has a cut that does not, or a link for which
no route is found on a grid.
"""

import random

import numpy as np
import pytest

from chipwise.clamps.clamp import Clamp
from chipwise.clib.height_map import Shape
from chipwise.cycles import obstacles
from chipwise.cycles.detour import Detour
from chipwise.errors import CycleError
from chipwise.moves import Blend, Code, Copy, Line, Rapid
from support import detour_oracle
from support.random_cases import random_count, random_seed, write_replay
from support.detour_cases import TOOLS, DetourCase

LIMITS = {
    "matrix": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "shift": (0.0, 0.0, 0.0),
    "limits": (("axis X", -90.0, 90.0), ("axis Y", -90.0, 90.0), ("axis Z", -90.0, 30.0)),
}
BOX = Clamp(0, 0.0, (-10.0, -10.0, -20.0), (10.0, 10.0, 50.0), "clamp jaw of set-up 2")


def test_random_cycles_among_clamps(capsys):
    count, seed = random_count(300), random_seed()
    rng, sums = random.Random(seed), {"as planned": 0, "led": 0, "cut": 0, "no route": 0}
    for number in range(count):
        case = DetourCase(rng)
        try:
            sums[judge(case)] += 1
        except AssertionError as error:
            path = write_replay(f"detour_{seed}_{number}", case.words())
            raise AssertionError(f"seed {seed}, case {number}: {error}; replay {path}") from error
    with capsys.disabled():
        print(f"\n{count} cycles: {sums}")
    assert min(sums.values()) >= count // 60, sums


def judge(case):
    """What has become of a DetourCase, compared with the oracle."""
    try:
        found = case.obstacles().clear(case.moves, case.start, "mm", case.plane, case.keep)
    except CycleError as error:
        cut, lost = detour_oracle.hindered(case)
        assert cut or lost, f"refused though it can be reached: {error.text()}"
        assert ("a cut" in error.text() or "a traverse" in error.text()) or lost, error.text()
        return "no route" if "no traverse leads" in error.text() else "cut"
    worst = detour_oracle.nearest(case, found)
    assert worst > case.clearance - detour_oracle.SAMPLED_MM, f"comes within {worst} mm"
    assert [move for move in singly(found) if not isinstance(move, (Rapid, Blend))] == [
        move for move in singly(case.moves) if not isinstance(move, (Rapid, Blend))
    ]
    return "as planned" if found is case.moves else "led"


def singly(moves):
    return [one for move in moves for one in (obstacles._singly(move) if isinstance(move, Copy) else (move,))]


def route(start, end, base, limits=None, clamps=(BOX,), along=None):
    return Detour(clamps, 1.0, Shape(6.0), limits).route(start, end, base, along)


def test_the_shorter_route_is_taken():
    low = Clamp(0, 0.0, (-10.0, -80.0, -20.0), (10.0, 80.0, 8.0), "low")
    assert route((-30.0, 0.0, 5.0), (30.0, 0.0, 2.0), 5.0, clamps=(low,)) == [
        (-30.0, 0.0, 9.02),
        (30.0, 0.0, 9.02),
        (30.0, 0.0, 2.0),
    ]
    round_it = route((-30.0, 0.0, 5.0), (30.0, 0.0, 2.0), 5.0)
    assert {place[2] for place in round_it[:-1]} == {5.0} and max(abs(place[1]) for place in round_it) > 14.0


def test_a_wall_higher_than_the_axis_reaches_has_no_route():
    wall = Clamp(0, 0.0, (-10.0, -95.0, -20.0), (10.0, 95.0, 50.0), "wall")
    assert route((-30.0, 0.0, 5.0), (30.0, 0.0, 2.0), 5.0, LIMITS, (wall,)) is None
    assert route((-30.0, 0.0, 5.0), (30.0, 0.0, 2.0), 5.0, None, (wall,)) is not None
    with pytest.raises(
        CycleError, match="no traverse leads past the clamps to X30 Y0 Z2 within the limits of the axes"
    ):
        obstacles.Obstacles((wall,), 1.0, Shape(6.0), LIMITS).clear(
            (Rapid(30.0, 0.0), Rapid(z=2.0), Line(z=-1.0)), (-30.0, 0.0, 5.0), "mm", 5.0
        )


def test_a_sub_keeps_its_path_where_that_is_free_higher_up():
    """From place to place above the same line: nothing is known of what stands beside it."""
    assert route((-30.0, 0.0, 5.0), (30.0, 0.0, 5.0), 5.0, along=[(0.0, 3.0)]) == [
        (-30.0, 0.0, 51.02),
        (0.0, 3.0, 51.02),
        (30.0, 0.0, 51.02),
        (30.0, 0.0, 5.0),
    ]


def test_the_path_mode_of_the_plan_goes_on():
    """Corners of a route are blended by less than the margin that they have."""
    moves = Blend(0.3), Line(-30.0, 0.0, 5.0), Code("G64 P0.2"), Rapid(30.0, 0.0), Line(z=2.0)
    found = obstacles.Obstacles((BOX,), 1.0, Shape(6.0)).clear(moves, (-40.0, 0.0, 5.0), "mm", 5.0)
    modes = [move for move in found if isinstance(move, (Blend, Code))]
    assert modes == [Blend(0.3), Code("G64 P0.2"), Blend(0.01), Code("G64 P0.2")]


def test_copies_are_led_as_well():
    own = (Rapid(-30.0, 0.0, 5.0), Line(-30.0, 0.0, -1.0), Rapid(-30.0, 0.0, 5.0))
    places = np.array([[30.0, 0.0, 5.0, 0, 0, 0], [30.0, 0.0, -1.0, 0, 0, 0], [30.0, 0.0, 5.0, 0, 0, 0]])
    found = obstacles.Obstacles((BOX,), 1.0, Shape(6.0)).clear(
        (*own, Copy(own, places)), (-30.0, 0.0, 20.0), "mm", None, True
    )
    assert Line(30.0, 0.0, -1.0) in found and max(move.z for move in found if isinstance(move, Rapid)) > 51.0


@pytest.mark.parametrize("tool", TOOLS)
def test_the_oracle_sees_a_route_that_was_not_led(tool):
    """It can fail: plans as they were, among the same clamps."""
    rng, touched = random.Random(5), 0
    for _ in range(25):
        case = DetourCase(rng, tool=tool)
        touched += detour_oracle.nearest(case, case.moves) < case.clearance - detour_oracle.SAMPLED_MM
    assert touched >= 5
