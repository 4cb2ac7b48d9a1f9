# SPDX-License-Identifier: GPL-2.0-or-later
"""Models from files: read right, or answered with a message in 2 s."""

import os
import struct
import zlib

import numpy as np
import pytest
from support import surface_cases
from support.computing import least_s

from chipwise.clib.height_map import Shape
from chipwise.errors import CycleError
from chipwise.clib import core, layout
from chipwise.stock import store
from chipwise.clib import drop_cutter
from chipwise.surface import png, stl
from chipwise.surface.model import Placing, read_model

WAVES = surface_cases.waves(12)


def answer(path, **placing):
    """(Model or message, seconds of computing)"""

    def read():
        try:
            return read_model(str(path), Placing(**placing))
        except CycleError as error:
            return str(error)

    return least_s(read, 2.0)


@pytest.mark.parametrize(
    "content",
    [
        surface_cases.stl_bytes(WAVES),
        surface_cases.stl_text(WAVES),
        surface_cases.stl_text(WAVES).replace(b"\n", b"\r\n").upper(),
        b"solid not text ".ljust(80) + surface_cases.stl_bytes(WAVES)[80:],
        b"solid facet endsolid".ljust(80) + surface_cases.stl_bytes(WAVES)[80:] + b"more\n",
        b"\xef\xbb\xbf\n" + surface_cases.stl_text(WAVES).replace(b"test", b"t" * 2000),
    ],
    ids=["binary", "ascii", "capitals", "solid", "solid and more", "mark and long name"],
)
def test_binary_and_ascii(tmp_path, content):
    (tmp_path / "model.stl").write_bytes(content)
    model, _seconds = answer(tmp_path / "model.stl", shift=(5, -3, 1), scale=2.0)
    expected = 2 * WAVES + (5, -3, 1)
    assert model.low == pytest.approx(expected.min(axis=(0, 1)), abs=1e-5) and model.high == pytest.approx(
        expected.max(axis=(0, 1)), abs=1e-5
    )
    found = surface_cases.triangles_of(model)
    order = [np.lexsort(part.reshape(-1, 9).round(3).T) for part in (found, expected)]
    assert found[order[0]] == pytest.approx(expected[order[1]], abs=2e-5)


def test_parts_of_a_long_ascii_file(tmp_path, monkeypatch):
    monkeypatch.setattr(stl, "TEXT_PART", 1000)
    (tmp_path / "model.stl").write_bytes(surface_cases.stl_text(WAVES))
    assert len(answer(tmp_path / "model.stl")[0].triangles) == len(WAVES)


def binary(triangles=WAVES, count=None):
    data = surface_cases.stl_bytes(triangles)
    return data if count is None else data[:80] + count.to_bytes(4, "little") + data[84:]


def not_finite(value):
    triangles = WAVES.copy()
    triangles[7, 1, 2] = value
    return triangles


@pytest.mark.parametrize(
    "content, text",
    [
        (b"", "the file is empty"),
        (b"\xff\xd8\xff\xe0" + bytes(500), "JPEG"),
        (b"G21\nG0 X0\n", "neither STL nor PNG"),
        (b"G21\nG0 X0\n" * 30, "the file is text, not an STL file; export the model as STL"),
        (b"PK\x03\x04" + b"ab" * 300, "is a ZIP archive, perhaps 3MF, not an STL file"),
        (
            b"BM" + b"ab" * 300,
            "is a BMP picture, not an STL file; export the model as STL, or save a picture as 16-bit grey PNG",
        ),
        (surface_cases.stl_text(WAVES).decode().encode("utf-16"), "is text in UTF-16"),
        (binary()[:1000], "is cut off: it says 242 triangles and has 18"),
        (binary(count=2**32 - 1), "is cut off"),
        (binary(WAVES[:0]), "has no triangles"),
        (b"solid\nendsolid\n", "has no triangles"),
        (binary(not_finite(np.nan)), "triangle 8 of 242 has a coordinate that is not a finite number"),
        (binary(not_finite(np.inf)), "not a finite number"),
        (binary(WAVES * 1e6), "check the unit"),
        (surface_cases.stl_text(not_finite(np.nan)), "not a finite number"),
        (surface_cases.stl_text(WAVES)[:5000], "endsolid is missing"),
        (surface_cases.stl_text(WAVES) + surface_cases.stl_text(WAVES)[:5000], "endsolid is missing"),
        (
            surface_cases.stl_text(WAVES) + b"solid two\nfacet normal 0 0 1\nouter loop\nvertex 1 2 3\n",
            "endsolid is missing",
        ),
        (surface_cases.stl_text(WAVES).replace(b"vertex", b"vortex", 1), "without three vertices"),
        (surface_cases.stl_text(WAVES).replace(b"vertex 0", b"vertex zero", 1), "not three numbers"),
        (surface_cases.png_bytes(np.zeros((4, 4)))[:60], "is cut off"),
        (
            surface_cases.png_bytes(np.zeros((4, 4)))[:45] + b"\7" + surface_cases.png_bytes(np.zeros((4, 4)))[46:],
            "is damaged",
        ),
        (surface_cases.png_bytes(np.zeros((1, 1))), "1 x 1 pixels"),
        (surface_cases.png_bytes(np.zeros((4, 4))).replace(b"\x10\0\0\0\0", b"\x10\3\0\0\0", 1), "damaged"),
    ],
    ids=lambda value: value.replace(" ", "_") if isinstance(value, str) else "",
)
def test_bad_files_are_answered(tmp_path, content, text):
    (tmp_path / "model.stl").write_bytes(content)
    found, seconds = answer(tmp_path / "model.stl")
    assert isinstance(found, str) and text in found and found.startswith("chipwise: model.stl: "), found
    assert seconds < 2


def test_files_that_are_none(tmp_path):
    (tmp_path / "huge.stl").touch()
    os.truncate(tmp_path / "huge.stl", 2 << 30)
    os.mkfifo(tmp_path / "pipe.stl")
    for name, text in (
        ("huge.stl", "2147483648 bytes, more than"),
        ("pipe.stl", "not a regular file"),
        ("none.stl", "No such file"),
        (".", "not a regular file"),
    ):
        found, seconds = answer(tmp_path / name)
        assert text in found and seconds < 2, found


def test_an_ascii_model_far_from_its_origin(tmp_path):
    """Its decimals are kept, which single precision has not there (0.004 mm); --at or X Y bring it back."""
    far = WAVES + (65000.1234, -40000.4321, 0)
    facets = [f"vertex {x:.4f} {y:.4f} {z:.4f}" for x, y, z in far.reshape(-1, 3)]
    lines = [
        "solid",
        *(
            line
            for k in range(0, len(facets), 3)
            for line in ("facet normal 0 0 1", "outer loop", *facets[k : k + 3], "endloop", "endfacet")
        ),
        "endsolid",
    ]
    (tmp_path / "model.stl").write_text("\n".join(lines))
    model, _seconds = answer(tmp_path / "model.stl", shift=(-65000.0, 40000.0, 0))
    found = surface_cases.triangles_of(model).reshape(-1, 9)
    expected = (far.round(4) - (65000, -40000, 0)).reshape(-1, 9)
    order = [np.lexsort(part.round(3).T) for part in (found, expected)]
    assert found[order[0]] == pytest.approx(expected[order[1]], abs=2e-5)


@pytest.mark.parametrize("size, said", [(0.02, True), (1.5, False)])
def test_a_model_in_metres_is_named(tmp_path, size, said):
    (tmp_path / "model.stl").write_bytes(surface_cases.stl_bytes(WAVES * size / 40))
    model, _seconds = answer(tmp_path / "model.stl")
    assert [("check its unit and SCALE" in note) for note in model.notes] == [True] * said


def test_large_good_models_are_read_in_time(tmp_path):
    """100,000 triangles in 2 s, and at most 150 bytes a triangle beside the file."""
    many = surface_cases.waves(225)
    (tmp_path / "model.stl").write_bytes(surface_cases.stl_bytes(many))
    model, seconds = answer(tmp_path / "model.stl")
    assert len(model.triangles) == len(many) > 100_000 and seconds < 2


def stock_file(path, turn=0.0, cell=0.5):
    """A stock of 20 x 12 mm with a groove along Y, cut by the core, as M253 saves it."""
    stock = core.Stock((5, -3, -10), (25, 9, 0), cell, turn=turn)
    stock.cells["top"][:, 10:18] = -2.5
    head = stock.head
    low, high = (head.x0, head.y0, head.z_min), (head.x_max, head.y_max, head.z_max)
    store.write(
        str(path),
        store.Head(cell, low, high, layout.StockShape.BOX, head.nx, head.ny, 0.0, (head.half_x, head.half_y), turn),
        stock.cells_and_ring.copy(),
    )


def test_a_stock_file_is_a_model(tmp_path):
    """Its cells are points of the surface, in its own coordinates; shifted and scaled as any model."""
    stock_file(tmp_path / "slot1.stock")
    model, _seconds = answer(tmp_path / "slot1.stock", shift=(1, 2, 0.5))
    assert model.low == pytest.approx([6.25, -0.75, -2.0], abs=1e-5) and model.high == pytest.approx(
        [25.75, 10.75, 0.5], abs=1e-5
    )
    probe = drop_cutter.Mesh(model, 1.0)
    x = np.array([8.0, 11.6, 12.5, 14.4, 20.0])
    found = probe.heights(drop_cutter.drop_tool(Shape(0.01)), np.column_stack([x, np.full(5, 4.0)]), -50.0)
    assert found == pytest.approx([0.5, -2.0, -2.0, -2.0, 0.5], abs=1e-3)


def test_stock_files_that_are_refused(tmp_path):
    stock_file(tmp_path / "good.stock")
    data = (tmp_path / "good.stock").read_bytes()
    (tmp_path / "bad.stock").write_bytes(data[:-40] + bytes(40))
    (tmp_path / "cut.stock").write_bytes(data[:200])
    stock_file(tmp_path / "turned.stock", turn=0.3)
    for name, text in (
        ("bad.stock", "the stock file cannot be used: its checksum is wrong"),
        ("cut.stock", "its checksum is wrong"),
        ("turned.stock", "the stock in the file is turned"),
    ):
        found, seconds = answer(tmp_path / name)
        assert isinstance(found, str) and text in found and seconds < 2, found


def test_an_ascii_file_with_several_solids(tmp_path):
    (tmp_path / "model.stl").write_bytes(surface_cases.stl_text(WAVES) * 3)
    assert len(answer(tmp_path / "model.stl")[0].triangles) == 3 * len(WAVES)


@pytest.mark.parametrize(
    "across, up, unit, good",
    [(2000, 1000, 1, False), (1, 2, 0, False), (11811, 11812, 1, True), (3, 3, 0, True), (0, 5, 1, True)],
)
def test_pixels_that_are_not_square(tmp_path, across, up, unit, good):
    """Refused, unless the size of a pixel is given."""
    data = surface_cases.png_bytes(np.arange(12).reshape(3, 4) * 5000, pixel_mm=0.25)
    old, new = (struct.pack(">IIB", *sizes) for sizes in ((4000, 4000, 1), (across, up, unit)))
    data = data.replace(
        old + struct.pack(">I", zlib.crc32(b"pHYs" + old)), new + struct.pack(">I", zlib.crc32(b"pHYs" + new))
    )
    (tmp_path / "depth.png").write_bytes(data)
    found, _seconds = answer(tmp_path / "depth.png", depth=3.0)
    assert isinstance(found, str) != good and (good or "times as wide as high" in found), found
    assert not isinstance(answer(tmp_path / "depth.png", depth=3.0, pixel=0.2)[0], str)


@pytest.mark.parametrize("alpha, said", [(65535, False), (65534, True)])
def test_transparent_pixels_are_named(tmp_path, alpha, said):
    grey = np.arange(12, dtype=np.uint16).reshape(3, 4) * 5000
    head = struct.pack(">IIBBBBB", 4, 3, 16, 4, 0, 0, 0)
    both = np.stack([grey, np.full((3, 4), 65535)], axis=2)
    both[1, 2, 1] = alpha
    data = b"".join(b"\0" + row.astype(">u2").tobytes() for row in both)
    chunks = [(b"IHDR", head), (b"IDAT", zlib.compress(data)), (b"IEND", b"")]
    (tmp_path / "depth.png").write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + b"".join(struct.pack(">I", len(c)) + k + c + struct.pack(">I", zlib.crc32(k + c)) for k, c in chunks)
    )
    model, _seconds = answer(tmp_path / "depth.png")
    assert model.low[2] == pytest.approx(-5) and any("transparent pixels" in note for note in model.notes) == said


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("filters", [(0,), (1,), (2,), (3,), (4,), (0, 4, 3, 2, 1)])
def test_png(tmp_path, bits, filters):
    values = np.random.default_rng(1).integers(0, 2**bits, (9, 13))
    (tmp_path / "depth.png").write_bytes(surface_cases.png_bytes(values, bits, filters, 0.25))
    with open(tmp_path / "depth.png", "rb") as file:
        picture = png.read_png(file)
    assert picture.height == pytest.approx(values / (2**bits - 1)) and picture.pixel == pytest.approx(0.25)
    model, _seconds = answer(tmp_path / "depth.png", shift=(1, 2, 0), depth=4.0, scale=2.0)
    assert model.low == pytest.approx([1, 2, 4 * (values.min() / (2**bits - 1) - 1)], abs=1e-5)
    assert model.high[:2] == pytest.approx([1 + 12 * 0.5, 2 + 8 * 0.5], abs=1e-5)
    assert bool(model.notes) == (bits == 8)
    corner = surface_cases.triangles_of(model).reshape(-1, 3)
    corner = corner[np.argmin(np.hypot(corner[:, 0] - 1, corner[:, 1] - 2))]
    assert corner[2] == pytest.approx(4 * (values[-1, 0] / (2**bits - 1) - 1), abs=1e-5)  # the last row is the front
