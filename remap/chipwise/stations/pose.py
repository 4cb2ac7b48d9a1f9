# SPDX-License-Identifier: GPL-2.0-or-later
"""The tool's orientation in a station.  Pure; degrees.  Called by glue/robot.py.

A, B and C are roll, pitch and yaw: the rotation Rz(C) Ry(B) Rx(A), as pumakins and the other kinematics of arms have it.  In a station with the
matrix S, the tool that has the pose P in a level one has S P.
"""

import math

import numpy as np

LEVEL = 1e-9            # of a cosine: B is +-90 degrees, and only A - C or A + C counts


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
    if flat < LEVEL:            # A alone: C stays
        b = math.copysign(90.0, -m[2, 0])
        c = math.radians(near[2])
        rest = np.array([[math.cos(c), math.sin(c), 0], [-math.sin(c), math.cos(c), 0], [0, 0, 1]]) @ m
        first = [(math.degrees(math.atan2(-rest[1, 2], rest[1, 1])), b, near[2])]
    else:
        a, b, c = (math.degrees(v) for v in (math.atan2(m[2, 1], m[2, 2]), math.atan2(-m[2, 0], flat), math.atan2(m[1, 0], m[0, 0])))
        first = [(a, b, c), (a + 180.0, 180.0 - b, c + 180.0)]
    whole = [tuple(value - 360.0 * round((value - now) / 360.0) for value, now in zip(abc, near)) for abc in first]
    return min(whole, key=lambda abc: max(abs(value - now) for value, now in zip(abc, near)))


def in_station(station, pose, near):
    """(A, B, C) of a tool in a station (3 x 3, to machine coordinates) that has the pose in a level one."""
    return abc_of(np.asarray(station) @ matrix_of(pose), near)
