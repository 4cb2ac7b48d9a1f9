# SPDX-License-Identifier: GPL-2.0-or-later
"""Writes the control benchmark's programs, bench/nc/*.ngc.

Run by hand after a change; bench/bench_time.py runs what lies there.  Every program has the stock
120 x 80 x 12 mm with work zero at its lower left corner on the top face, T1 (6 mm flat) and
mode 2: the removal rate is to be the target wherever the ceiling lets it.
"""

import math
from pathlib import Path

HEAD = """({title})
(made by bench/make_nc.py; stock 120 x 80 x 12 mm, T1 6 mm flat)
(WORKPIECE,BOX,XMIN=0,YMIN=0,ZMIN=-12,XMAX=120,YMAX=80,ZMAX=0)
G17 G21 G40 G49 G54 G80 G90 G91.1 G94
G64 {tolerance}
T1 M6
M250
M251 P2 Q{q:g} E{ceiling:g}
S12000 M3
F600
"""
TAIL = "G0 Z10\nM252\nM5\nM2\n"
PROGRAMS = {}


def program(title, q=8, ceiling=5000, tolerance="P0.01"):
    """Registers a function that gives the lines of a program under its own name."""

    def keep(make):
        PROGRAMS[make.__name__] = (HEAD.format(title=title, q=q, ceiling=ceiling, tolerance=tolerance), make)
        return make

    return keep


def start(x, y, z):
    return [f"G0 X{x:.4f} Y{y:.4f} Z5", f"G0 Z{z:g}"]


def cut(*points):
    return [f"G1 X{x:.4f} Y{y:.4f}" for x, y in points]


@program("from air at the ceiling into full slots, at 0, 17, 45 and 90 degrees to the edge")
def entry():
    out = []
    for angle, at in ((0, (-25, 15)), (17, (-25, 30)), (45, (-20, 30)), (90, (100, -20))):
        a, length = math.radians(angle), 60 if angle != 45 else 75
        out += start(*at, -4)
        out += cut((at[0] + length * math.cos(a), at[1] + length * math.sin(a))) + ["G0 Z5"]
    return out


@program("10 % radial, then a step to 100 %, on straight lines")
def step():
    out = []
    out += start(-10, -2.4, -4) + cut((60, -2.4)) + ["G0 Z5"]  # 0.6 mm of the edge
    out += start(-10, 40, -4) + cut((50, 40)) + ["G0 Z5"]  # a slot to step beside
    out += start(-10, 40.6, -4) + cut((110, 40.6)) + ["G0 Z5"]  # 10 % up to X 50, then full
    out += start(-10, 20, -4) + cut((50, 20)) + ["G0 Z5"]
    out += start(-10, 23, -4) + cut((110, 23)) + ["G0 Z5"]  # 50 %, then full
    return out


@program("walls left by earlier cuts, met square and at 30 degrees, and islands of stock between slots")
def wall():
    out = []
    for x in (20, 40, 60, 80, 100):  # slots across
        out += start(x, -6, -4) + cut((x, 86)) + ["G0 Z5"]
    out += start(-10, 20, -4) + cut((130, 20)) + ["G0 Z5"]  # through ribs of 14 mm
    a = math.radians(30)
    out += start(-10, 30, -4) + cut((-10 + 100 * math.cos(a), 30 + 100 * math.sin(a))) + ["G0 Z5"]
    return out


@program("arcs: in from air, over a wall, a side cut that becomes a full slot")
def arcs():
    out = []
    out += start(30, -15, -4)  # half circle in from the edge
    out += ["G1 X30 Y-10", "G3 X30 Y50 I0 J30", "G0 Z5"]
    out += start(80, -6, -4) + cut((80, 86)) + ["G0 Z5"]  # a slot the next arc crosses
    out += start(60, 90, -4)
    out += ["G1 X60 Y84", "G3 X60 Y24 I0 J-30", "G3 X84 Y48 I0 J24", "G1 Y90", "G0 Z5"]
    return out


def _wave(x0, x1, y, swing, length, step):
    """Places `step` mm apart (by arc length) on a sine."""
    x, points = x0, [(x0, y + swing * math.sin(2 * math.pi * x0 / length))]
    while x < x1:
        slope = swing * 2 * math.pi / length * math.cos(2 * math.pi * x / length)
        x += step / math.hypot(1.0, slope)
        points.append((x, y + swing * math.sin(2 * math.pi * x / length)))
    return points


@program("0.1 mm lines along a wave, then beside it at 30 % radial, into a wall", tolerance="P0.01 Q0.002")
def cam01():
    out = []
    for shift, end in ((0.0, 80.0), (1.8, 112.0)):
        points = _wave(-12.0, end, 40.0 + shift, 4.0, 40.0, 0.1)
        out += start(*points[0], -4) + cut(*points[1:]) + ["G0 Z5"]
    return out


@program("corners through G64 blends: a zigzag of full width, then a square spiral at half width", tolerance="P0.1")
def corners():
    out = start(-10, 10, -4) + cut((50, 10), (50, 22), (10, 22), (10, 34), (50, 34)) + ["G0 Z5"]
    out += start(90, 40, 1) + ["G1 Z-4"]
    for i in range(1, 7):
        r = 3.0 * i
        out += cut((90 + r, 40 + r), (90 - r, 40 + r), (90 - r, 40 - r), (90 + r, 40 - r), (90 + r, 40 + r))
    return out + ["G0 Z5"]


def main():
    folder = Path(__file__).resolve().parent / "nc"
    folder.mkdir(exist_ok=True)
    for name, (head, make) in PROGRAMS.items():
        (folder / f"{name}.ngc").write_text(head + "\n".join(make()) + "\n" + TAIL)


if __name__ == "__main__":
    main()
