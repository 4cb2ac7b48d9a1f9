# SPDX-License-Identifier: GPL-2.0-or-later
"""A height map of a probing program -> the cells of a stock.

Called by cli/digitise.py; the file itself is read by surface/height_map_file.py.  Between its points the map is taken
as bilinear.  A cell is as high as the highest place of the map in it, border included, so that the stock is nowhere
below the map.
"""

from __future__ import annotations

import numpy as np

from chipwise.digitise.height_map import MOST_CELLS, HeightMap
from chipwise.errors import MM_PER_INCH, CycleError
from chipwise.surface import height_map_file


def _weights(known: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For rising coordinates `known` (n,) and places `wanted` (k,): the index of the one before (k,) int, and the share
    of the one after (k,)."""
    before = np.clip(np.searchsorted(known, wanted, side="right") - 1, 0, len(known) - 2)
    return before, np.clip((wanted - known[before]) / (known[before + 1] - known[before]), 0.0, 1.0)


def _along(heights: np.ndarray, known: np.ndarray, cell: float) -> np.ndarray:
    """Heights (n, m) at the coordinates `known` (n,) -> (k, m): the highest in each of the k cells along the first
    axis.

    Between points it is linear, so its extremes are at borders of cells and at its own points.  One axis after the
    other is never lower than the highest place of the bilinear surface in a cell."""
    count = max(1, int(np.ceil((known[-1] - known[0]) / cell - 1e-9)))
    borders = known[0] + cell * np.arange(count + 1)
    before, share = _weights(known, borders)
    at = heights[before] * (1.0 - share[:, None]) + heights[before + 1] * share[:, None]
    found = np.maximum(at[:-1], at[1:])
    np.maximum.at(found, np.clip(((known - known[0]) / cell).astype(int), 0, count - 1), heights)
    return found


def cells_of(probed: height_map_file.HeightMap, offset: tuple[float, float, float], cell: float) -> HeightMap:
    """The map, shifted by `offset` (mm), in cells of `cell` mm.  Raises CycleError if they are too many.

    The last row and column may reach beyond the map by less than a cell; there the stock is as high as at the map's
    edge."""
    counts = [(axis[-1] - axis[0]) / cell for axis in (probed.x, probed.y)]
    if counts[0] * counts[1] > MOST_CELLS:
        raise CycleError(
            f"a cell of {cell:g} mm is too small for a map of {probed.x[-1] - probed.x[0]:g} x "
            f"{probed.y[-1] - probed.y[0]:g} mm",
            "use a larger --cell",
        )
    heights = _along(_along(probed.height, probed.y, cell).T, probed.x, cell).T
    return HeightMap(heights + offset[2], float(probed.x[0]) + offset[0], float(probed.y[0]) + offset[1], cell)


def read(path: str, inch: bool) -> height_map_file.HeightMap:
    """The height map of a file, in mm.  Raises CycleError for another file, OSError."""
    with open(path, "rb") as file:
        data = file.read(height_map_file.MAX_BYTES + 1)
    found = height_map_file.read_height_map(data)
    if found is None:
        raise CycleError(
            f"{path} is not a height map",
            "give --ball for the log of a tracer, or a height map of Candle, bCNC, OpenCNCPilot, or points x y z",
        )
    unit = MM_PER_INCH if inch else 1.0
    return height_map_file.HeightMap(found.x * unit, found.y * unit, found.height * unit)
