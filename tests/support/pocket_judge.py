# SPDX-License-Identifier: GPL-2.0-or-later
"""The verdict on one random pocket, shared by test_pocket.py and bench/pocket_bench.py.

By itself it judges one case again:  tools/judge pocket SEED STRATEGY
"""

import sys
from dataclasses import replace

import numpy as np

from support import hole_oracle as trace
from support import pocket_oracle as oracle
from chipwise.cycles import pocket as cycle
from chipwise.errors import CycleError
from support.pocket_random import random_pocket

# Step-overs, as shares of the tool's diameter, that the random cases go through.
SHARES = (0.4, 0.7, 1.0, 0.25, 0.5, 0.9)


def random_request(seed, strategy):
    """A PocketRequest."""
    rng = np.random.default_rng([seed, 6])
    kind, loops = random_pocket(seed)
    radius = float(
        rng.choice([1.5, 2.0, 3.0, 5.0]) if kind == "grid" else np.exp(rng.uniform(np.log(1.2), np.log(6.0)))
    )
    depth = float(rng.uniform(2.0, 6.0))
    return cycle.PocketRequest(
        loops=loops,
        bottom=-depth,
        clearance=1.0,
        tool_radius=radius,
        step=SHARES[seed % len(SHARES)] * 2 * radius,
        feed=600.0,
        plunge_feed=200.0,
        start=(0.0, 0.0, 10.0),
        side_allowance=float(rng.choice([0.0, 0.0, 0.3])),
        floor_allowance=float(rng.choice([0.0, 0.0, 0.2])),
        strategy=strategy,
        direction=float(rng.integers(-90, 180)),
        climb=bool(rng.random() < 0.7),
        depth_step=None if rng.random() < 0.6 else depth * 0.55,
        ramp_angle=float(rng.choice([3.0, 5.0, 20.0])),
    )


def case_of(request):
    """The oracle's view of a request."""
    return oracle.Case(
        [oracle.shape_of(loop) for loop in request.loops],
        request.tool_radius,
        request.tool_radius + request.side_allowance,
        request.bottom + request.floor_allowance,
        request.clearance,
    )


def verdict(request, seed=0, count=6000):
    """(list of faults, plan or None)."""
    case = case_of(request)
    try:
        plan = cycle.pocket_plan(request)
    except CycleError as error:
        if "fits nowhere" in str(error):
            rng = np.random.default_rng(seed)
            return (["refused, but the tool fits"] if any(map(len, oracle.centres(case, rng, 4000))) else []), None
        return [f"refused: {error}"], None
    except Exception as error:  # any alarm is a finding
        return [f"alarm: {error!r}"], None
    moves = trace.walk(plan.moves, request.start)
    return oracle.judge(case, moves, request.ramp_angle, cycle.GAP_MM, plan.plunges, seed, count), plan


def shrunk_names(found):
    """Faults without their figures, to count them."""
    return [text.split(" ")[0] for text in found]


if __name__ == "__main__":
    asked = random_request(int(sys.argv[1]), int(sys.argv[2]))
    print(replace(asked, loops=len(asked.loops)))
    print(verdict(asked, int(sys.argv[1])))
