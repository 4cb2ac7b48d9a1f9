# SPDX-License-Identifier: GPL-2.0-or-later
"""Polygons as lists of corners: where they bend, their centre of gravity and height, and cuts that may divide them.

Called by convex.py and baseline.py.  Lengths mm; a position on a polygon is (edge, share of it).
"""

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

# Cuts sorted before the others: mostly one of them stays inside.
FEW = 24


def cross(a, b):
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


def level(p, polygon, above, level):
    """The two positions of a convex polygon at a height above one of its edges; a position on a shared
    edge moves to the nearer end.  None where there are not two."""
    positions, n = [], len(p)
    for k in range(n):
        a, b = above[k], above[(k + 1) % n]
        if (a < level) != (b < level):
            t = (level - a) / (b - a)
            if polygon[k][1] or t < 0.05 or t > 0.95:
                t = float(t > 0.5)
            positions.append((k, t) if t < 1.0 else ((k + 1) % n, 0.0))
    return positions if len(positions) == 2 and positions[0] != positions[1] else None


def nearest(p, inner, q):
    """(distance, position on p, position on q) of the shortest connection between loops p and q (n, 2), bridges
    left out; a position is (edge, share)."""
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


def looks(p, k, target):
    """Whether the straight line from corner k to target starts inside the polygon."""
    n = len(p)
    d, before, after = target - p[k], p[k - 1] - p[k], p[(k + 1) % n] - p[k]
    if cross(-before, after) >= 0.0:
        return cross(after, d) > 0.0 and cross(d, before) > 0.0
    return not (cross(before, d) >= 0.0 and cross(d, after) >= 0.0)


def candidates(p, polygon, before, after, bend, bent):
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
    mends = (cross(before[bent][:, None], d) >= 0.0) & (cross(after[bent][:, None], d) >= 0.0)
    both = (bend < BEND) & (cross(before, -d[:, :n]) >= 0.0) & (cross(after, -d[:, :n]) >= 0.0)
    cost = length * np.where(np.concatenate((both, np.zeros_like(both)), axis=1), BOTH_ENDS, 1.0)
    cost = np.where(mends, cost, cost + 4.0 * length.max())
    usable = np.concatenate((np.ones_like(square), square), axis=1) & (length > 1e-9)
    cost = np.where(usable, cost, np.inf).ravel()
    for order in rising(cost):
        row, column = divmod(int(order), 2 * n)
        yield int(bent[row]), column % n, float(t[row, column - n]) if column >= n else 0.0


def rising(cost):
    """Indices of finite costs in rising order, the first ones without sorting all."""
    few = min(FEW, len(cost) - 1)
    first = np.argpartition(cost, few)[:few]
    yield from first[np.lexsort((first, cost[first]))][: np.count_nonzero(np.isfinite(cost[first]))]
    rest = np.setdiff1d(np.flatnonzero(np.isfinite(cost)), first)
    yield from rest[np.argsort(cost[rest], kind="stable")]


def visible(p, i, k, t):
    """Whether the straight line from corner i to position (k, t) stays inside the polygon and off its corners."""
    n = len(p)
    after = np.roll(p, -1, axis=0)
    target = p[k] + t * (after[k] - p[k]) if t else p[k]
    if not looks(p, i, target) or (not t and (k in (i, (i + 1) % n, i - 1 if i else n - 1) or not looks(p, k, p[i]))):
        return False
    d = target - p[i]
    length = math.hypot(*d)
    off = p - p[i]
    side, along = cross(d, off) / length, (off @ d) / length
    slack = 1e-7 * length
    on_line = (np.abs(side) < slack) & (along > slack) & (along < length - slack)
    if on_line.any():
        return False
    side_after, edge = np.roll(side, -1), after - p
    to_v, to_t = cross(edge, p[i] - p), cross(edge, target - p)
    crossing = (side * side_after < 0.0) & (to_v * to_t < 0.0)
    touched = (np.hypot(*(p - p[i]).T) < 1e-9) | (np.hypot(*(p - target).T) < 1e-9)
    crossing &= ~(touched | np.roll(touched, -1))
    if t:
        crossing[k] = False
    return not crossing.any()
