"""G77 / G78: a contour, roughed or finished from its finish shape alone.  ContourRequest -> moves; pure, mm.

Called by glue/contour.py.  Sources: JP H07-47256 B2 (tool paths of any tool from the one finish shape) through
geometry/offset.py; the approach from the approaching method of area machining (an angle to the work plane, a height, the
projection normal to the outline).

Order of work, and why:
 1. The path of every radial pass is the offset of the finish shape itself by tool radius + allowance + a multiple of
    the step, never of the pass before: nothing adds up.
 2. One radial pass: each path to full depth before the next one, at one place, so without rapids between its depths.
    Several: level by level, from the outside in, so that no pass meets more than the step.
 3. From one radial pass to the next at the same place the tool stays down: its lead-in has cleared the way.
 4. G78 of a closed contour from inside: the slug is chopped first (contour_chop.py).  Chopped or not, where one is left
    the lead-in is a full circle, so that the tool leaves the wall through an open kerf.
 5. Rapids run on the clearance plane or above, or straight up to it; below it every move down or across is a feed.

Where the tool enters and leaves, never through the finish shape: every approach is held against the whole contour.
 - K given: down to the point PA, which lies K above the start point Pi on a straight line that makes the approach angle
   with the work plane and is seen normal to the outline from above, away from the wall; along it to Pi, and at the end
   mirrored.  Departure from the source: it goes to PA by rapid; here the part of the way below the clearance plane is a
   feed.  PA may lie in the stock, and at the second depth it does.
 - else: straight down at a point beside the path, two lead radii from it, and in along half a circle tangent to it.  The
   lead radius is that of the tool or, in narrow places, a part of it; no mark is left on the finished wall.
 A closed path is entered where its contour starts or, when there is no room, in the middle of the longest element with
 room.  Where there is room nowhere the tool goes straight down on the path, and a note says so.
 The path round a chopped slug begins at the end of a chop line or well away from all of them: begun just behind one, it
 leaves a horn on the piece there until its own end (docs/Chop.md).
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Optional

import numpy as np

from chipwise.cycles.chop_lines import depths
from chipwise.cycles.common_words import (
    EQUAL, MOST_MOVES, check_chop_size, check_depth_step, check_feeds, check_heights, check_moves, check_step, gap_notes)
from chipwise.cycles.contour_chop import ChopPlan, ChopRequest, chop_moves, chop_plan
from chipwise.errors import Area, CycleError
from chipwise.geometry import elements as runs
from chipwise.geometry.contour import make_contour, refuse_nearly_closed
from chipwise.geometry.judge import clear_lines, depths as tool_depths, make_judge
from chipwise.geometry.necks import UnreachableRegion
from chipwise.geometry.offset import LEFT, RIGHT, offset_contour
from chipwise.geometry.slug import BRIDGE
from chipwise.geometry.tolerances import CONNECT_MM
from chipwise.moves import Arc, Line, Rapid

SIDES = {41: LEFT, 42: RIGHT}

# Shares of the tool's radius that are tried as lead radius.
LEADS = (1.0, 0.5, 0.25, 0.125)

# An approach may come this much nearer to the finish shape than the path. mm; ten times the kernel's own tolerance,
# a hundredth of what six decimals of an inch leave
NEAR = 1e-6

# Radial passes: each is an offset of its own, some hundredths of a second for a long contour.
MAX_RINGS = 200

# A path's start this near to a chop line lies on it. mm; a line ends up to slug.LINE_SAGITTA beside the path
ON_LINE = 1e-3

# A slanted approach that runs farther to the side comes from a slip of the finger. mm
MAX_APPROACH = 1000.0

# Smaller leftovers are not worth a message. mm2
AREA = 0.01


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
    depth_step      J: deepest pass; None: one pass
    approach        K: height of the slanted approach; None: vertical plunge
    angle           of the slanted approach to the work plane, rad
    feed            mm/min (mm per revolution under G95)
    plunge_feed     E, same unit
    start           (x, y, z) where the tool stands
    finish          G78: the notes say what the tool does not reach
    chop_size       H: no piece that comes loose may reach it; 0: do not chop (G78)
    close_gap       gaps of the shape up to this width are closed
    most_moves      a cycle of more is refused
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
    approach: Optional[float] = None
    angle: float = math.radians(30.0)
    finish: bool = False
    chop_size: float = 0.0
    close_gap: float = CONNECT_MM
    most_moves: int = MOST_MOVES


@dataclass(frozen=True)
class ContourPlan:
    """moves; notes: (text with {names} of lengths, {name: mm}) for the operator; chop: what becomes of the slug (G78 of
    a closed contour from inside)."""

    moves: tuple
    notes: tuple
    chop: ChopPlan = ChopPlan(())


def check(r):
    """Raise CycleError for a request that cannot be done, as far as its numbers tell."""
    if r.side not in SIDES:
        raise CycleError(f"side P{r.side:g} is neither 41 nor 42", "use P41 (tool left of the contour) or P42 (right)")
    if r.tool_radius <= 0:
        raise CycleError("tool diameter {d} is not above 0 mm", "load a tool with a diameter", d=2 * r.tool_radius)
    if r.allowance < 0 and r.tool_radius + r.allowance <= EQUAL:
        raise CycleError("allowance I{i} takes away the whole tool radius {t}", "use I of 0 or more", i=r.allowance,
                         t=r.tool_radius)
    if r.allowance < 0:
        raise CycleError("allowance I{i} is negative: it would cut into the finish shape", "use I of 0 or more",
                         i=r.allowance)
    check_heights(r)
    check_feeds(r)
    _check_passes(r)
    if r.approach is not None and r.approach <= 0:
        raise CycleError("approach height K{k} is not above 0", "use K above 0, or leave it out to plunge", k=r.approach)
    if not 0 < r.angle <= math.pi / 2 + 1e-12:
        raise CycleError(f"approach angle {math.degrees(r.angle):g} is not above 0 and up to 90 degrees",
                         "set #<_chipwise_approach_angle>")
    if r.approach is not None and r.approach / math.tan(r.angle) > MAX_APPROACH:
        raise CycleError(f"the approach of K{{k}} at {math.degrees(r.angle):g} degrees begins {{out}} beside the contour, "
                         "more than {most}", "use a smaller K or a larger #<_chipwise_approach_angle>",
                         k=r.approach, out=r.approach / math.tan(r.angle), most=MAX_APPROACH)
    check_chop_size(r)


def _check_passes(r):
    """The rules of J, L and D."""
    check_depth_step(r)
    if not 1 <= r.passes <= MAX_RINGS or r.passes != int(r.passes):
        raise CycleError(f"L{r.passes:g} radial passes are not from 1 to {MAX_RINGS}", "use such an L")
    if r.step is not None:
        step = r.step if r.passes > 1 else min(r.step, 2 * r.tool_radius)      # not used in a single pass
        check_step("radial step", "D", step, 2 * r.tool_radius, " and would leave ridges")
    if r.passes > 1 and r.step is None:
        raise CycleError(f"L{r.passes:g} radial passes without a step D", "add D of at most {t}", t=2 * r.tool_radius)


@lru_cache(maxsize=16)
def contour_plan(request):
    """ContourPlan of a request.  Raises CycleError or ContourError, before any move, where it cannot be done."""
    check(request)
    contour = make_contour(list(request.shape), request.close_gap)
    refuse_nearly_closed(contour, request.close_gap)
    room = _Room(request, contour)
    results = [_offset(request, contour, distance) for distance in radial_distances(request)]
    if not results[-1].paths:
        raise CycleError("the tool ({d}) fits nowhere on this side of the contour", "use a smaller tool"
                         + (", or less allowance" if request.allowance else "") + ", or the other side",
                         d=2 * request.tool_radius)
    passes = depths(request.clearance, request.bottom, request.depth_step)
    count = len(passes) * sum(len(path.elements) + 6 for result in results for path in result.paths)
    check_moves(count, request, "use a larger J or D")
    chop = _chop(request, contour, results[-1])
    check_moves(count + 4 * len(passes) * len(chop.segments), request, "use a larger J or chop size")
    kerfs = _Kerfs(chop.segments, request.tool_radius)
    ways = [[_way(room, path, kerfs) for path in result.paths] for result in results]
    tool = _Tool(request, room, slug=bool(chop.chops))
    tool.chop(chop, ways[-1])
    if len(ways) == 1:
        for way in ways[0]:
            for z in passes:
                tool.run(way, z)
    else:
        for z in passes:
            for way in (way for ring in ways for way in ring):
                tool.run(way, z)
    tool.moves.append(Rapid(z=request.clearance))
    notes = gap_notes((contour,)) + _open_notes(request, contour) + _reach_notes(request, results[-1]) + _entry_notes(request, [way for ring in ways for way in ring])
    return ContourPlan(tuple(tool.moves), notes + _chop_notes(request, chop), chop)


def _chop_notes(request, chop):
    """What the operator should know about the slug."""
    if not chop.too_small:
        return ()
    return (("no piece below the chop size {h} is left by a tool of {d}: the slug is cut to chips as a whole",
             {"h": request.chop_size, "d": 2 * request.tool_radius}),)


def radial_distances(request):
    """Distance (mm) of the tool's centre from the finish shape in each radial pass, from the outside in."""
    last = request.tool_radius + request.allowance
    step = min(request.step or 0.0, 2 * request.tool_radius)
    return [last + step * k for k in range(int(request.passes) - 1, -1, -1)]


def _offset(request, contour, distance):
    result = offset_contour(contour, SIDES[request.side], distance)
    if result.loose:
        raise CycleError("the path of the tool ({d}) along this contour could not be closed", "change the allowance I "
                         "or the tool a little, and report the contour", d=2 * request.tool_radius)
    return result


def _chop(request, contour, result):
    """ChopPlan of what comes loose when a closed contour is cut from inside by G78."""
    inside = contour.closed and (runs.area(contour.elements) > 0.0) == (SIDES[request.side] == LEFT)
    if not request.finish or not inside:
        return ChopPlan(())
    paths = [path.elements for path in result.paths if runs.lengths(path.elements).any()]
    return chop_plan(paths, [], request.tool_radius, request.chop_size)


# ---- entering and leaving ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Gate:
    """How the tool comes to a point of its path, or leaves it: the point (x, y), its normal away from the wall, and

    height    of the slanted way, 0 for none
    out       distance of the place where the tool goes down or up, along the normal
    lead      radius of the half circle, 0 for none
    """

    point: tuple
    normal: tuple
    height: float = 0.0
    out: float = 0.0
    lead: float = 0.0

    def at(self, distance):
        return self.point[0] + self.normal[0] * distance, self.point[1] + self.normal[1] * distance


class _Room:
    """Where the tool may go down, held against the whole contour."""

    def __init__(self, request, contour):
        self.request = request
        self.side = SIDES[request.side]
        self.judge = make_judge((contour,))
        self.limit = request.tool_radius + request.allowance
        self._links = {}

    def normals(self, e, index, t):
        """Unit normals (m, 2) away from the wall at parameters t of elements index of a path."""
        tangent = runs.tangent_at(e, index, t)
        return -self.side * np.stack((-tangent[:, 1], tangent[:, 0]), axis=1)

    def for_lead(self, point, normal, lead):
        """Which points (m,) bool have room for a half circle of radius lead: the disc it runs round stays clear."""
        return tool_depths(self.judge, point + normal * lead, self.limit + lead) <= NEAR

    def for_slant(self, point, normal, out):
        """Which points (m,) bool have room for the slanted way, as seen from above."""
        if out <= EQUAL:
            return tool_depths(self.judge, point, self.limit) <= NEAR
        return clear_lines(self.judge, point, point + normal * out, self.limit - NEAR)

    def for_free_slant(self, point, normal, out):
        """As for_slant, and the tool touches nothing but the place it comes to."""
        return self.for_slant(point, normal, out) & (tool_depths(self.judge, point + normal * out, self.limit + out) <= NEAR)

    def for_link(self, start, end):
        """Whether the tool may go straight from one place (x, y) to another; the same ones come at every depth."""
        if (start, end) not in self._links:
            self._links[start, end] = bool(clear_lines(self.judge, np.array([start]), np.array([end]), self.limit - NEAR)[0])
        return self._links[start, end]

    def gates(self):
        """Kinds of gates, best first: (height, out, lead, which points have room)."""
        r = self.request
        if r.approach is not None:
            out = r.approach / math.tan(r.angle)
            yield r.approach, out, 0.0, lambda p, n: self.for_free_slant(p, n, out)
            yield r.approach, out, 0.0, lambda p, n: self.for_slant(p, n, out)
        for share in LEADS:
            lead = share * r.tool_radius
            yield 0.0, 2 * lead, lead, lambda p, n: self.for_lead(p, n, lead)


@dataclass(frozen=True, eq=False)
class _Way:
    """A path as it is run: its elements from the place of entry, the gates at both ends."""

    elements: runs.Elements
    enter: _Gate
    leave: _Gate


class _Kerfs:
    """The chop lines, cut before the path is: where it may begin so that no piece falls with a horn (docs/Chop.md).

    That is where it meets a line's end, or so far from all lines that what lies between holds the piece.
    """

    def __init__(self, segments, tool_radius):
        self.radius = tool_radius
        ends = np.asarray(segments, float).reshape(-1, 2, 2)
        self.lines = runs.make_lines(ends[:, 0], ends[:, 1])
        self.ends = ends.reshape(-1, 2)

    def _distances(self, points):
        """Distance (m, lines) mm of points (m, 2) from every line."""
        which, line = np.divmod(np.arange(len(points) * len(self.lines)), max(len(self.lines), 1))
        return runs.distances(self.lines, line, points[which]).reshape(len(points), len(self.lines))

    def clear_of(self, points, normals, out=0.0, lead=0.0):
        """Which points (m,) bool a path may begin at by a gate of that kind."""
        reach = [(0.0, 0.0), (lead, lead)] if lead else \
            [(at, 0.0) for at in np.linspace(0.0, out, 1 + math.ceil(2 * out / self.radius))]
        on = self._distances(points) <= ON_LINE
        far = np.all([self._distances(points + normals * at) >= 2 * self.radius + more + BRIDGE for at, more in reach], axis=0)
        return np.all(on | far, axis=1)

    def places(self, e):
        """Where lines end on a path: (index (m,), parameter (m,)), in its order; none where two of its elements meet."""
        if not len(self.ends) or not len(e):
            return np.zeros(0, int), np.zeros(0)
        which, element = np.divmod(np.arange(len(self.ends) * len(e)), len(e))
        off = runs.distances(e, element, self.ends[which]).reshape(len(self.ends), len(e))
        index = off.argmin(axis=1)
        t = runs.parameters(e, index, self.ends)
        inner = np.minimum(t, 1 - t) * runs.lengths(e)[index] > ON_LINE
        good = np.flatnonzero((off.min(axis=1) <= ON_LINE) & inner)
        good = good[np.lexsort((t[good], index[good]))]
        return index[good], t[good]


def from_line_end(path, segments, tool_radius):
    """A closed path from the first line's end on it, as it is where none is: for paths run without an approach."""
    index, t = _Kerfs(segments, tool_radius).places(path)
    return _turned(path, int(index[0]), float(t[0])) if len(index) else path


def _way(room, path, kerfs):
    """The _Way of a path of the kernel."""
    if len(path.elements) and not runs.lengths(path.elements).any():
        spot = _Gate(tuple(path.elements.start[0].tolist()), (0.0, 0.0))
        return _Way(runs.take(path.elements, []), spot, spot)
    return _closed_way(room, path.elements, kerfs) if path.closed else _open_way(room, path.elements)


def _ends(room, e):
    """Points and normals (2, 2) at the start and the end of a run."""
    index, t = np.array([0, len(e) - 1]), np.array([0.0, 1.0])
    return runs.point_at(e, index, t), room.normals(e, index, t)


def _open_way(room, e):
    """Entered at its start, left at its end, each by the best gate there is room for."""
    points, normals = _ends(room, e)
    gates = []
    for k in (0, 1):
        point, normal = points[k:k + 1], normals[k:k + 1]
        kind = next(((h, o, l) for h, o, l, fits in room.gates() if fits(point, normal)[0]), (0.0, 0.0, 0.0))
        gates.append(_gate(point[0], normal[0], *kind))
    return _Way(e, *gates)


def _closed_way(room, e, kerfs):
    """Entered and left where the best gate has room: at its start, at the end of a chop line, or in the middle of an
    element, longest first, of equal ones the first.  Where none has that keeps clear of chop lines: straight down in
    the kerf at a line's end."""
    ends, end_normals = _ends(room, e)
    order = np.argsort(-np.round(runs.lengths(e), 6), kind="stable")
    index, t = kerfs.places(e)
    at_lines = len(index)
    index, t = np.concatenate((index, order)), np.concatenate((t, np.full(len(order), 0.5)))
    points, normals = runs.point_at(e, index, t), room.normals(e, index, t)
    for height, out, lead, fits in room.gates():
        if fits(ends, end_normals).all() and kerfs.clear_of(ends, end_normals, out, lead).all():
            return _Way(e, _gate(ends[0], end_normals[0], height, out, lead), _gate(ends[1], end_normals[1], height, out,
                                                                                    lead))
        good = np.flatnonzero(fits(points, normals) & kerfs.clear_of(points, normals, out, lead))
        if len(good):
            return _way_from(e, int(index[good[0]]), float(t[good[0]]),
                             _gate(points[good[0]], normals[good[0]], height, out, lead))
    if at_lines:
        return _way_from(e, int(index[0]), float(t[0]), _gate(points[0], normals[0]))
    if len(kerfs.ends):
        return _closed_way(room, e, _Kerfs((), kerfs.radius))
    return _Way(e, _gate(ends[0], end_normals[0]), _gate(ends[1], end_normals[1]))


def _way_from(e, k, t, gate):
    """The way along a closed run from parameter t of its element k."""
    return _Way(_turned(e, k, t), gate, gate)


def _gate(point, normal, height=0.0, out=0.0, lead=0.0):
    return _Gate(tuple(point.tolist()), tuple(normal.tolist()), height, out, lead)


def _turned(e, k, t):
    """A closed run that begins at parameter t, above 0 and below 1, of its element k."""
    index = np.array([k])
    middle = runs.point_at(e, index, np.array([t]))
    angle, sweep = e.start_angle[index], e.sweep[index]
    first = runs.Elements(e.start[index], middle, e.centre[index], e.radius[index], angle, t * sweep)
    second = runs.Elements(middle, e.end[index], e.centre[index], e.radius[index], angle + t * sweep, (1 - t) * sweep)
    every = np.arange(len(e))
    return runs.join((second, runs.take(e, every[k + 1:]), runs.take(e, every[:k]), first))


# ---- moves -----------------------------------------------------------------------------------------------------------


class _Tool:
    """Collects moves and knows where the tool stands."""

    def __init__(self, request, room, slug):
        self.request, self.room, self.slug = request, room, slug
        self.moves = []
        self.xy, self.z = request.start[:2], request.start[2]

    def _add(self, move):
        self.moves.append(move)
        if move.x is not None:
            self.xy = (move.x, move.y)
        if move.z is not None:
            self.z = move.z

    def chop(self, plan, ways):
        """The chop lines, before anything else."""
        r = self.request
        first = ways[0].enter
        for move in chop_moves(plan, ChopRequest(r.bottom, r.clearance, r.tool_radius, r.feed, r.plunge_feed, r.start,
                                                 first.at(first.out), r.depth_step)):
            self._add(move)

    def run(self, way, z):
        """One path at one depth, with its approach and departure."""
        r, enter, leave = self.request, way.enter, way.leave
        ccw = SIDES[r.side] == LEFT
        self._down(enter.at(enter.out), z + enter.height)
        if enter.height:
            self._add(Line(x=enter.point[0], y=enter.point[1], z=z, feed=r.feed))
        elif enter.lead:
            if self.slug:
                self._add(_arc(enter.at(enter.out), enter.at(enter.lead), ccw, r.feed))
            self._add(_arc(enter.point, enter.at(enter.lead), ccw, r.feed))
        for move in _along(way.elements, r.feed):
            self._add(move)
        if leave.height:
            x, y = leave.at(leave.out)
            self._add(Line(x=x, y=y, z=z + leave.height, feed=r.feed))
        elif leave.lead:
            self._add(_arc(leave.at(leave.out), leave.at(leave.lead), ccw, r.feed))

    def _down(self, point, z):
        """To a point, then down: from the pass beside it straight across, else on the clearance plane."""
        r = self.request
        if self.moves and self.z >= z - EQUAL and self._beside(point):
            if math.dist(point, self.xy) > EQUAL:
                self._add(Line(x=point[0], y=point[1], feed=r.feed))
        else:
            if self.moves or self.z < r.clearance - EQUAL:
                self._add(Rapid(z=r.clearance))
            self._add(Rapid(x=point[0], y=point[1]))
            if z > r.clearance - EQUAL or self.z > r.clearance + EQUAL:
                self._add(Rapid(z=max(z, r.clearance)))
        if z < self.z - EQUAL:
            self._add(Line(z=z, feed=r.plunge_feed))

    def _beside(self, point):
        """Whether a point belongs to the pass where the tool is, or to a radial pass beside it: cleared already."""
        far = math.dist(point, self.xy)
        return far <= EQUAL or far <= (self.request.passes - 1) * (self.request.step or 0.0) + EQUAL \
            and self.room.for_link(self.xy, point)


def _along(e, feed):
    """Moves along a run."""
    for k in range(len(e)):
        x, y = e.end[k].tolist()
        if e.is_arc[k]:
            yield _arc((x, y), tuple(e.centre[k].tolist()), bool(e.sweep[k] > 0.0), feed)
        else:
            yield Line(x=x, y=y, feed=feed)


def _arc(end, centre, ccw, feed):
    return Arc(x=end[0], y=end[1], cx=centre[0], cy=centre[1], ccw=ccw, feed=feed)


# ---- what the operator should know -------------------------------------------------------------------------------------


def _reach_notes(request, result):
    """What of the finish shape stays uncut by the finishing tool."""
    if not request.finish:
        return ()
    places = [u for u in result.unreachable if getattr(u, "area", AREA) >= AREA]
    corners = [u for u in places if _is_corner(u, request.tool_radius)]
    places = [u for u in places if u not in corners]
    notes = ()
    if places:
        area = sum(getattr(place, "area", 0.0) for place in places)
        stay = "; {area} stay" if area >= AREA else ""
        many = f"{len(places)} places" if len(places) > 1 else "one place"
        notes += ((f"the tool ({{d}}) does not fit in {many} (line {_listed(places)}{stay}): use a smaller tool there",
                   {"d": 2 * request.tool_radius, "area": Area(area)}),)
    if corners:
        many = f"{len(corners)} inside corners keep" if len(corners) > 1 else "one inside corner keeps"
        notes += ((f"{many} the tool's radius of {{r}} (line {_listed(corners)})", {"r": request.tool_radius}),)
    return notes


def _is_corner(place, tool_radius):
    """Whether an unreachable region is a sharp inside corner, in which any tool leaves something: two elements that no
    tool of this radius is too large for, and the tool's edge."""
    if not isinstance(place, UnreachableRegion) or place.holes or len(place.boundary) != 3:
        return False
    arc_radii = place.boundary.radius[place.boundary.is_arc]
    return bool((arc_radii >= tool_radius * (1 - 1e-6)).all())


def _listed(places):
    """Source lines of unreachable places, eight at most."""
    lines = sorted({line for place in places for line in place.lines})
    return ", ".join(map(str, lines[:8])) + (", .." if len(lines) > 8 else "")


def _open_notes(request, contour):
    """A piece that an open contour lets fall although it is to be chopped: its ends are nearer than the tool is wide."""
    e = contour.elements
    gap = math.dist(e.end[-1], e.start[0])
    if contour.closed or not request.finish or not request.chop_size or gap >= 2 * request.tool_radius:
        return ()
    return (("the contour is open by {gap}, less than the tool ({d}): what comes loose is not chopped; close the contour",
             {"gap": gap, "d": 2 * request.tool_radius}),)


def _entry_notes(request, ways):
    """Where the tool could not come in as asked."""
    plunges = [way.enter for way in ways if not way.enter.out and not way.enter.height and len(way.elements)]
    notes = ()
    if request.approach is not None and any(not way.enter.height for way in ways):
        gate = next(way.enter for way in ways if not way.enter.height)
        notes += (("no room for the slanted approach of K{k} at X{x} Y{y}: plunged vertically",
                   {"k": request.approach, "x": gate.point[0], "y": gate.point[1]}),)
    if plunges and request.finish:
        notes += (("no room beside the path at X{x} Y{y}: plunged at the finished wall",
                   {"x": plunges[0].point[0], "y": plunges[0].point[1]}),)
    return notes
