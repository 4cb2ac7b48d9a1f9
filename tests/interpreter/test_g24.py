# SPDX-License-Identifier: GPL-2.0-or-later
"""G24 through LinuxCNC's interpreter: units, offsets, modes, the SURFACE comment, refusals, preview and rs274 alike."""

import math
import re

import pytest
from support import surface_cases
from support.canon import ends_of, run_preview, run_rs274

from chipwise.clib.height_map import Shape
from chipwise.cycles.surface import SurfaceRequest, surface_plan
from chipwise.moves import Rapid
from chipwise.surface.model import Placing

TOOLS = {4: 6.0}
START = (1.0, 2.0, 20.0)
LINE = "G24 D1.5 Z-9 R4 L30 I0.2 K1.5 E150 P1 F600"


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return surface_cases.write_stl(tmp_path_factory.mktemp("model") / "part.stl", surface_cases.waves(15, 15.0))


def program(model, line=LINE, place="X=5,Y=-3,Z=1,SCALE=1.1", unit="G21", before="", start="G0 X1 Y2 Z20"):
    if unit == "G20":
        line, start = (
            re.sub(r"\b([XYZRIKDEF])(-?[\d.]+)", lambda m: f"{m[1]}{float(m[2]) / 25.4:.9f}", text)
            for text in (line, start)
        )
        place = re.sub(r"([XYZ])=(-?[\d.]+)", lambda m: f"{m[1]}={float(m[2]) / 25.4:.9f}", place)
    return (
        f"T4 M6\nS9000 M3\n{unit} G90 G17 G40 G94\n{before}\n{start}\n(SURFACE,FILE={model},{place})\n(begin)\n"
        f"{line}\n(end)\nM2\n"
    )


KNOWN = dict(
    stamp=(),
    placing=Placing((5.0, -3.0, 1.0), 1.1),
    bottom=-9.0,
    clearance=4.0,
    tool=Shape(6, 3),
    step=1.5,
    feed=600.0,
    plunge_feed=150.0,
    start=START,
    direction=30.0,
    allowance=0.2,
    relief=1.5,
    link=1,
)


def expected(model, **fields):
    return ends(surface_plan(SurfaceRequest(**{**KNOWN, "file": model, **fields})).moves)


def ends(moves):
    """[(kind, (x, y, z))] of moves from START; moves without a length are left out."""
    at, found = START, []
    for move in moves:
        new = tuple(old if value is None else value for old, value in zip(at, (move.x, move.y, move.z)))
        if math.dist(at, new) > 1e-6:
            found.append(("rapid" if isinstance(move, Rapid) else "feed", new))
        at = new
    return found


def same(trace, wanted, shift=(0, 0, 0), off=2e-4):
    assert not trace.error, trace.error
    found = ends_of(trace.between("begin", "end"))
    assert [e.kind for e in found] == [kind for kind, _ in wanted]
    for element, (_kind, place) in zip(found, wanted):
        assert math.dist(element.b, [p + s for p, s in zip(place, shift)]) <= off


def same_cuts(trace, wanted, off=2e-4):
    """Each feed ends where it should, and the traverses are as long, each but for a fifth, all but for a hundredth: of
    two links that take about the same time, the last decimals of a word may choose the other one (one of 82 was 14 %
    shorter, in 1.5 % less time)."""
    assert not trace.error, trace.error
    cuts, lengths = parted([(e.kind, e.b) for e in ends_of(trace.between("begin", "end"))])
    wanted_cuts, wanted_lengths = parted(wanted)
    assert len(cuts) == len(wanted_cuts)
    for cut, length, wanted_cut, wanted_length in zip(cuts, lengths, wanted_cuts, wanted_lengths):
        assert math.dist(cut, wanted_cut) <= off and length == pytest.approx(wanted_length, rel=0.2, abs=off), (
            cut,
            length,
        )
    assert sum(lengths) == pytest.approx(sum(wanted_lengths), rel=0.01)


def parted(moves):
    """Of [(kind, end)] from START the ends of the feeds, and how long the traverses before each of them are."""
    at, ends, lengths, length = START, [], [], 0.0
    for kind, end in moves:
        if kind == "feed":
            ends.append(end)
            lengths.append(length)
        length = 0.0 if kind == "feed" else length + math.dist(at, end)
        at = end
    return ends, lengths


@pytest.mark.parametrize("unit", ["G21", "G20"])
@pytest.mark.parametrize("machine", ["mm", "in"])
def test_units(model, unit, machine):
    """All four of program and machine units cut the same; 2e-4 mm: words of the test with nine decimals of an inch."""
    same_cuts(run_preview(program(model, unit=unit), TOOLS, machine), expected(model))


def test_rs274_and_offsets(model):
    same(run_rs274(program(model), TOOLS), expected(model))
    same(run_preview(program(model, before="G10 L2 P1 X7 Y8 Z-2"), TOOLS), expected(model), (7, 8, -2))


def test_without_the_core_library(model, tmp_path, monkeypatch):
    """Its planner is a process of its own: the remedy comes through, not an internal error."""
    monkeypatch.setenv("CHIPWISE_CORE", str(tmp_path / "none.so"))
    error = run_preview(program(model), TOOLS).error
    assert (
        f"core library {tmp_path}/none.so is missing; run `make build` first" in error and "internal error" not in error
    ), error


def test_g91_counts_z_from_r_and_r_from_here(model):
    same(run_preview(program(model, "G91\nG24 D1.5 R-16 Z-13 L30 I0.2 K1.5 E150 P1 F600\nG90"), TOOLS), expected(model))


@pytest.mark.parametrize("path", ["G64 P0.01", "G61"])
def test_modes_and_feed_are_afterwards_what_they_were(model, path):
    """Also the path mode, which the links change."""
    trace = run_preview(program(model, before=path), TOOLS)
    assert trace.modes("begin")[0] == trace.modes("end")[0]
    feeds = {round(feed, 6) for feed in trace.feeds if feed}
    assert (
        {600.0, 150.0} <= feeds and min(feeds) >= 150 and max(feeds) <= 600
    )  # at a slant the lead-in is between E and F


@pytest.mark.parametrize("unit, mm", [("G21", 1.0), ("G20", 25.4)])
def test_only_the_traverses_of_links_are_rounded(model, unit, mm):
    """Every cut has the program's path mode, P and Q; between two cuts, and only there, it is 1 mm: four cells of the
    map."""
    trace = run_rs274(program(model, unit=unit, before=f"G64 P{0.02 / mm:.9f} Q{0.01 / mm:.9f}"), TOOLS)
    assert not trace.error, trace.error
    tolerance, cuts, wide = None, set(), 0
    for line in trace.output.splitlines():
        mode = re.search(r"SET_MOTION_CONTROL_MODE\(CANON_CONTINUOUS, ([\d.]+)\)", line)
        tolerance = float(mode[1]) if mode else tolerance
        wide += mode is not None and float(mode[1]) == pytest.approx(1.0 / mm, abs=1e-6)
        cuts |= {tolerance} if "STRAIGHT_FEED" in line else set()
    assert max(cuts) == min(cuts) == tolerance == pytest.approx(0.02 / mm, abs=1e-6) and wide > 5


def test_defaults_and_known_stock(model):
    """Without R, L, I, K, P: from here, along X, no allowance, 1 mm, over the clearance plane; M250's top is used."""
    text = program(model, "G24 D2 Z-9 F600")
    same(
        run_preview(text, TOOLS),
        expected(model, clearance=20.0, step=2.0, direction=0.0, allowance=0.0, relief=1.0, link=0, plunge_feed=300.0),
    )
    known = program(
        model, "G24 D2 Z-9 F600", before="(WORKPIECE,BOX,XMIN=0,YMIN=-10,ZMIN=-20,XMAX=30,YMAX=30,ZMAX=3)\nM250"
    )
    same(
        run_preview(known, TOOLS),
        expected(
            model,
            clearance=20.0,
            step=2.0,
            direction=0.0,
            allowance=0.0,
            relief=1.0,
            link=0,
            plunge_feed=300.0,
            stock_top=3.0,
        ),
    )


def test_conventional_with_m4(model):
    same(run_preview(program(model, before="M4"), TOOLS), expected(model, climb=False))


def test_the_last_comment_counts_and_the_folder_of_the_program(model, tmp_path):
    text = program(model).replace(
        "(begin)", "(SURFACE,FILE=none.stl)\n(surface , file = " + model + " , x=5, Y=-3,Z=1,SCALE=1.1)\n(begin)"
    )
    same(run_preview(text, TOOLS), expected(model))
    trace = run_preview(text + "(SURFACE,FILE=later.stl)\n", TOOLS)
    same(trace, expected(model))


LEVELS = "#<_chipwise_surface_depth> = 2.5\n#<_chipwise_ramp_angle> = 10\n"


@pytest.mark.parametrize("unit", ["G21", "G20"])
def test_levels(model, unit):
    before = LEVELS if unit == "G21" else LEVELS.replace("2.5", f"{2.5 / 25.4:.9f}")
    same_cuts(run_preview(program(model, unit=unit, before=before), TOOLS), expected(model, depth=2.5, ramp_angle=10.0))
    same(run_preview(program(model, before=LEVELS + "#<_chipwise_surface_depth> = 0"), TOOLS), expected(model))
    height = 0.06 if unit == "G21" else 0.06 / 25.4
    trace, wanted = (
        run_preview(program(model, unit=unit, before=f"#<_chipwise_surface_scallop> = {height:.9f}"), TOOLS),
        expected(model, scallop=0.06),
    )
    if unit == "G21":
        same(trace, wanted)
    else:  # a step-over that adapts carries the rounding of an inch on: not move by move
        assert not trace.error and len(trace.between("begin", "end")) == pytest.approx(len(wanted), rel=0.01)


def test_the_lines_before_are_known(model):
    """The second line finds the cuts of the first one done, but not after M250, another offset or with a model
    elsewhere."""
    first = SurfaceRequest(**KNOWN, file=model, most_moves=500_000)
    second = "#<_chipwise_surface_rest> = 0.1\nG24 D0.8 Z-9 R4 I0.2 K1.5 E150 P1"
    stock = "M250 P-20 Q-20 R-12 I60 J60 K16"

    def after(between):
        text = program(model).replace(
            "(begin)\n" + LINE, f"{LINE}\n{between}\n(begin)\n#<_chipwise_surface_depth>=0\n{second}"
        )
        trace = run_preview(text, TOOLS)
        assert not trace.error, trace.error
        return trace.between("begin", "end")

    def fed(between):
        return sum(math.dist(e.a, e.b) for e in after(between) if e.kind != "rapid")

    wanted = SurfaceRequest(
        **{**KNOWN, "direction": 0.0, "step": 0.8, "start": (0.0, 0.0, 4.0)}, file=model, least=0.1, earlier=(first,)
    )
    plan = surface_plan(wanted)
    found, rest = ends_of(after("")), fed("")
    assert sum(e.kind != "rapid" for e in found) == sum(kind == "feed" for kind, _ in ends(plan.moves))
    assert [e.b for e in found if e.kind != "rapid"][-1] == pytest.approx(
        [m for m in ends(plan.moves) if m[0] == "feed"][-1][1], abs=2e-4
    )
    assert fed(stock) > 1.5 * rest
    assert fed("G10 L2 P1 X0.5") > 1.5 * rest
    assert fed(f"(SURFACE,FILE={model},X=6,Y=-3,Z=1,SCALE=1.1)") > 1.5 * rest


def test_arcs_in_all_units_and_none_in_turned_coordinates(model):
    """G18 after G20 and G91, G90.1 and offsets; under a rotation LinuxCNC has no such arcs, and the moves are lines."""
    line = "G24 D3 Z-9 R4 L90 F600"
    wanted = dict(direction=90.0, step=3.0, allowance=0.0, relief=1.0, link=0, plunge_feed=300.0)
    assert (
        sum(
            type(move).__name__ == "PlaneArc"
            for move in surface_plan(SurfaceRequest(**{**KNOWN, **wanted}, file=model)).moves
        )
        > 3
    )
    same(
        run_preview(program(model, line, before="G90.1\nG10 L2 P1 X7 Y8 Z-2"), TOOLS),
        expected(model, **wanted),
        (7, 8, -2),
    )
    same(run_preview(program(model, line, unit="G20"), TOOLS, "in"), expected(model, **wanted))
    turned = run_preview(program(model, line, before="G10 L2 P1 R30"), TOOLS)
    assert not turned.error and all(e.kind != "arc" and e.ccw for e in turned.between("begin", "end"))
    assert len(ends_of(turned.between("begin", "end"))) == len(expected(model, **wanted, arcs=False))


@pytest.mark.parametrize(
    "change, text",
    [
        (("G24 D1.5", "G24"), "word D (step-over) is missing"),
        (("D1.5", "D9"), "step-over D9 mm is larger than the tool (6 mm); use D up to 6 mm"),
        (("Z-9", ""), "word Z (final depth) is missing"),
        (("R4", "R0.5"), "clearance plane R0.5 mm is below the top of the model"),
        (("P1", "P3"), "link P3 is not known"),
        (("I0.2", "I0.2 J3"), "word J is not used here"),
        (("(SURFACE", "(SURFASE"), "there is no SURFACE comment"),
        (("FILE=", "FILE=none"), "No such file"),
        (("FILE=", "FOLDER="), "is not FILE=name"),
        (("SCALE=1.1", "SCALE=0"), "SCALE=0 is not"),
        (("X=5", "X=five"), "X=five is not"),
        (("X=5", "X=5,x=6"), "SURFACE comment: X is given twice; give it once"),
        (("F600", ""), "no feed is set"),
        (("(begin)", "#<_chipwise_surface_depth> = -1 (begin)"), "#<_chipwise_surface_depth> = -1 is not a height"),
        (("G17", "G18"), "the plane is not G17"),
    ],
)
def test_refused_without_motion(model, change, text):
    assert change[0] in program(model)
    trace = run_preview(program(model).replace(*change), TOOLS)
    assert trace.error.startswith("chipwise: G24: ") and text in trace.error and trace.error_line == 8, trace.error
    begin = next(n for name, n, _ in trace.comments if name == "begin")
    assert len(trace.elements) == begin


def test_no_pattern_holds_it(model):
    text = f"T4 M6\nG21 G90 G17 F600\nO100 sub\n{LINE}\nO100 endsub\nG75 Q100 X30 H1\nM2\n"
    assert (
        "G24 follows the stock at one place only; program it outside of the pattern" in run_preview(text, TOOLS).error
    )


def test_bad_model_is_a_message(tmp_path):
    (tmp_path / "part.stl").write_bytes(b"\xff\xd8\xff" + bytes(100))
    assert "part.stl: the file is a JPEG picture" in run_preview(program(tmp_path / "part.stl"), TOOLS).error
