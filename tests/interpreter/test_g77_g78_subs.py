# SPDX-License-Identifier: GPL-2.0-or-later
"""The subs of G77 and G78 through LinuxCNC's interpreter: every way of writing one, random ones, and those that cannot
be used."""

import dataclasses
import math
import os
import re

import pytest

from support.contour_program import SUB, SHAPE, TOOLS, ROUGH, FINISH, ROUGH_REQUEST, inch, program, rough_and_finish
from support.random_cases import random_count, random_seed
from support.contour_cycle_oracle import deepest, shape_oracle
from support.contour_oracle import from_elements
from support.contour_cycle_judge import judge, random_request
from support.bad_subs import BAD_SUBS
from support.canon import run_preview, run_rs274, same_path

from chipwise.cycles.contour import contour_plan
from chipwise.errors import CycleError
from chipwise.geometry.base.contour import ArcElement, make_contour
from chipwise.contour_sub.job import Job
from chipwise.contour_sub.read import read_shape


@pytest.fixture(scope="module")
def base():
    return rough_and_finish()


READING = """o100 sub
#<s> = [1 / #<_unit>]
G0 X[5 * #<s> + #5420 + #5222 * .01] Y[#<_x> * .1 + #5221 * .01]
G1 X[45 * #<s> + #5410 * .1 + #5230 * .01 * #<s>]
G1 Y[20 * #<s> + #5421 * .01 + #5211 * .01 + #5400 * .1 * #<s>]
G3 X[35 * #<s> + #31 * #<s>] R[40 * #<s> + #<_feed> * .001]
G1 X[#<_y> * .1 + #5210 * .1 * #<s> + #<_current_tool> * .1 * #<s> + #5220 * .1 * #<s>]
o100 endsub
"""


@pytest.mark.parametrize("unit, machine", [("G21", "in"), ("G20", "mm"), ("G21", "mm"), ("G20", "in")])
def test_a_sub_that_reads_parameters(unit, machine):
    """Under offsets, rotation and G92 the sub is what a call of it in the program is, parameter by parameter."""
    before = (
        "G21\nG10 L2 P2 X1 Y2 Z3 R45\nG55\nG0 X0 Y0 Z0\nG92 X-5 Y0\nF600\n#31 = 1.5\n"
        f"#<_unit> = {1 if unit == 'G21' else 25.4}\nM250 P-5 Q-5 R-20 I50 J50 K20\n"
    )  # the top of the stock is known
    at = "G0 X3 Y-4 Z20" if unit == "G21" else "G0 X[3/25.4] Y[-4/25.4] Z[20/25.4]"
    cycle = FINISH if unit == "G21" else inch(FINISH)
    feed = "F600" if unit == "G21" else inch("F600")
    trace = run_preview(
        f"T1 M6\n{READING}{before}{unit} {at}\n{feed}\n(call)\no100 call\n{at}\n(begin)\n{cycle}\n(end)\nM2\n",
        TOOLS,
        machine=machine,
    )
    assert trace.error == ""
    plain = [
        (("A", *e.a[:2], *e.b[:2], *e.centre, e.sweep[1]) if e.kind == "arc" else ("L", *e.a[:2], *e.b[:2]))
        for e in trace.between("call", "begin")
        if e.kind != "rapid"
    ]
    path = [
        (("A", *e.a[:2], *e.b[:2], *e.centre, e.sweep[1]) if e.kind == "arc" else ("L", *e.a[:2], *e.b[:2]))
        for e in trace.between("begin", "end")
        if e.kind != "rapid" and e.a[2] == e.b[2] == pytest.approx(-3, abs=1e-4)
    ]
    assert len(plain) == 4 and path
    assert abs(shape_oracle.gouge(plain, 3.0, path)) <= 1e-4
    assert shape_oracle.missing(plain, False, 1, 3.0, path, tolerance=1e-3) == []


VARIANTS = {
    "r_form": SUB.replace("I-2 J0", "R2").replace("I0 J4", "R4"),
    "p1_f_g40": SUB.replace("I-2 J0", "I-2 J0 P1 F33").replace("G1 X40", "G40 G1 X40 F9"),
    "expressions": SUB.replace("X40", "X[4 * 10]").replace("G1 Y10", "#<top> = 10\nG1 Y#<top>"),
    "global_parameters": "#<_my_long_side> = 40\n#31 = 12\n"
    + SUB.replace("X40", "X#<_my_long_side>").replace("X12", "X#31"),
    "loop": SUB.replace(
        "G1 X40\n", "#<n> = 0\no101 while [#<n> LT 4]\n#<n> = [#<n> + 1]\nG1 X[#<n> * 10]\no101 endwhile\n"
    ),
    "call": SUB.replace("G1 X16\n", "o102 call [16]\n") + "o102 sub\nG1 X#1\no102 endsub\n",
    "condition": SUB.replace("G1 Y40\n", "o103 if [#<_metric> EQ 1]\nG1 Y40\no103 else\nG1 Y50\no103 endif\n"),
    "lower_case_and_comments": "N5 O 100 SUB (the part)\ng0x0y0\n/(nothing)\n"
    + SUB.lower().partition("y0\n")[2].replace("g1 y40", "n77g01  y 40 ; up (and on)"),
    "repeat_start": SUB.replace("G0 X0 Y0\n", "G0 X0 Y0\nG0 X0\n").replace("G1 Y0\no100", "G1 Y0\nG0 X-9\no100"),
    "ini_value": SUB.replace("X40", "X[40 + #<_ini[CHIPWISE]CHOP_SIZE>]"),
}


def numbered(sub, first):
    """A sub with its O-numbers from 100 on moved to `first` on."""
    return re.sub(r"(?i)\b(o ?)(\d{3})\b", lambda m: m[1] + str(first + int(m[2]) - 100), sub)


def test_subs(base):
    """Every way of writing the same contour, in one program."""
    kinds = sorted(VARIANTS)
    subs = "".join(numbered(VARIANTS[kind], 1000 + 10 * n) for n, kind in enumerate(kinds))
    calls = "".join(
        f"G0 Z20\nG0 X0 Y0\n({kind})\n{ROUGH.replace('Q100', f'Q{1000 + 10 * n}')}\n(end {kind})\n"
        for n, kind in enumerate(kinds)
    )
    trace = run_preview(program(calls, subs), TOOLS)
    assert trace.error == ""
    for kind in kinds:
        found = trace.between(kind, "end " + kind)
        if kind == "loop":  # the same line in four pieces: other elements
            judge(ROUGH_REQUEST, found)
        else:
            same_path(found, base.between("begin", "middle"), 1e-5)


def test_sub_after_the_end_of_the_program(base):
    trace = run_preview(program(ROUGH, sub="") + SUB, TOOLS)
    same_path(trace.between("begin", "end"), base.between("begin", "middle"), 1e-5)


def test_sub_in_its_own_file(base, tmp_path):
    """On the SUBROUTINE_PATH, calling another file; a change of the file counts at once."""
    (tmp_path / "100.ngc").write_text(SUB.replace("G1 X16\n", "o<side> call [16]\n"))
    (tmp_path / "side.ngc").write_text("o<side> sub\nG1 X#1\no<side> endsub\nM2\n")
    trace = run_preview(program(ROUGH, sub=""), TOOLS, SUBROUTINE_PATH=tmp_path)
    assert trace.error == ""
    same_path(trace.between("begin", "end"), base.between("begin", "middle"), 1e-5)
    job = Job(program="", sub=100, ini=str(tmp_path / "x.ini"))
    (tmp_path / "x.ini").write_text(f"[RS274NGC]\nSUBROUTINE_PATH = {tmp_path}\n")
    first = read_shape(job)
    assert read_shape(job) is first
    (tmp_path / "side.ngc").write_text("o<side> sub\nG1 X20\nG1 X#1\no<side> endsub\nM2\n")
    os.utime(tmp_path / "side.ngc", ns=(1, 1))
    assert read_shape(job).loops[0][3].end == (20.0, 12.0)


def test_sub_called_from_a_sub_in_a_loop(base):
    """The line in a sub, in a loop, with parameters: each call reads the contour anew."""
    sub = (
        "o100 sub\nG0 X#<_x0> Y0\nG3 I5 J0\no100 endsub\no8 sub\n#<n> = 0\no9 while [#<n> LT 3]\n#<_x0> = [#<n> * 30]\n"
        "G78 Q100 P42 Z-6 R2 F600\n#<n> = [#<n> + 1]\no9 endwhile\no8 endsub\n"
    )
    trace = run_preview(program("#<_x0> = 0\no8 call", sub), TOOLS)
    assert trace.error == ""
    centres = [round(e.centre[0], 3) for e in trace.between("begin", "end") if e.kind == "arc" and e.radius > 5]
    assert centres == [5, 35, 65]


def test_the_plain_sub_is_cut_as_drawn(base):
    """An oracle of the whole way: the finishing tool touches every element of the shape as typed above."""
    finish = [
        ("A", *e.start, *e.end, *e.centre, math.pi / 2 if e.ccw else -math.pi / 2)
        if isinstance(e, ArcElement)
        else ("L", *e.start, *e.end)
        for e in SHAPE
    ]
    path = [
        (("A", *e.a[:2], *e.b[:2], *e.centre, e.sweep[1]) if e.kind == "arc" else ("L", *e.a[:2], *e.b[:2]))
        for e in base.between("middle", "end")
        if e.kind != "rapid" and e.a[2] == e.b[2] == pytest.approx(-6)
    ]
    assert shape_oracle.gouge(finish, 3.0, path) <= 1e-5
    assert shape_oracle.missing(finish, True, 1, 3.0, path, tolerance=1e-4) == []


def written(shape, number, scale):
    """A shape as the sub a CAM system would write, six decimals."""
    rows = [f"o{number} sub", "G0 X{:.6f} Y{:.6f}".format(*(v * scale for v in shape[0].start))]
    for e in shape:
        to = "X{:.6f} Y{:.6f}".format(*(v * scale for v in e.end))
        if isinstance(e, ArcElement):
            i, j = (c * scale - s * scale for c, s in zip(e.centre, e.start))
            rows.append(f"G{3 if e.ccw else 2} {to} I{i:.6f} J{j:.6f}")
        else:
            rows.append(f"G1 {to}")
    return "\n".join([*rows, f"o{number} endsub", ""])


@pytest.mark.parametrize("machine, unit", [("mm", "G21"), ("in", "G20")])
def test_random_contours_through_the_interpreter(machine, unit):
    """The whole way from text to canonical motion, in one program; judged against the shapes before they were
    written."""
    scale = 1.0 if unit == "G21" else 1 / 25.4
    cases, subs, lines = [], "", ""
    for seed in range(random_seed(), random_seed() + max(1, random_count(50, least=50) // 10)):
        r = dataclasses.replace(random_request(seed), tool_radius=3.0, angle=math.radians(30))
        try:
            contour_plan(r)
        except CycleError:
            continue
        number = 1000 + len(cases)
        words = "".join(
            f" {w}{v * scale:.9f}"
            for w, v in (
                ("I", r.allowance),
                ("Z", r.bottom),
                ("R", r.clearance),
                ("J", r.depth_step),
                ("K", r.approach),
                ("D", r.step),
            )
            if v
        )
        subs += written(r.shape, number, scale)
        lines += f"({number})\nG77 Q{number} P{r.side} L{r.passes}{words}\n"
        cases.append(r)
    trace = run_preview(
        f"T1 M6\n{subs}{unit} G0 X0 Y0 Z{20 * scale}\nF{600 * scale}\n{lines}({1000 + len(cases)})\nM2\n",
        TOOLS,
        machine=machine,
    )
    assert trace.error == "" and len(cases) > 2
    for number, r in enumerate(cases, 1000):
        found = trace.between(str(number), str(number + 1))
        if unit == "G21":
            judge(r, found)
        else:  # six decimals of an inch
            finish = from_elements(make_contour(list(r.shape)).elements)
            assert deepest(found, finish, r.tool_radius + r.allowance, r.clearance) <= 1e-3


@pytest.mark.parametrize("name", ["endless", "move in Z", "crosses itself", "empty"])
def test_bad_subs(name):
    """Named by its line, no motion, within 2 s of computing; all of them: tests/contour_sub/test_subs.py."""
    sub, message = BAD_SUBS[name]
    before = os.times()
    trace = run_rs274(f"{sub}T1 M6\nG21 G0 Z20\n(begin)\nG77 Q100 P41 Z-6 R2 F600\n(end)\nM2\n", TOOLS)
    after = os.times()
    assert trace.error == f"chipwise: G77: {message}"
    assert trace.after("begin") == []
    assert sum(after[2:4]) - sum(before[2:4]) < 2.0


@pytest.mark.parametrize("code", ["G78 Q100 P42", "G79 Q100"])
def test_lines_of_a_sub_that_block_delete_leaves_out(code, monkeypatch):
    """As a call of the sub would run them: with block delete on, lines that begin with / are not read."""
    words = " Z-6 R2 F600"
    deleted = SUB.replace("G1 X16\n", "G1 X20\n/G1 X18 Y14\n/G1 X16 Y12\nG1 X16\n")
    wanted = {
        "0": run_preview(program(code + words, deleted.replace("/", "")), TOOLS),
        "1": run_preview(program(code + words, deleted.replace("/G1 X18 Y14\n/G1 X16 Y12\n", "")), TOOLS),
    }
    for switch, plain in wanted.items():
        monkeypatch.setenv("BLOCK_DELETE", switch)
        trace = run_preview(program(code + words, deleted), TOOLS)
        assert trace.error == plain.error == ""
        same_path(trace.between("begin", "end"), plain.between("begin", "end"), 1e-6)
    assert len(wanted["0"].elements) != len(wanted["1"].elements)
