"""Traverses as the planner makes them, near the stock, into it and in a slot cut before."""
from halrig import Way

LOW, HIGH = (0.0, 0.0, -10.0), (60.0, 40.0, 0.0)
DIAMETER = 6.0                      # mm
ACCEL = 2000.0                      # mm/s2, as in test.hal
RAPID = 200.0                       # mm/s
CLEARANCE = 2.0                     # mm above the stock
SIDE_Y, BOTTOM = 30.0, -3.0         # mm


def stimulus():
    way = Way((10.0, 10.0, 40.0), motion_type=1, enable=1, tool_diameter=DIAMETER)
    way.box(LOW, HIGH)
    way.phase("define")
    way.stay(2).define(10)
    way.phase("down to the clearance plane")
    way.move((10.0, 10.0, CLEARANCE), RAPID, ACCEL)
    way.phase("across at the clearance plane")
    way.move((20.0, 25.0, CLEARANCE), RAPID, ACCEL)
    way.phase("away")
    way.move((-45.0, SIDE_Y, CLEARANCE), RAPID, ACCEL).move((-45.0, SIDE_Y, BOTTOM), RAPID, ACCEL)
    way.phase("towards the side, braking in front of it")
    way.move((-0.5 * DIAMETER - CLEARANCE, SIDE_Y, BOTTOM), RAPID, ACCEL)
    way.move((-45.0, SIDE_Y, BOTTOM), RAPID, ACCEL)
    way.phase("into the side at full speed")
    way.line((10.0, SIDE_Y, BOTTOM), RAPID)
    way.phase("feed")
    way.set(motion_type=2).line((25.0, SIDE_Y, BOTTOM), 100.0)
    way.phase("back in the finished slot")
    way.set(motion_type=1).move((-10.0, SIDE_Y, BOTTOM), RAPID, ACCEL)
    way.phase("in the slot once more")
    way.move((20.0, SIDE_Y, BOTTOM), RAPID, ACCEL).move((20.0, SIDE_Y, 5.0), RAPID, ACCEL)
    way.phase("end")
    way.stay(10)
    return way
