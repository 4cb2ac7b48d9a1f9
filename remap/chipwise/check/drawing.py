# SPDX-License-Identifier: GPL-2.0-or-later
"""What the report of a check draws of one program: the stock before and after, and the path of the tool.

Called by simulate.py; page_stock.py draws it.  A stock of which M250 is said again begins the pictures again.  mm,
machine coordinates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Optional

import numpy as np

from chipwise.program import records
from chipwise.check.drawn_path import Path, Thinner

if TYPE_CHECKING:
    from chipwise.clib.arrays import Floats, Ints
    from chipwise.clib.height_map import HeightMap

PICTURE = 400  # cells of a picture along its longer side
PATH_POINTS = 3000  # of a path: more are not seen at this size


@dataclass
class Drawing:
    """cell: side of the pictures' cells; low: (x, y, z) of the lower corner; before, after: (rows, columns) heights;
    path: may be None; first: number of the first segment of this stock; frame: records.Frame of the first move, None
    without one."""

    cell: float
    low: tuple
    before: np.ndarray
    after: np.ndarray
    path: Optional[Path] = None
    first: int = 0
    frame: Optional[records.Frame] = None


class Draughtsman:
    """Draws one stock while it is cut."""

    def __init__(self, stock: HeightMap, first: int) -> None:
        self.stock, self._first, self._before = stock, first, stock.picture(PICTURE)
        self.frame: records.Frame | None = None  # of the first move
        self._thinner = Thinner(PATH_POINTS)

    def add(self, kinds: Ints, positions: Floats, lines: Ints, frame: records.Frame) -> None:
        """Moves to these positions (n, 3)."""
        self.frame = self.frame or frame
        self._thinner.add(positions, kinds == records.RAPID, lines)

    def drawing(self) -> Drawing:
        """-> Drawing."""
        stock = self.stock
        step = max(1, math.ceil(max(stock.nx, stock.ny) / PICTURE))
        return Drawing(
            stock.cell * step,
            (stock.x0, stock.y0, stock.z_min),
            self._before,
            stock.picture(PICTURE),
            self._thinner.path(),
            self._first,
            self.frame,
        )
