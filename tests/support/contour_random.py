# SPDX-License-Identifier: GPL-2.0-or-later
"""Seeded random contours for tests and benches, as parts for make_contour.

Two kinds: filleted polygons (every corner may get an arc, some stay sharp) and line/arc
contours (edges of a polygon bulged into arcs, not tangent).  Half of each are rounded to
four decimals as a CAM system prints them, which makes arcs slightly impossible and
tangents slightly wrong.  Shapes that cross themselves are thrown away by a test of its own.
"""

import math

import numpy as np

from chipwise.geometry.base.contour import ArcElement, ContourError, LineElement, make_contour


def _star(rng, n, size):
    angle = np.sort(rng.uniform(0.0, 2.0 * math.pi, n))
    r = size * rng.uniform(0.25, 1.0, n)
    return np.stack((r * np.cos(angle), r * np.sin(angle)), axis=1)


def _tangled(rng, n, size):
    """Random points, uncrossed two edges at a time."""
    p = rng.uniform(-size, size, (n, 2))
    for _ in range(20 * n * n):
        found = _crossing_edges(p)
        if found is None:
            return p
        i, j = found
        p[i + 1 : j + 1] = p[i + 1 : j + 1][::-1].copy()
    return None


def _crossing_edges(p):
    n = len(p)
    a, b = p, np.roll(p, -1, axis=0)

    def left(u, v, w):
        return (v[:, 0] - u[:, 0]) * (w[:, 1] - u[:, 1]) - (v[:, 1] - u[:, 1]) * (w[:, 0] - u[:, 0])

    i, j = np.triu_indices(n, 2)
    ok = ~((i == 0) & (j == n - 1))
    i, j = i[ok], j[ok]
    hit = (left(a[i], b[i], a[j]) * left(a[i], b[i], b[j]) < 0) & (left(a[j], b[j], a[i]) * left(a[j], b[j], b[i]) < 0)
    k = np.flatnonzero(hit)
    return None if not len(k) else (int(i[k[0]]), int(j[k[0]]))


def polygon(rng, least=4, most=14, size=30.0):
    """Random simple polygon (n, 2), either way round."""
    while True:
        n = int(rng.integers(least, most + 1))
        p = _star(rng, n, size) if rng.random() < 0.5 else _tangled(rng, n, size)
        if p is None:
            continue
        edges = np.hypot(*(np.roll(p, -1, axis=0) - p).T)
        if _crossing_edges(p) is None and edges.min() > 0.02 * size:
            return p if rng.random() < 0.5 else p[::-1]


def filleted(rng, **kind):
    """(parts, smallest fillet radius) of a polygon with filleted corners."""
    p = polygon(rng, **kind)
    n = len(p)
    edge = np.roll(p, -1, axis=0) - p
    length = np.hypot(*edge.T)
    unit = edge / length[:, None]
    corners, smallest = [], math.inf
    for k in range(n):
        u, v = unit[k - 1], unit[k]
        turn = math.atan2(u[0] * v[1] - u[1] * v[0], u @ v)
        room = 0.45 * min(length[k - 1], length[k])
        half = math.tan(abs(turn) / 2.0)
        r = rng.uniform(0.05, 1.0) * room / half if half > 1e-6 else 0.0
        r = min(r, 10.0)
        if rng.random() < 0.15 or r < 0.05 or abs(turn) > 3.1:
            corners.append((p[k], p[k], None, False))
            continue
        smallest = min(smallest, r)
        cut = r * half
        a, b = p[k] - cut * u, p[k] + cut * v
        ccw = turn > 0.0
        centre = a + (r if ccw else -r) * np.array((-u[1], u[0]))
        corners.append((a, b, centre, ccw))
    parts = []
    for k in range(n):
        a, b, centre, ccw = corners[k]
        if centre is not None:
            parts.append(ArcElement(tuple(a), tuple(b), tuple(centre), bool(ccw), len(parts) + 1))
        parts.append(LineElement(tuple(b), tuple(corners[(k + 1) % n][0]), len(parts) + 1))
    return parts, smallest


def bulged(rng, **kind):
    """Parts of a polygon with edges bulged into arcs."""
    p = polygon(rng, **kind)
    parts = []
    for k in range(len(p)):
        a, b = p[k], p[(k + 1) % len(p)]
        if rng.random() < 0.4:
            parts.append(LineElement(tuple(a), tuple(b), k + 1))
            continue
        half = math.exp(rng.uniform(math.log(0.05), math.log(2.2)))  # half the sweep
        left = rng.random() < 0.5
        chord = b - a
        height = 0.5 * math.hypot(*chord) / math.tan(half)
        normal = np.array((-chord[1], chord[0])) / math.hypot(*chord)
        centre = 0.5 * (a + b) + (height if left else -height) * normal
        parts.append(ArcElement(tuple(a), tuple(b), tuple(centre), left, k + 1))
    return parts


def rounded(parts, digits=4):
    """The same parts as a post-processor prints them."""

    def r(p):
        return tuple(round(float(v), digits) for v in p)

    return [
        ArcElement(r(q.start), r(q.end), r(q.centre), q.ccw, q.line)
        if isinstance(q, ArcElement)
        else LineElement(r(q.start), r(q.end), q.line)
        for q in parts
    ]


# Chords of flattened arcs: evenly, and ever denser towards both ends, where a neighbour at
# a sharp angle may be crossed.
_FLAT = np.unique(
    np.concatenate((np.linspace(0.0, 1.0, 24, endpoint=False), 0.5 ** np.arange(5, 15), 1.0 - 0.5 ** np.arange(5, 15)))
)


def _flat(parts):
    points = []
    for q in parts:
        if isinstance(q, LineElement):
            points.append(np.array([q.start]))
            continue
        a = math.atan2(q.start[1] - q.centre[1], q.start[0] - q.centre[0])
        b = math.atan2(q.end[1] - q.centre[1], q.end[0] - q.centre[0])
        sweep = (b - a) % (2 * math.pi) if q.ccw else -((a - b) % (2 * math.pi))
        t = _FLAT
        r = math.hypot(q.start[0] - q.centre[0], q.start[1] - q.centre[1])
        angle = a + sweep * t
        points.append(np.stack((q.centre[0] + r * np.cos(angle), q.centre[1] + r * np.sin(angle)), axis=1))
    return np.concatenate(points)


def simple(parts, clearance=0.02):
    """Whether a shape neither crosses nor nearly touches itself, by flattening."""
    p = _flat(parts)
    if _crossing_edges(p) is not None:
        return False
    # points near an edge that is not near along the contour
    a, b = p, np.roll(p, -1, axis=0)
    d = b - a
    away = np.cumsum(np.hypot(*d.T))
    total = away[-1]
    at = np.concatenate(([0.0], away[:-1]))
    off = p[:, None] - a[None]
    t = np.clip((off * d[None]).sum(2) / np.maximum((d * d).sum(1), 1e-18)[None], 0.0, 1.0)
    gap = np.hypot(*np.moveaxis(off - t[:, :, None] * d[None], 2, 0))
    along = np.abs(at[:, None] - (at[None] + t * np.hypot(*d.T)[None]))
    along = np.minimum(along, total - along)
    return bool(np.all((gap > clearance) | (along < 6.0 * gap + 1e-9)))


def contour_case(seed, kind):
    """(parts, radius) number `seed` of a kind, "filleted" or "bulged"."""
    rng = np.random.default_rng([seed, 0 if kind == "filleted" else 1])
    while True:
        if kind == "filleted":
            parts, smallest = filleted(rng)
            if not math.isfinite(smallest):
                continue
            radius = rng.uniform(0.2, 2.5) * smallest
        else:
            parts = bulged(rng)
            radius = math.exp(rng.uniform(math.log(0.3), math.log(10.0)))
        if rng.random() < 0.5:
            parts, radius = rounded(parts), round(radius, 3)
        if radius > 0.01 and simple(parts):
            return parts, radius


def grid(rng, cells=14):
    """Parts of the outline of a random heap of unit squares without holes, some corners
    rounded by exactly half a unit or a quarter: walls at exact multiples, equal radii."""
    while True:
        outline = _heap_outline(rng, cells)
        if outline is not None:
            break
    p = np.array(outline, float)
    n = len(p)
    unit = np.roll(p, -1, axis=0) - p
    unit /= np.hypot(*unit.T)[:, None]
    corners = []
    for k in range(n):
        u, v = unit[k - 1], unit[k]
        ccw = bool(u[0] * v[1] - u[1] * v[0] > 0.0)
        r = rng.choice([0.0, 0.0, 0.25, 0.5])
        centre = p[k] - r * u + (r if ccw else -r) * np.array((-u[1], u[0]))
        corners.append((p[k] - r * u, p[k] + r * v, centre if r else None, ccw))
    parts = []
    for k in range(n):
        a, b, centre, ccw = corners[k]
        if centre is not None:
            parts.append(ArcElement(tuple(a), tuple(b), tuple(centre), ccw, len(parts) + 1))
        after = corners[(k + 1) % n][0]
        if math.hypot(*(after - b)) > 1e-9:
            parts.append(LineElement(tuple(b), tuple(after), len(parts) + 1))
    return parts if rng.random() < 0.5 else backwards(parts)


def _heap_outline(rng, cells):
    """Corners (n, 2) of a random edge-connected heap of cells, None where it has a hole or
    touches itself at a corner."""
    heap = {(0, 0)}
    while len(heap) < cells:
        x, y = sorted(heap)[rng.integers(len(heap))]
        dx, dy = ((1, 0), (-1, 0), (0, 1), (0, -1))[rng.integers(4)]
        heap.add((x + dx, y + dy))
    step = {}
    for x, y in heap:
        p, q, r, s = (x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)
        for a, b, other in ((p, q, (x, y - 1)), (q, r, (x + 1, y)), (r, s, (x, y + 1)), (s, p, (x - 1, y))):
            if other not in heap:
                if a in step:
                    return None
                step[a] = b
    first = here = min(step)
    walk = []
    while True:
        walk.append(here)
        here = step[here]
        if here == first:
            break
    if len(walk) != len(step):
        return None
    n = len(walk)
    return [
        walk[k]
        for k in range(n)
        if (walk[k][0] - walk[k - 1][0], walk[k][1] - walk[k - 1][1])
        != (walk[(k + 1) % n][0] - walk[k][0], walk[(k + 1) % n][1] - walk[k][1])
    ]


def backwards(parts):
    """The same shape travelled the other way."""
    return [
        ArcElement(q.end, q.start, q.centre, not q.ccw, q.line)
        if isinstance(q, ArcElement)
        else LineElement(q.end, q.start, q.line)
        for q in reversed(parts)
    ]


def grid_case(seed):
    """(parts, radius) of a grid contour with a radius that fits its walls exactly."""
    rng = np.random.default_rng([seed, 2])
    return grid(rng, int(rng.integers(5, 30))), float(rng.choice([0.25, 0.5, 0.75, 1.0, 1.5]))


def chords(parts, step):
    """The same shape with every arc as chords no longer than `step`, rounded: the many tiny
    elements in a row of a program made from a drawing."""
    made = []
    for q in parts:
        points = [q.start, q.end]
        if isinstance(q, ArcElement):
            a = math.atan2(q.start[1] - q.centre[1], q.start[0] - q.centre[0])
            b = math.atan2(q.end[1] - q.centre[1], q.end[0] - q.centre[0])
            sweep = (b - a) % (2 * math.pi) if q.ccw else -((a - b) % (2 * math.pi))
            r = math.hypot(q.start[0] - q.centre[0], q.start[1] - q.centre[1])
            n = max(2, math.ceil(r * abs(sweep) / step))
            points = (
                [q.start]
                + [
                    (q.centre[0] + r * math.cos(a + sweep * k / n), q.centre[1] + r * math.sin(a + sweep * k / n))
                    for k in range(1, n)
                ]
                + [q.end]
            )
        made += [LineElement(tuple(s), tuple(e), len(made) + k + 1) for k, (s, e) in enumerate(zip(points, points[1:]))]
    return rounded(made)


def chords_case(seed):
    """(parts, radius) of a filleted polygon in chords, tool up to 2.5 x the fillet."""
    rng = np.random.default_rng([seed, 3])
    while True:
        parts, smallest = filleted(rng, most=9)
        if math.isfinite(smallest) and simple(parts):
            return chords(parts, rng.uniform(0.3, 1.0)), rng.uniform(0.2, 2.5) * smallest


def needles_case(seed):
    """(parts, radius) of a star of needles with slightly bowed sides, tips down to a degree.

    Stars that cross themselves are thrown away by the kernel's own check, because the flat
    one above takes a needle for a touch; so this kind does not test what is refused.
    """
    rng = np.random.default_rng([seed, 5])
    while True:
        n = 2 * int(rng.integers(5, 12))
        angle = np.cumsum(rng.uniform(0.05, 1.0, n) ** 2 + 1e-3)
        angle *= 2.0 * math.pi * (1.0 - 1e-3) / angle[-1]
        r = 20.0 * np.where(np.arange(n) % 2, rng.uniform(0.02, 0.3, n), rng.uniform(0.5, 1.0, n))
        p = np.stack((r * np.cos(angle), r * np.sin(angle)), axis=1)
        parts = [_bowed(rng, p[k], p[(k + 1) % n], k + 1) for k in range(n)]
        try:
            make_contour(parts)
        except ContourError:
            continue
        return parts, math.exp(rng.uniform(math.log(0.01), math.log(12.0)))


def _bowed(rng, a, b, line):
    """A line or a flat arc from a to b."""
    if rng.random() < 0.5:
        return LineElement(tuple(a), tuple(b), line)
    half, left = math.exp(rng.uniform(math.log(1e-4), math.log(0.3))), bool(rng.random() < 0.5)
    chord = b - a
    height = 0.5 * math.hypot(*chord) / math.tan(half)
    normal = np.array((-chord[1], chord[0])) / math.hypot(*chord)
    centre = 0.5 * (a + b) + (height if left else -height) * normal
    return ArcElement(tuple(a), tuple(b), tuple(centre), left, line)
