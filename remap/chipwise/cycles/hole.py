# SPDX-License-Identifier: GPL-2.0-or-later
"""G12 / G13: a circular hole, its slug chopped or its pocket cleared.  HoleRequest -> moves; pure, mm.

Called by glue/hole.py.  Chopping: JP H05-7134 B2, see geometry/slug/disc.py and chop_lines.py; pocketing: Haas' I, K
and Q.

Order of work, and why:
 1. To the clearance plane over the first line: up before across before down, never through stock.
 2. Chop lines, each to FULL depth in its passes before the next (patent, fig. 5: lines first, then the circle).
    A strip between two lines stays joined to the stock at both ends; a cell comes loose when its last line reaches
    the final depth, and then it is small already.
 3. The circle, in passes.  At the last one the pieces at the rim come loose, one after the other, small.
    Were the passes taken level by level through lines and circle, the same pieces would come loose at the last level,
    but every level would cost all the rapids again.
 4. Up, and across to the centre: the tool is on the clearance plane over the hole.

Rapids run on the clearance plane or straight up and down above it; below it every move is a feed.

Entry, never at the finished wall:
 - a line is entered one tool radius inside its end (or at its middle, if shorter), run to that end and back across;
 - the circle is met along an arc of radius a tangent to it (a = the tool's radius, or half the way from the centre);
   the plunge stands a diameter of the tool or more from the wall's path, or at the centre of a small hole.
 - where a slug or its pieces are left, that arc is first cut as a full circle, so that the half by which the tool
   leaves is open before anything comes loose.
"""

import math
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Optional

from chipwise.cycles.chop_lines import cut_line, depth_levels, ends
from chipwise.cycles.mover import Mover
from chipwise.cycles.plan import CyclePlan, Report
from chipwise.cycles.word_checks import (
    EQUAL,
    MAX_PASSES,
    MOST_MOVES,
    check_chop_size,
    check_depth_step,
    check_feeds,
    check_heights,
    check_moves,
    check_step,
)
from chipwise.errors import CycleError
from chipwise.geometry.slug import disc
from chipwise.geometry.slug.line_order import order_lines

# Smallest radius of the tool's own circle. mm; LinuxCNC refuses arcs below 0.00127, the lead-in has half of this.
MIN_PATH_RADIUS = 0.005


@dataclass(frozen=True)
class HoleRequest:
    """A hole, in mm and absolute work coordinates.

    x, y            centre
    bottom          final depth
    clearance       clearance plane
    radius          I without K: radius of the finished hole.  With K: of the first ring
    finished        K: radius of the finished pocket; None: no pocket, a slug is left
    step            Q: radial step of the pocket
    ccw             True: G13, False: G12
    tool_radius     half the tool's diameter
    chop_size       H: no loose piece may reach it; 0: do not chop
    depth_step      J, or the flute length: deepest pass; None: one pass
    stock_top       nothing is above it; None: not known.  Only without J
    feed            mm/min (mm per revolution under G95)
    plunge_feed     E, same unit
    start           (x, y, z) where the tool stands
    most_moves      a cycle of more is refused
    feed_per        "min", or "rev" under G95: for messages
    """

    x: float
    y: float
    bottom: float
    clearance: float
    radius: float
    ccw: bool
    tool_radius: float
    feed: float
    plunge_feed: float
    start: tuple
    finished: Optional[float] = None
    step: Optional[float] = None
    chop_size: float = 0.0
    depth_step: Optional[float] = None
    stock_top: Optional[float] = None
    most_moves: int = MOST_MOVES
    feed_per: str = "min"


def check(request):
    """Raise CycleError for a request that cannot be done; every rule of the cycle's geometry stands here."""
    r = request
    if r.tool_radius <= 0:
        raise CycleError("tool diameter {d} is not above 0 mm", "load a tool with a diameter", d=2 * r.tool_radius)
    if r.radius <= 0:
        raise CycleError("radius I{i} is not above 0", "use the radius of the hole", i=r.radius)
    if 0.0 < r.radius - r.tool_radius < MIN_PATH_RADIUS:
        raise CycleError(
            "radius I{i} is less than {least} larger than the tool radius {t}",
            "use a larger I or a smaller tool",
            i=r.radius,
            least=MIN_PATH_RADIUS,
            t=r.tool_radius,
        )
    if r.radius <= r.tool_radius:
        raise CycleError(
            "radius I{i} is not larger than the tool radius {t}",
            "use I above {t} or a smaller tool",
            i=r.radius,
            t=r.tool_radius,
        )
    check_heights(r)
    check_feeds(r)
    check_chop_size(r)
    check_depth_step(r)
    _check_pocket(r)


def _check_pocket(r):
    """The rules of K and Q."""
    if r.finished is None:
        if r.step is not None:
            raise CycleError("step Q{q} without a finished radius K", "add K, or leave Q out", q=r.step)
        return
    if r.finished < r.radius - EQUAL:
        raise CycleError(
            "finished radius K{k} is smaller than the first radius I{i}",
            "use K of {i} or more",
            k=r.finished,
            i=r.radius,
        )
    if r.step is None:
        raise CycleError(
            "finished radius K{k} without a radial step Q", "add Q of at most {d}", k=r.finished, d=2 * r.tool_radius
        )
    check_step("radial step", "Q", r.step, 2 * r.tool_radius, " and would leave rings")
    if r.finished / r.step > MAX_PASSES:
        raise CycleError(f"radial step Q{{q}} needs more than {MAX_PASSES} rings", "use a larger Q", q=r.step)


def finished_radius(request):
    """Radius (mm) of the hole as it will be: K, or I without K."""
    return request.radius if request.finished is None else request.finished


def leaves_slug(request):
    """Whether the circle leaves anything inside it."""
    return request.finished is None and request.radius > 2 * request.tool_radius


def chop_parts(request):
    """Into how many parts along each axis the slug is divided; 1: not at all."""
    if not leaves_slug(request):
        return 1
    return _cached_parts(2 * request.radius, request.tool_radius, request.chop_size)


def largest_piece(request):
    """Size (mm) of the largest piece that comes loose; 0.0 where none does."""
    if not leaves_slug(request):
        return 0.0
    return _cached_piece(2 * request.radius, request.tool_radius, chop_parts(request))


# The search for n is the only slow step (to 0.1 s); panels repeat few sizes, and the preview asks again.
_cached_parts = lru_cache(maxsize=256)(disc.choose_parts)
_cached_piece = lru_cache(maxsize=256)(disc.disc_piece)


@lru_cache(maxsize=64)
def hole_plan(request: HoleRequest) -> CyclePlan:
    """The whole cycle.  Raises CycleError, before any move, if it cannot be done."""
    check(request)
    levels = depth_levels(request.clearance, request.bottom, request.depth_step, request.stock_top)
    mover, lines = Mover(request), _lines_in_order(request, len(levels))
    check_moves(len(levels) * (4 * len(lines) + _circle_moves(request)), request, "use a larger J or Q")
    for line in lines:
        cut_line(mover, line, request.tool_radius, levels)
    if leaves_slug(request):
        _cut_slug_circle(mover, request, levels)
    else:
        _cut_pocket(mover, request, levels)
    mover.up()
    mover.rapid(x=request.x, y=request.y)
    return CyclePlan(tuple(mover.moves), report=partial(_report, request))


def _report(request):
    """What becomes of the slug."""
    parts = chop_parts(request)
    return Report("hole", dict(chopped=parts > 1, pieces=parts, largest_piece_mm=largest_piece(request)))


# ---- chop lines -------------------------------------------------------------------------------------------------


def _lines_in_order(request, pass_count):
    """Directed chop lines, shortest travel first to last."""
    parts = chop_parts(request)
    if parts == 1:
        return []
    groups = disc.disc_lines(request.x, request.y, request.radius, request.tool_radius, parts)
    return order_lines(groups, request.start[:2], (request.x, request.y), *ends(request.tool_radius, pass_count))


def _circle_moves(request):
    """How many moves one pass of the circle or the pocket takes, about."""
    return 5 if leaves_slug(request) else 3 + 2 * len(pocket_rings(request))


# ---- circles ----------------------------------------------------------------------------------------------------


def _wall_direction(request, here):
    """The axis direction (unit vector) in which the circle is met: the nearest to where the tool is."""
    directions = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
    return max(directions, key=lambda u: round(u[0] * (here[0] - request.x) + u[1] * (here[1] - request.y), 6))


def _cut_slug_circle(mover, request, levels):
    """The circle around a slug: per pass plunge, lead circle, in along half of it, full turn, out along the rest."""
    path = request.radius - request.tool_radius
    lead = min(path / 2, request.tool_radius)
    at = _point_on_ray(request, _wall_direction(request, mover.xy))
    inside, centre, wall = at(path - 2 * lead), at(path - lead), at(path)
    mover.over(inside)
    for z in levels:
        mover.plunge(z)
        for end, about in ((inside, centre), (wall, centre), (wall, (request.x, request.y)), (inside, centre)):
            mover.arc(end, about, request.ccw)


def pocket_rings(request):
    """Radii (mm) of the tool's circles in a pocket, rising: I, I + Q, ... K, less the tool's radius.

    Departs from Haas where the first ring would leave a core (I above three tool radii, the plunge at the centre
    included): then rings inside it, Q apart, come first, so that a pocket is always cleared.
    """
    first, last = request.radius - request.tool_radius, finished_radius(request) - request.tool_radius
    rings = [first]
    if request.finished is not None:
        step = min(request.step, 2 * request.tool_radius)
        if first > 2 * request.tool_radius + EQUAL:
            inner = math.ceil(first / step - EQUAL) - 1
            rings = [first - step * k for k in range(inner, 0, -1)] + rings
        outer = math.ceil((last - first) / step - EQUAL)
        rings += [first + step * k for k in range(1, outer)]
        if outer > 0:
            rings.append(last)
    return [ring for ring in rings if ring >= MIN_PATH_RADIUS]


def _cut_pocket(mover, request, levels):
    """Rings from the centre out, joined by half circles tangent to both; nothing is left standing."""
    rings = pocket_rings(request)
    centre = (request.x, request.y)
    mover.over(centre)
    for number, z in enumerate(levels):
        if number:
            mover.line(centre)
        mover.plunge(z)
        before, side = 0.0, 1.0
        for ring in rings:
            at = _point_on_ray(request, (side, 0.0))
            mover.arc(at(ring), at((ring - before) / 2), request.ccw)
            mover.arc(at(ring), centre, request.ccw)
            before, side = ring, -side
        at = _point_on_ray(request, (-side, 0.0))
        lead = min(before / 2, request.tool_radius)
        mover.arc(at(before - 2 * lead), at(before - lead), request.ccw)


def _point_on_ray(request, toward):
    """distance (mm) -> the point that far from the centre in a direction."""
    return lambda distance: (request.x + toward[0] * distance, request.y + toward[1] * distance)
