# SPDX-License-Identifier: GPL-2.0-or-later
"""Traverses as the planner makes them, near the stock, into it and in a slot cut before."""

from support.halrig import ToolPath

LOW, HIGH = (0.0, 0.0, -10.0), (60.0, 40.0, 0.0)
DIAMETER = 6.0  # mm
ACCEL = 2000.0  # mm/s2, as in test.hal
RAPID = 200.0  # mm/s
CLEARANCE = 2.0  # mm above the stock
SIDE_Y, BOTTOM = 30.0, -3.0  # mm


def stimulus():
    path = ToolPath((10.0, 10.0, 40.0), motion_type=1, enable=1, tool_diameter=DIAMETER)
    path.box(LOW, HIGH)
    path.phase("define")
    path.stay(2).define(10)
    path.phase("down to the clearance plane")
    path.move((10.0, 10.0, CLEARANCE), RAPID, ACCEL)
    path.phase("across at the clearance plane")
    path.move((20.0, 25.0, CLEARANCE), RAPID, ACCEL)
    path.phase("away")
    path.move((-45.0, SIDE_Y, CLEARANCE), RAPID, ACCEL).move((-45.0, SIDE_Y, BOTTOM), RAPID, ACCEL)
    path.phase("towards the side, braking in front of it")
    path.move((-0.5 * DIAMETER - CLEARANCE, SIDE_Y, BOTTOM), RAPID, ACCEL)
    path.move((-45.0, SIDE_Y, BOTTOM), RAPID, ACCEL)
    path.phase("into the side at full speed")
    path.line((10.0, SIDE_Y, BOTTOM), RAPID)
    path.phase("feed")
    path.set(motion_type=2).line((25.0, SIDE_Y, BOTTOM), 100.0)
    path.phase("back in the finished slot")
    path.set(motion_type=1).move((-10.0, SIDE_Y, BOTTOM), RAPID, ACCEL)
    path.phase("in the slot once more")
    path.move((20.0, SIDE_Y, BOTTOM), RAPID, ACCEL).move((20.0, SIDE_Y, 5.0), RAPID, ACCEL)
    path.phase("end")
    path.stay(10)
    return path
