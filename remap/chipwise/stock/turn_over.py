# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock of side one, turned over: the stock of side two.

Called by cli/turn_over.py, and by monitor/stock_files.py for M254 with R180.  Pure: no HAL, no LinuxCNC.  Lengths mm.

A height map knows a stock from above only.  Turned by 180 degrees about X or Y:
 1. The bottom of side one, which nothing has cut, is the top of side two: flat.
 2. Side one has left nothing where it has cut through; a cell that is cut through in part lacks that share.
 3. Everything else that side one has cut is now an undercut, which no height map can hold: it counts as stock.
 4. The new bottom is where the highest place of side one lies now.
Cells do not move against each other, so the walls of [2] stay where they are to a share of a cell.  A map of whole
cells begins at its far side after the turn: the box is then larger by the part of a cell that was beyond the blank,
which is empty.  A turned box and a cylinder become an upright box with empty cells.
"""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np

from chipwise.clib import layout
from chipwise.clib.core import CELL_DTYPE
from chipwise.errors import CycleError
from chipwise.stock import reasons, store, turn_request
from chipwise.stock.store import Head, StoreError, check_head
from chipwise.stock.turn_request import AXES

BAND = 1 << 20  # cells at a time: bounds the memory


def empty_shares(cells: np.ndarray, head: Head) -> tuple[np.ndarray, np.ndarray]:
    """Of cells of CELL_DTYPE: (share 0..1 without any stock, highest place of the stock left, mm)."""
    low, high = head.low[2], head.high[2]
    top, cut, drop = cells["top"].astype(float), cells["cut"].astype(int), cells["drop"].astype(int)
    rim = drop & layout.RIM != 0
    two = rim & (drop & layout.RIM_TWO != 0)
    step = np.where(two, (high - low) / layout.RIM_DROP, (high - low) / layout.DROP_FULL)
    depth = np.where(two, drop & layout.RIM_DROP, np.where(rim, 0, drop)) * step
    share = np.where(two, ((drop >> 10 & 15) | (cut & 31) << 4) / layout.RIM_CUT, np.where(rim, 0.0, cut / layout.FULL))
    outside = np.where(two, (cut >> 5) / layout.RIM_GONE, np.where(rim, cut / layout.FULL, 0.0))
    rounding = float(np.spacing(np.float32(max(abs(low), abs(high)))))
    through = (share > 0) & (top - depth <= low + 0.5 * step + rounding)  # half a step: that of a cut to the bottom
    empty = np.where(top <= low + rounding, 1.0, outside + (1.0 - outside) * np.where(through, share, 0.0))
    return empty, np.where(empty < 1.0, top, low)


def turned_over(
    head: Head, cells: np.ndarray, about: str, corner: tuple[float, float, float], allowance: float = 0.0
) -> tuple[Head, np.ndarray]:
    """(head, cells) of a stock (stock/store.py) -> those of it turned over about an axis.

    about       X or Y: the axis of the turn
    corner      the touched corner of the blank as it lies now: its smallest X and Y, its top Z; machine coordinates of
                the tool's tip
    allowance   how far the blank's sides are inside of the box of M250
    Raises CycleError if nothing is left, StoreError for a place that no map can have."""
    inner = cells[1:-1, 1:-1]
    fresh = np.zeros(cells.shape, CELL_DTYPE)
    gone = np.empty(inner.shape, np.uint16)
    highest = head.low[2]
    rows = max(1, BAND // inner.shape[1])
    for first in range(0, len(inner), rows):
        empty, top = empty_shares(inner[first : first + rows], head)
        gone[first : first + rows] = np.floor(empty * layout.FULL)  # the stock is never less
        highest = max(highest, float(top.max()))
    if not highest - head.low[2] >= layout.MIN_SIZE:
        raise CycleError("nothing is left of the stock", "take the file of the part that was turned over")
    gone = gone[::-1] if about == "X" else gone[:, ::-1]
    sizes = [count * head.cell for count in (head.nx, head.ny)]
    beyond = [size - (b - a) for size, a, b in zip(sizes, head.low, head.high)]
    # the side that was turned to the front begins with the part of a cell that was beyond the blank
    begins = [corner[k] - allowance - (max(beyond[k], 0.0) if about != AXES[k] else 0.0) for k in (0, 1)]
    low = (begins[0], begins[1], corner[2] - (highest - head.low[2]))
    high = (begins[0] + sizes[0], begins[1] + sizes[1], corner[2])
    inside: np.ndarray = fresh[1:-1, 1:-1]
    fresh["top"] = np.float32(low[2])
    whole = gone >= layout.FULL
    inside["top"][~whole] = np.float32(high[2])
    inside["cut"] = np.where(whole, 0, gone)
    inside["drop"] = np.where((gone > 0) & ~whole, layout.DROP_FULL, 0)
    found = replace(
        head, low=low, high=high, shape=int(layout.StockShape.BOX), half=(sizes[0] / 2, sizes[1] / 2), turn=0.0
    )
    try:
        check_head(found)
    except StoreError as error:
        raise StoreError(reasons.TOO_FAR, str(error)) from error
    return found, fresh


def asked(path: str, most_cells: int) -> tuple[Head, np.ndarray]:
    """(head, cells) of the turned stock that a request of M254 (turn_request.py) names; its slot's file is not changed.
    Raises StoreError."""
    try:
        request = turn_request.read(path)
    except (OSError, ValueError) as error:
        raise StoreError(reasons.DISK, f"{path}: {error}") from error
    taken = store.read(os.path.join(os.path.dirname(path), store.slot_name(request.slot)), most_cells)
    try:
        return turned_over(*taken, request.about, request.corner, request.allowance)
    except CycleError as error:
        raise StoreError(reasons.NOTHING_LEFT, f"slot {request.slot}: {error}") from error
