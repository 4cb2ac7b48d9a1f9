# SPDX-License-Identifier: GPL-2.0-or-later
"""What a program leaves against a model of the part: gouge, where it has cut into the part, and rest, what is left on
it.

Called by part_simulation.py when the program has been cut.  mm, machine coordinates.

 1. The part is what is below the highest surface of the model seen from above: a tool from above cannot do more.
    Beside the model there is no part, and neither is judged.
 2. The stock is judged at its needles (clib/height_map.py).  A needle below the model is a gouge if its top is at least
    the tolerance inside of the part, a needle above it is a rest if its top is at least the tolerance away from the
    part; both by the distance to the nearest surface in any direction, so a needle that a wall passes by a micrometre
    is neither.
 3. A point is farther from the part than r if a ball of radius r about it does not touch the model, which the drop
    cutter says
    (components/offline/drop_cutter.h).  For the gouge the model is turned upside down, without the triangles that face
    down.
 4. The largest of each is found with balls that grow until none fits, then by halving.  The distance changes by no more
    than the place does, so one needle of a square decides whether the others are tried.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Optional

import numpy as np

from chipwise.errors import CycleError
from chipwise.clib import layout
from chipwise.clib.drop_cutter import NOTHING, Mesh
from chipwise.surface.model import Model

if TYPE_CHECKING:
    from chipwise.clib.arrays import Floats, Ints
    from chipwise.clib.height_map import HeightMap
    from chipwise.program.records import Frame

NEEDLE = layout.DropTool(1e-4, 0.0, 0.0)  # as good as a point
STEEP = 0.01  # of a normal: what is steeper is a wall
ONE_SIDE = 0.01  # share of the area that may face another way in a model whose triangles face one
GROWTH = 2.0  # from one ball to the next
THIN = 0.1  # of a ball's radius: squares of which one needle tells whether the others are tried
SAME_MM = 1e-4  # the largest is found to that
PART = 1 << 18  # needles at once


@dataclass(frozen=True)
class Deviation:
    """most: mm, 0: none of the tolerance; at: (x, y, z) mm of it; area: mm2 of all."""

    most: float = 0.0
    at: Optional[tuple] = None
    area: float = 0.0


@dataclass(frozen=True)
class Comparison:
    """gouge, rest: Deviations; beyond: mm by which the part reaches out of the stock, to the side or above."""

    gouge: Deviation
    rest: Deviation
    beyond: float = 0.0


def compared(stock: HeightMap, model: Model, frame: Frame, tolerance: float) -> Comparison:
    """-> Comparison of a HeightMap that has been cut with a surface.model.Model in work coordinates of the Frame."""
    part = _model(frame.to_machine((model.triangles.reshape(-1, 3) + model.low).T))
    rows, columns, beyond = _window(stock, part)
    x = stock.x0 + np.arange(stock.nx)[None, columns] * stock.cell + stock.shift_x[rows, None].astype(float)
    y = stock.y0 + np.arange(stock.ny)[rows, None] * stock.cell + stock.shift_y[None, columns].astype(float)
    places = np.column_stack([x.ravel(), np.broadcast_to(y, x.shape).ravel()])
    top = stock.height[rows, columns].ravel().astype(float)
    mesh, inside = Mesh(part, 1.0), stock._inside(places[:, 0] - stock._middle[0], places[:, 1] - stock._middle[1])
    surface = np.concatenate(
        [mesh.heights(NEEDLE, places[first : first + PART], NOTHING) for first in range(0, len(places), PART)]
    )
    judged = inside & (surface > part.low[2] - 1.0)
    beyond = max(beyond, float(part.high[2]) - stock.z_max)
    above = judged & (top > surface + tolerance)
    below = judged & (top < np.minimum(surface, stock.z_max) - tolerance)
    rest = _largest(part, places[above], top[above], -1e9, tolerance, stock.cell)
    gouge = _largest(
        _upside_down(part), places[below], -np.maximum(top[below], part.low[2]), -stock.z_max, tolerance, stock.cell
    )
    if gouge.at:
        gouge = Deviation(gouge.most, (*gouge.at[:2], -gouge.at[2]), gouge.area)
    return Comparison(gouge, rest, max(0.0, beyond))


def _model(points: Floats) -> Model:
    """Model of the corners (3, 3 n) of triangles."""
    triangles = np.asarray(points, float).T
    low, high = triangles.min(axis=0), triangles.max(axis=0)
    corners = (triangles - low).astype(np.float32).reshape(-1, 9)
    top = corners[:, 2::3].max(axis=1)
    order = np.argsort(-top, kind="stable")
    return Model(np.ascontiguousarray(corners[order]), np.ascontiguousarray(top[order]), low, high)


def _window(stock: HeightMap, part: Model) -> tuple[slice, slice, float]:
    """Slices (rows, columns) of the needles that may be over the part, and mm by which it reaches out of the stock."""
    first = [int(np.floor((low - corner) / stock.cell)) - 1 for low, corner in zip(part.low, (stock.x0, stock.y0))]
    last = [int(np.ceil((high - corner) / stock.cell)) + 1 for high, corner in zip(part.high, (stock.x0, stock.y0))]
    columns, rows = (slice(max(0, a), max(0, min(size, b))) for a, b, size in zip(first, last, (stock.nx, stock.ny)))
    if (
        columns.start >= columns.stop
        or rows.start >= rows.stop
        or part.high[2] <= stock.z_min
        or part.low[2] >= stock.z_max
    ):
        raise CycleError(
            "the part lies beside the stock, {x} in X, {y} in Y and {z} in Z from its corner",
            "correct --part-at or --part-scale",
            x=float(part.low[0] - stock.x0),
            y=float(part.low[1] - stock.y0),
            z=float(part.low[2] - stock.z_min),
        )
    size = stock.nx * stock.cell, stock.ny * stock.cell
    out = [
        max(corner - low, high - corner - wide)
        for low, high, corner, wide in zip(part.low, part.high, (stock.x0, stock.y0), size)
    ]
    return rows, columns, max(*out, 0.0) if max(out) > stock.cell else 0.0


def _upside_down(part: Model) -> Model:
    """The Model of what is above the part, turned upside down [3]."""
    corners = part.triangles.astype(float).reshape(-1, 3, 3) + part.low
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    up, wall = normal[:, 2], np.abs(normal[:, 2]) <= STEEP * length
    middle = corners.mean(axis=1)
    slope = np.hypot(normal[:, 0], normal[:, 1]) / np.maximum(np.abs(up), 1e-12)
    seen = ~wall & (middle[:, 2] >= Mesh(part, 1.0).heights(NEEDLE, middle[:, :2], NOTHING) - 2e-3 - 2e-4 * slope)
    faces = float(up[seen & (up > 0)].sum()), float(-up[seen & (up < 0)].sum())
    if min(faces) <= ONE_SIDE * max(faces):
        keep = wall | (up * (1.0 if faces[0] >= faces[1] else -1.0) > 0)
    else:
        keep = wall | seen
    return _model((corners[keep].reshape(-1, 3) * (1.0, 1.0, -1.0)).T)


def _largest(model: Model, places: Floats, z: Floats, floor: float, tolerance: float, cell: float) -> Deviation:
    """Deviation of the points (places, z) that are above a model and above a plane, by the distance to both."""
    mesh, radius = Mesh(model, 1.0), 1.0

    def outside(index: Ints, r: float) -> Ints:
        """Those of the points from which all is farther than r."""
        nonlocal mesh, radius
        if r > 4 * radius:
            mesh, radius = Mesh(model, r), r
        tool = layout.DropTool(r, r, 0.0)
        return np.concatenate(
            [
                part[mesh.heights(tool, places[part], floor) + r <= z[part]]
                for part in np.split(index, range(PART, len(index), PART))
            ]
        )

    def farther(index: Ints, r: float) -> Ints:
        """Some of them, with all that are outside by r, or none: what is in a square with one that is nearer by more
        than its diagonal is left out."""
        squares = _squares(places[index], THIN * r)
        order = np.lexsort((-z[index], squares))
        first = np.ones(len(order), bool)
        first[1:] = np.diff(squares[order]) != 0
        heads = outside(index[order[first]], (1.0 - 2**0.5 * THIN) * r)
        kept = index[np.isin(squares, squares[np.isin(index, heads)])]
        return kept if len(outside(heads, r)) else outside(kept, r)

    found = outside(np.arange(len(places)), tolerance) if len(places) else np.zeros(0, int)
    if not len(found):
        return Deviation()
    low, high, area = tolerance, tolerance * GROWTH, len(found) * cell**2
    while len(bigger := farther(found, high)):
        found, low, high = bigger, high, high * GROWTH
    while high - low > SAME_MM:
        middle = (low + high) / 2
        bigger = farther(found, middle)
        found, low, high = (bigger, middle, high) if len(bigger) else (found, low, middle)
    best = outside(found, low)[0]
    return Deviation(low, (*places[best].tolist(), float(z[best])), area)


def _squares(places: Floats, side: float) -> Ints:
    """Number (n,) of the square of that side in which each of places (n, 2) is."""
    squares = np.floor((places - places.min(axis=0)) / side).astype(np.int64)
    return squares[:, 0] * (int(squares[:, 1].max()) + 1) + squares[:, 1]
