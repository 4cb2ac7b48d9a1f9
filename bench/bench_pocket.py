# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 against its targets: random pockets, length of the path, engagement, planning time.

Called by bench/run.py (prints JSON rows).  By hand, in full:

    /usr/bin/python3 bench/bench_pocket.py --count 1000 --jobs 2

random: CHIPWISE_RANDOM_COUNT pockets (default 40) from CHIPWISE_SEED on, each with every strategy, D going through
0.25 to 1.0 tool diameters, judged by tests/support/pocket_oracle.py.
length: path at feed and in the air of P0 at D = 0.4 tool diameters, against area / D; everything counted from the first
place over the pocket to the last, with helices and heights (R 1 mm above the stock, one level a tool radius deep, ramp
3 degrees); "flat" leaves out what goes up and down.  The area is all that the tool can reach.
engagement: width of stock met per mm of path (section area / depth) by the C stock model, in tool diameters.
plan: processor time of pocket_plan() for an outline of 200 elements with 3 islands, nothing cached.
embedded: the same in the Python inside LinuxCNC's interpreter.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from roots import ROOT
from support import hole_oracle as trace
from support import pocket_oracle as oracle
from chipwise.cycles import pocket as cycle
from chipwise.errors import CycleError
from chipwise.geometry.base import polygons
from chipwise.geometry.base.contour import LineElement
from chipwise.geometry.base import chains
from chipwise.geometry.pocket import machinable
from chipwise.geometry.pocket.strategies import NAMES
from chipwise.moves import Rapid
from chipwise.clib import core
from support.pocket_judge import random_request, shrunk_names, verdict
from support.pocket_random import circle
from rows import row

RATIO, PLAN_MS = 1.35, 300.0  # the targets
SHARE = 0.4  # D in tool diameters
STEP_MM, CELL_MM = 0.4, 0.1  # of the engagement


# ---- random pockets ----------------------------------------------------------------------------------------------


def judged(seed):
    """(seed, [(strategy, faults, entries by plunge)]) of one pocket."""
    found = []
    for strategy in NAMES:
        faults, plan = verdict(random_request(seed, strategy), seed)
        found.append((strategy, faults, plan is not None))
    return seed, found


def random_rows(count, first, jobs):
    faults, cleared = {p: Counter() for p in NAMES}, Counter()
    with ProcessPoolExecutor(jobs) as pool:
        for seed, found in pool.map(judged, range(first, first + count), chunksize=4):
            for strategy, texts, made in found:
                cleared[strategy] += made
                faults[strategy].update(shrunk_names(texts))
                for text in texts:
                    print(f"seed {seed} P{strategy}: {text}", file=sys.stderr, flush=True)
    for strategy, name in NAMES.items():
        listed = ", ".join(f"{k} {v}" for k, v in faults[strategy].items())
        yield row(
            f"random pockets, P{strategy} {name}: faults",
            sum(faults[strategy].values()),
            "",
            f"{cleared[strategy]} pockets cleared of {count} from {first} on" + (f"; {listed}" if listed else ""),
            0,
        )


# ---- length of the path -------------------------------------------------------------------------------------------


def plain_request(seed, strategy):
    """One level of a random pocket at D = 0.4 tool diameters."""
    request = random_request(3 * seed, strategy)
    return replace(
        request,
        step=SHARE * 2 * request.tool_radius,
        side_allowance=0.0,
        floor_allowance=0.0,
        depth_step=None,
        ramp_angle=3.0,
        bottom=-request.tool_radius,
        clearance=1.0,
        climb=True,
        direction=0.0,
    )


def lengths(moves, start):
    """(mm at feed, mm in the air, mm level) from the first place over the pocket on."""
    toolpath = trace.walk(moves, start)[1:-1]
    long = [
        math.hypot(e.radius * e.sweep[1], e.b[2] - e.a[2]) if e.kind == "arc" else math.dist(e.a, e.b) for e in toolpath
    ]
    air = sum(n for e, n in zip(toolpath, long) if e.kind == "rapid")
    return sum(long) - air, air, sum(n for e, n in zip(toolpath, long) if e.a[2] == e.b[2])


def reached_area(request):
    """mm2 that the tool can reach."""
    _, pockets = cycle._pockets(request.loops, request.close_gap)
    found = [region for pocket in pockets for region in machinable.machinable_regions(pocket, request.tool_radius)]
    areas = [
        polygons.area_region(chains.flat(f.boundary, 0.01), [chains.flat(h, 0.01) for h in f.holes])
        for f in found
        if f.area > 0.0
    ]
    return polygons.area_of(polygons.grown(polygons.joined(areas), request.tool_radius, 0.01)) if areas else 0.0


def length_rows(count):
    for strategy, name in NAMES.items():
        ratios, air_share, flat = [], [], []
        for seed in range(count):
            request = plain_request(seed, strategy)
            try:
                moves = cycle.pocket_plan(request).moves
            except CycleError:
                continue
            cut, air, level = lengths(moves, request.start)
            bound = reached_area(request) / request.step
            if bound > 0.0:
                ratios.append((cut + air) / bound)
                air_share.append(air / (cut + air))
                flat.append(level / bound)
        yield row(
            f"path / (area / D), P{strategy} {name}, median",
            round(float(np.median(ratios)), 3),
            "",
            f"worst {max(ratios):.2f}; flat {np.median(flat):.2f}, worst {max(flat):.2f}; air "
            f"{100 * np.mean(air_share):.0f} %; {len(ratios)} pockets",
            RATIO if strategy == 0 else None,
        )


# ---- engagement --------------------------------------------------------------------------------------------------


def widths(request):
    """Width met (mm) every STEP_MM of the paths at final depth, level moves only."""
    depth = request.clearance - request.bottom
    toolpath = trace.walk(cycle.pocket_plan(request).moves, request.start)
    low = np.min([np.min([e.a, e.b], axis=0) for e in toolpath], axis=0)[:2] - 2 * request.tool_radius
    high = np.max([np.max([e.a, e.b], axis=0) for e in toolpath], axis=0)[:2] + 2 * request.tool_radius
    stock = core.Stock((*low, request.bottom - 1), (*high, request.clearance), CELL_MM)
    tool = core.Tool(2 * request.tool_radius)
    cutter, met = core.Cutter(stock, tool, (*low, request.clearance + 5)), []
    for e in toolpath:
        for a, b in zip(points := oracle.on_path(e, STEP_MM), points[1:]):
            along = b - a
            level = e.kind != "rapid" and abs(along[2]) < 1e-9 and b[2] <= request.bottom + 1e-9
            if level and np.hypot(*along[:2]) > 1e-6:
                met.append(stock.section(tool, a, along / np.linalg.norm(along))[0] / depth)
            cutter.to(b)
    return np.array(met)


def engagement_rows(count):
    for strategy, name in NAMES.items():
        every = []
        for seed in range(count):
            try:
                request = plain_request(seed, strategy)
                every.append(widths(request) / (2 * request.tool_radius))
            except CycleError:
                pass
        met = np.concatenate(every)
        largest = np.median([np.percentile(m, 99.5) for m in every])
        cutting = met[met > 0.02]
        yield row(
            f"engagement, P{strategy} {name}: mean",
            round(float(cutting.mean()), 3),
            "D",
            f"where it cuts, at D = 0.4; largest {largest:.2f}; full width (> 0.9) on {100 * np.mean(met > 0.9):.1f} % "
            f"of the path, air at feed {100 * np.mean(met <= 0.02):.0f} %; {len(every)} pockets",
        )


# ---- planning time -----------------------------------------------------------------------------------------------


def large_pocket():
    """Loops: an outline of 200 elements, 130 mm across, and 3 islands."""
    angle = 2 * np.pi * np.arange(100) / 100
    r = 65 + 8 * np.sin(3 * angle) + 1.5 * np.cos(20 * angle)
    p = np.stack((r * np.cos(angle), r * np.sin(angle)), axis=1)
    parts = []
    for k in range(100):
        a, b = p[k], p[(k + 1) % 100]
        middle = 0.5 * (a + b) * (1 + 0.003 * (-1) ** k)
        parts += [LineElement(tuple(a), tuple(middle), 2 * k + 1), LineElement(tuple(middle), tuple(b), 2 * k + 2)]
    return (tuple(parts), circle(9, (22, 5)), circle(7, (-20, 20)), circle(6, (-15, -25)))


def plan_rows(rounds=5):
    for strategy, name in NAMES.items():
        for radius in (3.0, 5.0):
            request = cycle.PocketRequest(
                loops=large_pocket(),
                bottom=-4.0,
                clearance=1.0,
                tool_radius=radius,
                step=SHARE * 2 * radius,
                feed=600.0,
                plunge_feed=200.0,
                start=(0.0, 0.0, 5.0),
                strategy=strategy,
            )
            took = []
            for _ in range(rounds):
                cycle.pocket_plan.cache_clear()
                cycle._pockets.cache_clear()
                begun = time.process_time()
                moves = cycle.pocket_plan(request).moves
                took.append(1000 * (time.process_time() - begun))
            yield row(
                f"plan of 200 elements, 3 islands, P{strategy} {name}, tool {2 * radius:g} mm",
                round(min(took), 1),
                "ms",
                f"median {np.median(took):.0f} ms, {len(moves)} moves, "
                f"{sum(isinstance(m, Rapid) for m in moves)} rapids",
                PLAN_MS,
            )


def embedded_rows():
    """plan_rows() in the interpreter's own Python: rs274 runs a program whose ;py comment calls it."""
    with tempfile.TemporaryDirectory(prefix="chipwise-bench.") as folder:
        found, program = Path(folder) / "rows", Path(folder) / "plan.ngc"
        program.write_text(
            f";py,import sys; sys.path.insert(0, '{ROOT}/bench'); import bench_pocket; "
            f"bench_pocket.write_plan_rows('{found}')\nM2\n"
        )
        subprocess.run(
            ["rs274", "-g", "-i", "configs/mill.ini", str(program)],
            cwd=ROOT,
            env={**os.environ, "HOME": folder},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            check=True,
        )
        for line in found.read_text().splitlines():
            made = json.loads(line)
            yield {**made, "name": made["name"] + ", in LinuxCNC's interpreter"}


def write_plan_rows(path):
    """Called by the program of embedded_rows()."""
    Path(path).write_text("".join(json.dumps(made) + "\n" for made in plan_rows()))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=int(os.environ.get("CHIPWISE_RANDOM_COUNT") or 40))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="random,length,engagement,plan,embedded")
    given = parser.parse_args()
    first = int(os.environ.get("CHIPWISE_SEED") or 0)
    parts = {
        "random": lambda: random_rows(given.count, first, given.jobs),
        "length": lambda: length_rows(max(40, given.count // 3)),
        "engagement": lambda: engagement_rows(8),
        "plan": plan_rows,
        "embedded": embedded_rows,
    }
    failed = False
    for part in given.only.split(","):
        for made in parts[part]():
            print(json.dumps(made), flush=True)
            failed |= made["note"].startswith("MISSES")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
