# SPDX-License-Identifier: GPL-2.0-or-later
"""What a pattern has to do, from what its sub does by itself: G75's oracle, and random subs.

Used by tests/interpreter/test_g75.py and bench/bench_pattern.py.  The sub runs in the preview's interpreter; every move
becomes points on it, and the points are transformed with complex numbers: nothing of chipwise's isometries, arcs or
planes is in it.
"""

import cmath
import json
import math
import random

import numpy as np

from support import canon

STILL_MM = 1e-8  # shorter moves are not compared
SHARES = np.linspace(0.0, 1.0, 9)[1:]
_OWN = {1: (0, 1, 2), 3: (2, 0, 1), 2: (1, 2, 0)}  # gcode's planes: X, Y, Z of the arc's first, second and third axis
SUB = [
    "o100 sub",
    "G0 X10 Y2",
    "G0 Z2",
    "G1 Z-1 F100",
    "X20 F300",
    "G3 X20 Y12 I0 J5",
    "G1 X12 Y9 Z-2",
    "G0 Z5",
    "o100 endsub",
]


class Move:
    """kind, points (n, 3) from its start on without it, feed (mm/min), line."""

    def __init__(self, kind, points, feed, line, plane=1):
        self.kind, self.points, self.feed, self.line, self.plane = kind, np.asarray(points), feed, line, plane


def moves_of(program, first="begin", last="end", **options):
    """(moves between two comments of a program, the Trace); raises AssertionError for an error of the program."""
    trace = canon.run_preview(program, **options)
    assert not trace.error, trace.error
    return calls_to_moves(json.loads(trace.output.splitlines()[-1])["calls"], first, last), trace


def calls_to_moves(calls, first="begin", last="end"):
    """Moves, machine coordinates, of preview_probe.py's calls."""
    here, feed, plane, found, inside = np.zeros(3), 0.0, 1, [], False
    for kind, line, *n in calls:
        if kind == "comment":
            inside = n[0] == first or inside and n[0] != last
        elif kind == "F":
            feed = n[0]
        elif kind == "plane":
            plane = n[0]
        elif kind in ("rapid", "feed"):
            end = np.array(n[:3])
            if inside and np.abs(end - here).max() > STILL_MM:
                found.append(Move(kind, [end], feed if kind == "feed" else None, line))
            here = end
        elif kind == "arc":
            points = _arc(here, n, plane)
            if inside:
                found.append(Move("arc", points, feed, line, plane))
            here = points[-1]
    return found


def _arc(start, numbers, plane):
    """Points on an arc at SHARES of its turn."""
    first, second, along, centre_first, centre_second, turns = numbers
    own = _OWN[plane]
    a, b, c = start[list(own)]
    centre = complex(centre_first, centre_second)
    z0, z1 = complex(a, b) - centre, complex(first, second) - centre
    sweep = cmath.phase(z1 / z0)
    if turns > 0 and sweep <= 1e-9:
        sweep += 2 * math.pi
    if turns < 0 and sweep >= -1e-9:
        sweep -= 2 * math.pi
    sweep += 2 * math.pi * (abs(turns) - 1) * (1 if turns > 0 else -1)
    points = np.empty((len(SHARES), 3))
    for k, share in enumerate(SHARES):
        z = centre + z0 * cmath.exp(1j * sweep * share)
        points[k, list(own)] = z.real, z.imag, c + (along - c) * share
    points[-1, list(own)] = first, second, along
    return points


def transformed(points, mirror, degrees, shift):
    """Points (n, 3): mirrored about the origin, rotated, shifted."""
    found = []
    for x, y, z in np.atleast_2d(points):
        w = complex(-x if mirror in (1, 3) else x, -y if mirror in (2, 3) else y) * cmath.rect(
            1.0, math.radians(degrees)
        )
        found.append((w.real + shift[0], w.imag + shift[1], z + shift[2]))
    return np.array(found)


def compare(pattern, plain, transform, tolerance=1e-6):
    """Raise AssertionError unless `pattern` is `plain` under a function of points."""
    assert [m.kind for m in pattern] == [m.kind for m in plain]
    for k, (mine, other) in enumerate(zip(pattern, plain)):
        off = float(np.abs(mine.points - transform(other.points)).max())
        assert off <= tolerance, (
            f"move {k} (line {mine.line}) is {off:.2g} mm off: {mine.points[-1]}, not {transform(other.points)[-1]}"
        )
        assert (mine.feed is None) == (other.feed is None)
        if mine.feed is not None:
            assert abs(mine.feed - other.feed) <= 1e-6 * other.feed, f"move {k} has F{mine.feed}, not F{other.feed}"


# ---- random subs -----------------------------------------------------------------------------------------------------


class _Maker:
    """Lines of a random sub, a kind of move each."""

    def __init__(self, seed):
        self.random, self.labels = random.Random(f"pattern {seed}"), iter(range(101, 200))

    def kinds(self, cycles, contours):
        """What one is chosen of: functions that return lines."""
        found = [lambda: [self.line()]] * 4 + [
            self.arc,
            self.arc,
            self.arc_r,
            self.canned,
            self.compensated,
            self.called,
            self.looped,
        ]
        found += [self.cycle] if cycles else []
        return found + (([self.nested] + ([self.contour_cycle] if cycles else [])) if contours else [])

    def number(self, low, high):
        return f"{self.random.uniform(low, high):.4f}"

    def line(self):
        return (
            f"G1 X{self.number(-20, 20)} Y{self.number(-20, 20)}"
            + (f" Z{self.number(-5, 3)}" if self.random.random() < 0.4 else "")
            + (f" F{self.number(50, 900)}" if self.random.random() < 0.4 else "")
        )

    def arc(self):
        plane, (a, b), (i, j) = self.random.choice(
            [("G17", "XY", "IJ"), ("G17", "XY", "IJ"), ("G18", "XZ", "IK"), ("G19", "YZ", "JK")]
        )
        x, y = self.random.uniform(-9, 9), self.random.uniform(-9, 9)
        turn = cmath.rect(1.0, self.random.uniform(0.2, 6.0)) * complex(-x, -y)
        along = "ZYX"["G17 G18 G19".split().index(plane)] + self.number(-2, 2) if self.random.random() < 0.4 else ""
        end = turn - complex(-x, -y)
        return [
            f"G91 {plane} G{self.random.choice('23')} {a}{end.real:.6f} {b}{end.imag:.6f} {along} {i}{x:.6f} {j}{y:.6f}"
            + (f" P{self.random.choice((2, 3))}" if plane == "G17" and self.random.random() < 0.2 else ""),
            "G90 G17",
        ]

    def arc_r(self):
        x, y = self.random.uniform(-9, 9), self.random.uniform(-9, 9)
        code, side = self.random.choice("23"), self.random.choice((1, -1))
        return [f"G91 G{code} X{x:.4f} Y{y:.4f} R{side * math.hypot(x, y) * self.random.uniform(0.55, 2):.5f}", "G90"]

    def canned(self):
        code = self.random.choice(["G81", "G82", "G83", "G73"])
        more = {"G82": " P0.05", "G83": " Q1.3", "G73": " Q0.9"}.get(code, "")
        return [
            f"G{self.random.choice((98, 99))} {code} X{self.number(-20, 20)} Y{self.number(-20, 20)} "
            f"Z{self.number(-6, -1)} R{self.number(0.5, 3)}{more}",
            f"X{self.number(-20, 20)}",
            "G80",
            "G0 Z5",
        ]

    def compensated(self):
        side = self.random.choice((41, 42))
        return [
            f"G0 X-15 Y-15 Z{self.number(1, 4)}",
            f"G{side}.1 D{self.number(0.5, 2)}",
            "G1 X-5 Y-9",
            f"X{self.number(3, 9)}",
            f"Y{self.number(3, 9)}",
            "X-5",
            "G40",
            "G0 X-20",
        ]

    def called(self):
        return [f"o200 call [{self.number(-9, 9)}] [{self.number(1, 5)}]"]

    def looped(self):
        label = next(self.labels)
        return [
            "#1 = 0",
            f"o{label} while [#1 LT 3]",
            f"G0 X[#1 * {self.number(2, 6)}] Y{self.number(-5, 5)}",
            "G1 Z-1",
            "G0 Z4",
            "#1 = [#1 + 1]",
            f"o{label} endwhile",
        ]

    def cycle(self):
        return [
            f"G0 X{self.number(-9, 9)} Y{self.number(-9, 9)} Z5",
            f"G{self.random.choice((12, 13))} I{self.number(2, 6)} K{self.number(7, 9)} Q0.9 Z-3 R2 F400",
        ]

    def contour_cycle(self):
        code = self.random.choice(
            [
                f"G77 P{self.random.choice((41, 42))} I0.2 D0.9",
                f"G78 P{self.random.choice((41, 42))}",
                f"G79 D0.9 P{self.random.randrange(4)}",
            ]
        )
        return [f"G0 X{self.number(-9, 9)} Y{self.number(-9, 9)} Z5", f"{code} Q300 Z-2 R2 J1.5 F400"]

    def nested(self):
        return [
            f"G0 X{self.number(-9, 9)} Y{self.number(-9, 9)} Z5",
            f"G75 Q400 X{self.number(-9, 9)} Y{self.number(-9, 9)} R{self.number(-180, 180)} "
            f"H{self.random.randrange(4)} L2 I7 K{self.number(0, 90)}",
        ]


def random_sub(seed, cycles=True, contours=False):
    """Lines of a sub O100 and of the subs that it calls, for a tool of 2 mm: lines, I J and R arcs, helices, planes,
    G91, canned cycles, compensation, loops, calls; cycles: G12 and G13 too; contours: patterns in the pattern, and of
    the cycles G77, G78 and G79 too."""
    maker = _Maker(seed)
    r, kinds = maker.random, maker.kinds(cycles, contours)
    body = [f"G0 X{maker.number(-20, 20)} Y{maker.number(-20, 20)}", "G0 Z4 (down)", maker.line()]
    for _ in range(r.randint(2, 7)):
        body += r.choice(kinds)()
    body += ["G90 G17 G0 Z6"]
    return [
        "o200 sub",
        "G0 X#1 Y#2 Z4",
        "G1 Z-2 F222",
        "G2 I1.5 J0.5",
        "G0 Z4",
        "o200 endsub",
        *(_PARTS if contours else []),
        "o100 sub",
        *body,
        "o100 endsub",
    ]


# a contour with round corners, and a sub for a pattern in the pattern
_PARTS = [
    "o300 sub",
    "G0 X-6 Y-4",
    "G1 X6",
    "G3 X8 Y-2 I0 J2",
    "G1 Y5",
    "X-3",
    "G2 X-6 Y2 I0 J-3",
    "G1 Y-4",
    "o300 endsub",
    "o400 sub",
    "G0 X1 Y2 Z4",
    "G1 Z-1 F333",
    "G2 X3 Y1 I1.5 J0.5",
    "G1 X5 Y-1",
    "G0 Z4",
    "o400 endsub",
]
