# SPDX-License-Identifier: GPL-2.0-or-later
"""Scan rows over a machinable region: the chords, how the outline joins their ends, and which lie next to which.

Called by oneway.py (P1) and zigzag.py (P2).  Source: the abstract on unidirectional area machining
(cutting paths PTi from Pi to Qi, joined by moves along the outline curve OLC), which knows one chord
per path.  Departure: islands and bays cut a row into several chords, so the order of paths is kept
as relations between chords instead of the number i.

1. Rows lie across the direction of progress v: to the right of travel for climb milling, to the left
   for conventional, so that the stock still standing is on the wanted side of every cut.  Seen in the
   frame (u along the cut, v progress) both cases are the same picture, and every contour in its
   direction of travel passes v upwards at the start P of a chord and downwards at its end Q.
2. Rows are spread evenly over the machinable region, gaps at most `limit`, and keep CLEAR_MM away from every
   corner and turning point, so that all crossings are clean.
3. Between two crossings that follow one another on a contour lies one outline piece.  It joins two
   ends in neighbouring rows (a wall), or two of one row (the end of an island or of a bay, a cap).
4. Chords on the outer edge of the same region between two rows are joined by its pieces, so a
   union-find over pieces tells which chords border which region.

No residue: a point of the machinable region is within half a gap of a row, or the way there meets the outline;
what lies outside the machinable region within the tool's reach is nearest to the outline.  So rows and outline
together reach everything while the gap is at most the tool's diameter.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Optional

import numpy as np

from chipwise.errors import CycleError

from chipwise.geometry.base import chains, elements
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.pocket.rounded import EASED_DEEPEST, eased
from chipwise.geometry.pocket.tracks import along, make_track

# Rows stay this far (mm) from the v of corners and turning points: far above rounding, far below
# any step-over; also the least height of what a row cuts off an element.
CLEAR_MM = 2e-4

# Neighbouring rows overlap by at least this share of the tool's diameter: rows that only touch
# would leave a ridge of rounding.
OVERLAP_SHARE = 0.005

# An arc in a corner may be as deep as what the tool is wider than half a gap, times this.
SURE = 0.9

# More rows are a slip of the finger and would stall the preview.
MAX_ROWS = 3000

# A machinable region below this area (mm2) is a line or a point contact: its contour is all there is to cut.
NO_AREA_MM2 = 1e-6

# Elements of the pool below this length (mm) are ignored: rounding of a chord between two walls that
# lie on one another.
NO_LENGTH_MM = 1e-9

# Start angles lie within -2 pi .. 3 pi, sweeps within 2 pi, and a direction within -pi .. pi: so many half turns from
# there (first, and one after the last) lead to every angle of an arc.
_HALF_TURNS = (-5, 7)

# Ends of a chord that lie this near (mm) may come in either order: where a machinable region is a line.
TIE_MM = 1e-6


@dataclass(frozen=True, eq=False)
class Scan:
    """k crossings and k / 2 chords of the rows with the contours in their direction of travel.

    chord (k,) int; is_start (k,) bool: P, else Q; after, before (k,) int: the next crossing on the
    same contour and the last one; point (k, 2) mm; starts, ends (c,) int: crossings P and Q of each
    chord, row by row; loop (k,) int: contour.
    pool: every element a track may need: the contours cut at all crossings (split of them), the
    same backwards, the chords, the same backwards; begin (k,) int: where in it a crossing's outline
    piece begins; loops: (first, last) of each contour in it.
    deepest: the rows end before the walls, the contours are not the walls, and their corners may be arcs that are this
    far (mm) from the corner; None: neither.
    """

    chord: np.ndarray
    is_start: np.ndarray
    after: np.ndarray
    before: np.ndarray
    point: np.ndarray
    starts: np.ndarray
    ends: np.ndarray
    begin: np.ndarray
    loop: np.ndarray
    loops: tuple
    split: int
    pool: Elements
    deepest: Optional[float] = None

    @property
    def chords(self):
        """Number of chords."""
        return len(self.starts)

    def chain_of_segment(self, crossing):
        """Pool indices of the outline from a crossing to the next one on its contour."""
        first, last = self.loops[self.loop[crossing]]
        a, b = int(self.begin[crossing]), int(self.begin[self.after[crossing]])
        return list(range(a, b)) if a < b else [*range(a, last), *range(first, b)]

    def chain_back(self, chain):
        """A run of outline pieces travelled backwards."""
        return [2 * self.split - 1 - k for k in reversed(chain)]

    def chain_of_chord(self, chord, forward=True):
        """Pool index of a chord, from P to Q, or back."""
        return [2 * self.split + chord + (0 if forward else self.chords)]

    def track(self, chain, wall=False):
        """Track of pool indices, without chords where the machinable region is a line that the row crosses."""
        chain = np.array(chain)
        long = self._long[chain]
        return make_track(elements.take(self.pool, chain[long] if long.any() else chain[:1]), wall=wall)

    @cached_property
    def _long(self):
        return elements.lengths(self.pool) > NO_LENGTH_MM

    @cached_property
    def above(self):
        """For each chord the tuple of chords that border the same region from the row before."""
        return _neighbours(self)[0]

    @cached_property
    def beside(self):
        """For each chord the tuple of chords of its own row that border the region before it."""
        return _neighbours(self)[1]

    def contour_tracks(self, here):
        """The closing tracks: every contour once, the boundary last, each from a chord's end near
        the end of the track before; here (2,) mm or None."""
        tracks = []
        for loop in [*range(1, len(self.loops)), 0]:
            first, last = self.loops[loop]
            on_loop = np.flatnonzero(self.loop == loop)
            begin = self.begin[on_loop] if len(on_loop) else np.arange(first, last)
            near = 0 if here is None else int(np.argmin(np.hypot(*(self.pool.start[begin] - here).T)))
            a = int(begin[near])
            tracks.append(self.track([*range(a, last), *range(first, a)], True))
            here = tracks[-1].end
        return tracks


def rows_before(region, radius, step, direction, climb, walls):
    """Scan whose rows end before the walls of a machinable region; of the region itself where no row has room so, or
    without walls."""
    if walls is not None and walls.within is not region:
        rows = scan(walls.within, radius - walls.kept, step, direction, climb)
        if rows.chords:
            gap = widest(step, radius - walls.kept)
            return replace(rows, deepest=min(EASED_DEEPEST * radius, SURE * (radius - 0.5 * gap)))
    return scan(region, radius, step, direction, climb)


def finished(region, rows, tracks, climb, walls):
    """Tracks of rows, and after them every contour of the machinable region once, with arcs onto and off them if walls
    are given; then corners of the rows are arcs, but those at which Tracks begin."""
    here = tracks[-1].end if tracks else None
    if rows.deepest is None:
        tracks = tuple(tracks + rows.contour_tracks(here))
        return tracks if walls is None else walls.led(tracks)
    starts = np.array([track.start for track in tracks])
    parts = [track.elements for track in tracks]
    tracks = [make_track(chain) for chain in eased(parts, starts, walls.radius, rows.deepest, walls.keeps)]
    for contour in (*region.holes, region.boundary):
        loop = along(contour, climb)
        index, t = chains.nearest(loop, here)[1:]
        tracks.append(make_track(chains.rotated(loop, *chains.snapped(loop, index, t)), wall=True))
        here = tracks[-1].end
    return walls.led(tracks)


def scan(region, radius, step, direction, climb):
    """Scan of a machinable region: rows at most `step` (mm) apart, cut in `direction` (rad)."""
    contours = [along(contour, climb) for contour in region.contours]
    e = elements.join(contours)
    u = np.array((np.cos(direction), np.sin(direction)))
    v = np.array((u[1], -u[0])) if climb else np.array((-u[1], u[0]))
    segment, t0, t1 = _monotone(e, v)
    low, high = (elements.point_at(e, segment, t) @ v for t in (t0, t1))
    low = np.where(t0 == 0.0, e.start[segment] @ v, low)
    high = np.where(t1 == 1.0, e.end[segment] @ v, high)
    limit = widest(step, radius)
    rows = spread_rows(np.concatenate((low, high)), limit) if region.area > NO_AREA_MM2 else np.zeros(0)
    found = _crossings(e, v, (segment, t0, t1, low, high), rows)
    keep = _matched(elements.point_at(e, found.element, found.t) @ u, found.row, found.rising)
    return _assemble(contours, e, u, _Crossings(*(values[keep] for values in found)))


def widest(step, radius):
    """Most gap of rows, mm."""
    return min(step, 2.0 * radius * (1.0 - OVERLAP_SHARE))


def _monotone(e, v):
    """Pieces (element, t0, t1) of a run within which v only rises or only falls."""
    towards = np.arctan2(v[1], v[0])
    cuts = [np.zeros(len(e)), np.ones(len(e))]
    for turn in range(*_HALF_TURNS):
        t = (towards + turn * np.pi - e.start_angle) / np.where(e.is_arc, e.sweep, 1.0)
        cuts.append(np.where(e.is_arc & (t > 0.0) & (t < 1.0), t, 0.0))
    cuts = np.sort(np.stack(cuts, axis=1), axis=1)
    element, k = np.nonzero(cuts[:, 1:] > cuts[:, :-1])
    return element, cuts[element, k], cuts[element, k + 1]


def spread_rows(critical, limit):
    """Rows spread evenly between the least and the largest of `critical` (m,) mm, gaps at most
    `limit`, none within CLEAR_MM of a critical value if that can be helped."""
    low, high = float(critical.min()), float(critical.max())
    count = int(np.ceil((high - low) / limit - 1e-9)) - 1
    if count < 1:
        return np.zeros(0)
    if count > MAX_ROWS:
        raise CycleError(f"step-over D{{d}} needs more than {MAX_ROWS} rows", "use a larger D", d=limit)
    values = np.unique(critical)
    for clear in (CLEAR_MM, 0.1 * CLEAR_MM):
        for more in range(3):
            even = low + (high - low) * np.arange(1, count + more + 1) / (count + more + 1)
            rows = _moved(even, values, clear)
            gaps = np.diff(np.concatenate(([low], rows, [high])))
            if gaps.max() <= limit * (1.0 + 1e-9) and gaps.min() > 0.0:
                return rows
    return rows[np.concatenate(([True], np.diff(rows) > 0.0))]


def _moved(rows, values, clear):
    """Rows moved out of the bands of half width `clear` about sorted values, the short way."""
    apart = np.flatnonzero(np.diff(values) > 2.0 * clear)
    bottom = values[np.concatenate(([0], apart + 1))] - clear
    top = values[np.append(apart, len(values) - 1)] + clear
    k = np.maximum(np.searchsorted(bottom, rows) - 1, 0)
    within = (rows > bottom[k]) & (rows < top[k])
    near = np.where(rows - bottom[k] < top[k] - rows, bottom[k], top[k])
    return np.where(within, near, rows)


class _Crossings(NamedTuple):
    """Of rows with elements of a run, at t of them, in contour order: (k,) each; rising: whether v rises there."""

    element: np.ndarray
    t: np.ndarray
    row: np.ndarray
    rising: np.ndarray


def _crossings(e, v, segments, rows):
    """The _Crossings of rows with monotone pieces."""
    segment, t0, t1, low, high = segments
    first = np.searchsorted(rows, np.minimum(low, high), side="right")
    many = np.maximum(np.searchsorted(rows, np.maximum(low, high), side="left") - first, 0)
    which = np.repeat(np.arange(len(segment)), many)
    row = np.arange(len(which)) - np.repeat(np.cumsum(many) - many, many) + first[which]
    index, rising = segment[which], (high > low)[which]
    share = (rows[row] - low[which]) / (high - low)[which]
    line_t = t0[which] + (t1 - t0)[which] * share
    arc = e.is_arc[index]
    radius, sweep = np.where(arc, e.radius[index], 1.0), np.where(arc, e.sweep[index], 1.0)
    turned = np.arccos(np.clip((rows[row] - e.centre[index] @ v) / radius, -1.0, 1.0))
    angle = np.arctan2(v[1], v[0]) + np.where(rising == (sweep > 0.0), -turned, turned)
    middle = e.start_angle[index] + 0.5 * (t0 + t1)[which] * e.sweep[index]
    angle += 2.0 * np.pi * np.round((middle - angle) / (2.0 * np.pi))
    arc_t = np.clip((angle - e.start_angle[index]) / sweep, t0[which], t1[which])
    t = np.where(arc, arc_t, line_t)
    order = np.lexsort((t, index))
    return _Crossings(index[order], t[order], row[order], rising[order])


def _matched(u, row, rising):
    """Crossings (m,) bool of rows whose chords come out: start, end, start, end along u."""
    order = _along_rows(u, row, rising)
    count = np.bincount(row, minlength=1) if len(row) else np.zeros(1, int)
    odd = np.zeros(len(count), bool)
    position = np.arange(len(order)) - np.repeat(np.cumsum(count) - count, count)
    bad = rising[order] != (position % 2 == 0)
    odd[row[order[bad]]] = True
    odd |= count % 2 == 1
    return ~odd[row]


def _along_rows(u, row, rising):
    """Order of crossings by row and u; of two at one position a start comes before its end where the
    row is outside, else after."""
    order = np.lexsort((u, row))
    tied = np.flatnonzero((np.diff(u[order]) < TIE_MM) & (np.diff(row[order]) == 0))
    for k in tied.tolist():
        first = np.searchsorted(row[order], row[order[k]])
        level = np.sum(np.where(rising[order[first:k]], 1, -1))
        if bool(rising[order[k]]) != (level == 0):
            order[k], order[k + 1] = order[k + 1], order[k]
    return order


def _assemble(contours, e, u, matched):
    """Scan of matched _Crossings."""
    element, t, row, rising = matched
    k = len(element)
    point = elements.point_at(e, element, t)
    order = _along_rows(point @ u, row, rising)
    chord = np.empty(k, int)
    chord[order] = np.arange(k) // 2
    bounds = np.cumsum([0] + [len(c) for c in contours])
    loop = np.searchsorted(bounds, element, side="right") - 1
    start = np.searchsorted(element, bounds)  # first crossing of each contour
    after, before = np.arange(1, k + 1), np.arange(-1, k - 1)
    for a, b in zip(start, start[1:]):
        if b > a:
            after[b - 1], before[a] = a, b - 1
    edges = bounds + start
    parts = split_at(e, element, t, point)
    lines = elements.make_lines(point[order[::2]], point[order[1::2]])
    pool = elements.join((parts, elements.reverse(parts), lines, elements.make_lines(lines.end, lines.start)))
    return Scan(
        chord,
        rising,
        after,
        before,
        point,
        order[::2],
        order[1::2],
        element + np.arange(k) + 1,
        loop,
        tuple((int(a), int(b)) for a, b in zip(edges, edges[1:])),
        len(parts),
        pool,
    )


def split_at(e, element, t, point):
    """A run cut at parameters t of elements (k,), sorted; each cut makes one element more."""
    index = np.sort(np.concatenate((np.arange(len(e)), element)))
    cut = element + np.arange(len(element)) + 1  # the elements that begin at a cut
    t0, t1 = np.zeros(len(index)), np.ones(len(index))
    t0[cut], t1[cut - 1] = t, t
    start, end = e.start[index].copy(), e.end[index].copy()
    start[cut], end[cut - 1] = point, point
    return Elements(
        start,
        end,
        e.centre[index],
        e.radius[index],
        e.start_angle[index] + t0 * e.sweep[index],
        e.sweep[index] * (t1 - t0),
    )


def _neighbours(scan_):
    """(above, beside) of every chord, by union-find over the regions between rows: side 2 c is the
    region before chord c, side 2 c + 1 the one after it."""
    root = list(range(2 * scan_.chords))

    def find(k):
        while root[k] != k:
            root[k] = root[root[k]]
            k = root[k]
        return k

    chord = scan_.chord.tolist()
    for a, b in enumerate(scan_.after.tolist()):
        down, last = scan_.is_start[a], scan_.is_start[b]
        root[find(2 * chord[a] + (1 if down else 0))] = find(2 * chord[b] + (0 if last else 1))
    before, after = {}, {}
    for c in range(scan_.chords):
        before.setdefault(find(2 * c), []).append(c)
        after.setdefault(find(2 * c + 1), []).append(c)
    above = [tuple(after.get(find(2 * c), ())) for c in range(scan_.chords)]
    beside = [tuple(before[find(2 * c)]) for c in range(scan_.chords)]
    return above, beside
