# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the tip has been, as stock_tracker keeps it behind the cells of its map (components/core/path_done.h).

Called by panel/watch.py through SharedStock.path_done().  The tracker writes while we read: a point that may have been
overwritten meanwhile is left out.  What another program has written into the memory is not trusted: a look takes at
most a ring of points, and none that is not a finite number of mm.
"""

import numpy as np

from chipwise.clib import layout

MOST_MM = layout.MAX_COORDINATE


class PathDone:
    """The ring of points in a buffer."""

    def __init__(self, memory, start):
        """`memory`: buffer with the map; start: bytes in front of struct chip_path_done."""
        offset = start + layout.PathDone.point.offset
        self._count = np.frombuffer(memory, np.uint64, 1, start + layout.PathDone.count.offset)
        self._points = np.frombuffer(memory, float, 3 * layout.PATH_DONE_POINTS, offset).reshape(-1, 3)

    @property
    def count(self):
        """Points that were ever kept."""
        return int(self._count[0])

    def since(self, count):
        """Points after the first `count`, the oldest first, as far as they are still there.  -> ((n, 3) float mm,
        machine coordinates; the count now)."""
        size, now = layout.PATH_DONE_POINTS, self.count
        first = max(count if count <= now else 0, now - size)
        found = self._points[(first % size + np.arange(now - first)) % size]
        lost = self.count + 1 - size - first  # the tracker may be writing one more
        found = found[max(0, lost) :]
        return found[(np.abs(found) <= MOST_MM).all(axis=1)], now
