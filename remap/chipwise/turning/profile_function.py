# SPDX-License-Identifier: GPL-2.0-or-later
"""Functions x(z) made of lines and arcs: profiles, stock and the positions that a tool may take.

Called by every module of turning/.  A graph is a list of pieces, sorted and without overlap.  A gap between two pieces
means minus infinity: nothing is there.  Where two pieces meet at different heights the graph has a vertical wall.  The
region of a graph is everything below it.

All lengths mm.  Everything is exact but for rounding: intersections are solved, nothing is sampled.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

TINY_MM = 1e-10  # shorter intervals are rounding
GAP_MM = 1e-7  # rounding may open a gap of this width between pieces that meet


class Piece(NamedTuple):
    """A line or an arc over [z0, z1].

    r == 0: the line through (zr, xr) with the given slope; r > 0: the arc about (zr, xr), upper half for side 1, lower
    for -1 line: source line of the sub
    """

    z0: float
    z1: float
    zr: float
    xr: float
    slope: float = 0.0
    r: float = 0.0
    side: int = 0
    line: int = 0


Graph = Sequence[Piece]  # as a function takes it; what functions make are lists
View = Callable[[Graph], list[Piece]]  # mirrored(), or list for the same way round
Interval = tuple[float, float]  # (z0, z1) mm
Place = tuple[float, float]  # (z, x) mm
Box = tuple[float, float, float, float]  # (z0, z1, x0, x1) mm, x as radii
Region = tuple[float, float, float, float]  # (z0, z1, area mm2, largest height mm), of above()


def flat(z0: float, z1: float, x: float, line: int = 0) -> Piece:
    """A horizontal piece."""
    return Piece(z0, z1, z0, x, line=line)


def segment(z0: float, x0: float, z1: float, x1: float, line: int = 0) -> Piece:
    """The line from (z0, x0) to (z1, x1), z0 < z1."""
    return Piece(z0, z1, z0, x0, (x1 - x0) / (z1 - z0), line=line)


def value(p: Piece, z: float) -> float:
    """Height of a piece at z."""
    if p.r == 0.0:
        return p.xr + p.slope * (z - p.zr)
    d = z - p.zr
    return p.xr + p.side * math.sqrt(max(p.r * p.r - d * d, 0.0))


def slope_at(p: Piece, z: float) -> float:
    """Slope of a piece at z."""
    if p.r == 0.0:
        return p.slope
    d = z - p.zr
    h = math.sqrt(max(p.r * p.r - d * d, 0.0))
    return -p.side * d / h if h > 1e-12 else -p.side * math.copysign(1e12, d)


def top(p: Piece, z0: float, z1: float) -> float:
    """Largest height of a piece over [z0, z1]."""
    high = max(value(p, z0), value(p, z1))
    return p.xr + p.r if p.r and p.side > 0 and z0 < p.zr < z1 else high


def lowest(p: Piece) -> float:
    """Smallest height of a piece."""
    return p.xr - p.r if p.r and p.side < 0 and p.z0 < p.zr < p.z1 else min(value(p, p.z0), value(p, p.z1))


def area_under(p: Piece, z0: float, z1: float) -> float:
    """Integral of a piece over [z0, z1], mm2."""
    if p.r == 0.0:
        return (z1 - z0) * value(p, 0.5 * (z0 + z1))
    u, v = (min(max((z - p.zr) / p.r, -1.0), 1.0) for z in (z0, z1))
    half = 0.5 * (v * math.sqrt(1 - v * v) + math.asin(v) - u * math.sqrt(1 - u * u) - math.asin(u))
    return p.xr * (z1 - z0) + p.side * p.r * p.r * half


def _roots(p: Piece, q: Piece) -> tuple[float, ...]:
    """z where two pieces' carriers meet; also where only the other halves of their circles do."""
    if p.r == 0.0 and q.r == 0.0:
        return () if p.slope == q.slope else ((value(q, 0.0) - value(p, 0.0)) / (p.slope - q.slope),)
    if p.r == 0.0:
        p, q = q, p
    if q.r == 0.0:
        s, k = q.slope, q.xr - q.slope * (q.zr - p.zr) - p.xr  # x = k + s d, d = z - p.zr
        a, b, c = 1.0 + s * s, s * k, k * k - p.r * p.r
        root = b * b - a * c
        return () if root < 0.0 else tuple(p.zr + (-b + sign * math.sqrt(root)) / a for sign in (-1, 1))
    dz, dx = q.zr - p.zr, q.xr - p.xr
    d = math.hypot(dz, dx)
    if d < 1e-12 or d > p.r + q.r:
        return ()
    along = (d * d + p.r * p.r - q.r * q.r) / (2 * d)
    root = p.r * p.r - along * along
    if root < 0.0:
        return ()
    across = math.sqrt(root)
    return (p.zr + (along * dz - across * dx) / d, p.zr + (along * dz + across * dx) / d)


def _add(out: list[Piece], p: Piece, z0: float, z1: float) -> None:
    """Append a piece over [z0, z1], joined to the one before if it is the same."""
    if out:
        last = out[-1]
        if last[1] == z0 and last[2] == p[2] and last[2:] == p[2:]:
            out[-1] = Piece(last[0], z1, *p[2:])
            return
    out.append(p if p[0] == z0 and p[1] == z1 else Piece(z0, z1, *p[2:]))


def _choose(out: list[Piece], p: Piece, q: Piece, z0: float, z1: float, sign: int) -> None:
    """Append the higher (sign 1) or lower (-1) of two pieces over [z0, z1]."""
    if p[2] == q[2] and p[2:7] == q[2:7]:
        return _add(out, p, z0, z1)
    if p[5] == 0.0 and q[5] == 0.0:
        return _choose_line(out, p, q, z0, z1, sign)
    inner = [z for z in _roots(p, q) if z0 + TINY_MM < z < z1 - TINY_MM]
    cuts = [z0, *sorted(inner), z1] if inner else (z0, z1)
    for a, b in zip(cuts, cuts[1:]):
        if b > a:
            middle = 0.5 * (a + b)
            _add(out, p if sign * (value(p, middle) - value(q, middle)) >= 0.0 else q, a, b)
    return None


def _choose_line(out: list[Piece], p: Piece, q: Piece, z0: float, z1: float, sign: int) -> None:
    """_choose() for two lines: their difference at both ends says where they cross."""
    _, _, zp, xp, sp, *_ = p
    _, _, zq, xq, sq, *_ = q
    a = sign * (xp + sp * (z0 - zp) - xq - sq * (z0 - zq))
    b = sign * (xp + sp * (z1 - zp) - xq - sq * (z1 - zq))
    if (a < 0.0) != (b < 0.0) and a != b:
        cut = z0 + (z1 - z0) * a / (a - b)
        if z0 + TINY_MM < cut < z1 - TINY_MM:
            _add(out, p if a > 0.0 else q, z0, cut)
            return _add(out, p if b > 0.0 else q, cut, z1)
    return _add(out, p if a + b >= 0.0 else q, z0, z1)


def combine(f: Graph, g: Graph, sign: int) -> list[Piece]:
    """Maximum (sign 1) or minimum (-1) of two graphs.  The maximum is where either is, the minimum where both are."""
    if not f or not g:
        return list(f or g) if sign > 0 else []
    out: list[Piece] = []
    i = j = 0
    p, q = f[0], g[0]
    p0, p1, q0, q1 = p[0], p[1], q[0], q[1]  # inf: that graph is used up
    z = min(p0, q0)
    while True:
        in_p, in_q = p0 <= z, q0 <= z
        end_p, end_q = p1 if in_p else p0, q1 if in_q else q0
        end = end_p if end_p < end_q else end_q
        if end == math.inf:
            return out
        if end > z:
            if in_p and in_q:
                _choose(out, p, q, z, end, sign)
            elif sign > 0 and (in_p or in_q):
                _add(out, p if in_p else q, z, end)
        if p1 <= end:
            i += 1
            p = f[i] if i < len(f) else _NONE
            p0, p1 = p[0], p[1]
        if q1 <= end:
            j += 1
            q = g[j] if j < len(g) else _NONE
            q0, q1 = q[0], q[1]
        z = end


_NONE = Piece(math.inf, math.inf, 0.0, 0.0)


def upper(f: Graph, g: Graph) -> list[Piece]:
    return combine(f, g, 1)


def lower(f: Graph, g: Graph) -> list[Piece]:
    return combine(f, g, -1)


def envelope(graphs: Iterable[Graph]) -> list[Piece]:
    """Maximum of many graphs; neighbours in the list should be neighbours in z."""
    graphs = [g for g in graphs if g]
    while len(graphs) > 1:
        graphs = [
            upper(graphs[k], graphs[k + 1]) if k + 1 < len(graphs) else graphs[k] for k in range(0, len(graphs), 2)
        ]
    return closed(graphs[0]) if graphs else []


def closed(f: Graph) -> list[Piece]:
    """A graph without the gaps and slivers that rounding has opened."""
    out: list[Piece] = []
    for p in f:
        if out and 0.0 < p.z0 - out[-1].z1 <= GAP_MM:
            p = p._replace(z0=out[-1].z1)
        if p.z1 - p.z0 > TINY_MM:
            out.append(p)
        elif out:
            out[-1] = out[-1]._replace(z1=p.z1)
    return out


def clip(f: Graph, z0: float, z1: float) -> list[Piece]:
    """The part of a graph over [z0, z1]."""
    return [
        p if p[0] >= z0 and p[1] <= z1 else Piece(max(p[0], z0), min(p[1], z1), *p[2:])
        for p in f
        if p[1] > z0 and p[0] < z1
    ]


def negative(f: Graph) -> list[Piece]:
    """-f: gaps stay gaps."""
    return [Piece(p.z0, p.z1, p.zr, -p.xr, -p.slope, p.r, -p.side, p.line) for p in f]


def mirrored(f: Graph) -> list[Piece]:
    """f(-z)."""
    return [Piece(-p.z1, -p.z0, -p.zr, p.xr, -p.slope, p.r, p.side, p.line) for p in reversed(f)]


def moved(f: Graph, dz: float, dx: float) -> list[Piece]:
    """The graph shifted."""
    return [Piece(p[0] + dz, p[1] + dz, p[2] + dz, p[3] + dx, *p[4:]) for p in f]


def at(f: Graph, z: float) -> float | None:
    """Height at z, the higher side of a wall; None in a gap."""
    found = [value(p, z) for p in f if p.z0 <= z <= p.z1]
    return max(found) if found else None


def highest(f: Graph, z0: float, z1: float) -> float:
    """Largest height over [z0, z1], walls at its ends included; -inf without any."""
    return max([top(p, max(p[0], z0), min(p[1], z1)) for p in f if p[1] >= z0 and p[0] <= z1], default=-math.inf)


def _lines_below(p: Piece, q: Piece, z0: float, z1: float, margin: float) -> bool:
    """Whether two pieces are lines, and p is nowhere more than a margin above q."""
    if p.r or q.r:
        return False
    a = p.xr - q.xr - margin - p.slope * p.zr + q.slope * q.zr
    rise = p.slope - q.slope
    return a + rise * z0 <= 0.0 and a + rise * z1 <= 0.0


def above(f: Graph, g: Graph, margin: float = 0.0) -> list[Region]:
    """[(z0, z1, area, height)] where f is more than a margin above g: intervals, area between them (mm2), largest
    difference at their pieces' ends and middles (mm).  Where g has a gap f must have one, too."""
    found: list[Region] = []
    i = j = 0
    while i < len(f) and j < len(g):
        p, q = f[i], g[j]
        z0, z1 = max(p.z0, q.z0), min(p.z1, q.z1)
        if z1 > z0 and not _lines_below(p, q, z0, z1, margin):
            raised = Piece(q[0], q[1], q[2], q.xr + margin, *q[4:]) if margin else q
            cuts = [z0, *sorted(z for z in _roots(p, raised) if z0 < z < z1), z1]
            for a, b in zip(cuts, cuts[1:]):
                middle = 0.5 * (a + b)
                if value(p, middle) > value(raised, middle):
                    size = area_under(p, a, b) - area_under(q, a, b)
                    height = max(value(p, z) - value(q, z) for z in (a, middle, b))
                    if found and a - found[-1][1] <= GAP_MM:
                        found[-1] = (found[-1][0], b, found[-1][2] + size, max(height, found[-1][3]))
                    else:
                        found.append((a, b, size, height))
        if p.z1 <= q.z1:
            i += 1
        else:
            j += 1
    return found
