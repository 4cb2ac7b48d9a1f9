# SPDX-License-Identifier: GPL-2.0-or-later
"""Threads and undercuts: passes, run-in and run-out, units, hands, refusals; judged by an oracle written apart."""

import json
import math
import os
import random
import re

import pytest

from chipwise import cli
from support import ROOT
from support.lathe_preview import canon_calls, machine, preview
from support.random_cases import random_count, random_seed, write_replay
from support.threads import M20, NUT, clean, judged, lowered, passes, program, sub

INSIDE_TABLE = "T10 P10 D{d} I240 J300 Q8 ;60 degree threading insert on a bar of 6 mm\n"
INSIDE_GEOMETRY = '\n[lathe.10]\nroles = ["thread"]\nedge_length = 2.3\nrelief = 0\nbar = 6\nholder = [-1.2, 60, 2]\n'
ACCELERATION = 500.0  # mm/s2, of configs/lathe.ini
OVERRIDE = 1.2


@pytest.fixture
def lathe(tmp_path):
    """INI file of the simulated lathe with a threading tool for bores."""
    with (
        open(os.path.join(ROOT, "configs", "lathe.tbl")) as table,
        open(os.path.join(ROOT, "configs", "lathe_tools.toml")) as tools,
    ):
        return machine(tmp_path, table.read() + INSIDE_TABLE.format(d=0.2), geometry=tools.read() + INSIDE_GEOMETRY)


@pytest.fixture
def turn(tmp_path, lathe, capsys):
    """(text) -> (status, steps by name, written program, messages)."""

    def run(text):
        for name in ("out.ngc", "plan.json"):
            (tmp_path / name).unlink(missing_ok=True)
        (tmp_path / "part.ngc").write_text(text)
        status = cli.main(
            [
                "turn",
                str(tmp_path / "part.ngc"),
                "-o",
                str(tmp_path / "out.ngc"),
                "--json",
                str(tmp_path / "plan.json"),
                "--ini",
                str(lathe),
            ]
        )
        out = capsys.readouterr()
        if status == 2:
            assert not (tmp_path / "out.ngc").exists()
            return status, {}, "", out.err
        steps = {s["name"]: s for s in json.loads((tmp_path / "plan.json").read_text())["steps"]}
        return status, steps, (tmp_path / "out.ngc").read_text(), out.out

    return run


def test_passes_have_chips_of_equal_area_and_room_at_both_ends(turn):
    status, steps, text, said = turn(program())
    assert status in (0, 1) and steps["thread outside"]["needed"], said
    found = passes(text)
    depth, root = 0.61343 * 1.5, 10.0 - 0.61343 * 1.5
    squares = [((10.0 - x) / depth) ** 2 for _, _, x, _ in found]
    n = len(found) - 1
    assert n == 7 and squares == pytest.approx([min(k / n, 1.0) for k in range(1, n + 2)], abs=1e-5)
    speed = 800 / 60 * 1.5 * OVERRIDE
    room = speed * speed / (2 * ACCELERATION)
    half = 0.1 + depth / math.tan(math.radians(60))  # at most, of the insert from its middle where it meets the crest
    for z0, z1, x, pitch in found:
        assert pitch == pytest.approx(1.5) and x >= root - 1e-6
        assert z0 - half - room >= -(10.0 - root) + 0.0 and z1 + half + room <= -14.0
    assert clean(judged(text, M20, lowered(M20, root, 5), (32, -60, 0))), said


FAULTS = [(lambda z0, z1, x: (z0, z1 - 1.5, x)), (lambda z0, z1, x: (z0, z1, x - 0.3))]


@pytest.mark.parametrize("fault", FAULTS)
def test_the_oracle_sees_a_wrong_pass(turn, fault):
    _, _, text, _ = turn(program())
    root = 10.0 - 0.61343 * 1.5
    wrong = re.sub(
        r"^G33 X([\d.-]+) Z([\d.-]+)",
        lambda m: "G33 X{2:.6f} Z{1:.6f}".format(*fault(0, float(m[2]), float(m[1]))),
        text,
        flags=re.M,
    )
    assert wrong != text and judged(wrong, M20, lowered(M20, root, 5), (32, -60, 0))["gouge"] > 0.01


def test_a_thread_in_a_bore(turn):
    """M20 x 1.5 inside: from the bore's diameter outwards, the far side of the bar clear of the bore."""
    status, steps, text, said = turn(
        program(NUT, "(THREAD,PITCH=1.5)", 5, (30, -40, 0), "ROUGH=7,FINISH=7,DRILL=5,THREAD=10", "G94 G97 S300 M3")
    )
    assert status in (0, 1) and steps["thread inside"]["needed"] and not steps["thread outside"]["needed"], said
    found = passes(text)
    assert (
        found[-1][2] == found[-2][2] == pytest.approx(9.188 + 0.54127 * 1.5, abs=1e-5)
        and found[0][0] > 0 > -16 > found[0][1] > -20
    )
    root = 9.188 + 0.54127 * 1.5
    split = [
        *NUT[:4],
        (-16.2 + 2.2 * (10.4 - root) / (10.4 - 9.188), root),
        (-(10.2 - root) / (10.2 - 9.188), root),
        (0.0, 10.2),
        *NUT[7:],
    ]
    assert clean(judged(text, NUT, split, (30, -40, 0), bore=True)), said


@pytest.mark.parametrize("unit, twice", [(25.4, 1), (25.4, 2), (1.0, 2)])
def test_the_same_thread_in_all_units(turn, unit, twice):
    _, _, plain, _ = turn(program())
    _, _, other, said = turn(program(unit=unit, twice=twice, note=f"(THREAD,PITCH={1.5 / unit:.9f})"))
    assert other, said
    for a, b in zip(passes(plain), passes(other, unit), strict=True):
        assert a == pytest.approx(b, abs=2e-5)


def test_hands(turn):
    """M3 towards the chuck is right-handed, M4 left-handed; the other two begin in the undercut."""
    right = passes(turn(program())[2])
    assert passes(turn(program(note="(THREAD,PITCH=1.5,HAND=LEFT)", spindle="G94 G97 S800 M4"))[2]) == right
    for note, spindle in (
        ("(THREAD,PITCH=1.5,HAND=LEFT)", "G94 G97 S500 M3"),
        ("(THREAD,PITCH=1.5,HAND=RIGHT)", "G94 G97 S500 M4"),
    ):
        status, _, text, said = turn(program(note=note, spindle=spindle))
        assert status in (0, 1), said
        found = passes(text)
        assert all(-19.2 < z0 < -14 and z1 > 0 for z0, z1, _, _ in found)
        assert clean(judged(text, M20, lowered(M20, 10.0 - 0.61343 * 1.5, 5), (32, -60, 0))), said


def test_threads_run_under_g97(turn):
    """Under G96 the speed is that of the thread's diameter, or the comment's; the next step has G96 again."""
    for note, speed in (
        ("(THREAD,PITCH=1.5)", math.floor(50e3 / (20 * math.pi))),
        ("(THREAD,PITCH=1.5,SPEED=640)", 640),
    ):
        _, _, text, said = turn(
            program(
                note=note,
                spindle="G95 G96 D2500 S50 M3",
                words="I0.3 D1.5 F0.2 E0.1",
                tools="ROUGH=1,FINISH=4,THREAD=8,PARTOFF=6",
            )
        )
        assert text, said
        block, after = text.split("thread outside, T8")[1].split("(thread outside ends)")
        assert f"G97 S{speed} M3" in block and "G96 D2500 S50 M3" in after


def test_a_thread_that_the_blank_has_is_not_cut_again(turn):
    lines = list(sub(M20, "(THREAD,PITCH=1.5)", 2))
    text = program(words="P200 I0.3 D1.5 F200 E100") + "\n".join(["O200 sub", *lines[1:-1], "O200 endsub", ""])
    status, steps, _, said = turn(text)
    assert status in (0, 1) and not any(s["needed"] for s in steps.values()) and "the blank has the same thread" in said
    assert turn(text.replace("PITCH=1.5", "PITCH=1.25", 1))[1]["thread outside"]["needed"]


def wide(chain, z):
    """The chain with its undercut longer by z."""
    return [(a - (z if k > 3 else 0.0), b) for k, (a, b) in enumerate(chain)]


REFUSED = [
    (dict(note="(THREAD)"), "PITCH is not above 0"),
    (dict(note="(THREAD,PITCH=0)"), "PITCH=0 is not understood"),
    (dict(note="(THREAD,PITCH=nan)"), "PITCH=NAN is not"),
    (dict(note="(THREAD,PITCH=1.5,DEPTH=2)"), "DEPTH is more than PITCH"),
    (dict(note="(THREAD,PITCH=1.5,COLOUR=2)"), "COLOUR=2 is not understood"),
    (dict(note="(THREAD,PITCH=51)"), "up to 50 mm"),
    (dict(at=3), "not on a cylinder"),
    (dict(at=0), "draws nothing"),
    (dict(at=5), "draws nothing"),
    (dict(spindle="G94 G97 S2900 M3"), "the run-out of the thread needs"),
    (dict(spindle="G94 G97 S3900 M3"), "MAX_VELOCITY is 100 mm/s"),
    (dict(spindle="G94 G97 S2000 M4"), "the run-in of the thread needs"),
    (dict(at=6), "the part is above its root"),
    (dict(note="(THREAD,PITCH=2.5)"), "the pitch 2.5 mm is not one of T8"),
    (dict(note="(THREAD,PITCH=0.6)"), "nose radius 0.1 mm is more than"),
    (dict(tools="ROUGH=1,FINISH=4,THREAD=9"), "35 degrees between its edges"),
    (dict(more="G22 X9.5 I0 Z20 K0.4"), "the run-in of the thread needs"),
    (dict(spindle="G94 M3"), "a thread has no speed"),
]


@pytest.mark.parametrize("k", range(len(REFUSED)))
def test_what_is_refused(turn, k):
    fields, words = REFUSED[k]
    status, _, _, said = turn(program(**fields))
    assert (
        status == 2
        and words in said
        and ";" in said
        and "line" in said
        and said.count("\n") == 1
        and "Traceback" not in said
    ), said


def test_a_cylinder_that_is_not_finished_is_refused(tmp_path, capsys):
    (tmp_path / "part.ngc").write_text(program())
    (tmp_path / "steps.toml").write_text('steps = ["rough outside", "thread outside"]\n')
    assert cli.main(["turn", str(tmp_path / "part.ngc"), "--steps", str(tmp_path / "steps.toml")]) == 2
    assert "0.3 mm of stock is left on the cylinder of the thread (line 13)" in capsys.readouterr().err


def test_the_speed_that_a_refusal_names_is_possible(turn):
    """And a speed a little above it is refused."""
    said = turn(program(spindle="G94 G97 S2900 M3"))[3]
    speed = int(re.search(r"write SPEED=(\d+)", said)[1])
    assert 900 < speed < 2900 and turn(program(note=f"(THREAD,PITCH=1.5,SPEED={speed})"))[0] != 2
    assert turn(program(note=f"(THREAD,PITCH=1.5,SPEED={speed * 1.1:.0f})"))[0] == 2


def test_without_a_thread_in_the_drawing_nothing_changes(turn):
    _, steps, text, _ = turn(program(note=""))
    assert (
        not steps["thread outside"]["needed"]
        and "no thread outside" in steps["thread outside"]["why"]
        and "G33" not in text
    )
    _, steps, _, _ = turn(
        program(tools="ROUGH=1,FINISH=4", note="(THREAD,PITCH=1.5)")
    )  # T8 has the role in the tool geometry file
    assert steps["thread outside"]["needed"]


STEEP = [(0.0, 10.0), (-12.0, 10.0), (-12.4, 8.8), (-14.4, 8.8), (-14.8, 10.0), (-17.0, 14.0), (-30.0, 14.0)]


def test_an_undercut_is_cut_by_the_tool_that_reaches_it(turn):
    """What roughing and finishing leave; not needed where they reach it."""
    text = program(STEEP, "", tools="ROUGH=1,FINISH=4,UNDERCUT=9")
    _, steps, written, said = turn(text)
    assert steps["undercut"]["needed"] and steps["undercut"]["tool"] == 9 and steps["undercut"]["removed_mm2"] > 0.05, (
        said
    )
    assert clean(judged(written, STEEP, STEEP, (32, -60, 0))), said
    assert not turn(program(M20, "", tools="ROUGH=1,FINISH=4,UNDERCUT=9"))[1]["undercut"]["needed"]
    _, without, _, _ = turn(program(STEEP, "", tools="ROUGH=1,FINISH=4"))
    assert not without["undercut"]["needed"] and "none of role UNDERCUT" in without["undercut"]["why"]


@pytest.mark.parametrize("k", range(random_count(8)))
def test_random_threads(turn, k):
    """Chamfers, undercuts, shoulders, starts, speeds: cut without touching anything but the thread, or refused with the
    line."""
    seed = random_seed() * 100_019 + k
    rng = random.Random(seed)
    pitch, major = rng.choice((0.75, 1.0, 1.25, 1.5, 2.0)), rng.uniform(6.0, 14.0)
    depth = 0.61343 * pitch
    length, under, gap = rng.uniform(4, 20), depth + rng.uniform(0.05, 0.5), rng.uniform(1.0, 8.0)
    chamfer = rng.choice((0.0, depth * 1.2, depth * 0.6))
    chain = [
        (0.0, major - chamfer),
        *([(-chamfer, major)] if chamfer else []),
        (-length, major),
        (-length - under / math.tan(math.radians(30)), major - under),
        (-length - under / math.tan(math.radians(30)) - gap, major - under),
        (-length - under / math.tan(math.radians(30)) - gap, major + rng.uniform(1, 4)),
        (-length - 30.0, major + 4),
    ]
    shoulder, bar = len(chain) - 2, (2 * major + 10, -80.0, rng.choice((0.0, 1.0)))
    starts = rng.choice(("", "", ",STARTS=2", ",STARTS=3"))
    text = program(
        chain,
        f"(THREAD,PITCH={pitch}{starts})",
        shoulder - 3,
        bar,
        spindle=f"G94 G97 S{rng.randint(100, 2500)} {rng.choice(('M3', 'M4'))}",
    )
    replay = write_replay(f"thread_{seed}", {"seed": seed, "text": text})
    status, _, written, said = turn(text)
    if status == 2:
        assert re.search(r"the run-(in|out) of the thread needs|MAX_VELOCITY", said), (seed, said)
    else:
        assert len(passes(written)) > 4 and clean(
            judged(written, chain, lowered(chain, major - depth, shoulder), bar)
        ), (seed, str(replay), said)
    replay.unlink()


def test_g26_has_the_passes_of_the_written_program(tmp_path, lathe, turn):
    text = program(spindle="G95 G97 S800 M3", words="I0.3 D1.5 F0.2 E0.1")
    seen = preview(tmp_path, lathe, text)
    assert not seen.error, seen.error
    _, _, written, _ = turn(text)
    wanted = [(round(z0, 5), round(z1, 5), round(x, 5)) for z0, z1, x, _ in passes(written)]
    found, at = [], None
    for kind, _, place, _, arc in seen.between("begin", "end"):
        if kind == "feed" and not arc and at and (round(at[0], 5), round(place[0], 5), round(place[1], 5)) in wanted:
            found.append((round(at[0], 5), round(place[0], 5), round(place[1], 5)))
        at = place
    assert found == wanted


def test_the_feed_per_revolution_comes_back_after_a_thread(tmp_path, lathe):
    """G33 ends it in LinuxCNC; a feed move after G26 would creep at F per minute."""
    (tmp_path / "part.ngc").write_text(
        program(spindle="G95 G97 S800 M3", words="I0.3 D1.5 F0.2 E0.1").replace("(end)", "(end)\nG1 X70")
    )
    done = canon_calls(tmp_path, lathe)
    calls = [line.split(" ", 1)[1] for line in re.findall(r"N\S+ .*", done.stdout)]
    deepest = [k for k, call in enumerate(calls) if call.startswith(f"STRAIGHT_FEED({10 - 0.61343 * 1.5:.4f},")]
    after = calls[deepest[-1] :]
    assert len(deepest) >= 2 and "SET_FEED_RATE(0.2000)" in after[: after.index('COMMENT("end")')], (
        done.stdout[-800:] + done.stderr
    )


@pytest.mark.parametrize(
    "starts, hand, spindle",
    [(2, "RIGHT", "G94 G97 S400 M3"), (3, "RIGHT", "G94 G97 S300 M3"), (2, "RIGHT", "G94 G97 S170 M4")],
)
def test_several_starts(turn, starts, hand, spindle):
    """Each depth once for every start, a pitch apart where they begin, so that every start has a phase of its own; G33
    has the lead."""
    status, steps, text, said = turn(program(note=f"(THREAD,PITCH=1.5,STARTS={starts},HAND={hand})", spindle=spindle))
    assert status in (0, 1) and f"with {starts} starts, each in 7 + 1 passes" in steps["thread outside"]["why"], said
    found = passes(text)
    single = passes(turn(program(note=f"(THREAD,PITCH=1.5,HAND={hand})", spindle=spindle))[2])
    assert len(found) == starts * len(single)
    for k, (z0, z1, x, lead) in enumerate(found):
        assert lead == pytest.approx(1.5 * starts) and x == pytest.approx(single[k // starts][2], abs=1e-6)
        assert abs(z0 - found[0][0]) == pytest.approx(1.5 * (k % starts), abs=1e-5) and z1 == found[0][1]
    phases = sorted({round((z0 / (1.5 * starts)) % 1.0, 4) for z0, _, _, _ in found})
    assert len(phases) == starts and all(
        b - a == pytest.approx(1 / starts, abs=2e-4) for a, b in zip(phases, phases[1:])
    )
    root = 10.0 - 0.61343 * 1.5
    assert clean(judged(text, M20, lowered(M20, root, 5), (32, -60, 0))), said
    speed = float(spindle.split("S")[1].split()[0]) / 60 * 1.5 * starts * OVERRIDE
    assert min(abs(z0) for z0, _, _, _ in found) > speed * speed / (2 * ACCELERATION) or "M4" in spindle


@pytest.mark.parametrize(
    "more, words",
    [
        ("STARTS=0", "STARTS=0 is not understood"),
        ("STARTS=13", "STARTS=13 is not understood"),
        ("STARTS=1.5", "STARTS=1.5 is not"),
        ("STARTS=-2", "STARTS=-2 is not"),
        ("STARTS=2,PITCH=26", "times STARTS, up to 50 mm"),
        ("STARTS=12", "300 rpm with a lead of 18 mm needs 108 mm/s along Z"),
        ("STARTS=4", "the run-out of the thread needs"),
    ],
)
def test_starts_that_are_refused(turn, more, words):
    status, _, _, said = turn(program(note=f"(THREAD,PITCH=1.5,{more})", spindle="G94 G97 S300 M3"))
    assert status == 2 and words in said and "line" in said and "Traceback" not in said, said


def test_a_thread_with_other_starts_is_another_one(turn):
    lines = list(sub(M20, "(THREAD,PITCH=1.5)", 2))
    text = program(words="P200 I0.3 D1.5 F200 E100", spindle="G94 G97 S300 M3") + "\n".join(
        ["O200 sub", *lines[1:-1], "O200 endsub", ""]
    )
    assert turn(text.replace("PITCH=1.5", "PITCH=1.5,STARTS=2", 1))[1]["thread outside"]["needed"]
