# SPDX-License-Identifier: GPL-2.0-or-later
"""What cuts and what does not: enable, tool offset, plunge, retract, traverse."""

from support.halrig import ToolPath

DIAMETER = 6.0  # mm
DEPTH = 4.0  # mm
SPEED = 60.0  # mm/s
LOW, HIGH = (10.0, -20.0, -110.0), (70.0, 20.0, -100.0)
TOP = HIGH[2]
OFFSET = (3.5, -2.25, 42.0)  # mm, the axes are this far from the tip


def stimulus():
    path = ToolPath((15.0, -14.0, TOP + 5.0), tool_diameter=DIAMETER, motion_type=2, enable=0)
    path.box(LOW, HIGH).offset(*OFFSET)
    path.phase("define")
    path.stay(2).define()
    bottom = TOP - DEPTH

    path.phase("disabled")  # down and across, nothing is cut
    path.line((15.0, -14.0, bottom), SPEED).line((30.0, -14.0, bottom), SPEED)
    path.phase("enabled in the middle")  # cuts from here on, not the path made before
    path.set(enable=1).line((45.0, -14.0, bottom), SPEED)
    path.phase("disabled again")
    path.set(enable=0).line((60.0, -14.0, bottom), SPEED)
    path.line((60.0, -14.0, TOP + 2.0), SPEED).line((20.0, 0.0, TOP + 2.0), 4 * SPEED)

    path.phase("plunge")
    path.set(enable=1).line((20.0, 0.0, bottom), SPEED)
    path.phase("retract")
    path.line((20.0, 0.0, TOP + 2.0), SPEED)
    path.phase("traverse above")
    path.set(motion_type=1).line((50.0, 12.0, TOP + 2.0), 4 * SPEED)
    path.phase("traverse touches nothing at the top")
    path.line((50.0, 12.0, TOP), SPEED).line((30.0, 12.0, TOP), SPEED)
    path.phase("plunge slanted")
    path.set(motion_type=2).line((50.0, 12.0, bottom), SPEED)
    path.phase("same way back")  # levels the ramp
    path.line((30.0, 12.0, bottom), SPEED)
    path.phase("once more")
    path.line((50.0, 12.0, bottom), SPEED)
    path.phase("end")
    path.stay(30)
    return path
