# SPDX-License-Identifier: GPL-2.0-or-later
"""Path elements of a few nanometres: rolled corners absorbed, shortest arcs made straight.

Called by paths.py.  Arcs that a post-processor rounds leave every tangent point with a corner
of some 1e-5 rad, and the tool would roll about each: an element of a few nanometres.  Such
an arc goes, and both neighbours are extended to where their tangents meet.  That point lies
gap^2 / (8 radius) further from the corner, never nearer, and as little off the circle of
a neighbouring arc; both stay below SLIGHT_CORNER_MM.
"""

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.base.lines import cross, dot
from chipwise.geometry.base.tolerances import SLIGHT_CORNER_MM, SHORT_ARC_MM


def absorbed(e: Elements, rolling, closed):
    """(elements, kept (m,) int): the run without rolling arcs (n,) bool that are corners."""
    count = len(e)
    before, after = np.arange(count) - 1, (np.arange(count) + 1) % count
    bend = np.where(e.is_arc, e.radius, np.inf)
    tightest = np.minimum(np.minimum(bend, bend[before]), bend[after])
    slight = rolling & (elements.lengths(e) <= np.sqrt(8.0 * SLIGHT_CORNER_MM * tightest))
    slight &= ~(rolling[before] | rolling[after])
    if not closed and count:
        slight[[0, -1]] = False
    gone = np.flatnonzero(slight)
    if not len(gone) or count < 3:
        return e, np.arange(count)
    tip = e.centre[gone] + e.middle[gone] * (e.radius[gone] / e.cos_half[gone])[:, None]
    start, end = e.start.copy(), e.end.copy()
    end[before[gone]] = tip
    start[after[gone]] = tip
    kept = np.flatnonzero(~slight)
    return _moved_ends(elements.take(e, kept), start[kept], end[kept]), kept


def straightened(e: Elements):
    """Elements with arcs shorter than SHORT_ARC_MM as lines: printed with six decimals, an
    arc whose ends round to one point would be read as a full circle."""
    short = e.is_arc & (elements.lengths(e) < SHORT_ARC_MM)
    if not short.any():
        return e
    return Elements(
        e.start,
        e.end,
        np.where(short[:, None], 0.0, e.centre),
        np.where(short, 0.0, e.radius),
        np.where(short, 0.0, e.start_angle),
        np.where(short, 0.0, e.sweep),
    )


def _moved_ends(e, start, end):
    """Elements with their ends moved a little along themselves."""
    first, last = _angle(e.centre, e.start, start), _angle(e.centre, e.end, end)
    angle = e.start_angle + np.where(e.is_arc, first, 0.0)
    return Elements(start, end, e.centre, e.radius, angle, e.sweep + np.where(e.is_arc, last - first, 0.0))


def _angle(centre, old, new):
    """Small angle (n,) rad from old to new points about centres."""
    a, b = old - centre, new - centre
    return np.arctan2(cross(a, b), dot(a, b))
