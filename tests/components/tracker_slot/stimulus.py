# SPDX-License-Identifier: GPL-2.0-or-later
"""A slot 17 degrees off the X axis, from 5 mm before the box to its middle, 3 mm deep."""

import math

from support.halrig import ToolPath

ANGLE = math.radians(17.0)
START = (-10.0, 8.0)  # mm, tip in XY; the tool touches the box 5..6 mm on
LENGTH = 57.0  # mm
DEPTH = 3.0  # mm
SPEED = 50.0  # mm/s
DIAMETER = 6.0  # mm
LOW, HIGH = (0.0, 0.0, -10.0), (60.0, 40.0, 0.0)


def stimulus(scale=1.0):
    path = ToolPath((*START, -DEPTH), scale, tool_diameter=DIAMETER, motion_type=2, enable=1)
    path.box(LOW, HIGH)
    path.phase("define")
    path.stay(2).define()
    path.phase("cut")
    path.line((START[0] + LENGTH * math.cos(ANGLE), START[1] + LENGTH * math.sin(ANGLE), -DEPTH), SPEED)
    path.phase("stand")
    path.stay(120)
    return path
