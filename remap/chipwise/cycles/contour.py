# SPDX-License-Identifier: GPL-2.0-or-later
"""G77 / G78: a contour, roughed or finished from its finish shape alone.  ContourRequest -> moves; pure, mm.

Called by glue/contour.py.  Sources: JP H07-47256 B2 (tool paths of any tool from the one finish shape) through
geometry/offset/kernel.py; the approach from the approaching method of area machining (an angle to the work plane, a
height, the projection normal to the outline).

Order of work, and why:
 1. The path of every radial pass is the offset of the finish shape itself by tool radius + allowance + a multiple of
    the step, never of the pass before: nothing adds up.
 2. One radial pass: each path to full depth before the next one, at one place, so without rapids between its depths.
    Several: chamber by chamber (contour_order.py), in each level by level from the outside in, so that no pass meets
    more than the step.
 3. From one radial pass to the next at the same place the tool stays down: its lead-in has cleared the way.  A closed
    pass begins there; an open one of G77 to and fro begins at the end where the tool is.
 4. G78 of a closed contour from inside: the slug is chopped first (contour_chop.py).  Chopped or not, where one is left
    the lead-in is a full circle, so that the tool leaves the wall through an open kerf.
 5. Rapids run on the clearance plane or above, or straight up to it; below it every move down or across is a feed.
"""

import math
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Optional

from chipwise.cycles.chop_lines import depth_levels
from chipwise.cycles.contour_chop import ChopPlan, chop_plan, cut_chops
from chipwise.cycles.contour_notes import chop_notes, lead_in_notes, open_notes, reach_notes
from chipwise.cycles.contour_order import chambers
from chipwise.cycles.lead_in import MAX_APPROACH, Before, ChopKerfs, LeadInClearance, LedPath, led_path
from chipwise.cycles.mover import Mover
from chipwise.cycles.plan import CyclePlan, Report
from chipwise.cycles.word_checks import (
    EQUAL,
    MOST_MOVES,
    check_chop_size,
    check_depth_step,
    check_feeds,
    check_heights,
    check_moves,
    check_step,
    gap_notes,
)
from chipwise.errors import CycleError
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import make_contour, refuse_nearly_closed
from chipwise.geometry.base.tolerances import CONNECT_MM
from chipwise.geometry.offset.kernel import LEFT, RIGHT, offset_contour

SIDES = {41: LEFT, 42: RIGHT}

# Radial passes: each is an offset of its own, some hundredths of a second for a long contour.
MAX_RINGS = 200


@dataclass(frozen=True)
class ContourRequest:
    """A contour, in mm and absolute work coordinates.

    shape           LineElement and ArcElement of the finish shape, in the direction of travel
    side            41 tool left, 42 tool right of it
    tool_radius     half the tool's diameter
    bottom          final depth
    clearance       clearance plane
    allowance       I: stock left on the wall
    passes, step    L, D: radial passes and their distance
    depth_step      J, or the flute length: deepest pass; None: one pass
    stock_top       nothing is above it; None: not known.  Only without J
    approach        K: height of the slanted approach; None: vertical plunge
    angle           of the slanted approach to the work plane, rad
    feed            mm/min (mm per revolution under G95)
    plunge_feed     E, same unit
    start           (x, y, z) where the tool stands
    finish          G78: the notes say what the tool does not reach
    to_and_fro      open paths of G77 are run in either direction
    chop_size       H: no piece that comes loose may reach it; 0: do not chop (G78)
    close_gap       gaps of the shape up to this width are closed
    most_moves      a cycle of more is refused
    feed_per        "min", or "rev" under G95: for messages
    """

    shape: tuple
    side: int
    tool_radius: float
    bottom: float
    clearance: float
    feed: float
    plunge_feed: float
    start: tuple
    allowance: float = 0.0
    passes: int = 1
    step: Optional[float] = None
    depth_step: Optional[float] = None
    stock_top: Optional[float] = None
    approach: Optional[float] = None
    angle: float = math.radians(30.0)
    finish: bool = False
    to_and_fro: bool = False
    chop_size: float = 0.0
    close_gap: float = CONNECT_MM
    most_moves: int = MOST_MOVES
    feed_per: str = "min"


@dataclass(frozen=True)
class ContourPlan(CyclePlan):
    """A CyclePlan; chop: what becomes of the slug (G78 of a closed contour from inside)."""

    chop: ChopPlan = ChopPlan(())


def check(r):
    """Raise CycleError for a request that cannot be done, as far as its numbers tell."""
    if r.side not in SIDES:
        raise CycleError(f"side P{r.side:g} is neither 41 nor 42", "use P41 (tool left of the contour) or P42 (right)")
    if r.tool_radius <= 0:
        raise CycleError("tool diameter {d} is not above 0 mm", "load a tool with a diameter", d=2 * r.tool_radius)
    if r.allowance < 0 and r.tool_radius + r.allowance <= EQUAL:
        raise CycleError(
            "allowance I{i} takes away the whole tool radius {t}", "use I of 0 or more", i=r.allowance, t=r.tool_radius
        )
    if r.allowance < 0:
        raise CycleError(
            "allowance I{i} is negative: it would cut into the finish shape", "use I of 0 or more", i=r.allowance
        )
    check_heights(r)
    check_feeds(r)
    _check_passes(r)
    if r.approach is not None and r.approach <= 0:
        raise CycleError(
            "approach height K{k} is not above 0", "use K above 0, or leave it out to plunge", k=r.approach
        )
    if not 0 < r.angle <= math.pi / 2 + 1e-12:
        raise CycleError(
            f"approach angle {math.degrees(r.angle):g} is not above 0 and up to 90 degrees",
            "set #<_chipwise_approach_angle>",
        )
    if r.approach is not None and r.approach / math.tan(r.angle) > MAX_APPROACH:
        raise CycleError(
            f"the approach of K{{k}} at {math.degrees(r.angle):g} degrees begins {{out}} beside the contour, "
            "more than {most}",
            "use a smaller K or a larger #<_chipwise_approach_angle>",
            k=r.approach,
            out=r.approach / math.tan(r.angle),
            most=MAX_APPROACH,
        )
    check_chop_size(r)


def _check_passes(r):
    """The rules of J, L and D."""
    check_depth_step(r)
    if not 1 <= r.passes <= MAX_RINGS or r.passes != int(r.passes):
        raise CycleError(f"L{r.passes:g} radial passes are not from 1 to {MAX_RINGS}", f"use L1 to L{MAX_RINGS}")
    if r.step is not None:
        step = r.step if r.passes > 1 else min(r.step, 2 * r.tool_radius)  # not used in a single pass
        check_step("radial step", "D", step, 2 * r.tool_radius, " and would leave ridges")
    if r.passes > 1 and r.step is None:
        raise CycleError(f"L{r.passes:g} radial passes without a step D", "add D of at most {t}", t=2 * r.tool_radius)


@lru_cache(maxsize=16)
def contour_plan(request: ContourRequest) -> ContourPlan:
    """The whole cycle.  Raises CycleError or ContourError, before any move, if it cannot be done."""
    check(request)
    contour = make_contour(list(request.shape), request.close_gap)
    refuse_nearly_closed(contour, request.close_gap)
    results = _offsets(request, contour)
    levels = depth_levels(request.clearance, request.bottom, request.depth_step, request.stock_top)
    count = len(levels) * sum(len(path.elements) + 6 for result in results for path in result.paths)
    check_moves(count, request, "use a larger J or D")
    chop = _chop(request, contour, results[-1])
    check_moves(count + 4 * len(levels) * len(chop.segments), request, "use a larger J or chop size")
    clearance = LeadInClearance(request, contour, SIDES[request.side])
    kerfs = ChopKerfs(chop.segments, request.tool_radius)
    parts = [
        _led(request, clearance, part, kerfs)
        for part in chambers([result.paths for result in results], request.step or 0.0, clearance.normals)
    ]
    moves = _moves(request, clearance, chop, parts, levels)
    notes = (
        gap_notes((contour,))
        + open_notes(request, contour)
        + reach_notes(request, results[-1])
        + lead_in_notes(request, [path for part in parts for path in part])
        + chop_notes(request, chop)
    )
    return ContourPlan(moves, notes, partial(_report, chop) if request.finish else None, chop)


def _report(chop):
    """What becomes of the slug."""
    return Report("contour", dict(chopped=chop.chopped, pieces=chop.pieces, largest_piece_mm=chop.largest_piece))


def _led(request, clearance, part, kerfs):
    """LedPaths of the paths of a chamber, each begun beside the end of the one before if there is room."""
    found, before = [], None
    for path in part:
        found.append(led_path(clearance, path, kerfs, before))
        before = Before(found[-1].leave, partial(_linked, request, clearance, found[-1].leave))
    return found


def _moves(request, clearance, chop, parts, levels):
    """All moves: the chop lines, then the paths of every chamber."""
    mover = Mover(request)
    first = parts[0][-1].enter
    cut_chops(mover, chop, first.at(first.out), request.tool_radius, levels)
    driver = _Driver(request, clearance, mover, slug=bool(chop.chops))
    for path, z in ((path, z) for part in parts for z in levels for path in part):
        driver.run(path, z)
    mover.up()
    return tuple(mover.moves)


def radial_distances(request):
    """Distance (mm) of the tool's centre from the finish shape in each radial pass, from the outside in."""
    last = request.tool_radius + request.allowance
    step = min(request.step or 0.0, 2 * request.tool_radius)
    return [last + step * k for k in range(int(request.passes) - 1, -1, -1)]


def _offsets(request, contour):
    """The paths of every radial pass."""
    results = [_offset(request, contour, distance) for distance in radial_distances(request)]
    if not results[-1].paths:
        raise CycleError(
            "the tool ({d}) fits nowhere on this side of the contour",
            "use a smaller tool" + (", or less allowance" if request.allowance else "") + ", or the other side",
            d=2 * request.tool_radius,
        )
    return results


def _offset(request, contour, distance):
    result = offset_contour(contour, SIDES[request.side], distance)
    if result.loose:
        raise CycleError(
            "the path of the tool ({d}) along this contour could not be closed",
            "change the allowance I or the tool a little, and report the contour",
            d=2 * request.tool_radius,
        )
    return result


def _chop(request, contour, result):
    """ChopPlan of what comes loose when a closed contour is cut from inside by G78."""
    inside = contour.closed and (elements.area(contour.elements) > 0.0) == (SIDES[request.side] == LEFT)
    if not request.finish or not inside:
        return ChopPlan(())
    paths = [path.elements for path in result.paths if elements.lengths(path.elements).any()]
    return chop_plan(paths, [], request.tool_radius, request.chop_size)


class _Driver:
    """Runs paths, each with its lead-in and lead-out."""

    def __init__(self, request, clearance, mover, slug):
        """slug: whether a slug is left, so that the tool leaves the wall through a kerf that is open."""
        self.request, self.clearance, self.mover, self.slug = request, clearance, mover, slug

    def run(self, path, z):
        """One path at one depth."""
        side = SIDES[self.request.side]
        if self._backwards(path, z):
            path, side = LedPath(elements.reverse(path.elements), path.leave, path.enter), -side
        mover, enter, leave, ccw = self.mover, path.enter, path.leave, side == LEFT
        self._down(enter.at(enter.out), z + enter.height)
        if enter.height:
            mover.line(enter.point, z, mover.descent_feed(self.request.angle))
        elif enter.lead:
            if self.slug:
                mover.arc(enter.at(enter.out), enter.at(enter.lead), ccw)
            mover.arc(enter.point, enter.at(enter.lead), ccw)
        mover.follow(path.elements)
        if leave.height:
            mover.line(leave.at(leave.out), z + leave.height)
        elif leave.lead:
            mover.arc(leave.at(leave.out), leave.at(leave.lead), ccw)

    def _backwards(self, path, z):
        """Whether a path is run from its end to its start: open, to and fro, and only its end is beside the tool."""
        enter, leave = path.enter, path.leave
        return (
            self.request.to_and_fro
            and math.dist(enter.point, leave.point) > EQUAL
            and not self._straight(enter.at(enter.out), z + enter.height)
            and self._straight(leave.at(leave.out), z + leave.height)
        )

    def _down(self, point, z):
        """To a point, then down: from the pass beside it straight across, else by rapids."""
        mover = self.mover
        if self._straight(point, z):
            if math.dist(point, mover.xy) > EQUAL:
                mover.line(point)
        else:
            mover.over(point, max(z, self.request.clearance))
        mover.plunge(z)

    def _straight(self, point, z):
        """Whether the tool may go straight across to a point and down to z."""
        mover = self.mover
        return bool(mover.moves) and mover.z >= z - EQUAL and _beside(self.request, self.clearance, mover.xy, point)


def _beside(request, clearance, at, point):
    """Whether a point belongs to the pass that a place belongs to, or to a radial pass beside it: cleared already.  A
    tool radius more: the lead-ins are beside the passes, and need not be opposite to one another."""
    far = math.dist(point, at)
    most = (request.passes - 1) * (request.step or 0.0) + request.tool_radius if request.passes > 1 else 0.0
    return far <= EQUAL or far <= most + EQUAL and clearance.for_link(at, point)


def _linked(request, clearance, leave, lead_in):
    """Whether a lead-in is beside the place where the tool has left a path."""
    return _beside(request, clearance, leave.at(leave.out), lead_in.at(lead_in.out))
