# SPDX-License-Identifier: GPL-2.0-or-later
"""What the tuned constants of the load and of the feed are worth: the core is built with each of them smaller and
larger, and commands the feed of random cuts (tests/support/closed_loop.c).

Called by hand: bench_constants.py [--count N] [--seed S] [--only NAME ...] prints a Markdown table, the rows of
docs/design/constants.md.  A scene takes about three seconds of computing, so the whole table takes an hour.
"""

import argparse
import concurrent.futures
import re
import sys
import tempfile
from pathlib import Path

import roots  # noqa: F401  sys.path
from support import closed_loop

JOBS = 2
# Constant of components/core: smaller and larger value to try.
TUNED = {
    "CHIP_SPACING_RADII": (0.03125, 0.125),
    "CHIP_TURN_STEP": (0.17, 0.7),
    "CHIP_TIGHT_TURN": (1.0, 4.0),
    "CHIP_PASSED_TURN": (0.17, 0.7),
    "CHIP_SAME_DIRECTION": (0.7, 0.99),
    "CHIP_CLOSEST": (0.12, 0.5),
    "CHIP_LATE_FALL": (0.5, 2.0),
    "CHIP_CLEAR_BACK": (0, 4),
    "CHIP_LOAD_JUMP": (0.07, 0.3),
    "CHIP_SLOPE_CHANGE": (0.012, 0.05),
    "CHIP_MIN_CHANGE": (0.005, 0.02),
    "CHIP_LATE_RISE": (0.25, 1.0),
    "CHIP_LATE_STEEP": (0.5, 2.0),
    "CHIP_STEEP_RISE": (0.14, 0.56),
    "CHIP_LATE_AT_ONCE": (0.25, 1.0),
    "CHIP_AT_ONCE": (0.22, 0.9),
    "CHIP_STEP_WIDTH": (1.2, 5.0),
    "CHIP_TRAILING": (0.25, 1.0),
    "CHIP_WIDTH_ERROR": (0.16, 0.66),
    "CHIP_PEAK": (0.0, 2.0),
    "CHIP_BENT_RISE": (1.0, 4.0),
    "CHIP_BEND": (0.25, 1.0),
    "CHIP_SMOOTHED_PEAK": (0.0, 2.0),
    "CHIP_DIP": (0.0, 1.0),
    "CHIP_CLEAR": (0.75, 3.0),
    "CHIP_TOGETHER": (0.01, 2.0),
    "CHIP_EDGE_CELLS": (0.75, 3.0),
    "CHIP_PARTLY_COVERED": (2.0, 8.0),
    "CHIP_WALL_HALF": (0.25, 1.0),
    "CHIP_CLEAR_WALL": (0.25, 1.0),
    "CHIP_ALONG": (0.5, 0.9),
    "CHIP_SAME_LEVEL": (0.01, 0.05),
    "CHIP_WALL_JUMP": (0.01, 0.1),
    "CHIP_NARROW_BAND": (0.3, 0.95),
    "CHIP_NODE_CELLS": (1.0, 4.0),
    "CHIP_REFINE": (0, 6),
    "CHIP_JUMP": (0.1, 0.4),
    "CHIP_BACK_CELLS": (0.0, 3.0),
    "CHIP_MERGE_DEVIATION": (1e-4, 1e-2),
    "CHIP_SMOOTH_CORNER": (0.005, 0.1),
    "CHIP_BEND_BEGINS": (0.01, 0.3),
    "CHIP_LATENCY": (0.0, 4.0),
    "CHIP_MARGIN_PERIODS": (1.0, 16.0),
    "CHIP_WORK_PARTS": (1, 6),
    "CHIP_SAME_LOAD": (1.05, 2.0),
    "CHIP_CATCH_UP_FROM": (0.9, 0.999),
}


def found(name):
    """-> (value, file) of a constant as it stands."""
    for path in sorted(closed_loop.CORE.glob("*.[ch]")):
        match = re.search(rf"^#define {name}\s+(\S+)", path.read_text(), flags=re.M)
        if match:
            return match.group(1), path.name
    raise KeyError(name)


def judged(constants, first, count):
    """-> [Scene] with these constants."""
    with tempfile.TemporaryDirectory(prefix="chipwise-constants.") as folder:
        return closed_loop.run(closed_loop.build(Path(folder), constants=constants), first, count)


def summary(scenes, base):
    """Peak, share of the time above 102 %, time and worst volume error, as text; the time against the core as it is."""
    seconds = sum(scene.seconds for scene in scenes) / sum(scene.seconds for scene in base)
    over = sum(scene.over * scene.seconds for scene in scenes) / sum(scene.seconds for scene in scenes)
    text = f"{100 * max(scene.peak for scene in scenes):.1f}"
    if over:
        text += f" ({100 * over:.2f} % of the time)"
    text += f", time {seconds:.4f}"
    volume = max(abs(scene.volume - 1) for scene in scenes)
    return text if volume < 0.002 else text + f", volume off by {100 * volume:.2f} %"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument(
        "--count", type=int, default=10, metavar="N", help="scenes for each value (default %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=101, metavar="S", help="of the first scene (default %(default)s)")
    parser.add_argument(
        "--only", nargs="+", choices=TUNED, metavar="NAME", default=list(TUNED), help="these constants only"
    )
    chosen = parser.parse_args()
    with concurrent.futures.ThreadPoolExecutor(JOBS) as pool:
        base = judged({}, chosen.seed, chosen.count)
        print(f"As it is: {summary(base, base)}", flush=True)
        print("\n| constant | value | smaller: peak, % | larger: peak, % |\n|---|---|---|---|", flush=True)
        results = {
            name: [pool.submit(judged, {name: value}, chosen.seed, chosen.count) for value in TUNED[name]]
            for name in chosen.only
        }
        for name, (smaller, larger) in results.items():
            low, high = TUNED[name]
            value, file = found(name)
            cells = [
                "no difference" if scenes == base else summary(scenes, base)
                for scenes in (smaller.result(), larger.result())
            ]
            print(f"| `{name}` ({file}) | {value} | {low:g}: {cells[0]} | {high:g}: {cells[1]} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
