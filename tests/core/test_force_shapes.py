# SPDX-License-Identifier: GPL-2.0-or-later
"""Ball, bull nose and cones whose feed the core commands by the side force, judged edge by edge in an exact stock
(support/judge_force.py)."""

import numpy as np
import pytest

from chipwise.clib import core
from support import judge_force
from support.judge import Blank, Run, Tool, ball
from support.tooth_oracle import ANGLES, Drive, Limits, Plane

PEAK, REACHED = 1.02, 0.96  # of the limit: the largest of a turn; and what is used of it where nothing else limits
FORCE = 120.0  # N: about half of that of the ceiling
BOX = Blank.corners((-60.0, -60.0, -12.0), (60.0, 60.0, 0.0))
EDGES = 2


class Places(Plane):
    """Notes where the tool has been asked for."""

    def __init__(self):
        super().__init__()
        self.tips = []

    def met(self, at, heading, radius, z):
        self.tips.append(tuple(at))
        return np.zeros(len(ANGLES))


def driven(tool, passes, told=EDGES):
    """Shares of FORCE, an array for each of the passes [(first, last) mm].  told: number of edges that the core is
    given."""
    places, limits = Places(), Limits(force=FORCE, flutes=told)
    drive = Drive(places, tool.diameter, 0.0, limits)
    drive.tool = core.Tool(tool.diameter, tool.corner, tool.angle)
    number, kind, at = [], [], []
    for k, (first, last) in enumerate(passes):
        before = len(places.tips)
        drive.go([core.line(first, last)])
        cut = places.tips[before:]
        at += [(*first[:2], 5.0), first, *cut, (*cut[-1][:2], 5.0)]
        number += [k] * (len(cut) + 3)
        kind += [1, 1] + [2] * len(cut) + [1]
    at = np.array(at)
    run = Run(
        {
            "sample": np.arange(len(at)),
            "x": at[:, 0],
            "y": at[:, 1],
            "z": at[:, 2],
            "tool_offset_z": np.zeros(len(at)),
            "motion_type": np.array(kind),
            "line": np.array(number),
            "period": 0.001,
            "units_per_mm": 1.0,
        }
    )
    met = judge_force.side_force(
        run, BOX, [tool], [EDGES], np.full(len(at), limits.rps), limits.kc11, limits.mc, step=0.2
    )
    return [met[run.feeding & (run.line == k)] / FORCE for k in range(len(passes))]


@pytest.mark.parametrize(
    "seed, tool", enumerate([ball(6.0), Tool(10.0, 2.0), Tool(12.0, 0.0, 60.0), Tool(6.0, 0.5, 20.0)])
)
def test_slot_and_pass(seed, tool):
    """From air into a slot, and into a pass beside it; held and used.  With one edge more in the core the tool is too
    fast, and it is seen."""
    rng = np.random.default_rng(seed)
    depth, beside = -rng.uniform(2.0, 3.0), rng.uniform(0.3, 0.6) * tool.diameter
    print(f"seed {seed}: depth {depth:.3f} mm, beside {beside:.3f} mm")
    slot = (-61.0 - 0.5 * tool.diameter, 0.0, depth), (-54.0, 0.0, depth)
    for load in driven(tool, [slot, tuple((x, beside, z) for x, _y, z in slot)]):
        assert load.max() < PEAK and np.median(load[load > 0.5]) > REACHED, (load.max(), np.median(load[load > 0.5]))
    if seed == 0:
        assert driven(tool, [slot], EDGES + 1)[0].max() > 1.2
