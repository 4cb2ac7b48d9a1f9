# SPDX-License-Identifier: GPL-2.0-or-later
"""Twenty CAM styles under feed overrides of 50 to 120 %, on the real LinuxCNC: peak of the removal rate in 10 ms.

Called by bench/run.py (prints JSON rows, of three programs); by hand with --table: `/usr/bin/python3
bench/bench_styles.py --table --only peel_arcs --overrides 0.5`.

 1. A program of tests/support/foreign_styles.py runs as written, with the operator's override set before it starts.
 2. tests/support/judge.py says from the servo-rate log, the blank and the tool alone what was removed in every window
    of 10 ms in which only feeds run.  The target is Q times the override.
 3. The judge's section areas are CELL of travel apart: at half the feed a slow tool goes 0.01 mm in 10 ms, and with the
    judge's usual 0.04 mm a contact came up to 0.02 mm early (109 % in place of 101 %).
 4. A run in which servo periods were lost is repeated, at most RUNS times, then void.
"""

import argparse
import json
import tempfile
from pathlib import Path

import roots  # noqa: F401  puts tests/ and remap/ on the path
from rows import row
from support import claims, foreign_styles
from support.claims import Condition

SEED = "40"
OVERRIDES = (0.5, 0.8, 1.0, 1.2)
PEAK = 102.0
SHORT = ("smooth_lace", "small_bends", "corner_rest")  # what bench/run.py runs
RUNS = 3
CELL = 0.01  # mm


def measured(program, override, keep):
    """claims.measure() of a run without lost servo periods, or of the last of RUNS."""
    for _ in range(RUNS):
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(keep or scratch) / f"{program.name}-{100 * override:g}"
            folder.mkdir(parents=True, exist_ok=True)
            found = claims.measure(program, Condition(override=override), folder, cell=CELL)[0]
        if not found["lost"]:
            break
    return found


def rows_of(f):
    """The rows of one run for build/bench.json."""
    name = f"{f['program']}, {f['condition']}"
    if f["lost"]:
        return [row(f"{name}: servo periods lost, void", f["lost"], "")]
    place = f["worst"]
    return [
        row(
            f"{name}: peak rate, 10 ms",
            round(100 * f["peak_10ms"], 2),
            "%",
            target=PEAK,
            note=f"line {place[1]} at X{place[2]} Y{place[3]} Z{place[4]}" if place else "",
        ),
        row(f"{name}: volume, tracker less judge", round(100 * f["volume_off"], 3), "%"),
        row(f"{name}: operator errors", len(f["errors"]), "", target=0, note="; ".join(f["errors"])[:200]),
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", default=[], help="programs")
    parser.add_argument("--seed", default=SEED)
    parser.add_argument("--overrides", nargs="*", type=float, default=OVERRIDES)
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--keep", help="folder for programs and logs")
    options = parser.parse_args()
    options.only = options.only or ([] if options.table else SHORT)
    if options.table:
        print(claims.HEAD, flush=True)
    for name, program in foreign_styles.programs(options.seed).items():
        if options.only and name not in options.only:
            continue
        for override in options.overrides:
            found = measured(program, override, options.keep)
            if not options.table:
                for made in rows_of(found):
                    print(json.dumps(made), flush=True)
                continue
            print(claims.line_of(found), flush=True)
            for error in found["errors"]:
                print("    " + error, flush=True)
            for place in found["places"][:3]:
                print("    %.3f for %g ms, line %d at X%g Y%g Z%g" % tuple(place), flush=True)


if __name__ == "__main__":
    main()
