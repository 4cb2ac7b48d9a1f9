# SPDX-License-Identifier: GPL-2.0-or-later
"""M256 and the cycles: one that comes nearer to a clamp of the set-up than CLAMP_CLEARANCE is refused by its name, and
moves nothing."""

import math
import random

import pytest

from chipwise.clib.height_map import Shape
from chipwise.clamps.clamp import Clamp
from chipwise.cycles.obstacles import Obstacles
from chipwise.errors import CycleError
from chipwise.moves import Arc, Line, Rapid
from chipwise.setup import job as jobs
from support import canon, clamp_oracle

SET_UP = (
    "[set_up.2.clamp.jaw]\nbox = [40, -12, -20, 60, -2, 8]\n[set_up.2.clamp.stop]\n"
    "cylinder = [0, 60, -20, 30, 10]\n[set_up.3]\n"
)
HEAD = "G21 G90 G64 G94 G17 G40 G54\nT1 M6\nS5000 M3\nF600\n"
SUB = (
    "o200 sub\nG0 X5 Y-20\nG0 Z2\nG1 Z-1 F100\nG1 Y-14\nG0 Z20\no200 endsub\no100 sub\nG0 X20 Y2\nG1 X80\nY30\nX20\n"
    "Y2\no100 endsub\n"
)


def run(text, tmp_path, **settings):
    path = tmp_path / "clamps.toml"
    path.write_text(SET_UP)
    return canon.run_preview(SUB + HEAD + text + "\nM2\n", tools={1: 6.0}, CLAMPS=str(path), **settings)


REFUSED = {
    "M256 P2\nG0 X50 Y5 Z20\nG13 X50 Y5 I9 Z-3 R10": "G13: a cut of the tool meets clamp jaw of set-up 2 at X",
    "M256 P2\nG0 X50 Y9 Z20\nG13 X50 Y6.5 I8 Z-3 R10": "G13: a cut of the tool comes within 0.5 mm of clamp jaw of "
    "set-up 2 at X",
    "M256 P2\nG0 X50 Y-7 Z8.5\nG13 X50 Y20 I6 Z-3 R5": "G13: a traverse of the tool comes within 0.5 mm of clamp jaw "
    "of set-up 2",
    "G10 L2 P1 X0 Y-5 R0\nM256 P2\nG0 X50 Y20 Z20\nG79 Q100 Z-2 R15": "G79: a cut of the tool meets clamp jaw of "
    "set-up 2",
    "G10 L2 P1 X0 Y0 R90\nM256 P2\nG0 X5 Y-50 Z20\nG13 X5 Y-50 I9 Z-3 R10": "G13: a cut of the tool meets clamp jaw of "
    "set-up 2 at X-1 Y-",
    "G20\nM256 P2\nG0 X2 Y0.2 Z1\nG13 X2 Y0.2 I0.3 Z-0.1 R0.5": "G13: a cut of the tool meets clamp jaw of set-up 2 at "
    "X",
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
    assert len(trace.elements) <= 2  # the move to the place before it


@pytest.mark.parametrize("text", ALLOWED)
def test_one_that_keeps_clear_is_not(tmp_path, text):
    trace = run(text, tmp_path)
    assert not trace.error and len(trace.elements) > 3


JAW = "(CLAMP,BOX,XMIN=40,YMIN=-12,ZMIN=-20,XMAX=60,YMAX=-2,ZMAX=8)"
INTO, BESIDE = "G0 X50 Y5 Z20\nG13 X50 Y5 I9 Z-3 R10", "G0 X50 Y10 Z20\nG13 X50 Y7.01 I8 Z-3 R10"
MEETS = "chipwise: G13: a cut of the tool meets the clamp of line 19 at X"
COMMENTS = {  # behind the head, whose last line is 18
    JAW + "\n" + INTO: MEETS,
    JAW + "\n" + BESIDE: "",
    INTO + "\n" + JAW + "\nG0 X0": MEETS.replace("19", "21"),
    JAW + "\nM256 P3\n" + INTO: "",
    "M256 P3\n" + JAW + "\n" + INTO: MEETS.replace("19", "20"),
    "G55\n" + JAW + "\nG0 X0\nG54\n" + INTO: MEETS.replace("19", "20"),
    "G10 L2 P2 X-50 Y5\nG55\n" + JAW + "\nG0 X0\nG54\n" + INTO: "",
    "G10 L2 P2 X-50 Y5\nG55\n"
    + JAW.replace("=40", "=90").replace("=60", "=110").replace("-12", "-17").replace("-2,", "-7,")
    + "\nG0 X0\nG54\n"
    + INTO: MEETS.replace("19", "21"),
    "G10 L2 P1 X0 Y0 R90\n" + JAW + "\n" + INTO: MEETS.replace("19", "20"),
    "G92 X1\n" + JAW + "\n" + INTO: MEETS.replace("19", "20"),
    "G20\n"
    + JAW.replace("40", "1.6")
    .replace("60", "2.4")
    .replace("-12", "-0.5")
    .replace("-20", "-1")
    .replace("-2,", "-0.1,")
    .replace("8)", "0.3)")
    + "\nG0 X2\nG21\n"
    + INTO: MEETS.replace("19", "20"),
    JAW.replace("ZMIN", "Z") + "\n" + INTO: "chipwise: G13: line 19: CLAMP comment: BOX lacks ZMIN",
    JAW + " (left)\n" + INTO: "chipwise: G13: line 19: another comment is behind the CLAMP comment",
    JAW + "\nG0 X0\nG10 L20 P1 X0\n" + INTO: "",
}


@pytest.mark.parametrize("text", COMMENTS)
def test_clamps_of_comments(tmp_path, text):
    trace = run(text, tmp_path)
    assert trace.error.startswith(COMMENTS[text]) and bool(trace.error) == bool(COMMENTS[text]), trace.error
    assert trace.error or len(trace.elements) > 3


def test_traverses_are_led_over_the_clamp_of_a_comment(tmp_path):
    """In both interpreters alike; a comment whose coordinates the text does not say is named, once."""
    over = "G0 X50 Y-30 Z5\nG13 X50 Y20 I6 Z-3 R5\nG0 X50 Y-30 Z5\nG13 X50 Y20 I6 Z-3 R5"
    trace = run(JAW + "\n" + over, tmp_path)
    assert not trace.error and max(element.b[2] for element in trace.elements) > 9.0
    path = tmp_path / "clamps.toml"
    other = canon.run_rs274(SUB + HEAD + JAW + "\n" + over + "\nM2\n", tools={1: 6.0}, CLAMPS=str(path))
    canon.same_path(canon.ends_of(trace.elements), canon.ends_of(other.elements), 1e-3)
    unknown = run(JAW + "\nG0 X0\nG10 L2 P1 X0\n" + over, tmp_path)
    assert not unknown.error and max(element.b[2] for element in unknown.elements) == 5.0
    said = (
        "the clamp of line 19 is not known to the cycles: line 21 changes the work offset; say units and "
        "coordinates in front of it and keep them; the machine stops"
    )
    assert unknown.output.count(said) == 1, unknown.output


def test_clamps_of_the_set_up_of_a_program(tmp_path):
    program = SUB + HEAD + "G55\n" + INTO + "\nM2\n"
    (tmp_path / "clamps.toml").write_text(SET_UP)
    ini = canon.write_ini(tmp_path, CLAMPS=str(tmp_path / "clamps.toml"))
    ini.write_text(ini.read_text().replace("CLAMPS =", f"JOBS = {tmp_path}\nCLAMPS ="))
    for own, number, wanted in ((8, 0, "clamp stop of the set-up of program.ngc"), (0, 2, ""), (7, 2, "")):
        clamps = {"stop": Clamp(0, 0.0, (40.0, -12.0, -20.0), (60.0, own - 10.0, 8.0), "")}
        job = jobs.Job(
            "program.ngc",
            jobs.hashlib.sha256(program.encode()).hexdigest(),
            (0.0, 0.0, -10.0),
            (50.0, 50.0, 0.0),
            "assumed",
            "",
            {1: jobs.JobTool(6.0, None, 1.0)},
            False,
            number,
            clamps if own else {},
        )
        (tmp_path / "program.job.toml").write_text(jobs.text_of(job))
        trace = canon.run_preview(program, tools={1: 6.0}, ini=ini)
        assert bool(trace.error) == (own == 8 or number == 2) and (not wanted or wanted in trace.error), trace.error
    assert not canon.run_preview(
        program.replace("G55", "G56"), tools={1: 6.0}, ini=ini
    ).error  # it has been changed since


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
            path = clamp_oracle.np.array(
                [
                    (
                        centre[0] + radius * math.cos(a),
                        centre[1] + radius * math.sin(a),
                        start[2] + (end[2] - start[2]) * k / 2000,
                    )
                    for k, a in enumerate(angles)
                ]
            )
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
