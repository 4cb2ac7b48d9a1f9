# SPDX-License-Identifier: GPL-2.0-or-later
"""A typed line as the machine plans it: against rs274's motion of a program with the same line, chop lines, offsets,
errors, the picture."""

import math
import random
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from support import ROOT
from support.canon import run_rs274, write_ini
from support.random_cases import random_count, random_seed, write_replay

from chipwise import entry
from chipwise.host import language
from chipwise.drawing import entered
from chipwise.entry import planned
from chipwise.errors import CycleError
from chipwise.panel import colours

pytestmark = pytest.mark.usefixtures("forked_readers")


MM, INCH = (
    {"ini": str(ROOT / "configs" / name), "unit": unit} for name, unit in (("mill.ini", "mm"), ("mill_inch.ini", "in"))
)
SUB = "o100 sub\nG0 X10 Y10\nG1 X60\nG3 X70 Y20 J10\nG1 Y50\nX10\nY10\nG0 X40 Y30\nG2 I-6\no100 endsub\n"
OUTLINE = "o200 sub\nG0 X0 Y0\nG1 X30\nY20\nX0\nY0\no200 endsub\n"
TOOLS = {1: 6.0, 2: 3.0, 3: 10.0, 8: 12.0}  # of configs/mill.tbl, mm
CHORDS = 1e-3  # share by which chords of 2 um sag are shorter than their arcs


@pytest.fixture
def program(tmp_path):
    path = tmp_path / "part.ngc"
    path.write_text("(a part)\n" + SUB + OUTLINE + "G20 T8 M6\nG0 X500\nM250 P0 Q0 R-20 I1 J1 K1\nM2\n")
    return str(path)


# ---- the same motion as in a program -----------------------------------------------------------------------------


def cases(rng, count):
    """(tool, chop size, line) of random lines that can be planned."""
    for _ in range(count):
        tool = rng.choice((1, 2))
        z, r = -round(rng.uniform(0.5, 8), 3), round(rng.uniform(0.5, 4), 2)
        line = rng.choice(
            (
                f"G12 X{rng.uniform(-40, 40):.3f} Y{rng.uniform(-40, 40):.3f} I{rng.uniform(7, 25):.3f} Z{z} R{r}",
                f"G13 X5 I{rng.uniform(7, 12):.3f} Z{z} R{r} K20 Q2.5 J3",
                f"G79 Q100 Z{z} R{r} D{rng.uniform(1, 2.5):.3f} P{rng.randint(0, 3)}",
                f"G78 Q200 P{rng.choice((41, 42))} Z{z} R{r}",
                f"G77 Q200 P41 Z{z} R{r} I0.3 L2 D2",
            )
        )
        yield tool, rng.choice((0.0, 0.0, 9.0)), line


def fault_of(found, elements):
    """How the runs differ from the elements of rs274 (mm), "" if they do not."""
    points = np.concatenate([run.points for run in found.runs])
    at = 0
    for number, element in enumerate(elements):
        near = np.flatnonzero(np.linalg.norm(points[at:] - element.b, axis=1) < 2e-3)
        if not len(near):
            return f"element {number} ends at {element.b}: no point of the plan does"
        at += int(near[0])
    for kinds, own in ((("cut", "chop"), ("feed", "arc")), (("rapid",), ("rapid",))):
        length = sum(length_of(element) for element in elements if element.kind in own)
        if abs(found.length(*kinds) - length) > CHORDS * length + 0.01:
            return f"{kinds}: {found.length(*kinds)} mm, rs274 {length}"
    return ""


def length_of(element):
    if element.kind != "arc":
        return math.dist(element.a, element.b)
    return math.hypot(element.radius * element.sweep[1], element.b[2] - element.a[2])


def test_random_lines_move_as_in_a_program(program):
    rng = random.Random(random_seed())
    for tool, chop, line in cases(rng, random_count(8)):
        found = planned.plan(
            planned.Scene(**MM, program=program, tool=tool, named=(("_chipwise_chop_size", chop),)), line
        )
        trace = run_rs274(
            f"{SUB}{OUTLINE}G21 G90 G17 G40\nT{tool} M6\n#<_chipwise_chop_size> = {chop}\nF1000\nG0 X0 Y0 Z5\n(here)\n"
            f"{line}\nM2\n",
            TOOLS,
        )
        assert not trace.error, (line, trace.error)
        fault = fault_of(found, trace.after("here"))
        assert not fault, (fault, str(write_replay("entry_planned", {"line": line, "tool": tool, "chop": chop})))
        assert found.tool == tool and found.diameter == pytest.approx(TOOLS[tool])


def test_the_checker_sees_another_motion(program):
    scene = planned.Scene(**MM, program=program, tool=1)
    found = planned.plan(scene, "G13 X5 I12 Z-3 R1")
    trace = run_rs274("G21 G90 G17\nT1 M6\nF1000\nG0 X0 Y0 Z5\n(here)\nG12 X5 I12 Z-3 R1\nM2\n", TOOLS)
    assert fault_of(found, trace.after("here")) or found.runs[1].points[5][1] * trace.after("here")[3].sweep[1] < 0
    assert fault_of(planned.plan(scene, "G13 X5 I12.1 Z-3 R1"), trace.after("here"))
    assert fault_of(replace(found, runs=found.runs[:-1]), trace.after("here"))


# ---- chop lines --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("diameter, size, lines", [(44, 12, 6), (20, 30, 0), (40, 40, 2), (44, 0, 0)])
def test_chop_lines_of_a_hole(diameter, size, lines):
    """Closed form: the diameter and the size make n = floor((d + H) / H) parts, by n - 1 lines in each of two
    directions."""
    scene = planned.Scene(**MM, tool=2, named=(("_chipwise_chop_size", float(size)),))
    found = planned.plan(scene, f"G13 X30 Y30 I{diameter / 2} Z-2 R1")
    chops = [run for run in found.runs if run.kind == "chop"]
    assert len(chops) == lines
    for run in chops:
        ends = run.points[0][:2], run.points[-1][:2]
        assert all(math.dist(end, (30, 30)) == pytest.approx(diameter / 2 - 1.5, abs=0.01) for end in ends[1:])
        assert abs(run.points[0][0] - run.points[-1][0]) < 1e-6 or abs(run.points[0][1] - run.points[-1][1]) < 1e-6
    assert planned.plan(scene, f"G13 X30 Y30 I{diameter / 2} Z-2 R1 H0").length("chop") == 0


def test_chop_lines_of_a_contour(program):
    scene = planned.Scene(**MM, program=program, tool=2, named=(("_chipwise_chop_size", 8.0),))
    found = planned.plan(scene, "G78 Q200 P41 Z-2 R1")
    assert found.length("chop") > 40 and found.length("cut") > 2 * (27 + 17)
    assert planned.plan(scene, "G78 Q200 P42 Z-2 R1").length("chop") == 0  # outside, the contour is the part


# ---- where it is run ---------------------------------------------------------------------------------------------


def test_contours_stock_and_units(program):
    found = planned.plan(planned.Scene(**MM, program=program), "G79 Q100 Z-3 R1")
    assert found.tool == 8 and len(found.loops) == 2 and found.stock is None  # the program's first tool
    assert found.loops[0].min() == pytest.approx(10) and found.loops[0].max() == pytest.approx(70)
    stock = planned.plan(planned.Scene(**INCH), "M250 P0 Q1 R-2 I3 J4 K2")
    assert (
        stock.stock[0] == pytest.approx([0, 25.4, -50.8])
        and stock.stock[1] == pytest.approx([76.2, 127, 0])
        and stock.runs == ()
    )
    hole = planned.plan(planned.Scene(**{**MM, "unit": "in"}, at=(0.0, 0.0, 10.0)), "G13 X1 Y1 I0.5 Z-0.1 R0.1")
    assert min(run.points[:, 2].min() for run in hole.runs) == pytest.approx(-2.54)


def test_a_work_offset_does_not_matter(program, tmp_path):
    """The machine's parameter file has an offset, turned: the drawing is in work coordinates all the same."""
    plain = planned.plan(planned.Scene(**MM, tool=1), "G13 X30 Y30 I10 Z-2 R1")
    ini = write_ini(tmp_path)
    ini.write_text(ini.read_text().replace("TOOL_TABLE = mill.tbl", f"TOOL_TABLE = {ROOT / 'configs' / 'mill.tbl'}"))
    (tmp_path / "mill.var").write_text(
        "5161 0\n5210 1\n5211 3\n5212 -2\n5213 1\n5220 1\n5221 100\n5222 50\n5223 -20\n5230 30\n"
    )
    moved = planned.plan(planned.Scene(str(ini), tool=1), "G13 X30 Y30 I10 Z-2 R1")
    for run, other in zip(plain.runs, moved.runs):
        assert run.kind == other.kind and np.abs(run.points - other.points).max() < 1e-5


def test_a_surface_beside_the_program(tmp_path):
    """A model whose name counts from the folder of the program."""
    (tmp_path / "relief.stl").write_bytes((ROOT / "nc_files" / "relief.stl").read_bytes())
    (tmp_path / "relief.ngc").write_text((ROOT / "nc_files" / "relief.ngc").read_text())
    found = planned.plan(planned.Scene(**MM, program=str(tmp_path / "relief.ngc")), "G24 D6 Z-10 R20")
    assert found.length("cut") > 300


# ---- errors ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "line, letter, words",
    [
        (
            "G79 Q100 Z-3 R1 D30",
            "D",
            "chipwise: G79: step-over D30 mm is larger than the tool (12 mm); use D up to 12 mm",
        ),
        ("G79 Q100 Z3 R1", "Z", "chipwise: G79: final depth Z3 mm"),
        ("G79 Q7 Z-3 R1", "", "chipwise: G79: there is no sub O7 in part.ngc"),
        ("M251 Q30 P2", "E", "chipwise: M251: word E (ceiling of the feed) is missing"),
        ("M253 P3", None, ""),
        ("M250", "", "chipwise: M250: there are neither"),
        ("G13 I2 Z-1 R1", "I", "chipwise: G13: radius I2 mm is not larger than the tool radius 6 mm"),
    ],
)
def test_a_line_that_the_code_refuses(program, line, letter, words):
    scene = planned.Scene(**MM, program=program)
    if letter is None:
        assert planned.plan(scene, line).runs == ()
        return
    with pytest.raises(planned.PlanError) as caught:
        planned.plan(scene, line)
    error = caught.value
    assert (
        str(error).startswith(words)
        and "(line" not in str(error)
        and (error.field.letter if error.field else "") == letter
    )
    assert error.number == (
        0 if not letter else 1 + [field.letter for field in entry.fields(line.split()[0], "")].index(letter)
    )


BASES = {
    "G12": "I20 Z-3 R1",
    "G24": "D6 Z-10 R20",
    "G75": "Q200",
    "G77": "Q200 P42 Z-3 R1 L2 D2",
    "G78": "Q200 P42 Z-3 R1",
    "G79": "Q100 Z-3 R1",
    "M250": "P0 Q0 R-5 I10 J10 K5",
    "M251": "Q30 P3 R10 E500",
    "M253": "P3",
    "M255": "P3 Q1",
    "M256": "P0",
}


def outside(field):
    """Numbers that the entry refuses for a datum, nearest to those that it accepts."""
    found = [field.above] if field.above is not None else []
    found += [field.least - 1] if field.least is not None else []
    found += [field.most + 1] if field.most is not None else []
    return found + ([max(number for number, _meaning in field.choices) + 1] if field.choices else [])


@pytest.mark.parametrize("code", BASES)
def test_what_the_entry_refuses_the_code_refuses_too(code, tmp_path):
    """The limits of fields.toml are those of the codes: no line is refused that would run."""
    (tmp_path / "relief.stl").write_bytes((ROOT / "nc_files" / "relief.stl").read_bytes())
    path = tmp_path / "part.ngc"
    path.write_text(
        SUB
        + OUTLINE.replace("G0 X0 Y0\n", "G0 X0 Y0\nG0 Z5\n", 1).replace("o200", "o300")
        + OUTLINE
        + "(SURFACE,FILE=relief.stl)\nM2\n"
    )
    base = BASES[code].replace("Q200", "Q300") if code == "G75" else BASES[code]
    scene = planned.Scene(**MM, program=str(path), tool=1)
    planned.plan(scene, f"{code} {base}")
    tried = 0
    for field in entry.fields(code, ""):
        for number in outside(field):
            words = [word for word in base.split() if word[0] != field.letter]
            with pytest.raises(planned.PlanError):
                planned.plan(scene, " ".join([code, *words, f"{field.letter}{number:g}"]))
                pytest.fail(f"{code} with {field.letter}{number:g} is planned")
            tried += 1
    assert tried


def test_an_error_in_the_sub_has_the_line_of_the_users_program(tmp_path):
    path = tmp_path / "part.ngc"
    path.write_text("(one)\nG0 X1\n\n" + SUB.replace("G1 Y50", "G1 Y50 Z3") + "M2\n")
    with pytest.raises(planned.PlanError, match=r"sub O100, line 8 .*of part.ngc: a move in Z"):
        planned.plan(planned.Scene(**MM, program=str(path), tool=1), "G79 Q100 Z-3 R1")


@pytest.mark.parametrize(
    "scene, words",
    [
        ({"program": "/nowhere.ngc"}, "/nowhere.ngc: No such file or directory; name a G-code file that can be read"),
        ({"program": "/dev/zero"}, "/dev/zero: it is not a regular file"),
        ({"tool": 99}, "99"),
        (
            {"ini": str(ROOT / "configs" / "lathe.ini")},
            "lathe.ini has no REMAP for G13, so LinuxCNC does not know it there",
        ),
        ({"ini": "/nowhere.ini"}, "nowhere.ini"),
    ],
)
def test_a_scene_that_cannot_be(scene, words):
    with pytest.raises(CycleError) as caught:
        planned.plan(planned.Scene(**{**MM, **scene}), "G13 I10 Z-1 R1")
    assert words in str(caught.value)


# ---- the picture -------------------------------------------------------------------------------------------------


def picture(found, mode="light", languages=("en",)):
    """(root of the SVG, its text) of a plan."""
    items = colours.load("")
    text = entered.svg(
        found,
        "a title",
        [("Q", "sub", "100"), ("Z", "<depth> & more", "-3 mm")],
        items,
        mode,
        language.translator(languages),
    )
    root = ET.fromstring(text)
    used = {element.get(name) for element in root.iter() for name in ("fill", "stroke")} - {None, "none"}
    assert used <= {item.colour(mode) for item in items.values()}
    return root, text


def test_the_picture_shows_the_items_in_their_colours(program):
    scene = planned.Scene(**MM, program=program, tool=2, named=(("_chipwise_chop_size", 8.0),))
    found = planned.plan(scene, "G78 Q200 P41 Z-2 R1")
    for mode in colours.MODES:
        root, text = picture(found, mode)
        strokes = {element.get("stroke") for element in root.iter()}
        items = colours.load("")
        assert {items[item].colour(mode) for item in ("target", "path_ahead", "chop", "rapid", "tool")} <= strokes
        assert items["background"].colour(mode) in text and "chop line" in text and "&lt;depth&gt; &amp; more" in text
    assert "Trennschnitte: " in picture(found, languages=("de",))[1]
    without = picture(planned.plan(scene, "G78 Q200 P41 Z-2 R1 H0"))[1]
    assert colours.colour("chop", path="") not in without


def test_a_picture_of_odd_sizes():
    """A hole far from the origin, one point, numbers of any size: a finite picture."""
    scene = planned.Scene(**MM, tool=1)
    far = planned.plan(scene, "G13 X30000 Y-30000 I4 Z-1 R1")
    assert "M-" not in picture(far)[1].partition("<g ")[0] and "nan" not in picture(far)[1]
    empty = planned.Planned("M253 P1", scene, 1, 6.0)
    assert "nan" not in picture(empty)[1]
    many = replace(far, runs=(planned.Run("cut", np.zeros((entered.MOST_POINTS + 1, 3))),))
    assert "more than 200000 points, not drawn" in picture(many)[1]
