# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock that a path alone makes likely, by walking it in small steps.  Called by tests/assumed; knows nothing of
check/survey.py."""

import math

STEP = 0.01  # mm


def stock_of(moves):
    """moves: [(is a feed, (x, y, z), diameter)], the first from an unknown place -> (low, high) or None without a
    depth."""
    places, at = [], None
    heights, across, highest = [], [], -math.inf
    for feeds, place, diameter in moves:
        if at is not None:
            highest = max(highest, at[2], place[2])
            if feeds:
                length = math.dist(at, place)
                count = max(1, math.ceil(length / STEP))
                places += [
                    (tuple(a + (b - a) * k / count for a, b in zip(at, place)), diameter) for k in range(count + 1)
                ]
                heights += [at[2], place[2]]
                if math.dist(at[:2], place[:2]) > 1e-4:
                    across += [at[2], place[2]]
        at = place
    if not heights:
        return None
    bottom = min(heights)
    top = 0.0 if bottom < 0 < highest else max(across, default=bottom)
    inside = [(p, d / 2) for p, d in places if p[2] < top - 1e-6]
    if not inside or top - bottom < 0.01:
        return None
    return (
        (min(p[0] - r for p, r in inside), min(p[1] - r for p, r in inside), bottom),
        (max(p[0] + r for p, r in inside), max(p[1] + r for p, r in inside), top),
    )
