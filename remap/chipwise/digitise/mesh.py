# SPDX-License-Identifier: GPL-2.0-or-later
"""A height map as a binary STL file, which G24 and chipwise surface read.

Called by cli/digitise.py.  Two triangles between any four neighbouring cells that a ball has touched, their corners at
the cells' middles; there are none where a ball was missing, so that nothing of the model is guessed.
"""

from __future__ import annotations

import numpy as np

from chipwise.digitise.height_map import HeightMap
from chipwise.errors import CycleError
from chipwise.surface.stl import MAX_TRIANGLES

TITLE = b"chipwise digitise, mm"
HEAD_BYTES = 80
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def triangles(model: HeightMap) -> np.ndarray:
    """(n, 3, 3) mm, counter-clockwise seen from above.  Raises CycleError if there is none, or more than G24 reads."""
    rows, columns = model.heights.shape
    x, y = np.meshgrid(
        model.x0 + (np.arange(columns) + 0.5) * model.cell, model.y0 + (np.arange(rows) + 0.5) * model.cell
    )
    point = np.stack([x, y, model.heights], axis=2)
    a, b, c, d = point[:-1, :-1], point[:-1, 1:], point[1:, 1:], point[1:, :-1]
    known = np.isfinite(a + b + c + d).all(axis=2)
    if not known.any():
        raise CycleError(
            "no four neighbouring cells have been touched",
            "use a larger --cell, or lines that are nearer to each other",
        )
    found = np.concatenate([np.stack([one[known] for one in corners], axis=1) for corners in ((a, b, d), (b, c, d))])
    if len(found) > MAX_TRIANGLES:
        raise CycleError(
            f"a cell of {model.cell:g} mm makes {len(found)} triangles, more than {MAX_TRIANGLES}",
            "use a larger --cell",
        )
    return found


def stl(corners: np.ndarray) -> bytes:
    """Binary STL of triangles (n, 3, 3) mm."""
    table = np.zeros(len(corners), TRIANGLE)
    table["corners"] = corners
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    table["normal"] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return TITLE.ljust(HEAD_BYTES) + np.uint32(len(corners)).astype("<u4").tobytes() + table.tobytes()
