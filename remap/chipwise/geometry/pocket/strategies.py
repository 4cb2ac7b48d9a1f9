"""The strategies of G79 by their number P.  Called by cycles/pocket.py."""
from .concentric import concentric
from .oneway import one_way
from .rings import contour_parallel
from .zigzag import zigzag

# P word -> strategy, as tracks.py describes it.
STRATEGIES = {0: contour_parallel, 1: one_way, 2: zigzag, 3: concentric}

NAMES = {0: "contour-parallel", 1: "one-way", 2: "zigzag", 3: "concentric about a base line"}
