# SPDX-License-Identifier: GPL-2.0-or-later
"""The strategies of G79 by their number P.  Called by cycles/pocket.py."""

from chipwise.geometry.pocket.concentric import concentric
from chipwise.geometry.pocket.oneway import one_way
from chipwise.geometry.pocket.rings import contour_parallel
from chipwise.geometry.pocket.zigzag import zigzag

# P word -> strategy, as tracks.py describes it.  P4 is more than Tracks: engage.py, by way of cycles/pocket_engage.py.
STRATEGIES = {0: contour_parallel, 1: one_way, 2: zigzag, 3: concentric}

ENGAGE = 4

NAMES = {0: "contour-parallel", 1: "one-way", 2: "zigzag", 3: "concentric about a base line"}
