# SPDX-License-Identifier: GPL-2.0-or-later
"""Where a level climbs the wall it ends at: as high as there is stock, and not where the finish comes later and the
tooth that stays is thin."""

import math
import random

import pytest

from chipwise.turning import passes, path
from support import turning_rig
from support.random_cases import random_count, random_seed, write_replay
from support.turning_cut import Section, lengths
from support.turning_oracle import moves
from support.turning_random import Case, random_case
from support.turning_rig import planned

NOSE, LEAN = 0.4, math.tan(math.radians(5.0))  # of T1 in support/turning_rig.py: D0.8 I85 J5
SHOULDER = [(0.0, 10.0), (-20.0, 10.0), (-20.0, 14.0), (-30.0, 14.0)]
FOUND = 713421410  # of the random parts one whose last level of roughing is too narrow to leave it aside


def shaft(folder, allowance, depth, blank=16.0):
    """(plan, G-code, tools, case) of a shaft with one shoulder from Z-20."""
    text = "\n".join(
        [
            f"(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER={2 * blank},ZMIN=-60,ZMAX=0)",
            "G21 G18 G8 G94 G97 S500 M3",
            f"G26 Q100 I{allowance} D{depth} F100 E50",
            "M2",
            "O100 sub",
            "G0 X10 Z0",
            "G1 Z-20",
            "G1 X14",
            "G1 Z-30",
            "O100 endsub",
            "",
        ]
    )
    case = Case(text, SHOULDER, [], (blank, -60.0, 0.0), allowance, "D55")
    plan, _, machine, written = planned(case, folder)
    return plan, written, machine.tools, case


def climbs(plan, name):
    """[(z, from x, to x)] of the feeds of a step straight away from the axis that end a cut."""
    found = []
    for step in plan.steps:
        z, x = step.start
        for m, after in zip(step.moves, step.moves[1:]) if step.name == name else ():
            if m.kind == "feed" and after.kind == "rapid" and abs(m.z - z) < 1e-7 and m.x > x:
                found.append((m.z, x, m.x))
            z, x = m.z, m.x
    return found


def test_a_wall_is_climbed_by_the_finish_only(tmp_path):
    assert climbs(shaft(tmp_path, 0.3, 1.0)[0], "rough outside") == []
    assert [c[0] for c in climbs(shaft(tmp_path, 0.3, 1.0)[0], "finish outside")] == pytest.approx([-30 + NOSE])
    assert len(climbs(shaft(tmp_path, 0.0, 1.0)[0], "rough outside")) >= 5  # nothing comes after it


def test_a_thick_tooth_is_cut_at_once(tmp_path):
    """What leans at the wall is then more than half of the allowance."""
    assert LEAN * 1.5 < 0.15 < LEAN * 2.0
    assert climbs(shaft(tmp_path, 0.3, 1.5)[0], "rough outside") == []
    assert [x - low > 2.0 for _, low, x in climbs(shaft(tmp_path, 0.3, 2.5)[0], "rough outside")] == [True]
    assert len(climbs(shaft(tmp_path, 0.1, 1.0)[0], "rough outside")) >= 4


def test_without_a_finish_in_the_order_every_level_climbs(tmp_path, monkeypatch):
    order = tuple(name for name in turning_rig.ORDER if not name.startswith("finish"))
    assert not climbs(shaft(tmp_path, 0.3, 1.0)[0], "rough outside")
    monkeypatch.setattr(turning_rig, "ORDER", order)
    assert len(climbs(shaft(tmp_path, 0.3, 1.0)[0], "rough outside")) >= 4


def test_a_climb_ends_where_the_stock_ends(tmp_path):
    """The widest place of the nose has passed the bar: its centre is at the bar's radius, not a nose radius above
    it."""
    last = climbs(shaft(tmp_path, 0.3, 1.0)[0], "finish outside")[-1]
    assert last[2] == pytest.approx(16.0, abs=1e-6)


@pytest.mark.parametrize("allowance, depth", [(0.3, 1.0), (0.3, 1.5), (0.3, 2.0), (0.0, 1.0)])
def test_nothing_stays_at_the_wall_in_the_end(tmp_path, allowance, depth):
    """Cells of 0.01 mm: the insert as a wedge leaves nothing beside the shoulder, from the fillet of the nose up to the
    bar."""
    assert _left(*shaft(tmp_path, allowance, depth)[1:]) == 0


def _left(text, tools, case):
    section = Section(case.blank, 0.01)
    for number, _, points in moves(text, 1.0):
        for z, x in points[1:]:
            section.cut(number, tools[number], z, x)
    rows, columns = (
        slice(int(10.9 / 0.01), None),
        slice(int((-19.97 - section.z0) / 0.01), int((0.0 - section.z0) / 0.01)),
    )
    return int(section.cells[rows, columns].sum())


def test_the_cells_see_teeth_that_stay(tmp_path, monkeypatch):
    monkeypatch.setattr(passes, "_climb", lambda path, wall, level, aside: None)
    assert _left(*shaft(tmp_path, 0.0, 1.0)[1:]) > 100


def test_a_cut_that_cannot_be_left_aside_is_climbed(tmp_path, monkeypatch):
    """Else the rapid away from it goes up along the tooth, or a feed if rapids keep clear of stock."""

    def rapid():
        case = random_case(random.Random(FOUND))
        _, request, machine, text = planned(case, tmp_path)
        return lengths(text, request.scale, case.blank, machine.tools, 0.005)["rapid"]

    assert rapid() == 0.0
    plain = passes._climb
    monkeypatch.setattr(passes, "_climb", lambda path, wall, level, aside: plain(path, wall, level, True))
    monkeypatch.setattr(passes.Path, "_free", lambda path, z0, z1: -math.inf)
    monkeypatch.setattr(path, "LEAVES", path.LEAVES[:1])
    assert rapid() > 0.02


@pytest.mark.parametrize("k", range(min(random_count(4), 200)))
def test_no_rapid_cuts_a_tooth(k, tmp_path):
    """Cells of 0.01 mm, on which teeth are; they are not in the plan's own stock."""
    seed = random_seed() * 1_009 + k
    case = random_case(random.Random(seed), allowance=0.3)
    replay = write_replay(f"turning_walls_{seed}", {"seed": seed, "text": case.text})
    _, request, machine, text = planned(case, tmp_path)
    assert lengths(text, request.scale, case.blank, machine.tools, 0.01)["rapid"] == 0.0, f"seed {seed}, {replay}"
    replay.unlink()
