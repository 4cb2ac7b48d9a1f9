# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 of pockets drawn in very many elements: computing time and memory of a plan over the number of elements.

Called by bench/run.py in a small size (prints JSON rows).  In full:

    /usr/bin/python3 bench/bench_pocket_size.py --sizes 500,1000,2000,5000,20000

Each plan is made in a process of its own: its computing time, and the most memory that the process has had, numpy and
shapely included.  Tool 6 mm, D 2.4.  The shapes: tests/support/large_outlines.py.
"""

import argparse
import json
import resource
import subprocess
import sys
import time

import roots  # noqa: F401  the path to chipwise
from chipwise.cycles import pocket as cycle
from support.large_outlines import outline
from rows import row

TARGETS = {5000: (3.0, 200.0), 20000: (15.0, 600.0)}  # s, MB


def measure(kind, count, strategy):
    """[s of computing time, MB, moves] of the plan in this process."""
    request = cycle.PocketRequest(
        loops=(outline(kind, count),),
        bottom=-4.0,
        clearance=1.0,
        tool_radius=3.0,
        step=2.4,
        feed=600.0,
        plunge_feed=200.0,
        start=(0.0, 0.0, 5.0),
        strategy=strategy,
        most_moves=1_000_000,
    )
    begun = time.process_time()
    moves = len(cycle.pocket_plan(request).moves)
    return [time.process_time() - begun, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, moves]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--sizes", default="500,1000,2000")
    parser.add_argument("--strategies", default="0")
    parser.add_argument("--shapes", default="curve,lobes,coast")
    parser.add_argument("--one", nargs=3, metavar=("SHAPE", "SIZE", "P"), help="print [s, MB, moves] of one plan")
    given = parser.parse_args()
    if given.one:
        kind, count, strategy = given.one
        print(json.dumps(measure(kind, int(count), int(strategy))))
        return
    for strategy in given.strategies.split(","):
        for kind in given.shapes.split(","):
            for size in given.sizes.split(","):
                made = subprocess.run(
                    [sys.executable, __file__, "--one", kind, size, strategy], stdout=subprocess.PIPE, check=True
                )
                seconds, megabytes, moves = json.loads(made.stdout)
                time_most, memory_most = TARGETS.get(int(size), (None, None))
                name = f"plan of {size} elements, P{strategy}, {kind}"
                print(json.dumps(row(f"{name}: time", round(seconds, 2), "s", f"{moves} moves", time_most)), flush=True)
                print(json.dumps(row(f"{name}: memory", round(megabytes), "MB", "", memory_most)), flush=True)


if __name__ == "__main__":
    main()
