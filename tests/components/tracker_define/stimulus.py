# SPDX-License-Identifier: GPL-2.0-or-later
"""Stocks one after the other, possible and impossible ones, with a cut in between."""

import math

from support.halrig import ToolPath

DIAMETER, DEPTH, SPEED = 8.0, 2.0, 60.0  # mm, mm, mm/s
BIG = (-150.0, -100.0, -20.0), (150.0, 100.0, 0.0)  # fills the map to the last cell
SMALL = (-30.0, -30.0, -20.0), (30.0, 30.0, 0.0)
PERIODS_TO_FILL = 200
NAN, INF = math.nan, math.inf
IMPOSSIBLE = {  # phase: (fault code, box)
    "nan": (1, ((NAN, -30.0, -20.0), SMALL[1])),
    "infinite": (1, (SMALL[0], (30.0, INF, 0.0))),
    "minus infinite": (1, ((-30.0, -30.0, -INF), SMALL[1])),
    "upside down": (2, ((-30.0, -30.0, 5.0), SMALL[1])),
    "no width": (2, ((30.0, -30.0, -20.0), SMALL[1])),
    "swapped": (2, (SMALL[1], SMALL[0])),
    "a cell too wide": (3, ((-150.0, -100.0, -20.0), (150.3, 100.0, 0.0))),
    "huge": (3, ((-1e300, -1e300, -20.0), (1e300, 1e300, 0.0))),
    "width overflows": (3, ((-1.5e308, -30.0, -20.0), (1.5e308, 30.0, 0.0))),
}


def stimulus():
    path = ToolPath((-20.0, 0.0, 5.0), tool_diameter=DIAMETER, motion_type=2, enable=1)
    path.phase("nothing defined")
    path.box(*BIG).stay(5)
    path.phase("big")
    path.define(PERIODS_TO_FILL)
    path.phase("cut")
    path.line((-20.0, 0.0, -DEPTH), SPEED).line((0.0, 0.0, -DEPTH), SPEED)
    for name, (_code, box) in IMPOSSIBLE.items():
        path.phase(name)
        path.box(*box).define(3)
    path.phase("cut on")  # the old stock is still there
    path.line((20.0, 0.0, -DEPTH), SPEED)
    path.phase("small")
    path.box(*SMALL).define(30)
    path.phase("held")  # a level is one request, not many
    path.line((20.0, 20.0, -DEPTH), SPEED)
    path.set(define=1).stay(30)
    path.phase("cut after held")
    path.line((20.0, 0.0, -DEPTH), SPEED)
    path.phase("twice")  # again while the first is being filled
    path.set(define=0).box(*BIG).stay(1).define(20).define(PERIODS_TO_FILL)
    return path
