# SPDX-License-Identifier: GPL-2.0-or-later
"""Random drawings in the manner of five CAD programs, with the area to be cut by closed forms.  Called by
import_table.py.

drawing(seed, path) writes a DXF and returns (manner, mm2 of the pockets, largest first).  The manners are those of
  files seen:
  blocks     closed polylines with bulges, some in blocks that are rotated, mirrored and scaled; dimensions, hidden
             layers
  entities   single lines and arcs in any order and direction, no unit in the header
  curves     old polylines, and every arc a spline, as programs for illustration export
  sketch     lines, arcs and ellipses in inch with gaps of the sixth to third decimal, at a height, arcs seen from below
  doubled    entities that are there twice, lines cut into overlapping parts, whole outlines drawn again
"""

import math

import ezdxf
import numpy as np

MANNERS = ("blocks", "entities", "curves", "sketch", "doubled")
INCH = 25.4


def drawing(seed, path):
    """-> (manner, [mm2, ..])"""
    rng = np.random.default_rng([seed, 46])
    manner = MANNERS[seed % len(MANNERS)]
    document = ezdxf.new("R12" if manner == "curves" and seed % 2 else "R2010")
    document.header["$INSUNITS"] = {"sketch": 1, "entities": 0}.get(manner, 4)
    areas, loops = [], []
    for k in range(int(rng.integers(1, 7))):
        found, area = _part(rng, 60.0 * (k % 3), 60.0 * (k // 3))
        loops += found
        areas += area
    rng.shuffle(loops)
    _WRITERS[manner](document, document.modelspace(), loops, rng)
    document.saveas(path)
    return manner, sorted(areas, reverse=True)


def _part(rng, x, y):
    """(loops, areas of the pockets) about a place: a boundary, perhaps an island in it, perhaps a pocket in that."""
    sizes = (24.0, 12.0, 5.0)[: int(rng.integers(1, 4))]
    made = [_outline(rng, x, y, size) for size in sizes]
    area = [a for _, a in made]
    pockets = [area[0] - (area[1] if len(area) > 1 else 0.0), *area[2:]]
    return [loop for loop, _ in made], pockets


def _outline(rng, x, y, s):
    """(list of ("L", p, q), ("A", centre, radius, from, to), ("E", centre, a, b); area mm2) that holds the circle of
    0.7 s and lies in that of s."""
    kind = int(rng.integers(0, 5))
    if kind == 0:
        return [("A", (x, y), 0.9 * s, 0.0, 2 * math.pi)], math.pi * (0.9 * s) ** 2
    if kind == 1:
        a, b = 0.95 * s, s * rng.uniform(0.75, 0.9)
        return [("E", (x, y), a, b)], math.pi * a * b
    if kind == 2:
        n, turn = int(rng.integers(5, 9)), rng.random() * 2 * math.pi
        r = 0.97 * s
        p = [
            (x + r * math.cos(turn + 2 * math.pi * k / n), y + r * math.sin(turn + 2 * math.pi * k / n))
            for k in range(n)
        ]
        return [("L", p[k], p[(k + 1) % n]) for k in range(n)], n / 2 * r * r * math.sin(2 * math.pi / n)
    w = h = 0.75 * s
    r = w * rng.uniform(0.1, 0.9 if kind == 3 else 0.3)
    parts = []
    for cx, cy, a in (
        (x + w - r, y - h + r, -90),
        (x + w - r, y + h - r, 0),
        (x - w + r, y + h - r, 90),
        (x - w + r, y - h + r, 180),
    ):
        parts.append(("A", (cx, cy), r, math.radians(a), math.radians(a + 90)))
    return _with_lines(parts), 4 * w * h - (4 - math.pi) * r * r


def _with_lines(arcs):
    """Arcs and the lines between them."""
    found = []
    for k, part in enumerate(arcs):
        found += [part, ("L", _tip(part, 4), _tip(arcs[(k + 1) % len(arcs)], 3))]
    return found


def _tip(part, which):
    _, (x, y), r = part[:3]
    return x + r * math.cos(part[which]), y + r * math.sin(part[which])


def _is_circle(part):
    return part[0] == "A" and part[4] - part[3] > 6.28


def _add(space, part, scale=1.0, move=(0.0, 0.0), **attributes):
    """One entity; move: of the second end or the end angle's point, drawing units."""

    def at(p):
        return p[0] * scale, p[1] * scale

    if part[0] == "L":
        a, b = at(part[1]), at(part[2])
        space.add_line(a, (b[0] + move[0], b[1] + move[1]), dxfattribs=attributes)
    elif part[0] == "E":
        space.add_ellipse(at(part[1]), (part[2] * scale, 0), part[3] / part[2], dxfattribs=attributes)
    elif _is_circle(part):
        space.add_circle(at(part[1]), part[2] * scale, dxfattribs=attributes)
    else:
        space.add_arc(at(part[1]), part[2] * scale, math.degrees(part[3]), math.degrees(part[4]), dxfattribs=attributes)


def _polyline(space, loop, **attributes):
    """A closed polyline with bulges of a loop of lines and arcs."""
    points = []
    for part in loop:
        if part[0] == "L":
            points.append((*part[1], 0.0))
        else:
            points.append((*_tip(part, 3), math.tan((part[4] - part[3]) / 4)))
    space.add_lwpolyline(points, format="xyb", close=True, dxfattribs=attributes)


def _blocks(document, space, loops, rng):
    document.layers.new("HIDDEN").off()
    space.add_circle((0, 0), 500, dxfattribs={"layer": "HIDDEN"})
    space.add_linear_dim(base=(0, -60), p1=(0, 0), p2=(40, 0)).render()
    for k, loop in enumerate(loops):
        if len(loop) == 1:
            _add(space, loop[0])
        elif rng.random() < 0.5:
            _polyline(space, loop)
        else:
            turn, scale, mirror = rng.integers(0, 360), rng.uniform(0.5, 2.0), rng.random() < 0.5
            block = document.blocks.new(f"B{k}")
            placed = (
                _mirrored(loop, turn, scale)
                if mirror
                else [_unplaced(part, math.radians(turn), scale) for part in loop]
            )
            _polyline(block, placed)
            space.add_blockref(
                f"B{k}",
                (0, 0),
                dxfattribs={"xscale": -scale if mirror else scale, "yscale": scale, "rotation": float(turn)},
            )


def _unplaced(part, turn, scale):
    """A part as it is in a block that is turned and scaled."""
    c, s = math.cos(-turn), math.sin(-turn)

    def at(p):
        return (c * p[0] - s * p[1]) / scale, (s * p[0] + c * p[1]) / scale

    if part[0] == "L":
        return "L", at(part[1]), at(part[2])
    return "A", at(part[1]), part[2] / scale, part[3] - turn, part[4] - turn


def _mirrored(loop, turn, scale):
    """A loop as it is in a block that is mirrored in x, then turned: run the other way."""
    found = []
    for part in reversed([_unplaced(part, math.radians(turn), scale) for part in loop]):
        if part[0] == "L":
            found.append(("L", (-part[2][0], part[2][1]), (-part[1][0], part[1][1])))
        else:
            found.append(("A", (-part[1][0], part[1][1]), part[2], math.pi - part[4], math.pi - part[3]))
    return found


def _entities(document, space, loops, rng):
    parts = [part for loop in loops for part in loop]
    for k in rng.permutation(len(parts)):
        part = parts[k]
        _add(space, ("L", part[2], part[1]) if part[0] == "L" and rng.random() < 0.5 else part)


def _curves(document, space, loops, rng):
    for loop in loops:
        if all(part[0] == "L" for part in loop):
            space.add_polyline2d([part[1] for part in loop], close=True)
            continue
        if document.dxfversion == "AC1009" and loop[0][0] == "E":  # R12 has no ellipses
            (x, y), a, b = loop[0][1:]
            space.add_polyline2d(
                [(x + a * math.cos(math.pi * k / 360), y + b * math.sin(math.pi * k / 360)) for k in range(720)],
                close=True,
            )
            continue
        for part in loop:
            if part[0] == "L" or document.dxfversion == "AC1009":
                _add(space, part)
            elif part[0] == "E":
                _add(space, part)
            else:
                _spline(space, part)


def _spline(space, part):
    """An arc as cubic splines of a quarter turn at most."""
    (x, y), r, first, last = part[1:]
    count = max(1, math.ceil((last - first) / (math.pi / 4) - 1e-9))
    for k in range(count):
        a, b = first + (last - first) * k / count, first + (last - first) * (k + 1) / count
        out = 4 / 3 * math.tan((b - a) / 4) * r
        p, q = (x + r * math.cos(a), y + r * math.sin(a)), (x + r * math.cos(b), y + r * math.sin(b))
        space.add_open_spline(
            [
                p,
                (p[0] - out * math.sin(a), p[1] + out * math.cos(a)),
                (q[0] + out * math.sin(b), q[1] - out * math.cos(b)),
                q,
            ]
        )


def _sketch(document, space, loops, rng):
    for loop in loops:
        for part in loop:
            gap = 10 ** rng.uniform(-6, math.log10(4e-3)) / INCH
            turn = rng.random() * 2 * math.pi
            if part[0] == "A" and not _is_circle(part) and rng.random() < 0.5:  # seen from below: x is mirrored
                (x, y), r, a, b = part[1:]
                space.add_arc(
                    (-x / INCH, y / INCH, -2.0),
                    r / INCH,
                    math.degrees(math.pi - b),
                    math.degrees(math.pi - a),
                    dxfattribs={"extrusion": (0, 0, -1)},
                )
            else:
                _add(space, part, 1 / INCH, (gap * math.cos(turn), gap * math.sin(turn)))


def _doubled(document, space, loops, rng):
    for loop in loops:
        for part in loop:
            _add(space, part)
            if rng.random() < 0.5:
                _add(space, part)
            if part[0] == "L" and rng.random() < 0.5:
                t = sorted(rng.random(2))
                p, q = np.array(part[1]), np.array(part[2])
                space.add_line(tuple(p + t[0] * (q - p)), tuple(p + t[1] * (q - p)))
        if len(loop) > 1 and rng.random() < 0.3 and all(part[0] != "E" for part in loop):
            _polyline(space, loop)


_WRITERS = {"blocks": _blocks, "entities": _entities, "curves": _curves, "sketch": _sketch, "doubled": _doubled}
