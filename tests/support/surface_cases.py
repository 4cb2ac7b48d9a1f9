# SPDX-License-Identifier: GPL-2.0-or-later
"""Models for tests and benchmarks of surfaces: shapes as triangles (n, 3, 3), mm; files of them."""

import struct
import zlib

import numpy as np

from chipwise.cycles.surface import SurfaceRequest
from chipwise.surface.model import Placing, read_model


START = (-10.0, -10.0, 30.0)  # where the tool is before a request()


def request(file, **fields):
    """A SurfaceRequest of a model's file, with a tool and other fields of its own."""
    known = dict(
        file=file,
        stamp=(),
        placing=Placing(),
        bottom=None,
        clearance=None,
        step=2.0,
        feed=600.0,
        plunge_feed=200.0,
        start=START,
        stock_is_model=True,
    )
    return SurfaceRequest(**{**known, **fields})


def model_files(folder, **more):
    """{name: STL file in a folder} of hills, of a box on a box, and of more triangles."""
    step = np.concatenate([box((0, 0, -5), (25, 20, 0)), box((6, 6, 0), (15.3, 14.1, 4))])
    shapes = {"waves": waves(25, 25.0), "step": step, **more}
    return {name: write_stl(folder / f"{name}.stl", triangles) for name, triangles in shapes.items()}


def model_of(triangles, folder=None, **placing):
    """Triangles -> Model, through a binary STL file."""
    import tempfile

    with tempfile.TemporaryDirectory() as scratch:
        return read_model(write_stl(f"{folder or scratch}/model.stl", triangles), Placing(**placing))


def triangles_in(file):
    """The triangles of a file, as read."""
    return triangles_of(read_model(file, Placing()))


def triangles_of(model):
    """The triangles of a Model, (n, 3, 3) mm."""
    return model.triangles.astype(float).reshape(-1, 3, 3) + model.low


def stl_bytes(triangles):
    """A binary STL file."""
    triangles = np.asarray(triangles, np.float32).reshape(-1, 9)
    records = np.zeros(len(triangles), np.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("attribute", "<u2")]))
    records["corners"] = triangles
    return b"test".ljust(80) + struct.pack("<I", len(triangles)) + records.tobytes()


def stl_text(triangles):
    """An ASCII STL file."""
    lines = ["solid test"]
    for triangle in np.asarray(triangles, float).reshape(-1, 3, 3):
        lines += [
            "facet normal 0 0 1",
            " outer loop",
            *(f"  vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in triangle),
            " endloop",
            "endfacet",
        ]
    return "\n".join([*lines, "endsolid test", ""]).encode()


def write_stl(path, triangles):
    with open(path, "wb") as file:
        file.write(stl_bytes(triangles))
    return str(path)


def png_bytes(values, bits=16, filters=(0,), pixel_mm=None):
    """Grey values (rows, columns) -> a PNG file; the rows' filters in turn."""
    values = np.asarray(values).astype(">u2" if bits == 16 else np.uint8)
    rows = [np.frombuffer(row.tobytes(), np.uint8).astype(int) for row in values]
    step, before, data = bits // 8, np.zeros(len(rows[0]), int), b""
    for number, row in enumerate(rows):
        kind = filters[number % len(filters)]
        left = np.concatenate([np.zeros(step, int), row[:-step]])
        corner = np.concatenate([np.zeros(step, int), before[:-step]])
        guess = left + before - corner
        off = [abs(guess - v) for v in (left, before, corner)]
        paeth = np.where((off[0] <= off[1]) & (off[0] <= off[2]), left, np.where(off[1] <= off[2], before, corner))
        taken = [0 * row, left, before, (left + before) // 2, paeth][kind]
        data += bytes([kind]) + ((row - taken) % 256).astype(np.uint8).tobytes()
        before = row
    head = struct.pack(">IIBBBBB", values.shape[1], values.shape[0], bits, 0, 0, 0, 0)
    sizes = (
        [] if pixel_mm is None else [(b"pHYs", struct.pack(">IIB", round(1000 / pixel_mm), round(1000 / pixel_mm), 1))]
    )
    chunks = [(b"IHDR", head), *sizes, (b"IDAT", zlib.compress(data)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(c)) + k + c + struct.pack(">I", zlib.crc32(k + c)) for k, c in chunks
    )


def terrain(x, y, z):
    """Heights z (len(y), len(x)) on a grid -> triangles."""
    x, y = np.meshgrid(x, y)
    p = np.stack([x, y, z], axis=2)
    a, b, c, d = p[:-1, :-1], p[:-1, 1:], p[1:, 1:], p[1:, :-1]
    return np.concatenate(
        [np.stack([a, b, d], axis=2).reshape(-1, 3, 3), np.stack([b, c, d], axis=2).reshape(-1, 3, 3)]
    )


def waves(count, size=40.0):
    """2 (count - 1)^2 triangles of hills and hollows, Z from -10 to 0, on a square of `size` mm."""
    g = np.linspace(0, size, count)
    return terrain(g, g, 5 * np.sin(g / size * 12)[None, :] * np.cos(g / size * 9)[:, None] - 5)


def box(low, high):
    """The twelve triangles of a box."""
    corners = np.array([[(low, high)[k >> a & 1][a] for a in range(3)] for k in range(8)], float)
    faces = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    return np.array([[corners[i] for i in part] for a, b, c, d in faces for part in ((a, b, c), (a, c, d))])


def sphere(radius, count):
    """The upper half of a sphere about the origin."""
    up, round_ = np.meshgrid(np.linspace(0, np.pi / 2, count // 4 + 1), np.linspace(0, 2 * np.pi, count + 1))
    p = radius * np.stack([np.cos(up) * np.cos(round_), np.cos(up) * np.sin(round_), np.sin(up)], axis=2)
    a, b, c, d = p[:-1, :-1], p[:-1, 1:], p[1:, 1:], p[1:, :-1]
    return np.concatenate(
        [np.stack([a, b, d], axis=2).reshape(-1, 3, 3), np.stack([b, c, d], axis=2).reshape(-1, 3, 3)]
    )


def opencamlib_heights(ocl, triangles, shape, xy, floor):
    """The lowest tips by opencamlib's batch drop cutter."""
    surface = ocl.STLSurf()
    for triangle in np.asarray(triangles, float):
        surface.addTriangle(ocl.Triangle(*(ocl.Point(*map(float, point)) for point in triangle)))
    diameter = shape.diameter
    cutter = (
        ocl.BallCutter(diameter, 100.0)
        if shape.corner_radius >= diameter / 2
        else ocl.BullCutter(diameter, shape.corner_radius, 100.0)
    )
    work = ocl.BatchDropCutter()
    work.setSTL(surface)
    work.setCutter(cutter)
    for x, y in xy:
        work.appendPoint(ocl.CLPoint(float(x), float(y), floor))
    work.run()
    return np.array([point.z for point in work.getCLPoints()])
