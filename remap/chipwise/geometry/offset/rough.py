# SPDX-License-Identifier: GPL-2.0-or-later
"""The rough shape: what a tool following the centre path leaves behind.

Called by kernel.py.  Source: JP H07-47256, Fig. 2 steps 14 and 15: the centre path offset
back by minus the radius.  Departure: at an inner corner of the path the patent extends
both neighbours to their intersection, beyond what the tool can cut and into the finish
shape (Fig. 6); here the tool's own edge, an arc of its radius, closes the corner.
Offsetting the rough shape by the radius gives the centre path again.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.base.tolerances import SOLID_MM
from chipwise.geometry.offset.touch import corner_arcs, segments


@dataclass(frozen=True, eq=False)
class RoughShape:
    """One connected edge that the tool leaves; elements run like the centre path."""

    elements: Elements
    closed: bool


def rough_shapes(finish, touch, paths, side, radius):
    """One RoughShape per path, in the same order."""
    if not len(paths):
        return []
    solid = np.flatnonzero((touch.t1 - touch.t0) * finish.length[touch.finish] > SOLID_MM)
    corner = np.flatnonzero(touch.corner)
    along = segments(finish, touch.finish[solid], touch.t0[solid], touch.t1[solid])
    edge = corner_arcs(finish, touch, corner, side, radius)
    key = np.concatenate((2 * solid, 2 * corner + 1))
    order = np.argsort(key)
    path = touch.path[key[order] // 2]
    everything = elements.join((along, edge))
    made = [elements.take(everything, order[path == k]) for k in range(len(paths))]
    return [RoughShape(_watertight(e, path.closed), path.closed) for e, path in zip(made, paths)]


def _watertight(e, closed):
    """Elements with every start moved onto the end before it (about 1e-6 mm)."""
    start = np.roll(e.end, 1, axis=0)
    if not closed and len(e):
        start[0] = e.start[0]
    return Elements(start, e.end, e.centre, e.radius, e.start_angle, e.sweep)
