# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise contour: figures against closed forms, pictures read back, errors in one line with exit status 2."""

import math
import os
import re
import xml.etree.ElementTree as ElementTree

import pytest
from support import forked

from chipwise.cli import contour
from chipwise.drawing import contour as picture

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

PROGRAM = """G21 G90
G77 Q100 P41 Z-5
O100 sub
  G0 X0 Y0
  G1 X80
  G1 Y60
  G3 X70 Y70 I-10 J0
  G1 X0
  G1 Y0
O100 endsub
O200 sub (a pocket with two islands)
  G0 X0 Y0
  G1 X80
  G1 Y60
  G1 X0
  G1 Y0
  G0 X20 Y20
  G3 I8
  G0 X45 Y10
  G1 X60 Y10
  G1 Y50
  G1 X45 Y10
O200 endsub
O300 sub
  G0 X0 Y0
  G1 X#<_width>
  G1 X[#<_width> + #100] Y20
O300 endsub
O400 sub
  o401 while [1]
    #1 = [#1 + 1]
  o401 endwhile
O400 endsub
O500 sub
  G1 X10
  G1 Z-1
O500 endsub
O600 sub
  G1 X10 Y10
  G1 X10 Y0
  G1 X0 Y10
O600 endsub
O700 sub
O700 endsub
O800 sub
  G1 X3
  G1 Y4
  G1 X0 Y0
O800 endsub
M2
"""


def chipwise(*arguments, env=None):
    return forked.run(
        [forked.CHIPWISE, "contour", *arguments], env={**os.environ, "INI_FILE_NAME": "", **(env or {})}, timeout=300
    )


@pytest.fixture
def program(tmp_path):
    path = tmp_path / "part.ngc"
    path.write_text(PROGRAM)
    return path


def drawn(program, *arguments, **environment):
    """(rows {name: numbers}, regions [(x, y, area, lines)], text) of a run that must succeed."""
    done = chipwise(program, *arguments, env=environment)
    assert done.returncode == 0, done.stderr
    rows = {}
    for line in done.stdout.splitlines():
        match = re.match(r"(finish shape|boundary|island \d|(?:centre path|rough shape) \d)(?:, open)?\s+(\d.*)", line)
        if match:
            rows[match[1]] = [None if word == "-" else float(word) for word in match[2].split()]
    regions = [
        (float(x), float(y), float(area), lines)
        for x, y, area, lines in re.findall(
            r"^ +\d+  X(\S+) Y(\S+)  (\S+) \w+2  (lines? .*)$", done.stdout, re.MULTILINE
        )
    ]
    return rows, regions, done.stdout


def test_inside_against_closed_forms(program):
    """Rectangle 80 x 70 with one fillet of 10, tool 6 on its left: three corners are left."""
    rows, regions, text = drawn(program, "--sub", 100, "--tool", 6)
    quarter = 1 - math.pi / 4
    assert rows["finish shape"] == pytest.approx([5, 4, 1, 280 + 5 * math.pi, 5600 - 100 * quarter], abs=1e-4)
    assert rows["centre path 1"] == pytest.approx(
        [5, 4, 1, 2 * 74 + 2 * 64 - 14 + 3.5 * math.pi, 74 * 64 - 49 * quarter], abs=1e-4
    )
    assert rows["rough shape 1"][4] == pytest.approx(5600 - 100 * quarter - 3 * 9 * quarter, abs=1e-4)
    assert "part.ngc, tool 6 mm left (41), inside" in text
    assert [r[2] for r in regions] == pytest.approx([9 * quarter] * 3, abs=1e-4)
    for (x, y, _, lines), corner, named in zip(regions, ((80, 0), (0, 70), (0, 0)), ("5, 6", "8, 9", "5, 9")):
        assert math.dist((x, y), corner) < 2 and lines == f"lines {named}"


def test_outside(program):
    rows, regions, text = drawn(program, "--sub", "o100", "--tool", 6, "--side", 42)
    assert rows["centre path 1"][3] == pytest.approx(280 + 5 * math.pi + 6 * math.pi, abs=1e-4)
    assert not regions and "right (42), outside" in text


def test_pocket_with_islands(program):
    rows, regions, _ = drawn(program, "--sub", 200, "--tool", 6)
    assert rows["boundary"][4] == pytest.approx(4800)
    assert rows["island 1"] == pytest.approx([1, 0, 1, 16 * math.pi, 64 * math.pi], abs=1e-4)
    lengths = sorted(rows[f"centre path {k}"][3] for k in (1, 2, 3))
    around = 15 + 40 + math.hypot(15, 40) + 6 * math.pi
    assert lengths == pytest.approx(sorted([2 * 74 + 2 * 54, 22 * math.pi, around]), abs=1e-4)
    assert len(regions) == 4


def test_an_island_across_the_wall(tmp_path):
    """A pocket of 80 x 60 with a bar of 20 into it from below: six corners; regions in chords, paths exactly."""
    path = tmp_path / "bar.ngc"
    path.write_text(
        "G21\no1 sub\nG0 X0 Y0\nG1 X80\nG1 Y60\nG1 X0\nG1 Y0\n"
        "G0 X30 Y-5\nG1 X50\nG1 Y20\nG1 X30\nG1 Y-5\no1 endsub\nM2\n"
    )
    rows, regions, text = drawn(path, "--sub", 1, "--tool", 10, "-o", tmp_path / "bar.svg")
    assert rows["centre path 1"][3:] == pytest.approx([260 + 5 * math.pi, 2950 - 12.5 * math.pi], abs=1e-3)
    assert "rough shape 1" not in rows and "contours meet" in text
    assert [r[2] for r in regions] == pytest.approx([25 * (1 - math.pi / 4)] * 6, abs=0.02)
    assert {r[3] for r in regions} == {f"lines {a}, {b}" for a, b in ((4, 5), (5, 6), (6, 7), (4, 7), (4, 10), (4, 12))}


@pytest.mark.parametrize("tool", ["6", "6mm", "0.2362204724in", " 6 MM"])
def test_units_of_the_tool(program, tool):
    assert "tool 6 mm" in drawn(program, "--sub", 100, "--tool", tool)[2]


def test_bare_number_is_in_machine_units(program):
    assert (
        "tool 6.35 mm"
        in drawn(program, "--sub", 100, "--tool", "0.25", INI_FILE_NAME=f"{ROOT}/configs/mill_inch.ini")[2]
    )
    assert "tool 6.35 mm" in drawn(program, "--sub", 100, "--tool", "0.25", "--ini", f"{ROOT}/configs/mill_inch.ini")[2]


def test_program_in_inch(tmp_path):
    path = tmp_path / "inch.ngc"
    path.write_text("(G21) G20\no1 sub\nG0 X0 Y0\nG1 X4\nG1 Y2\nG1 X0\nG1 Y0\no1 endsub\nM2\n")
    rows, _, text = drawn(path, "--sub", 1, "--tool", "0.5in")
    assert rows["finish shape"][3:] == pytest.approx([12, 8])
    assert rows["centre path 1"][3:] == pytest.approx([10, 3.5 * 1.5])
    assert "tool 0.5 in" in text and "length in" in text


def test_parameters_and_place(program):
    rows, _, _ = drawn(program, "--sub", 300, "--tool", 2, "--set", "_width=30", "--set", "100=15")
    assert rows["finish shape"][3] == pytest.approx(30 + 25)
    rows, _, text = drawn(program, "--sub", 800, "--tool", 0.5, "--at", 0, 0)
    assert rows["finish shape"][4] == pytest.approx(6)
    rows, _, _ = drawn(program, "--sub", 800, "--tool", 0.5, "--at", 0, -1)
    assert rows["finish shape"][3] == pytest.approx(3 + 5 + 5) and rows["finish shape"][4] is None


def test_a_tool_that_fits_nowhere(program, tmp_path):
    _, regions, text = drawn(program, "--sub", 800, "--tool", 50, "--at", 0, 0, "-o", tmp_path / "none.svg")
    assert "fits nowhere" in text
    assert [r[2] for r in regions] == pytest.approx([6])


# ---- pictures ------------------------------------------------------------------------------------------------------


def svg_paths(path):
    """(root, [(d, stroke)]) of a picture."""
    root = ElementTree.parse(path).getroot()
    return root, [(p.get("d"), p.get("stroke")) for p in root.iter("{http://www.w3.org/2000/svg}path")]


def arc_centre(x0, y0, r, large, sweep, x1, y1):
    """Centre of an SVG arc of a circle, by the rule of SVG 1.1, appendix F.6.5."""
    hx, hy = (x0 - x1) / 2, (y0 - y1) / 2
    root = math.sqrt(max(r * r / (hx * hx + hy * hy) - 1, 0)) * (-1 if large == sweep else 1)
    return (x0 + x1) / 2 + root * hy, (y0 + y1) / 2 - root * hx


def test_svg_has_arcs_on_the_right_side(program, tmp_path):
    path = tmp_path / "part.svg"
    drawn(program, "--sub", 100, "--tool", 6, "-o", path)
    _, found = svg_paths(path)
    shape = next(d for d, colour in found if colour == picture.FINISH and "Z" in d)
    words = re.findall(r"([MLA])([-\d. ]+)", shape)
    points = [tuple(map(float, text.split()[-2:])) for _, text in words]
    scale = (points[1][0] - points[0][0]) / 80
    arc = [(n, list(map(float, text.split()))) for n, (kind, text) in enumerate(words) if kind == "A"]
    assert len(arc) == 1
    n, (rx, ry, _, large, sweep, x, y) = arc[0]
    assert rx == ry == pytest.approx(10 * scale, abs=2e-3)
    centre = arc_centre(*points[n - 1], rx, large, sweep, x, y)
    assert centre == pytest.approx((points[0][0] + 70 * scale, points[0][1] - 60 * scale), abs=0.01)


def test_svg_full_circle_and_hatch(program, tmp_path):
    path = tmp_path / "pocket.svg"
    drawn(program, "--sub", 200, "--tool", 6, "-o", path)
    root, found = svg_paths(path)
    circle = [d for d, colour in found if colour == picture.FINISH and d.count("A") == 3]
    assert len(circle) == 1, "a full circle is drawn in three arcs"
    hatched = [p for p in root.iter() if p.get("fill") == "url(#hatch)" and p.get("d")]
    texts = [t.text for t in root.iter("{http://www.w3.org/2000/svg}text")]
    assert len(hatched) == 4 and {"1", "2", "3", "4"} < set(texts)
    assert "10 mm" in texts and "finish shape" in texts


def test_png(program, tmp_path):
    path = tmp_path / "part.png"
    done = chipwise(program, "--sub", 100, "--tool", 6, "-o", path)
    assert done.returncode == 0, done.stderr
    head = path.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n" and int.from_bytes(head[16:20], "big") == 1500
    assert sorted(os.listdir(tmp_path)) == ["part.ngc", "part.png"]


# ---- what it refuses -----------------------------------------------------------------------------------------------


def test_a_numbered_parameter_of_the_program_is_not_0(tmp_path):
    """LinuxCNC reads one that nobody has set as 0: another shape was drawn.  Its own ones, from #5001 on, have
    values."""
    path = tmp_path / "plate.ngc"
    path.write_text(
        "G21\nO100 sub\nG0 X0 Y0\nG1 X[20 + #101]\n#102=9\nG1 Y#102\nG1 X[0 * #5420]\nG1 Y0\nO100 endsub\nM2\n"
    )
    done = chipwise(str(path), "--sub", "100", "--tool", "3mm")
    assert (
        done.returncode == 2
        and "line 4 of plate.ngc: #101 has its value only when the program runs; give it with --set 101=30"
        in done.stderr
    )
    assert chipwise(str(path), "--sub", "100", "--tool", "3mm", "--set", "101=4").returncode == 0


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["/no/such.ngc", "--sub", "100", "--tool", "6"], ("/no/such.ngc", "No such file")),
        (["PROGRAM", "--sub", "999", "--tool", "6"], ("O999", "put the sub")),
        (["PROGRAM", "--sub", "x", "--tool", "6"], ("--sub x", "O100")),
        (["PROGRAM", "--sub", "400", "--tool", "6"], ("O400", "does not end", "loop")),
        (["PROGRAM", "--sub", "500", "--tool", "6"], ("O500", "line 36", "Z")),
        (["PROGRAM", "--sub", "800", "--tool", "6"], ("line 46", "begins where the tool is", "G0 X.. Y..")),
        (["PROGRAM", "--sub", "600", "--tool", "6", "--at", "0", "0"], ("line 39", "line 41", "cross")),
        (["PROGRAM", "--sub", "700", "--tool", "6"], ("O700", "put the contour")),
        (["PROGRAM", "--sub", "300", "--tool", "6", "--set", "100=15"], ("O300", "_width")),
        (["PROGRAM", "--sub", "300", "--tool", "6", "--set", "_width=30"], ("line 27", "--set 100=30")),
        (["PROGRAM", "--sub", "100", "--tool", "0"], ("--tool 0", "above 0")),
        (["PROGRAM", "--sub", "100", "--tool=-6"], ("--tool -6", "above 0")),
        (["PROGRAM", "--sub", "100", "--tool", "nan"], ("--tool nan", "6mm")),
        (["PROGRAM", "--sub", "100", "--tool", "inf"], ("--tool inf", "2000 mm")),
        (["PROGRAM", "--sub", "100", "--tool", "6cm"], ("--tool 6cm", "0.25in")),
        (["PROGRAM", "--sub", "100", "--tool", "{6}"], ("--tool {6}", "0.25in")),
        (["PROGRAM", "--sub", "100"], ("--tool", "--help")),
        (["PROGRAM", "--sub", "100", "--tool", "6", "--side", "43"], ("43", "--help")),
        (["PROGRAM", "--sub", "200", "--tool", "6", "--side", "41"], ("--side 41", "leave")),
        (["PROGRAM", "--sub", "100", "--tool", "6", "-o", "x.gif"], ("x.gif", ".svg")),
        (["PROGRAM", "--sub", "100", "--tool", "6", "-o", "/no/such/x.svg"], ("/no/such", "make it")),
        (["PROGRAM", "--sub", "100", "--tool", "6", "-o", "/proc/x.svg"], ("/proc/x.svg", "name a file")),
        (["PROGRAM", "--sub", "100", "--tool", "6", "--ini", "/no.ini"], ("/no.ini", "correct")),
        (["PROGRAM", "--sub", "100", "--tool", "6", "--set", "width=3"], ("width=3", "_name")),
        (["PROGRAM", "--sub", "100", "--tool", "6", "--at", "nan", "0"], ("--at", "two numbers")),
    ],
)
def test_errors(program, arguments, words):
    before = os.times()
    done = chipwise(*[str(program) if word == "PROGRAM" else word for word in arguments])
    assert done.returncode == 2
    assert done.stderr.startswith("chipwise: contour: ") and done.stderr.count("\n") == 1
    assert done.stdout == "" and "Traceback" not in done.stderr
    for word in words:
        assert word in done.stderr
    assert sum(os.times()[2:4]) - sum(before[2:4]) < 30  # s of computing


def test_no_renderer(program, tmp_path):
    """Without rsvg-convert: the remedy, and nothing left behind."""
    (tmp_path / "out").mkdir()
    done = chipwise(program, "--sub", 100, "--tool", 6, "-o", tmp_path / "out" / "x.png", env={"PATH": "/nowhere"})
    assert done.returncode == 2 and "librsvg2-bin" in done.stderr
    assert os.listdir(tmp_path / "out") == []


def test_middle_lies_in_its_region():
    """A region like a sickle: its middle is not the mean of its corners."""
    from chipwise.geometry.base.elements import make_arcs
    import numpy as np

    ends = np.array([[-10.0, 0.0], [10.0, 0.0]])
    edge = make_arcs(
        ends,
        ends[::-1],
        np.array([[0.0, 0.0], [0.0, -2.0]]),
        np.array([10.0, math.hypot(10, 2)]),
        np.array([-math.pi, math.pi - 2 * math.atan(0.2)]),
    )
    x, y = contour.middle(type("Region", (), {"boundary": edge, "holes": ()}))
    assert math.hypot(x, y) < 10 and math.hypot(x, y + 2) > math.hypot(10, 2)
