"""A slot 17 degrees off the X axis, from 5 mm before the box to its middle, 3 mm deep."""
import math

from halrig import Way

ANGLE = math.radians(17.0)
START = (-10.0, 8.0)        # mm, tip in XY; the tool touches the box 5..6 mm on
LENGTH = 57.0               # mm
DEPTH = 3.0                 # mm
SPEED = 50.0                # mm/s
DIAMETER = 6.0              # mm
LOW, HIGH = (0.0, 0.0, -10.0), (60.0, 40.0, 0.0)


def stimulus(scale=1.0):
    way = Way((*START, -DEPTH), scale, tool_diameter=DIAMETER, motion_type=2, enable=1)
    way.box(LOW, HIGH)
    way.phase("define")
    way.stay(2).define()
    way.phase("cut")
    way.line((START[0] + LENGTH * math.cos(ANGLE), START[1] + LENGTH * math.sin(ANGLE), -DEPTH),
             SPEED)
    way.phase("stand")
    way.stay(120)
    return way
