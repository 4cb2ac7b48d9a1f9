# SPDX-License-Identifier: GPL-2.0-or-later
"""Random pockets whose islands all stand apart, for the geometry's tests and bench/pocket_engagement.py."""

import math

import numpy as np

from chipwise.geometry.base.contour import ArcElement, LineElement, make_contour
from support.contour_oracle import from_elements, nearest, point, winding
from support.contour_random import bulged, filleted, simple


def random_islands(seed):
    """(loops of parts: boundary first, distance)."""
    rng = np.random.default_rng([seed, 4])
    while True:
        parts = filleted(rng)[0] if rng.random() < 0.5 else bulged(rng)
        if simple(parts):
            break
    shape = from_elements(make_contour(parts).elements)
    loops, taken = [parts], shape
    for _ in range(12):
        size = math.exp(rng.uniform(math.log(1.0), math.log(8.0)))
        island = bulged(rng, size=size, most=7)
        island = shifted(island, rng.uniform(-20, 20, 2))
        if not simple(island, 1e-3 * size):
            continue
        made = from_elements(make_contour(island).elements)
        edge = np.concatenate([np.stack([np.array(el[1:3])]) for el in made])
        dense = np.concatenate([curve_points(el) for el in made])
        if (
            (winding(shape, edge) != 0).all()
            and nearest(taken, dense).min() > 0.05
            and all((winding(from_elements(make_contour(other).elements), edge) == 0).all() for other in loops[1:])
        ):
            loops.append(island)
            taken = taken + made
    return loops, math.exp(rng.uniform(math.log(0.2), math.log(6.0)))


def curve_points(el):
    return point(el, np.linspace(0.0, 1.0, 60))


def shifted(parts, by):
    def move(p):
        return (p[0] + by[0], p[1] + by[1])

    return [
        ArcElement(move(q.start), move(q.end), move(q.centre), q.ccw, q.line)
        if isinstance(q, ArcElement)
        else LineElement(move(q.start), move(q.end), q.line)
        for q in parts
    ]
