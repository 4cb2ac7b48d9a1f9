# SPDX-License-Identifier: GPL-2.0-or-later
"""Where a tool may be: the Minkowski sum of part and mirrored tool, exactly, on graphs.

Called by steps.py, sides.py, grooves.py, transverse.py, drilling.py, thread.py and obstacles.py.  A tool is a disc (the
nose), the cone above it between front and back edge, perhaps a flat bottom (grooving tools), and a holder box.
Positions are those of the nose's centre (of a grooving tool: of the corner on the left).  Then

    positions that touch     dilated(f): max over s of f(s) - t(s - z), t the tool's own lower edge
    what a path leaves       eroded(p): min over s of p(s) + t(z - s)

A convex tool is the sum of its parts, so the disc, the cone and the flat are added one after the other.
"""

import math
from collections.abc import Iterator
from functools import lru_cache

from chipwise.turning.profile_function import (
    Graph,
    Interval,
    Piece,
    above,
    clip,
    closed,
    envelope,
    flat,
    lower,
    mirrored,
    moved,
    negative,
    slope_at,
    upper,
    value,
)
from chipwise.turning.tool import LatheTool

HOLDER_ROUNDS = 40  # each raises the positions by less; most tools need one
HOLDER_MM = 0.2  # levels leave what is thinner than 0.05 mm, the holder stays farther away
SAME_MM = 1e-6  # a rise below this ends the rounds
SLOPE, SAME_X_MM = 1e-6, 1e-9  # rounding of slopes and of heights at joints


def disc(f: Graph, r: float) -> list[Piece]:
    """max over s of f(s) + sqrt(r^2 - (z - s)^2): f offset by r.  Ends of pieces are rounded where the graph is not
    concave.

    Above a piece's offset no disc about its ends is higher, and beyond it the disc about the nearer end is: so of each
    disc only the part between the offsets of its neighbours counts.
    """
    if r <= 0.0 or not f:
        return list(f)
    graphs: list[list[Piece]] = []
    offsets = [_offset(p, r) for p in f]
    for k, (p, offset) in enumerate(zip(f, offsets)):
        before, after = (f[k - 1] if k else None), (f[k + 1] if k + 1 < len(f) else None)
        if _needs_disc(before, p, r, at_start=True):
            _append(graphs, _half_circle(p.z0, value(p, p.z0), r, p.line), -math.inf, offset.z0 if offset else math.inf)
        if offset:
            _append(graphs, offset, -math.inf, math.inf)
        if _needs_disc(p, after, r, at_start=False):
            meets = after is not None and after.z0 == p.z1 and abs(value(after, p.z1) - value(p, p.z1)) <= SAME_X_MM
            joined = offsets[k + 1] if meets else None
            _append(
                graphs,
                _half_circle(p.z1, value(p, p.z1), r, p.line),
                offset.z1 if offset else -math.inf,
                joined.z0 if joined else math.inf,
            )
    return envelope(graphs)


def _append(graphs: list[list[Piece]], piece: Piece, z0: float, z1: float) -> None:
    """A piece, clipped to [z0, z1]: to the last graph if it is to the right of that, else as a new one."""
    if z0 > piece.z0 or z1 < piece.z1:
        piece = Piece(max(piece.z0, z0), min(piece.z1, z1), *piece[2:])
    if piece.z1 <= piece.z0:
        return
    if graphs and graphs[-1][-1].z1 <= piece.z0:
        graphs[-1].append(piece)
    else:
        graphs.append([piece])


def _vanishes(p: Piece, r: float) -> bool:
    return p.r > 0.0 and p.side < 0 and p.r <= r + 1e-9


def _needs_disc(left: Piece | None, right: Piece | None, r: float, at_start: bool) -> bool:
    """Whether the joint of two pieces is rounded by this end: not if the graph turns up there and both pieces have
    offsets."""
    if left is None or right is None or left.z1 != right.z0:
        return True
    z = right.z0
    a, b = value(left, z), value(right, z)
    if abs(a - b) > SAME_X_MM:
        return (b > a) if at_start else (a > b)
    if _vanishes(left, r) or _vanishes(right, r):
        return not at_start
    return not at_start and slope_at(right, z) - slope_at(left, z) < 1e-6


def _half_circle(z: float, x: float, r: float, line: int) -> Piece:
    return Piece(z - r, z + r, z, x, 0.0, r, 1, line)


def _offset(p: Piece, r: float) -> Piece | None:
    if p.r == 0.0:
        length = math.hypot(1.0, p.slope)
        dz, dx = -p.slope * r / length, r / length
        return Piece(p.z0 + dz, p.z1 + dz, p.zr + dz, p.xr + dx, *p[4:])
    radius = p.r + p.side * r
    if _vanishes(p, r):
        return None
    scale = radius / p.r
    return p._replace(z0=p.zr + (p.z0 - p.zr) * scale, z1=p.zr + (p.z1 - p.zr) * scale, r=radius)


def falling_left(f: Graph, slope: float, z_low: float) -> list[Piece]:
    """max over u >= 0 of f(z + u) - slope u, down to z_low: rays from f to the left, falling by `slope` mm per mm."""
    if math.isinf(slope) or not f:
        return list(f)
    ray, z = -math.inf, f[-1].z1  # ray: the largest of f(s) - slope s so far
    parts = []
    for p in reversed(f):
        if p.z1 < z and not math.isinf(ray):
            parts.append([Piece(p.z1, z, 0.0, ray, slope)])
        cuts = [p.z1, *[c for c in [tangent(p, slope)] if c is not None and p.z0 < c < p.z1], p.z0]
        for b, a in zip(cuts, cuts[1:]):
            ray = max(ray, value(p, b) - slope * b)
            if b > a:
                parts.append(upper([Piece(a, b, *p[2:])], [Piece(a, b, 0.0, ray, slope, line=p.line)]))
            ray = max(ray, value(p, a) - slope * a)
        z = p.z0
    if z > z_low:
        parts.append([Piece(z_low, z, 0.0, ray, slope)])
    return closed([p for part in reversed(parts) for p in part])


def tangent(p: Piece, slope: float) -> float | None:
    """z where an upper arc has this slope: there its distance above a ray is largest."""
    return p.zr - p.r * slope / math.hypot(1.0, slope) if p.r and p.side > 0 else None


def cone(f: Graph, left: float, right: float, domain: Interval) -> list[Piece]:
    """f with rays: falling by `left` mm per mm to its left, by `right` to its right, within domain (z0, z1)."""
    f = falling_left(f, left, domain[0])
    return mirrored(falling_left(mirrored(f), right, -domain[1]))


def window(f: Graph, u0: float, u1: float) -> list[Piece]:
    """max over u0 <= u <= u1 of f(z + u): at one end of the window, or at a local maximum within."""
    if u1 <= u0:
        return moved(f, -u0, 0.0)
    flats: list[list[Piece]] = []
    for z, x, line in _maxima(f):
        _append(flats, flat(z - u1, z - u0, x, line), -math.inf, math.inf)
    return envelope([moved(f, -u1, 0.0), moved(f, -u0, 0.0), envelope(flats)])


def _maxima(f: Graph) -> Iterator[tuple[float, float, int]]:
    """(z, x, line) of the local maxima of a graph, ends at gaps and tops of walls included; in doubt more than
    needed."""
    for k, p in enumerate(f):
        before, after = (f[k - 1] if k else None), (f[k + 1] if k + 1 < len(f) else None)
        first, last = value(p, p.z0), value(p, p.z1)
        if slope_at(p, p.z0) <= SLOPE and (
            before is None or before.z1 != p.z0 or value(before, p.z0) < first - SAME_X_MM
        ):
            yield p.z0, first, p.line
        if p.r and p.side > 0 and p.z0 < p.zr < p.z1:
            yield p.zr, p.xr + p.r, p.line
        if slope_at(p, p.z1) < -SLOPE:
            continue
        step = math.inf if after is None or after.z0 != p.z1 else last - value(after, p.z1)
        if step > SAME_X_MM or step >= -SAME_X_MM and after is not None and slope_at(after, p.z1) <= SLOPE:
            yield p.z1, last, p.line


def dilated(f: Graph, tool: LatheTool, more: float, domain: Interval) -> list[Piece]:
    """Positions at which the tool's insert, its nose larger by `more`, touches the region of f."""
    return list(_dilated(tuple(f), tool, more, domain))


@lru_cache(maxsize=32)
def _dilated(f: tuple[Piece, ...], tool: LatheTool, more: float, domain: Interval) -> tuple[Piece, ...]:
    # an edge that rises by `right` per mm to the right of the nose meets what is to the right: rays fall to the left
    edges = cone(f, tool.right, tool.left, domain)
    edges = window(edges, 0.0, tool.flat) if tool.flat > 0.0 else edges
    return tuple(clip(disc(edges, tool.nose + more), *domain))


def eroded(path: Graph, tool: LatheTool, domain: Interval) -> list[Piece]:
    """What a path of positions leaves standing: the lowest edge of the insert over all of the path; gaps: untouched."""
    f = cone(negative(path), tool.left, tool.right, domain)
    f = window(f, -tool.flat, 0.0) if tool.flat > 0.0 else f
    return clip(negative(disc(f, tool.nose)), *domain)


def after(stock: Graph, path: Graph, tool: LatheTool, domain: Interval) -> list[Piece]:
    """Stock after a path: where the path's gaps leave it, unchanged."""
    if not path or not stock:
        return list(stock)
    left = eroded(path, tool, domain)
    touched = lower(stock, left)
    gaps, z = [], domain[0]
    for p in left:
        if p.z0 > z:
            gaps.append((z, p.z0))
        z = max(z, p.z1)
    gaps.append((z, domain[1]))
    return envelope([touched, *[clip(stock, *gap) for gap in gaps]])


def holder_height(f: Graph, tool: LatheTool, aside: float = HOLDER_MM) -> list[Piece]:
    """Positions at which the holder touches the region of f, or comes nearer than `aside` mm beside it; a side of it
    that does not go beyond the nose has no such distance, for the nose is nearer."""
    left = tool.holder_left - aside * (-tool.holder_left > tool.nose)
    right = tool.holder_right + aside * (tool.holder_right > tool.flat + tool.nose)
    return moved(window(f, left + SAME_MM, right - SAME_MM), 0.0, -tool.holder_up) if f else []


def reachable(
    part: Graph, stock: Graph, tool: LatheTool, allowance: float, floor: float, domain: Interval
) -> list[Piece]:
    """Lowest positions: the insert stays clear of the part by the allowance, the holder of part and stock as they are
    now.

    floor    no position is lower, mm
    """
    insert = upper(dilated(part, tool, allowance, domain), [flat(*domain, floor)])
    return closed(upper(insert, clip(moved(holder_height(upper(part, stock), tool), 0.0, HOLDER_MM), *domain)))


def reachable_in_levels(
    part: Graph, stock: Graph, tool: LatheTool, allowance: float, floor: float, domain: Interval
) -> list[Piece] | None:
    """As reachable(), for roughing in levels: the holder stays clear of what the tool has left by then.  None if that
    does not come to an end.

    While level k is cut, the stock is below max(stock at the end, level k - 1) everywhere: levels are cut from the top,
    each over its whole length, and the erosion of max(reach, c) is below max(erosion of reach, c) because reach is made
    by the tool itself.  So the holder needs no more than to be above a depth of cut, and clear of the stock at the end,
    which depends on where the holder lets the tool go: the least fixed point.
    """
    contact = dilated(stock, tool, 0.0, domain)
    result = upper(dilated(part, tool, allowance, domain), [flat(*domain, floor)])
    result = upper(result, clip(holder_height(part, tool), *domain)) if part else result
    for _ in range(HOLDER_ROUNDS):
        left = stock
        for a, b, _, _ in above(contact, result):
            left = after(left, clip(result, a, b), tool, domain)
        grown = upper(result, clip(moved(holder_height(left, tool), 0.0, HOLDER_MM), *domain)) if left else result
        if not above(grown, result, SAME_MM):
            return closed(result)
        result = grown
    return None
