# SPDX-License-Identifier: GPL-2.0-or-later
"""Chopping the slug of any closed contour: which straight lines, in which direction.

Called by cycles/contour_chop.py.  Pure; mm.  docs/design/chop.md has the method with a picture.

Source: JP H05-7134 B2 (1988), fig. 4 and 5, which divides a circle of diameter d into n parts along X and Y.  Symbols:
H the reference size, n the number of parts, here one for each of the two directions.

Where this departs from the patent:
 1. Any region of allowed tool centres instead of a circle: the inside of a closed centre path, without islands.  A line
    is clipped to that region, so no kerf leaves the contour.  It is left out where it meets no slug.
 2. The grid is turned, and has as many parts each way as the pieces need: of all directions and numbers looked at,
    those with the fewest lines, then with the shortest.
 3. A piece must fit a circle of diameter H; the pieces are computed, as for holes (disc.py, departure 1).

Why cells are enough: a point of the slug is at least a tool radius inside the region, so the foot of its perpendicular
on a scan line nearer than that is inside the region too, and so on the line cut there.  In the slug a kerf is the whole
strip of a tool's width; its ends lie outside.  So the pieces are the slug cut up by rectangles.
"""

import math
from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base import polygons
from chipwise.geometry.base.enclosing_circle import piece_size
from chipwise.geometry.slug.disc import PIECE_MARGIN, flat_segments
from chipwise.geometry.slug.grid import Grid
from chipwise.geometry.slug.line_order import order_lines

# A slug thinner than this leaves as a chip; the drawings of its edges are not much finer. mm
HAIR = 0.01

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

# So many parts more are tried where the grid of fewest lines leaves a large piece on a thin bridge.
FINER = 2

# Then grids in its direction for pieces smaller than H, as shares of it.
SMALLER = (0.85, 0.7)

# A quick look at a grid takes about so many points at most.
PROBES = 8000


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


def corners(chain, sagitta):
    """A closed chain of elements as a polygon (n, 2), mm: its corners lie on it, its edges at most `sagitta` beside."""
    positions, params = [], []
    for k in range(len(chain)):
        count = 1
        if chain.sweep[k]:
            step = 2 * math.acos(max(1 - sagitta / chain.radius[k], 0.5))
            count = max(1, math.ceil(abs(chain.sweep[k]) / step))
        positions.append(np.full(count, k))
        params.append(np.arange(count) / count)
    if not positions:
        return np.zeros((0, 2))
    return elements.point_at(chain, np.concatenate(positions), np.concatenate(params))


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
        for slug in polygons.parts(polygons.shrink(region, tool_radius - 1.5 * SLUG_SAGITTA)):
            if not polygons.parts(polygons.shrink(slug, HAIR / 2)):
                continue
            reach = next((r for r in reaches if r.intersects(slug)), None)
            if reach is not None:
                chops.append(_Slug(slug, region, reach, _directions(boundaries), tool_radius).chop(chop_size))
    return tuple(chops)


def order_chops(chops, start, end, entry_of, exit_of):
    """Directed lines of all slugs: the nearest slug next, each slug's lines as line_order.order_lines has them."""
    waiting, here, ordered = [chop for chop in chops if chop.segments], start, []
    while waiting:
        paths = [
            order_lines(chop.groups, here, end if len(waiting) == 1 else here, entry_of, exit_of) for chop in waiting
        ]
        nearest = min(range(len(paths)), key=lambda k: round(math.dist(here, entry_of(paths[k][0])), 6))
        ordered += paths[nearest]
        here = exit_of(ordered[-1])
        waiting.pop(nearest)
    return ordered


def _regions(boundaries, islands, sagitta):
    """Regions of allowed tool centres, drawn with chords."""
    return polygons.loop_regions(
        [corners(chain, sagitta) for chain in boundaries], [corners(chain, sagitta) for chain in islands]
    )


def _directions(boundaries):
    """Directions (rad, 0 .. pi/2, in rising distance from 0) worth looking at: a fixed fan, and the contour's own."""
    length_of = {}
    for chain in boundaries:
        straight = ~chain.is_arc
        across = (chain.end - chain.start)[straight]
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
        whole = piece_size(polygons.hull(self.slug))
        size = chop_size - PIECE_MARGIN
        if chop_size <= 0 or whole < size:
            return SlugChop(((), ()), 0.0, (1, 1), 1, whole)
        points = _probe(self.slug, size)
        inner_radius = polygons.inner_radius(self.slug, size / 10)
        grids = [Grid(self, angle, points, inner_radius) for angle in self.angles]
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
        clear = min(
            ((grid.lines(parts), grid.angle, grid, parts) for grid in grids for parts in grid.clearing()),
            key=lambda t: t[:2],
        )
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
    """Paths through the slug for quick looks: (points (n, 2), starts of the paths (m,)), mm.

    Its edges and chords along X and Y, in steps of size / 16: points in a row that no kerf parts are of one piece.
    """
    paths = polygons.rings(slug)
    low_x, low_y, high_x, high_y = polygons.bounds(slug)
    for axis, low, high in ((0, low_x, high_x), (1, low_y, high_y)):
        count = min(max(3, math.ceil(3 * (high - low) / size)), 60)
        for at in low + (high - low) * (np.arange(count) + 0.5) / count:
            paths += [
                [(at, a), (at, b)] if axis == 0 else [(a, at), (b, at)] for a, b in polygons.chords(slug, axis, at)
            ]
    points, starts, here = [], [], 0
    paths = [np.asarray(path, float) for path in paths]
    step = max(size / 16, sum(np.hypot(*np.diff(path, axis=0).T).sum() for path in paths) / PROBES)
    for path in paths:
        upto = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))))
        at = np.linspace(0.0, upto[-1], max(2, math.ceil(upto[-1] / step)))
        points.append(np.stack((np.interp(at, upto, path[:, 0]), np.interp(at, upto, path[:, 1])), axis=1))
        starts.append(here)
        here += len(at)
    return np.concatenate(points), np.array(starts)
