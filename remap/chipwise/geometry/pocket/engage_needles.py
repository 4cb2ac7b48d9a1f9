# SPDX-License-Identifier: GPL-2.0-or-later
"""Needles that paths of constant engagement leave between them: run over, one after the other.

Called by engage.py.  Lengths mm.  A needle is narrower than the spacing of the places at which stock is looked for, so
no path starts there.  The tool goes over cleared ground to near it, straight to the place of its centre that is nearest
to the needle, and back.
"""

import math

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import make_lines
from chipwise.geometry.pocket import engage_links as links
from chipwise.geometry.pocket.engage_proof import FINE_MM

MOST = 60

# A place of cleared ground to come from is not looked for further away, in tool radii.
AWAY = 2.0

# The place of the tool's centre is moved into the region by this. mm
INTO_MM = 1e-5


def clear(planner):
    """Segments over all needles that can be got at, added to a planner's; the certificate says what is left after
    that."""
    for _ in range(MOST):
        area, place = planner.ground.left(FINE_MM)
        if area <= 0.0 or not _over(planner, place):
            return


def _over(planner, place):
    """Over one needle; whether that was possible."""
    target = _centre(planner, place)
    planner.grid.refresh()
    grid = planner.grid
    near = grid.point[grid.cleared & (grid.depth >= 0.0)]
    gap = np.hypot(*(near - target).T)
    for k in np.argsort(gap, kind="stable"):
        if gap[k] > AWAY * planner.radius:
            return False
        line = make_lines(near[k][None], target[None])
        if gap[k] > 0.0 and links.inside(planner.ground, line) and planner.go_to(near[k], line):
            planner.cut(elements.join((line, elements.reverse(line))))
            return True
    return False


def _centre(planner, place):
    """Where the tool's centre may be, the nearest to a place."""
    if planner.ground.depth(place[None])[0] >= 0.0:
        return place
    best, least = place, math.inf
    for contour in planner.region.contours:
        gap = elements.distances(contour, np.arange(len(contour)), np.broadcast_to(place, (len(contour), 2)))
        k = int(np.argmin(gap))
        if gap[k] < least:
            best, least = _foot(contour, k, place), float(gap[k])
    toward = (best - place) / max(math.dist(best, place), 1e-12)
    into = best + INTO_MM * toward
    return into if planner.ground.depth(into[None])[0] >= 0.0 else best


def _foot(contour, k, place):
    """The place of an element nearest to a point, by thirds."""
    low, high = 0.0, 1.0
    for _ in range(60):
        t = np.array((low + (high - low) / 3.0, high - (high - low) / 3.0))
        a, b = np.hypot(*(elements.point_at(contour, np.array([k, k]), t) - place).T)
        low, high = (low, float(t[1])) if a <= b else (float(t[0]), high)
    ends = elements.point_at(contour, np.array([k, k, k]), np.array((0.0, 0.5 * (low + high), 1.0)))
    return ends[int(np.argmin(np.hypot(*(ends - place).T)))]
