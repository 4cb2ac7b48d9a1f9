"""A polygon with holes divided into convex polygons that meet along whole edges.

Called by concentric.py.  Source: the abstract on area machining by convex polygons, which asks for
the division and leaves open how.

1. Every hole is joined to the outline, or to another hole, by the shortest bridge, the nearest
   first (a spanning tree of shortest ways does not cross itself).
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

# A corner bends inward where the sine of its turn is below this: above rounding, and too flat to
# carry a path out of the polygon by more than 1e-6 of an edge.
BEND = -1e-6

# A cut square onto an edge keeps this share of its length away from the edge's ends; nearer than
# that it goes to the end itself.
NEAR_END = 0.2

# A cut that mends corners at both of its ends counts as this share of its length.
BOTH_ENDS = 0.7

# Corners asked for their cuts at a time: with more the shortest cut of all is found, but slowly.
MOST_ASKED = 10

# Cuts sorted before the others: mostly one of them stays inside.
FEW = 24

# Shares of the height above the farthest edge at which a long polygon may be cut across.
ACROSS = (0.35, 0.65, 1.0, 1.35)

# A cut across pays when the largest height of both parts is below this share of the old one.
WORTH = 0.93

# Cuts across: more would only refine.
MOST_CUTS = 200


class Partition:
    """points: list of (x, y) mm; polygons: list of polygons, counter-clockwise, each a list of
    (point, inner): inner tells whether the edge from this point to the next is shared."""

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
            found = [_nearest(self.array(polygon), [f for _, f in polygon], self.array(loop))
                     for loop in left]
            k = min(range(len(left)), key=lambda n: found[n][0])
            _, here, there = found[k]
            loop, to = self._at(left.pop(k), there)
            polygon, start = self._at(polygon, here)
            start = self._occurrence(polygon, start, self.points[loop[to][0]])
            turned = loop[to:] + loop[:to]
            polygon = polygon[:start] + [(polygon[start][0], True)] + turned \
                + [(turned[0][0], True)] + polygon[start:]
        return polygon

    def _at(self, polygon, place):
        """(polygon, index) with a corner at a place (index, share of the edge)."""
        k, t = place
        if t <= 0.0:
            return polygon, k
        if t >= 1.0:
            return polygon, (k + 1) % len(polygon)
        a, b = self.points[polygon[k][0]], self.points[polygon[(k + 1) % len(polygon)][0]]
        new = self._add((a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])))
        return polygon[:k + 1] + [(new, polygon[k][1])] + polygon[k + 1:], k + 1

    def _occurrence(self, polygon, k, target):
        """Which corner at the same point looks towards target."""
        same = [m for m, corner in enumerate(polygon) if corner[0] == polygon[k][0]]
        for m in same:
            if _looks(self.array(polygon), m, np.array(target)):
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
        asked = bent[::-(-len(bent) // MOST_ASKED)]
        for i, k, t in _candidates(p, polygon, before, after, bend, asked):
            if _visible(p, i, k, t):
                return self._split(polygon, i, k, t)
        return None

    def _split(self, polygon, i, k, t):
        """The two parts along a cut from corner i to place (k, t)."""
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
        owner = {(q[k][0], q[(k + 1) % len(q)][0]): n
                 for n, q in enumerate(self.polygons) for k in range(len(q)) if q[k][1]}
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
        both = first[i + 1:] + first[:i]
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
            places = _level(p, polygon, above, share * tall)
            if places is None:
                continue
            del self.points[count:]
            parts = self._between(polygon, *places)
            if parts is None:
                continue
            worst = max(self.height(q)[0] for q in parts)
            if worst < WORTH * tall and (best is None or worst < best[0]):
                best = worst, places
        del self.points[count:]
        return best and self._between(polygon, *best[1])

    def _between(self, polygon, first, second):
        """The two parts along a cut between two places, None where one would have no area."""
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


def _cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def bends(p):
    """Sine of the turn at every corner of a polygon [(x, y)], negative where it bends inward."""
    found, (ox, oy) = [], p[-1]
    for (x, y), (nx, ny) in zip(p, p[1:] + p[:1]):
        ax, ay, bx, by = x - ox, y - oy, nx - x, ny - y
        found.append((ax * by - ay * bx) / max(math.hypot(ax, ay) * math.hypot(bx, by), 1e-300))
        ox, oy = x, y
    return found


def centroid(p):
    """Centre of gravity (x, y) of a polygon [(x, y)]."""
    (ox, oy), total, sx, sy = p[0], 0.0, 0.0, 0.0
    for (ax, ay), (bx, by) in zip(p[1:], p[2:]):
        turn = (ax - ox) * (by - oy) - (ay - oy) * (bx - ox)
        total, sx, sy = total + turn, sx + turn * (ax + bx - 2.0 * ox), sy + turn * (ay + by - 2.0 * oy)
    if abs(total) < 1e-12:
        return sum(x for x, _ in p) / len(p), sum(y for _, y in p) / len(p)
    return ox + sx / (3.0 * total), oy + sy / (3.0 * total)


def height(p, inner, centre=None):
    """(largest height mm, its edge) of the triangles between the centre (else that of gravity) and
    the edges of a polygon [(x, y)]: over an outer edge the distance of the centre from it; at a shared
    one (inner) the distance of its ends from the base line, from the centre to its middle."""
    (wx, wy), tallest, edge = centre or centroid(p), -1.0, 0
    for k, ((ax, ay), (bx, by), shared) in enumerate(zip(p, p[1:] + p[:1], inner)):
        ux, uy = (0.5 * (ax + bx) - wx, 0.5 * (ay + by) - wy) if shared else (bx - ax, by - ay)
        tall = abs(ux * (ay - wy) - uy * (ax - wx)) / max(math.hypot(ux, uy), 1e-12)
        if tall > tallest:
            tallest, edge = tall, k
    return tallest, edge


def _level(p, polygon, above, level):
    """The two places of a convex polygon at a height above one of its edges; a place on a shared
    edge moves to the nearer end.  None where there are not two."""
    places, n = [], len(p)
    for k in range(n):
        a, b = above[k], above[(k + 1) % n]
        if (a < level) != (b < level):
            t = (level - a) / (b - a)
            if polygon[k][1] or t < 0.05 or t > 0.95:
                t = float(t > 0.5)
            places.append((k, t) if t < 1.0 else ((k + 1) % n, 0.0))
    return places if len(places) == 2 and places[0] != places[1] else None


def _nearest(p, inner, q):
    """(distance, place on p, place on q) of the shortest way between loops p and q (n, 2), bridges
    left out; a place is (edge, share)."""
    best = (math.inf, (0, 0.0), (0, 0.0))
    for a, b, swap in ((p, q, False), (q, p, True)):
        start, along = b, np.roll(b, -1, axis=0) - b
        size = np.maximum((along * along).sum(axis=1), 1e-300)
        t = np.clip(((a[:, None] - start) * along).sum(axis=2) / size, 0.0, 1.0)
        if swap:
            t[:, inner] = np.round(t[:, inner])
        away = np.hypot(*np.moveaxis(a[:, None] - start - along * t[..., None], 2, 0))
        k, m = np.unravel_index(int(np.argmin(away)), away.shape)
        if away[k, m] < best[0]:
            ends = (int(k), 0.0), (int(m), float(t[k, m]))
            best = (float(away[k, m]), *(ends[::-1] if swap else ends))
    return best


def _looks(p, k, target):
    """Whether the way from corner k to target starts inside the polygon."""
    n = len(p)
    d, before, after = target - p[k], p[k - 1] - p[k], p[(k + 1) % n] - p[k]
    if _cross(-before, after) >= 0.0:
        return _cross(after, d) > 0.0 and _cross(d, before) > 0.0
    return not (_cross(before, d) >= 0.0 and _cross(d, after) >= 0.0)


def _candidates(p, polygon, before, after, bend, bent):
    """Cuts (corner, edge, share) from corners that bend inward, in the order to try: those that
    mend their corner by length, then all others to corners."""
    n, v = len(p), p[bent]
    size = np.maximum((after * after).sum(axis=1), 1e-300)
    t = ((v[:, None] - p) * after).sum(axis=2) / size
    target = np.concatenate((np.broadcast_to(p, (len(bent), n, 2)), p + after * t[..., None]), axis=1)
    d = target - v[:, None]
    length = np.hypot(d[..., 0], d[..., 1])
    to_end = np.sqrt(size) * np.minimum(t, 1.0 - t)
    square = (to_end > NEAR_END * length[:, n:]) & ~np.array([f for _, f in polygon])
    mends = (_cross(before[bent][:, None], d) >= 0.0) & (_cross(after[bent][:, None], d) >= 0.0)
    both = (bend < BEND) & (_cross(before, -d[:, :n]) >= 0.0) & (_cross(after, -d[:, :n]) >= 0.0)
    cost = length * np.where(np.concatenate((both, np.zeros_like(both)), axis=1), BOTH_ENDS, 1.0)
    cost = np.where(mends, cost, cost + 4.0 * length.max())
    usable = np.concatenate((np.ones_like(square), square), axis=1) & (length > 1e-9)
    cost = np.where(usable, cost, np.inf).ravel()
    for order in _rising(cost):
        row, column = divmod(int(order), 2 * n)
        yield int(bent[row]), column % n, float(t[row, column - n]) if column >= n else 0.0


def _rising(cost):
    """Indices of finite costs in rising order, the first ones without sorting all."""
    few = min(FEW, len(cost) - 1)
    first = np.argpartition(cost, few)[:few]
    yield from first[np.lexsort((first, cost[first]))][:np.count_nonzero(np.isfinite(cost[first]))]
    rest = np.setdiff1d(np.flatnonzero(np.isfinite(cost)), first)
    yield from rest[np.argsort(cost[rest], kind="stable")]


def _visible(p, i, k, t):
    """Whether the way from corner i to place (k, t) stays inside the polygon and off its corners."""
    n = len(p)
    after = np.roll(p, -1, axis=0)
    target = p[k] + t * (after[k] - p[k]) if t else p[k]
    if not _looks(p, i, target) or (not t and (k in (i, (i + 1) % n, i - 1 if i else n - 1)
                                               or not _looks(p, k, p[i]))):
        return False
    d = target - p[i]
    length = math.hypot(*d)
    off = p - p[i]
    side, along = _cross(d, off) / length, (off @ d) / length
    slack = 1e-7 * length
    on_way = (np.abs(side) < slack) & (along > slack) & (along < length - slack)
    if on_way.any():
        return False
    side_after, edge = np.roll(side, -1), after - p
    to_v, to_t = _cross(edge, p[i] - p), _cross(edge, target - p)
    crossing = (side * side_after < 0.0) & (to_v * to_t < 0.0)
    touched = (np.hypot(*(p - p[i]).T) < 1e-9) | (np.hypot(*(p - target).T) < 1e-9)
    crossing &= ~(touched | np.roll(touched, -1))
    if t:
        crossing[k] = False
    return not crossing.any()
