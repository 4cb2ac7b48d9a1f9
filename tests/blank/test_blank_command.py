# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise blank: the stock of a casting from touched points, against the casting itself."""

import errno
import json
import math
import os
import types

import numpy as np
import pytest

from chipwise.blank import doubt, points
from chipwise.cli import main
from chipwise.clib import core
from chipwise.host import files
from chipwise.monitor.stock_files import StockFiles
from chipwise.settings import parse_settings
from chipwise.stock import store
from chipwise.stock.shared import SharedStock
from support.castings import CASES, CELL, MOST_ABOVE, Casting
from support.height_maps import FORMS, X, Y, Z
from support.random_cases import random_count, random_seed

ROUNDING = 2e-4  # mm: a float32 of some 1000 mm


def made(folder, file, *options):
    """-> (exit status, (head, cells) of a.stock or None, figures or None)."""
    out, figures = folder / "a.stock", folder / "figures.json"
    status = main(["blank", str(file), "-o", str(out), "--json", str(figures), *map(str, options)])
    return (
        status,
        store.read(str(out)) if out.exists() else None,
        json.loads(figures.read_text()) if figures.exists() else None,
    )


def written(path, rows):
    path.write_text("".join(" ".join(f"{value:.6f}" for value in row) + "\n" for row in rows))
    return path


@pytest.mark.parametrize("k", range(random_count(CASES // 4)))
def test_random_castings(tmp_path, k):
    """Of a file of points, with a work offset: never below the truth minus the error, at most 3 % above, and the stated
    doubt holds.  bench/bench_blank.py has all of them, and other spacings."""
    casting = Casting(random_seed() * 100_019 + k)
    offset = np.random.default_rng(k).uniform(-400.0, 400.0, 3)
    status, (head, cells), figures = made(
        tmp_path,
        written(tmp_path / "p.xyz", casting.points),
        "--stock",
        0,
        0,
        0,
        casting.wide,
        casting.deep,
        casting.high,
        "--offset",
        *offset,
        "--error",
        casting.error + 1e-6,
        "--cell",
        CELL,
    )
    assert status == 0
    # the casting at five by five places of each cell of the map, which begins at the corner
    x, y = np.meshgrid((np.arange(head.nx) + 0.5) * CELL, (np.arange(head.ny) + 0.5) * CELL)
    casting.places = np.column_stack((x.ravel(), y.ravel()))
    truth = casting.highest().reshape(head.ny, head.nx) + offset[2]
    tops = cells["top"][1:-1, 1:-1]
    assert (tops >= truth - casting.error - ROUNDING).all(), float((truth - casting.error - tops).max())
    stock = core.Stock((0, 0, 0), (1, 1, 1), CELL, capacity=head.count)
    SharedStock(memoryview(stock._block)).put(head, cells)
    volume = casting.volume()
    above = stock.volume() / volume - 1.0
    assert above <= MOST_ABOVE, above
    assert above <= figures["above_share"] + 1e-3 and figures["points"] == len(casting.points)
    assert head.removed == pytest.approx(casting.wide * casting.deep * casting.high - stock.volume(), rel=2e-2)


SQUARE = [(x, y, 5.0) for y in range(0, 41, 10) for x in range(0, 61, 10)]
BOX = "--stock", 0, 0, 0, 60, 40, 8
PLACED = (*BOX, "--offset", 100, 200, -50, "--cell", 0.5)


def tops(found):
    return found[1]["top"][1:-1, 1:-1]


def test_what_is_not_probed_has_the_typed_height_and_the_allowance(tmp_path, capsys):
    """A level face that is touched in its left half."""
    status, found, figures = made(
        tmp_path, written(tmp_path / "p.xyz", [p for p in SQUARE if p[0] <= 30]), *PLACED, "--allowance", 2
    )
    said = capsys.readouterr().out
    assert status == 0 and found[0].low == (98.0, 198.0, -50.0) and found[0].high == (162.0, 242.0, -40.0)
    assert (
        tops(found)[20:70, 10:60] == pytest.approx(-45.0, abs=0.05)
        and (tops(found)[:, 70:] == -40.0).all()
        and (tops(found)[:, :3] == -40.0).all()
    )
    assert (
        figures["probed"] == pytest.approx(30 * 40 / (64 * 44), rel=0.03)
        and "of it was not probed and has the typed height" in said
    )


@pytest.mark.parametrize("rotation", [0, 30])
def test_a_round_blank(tmp_path, capsys, rotation):
    """A disc with a face that falls in X: no stock outside of the circle, never below the face, and at most 3 % above
    it."""
    touched = [
        (x, y, 5.0 - x / 60.0) for x in range(2, 40, 3) for y in range(2, 40, 3) if math.hypot(x - 20, y - 20) < 19
    ]
    corners = [
        "--stock",
        0,
        0,
        0,
        40,
        40,
        8,
        "--offset",
        100,
        200,
        -50,
        "--cell",
        0.5,
        "--error",
        0,
        "--rotation",
        rotation,
    ]
    status, (head, cells), figures = made(tmp_path, written(tmp_path / "p.xyz", touched), *corners, "--round")
    assert status == 0 and head.shape == 1 and head.turn == 0.0
    stock = core.Stock((0, 0, 0), (1, 1, 1), 0.5, capacity=head.count)
    SharedStock(memoryview(stock._block)).put(head, cells)
    assert core.library().chip_stock_sound(stock.address, 0.5, 0.5, head.count)
    centre = np.array(head.low[:2]) + 20
    x, y = (low + (np.arange(count) + 0.5) * 0.5 for low, count in zip(head.low, (head.nx, head.ny)))
    away, top = np.hypot(x[None] - centre[0], y[:, None] - centre[1]), tops((head, cells)) + 50
    turn = math.radians(rotation)
    face = 5.0 - (20 + (x[None] - centre[0]) * math.cos(turn) + (y[:, None] - centre[1]) * math.sin(turn)) / 60.0
    assert (top[away > 20.5] == 0).all() and (top[away < 19.5] > face[away < 19.5] - ROUNDING).all()
    truth, edge = (
        math.pi * 400 * (5 - 20 / 60),
        math.pi * (400 - 17**2) * (8 - 5),
    )  # what points do not surround has the typed height
    assert truth < stock.volume() < 1.03 * truth + edge and figures["probed"] > 0.75
    probed = away < 16
    assert top[probed].sum() / face[probed].sum() < 1.03
    status, _found, _figures = made(tmp_path, tmp_path / "p.xyz", *corners[:4], 44, *corners[5:], "--round")
    assert (
        status == 2 and "as long in X as in Y, and this one has 44 x 40 mm; give the square" in capsys.readouterr().err
    )


def test_a_rotated_work_offset(tmp_path):
    """The map is the upright box around the blank, and the points lie in the turned one; a quarter turn stays
    upright."""
    points_file = written(tmp_path / "p.xyz", [(x, y, 5.0 - x / 60.0) for x, y, _ in SQUARE])
    _status, (head, cells), _figures = made(tmp_path, points_file, *PLACED, "--rotation", 30)
    stock = core.Stock((0, 0, 0), (1, 1, 1), 0.5, capacity=head.count)
    SharedStock(memoryview(stock._block)).put(head, cells)
    assert core.library().chip_stock_sound(stock.address, 0.5, 0.5, head.count)
    assert (
        head.turn == pytest.approx(math.radians(30))
        and stock.volume() == pytest.approx(60 * 40 * 4.5, rel=0.03)
        and stock.volume() > 60 * 40 * 4.5
    )
    at = np.array([50.0, 20.0]) @ [
        [math.cos(head.turn), math.sin(head.turn)],
        [-math.sin(head.turn), math.cos(head.turn)],
    ] + [100, 200]
    column, row = ((at - head.low[:2]) / 0.5).astype(int)
    assert cells["top"][row + 1, column + 1] == pytest.approx(-50 + 5 - 50 / 60, abs=0.08)
    _status, (head, cells), _figures = made(tmp_path, points_file, *PLACED, "--rotation", 90)
    assert (
        head.turn == 0.0
        and (head.nx, head.ny) == (80, 120)
        and head.low[:2] == pytest.approx((60.0, 200.0))
        and cells["top"][100, 40] < cells["top"][20, 40]
    )


@pytest.mark.parametrize("name", FORMS)
def test_height_maps(tmp_path, name):
    """Of each probing program: nowhere below a point."""
    path = tmp_path / "probe.map"
    path.write_text(FORMS[name])
    status, found, figures = made(
        tmp_path,
        path,
        "--stock",
        X[0],
        Y[0],
        Z.min() - 5,
        X[-1],
        Y[-1],
        Z.max() + 5,
        "--offset",
        0,
        0,
        0,
        "--cell",
        0.5,
    )
    assert status == 0 and figures["points"] == Z.size
    columns, rows = (
        np.clip(((axis - axis[0]) / 0.5).astype(int), 0, size - 1)
        for axis, size in ((X, found[0].nx), (Y, found[0].ny))
    )
    assert (tops(found)[np.ix_(rows, columns)] >= Z - 1e-4).all()


def test_a_log_of_probeopen_and_inches(tmp_path):
    path = written(tmp_path / "p.txt", [(x / 25.4, y / 25.4, z / 25.4, 0, 0, 0, 0, 0, 0) for x, y, z in SQUARE])
    status, found, _figures = made(tmp_path, path, "--inch", *PLACED)
    assert status == 0 and tops(found).max() == pytest.approx(-45.0, abs=0.05)


LOG = "chipwise probe 1\nunit 25.4\ng5x 10 20 30\ng92 1 2 3\nrotation 90\n" + "".join(
    f"{x / 25.4} {y / 25.4} {z / 25.4}\n" for x, y, z in SQUARE
)


def test_the_log_of_the_sub(tmp_path):
    """Its unit, and the work offset in machine units: G92, then the rotation, then the offset."""
    path, ini = tmp_path / "chipwise_probe.txt", tmp_path / "m.ini"
    path.write_text(LOG + "end\n")
    found = points.read(str(path), None, 25.4)
    assert found.points == pytest.approx(np.array(SQUARE), abs=1e-4)
    x, y, z = np.array(SQUARE).T
    assert found.place.machine(found.points) == pytest.approx(
        np.column_stack((254.0 - (y + 50.8), 508.0 + x + 25.4, 762.0 + z + 76.2)), abs=1e-4
    )
    ini.write_text(
        "[TRAJ]\nLINEAR_UNITS = mm\n[AXIS_X]\nMAX_VELOCITY = 10\n[CHIPWISE]\nCELL = 0.5\n[EMCIO]\nTOOL_TABLE = t.tbl\n"
    )
    (tmp_path / "t.tbl").write_text("T1 P1 D6\n")
    assert main(["blank", str(path), "-o", "3", "--ini", str(ini), *map(str, BOX)]) == 0
    head, _cells = store.read(str(tmp_path / "stock" / "slot3.stock"))
    assert head.cell == 0.5 and head.low == pytest.approx((10.0 - 42.0, 20.0 + 1.0, 33.0), abs=1e-3)


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "is empty; probe first"),
        (LOG, "ends after 35 points: the probing was interrupted; probe again"),
        ("chipwise probe 1\nend\n", "does not say its unit"),
        (LOG + "1 2\nend\n", "has a line that probe_grid.ngc does not write: 1 2"),
        (LOG + "end\n", "name the machine with --ini INI"),
        ("1 2 3\nfoo\n", "is not a list of points"),
        ("x,y,z\n0,0,5\n10,0,5\n0,10,abc\n", "has a line that is not a point: 0,10,abc; correct the line"),
        ("0 0 5\n10 0 5\n", "2 points are not enough"),
        ("0 0 nan\n" * 9, "the height map is one line of points"),
        (
            "0 0 5\n10 0 5\n0 10 9\n",
            "the point X0.000 Y10.000 Z9.000 is above the top of the blank, Z8.000; raise the top",
        ),
        ("0 0 5\n10 0 5\n0 10 -1\n", "is below the bottom of the blank, Z0.000; lower the bottom"),
        ("100 0 5\n110 0 5\n100 10 5\n", "no point is on the blank; compare the corners of the blank with the points"),
    ],
)
def test_files_that_are_refused(tmp_path, monkeypatch, capsys, text, words):
    monkeypatch.delenv("INI_FILE_NAME", raising=False)
    path = tmp_path / "p.xyz"
    path.write_text(text)
    (tmp_path / "a.stock").write_bytes(b"old")
    status = main(
        ["blank", str(path), "-o", str(tmp_path / "a.stock"), *map(str, PLACED if "chipwise" not in text else BOX)]
    )
    assert status == 2 and words in capsys.readouterr().err and (tmp_path / "a.stock").read_bytes() == b"old"


@pytest.mark.parametrize(
    "options, words",
    [
        (BOX, "where the zero of the points is in the machine is not known; give --offset X Y Z"),
        ((*PLACED, "--error", -1), "--error -1 is not from 0 to 10"),
        ((*PLACED, "--allowance", "nan"), "--allowance nan is not from 0 to 100"),
        (("--offset", 0, 0, 0), "arguments are required: --stock"),
        ((*PLACED, "-o", "a.txt"), "a.txt is neither FILE.stock nor a slot from 0 to 9"),
        ((*PLACED, "-o", "p.xyz"), "p.xyz is neither FILE.stock"),
        ((*PLACED, "-o", "2"), "slot 2 is that of a machine; use --ini INI"),
        (("--stock", 0, 0, 0, 60, 40, 0, "--offset", 0, 0, 0), "the blank has no extent in Z"),
        ((*PLACED, "--offset", 0, "inf", 0), "--offset 0 inf 0 is not from"),
        (("--stock", 0, 0, 0, 90000, 90000, 8, "--offset", 0, 0, 0), "a cell of 0.25 mm is too small for a blank"),
    ],
)
def test_options_that_are_refused(tmp_path, monkeypatch, capsys, options, words):
    monkeypatch.delenv("INI_FILE_NAME", raising=False)
    path = written(tmp_path / "p.xyz", SQUARE)
    status, found, _figures = made(tmp_path, path, *options)
    assert status == 2 and found is None and words in capsys.readouterr().err


def test_a_full_disk_leaves_the_old_file(tmp_path, monkeypatch, capsys):
    path = written(tmp_path / "p.xyz", SQUARE)
    assert made(tmp_path, path, *PLACED)[0] == 0
    before = {name: (tmp_path / name).read_bytes() for name in ("a.stock", "a.stock" + doubt.ENDING)}

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(files.os, "fsync", full)
    assert made(tmp_path, path, *PLACED, "--error", 0.5)[0] == 2
    assert "No space left on device" in capsys.readouterr().err and before == {
        name: (tmp_path / name).read_bytes() for name in before
    }


def test_the_doubt_belongs_to_its_stock(tmp_path):
    """Said of the stock as it was made; not of another stock in the same slot, nor of a damaged note."""
    path = written(tmp_path / "p.xyz", [(x, y, 5.0 - x / 20.0) for x, y, _ in SQUARE])
    _status, found, figures = made(tmp_path, path, *PLACED)
    out = str(tmp_path / "a.stock")
    assert (
        doubt.read(out)
        == f"it may be up to {figures['most_doubt_mm']:.2f} mm higher than the part, {figures['doubt_mm']:.2f} mm on "
        f"the average"
    )
    assert 0.3 < figures["doubt_mm"] < figures["most_doubt_mm"] < 2.0
    note = tmp_path / ("a.stock" + doubt.ENDING)
    text = note.read_text()
    for bad in (
        "",
        "[]",
        text.replace("most_doubt_mm", "x"),
        text.replace('"probed": 1.0', '"probed": NaN'),
        "[" * 4000,
    ):
        note.write_text(bad)
        assert doubt.read(out) is None
    note.write_text(text)
    other = found[1].copy()
    other["top"][5, 5] -= 0.5
    store.write(out, found[0], other)
    assert doubt.read(out) is None


def test_the_doubt_is_shown_as_long_as_its_stock_is_there(tmp_path):
    """chipwise-monitor.stock-doubt, which the page shows."""
    _status, _found, figures = made(
        tmp_path, written(tmp_path / "p.xyz", [(x, y, 5.0 - x / 20.0) for x, y, _ in SQUARE]), *PLACED
    )
    pins, said = {}, []
    files = StockFiles(pins, parse_settings({}), said.append)
    files.stock = types.SimpleNamespace(definitions=7)
    files.say_doubt(str(tmp_path / "a.stock"))
    files.follow_doubt()
    assert pins["stock-doubt"] == pytest.approx(figures["most_doubt_mm"]) and said[0].startswith(
        "the stock is a probed blank: it may be up to"
    )
    files.stock.definitions = 8
    files.follow_doubt()
    assert pins["stock-doubt"] == 0.0
    files.say_doubt(str(tmp_path / "b.stock"))
    assert pins["stock-doubt"] == 0.0 and len(said) == 1


def test_the_spacing_that_3_percent_needs_is_said(tmp_path, capsys):
    rough = [(x, y, 5.0 + (x // 10 + y // 10) % 2 * 2.0) for x, y, _ in SQUARE]
    _status, _found, figures = made(tmp_path, written(tmp_path / "p.xyz", rough), *PLACED)
    assert (
        figures["above_share"] > MOST_ABOVE
        and f"for at most 3 %, probe about every {figures['spacing_needed_mm']:.1f} mm" in capsys.readouterr().out
    )
    assert figures["spacing_needed_mm"] == pytest.approx(figures["spacing_mm"] * MOST_ABOVE / figures["above_share"])
