# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock of a blank that was probed: cells from touched points.

Called by cli/blank.py.  The box is what M250 would get, with its allowance; heights.py lowers it where points show how
high the blank is.  mm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence

import numpy as np

from chipwise.blank.heights import Blank, heights
from chipwise.blank.points import Place
from chipwise.clib import core, layout
from chipwise.errors import CycleError
from chipwise.stock import store

MOST_CELLS = 20_000_000
ROUND_MM = 1e-3  # by which the sides of the square around a round blank may differ
BELOW = 0.03  # of the volume: what a probed blank should be above the truth at most


@dataclass
class Probed:
    """head, cells: the stock; points: how many; spacing, steepest: of heights.py; probed: the share of the blank that
    points show; doubt, most_doubt: mean and largest of what is probed, mm; above: mm3 of stock that may be missing
    there, volume: mm3 of the stock there."""

    head: store.Head
    cells: np.ndarray
    points: int
    spacing: float
    steepest: float
    probed: float
    doubt: float
    most_doubt: float
    above: float
    volume: float

    @property
    def above_share(self) -> float:
        """How far the probed volume may be above the truth at most."""
        return self.above / max(self.volume - self.above, 1e-9)

    @property
    def spacing_needed(self) -> float | None:
        """Spacing of points, mm, at which that should be at most BELOW: the doubt grows with the spacing; None if the
        points suffice."""
        return None if self.above_share <= BELOW else self.spacing * BELOW / self.above_share


@dataclass(frozen=True)
class Typed:
    """The blank that was typed: its corners, work coordinates; the allowance on all sides but the bottom; whether it is
    the cylinder along Z in that box."""

    low: Sequence[float]
    high: Sequence[float]
    allowance: float = 0.0
    is_round: bool = False

    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """(low, high) with the allowance."""
        low, high, more = np.asarray(self.low, float), np.asarray(self.high, float), self.allowance
        return low - [more, more, 0.0], high + more


def made(points: np.ndarray, typed: Typed, place: Place, cell: float, error: float) -> Probed:
    """points (n, 3), work coordinates; place: of their zero in the machine; error: the probe's.  Raises CycleError."""
    low, high = typed.box()
    _check(points, low, high, error)
    sizes, is_round = high - low, typed.is_round
    if is_round and abs(sizes[0] - sizes[1]) > ROUND_MM:
        raise CycleError(
            f"a round blank is as long in X as in Y, and this one has {sizes[0]:g} x {sizes[1]:g} mm",
            "give the square around it, or leave --round out",
        )
    if sizes[0] * sizes[1] / cell**2 > MOST_CELLS:
        raise CycleError(
            f"a cell of {cell:g} mm is too small for a blank of {sizes[0]:g} x {sizes[1]:g} mm", "use a larger --cell"
        )
    middle = place.machine(((low + high) / 2)[None])[0]
    quarters, turn = divmod(place.rotation % 360.0, 90.0)
    if is_round:
        turn = 0.0
    elif not turn:  # upright all the same
        sizes = sizes[[1, 0, 2]] if quarters % 2 else sizes
    else:
        turn += 90.0 * quarters
    try:
        stock = core.Stock(
            middle - sizes / 2,
            middle + sizes / 2,
            cell,
            shape=int(layout.StockShape.CYLINDER if is_round else layout.StockShape.BOX),
            turn=math.radians(turn),
        )
    except core.CoreError as problem:
        raise CycleError(str(problem), "correct --stock or --cell") from problem
    head, cells = stock.head, stock.cells
    x, y = np.meshgrid(head.x0 + (np.arange(head.nx) + 0.5) * cell, head.y0 + (np.arange(head.ny) + 0.5) * cell)
    inside = cells["top"] > np.float32(head.z_min)
    found = heights(place.machine(points), np.column_stack((x[inside], y[inside])), head.z_min, head.z_max, error, cell)
    tops = np.nextafter(found.top.astype(np.float32), np.float32(np.inf))  # rounding is upwards
    cells["top"][inside] = np.clip(
        tops, np.nextafter(np.float32(head.z_min), np.float32(np.inf)), np.float32(head.z_max)
    )
    removed = max(float(np.sum(np.float32(head.z_max) - cells["top"][inside].astype(float))) * cell**2, 0.0)
    return _figures(store.head_of(head, removed), stock.cells_and_ring.copy(), found, len(points), cell)


def _check(points: np.ndarray, low: np.ndarray, high: np.ndarray, error: float) -> None:
    """Raise CycleError if points and blank cannot be of one another."""
    for axis, a, b in zip("XYZ", low, high):
        if not layout.MIN_SIZE <= b - a <= 1e5:
            raise CycleError(f"the blank has no extent in {axis}", "give its lower corner first, then its upper one")
    above = points[:, 2] > high[2] + error
    below = points[:, 2] < low[2] - error
    if above.any() or below.any():
        x, y, z = points[np.argmax(above | below)]
        side, limit, remedy = (
            ("above the top", high[2], "raise the top, or the allowance")
            if above.any()
            else ("below the bottom", low[2], "lower the bottom")
        )
        raise CycleError(
            f"the point X{x:.3f} Y{y:.3f} Z{z:.3f} is {side} of the blank, Z{limit:.3f}",
            f"{remedy}, in the corners of the blank",
        )
    if not ((points[:, :2] >= low[:2]) & (points[:, :2] <= high[:2])).all(axis=1).any():
        raise CycleError(
            "no point is on the blank", "compare the corners of the blank with the points: both have the same zero"
        )


def _figures(head: store.Head, cells: np.ndarray, found: Blank, count: int, cell: float) -> Probed:
    there = found.probed
    doubt = found.doubt[there]
    bottom = head.low[2]
    return Probed(
        head,
        cells,
        count,
        found.spacing,
        found.steepest,
        float(there.mean()),
        float(doubt.mean()) if len(doubt) else 0.0,
        float(doubt.max(initial=0.0)),
        float(doubt.sum()) * cell**2,
        float((found.top[there] - bottom).sum()) * cell**2,
    )
