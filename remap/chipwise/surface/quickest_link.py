# SPDX-License-Identifier: GPL-2.0-or-later
"""The quickest safe link from the end of a cut to the start of the next one.

Called by cycles/surface_moves.py.  All lengths mm.
Source: the pick-feed abstract has the link over the clearance plane; this is the lower one of P1.

A link is straight traverses, and a last move at a feed into the start. It is always found straight up over the end, and
over all that is in between. Beside a cut the stock that has still to be cut keeps the tool up, and a few cells away
    from it does not, so these are tried as well:
    off the end     at a slant over a place aside: away from the stock beside and behind the cut, and first straight up,
                    if stock ahead asks for it
    into the start  at a slant from a place aside
The heights over such a lane are one of route.py. The link that takes the least time is used.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from chipwise.surface import route

ASIDE_CELLS = (
    2.2  # cells of the stock's map from a cut aside: Obstacles.lowest keeps off by 1.5, and from the cell's middle
)
ASIDE = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))  # across and along the cuts
PIECE, FIRST_PIECE = 1.0, 0.0625  # mm of a link for which one height is looked for, and at its ends
MOST_PIECES = 64
CHECKED = 0.25  # mm of a move off a cut for which one height is looked for
FROM, OFF = (1.0, 0.6), (1.0, 2.5)  # times as far aside: of a start, of an end
NEAR, GROWS = (
    0.5,
    0.25,
)  # of the relief, at the place aside of a start, and mm of it more for each mm away from there, up to all of it
KEPT = 0.5  # of the relief, where corners are rounded
CORNER_S = 0.002  # s, for each corner: of two links that are as quick the simpler one


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
    low, high  (2,) mm: the rectangle that the tool's centre stays over
    """

    relief: float
    clearance: float
    blend: float
    side: tuple
    step: float
    feed: float
    plunge: float
    rate: float
    low: tuple
    high: tuple

    def inside(self, places):
        """Those of places (n, 2) that are in the rectangle."""
        return places[
            ((places >= np.array(self.low) - route.SAME) & (places <= np.array(self.high) + route.SAME)).all(axis=1)
        ]


def quickest_link(obstacles, end, start, terms):
    """Points (k, 3) from the end (3,) of a cut to the start (3,) of the next, and how far their corners may be rounded
    (mm).

    The last move is at lead_in(), the others are traverses."""
    enter = _entry(obstacles, start, terms)
    over_end = _over(obstacles, end[None, :2], end, terms)[0]
    if math.dist(end[:2], enter[:2]) < route.SAME:
        return np.array([end, (*end[:2], max(over_end[2], enter[2])), enter, start]), 0.0
    over = _over_all(obstacles, end, over_end[2], enter, terms)
    lanes = [over, *(_off(obstacles, end, leave, enter, terms) for leave in _asides(obstacles, end, enter, terms))]
    found = [
        (seconds + CORNER_S * len(points), k, points)
        for k, lane in enumerate(lanes)
        for seconds, points in lane.routes()
    ]
    for _seconds, k, points in sorted(found, key=lambda one: one[0]):
        chain = lanes[k].chain(points) if lanes[k] is over else _level_off(lanes[k].chain(points), lanes[k].places[1])
        if lanes[k] is over or _is_clear(obstacles, chain, lanes[k].places[1], terms.blend):
            return np.vstack([chain, start]), terms.blend
    return np.vstack([over.chain(over.level()), start]), 0.0


def lead_in(above, start, terms):
    """The feed from a point down to the start of a cut, whose part straight down is at most the plunge feed, and its
    time (s)."""
    length, depth = math.dist(above, start), above[2] - start[2]
    feed = min(max(terms.feed, terms.plunge), terms.plunge * length / depth) if depth > 0 else terms.feed
    speed = feed * terms.rate
    return feed, length / speed + speed / route.ACCEL


def _over(obstacles, places, point, terms):
    """The points (n, 3) over places (n, 2) that are the relief above a point, and above all that is there."""
    height = np.maximum(obstacles.lowest_at(places), point[2]) + terms.relief
    return np.column_stack([places, np.minimum(height, terms.clearance)])


def _places(obstacles, point, terms):
    """Places (n, 2) aside of the start of a cut, where the cut before has been or further away."""
    aside = ASIDE_CELLS * obstacles.stock.cell
    across, along = np.array(terms.side), np.array((terms.side[1], -terms.side[0]))
    return terms.inside(
        np.array(
            [
                point[:2] + a * (scale * aside + terms.step) * across + b * scale * aside * along
                for scale in FROM
                for a, b in ASIDE
            ]
        )
    )


def _entry(obstacles, start, terms):
    """The point (3,) from which the tool goes in: the one aside with the quickest clear lead-in, else the relief above
    the start."""
    over = _over(obstacles, start[None, :2], start, terms)[0]
    places = _places(obstacles, start, terms)
    if not len(places):
        return over
    height = np.minimum(
        np.maximum(obstacles.lowest_at(places) + NEAR * terms.relief, start[2] + terms.relief), terms.clearance
    )
    aside = sorted(
        (one for one in np.column_stack([places, height]) if one[2] < over[2] - route.SAME),
        key=lambda one: lead_in(one, start, terms)[1],
    )
    return next((one for one in aside if not obstacles.touches_model(one, start)), over)


def _asides(obstacles, end, enter, terms):
    """Places (2,) aside of the end of a cut: low, and towards the point (3,) where the link leads; one is further
    away."""
    places = terms.inside(end[:2] + ASIDE_CELLS * obstacles.stock.cell * np.array(ASIDE))
    if not len(places):
        return []
    k = int((obstacles.lowest_at(places) + np.hypot(*(places - enter[:2]).T)).argmin())
    found = terms.inside(np.array([end[:2] + scale * (places[k] - end[:2]) for scale in OFF]))
    return [leave for leave in found if math.dist(leave, enter[:2]) > route.SAME]


def _over_all(obstacles, end, height, enter, terms):
    """route.Lane straight up to a height over the end of a cut, and to a point."""
    at = _pieces(math.dist(enter[:2], end[:2]))
    ground = obstacles.lowest_along(_line(end, enter, at))
    limit = _hull(at, ground + _near(at, terms), height, enter[2], terms)
    lower = _hull(at, ground + KEPT * terms.relief, height - (1.0 - KEPT) * terms.relief, enter[2], terms)
    return route.Lane(
        np.array([end[:2], end[:2], enter[:2]]), 0.0, limit, lower, end[2], enter[2], terms.clearance, terms.blend
    )


def _off(obstacles, end, leave, enter, terms):
    """route.Lane off the end of a cut over a place aside to a point. The relief grows up to that place."""
    first, rest = math.dist(leave, end[:2]), math.dist(enter[:2], leave)
    ahead, beyond = _pieces(first), _pieces(rest)
    free = obstacles.lowest_along(_line(end, leave, ahead), end)
    at = np.concatenate([ahead[:-1], first + beyond])
    away = np.minimum(_ends(at) / first, 1.0)
    ground = np.hstack(
        [
            free + obstacles.ridge * away[:, : len(free)],
            np.tile(obstacles.lowest_along(_line(leave, enter, beyond)), (2, 1)),
        ]
    )
    up = max(0.0, free[ahead[1:] <= CHECKED].max() - end[2])
    limit = _hull(
        at, ground + np.minimum(terms.relief * away, _near(at, terms)), end[2] + 2.0 * up, enter[2], terms, off=True
    )
    lower = _hull(at, ground + KEPT * terms.relief * away, end[2] + up, enter[2], terms, off=True)
    return route.Lane(
        np.array([end[:2], leave, enter[:2]]), first, limit, lower, end[2], enter[2], terms.clearance, terms.blend
    )


def _hull(at, needs, start, end, terms, off=False):
    """Upper hull of a start, needs (2, n) between distances (n + 1,), which are no higher than the clearance plane, and
    an end; off: at the start the tool is clear."""
    start, needs = min(start, terms.clearance), np.broadcast_to(np.minimum(needs, terms.clearance), (2, len(at) - 1))
    return route.upper_hull(
        np.concatenate(
            [
                [(0.0, start)],
                np.column_stack([at[:-1], needs[0]])[int(off) :],
                np.column_stack([at[1:], needs[1]]),
                [(at[-1], end)],
            ]
        )
    )


def _line(start, end, at):
    """Places (n, 2) at distances (n,) from a point to another one."""
    return start[:2] + at[:, None] * ((end[:2] - start[:2]) / at[-1])


def _ends(at):
    """Where moves between distances (n + 1,) begin and end -> (2, n)."""
    return np.stack([at[:-1], at[1:]])


def _near(at, terms):
    """The relief (2, n) at the ends of moves between distances (n + 1,), which is less close to the last one."""
    return np.minimum(terms.relief, NEAR * terms.relief + GROWS * (at[-1] - _ends(at)))


def _pieces(length):
    """Distances (n,) at which a link is divided: close together at its ends, where it may be steep."""
    near = FIRST_PIECE * 2.0 ** np.arange(math.log2(PIECE / FIRST_PIECE) + 1)
    near = np.concatenate([[0.0], near[near < length / 2]])
    count = min(max(1, math.ceil((length - 2 * near[-1]) / PIECE)), MOST_PIECES)
    return np.concatenate([near[:-1], np.linspace(near[-1], length - near[-1], count + 1), length - near[-2::-1]])


def _level_off(chain, leave):
    """A route that goes nowhere down before it is over the place aside (2,): up to there stock is at its side, behind
    the end."""
    corner = int(np.hypot(*(chain[:, :2] - leave).T).argmin())
    chain[: corner + 1, 2] = np.maximum.accumulate(chain[: corner + 1, 2])
    return chain


def _is_clear(obstacles, chain, leave, blend):
    """Whether a route is clear off the end of a cut, up to a place aside (2,) and around its corner there, also where
    corners are cut off."""
    corner = int(np.hypot(*(chain[:, :2] - leave).T).argmin())
    return all(
        _is_off(obstacles, a, b, chain[0])
        for a, b in itertools.pairwise(route.cut_corners(chain, blend)[: 2 * corner + 1])
    )


def _is_off(obstacles, start, end, point):
    """Whether a straight move is clear of the model, and of all stock that is not behind the end of a cut."""
    if math.dist(start[:2], end[:2]) < route.SAME:
        return True  # straight up over the end
    places = np.linspace(start, end, 1 + math.ceil(math.dist(start[:2], end[:2]) / CHECKED))
    return not obstacles.touches_model(start, end) and all(
        min(a[2], b[2]) >= obstacles.lowest_ahead(a, b, point) - route.SAME for a, b in itertools.pairwise(places)
    )
