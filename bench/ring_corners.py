# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the rings of P0 work the tool hard, and what loops in their corners would cost; the nine pockets of
bench_engagement.py, by its judge.

    /usr/bin/python3 bench/ring_corners.py

A corner: the path turns left by more than 45 degrees; what lies within a tool radius of one is the corner's.  A loop: a
circle of half a tool radius, the least that rounds a corner of a ring.
"""

import math

import numpy as np

from roots import ROOT  # noqa: F401  the path to chipwise
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.pocket.engage_ground import rows_of
from chipwise.geometry.pocket.machinable import split
from chipwise.geometry.pocket.rings import contour_parallel
from support import engagement_judge
from support.engagement_shapes import SHAPES

RADIUS, STEP = 3.0, 2.4
TURN, LOOP = 45.0, 0.5
ABOVE = 1.1  # times nominal


def corners(chain):
    """(n, 2) places where a chain turns left by more than TURN degrees."""
    count = len(chain)
    out, onto = (elements.tangent_at(chain, np.arange(count), np.full(count, t)) for t in (1.0, 0.0))
    out, onto = out[:-1], onto[1:]
    turn = np.degrees(np.arctan2(out[:, 0] * onto[:, 1] - out[:, 1] * onto[:, 0], (out * onto).sum(axis=1)))
    joined = np.hypot(*(chain.end[:-1] - chain.start[1:]).T) < 1e-6
    return chain.end[:-1][joined & (turn > TURN)]


def figures(loops):
    """(mm of the path, in stock, full slot, of that in corners, above ABOVE times nominal in corners, number of
    corners)."""
    contours, found = [make_contour(parts) for parts in loops], np.zeros(6)
    for region in split(contours[0], contours[1:], RADIUS):
        chain = elements.join([track.elements for track in contour_parallel(region, RADIUS, STEP, 0.0, True)])
        at = corners(chain)
        rows = engagement_judge.exact(rows_of(chain), np.ones(len(chain), bool), RADIUS)
        near = (np.hypot(*(rows[:, None, 1:3] - at[None]).transpose(2, 0, 1)) < RADIUS).any(axis=1)
        full, above = rows[:, 4] > engagement_judge.FULL, rows[:, 4] > ABOVE * math.acos(1.0 - STEP / RADIUS)
        found += (
            float(elements.lengths(chain).sum()),
            *(rows[which, 5].sum() for which in (rows[:, 4] > engagement_judge.AIR, full, full & near, above & near)),
            len(at),
        )
    return found


def main():
    shares = []
    for name, loops in SHAPES.items():
        path, stock, full, there, above, count = figures(loops)
        more = count * 2.0 * math.pi * LOOP * RADIUS
        shares.append((full / stock, there / full, above / stock, more / path))
        print(
            f"{name}: path {path:.0f} mm, full slot {full:.0f} mm, of that {there:.0f} mm in {count:.0f} corners; "
            f"loops would add {more:.0f} mm"
        )
    print(
        "medians: full slot %.1f %% of the path in stock, %.0f %% of it in corners; above nominal in corners %.0f %%; "
        "loops would add %.0f %% of the path" % tuple(100.0 * np.median(np.array(shares), axis=0))
    )


if __name__ == "__main__":
    main()
