# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 through LinuxCNC's interpreter: units, offsets, modes, spindle, messages, refusals, goldens, the demo
programs."""

import dataclasses
import math
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from support import contour_program, pocket_oracle as oracle
from support.hole_oracle import walk
from support.pocket_judge import case_of
from support.canon import ROOT, run_preview, run_rs274, same_path
from support.goldens import compare_golden, motion_text, turned

from chipwise.cycles import pocket as cycle
from chipwise.geometry.base.contour import ArcElement, LineElement

# A box of 50 x 30 with one round corner and a round island, a tool of 6 mm; from 0 0 20.
SUB = """o100 sub
G0 X0 Y0
G1 X50
Y20
G3 X40 Y30 I-10
G1 X0
Y0
G0 X24 Y15
G2 I-4
o100 endsub
"""
LOOPS = (
    (
        LineElement((0.0, 0.0), (50.0, 0.0), 3),
        LineElement((50.0, 0.0), (50.0, 20.0), 4),
        ArcElement((50.0, 20.0), (40.0, 30.0), (40.0, 20.0), True, 5),
        LineElement((40.0, 30.0), (0.0, 30.0), 6),
        LineElement((0.0, 30.0), (0.0, 0.0), 7),
    ),
    (ArcElement((24.0, 15.0), (24.0, 15.0), (20.0, 15.0), False, 9),),
)
TOOLS = {1: 6.0, 3: 12.0}
LINE = "G79 Q100 Z-6 R2 J4 I0.5 K0.25 F600 E200"
REQUEST = cycle.PocketRequest(
    loops=LOOPS,
    bottom=-6.0,
    clearance=2.0,
    tool_radius=3.0,
    step=2.4,
    feed=600.0,
    plunge_feed=200.0,
    start=(0.0, 0.0, 20.0),
    side_allowance=0.5,
    floor_allowance=0.25,
    depth_step=4.0,
)


def program(line=LINE, sub=SUB, **around):
    """contour_program.program() of the pocket."""
    return contour_program.program(line, sub, **around)


def judge(request, found):
    """The oracle's verdict on what the interpreter did; 1e-4 mm for six decimals of an inch."""
    return oracle.judge(
        case_of(request), found, request.ramp_angle * 1.001, cycle.GAP_MM + 1e-4, cycle.pocket_plan(request).plunges
    )


@pytest.fixture(scope="module")
def base():
    """The pocket on a metric machine in a metric program: what all others must equal."""
    trace = run_preview(program(), TOOLS)
    assert trace.error == ""
    return trace.between("begin", "end")


def test_base_is_what_the_pure_cycle_says(base):
    same_path(base, walk(cycle.pocket_plan(REQUEST).moves, REQUEST.start), 2e-6)


@pytest.mark.parametrize("strategy, step", [(0, 3.3), (1, 3.3), (2, 3.3), (3, 3.3), (4, 2.7)])
def test_every_strategy_keeps_every_promise(strategy, step):
    trace = run_preview(program(f"{LINE} P{strategy} L30 D{step}"), TOOLS)
    assert trace.error == ""
    assert (
        judge(dataclasses.replace(REQUEST, strategy=strategy, direction=30.0, step=step), trace.between("begin", "end"))
        == []
    )


@pytest.mark.parametrize("machine", ["mm", "in"])
@pytest.mark.parametrize("unit", ["G21", "G20"])
def test_units_of_machine_and_program(machine, unit):
    """Everything in program units, D too; one golden for all four.  E20 holds the helix back: 20 / sin 3 degrees."""
    line = f"{LINE} D3".replace("E200", "E20")
    wanted = run_preview(program(line), TOOLS).between("begin", "end")
    trace = run_preview(program(line, unit=unit), TOOLS, machine=machine)
    assert trace.error == ""
    compare_golden(motion_text(trace), "g79_step")
    same_path(trace.between("begin", "end"), wanted, 1e-4)
    assert {round(f, 3) for f in trace.feeds if f} == {600, 382.146}


@pytest.mark.parametrize("unit", ["G21", "G20"])
def test_rs274_agrees_with_the_preview(base, unit):
    trace = run_rs274(program(unit=unit), TOOLS)
    assert trace.error == ""
    same_path(trace.between("begin", "end"), base, 2e-4 if unit == "G21" else 4e-3)


def test_g91(base):
    """R from current Z, Z from R; the sub's moves are incremental too."""
    sub = "o100 sub\nG1 X50\nY20\nG3 X-10 Y10 I-10\nG1 X-40\nY-30\nG0 X24 Y15\nG2 I-4\no100 endsub\n"
    trace = run_preview(program("G91 " + LINE.replace("Z-6 R2", "Z-8 R-18"), sub, after="G1 X1 Y0 Z0"), TOOLS)
    assert trace.error == ""
    same_path(trace.between("begin", "end"), base, 1e-5)
    assert trace.elements[-1].b[0] == pytest.approx(trace.elements[-2].b[0] + 1)  # still G91


def test_p4_in_inch_with_g91_in_turned_coordinates():
    """A square of 1 inch by a tool of 0.25."""
    sub = "o100 sub\nG1 X1\nY1\nX-1\nY-1\no100 endsub\n"
    trace = run_preview(
        program(
            "G91 G79 Q100 Z-.25 R-.5 P4 D.1 F20",
            sub,
            before="G10 L2 P2 X1 Y2 R30\nG55 G20",
            unit="G20 (no)",
            start="G0 X0 Y0 Z1",
        ),
        {1: 6.35},
    )
    assert trace.error == ""
    square = ((0.0, 0.0), (25.4, 0.0), (25.4, 25.4), (0.0, 25.4), (0.0, 0.0))
    asked = cycle.PocketRequest(
        loops=(tuple(LineElement(a, b, 3) for a, b in zip(square, square[1:])),),
        bottom=6.35,
        clearance=12.7,
        tool_radius=3.175,
        step=2.54,
        feed=508.0,
        plunge_feed=254.0,
        start=(0.0, 0.0, 25.4),
        strategy=4,
    )
    wanted = walk(cycle.pocket_plan(asked).moves, asked.start)
    same_path(trace.between("begin", "end"), [turned(e, 30, 1.0, 2.0, 0.0) for e in wanted], 1e-4)


@pytest.mark.parametrize(
    "before, angle, shift",
    [
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
    trace = run_preview(program(unit=unit, before="G21\n" + before), TOOLS)
    assert trace.error == ""
    same_path(trace.between("begin", "end"), [turned(e, angle, *shift) for e in base], 1e-4)


def test_defaults():
    """D 0.4 tool diameters, I, K and P 0, R the current Z, E half of F, one pass."""
    trace = run_preview(program("G0 Z2\nG79 Q100 Z-6 F600"), TOOLS)
    plain = dataclasses.replace(
        REQUEST, side_allowance=0.0, floor_allowance=0.0, depth_step=None, plunge_feed=300.0, start=(0.0, 0.0, 2.0)
    )
    same_path(trace.between("begin", "end")[1:], walk(cycle.pocket_plan(plain).moves, plain.start), 2e-6)


@pytest.mark.parametrize("spindle, climb", [("S900 M3", True), ("S900 M4", False), ("M5", True), ("S900 M4\nM5", True)])
def test_climb_by_the_spindle(spindle, climb):
    trace = run_preview(program(before=spindle), TOOLS)
    asked = dataclasses.replace(REQUEST, climb=climb)
    same_path(trace.between("begin", "end"), walk(cycle.pocket_plan(asked).moves, asked.start), 2e-6)


def test_ramp_angle():
    """INI default 3; the parameter wins."""
    for settings, before, angle in (
        ({}, "", 3.0),
        ({"RAMP_ANGLE": 8}, "", 8.0),
        ({"RAMP_ANGLE": 8}, "#<_chipwise_ramp_angle> = 20", 20.0),
    ):
        trace = run_preview(program(before=before), TOOLS, **settings)
        asked = dataclasses.replace(REQUEST, ramp_angle=angle)
        same_path(trace.between("begin", "end"), walk(cycle.pocket_plan(asked).moves, asked.start), 2e-6)


def test_seam_overlap():
    """INI default 0.3; the parameter wins, in the units of the program, and is refused beyond 100 mm."""
    for before, length in (
        ("", 0.3),
        ("#<_chipwise_seam_overlap> = 0", 0.0),
        ("#<_chipwise_seam_overlap> = 0.1", 2.54),
    ):
        trace = run_preview(program(before=before, unit="G20" if before else "G21"), TOOLS)
        same_path(
            trace.between("begin", "end"),
            walk(cycle.pocket_plan(dataclasses.replace(REQUEST, seam_overlap=length)).moves, REQUEST.start),
            1e-4,
        )
    for length in (-0.1, 100.1):
        assert run_preview(program(before=f"#<_chipwise_seam_overlap> = {length}"), TOOLS).error.startswith(
            f"chipwise: G79: seam overlap {length} mm is not a length from 0 to 100 mm; set #<_chipwise_seam_overlap> "
            f"to a length in that range"
        )


def test_flute_length_is_the_default_depth_step(tmp_path):
    tools = tmp_path / "t.toml"
    tools.write_text("[tool.1]\nflute_length = 4\n")
    trace = run_preview(program("G79 Q100 Z-6 R2 F600"), TOOLS, TOOL_GEOMETRY=tools)
    assert {round(e.b[2], 3) for e in trace.elements if e.kind != "rapid" and e.a[2] == e.b[2]} == {-6, -2}


def test_line_numbers_are_the_codes_own():
    trace = run_preview(program(), TOOLS)
    places = {t: n for t, n, _ in trace.comments}
    assert set(trace.lines[places["begin"] : places["end"]]) == {program().splitlines().index(LINE) + 1}


@pytest.mark.parametrize(
    "modes",
    [
        "G90 G91.1 G21 G64 P0.01 G94 G98 G0 X1",
        "G91 G91.1 G21 G61 G94 G99 G1 X1 F100",
        "S500 M3 G90 G91.1 G21 G64 G95 G98 G1 X1 F1",
    ],
)
def test_modal_state_afterwards(modes):
    heights = "Z-8 R0" if "G91 " in modes else "Z-6 R2"
    sub = "o7 sub\nG1 X40\nG1 Y30\nG1 X-40\nG1 Y-30\no7 endsub\n" if "G91 " in modes else SUB.replace("o100", "o7")
    trace = run_preview(f"T1 M6\n{sub}{modes}\nF77\n(settle)\n(begin)\nG79 Q7 {heights}\n(end)\nM2\n", TOOLS)
    assert trace.error == ""
    assert trace.modes("end") == trace.modes("begin")
    assert len(trace.between("begin", "end")) > 10


# ---- messages and the report -------------------------------------------------------------------------------------

NARROW = "o5 sub\nG0 X0 Y0\nG1 X30\nY18\nX60\nY22\nX30\nY40\nX0\nY0\no5 endsub\n"


def test_messages_of_regions_and_plunges():
    said = re.findall(r'MESSAGE\("(.*)"\)', run_rs274(program("G79 Q5 Z-6 R2 F600", NARROW), TOOLS).output)
    assert len(said) == 2 and re.match(
        r"chipwise: G79: the tool cuts its full width over [\d.]+ mm in \d+ places?, the longest over [\d.]+ mm from "
        r"X[\d.]+ mm Y[\d.]+ mm",
        said[1],
    )
    assert re.match(
        r"chipwise: G79: 1 region of the pocket cannot be entered by this tool and stays uncut, the largest "
        r"\(11\d\.\d mm2\) at X[\d.]+ mm Y[\d.]+ mm \(line 16\)$",
        said[0],
    )
    said = re.findall(
        r'MESSAGE\("(.*)"\)',
        run_rs274(
            program("G79 Q6 Z-6 R2 F600", "o6 sub\nG0 X0 Y0\nG1 X6.5\nY6.8\nX0\nY0\no6 endsub\n", unit="G20"), TOOLS
        ).output,
    )
    assert said[0].startswith(
        "chipwise: G79: no clearance for a helix or a ramp, so the tool plunges at E in 1 place, the first at X0.13071 "
        "in Y0.12158 in"
    )


# ---- refused -----------------------------------------------------------------------------------------------------

REFUSED = [
    ("G79 Q100 Z-6 R2 F600 D7.2", "step-over D7.2 mm is larger than the tool (6 mm); use D up to 6 mm"),
    (
        "G20\nG79 Q100 Z-6 R2 F600 D.2363",
        "step-over D0.2363 in is larger than the tool (0.23622 in); use D up to 0.23622 in",
    ),
    ("G79 Q100 Z-6 R2 F600 D0", "step-over D0 mm is not above 0; use D above 0, up to 6 mm"),
    ("G79 Q100 Z-6 R2", "no feed is set; give F on this line or before"),
    ("G79 Z-6 R2 F600", "word Q (number of the sub) is missing; add Q"),
    ("G79 Q100 R2 F600", "word Z (final depth) is missing; add Z"),
    ("G79 Q100 Z-6 R2 F600 P5", "strategy P5 is not known; use P0, P1, P2, P3 or P4"),
    (
        "G79 Q100 Z-6 R2 F600 P4 D3.1",
        "step-over D3.1 mm is above half the tool diameter (6 mm), which is the most of P4; use D up to 3 mm, or P0",
    ),
    (
        "G20\nG79 Q100 Z-6 R2 F600 P4 D.005",
        "step-over D0.005 in is below a fortieth of the tool diameter (0.23622 in), which is the least of P4; "
        "use D of 0.00591 in or more, or P0",
    ),
    ("G79 Q100 Z-6 R2 F600 P.5", "strategy P0.5 is not known; use P0, P1, P2, P3 or P4"),
    (
        "G79 Q100 Z6 R2 F600",
        "final depth Z6 mm with the floor allowance K0 mm is not below the clearance plane R2 mm; use a deeper Z, "
        "a smaller K or a higher R",
    ),
    ("G79 Q100 Z-6 R2 F600 I-1", "side allowance I-1 mm is negative; use I of 0 or more"),
    (
        "G79 Q100 Z-6 R2 F600 I12",
        "the tool (6 mm) with the side allowance I12 mm beside it fits nowhere in the pocket; use a smaller tool or a "
        "smaller I",
    ),
    ("G79 Q100 Z-6 R2 F600 E0", "plunge feed E0 mm/min is not above 0; use E above 0, or leave it out for F/2"),
    ("G79 Q100 Z-6 R2 F600 J0", "depth per pass J0 mm is not above 0; use J above 0"),
    ("G79 Q100 Z-6 R2 F600 H5", "word H5 is not H0; H0 means do not chop; the chop size is #<_chipwise_chop_size>"),
    ("G79 Q100 Z-6 R2 F600 X1", "word X is not used here; words are Q D I K P L Z R J E H F"),
    (
        "#<_chipwise_ramp_angle> = 0\nG79 Q100 Z-6 R2 F600",
        "ramp angle 0 is not from 0.1 to 90 degrees; set #<_chipwise_ramp_angle> to an angle in that range",
    ),
    ("G18\nG79 Q100 Z-6 R2 F600", "the plane is not G17; program G17 before"),
    ("G41 D1 F100\nG79 Q100 Z-6 R2 F600", "cutter compensation is on; program G40 before"),
    ("T0 M6\nG79 Q100 Z-6 R2 F600", "no tool is in the spindle; load one with T.. M6"),
]


def test_refused():
    """Exact message, no motion, and the program stops there."""

    def run(case):
        first = "" if "T0" in case[0] else "T1 M6\n"
        return run_rs274(f"{SUB}{first}G21 G0 X0 Y0 Z20\n(begin)\n{case[0]}\n(end)\nM2\n", TOOLS)

    with ThreadPoolExecutor(2) as pool:
        traces = list(pool.map(run, REFUSED))
    for (line, message), trace in zip(REFUSED, traces):
        assert trace.error == f"chipwise: G79: {message}", line
        assert trace.error_line == len(SUB.splitlines()) + (0 if "T0" in line else 1) + 3 + line.count("\n"), line
        assert trace.after("begin") == [], line
        assert "end" not in [t for t, _, _ in trace.comments]


def test_open_and_crossing_loops_are_named_by_their_lines():
    for change, words in (("G1 X0\nY0\nG0", "G1 X0\nG0"), ("G1 X0\nY0", "G1 X0\nX60 Y10\nX0 Y0")):
        trace = run_rs274(program(sub=SUB.replace(change, words)), TOOLS)
        assert trace.error.startswith("chipwise: G79: sub O100 of ") and "line" in trace.error
        assert trace.after("begin") == []


# ---- goldens and the programs we ship -----------------------------------------------------------------------------

GOLDENS = {f"g79_p{p}": program(f"G79 Q100 P{p} Z-3 R1 F600 D3.81") for p in (0, 1, 2)}


@pytest.mark.parametrize("name", sorted(GOLDENS))
def test_golden(name):
    trace = run_rs274(GOLDENS[name], TOOLS)
    assert trace.error == ""
    compare_golden(motion_text(trace), name)


@pytest.mark.parametrize("name", ["pocket", "pocket_oneway", "pocket_zigzag", "pocket_concentric"])
def test_demo_programs(name):
    """They run, to depth in two levels, with no message but that on the full width."""
    trace = run_rs274(Path(ROOT, "nc_files", name + ".ngc").read_text(), {3: 10.0})
    said = re.findall(r'MESSAGE\("(.*)"\)', trace.output)
    assert (
        trace.error == "" and len(said) == 1 and said[0].startswith("chipwise: G79: the tool cuts its full width over ")
    )
    levels = {round(e.b[2], 2) for e in trace.elements if e.kind != "rapid" and e.a[2] == e.b[2]}
    assert levels == {-3.45, -7.9}
