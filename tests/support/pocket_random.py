# SPDX-License-Identifier: GPL-2.0-or-later
"""Seeded random pockets for tests and benches: a boundary and 0 to 5 islands, as parts.

Three kinds: islands apart; islands anywhere, so that they touch, overlap, cross the wall, hold one another or lie
outside; and rectangles on whole millimetres, whose edges often lie on one another.
"""

import math

import numpy as np

from support import contour_oracle as contour
from chipwise.geometry.base.contour import ArcElement, LineElement
from support.contour_random import bulged, filleted, simple
from support.pocket_oracle import shape_of

KINDS = ("apart", "anywhere", "grid")


def moved(parts, by):
    """Parts shifted by (x, y)."""

    def at(p):
        return (float(p[0] + by[0]), float(p[1] + by[1]))

    return tuple(
        ArcElement(at(q.start), at(q.end), at(q.centre), q.ccw, q.line)
        if isinstance(q, ArcElement)
        else LineElement(at(q.start), at(q.end), q.line)
        for q in parts
    )


def rectangle(x0, y0, x1, y1):
    """Parts of a rectangle."""
    p = [(float(x), float(y)) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
    return tuple(LineElement(p[k], p[(k + 1) % 4], k + 1) for k in range(4))


def circle(radius, centre, ccw=True):
    """Parts of a full circle."""
    p = (float(centre[0] + radius), float(centre[1]))
    return (ArcElement(p, p, (float(centre[0]), float(centre[1])), ccw, 1),)


def _outline(rng, **kind):
    while True:
        parts = filleted(rng, **kind)[0] if rng.random() < 0.5 else bulged(rng, **kind)
        if simple(parts, 1e-3 * kind.get("size", 30.0)):
            return parts


def _grid(rng, islands):
    w, h = rng.integers(12, 50, 2)
    loops = [rectangle(0, 0, w, h)]
    for _ in range(islands):
        x, y = rng.integers(-2, w), rng.integers(-2, h)
        loops.append(rectangle(x, y, x + rng.integers(2, 15), y + rng.integers(2, 15)))
    return loops


def _apart(loops, island):
    """Whether an island stands free of every loop, inside the first."""
    shape = shape_of(island)
    p = contour.samples(shape, 0.3)
    if not (contour.winding(shape_of(loops[0]), p) != 0).all():
        return False
    return all(contour.nearest(shape_of(loop), p).min() > 0.05 for loop in loops) and all(
        (contour.winding(shape_of(loop), p) == 0).all() for loop in loops[1:]
    )


def random_pocket(seed):
    """(kind, loops of parts, the boundary first)."""
    rng = np.random.default_rng([seed, 5])
    kind, islands = KINDS[seed % 3], int(rng.integers(0, 6))
    if kind == "grid":
        return kind, tuple(_grid(rng, islands))
    loops = [moved(_outline(rng), (0, 0))]
    for _ in range(40):
        if len(loops) > islands:
            break
        size = math.exp(rng.uniform(math.log(1.5), math.log(9.0)))
        shape = circle(size, (0, 0), rng.random() < 0.5) if rng.random() < 0.3 else _outline(rng, size=size, most=7)
        island = moved(shape, rng.uniform(-22, 22, 2))
        if kind == "anywhere" or _apart(loops, island):
            loops.append(island)
    return kind, tuple(loops)
