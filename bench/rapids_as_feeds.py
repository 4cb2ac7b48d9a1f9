# SPDX-License-Identifier: GPL-2.0-or-later
"""Ten programs in the manner of a CAM system whose free licence writes rapids as G1 at the feed of the cut.

Called by bench_air.py.  Each is a list of moves, posted twice: with G0, and with G1 in its place.  Sizes, heights,
feeds and tools are odd and come from the seed; every other program is in inches.  mm, mm/min; the stock's top is Z0,
its corner at (20, 20).
"""

import math
import random
from dataclasses import dataclass, field

import roots  # noqa: F401  puts tests/ and remap/ on the path
from chipwise.errors import MM_PER_INCH
from support.judge import Blank, Tool, ball

PLACE = 20.0


@dataclass
class Job:
    """name; inch; size: of the stock; tools: {number: (Tool, length)}; moves: ("tool", n) | ("rapid", x, y, z) |
    ("line", x, y, z, f) |
    ("arc", clockwise, x, y, z, i, j, f); None: as before."""

    name: str
    inch: bool
    size: tuple
    tools: dict
    moves: list = field(default_factory=list)

    @property
    def blank(self):
        return Blank.corners((PLACE, PLACE, -self.size[2]), (PLACE + self.size[0], PLACE + self.size[1], 0.0))

    def text(self, rapids):
        """G-code: rapids as G0, or as G1 at the F of the tool's cut."""
        unit = MM_PER_INCH if self.inch else 1.0
        lines = [
            "%",
            f"({self.name.upper()})",
            "(WHEN USING FUSION FOR PERSONAL USE, THE FEEDRATE OF RAPID MOVES IS REDUCED TO MATCH THE FEEDRATE OF "
            "CUTTING MOVES)",
            f"G90 G94 G17 G{20 if self.inch else 21} G64 P{0.02 / unit:.4f}",
        ]
        cut = 600.0
        for kind, *values in self.moves:
            if kind == "tool":
                number, cut = values
                lines += [f"T{number} M6", "S9000 M3", f"G43 H{number}"]
                continue
            f, words = (None if kind == "rapid" else values.pop()), ""
            code = {
                "rapid": "G0" if rapids else "G1",
                "line": "G1",
                "arc": "G2" if kind == "arc" and values[0] else "G3",
            }[kind]
            if kind == "arc":
                values = values[1:]
            for letter, value in zip("XYZIJ", values):
                if value is not None:
                    words += f" {letter}{(value + (PLACE if letter in 'XY' else 0.0)) / unit:.5f}"
            f = f if f or rapids else cut
            lines.append(code + words + (f" F{f / unit:.3f}" if f else ""))
        return "\n".join([*lines, "M5", "M30", "%"]) + "\n"


class Path:
    """Moves of a tool with its heights and feeds."""

    def __init__(self, rng, job, number, cut, plunge):
        self.job, self.cut, self.plunge = job, cut, plunge
        self.clear, self.near = rng.uniform(11, 17), rng.uniform(1.1, 5.3)
        self.lead = cut * rng.uniform(0.5, 0.9)
        job.moves += [("tool", number, cut)]

    def over(self, x, y):
        """Above a place, and down near the stock."""
        self.job.moves += [("rapid", None, None, self.clear), ("rapid", x, y, None), ("rapid", None, None, self.near)]

    def line(self, x=None, y=None, z=None, f=None):
        self.job.moves.append(("line", x, y, z, f or self.cut))

    def arc(self, clockwise, x, y, i, j, z=None, f=None):
        self.job.moves.append(("arc", clockwise, x, y, z, i, j, f or self.cut))

    def circle(self, x, y, r, clockwise=False):
        """From wherever the tool is to (x + r, y), and round about (x, y) in two halves; r below 0 begins on the other
        side."""
        self.line(x + r, y, f=self.lead)
        self.arc(clockwise, x - r, y, -r, 0.0)
        self.arc(clockwise, x + r, y, r, 0.0)

    def up(self):
        self.job.moves.append(("rapid", None, None, self.near))

    def end(self):
        self.job.moves.append(("rapid", None, None, self.clear + 3.7))

    def helix(self, x, y, r, top, low, pitch):
        """Down on a helix about (x, y), from (x + r, y)."""
        self.line(x + r, y, top, self.lead)
        turns = max(1, math.ceil((top - low) / pitch))
        for n in range(1, turns + 1):
            self.arc(False, x + r, y, -r, 0.0, top + (low - top) * n / turns, self.plunge)
        self.arc(False, x + r, y, -r, 0.0, None, self.lead)


def job(rng, name, inch, size, *tools):
    return Job(name, inch, size, {n + 1: (tool, rng.uniform(41, 63)) for n, tool in enumerate(tools)})


def face(rng, inch):
    made = job(rng, "face", inch, (93.7, 41.3, 17.0), Tool(25.0))
    p = Path(rng, made, 1, rng.uniform(900, 1300), rng.uniform(250, 400))
    for n, depth in enumerate((1.3, 2.35)):
        for k in range(3):
            y, far = 4.1 + 15.7 * k, k % 2
            p.over((-16.0, 110.0)[far], y)
            p.line(z=-depth, f=p.plunge)
            p.line((110.0, -16.0)[far], y + 0.37 * n)
            p.up()
    p.end()
    return made


def helical_pocket(rng, inch):
    made = job(rng, "helical pocket", inch, (71.3, 53.9, 19.0), Tool(8.0))
    p = Path(rng, made, 1, rng.uniform(700, 1100), rng.uniform(180, 260))
    for x, y in ((19.3, 17.7), (52.1, 36.3), (21.7, 39.1)):
        p.over(x, y)
        for low in (-2.7, -5.3):
            p.helix(x, y, 2.63, low + 2.9, low, 0.87)
            for r in (4.77, 6.9):
                p.circle(x, y, r)
            p.line(x, y)
        p.up()
    p.end()
    return made


def trochoid(rng, inch):
    made = job(rng, "trochoid", inch, (63.1, 44.7, 14.0), Tool(6.0))
    p = Path(rng, made, 1, rng.uniform(1300, 1700), rng.uniform(200, 300))
    for y in (12.3, 31.9):
        p.over(-6.3, y)
        p.line(z=-4.1, f=p.plunge)
        r, step = 3.9, 0.83
        p.line(-3.1, y + r, f=p.lead)
        for k in range(24):
            x = -3.1 + step * k
            p.arc(True, x, y - r, 0.0, -r)
            p.arc(True, x + step, y + r, 0.5 * step, r)
        p.line(x - 4.4, y, f=p.lead)
        p.up()
    p.end()
    return made


def outline(rng, inch):
    made = job(rng, "outline", inch, (57.7, 48.3, 12.0), Tool(10.0))
    p = Path(rng, made, 1, rng.uniform(800, 1200), rng.uniform(220, 330))
    a, b, r = 7.3, 50.1, 6.7
    for low in (-2.9, -5.7):
        p.over(0.5 * (a + b), -13.0)
        p.line(z=low, f=p.plunge)
        p.line(0.5 * (a + b) - 7.0, a - 12.0, f=p.lead)
        p.arc(True, 0.5 * (a + b), a - 5.0, 7.0, 0.0, f=p.lead)
        for (x, y), (u, v), (i, j) in (
            ((b - r, a - 5.0), (b + 5.0, a + r), (0.0, r + 5.0)),
            ((b + 5.0, 41.0 - r), (b - r, 46.0), (-r - 5.0, 0.0)),
            ((a + r, 46.0), (a - 5.0, 41.0 - r), (0.0, -r - 5.0)),
            ((a - 5.0, a + r), (a + r, a - 5.0), (r + 5.0, 0.0)),
        ):
            p.line(x, y)
            p.arc(False, u, v, i, j)
        p.line(0.5 * (a + b), a - 5.0)
        p.arc(True, 0.5 * (a + b) + 7.0, a - 12.0, 0.0, -7.0, f=p.lead)
        p.up()
    p.end()
    return made


def ramped_slots(rng, inch):
    made = job(rng, "ramped slots", inch, (82.9, 47.1, 16.0), Tool(6.35))
    p = Path(rng, made, 1, rng.uniform(600, 900), rng.uniform(150, 240))
    for k in range(5):
        x, y, to = 9.7 + 1.3 * k, 6.1 + 8.3 * k, 66.9 - 2.1 * k
        p.over(x, y)
        p.line(z=0.41, f=p.lead)
        for low in (-1.1, -2.3):
            p.line(x + 14.3, y, low - 0.3, p.plunge)
            p.line(x, y, low, p.plunge)
            p.line(to, y + 0.9)
            p.line(x, y)
        p.up()
    p.end()
    return made


def drilled(rng, inch):
    made = job(rng, "drilled", inch, (77.3, 58.7, 18.0), Tool(5.1, 0.0, 118.0), Tool(12.0))
    p = Path(rng, made, 1, rng.uniform(300, 420), rng.uniform(200, 280))
    for x, y in ((8.3, 9.1), (68.9, 9.7), (67.3, 49.9), (9.9, 48.1), (38.7, 29.3)):
        p.over(x, y)
        for low in (-3.7, -7.9):
            p.line(z=low, f=p.plunge)
            p.up()
    p.end()
    p = Path(rng, made, 2, rng.uniform(700, 1000), rng.uniform(200, 300))
    for y in (-3.1, 61.9):
        p.over(-9.7, y)
        p.line(z=-3.3, f=p.plunge)
        p.line(87.3, y)
        p.up()
    p.end()
    return made


def bosses(rng, inch):
    made = job(rng, "bosses", inch, (74.9, 39.1, 13.0), Tool(8.0))
    p = Path(rng, made, 1, rng.uniform(800, 1200), rng.uniform(200, 300))
    for x in (18.1, 54.3):
        y, side = 19.7, 1 if x > 30 else -1
        for r in (17.9, 14.7):
            p.over(x + side * 25.3, y)
            p.line(z=-3.1, f=p.plunge)
            p.circle(x, y, side * r, clockwise=True)
            p.line(x + side * 25.3, y)
            p.up()
    p.end()
    return made


def waves(rng, inch):
    made = job(rng, "waves", inch, (47.3, 31.9, 21.0), ball(10.0))
    p = Path(rng, made, 1, rng.uniform(900, 1400), rng.uniform(300, 400))
    for k in range(7):
        y = 3.9 + 3.7 * k
        points = [(2.1 + 1.43 * n, -2.9 + 1.9 * math.sin(0.21 * n + 0.4 * k)) for n in range(31)]
        p.over(points[0][0], y)
        p.line(z=points[0][1], f=p.plunge)
        for x, z in points[1:]:
            p.line(x, y, z)
        p.up()
    p.end()
    return made


def engraved(rng, inch):
    made = job(rng, "engraved", inch, (68.3, 43.7, 9.0), Tool(6.0, 0.0, 60.0))
    p = Path(rng, made, 1, rng.uniform(700, 1000), rng.uniform(200, 300))
    for k in range(9):
        x, y = 6.3 + 7.1 * (k % 3) * 2.6, 7.7 + 12.9 * (k // 3)
        p.over(x, y)
        p.line(z=-0.73, f=p.plunge)
        p.line(x + 5.9, y + 2.3)
        p.arc(False, x + 3.1, y + 5.1, -2.8, 0.0)
        p.line(x, y)
        p.up()
    p.end()
    return made


def two_sizes(rng, inch):
    made = job(rng, "two sizes", inch, (66.7, 49.3, 15.0), Tool(12.0), Tool(4.0))
    p = Path(rng, made, 1, rng.uniform(800, 1100), rng.uniform(220, 300))
    for x in (16.9, 47.7):
        p.over(x, 23.3)
        p.helix(x, 23.3, 3.3, 0.53, -3.9, 1.1)
        p.line(x, 23.3)
        p.up()
    p.end()
    p = Path(rng, made, 2, rng.uniform(500, 700), rng.uniform(130, 180))
    for x in (16.9, 47.7):
        p.over(x, 23.3)
        p.line(z=-3.9, f=p.plunge)
        p.circle(x, 23.3, 9.3 - 0.9)
        p.line(x, 23.3)
        p.up()
    p.end()
    return made


BUILDERS = face, helical_pocket, trochoid, outline, ramped_slots, drilled, bosses, waves, engraved, two_sizes


def programs(seed):
    """The ten of a seed."""
    return [build(random.Random(f"{seed} {build.__name__}"), n % 2 == 1) for n, build in enumerate(BUILDERS)]
