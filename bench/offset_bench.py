#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Figures of the geometry kernel at full size; prints a table, writes build/bench_geometry.json.

    /usr/bin/python3 bench/offset_bench.py [--count 5000] [--jobs 3] [--only speed,rings,...]

Called by hand; bench/bench_geometry.py takes the same figures at a size for `make bench`.

random: CHIPWISE_RANDOM_COUNT contours of each kind (default 5,000) from CHIPWISE_SEED on,
both sides, against the oracle of tests/support/contour_oracle.py, and each backwards and
from every vertex against itself; failures leave replay files under build/.
speed: time over size, beside cavalier_contours and Clipper in the same run.
size: elements against cavalier_contours, areas against pyclipper.
rings: ten offsets of one outline.
"""

import argparse
import json
import math
import os
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from roots import ROOT
from support import contour_oracle as oracle
from support import second_oracles
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import ArcElement, LineElement, make_contour
from chipwise.geometry.offset.kernel import LEFT, RIGHT, offset_contour
from support.contour_judge import count_from_environment, seed_from_environment, variants, verdict, write_replay
from support.contour_random import contour_case
from support.contour_shapes import rounded_square

KINDS = ("filleted", "bulged")


def ring_outline(n, seed=1):
    """A closed outline of n elements, lines and fillets, about 1.2 n / pi mm across: a
    three-lobed ring with a jagged edge, so that its length grows with n."""
    rng = np.random.default_rng(seed)
    m = n // 2
    angle = 2.0 * np.pi * np.arange(m) / m
    radius = 0.6 * m * (1.0 + 0.25 * np.sin(3.0 * angle)) + 1.2 * rng.uniform(-1.0, 1.0, m)
    p = np.stack((radius * np.cos(angle), radius * np.sin(angle)), axis=1)
    edge = np.roll(p, -1, axis=0) - p
    length = np.hypot(*edge.T)
    unit = edge / length[:, None]
    corners = []
    for k in range(m):
        u, v = unit[k - 1], unit[k]
        turn = math.atan2(u[0] * v[1] - u[1] * v[0], u @ v)
        half = math.tan(abs(turn) / 2.0)
        r = min(0.4 * min(length[k - 1], length[k]) / half, 3.0) * rng.uniform(0.3, 1.0)
        ccw = turn > 0.0
        start = p[k] - r * half * u
        centre = start + (r if ccw else -r) * np.array((-u[1], u[0]))
        corners.append((start, p[k] + r * half * v, centre, ccw))
    parts = []
    for k, (start, end, centre, ccw) in enumerate(corners):
        parts.append(ArcElement(tuple(start), tuple(end), tuple(centre), ccw, 2 * k + 1))
        parts.append(LineElement(tuple(end), tuple(corners[(k + 1) % m][0]), 2 * k + 2))
    return parts


def judge_range(job):
    """Counters of cases first..last-1 of one kind."""
    kind, first, last, every = job
    total = dict(
        contours=0,
        offsets=0,
        variants=0,
        alarms=0,
        wrong=0,
        variant_findings=0,
        kernel_s=0.0,
        worst_gouge_mm=0.0,
        worst_round_trip_mm=0.0,
        lost_paths=0,
        replays=[],
    )
    for seed in range(first, last):
        parts, radius = contour_case(seed, kind)
        total["contours"] += 1
        for side in (LEFT, RIGHT):
            total["offsets"] += 1
            begin = time.perf_counter()
            found, result = [], None
            try:
                contour = make_contour(parts)
                result = offset_contour(contour, side, radius)
                _ = result.rough, result.inaccessible  # both are made when they are asked for
            except Exception:
                total["alarms"] += 1
            total["kernel_s"] += time.perf_counter() - begin
            if result is not None:
                shape = oracle.from_elements(contour.elements)
                path = [el for p in result.paths for el in oracle.from_elements(p.elements)]
                total["worst_gouge_mm"] = max(total["worst_gouge_mm"], oracle.gouge(shape, radius, path, 0.1))
                total["worst_round_trip_mm"] = max(total["worst_round_trip_mm"], deepest_rough(shape, side, result))
            found = verdict(parts, side, radius)
            count, different = (0, []) if seed % every else variants(parts, side, radius)
            total["variants"] += count
            total["wrong"] += bool(found)
            total["lost_paths"] += any("lost" in text for text in found)
            total["variant_findings"] += len(different)
            if found or different:
                total["replays"].append(str(write_replay(kind, seed, parts, side, radius, found + different)))
    return total


def deepest_rough(shape, side, result):
    """Largest depth (mm) of the rough shapes inside the finish shape."""
    edges = [oracle.from_elements(rough.elements) for rough in result.rough]
    return max((oracle.inside_material(shape, side, edge, 0.3) for edge in edges if edge), default=0.0)


def bench_random(count, jobs, every):
    first, table = seed_from_environment(), {}
    for kind in KINDS:
        step = max(1, min(25, count // jobs))
        ranges = [(kind, k, min(k + step, first + count), every) for k in range(first, first + count, step)]
        begin = time.perf_counter()
        with ProcessPoolExecutor(jobs) as pool:
            rows = list(pool.map(judge_range, ranges))
        merged = {
            key: (max if key.startswith("worst") else sum)(row[key] for row in rows)
            for key in rows[0]
            if key != "replays"
        }
        merged["replays"] = [name for row in rows for name in row["replays"]]
        merged["kernel_ms_per_offset"] = 1e3 * merged.pop("kernel_s") / merged["offsets"]
        merged["wall_s"] = time.perf_counter() - begin
        table[kind] = merged
        show(f"random, {kind}", merged)
    return table


def best(work, times):
    """Shortest run, ms of processor time (the work is one thread), and the last result."""
    shortest = math.inf
    for _ in range(times):
        begin = time.process_time()
        result = work()
        shortest = min(shortest, time.process_time() - begin)
    return 1e3 * shortest, result


SIZES = (200, 1000, 2000, 5000, 10000, 20000)


def other_libraries():
    """(cavalier_contours, pyclipper, None), or (None, None, why not)."""
    cavalier, no_cavalier = second_oracles.load("cavaliercontours")
    clipper, no_clipper = second_oracles.load("pyclipper")
    if cavalier and clipper:
        return cavalier, clipper, None
    return None, None, no_cavalier or no_clipper


def bench_speed(sizes=SIZES):
    """Everything: build and validate the contour, offset, rough shape, regions.  The other
    libraries make the paths alone, from a shape they hold already."""
    cavalier, clipper, reason = other_libraries()
    if reason:
        print("speed: no other libraries:", reason)
    table = {}
    for n in sizes:
        parts, rows, ours, path, others = ring_outline(n), {}, [], [], {}
        contour, again = make_contour(parts), 7 if n <= 2000 else 3
        shape = oracle.from_elements(contour.elements)
        for radius in (1.0, 5.0, 20.0):
            for side, name in ((LEFT, "inside"), (RIGHT, "outside")):

                def work():
                    result = offset_contour(make_contour(parts), side, radius)
                    return result, result.rough, result.inaccessible

                ours.append(best(work, again)[0])
                rows[f"R{radius:g} {name} ms"] = ours[-1]
                path.append(best(lambda: offset_contour(contour, side, radius), again)[0])
                if cavalier:
                    jobs = {
                        "cavalier": second_oracles.cavalier_job(cavalier, shape, side, radius),
                        "clipper": second_oracles.clipper_job(clipper, shape, side, radius)[0],
                    }
                    for library, job in jobs.items():
                        others.setdefault(library, []).append(best(job, 3)[0])
        rows["make_contour ms"] = best(lambda: make_contour(parts), 3)[0]
        rows["slowest, us per n log2 n"] = 1e3 * max(ours) / (n * math.log2(n))
        for library, times in others.items():
            rows[f"{library} ms, mean"] = float(np.mean(times))
            rows[f"whole / {library}"] = sum(ours) / sum(times)
            rows[f"paths alone / {library}"] = sum(path) / sum(times)
        table[n] = rows
        show(f"speed, {n} elements", rows)
    return table


def bench_size(count):
    """Elements against cavalier_contours, centre area against both libraries."""
    cavalier, clipper, reason = other_libraries()
    if reason:
        print("size: skipped:", reason)
        return {"skipped": reason}
    ours = theirs = compared = other_count = area_off = clipper_off = 0
    worst = 0.0
    first = seed_from_environment()
    for kind in KINDS:
        for seed in range(first, first + count):
            parts, radius = contour_case(seed, kind)
            contour = make_contour(parts)
            shape = oracle.from_elements(contour.elements)
            for side in (LEFT, RIGHT):
                paths = offset_contour(contour, side, radius).paths
                area = sum(elements.area(p.elements) for p in paths)
                slack = 1e-2 + 2e-3 * (second_oracles.perimeter(shape) + 7.0 * radius)
                clipper_off += int(abs(area - second_oracles.clipper_area(clipper, shape, side, radius)) > slack)
                other = second_oracles.cavalier_paths(cavalier, shape, side, radius)
                if len(other) != len(paths):
                    other_count += 1
                    continue
                compared += 1
                area_off += int(abs(area - sum(a for _, a in other)) > 1e-3)
                n, m = sum(len(p.elements) for p in paths), sum(k for k, _ in other)
                ours, theirs = ours + n, theirs + m
                worst = max(worst, n / m if m >= 10 else 0.0)
    rows = {
        "offsets compared": compared,
        "other number of paths": other_count,
        "area differs from cavalier": area_off,
        "area differs from clipper": clipper_off,
        "elements": ours,
        "elements of cavalier": theirs,
        "ratio": ours / theirs,
        "largest ratio of one case": worst,
    }
    show("size and area against other libraries", rows)
    return rows


def bench_rings():
    """Ten rings inward of 200 elements, and the drift of ten rings of a rounded square."""
    parts = ring_outline(200)

    def work():
        contour = make_contour(parts)
        return [offset_contour(contour, LEFT, 2.0 * k) for k in range(1, 11)]

    ms, results = best(work, 5)
    contour = make_contour(parts)
    shape = oracle.from_elements(contour.elements)
    deviation = 0.0
    for k, result in enumerate(results, 1):
        path = [el for p in result.paths for el in oracle.from_elements(p.elements)]
        gap = oracle.nearest(shape, oracle.samples(path, 0.2))
        deviation = max(deviation, float(np.max(2.0 * k - gap)))
    drift = 0.0
    for k in range(1, 11):
        (path,) = offset_contour(rounded_square(60, 25), LEFT, 2.0 * k).paths
        length = float(elements.lengths(path.elements).sum())
        drift = max(drift, abs(length - (40.0 + 2.0 * math.pi * (25.0 - 2.0 * k))))
    rows = {
        "ten rings of 200 elements ms": ms,
        "deepest gouge mm": deviation,
        "length error of ten exact rings mm": drift,
    }
    show("rings", rows)
    return rows


def show(title, rows):
    print(title)
    for key, value in rows.items():
        print(f"    {key:34} {value:.4g}" if isinstance(value, float) else f"    {key:34} {value}", flush=True)


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--count", type=int, default=count_from_environment(5000))
    arguments.add_argument("--jobs", type=int, default=max(1, (os.cpu_count() or 2) - 1))
    arguments.add_argument(
        "--variants", type=int, default=1, metavar="N", help="judge the variants of every Nth random contour"
    )
    arguments.add_argument("--only", default="speed,rings,size,random")
    given = arguments.parse_args()
    made = {"count": given.count, "seed": seed_from_environment()}
    runs = dict(
        speed=bench_speed,
        rings=bench_rings,
        size=lambda: bench_size(min(given.count, 1000)),
        random=lambda: bench_random(given.count, given.jobs, given.variants),
    )
    for name in given.only.split(","):
        made[name] = runs[name]()
        (ROOT / "build").mkdir(exist_ok=True)
        (ROOT / "build" / "bench_geometry.json").write_text(json.dumps(made, indent=1))


if __name__ == "__main__":
    main()
