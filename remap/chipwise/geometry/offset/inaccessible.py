# SPDX-License-Identifier: GPL-2.0-or-later
"""What of the finish shape the tool cannot reach.

Called by kernel.py.  Along the finish shape, touched segments and untouched gaps
alternate.  A region's edge runs along a gap, then back along the tool's edge at the corner
whose far foot ends that gap, along the next gap, and so on until it closes: one gap for a
corner too tight, two for a neck between two paths, more for a hub of several necks.
"""

from dataclasses import dataclass, replace

import numpy as np

from chipwise.geometry.base import elements, winding
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.offset.necks import InaccessibleRegion, areas, disentangled
from chipwise.geometry.base.tolerances import REGION_MM2, SAME_FOOT_MM
from chipwise.geometry.offset.touch import corner_arcs, segments as segments_of


@dataclass(frozen=True, eq=False)
class InaccessibleSegment:
    """Finish elements that no path touches and no tool edge closes: at the ends of an open
    contour, or beyond the end of an open path."""

    elements: Elements
    lines: tuple


@dataclass(frozen=True, eq=False)
class _Segments:
    """s segments: first, last (s,) int path elements; before, after (s,) int segment on
    the other side of the corner at its start and end, -1 without one; along (s,)
    int the next segment along the contour, -1 at an open end; gap (s,) mm up to it."""

    first: np.ndarray
    last: np.ndarray
    before: np.ndarray
    after: np.ndarray
    along: np.ndarray
    gap: np.ndarray


def inaccessible(finish, touch, paths, side, radius):
    """InaccessibleRegions and InaccessibleSegments, in contour order."""
    if not (touch.corner | (touch.following < 0)).any():
        return _with_untouched(finish, touch, side, ())
    segment = _segments(finish, touch)
    gaps, gap_of = _gap_segments(finish, touch, segment)
    corner = touch_corners(touch, segment)
    edges = elements.reverse(corner_arcs(finish, touch, corner, side, radius))
    edge_of = {int(s): len(gaps[0]) + len(corner) - 1 - k for k, s in enumerate(np.flatnonzero(segment.after >= 0))}
    found, loose = _cycles(segment)
    pool = _Pool(elements.join((gaps[0], edges)), finish.line[gaps[1]].tolist(), gap_of, edge_of)
    result = _regions(pool, found, paths, side, radius)
    result += _loose(pool, loose)
    result += _leading(finish, touch, segment)
    return _with_untouched(finish, touch, side, result)


def touch_corners(touch, segment):
    """Path elements (k,) int after which a corner ends a segment."""
    return segment.last[segment.after >= 0]


def _segments(finish, touch):
    ends = np.flatnonzero(touch.corner | (touch.following < 0))
    first = touch.following[touch.corner]
    starts = np.concatenate((first, _open_starts(touch))).astype(int)
    # The segment of each end: walk is implicit, because elements of a path are in order
    # and only the closing step of a closed path goes back.
    number = np.full(len(touch.path), -1)
    number[ends] = np.arange(len(ends))
    begin = np.empty(len(ends), int)
    begin[_end_of(touch, starts, number)] = starts
    opened = np.full(len(touch.path), -1)
    opened[begin] = np.arange(len(ends))
    follow = touch.following[ends]
    after = np.where(follow >= 0, opened[follow], -1)
    before = np.full(len(ends), -1)
    before[after[after >= 0]] = np.flatnonzero(after >= 0)
    positions = _positions(finish, touch, begin, ends)
    return _Segments(begin, ends, before, after, *_next_along(finish, touch, begin, *positions))


def _open_starts(touch):
    """First elements of open paths."""
    entered = np.zeros(len(touch.path), bool)
    entered[touch.following[touch.following >= 0]] = True
    return np.flatnonzero(~entered)


def _end_of(touch, starts, number):
    """Segment number whose end is reached from each start (k,)."""
    ends = np.flatnonzero(number >= 0)
    position = np.searchsorted(ends, starts)
    beyond = (position == len(ends)) | (touch.path[ends[np.minimum(position, len(ends) - 1)]] != touch.path[starts])
    lowest = np.searchsorted(touch.path[ends], touch.path[starts])
    return np.where(beyond, lowest, position)


def _positions(finish, touch, begin, ends):
    """Position (s,) mm along its contour where each segment begins, and its length (s,) mm."""
    foot = touch.finish[begin]
    at = finish.upto[foot] + touch.t0[begin] * finish.length[foot]
    ring = finish.owner[foot]
    at = np.where(finish.closed[ring] & (at > finish.total[ring] - SAME_FOOT_MM), 0.0, at)
    touched = (touch.t1 - touch.t0) * finish.length[touch.finish]
    onward = np.cumsum(touched + np.where(touch.corner | (touch.following < 0), 0.0, touch.step))
    lap = np.bincount(touch.path, np.diff(onward, prepend=0.0))
    length = onward[ends] - onward[begin] + touched[begin]
    length += np.where(begin == ends, 0.0, np.where(touch.corner[begin], 0.0, touch.step[begin]))
    return at, np.where(ends < begin, length + lap[touch.path[begin]], length)


def _next_along(finish, touch, begin, at, size):
    """Next segment (s,) int along each one's contour, -1 at the end of an open one; and
    the gap (s,) mm up to it."""
    ring = finish.owner[touch.finish[begin]]
    order = np.lexsort((size, at, ring))
    along = np.full(len(begin), -1)
    along[order[:-1]] = order[1:]
    tail = np.flatnonzero(np.append(ring[order][1:] != ring[order][:-1], True))
    head = np.append(0, tail[:-1] + 1)
    last = order[tail]
    closed = finish.closed[ring[last]]
    along[last] = np.where(closed, order[head], -1)
    target = at[along]
    target[last] = np.where(closed, at[order[head]] + finish.total[ring[last]], finish.total[ring[last]])
    return along, target - at - size


def _gap_segments(finish, touch, segment):
    """Finish pieces of every gap: (Elements, finish index (p,)), and the span of each."""
    last, owner = segment.last, finish.owner[touch.finish[segment.last]]
    first, n = finish.first[owner], finish.count[owner]
    f0, t0 = touch.finish[last], touch.t1[last]
    beyond, target = segment.along < 0, segment.first[segment.along]
    f1 = np.where(beyond, first + n - 1, touch.finish[target])
    t1 = np.where(beyond, 1.0, touch.t0[target])
    many = np.where((f1 == f0) & (t1 < t0), n + 1, (f1 - f0) % n + 1)
    many = np.where(segment.gap > SAME_FOOT_MM, many, 0)
    begin = np.cumsum(many) - many
    which = np.repeat(np.arange(len(last)), many)
    step = np.arange(len(which)) - begin[which]
    index = first[which] + (f0[which] - first[which] + step) % n[which]
    a = np.where(step == 0, t0[which], 0.0)
    b = np.where(step == many[which] - 1, t1[which], 1.0)
    real = (b - a) * finish.length[index] > 0.0
    bounds = np.append(0, np.cumsum(real))
    spans = [(int(bounds[s]), int(bounds[s + m])) for s, m in zip(begin, many)]
    return (segments_of(finish, index[real], a[real], b[real]), index[real]), spans


def _cycles(segment):
    """Gaps chained to regions: (closed lists, loose lists) of segment indices."""
    into = {}
    onward = []
    for s, m in enumerate(segment.along.tolist()):
        onward.append(int(segment.before[m]) if m >= 0 else -1)
        into[onward[-1]] = s
    seen, closed, loose = set(), [], []
    for s in range(len(onward)):
        if s in seen or segment.after[s] < 0:
            continue
        chain, here = [], s
        while here >= 0 and here not in seen:
            seen.add(here)
            chain.append(here)
            here = onward[here]
        (closed if here == s else loose).append(chain)
    loose += [[s] for s in range(len(onward)) if s not in seen]
    return closed, loose


@dataclass(frozen=True, eq=False)
class _Pool:
    """members: the pieces of all gaps, then the tool's edges at corners; line: source line of each piece of a gap;
    gap_of: (first, end) of each segment's gap; edge_of: {segment: the edge at the corner after it}."""

    members: Elements
    line: list
    gap_of: list
    edge_of: dict

    def around(self, chain):
        """Members of the closed edge along a chain of gaps."""
        index = []
        for s, onward in zip(chain, chain[1:] + chain[:1]):
            index += [*range(*self.gap_of[s]), self.edge_of[onward]]
        return index

    def lines(self, index):
        """Source lines of members; edges have none."""
        return tuple(sorted({self.line[k] for k in index if k < len(self.line)}))


def _regions(pool, found, paths, side, radius):
    """Closed regions with an area worth naming."""
    members, necks = [], []
    for chain in found:
        (members if len(chain) == 1 else necks).append(pool.around(chain))
    result = [
        InaccessibleRegion(-side * area, pool.lines(index), pool.members, np.array(index))
        for index, area in zip(members, areas(pool.members, members))
    ]
    for index in necks:
        rows = [pool.line[k] if k < len(pool.line) else None for k in index]
        result += disentangled(elements.take(pool.members, index), rows, paths, side, radius)
    return [region for region in result if region.area > REGION_MM2]


def _loose(pool, loose):
    """Gaps that no tool edge closes."""
    gaps = [np.arange(*pool.gap_of[s]) for chain in loose for s in chain]
    return [InaccessibleSegment(elements.take(pool.members, gap), pool.lines(gap)) for gap in gaps if len(gap)]


def _leading(finish, touch, segment):
    """What lies before the first touched segment of open contours."""
    result, foot = [], touch.finish[segment.first]
    for ring in np.flatnonzero(~finish.closed):
        own = np.flatnonzero(finish.owner[foot] == ring)
        if not len(own):
            continue
        index, t = min((int(foot[s]), float(touch.t0[segment.first[s]])) for s in own)
        chain = np.arange(finish.first[ring], index + 1)
        t1 = np.where(chain == index, t, 1.0)
        real = t1 * finish.length[chain] > SAME_FOOT_MM
        if real.any():
            lines = tuple(sorted(set(finish.line[chain[real]].tolist())))
            result.append(InaccessibleSegment(segments_of(finish, chain[real], 0.0 * t1[real], t1[real]), lines))
    return result


def _with_untouched(finish, touch, side, found):
    """Found regions, and contours that no path touches at all: regions of their own, or
    holes in another where they are islands."""
    alone = np.setdiff1d(np.arange(len(finish.first)), finish.owner[touch.finish])
    islands, result = [], list(found)
    for ring in alone:
        index = finish.first[ring] + np.arange(finish.count[ring])
        chain = elements.take(finish.elements, index)
        lines = tuple(sorted(set(finish.line[index].tolist())))
        if not finish.closed[ring]:
            result.append(InaccessibleSegment(chain, lines))
        elif -side * elements.area(chain) > 0.0:
            result.append(InaccessibleRegion(-side * elements.area(chain), lines, chain, np.arange(len(chain))))
        else:
            islands.append((chain, lines))
    for chain, lines in islands:
        result = [_pierced(region, chain, lines) for region in result]
    return tuple(result)


def _pierced(region, island, lines):
    """The region with a hole where it holds the island."""
    if isinstance(region, InaccessibleSegment) or winding.numbers(region.boundary, island.start[:1])[0] == 0:
        return region
    return replace(
        region,
        area=region.area - abs(elements.area(island)),
        lines=tuple(sorted({*region.lines, *lines})),
        holes=(*region.holes, island),
    )
