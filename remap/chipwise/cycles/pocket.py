"""G79: clear a pocket with islands.  PocketRequest -> moves and what to tell the operator; pure, mm.

Called by glue/pocket.py and bin/chipwise.  Where the tool centre may be: geometry/pocket/fields.py; how it goes there:
the strategies; here are levels, entries and what lies between.

Order of work: Field by Field (regions between which the tool does not fit), each from the top level to the floor.

Rapids, and why none meets stock.  Above R everything is free.  Below it a rapid runs straight up, or straight down at
a place where the tool has been at that depth, or down to GAP_MM above the level before, which is cleared all over the
Field.  All else is a feed.  None runs across below R, though the level before is cleared: above R nothing has to be
known about the stock.  A Track whose start was on no way of this level yet is entered by a helix, a ramp or a plunge.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Optional

import numpy as np

from chipwise.cycles.chop_lines import depths
from chipwise.cycles.common_words import (
    EQUAL, MAX_PASSES, MOST_MOVES, check_depth_step, check_feeds, check_moves, check_step, gap_notes)
from chipwise.errors import Area, CycleError
from chipwise.geometry import elements
from chipwise.geometry.contour import make_contour
from chipwise.geometry.offset import make_pocket
from chipwise.geometry.pocket import entries, fields, leftovers, runs
from chipwise.geometry.pocket.strategies import NAMES, STRATEGIES
from chipwise.geometry.pocket.unreached import unreached
from chipwise.geometry.tolerances import CONNECT_MM
from chipwise.moves import Arc, Line, Rapid

# Height of rapids above what is cleared. mm
GAP_MM = 0.5

# A start this near to a way of the level lies on it. mm; far below what a stock model or a chip can tell.
ON_WAY_MM = 1e-4

# Widest spacing of the ways, in tool diameters: D up to the whole diameter is allowed, but kerfs side by side have to
# overlap by something, or every rounding leaves a wall of nothing between them.
WIDEST = 0.995


@dataclass(frozen=True)
class PocketRequest:
    """A pocket, in mm and absolute work coordinates.

    loops            tuples of LineElement and ArcElement: the boundary, then the islands
    bottom           Z: floor of the pocket (the floor allowance is left above it)
    clearance        clearance plane
    tool_radius      half the tool's diameter
    step             D: step-over
    side_allowance   I: left on the walls
    floor_allowance  K: left on the floor
    strategy         P: 0 to 3
    direction        L: degrees, of strategies 1 and 2
    climb            the stock right of travel: climb milling with M3
    depth_step       J: deepest pass; None: one pass
    ramp_angle       degrees
    feed             mm/min (mm per revolution under G95)
    plunge_feed      E, same unit
    start            (x, y, z) where the tool stands
    close_gap        gaps of a loop up to this width are closed
    most_moves       a cycle of more is refused
    """

    loops: tuple
    bottom: float
    clearance: float
    tool_radius: float
    step: float
    feed: float
    plunge_feed: float
    start: tuple
    side_allowance: float = 0.0
    floor_allowance: float = 0.0
    strategy: int = 0
    direction: float = 0.0
    climb: bool = True
    depth_step: Optional[float] = None
    ramp_angle: float = 3.0
    close_gap: float = CONNECT_MM
    most_moves: int = MOST_MOVES


@dataclass(frozen=True)
class PocketPlan:
    """moves; unreached: regions the tool cannot enter; plunges: (x, y) of entries without helix or ramp; fields: number
    of regions cleared; gaps: notes of gaps that were closed."""

    moves: tuple
    unreached: tuple
    plunges: tuple
    fields: int
    gaps: tuple = ()

    @property
    def notes(self):
        """What the operator should know: (text, {name: length in mm})."""
        found = list(self.gaps)
        if self.unreached:
            first, count = self.unreached[0], len(self.unreached)
            found.append((f"{count} region{'s' if count > 1 else ''} of the pocket cannot be entered by this tool and stay"
                          f"{'' if count > 1 else 's'} uncut, the largest ({{area}}) at X{{x}} Y{{y}}",
                          {"area": Area(first.area), "x": first.x, "y": first.y}))
        if self.plunges:
            (x, y), count = self.plunges[0], len(self.plunges)
            found.append((f"no room for a helix or a ramp: {count} plunge{'s' if count > 1 else ''} at E, the first at "
                          "X{x} Y{y}", {"x": x, "y": y}))
        return tuple(found)


def check(request):
    """Raise CycleError for a request that cannot be done, whatever the shape."""
    r = request
    diameter = 2 * r.tool_radius
    if r.tool_radius <= 0:
        raise CycleError("tool diameter {d} is not above 0 mm", "load a tool with a diameter", d=diameter)
    check_step("step-over", "D", r.step, diameter)
    if r.side_allowance < 0:
        raise CycleError("side allowance I{i} is negative", "use I of 0 or more", i=r.side_allowance)
    if r.floor_allowance < 0:
        raise CycleError("floor allowance K{k} is negative", "use K of 0 or more", k=r.floor_allowance)
    if r.strategy not in NAMES:
        raise CycleError(f"strategy P{r.strategy:g} is not known", "use P0, P1, P2 or P3")
    if r.bottom + r.floor_allowance >= r.clearance - EQUAL:
        raise CycleError("final depth Z{z} with the floor allowance K{k} is not below the clearance plane R{r}",
                         "use a deeper Z, a smaller K or a higher R", z=r.bottom, k=r.floor_allowance, r=r.clearance)
    check_feeds(r)
    check_depth_step(r)
    if not 0 < r.ramp_angle <= 90:
        raise CycleError(f"ramp angle {r.ramp_angle:g} degrees is not above 0, up to 90",
                         "correct #<_chipwise_ramp_angle> or [CHIPWISE]RAMP_ANGLE")


@lru_cache(maxsize=32)
def pocket_plan(request):
    """The whole cycle.  Raises CycleError, before any move, where it cannot be done, and ContourError for a loop that is
    no closed contour."""
    check(request)
    r = request
    pocket = _pocket(r.loops, r.close_gap)
    distance = r.tool_radius + r.side_allowance
    found = fields.fields_at(pocket, distance)
    missed = unreached(pocket, found, distance)
    if not found:
        raise CycleError("the tool ({d}, with the side allowance {w}) fits nowhere in the pocket", "use a smaller tool",
                         d=2 * r.tool_radius, w=2 * distance)
    driver = _Driver(r)
    waiting = [(field, field_tracks(field, r)) for field in found]
    while waiting:
        gaps = [math.dist(driver.at[:2], tracks[0].start) for _, tracks in waiting]
        driver.clear(*waiting.pop(runs.least(gaps)))
    driver.rapid(z=r.clearance)
    return PocketPlan(tuple(driver.moves), missed, tuple(driver.plunges), len(found), gap_notes(pocket.contours))


def pocket_moves(request):
    """The moves of pocket_plan()."""
    return pocket_plan(request).moves


def field_tracks(field, request):
    """Tracks of one level of a Field: the strategy's, then what it left."""
    r = request
    step = min(r.step, WIDEST * 2 * r.tool_radius)
    if np.ptp(field.boundary.start, axis=0).max() > MAX_PASSES * step:
        raise CycleError(f"step-over D{{d}} needs more than {MAX_PASSES} ways side by side", "use a larger D", d=r.step)
    tracks = tuple(STRATEGIES[r.strategy](field, r.tool_radius, step, math.radians(r.direction), r.climb))
    if r.strategy == 0 and step <= r.tool_radius:
        return tracks  # geometry/pocket/rings.py says why nothing is left then
    return tracks + leftovers.leftovers(field, tracks, r.tool_radius)


@lru_cache(maxsize=32)
def _pocket(loops, close_gap):
    """Loops of parts -> Pocket.  Kept: the same pocket is often cleared in several cycles."""
    contours = [make_contour(parts, close_gap) for parts in loops]
    return make_pocket(contours[0], contours[1:])


def _known_starts(tracks):
    """For each Track whether its start lies on an earlier one: the tool has been there at this level."""
    way, known, done = elements.join([track.elements for track in tracks]), [], 0
    for track in tracks:
        gap = elements.distances(way, np.arange(done), np.broadcast_to(track.start, (done, 2)))
        known.append(bool(done) and float(gap.min()) <= ON_WAY_MM)
        done += len(track.elements)
    return known


class _Driver:
    """The moves so far and where the tool is."""

    def __init__(self, request):
        self.request, self.moves, self.plunges = request, [], []
        self.at = tuple(request.start)

    # ---- single moves --------------------------------------------------------------------------------------------

    def rapid(self, x=None, y=None, z=None):
        """A traverse, unless the tool is there already."""
        there = tuple(old if new is None else float(new) for old, new in zip(self.at, (x, y, z)))
        if there != self.at:
            self.moves.append(Rapid(x=None if x is None else there[0], y=None if y is None else there[1],
                                    z=None if z is None else there[2]))
            self.at = there

    def down(self, z, feed):
        """Straight down at a feed."""
        if z < self.at[2]:
            self.moves.append(Line(z=z, feed=feed))
            self.at = (*self.at[:2], z)

    def run(self, run, feed, to_z=None):
        """Elements at a feed, level or evenly sloping down to to_z."""
        length = elements.lengths(run)
        total, done, from_z = float(np.sum(length)), np.cumsum(length), self.at[2]
        for k in range(len(run)):
            z = None if to_z is None else from_z + (to_z - from_z) * float(done[k]) / total if k < len(run) - 1 else to_z
            (x, y), (cx, cy) = run.end[k].tolist(), run.centre[k].tolist()
            if run.is_arc[k]:
                self.moves.append(Arc(x, y, cx, cy, bool(run.sweep[k] > 0), z=z, feed=feed))
            elif length[k] > 0.0 or z is not None:
                self.moves.append(Line(x=x, y=y, z=z, feed=feed))
            self.at = (x, y, self.at[2] if z is None else z)

    # ---- a Field -------------------------------------------------------------------------------------------------

    def clear(self, field, tracks):
        """All levels of a Field."""
        r = self.request
        above, known = None, _known_starts(tracks)
        levels = depths(r.clearance, r.bottom + r.floor_allowance, r.depth_step)
        per_level = sum(len(track.elements) + 3 for track in tracks)
        check_moves(len(self.moves) + len(levels) * per_level, r, "use a larger J or D")
        for z in levels:
            for track, is_known in zip(tracks, known):
                if is_known:
                    self._reach(track, z)
                    self.down(z, r.plunge_feed)
                else:
                    self._reach(track, above)
                    self._enter(field, track, z)
                self.run(track.elements, r.feed)
            above = z

    def _reach(self, track, free):
        """By rapids to over the start of a Track, down to just above `free`, the depth that is cleared there; None:
        nothing is cleared below R."""
        r, (x, y) = self.request, track.start.tolist()
        if self.moves or self.at[2] < r.clearance - EQUAL:
            self.rapid(z=r.clearance)
        self.rapid(x=x, y=y)
        self.rapid(z=r.clearance if free is None else min(free + GAP_MM, r.clearance))

    # ---- entries -------------------------------------------------------------------------------------------------

    def _enter(self, field, track, z):
        """Down into solid stock at the start of a Track."""
        r = self.request
        angle = math.radians(r.ramp_angle)
        how = entries.entry(field, track, r.tool_radius, self.at[2] - z, angle)
        feed = min(r.feed, r.plunge_feed / math.sin(angle))
        check_moves(len(self.moves) + entries.move_count(how), r, "use a larger #<_chipwise_ramp_angle> or J")
        if isinstance(how, entries.Helix):
            x, y, top = self.at
            for turn in range(1, how.turns + 1):
                low = z if turn == how.turns else top + (z - top) * turn / how.turns
                self.moves.append(Arc(x, y, *how.centre, how.ccw, z=low, feed=feed))
            self.at = (x, y, z)
        elif isinstance(how, entries.Ramp):
            top = self.at[2]
            legs = len(how.legs) * how.pairs
            for number, leg in enumerate(how.legs * how.pairs, 1):
                self.run(leg, feed, z if number == legs else top + (z - top) * number / legs)
        else:
            self.plunges.append(self.at[:2])
            self.down(z, r.plunge_feed)
