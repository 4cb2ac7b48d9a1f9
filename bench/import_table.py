#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise import against drawings in the manner of five CAD programs: bench/import_table.py [COUNT].  Prints a table.

Each drawing is right if its pockets are as many as were drawn and each has the area within 0.1 %; it is said if import
refuses it or names what is open.  What is neither is wrong.
"""

import sys
import tempfile
import time
from collections import defaultdict

import roots  # noqa: F401
from drawings_cad import MANNERS, drawing

from chipwise.errors import CycleError
from chipwise.importing.run import imported

SHARE = 1e-3


def judge(path, areas):
    """(right, said or wrong; largest error of an area as a share)."""
    try:
        found = imported(path, 0.01, 1.0)
    except CycleError:
        return "said", 0.0
    got = sorted((area for layer in found.layers for area in layer.areas), reverse=True)
    if len(got) == len(areas):
        worst = max(abs(a - b) / b for a, b in zip(got, areas))
        if worst <= SHARE:
            return "right", worst
    return ("said" if found.doubtful else "wrong"), 0.0


def tabled(manners, make, judged, seeds, suffix):
    """Prints a row for each manner of drawings, and each drawing that is not right; -> how many are wrong.

    make(seed, path) -> (manner, areas) writes a drawing; judged(path, areas) -> (right, said or wrong; largest error of
    an area; words)
    """
    rows = defaultdict(lambda: {"right": 0, "said": 0, "wrong": 0, "error": 0.0, "time": 0.0})
    with tempfile.TemporaryDirectory() as folder:
        for seed in seeds:
            path = f"{folder}/{seed}{suffix}"
            manner, areas = make(seed, path)
            before = time.process_time()
            verdict, error, words = judged(path, areas)
            row = rows[manner]
            row[verdict] += 1
            row["error"], row["time"] = max(row["error"], error), max(row["time"], time.process_time() - before)
            if verdict != "right":
                print(f"seed {seed}, {manner}: {verdict} {words}".rstrip(), file=sys.stderr)
    print(
        "| manner | right | said | wrong | largest error of an area | longest, with its judge, s |\n"
        "|---|---|---|---|---|---|"
    )
    for manner in manners:
        row = rows[manner]
        print(
            f"| {manner} | {row['right']} | {row['said']} | {row['wrong']} | {100 * row['error']:.3f} % | "
            f"{row['time']:.2f} |"
        )
    return sum(row["wrong"] for row in rows.values())


if __name__ == "__main__":
    tabled(
        MANNERS,
        drawing,
        lambda path, areas: (*judge(path, areas), ""),
        range(int(sys.argv[1]) if len(sys.argv) > 1 else 200),
        ".dxf",
    )
