# SPDX-License-Identifier: GPL-2.0-or-later
"""A judge of turned parts: r(z) of part, stock and barriers, a written program read as text.  Nothing of the product,
nor of turning_oracle.py.

Called by tests/turning/test_turning_rz.py.

    part, barriers   largest radius at samples of z: every CELL, and SIDE beside every corner, so that a wall may be
                     missed by SIDE
    insert           its lower edge as a function of the distance from the centre of the nose, edges without an end; a
                     drill from its tip
    bore             radii with the sign turned, as if it were turned from outside

A gouge is part above the insert or its holder, a contact stock above them on a rapid (above the holder on every move),
barrier the same with boxes that are larger by the clearance.  near: by how much a rapid of an insert is closer to stock
than `beside`; rapids after a feed may begin in contact, and have to go away from all stock by LEAVES mm per mm.  mm; at
most 0 is clean, but for what moves are sampled with."""

import math
import re

import numpy as np

CELL, SIDE, STEP, LATHE_FAR = 0.05, 0.001, 0.05, 80.0
BESIDE, LEAVES = 0.2, 0.3
CENTRES = {
    1: (-1, 1),
    2: (1, 1),
    3: (1, -1),
    6: (0, 1),
}  # Q: (z, x) signs from the controlled point to the centre of the nose, x away from the axis


class Judge:
    """part: turning_hands.Part; clearance: mm from barriers; beside: mm of rapids from stock.  judge(text, mm of a
    unit) -> {gouge, contact, holder, barrier, near}, mm."""

    def __init__(self, part, clearance, beside=BESIDE):
        self.beside, self.part, self.tools = beside, part, {t.number: t for t in part.tools}
        corners = sorted(
            {z for z, _ in [*part.outer, *part.bore]}
            if len(part.outer) + len(part.bore) < 60
            else _sharp(part.outer) | _sharp(part.bore)
        )
        corners += [
            z for z0, z1, _, _ in part.barriers for z in (z0 - clearance, z1 + clearance) if z > part.blank[1] - 40.0
        ]
        grid = np.arange(part.blank[1] - 40.0, part.blank[2] + LATHE_FAR, CELL)
        beside = np.array([z + s for z in corners for s in (-SIDE, SIDE)])
        grid = grid[np.min(np.abs(grid[:, None] - np.array(corners)), axis=1) > SIDE]
        self.z = np.sort(np.concatenate((grid, beside)))
        end = part.outer[-1][0]
        solid = (self.z >= part.blank[1]) & (self.z <= part.blank[2])
        outer = np.where(self.z < end, np.where(solid, part.blank[0], -np.inf), _radius(part.outer, self.z))
        self.want = {
            False: outer,
            True: -_radius(part.bore, self.z, np.inf) if part.bore else np.full(len(self.z), -np.inf),
        }
        if part.bore:
            self.want[True][self.z < part.bore[-1][0]] = 0.0
            if abs(part.bore[-1][0] - end) < 1e-9:  # through: what is behind the part is not of it
                self.want[True][self.z < end] = -np.inf
        self.box = {False: np.full(len(self.z), -np.inf), True: np.full(len(self.z), -np.inf)}
        for z0, z1, x0, x1 in part.barriers:
            near = (self.z > z0 - clearance) & (self.z < z1 + clearance)
            self.box[False][near] = np.maximum(self.box[False][near], x1 + clearance)
            self.box[True][near] = np.maximum(self.box[True][near], clearance - x0)
        self.stock = {False: np.where(solid, part.blank[0], -np.inf), True: np.where(solid, 0.0, -np.inf)}
        self.worst = {"gouge": -np.inf, "contact": -np.inf, "holder": -np.inf, "barrier": -np.inf, "near": -np.inf}
        self.where = {}
        self.gone, self.discs = (
            beside / LEAVES,
            {},
        )  # mm of rapids since the last feed; stock of a side with discs of a radius about it

    def judge(self, text, unit):
        tool, at = None, [None, None]
        for number, line in enumerate(text.splitlines(), 1):
            line = re.sub(r"\(.*?\)", "", line)
            if re.match(r"T\d+ M6", line):
                tool, at = self.tools[int(line[1:].split()[0])], [None, None]
                self.gone = self.beside / LEAVES
            words = dict(re.findall(r"([GXZIK])(-?\d+\.?\d*)", line))
            if "#" in line or words.get("G") not in ("0", "1", "2", "3") or not {"X", "Z"} & set(words):
                continue
            to = [float(words[letter]) * unit if letter in words else was for letter, was in zip("ZX", at)]
            if None not in at:
                centre = (float(words["K"]) * unit, float(words["I"]) * unit) if "K" in words else None
                self._move(tool, _points(at, to, centre, words["G"] == "3"), words["G"] == "0", number)
            at = to
        return self.worst

    def _move(self, tool, points, rapid, line):
        inside = tool.kind in ("bore", "drill")
        sign = -1.0 if inside else 1.0
        dz, dx = CENTRES.get(tool.q, (0, 0)) if tool.kind != "drill" else (0, 0)
        r = 0.0 if tool.kind == "drill" else tool.d / 2
        want, stock, box = self.want[inside], self.stock[inside], self.box[inside]
        last = points[0]
        for z, x in points:
            self.gone, last = self.gone + math.dist(last, (z, x)) if rapid else 0.0, (z, x)
            z, x = z + dz * r, sign * (x + dx * r)
            u = self.z - z
            edge = x + _edge(tool, u)
            self._note("gouge", np.max(want - edge), line)
            self._note("barrier", np.max(box - edge), line)
            if tool.holder:
                held = (u > tool.holder[0]) & (u < tool.holder[1])
                for name, graph in (("gouge", want), ("barrier", box), ("holder", stock)):
                    self._note(name, np.max(graph[held], initial=-np.inf) - x - tool.holder[2], line)
            if rapid:
                self._note("contact", np.max(stock - edge), line)
                if tool.kind != "drill":  # it slides in its own hole
                    self._note("near", np.max(self._beside(inside, min(self.beside, LEAVES * self.gone)) - edge), line)
            else:
                np.minimum(stock, edge, out=stock)
                self.discs = {}
        gone = np.flatnonzero(
            (self.stock[False] <= np.maximum(-self.stock[True], 1e-6)) & (self.z > self.part.blank[1])
        )
        if len(gone):  # nothing is left of the ring there: what is to the right of it has fallen off
            self.stock[True][gone[0] :] = self.stock[False][gone[0] :] = -np.inf

    def _beside(self, inside, r):
        """The stock with discs about it: what a point has to be above to be farther than r from it."""
        r = max(round(r, 2) - 0.01, 0.0)  # the samples are not exactly where the stock's corners are
        if (inside, r) not in self.discs:
            z, f = self.z, self.stock[inside]
            found, k = f.copy(), 1
            while r > 0.0 and np.min(z[k:] - z[:-k]) < r:
                rise = np.sqrt(np.maximum(r * r - (z[k:] - z[:-k]) ** 2, 0.0))
                rise[z[k:] - z[:-k] > r] = -np.inf
                np.maximum(found[:-k], f[k:] + rise, out=found[:-k])
                np.maximum(found[k:], f[:-k] + rise, out=found[k:])
                k += 1
            self.discs[inside, r] = np.maximum(found, f + r)
        return self.discs[inside, r]

    def _note(self, name, depth, line):
        if depth > self.worst[name]:
            self.worst[name], self.where[name] = float(depth), line

    def left(self):
        """Largest thickness of stock outside between face and end, mm."""
        within = (self.z > self.part.outer[-1][0] + SIDE) & (self.z < -SIDE)
        return float(np.max(self.stock[False][within] - self.want[False][within], initial=0.0))


def _sharp(points):
    """z of the corners of a chain that turn by more than 3 degrees."""
    found = {points[0][0], points[-1][0]} if points else set()
    for (a, b), (c, d), (e, f) in zip(points, points[1:], points[2:]):
        turn = math.atan2(f - d, e - c) - math.atan2(d - b, c - a)
        if abs(math.remainder(turn, 2 * math.pi)) > 0.05:
            found.add(c)
    return found


def _radius(points, z, least=-np.inf):
    """Radius of a chain from right to left at z, `least` where it is not; samples are never on a wall."""
    pz, px = np.array(points[::-1]).T
    after = np.clip(np.searchsorted(pz, z, side="right"), 1, len(pz) - 1)
    a, b = after - 1, after
    width = np.maximum(pz[b] - pz[a], 1e-300)
    return np.where((z < pz[0]) | (z > pz[-1]), least, px[a] + (px[b] - px[a]) * np.clip((z - pz[a]) / width, 0.0, 1.0))


def _edge(tool, u):
    """Height of the lower edge above the centre of the nose (of a drill above its tip), at distances u; inf where
    there is none."""
    if tool.kind == "drill":
        return np.where(u >= 0.0, np.maximum(-u * math.tan(math.radians(59.0)), -tool.d / 2), np.inf)
    r, low, high = tool.d / 2, *sorted((-a if tool.kind == "bore" else a) % 360.0 for a in (tool.i, tool.j))
    flat = max(tool.width - 2 * r, 0.0)
    v = np.where(u < 0.0, u, np.maximum(u - flat, 0.0))
    height = np.where(np.abs(v) < r, -np.sqrt(np.maximum(r * r - v * v, 0.0)), np.inf)
    for angle, side in ((low, v), (180.0 - high, -v)):
        if angle < 90.0:
            a = math.radians(angle)
            line = -r * math.cos(a) + (side - r * math.sin(a)) * math.tan(a)
            height = np.where(side >= r * math.sin(a), np.minimum(line, height), height)
    return height


def _points(a, b, centre, ccw):
    """Points of a move about STEP apart, its end included."""
    if centre is None:
        n = max(int(math.dist(a, b) / STEP), 1)
        return [(a[0] + (b[0] - a[0]) * k / n, a[1] + (b[1] - a[1]) * k / n) for k in range(n + 1)]
    cz, cx = a[0] + centre[0], a[1] + centre[1]
    first, last = math.atan2(a[1] - cx, a[0] - cz), math.atan2(b[1] - cx, b[0] - cz)
    turn = (last - first) % (2 * math.pi) if ccw else -((first - last) % (2 * math.pi))
    r = math.dist(a, (cz, cx))
    n = max(int(abs(turn) * r / STEP), math.ceil(abs(turn) / 0.05), 1)
    return [(cz + r * math.cos(first + turn * k / n), cx + r * math.sin(first + turn * k / n)) for k in range(n)] + [
        tuple(b)
    ]
