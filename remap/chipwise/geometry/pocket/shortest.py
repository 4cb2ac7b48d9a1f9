# SPDX-License-Identifier: GPL-2.0-or-later
"""The shortest route over the nodes of a graph, and over the free places of a raster.

Called by engage_links.py, links.py and path_graph.py.  Source: P. E. Hart, N. J. Nilsson and B. Raphael, IEEE Trans.
SSC 4 (1968), 100-107.
"""

import heapq
import math


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

    neighbours: ((i, j, length), ..) from a place to those beside it; of routes of one length their order decides."""
    (columns, rows), open_ = free.shape, free.tolist()

    def steps(at):
        i, j = at
        return [
            (size, (i + di, j + dj), None)
            for di, dj, size in neighbours
            if 0 <= i + di < columns and 0 <= j + dj < rows and open_[i + di][j + dj]
        ]

    found = shortest(first, last, steps, lambda at: math.dist(at, last))
    return found and found[0]
