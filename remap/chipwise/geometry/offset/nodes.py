# SPDX-License-Identifier: GPL-2.0-or-later
"""Points that are the same point: numbering the nodes of the cut raw offset.

Called by slices.py.
"""

import numpy as np

from chipwise.geometry.base.tolerances import NODE_MM


def number(point):
    """Node number (m,) int of every point (m, 2) mm, and the nodes (k, 2) mm.

    Points nearer than NODE_MM get the same number.  Each point is put into squares of
    twice that size, on four grids shifted by half a square: two near points share a square
    on at least one of them.
    """
    label = np.arange(len(point))
    scaled = point / (2.0 * NODE_MM)
    for _ in range(2):
        for shift in ((0.0, 0.0), (0.5, 0.5), (0.0, 0.5), (0.5, 0.0)):
            label = _share_label(np.floor(scaled + shift), label)
    kept, label = np.unique(label, return_inverse=True)
    return label, point[kept]


def _share_label(square, label):
    """Smallest label (m,) of all points in the same square (m, 2)."""
    order = np.lexsort((square[:, 1], square[:, 0]))
    placed = square[order]
    first = np.flatnonzero(np.concatenate(([True], np.any(placed[1:] != placed[:-1], axis=1))))
    if len(first) == len(label):
        return label
    least = np.minimum.reduceat(label[order], first)
    result = np.empty_like(label)
    result[order] = np.repeat(least, np.diff(np.append(first, len(label))))
    return result
