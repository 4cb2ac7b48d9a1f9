# SPDX-License-Identifier: GPL-2.0-or-later
"""Random turned parts with one to six tools of both hands, as programs, tool tables and geometry files.

Called by tests/turning/test_turning_rz.py.  Written apart from turning_random.py: shafts of features (shoulders with
fillets or chamfers, grooves as wide as the insert, hollows, cones), stepped bores, chucks and tailstocks."""

import math
from dataclasses import dataclass, field

HOLDERS = {"right": (0, 25, 8), "left": (-25, 0, 8), "neutral": (-3, 25, 10)}
INSERTS = {
    "right": ((85, 5), (87, 32), (87, 52), (90, 40)),
    "left": ((95, 175), (93, 148), (93, 128)),
    "neutral": ((107.5, 72.5), (120, 60)),
}
ORIENTATION = {"right": 2, "left": 1, "neutral": 6}


@dataclass(frozen=True)
class Tool:
    """D, I, J, Q of the table; kind "turn", "bore", "groove", "drill"; holder (left, right, up); width; bar; roles for
    the LATHE comment."""

    number: int
    kind: str
    d: float
    i: float
    j: float
    q: int
    holder: tuple
    roles: tuple
    width: float = 0.0
    bar: float = 0.0
    depth: float = 2.0

    def line(self):
        return f"T{self.number} P{self.number} D{self.d:g} I{self.i:g} J{self.j:g} Q{self.q}\n"

    def table(self):
        more = {
            "groove": f"width = {self.width}\nrelief = 0\n",
            "bore": f"bar = {self.bar}\n",
            "drill": "point_angle = 118\n",
        }.get(self.kind, "")
        holder = "" if self.kind == "drill" else f"holder = {list(self.holder)}\n"
        return (
            f"[lathe.{self.number}]\nedge_length = {90 if self.kind == 'drill' else 12}\ndepth = {self.depth}\n"
            f"{holder}{more}"
        )


@dataclass
class Part:
    """text of the program; tools; outer, bore: [(z, x)] mm from the right, arcs as chords; blank (radius, z0, z1);
    barriers (z0, z1, x0, x1) mm."""

    text: str
    tools: list
    outer: list
    bore: list
    blank: tuple
    barriers: list = field(default_factory=list)


class Pen:
    """Draws a chain to the left: moves as (code, z, x, i, k) in mm and radii, points with arcs as chords."""

    def __init__(self, z, x):
        self.z, self.x, self.moves, self.points = z, x, [(0, z, x, 0.0, 0.0)], [(z, x)]

    def line(self, z, x):
        if abs(z - self.z) > 1e-9 or abs(x - self.x) > 1e-9:
            self.moves.append((1, z, x, 0.0, 0.0))
            self.points.append((z, x))
            self.z, self.x = z, x

    def arc(self, z, x, cz, cx, ccw):
        a, b = math.atan2(self.x - cx, self.z - cz), math.atan2(x - cx, z - cz)
        turn = (b - a) % (2 * math.pi) if ccw else -((a - b) % (2 * math.pi))
        r, n = (
            math.hypot(self.z - cz, self.x - cx),
            max(int(abs(turn) * math.hypot(self.z - cz, self.x - cx) / 0.01), 4),
        )
        self.points += [
            (cz + r * math.cos(a + turn * k / n), cx + r * math.sin(a + turn * k / n)) for k in range(1, n)
        ] + [(z, x)]
        self.moves.append((3 if ccw else 2, z, x, cx - self.x, cz - self.z))
        self.z, self.x = z, x


def random_tools(rng, bored):
    """One to six tools; the first roughs outside."""
    count, tools = rng.randint(1, 6), []
    for k in range(count):
        kind = (
            "turn"
            if k == 0 or (not bored and rng.random() < 0.75) or rng.random() < 0.45
            else rng.choice(("groove", "bore", "drill") if bored else ("groove",))
        )
        if kind == "turn":
            hand = "right" if k == 0 and rng.random() < 0.85 else rng.choice(("right", "left", "left", "neutral"))
            i, j = rng.choice(INSERTS[hand])
            roles = ("ROUGH",) if k == 0 else rng.choice((("ROUGH",), ("FINISH",), ("ROUGH", "FINISH"), ("FINISH",)))
            tools.append(Tool(k + 1, kind, rng.choice((0.4, 0.8, 1.6)), i, j, ORIENTATION[hand], HOLDERS[hand], roles))
        elif kind == "groove":
            tools.append(
                Tool(
                    k + 1,
                    kind,
                    rng.choice((0.2, 0.4)),
                    90,
                    90,
                    2,
                    (-1, 22, 12),
                    ("GROOVE",),
                    width=rng.choice((2.0, 3.0)),
                )
            )
        elif kind == "bore":
            tools.append(
                Tool(
                    k + 1,
                    kind,
                    0.4,
                    *rng.choice(((275, 328), (275, 355))),
                    3,
                    (0.3, 60, 2),
                    rng.choice((("ROUGH", "FINISH"), ("ROUGH",), ("FINISH",))),
                    bar=rng.choice((4.0, 6.0)),
                )
            )
        else:
            tools.append(Tool(k + 1, kind, rng.choice((8.0, 10.0, 12.0)), 0, 0, 7, (), ("DRILL",), depth=6.0))
    return tools


def _outer(rng, tools, low, wide):
    """Pen of the outside: features from the face to the left."""
    pen = Pen(0.0, rng.uniform(low, 0.5 * (low + wide)))
    widths = [t.width for t in tools if t.kind == "groove"] or [3.0]
    for _ in range(rng.randint(2, 6)):
        kind, run = (
            rng.choice(("shoulder", "fillet", "cone", "groove", "hollow", "step down", "bulge")),
            rng.uniform(2.0, 9.0),
        )
        if kind in ("shoulder", "fillet") and pen.x < wide - 1.0:
            up = rng.uniform(0.5, min(5.0, wide - pen.x))
            r = min(up, rng.uniform(0.5, 2.0)) if kind == "fillet" else 0.0
            pen.line(pen.z - run, pen.x)
            if r:
                pen.arc(pen.z - r, pen.x + r, pen.z, pen.x + r, False)
            pen.line(pen.z, pen.x + up - r)
        elif kind == "cone":
            pen.line(pen.z - run, rng.uniform(low, wide))
        elif kind == "groove" and pen.x - low > 1.0:
            depth, width, x = (
                rng.uniform(0.5, min(3.0, pen.x - low)),
                rng.choice(widths) + rng.choice((0.0, 0.005, 0.02, 0.5, 4.0)),
                pen.x,
            )
            pen.line(pen.z - run, x)
            pen.line(pen.z, x - depth)
            pen.line(pen.z - width, x - depth)
            pen.line(pen.z, x)
        elif kind in ("hollow", "bulge") and low + 1.5 < pen.x < wide - 1.5:
            r, half = rng.uniform(4.0, 12.0), 0.5 * min(run, 4.0)
            rise = r - math.sqrt(r * r - half * half)
            if low < pen.x - rise and pen.x + rise < wide:
                sink = math.sqrt(r * r - half * half)
                pen.arc(
                    pen.z - 2 * half,
                    pen.x,
                    pen.z - half,
                    pen.x + sink * (1 if kind == "hollow" else -1),
                    kind == "bulge",
                )
        elif kind == "step down" and pen.x - low > 1.0:
            pen.line(pen.z - run, pen.x)
            pen.line(pen.z, rng.uniform(low, pen.x - 0.5))
        pen.line(pen.z - rng.uniform(1.0, 3.0), pen.x)
    return pen


def _bore(rng, end, most):
    """Pen of a stepped bore, from the face to the left; through, or blind with a flat end."""
    bottom = end if rng.random() < 0.5 else end * rng.uniform(0.3, 0.7)
    pen = Pen(0.0, rng.uniform(most - 1.0, most))
    if rng.random() < 0.6:
        pen.line(rng.uniform(0.3, 0.6) * bottom, pen.x)
        pen.line(pen.z, rng.choice((4.0, 5.0, 6.0, pen.x - 0.5)) if most > 6.5 else pen.x - 0.4)
    pen.line(bottom, pen.x)
    return pen


def _backwards(moves):
    """The same chain from its other end."""
    there = [(0, *moves[-1][1:3], 0.0, 0.0)]
    for (_, z, x, *_), (code, z1, x1, i, k) in zip(moves[-2::-1], moves[:0:-1]):
        there.append(({1: 1, 2: 3, 3: 2}[code], z, x, x + i - x1 if code > 1 else 0.0, z + k - z1 if code > 1 else 0.0))
    return there


def _sub(moves, number, twice):
    """Lines of the part; number: makes the text of a length, twice: 2 for X in diameters."""
    return [
        f"G{code} X{number(x * twice)} Z{number(z)}" + (f" I{number(i)} K{number(k)}" if code > 1 else "")
        for code, z, x, i, k in moves
    ]


def random_part(rng):
    """Part of a random.Random."""
    bored, unit, twice = rng.random() < 0.4, rng.choice((1.0, 1.0, 25.4)), rng.choice((1, 2))
    tools = random_tools(rng, bored)
    most = rng.uniform(6.8, 9.0)
    outer = _outer(rng, tools, most + 1.0 if bored else rng.uniform(2.0, 6.0), rng.uniform(14.0, 20.0))
    end, bore = outer.z, _bore(rng, outer.z, most) if bored else None
    moves = outer.moves
    if bore:
        joined = _backwards(bore.moves)
        moves = joined + [(1, *outer.moves[0][1:])] + outer.moves[1:]
    if rng.random() < 0.5:
        moves = _backwards(moves)
    widest = max(x for _, x in outer.points)
    blank = (widest + rng.uniform(0.2, 3.0), end - 25.0, rng.choice((0.0, 0.3, rng.uniform(0.5, 3.0))))
    barriers, lines = [], []

    def number(value):
        return f"{value / unit:.7f}"

    def barrier(z0, z1, x1):
        barriers.append((z0, z1, 0.0, x1))
        lines.append(f"G22 X{number(x1 * twice)} Z{number(z1)}" + ("" if z0 < -9000 else f" K{number(z0)}"))

    if rng.random() < 0.6:
        barrier(-1e4, end - rng.uniform(0.0, 8.0), rng.uniform(10.0, 45.0))
    if not bored and rng.random() < 0.2:
        blank = (*blank[:2], 0.0)
        left = rng.uniform(0.1, 2.0)
        barrier(left, left + 40.0, rng.uniform(1.0, 12.0))
    sub = _sub(moves, number, twice)
    roles = ",".join(f"{role}={t.number}" for t in tools for role in t.roles)
    text = "\n".join(
        [
            f"(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER={number(2 * blank[0])},ZMIN={number(blank[1])},"
            f"ZMAX={number(blank[2])})",
            f"(LATHE,{roles})",
            f"G{20 if unit > 1 else 21} G18 G{7 if twice > 1 else 8} G94 G97 S900 M3",
            *lines,
            f"G26 Q7 I{number(rng.choice((0.0, 0.2, 0.4)))} D{number(rng.uniform(0.6, 2.0))} F{number(120)} "
            f"E{number(60)}",
            "M2",
            "O7 sub",
            *sub,
            "O7 endsub",
            "",
        ]
    )
    return Part(text, tools, outer.points, bore.points if bore else [], blank, barriers)
