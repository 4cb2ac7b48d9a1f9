# SPDX-License-Identifier: GPL-2.0-or-later
"""G79: clear a pocket with islands.  PocketRequest -> moves and messages for the operator; pure, mm.

Called by glue/pocket.py and bin/chipwise.  Where the tool centre may be: geometry/pocket/machinable.py; how it goes
there:  the strategies; here are levels, entries and what lies between.

Order of work: one machinable region after the other (the tool does not fit between them), each from the top level to
the floor.

Rapids, and why none meets stock, nor has any at its side.  Above R everything is free.  Below it a rapid runs straight
up, or straight down to GAP_MM above the level before, which is cleared all over the machinable region, if the place is
the traverse clearance within that region.  Everything else is a feed: also the rest down to where the tool has been at
this level, as that may be beside stock.  From Track to Track of a level the tool goes over ground that the level has
cleared, lifted a little where it traverses (geometry/pocket/links.py; pocket_engage.py for P4); it lifts to R where
there is no such route.  A Track that does not start on an earlier path of its level is entered by a helix, a ramp or a
plunge.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Optional

import numpy as np

from chipwise.cycles import pocket_engage
from chipwise.cycles.chop_lines import depth_levels
from chipwise.cycles.mover import Mover
from chipwise.cycles.plan import CyclePlan, Note, Report
from chipwise.cycles.standing import Standing
from chipwise.cycles.word_checks import (
    EQUAL,
    MAX_PASSES,
    MOST_MOVES,
    check_depth_step,
    check_feeds,
    check_moves,
    check_step,
    gap_notes,
)
from chipwise.errors import Area, CycleError
from chipwise.geometry.base import elements
from chipwise.geometry.base.clearance import gouge_depths
from chipwise.geometry.offset.kernel import make_pocket
from chipwise.geometry.base import chains
from chipwise.geometry.pocket import entries, links, machinable, nesting, rest_material
from chipwise.geometry.pocket.strategies import ENGAGE, NAMES, STRATEGIES
from chipwise.geometry.pocket.full_width import full_width
from chipwise.geometry.pocket.inaccessible import inaccessible
from chipwise.geometry.pocket.wall_arcs import NO_AREA_MM2, Walls
from chipwise.geometry.base.tolerances import CONNECT_MM

# Height of rapids above what is cleared. mm
GAP_MM = 0.5

# Widest spacing of the paths, in tool diameters: D up to the whole diameter is allowed, but kerfs side by side have to
# overlap by something, or every rounding leaves a wall of nothing between them.
WIDEST = 0.995

# A remainder narrower than this is not looked for after P3 with a step-over up to the tool radius: it leaves none. mm
REST_MM = 0.01


@dataclass(frozen=True)
class PocketRequest:
    """A pocket, in mm and absolute work coordinates.

    loops            tuples of LineElement and ArcElement: closed loops, sorted by nesting whatever their order
    bottom           Z: floor of the pocket (the floor allowance is left above it)
    clearance        clearance plane
    tool_radius      half the tool's diameter
    step             D: step-over
    side_allowance   I: left on the walls
    floor_allowance  K: left on the floor
    strategy         P: 0 to 4
    direction        L: degrees, of strategies 1 and 2
    climb            the stock right of travel: climb milling with M3
    depth_step       J, or the flute length: deepest pass; None: one pass
    stock_top        nothing is above it; None: not known.  Only without J
    ramp_angle       degrees
    feed             mm/min (mm per revolution under G95)
    plunge_feed      E, same unit
    start            (x, y, z) where the tool stands
    close_gap        gaps of a loop up to this width are closed
    most_moves       a cycle of more is refused
    feed_per         "min", or "rev" under G95: for messages
    traverse_clearance  that a rapid keeps from stock at its side
    seam_overlap     the tool runs on over the start of a finished wall by this
    stock            Standing that P4 starts from; None: solid
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
    stock_top: Optional[float] = None
    ramp_angle: float = 3.0
    close_gap: float = CONNECT_MM
    most_moves: int = MOST_MOVES
    feed_per: str = "min"
    traverse_clearance: float = 0.2
    seam_overlap: float = 0.3
    stock: Optional[Standing] = None


@dataclass(frozen=True)
class PocketPlan(CyclePlan):
    """A CyclePlan; inaccessible: regions the tool cannot enter; plunges: (x, y) of entries without helix or ramp;
    regions:  number of regions cleared."""

    inaccessible: tuple = ()
    plunges: tuple = ()
    regions: int = 0


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
    if r.strategy not in (*NAMES, ENGAGE):
        raise CycleError(f"strategy P{r.strategy:g} is not known", "use P0, P1, P2, P3 or P4")
    if r.strategy == ENGAGE:
        pocket_engage.check(r)
    if r.bottom + r.floor_allowance >= r.clearance - EQUAL:
        raise CycleError(
            "final depth Z{z} with the floor allowance K{k} is not below the clearance plane R{r}",
            "use a deeper Z, a smaller K or a higher R",
            z=r.bottom,
            k=r.floor_allowance,
            r=r.clearance,
        )
    check_feeds(r)
    check_depth_step(r)
    if not 0 < r.ramp_angle <= 90:
        raise CycleError(
            f"ramp angle {r.ramp_angle:g} degrees is not above 0, up to 90",
            "correct #<_chipwise_ramp_angle> or [CHIPWISE]RAMP_ANGLE",
        )


@lru_cache(maxsize=32)
def pocket_plan(request):
    """The whole cycle.  Raises CycleError, before any move, if it cannot be done, and ContourError for a loop that is
    no closed contour."""
    check(request)
    r = request
    drawn, pockets = _pockets(r.loops, r.close_gap)
    mirrored = r.strategy == ENGAGE and not r.climb
    contours = [contour for pocket in pockets for contour in pocket.contours]
    if mirrored:
        pockets = _pockets(pocket_engage.mirrored_loops(r.loops), r.close_gap)[1]
    distance = r.tool_radius + r.side_allowance
    within = [machinable.machinable_regions(pocket, distance) for pocket in pockets]
    found = [region for regions in within for region in regions]
    missed = tuple(
        sorted(
            (area for pocket, regions in zip(pockets, within) for area in inaccessible(pocket, regions, distance)),
            key=lambda area: -area.area,
        )
    )
    if not found:
        if r.side_allowance > 0.0:
            raise CycleError(
                "the tool ({d}) with the side allowance I{i} beside it fits nowhere in the pocket",
                "use a smaller tool or a smaller I",
                d=2 * r.tool_radius,
                i=r.side_allowance,
            )
        raise CycleError("the tool ({d}) fits nowhere in the pocket", "use a smaller tool", d=2 * r.tool_radius)
    driver = _Driver(r)
    if r.strategy == ENGAGE:
        more = _engaged(driver, found)
        missed = tuple(replace(area, x=-area.x) for area in missed) if mirrored else missed
    else:
        waiting = [(region, region_tracks(region, r)) for region in found]
        while waiting:
            gaps = [math.dist(driver.mover.xy, tracks[0].start) for _, tracks in waiting]
            driver.clear(*waiting.pop(chains.least(gaps)))
        more = pocket_engage.full_width_note(driver.full)
    driver.mover.up()
    plunges = tuple(driver.plunges)
    notes = gap_notes(contours) + nesting_notes(drawn) + _notes(missed, plunges) + more
    report = partial(_report, len(found), missed, plunges)
    return PocketPlan(tuple(driver.mover.moves), notes, report, missed, plunges, len(found))


def _engaged(driver, found):
    """P4: clears the regions in their order; notes on the engagement."""
    done = []
    for region in found:
        planned = pocket_engage.levels(region, driver.request)
        pocket_engage.clear(driver, region, planned)
        done += planned
    return pocket_engage.notes(done, driver.request.climb, driver.request.tool_radius)


def _report(regions, missed, plunges):
    """What was cleared and what was not."""
    return Report(
        "pocket", dict(regions=regions, plunges=len(plunges), inaccessible_mm2=[round(area.area, 3) for area in missed])
    )


def _notes(missed, plunges) -> tuple[Note, ...]:
    """What the operator should know of regions that stay uncut, and of plunges."""
    notes: tuple[Note, ...] = ()
    if missed:
        first, count = missed[0], len(missed)
        notes += (
            Note(
                f"{count} region{'s' if count > 1 else ''} of the pocket cannot be entered by this tool and stay"
                f"{'' if count > 1 else 's'} uncut, the largest ({{area}}) at X{{x}} Y{{y}}",
                {"area": Area(first.area), "x": first.x, "y": first.y},
            ),
        )
    if plunges:
        (x, y), count = plunges[0], len(plunges)
        notes += (
            Note(
                "no clearance for a helix or a ramp, so the tool plunges at E in "
                f"{count} place{'s' if count > 1 else ''}, the first at X{{x}} Y{{y}}",
                {"x": x, "y": y},
            ),
        )
    return notes


def nesting_notes(drawn) -> tuple[Note, ...]:
    """What of a drawing was taken otherwise than as one wall each."""
    notes: tuple[Note, ...] = ()
    if drawn.doubled:
        (again, first), more = drawn.doubled[0], len(drawn.doubled) - 1
        notes += (
            Note(
                f"the loop of line {again.line[0]} repeats the one of line {first.line[0]} and counts "
                f"once{_and_more(more)}",
                {},
            ),
        )
    if drawn.links:
        lines = sorted({part.line for part in drawn.links})
        notes += (
            Note(
                f"line {lines[0]} leads from one loop to another with G1 and is not a wall{_and_more(len(lines) - 1)}",
                {},
            ),
        )
    return notes


def _and_more(count) -> str:
    return f" (and {count} more)" if count else ""


def region_tracks(region, request):
    """Tracks of one level of a machinable region: the strategy's, then what it left."""
    r = request
    step = min(r.step, WIDEST * 2 * r.tool_radius)
    if np.ptp(region.boundary.start, axis=0).max() > MAX_PASSES * step:
        raise CycleError(
            f"step-over D{{d}} needs more than {MAX_PASSES} paths side by side", "use a larger D", d=r.step
        )
    walls = Walls(region, r.tool_radius, r.climb, r.seam_overlap) if region.area > NO_AREA_MM2 else None
    tracks = tuple(STRATEGIES[r.strategy](region, r.tool_radius, step, math.radians(r.direction), r.climb, walls))
    if r.strategy == 0 and step <= r.tool_radius:
        return tracks  # geometry/pocket/rings.py says why nothing is left then
    if r.strategy == 3 and step <= r.tool_radius and walls is not None and walls.ground.left(REST_MM)[0] == 0.0:
        return tracks  # much quicker than to ask polygons
    return tracks + rest_material.rest_tracks(region, tracks, r.tool_radius)


@lru_cache(maxsize=32)
def _pockets(loops, close_gap):
    """Loops of parts -> (Nested, Pockets).  Kept: the same pockets are often cleared in several cycles."""
    drawn = nesting.nested(loops, close_gap)
    return drawn, tuple(make_pocket(boundary, islands) for boundary, islands in drawn.pockets)


def _open_starts(region, tracks, clearance):
    """For each Track whether no stock that a cleared level leaves is within the clearance (mm) of the tool's side at
    its start."""
    start = np.array([track.start for track in tracks], float).reshape(-1, 2)
    return (gouge_depths(region.pocket.clearance_check, start, region.distance + clearance) <= 0.0).tolist()


class _Driver:
    """Clears machinable regions level by level; plunges: (x, y) of entries without helix or ramp; full: places of full
    width, each of one level."""

    def __init__(self, request):
        self.request, self.mover = request, Mover(request)
        self.plunges, self.full = [], []

    def clear(self, region, tracks):
        """All levels of a machinable region."""
        r, mover = self.request, self.mover
        above, known, is_open = None, links.known_starts(tracks), _open_starts(region, tracks, r.traverse_clearance)
        routes = links.linked(region, tracks, r.tool_radius, r.traverse_clearance, r.feed / 60.0)
        levels = depth_levels(r.clearance, r.bottom + r.floor_allowance, r.depth_step, r.stock_top)
        per_level = sum(len(track.elements) + 4 for track in tracks) + sum(
            len(piece.elements) for route in routes for piece in route or ()
        )
        check_moves(len(mover.moves) + len(levels) * per_level, r, "use a larger J or D")
        entered = {}
        for z in levels:
            for k, (track, is_known, is_free, route) in enumerate(zip(tracks, known, is_open, routes)):
                if route is not None:
                    self._link(route, z)
                else:
                    self.over(track.start.tolist(), above, z if is_known else above, is_free)
                    if is_known:
                        mover.plunge(z)
                    else:
                        entered[k] = self._enter(region, track, z)
                mover.follow(track.elements)
            above = z
        self.full += full_width(region, tracks, entered, r.tool_radius)

    def _link(self, route, z):
        """Along the Pieces of a link at a level; rapids are lifted, and the feed after one goes down the rest."""
        mover, slope = self.mover, math.tan(math.radians(self.request.ramp_angle))
        for piece in route:
            if piece.rapid:
                pocket_engage.across(mover, piece.elements, z, self.request.clearance)
                continue
            if mover.z - z > float(elements.lengths(piece.elements).sum()) * slope:
                mover.down(z)
            mover.follow(piece.elements, z if mover.z > z else None)
        mover.down(z)

    def over(self, start, above, free, is_open):
        """To just above `free`, the depth that is cleared at a start (x, y): by rapids to over the level before
        (`above`) if that is open there, else to the clearance plane.  None: nothing is cleared below R."""
        clearance = self.request.clearance
        self.mover.over(start, min(above + GAP_MM, clearance) if is_open and above is not None else clearance)
        if free is not None:
            self.mover.down(free + GAP_MM)

    def _enter(self, region, track, z):
        """Down into solid stock at the start of a Track; Elements of what is cut at the level then."""
        r, mover = self.request, self.mover
        angle = math.radians(r.ramp_angle)
        entry = entries.entry(region, track, r.tool_radius, mover.z - z, angle)
        feed, top = mover.descent_feed(angle), mover.z
        check_moves(len(mover.moves) + entries.move_count(entry), r, "use a larger #<_chipwise_ramp_angle> or J")
        if isinstance(entry, entries.Helix):
            for turn in range(1, entry.turns + 1):
                low = z if turn == entry.turns else top + (z - top) * turn / entry.turns
                mover.arc(mover.xy, entry.centre, entry.ccw, low, feed)
        elif isinstance(entry, entries.Ramp):
            count = len(entry.segments) * entry.pairs
            for number, segment in enumerate(entry.segments * entry.pairs, 1):
                mover.follow(segment, z if number == count else top + (z - top) * number / count, feed)
        else:
            self.plunges.append(mover.xy)
            mover.plunge(z)
        return entries.cut(entry, track)
