# SPDX-License-Identifier: GPL-2.0-or-later
"""The shortest route over the nodes of a graph, and over the free places of a raster.

Called by engage_links.py, links.py and path_graph.py.  Source: P. E. Hart, N. J. Nilsson and B. Raphael, IEEE Trans.
SSC 4 (1968), 100-107.
"""

import ctypes as C
import heapq
import math

import numpy as np

from chipwise.clib import layout
from chipwise.clib.library import library


def shortest(first, last, steps, ahead):
    """([node], [piece between two of them]) from one node to another; None where none leads there.

    steps: node -> [(length, node, piece)], to all nodes beside it.  ahead: node -> length that is left at least."""
    cost, before, heap, done = {first: 0.0}, {}, [(0.0, first)], set()
    while heap:
        _, at = heapq.heappop(heap)
        if at in done:
            continue
        done.add(at)
        if at == last:
            break
        for length, near, piece in steps(at):
            if near not in done and (far := cost[at] + length) < cost.get(near, math.inf):
                cost[near], before[near] = far, (at, piece)
                heapq.heappush(heap, (far + ahead(near), near))
    if last not in done:
        return None
    nodes, pieces = [last], []
    while nodes[-1] != first:
        at, piece = before[nodes[-1]]
        nodes.append(at)
        pieces.append(piece)
    return nodes[::-1], pieces[::-1]


def over_raster(free, first, last, neighbours):
    """[(i, j)] from one place of a raster to another over places that are free (columns, rows) bool; None.

    neighbours: ((i, j, length), ..) from a place to those beside it, at most 8; of routes of one length their order
    decides.  The same search in C: components/offline/raster_route.h."""
    columns, rows = free.shape
    free = np.ascontiguousarray(free, np.uint8)
    step = np.array([beside[:2] for beside in neighbours], np.int64)
    length = np.array([beside[2] for beside in neighbours])
    raster = layout.Raster(columns, rows, free.ctypes.data, len(step), step.ctypes.data, length.ctypes.data)
    route = np.empty(free.size, np.int64)
    start, end = (int(i * rows + j) for i, j in (first, last))
    count = library().chip_raster_route(C.byref(raster), start, end, route.ctypes.data)
    if count < 0:
        raise MemoryError
    return [divmod(at, rows) for at in route[:count][::-1].tolist()] or None
