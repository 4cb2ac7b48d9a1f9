# SPDX-License-Identifier: GPL-2.0-or-later
"""A grid of chop lines in one direction of a slug: its pieces, whether they fit, and what it costs.

Called by slug.py, which compares grids of several directions.  Pure; mm.
"""

import math

import numpy as np

from chipwise.geometry.base import polygons
from chipwise.geometry.base.enclosing_circle import piece_size
from chipwise.geometry.slug.disc import MIN_LINE, flat_segments

# A strip of stock thinner than this may break at any time and holds nothing: run-out, deflection and wear make a kerf
# some hundredths of a mm wider on either side than computed, so that the strip may not be there at all. mm
BRIDGE = 0.1

# Lines that clear instead of dividing overlap by this at least, so that no fin is left between them. mm
OVERLAP = 0.02

# Parts across one direction that the search looks at: it bounds the preview's time.  A slug that needs more is cleared.
MAX_PARTS = 400

# Of a grid with more cells than this the pieces are not counted one by one.
MAX_CELLS = 3000

# Chords are counted at so many positions across the slug.
COUNT_POSITIONS = 64


class Grid:
    """The slug turned so that the first group of lines is parallel to X.  parts: (n across the first, the second)."""

    def __init__(self, owner, angle, points, inner_radius):
        self.owner, self.angle, self.radius, self.inner_radius = owner, angle, owner.radius, inner_radius
        self.cos, self.sin = math.cos(angle), math.sin(angle)
        self.slug = polygons.rotated(owner.slug, -angle)
        self._reach = None
        self.points = points[0] @ np.array([[self.cos, -self.sin], [self.sin, self.cos]])
        self.starts = points[1]
        bounds = polygons.bounds(self.slug)
        self.low = (bounds[1] - self.radius, bounds[0] - self.radius)
        self.span = (bounds[3] - bounds[1] + 2 * self.radius, bounds[2] - bounds[0] + 2 * self.radius)
        self.count = [_crossings(self.slug, 1 - axis, self.low[axis], self.span[axis]) for axis in (0, 1)]

    @property
    def reach(self):
        """The allowed tool centres, turned, when first asked for."""
        if self._reach is None:
            self._reach = polygons.rotated(self.owner.reach, -self.angle)
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
        cells = (math.sqrt(size**2 / 2 - r**2) - r, size / math.sqrt(2) - 2 * r)
        return [tuple(math.ceil(span / (cell + 2 * r)) for span in self.span) for cell in cells if cell >= BRIDGE]

    def clearing(self):
        """Parts that leave nothing, for one group or the other."""
        for axis in (0, 1):
            n = math.ceil(self.span[axis] / (2 * self.radius - min(OVERLAP, self.radius)))
            yield (n, 1) if axis == 0 else (1, n)

    def positions(self, axis, n):
        """Where the lines of a group lie, mm."""
        return self.low[axis] + self.span[axis] * np.arange(1, n) / n

    def lines(self, parts):
        """How many lines, about: chords of the slug at every position."""
        total = 0
        for axis, n in enumerate(parts):
            at = (np.arange(1, n) / n * COUNT_POSITIONS).astype(int)
            total += int(self.count[axis][at].sum())
        return total

    def full(self, n, size):
        """Least parts of the second group with which even a full cell fits, None where none does."""
        height = self.cell(0, n)
        if height >= size:
            return None
        width = math.sqrt(size**2 - height**2)
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
        while low < high:  # quick looks find where to begin; what they pass is not yet sure
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
        """False where a piece of `size` is certain: a full cell, or a path along the slug that no kerf parts."""
        cells = [self.cell(axis, n) for axis, n in enumerate(parts)]
        pitch = [self.span[axis] / n for axis, n in enumerate(parts)]
        if math.hypot(*cells) >= size and self.inner_radius >= math.hypot(*pitch):
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
        wide = [
            np.maximum.reduceat(v, first) - np.minimum.reduceat(v, first)
            for v in (x, y, (x + y) * math.sqrt(0.5), (x - y) * math.sqrt(0.5))
        ]
        return not np.any((np.max(wide, axis=0) >= size) & (label[first] >= 0))

    def _rows(self, axis, n):
        """The strips between the lines of a group as (low, high), mm."""
        at = np.concatenate(([self.low[axis]], self.positions(axis, n), [self.low[axis] + self.span[axis]]))
        return [(a + self.radius, b - self.radius) for a, b in zip(at[:-1], at[1:]) if b - a > 2 * self.radius]

    def pieces(self, parts, reaching=0.0):
        """The pieces of the slug, middle row first, without those whose bounding box has a diagonal below `reaching`
        (mm)."""
        columns = self._rows(1, parts[1])
        low_x, high_x = self.low[1], self.low[1] + self.span[1]
        middle = self.low[0] + self.span[0] / 2
        for low, high in sorted(self._rows(0, parts[0]), key=lambda row: abs(sum(row) / 2 - middle)):
            for strip in polygons.clipped(self.slug, low_x, low, high_x, high):
                if polygons.diagonal(strip) < reaching:
                    continue
                first, last = strip.bounds[0], strip.bounds[2]
                for a, b in columns:
                    if b > first and a < last:
                        yield from (
                            piece
                            for piece in polygons.clipped(strip, a, low, b, high)
                            if polygons.diagonal(piece) >= reaching
                        )

    def outcome(self, parts):
        """(number of pieces, size of the largest, mm); of very many the number is about right."""
        cells = [self.cell(axis, n) for axis, n in enumerate(parts)]
        if parts[0] * parts[1] > MAX_CELLS and min(cells) > 0:
            return round(self.slug.area * parts[0] * parts[1] / (self.span[0] * self.span[1])), math.hypot(*cells)
        sizes = [piece_size(polygons.hull(piece)) for piece in self.pieces(parts)]
        return len(sizes), max(sizes, default=0.0)

    def fits(self, parts, size):
        """Whether every piece fits inside a circle of diameter < size (mm)."""
        if math.hypot(self.cell(0, parts[0]), self.cell(1, parts[1])) < size:
            return True
        return all(piece_size(polygons.hull(piece)) < size for piece in self.pieces(parts, reaching=size))

    def held(self, parts, groups, size):
        """Whether everything of `size` (mm) or more is still held, BRIDGE thick, when all lines are cut.

        Cells farther inside than their own diagonal hang on nothing by intention and are left out.
        """
        pitch = math.hypot(*(self.span[axis] / n for axis, n in enumerate(parts)))
        region = polygons.rotated(self.owner.region, -self.angle)
        waste = polygons.grow(region, self.radius)
        inner = polygons.shrink(self.slug, 1.1 * pitch)
        stock = polygons.without(polygons.grow(region, self.radius + 1.0), flat_segments(groups), self.radius, inner)
        loose = polygons.badly_held(stock, waste, BRIDGE, size)
        if any(piece_size(outline) >= size for outline in loose):
            return False
        late = polygons.released_with_rim(stock, waste, region, self.radius, BRIDGE, size)
        return all(piece_size(outline) < size for outline in late)

    def groups(self, parts):
        """The scan lines of both groups, turned; where they meet the slug, clipped to the allowed tool centres."""
        return tuple(
            [line for at in self.positions(axis, n) if (line := self._scan_line(axis, float(at)))]
            for axis, n in enumerate(parts)
        )

    def _scan_line(self, axis, at):
        """Segments of one scan line: from a tool's radius before the slug to a tool's radius after it.

        Neighbours less than the tool's diameter apart are one.
        """
        r, low, high = self.radius, self.low[1 - axis], self.low[1 - axis] + self.span[1 - axis]
        strip = (low, at - r, high, at + r) if axis == 0 else (at - r, low, at + r, high)
        met = sorted((part.bounds[axis] - r, part.bounds[axis + 2] + r) for part in polygons.clipped(self.slug, *strip))
        segments = []
        for low, high in polygons.chords(self.reach, 1 - axis, at):
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
    """How often a line across the region runs inside it, at COUNT_PLACES + 1 positions: (m,) int.

    axis 0: lines x = at, 1: y = at; from low over span, mm.
    """
    at = low + span * (np.arange(COUNT_POSITIONS + 1) + 0.5) / (COUNT_POSITIONS + 1)
    total = np.zeros(len(at), int)
    for ring in polygons.rings(region):
        v = np.asarray(ring)[:, axis]
        below = v[:, None] < at[None, :]
        total += np.sum(below[1:] != below[:-1], axis=0)
    return np.maximum(total // 2, 1)
