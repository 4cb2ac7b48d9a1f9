"""What cuts and what does not: enable, tool offset, plunge, retract, traverse."""
from halrig import Way

DIAMETER = 6.0                                      # mm
DEPTH = 4.0                                         # mm
SPEED = 60.0                                        # mm/s
LOW, HIGH = (10.0, -20.0, -110.0), (70.0, 20.0, -100.0)
TOP = HIGH[2]
OFFSET = (3.5, -2.25, 42.0)                         # mm, the axes are this far from the tip


def stimulus():
    way = Way((15.0, -14.0, TOP + 5.0), tool_diameter=DIAMETER, motion_type=2, enable=0)
    way.box(LOW, HIGH).offset(*OFFSET)
    way.phase("define")
    way.stay(2).define()
    bottom = TOP - DEPTH

    way.phase("disabled")                           # down and across, nothing is cut
    way.line((15.0, -14.0, bottom), SPEED).line((30.0, -14.0, bottom), SPEED)
    way.phase("enabled in the middle")              # cuts from here on, not the way made before
    way.set(enable=1).line((45.0, -14.0, bottom), SPEED)
    way.phase("disabled again")
    way.set(enable=0).line((60.0, -14.0, bottom), SPEED)
    way.line((60.0, -14.0, TOP + 2.0), SPEED).line((20.0, 0.0, TOP + 2.0), 4 * SPEED)

    way.phase("plunge")
    way.set(enable=1).line((20.0, 0.0, bottom), SPEED)
    way.phase("retract")
    way.line((20.0, 0.0, TOP + 2.0), SPEED)
    way.phase("traverse above")
    way.set(motion_type=1).line((50.0, 12.0, TOP + 2.0), 4 * SPEED)
    way.phase("traverse touches nothing at the top")
    way.line((50.0, 12.0, TOP), SPEED).line((30.0, 12.0, TOP), SPEED)
    way.phase("plunge slanted")
    way.set(motion_type=2).line((50.0, 12.0, bottom), SPEED)
    way.phase("same way back")                      # levels the ramp
    way.line((30.0, 12.0, bottom), SPEED)
    way.phase("once more")
    way.line((50.0, 12.0, bottom), SPEED)
    way.phase("end")
    way.stay(30)
    return way
