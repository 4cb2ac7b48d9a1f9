# SPDX-License-Identifier: GPL-2.0-or-later
"""Tools of both hands: rest machining and finishing go on as long as a tool reaches more, and no tool that cannot do
all is a reason to refuse."""

import re

import pytest

from support.turning_bench import Bench

GROOVED = "G0 X10 Z0\nG1 Z-8\nG1 X6\nG1 Z-20\nG1 X10\nG1 Z-30\n"
LEFT = {"line": "T10 P10 D0.8 I93 J148 Q1", "table": "edge_length = 11\ndepth = 2\nholder = [-25, 0, 8]\n"}


@pytest.fixture
def bench(tmp_path, capsys):
    """Plans a program with the tools of configs/lathe.tbl and T10, the mirror of T2."""
    return Bench(tmp_path, capsys, {10: LEFT})


def needed(plan):
    return [(s["name"], s["tool"]) for s in plan["steps"] if s["needed"]]


def test_a_left_hand_tool_does_not_make_the_plan_impossible(bench):
    """Before T10 was added T2 came for the rest and the finish; with it the rest was T10's alone, and the finish
    refused."""
    for tools, rest in (("ROUGH=1", [2]), ("ROUGH=1,ROUGH=10", [10, 2])):
        plan = bench.plan(GROOVED, f"{tools},FINISH=2,GROOVE=3")
        assert [tool for name, tool in needed(plan) if name == "rest outside"] == rest
        assert ("finish outside", 2) in needed(plan) and ("groove", 3) in needed(plan)
        assert sum(r["area_mm2"] for r in plan["residue"]) < 0.1  # fillets of noses


def test_both_hands_finish_what_they_reach(bench):
    """A pocket whose walls one hand each reaches: nothing stays in its corners but the fillets."""
    plan = bench.plan(GROOVED, "ROUGH=1,ROUGH=10,FINISH=2,FINISH=10")
    assert [tool for name, tool in needed(plan) if name == "finish outside"] == [2, 10]
    assert max(r["height_mm"] for r in plan["residue"]) < 0.41


def test_the_steps_have_numbers_of_their_own(bench):
    plan = bench.plan(GROOVED, "ROUGH=1,ROUGH=10,FINISH=2,FINISH=10")
    assert [s["number"] for s in plan["steps"]] == list(range(1, len(plan["steps"]) + 1)) and len(plan["steps"]) > 13


def test_what_a_finishing_tool_cannot_take_is_left(bench):
    """Without a roughing tool for the pocket the finish takes what is thin, says what it leaves, and a groove tool
    clears the pocket."""
    plan = bench.plan(GROOVED, "ROUGH=1,FINISH=2,GROOVE=3", steps=["face", "rough outside", "finish outside", "groove"])
    finish = next(s for s in plan["steps"] if s["name"] == "finish outside")
    assert finish["needed"] and "T2 leaves what is thicker than 0.45 mm" in finish["why"]
    assert sum(r["area_mm2"] for r in plan["residue"]) < 0.2


def test_a_tool_that_cannot_go_there_is_passed_over(bench):
    """A drill whose flutes are too short, and one that is long enough."""
    bench.add(11, "T11 P11 D11 Q7", "edge_length = 20\npoint_angle = 118\n")
    bored = "G0 X5.5 Z-30\nG1 Z0\nG1 X14\nG1 Z-30\n"
    status, _, said = bench.turn(bored, "ROUGH=1,FINISH=2,DRILL=11")
    assert status == 2 and "more than the drill's flutes of 20 mm" in said
    bench.add(12, "T12 P12 D10.9 Q7", "edge_length = 60\npoint_angle = 118\n")
    plan = bench.plan(bored, "ROUGH=1,FINISH=2,DRILL=11,DRILL=12")
    assert ("drill", 12) in needed(plan)


def test_what_keeps_a_tool_from_the_face_is_named(bench):
    """An edge at I95 reaches over the face; it is not the holder's fault.  X as the program has it, here a diameter."""
    bench.add(13, "T13 P13 D0.8 I95 J5 Q2", "edge_length = 12\ndepth = 4\nholder = [0, 25, 8]\n")
    status, _, said = bench.turn(GROOVED, "ROUGH=13,FINISH=13")
    assert (
        status == 2
        and "T13 faces down to X" in said
        and "an edge that reaches over the work is in the way" in said
        and "front angle I" in said
    )
    bench.add(14, "T14 P14 D0.8 I85 J5 Q2", "edge_length = 12\ndepth = 4\nholder = [-3, 25, 8]\n")
    assert "its holder is in the way" in bench.turn(GROOVED, "ROUGH=14,FINISH=14")[2]
    assert ("face", 2) in needed(bench.plan(GROOVED, "ROUGH=14,FINISH=2"))
    assert "a barrier is in the way" in bench.turn(GROOVED, "ROUGH=1", more="G22 X4 Z60 K0.5\n")[2]


@pytest.mark.parametrize("mode, twice", [("G8", 1), ("G7", 2)])
def test_part_off_says_x_as_the_program_has_it(bench, mode, twice):
    """The blade's holder, 20 mm above it, would meet a chuck of 32 mm radius, 12 mm from the axis."""
    part, chuck = f"G0 X{10 * twice} Z0\nG1 Z-30\n", f"G22 X{32 * twice} Z-34.5\n"
    status, _, said = bench.turn(part, "ROUGH=1,FINISH=2,PARTOFF=6", mode=mode, more=chuck)
    assert status == 2, said
    assert (
        11.5
        < float(re.search(r"T6 parts off down to X([\d.]+) mm only, for a barrier is in the way", said)[1]) / twice
        < 13.1
    ), said


def test_a_bore_of_the_drill_is_drilled_with_an_allowance(bench):
    """No drill leaves 0.3 mm in a bore of its own diameter."""
    bored = "G0 X6 Z-30\nG1 Z0\nG1 X15\nG1 Z-30\n"
    for tools in ("ROUGH=1,FINISH=2,DRILL=5", "ROUGH=1,FINISH=2,ROUGH=7,FINISH=7,DRILL=5"):
        plan = bench.plan(bored, tools)
        assert ("drill", 5) in needed(plan)
        assert sum(r["area_mm2"] for r in plan["residue"]) < 0.05


def test_a_smaller_drill_is_not_taken_if_nothing_bores_the_rest(bench):
    """11 mm leaves the allowance for a boring bar; without one the bore is drilled to its diameter."""
    bench.add(12, "T12 P12 D11 Q7", "edge_length = 60\npoint_angle = 118\n")
    bored = "G0 X6 Z-30\nG1 Z0\nG1 X15\nG1 Z-30\n"
    assert ("drill", 5) in needed(bench.plan(bored, "ROUGH=1,FINISH=2,DRILL=5,DRILL=12"))
    with_bar = bench.plan(bored, "ROUGH=1,FINISH=2,ROUGH=7,FINISH=7,DRILL=5,DRILL=12")
    assert ("drill", 12) in needed(with_bar)
