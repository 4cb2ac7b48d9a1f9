# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock as pictures in tiles, of which only those that have changed are sent.

Called by watch.py, which looks at the running map some times a second, and by server.py, once for each page and
picture.

 1. A look compares the cells of the map with a copy of them, tile by tile.  The tracker writes meanwhile: what a look
    misses, the next one finds.
 2. A tile that has changed gets the number of this look, and its heights are computed anew.
 3. A page names the last look it has; it gets all tiles with a higher number.
 4. The heights at the begin of a program are kept (mark), and sent to each page once: what the program has cut is the
    difference.  Another stock ends that (unmark), also one of the same box.
 5. A map of more than MOST_CELLS is shown in steps: one cell of each field of `step` by `step` cells.

Heights go out as 16 bit numbers, 0 at the bottom of the stock's box, 65535 at its top.
"""

import json
import struct
import threading
from typing import Protocol

import numpy as np
import numpy.typing as npt

from chipwise.clib.core import CELL_DTYPE
from chipwise.stock.shared import mean_heights

Message = tuple[bytes, bytes]  # its kind (server.py: message), and its content
Heights = npt.NDArray[np.uint16]
Box = tuple[float, float, float, float, float, float, int, int, float]
TILE = 64  # cells along the sides of a tile
MOST_CELLS = 1 << 20  # of a picture
MOST_SIDE = 4096  # of its cells along X or Y: what a browser's texture can have
FULL = 65535  # height of the top of the box in a picture
MAP, TILES, BEFORE = b"M", b"T", b"B"  # kinds of messages (server.py: message)
TILE_HEAD = struct.Struct("<HHHH")  # first column, first row, columns, rows


def step_of(rows: int, columns: int) -> int:
    """Cells of the map along one cell of the picture."""
    step = 1
    while -(-rows // step) * -(-columns // step) > MOST_CELLS or -(-max(rows, columns) // step) > MOST_SIDE:
        step += 1
    return step


class Head(Protocol):
    """Of a map (clib/layout.py: Stock): box and cells, mm."""

    x0: float
    y0: float
    z_min: float
    x_max: float
    y_max: float
    z_max: float
    nx: int
    ny: int
    cell: float
    drop_unit: float


class Tiles:
    """The picture of one map.  look() is for one thread, messages() for any."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._box: Box | None = None  # of the map that is shown
        self._head: Head | None = None  # of that map
        self._epoch = 0  # counts maps: another box, another size
        self._number = 0  # counts looks that have found a change
        self._step = 1
        self._seen = np.zeros((0, 0), np.uint64)  # (rows, columns): the cells as they were at the last look
        self._heights: Heights | None = None  # (rows, columns)
        self._before: Heights | None = None  # the heights at the last mark(), of the same box
        self._mark = 0  # counts marks and maps
        self._unmarked = -1  # the one that unmark() has made
        self._changed = np.zeros((0, 0), np.int64)  # (tiles in Y, tiles in X): look at which a tile has changed last

    @property
    def now(self) -> tuple[int, int]:
        """(epoch, number) of what messages() would send."""
        return self._epoch, self._number

    def look(self, live: tuple[Head, npt.NDArray[np.uint64]] | None) -> bool:
        """live: SharedStock.live(), None without a stock.  -> whether anything has changed."""
        if live is None:
            return False
        head, cells = live
        box = (head.x0, head.y0, head.z_min, head.x_max, head.y_max, head.z_max, head.nx, head.ny, head.cell)
        heights = self._heights
        if box != self._box or heights is None:
            return self._begin(head, cells, box)
        cells = cells[:: self._step, :: self._step]
        rows, columns = (np.arange(0, size, TILE) for size in cells.shape)
        found = (cells != self._seen).view(np.uint8)
        hit = np.maximum.reduceat(np.maximum.reduceat(found, rows, axis=0), columns, axis=1)
        if not hit.any():
            return False
        with self._lock:
            self._number += 1
            self._head = head
            for j, i in np.argwhere(hit):
                self._take(head, heights, cells, slice(j * TILE, (j + 1) * TILE), slice(i * TILE, (i + 1) * TILE))
            self._changed[hit != 0] = self._number
        return True

    def _begin(self, head: Head, cells: npt.NDArray[np.uint64], box: Box) -> bool:
        """A map of another box."""
        with self._lock:
            self._step = step_of(*cells.shape)
            cells = cells[:: self._step, :: self._step]
            self._box, self._head = box, head
            self._before, self._mark = None, self._mark + 1
            self._seen = np.zeros(cells.shape, np.uint64)
            heights = self._heights = np.zeros(cells.shape, np.uint16)
            self._epoch += 1
            self._number += 1
            self._changed = np.full([-(-size // TILE) for size in cells.shape], self._number)
            for first in range(0, cells.shape[0], TILE):
                self._take(head, heights, cells, slice(first, first + TILE), slice(None))
        return True

    def _take(self, head: Head, kept: Heights, cells: npt.NDArray[np.uint64], rows: slice, columns: slice) -> None:
        """The cells of a part into the copy, and its heights from the copy to those that are kept."""
        self._seen[rows, columns] = cells[rows, columns]
        part = np.ascontiguousarray(self._seen[rows, columns])
        heights = mean_heights(part.view(CELL_DTYPE).reshape(part.shape), head)
        scaled = (heights - head.z_min) * (FULL / (head.z_max - head.z_min))
        kept[rows, columns] = np.clip(np.nan_to_num(np.rint(scaled)), 0, FULL)

    def mark(self) -> None:
        """The stock of the last look is what later ones are compared with; another box ends that."""
        with self._lock:
            if self._heights is not None:
                self._before, self._mark = self._heights.copy(), self._mark + 1

    def unmark(self) -> None:
        """There is nothing to compare with any more."""
        with self._lock:
            if self._before is not None:
                self._before, self._mark = None, self._mark + 1
                self._unmarked = self._mark

    def before(self, mark: int) -> tuple[list[Message], int]:
        """The stock at the last mark(), for a page that has that of `mark` (0: none yet): ([(kind, bytes)], the new
        mark); without heights if there is none any more."""
        with self._lock:
            if mark == self._mark or self._before is None and self._unmarked != self._mark:
                return [], self._mark
            heights = b"" if self._before is None else self._before.astype("<u2").tobytes()
            return [(BEFORE, struct.pack("<I", self._epoch) + heights)], self._mark

    def messages(self, since: tuple[int, int]) -> tuple[list[Message], tuple[int, int]]:
        """What a page needs that has `since` = (epoch, number), (0, 0) for a new one.
        -> ([(kind, bytes), ..], the new (epoch, number))."""
        with self._lock:
            if since == self.now or self._heights is None or self._head is None:
                return [], self.now
            head, heights, (epoch, number) = self._head, self._heights, since
            found: list[Message] = []
            if epoch != self._epoch:
                number = 0
                rows, columns = heights.shape
                found.append(
                    (
                        MAP,
                        json.dumps(
                            {
                                "epoch": self._epoch,
                                "rows": rows,
                                "columns": columns,
                                "cell": head.cell * self._step,
                                "x": head.x0,
                                "y": head.y0,
                                "bottom": head.z_min,
                                "top": head.z_max,
                            }
                        ).encode(),
                    )
                )
            data = b"".join(_packed(heights, j, i) for j, i in np.argwhere(self._changed > number))
            return found + [(TILES, struct.pack("<I", self._epoch) + data)], self.now


def _packed(heights: Heights, j: int, i: int) -> bytes:
    """One tile: TILE_HEAD and its heights, row by row from the lowest Y."""
    part = heights[j * TILE : (j + 1) * TILE, i * TILE : (i + 1) * TILE]
    return TILE_HEAD.pack(i * TILE, j * TILE, part.shape[1], part.shape[0]) + part.astype("<u2").tobytes()
