# SPDX-License-Identifier: GPL-2.0-or-later
"""As few lines and arcs as fit into a band of heights: components/offline/chain_fit.c from Python.

Called by surface/raster.py and rewrite/merge_moves.py.  Lengths mm.
"""

from __future__ import annotations

from typing import Optional

import numpy as np

from chipwise.clib.library import library


def fitted(
    s: np.ndarray, low: np.ndarray, high: np.ndarray, arc_low: Optional[np.ndarray] = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(indices (k,) of the stations that stay, their heights (k,), arcs (k, 3) as in chip_chain_fit).

    s, low, high (n,) float64: stations, rising, and the band; arc_low (n,): the lowest heights on arcs; None: lines
    only.
    """
    s, low, high = (np.ascontiguousarray(v) for v in (s, low, high))
    kept, height, arc = np.empty(len(s), np.int64), np.empty(len(s)), np.empty((len(s), 3))
    count = library().chip_chain_fit(
        len(s),
        s.ctypes.data,
        low.ctypes.data,
        high.ctypes.data,
        None if arc_low is None else arc_low.ctypes.data,
        kept.ctypes.data,
        height.ctypes.data,
        arc.ctypes.data,
    )
    return kept[:count].copy(), height[:count].copy(), arc[:count].copy()
