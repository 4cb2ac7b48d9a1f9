# SPDX-License-Identifier: GPL-2.0-or-later
"""The quickest safe link from the end of a cut to the start of the next one.

Called by cycles/surface_moves.py.  All lengths mm.
Source: the pick-feed abstract has the link over the clearance plane; this is the lower one of P1.

A link is straight traverses, and a last move at a feed into the start. It is always found over the ends themselves: straight up, over all
that is in between, straight down to the relief. Beside a cut the stock that has still to be cut keeps the tool up, and a few cells
away from it does not, so these are tried as well:
    off the end     up to a place aside: away from the stock beside and behind the cut, and first straight up, if stock ahead asks for it
    into the start  at a slant from a place aside
Between the two places the link is one of route.py. The one that takes the least time is used.
"""

import math
from dataclasses import dataclass

import numpy as np

from chipwise.surface import route

ASIDE_CELLS = 2.2           # cells of the stock's map from a cut aside: Obstacles.lowest keeps off by 1.5, and from the cell's middle
ASIDE = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))      # across and along the cuts
PIECE, FIRST_PIECE = 1.0, 0.0625    # mm of a link for which one height is looked for, and at its ends
MOST_PIECES = 64
CORNER_S = 0.002            # s, for each corner: of two links that are as quick the simpler one


@dataclass(frozen=True)
class Terms:
    """What a link has to keep.

    relief     mm above model and stock, but for the ends
    clearance  mm; no link is higher
    blend      mm; its corners are rounded by that
    side       (2,) unit vector across the cuts
    step       mm between them
    feed, plunge   of the lead-in: the most along it, and straight down
    rate       mm/s of a feed of 1
    """

    relief: float
    clearance: float
    blend: float
    side: tuple
    step: float
    feed: float
    plunge: float
    rate: float


def quickest_link(obstacles, end, start, terms):
    """Points (k, 3) from the end (3,) of a cut to the start (3,) of the next; the last move is at lead_in(), the others are traverses."""
    over_end, leave = _aside(obstacles, end, terms, 0.0)
    over_start, enter = _aside(obstacles, start, terms, terms.step)
    if enter is None or obstacles.touches_model(enter, start):
        enter = over_start
    found = [(np.vstack([end, one]), 0) for one in _between(obstacles, over_end, over_start, terms)]
    off = end[None] if leave is None else _off(obstacles, end, leave)
    for one in _between(obstacles, over_end if leave is None else leave, enter, terms):
        found.append((np.vstack([off, one]), 0 if leave is None else len(off)))
    found.sort(key=lambda one: _cost(one[0], start, terms))
    best = next(chain for chain, count in found if not count or _is_clear(obstacles, chain, count))
    return np.vstack([best, start])


def lead_in(above, start, terms):
    """The feed from a point down to the start of a cut, whose part straight down is at most the plunge feed, and its time (s)."""
    length, depth = math.dist(above, start), above[2] - start[2]
    feed = min(max(terms.feed, terms.plunge), terms.plunge * length / depth) if depth > 0 else terms.feed
    speed = feed * terms.rate
    return feed, length / speed + speed / route.ACCEL


def _cost(chain, start, terms):
    return route.seconds(chain, terms.blend) + lead_in(chain[-1], start, terms)[1] + CORNER_S * len(chain)


def _over(obstacles, places, point, terms):
    """The points (n, 3) over places (n, 2) that are the relief above a point, and above all that is there."""
    height = np.maximum(obstacles.lowest_at(places), point[2]) + terms.relief
    return np.column_stack([places, np.minimum(height, terms.clearance)])


def _aside(obstacles, point, terms, step):
    """The point (3,) the relief above one, and the lowest one aside of it if that is lower, or None; step: mm more across."""
    across = (ASIDE_CELLS * obstacles.stock.cell + step) * np.array(terms.side)
    along = ASIDE_CELLS * obstacles.stock.cell * np.array((terms.side[1], -terms.side[0]))
    over, *aside = _over(obstacles, np.array([point[:2] + a * across + b * along for a, b in ((0, 0), *ASIDE)]), point, terms)
    lowest = min(aside, key=lambda one: one[2])
    return over, lowest if lowest[2] < over[2] - route.SAME else None


def _off(obstacles, end, leave):
    """The points (k, 3) off the end of a cut before a place aside: so far straight up that its corner may be cut off."""
    up = 2.0 * (obstacles.lowest_ahead(end, leave, end) - end[2])
    return np.array([end, (*end[:2], end[2] + up)] if up > route.SAME else [end])


def _between(obstacles, leave, enter, terms):
    """[(k, 3)]: routes between two points."""
    length = math.dist(leave[:2], enter[:2])
    if length < route.SAME:
        return [np.array([leave, enter] if leave[2] > enter[2] + route.SAME else [enter])]
    at, step = _pieces(length), (enter[:2] - leave[:2]) / length
    needs = obstacles.lowest_along(leave[:2] + at[:, None] * step) + terms.relief
    return [np.column_stack([leave[:2] + one[:, :1] * step, one[:, 1]])
            for one in route.routes(at, needs, leave[2], enter[2], terms.clearance, terms.blend)]


def _pieces(length):
    """Distances (n,) at which a link is divided: close together at its ends, where it may be steep."""
    near = FIRST_PIECE * 2.0 ** np.arange(math.log2(PIECE / FIRST_PIECE) + 1)
    near = np.concatenate([[0.0], near[near < length / 2]])
    count = min(max(1, math.ceil((length - 2 * near[-1]) / PIECE)), MOST_PIECES)
    return np.concatenate([near[:-1], np.linspace(near[-1], length - near[-1], count + 1), length - near[-2::-1]])


def _is_clear(obstacles, chain, aside):
    """Whether the moves off a cut are clear: the move aside, which leads to chain[aside], and where its corners are cut off."""
    step = np.diff(chain[:aside + 2], axis=0)
    length = np.linalg.norm(step, axis=1)
    moves = [(chain[aside - 1], chain[aside])]
    for k in range(1, len(step)):
        half = min(length[k - 1:k + 1]) / 2
        moves.append((chain[k] - half * step[k - 1] / length[k - 1], chain[k] + half * step[k] / length[k]))
    return all(min(a[2], b[2]) >= obstacles.lowest_ahead(a, b, chain[0]) - route.SAME and not obstacles.touches_model(a, b) for a, b in moves)
