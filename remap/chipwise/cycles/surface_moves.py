# SPDX-License-Identifier: GPL-2.0-or-later
"""The moves of a surface: cuts, the links between them, and the entry into full stock.

Called by surface.py; mm.
Source: the pick-feed abstract.  From the end Pe of a cut the tool goes up by the tool relief to Pa, to the foot Pb of
Pa on the clearance plane, to the foot Pc of Pd on it, and to Pd, the tool relief above the start Ps of the next cut;
then to Ps.  Departs from it: Pa and Pd are not above the clearance plane; Pd is above the stock as it has been cut so
far, if that is higher.  Into full stock of a level the tool goes by ramps over the beginning of the cut, the last of
them back to Ps.
"""

import math
from dataclasses import dataclass

import numpy as np

from chipwise.cycles.mover import Mover
from chipwise.cycles.word_checks import EQUAL
from chipwise.moves import Blend, Line, Rapid
from chipwise.surface import raster
from chipwise.surface.curve import Curve, moves_of
from chipwise.surface.needed import BRIDGE, clipped
from chipwise.surface.quickest_link import Terms, quickest_link, lead_in
from chipwise.surface.raster import direction_of

PICK_FEED, LOWEST, ZIGZAG = 0, 1, 2
BLEND, BLEND_CELLS = (
    0.7,
    4.0,
)  # the corners of a link are rounded by so much of the relief, at most by so many cells of the stock's map
MINUTE, TURNS = 1 / 60, 10.0  # mm/s of a feed of 1: a minute, and a revolution at 600 1/min
REST_MOVES = 10_000  # of a zigzag without a place to rest (lines.MOST_MOVES)
LIFT_MM = 0.1
SHALLOW = 0.1  # mm of stock into which the tool goes straight down, also in a level
MOST_RAMPS = 40  # back and forth; over a cut that is shorter than that asks for they are steeper
NEXT_STEPS = 2.0  # step-overs: to a start as near as this a zigzag stays down


class Driver:
    """Adds one cut after the other to a Mover, with the links between them.

    request    SurfaceRequest; clearance: mm
    obstacles  surface.links.Obstacles
    probe      surface.drop.Probe
    low, high  (2,) mm: the rectangle that the cuts are over
    """

    def __init__(self, request, clearance, obstacles, probe, low, high):
        self.request, self.clearance, self.obstacles, self.probe = request, clearance, obstacles, probe
        self.mover, self.rested, self.first, self.last = None, 0, None, None
        self.held, self.held_at, self.deepest = (
            0.0,
            (0.0, 0.0),
            0.0,
        )  # how far, and where, stock has kept the holder up; how deep a cut is
        across, along = direction_of(request.direction)
        self.terms = Terms(
            request.relief,
            clearance,
            min(BLEND * request.relief, BLEND_CELLS * obstacles.stock.cell),
            (-along, across),
            request.step,
            request.feed,
            request.plunge_feed,
            MINUTE if request.feed_per == "min" else TURNS,
            low,
            high,
        )

    def add(self, cut):
        """To the start of a cut, surface.curve.Curve, and along it."""
        cut = self.held_up(cut)
        start = tuple(map(float, cut.points[0]))
        if self.mover is None:
            self._begin(start)
        elif self.request.link != ZIGZAG:
            self._link(start)
        else:
            self._rest()
        self._descend(start)
        self._follow(cut)

    def add_segment(self, curve, level):
        """As add() for a part of a cut that is not lower than `level` (mm, or None): it may be anywhere in the
        stock."""
        curve = self.held_up(curve)
        cut = curve.points
        entry = self._from_the_side(cut, level)
        entry = self._ramp(cut) if entry is None else entry
        start = tuple(map(float, entry[0]))
        if self.mover is None:
            self._begin(start)
        elif self._stay_down(cut, level):
            entry = cut[:1]
        else:
            self._link(start)
            self.rested = len(self.mover.moves)
        if len(entry) > 1:
            self._descend(start)
            self._along(entry, self.request.plunge_feed)
        self._descend(tuple(map(float, cut[0])))
        self._follow(curve)
        self.last = cut

    def moves(self):
        """All of them, with the one up to the clearance plane."""
        if self.mover is None:
            if self.request.start is None:
                return ()
            self._begin(self.request.start)
        self.mover.up()
        return tuple(self.mover.moves)

    def _follow(self, curve):
        """Along a cut, from its start."""
        self.mover.moves += moves_of(curve, self.request.feed)
        self.mover.at = tuple(map(float, curve.points[-1]))
        self.deepest = max(self.deepest, self.obstacles.cut(curve.points))

    def held_up(self, curve):
        """A Curve so high that the holder is clear of the stock; `held` knows by how much."""
        curve, rise, place = self.obstacles.held_up(curve)
        if rise > self.held:
            self.held, self.held_at = rise, place
        return curve

    def _along(self, chain, feed):
        self.mover.moves.extend(Line(x=x, y=y, z=z, feed=feed) for x, y, z in chain[1:].tolist())
        self.mover.at = tuple(map(float, chain[-1]))
        self.obstacles.cut(chain)

    def _begin(self, start):
        r = self.request
        self.first = start[:2]
        self.mover = Mover(_Frame(r.start or (*start[:2], self.clearance), self.clearance, r.feed, r.plunge_feed))
        self.mover.over(start[:2])

    def _link(self, start):
        """Pe - Pa - Pb - Pc - Pd, or with P1 and P2 the quickest safe link, to the start."""
        if self.request.link != PICK_FEED:
            self._quickest_link(start)
            return
        mover, end = self.mover, self.mover.at
        lifted = min(end[2] + self.request.relief, self.clearance)
        if lifted > end[2] + EQUAL:
            mover.moves.append(Line(z=lifted, feed=self.request.feed))
        mover.moves.append(Rapid(z=self.clearance))
        mover.moves.append(Rapid(x=start[0], y=start[1]))
        mover.at = (start[0], start[1], self.clearance)

    def _quickest_link(self, start):
        """As links.py says; down to the start straight or at a slant."""
        chain, blend = quickest_link(self.obstacles, np.array(self.mover.at), np.array(start), self.terms)
        *points, _start = chain.tolist()
        rounded = [Blend(blend)] if blend > 0 else []
        self.mover.moves += rounded
        for point in points[1:]:
            self.mover.rapid(*(new if abs(new - old) > EQUAL else None for new, old in zip(point, self.mover.at)))
        self.mover.moves += [Blend(None) for _ in rounded]
        if math.dist(self.mover.xy, start[:2]) > EQUAL:
            feed, _seconds = lead_in(self.mover.at, start, self.terms)
            self.mover.moves.append(Line(x=start[0], y=start[1], z=start[2], feed=feed))
            self.mover.at = tuple(start)

    def _stay_down(self, cut, level):
        """With P2, over the surface to a start that is a step away, or as near as a gap that is cut through; whether it
        did."""
        end, start = np.array(self.mover.at), cut[0]
        near = max(NEXT_STEPS * self.request.step, BRIDGE if level is None else 0.0)
        if self.request.link != ZIGZAG or math.dist(end[:2], start[:2]) > near:
            return False
        path = self._across(end, start, level)
        if level is None and np.linalg.norm(np.diff(path, axis=0), axis=1).sum() > near:  # over a wall
            return False
        self._rest()
        self._along(path, self.request.feed)
        return True

    def _across(self, start, end, level):
        """The chain (k, 3) over the surface from a point (3,) to another one, not lower than `level`, nor than the line
        between them:  what two cuts leave between them may be deeper than a level."""
        (curve,), _sampled = raster.chains(
            self.probe,
            raster.between(start[None, :2], end[None, :2]),
            self.request.tool,
            self.request.tolerance,
            arcs=False,
        )
        chain = curve.points
        if level is not None:
            chain = clipped(curve, level).points
            share = np.hypot(*(chain[:, :2] - start[:2]).T) / max(math.dist(start[:2], end[:2]), 1e-12)
            chain[:, 2] = np.maximum(chain[:, 2], start[2] + share * (end[2] - start[2]))
        return np.concatenate([start[None], self.held_up(Curve.straight(chain)).points, end[None]])

    def _rest(self):
        """Up by the relief and down again, in a long zigzag: the task serves nobody between two places where the tool
        may rest."""
        if len(self.mover.moves) - self.rested <= REST_MOVES:
            return
        self.rested = len(self.mover.moves)
        level = min(self.mover.z + max(self.request.relief, LIFT_MM), self.clearance)
        self.mover.moves.append(Line(z=level, feed=self.request.feed))
        self.mover.at = (*self.mover.xy, level)

    def _descend(self, start):
        """Pc - Pd - Ps: by rapid to the relief above the start and above the stock there, then at E."""
        mover = self.mover
        if mover.z > start[2] + EQUAL:
            above = max(start[2], self.obstacles.lowest(start)) + self.request.relief
            if above < mover.z - EQUAL:
                mover.rapid(z=above)
            mover.plunge(start[2])

    def _from_the_side(self, cut, level):
        """The path (k, 3) into the start of a cut from the one before, which is a step away and free of stock; None if
        it is not."""
        if self.request.depth is None or self.last is None:
            return None
        beside = _nearest(self.last, cut[0])
        if math.dist(beside[:2], cut[0][:2]) > NEXT_STEPS * self.request.step or not self.obstacles.is_free(
            beside, SHALLOW
        ):
            return None
        path = self._across(beside, cut[0], level)
        return (
            path
            if self.obstacles.deepest(_along(path, self.request.tool.diameter / 8)) <= self.request.depth + SHALLOW
            else None
        )

    def _ramp(self, cut):
        """The ramps (k, 3) down to the start of a cut in a level, or the start alone: over the beginning of the cut,
        above it all along."""
        r = self.request
        far = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(cut[:, :2], axis=0).T))])
        if r.depth is None or far[-1] < SHALLOW or self.obstacles.is_free(cut[0], SHALLOW):
            return cut[:1]
        slope = math.tan(math.radians(r.ramp_angle))
        ahead = _beginning(cut, far, min(r.depth / slope, far[-1]))
        depth = min(self.obstacles.deepest(_along(ahead, r.tool.diameter / 4)), r.depth)
        if depth <= SHALLOW or slope > 1e6:
            return cut[:1]
        return _ramps(raster.thinned(_beginning(cut, far, min(depth / slope, far[-1])), r.tolerance), depth, slope)


def _nearest(chain, point):
    """The point (3,) of a chain (k, 3) that is nearest to a point, seen from above."""
    start, step = chain[:-1], np.diff(chain, axis=0)
    square = np.maximum((step[:, :2] ** 2).sum(axis=1), 1e-18)
    share = np.clip(((point[:2] - start[:, :2]) * step[:, :2]).sum(axis=1) / square, 0.0, 1.0)
    found = start + share[:, None] * step
    return found[int(np.hypot(*(found[:, :2] - point[:2]).T).argmin())]


def _along(chain, step):
    """Points (n, 3) of a chain (k, 3) that are at most `step` (mm) apart seen from above."""
    far = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(chain[:, :2], axis=0).T))])
    at = np.linspace(0.0, far[-1], max(2, math.ceil(far[-1] / step) + 1))
    return np.column_stack([np.interp(at, far, chain[:, axis]) for axis in range(3)])


def _beginning(cut, far, length):
    """A cut up to a length (mm seen from above; far (k,): of its points)."""
    count = int(np.searchsorted(far, length))
    share = (length - far[count - 1]) / max(far[count] - far[count - 1], 1e-12)
    return np.concatenate([cut[:count], (cut[count - 1] + share * (cut[count] - cut[count - 1]))[None]])


def _ramps(chain, depth, slope):
    """Back and forth over a chain (k, 3), from `depth` above it evenly down to its start; the last pass leads back to
    it."""
    far = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(chain[:, :2], axis=0).T))])
    count = min(max(1, math.ceil(depth / slope / far[-1] - 1e-6)), MOST_RAMPS)
    found = []
    for number in range(count):
        back = (count - 1 - number) % 2 == 0
        points, done = (chain[::-1], far[-1] - far[::-1]) if back else (chain, far)
        raised = points.copy()
        raised[:, 2] += depth * (1.0 - (number + done / far[-1]) / count)
        found.append(raised if not found else raised[1:])
    return np.concatenate(found)


@dataclass(frozen=True)
class _Frame:
    """What a Mover asks of a request."""

    start: tuple
    clearance: float
    feed: float
    plunge_feed: float
