# SPDX-License-Identifier: GPL-2.0-or-later
"""Grooves as wide as the insert, speed and feeds of a tool's own, roles that a comment hides, the picture of a blind
bore."""

import re

import numpy as np
import pytest

from support.turning_bench import Bench
from support.turning_oracle import moves

GROOVE = "G0 X15 Z0\nG1 Z-20\nG1 X12\nG1 Z-{end}\nG1 X15\nG1 Z-40\n"
BORED = "G0 X8 Z-30\nG1 Z0\nG1 X14\nG1 Z-30\n"
BLIND = "G0 X6.5 Z-15\nG1 Z0\nG1 X14\nG1 Z-30\n"
INSIDE = "ROUGH=1,ROUGH=7,FINISH=2,FINISH=7,DRILL=5"


@pytest.fixture
def bench(tmp_path, capsys):
    return Bench(tmp_path, capsys)


def step(plan, name):
    return next(s for s in plan["steps"] if s["name"] == name)


def feeds(bench, tool):
    """[(z, x)] of the feeds of a tool in the written program."""
    found = moves((bench.folder / "out.ngc").read_text(), 1.0)
    return np.array([p for number, kind, points in found if number == tool and kind == "feed" for p in points])


@pytest.mark.parametrize(
    "end, plunged",
    [
        (22.98, False),
        (22.9995, True),
        (23.0, True),
        (23.0004, True),
        (23.005, True),
        (23.01, True),
        (23.02, True),
        (23.03, True),
    ],
)
def test_a_groove_as_wide_as_the_insert_is_one_plunge(bench, end, plunged):
    """T3 is 3 mm wide.  No other insert goes into the groove; its walls are missed by at most 0.0005 mm."""
    plan = bench.plan(
        GROOVE.format(end=end),
        "ROUGH=1,FINISH=2,GROOVE=3",
        bar=(31, -60, 1),
        more="",
        options=("-o", bench.folder / "out.ngc"),
    )
    assert step(plan, "groove")["needed"] == plunged
    if not plunged:
        return
    path = feeds(bench, 3)
    assert path[:, 1].min() == pytest.approx(12.0, abs=1e-5)
    assert path[:, 0].min() >= -end - 0.00051 and path[:, 0].max() <= -23.0 + 0.00051  # Q2: the left corner
    starts = [p for p in path if p[1] > 15.4]
    assert len(starts) <= 4  # sampled: down and up once
    deepest = [p for tool in (1, 2) for p in feeds(bench, tool) if -end + 0.3 < p[0] < -20.3]
    assert min(p[1] for p in deepest) >= 15.0 - 1e-6
    assert sum(r["area_mm2"] for r in plan["residue"]) < 0.1


@pytest.mark.parametrize("end, tight", [(22.7, False), (22.97, False), (22.985, True), (22.995, True), (22.998, True)])
def test_a_groove_a_little_too_narrow_for_the_insert_is_named(bench, end, tight):
    """It stays, and the reason says why: the insert would gouge its walls."""
    plan = bench.plan(GROOVE.format(end=end), "ROUGH=1,FINISH=2,GROOVE=3", bar=(31, -60, 1), more="")
    one = step(plan, "groove")
    assert not one["needed"] and ("is narrower than the insert of T3 by 0.001 to 0.02 mm" in one["why"]) == tight
    assert ("nothing thicker than 0.3 mm is left within reach of T3" in one["why"]) != tight
    assert any(r["area_mm2"] > 5.0 for r in plan["residue"])


def test_a_wide_groove_is_cut_by_both(bench):
    """12 mm are too wide to be left to a grooving tool of 3 mm."""
    bench.plan(
        GROOVE.format(end=32), "ROUGH=1,FINISH=2,GROOVE=3", bar=(31, -60, 1), options=("-o", bench.folder / "out.ngc")
    )
    assert min(p[1] for p in feeds(bench, 2)) < 12.1


def test_a_groove_that_no_grooving_tool_reaches_is_not_left_to_it(bench):
    """The holder of T15 is hardly above its edge: the insert takes what it can."""
    bench.add(15, "T15 P15 D0.4 I90 J90 Q2", "edge_length = 10\nwidth = 3\nrelief = 0\nholder = [-1, 22, 0.25]\n")
    bench.plan(
        GROOVE.format(end=23), "ROUGH=1,FINISH=2,GROOVE=15", bar=(31, -60, 1), options=("-o", bench.folder / "out.ngc")
    )
    assert min(p[1] for p in feeds(bench, 2) if -22.7 < p[0] < -20.3) < 14.9


def speed_and_feed(bench, name, tools, spindle, call="G26 Q100 I0.3 D1 F0.2 E0.1", part=BORED):
    plan = bench.plan(part, tools, spindle=spindle, call=call)
    return step(plan, name)["spindle"], step(plan, name)["feed"]


def test_speed_and_feeds_of_a_tool(bench):
    """A drill of 30 m/min beside inserts of 160 m/min; G97 is never exceeded; feeds a revolution become feeds a
    minute."""
    per_rev, constant = "G95 G96 D3000 S160 M3", "G95 G97 S500 M4"
    assert speed_and_feed(bench, "drill", INSIDE, per_rev) == ("G97 S795 M3", 0.1)  # 30 m/min at 12 mm
    assert speed_and_feed(bench, "drill", INSIDE, constant) == ("G97 S500 M4", 0.1)
    bench.add(16, "T16 P16 D12 Q7", "edge_length = 80\npoint_angle = 118\ncutting_speed = 10\nfeed = 0.05\n")
    tools = INSIDE.replace("DRILL=5", "DRILL=16")
    assert speed_and_feed(bench, "drill", tools, constant) == ("G97 S265 M4", 0.05)  # lower than S500
    spindle, feed = speed_and_feed(bench, "drill", tools, "G94 G97 S500 M3", "G26 Q100 I0.3 D1 F100 E50")
    assert spindle == "G97 S265 M3" and feed == pytest.approx(0.05 * 265.26, rel=1e-3)
    bench.add(
        17,
        "T17 P17 D0.8 I87 J32 Q2",
        "edge_length = 11\ndepth = 2\nholder = [0, 25, 8]\ncutting_speed = 220\nfeed = 0.3\nfinish_feed = 0.07\n",
    )
    tools = INSIDE.replace("FINISH=2", "FINISH=17")
    assert speed_and_feed(bench, "finish outside", tools, per_rev) == ("G96 D3000 S220 M3", 0.07)
    assert speed_and_feed(bench, "rough outside", tools, per_rev) == ("G96 D3000 S160 M3", 0.2)
    assert speed_and_feed(bench, "rough outside", tools.replace("ROUGH=1,", "ROUGH=17,"), per_rev) == (
        "G96 D3000 S220 M3",
        0.3,
    )


def test_a_drill_without_a_speed_of_its_own_is_named(bench):
    bench.add(16, "T16 P16 D12 Q7", "edge_length = 80\npoint_angle = 118\n")
    text = "T16 drills at the S160 of G96; give its cutting_speed in [lathe.16]"
    tools = INSIDE.replace("DRILL=5", "DRILL=16")
    assert text in bench.turn(BORED, tools, spindle="G95 G96 D3000 S160 M3")[2]
    assert text not in bench.turn(BORED, tools, spindle="G95 G97 S500 M3")[2]


@pytest.mark.parametrize(
    "key, words",
    [
        ("cutting_speed = 0", "cutting_speed is not a speed above 0"),
        ("feed = 11", "feed is not a feed above 0"),
        ("finish_feed = true", "finish_feed is not a feed"),
    ],
)
def test_speeds_and_feeds_that_are_refused(bench, key, words):
    bench.add(18, "T18 P18 D0.8 I87 J32 Q2", f"edge_length = 11\nholder = [0, 25, 8]\n{key}\n")
    status, _, said = bench.turn(BORED, "ROUGH=18")
    assert status == 2 and words in said


def test_a_role_that_hides_tools_says_so(bench):
    """T7 of the file bores; a comment that names T1 for ROUGH hides it.  Of no interest for a part without a bore."""
    said = bench.turn(BORED, "ROUGH=1,FINISH=2")[2]
    assert (
        "T7 of role ROUGH is not used, for the LATHE comment names others; add ROUGH=7 to it" in said
        and "T7 of role FINISH is not used" in said
    )
    assert (
        "is not used" not in bench.turn(BORED, INSIDE)[2]
        and "is not used" not in bench.turn("G0 X8 Z0\nG1 Z-30\n", "ROUGH=1,FINISH=2")[2]
    )


def test_the_picture_of_a_blind_bore_ends_in_a_wall(bench):
    """From the end of the bore straight to the axis, and along it to the left end of the part: before, a line went to
    the outer corner."""
    status, _, said = bench.turn(BLIND, INSIDE, options=("-o", bench.folder / "out.svg"))
    assert status in (0, 1), said
    text = (bench.folder / "out.svg").read_text()
    blank, part = (
        re.search(rf'<path d="M([^"]*)Z" fill="{colour}"', text)[1].split("L") for colour in ("#e4e1da", "#9db4c8")
    )
    points = np.array([[float(v) for v in p.split()] for p in part])
    axis = points[:, 1].max()
    bottom = [p for p in points if p[1] > axis - 0.01]
    assert len(bottom) == 2 and bottom[1][0] == points[:, 0].min() and len(blank) >= 4
    assert any(abs(p[0] - bottom[0][0]) < 0.01 and p[1] < axis - 20.0 for p in points)  # the end of the bore is upright
