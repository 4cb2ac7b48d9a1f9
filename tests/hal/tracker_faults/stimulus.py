"""One trouble after the other, with sound rows in between."""
import math

from halrig import Way

NAN, INF = math.nan, math.inf
LOW, HIGH = (0.0, 0.0, -10.0), (60.0, 40.0, 0.0)
TOOL = dict(tool_diameter=6.0, tool_corner_radius=0.0, tool_tip_angle=0.0, tool_flute_length=0.0)
FLUTE = 3.0                         # mm

BAD_TOOLS = {                       # phase: (fault code, pins)
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


def bad_tools(way):
    """Each goes 3 mm through the stock with cutting enabled, then the sound tool stands there."""
    for name, (_code, pins) in BAD_TOOLS.items():
        way.phase(name)
        way.set(**dict(TOOL, **pins)).line(way.at + (3.0, 0.0, 0.0), 150.0)
        way.phase("after " + name)
        way.set(enable=0, **TOOL).stay(2)
        way.set(enable=1)
    way.phase("no tool, not cutting")
    way.set(enable=0, tool_diameter=0.0).stay(10)
    way.set(**TOOL)


def bad_positions(way):
    way.phase("jump while not cutting")             # homing, a switched-off machine moved by hand
    way.stay(3).jump((30.0, 20.0, 20.0)).stay(10)
    way.phase("jump")
    way.set(enable=1).stay(3).jump((30.0, 60.0, 20.0)).stay(10)
    way.phase("defined after the jump")
    way.define(30)
    way.phase("no position")
    way.jump((NAN, 60.0, 20.0)).jump((30.0, INF, 20.0)).jump((30.0, 60.0, -1e300))
    way.phase("position back")
    way.jump((30.0, 60.0, 20.0)).stay(10)
    way.phase("defined after no position")
    way.define(30)


def flute(way):
    way.set(motion_type=1, tool_flute_length=FLUTE)
    way.line((30.0, 60.0, -2.9), 300.0)
    way.phase("within the flute")
    way.set(motion_type=2).line((30.0, 30.0, -2.9), 100.0)
    way.line((30.0, 30.0, 5.0), 100.0).line((30.0, 60.0, 5.0), 300.0).line((30.0, 60.0, -4.0), 100.0)
    way.phase("beside the stock, deeper than the flute")
    way.line((50.0, 60.0, -4.0), 100.0)
    way.phase("deeper than the flute")
    way.line((50.0, 30.0, -4.0), 100.0)
    way.phase("out of the stock again")
    way.line((50.0, 30.0, 5.0), 100.0)
    way.set(tool_flute_length=0.0)


def stimulus():
    way = Way((5.0, 5.0, -2.0), motion_type=2, enable=0, **TOOL)
    way.box(LOW, HIGH)
    way.phase("define")
    way.stay(2).define(10)
    way.set(enable=1)
    bad_tools(way)
    bad_positions(way)
    way.phase("way to the flute")
    flute(way)
    way.phase("all clear")
    way.stay(10)
    return way
