# SPDX-License-Identifier: GPL-2.0-or-later
"""G22, G23, G26 and G27 through LinuxCNC's interpreter: the moves of `chipwise turn`, modes, units, offsets, barriers,
refusals."""

import math
import re

import pytest

from chipwise import cli
from support.lathe_preview import canon_calls, machine, preview
from support.turning_paths import distances, polyline

SHAFT = (
    (8, 0),
    (10, -2),
    (10, -16),
    (14, -20, 4, 0),
    (14, -30),
)  # (x, z), of arcs with the centre's I and K; x a radius, mm
BORED = ((8, -25), (8, 0), (14, 0), (14, -25))
START = (60, 40)
TABLE = (
    "T1 P1 X3 Z-7.5 D0.8 I85 J5 Q2\nT2 P2 X-2 Z11 D0.8 I87 J32 Q2\nT5 P5 X1 Z20 D12 Q7\n"
    "T7 P7 X4 Z15 D0.4 I275 J328 Q3\n"
)
LATHE = "ROUGH=1,FINISH=2"
ALL = "ROUGH=1,ROUGH=7,FINISH=2,FINISH=7,DRILL=5"


def drawn(part, start, unit, twice, incremental, centres):
    """Lines of a part from start."""
    at = start
    for k, (x, z, *centre) in enumerate(part):
        to = (x - at[0], z - at[1]) if incremental else (x, z)
        arc = ""
        if centre:
            c = [a + v for a, v in zip(at, centre)] if centres else centre
            arc = f" I{c[0] / unit:.8f} K{c[1] / unit:.8f}"
        yield f"G{2 if centre else 1 if k else 0} X{twice * to[0] / unit:.8f} Z{to[1] / unit:.8f}{arc}"
        at = (x, z)


def program(
    part=SHAFT,
    code="G26 Q100",
    inch=False,
    diameter=False,
    incremental=False,
    centres=False,
    spindle="G94 G97 S500 M3",
    tools=LATHE,
    chuck="",
    more="",
    words="I0.3 D1 F100 E50",
    start=START,
    bar=(30, -60, 1),
    shift=(0, 0),
):
    """A program in the modes asked for; lengths in mm, radii."""
    unit, twice = (25.4 if inch else 1.0), (2 if diameter else 1)

    def scaled(text):
        return re.sub(r"([XZIKDFE])(-?[\d.]+)", lambda m: f"{m[1]}{float(m[2]) / unit:.8f}", text)

    modes = f"G{20 if inch else 21} G18 G{7 if diameter else 8} G40 G49"
    d, z0, z1 = (v / unit for v in bar)
    lines = [
        f"(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER={d:.8f},ZMIN={z0:.8f},ZMAX={z1:.8f})",
        f"(LATHE,{tools})",
        modes,
        spindle,
        f"G0 X{twice * start[0] / unit:.8f} Z{start[1] / unit:.8f}",
        *([scaled(chuck)] if chuck else []),
        *([more] if more else []),
        f"{'G91' if incremental else 'G90'} {'G90.1' if centres else 'G91.1'}",
        "(begin)",
        f"{code} {scaled(words)}",
        "(end)",
        "M2",
        "O100 sub",
        *drawn(part, start, unit, twice, incremental, centres),
        "O100 endsub",
        "",
    ]
    return "\n".join(lines)


@pytest.fixture
def lathe(tmp_path):
    """Text of a program -> Seen, on the lathe with TABLE."""
    ini = machine(tmp_path, TABLE)
    return lambda text: preview(tmp_path, ini, text)


def written(folder, text):
    """Text of the program that `chipwise turn` writes for a program."""
    (folder / "part.ngc").write_text(text)
    assert cli.main(
        ["turn", str(folder / "part.ngc"), "-o", str(folder / "out.ngc"), "--ini", str(folder / "lathe.ini")]
    ) in (0, 1)
    return (folder / "out.ngc").read_text()


def same(found, wanted, within=2e-6, scale=1.0, shift=(0.0, 0.0)):
    """Raise AssertionError unless two lists of moves are the same motion (mm)."""
    assert [m[0] for m in found] == [m[0] for m in wanted]
    for k, (a, b) in enumerate(zip(found, wanted)):
        assert math.dist(a[2], [v * scale + s for v, s in zip(b[2], shift)]) <= within, (k, a, b)
        assert (a[3] is None) == (b[3] is None) and (a[3] is None or a[3] == pytest.approx(b[3], rel=1e-5)), (k, a, b)
        if a[4]:
            assert (
                a[4][2] == b[4][2] and math.dist(a[4][:2], [v * scale + s for v, s in zip(b[4][:2], shift)]) <= within
            ), (k, a, b)


SAME = {
    "shaft": dict(),
    "bored, a drill under G96": dict(part=BORED, tools=ALL, spindle="G95 G96 D2500 S180 M3", words="I0.3 D1 F0.2 E0.1"),
    "a chuck": dict(chuck="G22 X20 Z-34"),
    "diameters, M4": dict(diameter=True, spindle="G94 G97 S500 M4"),
    "inch": dict(inch=True),
}


@pytest.mark.parametrize("name", SAME)
def test_g26_has_the_moves_of_chipwise_turn(lathe, tmp_path, name):
    """Tool changes, approaches and retreats included; each step with the feed of the written program."""
    seen = lathe(program(**SAME[name]))
    assert not seen.error, seen.error
    lines = written(tmp_path, program(**SAME[name])).replace("M2", "(end)")
    unit = (
        25.4 if "G20" in lines else 1.0
    )  # the preview has the place of a tool change in the unit of the move before it
    other = lathe(
        f"{'G20' if unit > 1 else 'G21'} G8 G18\nG0 X{START[0] / unit:.8f} Z{START[1] / unit:.8f}\n(begin)\n{lines}M2\n"
    )
    assert not other.error, other.error
    found = seen.between("begin", "end")
    same(found, other.between("begin", "end"))
    assert seen.tools == other.tools[-len(seen.tools) :] and len(found) > 20
    assert len(seen.messages) == 1 and "rough outside T1" in seen.messages[0]


def test_the_comparison_sees_a_difference(lathe):
    moves = lathe(program()).between("begin", "end")
    shifted = [(*m[:2], (m[2][0] + 0.001, m[2][1]), *m[3:]) for m in moves]
    for other in (shifted, moves[1:], [("feed", *m[1:]) for m in moves]):
        with pytest.raises(AssertionError):
            same(moves, other)


MODES = [
    dict(incremental=True, centres=True, diameter=True, more="G64 P0.02 Q0.01"),
    dict(more="G61"),
    dict(more="G61.1"),
    dict(diameter=True, more="G64"),
    dict(inch=True, incremental=True, more="G64 P0.001"),
    dict(spindle="G95 G97 S400 M4", words="I0.3 D1 F0.2 E0.1"),
    dict(part=BORED, tools=ALL, spindle="G95 G96 D2500 S180 M3", words="I0.3 D1 F0.2 E0.1"),
]


@pytest.mark.parametrize("k", range(len(MODES)))
def test_modes_feed_and_spindle_are_afterwards_what_they_were(lathe, k):
    seen = lathe(program(**MODES[k]))
    assert not seen.error, seen.error
    for key in ("gcodes", "spindle"):
        kept = [
            value[1:2] + value[3:] if key == "gcodes" else value
            for value in (seen.modes[m][key] for m in ("begin", "end"))
        ]
        if key == "gcodes":  # G43 is left on: the tool is the last one's
            assert (490 in kept[0]) and (430 in kept[1])
            kept = [[c for c in codes if c not in (490, 430)] for codes in kept]
        assert kept[0] == kept[1], (key, kept)
    assert math.dist(seen.between("begin", "end")[-1][2], START[::-1]) > 5  # other tools have other offsets


@pytest.fixture(scope="module")
def plain_path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plain")
    return feeds(preview(folder, machine(folder, TABLE), program()))


def feeds(seen):
    """Points of the feeds: rapids to the tool change depend on where the machine is."""
    assert not seen.error, seen.error
    moves = [m for m in seen.between("begin", "end") if m[0] != "rapid"]
    assert len(moves) > 20
    return polyline(moves, 0.02)


OFFSETS = ["", "G10 L2 P1 X{x} Z{z}", "G92 X{u} Z{w}"]


@pytest.mark.parametrize("k", range(8))
def test_the_same_path_on_the_work(tmp_path, plain_path, k):
    """G7/G8, G20/G21, both machines, front and back tool post, work offsets: to 0.001 mm."""
    inch_machine, inch, diameter = bool(k & 1), bool(k & 2), bool(k & 4)
    unit, twice, back = (25.4 if inch else 1.0), (2 if diameter else 1), (k + k // 4) % 2
    more = OFFSETS[(k + 1) % 3].format(
        x=twice * 1.5 / unit, z=-7.25 / unit, u=twice * (START[0] - 1.5) / unit, w=(START[1] + 7.25) / unit
    )
    table = (
        re.sub(r"\b([XZD])(-?[\d.]+)", lambda m: f"{m[1]}{float(m[2]) / 25.4:.9f}", TABLE) if inch_machine else TABLE
    )
    ini = machine(
        tmp_path,
        table,
        "lathe_inch.ini" if inch_machine else "lathe.ini",
        edit=lambda text: text.replace("BACK_TOOL_LATHE = 1", f"BACK_TOOL_LATHE = {back}"),
    )
    path = feeds(preview(tmp_path, ini, program(inch=inch, diameter=diameter, more=more)))
    assert max(distances(path, plain_path).max(), distances(plain_path, path).max()) < 0.001
    assert distances(path + (0.0, 0.0015), plain_path).max() > 0.001  # it would be seen


def test_units_that_change_after_the_last_move(lathe):
    """The preview's own place of a tool change is then in the unit of the move before it (gcodemodule.cc,
    2.9.0~pre1)."""
    other = (
        program(inch=True)
        .replace("G20 G18", "G21 G18")
        .replace(f"G0 X{START[0] / 25.4:.8f} Z{START[1] / 25.4:.8f}", f"G0 X{START[0]} Z{START[1]}\nG20")
    )
    found = lathe(other)
    assert not found.error and "G20\nG90" in other
    same(found.between("begin", "end"), lathe(program(inch=True)).between("begin", "end"), 1e-5)


def test_the_tolerance_of_the_path_mode_comes_back(tmp_path):
    ini = machine(tmp_path, TABLE)
    (tmp_path / "part.ngc").write_text(program(more="G64 P0.02 Q0.01"))
    done = canon_calls(tmp_path, ini)
    modes = [
        line.split(" ", 1)[1]
        for line in re.findall(r"N\S+ (?:SET_MOTION_CONTROL_MODE|SET_NAIVECAM_TOLERANCE).*", done.stdout)
    ]
    assert modes[-2:] == ["SET_MOTION_CONTROL_MODE(CANON_CONTINUOUS, 0.020000)", "SET_NAIVECAM_TOLERANCE(0.0100)"], (
        done.stdout[-500:] + done.stderr
    )
    assert "SET_MOTION_CONTROL_MODE(CANON_EXACT_PATH)" in modes


def test_expressions_and_subs_in_files_count(lathe, tmp_path):
    """The words and the sub are those of the interpreter: parameters, loops, a file of its own."""
    seen = lathe(
        program(more="#1 = 100\n#<r> = 8\n#<_len> = 30", code="G26 Q#1").replace(
            "X14.00000000 Z-30.00000000", "X[10+4] Z[-#<_len>]"
        )
    )
    assert not seen.error, seen.error
    same(seen.between("begin", "end"), lathe(program()).between("begin", "end"))


def test_the_barrier_keeps_its_place_and_ends(lathe):
    """G22 is in work coordinates where it stands, and stays where the machine is whatever the work offset becomes; G23
    ends it."""

    def seen(chuck, more=""):
        return lathe(
            program(part=((8, 0), (8, -20)), tools="ROUGH=1", bar=(30, -60, 0), chuck=chuck, more=more, start=(90, 40))
        )

    def lowest(found):
        """Of the first approach: X before Z."""
        assert not found.error, found.error
        return found.between("begin", "end")[0][2][1]

    free = lowest(seen(""))
    assert lowest(seen("G22 X40 Z-25")) == pytest.approx(free + 25) and lowest(
        seen("G22 X40 Z-25 I60 K-30")
    ) == pytest.approx(free + 45)
    assert (
        lowest(seen("G22 X40 Z-25\nG22 X50 Z-30")) == pytest.approx(free + 35)
        and lowest(seen("G22 X40 Z-25\nG23")) == free
    )
    for chuck, more in (("G22 X20 Z-19", ""), ("G22 X20 Z-25", "G10 L2 P1 Z-6"), ("G22 X20 Z-25", "G92 Z46")):
        assert "part goes into a barrier" in seen(chuck, more).error, (chuck, more)
    for chuck, more in (("G22 X20 Z-19", "G10 L2 P1 Z6"), ("G22 X20 Z-25", "G10 L2 P1 Z-4"), ("G22 X20 Z-19\nG23", "")):
        assert not seen(chuck, more).error, (chuck, more)


def test_g27_makes_one_step(lathe):
    whole, steps = lathe(program()), {n: lathe(program(code=f"G27 Q100 L{n}")) for n in (1, 3, 5, 7)}
    for seen in steps.values():
        assert not seen.error, seen.error
    feeds = [m[2] for m in whole.between("begin", "end") if m[0] != "rapid"]
    assert feeds == [m[2] for n in steps for m in steps[n].between("begin", "end") if m[0] != "rapid"]
    assert "step 5, rest outside" in steps[5].messages[0]
    unneeded = lathe(program(code="G27 Q100 L2"))
    assert (
        not unneeded.error
        and unneeded.between("begin", "end") == []
        and "step 2, drill: not needed" in unneeded.messages[0]
    )


def test_the_steps_of_the_ini_file(tmp_path):
    """[CHIPWISE]TURNING_STEPS has the order for G26 and for chipwise turn; a file that cannot be used is named."""
    (tmp_path / "steps.toml").write_text('steps = ["rough outside", "finish outside"]\n')
    ini = machine(
        tmp_path, TABLE, edit=lambda text: text.replace("[CHIPWISE]\n", "[CHIPWISE]\nTURNING_STEPS = steps.toml\n")
    )
    text = program(bar=(30, -60, 0))
    seen = preview(tmp_path, ini, text)
    assert not seen.error and seen.messages[0].startswith("chipwise: G26: 1 rough outside T1, 2 finish outside T2"), (
        seen
    )
    assert "(step 2: finish outside" in written(tmp_path, text)
    for content, words in (
        ("steps = [1]", "has no list of steps"),
        ("steps = [", "is not TOML"),
        ('steps = ["polish"]', "polish is not a step"),
    ):
        (tmp_path / "steps.toml").write_text(content)
        seen = preview(tmp_path, ini, text)
        assert words in seen.error and seen.error.startswith("chipwise: G26: "), seen.error
    (tmp_path / "steps.toml").unlink()
    assert "steps.toml: No such file" in preview(tmp_path, ini, text).error


def test_h1_only_says_the_plan(lathe):
    seen = lathe(program(code="G26 Q100 H1"))
    assert not seen.error and seen.between("begin", "end") == [] and seen.tools[1:] == []
    assert (
        len(seen.messages) > 12
        and any("3 rough outside T1" in text for text in seen.messages)
        and any("residue" in text for text in seen.messages)
    )


def test_nothing_to_do_moves_nothing(lathe):
    text = program(words="I0.3 D1 F100 E50 P200").replace(
        "O100 sub", "O200 sub\nG0 X8 Z0\nG1 X10 Z-2\nG1 Z-16\nG2 X14 Z-20 I4 K0\nG1 Z-30\nO200 endsub\nO100 sub"
    )
    seen = lathe(text)
    assert not seen.error and seen.between("begin", "end") == [] and "nothing to do" in seen.messages[0]


REFUSED = [
    (dict(more="G17"), "the plane is not G18"),
    (dict(more="G10 L2 P1 R10"), "the work coordinates are rotated"),
    (dict(more="G93"), "inverse time feed (G93)"),
    (dict(spindle="G94 G97 S500"), "the spindle does not turn"),
    (dict(spindle="G94 G97 M3"), "the spindle does not turn"),
    (dict(spindle="G94 G96 D#<_d> S180 M3", more=""), "G96"),
    (dict(words="I0.3 D1 E50"), "no feed F above 0"),
    (dict(code="G26"), "there is no Q"),
    (dict(code="G26 Q7"), "there is no sub O7"),
    (dict(words="I-1 F100"), "allowance I-1 is not"),
    (dict(words="D0 F100"), "depth of cut D0 is not"),
    (dict(code="G26 Q100 L2"), "word L is not used here"),
    (dict(code="G26 Q100 H2"), "H2 is neither 0 nor 1"),
    (dict(code="G27 Q100"), "word L"),
    (dict(code="G27 Q100 L14"), "there is no step L14: the plan has 13"),
    (dict(bar=(20, -60, 1)), "blank is smaller than the part"),
    (dict(tools="ROUGH=9"), "no such tool"),
    (dict(part=((8, 0), (8, -10), (9, -5), (9, -20))), "turns back in Z"),
    (dict(chuck="G22 X40"), "word Z (corner of the barrier) is missing"),
    (dict(chuck="G22 X40 Z-30 R5"), "word R is not used here"),
    (dict(chuck="\n".join(["G22 X20 Z-40"] * 21)), "there are 20 barriers already"),
]


@pytest.mark.parametrize("k", range(len(REFUSED)))
def test_refused_without_motion(lathe, k):
    """One line with the fact and the remedy, and nothing has moved."""
    fields, words = REFUSED[k]
    seen = lathe(program(**fields).replace("#<_d>", "[2500]"))
    assert words in seen.error and ";" in seen.error and seen.error.startswith("chipwise: G2"), seen.error
    first = seen.marks.get("begin", len(seen.moves))
    assert [m for m in seen.moves[first:]] == []


def test_the_preview_says_that_the_tool_begins_beside_the_work(lathe):
    """It begins where the machine is when the program is opened; the task refuses
    (tests/machine/test_turning_machine.py)."""
    seen = lathe(program(start=(10, -5)))
    assert not seen.error and len(seen.between("begin", "end")) > 20
    assert any(
        text.startswith("chipwise: G26: the tool is beside the work at Z2.5 mm X7 mm; begin in front of Z6 mm")
        for text in seen.messages
    )
    assert not any("beside" in text for text in lathe(program()).messages)
    said = lathe(program(start=(10, -5), diameter=True)).messages  # X as the program has it
    assert any("at Z2.5 mm X14 mm; begin in front of Z6 mm or outside of X40 mm" in text for text in said), said


def test_a_refusal_says_that_the_part_is_drawn_from_the_tool(lathe):
    """Its sub begins with G1: the place of the tool, X30 (radius) Z6, is a corner of the part, which the blank does not
    have."""
    text = program(diameter=True, start=(30, 6)).replace("O100 sub\nG0", "O100 sub\nG1")
    seen = lathe(text)
    assert (
        "the blank ends at" in seen.error
        and "(the sub O100 is drawn from the tool's place, Z6 mm X60 mm)" in seen.error
    ), seen.error
    assert "begin the sub with G0 X.. Z.." in seen.error
    assert "tool's place" not in lathe(program(bar=(20, -60, 1))).error


def test_check_plans_g26_and_says_what_it_lacks(tmp_path, capsys):
    """`chipwise check` is for mills: it has no stock here.  It runs G26 with a copy of the INI file elsewhere, so the
    tool table has to be found."""
    machine(tmp_path, TABLE)
    (tmp_path / "part.ngc").write_text(program())
    assert cli.main(["check", str(tmp_path / "part.ngc"), "--ini", str(tmp_path / "lathe.ini")]) == 2
    assert "no stock is defined" in capsys.readouterr().out


def test_a_remapped_tool_change_is_refused(tmp_path):
    ini = machine(
        tmp_path,
        TABLE,
        edit=lambda text: text.replace("REMAP = G22", "REMAP = M6 modalgroup=6 python=g23\nREMAP = G22"),
    )
    seen = preview(tmp_path, ini, program())
    assert "M6 is remapped on this machine" in seen.error and "chipwise turn -o" in seen.error
