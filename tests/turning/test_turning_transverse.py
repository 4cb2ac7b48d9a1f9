# SPDX-License-Identifier: GPL-2.0-or-later
"""Roughing in columns towards the axis: where it is chosen, that it is shorter, and that nothing is touched
(support/turning_oracle.py)."""

import json
import os
import random
from dataclasses import replace
import re

import pytest

from chipwise import cli
from chipwise.turning import transverse
from chipwise.turning.plan import lengths
from support import ROOT
from support.random_cases import random_count, random_seed, write_replay
from support.turning_cut import lengths as cut_lengths
from support.turning_oracle import judge
from support.turning_random import Case, random_case
from support.turning_rig import Machine, planned

RAPID, RETURN_MM = 0.1, 1.0  # as docs/design/turning.md says: what a mm of rapid and the return of a cut count


def disc(step, hub, allowance=0.3, depth=1.0, radius=40.0):
    """Program of a disc whose hub, of radius `hub`, is `step` mm long."""
    return "\n".join(
        [
            f"(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER={2 * radius},ZMIN=-50,ZMAX=0)",
            "(LATHE,ROUGH=1,FINISH=2)",
            "G21 G18 G8 G94 G97 S500 M3",
            f"G26 Q100 I{allowance} D{depth} F100 E50",
            "M2",
            "O100 sub",
            f"G0 X{hub} Z0",
            f"G1 Z-{step}",
            "G1 X38",
            "G1 Z-20",
            "O100 endsub",
            "",
        ]
    )


@pytest.fixture
def rough(tmp_path, capsys):
    """(program, line of T1 in the tool table, its holder) -> (plan's data of rough outside, text)."""

    def run(text, line="T1 P1 D0.8 I85 J5 Q2", holder="[0, 25, 8]"):
        with open(os.path.join(ROOT, "configs", "lathe.ini")) as file:
            (tmp_path / "lathe.ini").write_text(file.read())
        (tmp_path / "lathe_tools.toml").write_text(
            f"[lathe.1]\nedge_length = 12\ndepth = 4\nholder = {holder}\n[lathe.2]\nedge_length = 11\n"
            f"holder = [0, 25, 8]\n"
        )
        (tmp_path / "lathe.tbl").write_text(line + "\nT2 P2 D0.8 I87 J32 Q2\n")
        (tmp_path / "part.ngc").write_text(text)
        status = cli.main(
            [
                "turn",
                str(tmp_path / "part.ngc"),
                "--json",
                str(tmp_path / "plan.json"),
                "-o",
                str(tmp_path / "out.ngc"),
                "--ini",
                str(tmp_path / "lathe.ini"),
            ]
        )
        said = capsys.readouterr()
        assert status in (0, 1), said
        steps = {s["name"]: s for s in json.loads((tmp_path / "plan.json").read_text())["steps"]}
        return steps["rough outside"], said.out

    return run


def test_a_wide_shallow_step_is_cut_towards_the_axis(rough):
    step, said = rough(disc(3, 12))
    ((z0, z1),) = step["transverse"]
    assert z0 == pytest.approx(-3 + 0.3 + 0.4, abs=0.2) and z1 == pytest.approx(
        0.4, abs=1e-3
    )  # the centre of the nose: allowance, radius
    assert "longitudinal, towards -Z and transverse, towards the axis" in said and "transverse: Z0.400 to Z-2." in said


def test_the_layer_above_a_step_is_cut_along_z_first(rough):
    """2 mm on the rim, 20 mm long, and a step of 3 mm: in columns all of it would be 20 cuts."""
    ((z0, z1),) = rough(disc(3, 12, allowance=0))[0]["transverse"]
    assert z1 - z0 < 3.5


def test_a_long_step_is_cut_along_z(rough):
    step, said = rough(disc(18, 30))
    assert step["transverse"] == [] and "transverse" not in said.split("finish outside")[0].split("rough outside")[1]


def test_an_edge_that_reaches_over_the_wall_cuts_no_columns(rough):
    assert rough(disc(3, 12))[0]["transverse"]
    assert not rough(disc(3, 12), "T1 P1 D0.8 I95 J5 Q2")[0]["transverse"]


def test_a_holder_beside_the_nose_cuts_no_columns(rough):
    assert not rough(disc(3, 12), holder="[-2, 25, 8]")[0]["transverse"]
    assert rough(disc(1, 32, radius=39.0), holder="[-2, 25, 8]")[0]["transverse"]  # the wall is lower than the holder


def test_the_holder_is_seen_by_the_oracle(tmp_path, monkeypatch):
    """Without the check of the holder it goes into the stock that the columns leave beside it."""
    text = disc(3, 12)
    case = Case(text, [(0.0, 12.0), (-3.0, 12.0), (-3.0, 38.0), (-20.0, 38.0)], [], (40.0, -50.0, 0.0), 0.3, "D55")

    def holder(wanted):
        plain = Machine.__init__

        def wide(self, folder, insert):
            plain(self, folder, insert)
            (folder / "tools.toml").write_text(
                (folder / "tools.toml").read_text().replace("holder = [0, 25, 8]", "holder = [-2, 25, 8]")
            )
            self.tools[1] = replace(self.tools[1], holder=(-2, 25, 8))

        with monkeypatch.context() as patch:
            patch.setattr(Machine, "__init__", wide)
            if not wanted:
                patch.setattr(transverse, "_holder_clear", lambda *_: True)
            _, request, machine, written = planned(case, tmp_path)
        return judge(written, request.scale, case, machine.tools)[0]["holder"]

    assert holder(True) <= -0.19  # mm that it keeps beside it
    assert holder(False) > 1.0


@pytest.mark.parametrize("k", range(random_count(8)))
def test_random_discs_are_turned_without_gouge_or_collision(k, tmp_path):
    seed = random_seed() * 100_019 + k
    case = random_case(random.Random(seed), wide=True)
    replay = write_replay(f"turning_disc_{seed}", {"seed": seed, "text": case.text})
    plan, request, machine, text = planned(case, tmp_path)
    found, _, _ = judge(text, request.scale, case, machine.tools)
    said = f"seed {seed}, {replay}: {found}"
    assert found["gouge"] <= 0.001 and found["rapid"] <= 0.002 and found["holder"] <= 0.001, said
    replay.unlink()
    assert plan.steps


@pytest.mark.parametrize("k", range(min(random_count(3), 100)))
def test_no_rapid_of_a_column_cuts(k, tmp_path):
    """Cells of 0.02 mm: teeth that levels have left at walls are on them."""
    seed = random_seed() * 1_013 + k
    case = random_case(random.Random(seed), wide=True, allowance=0.3)
    replay = write_replay(f"turning_disc_cells_{seed}", {"seed": seed, "text": case.text})
    _, request, machine, text = planned(case, tmp_path)
    assert cut_lengths(text, request.scale, case.blank, machine.tools, 0.02)["rapid"] == 0.0, f"seed {seed}, {replay}"
    replay.unlink()


def cost(plan):
    """mm of feed, rapids and returns counted, of the roughing steps."""
    moves = [m for s in plan.steps if re.match("rough|rest", s.name) for m in lengths(s)]
    cuts = sum(len(s.cuts) for s in plan.steps if re.match("rough|rest", s.name))
    return sum(length * (RAPID if kind == "rapid" else 1.0) for kind, length in moves) + RETURN_MM * cuts


@pytest.mark.parametrize("wide", [False, True])
def test_columns_are_chosen_where_they_are_shorter(wide, tmp_path, monkeypatch):
    chosen, longer, total = 0, [], {True: 0.0, False: 0.0}
    for k in range(20):
        case = random_case(random.Random(f"columns {k}"), wide=wide)
        plan = planned(case, tmp_path)[0]
        with monkeypatch.context() as patch:
            patch.setattr(transverse, "choose", lambda *_: None)
            levels = planned(case, tmp_path)[0]
        chosen += any(s.transverse for s in plan.steps)
        longer += [k] if cost(plan) > 1.02 * cost(levels) else []
        total[True], total[False] = total[True] + cost(plan), total[False] + cost(levels)
    assert chosen >= 5 and not longer, (chosen, longer)
    assert total[True] < 0.995 * total[False], total


def test_a_bar_goes_deeper_once_the_bore_is_wider(tmp_path):
    """What a boring bar could not reach before its own roughing is cut by the rest step, by the same tool, and is not
    said to be out of reach."""
    plan = planned(random_case(random.Random("columns 1")), tmp_path)[0]
    rough, rest = (next(s for s in plan.steps if s.name == name) for name in ("rough inside", "rest inside"))
    assert rest.needed and rest.tool.number == rough.tool.number and rest.removed > 1.0, rest.why
