# SPDX-License-Identifier: GPL-2.0-or-later
"""Judges the moves over a model by brute force: gouges, what is left, traverses through stock.

Shares nothing with the package but the moves: the lowest tip comes from drop_oracle.py, the stock is a set of needles.
"""

import ctypes as C
from functools import lru_cache

import numpy as np

from support import ROOT, drop_oracle
from support.drop_oracle import tool_of

LIBRARY = ROOT / "build" / "tests" / "support" / "surface_judge.so"
STEP = 0.05  # mm, between the positions of a move that are looked at
RIDGE = 0.01  # mm that stays on a needle between two of them


def between(start, end):
    """(n, 3) positions along a straight move."""
    return np.linspace(start, end, max(2, int(np.ceil(np.linalg.norm(end - start) / STEP)) + 1))


def arc(start, end, centre, plane, ccw):
    """(n, 3) positions along an arc of G18 (seen from +Y: Z to X is counter-clockwise) or G19 (seen from +X: Y to
    Z)."""
    a, b = {"G18": (2, 0), "G19": (1, 2)}[plane]
    middle = complex(centre[a], centre[b])
    first, last = complex(start[a], start[b]) - middle, complex(end[a], end[b]) - middle
    sweep = np.angle(last / first) % (2 * np.pi) - (0.0 if ccw else 2 * np.pi)
    share = np.linspace(0, 1, max(2, int(np.ceil(abs(sweep * first) / STEP)) + 1))
    on = middle + first * np.exp(1j * sweep * share) * (1 + (abs(last / first) - 1) * share)
    found = start + share[:, None] * (end - start)
    found[:, a], found[:, b] = on.real, on.imag
    return found


def along(move, start, end):
    """(n, 3) positions along a move."""
    if type(move).__name__ == "PlaneArc":
        return arc(start, end, move.centre, move.plane, move.ccw)
    return between(start, end)


def positions(moves, start):
    """[(is a rapid, (n, 3) positions along it)] of moves from a start."""
    at, found = np.array(start, float), []
    for move in moves:
        new = np.array([old if value is None else value for old, value in zip(at, (move.x, move.y, move.z))], float)
        found.append((type(move).__name__ == "Rapid", along(move, at, new)))
        at = new
    return found


@lru_cache(maxsize=None)
def library():
    found, p = C.CDLL(str(LIBRARY)), C.c_void_p
    found.surface_under.argtypes, found.surface_under.restype = [p, p, C.c_long, p, C.c_long, p], None
    found.surface_taken.argtypes, found.surface_taken.restype = (
        [p, p, p, C.c_long, p, C.c_long, C.c_long, C.c_int, p],
        None,
    )
    return found


def lowest_edge(xy, points, shape):
    """(n, 2) needles, (m, 3) tips -> (n,): how low the tool's edge has been over each, mm; infinite for one beside
    all."""
    xy, points, under = np.ascontiguousarray(xy, float), np.ascontiguousarray(points, float), np.empty(len(xy))
    library().surface_under(
        C.byref(tool_of(shape)), xy.ctypes.data, len(xy), points.ctypes.data, len(points), under.ctypes.data
    )
    return under


class Needles:
    """Stock as heights at random points of a rectangle; everything is below `top` at first."""

    def __init__(self, low, high, top, count, seed):
        self.xy = np.random.default_rng(seed).uniform(low[:2], high[:2], (count, 2))
        self.height = np.full(count, float(top))

    def taken(self, points, shape, size, cuts):
        """mm that each bit of a move, `size` positions and the next one, takes off a needle at most; cuts: whether they
        are lower afterwards."""
        points, self.xy, self.height = (
            np.ascontiguousarray(values, float) for values in (points, self.xy, self.height)
        )
        found = np.empty(max(1, len(range(0, len(points) - 1, size))))
        library().surface_taken(
            C.byref(tool_of(shape)),
            self.xy.ctypes.data,
            self.height.ctypes.data,
            len(self.xy),
            points.ctypes.data,
            len(points),
            size,
            cuts,
            found.ctypes.data,
        )
        return found

    def follow(self, moves, start, shape, positions=positions):
        """Cuts along the feed moves; -> how deep (mm) each rapid is in the stock.  positions: how moves become
        positions."""
        depths = []
        for is_rapid, points in positions(moves, start):
            taken = self.taken(points, shape, len(points), not is_rapid)
            if is_rapid:
                depths.append(float(taken[0]))
        return depths


def gouge_and_rest(moves, start, triangles, shape, floor, count, seed, allowance=0.0):
    """(deepest, highest): how far below and above the lowest tip `count` random positions of the feed moves in XY are,
    mm.  allowance: left on a model by a ball, which is then a larger ball."""
    import dataclasses

    grown = (
        dataclasses.replace(
            shape, diameter=shape.diameter + 2 * allowance, corner_radius=shape.corner_radius + allowance
        )
        if allowance
        else shape
    )
    points = np.concatenate(
        [p for is_rapid, p in positions(moves, start) if not is_rapid and np.hypot(*(p[-1] - p[0])[:2]) > 1e-9]
    )
    points = points[np.random.default_rng(seed).integers(0, len(points), count)]
    lowest = np.maximum(floor, drop_oracle.all_lowest(triangles, grown, points[:, :2], floor - allowance) + allowance)
    return float((lowest - points[:, 2]).max()), float((points[:, 2] - lowest).max())


def grid(low, high, top, apart, beyond=0.0):
    """Needles on a grid, `apart` mm, of a stock that reaches `beyond` mm further in X and Y."""
    low, high = np.asarray(low[:2]) - beyond, np.asarray(high[:2]) + beyond
    needles = Needles(low, high, top, 0, 0)
    x, y = (np.arange(low[k] + apart / 3, high[k], apart) for k in (0, 1))
    needles.xy = np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 2)
    needles.height = np.full(len(needles.xy), float(top))
    return needles


AIR_MM, BIT_MM = 1e-4, 0.25  # a bit of a feed move that lowers no needle by more is in air


def feed_figures(needles, moves, start, shape):
    """Cuts the needles along the feed moves -> {feed: (mm in all, mm in air)}, deepest mm that a bit of a move takes
    off a needle."""
    lengths, deepest = {}, 0.0
    for move, (is_rapid, points) in zip(moves, positions(moves, start)):
        if is_rapid:
            continue
        size = max(1, int(BIT_MM / max(np.linalg.norm(points[-1] - points[0]) / (len(points) - 1), 1e-9)))
        taken = needles.taken(points, shape, size, True)
        length = np.linalg.norm(np.diff(points[[*range(0, len(points) - 1, size), -1]], axis=0), axis=1)
        all_mm, air_mm = lengths.get(move.feed, (0.0, 0.0))
        lengths[move.feed] = all_mm + length.sum(), air_mm + length[taken <= AIR_MM].sum()
        deepest = max(deepest, taken.max())
    return lengths, deepest
