# SPDX-License-Identifier: GPL-2.0-or-later
"""A model from a file, at its place: triangles in mm.

Called by cycles/surface.py, options/surface_program.py, check/part.py and glue/surface.py.  The kind of a file is read
from its content, not from its name.
"""

import os
from dataclasses import dataclass

import numpy as np

from chipwise.errors import CycleError, braceless
from chipwise.host.files import TooLong, open_regular
from chipwise.stock import store
from chipwise.surface import height_map_file, png, stl, stock_model

LARGEST = 1e5  # mm, of a coordinate
SMALL = 1.0  # mm: of a model that is smaller the unit is probably another one
PIXEL = 0.1  # mm of a pixel if neither the picture nor the user says it
UNITS = ("inch", 25.4), ("metres", 1000.0)
USUAL = 2000.0  # mm: a model that would be larger has another unit
SQUARE = 0.01  # share by which a pixel may be wider than high: what is rounded
DEPTH = 5.0  # mm from white to black if the user does not say it


@dataclass(frozen=True)
class Placing:
    """Where a model goes.

    shift   (x, y, z) mm, of the file's origin; of a picture its lower left corner, at the height of white
    scale   factor of the file's lengths; STL files count as mm
    pixel   mm of a pixel before the scale, None: as the picture says, else PIXEL
    depth   mm from white to black, not scaled
    said    whether the user gives the scale
    """

    shift: tuple = (0.0, 0.0, 0.0)
    scale: float = 1.0
    pixel: float | None = None
    depth: float = DEPTH
    said: bool = False


@dataclass(frozen=True)
class Model:
    """triangles  (n, 9) float32, mm from `low`, the highest triangle first
    top         (n,) float32, mm from low: the highest point of each
    low, high   (3,) float64, mm: the box around it
    notes       for the operator
    unit_said   whether the lengths of the file have a unit, or the user has given the scale
    """

    triangles: np.ndarray
    top: np.ndarray
    low: np.ndarray
    high: np.ndarray
    notes: tuple = ()
    unit_said: bool = True


def read_model(path: str, placing: Placing) -> Model:
    """Raises CycleError, with the file's name, for a file that is not a usable model."""
    name = braceless(os.path.basename(path))
    try:
        with open_regular(path, max(stl.MAX_BYTES, png.MAX_BYTES, stock_model.MAX_BYTES)) as file:
            corners, origin, notes = _read(file, os.fstat(file.fileno()).st_size, placing)
            file.seek(0)
            has_unit = _has_unit(file.read(len(png.SIGNATURE) + len(store.MARK)))
    except TooLong as error:
        raise CycleError(
            f"{name}: the file has {error.found} bytes, more than {error.most}", "export it with a larger tolerance"
        ) from error
    except OSError as error:
        raise CycleError(
            f"{name}: {braceless(error.strerror or str(error))}", "correct the name of the model"
        ) from error
    except CycleError as error:
        raise CycleError(f"{name}: {error.problem}", error.remedy, **error.values) from None
    return _placed(
        name, corners, placing.scale, origin * placing.scale + placing.shift, notes, has_unit or placing.said
    )


def check_size(model, diameter):
    """Raises CycleError for a Model smaller than a tool (mm) whose unit nobody has said: it is probably another one."""
    across = float((model.high - model.low)[:2].max())
    if model.unit_said or across >= diameter:
        return
    sizes = {name: factor for name, factor in UNITS if diameter <= across * factor <= USUAL}
    scales = " or ".join(
        [f"{factor:g} if it is in {name} ({{{name}}})" for name, factor in sizes.items()] + ["1 if it is that small"]
    )
    raise CycleError(
        "the model is {across} across, smaller than the tool ({diameter}), and its lengths count as mm",
        f"use SCALE (--scale) {scales}",
        across=across,
        diameter=diameter,
        **{name: across * factor for name, factor in sizes.items()},
    )


def _has_unit(head):
    """Whether a file that begins so says the unit of its lengths, or has none."""
    return head.startswith((png.SIGNATURE, store.MARK))


def _read(file, size, placing):
    """-> (corners (n, 9) float32 from an origin (3,), both in the file's unit, and notes)."""
    head = file.read(1024)
    file.seek(0)
    if head.startswith(png.SIGNATURE):
        picture = png.read_png(file)
        if not placing.pixel and abs(picture.aspect - 1.0) > SQUARE:
            raise CycleError(
                f"a pixel of the picture is {picture.aspect:.4g} times as wide as high",
                "scale the picture so that its pixels are "
                "square, or give PIXEL if they are and the picture says otherwise",
            )
        notes = (
            ("the picture has 8 bit: steps of 1/255 of the depth stay visible; use 16 bit",)
            if picture.bits == 8
            else ()
        )
        notes += (
            ("the picture has transparent pixels, which count by their colour; remove its alpha channel",)
            if picture.transparent
            else ()
        )
        return (
            _terrain(picture.height, placing.pixel or picture.pixel or PIXEL, placing.depth / placing.scale),
            np.zeros(3),
            notes,
        )
    if head.startswith(store.MARK):
        height, cell, (x0, y0) = stock_model.read_stock(file.read())
        return _even_grid(height, cell, x0, y0), np.zeros(3), ()
    if head.startswith(b"\xff\xd8"):
        raise CycleError("the file is a JPEG picture, not an STL or PNG file", "save it as 16-bit grey PNG")
    if not size:
        raise CycleError("the file is empty", "export the model again")
    if height_map_file.may_be(head) and (
        found := height_map_file.read_height_map(file.read(height_map_file.MAX_BYTES + 1))
    ):
        origin = np.array([found.x[0], found.y[0], 0.0])
        return _grid(found.height[::-1].astype(np.float32), found.x - found.x[0], found.y - found.y[0]), origin, ()
    file.seek(0)
    if not stl.is_stl(head, size):
        raise CycleError(
            "the file is neither STL nor PNG nor a height map",
            "name an STL file, a PNG picture, a height map or a stock file",
        )
    return stl.read_stl(file, size)


def _terrain(height, pixel, depth):
    """White at Z0, the lower left pixel at the origin."""
    return _even_grid((height - np.float32(1.0)) * np.float32(depth), pixel, 0.0, 0.0)


def _even_grid(z, apart, x0, y0):
    """_grid() of points at equal distances; x0, y0: of the lower left one."""
    rows, columns = z.shape
    return _grid(z, x0 + np.arange(columns) * apart, y0 + np.arange(rows) * apart)


def _grid(z, x, y):
    """Two triangles between any four points of a grid z (rows, columns), the first row at the largest Y; x, y: of
    columns and rows, rising."""
    x = np.broadcast_to(x.astype(np.float32), z.shape)
    y = np.broadcast_to(y.astype(np.float32)[::-1, None], z.shape)
    point = np.stack([x, y, z], axis=2)
    a, b, c, d = point[:-1, :-1], point[:-1, 1:], point[1:, 1:], point[1:, :-1]
    return np.concatenate(
        [np.concatenate([a, b, d], axis=2).reshape(-1, 9), np.concatenate([b, c, d], axis=2).reshape(-1, 9)]
    )


def _placed(name, corners, scale, shift, notes, unit_said=True):
    """Scaled, shifted, checked, and sorted by height."""
    if not len(corners):
        raise CycleError(f"{name}: the model has no triangles", "export the model again")
    good = np.isfinite(corners).all(axis=1)
    if not good.all():
        raise CycleError(
            f"{name}: triangle {int(np.argmin(good)) + 1} of {len(corners)} has a coordinate that is not a finite "
            f"number",
            "repair the model",
        )
    points = corners.reshape(-1, 3)
    with np.errstate(over="ignore"):
        low, high = (
            points.min(axis=0).astype(np.float64) * scale + shift,
            points.max(axis=0).astype(np.float64) * scale + shift,
        )
    if not max(np.abs(low).max(), np.abs(high).max()) <= LARGEST:
        raise CycleError(
            f"{name}: the model reaches {{far}}, more than {{most}}",
            "check the unit and SCALE of the model",
            far=float(max(np.abs(low).max(), np.abs(high).max())),
            most=LARGEST,
        )
    off = np.tile(np.asarray(shift, np.float64) - low, 3)
    for begin in range(0, len(corners), stl.PART):  # in place, and in double precision between
        part = corners[begin : begin + stl.PART]
        part[:] = part.astype(np.float64) * scale + off
    if (high - low)[:2].max() < SMALL:
        notes += (
            f"the model is only {(high - low)[:2].max():.3g} mm large; the lengths of STL files count as mm, so check "
            f"its unit and SCALE",
        )
    top = corners[:, 2::3].max(axis=1)
    order = np.argsort(-top, kind="stable")
    return Model(corners[order], top[order], low, high, notes, unit_said)
