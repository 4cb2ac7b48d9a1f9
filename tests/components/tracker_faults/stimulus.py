# SPDX-License-Identifier: GPL-2.0-or-later
"""One trouble after the other, with sound rows in between."""

import math

from support.halrig import ToolPath

NAN, INF = math.nan, math.inf
LOW, HIGH = (0.0, 0.0, -10.0), (60.0, 40.0, 0.0)
TOOL = dict(tool_diameter=6.0, tool_corner_radius=0.0, tool_tip_angle=0.0, tool_flute_length=0.0)
FLUTE = 3.0  # mm

BAD_TOOLS = {  # phase: (fault code, pins)
    "no tool": (11, dict(tool_diameter=0.0)),
    "negative diameter": (11, dict(tool_diameter=-6.0)),
    "diameter NaN": (11, dict(tool_diameter=NAN)),
    "diameter infinite": (11, dict(tool_diameter=INF)),
    "corner too large": (12, dict(tool_corner_radius=3.5)),
    "corner negative": (12, dict(tool_corner_radius=-0.1)),
    "corner NaN": (12, dict(tool_corner_radius=NAN)),
    "angle 180": (13, dict(tool_tip_angle=180.0)),
    "angle 400": (13, dict(tool_tip_angle=400.0)),
    "angle negative": (13, dict(tool_tip_angle=-90.0)),
    "angle NaN": (13, dict(tool_tip_angle=NAN)),
    "flute negative": (14, dict(tool_flute_length=-1.0)),
    "flute NaN": (14, dict(tool_flute_length=NAN)),
}


def bad_tools(path):
    """Each goes 3 mm through the stock with cutting enabled, then the sound tool stays there."""
    for name, (_code, pins) in BAD_TOOLS.items():
        path.phase(name)
        path.set(**dict(TOOL, **pins)).line(path.at + (3.0, 0.0, 0.0), 150.0)
        path.phase("after " + name)
        path.set(enable=0, **TOOL).stay(2)
        path.set(enable=1)
    path.phase("no tool, not cutting")
    path.set(enable=0, tool_diameter=0.0).stay(10)
    path.set(**TOOL)


def bad_positions(path):
    path.phase("jump while not cutting")  # homing, a switched-off machine moved by hand
    path.stay(3).jump((30.0, 20.0, 20.0)).stay(10)
    path.phase("jump")
    path.set(enable=1).stay(3).jump((30.0, 60.0, 20.0)).stay(10)
    path.phase("defined after the jump")
    path.define(30)
    path.phase("no position")
    path.jump((NAN, 60.0, 20.0)).jump((30.0, INF, 20.0)).jump((30.0, 60.0, -1e300))
    path.phase("position back")
    path.jump((30.0, 60.0, 20.0)).stay(10)
    path.phase("defined after no position")
    path.define(30)


def flute(path):
    path.set(motion_type=1, tool_flute_length=FLUTE)
    path.line((30.0, 60.0, -2.9), 300.0)
    path.phase("within the flute")
    path.set(motion_type=2).line((30.0, 30.0, -2.9), 100.0)
    path.line((30.0, 30.0, 5.0), 100.0).line((30.0, 60.0, 5.0), 300.0).line((30.0, 60.0, -4.0), 100.0)
    path.phase("beside the stock, deeper than the flute")
    path.line((50.0, 60.0, -4.0), 100.0)
    path.phase("deeper than the flute")
    path.line((50.0, 30.0, -4.0), 100.0)
    path.phase("out of the stock again")
    path.line((50.0, 30.0, 5.0), 100.0)
    path.set(tool_flute_length=0.0)


def stimulus():
    path = ToolPath((5.0, 5.0, -2.0), motion_type=2, enable=0, **TOOL)
    path.box(LOW, HIGH)
    path.phase("define")
    path.stay(2).define(10)
    path.set(enable=1)
    bad_tools(path)
    bad_positions(path)
    path.phase("path to the flute")
    flute(path)
    path.phase("all clear")
    path.stay(10)
    return path
