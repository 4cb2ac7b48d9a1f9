# SPDX-License-Identifier: GPL-2.0-or-later
"""Corners of a ring rounded by arcs, so that the tool need not stop in them.

Called by rings.py, by scan.py (eased) and by concentric.py (smoothed).  Lengths mm, angles rad.

Only corners that turn left are rounded, with the cleared side on the left: the arc lies inside of the ring.  It leaves
nothing.  A place inside of the ring is as near to it as the radius of a circle about the place that keeps inside of the
ring.  If that circle is wider than the arc it touches the ring beside the part that the arc replaces; if not, the place
is within the radius of the arc, or of the depth of the corner, from the arc.  Both are below the tool radius.

The closed paths of P3 are lines with corners to both sides.  Those to the left get such arcs; the others, and flat
ones, any arc that stays within a depth of the corner, by which the paths are nearer to one another than they have to.

The rows of P1 and P2 are within half their gap of all that the outline does not reach, so their corners to both sides
may be arcs as deep as the tool is wider than half a gap.
"""

import numpy as np

from chipwise.geometry.base import chains, elements
from chipwise.geometry.base.arcs import intersect_circles, intersect_line_circle
from chipwise.geometry.base.elements import Elements, make_arcs
from chipwise.geometry.base.lines import cross, dot, intersect_lines

# Radii that are tried, in tool radii, and how far the corner may be from its arc.
RADII, DEEPEST = (0.5, 0.25), 0.5

# A turn of less than this is not a corner. rad
CORNER = 0.15

# An arc may take this share of the element before and after it.
SHARE = 0.49

# Arcs from rows to the outline, in tool radii: the widest, which shares of that are tried, and how far from the corner:
# with deeper ones a track that ends in the corner of another has no cleared line back to it.
EASED, SHARES, EASED_DEEPEST = 0.3, (1.0, 0.5, 0.25), 0.2

# Such an arc between lines is made as wide as takes this share of the shorter one, a little less than it may.
TAKEN = 0.98 * SHARE

# Corners of lines that turn less are passed without a stop. rad
FLAT = 0.03

# A corner is not looked at if lines would need this much more room for the arc: curved elements may do with less.
LIKELY = 3.0

# Lines that arcs leave nothing of. mm
NO_LENGTH_MM = 1e-7


def rounded(loop: Elements, radius) -> Elements:
    """A closed loop with arcs in its corners to the left, where they fit."""
    after = (np.arange(len(loop)) + 1) % len(loop)
    turn, length = _turns(loop, after), elements.lengths(loop)
    left, share_mm = (turn > CORNER) & (turn < np.pi - CORNER), SHARE * np.minimum(length, length[after])
    arcs = {}
    for share in RADII:
        likely = left & (share * radius * np.tan(0.5 * np.where(left, turn, 0.0)) < LIKELY * share_mm)
        open_ = np.array([k for k in np.flatnonzero(likely) if k not in arcs], int)
        if len(open_):
            arcs.update(_arcs(loop, open_, after[open_], np.full(len(open_), share * radius), DEEPEST * radius))
    return _with(loop, arcs) if arcs else loop


def eased(parts, sharp, radius, deepest, keeps):
    """Open chains with arcs in their corners to both sides, where they fit.

    sharp (n, 2): places whose corners stay.  radius: of the tool.  deepest: mm that a corner may be from its arc.
    keeps: as smoothed."""
    chain, part = elements.join(parts), np.repeat(np.arange(len(parts)), [len(one) for one in parts])
    for _ in range(2):  # corners to the left, and those of the same chains backwards
        chain, part = _eased_left(chain, part, sharp, radius, deepest, keeps)
        chain, part = elements.reverse(chain), part[::-1]
    return [elements.take(chain, np.flatnonzero(part == k)) for k in range(len(parts))]


def _eased_left(chain, part, sharp, radius, deepest, keeps):
    """(Elements, which chain each is of) with arcs in corners to the left."""
    after, length = np.roll(np.arange(len(chain)), -1), elements.lengths(chain)
    turn = _turns(chain, after)
    inner = np.append(part[1:] == part[:-1], False)
    at = np.flatnonzero(inner & (turn > CORNER) & (turn < np.pi - CORNER))
    at = at[~(np.hypot(*(chain.end[at, None] - sharp[None]).transpose(2, 0, 1)) <= chains.SNAP_MM).any(axis=1)]
    size = np.minimum(EASED * radius, TAKEN * np.minimum(length[at], length[at + 1]) / np.tan(0.5 * turn[at]))
    arcs = {}
    for share in SHARES:
        open_ = np.array([n for n, k in enumerate(at) if k not in arcs], int)
        found = _arcs(chain, at[open_], at[open_] + 1, share * size[open_], deepest) if len(open_) else {}
        if found:
            kept = keeps(_made(found.values()), chain.end[list(found)])
            arcs.update({k: arc for (k, arc), keep in zip(found.items(), kept.tolist()) if keep})
    if not arcs:
        return chain, part
    return _with(chain, arcs), np.insert(part, np.array(sorted(arcs)) + 1, part[sorted(arcs)])


def smoothed(points, sharp, side, size, stray, keeps):
    """(Elements, index of a line (n,) for each) of lines along points (n, 2) with arcs in their corners.

    sharp: indices of points that stay.  side: 1 if the cleared side is on the left, else -1.  An arc in a corner to
    that side has a radius of `size`, or, like all others, one that stays within `stray` of the corner; it takes at most
    half of each line.  keeps: whether arcs may be where they are (Elements, places (n, 2) of the corners) -> (n,)
    bool."""
    along = np.diff(points, axis=0)
    length = np.hypot(*along.T)
    turn = np.arctan2(cross(along[:-1], along[1:]), dot(along[:-1], along[1:]))
    bent = (np.abs(turn) > FLAT) & (np.abs(turn) < np.pi - CORNER)
    at = np.flatnonzero(bent)
    at = at[~np.isin(at + 1, sharp)]
    turn, half = turn[at], np.tan(0.5 * np.abs(turn[at]))
    radius = np.maximum(stray / (np.hypot(1.0, half) - 1.0), np.where(side * turn > 0.0, size, 0.0))
    radius = np.minimum(radius, 0.5 * np.minimum(length[at], length[at + 1]) / half)
    unit, corner = along / length[:, None], points[at + 1]
    first, last = (corner + s * (radius * half)[:, None] * unit[k] for s, k in ((-1.0, at), (1.0, at + 1)))
    normal = np.copysign(1.0, turn)[:, None] * np.stack((-unit[at, 1], unit[at, 0]), axis=1)
    arcs = elements.make_arcs(first, last, first + radius[:, None] * normal, radius, turn)
    kept = keeps(arcs, corner)
    arcs, at = elements.take(arcs, kept), at[kept]
    start, end = points[:-1].copy(), points[1:].copy()
    start[at + 1], end[at] = arcs.end, arcs.start
    lines = elements.make_lines(start, end)
    index = np.concatenate((np.arange(len(lines)), at))
    order = np.lexsort((np.arange(len(index)) >= len(lines), index))
    chain = elements.take(elements.join((lines, arcs)), order)
    long = elements.lengths(chain) > NO_LENGTH_MM
    return elements.take(chain, long), index[order][long]


def _turns(loop, after):
    """Turn to the left (n,) rad in the corner after each element."""
    ends, starts = (
        elements.tangent_at(loop, index, np.full(len(loop), t))
        for index, t in ((np.arange(len(loop)), 1.0), (after, 0.0))
    )
    return np.arctan2(cross(ends, starts), dot(ends, starts))


def _arcs(loop, before, after, size, deepest):
    """{index of the element before a corner: (start, end, centre, size, t where the element ends, t where the next
    begins)} of the corners that an arc of a radius, of `size` (n,), fits in."""
    corner = loop.end[before]
    centre = _centres(loop, before, after, size, corner)
    first, last = _foot(loop, before, centre), _foot(loop, after, centre)
    known = np.isfinite(centre).all(axis=1)
    safe = np.where(known[:, None], first, corner), np.where(known[:, None], last, corner)
    t = elements.parameters(loop, before, safe[0]), elements.parameters(loop, after, safe[1])
    fits = known & (t[0] > 1.0 - SHARE) & (t[0] < 1.0) & (t[1] > 0.0) & (t[1] < SHARE)
    fits &= np.hypot(*(np.where(known[:, None], centre, corner) - corner).T) - size <= deepest
    return {
        int(before[k]): (first[k], last[k], centre[k], size[k], float(t[0][k]), float(t[1][k]))
        for k in np.flatnonzero(fits)
    }


def _centres(loop, before, after, size, corner):
    """(n, 2) places as far to the left of both elements of a corner as the arc's radius; nan where none is."""
    found = np.full((len(corner), 2), np.nan)
    arc = loop.is_arc[before], loop.is_arc[after]
    both = np.flatnonzero(~arc[0] & ~arc[1])
    if len(both):
        (p, q), (u, v) = (_beside(loop, index[both], size[both]) for index in (before, after))
        t, _ = intersect_lines(p, q, u, v)
        found[both] = p + t[:, None] * (q - p)
    for line, other, unlike in ((before, after, ~arc[0] & arc[1]), (after, before, arc[0] & ~arc[1])):
        which = np.flatnonzero(unlike)
        if len(which):
            p, q = _beside(loop, line[which], size[which])
            wide = _inner(loop, other[which], size[which])
            found[which] = _nearer(intersect_line_circle(p, q, loop.centre[other[which]], wide), corner[which])
    which = np.flatnonzero(arc[0] & arc[1])
    if len(which):
        a, b = before[which], after[which]
        wide = _inner(loop, a, size[which]), _inner(loop, b, size[which])
        found[which] = _nearer(intersect_circles(loop.centre[a], wide[0], loop.centre[b], wide[1]), corner[which])
    return found


def _beside(loop, index, size):
    """Ends (n, 2), (n, 2) of lines moved to the left."""
    along = loop.end[index] - loop.start[index]
    normal = np.stack((-along[:, 1], along[:, 0]), axis=1) / np.hypot(*along.T)[:, None]
    return loop.start[index] + size[:, None] * normal, loop.end[index] + size[:, None] * normal


def _inner(loop, index, size):
    """Radii (n,) of arcs moved to the left; nan where nothing is left of one."""
    wide = loop.radius[index] - np.copysign(size, loop.sweep[index])
    return np.where(wide > size, wide, np.nan)


def _nearer(found, corner):
    """Of two places (2, n, 2) the one nearer to a corner."""
    gap = np.hypot(*(found - corner).transpose(2, 0, 1))
    return np.where((gap[0] <= gap[1])[:, None], *found)


def _foot(loop, index, centre):
    """The places (n, 2) of carriers nearest to centres."""
    away = centre - loop.centre[index]
    on_arc = loop.centre[index] + away * (loop.radius[index] / np.maximum(np.hypot(*away.T), 1e-12))[:, None]
    along = loop.end[index] - loop.start[index]
    t = dot(centre - loop.start[index], along) / np.maximum(dot(along, along), 1e-300)
    return np.where(loop.is_arc[index][:, None], on_arc, loop.start[index] + t[:, None] * along)


def _with(loop, arcs):
    """The loop with its corners replaced."""
    count = len(loop)
    first, last = np.zeros(count), np.ones(count)
    for k, (*_, ends, begins) in arcs.items():
        last[k], first[(k + 1) % count] = ends, begins
    start, end = loop.start.copy(), loop.end.copy()
    for k, (a, b, *_) in arcs.items():
        end[k], start[(k + 1) % count] = a, b
    angle = np.where(loop.is_arc, loop.start_angle + first * loop.sweep, loop.start_angle)
    shorter = Elements(start, end, loop.centre, loop.radius, angle, loop.sweep * (last - first))
    corners = np.array(sorted(arcs))
    index = np.concatenate((np.arange(count), corners))
    order = np.lexsort((np.arange(len(index)) >= count, index))
    return elements.take(elements.join((shorter, _made([arcs[k] for k in corners.tolist()]))), order)


def _made(arcs):
    """Elements of arcs that _arcs found."""
    a, b, centre, size, *_ = map(np.array, zip(*arcs))
    turn = np.arctan2(cross(a - centre, b - centre), dot(a - centre, b - centre))
    return make_arcs(a, b, centre, size, turn)
