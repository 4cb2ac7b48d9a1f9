# SPDX-License-Identifier: GPL-2.0-or-later
"""What plain G-code of a lathe does to a bar: heights over a grid of Z, maximum filters, nothing of the product.

The program is read as text: T, G0 G1 G2 G3 G33 with X (radius), Z, I, K.  A tool is given by the numbers of its table
line and its holder.  Every position is judged: the insert (nose, both edges without end) and the holder's box against
the part, and on rapids against the stock; the holder against the stock on feeds, too.  Feeds take stock away.  Threads
(G33) are judged against a part of their own.
"""

import ctypes as C
import math
import re
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from support import ROOT

LIBRARY = ROOT / "build" / "tests" / "support" / "turning_oracle.so"
KINDS = ("gouge", "rapid", "holder")  # in the order of turning_oracle.c
CELL = 0.02
STEP = 0.05
CENTRE = {1: (1, -1), 2: (1, 1), 3: (-1, 1), 4: (-1, -1), 5: (0, -1), 6: (1, 0), 7: (0, 1), 8: (-1, 0), 9: (0, 0)}


@dataclass(frozen=True)
class Insert:
    """D, I, J, Q of the table, holder box and flat width (corner to corner); point angle of a drill; edge: mm, of the
    flanks of a threading insert, which has straight sides above them."""

    d: float
    i: float
    j: float
    q: int
    holder: tuple = (0.0, 0.0, 1e9)
    flat: float = 0.0
    point: float = 0.0
    relief: float = 0.0
    edge: float = math.inf

    @property
    def inside(self):
        return self.q in (3, 4, 8) or bool(self.point)

    def lower_edge(self, u):
        """Height of the insert's lower edge at u (array) from the nose's centre, in the frame of its side; inf beside
        it."""
        if self.point:
            return np.where(np.abs(u) < 1e-9, 0.0, np.inf)
        r = self.d / 2
        low, high = sorted((a % 360) if not self.inside else (-a % 360) for a in (self.i, self.j))
        t = np.full(len(u), np.inf)
        for corner in (0.0, self.flat):
            v = u - corner
            t = np.where(np.abs(v) < r - 1e-9, np.minimum(t, -np.sqrt(np.maximum(r * r - v * v, 0))), t)
        t = np.where((u >= 0) & (u <= self.flat), -r, t)
        for angle, v in ((low, u - self.flat), (180 - high, -u)):
            if angle < 90:
                a = math.radians(angle - self.relief)
                edge = -r * math.cos(a) + (v - r * math.sin(a)) * math.tan(a)
                t = np.where((v >= r * math.sin(a)) & (v <= self.edge * math.cos(a)), np.minimum(t, edge), t)
        return t


def heights(points, z):
    """Largest x of a chain at every z, walls included; -inf outside."""
    pz, px = (np.array(v) for v in zip(*points[::-1]))  # from the left, so that walls keep their order
    order = np.argsort(pz, kind="stable")
    found = np.interp(z, pz[order], px[order], left=-np.inf, right=-np.inf)
    for a, x in zip(pz, px):  # both ends of walls
        k = int(round((a - z[0]) / CELL))
        if 0 <= k < len(z) and abs(z[k] - a) < 1e-9:
            found[k] = max(found[k], x)
    return found


def moves(text, unit, home=None, angle=0.1):
    """Yield (tool, kind, [(z, x)] points with about STEP between) of a program.

    home: (z, x) mm where tools are changed, without it the moves to there are left out; angle: rad, most of an arc
    between points."""
    if home:
        text = text.replace("X#<change_x>", f"X{home[1] / unit}").replace("Z#<change_z>", f"Z{home[0] / unit}")
    tool, z, x = 0, None, None
    for line in text.splitlines():
        line = re.sub(r"\([^)]*\)", "", line)
        if line.startswith("T"):
            tool = int(re.match(r"T(\d+)", line).group(1))
        words = dict(re.findall(r"([GXZIK])(-?[\d.]+)", line)) if re.match(r"G(?:[0123]|33) ", line) else {}
        if not words or not ("X" in words or "Z" in words):
            continue
        z2, x2 = (float(words[k]) * unit if k in words else was for k, was in (("Z", z), ("X", x)))
        if z is not None and x is not None:
            if words["G"] in ("0", "1", "33"):
                n = max(int(math.hypot(z2 - z, x2 - x) / STEP), 1)
                points = [(z + (z2 - z) * k / n, x + (x2 - x) * k / n) for k in range(n + 1)]
            else:
                cz, cx = z + float(words["K"]) * unit, x + float(words["I"]) * unit
                a, b = math.atan2(x - cx, z - cz), math.atan2(x2 - cx, z2 - cz)
                if (z, x) == (z2, x2):
                    b = a
                r = math.hypot(x - cx, z - cz)
                assert abs(r - math.hypot(x2 - cx, z2 - cz)) < 2e-4, line
                turn = (b - a) % (2 * math.pi) if words["G"] == "3" else -((a - b) % (2 * math.pi))
                turn = turn or (2 * math.pi if words["G"] == "3" else -2 * math.pi)  # equal ends are a full circle
                n = max(int(abs(turn) * r / STEP), math.ceil(abs(turn) / angle), 1)
                points = [(cz + r * math.cos(a + turn * k / n), cx + r * math.sin(a + turn * k / n)) for k in range(n)]
                points.append(
                    (z2, x2)
                )  # an arc ends where its line says, whatever its printed centre is: at a wall 0.00001 mm are a column
            yield tool, {"0": "rapid", "33": "thread"}.get(words["G"], "feed"), points
        z, x = z2, x2


def judge(text, unit, case, tools, threaded=None):
    """{gouge, rapid, holder, air, feed} of a program: largest depths in mm (at most 0 is clean), feed lengths in mm.

    case: outside, bore, blank as in turning_random.Case; tools: {number: Insert}; threaded: (outside, bore) of the part
    with its threads cut down to their roots, which is what the passes of a thread must not touch."""
    low, high = case.blank[1] - 60.0, case.blank[2] + 70.0
    z = low + CELL * np.arange(int((high - low) / CELL) + 1)
    end, bar = case.outside[-1][0], bar_of(case, z)
    if threaded:
        roots = {
            False: heights(threaded[0], z),
            True: heights([(a, -b) for a, b in threaded[1]], z) if threaded[1] else None,
        }
        roots[False][z < end - 1e-9] = bar[False][0][z < end - 1e-9]
    found = {"gouge": -np.inf, "rapid": -np.inf, "holder": -np.inf, "feed": 0.0, "air": 0.0, "where": {}}
    for number, kind, points in moves(text, unit):
        side = tools[number].inside
        if kind == "thread":
            for k in range(len(points)):
                _judge_position(
                    found,
                    roots[side],
                    bar[side][1],
                    z,
                    tools[number],
                    kind,
                    _centre(tools[number], points[k]),
                    slice(0, len(z)),
                    True,
                    (*np.round(points[k], 4), kind),
                    0.0,
                )
            continue
        _follow(found, bar[side], z, tools[number], kind, points)
        bar[False][1][bar[False][1] <= 0.0] = -np.inf  # cut to the axis and beyond
        bar[True][1][
            bar[False][1] <= np.maximum(-bar[True][1], 1e-6)
        ] = -np.inf  # faced down to the hole: nothing is left inside
    return found, bar, z


def bar_of(case, z):
    """{inside: [heights of the part and its barriers, heights of the stock]} at z, before the first cut; those inside
    are negative."""
    end = case.outside[-1][0]
    outside = heights(case.outside, z)
    stock = np.where((z >= case.blank[1]) & (z <= case.blank[2]), case.blank[0], -np.inf)
    outside[z < end - 1e-9] = stock[z < end - 1e-9]
    if case.barrier:
        radius, right = case.barrier
        outside[z <= right] = np.maximum(outside[z <= right], radius)
    if case.tailstock:
        radius, left, right = case.tailstock
        outside[(z >= left) & (z <= right)] = np.maximum(outside[(z >= left) & (z <= right)], radius)
    return {
        False: [outside, stock],
        True: [
            heights([(a, -b) for a, b in case.bore], z) if case.bore else np.full(len(z), -np.inf),
            np.where(np.isfinite(stock), 0.0, -np.inf),
        ],
    }


def _note(found, name, depth, where):
    if depth > found[name]:
        found[name] = depth
        found["where"][name] = where


def _follow(found, sides, z, tool, kind, points):
    """One move: judge every position, take stock away (turning_oracle.c)."""
    centres = np.array([_centre(tool, point) for point in points])
    got = _Found((C.c_double * 3)(*(found[name] for name in KINDS)), (C.c_int * 3)(-1, -1, -1), 0)
    part, stock = sides
    _library().follow(
        C.byref(got),
        part.ctypes,
        stock.ctypes,
        z.ctypes,
        len(z),
        C.c_double(CELL),
        C.byref(_tool_of(tool)),
        centres.ctypes,
        len(points),
        kind == "rapid",
    )
    for name, depth, k in zip(KINDS, got.depth, got.at):
        if k >= 0:
            _note(found, name, depth, (round(points[k][0], 4), round(points[k][1], 4), kind))
    if kind == "feed":
        step = math.dist(points[0], points[1])
        found["feed"] += step * len(points)
        found["air"] += step * (len(points) - got.cutting)


def follow_slowly(found, sides, z, tool, kind, points):
    """_follow() without the library; tests/turning/test_turning_random.py compares the two."""
    part, stock = sides
    r = 0.0 if tool.point else tool.d / 2
    step = math.dist(points[0], points[1])
    for k, (pz, px) in enumerate(points):
        cz, cx = _centre(tool, (pz, px))
        whole = k % 8 == 0 or k == len(points) - 1 or bool(tool.point)  # far from the nose the edges are straight
        first, last = (
            (0, len(z)) if whole else (int((v - z[0]) / CELL) + 1 for v in (cz - r - 0.3, cz + tool.flat + r + 1.0))
        )
        _judge_position(
            found,
            part,
            stock,
            z,
            tool,
            kind,
            (cz, cx),
            slice(first, last),
            whole,
            (round(pz, 4), round(px, 4), kind),
            step,
        )


class _Tool(C.Structure):
    """struct tool of turning_oracle.c."""

    _fields_ = [
        ("radius", C.c_double),
        ("flat", C.c_double),
        ("begin", C.c_double * 2),
        ("end", C.c_double * 2),
        ("foot", C.c_double * 2),
        ("rise", C.c_double * 2),
        ("holder", C.c_double * 3),
        ("point", C.c_double),
        ("drill_radius", C.c_double),
    ]


class _Found(C.Structure):
    """struct found of turning_oracle.c."""

    _fields_ = [("depth", C.c_double * 3), ("at", C.c_int * 3), ("cutting", C.c_int)]


@lru_cache(maxsize=1)
def _library():
    return C.CDLL(str(LIBRARY))


@lru_cache(maxsize=64)
def _tool_of(tool):
    """_Tool of an Insert."""
    point = math.tan(math.radians(tool.point) / 2) if tool.point else 0.0
    r = 0.0 if tool.point else tool.d / 2
    low, high = sorted((a % 360) if not tool.inside else (-a % 360) for a in (tool.i, tool.j))
    begin, end, foot, rise = ([0.0, 0.0] for _ in range(4))
    for k, angle in enumerate((low, 180 - high)):
        a = math.radians(angle - tool.relief)
        begin[k], end[k], foot[k], rise[k] = (
            (r * math.sin(a), tool.edge * math.cos(a), -r * math.cos(a), math.tan(a))
            if angle < 90
            else (1.0, 0.0, 0.0, 0.0)
        )
    two = C.c_double * 2
    return _Tool(
        r, tool.flat, two(*begin), two(*end), two(*foot), two(*rise), (C.c_double * 3)(*tool.holder), point, tool.d / 2
    )


def _centre(tool, point):
    """Centre of the nose (z, x) in the frame of its side, of a controlled point."""
    dx, dz = CENTRE[tool.q]
    r = 0.0 if tool.point else tool.d / 2
    return point[0] + dz * r, (point[1] + dx * r) * (-1 if tool.inside else 1)


def _judge_position(found, part, stock, z, tool, kind, centre, near, whole, where, step):
    """One position: cells `near` for the insert, all of the holder's if `whole`."""
    cz, cx = centre
    u = z[near] - cz
    if tool.point:
        edge = np.where(u >= 0, np.maximum(-u * math.tan(math.radians(tool.point) / 2), -tool.d / 2), np.inf)
    else:
        edge = tool.lower_edge(u)
    _note(found, "gouge", float(np.max(part[near] - (cx + edge))), where)
    if whole:
        box = slice(*np.searchsorted(z, (cz + tool.holder[0], cz + tool.holder[1] + 1e-9)))
        if box.stop > box.start:
            _note(found, "gouge", float(np.max(part[box])) - cx - tool.holder[2], where)
            _note(found, "holder", float(np.max(stock[box])) - cx - tool.holder[2], where)
    if kind == "thread":
        return
    if kind == "rapid":
        _note(found, "rapid", float(np.max(stock[near] - (cx + edge))), where)
        return
    cut = stock[near] > cx + edge + 1e-4
    found["feed"] += step
    found["air"] += 0.0 if cut.any() else step
    stock[near] = np.minimum(stock[near], cx + edge)


def inaccessible_area(case, tools, cell=0.005):
    """Area (mm2) between the outside of a part and the lowest that all the outside tools leave together, by filters on
    a grid.

    Walls are on the grid (random_case(snap=cell)): positions are sampled there, areas between.  Then the grid errs by
    cell^2 / (8 nose) in height, 0.0001 mm2 on these parts, and not by half a cell at each wall."""
    end, face, radius = case.outside[-1][0], case.outside[0][0], case.blank[0]
    first = round((end - 1.0) / cell)
    z = cell * np.arange(first, first + int((face - end + 60.0) / cell))
    between = z[:-1] + 0.5 * cell
    points = case.outside[::-1]
    right = {
        round(a / cell): max(b for c, b in points if abs(c - a) < 1e-7)
        for a, b in points
        if abs(a / cell - round(a / cell)) < 1e-6
    }
    pz, px = (np.array(v) for v in zip(*points))
    part, low = (np.interp(at, pz, px, right=-np.inf) for at in (z, between))
    for index, high in right.items():  # the higher side of walls, rounding of ends
        part[index - first] = max(part[index - first], high) if np.isfinite(part[index - first]) else high
    part[z < end + 1e-9] = max(radius, part.max()) + 5.0
    if case.barrier:
        part[z <= case.barrier[1] + 1e-9] = np.maximum(part[z <= case.barrier[1] + 1e-9], case.barrier[0])
    left = np.full(len(between), radius)
    for tool in tools:
        _lower(left, _contact(part, tool, cell), tool, cell)
    inside = (between > end) & (between < face)
    return float(np.sum(np.maximum(left - low, 0.0)[inside]) * cell)


def _contact(part, tool, cell):
    """Positions at which the insert or the holder touches the part, at every grid point."""
    n = int((tool.d / 2 + 0.01) / cell)
    contact = np.full(len(part), -np.inf)
    for k, t in zip(
        range(-n, len(part)), tool.lower_edge(cell * np.arange(-n, len(part)))
    ):  # position i touches part[i + k] at height part - t
        if np.isfinite(t) and t < 40.0:
            a, b = max(0, -k), min(len(part), len(part) - k)
            contact[a:b] = np.maximum(contact[a:b], part[a + k : b + k] - t)
    box = slice(
        int(round(tool.holder[0] / cell)) + 1, int(round(tool.holder[1] / cell))
    )  # the open box: its sides may be beside a wall
    ahead = max(-box.start, 0)  # a box that begins to the left of the nose's centre
    padded = np.pad(part, (ahead, box.stop), constant_values=-np.inf)[box.start + ahead :]
    windows = np.lib.stride_tricks.sliding_window_view(padded, box.stop - box.start)
    return np.maximum(np.maximum(contact, windows[: len(part)].max(axis=1) - tool.holder[2]), 0.0)


def _lower(left, contact, tool, cell):
    """Take from `left` (heights between grid points) what the tool takes at all positions of `contact`."""
    n = int((tool.d / 2 + 0.01) / cell)
    for k, t in zip(range(-n, len(left)), tool.lower_edge(cell * (np.arange(-n, len(left)) + 0.5))):
        if np.isfinite(t) and t < 40.0:
            a, b = max(0, -k), min(len(left), len(left) - k)
            left[a + k : b + k] = np.minimum(left[a + k : b + k], contact[a:b] + t)
