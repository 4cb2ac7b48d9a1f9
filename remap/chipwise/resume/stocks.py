# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock that is kept, and the same blank uncut, both as maps of the core with the same cells.  Called by run.py.

All lengths mm, machine coordinates.
"""

import math
import os
from dataclasses import dataclass
from typing import Optional

import numpy as np

from chipwise.program import records
from chipwise.program.reader import Unreadable
from chipwise.host.files import JOURNAL, is_full, read_only
from chipwise.clib import layout
from chipwise.stock import journal, store
from chipwise.clib.core import CoreError, Stock
from chipwise.stock.shared import mean_heights

SAME_MM = 0.01  # of the corners of a blank


@dataclass
class Kept:
    """What was kept: head and cells of store.py, note of journal.py (None: of a run that ended in order), path."""

    head: store.Head
    cells: np.ndarray
    note: Optional[journal.Note]
    path: str


def kept(folder):
    """The Kept of a STOCK_DIR.  Raises Unreadable."""
    for name, read in ((JOURNAL, journal.read), (store.KEPT, store.read)):
        path = os.path.join(folder, name)
        if not os.path.exists(path) or not os.path.getsize(
            path
        ):  # empty: of another stock, in a folder where it could not be deleted
            continue
        try:
            head, cells, *note = read(path)
        except store.StoreError as error:
            raise Unreadable(f"the kept stock cannot be used: {error}", "say where to go on with --line N") from error
        return Kept(head, cells, note[0] if note else journal.read_note(path), path)
    if read_only(folder):
        raise Unreadable(
            f"no stock is kept in {folder}: it {read_only(folder)}",
            "make it writable, and say where to go on with --line N",
        )
    if is_full(folder):
        raise Unreadable(
            f"no stock is kept in {folder}: its disk is full", "make room, and say where to go on with --line N"
        )
    raise Unreadable(
        f"no stock is kept in {folder}",
        "if this is not the folder of your machine, name its INI file with --ini; else set [CHIPWISE]KEEP_STOCK = yes "
        "for the next time, and say where to go on with --line N",
    )


def _corners(head):
    """(low, high) of the blank before it was turned about its middle."""
    x, y = ((a + b) / 2 for a, b in zip(head.low[:2], head.high[:2]))
    half_x, half_y = head.half
    return (x - half_x, y - half_y, head.low[2]), (x + half_x, y + half_y, head.high[2])


def blank(head):
    """The uncut Stock of a store.Head, its cells those of the head."""
    stock = Stock(*_corners(head), head.cell, head.count, head.shape, head.turn)
    own = stock.head
    if (own.nx, own.ny) != (head.nx, head.ny):
        raise Unreadable(
            f"the kept stock has {head.nx} x {head.ny} cells, its blank {own.nx} x {own.ny}",
            "say where to go on with --line N",
        )
    return stock


def stock_of(found):
    """The Stock of a Kept."""
    stock = blank(found.head)
    stock.cells_and_ring[:] = found.cells
    stock.head.removed = found.head.removed
    return stock


def heights(stock):
    """(ny, nx) mm: mean height of each cell."""
    return mean_heights(stock.cells, stock.head)


def head_of(stock, removed):
    """The store.Head of a Stock; removed: mm3 that are cut of it."""
    return store.head_of(stock.head, max(removed, 0.0))


def of_record(event, cell, most):
    """The uncut Stock of a STOCK record, as the machine defines it: cells of `cell` mm, larger where the map has no
    room for them (most cells)."""
    shape, turn, *corners = event.values[:8]
    if shape < 0:
        raise restored(event.line)
    try:
        return Stock(corners[:3], corners[3:], cell, most, int(shape), math.radians(turn))
    except CoreError as error:
        raise Unreadable(
            f"the program's stock does not fit: {error}", "use a larger [CHIPWISE]CELL", event.line
        ) from error


def restored(line):
    """The Unreadable for M254."""
    return Unreadable(
        "M254 restores a stock that only the machine has, so where the program began is not known",
        "go on by hand",
        line,
    )


def is_of(event, head):
    """Whether a STOCK record is the blank of a head."""
    shape, turn, *corners = event.values[:8]
    low, high = _corners(head)
    return (
        int(shape) == head.shape
        and max(abs(a - b) for a, b in zip(corners, (*low, *high))) <= SAME_MM
        and abs(math.remainder(math.radians(turn) - head.turn, math.pi)) < 1e-6
    )


def first_move(program, head):
    """Number of the first move in the kept stock: behind the program's definition of it.  Raises Unreadable."""
    own = [event for event in program.events if event.kind == records.STOCK]
    if not own:
        return 0
    for event in own:
        if event.values[0] < 0:
            raise restored(event.line)
    found = [event for event in own if is_of(event, head)]
    if not found:
        raise Unreadable(
            "the kept stock is not the program's: its blank is X{:.3f} Y{:.3f} Z{:.3f} to X{:.3f} Y{:.3f} Z{:.3f} mm "
            "machine".format(*head.low, *head.high)
            + ", that of the program is another one",
            "name the program that ran, and see that the work offsets are those of then",
            own[0].line,
        )
    if len(found) > 1 and any(event.values != found[0].values or event.at != found[0].at for event in found):
        raise Unreadable(
            "the program defines this stock more than once", "say where to go on with --line N", found[1].line
        )
    return found[0].at


def save(path, stock, removed):
    """A Stock to the file of a slot.  Raises Unreadable."""
    cells = np.array(stock.cells_and_ring)
    try:
        store.write(path, head_of(stock, removed), cells)
    except store.StoreError as error:
        folder = os.path.dirname(path)
        if read_only(folder):
            raise Unreadable(
                f"the stock cannot be written: {folder} {read_only(folder)}", "make that folder writable"
            ) from error
        raise Unreadable(
            f"the stock cannot be written: {error}", "make room, or correct [CHIPWISE]STOCK_DIR"
        ) from error


def most_cells(settings):
    """Cells that the machine's map has room for."""
    size = settings["MAP_SIZE"]
    return min(
        layout.MAX_CELLS,
        int(math.ceil(size[0] / settings["CELL"]) + 2) * int(math.ceil(size[1] / settings["CELL"]) + 2),
    )
