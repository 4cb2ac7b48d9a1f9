# SPDX-License-Identifier: GPL-2.0-or-later
"""On which side of closed contours a point lies.

Called by kernel.py for the rare points that no path runs through, and by inaccessible.py.
"""

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.base.lines import cross, dot


# Pieces taken at once: bounds the memory, a matter of speed only.
CHUNK = 256


def numbers(e: Elements, point):
    """Winding number (m,) int of closed runs about points (m, 2) mm off the contour.

    The chords' turns add up to that of the polygon; a point between an arc and its chord
    is on the other side of the arc than of the chord, which is one whole turn.
    """
    parts = _short_arcs(e)
    total = np.zeros(len(point))
    for first in range(0, len(parts), CHUNK):
        total += _turns(parts, np.arange(first, min(first + CHUNK, len(parts))), point)
    return np.round(total / (2.0 * np.pi)).astype(int)


def _turns(parts, index, point):
    """Angle (m,) rad by which pieces index (k,) turn about points (m, 2)."""
    start, end = parts.start[index, None], parts.end[index, None]
    a, b = start - point, end - point
    side = cross(a, b)
    turn = np.arctan2(side, dot(a, b))
    arc = np.flatnonzero(parts.is_arc[index])
    if len(arc):
        out = point - parts.centre[index[arc], None]
        bend = np.sign(parts.sweep[index[arc]])[:, None]
        within = dot(out, out) < parts.radius[index[arc], None] ** 2
        turn[arc] += np.where((side[arc] * bend < 0.0) & within, 2.0 * np.pi * bend, 0.0)
    return turn.sum(axis=0)


def _short_arcs(e):
    """The run with every arc in four, so that none is longer than a quarter turn."""
    cut = np.where(e.is_arc, 4, 1)
    index = np.repeat(np.arange(len(e)), cut)
    step = np.arange(len(index)) - np.repeat(np.cumsum(cut) - cut, cut)
    t0, t1 = step / cut[index], (step + 1) / cut[index]
    start, end = elements.point_at(e, index, t0), elements.point_at(e, index, t1)
    start[step == 0], end[step == cut[index] - 1] = e.start, e.end
    return Elements(
        start,
        end,
        e.centre[index],
        e.radius[index],
        e.start_angle[index] + t0 * e.sweep[index],
        e.sweep[index] / cut[index],
    )
