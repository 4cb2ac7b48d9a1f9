# SPDX-License-Identifier: GPL-2.0-or-later
"""A stock file (M253, `chipwise digitise`) as a model: the heights of its cells.

Called by model.py.  Lengths mm, in the coordinates of the file: those of the machine, or of the log of a trace.
"""

import numpy as np

from chipwise.errors import CycleError, braceless
from chipwise.stock import store
from chipwise.stock.reasons import TOO_LARGE

MAX_CELLS = 2_500_000
MAX_BYTES = MAX_CELLS * store.CELL_DTYPE.itemsize


def read_stock(data):
    """The bytes of a stock file -> (heights (rows, columns) float32 with the first row at the largest Y, cell, (x, y)
    of the lower left one).

    Raises CycleError for a file that is damaged, too large, or of a stock that is turned.  A cell without stock is at
    its bottom."""
    try:
        head, cells = store.unpack(data, MAX_CELLS)
    except store.StoreError as error:
        raise CycleError(
            f"the stock file cannot be used: {braceless(str(error))}",
            "save it with a larger [CHIPWISE]CELL" if error.reply == TOO_LARGE else "save the stock again",
        ) from error
    if head.turn:
        raise CycleError(
            "the stock in the file is turned", "save a stock whose box is parallel to the axes of the machine"
        )
    top = cells["top"][1:-1, 1:-1]
    if min(top.shape) < 2:
        raise CycleError(
            f"the stock in the file has {top.shape[1]} x {top.shape[0]} cells, less than 2 x 2",
            "use a smaller [CHIPWISE]CELL",
        )
    return np.ascontiguousarray(top[::-1]), head.cell, (head.low[0] + head.cell / 2, head.low[1] + head.cell / 2)
