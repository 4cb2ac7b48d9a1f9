# SPDX-License-Identifier: GPL-2.0-or-later
"""G77 and G78 through LinuxCNC's interpreter: units, offsets, modes, refusals, goldens."""

import dataclasses
import math
import re

import pytest

from support.contour_program import SUB, TOOLS, ROUGH, FINISH, ROUGH_REQUEST, FINISH_REQUEST, program, rough_and_finish
from support.hole_oracle import walk
from support.contour_cycle_judge import judge
from support.canon import MODES, run_preview, run_rs274, run_rs274_on, same_path
from support.goldens import compare_golden, motion_text, turned

from chipwise.cycles.contour import contour_plan


@pytest.fixture(scope="module")
def base():
    return rough_and_finish()


def test_base_is_what_the_pure_cycle_says(base):
    rough, finish = base.between("begin", "middle"), base.between("middle", "end")
    same_path(rough, walk(contour_plan(ROUGH_REQUEST).moves, ROUGH_REQUEST.start), 2e-6)
    here = dataclasses.replace(FINISH_REQUEST, start=rough[-1].b)
    same_path(finish, walk(contour_plan(here).moves, here.start), 2e-6)


def test_base_keeps_every_promise(base):
    judge(ROUGH_REQUEST, base.between("begin", "middle"))
    slants, _ = judge(FINISH_REQUEST, base.between("middle", "end"))
    assert len(slants) == 4


@pytest.mark.parametrize("machine", ["mm", "in"])
@pytest.mark.parametrize("unit", ["G21", "G20"])
def test_units_of_machine_and_program(base, machine, unit):
    trace = run_preview(program(f"{ROUGH}\n{FINISH}", unit=unit), TOOLS, machine=machine)
    assert trace.error == ""
    same_path(trace.between("begin", "end"), base.between("begin", "end"), 1e-4)
    assert {round(f, 3) for f in trace.feeds if f} == {600, 400, 200}  # 400: the approach at 30 degrees goes down at E


@pytest.mark.parametrize("unit", ["G21", "G20"])
def test_rs274_agrees_with_the_preview(base, unit):
    trace = run_rs274(program(f"{ROUGH}\n{FINISH}", unit=unit), TOOLS)
    assert trace.error == ""
    same_path(trace.between("begin", "end"), base.between("begin", "end"), 2e-4 if unit == "G21" else 4e-3)


def test_g91(base):
    """R from current Z, Z from R; the sub's moves are incremental too, as a call of it would be."""
    sub = """o100 sub
G1 X40
Y10
G3 X-2 Y2 I-2 J0
G1 X-22
G2 X-4 Y4 J4
G1 Y24
X-12
Y-40
o100 endsub
"""
    trace = run_preview(program("G91 " + ROUGH.replace("Z-6 R2", "Z-8 R-18"), sub, after="G1 X1 Y0 Z0"), TOOLS)
    assert trace.error == ""
    same_path(trace.between("begin", "end"), base.between("begin", "middle"), 1e-5)
    assert trace.elements[-1].b[0] == pytest.approx(trace.elements[-2].b[0] + 1)  # still G91


@pytest.mark.parametrize(
    "before, angle, shift",
    [
        ("G10 L2 P1 X30 Y40 Z-7", 0, (30, 40, -7)),
        ("G10 L2 P2 X30 Y40 Z-7 R30\nG55", 30, (30, 40, -7)),
        ("G0 X0 Y0 Z0\nG92 X-5 Y6 Z1", 0, (5, -6, -1)),
        (
            "G10 L2 P1 X1 Y2 R45\nG0 X0 Y0 Z0\nG92 X-5 Y0",
            45,
            (1 + 5 * math.cos(math.pi / 4), 2 + 5 * math.sin(math.pi / 4), 0),
        ),
    ],
)
def test_offsets_rotation_g92(base, before, angle, shift):
    unit = "G20" if "R45" in before else "G21"
    trace = run_preview(program(ROUGH, unit=unit, before="G21\n" + before), TOOLS)
    assert trace.error == ""
    same_path(trace.between("begin", "end"), [turned(e, angle, *shift) for e in base.between("begin", "middle")], 1e-4)


def test_tool_length_offset(base):
    trace = run_preview(program(f"G43.1 Z10\nG0 Z20\n(cycle)\n{ROUGH}"), TOOLS)
    same_path(trace.between("cycle", "end"), base.between("begin", "middle"), 1e-4)


def test_line_numbers_are_the_codes_own(base):
    number = program(f"{ROUGH}\n(middle)\n{FINISH}").splitlines().index(ROUGH) + 1
    places = {t: n for t, n, _ in base.comments}
    assert set(base.lines[places["begin"] : places["middle"]]) == {number}


def test_approach_angle(base):
    """INI default 30; the parameter wins."""
    trace = run_preview(program("#<_chipwise_approach_angle> = 45\n" + FINISH), TOOLS)
    slanted = [e for e in trace.between("begin", "end") if e.kind == "feed" and e.a[2] > e.b[2] and e.a[:2] != e.b[:2]]
    assert slanted and all(math.dist(e.a[:2], e.b[:2]) == pytest.approx(2.0, abs=1e-4) for e in slanted)
    trace = run_preview(program(FINISH), TOOLS, APPROACH_ANGLE=60)
    slanted = [e for e in trace.between("begin", "end") if e.kind == "feed" and e.a[2] > e.b[2] and e.a[:2] != e.b[:2]]
    assert all(math.dist(e.a[:2], e.b[:2]) == pytest.approx(2.0 / math.tan(math.pi / 3), abs=1e-4) for e in slanted)


def test_to_and_fro():
    """A wall in two passes: both along the sub, or the second one back; INI default no, the parameter wins; G78 keeps
    the direction."""
    sub = "o100 sub\nG0 X0 Y0\nG1 X40\no100 endsub\n"

    def along(line, setting="", **ini):
        trace = run_preview(program(setting + line, sub), TOOLS, **ini)
        return [
            round(e.b[0] - e.a[0])
            for e in trace.between("begin", "end")
            if e.kind == "feed" and e.a[2] == e.b[2] and abs(e.b[0] - e.a[0]) > 30
        ]

    rough, on = "G77 Q100 P42 L2 D2 Z-3 R2 J5 F600", "#<_chipwise_to_and_fro> = 1\n"
    assert along(rough) == [40, 40]
    assert along(rough, on) == along(rough, TO_AND_FRO="yes") == [40, -40]
    assert along(rough, on.replace("1", "0"), TO_AND_FRO="yes") == [40, 40]
    assert along("G78 Q100 P42 Z-8 R2 J5 F600", on) == [40, 40]
    wrong = run_preview(program(on.replace("1", "2") + rough, sub), TOOLS)
    assert (
        "#<_chipwise_to_and_fro> = 2 is neither 0 nor 1; set it to 1 to rough open contours in both directions"
        in wrong.error
    )


def test_flute_length_is_the_default_depth_step(tmp_path):
    tools = tmp_path / "t.toml"
    tools.write_text("[tool.1]\nflute_length = 4\n")
    trace = run_preview(program("G77 Q100 P42 Z-6 R2 F600"), TOOLS, TOOL_GEOMETRY=tools)
    assert sorted({round(e.b[2], 3) for e in trace.elements if e.kind == "arc"}) == [-6, -2]


def test_message_of_what_the_tool_does_not_reach():
    """G78 says it, G77 does not; the tool of 12 mm does not go into the fillet of 4 mm."""
    sub = SUB.replace("G1 X0\n", "G1 X0 (x)\n")
    said = [run_rs274(program(f"T3 M6\n{code} Q100 P42 Z-6 R2 F600", sub), TOOLS).output for code in ("G77", "G78")]
    found = [re.findall(r'MESSAGE\("(.*)"\)', text) for text in said]
    assert found[0] == []
    assert len(found[1]) == 1
    assert found[1][0].startswith("chipwise: G78: the tool (12 mm) does not fit in one place (line 8, 9, 10; ")
    twenty = run_rs274(program("T3 M6\nG78 Q100 P42 Z-6 R2 F600", unit="G20"), TOOLS).output
    assert "the tool (0.47244 in) does not fit" in twenty


@pytest.mark.parametrize("modes", MODES)
def test_modal_state_afterwards(modes):
    code = "G77" if "G64" in modes else "G78"
    scale = 1 / 25.4 if "G20" in modes else 1.0
    centre = "I0 J0" if "G90.1" in modes else f"I{-5 * scale}"
    end = "" if "G91 " in modes else f"X{5 * scale} Y0"
    sub = f"o7 sub\nG0 X{5 * scale} Y0\nG3 {end} {centre}\no7 endsub\n"
    if "G91 G90.1" in modes:
        sub = f"o7 sub\nG1 X{5 * scale}\nY{5 * scale}\no7 endsub\n"
    heights = f"Z{-8 * scale} R0" if "G91" in modes else f"Z{-6 * scale} R{2 * scale}"
    line = f"{code} Q7 P42 {heights}"
    first, second = (modes.replace(" G80", ""), "G80") if "G80" in modes else (modes, "")
    trace = run_preview(
        f"T1 M6\n{sub}{first}\n{second}\nF{'3' if 'G20' in modes else '77'}\n(settle)\n(begin)\n{line}\n(end)\nM2\n",
        TOOLS,
    )
    assert trace.error == ""
    assert trace.modes("end") == trace.modes("begin")
    assert len(trace.between("begin", "end")) >= 5


def test_other_lines_go_on_as_before():
    """G81 stays the motion mode."""
    trace = run_preview(program(f"G99 G81 X50 Y0 Z-3 R1 F100\n{ROUGH}\n(drill)\nX60"), TOOLS)
    assert [(round(e.b[0]), round(e.b[2])) for e in trace.between("drill", "end") if e.kind == "feed"] == [(60, -3)]


SLOT = "o7 sub\nG0 X10 Y0\nG1 X20\nG3 Y20 J10\nG1 X0\nG3 Y0 J-10\nG1 X10\no7 endsub\n"


def test_chop_lines_come_before_the_same_contour():
    """INI, parameter and H0; where the lines go: tests/cycles/test_contour_chop.py."""
    line = "G78 Q7 P41 Z-6 R2 F600"
    plain = run_preview(program(line, SLOT), TOOLS).between("begin", "end")
    for text, settings, chopped in (
        (line, {"CHOP_SIZE": 9}, True),
        (line + " H0", {"CHOP_SIZE": 9}, False),
        ("#<_chipwise_chop_size> = 9\n" + line, {}, True),
        ("#<_chipwise_chop_size> = 0\n" + line, {"CHOP_SIZE": 9}, False),
        (line.replace("78", "77"), {"CHOP_SIZE": 9}, None),
    ):
        found = run_preview(program(text, SLOT), TOOLS, **settings).between("begin", "end")
        if chopped is None:  # G77: no slug is looked at, so there is no lead circle either
            assert len(found) == len(plain) - 1
            continue
        assert (len(found) > len(plain) + 6) == chopped
        if chopped:  # the lead may be smaller, to keep clear of the lines: five elements, then out and up
            same_path(found[-7:-2], plain[-7:-2], 1e-5)
        else:
            same_path(found[-len(plain) + 2 :], plain[2:], 1e-5)


# ---- bad input -------------------------------------------------------------------------------------------------------


REFUSED = [
    ("G77 Q100 P41 Z-6 R2", "no feed is set; give F on this line or before"),
    ("G77 P41 Z-6 R2 F600", "word Q (number of the sub) is missing; add Q"),
    ("G77 Q1.5 P41 Z-6 R2 F600", "Q1.5 is not the number of a sub; use the number of an O-sub: Q100 for O100 sub"),
    ("G77 Q-1 P41 Z-6 R2 F600", "Q-1 is not the number of a sub; use the number of an O-sub: Q100 for O100 sub"),
    ("G77 Q100 Z-6 R2 F600", "word P (side of the tool) is missing; add P41 (tool left of the contour) or P42 (right)"),
    ("G77 Q100 P40 Z-6 R2 F600", "side P40 is neither 41 nor 42; use P41 (tool left of the contour) or P42 (right)"),
    ("G77 Q100 P41 R2 F600", "word Z (final depth) is missing; add Z"),
    ("G77 Q100 P41 Z6 R2 F600", "final depth Z6 mm is not below the clearance plane R2 mm; use Z below R or R above Z"),
    ("G77 Q100 P41 Z-6 R2 F600 X1", "word X is not used here; words are Q P I D L J E R Z K H F"),
    ("G78 Q100 P41 Z-6 R2 F600 L2", "word L is not used here; words are Q P I J E R Z K H F"),
    ("G78 Q100 P41 Z-6 R2 F600 A1", "word A is not used here; words are Q P I J E R Z K H F"),
    ("G77 Q100 P41 Z-6 R2 F600 L3", "L3 radial passes without a step D; add D of at most 6 mm"),
    (
        "G77 Q100 P41 Z-6 R2 F600 I-1",
        "allowance I-1 mm is negative: it would cut into the finish shape; use I of 0 or more",
    ),
    ("G77 Q100 P41 Z-6 R2 F600 K-1", "approach height K-1 mm is not above 0; use K above 0, or leave it out to plunge"),
    (
        "G77 Q100 P41 Z-6 R2 F600 I9",
        "the tool (6 mm) fits nowhere on this side of the contour; "
        "use a smaller tool, or less allowance, or the other side",
    ),
    ("G77 Q100 P41 Z-6 R2 F600 H1", "word H1 is not H0; H0 means do not chop; the chop size is #<_chipwise_chop_size>"),
    (
        "#<_chipwise_approach_angle> = 91\nG77 Q100 P41 Z-6 R2 F600 K1",
        "approach angle 91 is not from 0.1 to 90 degrees; set #<_chipwise_approach_angle> to an angle in that range",
    ),
    ("G18\nG77 Q100 P41 Y-6 R2 Z-6 F600", "the plane is not G17; program G17 before"),
    ("G41.1 D1\nG77 Q100 P41 R2 Z-6 F600", "cutter compensation is on; program G40 before"),
    (
        "T2 M6\nG77 Q100 P41 R2 Z-6 F600",
        "tool 2 has a diameter of 0 mm, which is not above 0; give it a D in the tool table",
    ),
]


def test_refused():
    """Each line in one session, as in MDI: its message, no motion, and the good line at the end is cut as ever."""
    lines = "".join(f"G17 G40 G21\n(case {n})\n{line}\n" for n, (line, _) in enumerate(REFUSED))
    trace, messages, at = run_rs274_on(
        f"T1 M6\n{SUB}G21 G0 X0 Y0 Z20\n{lines}G17 G40 G21\nT1 M6\n"
        f"#<_chipwise_approach_angle> = 30\n(good)\n{ROUGH}\n(end)\nM2\n",
        {**TOOLS, 2: 0.0},
    )
    codes = [re.search(r"G7[78]", line)[0] for line, _ in REFUSED]
    assert messages == [f"chipwise: {code}: {message}" for code, (_, message) in zip(codes, REFUSED)]
    assert None not in at  # rs274 counts anew after an error: which lines, test_a_refusal_names_its_line
    assert trace.between("case 0", "good") == []
    assert len(trace.between("good", "end")) > 20


# ---- goldens ---------------------------------------------------------------------------------------------------------

GOLDENS = {
    "g77_mm": program(ROUGH),
    "g77_inch": program(ROUGH, unit="G20"),
    "g77_rotated": program(ROUGH, before="G21\nG10 L2 P1 X30 Y40 R30"),
    "g77_g91": program(
        "G91 " + ROUGH.replace("Z-6 R2", "Z-8 R-18"), "o100 sub\nG1 X40\nY10\nG3 X-2 Y2 R2\no100 endsub\n"
    ),
    "g78_slanted": program(FINISH),
    "g78_inside": program("G78 Q100 P41 Z-6 R2 F600"),
    "g78_loop": program(
        "G78 Q7 P42 Z-2 R1 F600",
        "o7 sub\n#<n> = 1\nG0 X10 Y0\no8 while [#<n> LE 6]\n"
        "G1 X[10 * COS[#<n> * 60]] Y[10 * SIN[#<n> * 60]]\n#<n> = [#<n> + 1]\no8 endwhile\no7 endsub\n",
    ),
}


@pytest.mark.parametrize("name", sorted(GOLDENS))
def test_golden(name):
    trace = run_rs274(GOLDENS[name], TOOLS)
    assert trace.error == ""
    compare_golden(motion_text(trace), name)
