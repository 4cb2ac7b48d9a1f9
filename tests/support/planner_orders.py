# SPDX-License-Identifier: GPL-2.0-or-later
"""Orders for the planner's tests, from a hole of a few moves to one that takes minutes.  Called by test_planner.py."""

from chipwise.order import Order

SQUARE = "o100 sub\nG0 X0 Y0\nG1 X50\nG1 Y30\nG1 X0\nG1 Y0\no100 endsub\nM2\n"
HOLE = dict(
    x=0.0,
    y=0.0,
    bottom=-10.0,
    clearance=0.0,
    radius=20.0,
    ccw=True,
    tool_radius=3.0,
    feed=300.0,
    plunge_feed=150.0,
    start=(0.0, 0.0, 5.0),
)
CUT = dict(
    side=41,
    tool_radius=3.0,
    bottom=-10.0,
    clearance=0.0,
    feed=300.0,
    plunge_feed=150.0,
    start=(0.0, 0.0, 5.0),
    finish=False,
)
# More than a minute of computing; some 6 to 9 s of it, on any machine more than planner.LEASE_S; 1,715,000 moves, some
# 400 MB.
LONG = dict(HOLE, radius=1000.0, tool_radius=0.5, chop_size=1.2)
SECONDS = dict(HOLE, radius=400.0, tool_radius=0.5, chop_size=1.2)
LARGE = dict(HOLE, radius=6.0, finished=100.0, step=0.11, depth_step=0.01, most_moves=10**7)


def order(cycle="hole", fields=HOLE, job=None, memory_mb=1024, unit_mm=1.0):
    return Order(
        cycle=cycle,
        code="G00",
        fields=fields,
        unit="mm",
        unit_mm=unit_mm,
        start=(0.0, 0.0, 5.0),
        memory_mb=memory_mb,
        job=job,
    )
