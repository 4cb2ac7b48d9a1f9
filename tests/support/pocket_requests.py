# SPDX-License-Identifier: GPL-2.0-or-later
"""Plain requests of G79, the cycle's motion and the oracle's verdict on it.  Called by tests/cycles/test_pocket*.py and
tests/oracles/test_pocket_oracle.py."""

from support import hole_oracle as trace
from support import pocket_oracle as oracle
from chipwise.cycles import pocket as cycle
from support.pocket_judge import case_of
from support.pocket_random import rectangle

BOX = rectangle(0, 0, 60, 40)


def request(loops=(BOX,), **changes):
    """A plain request: tool 6 mm, D 2.4, 4 mm deep in one level."""
    given = dict(
        bottom=-4.0, clearance=1.0, tool_radius=3.0, step=2.4, feed=600.0, plunge_feed=200.0, start=(0.0, 0.0, 10.0)
    )
    return cycle.PocketRequest(loops=tuple(loops), **{**given, **changes})


def walked(asked):
    return trace.walk(cycle.pocket_plan(asked).moves, asked.start)


def faults(asked, moves=None, plunges=None):
    """The oracle's verdict, on the cycle's own moves or others."""
    plan = cycle.pocket_plan(asked)
    return oracle.judge(
        case_of(asked),
        trace.walk(plan.moves if moves is None else moves, asked.start),
        asked.ramp_angle,
        cycle.GAP_MM,
        plan.plunges if plunges is None else plunges,
    )
