# SPDX-License-Identifier: GPL-2.0-or-later
"""Arcs in cuts of surfaces: chip_chain_fit against its band, plans with arcs against brute force, LinuxCNC's reading of
them, parts of arcs.

Arcs are judged by tests/support/surface_judge.py (complex numbers) and by rs274; nothing of the package's arcs is in
either."""

import dataclasses
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from support import surface_cases, surface_judge
from support.canon import run_rs274
from support.random_cases import random_count, random_seed

from chipwise.clib.chain_fit import fitted
from chipwise.clib.height_map import Shape
from chipwise.cycles.surface import surface_plan
from chipwise.gcode_lines import chunks, texts
from chipwise.moves import Line, PlaneArc, Rapid
from chipwise.clib import layout
from chipwise.surface import curve, needed
from chipwise.surface.model import Placing, read_model

START = surface_cases.START
GOUGE, ORACLE = 1e-3, 1e-3
TOOLS = {"ball": Shape(6, 3), "bull": Shape(6, 1), "flat": Shape(6)}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    shapes = {
        "waves": surface_cases.waves(100, 40.0),
        "dome": surface_cases.sphere(9.0, 80),
        "bowl": surface_cases.sphere(9.0, 80) * (1, 1, -1),
    }
    return {name: surface_cases.write_stl(folder / f"{name}.stl", triangles) for name, triangles in shapes.items()}


def request(file, tool="ball", **fields):
    return surface_cases.request(file, **{"tool": TOOLS[tool], **fields})


def kinds(plan):
    return [sum(type(move) is kind for move in plan.moves) for kind in (Line, PlaneArc)]


# ---- the fit ---------------------------------------------------------------------------------------------------------


def height_on(s, a, b, arc):
    """Of an edge from a to b (station, height) at stations s."""
    if arc[2] == layout.CHAIN_LINE:
        return a[1] + (s - a[0]) * (b[1] - a[1]) / (b[0] - a[0])
    for station, z in (a, b):
        assert math.hypot(station - arc[0], z - arc[1]) == pytest.approx(abs(arc[2]), abs=1e-8)
    return arc[1] + math.copysign(1.0, arc[2]) * np.sqrt(arc[2] ** 2 - (s - arc[0]) ** 2)


def random_chain(rng):
    """Stations and heights: pieces of circles and waves, with steps and noise."""
    s = np.sort(rng.uniform(0, 30, rng.integers(3, 400)))
    z = (
        rng.uniform(0, 4) * np.sin(s * rng.uniform(0.05, 0.8))
        + rng.uniform(-1, 1) * np.sqrt(np.maximum(400 - (s - 15) ** 2, 0))
        + rng.normal(0, rng.choice([0, 1e-3]), len(s))
    )
    return s, z + 3.0 * (s > rng.uniform(0, 60))


def test_every_station_is_in_its_band():
    rng, arcs = np.random.default_rng(random_seed()), 0
    for case in range(random_count(60)):
        s, z = random_chain(rng)
        tolerance = float(rng.choice([0.003, 0.01, 0.1]))
        high, arc_low = z + 0.8 * tolerance, z + 0.25 * tolerance
        kept, height, arc = fitted(s, z, high, arc_low)
        assert (
            kept[0] == 0
            and kept[-1] == len(s) - 1
            and (np.diff(kept) > 0).all()
            and (height[0], height[-1]) == (z[0], z[-1])
        )
        for k in range(1, len(kept)):
            inside = slice(kept[k - 1] + 1, kept[k])
            on = height_on(s[inside], (s[kept[k - 1]], height[k - 1]), (s[kept[k]], height[k]), arc[k])
            is_arc = arc[k, 2] != layout.CHAIN_LINE
            arcs += is_arc
            assert (on >= (arc_low if is_arc else z)[inside] - 1e-9).all() and (on <= high[inside] + 1e-9).all(), (
                case,
                k,
            )
        assert (height >= z[kept] - 1e-12).all() and (height <= high[kept] + 1e-12).all()
    assert arcs > random_count(60)


def test_a_circle_is_few_arcs_and_without_them_lines():
    s = np.linspace(-12, 12, 500)
    for sign in (1, -1):
        z = sign * np.sqrt(20.0**2 - s**2)
        kept, _height, arc = fitted(s, z, z + 0.008, z + 0.0025)
        longest = 1 + int(np.diff(kept).argmax())
        assert len(kept) <= 6 and np.diff(kept).max() > 400 and arc[longest, 2] == pytest.approx(20 * sign, abs=0.05)
        plain = fitted(s, z, z + 0.008, None)
        assert len(plain[0]) > 20 and (plain[2][:, 2] == layout.CHAIN_LINE).all()


NOTHING_BEHIND = """
import sys
import numpy as np
from support.guarded import guarded
from chipwise.clib.chain_fit import fitted
rng = np.random.default_rng(int(sys.argv[1]))
for case in range(int(sys.argv[2])):
    n = int(rng.integers(1, 40))
    s, z = np.sort(rng.uniform(0, 8, n)), np.cumsum(rng.normal(0, 0.002, n))
    s, low, high, arc_low = (guarded(v) for v in (s, z, z + 0.01, z + 0.0025))
    fitted(s, low, high, arc_low)
    fitted(s, low, high)
"""


def test_nothing_is_read_behind_the_last_station():
    done = subprocess.run(
        [sys.executable, "-c", NOTHING_BEHIND, str(random_seed()), str(random_count(200))],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, (random_seed(), done.returncode, done.stderr)


# ---- plans -----------------------------------------------------------------------------------------------------------


CASES = [
    ("waves", "ball", 0),
    ("waves", "bull", 90),
    ("dome", "ball", 180),
    ("dome", "flat", 270),
    ("bowl", "ball", 90),
]


@pytest.mark.parametrize("name, tool, direction", CASES)
def test_arcs_gouge_nothing_and_leave_no_more_than_the_tolerance(files, name, tool, direction):
    """All positions of the oracle are on arcs; and fewer moves than lines alone."""
    r = request(files[name], tool, direction=float(direction))
    plan = surface_plan(r)
    lines, arcs = kinds(plan)
    assert arcs > 5 and lines + arcs < sum(kinds(surface_plan(dataclasses.replace(r, arcs=False))))
    assert {move.plane for move in plan.moves if type(move) is PlaneArc} == {"G18" if direction % 180 == 0 else "G19"}
    triangles = surface_cases.triangles_of(read_model(r.file, Placing()))
    deepest, highest = surface_judge.gouge_and_rest(
        only_arcs(plan.moves), START, triangles, r.tool, plan.low[2], 20, direction
    )
    assert deepest <= GOUGE and highest <= r.tolerance + ORACLE
    if name == "dome":
        turned = [
            dataclasses.replace(move, ccw=not move.ccw) if type(move) is PlaneArc else move
            for move in only_arcs(plan.moves)
        ]
        assert (
            surface_judge.gouge_and_rest(turned, START, triangles, r.tool, plan.low[2], 10, direction)[0] > 0.01
        )  # the judge sees it


def only_arcs(moves):
    """All moves but the arcs as rapids, which are not judged."""
    return [move if type(move) is PlaneArc else Rapid(move.x, move.y, move.z) for move in moves]


def test_no_arcs_at_another_angle_or_when_they_are_not_wanted(files):
    for fields in (dict(direction=45.0), dict(arcs=False)):
        assert kinds(surface_plan(request(files["dome"], **fields)))[1] == 0


@pytest.mark.parametrize("unit", [1.0, 25.4])
@pytest.mark.parametrize("direction", [0, 90])
def test_linuxcnc_reads_the_arcs_as_they_are_meant(files, direction, unit):
    """The program through rs274 against positions of the moves; also through zigzag, whose cuts go both ways."""
    r = request(files["waves"], direction=float(direction), link=2, step=4.0)
    moves = surface_plan(r).moves
    text = "\n".join(
        [
            f"{'G21' if unit == 1 else 'G20'} G90 G17 G91.1",
            "G0 Z{:.6f}".format(START[2] / unit),
            "G0 X{:.6f} Y{:.6f}".format(*(v / unit for v in START[:2])),
            *texts(moves, START, unit, 6, "G64"),
            "M2",
            "",
        ]
    )
    trace = run_rs274(text, {1: 6.0})
    assert not trace.error, trace.error
    theirs = np.array([e.b for e in trace.elements[2:]])
    ours = np.concatenate([points for _rapid, points in surface_judge.positions(moves, START)[1:]])
    for point in ours[np.random.default_rng(random_seed()).integers(0, len(ours), 300)]:
        assert distance(point, theirs) < 0.01, point  # a chord of the judge's arc of 0.002 rad and 0.05 mm, 4 decimals
    for point in theirs[:: max(1, len(theirs) // 300)]:
        assert distance(point, ours) < 0.01


def distance(point, chain):
    a, step = chain[:-1], np.diff(chain, axis=0)
    share = np.clip(((point - a) * step).sum(axis=1) / np.maximum((step**2).sum(axis=1), 1e-18), 0, 1)
    return np.linalg.norm(point - a - share[:, None] * step, axis=1).min()


def test_levels_and_rest_keep_arcs_and_gouge_nothing(files):
    """Parts of arcs: of a level, and of what a smaller tool finds."""
    levels = request(files["waves"], "bull", depth=2.0, step=3.0)
    rest = dataclasses.replace(
        request(files["waves"], step=1.0), tool=Shape(2, 1), least=0.02, earlier=(request(files["waves"], step=4.0),)
    )
    for r in (levels, rest):
        plan = surface_plan(r)
        assert kinds(plan)[1] > 5 and sum(kinds(plan)) < sum(kinds(surface_plan(dataclasses.replace(r, arcs=False))))
        triangles = surface_cases.triangles_of(read_model(r.file, Placing()))
        assert surface_judge.gouge_and_rest(plan.moves, START, triangles, r.tool, plan.low[2], 60, 1)[0] <= GOUGE


# ---- parts -----------------------------------------------------------------------------------------------------------


def half_circle(radius=5.0, count=9):
    """A Curve over X about the origin, from 150 to 30 degrees, with a line before and after."""
    angle = np.radians(np.linspace(150, 30, count))
    points = np.column_stack([radius * np.cos(angle), np.full(count, 2.0), radius * np.sin(angle)])
    points = np.vstack([[(-8, 2, 2.5)], points, [(8, 2, 2.5)]])
    centre = np.vstack([np.full((2, 3), np.nan), np.tile((0.0, 2.0, 0.0), (count - 1, 1)), np.full((1, 3), np.nan)])
    return curve.Curve(points, centre)


def test_parts_begin_and_end_on_the_arc():
    whole = half_circle()
    assert whole.moves == 3 and [type(move) for move in curve.moves_of(whole, 1.0)] == [Line, PlaneArc, Line]
    rng = np.random.default_rng(random_seed())
    for _case in range(random_count(40)):
        first, last = np.sort(rng.uniform(0, len(whole.points) - 1, 2))
        part = needed._part(whole, first, last)
        at = part.points[0]
        for move in curve.moves_of(part, 1.0):
            if type(move) is PlaneArc:
                assert np.hypot(*np.array(move.end)[[0, 2]]) == pytest.approx(5, abs=1e-9) and np.hypot(
                    at[0], at[2]
                ) == pytest.approx(5, abs=1e-9)
                assert move.ccw and move.plane == "G18"  # from Z to X
            at = (move.x, move.y, move.z)
        ends = part.points[[0, -1]]
        for end, place in zip(ends, (first, last)):
            if 1 < place < len(whole.points) - 2:
                assert np.hypot(end[0], end[2]) == pytest.approx(5, abs=1e-9)


def test_clipped_at_a_level():
    for level in (3.0, 4.0, 4.9):
        part = needed.clipped(half_circle(), level)
        (arc,) = [move for move in curve.moves_of(part, 1.0) if type(move) is PlaneArc]
        assert (
            arc.z == level and np.hypot(arc.x, arc.z) == pytest.approx(5, abs=1e-9) and part.points[:, 2].min() == level
        )
    assert not any(type(move) is PlaneArc for move in curve.moves_of(needed.clipped(half_circle(), 5.5), 1.0))


def test_short_rests_of_arcs_are_lines():
    """A full turn would be read where an arc's ends are rounded to the same place."""
    part = needed._part(half_circle(), 3.2, 3.2 + 1e-4)
    assert [type(move) for move in curve.moves_of(part, 1.0)] == [Line]


def test_the_plane_is_set_again_in_each_chunk():
    """Between two chunks the interpreter is back in G17."""
    arc = PlaneArc("G18", (1.0, 0.0, 1.0), (1.0, 0.0, 0.0), True, 100.0)
    moves = [
        arc,
        *(Line(x=1 + 0.01 * k, y=0.0, z=1.0, feed=100.0) for k in range(2100)),
        Rapid(x=0.0, y=0.0, z=0.0),
        arc,
    ]
    first, second = (
        [line for row in chunk for line in row[1].split("\n")] for chunk in chunks(moves, (0.0, 0.0, 0.0), 1.0)
    )
    assert first[0].startswith("G18 G3") and second[0] == "G18" and second[-1].startswith("G3")
