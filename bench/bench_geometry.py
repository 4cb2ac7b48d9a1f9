# SPDX-License-Identifier: GPL-2.0-or-later
"""The geometry kernel against its targets: random contours, size, speed and growth, rings, round trip.

Called by bench/run.py (prints JSON rows).  The figures are those of bench/offset_bench.py, at a size that keeps
`make bench` short: CHIPWISE_RANDOM_COUNT contours of each kind (default 100) from CHIPWISE_SEED on; `--count 5000
--variants 1` is the full one.  What it judges with, and how: docs/design/geometry.md.
"""

import argparse
import contextlib
import io
import json
import math

import roots  # noqa: F401  sys.path
import offset_bench as figures
from support.contour_judge import count_from_environment, seed_from_environment
from rows import row

SIZES = (1000, 20000)
SPEED_MS, SIZE_RATIO, GOUGE_MM, ROUND_TRIP_MM = 50.0, 1.1, 1e-3, 1e-6  # the targets
MOST_FOR_SIZE = 1000  # contours of each kind beside other libraries


def random_rows(count, jobs, every):
    for kind, made in figures.bench_random(count, jobs, every).items():
        title = f"random, {kind}"
        judged = f"{made['offsets']} offsets of {made['contours']} contours from {seed_from_environment()} on"
        yield row(f"{title}: alarms", made["alarms"], "", judged, 0)
        yield row(
            f"{title}: wrong verdicts",
            made["wrong"],
            "",
            "gouge, lost path, false region or rough shape inside "
            "by more than 1e-6 mm" + "".join(f"; {name}" for name in made["replays"]),
            0,
        )
        yield row(f"{title}: lost paths", made["lost_paths"], "", "", 0)
        yield row(
            f"{title}: differing variants",
            made["variant_findings"],
            "",
            f"{made['variants']} backwards and from every vertex",
            0,
        )
        yield row(f"{title}: deepest gouge", made["worst_gouge_mm"], "mm", "", GOUGE_MM)
        yield row(
            f"{title}: round trip",
            made["worst_round_trip_mm"],
            "mm",
            "rough shape inside the finish shape",
            ROUND_TRIP_MM,
        )
        yield row(f"{title}: paths, rough shape and regions", round(made["kernel_ms_per_offset"], 3), "ms", "an offset")


def size_rows(count):
    made = figures.bench_size(min(count, MOST_FOR_SIZE))
    if "skipped" in made:
        print("geometry: size skipped:", made["skipped"])
        return
    compared = f"{made['offsets compared']} offsets"
    yield row(
        "elements / cavalier_contours",
        round(made["ratio"], 4),
        "x",
        f"{compared}, {made['elements']} elements; worst of one with ten and more "
        f"{made['largest ratio of one case']:.3f}",
        SIZE_RATIO,
    )
    yield row("other number of paths than cavalier_contours", made["other number of paths"], "", "", 0)
    yield row("other area than cavalier_contours", made["area differs from cavalier"], "", "by more than 1e-3 mm2", 0)
    yield row("other area than pyclipper", made["area differs from clipper"], "", "by more than its chords", 0)


def speed_rows(sizes):
    made = figures.bench_speed(sizes)
    slowest = {n: max(v for key, v in found.items() if key.startswith("R")) for n, found in made.items()}
    for n, found in made.items():
        fastest = min(v for key, v in found.items() if key.startswith("R"))
        yield row(
            f"speed, {n} elements: everything",
            round(slowest[n], 2),
            "ms",
            f"slowest of R 1, 5, 20 mm, both sides; fastest {fastest:.1f} ms; building and checking the contour "
            f"{found['make_contour ms']:.1f} ms of it",
            SPEED_MS if n == 1000 else None,
        )
        for library in ("cavalier", "clipper"):
            if f"whole / {library}" in found:
                yield row(
                    f"speed, {n} elements: everything / {library}",
                    round(found[f"whole / {library}"], 3),
                    "x",
                    f"paths alone {found[f'paths alone / {library}']:.3f}; {library} "
                    f"{found[f'{library} ms, mean']:.1f} ms for its paths alone",
                )
    first, last = min(slowest), max(slowest)
    growth = slowest[last] / slowest[first] / (last * math.log(last) / (first * math.log(first)))
    yield row(
        f"growth from {first} to {last} elements / n log n",
        round(growth, 3),
        "x",
        "1: exactly n log n, below 1: slower growth",
    )


def ring_rows():
    made = figures.bench_rings()
    yield row(
        "ten rings of 200 elements",
        round(made["ten rings of 200 elements ms"], 1),
        "ms",
        "each from the original contour",
    )
    yield row("ten rings: deepest gouge", made["deepest gouge mm"], "mm", "", GOUGE_MM)
    yield row(
        "ten rings: drift",
        made["length error of ten exact rings mm"],
        "mm",
        "length against the closed form of a rounded square",
        ROUND_TRIP_MM,
    )


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--count", type=int, default=count_from_environment(100), help="contours of each kind")
    arguments.add_argument("--jobs", type=int, default=2, help="processes at once")
    arguments.add_argument(
        "--variants", type=int, default=10, metavar="N", help="judge the variants of every Nth random contour"
    )
    given = arguments.parse_args()
    for work in (
        lambda: speed_rows(SIZES),
        ring_rows,
        lambda: size_rows(given.count),
        lambda: random_rows(given.count, given.jobs, given.variants),
    ):
        talk = io.StringIO()  # the tables of offset_bench.py
        with contextlib.redirect_stdout(talk):
            made = list(work())
        for line in talk.getvalue().splitlines():
            if "skipped" in line or "no other" in line:
                print(line)
        for one in made:
            print(json.dumps(one), flush=True)


if __name__ == "__main__":
    main()
