#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC's own cutter compensation (G41.1, G42.1) on the random contours of the geometry tests, beside ours.

Called by bench/run.py (prints JSON rows) and by hand:

    /usr/bin/python3 bench/bench_compensation.py [--count 5000] [--jobs 2] [--table]

CHIPWISE_RANDOM_COUNT contours of each kind (default 100) from CHIPWISE_SEED on, both sides of each.  Counted are the
cases in which a path exists: if the tool fits nowhere, an alarm is the right answer.

How LinuxCNC gets its fair chance: every case is a program of its own for the real interpreter (`rs274 -g`, own HOME,
G41.1 D in program units, so that no tool table and no machine unit come into it).  The program starts in the middle
of the longest straight piece that the tool can touch (an arc where there is no straight one), so that no corner
stands at the seam; the entry move is longer than the tool radius and tangent to the contour there, and so is the
exit: neither can meet a corner.  Both would be run in the air and are not judged, only what is cut between them.

Its centre path, as the interpreter hands it to the machine, and ours are judged by the same oracle, written apart
from the kernel (tests/support/contour_oracle.py): the depth of the tool in the finish shape.  rs274 prints four
decimals of a mm, so a gouge counts from 0.001 mm.
"""

import argparse
import collections
import json
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path


import roots  # noqa: F401  sys.path
from support.compensation import judge_case
from chipwise.geometry.offset.kernel import LEFT, RIGHT
from support.contour_judge import count_from_environment, seed_from_environment

KINDS = {
    "filleted": "filleted polygons, tool 0.2 .. 2.5 x smallest fillet",
    "bulged": "line/arc polygons, tool 0.3 .. 10 mm",
}


def judge_range(job):
    """Cases first..last-1 of one kind: (counts, worst depths, alarms, [gouged seeds])."""
    kind, first, last = job
    counts, worst, alarms, gouged = collections.Counter(), {"ours": 0.0, "theirs": 0.0}, collections.Counter(), []
    with tempfile.TemporaryDirectory(prefix="chipwise-bench.") as folder:
        (Path(folder) / "case.var").write_text("5161 0\n")
        for seed in range(first, last):
            for side in (LEFT, RIGHT):
                one, depth, said = judge_case(seed, kind, side, folder)
                counts, alarms = counts + one, alarms + collections.Counter(said)
                gouged += [(seed, side, depth["theirs"])] if one["gouges"] else []
                worst = {who: max(worst[who], depth.get(who, 0.0)) for who in worst}
    return counts, worst, alarms, gouged


def measure(kind, count, jobs):
    """The figures of one kind as a dictionary."""
    first = seed_from_environment()
    ranges = [(kind, k, min(k + 25, first + count)) for k in range(first, first + count, 25)]
    with ProcessPoolExecutor(jobs) as pool:
        found = list(pool.map(judge_range, ranges))
    counts = sum((row[0] for row in found), collections.Counter())
    return {
        "contours": count,
        "first": first,
        "counts": dict(counts),
        "worst": {who: max(row[1][who] for row in found) for who in ("ours", "theirs")},
        "alarms": dict(sum((row[2] for row in found), collections.Counter()).most_common()),
        "gouged": sorted((g for row in found for g in row[3]), key=lambda g: -g[2]),
    }


def rows(kind, made):
    """The figures as rows of the bench."""
    counts, possible = collections.Counter(made["counts"]), made["counts"].get("possible", 0)
    share = 100.0 / max(possible, 1)

    def row(name, value, unit, note=""):
        return {"name": f"{KINDS[kind]}: {name}", "value": value, "unit": unit, "note": note}

    yield row(
        "cases with a path",
        possible,
        "",
        f"of {counts['cases']}, {made['contours']} contours from {made['first']} on, both sides",
    )
    yield row("chipwise, alarms", counts["our alarms"], "", "target 0")
    yield row("chipwise, gouges", counts["our gouges"], "", f"target 0; deepest {made['worst']['ours']:.2g} mm")
    yield row(
        "chipwise, wrong verdicts", counts["our wrong verdicts"], "", "gouge, lost path or false region; target 0"
    )
    yield row(
        "LinuxCNC, alarms",
        round(share * counts["alarms"], 2),
        "%",
        f"{counts['alarms']} cases; {counts['alarms, one path']} of the {counts['one path']} with a single path",
    )
    yield row(
        "LinuxCNC, silent gouges",
        round(share * counts["gouges"], 2),
        "%",
        f"{counts['gouges']} cases, deepest {made['worst']['theirs']:.3f} mm; {counts['gouges, one path']} of "
        f"the {counts['one path']} with a single path",
    )
    yield row("LinuxCNC, neither", round(share * counts["right"], 2), "%", f"{counts['right']} cases")
    for text, number in made["alarms"].items():
        yield row("LinuxCNC says", number, "x", text)


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--count", type=int, default=count_from_environment(100), help="contours of each kind")
    arguments.add_argument("--jobs", type=int, default=2, help="processes at once")
    arguments.add_argument("--table", action="store_true", help="print a table instead of JSON rows")
    arguments.add_argument("--output", help="JSON file for all figures, gouged cases included")
    given = arguments.parse_args()
    made = {kind: measure(kind, given.count, given.jobs) for kind in KINDS}
    for kind, figures in made.items():
        for row in rows(kind, figures):
            print(
                f"{row['name']:86} {row['value']:>10g} {row['unit']:2} {row['note']}"
                if given.table
                else json.dumps(row)
            )
    if given.output:
        Path(given.output).write_text(json.dumps(made, indent=1))


if __name__ == "__main__":
    main()
