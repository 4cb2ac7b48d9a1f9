"""Chopping the slug of any closed contour: which straight lines, in which direction.

Called by cycles/contour_chop.py.  Pure; mm.  docs/Chop.md has the method with a picture.

Source: JP H05-7134 B2 (1988), fig. 4 and 5, which divides a circle of diameter d into n parts along X and Y.  Symbols:
H the reference size, n the number of parts, here one for each of the two directions.

Where this departs from the patent:
 1. Any region of allowed tool centres instead of a circle: the inside of a closed centre path, without islands.  A line
    is clipped to that region, so no kerf leaves the contour.  It is left out where it meets no slug.
 2. The grid is turned, and has as many parts each way as the pieces need: of all directions and numbers looked at,
    those with the fewest lines, then with the shortest.
 3. A piece must fit a circle of diameter H; the pieces are computed, as for holes (chop.py, departure 1).

Why cells are enough: a point of the slug is at least a tool radius inside the region, so the foot of its perpendicular
on a scan line nearer than that is inside the region too, and so on the line cut there.  In the slug a kerf is the whole
strip of a tool's width; its ends lie outside.  So the pieces are the slug cut up by rectangles.
"""

import math
from dataclasses import dataclass

import numpy as np

from . import elements as runs
from . import regions
from .chop import MIN_LINE, PIECE_MARGIN, flat_segments, order_lines, piece_size

# A strip of stock thinner than this may break at any time and holds nothing: run-out, deflection and wear make a kerf
# some hundredths of a mm wider on either side than computed, so that the strip may not be there at all. mm
BRIDGE = 0.1

# A slug thinner than this is no piece but a chip; the drawings of its edges are not much finer. mm
HAIR = 0.01

# Lines that clear instead of dividing overlap by this at least, so that no fin is left between them. mm
OVERLAP = 0.02

# Arcs are drawn as chords this far off: for lines and for the slug. mm.  A line ends where its chord meets the first
# drawing, so its kerf may pass the contour by this much, less than half of the 0.001 mm allowed.  The slug is drawn
# larger by the second; finer chords make GEOS lose regions (platform: 15 of 3000 at 1e-4 mm).
LINE_SAGITTA = 4e-4
SLUG_SAGITTA = 1e-3

# Directions looked at: so many degrees apart, and so many of the contour's own straight lines, the longest.
ANGLE_STEP = 15
OWN_ANGLES = 4

# Directions nearer than this are one. rad
SAME_ANGLE = math.radians(0.5)

# Parts across one direction that the search looks at: it bounds the preview's time.  A slug that needs more is cleared.
MAX_PARTS = 400

# Of a grid with more cells than this the pieces are not counted one by one.
MAX_CELLS = 3000

# So many parts more are tried where the grid of fewest lines leaves a large piece on a thin bridge.
FINER = 2

# Then grids in its direction for pieces smaller than H, as shares of it.
SMALLER = (0.85, 0.7)

# A quick look at a grid takes about so many points at most.
PROBES = 8000

# Chords are counted at so many places across the slug.
COUNT_PLACES = 64


@dataclass(frozen=True)
class SlugChop:
    """How one slug is chopped.

    groups   two lists of scan lines in rising order, each a list of segments ((x0, y0), (x1, y1)), mm; may be empty
    angle    direction of the first group, rad; the second is square to it
    parts    into how many parts the slug is divided across the first and the second group; (1, 1): not chopped
    pieces   number of loose pieces after the contour's own pass; 0: nothing but chips is left
    largest  diameter of the smallest circle round the largest piece, mm
    too_small   whether the chop size is so small that this tool can leave no piece below it: all is cut to chips
    """

    groups: tuple
    angle: float
    parts: tuple
    pieces: int
    largest: float
    too_small: bool = False

    @property
    def segments(self):
        """All lines in no particular order."""
        return flat_segments(self.groups)


def corners(run, sagitta):
    """A closed run of elements as a polygon (n, 2), mm: its corners lie on it, its edges at most `sagitta` beside."""
    places, params = [], []
    for k in range(len(run)):
        count = 1
        if run.sweep[k]:
            step = 2 * math.acos(max(1 - sagitta / run.radius[k], 0.5))
            count = max(1, math.ceil(abs(run.sweep[k]) / step))
        places.append(np.full(count, k))
        params.append(np.arange(count) / count)
    if not places:
        return np.zeros((0, 2))
    return runs.point_at(run, np.concatenate(places), np.concatenate(params))


def chop_slugs(boundaries, islands, tool_radius, chop_size):
    """The chop lines of every slug a contour pass would leave: tuple of SlugChop.

    boundaries   closed Elements, either way round: each the edge of a region of allowed tool centres, that is the path
                 of the contour's own pass
    islands      closed Elements: the tool's path round material that stays
    tool_radius, chop_size   mm; chop_size 0: never chop
    """
    reaches = _regions(boundaries, islands, LINE_SAGITTA)
    chops = []
    for region in _regions(boundaries, islands, SLUG_SAGITTA):
        for slug in regions.parts(regions.shrink(region, tool_radius - 1.5 * SLUG_SAGITTA)):
            if not regions.parts(regions.shrink(slug, HAIR / 2)):
                continue
            reach = next((r for r in reaches if r.intersects(slug)), None)
            if reach is not None:
                chops.append(_Slug(slug, region, reach, _directions(boundaries), tool_radius).chop(chop_size))
    return tuple(chops)


def slug_lines(boundaries, islands, tool_radius, chop_size):
    """The chop lines alone, [((x0, y0), (x1, y1))], mm; arguments as chop_slugs."""
    return [segment for chop in chop_slugs(boundaries, islands, tool_radius, chop_size) for segment in chop.segments]


def order_chops(chops, start, end, entry_of, exit_of):
    """Directed lines of all slugs: the nearest slug next, each slug's lines as chop.order_lines has them."""
    waiting, here, ordered = [chop for chop in chops if chop.segments], start, []
    while waiting:
        ways = [order_lines(chop.groups, here, end if len(waiting) == 1 else here, entry_of, exit_of)
                for chop in waiting]
        nearest = min(range(len(ways)), key=lambda k: round(math.dist(here, entry_of(ways[k][0])), 6))
        ordered += ways[nearest]
        here = exit_of(ordered[-1])
        waiting.pop(nearest)
    return ordered


def _regions(boundaries, islands, sagitta):
    """Regions of allowed tool centres, drawn with chords."""
    return regions.loop_regions([corners(run, sagitta) for run in boundaries],
                                [corners(run, sagitta) for run in islands])


def _directions(boundaries):
    """Directions (rad, 0 .. pi/2, in rising distance from 0) worth looking at: a fixed fan, and the contour's own."""
    length_of = {}
    for run in boundaries:
        straight = ~run.is_arc
        across = (run.end - run.start)[straight]
        for angle, length in zip(np.arctan2(across[:, 1], across[:, 0]) % (math.pi / 2), np.hypot(*across.T)):
            key = round(angle / SAME_ANGLE)
            first, total = length_of.get(key, (angle, 0.0))
            length_of[key] = (first, total + length)
    own = [angle for angle, _ in sorted(length_of.values(), key=lambda item: -item[1])[:OWN_ANGLES]]
    found = [0.0]
    for angle in own + [math.radians(a) for a in range(0, 90, ANGLE_STEP)]:
        apart = [abs((angle - other + math.pi / 4) % (math.pi / 2) - math.pi / 4) for other in found]
        if min(apart) > SAME_ANGLE:
            found.append(angle)
    return found


class _Slug:
    """One slug on the way to its lines.

    slug     what the contour's pass leaves (drawn too large); region: the allowed tool centres round it, coarse;
    reach    the same, fine; all shapely
    """

    def __init__(self, slug, region, reach, angles, tool_radius):
        self.slug, self.region, self.reach, self.angles, self.radius = slug, region, reach, angles, tool_radius

    def chop(self, chop_size):
        """SlugChop for pieces below chop_size (mm)."""
        whole = piece_size(regions.hull(self.slug))
        size = chop_size - PIECE_MARGIN
        if chop_size <= 0 or whole < size:
            return SlugChop(((), ()), 0.0, (1, 1), 1, whole)
        points = _probe(self.slug, size)
        room = regions.inner_radius(self.slug, size / 10)
        grids = [_Grid(self, angle, points, room) for angle in self.angles]
        found, best = [], math.inf
        for grid in sorted(grids, key=lambda grid: grid.at_most(size)):
            found += grid.search(size, best)
            best = min([best] + [trial[0] for trial in found])
        for count, length, grid, parts in self._tries(sorted(found, key=lambda t: t[:2]), grids, size):
            groups = grid.groups(parts)
            if grid.held(parts, groups, size):
                break
        turned = tuple([[grid.back(segment) for segment in line] for line in group] for group in groups)
        return SlugChop(turned, grid.angle, parts, *grid.outcome(parts), not found)

    def _tries(self, found, grids, size):
        """What to take, best first: (lines, length, grid, parts).

        After the best grid the next two found and finer ones of the best, then grids for smaller pieces, at last lines
        that clear; these first where they are neither more nor longer.
        """
        clear = min(((grid.lines(parts), grid.angle, grid, parts) for grid in grids for parts in grid.clearing()),
                    key=lambda t: t[:2])
        clear = clear[2].trial(clear[3])
        others = list(found[1:3])
        if found:
            if clear[0] <= found[0][0] and clear[1] <= found[0][1]:
                yield clear
            yield found[0]
            _, _, grid, (a, b) = found[0]
            finer = [(a + i, b + more - i) for more in range(1, FINER + 1) for i in range(more + 1)]
            finer += grid.safe(size)
            others += [(grid.lines(parts), 0.0, grid, parts) for parts in finer if grid.usable(parts)]
        for trial in sorted(others, key=lambda t: t[:2]):
            if trial[2].fits(trial[3], size):
                yield trial
        for share in SMALLER if found else ():
            yield from sorted(found[0][2].search(share * size, math.inf), key=lambda t: t[:2])[:1]
        yield clear


def _probe(slug, size):
    """Ways through the slug for quick looks: (points (n, 2), starts of the ways (m,)), mm.

    Its edges and chords along X and Y, in steps of size / 16: points in a row that no kerf parts are of one piece.
    """
    ways = regions.rings(slug)
    low_x, low_y, high_x, high_y = regions.bounds(slug)
    for axis, low, high in ((0, low_x, high_x), (1, low_y, high_y)):
        count = min(max(3, math.ceil(3 * (high - low) / size)), 60)
        for at in low + (high - low) * (np.arange(count) + 0.5) / count:
            ways += [[(at, a), (at, b)] if axis == 0 else [(a, at), (b, at)] for a, b in regions.chords(slug, axis, at)]
    points, starts, here = [], [], 0
    ways = [np.asarray(way, float) for way in ways]
    step = max(size / 16, sum(np.hypot(*np.diff(way, axis=0).T).sum() for way in ways) / PROBES)
    for way in ways:
        upto = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))))
        at = np.linspace(0.0, upto[-1], max(2, math.ceil(upto[-1] / step)))
        points.append(np.stack((np.interp(at, upto, way[:, 0]), np.interp(at, upto, way[:, 1])), axis=1))
        starts.append(here)
        here += len(at)
    return np.concatenate(points), np.array(starts)


class _Grid:
    """The slug turned so that the first group of lines is parallel to X.  parts: (n across the first, the second)."""

    def __init__(self, owner, angle, points, room):
        self.owner, self.angle, self.radius, self.room = owner, angle, owner.radius, room
        self.cos, self.sin = math.cos(angle), math.sin(angle)
        self.slug = regions.rotated(owner.slug, -angle)
        self._reach = None
        self.points = points[0] @ np.array([[self.cos, -self.sin], [self.sin, self.cos]])
        self.starts = points[1]
        bounds = regions.bounds(self.slug)
        self.low = (bounds[1] - self.radius, bounds[0] - self.radius)
        self.span = (bounds[3] - bounds[1] + 2 * self.radius, bounds[2] - bounds[0] + 2 * self.radius)
        self.count = [_crossings(self.slug, 1 - axis, self.low[axis], self.span[axis]) for axis in (0, 1)]

    @property
    def reach(self):
        """The allowed tool centres, turned, when first asked for."""
        if self._reach is None:
            self._reach = regions.rotated(self.owner.reach, -self.angle)
        return self._reach

    def back(self, segment):
        """A segment of the turned slug where it belongs."""
        return tuple((x * self.cos - y * self.sin, x * self.sin + y * self.cos) for x, y in segment)

    def cell(self, axis, n):
        """Width (mm) of the strips between n - 1 lines; below 0 the lines overlap."""
        return self.span[axis] / n - 2 * self.radius

    def usable(self, parts):
        """Whether strips and cells are thick enough to be held and to hold."""
        return all(n == 1 or self.cell(axis, n) >= BRIDGE for axis, n in enumerate(parts))

    def safe(self, size):
        """[parts ..] so fine that cells of the outer rows, then also those in their corners, fit as long as the contour
        has not been cut; [] where the tool is too large for that."""
        r, size = self.radius, size - BRIDGE
        if size <= math.sqrt(2) * r:
            return []
        cells = (math.sqrt(size ** 2 / 2 - r ** 2) - r, size / math.sqrt(2) - 2 * r)
        return [tuple(math.ceil(span / (cell + 2 * r)) for span in self.span) for cell in cells if cell >= BRIDGE]

    def clearing(self):
        """Parts that leave nothing, for one group or the other."""
        for axis in (0, 1):
            n = math.ceil(self.span[axis] / (2 * self.radius - min(OVERLAP, self.radius)))
            yield (n, 1) if axis == 0 else (1, n)

    def places(self, axis, n):
        """Where the lines of a group lie, mm."""
        return self.low[axis] + self.span[axis] * np.arange(1, n) / n

    def lines(self, parts):
        """How many lines, about: chords of the slug at every place."""
        total = 0
        for axis, n in enumerate(parts):
            at = (np.arange(1, n) / n * COUNT_PLACES).astype(int)
            total += int(self.count[axis][at].sum())
        return total

    def full(self, n, size):
        """Least parts of the second group with which even a full cell fits, None where none does."""
        height = self.cell(0, n)
        if height >= size:
            return None
        width = math.sqrt(size ** 2 - height ** 2)
        return max(1, math.ceil(self.span[1] / (width + 2 * self.radius) + 1e-9))

    def at_most(self, size):
        """Lines of the best grid that fits whatever the shape: where the search in this direction starts."""
        least = math.inf
        for n in range(1, MAX_PARTS):
            if not self.usable((n, 1)):
                break
            full = self.full(n, size)
            if full is not None and self.usable((n, full)):
                least = min(least, self.lines((n, full)))
        return least

    def search(self, size, best):
        """Grids with less than `best` lines: [(lines, length mm, self, parts)]."""
        found = []
        for n in range(1, MAX_PARTS):
            if self.lines((n, 1)) >= best or not self.usable((n, 1)):
                break
            parts = self._least(n, size, best)
            if parts is not None:
                found.append(self.trial(parts))
                best = min(best, found[-1][0] + 1)
        return found

    def trial(self, parts):
        """(lines, their length mm, self, parts): what grids are compared by."""
        segments = flat_segments(self.groups(parts))
        return len(segments), sum(math.dist(*segment) for segment in segments), self, parts

    def _least(self, n, size, best):
        """(n, fewest parts of the second group that fit), None where that takes `best` lines or more."""
        full = self.full(n, size)
        low, high = 1, full or min(MAX_PARTS, max(1, int(self.span[1] / (2 * self.radius + BRIDGE))))
        last = high
        while low < high:                       # quick looks find where to begin; what they pass is not yet sure
            middle = (low + high) // 2
            if self._may_fit((n, middle), size):
                high = middle
            else:
                low = middle + 1
        for m in range(low, last + 1):
            if self.lines((n, m)) >= best or not self.usable((n, m)):
                return None
            if self._may_fit((n, m), size) and self.fits((n, m), size):
                return n, m
        return None

    def _may_fit(self, parts, size):
        """False where a piece of `size` is certain: a full cell, or a way along the slug that no kerf parts."""
        cells = [self.cell(axis, n) for axis, n in enumerate(parts)]
        pitch = [self.span[axis] / n for axis, n in enumerate(parts)]
        if math.hypot(*cells) >= size and self.room >= math.hypot(*pitch):
            return False
        index, cut = [], np.zeros(len(self.points), bool)
        for axis, n in enumerate(parts):
            u = (self.points[:, 1 - axis] - self.low[axis]) / pitch[axis]
            line = np.round(u)
            cut |= (line >= 1) & (line <= n - 1) & (np.abs(u - line) * pitch[axis] < self.radius)
            index.append(np.floor(u))
        label = np.where(cut, -1.0, index[0] * (parts[1] + 1) + index[1])
        first = np.concatenate(([True], label[1:] != label[:-1]))
        first[self.starts] = True
        first = np.flatnonzero(first)
        x, y = self.points.T
        wide = [np.maximum.reduceat(v, first) - np.minimum.reduceat(v, first)
                for v in (x, y, (x + y) * math.sqrt(0.5), (x - y) * math.sqrt(0.5))]
        return not np.any((np.max(wide, axis=0) >= size) & (label[first] >= 0))

    def _rows(self, axis, n):
        """The strips between the lines of a group as (low, high), mm."""
        at = np.concatenate(([self.low[axis]], self.places(axis, n), [self.low[axis] + self.span[axis]]))
        return [(a + self.radius, b - self.radius) for a, b in zip(at[:-1], at[1:]) if b - a > 2 * self.radius]

    def pieces(self, parts, reaching=0.0):
        """The pieces of the slug, middle row first, without those whose bounding box has a diagonal below `reaching` (mm)."""
        columns = self._rows(1, parts[1])
        low_x, high_x = self.low[1], self.low[1] + self.span[1]
        middle = self.low[0] + self.span[0] / 2
        for low, high in sorted(self._rows(0, parts[0]), key=lambda row: abs(sum(row) / 2 - middle)):
            for strip in regions.clipped(self.slug, low_x, low, high_x, high):
                if regions.diagonal(strip) < reaching:
                    continue
                first, last = strip.bounds[0], strip.bounds[2]
                for a, b in columns:
                    if b > first and a < last:
                        yield from (piece for piece in regions.clipped(strip, a, low, b, high)
                                    if regions.diagonal(piece) >= reaching)

    def outcome(self, parts):
        """(number of pieces, size of the largest, mm); of very many the number is about right."""
        cells = [self.cell(axis, n) for axis, n in enumerate(parts)]
        if parts[0] * parts[1] > MAX_CELLS and min(cells) > 0:
            return round(self.slug.area * parts[0] * parts[1] / (self.span[0] * self.span[1])), math.hypot(*cells)
        sizes = [piece_size(regions.hull(piece)) for piece in self.pieces(parts)]
        return len(sizes), max(sizes, default=0.0)

    def fits(self, parts, size):
        """Whether every piece fits inside a circle of diameter < size (mm)."""
        if math.hypot(self.cell(0, parts[0]), self.cell(1, parts[1])) < size:
            return True
        return all(piece_size(regions.hull(piece)) < size for piece in self.pieces(parts, reaching=size))

    def held(self, parts, groups, size):
        """Whether everything of `size` (mm) or more is still held, BRIDGE thick, when all lines are cut.

        Cells farther inside than their own diagonal hang on nothing by intention and are left out.
        """
        pitch = math.hypot(*(self.span[axis] / n for axis, n in enumerate(parts)))
        region = regions.rotated(self.owner.region, -self.angle)
        waste = regions.grow(region, self.radius)
        inner = regions.shrink(self.slug, 1.1 * pitch)
        stock = regions.without(regions.grow(region, self.radius + 1.0), flat_segments(groups), self.radius, inner)
        loose = regions.badly_held(stock, waste, BRIDGE, size)
        if any(piece_size(outline) >= size for outline in loose):
            return False
        late = regions.released_with_rim(stock, waste, region, self.radius, BRIDGE, size)
        return all(piece_size(outline) < size for outline in late)

    def groups(self, parts):
        """The scan lines of both groups, turned; where they meet the slug, clipped to the allowed tool centres."""
        return tuple([line for at in self.places(axis, n) if (line := self._scan_line(axis, float(at)))]
                     for axis, n in enumerate(parts))

    def _scan_line(self, axis, at):
        """Segments of one scan line: from a tool's radius before the slug to a tool's radius after it.

        Neighbours less than the tool's diameter apart are one.
        """
        r, low, high = self.radius, self.low[1 - axis], self.low[1 - axis] + self.span[1 - axis]
        strip = (low, at - r, high, at + r) if axis == 0 else (at - r, low, at + r, high)
        met = sorted((part.bounds[axis] - r, part.bounds[axis + 2] + r) for part in regions.clipped(self.slug, *strip))
        segments = []
        for low, high in regions.chords(self.reach, 1 - axis, at):
            spans = []
            for a, b in met:
                a, b = max(a, low), min(b, high)
                if b - a <= MIN_LINE:
                    continue
                if spans and a - spans[-1][1] < 2 * r:
                    spans[-1][1] = max(b, spans[-1][1])
                else:
                    spans.append([a, b])
            segments += [((a, at), (b, at)) if axis == 0 else ((at, a), (at, b)) for a, b in spans]
        return segments


def _crossings(region, axis, low, span):
    """How often a line across the region runs inside it, at COUNT_PLACES + 1 places: (m,) int.

    axis 0: lines x = at, 1: y = at; from low over span, mm.
    """
    at = low + span * (np.arange(COUNT_PLACES + 1) + 0.5) / (COUNT_PLACES + 1)
    total = np.zeros(len(at), int)
    for ring in regions.rings(region):
        v = np.asarray(ring)[:, axis]
        below = v[:, None] < at[None, :]
        total += np.sum(below[1:] != below[:-1], axis=0)
    return np.maximum(total // 2, 1)
