# SPDX-License-Identifier: GPL-2.0-or-later
"""How often G77 with several radial passes comes from above, beside the least by tests/support/contour_passes_judge.py:
closed random contours, three passes, depths of 6 mm.

    /usr/bin/python3 bench/contour_lifts.py [--first 45000] [--count 100]
"""

import argparse
import math
from dataclasses import replace

import numpy as np
import shapely.geometry as geometry

from roots import ROOT  # noqa: F401  the path to chipwise
from support import contour_passes_judge as judge
from support.contour_cycle_judge import random_request
from support.contour_oracle import from_elements, point
from support.hole_oracle import walk
from chipwise.cycles.contour import contour_plan, radial_distances
from chipwise.errors import CycleError
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import make_contour


def counted(seed):
    """(descents, the least) of a closed contour; None for others."""
    asked = random_request(seed)
    contour = make_contour(list(asked.shape))
    if not contour.closed:
        return None
    asked = replace(asked, passes=3, step=0.8 * asked.tool_radius, finish=False, depth_step=6.0, approach=None)
    try:
        plan = contour_plan(asked)
    except CycleError:
        return None
    outline = geometry.Polygon(
        np.concatenate([point(view, np.linspace(0.0, 1.0, 50)[:-1]) for view in from_elements(contour.elements)])
    ).buffer(0)
    inside = (elements.area(contour.elements) > 0.0) == (asked.side == 41)
    levels = math.ceil((asked.clearance - asked.bottom) / asked.depth_step - 1e-6)
    return (
        judge.lifts(walk(plan.moves, asked.start)) + 1,
        judge.entries(outline, inside, radial_distances(asked), levels),
        seed,
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=45000)
    parser.add_argument("--count", type=int, default=100)
    args = parser.parse_args()
    found = [one for seed in range(args.first, args.first + args.count) if (one := counted(seed))]
    more = [one for one in found if one[0] > one[1]]
    print(
        f"{len(found)} closed contours of {args.count}: {sum(one[0] for one in found)} descents, least "
        f"{sum(one[1] for one in found)}; more than the least in {len(more)} contours: {more}"
    )


if __name__ == "__main__":
    main()
