# SPDX-License-Identifier: GPL-2.0-or-later
"""Sharp outer corners by choice: the rolling arc replaced by its two tangents.

Called by kernel.py.  A sharp corner leaves no dwell mark of the cutting edge on the
workpiece's corner.  Departure from common practice (which extends without asking): a
corner stays round where its tip would come nearer than the radius to any part of the
contour, or would meet another part of the path, or would lie further out than TIP tool radii.
"""

from dataclasses import replace

import numpy as np

from chipwise.geometry.base import elements, search
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.base.intersect import meetings
from chipwise.geometry.base.clearance import clear_lines
from chipwise.geometry.base.lines import cross, dot
from chipwise.geometry.offset.paths import Feet, PointContact
from chipwise.geometry.base.tolerances import ANGLE_RAD, COLLINEAR, CUSP_RAD, NODE_MM

# Longest distance from the corner to the tip of a sharp corner, in tool radii: turns up to
# 120 degrees become sharp.
TIP = 2.0


def sharpen(paths, clearance_check, side, radius):
    """Paths with rolling arcs replaced by tangents where that is safe."""
    return tuple(p if isinstance(p, PointContact) else _sharpened(p, clearance_check, side, radius) for p in paths)


def _tips(path, side, radius):
    """Indices (k,) of rolling arcs between tangent neighbours that may become sharp, and
    their tips (k, 2)."""
    e, feet, turn = path.elements, path.feet, path.elements.sweep
    every = np.arange(len(e))
    into, out = (elements.tangent_at(e, every, np.full(len(e), t)) for t in (0.0, 1.0))
    smooth = dot(into, np.roll(out, 1, axis=0)) > COLLINEAR
    corner = (
        (feet.t0 == 1.0)
        & (feet.t1 == 1.0)
        & e.is_arc
        & (side * turn > CUSP_RAD)
        & (np.abs(turn) <= 2.0 * np.arccos(1.0 / TIP) + ANGLE_RAD)
        & smooth
        & np.roll(smooth, -1)
    )
    index = np.flatnonzero(corner)
    reach = radius / np.cos(0.5 * turn[index])
    return index, e.centre[index] + e.middle[index] * reach[:, None]


def _safe(path, index, tip, clearance_check, radius):
    """Which tips (k,) bool keep clear of the contour and of the rest of the path."""
    e = path.elements
    ok = clear_lines(clearance_check, e.start[index], tip, radius)
    ok &= clear_lines(clearance_check, tip, e.end[index], radius)
    n, k = len(e), len(index)
    extended = elements.join((e, elements.make_lines(e.start[index], tip), elements.make_lines(tip, e.end[index])))
    a, b = search.pairs(search.build(*elements.boxes(extended)), NODE_MM)
    met = meetings(extended, elements.lengths(extended), a[b >= n], b[b >= n])
    for other, line, point in ((met.a, met.b, met.point), (met.b, met.a, met.point)):
        real = np.flatnonzero(line >= n)
        which, point, other = (line[real] - n) % k, point[real], other[real]
        own = (
            np.minimum(np.hypot(*(point - e.start[index[which]]).T), np.hypot(*(point - e.end[index[which]]).T))
            <= 2.0 * NODE_MM
        )
        sister = (other >= n) & ((other - n) % k == which)
        ok[which[~own & ~sister]] = False
    return ok


def _sharpened(path, clearance_check, side, radius):
    index, tip = _tips(path, side, radius)
    if not len(index):
        return path
    ok = _safe(path, index, tip, clearance_check, radius)
    index, tip = index[ok], tip[ok]
    if not len(index):
        return path
    e, feet, n = path.elements, path.feet, len(path.elements)
    rest = np.setdiff1d(np.arange(n), index)
    first, second = (elements.make_lines(a, b) for a, b in ((e.start[index], tip), (tip, e.end[index])))
    key = np.concatenate((2 * rest, 2 * index, 2 * index + 1))
    order = np.argsort(key)
    made = elements.take(elements.join((elements.take(e, rest), first, second)), order)
    old = key[order] // 2
    made, old = _merged(made, old, order < len(rest), path.closed)
    return replace(path, elements=made, feet=Feet(feet.finish[old], feet.t0[old], feet.t1[old]))


def _merged(e: Elements, old, along_finish, closed):
    """Elements with straight runs on one line joined; for each the `old` (n,) index of its
    first member that runs along the finish shape (n,) bool, or of its first at all."""
    tangent = elements.tangent_at(e, np.arange(len(e)), np.zeros(len(e)))
    before = np.roll(tangent, 1, axis=0)
    length = elements.lengths(e)
    bump = np.abs(cross(tangent, before)) * np.minimum(length, np.roll(length, 1))
    same = ~e.is_arc & ~np.roll(e.is_arc, 1) & (dot(tangent, before) > 0.0) & (bump <= NODE_MM)
    same[0] &= closed
    shift = int(np.flatnonzero(~same)[0])
    e, old = elements.take(e, np.roll(np.arange(len(e)), -shift)), np.roll(old, -shift)
    first = np.flatnonzero(~np.roll(same, -shift))
    last = np.append(first[1:], len(e)) - 1
    position = np.where(np.roll(along_finish, -shift), np.arange(len(e)), len(e))
    chosen = np.minimum.reduceat(position, first)
    kept = elements.take(e, first)
    return Elements(kept.start, e.end[last], kept.centre, kept.radius, kept.start_angle, kept.sweep), old[
        np.where(chosen < len(e), chosen, first)
    ]
