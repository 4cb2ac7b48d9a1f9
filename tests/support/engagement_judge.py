# SPDX-License-Identifier: GPL-2.0-or-later
"""The engagement of a tool along what it did, exactly, by judge_engagement.c; nothing of the package is in it.

Takes the elements of support.hole_oracle.walk().  Levels are judged one by one: what is cleared above counts for
nothing below.  Lengths mm, angles rad.
"""

import ctypes as C
import math
from dataclasses import dataclass

import numpy as np

from support.judge import library, pointer

AIR = 0.06  # rad: less is in air
FULL = 3.0  # rad: more is a full slot


def exact(pieces, asked, radius, spacing=0.1):
    """Rows (n, 6): piece, x, y, heading, engagement, length.  pieces (n, 7): start, end, centre, sweep; asked (n,)
    bool."""
    pieces, asked = np.ascontiguousarray(pieces, float), np.ascontiguousarray(asked, np.uint8)
    lengths = np.where(
        pieces[:, 6] != 0.0,
        np.hypot(*(pieces[:, :2] - pieces[:, 4:6]).T) * np.abs(pieces[:, 6]),
        np.hypot(*(pieces[:, 2:4] - pieces[:, :2]).T),
    )
    out = np.empty((int(lengths.sum() / spacing) + len(pieces) + 1, 6))
    count = library().judge_engagement(
        C.c_long(len(pieces)),
        pointer(pieces),
        pointer(asked),
        C.c_double(radius),
        C.c_double(spacing),
        pointer(out),
        C.c_long(len(out)),
    )
    assert count >= 0
    return out[:count]


def pieces_of(moves, level):
    """(pieces (n, 7), asked (n,)) of the feeds that end at a level; those that come down to it are not asked for."""
    rows, asked = [], []
    for e in moves:
        if e.kind == "rapid" or abs(e.b[2] - level) > 1e-4:
            continue
        down = abs(e.a[2] - e.b[2]) > 1e-6
        if e.kind == "arc":
            rows.append((*e.a[:2], *e.b[:2], *e.centre, e.sweep[1]))
        elif math.dist(e.a[:2], e.b[:2]) > 0.0:
            rows.append((*e.a[:2], *e.b[:2], 0.0, 0.0, 0.0))
        else:
            continue
        asked.append(not down)
    return np.array(rows).reshape(-1, 7), np.array(asked, bool)


@dataclass
class Engagement:
    """rows as in exact(); shares are of the path at the feed at the level."""

    rows: np.ndarray

    @property
    def cutting(self):
        return self.rows[self.rows[:, 4] > AIR]

    def percentile(self, share):
        """Engagement that this share (0 to 1) of the path in stock does not exceed."""
        rows = self.cutting[np.argsort(self.cutting[:, 4])]
        return float(rows[min(len(rows) - 1, int(np.searchsorted(np.cumsum(rows[:, 5]), share * rows[:, 5].sum()))), 4])

    @property
    def most(self):
        return float(self.rows[:, 4].max())

    def length(self, above=-1.0):
        """mm with more engagement than that"""
        return float(self.rows[self.rows[:, 4] > above, 5].sum())


def engagement(moves, level, radius, spacing=0.1, without=()):
    """Engagement of the moves at a level; without: numbers of feeds at it that are not judged (an entry's last
    turn)."""
    pieces, asked = pieces_of(moves, level)
    asked[list(without)] = False
    return Engagement(exact(pieces, asked, radius, spacing))
