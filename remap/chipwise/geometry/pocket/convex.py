# SPDX-License-Identifier: GPL-2.0-or-later
"""A polygon with holes divided into convex polygons that meet along whole edges.

Called by concentric.py.  Source: the abstract on area machining by convex polygons, which asks for
the division and leaves open how.

1. Every hole is joined to the outline, or to another hole, by the shortest bridge, the nearest
   first (a spanning tree of shortest connections does not cross itself).
2. While a polygon has a corner that bends inward, it is cut from such a corner: of all cuts that
   mend a corner the shortest that stays inside, to a corner or square onto an edge.  Short cuts
   cross the polygon at its necks, so the middle points of cuts follow its middle.
3. Bridges and cuts end on the outline or on holes, never on another cut.  So polygons share whole
   edges, and every corner of every polygon lies on the outline or on a hole.
4. Long polygons are cut across (slimmer()), because the distance from the centre of gravity to the
   edges decides how many closed paths are needed everywhere.
"""

import heapq
import math

import numpy as np

from chipwise.geometry.pocket.convex_cuts import BEND, bends, candidates, height, level, looks, nearest, visible

# Corners asked for their cuts at a time: with more the shortest cut of all is found, but slowly.
MOST_ASKED = 10

# Shares of the height above the farthest edge at which a long polygon may be cut across.
ACROSS = (0.35, 0.65, 1.0, 1.35)

# A cut across pays when the largest height of both parts is below this share of the old one.
WORTH = 0.93

# Cuts across: more would only refine.
MOST_CUTS = 200


class Partition:
    """points: list of (x, y) mm; polygons: list of polygons, counter-clockwise, each a list of
    (point, inner): inner says whether the edge from this point to the next is shared."""

    def __init__(self, outline, holes):
        """outline (n, 2) counter-clockwise, holes (m, 2) clockwise, mm."""
        self.points = []
        loops = [[(self._add(p), False) for p in loop] for loop in (outline, *holes)]
        self.polygons, waiting = [], [self._bridged(loops)]
        while waiting:
            polygon = waiting.pop()
            parts = self._cut(polygon)
            if parts is None:
                self.polygons.append(polygon)
            else:
                waiting += parts

    def _add(self, point):
        self.points.append((float(point[0]), float(point[1])))
        return len(self.points) - 1

    def corners(self, polygon):
        """Corners [(x, y)] of a polygon."""
        return [self.points[k] for k, _ in polygon]

    def array(self, polygon):
        """Corners (n, 2) of a polygon."""
        return np.array([self.points[k] for k, _ in polygon])

    def height(self, polygon):
        """height() with the centre of gravity."""
        return height(self.corners(polygon), [f for _, f in polygon])

    def convex(self):
        """Whether every polygon came out convex."""
        return all(len(q) > 2 and min(bends(self.corners(q))) >= 10.0 * BEND for q in self.polygons)

    # --- 1: bridges

    def _bridged(self, loops):
        """One polygon of the outline and all holes, bridges there and back."""
        polygon, left = loops[0], loops[1:]
        while left:
            found = [nearest(self.array(polygon), [f for _, f in polygon], self.array(loop)) for loop in left]
            k = min(range(len(left)), key=lambda n: found[n][0])
            _, here, there = found[k]
            loop, to = self._at(left.pop(k), there)
            polygon, start = self._at(polygon, here)
            start = self._occurrence(polygon, start, self.points[loop[to][0]])
            turned = loop[to:] + loop[:to]
            polygon = polygon[:start] + [(polygon[start][0], True)] + turned + [(turned[0][0], True)] + polygon[start:]
        return polygon

    def _at(self, polygon, position):
        """(polygon, index) with a corner at a position (index, share of the edge)."""
        k, t = position
        if t <= 0.0:
            return polygon, k
        if t >= 1.0:
            return polygon, (k + 1) % len(polygon)
        a, b = self.points[polygon[k][0]], self.points[polygon[(k + 1) % len(polygon)][0]]
        new = self._add((a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])))
        return polygon[: k + 1] + [(new, polygon[k][1])] + polygon[k + 1 :], k + 1

    def _occurrence(self, polygon, k, target):
        """Which corner at the same point looks towards target."""
        same = [m for m, corner in enumerate(polygon) if corner[0] == polygon[k][0]]
        for m in same:
            if looks(self.array(polygon), m, np.array(target)):
                return m
        return k

    # --- 2: cuts

    def _cut(self, polygon):
        """Two parts of a polygon with a corner that bends inward; None where there is none or where
        no cut can be found."""
        bend = np.array(bends(self.corners(polygon)))
        bent = np.flatnonzero(bend < BEND)
        if not len(bent):
            return None
        p = self.array(polygon)
        before, after = p - np.roll(p, 1, axis=0), np.roll(p, -1, axis=0) - p
        asked = bent[:: -(-len(bent) // MOST_ASKED)]
        for i, k, t in candidates(p, polygon, before, after, bend, asked):
            if visible(p, i, k, t):
                return self._split(polygon, i, k, t)
        return None

    def _split(self, polygon, i, k, t):
        """The two parts along a cut from corner i to position (k, t)."""
        cut, j = self._at(polygon, (k, t))
        if len(cut) > len(polygon) and j <= i:
            i += 1
        i, j = min(i, j), max(i, j)
        return [cut[i:j] + [(cut[j][0], True)], cut[j:] + cut[:i] + [(cut[i][0], True)]]

    # --- 3: cuts that other cuts made needless

    def merged(self):
        """Takes away shared edges, the longest first, where both polygons together are convex and
        no taller than the tallest."""
        tallest = max(self.height(q)[0] for q in self.polygons)
        owner = {
            (q[k][0], q[(k + 1) % len(q)][0]): n for n, q in enumerate(self.polygons) for k in range(len(q)) if q[k][1]
        }
        pairs = sorted((edge for edge in owner if edge[0] < edge[1]), key=self._minus_length)
        for a, b in pairs:
            n, m = owner[a, b], owner[b, a]
            both = self._together(self.polygons[n], self.polygons[m], a, b)
            if both is None or self.height(both)[0] > tallest:
                continue
            self.polygons[n], self.polygons[m] = both, []
            for k, (u, inner) in enumerate(both):
                if inner:
                    owner[u, both[(k + 1) % len(both)][0]] = n
        self.polygons = [q for q in self.polygons if q]

    def _minus_length(self, edge):
        return -math.dist(self.points[edge[0]], self.points[edge[1]])

    def _together(self, first, second, a, b):
        """Two polygons without the edge a-b they share, None where that is not convex."""
        i = next(k for k, (u, _) in enumerate(first) if u == a and first[(k + 1) % len(first)][0] == b)
        j = next(k for k, (u, _) in enumerate(second) if u == b)
        both = first[i + 1 :] + first[:i]
        both += [second[(j + 1 + k) % len(second)] for k in range(len(second) - 1)]
        return both if min(bends(self.corners(both))) >= BEND else None

    # --- 4: long polygons

    def slimmer(self):
        """Cuts long polygons across while that lowers the largest height of all; returns it."""
        heap = [(-self.height(q)[0], n) for n, q in enumerate(self.polygons)]
        heapq.heapify(heap)
        for _ in range(MOST_CUTS):
            if not heap:
                break
            tall, n = heapq.heappop(heap)
            parts = self._across(self.polygons[n], -tall)
            if parts is None:
                heapq.heappush(heap, (tall, n))
                break
            self.polygons[n] = parts[0]
            self.polygons.append(parts[1])
            for m in (n, len(self.polygons) - 1):
                heapq.heappush(heap, (-self.height(self.polygons[m])[0], m))
        return -heap[0][0] if heap else 0.0

    def _across(self, polygon, tall):
        """The best cut of a polygon parallel to its farthest edge, or None."""
        p = self.array(polygon)
        _, edge = self.height(polygon)
        if polygon[edge][1]:
            return None
        along = p[(edge + 1) % len(p)] - p[edge]
        inward = np.array((-along[1], along[0])) / math.hypot(*along)
        above = (p - p[edge]) @ inward
        best, count = None, len(self.points)
        for share in ACROSS:
            positions = level(p, polygon, above, share * tall)
            if positions is None:
                continue
            del self.points[count:]
            parts = self._between(polygon, *positions)
            if parts is None:
                continue
            worst = max(self.height(q)[0] for q in parts)
            if worst < WORTH * tall and (best is None or worst < best[0]):
                best = worst, positions
        del self.points[count:]
        return best and self._between(polygon, *best[1])

    def _between(self, polygon, first, second):
        """The two parts along a cut between two positions, None where one would have no area."""
        cut, i = self._at(polygon, first)
        if len(cut) > len(polygon) and second[0] > first[0]:
            second = (second[0] + 1, second[1])
        more, j = self._at(cut, second)
        if len(more) > len(cut) and j <= i:
            i += 1
        i, j = min(i, j), max(i, j)
        if j - i < 2 or len(more) - (j - i) < 2:
            return None
        return [more[i:j] + [(more[j][0], True)], more[j:] + more[:i] + [(more[i][0], True)]]
