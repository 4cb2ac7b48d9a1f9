# SPDX-License-Identifier: GPL-2.0-or-later
"""Lifts within a level of P0 to P3 of G79, and how often a row or ring ends square on a finished wall.

    /usr/bin/python3 bench/pocket_lifts.py [--first 45000] [--count 40] [--strategies 0,1,2,3]

Lifts: random pockets, D of at most the tool radius; a lift more is one to a start that is cleared, so that no entry
needs it.  Square: the nine pockets of tests/support/engagement_shapes.py, tool 6 mm, D 2.4; at more than 45 degrees, on
Tracks before those that run the wall; medians.
"""

import argparse
import math
from dataclasses import replace

import numpy as np

from roots import ROOT  # noqa: F401  the path to chipwise
from support.engagement_shapes import SHAPES
from support.pocket_judge import random_request
from chipwise.cycles import pocket as cycle
from chipwise.errors import CycleError
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.pocket import links, nesting
from chipwise.geometry.pocket.machinable import split
from chipwise.geometry.pocket.strategies import NAMES, STRATEGIES
from chipwise.geometry.pocket.wall_arcs import Walls

RADIUS, STEP, CLEARANCE, FEED, ON_MM = 3.0, 2.4, 0.2, 25.0, 1e-3
SQUARE = math.sin(math.radians(45.0))


def regions(request):
    for boundary, islands in nesting.nested(request.loops, request.close_gap).pockets:
        yield from split(boundary, islands, request.tool_radius + request.side_allowance)


def lifts(strategy, first, count):
    """(regions, entries into stock, lifts more, pockets with such) of random pockets."""
    found = np.zeros(4, int)
    for seed in range(first, first + count):
        asked = random_request(seed, strategy)
        asked, more = replace(asked, climb=True, step=min(asked.step, asked.tool_radius)), 0
        for region in regions(asked):
            try:
                tracks = cycle.region_tracks(region, asked)
            except CycleError:
                continue
            known = links.known_starts(tracks)
            routes = links.linked(region, tracks, asked.tool_radius, CLEARANCE, FEED)
            more += sum(is_known and route is None for is_known, route in zip(known, routes))
            found += (1, known.count(False), 0, 0)
        found += (0, 0, more, more > 0)
    return found.tolist()


def square_ends(strategy, loops):
    """How many elements of the Tracks of a pocket end square on a wall."""
    contours, count = [make_contour(parts) for parts in loops], 0
    for region in split(contours[0], contours[1:], RADIUS):
        wall = elements.join(region.contours)
        for track in STRATEGIES[strategy](region, RADIUS, STEP, 0.0, True, Walls(region, RADIUS, True, 0.3)):
            if not track.wall:
                count += sum(_is_square(wall, track.elements, k) for k in range(len(track.elements)))
    return count


def _is_square(wall, chain, k):
    place = chain.end[k][None]
    gap = elements.distances(wall, np.arange(len(wall)), np.broadcast_to(place, (len(wall), 2)))
    near = np.array([np.argmin(gap)])
    if gap[near[0]] > ON_MM:
        return False
    (u, v), (x, y) = (
        elements.tangent_at(e, index, t)[0]
        for e, index, t in ((chain, np.array([k]), np.ones(1)), (wall, near, elements.parameters(wall, near, place)))
    )
    return bool(abs(u * y - v * x) > SQUARE)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=45000)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--strategies", default=",".join(map(str, sorted(NAMES))))
    args = parser.parse_args()
    for strategy in map(int, args.strategies.split(",")):
        square = [square_ends(strategy, loops) for loops in SHAPES.values()]
        several, entries, more, pockets = lifts(strategy, args.first, args.count)
        print(
            f"P{strategy}: {args.count} pockets, {several} regions, {entries} entries into stock, {more} lifts more, "
            f"in {pockets} pockets; square on finished walls: {np.median(square):.0f}, {min(square)} to {max(square)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
