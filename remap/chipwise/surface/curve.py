# SPDX-License-Identifier: GPL-2.0-or-later
"""Cuts of lines and arcs: as points on them for the stock, and as moves.

Called by raster.py, needed.py and cycles/surface_moves.py.  All lengths mm.
A cut is in a vertical plane.  Its arcs become moves of G18 or G19, so only cuts along X or Y have them.
"""

import math
from dataclasses import dataclass

import numpy as np

from chipwise.moves import Line, PlaneArc
from chipwise.clib import layout

LEAST_ARC = 0.1  # mm: what is left of an arc by a shorter chord becomes lines
AXIS_EXACT = 1e-9  # of a unit vector along an axis


@dataclass(frozen=True)
class Curve:
    """points (k, 3); centre (k, 3): of the arc that leads to each point, NaN where a line does.  An arc is several
    points, less than `sag` of raster.py from it by their chords."""

    points: np.ndarray
    centre: np.ndarray

    @classmethod
    def straight(cls, points):
        """Lines alone."""
        return cls(points, np.full(np.shape(points), np.nan))

    @property
    def moves(self):
        """How many moves it needs, nearly."""
        is_arc = np.isfinite(self.centre[1:, 0])
        same = (self.centre[1:-1] == self.centre[2:]).all(axis=1)
        return int(len(is_arc) - np.count_nonzero(same & is_arc[1:]))


def may_have_arcs(direction):
    """Which directions (n, 2) of cuts are along X or Y -> (n,) bool."""
    return np.abs(direction).max(axis=1) > 1.0 - AXIS_EXACT


# ---- in the plane of a cut: station and height ---------------------------------------------------------------------


def divided(s, z, arc, sag, outside=False):
    """Points on edges from (s[k], z[k]) to the next, so close on arcs that a chord is at most `sag` off in height.

    s, z     (k,) of one or more chains, one after the other
    arc      (k - 1, 3): centre and radius of each edge as chip_chain_fit has them
    outside  of arcs whose centre is above, the points where tangents meet instead of those between the ends: they are
             below the arc
    -> (edge (n,), s (n,), z (n,)): the points after the start of each edge, the end of the edge last
    """
    is_arc = arc[:, 2] > layout.CHAIN_LINE
    radius = np.where(is_arc, np.abs(arc[:, 2]), 1.0)
    first, last = (np.arctan2(z[k] - arc[:, 1], s[k] - arc[:, 0]) for k in (slice(None, -1), slice(1, None)))
    sweep = (last - first + np.pi) % (2 * np.pi) - np.pi
    level = np.minimum(np.abs(z[:-1] - arc[:, 1]), np.abs(z[1:] - arc[:, 1])) / radius  # cosine of the steepest slope
    half = np.arccos(1.0 - np.minimum(sag * level / radius, 1.0))
    count = np.where(is_arc, np.maximum(np.ceil(np.abs(sweep) / np.maximum(2 * half, 1e-6)), 1), 1).astype(int)
    tangents = is_arc & (arc[:, 2] < 0) & outside
    number = count + tangents
    edge = np.repeat(np.arange(len(count)), number)
    at = np.arange(len(edge)) - np.repeat(np.cumsum(number) - number, number) + 1.0
    angle = first[edge] + sweep[edge] * (at - 0.5 * tangents[edge]) / count[edge]
    far = radius[edge] / np.where(tangents[edge], np.cos(0.5 * sweep[edge] / count[edge]), 1.0)
    is_end = at == number[edge]
    return (
        edge,
        np.where(is_end, s[edge + 1], arc[edge, 0] + far * np.cos(angle)),
        np.where(is_end, z[edge + 1], arc[edge, 1] + far * np.sin(angle)),
    )


def placed(start, direction, s, z, arc, sag):
    """The Curve of stations and heights (k,) over a track from start (2,) in a direction (2,); arc (k, 3): of the edge
    to each point."""
    edge, more_s, more_z = divided(s, z, arc[1:], sag)
    centre = np.where((arc[1:, 2] > layout.CHAIN_LINE)[:, None], arc[1:, :2], np.nan)[edge]
    points = [
        np.column_stack([start + far[:, None] * direction, height])
        for far, height in ((np.append(s[:1], more_s), np.append(z[:1], more_z)), (centre[:, 0], centre[:, 1]))
    ]
    return Curve(points[0], np.concatenate([np.full((1, 3), np.nan), points[1]]))


# ---- parts of a Curve ----------------------------------------------------------------------------------------------


def on_arcs(points, centre, radius):
    """Points (n, 3) of chords moved onto their arcs, away from the centre (n, 3); those with a centre of NaN stay."""
    off = points - centre
    length = np.linalg.norm(off, axis=1)
    scale = np.where(np.isfinite(length) & (length > 0.0), radius / np.maximum(length, 1e-12), 1.0)
    return np.where(np.isfinite(length)[:, None], centre + off * scale[:, None], points)


# ---- moves ---------------------------------------------------------------------------------------------------------


def moves_of(curve, feed):
    """The Lines and PlaneArcs along a Curve, from its first point on."""
    points, centre, found, k = curve.points.tolist(), curve.centre.tolist(), [], 1
    while k < len(points):
        middle, last = centre[k], k
        while last + 1 < len(points) and centre[last + 1] == middle:  # NaN is not equal to itself
            last += 1
        if math.isfinite(middle[0]) and math.dist(points[k - 1], points[last]) >= LEAST_ARC:
            found.append(_arc(points[k - 1], points[last], middle, feed))
        else:
            found += [Line(x=x, y=y, z=z, feed=feed) for x, y, z in points[k : last + 1]]
        k = last + 1
    return found


def _arc(start, end, middle, feed):
    """Of less than half a turn.  Counter-clockwise in G18 is from Z to X, in G19 from Y to Z."""
    axis = 0 if abs(end[0] - start[0]) >= abs(end[1] - start[1]) else 1
    a, b, c, d = start[axis] - middle[axis], start[2] - middle[2], end[axis] - middle[axis], end[2] - middle[2]
    turn = a * d - b * c if axis else b * c - a * d
    return PlaneArc("G19" if axis else "G18", tuple(end), tuple(middle), turn > 0.0, feed)
