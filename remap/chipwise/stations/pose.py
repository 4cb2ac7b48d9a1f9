# SPDX-License-Identifier: GPL-2.0-or-later
"""The tool's orientation in a station.  Pure; degrees.  Called by glue/robot.py.

A, B and C are roll, pitch and yaw: the rotation Rz(C) Ry(B) Rx(A), as pumakins and the other kinematics of arms have
it.  In a station with the matrix S, the tool that has the pose P in a level one has S P.

On a table that tilts and turns (xyzac-trt-kins, xyzbc-trt-kins) A or B and C are the table's angles, and X Y Z the
part's own coordinates.  The tool's axis in the part, the direction in which joint Z moves the tip (trtfuncs.c, 2.9), is
(sin C sin A, cos C sin A, cos A) or
(-cos C sin B, sin C sin B, cos B).  Only the axis counts: the tool turns about it anyway.
"""

import math

import numpy as np

# of a cosine: B is +-90 degrees, and only A - C or A + C counts; of a sine: the tool's axis is Z, and C does not count
LEVEL = 1e-9
TABLES = {"xyzac-trt-kins": "AC", "xyzbc-trt-kins": "BC"}  # module: its rotary axes, the tilting one first


def matrix_of(abc):
    """(A, B, C) -> 3 x 3."""
    a, b, c = (math.radians(value) for value in abc)
    x = np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]])
    y = np.array([[math.cos(b), 0, math.sin(b)], [0, 1, 0], [-math.sin(b), 0, math.cos(b)]])
    z = np.array([[math.cos(c), -math.sin(c), 0], [math.sin(c), math.cos(c), 0], [0, 0, 1]])
    return z @ y @ x


def abc_of(matrix, near=(0.0, 0.0, 0.0)):
    """3 x 3 -> (A, B, C), of all that are equal the one with the least turn from `near`."""
    m = np.asarray(matrix)
    flat = math.hypot(m[0, 0], m[1, 0])
    if flat < LEVEL:  # A alone: C stays
        b = math.copysign(90.0, -m[2, 0])
        c = math.radians(near[2])
        rest = np.array([[math.cos(c), math.sin(c), 0], [-math.sin(c), math.cos(c), 0], [0, 0, 1]]) @ m
        first = [(math.degrees(math.atan2(-rest[1, 2], rest[1, 1])), b, near[2])]
    else:
        a, b, c = (
            math.degrees(v)
            for v in (math.atan2(m[2, 1], m[2, 2]), math.atan2(-m[2, 0], flat), math.atan2(m[1, 0], m[0, 0]))
        )
        first = [(a, b, c), (a + 180.0, 180.0 - b, c + 180.0)]
    whole = [tuple(value - 360.0 * round((value - now) / 360.0) for value, now in zip(abc, near)) for abc in first]
    return min(whole, key=lambda abc: max(abs(value - now) for value, now in zip(abc, near)))


def in_station(station, pose, near):
    """(A, B, C) of a tool in a station (3 x 3, to machine coordinates) that has the pose in a level one."""
    return abc_of(np.asarray(station) @ matrix_of(pose), near)


def table_axis(axes, abc):
    """The tool's axis in the part (3,) of a table at (A, B, C); axes: of TABLES."""
    tilt, turn = math.radians(abc[0] if axes == "AC" else abc[1]), math.radians(abc[2])
    if axes == "AC":
        return np.array([math.sin(turn) * math.sin(tilt), math.cos(turn) * math.sin(tilt), math.cos(tilt)])
    return np.array([-math.cos(turn) * math.sin(tilt), math.sin(turn) * math.sin(tilt), math.cos(tilt)])


def table_in_station(axes, station, pose, near, ranges):
    """(A, B, C) of a table whose tool has the axis in a station (3 x 3) that it has at `pose` in a level one.

    near: (A, B, C) now; ranges: (lowest, highest) of A, B and C.  Of all that are equal and in range the one with the
    least turn from near; without one in range, of all."""
    x, y, z = np.asarray(station) @ table_axis(axes, pose)
    flat, tilting = math.hypot(x, y), "AB".index(axes[0])
    found = []
    for sign in (1, -1):
        tilt = sign * math.degrees(math.atan2(flat, z))
        turn = (
            near[2]
            if flat < LEVEL
            else math.degrees(math.atan2(sign * x, sign * y) if axes == "AC" else math.atan2(sign * y, -sign * x))
        )
        for whole in (-1, 0, 1):
            abc = list(near)
            abc[tilting], abc[2] = tilt, turn + 360.0 * (whole + round((near[2] - turn) / 360.0))
            found.append(tuple(abc))
    fits = [abc for abc in found if all(low <= angle <= high for angle, (low, high) in zip(abc, ranges))]
    return min(fits or found, key=lambda abc: max(abs(angle - now) for angle, now in zip(abc, near)))
