# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise digitise: a traced ball becomes a height map and a program; both are judged by the ball's closed form."""

import json
import re
import subprocess

import numpy as np
import pytest

from chipwise.digitise import height_map, mesh, program, record
from chipwise.errors import CycleError
from chipwise.clib import core
from chipwise.stock import store
from chipwise.surface.model import Placing, read_model
from support import ROOT
from support.digitising import digitise
from support.random_cases import random_count, random_seed
from support.tracer_rig import FAR, STATE, SURFACE, Rig

RADIUS, STYLUS, HALF = 9.0, 1.0, 2.5  # mm: model, stylus, half the window


def log_of(rows, per_mm=1.0):
    """The rows as halsampler writes them."""
    touching = np.isin(rows["state"], (STATE.TRACE, STATE.PICK)) & (rows["measured_mm"] > 0.15)
    return "".join(
        f"{int(touch)} {x * per_mm:f} {y * per_mm:f} {z * per_mm:f} \n"
        for touch, (x, y, z) in zip(touching, rows["seen_ball_mm"])
    )


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A ball of R 9 traced with a stylus of R 1 in lines 0.1 mm apart, with noise and 2 periods of dead time."""
    rig = Rig(
        (-HALF, -HALF, 12),
        {"surface_number": SURFACE.BALL, "size_mm": RADIUS, "noise_mm": 0.0005, "delay_periods": 2},
        feed_mm_s=25.0,
        pick_mm=0.1,
        dead_time_s=0.002,
        window_min_mm=(-HALF, -HALF, -FAR),
        window_max_mm=(HALF, HALF, FAR),
    )
    rows = rig.until(STATE.DONE, STATE.FAULT)
    assert rows["state"][-1] == STATE.DONE
    path = tmp_path_factory.mktemp("trace") / "trace.log"
    path.write_text(log_of(rows))
    return path


def errors(path, cell, inside=HALF - 0.3):
    """Height above the ball's surface at the cells' middles, mm."""
    head, cells = store.read(str(path))
    x = head.low[0] + (np.arange(head.nx) + 0.5) * cell
    y = head.low[1] + (np.arange(head.ny) + 0.5) * cell
    x, y = np.meshgrid(x, y)
    near = (np.abs(x) < inside) & (np.abs(y) < inside)
    return (cells["top"][1:-1, 1:-1] - np.sqrt(RADIUS**2 - x**2 - y**2))[near]


def test_the_height_map_of_a_ball(log, tmp_path):
    out = tmp_path / "model.stock"
    done = digitise(log, "-o", out, "--ball", STYLUS, "--cell", 0.1, "--json", tmp_path / "figures.json")
    assert done.returncode == 0, done.stdout
    off = errors(out, 0.1)
    assert len(off) > 1500 and np.percentile(np.abs(off), 99) < 0.005
    assert off.min() > -0.005
    assert json.loads((tmp_path / "figures.json").read_text())["cell"] == 0.1
    # the core accepts the file's map as its own, with the volume that the head speaks of
    head, cells = store.read(str(out))
    stock = core.Stock(head.low, head.high, 0.1)
    full = stock.volume()
    stock.cells_and_ring[:] = cells
    assert full - stock.volume() == pytest.approx(head.removed, rel=1e-6)


@pytest.mark.parametrize("noise, cell", [(0.0, 0.1), (0.0005, 0.25), (0.002, 0.1)])
def test_the_map_with_noise_and_at_its_rim(noise, cell):
    """Up to 24 degrees at the rim: below the ball by three standard deviations over the cosine at most; where only a
    flank passed nothing is known."""
    half = 3.5
    rig = Rig(
        (-half, -half, 12),
        {"surface_number": SURFACE.BALL, "size_mm": RADIUS, "noise_mm": noise, "delay_periods": 2},
        feed_mm_s=25.0,
        pick_mm=0.2,
        dead_time_s=0.002,
        window_min_mm=(-half, -half, -FAR),
        window_max_mm=(half, half, FAR),
    )
    rig.stylus.random = random_seed()
    rows = rig.until(STATE.DONE, STATE.FAULT)
    centres = rows["seen_ball_mm"][np.isin(rows["state"], (STATE.TRACE, STATE.PICK)) & (rows["measured_mm"] > 0.15)]
    assert height_map.noise(centres) == pytest.approx(noise, rel=0.1, abs=1e-4)  # the curve of the path itself
    model = height_map.envelope(centres, STYLUS, cell)
    ny, nx = model.heights.shape
    x, y = np.meshgrid(model.x0 + (np.arange(nx) + 0.5) * cell, model.y0 + (np.arange(ny) + 0.5) * cell)
    ball = np.sqrt(RADIUS**2 - x**2 - y**2)
    off, known = model.heights - ball, np.isfinite(model.heights)
    low, high = (off + 3.0 * noise * RADIUS / ball)[known].min(), off[known].max()
    print(
        f"noise {noise} mm, cells {cell} mm: {off[known].min():.4f} to {high:.4f} mm, {(~known).sum()} cells not known"
    )
    assert low > -1e-4 and high < 0.05  # the flank alone would be high by 0.15 mm and more
    touched = np.maximum(np.abs(x), np.abs(y)) < half * RADIUS / (RADIUS + STYLUS) - cell
    assert known[touched].all() and not known.all()


def off_the_ball(path):
    """Height of the STL's corners above the ball, mm, away from the edge; as G24 reads them."""
    model = read_model(str(path), Placing())
    points = model.triangles.reshape(-1, 3).astype(float) + model.low
    points = points[(np.abs(points[:, :2]) < HALF - 0.3).all(axis=1)]
    return points[:, 2] - np.sqrt(RADIUS**2 - points[:, 0] ** 2 - points[:, 1] ** 2)


def test_the_surface_of_a_ball(log, tmp_path):
    out = tmp_path / "model.stl"
    done = digitise(log, "-o", out, "--ball", STYLUS, "--cell", 0.1)
    assert done.returncode == 0 and "triangles" in done.stdout, done.stdout
    off = off_the_ball(out)
    assert len(off) > 5000 and np.percentile(np.abs(off), 99) < 0.005
    assert digitise(log, "-o", tmp_path / "wrong.stl", "--ball", 1.05 * STYLUS, "--cell", 0.1).returncode == 0
    assert np.abs(off_the_ball(tmp_path / "wrong.stl")).max() > 0.04


def test_a_surface_has_no_triangle_where_nothing_was_touched():
    heights = np.zeros((4, 5))
    heights[1, 2] = np.nan
    corners = mesh.triangles(height_map.HeightMap(heights, 10.0, 20.0, 0.5))
    assert len(corners) == 2 * (3 * 4 - 4) and corners[..., 0].min() == 10.25 and corners[..., 1].max() == 21.75
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0).all()
    with pytest.raises(CycleError, match="no four neighbouring cells"):
        mesh.triangles(height_map.HeightMap(np.full((4, 5), np.nan), 0.0, 0.0, 0.5))


def test_the_judge_sees_a_wrong_ball(log, tmp_path):
    digitise(log, "-o", tmp_path / "model.stock", "--ball", STYLUS + 0.05, "--cell", 0.1)
    assert np.percentile(np.abs(errors(tmp_path / "model.stock", 0.1)), 99) > 0.03


def centres_of(text, radius):
    """Ball centres (n, 3) of the G1 moves, after each other."""
    return np.array([[float(v) for v in words] for words in re.findall(r"^G1 X(\S+) Y(\S+) Z(\S+)$", text, re.M)]) + (
        0,
        0,
        radius,
    )


def test_the_program_of_a_ball(log, tmp_path):
    """The tool touches the ball from outside, within the chord error; LinuxCNC reads the program."""
    out = tmp_path / "model.ngc"
    done = digitise(log, "-o", out, "--ball", STYLUS, "--chord", 0.003)
    assert done.returncode == 0, done.stdout
    found = centres_of(out.read_text(), STYLUS)
    middles = 0.5 * (found[1:] + found[:-1])[np.linalg.norm(np.diff(found, axis=0), axis=1) < 1.0]
    for points in (found, middles):
        off = np.linalg.norm(points, axis=1) - RADIUS - STYLUS
        assert np.percentile(np.abs(off), 99) < 0.005 and off.min() > -0.007
    assert len(found) < 0.1 * len(log.read_text().splitlines())
    tried = subprocess.run(
        [str(ROOT / "bin/chipwise"), "try", str(out)], text=True, stdin=subprocess.DEVNULL, capture_output=True
    )
    assert tried.returncode == 0 and "STRAIGHT_FEED" in tried.stdout, tried.stdout + tried.stderr


def test_an_allowance_raises_the_program(log, tmp_path):
    for name, allowance in (("a", 0.0), ("b", 0.4)):
        digitise(log, "-o", tmp_path / (name + ".ngc"), "--ball", STYLUS, "--allowance", allowance)
    a, b = (centres_of((tmp_path / (name + ".ngc")).read_text(), STYLUS) for name in "ab")
    assert b - a == pytest.approx(np.tile((0, 0, 0.4), (len(a), 1)), abs=1.001e-4)  # two roundings to 0.0001 mm


def test_an_inch_log(log, tmp_path):
    rows = [line.split() for line in log.read_text().splitlines()]
    inch = tmp_path / "inch.log"
    inch.write_text("".join(f"{touch} {' '.join(repr(float(v) / 25.4) for v in at)}\n" for touch, *at in rows))
    for path, options in ((log, []), (inch, ["--inch"])):
        assert digitise(path, "-o", tmp_path / (path.stem + ".stock"), "--ball", STYLUS, *options).returncode == 0
    assert errors(tmp_path / "inch.stock", 0.25) == pytest.approx(errors(tmp_path / "trace.stock", 0.25), abs=1e-5)


def farthest(points, kept):
    """Largest distance of a point from the path through the kept ones, by dense samples of the path."""
    dense = np.concatenate(
        [points[a] + (points[b] - points[a]) * np.linspace(0, 1, 400)[:, None] for a, b in zip(kept, kept[1:])]
    )
    return max(np.linalg.norm(dense - point, axis=1).min() for point in points)


def test_chord_error_at_random():
    random = np.random.default_rng(random_seed())
    for _ in range(random_count(20)):
        points = np.cumsum(random.normal(0, 0.05, (int(random.integers(2, 120)), 3)), axis=0)
        chord = 10 ** random.uniform(-3, -0.5)
        kept = program.thinned(points, chord)
        assert kept[0] == 0 and kept[-1] == len(points) - 1
        assert farthest(points, kept) <= chord + 0.002
    line = np.linspace(0, 1, 50)[:, None] * (3.0, 2.0, 1.0)
    assert list(program.thinned(line, 1e-6)) == [0, 49]


def test_lines_end_where_contact_ends():
    rows = b"1 0 0 0\n1 0.1 0 0\n0 0.2 0 0\n1 0.3 0 0\n1 0.4 0 0\noverrun\n1 0.5 0 0\n1 3 0 0\n17 1 3.1 0 0\n"
    found = record.parse(rows, 1.0)
    assert list(found.start) == [True, False, True, False, True, True, False]
    assert (found.rows, found.overruns) == (8, 1)


@pytest.mark.parametrize(
    "content, message",
    [
        ("", "the log has no row in contact"),
        ("0 1 2 3\n", "the log has no row in contact"),
        ("1 2 3\n", "line 1 is not in-contact"),
        ("1 0 0 0\nabc\n", "line 2 is not in-contact"),
        ("1 nan 0 0\n", "1 positions are not finite"),
        ("1 1e300 0 0\n1 inf 0 0\n", "2 positions"),
        ("1 0 0 0\n1 9e5 9e5 0\n", "a cell of 0.25 mm is too small"),
        ("\x00\x01\xff\n", "line 1 is not in-contact"),
    ],
)
def test_a_log_that_cannot_be_used(tmp_path, content, message):
    path = tmp_path / "bad.log"
    path.write_bytes(content.encode("latin-1"))
    done = digitise(path, "-o", tmp_path / "out.stock", "--ball", 1)
    assert done.returncode == 2 and message in done.stdout and "Traceback" not in done.stdout, done.stdout
    assert not (tmp_path / "out.stock").exists()


def test_options_that_cannot_be(log, tmp_path):
    for options, message in (
        (["-o", tmp_path / "a.txt"], "is not FILE.stock, FILE.stl or"),
        (["-o", tmp_path / "no" / "a.ngc"], "no folder"),
        (["-o", tmp_path / "a.stock", "--cell", "nan"], "--cell nan"),
        (["-o", tmp_path / "a.stock", "--floor", 9], "the floor 9 mm"),
    ):
        done = digitise(log, "--ball", 1, *options)
        assert done.returncode == 2 and message in done.stdout, done.stdout
    assert digitise(tmp_path / "none.log", "-o", tmp_path / "a.ngc", "--ball", 1).returncode == 2
    assert digitise(log, "-o", tmp_path / "a.ngc", "--ball", 0).returncode == 2
    copy = tmp_path / "log.ngc"
    copy.write_text(log.read_text())
    assert "is the log" in digitise(copy, "-o", copy, "--ball", 1).stdout and copy.read_text() == log.read_text()


def test_missing_samples_are_a_finding(tmp_path):
    path = tmp_path / "gaps.log"
    path.write_text("1 0 0 0\n1 0.1 0 0\noverrun\n1 0.2 0 0\n1 0.3 0 0\n")
    done = digitise(path, "-o", tmp_path / "a.ngc", "--ball", 1)
    assert done.returncode == 1 and "missing in 1 places" in done.stdout and (tmp_path / "a.ngc").exists()
