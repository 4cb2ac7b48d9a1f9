# SPDX-License-Identifier: GPL-2.0-or-later
"""Paths of turning compared as curves.  Called by tests/turning and tests/machine."""

import math

import numpy as np

CHORD = 0.002  # mm, of an arc's segments: their sag is below 1e-6 mm at radii above 0.5 mm


def distances(points, path):
    """Distance (n,) of points (n, 2) from a polyline (m, 2)."""
    a, b = path[:-1], path[1:]
    d = b - a
    square = np.maximum((d * d).sum(axis=1), 1e-18)
    found = np.full(len(points), np.inf)
    for k in range(len(a)):
        t = np.clip(((points - a[k]) @ d[k]) / square[k], 0.0, 1.0)
        found = np.minimum(found, np.hypot(*(points - a[k] - t[:, None] * d[k]).T))
    return found


def polyline(moves, chord=CHORD):
    """(n, 2) points (z, x) mm of moves as lathe_preview gives them."""
    points = [moves[0][2]]
    for move in moves[1:]:
        if move[4]:
            points += _arc(points[-1], move[2], move[4], chord)
        points.append(move[2])
    return np.array(points)


def _arc(start, end, about, chord):
    cz, cx, turns = about
    a, b = (math.atan2(p[1] - cx, p[0] - cz) for p in (start, end))
    turn = (b - a) % (2 * math.pi) if turns > 0 else -((a - b) % (2 * math.pi))
    r = math.hypot(start[0] - cz, start[1] - cx)
    n = max(int(abs(turn) * r / chord), 1)
    return [(cz + r * math.cos(a + turn * k / n), cx + r * math.sin(a + turn * k / n)) for k in range(1, n)]
