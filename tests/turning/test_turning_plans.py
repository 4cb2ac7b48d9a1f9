# SPDX-License-Identifier: GPL-2.0-or-later
"""Pairs of blank and part with the steps that a turner expects; units, directions, orientations; what is refused."""

import json
import math
import os
import re

import pytest

from chipwise import cli
from support import ROOT
from support.turning_oracle import moves

HEAD = "G21 G18 G8 G94 G97 S500 M3\n"
G26 = "G26 Q100 I0.3 D1 F100 E50\n"
SHAFT = "G0 X8 Z0\nG1 X10 Z-2\nG1 Z-20\nG1 X14\nG1 Z-30\n"
BORED = "G0 X8 Z-25\nG1 Z0\nG1 X14\nG1 Z-25\n"
GROOVED = "G0 X10 Z0\nG1 Z-10\nG1 X7\nG1 Z-16\nG1 X10\nG1 Z-30\n"
PIN = "G0 X4 Z0\nG1 Z-30\n"
FLANGE = "G0 X8 Z-25\nG1 Z-5\nG1 X10\nG1 Z0\nG1 X20\nG1 Z-8\nG1 X26\nG1 Z-25\n"
BLIND = "G0 X6.5 Z-15\nG1 Z0\nG1 X14\nG1 Z-30\n"
DISC = "G0 X24 Z0\nG1 Z-6\n"
TAPER = "G0 X6 Z0\nG1 X12 Z-40\n"
BALL = "G0 X0 Z0\nG3 X10 Z-10 I0 K-10\nG1 Z-20\n"
HOLLOW = "G0 X10 Z0\nG1 Z-10\nG1 X7 Z-16\nG1 Z-18\nG1 X10 Z-24\nG1 Z-30\n"
INSIDE = "ROUGH=1,ROUGH=7,FINISH=2,FINISH=7,DRILL=5"
BAR = "(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER={d},ZMIN=-60,ZMAX={z}{bore})\n"


def program(part, blank, head=HEAD, tools="ROUGH=1,FINISH=2", call=G26, more=""):
    return f"{blank}(LATHE,{tools})\n{head}{more}{call}M2\nO100 sub\n{part}O100 endsub\n"


def bar(d=30, z=0, bore=""):
    return BAR.format(d=d, z=z, bore=bore)


def blank_sub(text):
    return f"O200 sub\n{text}O200 endsub\n"


@pytest.fixture
def turn(tmp_path, capsys):
    """(text, options) -> (status, plan as data, text of the messages)."""

    def run(text, *options):
        (tmp_path / "part.ngc").write_text(text)
        status = cli.main(
            [
                "turn",
                str(tmp_path / "part.ngc"),
                "--json",
                str(tmp_path / "plan.json"),
                "--ini",
                os.path.join(ROOT, "configs", "lathe.ini"),
                *options,
            ]
        )
        out = capsys.readouterr()
        data = json.loads((tmp_path / "plan.json").read_text()) if status != 2 else None
        return status, data, out.out + out.err

    return run


FROM_SUB = G26.replace("Q100", "Q100 P200")
EXPECTED = [
    # a bar, faced or not
    (program(SHAFT, bar()), ["rough outside", "finish outside"]),
    (program(SHAFT, bar(z=1)), ["face", "rough outside", "finish outside"]),
    (program(SHAFT, bar(z=0.3)), ["rough outside", "finish outside"]),
    (program(SHAFT, bar(z=1), call=G26.replace("I0.3", "I0")), ["face", "rough outside"]),
    # without an allowance the first tool finishes what it reaches; the second one comes for the rest
    (program(GROOVED, bar(), call=G26.replace("I0.3", "I0")), ["rough outside", "rest outside", "groove"]),
    (
        program(GROOVED, bar(), tools="ROUGH=1,FINISH=2,GROOVE=3"),
        ["rough outside", "rest outside", "finish outside", "groove"],
    ),
    (
        program(GROOVED, bar(), tools="ROUGH=1,FINISH=2,GROOVE=6"),
        ["rough outside", "rest outside", "finish outside", "groove"],
    ),
    # the blank is the part
    (program(SHAFT, blank_sub(SHAFT), call=FROM_SUB), []),
    (program(BORED, blank_sub(BORED), call=FROM_SUB), []),
    # a casting: 2 mm more everywhere
    (
        program(SHAFT, blank_sub("G0 X11 Z2\nG1 X12 Z-2\nG1 Z-18\nG1 X16\nG1 Z-40\n"), call=FROM_SUB),
        ["face", "rough outside", "finish outside"],
    ),
    # finished to the last 0.3 mm: no roughing
    (
        program(SHAFT, blank_sub("G0 X8.3 Z0\nG1 X10.2 Z-1.8\nG1 Z-19.8\nG1 X14.2\nG1 Z-40\n"), call=FROM_SUB),
        ["finish outside"],
    ),
    # a half that is finished
    (
        program(SHAFT, blank_sub("G0 X12 Z0\nG1 Z-20\nG1 X14\nG1 Z-40\n"), call=FROM_SUB),
        ["rough outside", "finish outside"],
    ),
    # bores: solid, drilled, bored to the last 0.3 mm
    (program(BORED, bar(28), tools="ROUGH=1,FINISH=2,DRILL=5"), ["drill"]),
    (program(BORED, bar(28), tools="ROUGH=7,FINISH=7,DRILL=5"), ["drill", "rough inside", "finish inside"]),
    (program(BORED, bar(28, bore=",BORE=12"), tools="ROUGH=7,FINISH=7,DRILL=5"), ["rough inside", "finish inside"]),
    (program(BORED, bar(28, bore=",BORE=15.6"), tools="ROUGH=7,FINISH=7,DRILL=5"), ["finish inside"]),
    (program(BORED, bar(28, bore=",BORE=16"), tools="ROUGH=7,FINISH=7,DRILL=5"), []),
    # parted off
    (program(SHAFT, bar(), tools="PARTOFF=6"), ["rough outside", "finish outside", "part off"]),
    (program(SHAFT, blank_sub(SHAFT + "G1 X14 Z-60\n"), call=FROM_SUB, tools="PARTOFF=6"), ["part off"]),
    (program(PIN, bar(8.4), tools="ROUGH=1,FINISH=2,PARTOFF=6"), ["finish outside", "part off"]),
    (program(PIN, bar(8), tools="ROUGH=1,FINISH=2,PARTOFF=6"), ["part off"]),
    (program(PIN, bar(8, 0.8), tools="ROUGH=1,FINISH=2,PARTOFF=6"), ["face", "finish outside", "part off"]),
    # a flange with a stepped bore: from bar, tube, casting, either side finished
    (
        program(FLANGE, bar(56, 1), tools=INSIDE),
        ["face", "drill", "rough outside", "rough inside", "finish outside", "finish inside"],
    ),
    (
        program(FLANGE, bar(56, 0, ",BORE=14"), tools=INSIDE),
        ["rough outside", "rough inside", "finish outside", "finish inside"],
    ),
    (
        program(FLANGE, bar(56, 1, ",BORE=14"), tools=INSIDE),
        ["face", "rough outside", "rough inside", "finish outside", "finish inside"],
    ),
    (
        program(
            FLANGE,
            blank_sub("G0 X7 Z-30\nG1 Z-4\nG1 X8.5\nG1 Z1.5\nG1 X21.5\nG1 Z-7\nG1 X27\nG1 Z-30\n"),
            call=FROM_SUB,
            tools=INSIDE,
        ),
        ["face", "rough outside", "rough inside", "finish outside", "finish inside"],
    ),
    (
        program(FLANGE, blank_sub("G0 X7 Z-25\nG1 Z0\nG1 X20\nG1 Z-8\nG1 X26\nG1 Z-25\n"), call=FROM_SUB, tools=INSIDE),
        ["rough inside", "finish inside"],
    ),
    (
        program(FLANGE, blank_sub("G0 X8 Z-25\nG1 Z-5\nG1 X10\nG1 Z0\nG1 X27\nG1 Z-25\n"), call=FROM_SUB, tools=INSIDE),
        ["rough outside", "finish outside"],
    ),
    (program(FLANGE, blank_sub(FLANGE), call=FROM_SUB, tools=INSIDE), []),
    # bores
    (
        program(BLIND, bar(30, 0.5), tools=INSIDE),
        ["face", "drill", "rough outside", "rough inside", "finish outside", "finish inside"],
    ),
    (program(BORED, bar(28, 1, ",BORE=12"), tools=INSIDE), ["face", "rough inside", "finish outside", "finish inside"]),
    (program(BORED, bar(28, bore=",BORE=12"), tools=INSIDE, call=G26.replace("I0.3", "I0")), ["rough inside"]),
    # one cut, a face alone, a cone, a ball, a hollow
    (program(DISC, bar(48.4)), ["finish outside"]),
    (program(DISC, bar(48, 1.2)), ["face", "finish outside"]),
    (program(TAPER, bar(26)), ["rough outside", "finish outside"]),
    (program(TAPER, blank_sub("G0 X6.2 Z0\nG1 X12.2 Z-40\nG1 Z-50\n"), call=FROM_SUB), ["finish outside"]),
    (program(BALL, bar(22)), ["rough outside", "finish outside"]),
    (
        program(BALL, blank_sub("G0 X0 Z1\nG1 X11\nG1 Z-25\n"), call=FROM_SUB),
        ["face", "rough outside", "finish outside"],
    ),
    (program(HOLLOW, bar(22), tools="ROUGH=1,FINISH=4"), ["rough outside", "rest outside", "finish outside"]),
    # a chuck, the drawing in reverse
    (program(SHAFT, bar(z=1), more="G22 X20 Z-34\n"), ["face", "rough outside", "finish outside"]),
    (
        program("G0 X14 Z-30\nG1 Z-20\nG1 X10\nG1 Z-2\nG1 X8 Z0\n", bar(z=1)),
        ["face", "rough outside", "finish outside"],
    ),
]


@pytest.mark.parametrize("text, steps", EXPECTED)
def test_the_plan_is_what_a_turner_expects(turn, text, steps):
    status, plan, said = turn(text)
    assert status in (0, 1), said
    assert [s["name"] for s in plan["steps"] if s["needed"]] == steps, said
    assert all(s["why"] for s in plan["steps"])
    if not steps:
        assert "nothing to do" in said
        assert sum(s["feed_length_mm"] for s in plan["steps"]) == 0


def test_residue_is_listed_by_the_lines_of_the_sub(turn, tmp_path):
    """A square pocket of 6 mm that D55 enters at 30 degrees: what stays is beside its right wall, and is listed."""
    (tmp_path / "steps.toml").write_text('steps = ["rough outside", "rest outside", "finish outside"]\n')
    status, plan, said = turn(program(GROOVED, bar(z=0)), "--steps", str(tmp_path / "steps.toml"))
    lines = {line for r in plan["residue"] for line in r["lines"]}
    first = program(GROOVED, bar(z=0)).split("\n").index("O100 sub") + 1
    assert status == 1 and first + 4 in lines, said  # the pocket's bottom
    assert max(r["height_mm"] for r in plan["residue"]) == pytest.approx(3.0, abs=0.01)


def test_residue_has_the_area_of_closed_forms(turn, tmp_path):
    """Fillets of the nose at the foot of walls, and the shadow of the back edge beside a wall that faces away."""
    (tmp_path / "steps.toml").write_text('steps = ["rough outside", "rest outside", "finish outside"]\n')
    _, plan, _ = turn(program(GROOVED, bar(z=0)), "--steps", str(tmp_path / "steps.toml"))
    r, h, a = 0.4, 3.0, math.radians(30.0)  # D55: J32 less 2 degrees of relief
    fillet = r * r * (1 - math.pi / 4)
    shadow = h * h / (2 * math.tan(a)) + r * r * (math.tan(a / 2) - a / 2)
    assert [x["area_mm2"] for x in plan["residue"]] == pytest.approx([shadow, fillet, fillet], abs=1e-5)


def controlled(text):
    return [
        (tool, kind, [round(v * (25.4 if "G20" in text else 1), 3) for v in points[-1]])
        for tool, kind, points in moves(text, 1.0)
    ]


def scaled(text, unit, diameter):
    """A program's text of radii in mm, in other units."""

    def number(match):
        letter, value = match.group(1), float(match.group(2)) / unit
        return f"{letter}{value * (2 if diameter and letter == 'X' else 1):.9f}"

    text = re.sub(r"\b([XZIDFE])(-?[\d.]+)", number, text)
    text = re.sub(r"(DIAMETER=|ZMIN=|ZMAX=)(-?[\d.]+)", lambda m: f"{m.group(1)}{float(m.group(2)) / unit:.9f}", text)
    return text.replace("G21", "G20" if unit > 1 else "G21").replace("G8", "G7" if diameter else "G8")


@pytest.mark.parametrize("unit", [1.0, 25.4])
@pytest.mark.parametrize("diameter", [False, True])
@pytest.mark.parametrize("reverse", [False, True])
def test_the_same_path_in_all_units_and_directions(turn, tmp_path, unit, diameter, reverse):
    part = SHAFT if not reverse else "G0 X14 Z-30\nG1 Z-20\nG1 X10\nG1 Z-2\nG1 X8 Z0\n"
    found = []
    for text in (program(SHAFT, bar(z=1)), scaled(program(part, bar(z=1)), unit, diameter)):
        status, _, said = turn(text, "-o", str(tmp_path / "out.ngc"))
        assert status in (0, 1), said
        found.append(controlled((tmp_path / "out.ngc").read_text()))
    assert len(found[0]) == len(found[1])
    for a, b in zip(*found):
        assert a[:2] == b[:2] and a[2] == pytest.approx(b[2], abs=0.001)


TABLE = "T1 P1 D0.8 I85 J5 Q{q}\nT2 P2 D0.8 I87 J32 Q{q}\n"
OFFSETS = {1: (1, -1), 2: (1, 1), 6: (1, 0), 9: (0, 0), 5: (0, -1), 7: (0, 1)}


@pytest.mark.parametrize("q", OFFSETS)
def test_the_orientation_moves_the_controlled_point_only(turn, tmp_path, q):
    """The centre of the nose, from the controlled point by LinuxCNC's picture, has the same path for all
    orientations."""
    centres = []
    for orientation in (2, q):
        folder = tmp_path / f"q{orientation}"
        folder.mkdir(exist_ok=True)
        for name in ("lathe.ini", "lathe_tools.toml"):
            with open(os.path.join(ROOT, "configs", name)) as file:
                (folder / name).write_text(file.read())
        (folder / "lathe.tbl").write_text(TABLE.format(q=orientation))
        status, _, said = turn(
            program(SHAFT, bar(z=1)), "-o", str(folder / "out.ngc"), "--ini", str(folder / "lathe.ini")
        )
        assert status in (0, 1), said
        dx, dz = OFFSETS[orientation]
        centres.append(
            [
                (kind, p[-1][0] + 0.4 * dz, p[-1][1] + 0.4 * dx)
                for _, kind, p in moves((folder / "out.ngc").read_text(), 1.0)
            ]
        )
    assert len(centres[0]) == len(centres[1])
    for a, b in zip(*centres):
        assert a[0] == b[0] and a[1:] == pytest.approx(b[1:], abs=2e-6)


BAD = [
    (program("G0 X8 Z0\nG1 Z-10\nG1 X10 Z-5\nG1 Z-20\n", bar()), "turns back in Z"),
    (program("G0 X8 Z0\nG1 X-2 Z-10\nG1 X10 Z-20\n", bar()), "below the axis"),
    (program("G0 X8 Z0\nG1 Z-10\nG0 X8 Z-12\nG1 Z-20\n", bar()), "separated by G0"),
    (program("G0 X8 Z0\nG1 X12\n", bar()), "no extent in Z"),
    (program("G0 X8 Z0\nG1 Y3 Z-10\n", bar()), "Y3 is not allowed"),
    (program("", bar()), "holds no G1"),
    (program(SHAFT, ""), "neither a blank sub P nor a WORKPIECE comment"),
    (program(SHAFT, bar(20)), "blank is smaller than the part outside by 4 mm"),
    (program(SHAFT, bar(z=-1)), "the blank ends at"),
    (program(SHAFT, bar(), more="G22 X40 Z-25\n"), "goes into a barrier"),
    (program(SHAFT, bar(), tools="ROUGH=99"), "tool table has no such tool"),
    (program(SHAFT, bar(), tools="CARVE=1"), "CARVE=1 is not a role"),
    (program(SHAFT, bar(), call="G26 Q100 I-1 F100\n"), "allowance I-1 is not from"),
    (program(SHAFT, bar(), call="G26 Q100 D0 F100\n"), "depth of cut D0 is not"),
    (program(SHAFT, bar(), call="G26 Q100 D1\n"), "no feed F above 0"),
    (program(SHAFT, bar(), call="G26 D1 F100\n"), "there is no Q"),
    (program(SHAFT, bar(), call="G26 Q100 F#3\n"), "expression"),
    (program(SHAFT, bar(), call="G26 Q100 F100 Y3\n"), "Y is not a word of G26"),
    (program(SHAFT, bar(), call="G26 Q7 F100\n"), "there is no sub O7"),
    (program(SHAFT, bar(), call=""), "no G26"),
    (program(SHAFT, bar(), call="G26 Q100 F100 H2\n"), "H2 is neither 0 nor 1"),
    (program(SHAFT, bar(), head=HEAD.replace("G18", "G17")), "the plane is G17"),
    (program(SHAFT, bar(), more="G22 X40 Z-40 R3\n"), "R is not a word of G22"),
    (program(SHAFT, bar(), tools="ROUGH=5"), "tool 5 has the role ROUGH and is a drill"),
    (program(SHAFT, bar(), tools="ROUGH=1,GROOVE=2"), "tool 2 has the role GROOVE and is a turning tool"),
    (program(SHAFT, bar(), call=G26.replace("D1", "D0.01")), "makes 682 levels, more than 400"),
    (program(SHAFT, bar(), head="G21 G18 G8 G95\n"), "no speed S above 0"),
    (program(SHAFT, bar(), head="G21 G18 G8 G94\n"), "the spindle does not turn at G26"),
    (program(SHAFT, bar(), head="G21 G18 G8 G94 G97 S500 M5\n"), "the spindle does not turn at G26"),
    (program(SHAFT, bar(), head="G21 G18 G8 G95 G96 S180 M3\n"), "G96 has no D"),
    (program(BORED.replace("X8", "X5.5"), bar(28), tools="ROUGH=7,FINISH=7,DRILL=5"), "diameter"),
    (program(SHAFT, "(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=nan,ZMIN=-60,ZMAX=0)\n"), "not all given as numbers"),
]


@pytest.mark.parametrize("text, words", BAD)
def test_what_is_refused(turn, tmp_path, text, words):
    """One line with the fact and the remedy; nothing is written."""
    status, _, said = turn(text, "-o", str(tmp_path / "out.ngc"))
    if words == "diameter":
        assert status == 1 and "no drill is smaller than the bore" in said, said
        return
    assert status == 2, said
    assert words in said and ";" in said and said.count("\n") == 1 and "Traceback" not in said, said
    assert not (tmp_path / "out.ngc").exists()


TOOL_FAULTS = [
    ("T1 P1 D0.8 I85 J85 Q2", "no insert between them"),
    ("T1 P1 D0.8 I85 J5 Q0", "orientation Q0"),
    ("T1 P1 I85 J5 Q2", "nose diameter"),
    ("T1 P1 D0.8 I-30 J30 Q7", "point along Z"),
    ("T1 P1 D0.8 I85 J1 Q2", "relief"),
    ("T1 P1 D0.8 I275 J335 Q2", "different sides"),
    ("T1 P1 D0.8 Q2", "no insert between them"),
    ("T1 P1 Dnan I85 J5 Q2", "cannot be read"),
]


@pytest.mark.parametrize("line, words", TOOL_FAULTS)
def test_a_tool_of_unknown_shape_is_refused(turn, tmp_path, line, words):
    for name in ("lathe.ini", "lathe_tools.toml"):
        with open(os.path.join(ROOT, "configs", name)) as file:
            (tmp_path / name).write_text(file.read())
    (tmp_path / "lathe.tbl").write_text(line + "\n")
    status, _, said = turn(program(SHAFT, bar(), tools="ROUGH=1"), "--ini", str(tmp_path / "lathe.ini"))
    assert status == 2 and words in said, said


@pytest.mark.parametrize("key, words", [("holder", "has no holder"), ("edge_length", "has no edge_length")])
def test_a_tool_without_its_geometry_is_refused(turn, tmp_path, key, words):
    for name in ("lathe.ini", "lathe.tbl", "lathe_tools.toml"):
        with open(os.path.join(ROOT, "configs", name)) as file:
            (tmp_path / name).write_text(re.sub(rf"(?m)^{key} = .*\n", "", file.read()))
    status, _, said = turn(program(SHAFT, bar(), tools="ROUGH=1"), "--ini", str(tmp_path / "lathe.ini"))
    assert status == 2 and words in said, said


@pytest.mark.parametrize("tool, allowance, radius", [(4, 0.3, 30), (2, 0.6, 30), (4, 0.6, 15)])
def test_a_face_is_finished_to_the_axis(turn, tmp_path, tool, allowance, radius):
    """The holder beside the nose meets the allowance of a large face while it is cut from the axis: what stays then is
    cut afterwards."""
    bar_, part = bar(2 * radius + 4, 1), f"G0 X0 Z0\nG1 X{radius}\nG1 Z-20\n"
    text = program(part, bar_, tools=f"ROUGH=1,FINISH={tool}", call=G26.replace("I0.3", f"I{allowance}"))
    _, plan, said = turn(text, "-o", str(tmp_path / "out.ngc"))
    assert all(r["z"][1] < -19.0 for r in plan["residue"]), said
    cut = sorted(
        {
            round(x, 2)
            for _, kind, points in moves((tmp_path / "out.ngc").read_text(), 1.0)
            if kind == "feed"
            for z, x in points
            if abs(z) < 1e-5 and x < radius
        }
    )
    assert (
        cut[0] <= 0.0 and cut[-1] >= radius - 0.5 and max(b - a for a, b in zip(cut, cut[1:])) < 0.11
    )  # sampled 0.05 mm apart


def test_what_stays_in_front_of_the_face_is_residue(turn, tmp_path):
    (tmp_path / "steps.toml").write_text('steps = ["face", "rough outside"]\n')
    status, plan, said = turn(program(PIN, bar(z=1)), "--steps", str(tmp_path / "steps.toml"))
    assert status == 1 and plan["residue"][0]["z"][1] == pytest.approx(0.3, abs=1e-5), said
    _, plan, said = turn(
        program(BORED, bar(d=30, z=1, bore=",BORE=14"), tools="ROUGH=1"), "--steps", str(tmp_path / "steps.toml")
    )
    assert plan["residue"][0]["height_mm"] == pytest.approx(14.3 - 7.0, abs=0.01), said


@pytest.mark.parametrize(
    "bottom", ["G0 X0 Z-25\nG1 X8 Z-20\n", "G0 X0 Z-25\nG1 X6.3 Z-21.2145\n", "G0 X0 Z-25\nG2 X8 Z-17 I0 K8\n"]
)
def test_a_bore_that_ends_on_the_axis_is_drilled(turn, tmp_path, bottom):
    """In a cone or a ball the drill goes as deep as its point stays inside by the allowance."""
    _, plan, said = turn(
        program(bottom + "G1 Z0\nG1 X14\nG1 Z-40\n", bar(z=1), tools=INSIDE), "-o", str(tmp_path / "out.ngc")
    )
    drill = next(s for s in plan["steps"] if s["name"] == "drill")
    assert drill["needed"] and -24.7 <= drill["z"][0] < -21.0, said
    assert sum(r["area_mm2"] for r in plan["residue"] if r["side"] == "inside") < 8.0, said


@pytest.mark.parametrize("ini, same", [("lathe.ini", "G21 G7"), ("lathe_inch.ini", "G20 G7")])
def test_the_codes_of_the_machine_s_start_count(turn, tmp_path, ini, same):
    """A program without G20, G21, G7 and G8 is planned in those that the INI file begins with."""
    text, ini = scaled(program(SHAFT, bar()), 25.4 if "G20" in same else 1.0, True), os.path.join(ROOT, "configs", ini)
    bare = re.sub(r"G2[01] G18 G7", "G18", text)
    assert bare != text
    for number, source in enumerate((text, bare)):
        assert turn(source, "--ini", ini, "-o", str(tmp_path / f"{number}.ngc"))[0] == 1
    assert (tmp_path / "0.ngc").read_text() == (tmp_path / "1.ngc").read_text()


def test_an_offset_after_a_barrier_is_refused(turn):
    """G22 stays where the machine is, and chipwise turn does not know the offsets."""
    status, _, said = turn(program(SHAFT, bar(), more="G22 X40 Z-40\nG55\n"))
    assert status == 2 and "the work offset changes after G22" in said
    assert turn(program(SHAFT, bar(), more="G55\nG22 X40 Z-40\n"))[0] == 1


@pytest.mark.parametrize("name", ["turning_shaft", "turning_flange", "turning_half"])
def test_the_samples_are_planned_drawn_and_written(tmp_path, capsys, name):
    path = os.path.join(ROOT, "nc_files", name + ".ngc")
    for output in ("out.svg", "out.ngc"):
        assert cli.main(["turn", path, "-o", str(tmp_path / output)]) == 1
        assert (tmp_path / output).stat().st_size > 2000
    assert "rough outside" in capsys.readouterr().out
    text = (tmp_path / "out.ngc").read_text()
    assert text.count("(step ") == 13 and max(map(len, text.splitlines())) < 250


def test_the_program_itself_is_not_overwritten(tmp_path, capsys):
    path = tmp_path / "part.ngc"
    path.write_text(program(SHAFT, bar()))
    assert cli.main(["turn", str(path), "-o", str(path)]) == 2
    assert "is the program itself" in capsys.readouterr().err and path.read_text() == program(SHAFT, bar())


def test_the_plan_as_data_does_not_overwrite_the_program(tmp_path, capsys):
    (tmp_path / "part.ngc").write_text(program(SHAFT, bar()))
    assert (
        cli.main(
            ["turn", str(tmp_path / "part.ngc"), "-o", str(tmp_path / "out.ngc"), "--json", str(tmp_path / "out.ngc")]
        )
        == 2
    )
    assert "-o and --json are the same file" in capsys.readouterr().err and not (tmp_path / "out.ngc").exists()


def test_steps_in_another_order(turn, tmp_path):
    (tmp_path / "steps.toml").write_text('steps = ["rough outside", "finish outside"]\n')
    _, plan, _ = turn(program(SHAFT, bar(z=1)), "--steps", str(tmp_path / "steps.toml"))
    assert [s["name"] for s in plan["steps"]] == ["rough outside", "finish outside"]
    (tmp_path / "steps.toml").write_text('steps = ["finish outside"]\n')
    status, plan, said = turn(program(SHAFT, bar(z=1)), "--steps", str(tmp_path / "steps.toml"))
    assert status == 1 and "T2 leaves what is thicker than 0.45 mm" in said
    assert max(r["height_mm"] for r in plan["residue"]) > 4.0  # a finishing tool does not rough
    (tmp_path / "steps.toml").write_text('steps = ["polish"]\n')
    assert "polish is not a step" in turn(program(SHAFT, bar(z=1)), "--steps", str(tmp_path / "steps.toml"))[2]
