# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock map of a running stock_tracker, read from another process.

Who calls it: bin/chipwise, the monitor, tests.  The map lies in shared memory under the key the tracker shows as
stock-tracker.N.shm-key (components/core/stock.h, clib/layout.py).
The tracker writes while we read.  It makes `generation` odd before it writes and even after: a
copy made between two equal even generations is one state of the map (a sequence lock).  A map too
large to be copied between two periods in which the tool cuts is read in bands of rows, each of which is
one state; the bands are then some periods apart.

live() is for a picture that follows the map: the cells themselves, of no one moment.  Such a reader attaches read-only,
so that it cannot write into the map, whatever goes wrong in it.

put() writes a whole stock, for which the tracker must have let the map go (stock-tracker.N.held).

Everything in the memory is checked before it is used: the block must be our own, for nobody else to write, and as large
as its head says; its size, bounds of the cell and capacity are kept here from then on, and every head is compared with
them before an index is made of it.
All lengths mm, machine coordinates.
"""

from __future__ import annotations

import ctypes as C
import os
import time
from dataclasses import dataclass

import numpy as np

from chipwise.host.clock import patience
from chipwise.clib import layout
from chipwise.clib.core import CELL_DTYPE
from chipwise.stock.mapped import Mapped, SharedStockError
from chipwise.stock import clamp_table
from chipwise.stock.path_done import PathDone
from chipwise.stock.store import head_of

_Head = layout.Stock  # struct chip_stock without its cells
BAND_BYTES = 1 << 18  # copied between two looks at the generation: some 50 us
TRIES = 6  # to copy the map as a whole; one where it is large
LARGE_BYTES = 1 << 20  # takes longer to copy than a period
MOST_NUMBER = 1e15  # mm, mm3: of any number in the head
PART_TRIES = 200  # to copy a part of some 10,000 cells
TIMEOUT_S = 2.0  # then the map is given up


@dataclass(frozen=True)
class Snapshot:
    """One state of the stock."""

    low: tuple  # (x, y, z) of the box's lower corner, mm
    high: tuple  # (x, y, z) of its upper corner, mm
    cell: float  # mm
    heights: np.ndarray  # (ny, nx) float, mm, machine Z: mean height of each cell
    removed: float  # mm3 since the stock was defined
    generation: int  # rises with every change; equal: nothing has changed
    exact: bool  # all of one moment; else bands of rows are of moments close by


def mean_heights(cells, head):
    """Mean height of cells (dtype CELL_DTYPE) of the map with this head, mm, its bottom without stock; stock.h,
    chip_cell_levels has the layout."""
    height = cells["top"].astype(float) - cells["cut"].astype(float) / layout.FULL * cells["drop"] * head.drop_unit
    rim = cells["drop"] & layout.RIM != 0
    height[rim] = _rim_heights(cells[rim], head)
    return height


def _rim_heights(cells, head):
    """The same of cells on the outline of the stock."""
    top, cut, drop = cells["top"].astype(float), cells["cut"].astype(int), cells["drop"].astype(int)
    two = (drop & layout.RIM_TWO) != 0
    gone = np.where(two, (cut >> 5) / layout.RIM_GONE, cut / layout.FULL)
    share = np.where(two, (drop >> 10 & 15) | (cut & 31) << 4, 0) / layout.RIM_CUT
    mean = top - share * (drop & layout.RIM_DROP) / layout.RIM_DROP * (head.z_max - head.z_min)
    return mean - gone * (mean - head.z_min)


class SharedStock:
    """The map of one tracker in a buffer; attach() for that of a running LinuxCNC."""

    def __init__(self, memory):
        """`memory`: a writable buffer that starts with the map's head."""
        self._memory = memory
        self._held = ()
        if len(memory) < C.sizeof(_Head):
            raise SharedStockError(
                f"chipwise: stock map: a block of {len(memory)} bytes is not a map; start LinuxCNC again"
            )
        self._head = _Head.from_buffer(memory)
        self._room = (len(memory) - C.sizeof(_Head)) // CELL_DTYPE.itemsize
        self._bounds, self._capacity = _bounds(self._head), self._head.capacity
        if (self._head.magic, self._head.version) != (layout.STOCK_MAGIC, layout.STOCK_VERSION):
            raise SharedStockError(
                f"chipwise: stock map: magic {self._head.magic:#x} version {self._head.version} is not "
                f"{layout.STOCK_MAGIC:#x} version {layout.STOCK_VERSION}; use the stock_tracker of this chipwise"
            )
        if not (
            0 < self._capacity <= self._room
            and layout.MIN_CELL <= self._bounds[0] <= self._bounds[1] <= layout.MAX_CELL
        ):
            raise SharedStockError(
                f"chipwise: stock map: {self._capacity} cells of {self._bounds[1]:g} mm do not fit into its memory of "
                f"{len(memory)} bytes; start LinuxCNC again"
            )

    def close(self):
        """Lets the memory go; nothing can be read any more."""
        self._head = self._memory = None
        if self._held:
            self._held[0].close()
        component = self._held[1:]
        self._held = ()
        for one in component:
            one.exit()

    @property
    def defined(self):
        """A stock is defined and filled."""
        return self._has_stock(self._head)

    def _has_stock(self, head):
        """Whether the head is that of a filled map; SharedStockError where it is not that of a map at all."""
        if head.nx <= 0 or head.filled < head.ny + 2:
            return False
        numbers = (
            head.x0,
            head.y0,
            head.z_min,
            head.x_max,
            head.y_max,
            head.z_max,
            head.drop_unit,
            head.removed,
            head.turn,
        )
        if (
            head.ny <= 0
            or (head.nx + 2) * (head.ny + 2) > self._capacity
            or _bounds(head) != self._bounds
            or not layout.MIN_CELL <= head.cell <= layout.MAX_CELL
            or not all(abs(number) < MOST_NUMBER for number in numbers)
        ):
            raise SharedStockError(
                "chipwise: stock map: another program has written into its memory; define the stock again with M250"
            )
        return True

    @property
    def generation(self):
        return self._head.generation

    def snapshot(self, timeout_s=TIMEOUT_S):
        """A Snapshot, or None where no stock is defined; SharedStockError after timeout_s."""
        end = time.monotonic() + patience(timeout_s)
        tries = 0
        while time.monotonic() < end:
            head = self._unmoved(lambda: _Head.from_buffer_copy(self._memory))
            if head is None:
                continue
            tries += 1
            if not self._has_stock(head):
                return None
            large = (head.nx + 2) * (head.ny + 2) * CELL_DTYPE.itemsize > LARGE_BYTES
            exact = tries <= (1 if large else TRIES)
            cells = self._whole(head) if exact else self._in_bands(head, end)
            if cells is not None:
                return _snapshot(head, cells, exact)
        raise SharedStockError(
            f"chipwise: stock map: it changed faster than it could be read for "
            f"{timeout_s:g} s; read it while the tool stands"
        )

    @property
    def capacity(self):
        """Cells there is room for, ring included."""
        return self._capacity

    @property
    def bounds(self):
        """(finest, coarsest) side of a cell, mm."""
        return self._bounds

    def take(self, timeout_s=TIMEOUT_S):
        """(store.Head, cells with their ring) of one moment, or None where no stock is defined."""
        end = time.monotonic() + patience(timeout_s)
        while time.monotonic() < end:
            head = self._unmoved(lambda: _Head.from_buffer_copy(self._memory))
            if head is None:
                continue
            if not self._has_stock(head):
                return None
            cells = self._whole(head)
            if cells is not None:
                return head_of(head, head.removed), cells
        raise SharedStockError(
            f"chipwise: stock map: it changed faster than it could be read for "
            f"{timeout_s:g} s; save it while the tool stands"
        )

    def live(self):
        """(struct chip_stock without its cells, (ny, nx) uint64 view of the cells themselves), or None where no stock
        is defined.  The tracker goes on writing: a cell is of one moment, two cells are not.  The view ends with
        close()."""
        head = self._unmoved(lambda: _Head.from_buffer_copy(self._memory))
        if head is None or not self._has_stock(head):
            return None
        width, start = head.nx + 2, C.sizeof(_Head)
        cells = np.frombuffer(self._memory, np.uint64, (head.ny + 2) * width, start).reshape(-1, width)
        return head, cells[1:-1, 1:-1]

    def put(self, found, cells):
        """Makes a stock of store.read() the map's, or leaves none (None).  Only while the tracker holds still."""
        head = self._head
        if found and (found.count > self._capacity or cells.size != found.count):
            raise SharedStockError("chipwise: stock map: a stock that does not fit was to be written")
        head.generation += 1
        head.nx = 0  # no stock until everything is there
        if found:
            start, raw = C.sizeof(_Head), cells.view(np.uint8).reshape(-1)
            np.frombuffer(self._memory, np.uint8, raw.size, start)[:] = raw
            (head.x0, head.y0, head.z_min), (head.x_max, head.y_max, head.z_max) = found.low, found.high
            head.cell, head.drop_unit = found.cell, (found.high[2] - found.low[2]) / layout.DROP_FULL
            head.shape, head.removed = found.shape, found.removed
            (head.half_x, head.half_y), head.turn = found.half, found.turn
            head.ny, head.filled = found.ny, found.ny + 2
        head.definitions += 1
        head.nx = found.nx if found else 0
        head.generation += 1

    @property
    def definitions(self):
        """Counts stocks: a number that has changed means another stock."""
        return self._head.definitions

    @property
    def removed(self):
        """mm3 cut of this stock."""
        return self._head.removed

    def moment(self):
        """(struct chip_stock without its cells, store.Head, (rows, columns) uint64 view of the cells, ring included) or
        None without a stock: the view is of no one moment, see part()."""
        head = self._unmoved(lambda: _Head.from_buffer_copy(self._memory))
        if head is None or not self._has_stock(head):
            return None
        width = head.nx + 2
        return (
            head,
            head_of(head, head.removed),
            np.frombuffer(self._memory, np.uint64, (head.ny + 2) * width, C.sizeof(_Head)).reshape(-1, width),
        )

    def path_done(self):
        """The PathDone behind the cells, None where the memory has none; it ends with close()."""
        start = self._end_of_cells()
        return PathDone(self._memory, start) if len(self._memory) >= start + C.sizeof(layout.PathDone) else None

    def _end_of_cells(self):
        """Bytes in front of what follows the cells."""
        return C.sizeof(_Head) + self._capacity * CELL_DTYPE.itemsize

    def clamp_table(self):
        """The ClampTable behind the path done, None where the memory has none.  Close it before this."""
        start = self._end_of_cells() + C.sizeof(layout.PathDone)
        return clamp_table.ClampTable(self._memory, start) if len(self._memory) >= start + clamp_table.SIZE else None

    def clamps_in_force(self, before):
        """clamp_table.rows() of the ClampTable, or `before` while it is being written; [] where the memory has none.
        Nothing is written, so the memory may be read-only."""
        start = self._end_of_cells() + C.sizeof(layout.PathDone)
        if len(self._memory) < start + clamp_table.SIZE:
            return []
        table, again = (layout.ClampTable.from_buffer_copy(self._memory, start) for _ in range(2))
        return clamp_table.rows(table) if table.generation % 2 == 0 and table.generation == again.generation else before

    def part(self, cells, definitions, tries=PART_TRIES):
        """Copy of a part of moment()'s view as it was at one moment of the stock `definitions`, or None."""
        for _ in range(tries):
            copy = self._unmoved(lambda: (self._head.definitions, cells.copy()))
            if copy is not None:
                return copy[1] if copy[0] == definitions else None
        return None

    def _unmoved(self, read):
        """What `read` gives, or None where the tracker wrote meanwhile."""
        before = self._head.generation
        if before % 2:
            return None
        found = read()
        return found if self._head.generation == before else None

    def _rows(self, head, first, count):
        """Copy of rows of cells, ring included."""
        width = head.nx + 2
        start = C.sizeof(_Head) + first * width * CELL_DTYPE.itemsize
        return np.frombuffer(self._memory, CELL_DTYPE, count * width, start).copy().reshape(-1, width)

    def _whole(self, head):
        """All cells as they are at the generation of `head`, or None."""
        cells = self._unmoved(lambda: self._rows(head, 0, head.ny + 2))
        return cells if self._head.generation == head.generation else None

    def _in_bands(self, head, end):
        """All cells, each band of rows of one moment, or None."""
        at_once = max(1, BAND_BYTES // (CELL_DTYPE.itemsize * (head.nx + 2)))
        bands, first = [], 0
        while first < head.ny + 2 and time.monotonic() < end:
            count = min(at_once, head.ny + 2 - first)
            band = self._unmoved(lambda: self._rows(head, first, count))
            if band is not None:
                bands.append(band)
                first += count
        now = self._unmoved(lambda: _Head.from_buffer_copy(self._memory))
        if first < head.ny + 2 or now is None or _box(now) != _box(head) or now.filled < now.ny + 2:
            return None
        return np.concatenate(bands)


def _bounds(head):
    """mm, the smallest and the largest side a cell of the map may have."""
    return head.finest, head.coarsest


def _box(head):
    return (head.x0, head.y0, head.z_min), (head.x_max, head.y_max, head.z_max)


def _snapshot(head, cells, exact):
    low, high = _box(head)
    return Snapshot(low, high, head.cell, mean_heights(cells[1:-1, 1:-1], head), head.removed, head.generation, exact)


def attach(tracker=0, component=None, read_only=False):
    """The SharedStock of stock-tracker.<tracker> of the LinuxCNC that runs here; component: the caller's
    HAL component, if it has one; read_only: writing into the map ends this process."""
    import hal  # only where LinuxCNC is

    own = component is None
    if own:
        component = hal.component(f"chipwise-map-{os.getpid()}-{tracker}")
    try:
        key = hal.get_value(f"stock-tracker.{tracker}.shm-key")
    except RuntimeError as error:
        if own:
            component.exit()
        raise SharedStockError(
            f"chipwise: stock map: there is no stock-tracker.{tracker}; start a LinuxCNC with chipwise.hal"
        ) from error
    try:
        stock = of_key(key, read_only, True)
    except SharedStockError:
        if own:
            component.exit()
        raise
    stock._held += (component,) if own else ()
    return stock


def of_key(key=layout.STOCK_MAGIC, read_only=True, removes=False):
    """The SharedStock under a key (that of stock-tracker.0 without one), for a process that has nothing to do with
    HAL; removes: as in Mapped."""
    mapped = Mapped(key, read_only, C.sizeof(_Head), removes)
    stock = SharedStock(mapped.memory)
    stock._held = (mapped,)
    size = len(mapped.memory)
    if size != stock._end_of_cells() + C.sizeof(layout.PathDone) + clamp_table.SIZE:
        stock.close()
        raise SharedStockError(
            f"chipwise: stock map: its head is not {C.sizeof(_Head)} bytes long ({stock.capacity} cells in "
            f"{size} bytes); use the stock_tracker of this chipwise"
        )
    return stock
