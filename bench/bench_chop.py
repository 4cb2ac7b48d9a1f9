# SPDX-License-Identifier: GPL-2.0-or-later
"""The chop of contours in figures: loose pieces, kerfs, number of lines, time.

    OPENBLAS_NUM_THREADS=1 /usr/bin/python3 bench/bench_chop.py [--count 500] [--stages 60] [--jobs 2] [--first 0]

count    random contours x tools x H (tests/support/chop_judge.py), each judged by tests/support/chop_oracle.py;
         CHIPWISE_RANDOM_COUNT and CHIPWISE_SEED (first number) are the defaults
stages   so many more, a third as large, also judged while they are cut (cells and flood fill, slow)
A case that fails is printed with its number; tools/judge chop NUMBER judges it again.
Lines are compared with the same search held to the axes, and with the patent's way: the same n along X and Y, raised
until the pieces fit.
"""

import argparse
import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor

import numpy as np

import roots  # noqa: F401  sys.path
from chipwise.geometry.slug import grid, slug
from support.chop_judge import Chopped, chop_case, verdict


def lines_of(paths, islands, radius, chop_size, along_axes):
    """Number of lines with the search held to the axes, or the patent's way; 0 where a slug is cleared."""
    found = slug._directions
    slug._directions = lambda boundaries: [0.0]
    search = grid.Grid.search
    if not along_axes:
        grid.Grid.search = _equal_parts
    try:
        chops = slug.chop_slugs(paths, islands, radius, chop_size)
        return 0 if any(c.segments and not c.pieces for c in chops) else sum(len(c.segments) for c in chops)
    finally:
        slug._directions, grid.Grid.search = found, search


def _equal_parts(own, size, best):
    """In place of the search: the same n both ways."""
    for n in range(1, grid.MAX_PARTS):
        if own.usable((n, n)) and (min(own.cell(0, n), own.cell(1, n)) < 0 or own.fits((n, n), size)):
            return [own.trial((n, n))]
    return []


def case(job):
    """Figures of one case."""
    number, small = job
    kind, loops, radius, chop_size = chop_case(number, small)
    row = dict(number=number, kind=kind, small=small, findings=[])
    try:
        done = Chopped(loops, radius, chop_size)
        row["findings"], figures = verdict(done, stages=small)
        row.update(
            figures,
            plan_s=done.plan_s,
            share=figures["largest"] / chop_size,
            ever_share=figures["ever"] / chop_size,
            chopped=done.plan.chopped,
            pieces=done.plan.pieces,
            cleared=done.plan.cleared,
            lines=sum(len(chop.segments) for chop in done.plan.chops),
        )
        if not small and done.plan.chopped:
            paths = done.boundaries, done.islands, radius, chop_size
            row["axes"], row["patent"] = lines_of(*paths, True), lines_of(*paths, False)
    except Exception as error:  # any alarm is a finding
        row["findings"] = [f"alarm: {error!r}"]
    return row


def put(name, value, unit, note=""):
    print(json.dumps(dict(name=name, value=float(value), unit=unit, note=note)), flush=True)


def report(rows):
    """The table, from the rows of all cases."""
    whole = [row for row in rows if not row["small"]]
    if whole:
        report_whole(whole)
    staged = [row for row in rows if row["small"]]
    if staged:
        put("contours watched while cut", len(staged), "", f"{sum(bool(r.get('chopped')) for r in staged)} chopped")
        put("findings while cut", sum(len(r["findings"]) for r in staged), "")
        put("largest loose piece at any time / H, worst", max((r.get("ever_share", 0.0) for r in staged)), "")


def report_whole(whole):
    """The rows of the contours judged at the end."""
    cut = [row for row in whole if row.get("chopped")]
    put(
        "contours x tools x H",
        len(whole),
        "",
        f"{len(cut)} of them chopped, {sum(r['pieces'] for r in cut)} pieces, "
        f"{sum(r['cleared'] for r in cut)} with a slug cleared to chips",
    )
    put("findings: alarms, pieces of H and more, kerfs outside", sum(len(r["findings"]) for r in whole), "")
    put("largest piece / H, worst", max((r["share"] for r in cut), default=0.0), "")
    put("kerf outside the contour, worst", max((r["outside"] for r in cut), default=0.0), "mm", "0.001 allowed")
    grids = [row for row in cut if not row["cleared"] and row["axes"] and row["patent"]]
    if grids:
        lines, axes, patent = (sum(r[key] for r in grids) for key in ("lines", "axes", "patent"))
        put("lines", lines, "", f"{len(grids)} contours without a cleared slug")
        put(
            "lines / axis-parallel grid",
            lines / axes,
            "",
            f"fewer in {sum(r['lines'] < r['axes'] for r in grids)}, more in "
            f"{sum(r['lines'] > r['axes'] for r in grids)}",
        )
        put(
            "lines / same n along X and Y",
            lines / patent,
            "",
            f"fewer in {sum(r['lines'] < r['patent'] for r in grids)}, more in "
            f"{sum(r['lines'] > r['patent'] for r in grids)}",
        )
    if cut:
        seconds = np.array([r["plan_s"] for r in cut])
        for name, value in (
            ("median", np.median(seconds)),
            ("95 %", np.quantile(seconds, 0.95)),
            ("worst", seconds.max()),
        ):
            put(f"choosing the lines, {name}", 1000 * value, "ms")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=int(os.environ.get("CHIPWISE_RANDOM_COUNT", "100")))
    parser.add_argument("--stages", type=int, default=20)
    parser.add_argument("--first", type=int, default=int(os.environ.get("CHIPWISE_SEED", "0")))
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    jobs = [(options.first + k, False) for k in range(options.count)]
    jobs += [(options.first + k, True) for k in range(options.stages)]
    with ProcessPoolExecutor(options.jobs) as pool:
        rows = []
        for row in pool.map(case, jobs):
            rows.append(row)
            if row["findings"]:
                print(
                    f"case {row['number']}{' small' if row['small'] else ''} {row['kind']}: {row['findings']}",
                    flush=True,
                )
            elif len(rows) % 50 == 0:
                print(f"{len(rows)} of {len(jobs)}", file=sys.stderr, flush=True)
    report(rows)
    return 1 if any(row["findings"] for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
