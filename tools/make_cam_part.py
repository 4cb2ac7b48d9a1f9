#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Write nc_files/cam_part.ngc: what a CAM system would post for a rounded boss.

    tools/make_cam_part.py > nc_files/cam_part.ngc

Four roughing rings around a superellipse (|x/a|^p + |y/b|^p = 1), from the outside in, as chords
of SEGMENT mm, each entered and left by an arc; the last ring is the finish.  Kept so that the
program can be made again, not run by anything.
"""

import math

A, B, POWER = 38.0, 26.0, 3.2  # mm half axes of the boss
CENTRE = (60.0, 45.0)  # mm
TOOL_RADIUS = 3.0  # mm, T1
STEP = 2.2  # mm between rings
RINGS = 4
SEGMENT = 0.4  # mm
DEPTH = -4.0  # mm
HEADER = (
    "(A boss milled by small segments: how the feed follows the stock on a CAM program, lines of {segment} mm and arcs)"
    """
(Stock:  120 x 90 x 12 mm, work zero at its lower left corner on the top face)
(Tool:   T1, 6 mm end mill, 2 flutes)
(Feed:   12 cm3/min held by the volumetric feed, up to 4000 mm/min)
(Result: a rounded boss of {a2:g} x {b2:g} mm standing {depth:g} mm high in a trench {rings} rings wide; the first)
(        ring is a full slot, the others cut {step} mm)
(Made by tools/make_cam_part.py)

(WORKPIECE,BOX,XMIN=0,YMIN=0,ZMIN=-12,XMAX=120,YMAX=90,ZMAX=0)

G17 G21 G40 G49 G54 G80 G90 G91.1 G94
G64 P0.02 Q0.005
T1 M6
M250
M251 P2 Q12 E4000
S16000 M3
F800
G0 X{x:.3f} Y{y:.3f} Z5"""
)


def boss(t):
    """Point of the boss's outline (mm, about its centre) and its outward normal, t in rad."""
    c, s = math.cos(t), math.sin(t)
    x = A * math.copysign(abs(c) ** (2 / POWER), c)
    y = B * math.copysign(abs(s) ** (2 / POWER), s)
    nx = math.copysign(abs(x / A) ** (POWER - 1) / A, x)
    ny = math.copysign(abs(y / B) ** (POWER - 1) / B, y)
    length = math.hypot(nx, ny)
    return (x, y), (nx / length, ny / length)


def ring(offset):
    """Closed ring of chords at `offset` mm from the boss, from t = 0 clockwise (climb, outside)."""
    fine, points = 20000, []
    for i in range(fine + 1):
        (x, y), (nx, ny) = boss(-2 * math.pi * i / fine)
        point = CENTRE[0] + x + offset * nx, CENTRE[1] + y + offset * ny
        if not points or math.dist(point, points[-1]) >= SEGMENT:
            points.append(point)
    points[-1] = points[0]
    return points


def main():
    rings = [ring(TOOL_RADIUS + STEP * k) for k in reversed(range(RINGS))]
    lead = 4.0
    start = rings[0][0][0] + lead, rings[0][0][1] + lead
    print(
        HEADER.format(segment=SEGMENT, a2=2 * A, b2=2 * B, depth=-DEPTH, rings=RINGS, step=STEP, x=start[0], y=start[1])
    )
    for points in rings:
        x, y = points[0]
        print(f"G0 X{x + lead:.3f} Y{y + lead:.3f}")
        print("G0 Z1")
        print(f"G1 Z{DEPTH:g} F300")
        print(f"G3 X{x:.3f} Y{y:.3f} I0 J{-lead:.3f} F800".replace("G3", "G3"))
        for px, py in points[1:]:
            print(f"G1 X{px:.3f} Y{py:.3f}")
        print(f"G3 X{x + lead:.3f} Y{y - lead:.3f} I{lead:.3f} J0")
        print("G0 Z5")
    print("G0 Z20\nM252\nM5\nM2")


if __name__ == "__main__":
    main()
