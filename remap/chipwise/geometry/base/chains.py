# SPDX-License-Identifier: GPL-2.0-or-later
"""Positions on a chain of elements, and runs cut and turned there.

Called by rings.py, rest_material.py and cycles/pocket.py.  A position is (element index, parameter).
"""

import math

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.base.intersect import parameters

# A position nearer than this to an end of its element is that end: no piece is ever shorter. mm
SNAP_MM = 1e-3


def rising(values):
    """Indices (n,) of lengths (n,) mm from the smallest up; equal within SNAP_MM in their order, so
    that rounding (an inch machine's tool table) does not turn choices over."""
    return np.argsort(np.round(np.asarray(values) / SNAP_MM), kind="stable")


def least(values):
    """Index of the smallest of lengths, mm, flattened; the first of several that are equal."""
    return int(np.argmin(np.round(np.asarray(values) / SNAP_MM)))


def nearest(chain, point):
    """(distance mm, index, t) of the position on a run nearest to a point (2,) mm."""
    index = np.arange(len(chain))
    at = np.broadcast_to(point, (len(chain), 2))
    gap = elements.distances(chain, index, at)
    k = least(gap)
    t = float(np.clip(parameters(chain, index[k : k + 1], at[k : k + 1])[0], 0.0, 1.0))
    if chain.is_arc[k]:  # beyond an end the nearer end, not the nearer angle
        ends = np.hypot(*(chain.start[k] - point)), np.hypot(*(chain.end[k] - point))
        if min(ends) <= gap[k]:
            t = 0.0 if ends[0] <= ends[1] else 1.0
    return float(gap[k]), k, t


def position_at(chain, along):
    """(index, t) of the position `along` mm from the start of a closed run, counted round."""
    length = elements.lengths(chain)
    upto = np.cumsum(length)
    along = along % upto[-1] if upto[-1] > 0.0 else 0.0
    k = min(int(np.searchsorted(upto, along, side="right")), len(chain) - 1)
    return k, float(np.clip(1.0 - (upto[k] - along) / max(length[k], 1e-300), 0.0, 1.0))


def station_of(chain, index, t):
    """mm from the start of a run to a position."""
    length = elements.lengths(chain)
    return float(np.sum(length[:index]) + t * length[index])


def point(chain, index, t):
    """(2,) mm"""
    return elements.point_at(chain, np.array([index]), np.array([t]))[0]


def heading(chain, index, t):
    """rad"""
    x, y = elements.tangent_at(chain, np.array([index]), np.array([t]))[0].tolist()
    return math.atan2(y, x)


def snapped(chain, index, t):
    """The position, or the end of its element where that is nearer than SNAP_MM."""
    length = elements.lengths(chain)[index]
    if t * length <= SNAP_MM:
        return index, 0.0
    if (1.0 - t) * length <= SNAP_MM:
        return (index + 1) % len(chain), 0.0
    return index, t


def segment(chain, index, t0, t1):
    """One element (as Elements) from t0 to t1 of element `index`."""
    pick = np.array([index])
    start = chain.start[pick] if t0 == 0.0 else elements.point_at(chain, pick, np.array([t0]))
    end = chain.end[pick] if t1 == 1.0 else elements.point_at(chain, pick, np.array([t1]))
    sweep = chain.sweep[pick] * (t1 - t0)
    return Elements(
        start, end, chain.centre[pick], chain.radius[pick], chain.start_angle[pick] + t0 * chain.sweep[pick], sweep
    )


def rotated(chain, index, t):
    """A closed run that starts and ends at a position."""
    index, t = snapped(chain, index, t)
    order = (np.arange(len(chain)) + index) % len(chain)
    if t == 0.0:
        return elements.take(chain, order)
    return elements.join(
        (segment(chain, index, t, 1.0), elements.take(chain, order[1:]), segment(chain, index, 0.0, t))
    )


def line(start, end):
    """One line (as Elements)."""
    return elements.make_lines(np.array(start, float).reshape(1, 2), np.array(end, float).reshape(1, 2))


def flat(chain, sagitta):
    """Points (m, 2) mm on a run, arcs in chords no further than `sagitta` mm from them."""
    half = np.arccos(np.clip(1.0 - sagitta / np.maximum(chain.radius, sagitta), 0.0, 1.0))
    count = np.where(chain.is_arc, np.ceil(np.abs(chain.sweep) / np.maximum(2.0 * half, 1e-9)), 1)
    count = np.clip(count, 1, 2000).astype(int)
    index = np.repeat(np.arange(len(chain)), count)
    step = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
    points = elements.point_at(chain, index, step / count[index])
    return np.concatenate((points, chain.end[-1:]))
