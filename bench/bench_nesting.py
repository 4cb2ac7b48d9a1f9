# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 of random drawings of loops within loops: how many of them are cut as drawn, by areas.

Called by bench/run.py in a small size (prints JSON rows).  In full:

    /usr/bin/python3 bench/bench_nesting.py --count 300 --jobs 2

Drawings and judge: tests/support/nesting_random.py.  Tool 0.8 mm, D 0.5 (P4: 3 mm, D 1.1), 1 mm deep in one level.  A
drawing that is refused or that breaks the plan is a fault, too, and each fault is printed with its seed.
"""

import argparse
import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor

from roots import ROOT  # noqa: F401  the path to chipwise
from chipwise.cycles import pocket as cycle
from rows import row
from support.nesting_random import GAP, GOUGE_MM, REST_MM, SHARE, drawing, judge_drawing
from support.pocket_requests import request


def judged(asked):
    """(seed, Verdict or the text of an error) of one drawing with one strategy."""
    seed, strategy = asked
    chains = drawing(seed)[0]
    radius, step = (1.5, 1.1) if strategy == 4 else (0.4, 0.5)
    given = request(
        chains, tool_radius=radius, step=step, bottom=-1.0, strategy=strategy, direction=20.0, close_gap=GAP
    )
    try:
        return seed, judge_drawing(cycle.pocket_plan(given).moves, given, seed)
    except Exception as error:  # any alarm is a finding
        return seed, repr(error)


def rows_of(strategy, first, count, pool):
    """Rows of one strategy."""
    ran, faults, worst = 0, 0, [0.0] * 4
    for seed, found in pool.map(judged, [(seed, strategy) for seed in range(first, first + count)], chunksize=2):
        ran += 1
        if isinstance(found, str):
            wrong = True
        else:
            wrong = not found.right
            worst = [max(pair) for pair in zip(worst, found)]
        if wrong:
            faults += 1
            print(f"seed {seed} P{strategy}: {found}", file=sys.stderr, flush=True)
    yield row(f"nestings, P{strategy}: faults", faults, "", f"{ran} drawings from seed {first} on", 0)
    yield row(f"nestings, P{strategy}: deepest gouge", round(worst[2], 5), "mm", f"{ran} drawings", GOUGE_MM)
    yield row(f"nestings, P{strategy}: widest rest, half", round(worst[3], 5), "mm", f"{ran} drawings", REST_MM)
    yield row(
        f"nestings, P{strategy}: area left or cut beyond",
        round(max(worst[:2]), 6),
        "of the area",
        f"{ran} drawings",
        SHARE,
    )


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=int(os.environ.get("CHIPWISE_RANDOM_COUNT") or 6))
    parser.add_argument("--seed", type=int, default=int(os.environ.get("CHIPWISE_SEED") or 7134))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--strategies", default="0,1,2,3,4")
    given = parser.parse_args()
    with ProcessPoolExecutor(given.jobs) as pool:
        for strategy in given.strategies.split(","):
            for one in rows_of(int(strategy), given.seed, given.count, pool):
                print(json.dumps(one), flush=True)


if __name__ == "__main__":
    main()
