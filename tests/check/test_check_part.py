# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise check --part: gouge and rest against a model, beside an oracle in closed form (support/part_oracle.py)."""

import math
import random
import re

import numpy as np
import pytest

from chipwise.check.part import compared
from chipwise.program.records import Frame
from chipwise.clib.height_map import HeightMap, Shape
from support.check_runs import HEAD, chipwise_check, mill_with_tools
from support.part_oracle import GRID_MM, deviations, triangles
from support.random_cases import random_count, random_seed, write_replay
from support.surface_cases import model_of, write_stl

TOLERANCE = 0.05
# A block of 40 x 30 with a pocket of 20 x 14 and 5 mm deep in it, from Z-10 to 0.
XS, YS = [0.0, 10.0, 30.0, 40.0], [0.0, 8.0, 22.0, 30.0]
POCKET = [[0.0, 0.0, 0.0], [0.0, -5.0, 0.0], [0.0, 0.0, 0.0]]
CORNER = 3 * (1 - math.sqrt(0.5))  # what a tool of 6 mm leaves of a sharp corner, from the walls


def cut(segments, radius=3.0, low=(-5.0, -5.0, -10.0), high=(45.0, 35.0, 0.0), cell=0.1):
    """The stock after level cuts, each from above."""
    stock, tool = HeightMap(low, high, cell), Shape(2 * radius)
    for a, b, z in segments:
        stock.cut(tool, (*a, high[2] + 5), np.array([(*a, z), (*b, z), (*b, high[2] + 5)]))
    return stock


def pocket(by=0.0, floor=-5.0):
    """Cuts of the pocket, its walls cut by too much."""
    x0, x1, y0, y1 = 13.0 - by, 27.0 + by, 11.0 - by, 19.0 + by
    rows = [((x0, y), (x1, y), floor) for y in np.linspace(y0, y1, 4)]
    return [*rows, ((x0, y0), (x0, y1), floor), ((x1, y0), (x1, y1), floor)]


def judged(stock, model, tolerance=TOLERANCE, frame=Frame()):
    found = compared(stock, model, frame, tolerance)
    return found.gouge, found.rest, found.beyond


def block(levels=POCKET):
    return model_of(triangles(XS, YS, levels, -10.0))


def test_what_a_round_tool_leaves_of_a_sharp_corner():
    gouge, rest, beyond = judged(cut(pocket()), block())
    assert (gouge.most, gouge.at, gouge.area, beyond) == (0.0, None, 0.0, 0.0)
    assert rest.most == pytest.approx(CORNER, abs=0.1) and rest.most <= CORNER + 0.01
    assert 4 * 9 * (1 - math.pi / 4) * 0.6 < rest.area < 4 * 9 * (1 - math.pi / 4)


@pytest.mark.parametrize(
    "by, floor, expected", [(0.3, -5.0, 0.3), (0.0, -5.4, 0.4), (0.02, -5.03, 0.0), (1.0, -5.0, 1.0)]
)
def test_a_wall_or_a_floor_that_is_cut_too_far(by, floor, expected):
    """The distance to the surface, not the height of the wall; a micrometre beside a wall is nothing."""
    gouge, _rest, _beyond = judged(cut(pocket(by, floor)), block())
    assert gouge.most == pytest.approx(expected, abs=0.1) and gouge.most <= expected + 0.01


@pytest.mark.parametrize("by, floor, expected", [(-1.2, -5.0, 1.2), (0.0, -4.0, 1.0)])
def test_what_is_left_of_wall_or_floor(by, floor, expected):
    gouge, rest, _beyond = judged(cut(pocket(by, floor)), block())
    assert gouge.at is None and expected - 0.1 <= rest.most <= max(expected, CORNER - by) + 0.01


def test_through_the_part():
    """A hole where there is part, between its side at Y0 and the pocket."""
    cuts = [*pocket(), ((20.0, 3.0), (20.0, 3.0), -10.0)]
    gouge, _rest, _beyond = judged(cut(cuts), block())
    assert (
        gouge.most == pytest.approx(deviations(XS, YS, POCKET, -10.0, cuts, 3.0, 0.0)[0], abs=0.1)
        and 5.0 < gouge.most < 6.0
    )


def random_case(rng):
    """(xs, ys, levels, segments)."""
    xs = sorted(rng.uniform(0, 40) for _ in range(rng.randint(2, 5)))
    ys = sorted(rng.uniform(0, 30) for _ in range(rng.randint(2, 4)))
    if min(np.diff(xs).min(), np.diff(ys).min()) < 0.5:
        return random_case(rng)
    levels = [[rng.choice((0.0, -1.0, -3.3, -6.0)) for _ in xs[1:]] for _ in ys[1:]]
    segments = [
        (
            (rng.uniform(0, 40), rng.uniform(0, 30)),
            (rng.uniform(0, 40), rng.uniform(0, 30)),
            rng.choice((-0.4, -1.0, -3.3, -5.0, -9.0)),
        )
        for _ in range(rng.randint(1, 12))
    ]
    return xs, ys, levels, segments


def test_random_parts():
    """Never above the oracle, and below it by no more than a cell and the oracle's own grid."""
    seed, slack = random_seed(), 0.1 * math.sqrt(0.5) + GRID_MM
    for case in range(random_count(30)):
        rng = random.Random(f"{seed}/{case}")
        xs, ys, levels, segments = random_case(rng)
        radius = rng.choice((1.0, 3.0))
        found = judged(cut(segments, radius, cell=0.1), model_of(triangles(xs, ys, levels, -10.0)))
        for mine, oracle in zip(found, deviations(xs, ys, levels, -10.0, segments, radius, 0.0)):
            right = (
                oracle - slack <= mine.most <= oracle + GRID_MM + 0.01
                if oracle > TOLERANCE + slack
                else mine.most <= TOLERANCE + slack + GRID_MM
            )
            if not right:
                path = write_replay("part", {"seed": seed, "case": case})
                pytest.fail(f"part {case} of seed {seed}: {mine} and {oracle:.3f}; {path}")


@pytest.mark.parametrize("turn", ["inverted", "mixed"])
def test_triangles_that_face_another_side(turn):
    """All of them, or every other one at random."""
    shape = triangles(XS, YS, POCKET, -10.0)
    flip = np.ones(len(shape), bool) if turn == "inverted" else np.random.default_rng(3).random(len(shape)) < 0.5
    shape[flip] = shape[flip][:, ::-1]
    gouge, _rest, _beyond = judged(cut(pocket(0.3)), model_of(shape))
    assert gouge.most == pytest.approx(0.3, abs=0.1)


def test_turned_and_shifted_work_coordinates():
    frame = Frame(math.pi / 2, (50.0, 3.0, 2.0), (1.0, -2.0, 0.5))
    place = [tuple(frame.to_machine((*a, z))) for a, b, z in pocket(0.5) for a in (a, b)]
    stock = cut(
        [(a[:2], b[:2], a[2]) for a, b in zip(place[::2], place[1::2])], low=(0.0, -10.0, -7.5), high=(60.0, 60.0, 2.5)
    )
    gouge, rest, _beyond = judged(stock, block(), frame=frame)
    assert (
        gouge.most == pytest.approx(0.5, abs=0.1)
        and frame.to_work(gouge.at)[2] == pytest.approx(-5.0, abs=1e-3)
        and rest.most < CORNER + 0.01
    )


def test_a_ball_and_a_slope():
    """Half a cylinder of a ball tool in a part that has it: nothing; 0.2 mm deeper: 0.2 mm."""
    angles, xs = np.linspace(0, math.pi, 91), (0.0, 40.0)
    y, z = 15 - 4 * np.cos(angles), -4 * np.sin(angles)
    ys, zs = np.array([0.0, *y, 30.0]), np.array([0.0, *z, 0.0])
    shape = [
        (a, b, c)
        for k in range(len(ys) - 1)
        for a, b, c in (
            ((xs[0], ys[k], zs[k]), (xs[1], ys[k], zs[k]), (xs[1], ys[k + 1], zs[k + 1])),
            ((xs[0], ys[k], zs[k]), (xs[1], ys[k + 1], zs[k + 1]), (xs[0], ys[k + 1], zs[k + 1])),
        )
    ]
    for deep, expected in ((-4.0, 0.0), (-4.2, 0.2)):
        stock, tool = HeightMap((0.0, 0.0, -10.0), (40.0, 30.0, 0.0), 0.1), Shape(8.0, 4.0)
        stock.cut(tool, (-6.0, 15.0, 5.0), np.array([(-6.0, 15.0, deep), (46.0, 15.0, deep)]))
        gouge, rest, _beyond = judged(stock, model_of(shape))
        assert gouge.most == pytest.approx(expected, abs=0.03) and rest.most == 0.0


# ---- the command ---------------------------------------------------------------------------------------------------

PROGRAM = (
    HEAD
    + "M250 P-5 Q-5 R-10 I50 J40 K10\nT5 M6\nS8000 M3\nF900\nG0 Z5\n"
    + "".join("G0 X{} Y{}\nG1 Z{}\nG1 X{} Y{}\nG0 Z5\n".format(*a, z, *b) for a, b, z in pocket(0.3))
    + "M2\n"
)


def run(tmp_path, *options, program=PROGRAM, part=None):
    path = write_stl(tmp_path / "pocket.stl", triangles(XS, YS, POCKET, -10.0)) if part is None else part
    return chipwise_check(
        tmp_path,
        {"a.ngc": program},
        "--part",
        path,
        "--report",
        str(tmp_path / "r.html"),
        *options,
        machine=mill_with_tools(tmp_path),
    )


def own_line(finding):
    """The line of the first cut of PROGRAM that comes over the place of a finding."""
    centre = np.array([finding["x"], finding["y"]])
    for number, (a, b, z) in enumerate(pocket(0.3)):
        a, b = np.array(a), np.array(b)
        share = np.clip((centre - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        if np.hypot(*(a + share * (b - a) - centre)) < 3.005 and z <= finding["z"] + 1e-3:
            return len(HEAD.splitlines()) + 5 + 4 * number + (3 if share > 0 else 2)
    return 0


def test_text_json_and_report(tmp_path):
    status, said, errors, data = run(tmp_path, "--cell", "0.1")
    result = data["programs"][0]
    (finding,) = [one for one in result["findings"] if one["rule"] == "gouge"]
    assert status == 1 and not errors and result["part"]["gouge_mm"] == finding["value"] == pytest.approx(0.3, abs=0.1)
    assert (
        re.search(r"^  part pocket.stl: gouged, at most 0.(2[5-9]|30)\d* mm at X", said, re.M)
        and "; left on it at most " in said
        and "(tolerance 0.05 mm)" in said
    )
    assert "  " + finding["text"] in said.splitlines() and " the part is gouged by " in finding["text"]
    assert (
        own_line(finding) == finding["line"]
        and finding["tool"] == 5
        and finding["text"].startswith(f"line {finding['line']}, tool 5: ")
    )
    report = (tmp_path / "r.html").read_text()
    assert "part pocket.stl: gouged" in report and f">{finding['line']}</text>" in report


def test_the_place_and_the_tolerance(tmp_path):
    """0.3 mm to the side puts one wall right and the other 0.6 mm off; a tolerance above that finds nothing."""
    _status, _said, _errors, data = run(tmp_path, "--part-at", "0.3", "0", "0", "--cell", "0.1")
    assert data["programs"][0]["part"]["gouge_mm"] == pytest.approx(0.6, abs=0.1)
    (tmp_path / "again").mkdir()
    _status, said, _errors, data = run(tmp_path / "again", "--part-tolerance", "0.4")
    assert data["programs"][0]["part"]["gouge_place"] is None and "part pocket.stl: not gouged" in said


def test_a_part_that_reaches_out_of_the_stock(tmp_path):
    _status, said, _errors, _data = run(tmp_path, "--part-at", "8", "0", "1")
    assert "the part reaches 3 mm out of the stock: what is there is not judged" in said


@pytest.mark.parametrize(
    "options, words",
    [
        (["--part-at", "500", "0", "0"], "the part lies beside the stock"),
        (["--part-scale", "0"], "--part-scale 0 is not from"),
        (["--part-tolerance", "nan"], "--part-tolerance nan is not from"),
        (["--part-at", "nan", "0", "0"], "--part-at is not three numbers"),
        (["--part-scale", "10000"], "the model reaches 400000 mm"),
    ],
)
def test_options_that_cannot_be(tmp_path, options, words):
    status, said, errors, _data = run(tmp_path, *options)
    assert status == 2 and words in said + errors


def test_a_model_with_too_many_triangles(monkeypatch, tmp_path):
    from chipwise.check import part_simulation
    from chipwise.errors import CycleError

    monkeypatch.setattr(part_simulation, "MOST_TRIANGLES", 20)
    monkeypatch.setattr(part_simulation.Simulation, "__init__", lambda *_: None)
    order = part_simulation.PartOrder(
        write_stl(tmp_path / "m.stl", triangles(XS, YS, POCKET, -10.0)), part_simulation.Placing()
    )
    with pytest.raises(CycleError, match="the part has [0-9]+ triangles, more than 20"):
        order(None, 0.25)


def test_files_that_are_no_model(tmp_path):
    (tmp_path / "bad.stl").write_bytes(b"solid nothing")
    for name, words in (("none.stl", "none.stl: No such file"), ("bad.stl", "bad.stl: ")):
        folder = tmp_path / name.replace(".", "_")
        folder.mkdir()
        status, said, errors, _data = run(folder, part=str(tmp_path / name))
        assert status == 2 and words in said + errors
