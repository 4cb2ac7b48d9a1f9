# SPDX-License-Identifier: GPL-2.0-or-later
"""How the tool enters and leaves a path along a contour, never through the finish shape.

Called by contour.py (G77, G78).  Every lead-in is checked against the whole contour.  Source of the slanted one: the
approaching method of area machining (an angle to the work plane, a height, the projection normal to the outline).

 - K given: down to the point PA, which lies K above the start point Pi on a straight line that makes the approach angle
   with the work plane and is seen normal to the outline from above, away from the wall; along it to Pi, and at the end
   mirrored.  Departure from the source: it goes to PA by rapid; here the part below the clearance plane is a feed.  PA
   may lie in the stock, and at the second depth it does.
 - else: straight down at a point beside the path, two lead radii from it, and in along half a circle tangent to it.
   The lead radius is that of the tool or, in narrow places, a part of it; no mark is left on the finished wall.
 - A closed path is entered where its contour starts or, if there is no clearance, in the middle of the longest element
   that has clearance.  If there is clearance nowhere the tool goes straight down on the path.
 - One that follows another radial pass is entered beside the end of that one, if the tool cannot go straight to where
   it would be entered else.
 - The path round a chopped slug begins at the end of a chop line or well away from all of them: begun just behind one,
   it leaves a spur on the piece there until its own end (docs/design/chop.md).
"""

import math
from dataclasses import dataclass
from typing import Callable, Iterator, NamedTuple, Optional

import numpy as np

from chipwise.cycles.word_checks import EQUAL
from chipwise.geometry.base import chains, elements
from chipwise.geometry.base.clearance import clear_lines, gouge_depths, make_clearance_check
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.slug.grid import BRIDGE

# Shares of the tool's radius that are tried as lead radius.
LEADS = (1.0, 0.5, 0.25, 0.125)

# An approach may come this much nearer to the finish shape than the path. mm; ten times the kernel's own tolerance,
# a hundredth of what six decimals of an inch leave
NEAR = 1e-6

# A path's start this near to a chop line lies on it. mm; a line ends up to slug.LINE_SAGITTA beside the path
ON_LINE = 1e-3

# Elements in whose middle a path that follows another may be entered.
MOST_BESIDE = 8

# A slanted approach that runs farther to the side comes from a slip of the finger. mm
MAX_APPROACH = 1000.0


@dataclass(frozen=True)
class LeadIn:
    """How the tool comes to a point of its path, or leaves it: the point (x, y), its normal away from the wall, and

    height    of the slanted lead-in, 0 for none
    out       distance along the normal at which the tool goes down or up
    lead      radius of the half circle, 0 for none
    """

    point: tuple
    normal: tuple
    height: float = 0.0
    out: float = 0.0
    lead: float = 0.0

    def at(self, distance):
        """(x, y) at a distance from the point, away from the wall."""
        return self.point[0] + self.normal[0] * distance, self.point[1] + self.normal[1] * distance


@dataclass(frozen=True, eq=False)
class LedPath:
    """A path as it is run: its elements from the point of entry, and how it is entered and left."""

    elements: Elements
    enter: LeadIn
    leave: LeadIn


class Before(NamedTuple):
    """The path before: how it is left, and whether the tool can go straight from there to a lead-in."""

    leave: LeadIn
    linked: Callable[[LeadIn], bool]


class Kind(NamedTuple):
    """A kind of lead-in: sizes as in LeadIn; clear: which points (m,) bool have clearance for it, of points and normals
    (m, 2)."""

    height: float
    out: float
    lead: float
    clear: Callable

    def lead_in(self, point, normal) -> LeadIn:
        """The lead-in of this kind at a point (2,)."""
        return LeadIn(tuple(point.tolist()), tuple(normal.tolist()), self.height, self.out, self.lead)


STRAIGHT_DOWN = Kind(0.0, 0.0, 0.0, lambda point, normal: np.ones(len(point), bool))


class LeadInClearance:
    """Where the tool may go down, checked against the whole contour."""

    def __init__(self, request, contour, side):
        """request: with .tool_radius, .allowance, .approach and .angle; side: the kernel's LEFT or RIGHT."""
        self.request, self.side = request, side
        self.check = make_clearance_check((contour,))
        self.limit = request.tool_radius + request.allowance
        self._links = {}

    def normals(self, e: Elements, index, t):
        """Unit normals (m, 2) away from the wall at parameters t of elements index of a path."""
        tangent = elements.tangent_at(e, index, t)
        return -self.side * np.stack((-tangent[:, 1], tangent[:, 0]), axis=1)

    def for_lead(self, point, normal, lead):
        """Which points (m,) bool have clearance for a half circle of radius lead: the disc that it runs round is
        clear."""
        return gouge_depths(self.check, point + normal * lead, self.limit + lead) <= NEAR

    def for_slant(self, point, normal, out):
        """Which points (m,) bool have clearance for the slanted lead-in, seen from above."""
        if out <= EQUAL:
            return gouge_depths(self.check, point, self.limit) <= NEAR
        return clear_lines(self.check, point, point + normal * out, self.limit - NEAR)

    def for_free_slant(self, point, normal, out):
        """As for_slant, and the tool touches nothing but the point it comes to."""
        free = gouge_depths(self.check, point + normal * out, self.limit + out) <= NEAR
        return self.for_slant(point, normal, out) & free

    def for_link(self, start, end):
        """Whether the tool may go straight from one point (x, y) to another; the same ones come at every depth."""
        if (start, end) not in self._links:
            clear = clear_lines(self.check, np.array([start]), np.array([end]), self.limit - NEAR)
            self._links[start, end] = bool(clear[0])
        return self._links[start, end]

    def kinds(self) -> Iterator[Kind]:
        """Kinds of lead-ins, best first."""
        r = self.request
        if r.approach is not None:
            out = r.approach / math.tan(r.angle)
            yield Kind(r.approach, out, 0.0, lambda p, n: self.for_free_slant(p, n, out))
            yield Kind(r.approach, out, 0.0, lambda p, n: self.for_slant(p, n, out))
        for share in LEADS:
            lead = share * r.tool_radius
            yield Kind(0.0, 2 * lead, lead, lambda p, n: self.for_lead(p, n, lead))


class ChopKerfs:
    """The chop lines, cut before the path is: where it may begin so that no piece falls with a spur
    (docs/design/chop.md).

    That is where it meets a line's end, or so far from all lines that what lies between holds the piece.
    """

    def __init__(self, segments, tool_radius):
        self.radius = tool_radius
        ends = np.asarray(segments, float).reshape(-1, 2, 2)
        self.lines = elements.make_lines(ends[:, 0], ends[:, 1])
        self.ends = ends.reshape(-1, 2)

    def _distances(self, points):
        """Distance (m, lines) mm of points (m, 2) from every line."""
        which, line = np.divmod(np.arange(len(points) * len(self.lines)), max(len(self.lines), 1))
        return elements.distances(self.lines, line, points[which]).reshape(len(points), len(self.lines))

    def clear_of(self, points, normals, kind: Kind):
        """Which points (m,) bool a path may begin at by a lead-in of that kind."""
        reach = (
            [(0.0, 0.0), (kind.lead, kind.lead)]
            if kind.lead
            else [(at, 0.0) for at in np.linspace(0.0, kind.out, 1 + math.ceil(2 * kind.out / self.radius))]
        )
        on = self._distances(points) <= ON_LINE
        far = np.all(
            [self._distances(points + normals * at) >= 2 * self.radius + more + BRIDGE for at, more in reach], axis=0
        )
        return np.all(on | far, axis=1)

    def line_ends(self, e: Elements):
        """Where lines end on a path: (index (m,), parameter (m,)), in its order; none where two of its elements
        meet."""
        if not len(self.ends) or not len(e):
            return np.zeros(0, int), np.zeros(0)
        which, element = np.divmod(np.arange(len(self.ends) * len(e)), len(e))
        off = elements.distances(e, element, self.ends[which]).reshape(len(self.ends), len(e))
        index = off.argmin(axis=1)
        t = elements.parameters(e, index, self.ends)
        inner = np.minimum(t, 1 - t) * elements.lengths(e)[index] > ON_LINE
        good = np.flatnonzero((off.min(axis=1) <= ON_LINE) & inner)
        good = good[np.lexsort((t[good], index[good]))]
        return index[good], t[good]


def led_path(clearance: LeadInClearance, path, kerfs: ChopKerfs, before: Optional[Before] = None) -> LedPath:
    """A path of the kernel with its lead-in and lead-out."""
    e = path.elements
    if len(e) and not elements.lengths(e).any():
        contact = LeadIn(tuple(e.start[0].tolist()), (0.0, 0.0))
        return LedPath(elements.take(e, []), contact, contact)
    if not path.closed:
        return _open(clearance, e)
    found = _closed(clearance, e, kerfs)
    return found if before is None or before.linked(found.enter) else _beside(clearance, e, kerfs, before) or found


def _ends(clearance, e):
    """Points and normals (2, 2) at the start and the end of a chain."""
    index, t = np.array([0, len(e) - 1]), np.array([0.0, 1.0])
    return elements.point_at(e, index, t), clearance.normals(e, index, t)


def _open(clearance, e):
    """Entered at its start, left at its end, each by the best lead-in that has clearance."""
    points, normals = _ends(clearance, e)
    chosen = []
    for k in (0, 1):
        point, normal = points[k : k + 1], normals[k : k + 1]
        kind = next((kind for kind in clearance.kinds() if kind.clear(point, normal)[0]), STRAIGHT_DOWN)
        chosen.append(kind.lead_in(point[0], normal[0]))
    return LedPath(e, *chosen)


def _closed(clearance, e, kerfs):
    """Entered and left where the best lead-in has clearance: at its start, at the end of a chop line, or in the middle
    of an element, longest first, of equal ones the first.  If none has that keeps clear of chop lines: straight down in
    the kerf at a line's end."""
    ends, end_normals = _ends(clearance, e)
    order = np.argsort(-np.round(elements.lengths(e), 6), kind="stable")
    index, t = kerfs.line_ends(e)
    at_lines = len(index)
    index, t = np.concatenate((index, order)), np.concatenate((t, np.full(len(order), 0.5)))
    points, normals = elements.point_at(e, index, t), clearance.normals(e, index, t)

    def begun_at(k, kind):
        lead_in = kind.lead_in(points[k], normals[k])
        return LedPath(chains.rotated(e, int(index[k]), float(t[k])), lead_in, lead_in)

    for kind in clearance.kinds():
        if kind.clear(ends, end_normals).all() and kerfs.clear_of(ends, end_normals, kind).all():
            return LedPath(e, *map(kind.lead_in, ends, end_normals))
        good = np.flatnonzero(kind.clear(points, normals) & kerfs.clear_of(points, normals, kind))
        if len(good):
            return begun_at(good[0], kind)
    if at_lines:
        return begun_at(0, STRAIGHT_DOWN)
    if len(kerfs.ends):
        return _closed(clearance, e, ChopKerfs((), kerfs.radius))
    return LedPath(e, *map(STRAIGHT_DOWN.lead_in, ends, end_normals))


def _beside(clearance, e, kerfs, before):
    """A closed path entered by the best lead-in to which the tool can go straight from the path before, or None:
    nearest to its end, else in the middle of one of the nearest elements."""
    foot, along = chains.snapped(e, *chains.nearest(e, before.leave.point)[1:])
    middle = elements.point_at(e, np.arange(len(e)), np.full(len(e), 0.5))
    near = np.argsort(np.hypot(*(middle - before.leave.point).T), kind="stable")[:MOST_BESIDE]
    index, t = np.concatenate(([foot], near)), np.concatenate(([along], np.full(len(near), 0.5)))
    points, normals = elements.point_at(e, index, t), clearance.normals(e, index, t)
    for kind in clearance.kinds():
        for k in np.flatnonzero(kind.clear(points, normals) & kerfs.clear_of(points, normals, kind)):
            lead_in = kind.lead_in(points[k], normals[k])
            if before.linked(lead_in):
                return LedPath(chains.rotated(e, int(index[k]), float(t[k])), lead_in, lead_in)
    return None
