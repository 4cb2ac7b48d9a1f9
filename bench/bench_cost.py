# SPDX-License-Identifier: GPL-2.0-or-later
"""What the tracker and the feed law cost in a servo period: time, instructions, memory, growth.

Called by bench/run.py (prints JSON rows); by hand with --table, and with names of cases.  --quick: a
tenth of the periods, for work on the core.

Method: paths as a machine goes them (accelerating, corners, arcs, plunges, rasters, every lap turned
and shifted against the cells) are gone through by bench/lib/cost.c, which is the core compiled as the
components compile it.  Every path is gone through REPLAYS times; the time of a period is the fastest
of those, since work is the same each time and what an ordinary kernel does in between is not; the
first time alone is given beside it.  Instructions are counted by callgrind: the mean of a thousand
periods round the one of a path that costs most, and that one alone.
"""

import argparse
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "build" / "bench" / "lib" / "cost"
PERIOD = 0.001  # s
REPLAYS = 5
GRAIN = 0.02  # mm, of the paths before they are sampled
NEW_STOCK = np.full((1, 3), np.nan)


@dataclass
class Case:
    name: str
    tool: tuple  # diameter, corner, tip angle: mm, mm, degrees
    cell: float  # mm
    speed: float  # mm/s
    accel: float  # mm/s2
    depth: float  # mm
    periods: int
    size: tuple = (300.0, 200.0)
    mean_us: float = None  # targets
    worst_us: float = None
    counted: bool = True  # instructions too
    clamps: int = 0  # round the path


MILLION = Case("D25 flat, 0.1 mm cells, 500 mm/s", (25, 0, 0), 0.1, 500, 5000, 5, 1_000_000, worst_us=50)
CASES = [
    Case("D10 flat, 0.25 mm cells, 50 mm/s", (10, 0, 0), 0.25, 50, 500, 5, 60000, mean_us=10, counted=False),
    Case("D10 flat, 0.25 mm cells, 75 mm/s", (10, 0, 0), 0.25, 75, 500, 5, 60000, mean_us=10, counted=False),
    Case("D10 flat, 0.25 mm cells, 100 mm/s", (10, 0, 0), 0.25, 100, 500, 5, 60000, mean_us=10),
    Case("D6 ball, 0.25 mm cells, 100 mm/s", (6, 3, 0), 0.25, 100, 500, 3, 60000),
    Case("D10 bull R2, 0.25 mm cells, 100 mm/s", (10, 2, 0), 0.25, 100, 500, 3, 60000),
    Case("D8 vee 90, 0.25 mm cells, 100 mm/s", (8, 0, 90), 0.25, 100, 500, 3, 60000),
    Case("D6 taper R0.5 20, 0.25 mm cells, 100 mm/s", (6, 0.5, 20), 0.25, 100, 500, 4, 60000),
    MILLION,
    Case("D10 flat, 12 clamps, 0.25 mm cells, 100 mm/s", (10, 0, 0), 0.25, 100, 500, 5, 60000, clamps=12),
    Case("D10 flat, 100 clamps, 0.25 mm cells, 100 mm/s", (10, 0, 0), 0.25, 100, 500, 5, 60000, clamps=100),
]
BESIDE = (
    13.0  # mm, radius of a holder of 30 mm less that of the tool, the clearance and 2 mm more, from the tool's edge
)


def line(a, b):
    a, b = np.array(a, float), np.array(b, float)
    return a + (b - a) * np.linspace(0.0, 1.0, max(2, int(np.linalg.norm(b - a) / GRAIN) + 1))[:, None]


def arc(centre, radius, start, sweep, z0, z1):
    count = max(2, int(abs(sweep) * radius / GRAIN) + 1)
    a, z = start + sweep * np.linspace(0.0, 1.0, count), np.linspace(z0, z1, count)
    return np.column_stack([centre[0] + radius * np.cos(a), centre[1] + radius * np.sin(a), z])


def plan(case, scale):
    """Pieces of one lap round the origin, in a square of `scale` mm; the tool stops between them."""
    z, s, d = -case.depth, 0.5 * scale, case.tool[0]
    pieces = [
        line((-s, -s, 2), (-s, -s, z)),
        line((-s, -s, z), (s, -s, z)),
        line((s, -s, z), (s, s, z)),
        line((s, s, z), (-s, s, z)),
        line((-s, s, z), (-s, 0, z)),
    ]  # corners, full slots
    for i in range(4):  # side cuts
        y = -s + (0.1, 0.5, 0.75, 0.25)[i] * d * (i + 1)
        pieces += [line((-s, y, z), (s, y, z)), line((s, y, z), (-s, y, z))]
    pieces += [
        arc((0, 0), 0.7 * s, 0.0, 4.5 * math.pi, 0.0, z),  # a helix down
        arc((0.2 * s, 0), 0.5 * s, 0.0, 2 * math.pi, z, z),
        line((0.7 * s, 0, z), (0.7 * s, 0, 2)),
        line((0.7 * s, 0, 2), (-0.3 * s, 0.1 * s, 2)),
        line((-0.3 * s, 0.1 * s, 2), (-0.3 * s, 0.1 * s, 1.5 * z)),  # a plunge
        line((-0.3 * s, 0.1 * s, 1.5 * z), (s, 0.9 * s, 2)),  # a ramp out, and air
        line((s, 0.9 * s, 2), (-s, -0.8 * s, 2)),
    ]
    chain = arc((0, 0), 0.9 * s, 0.5, 3.0, z, z)[:: max(1, int(0.1 / GRAIN))]  # 0.1 mm chords
    pieces.append(np.concatenate([line(a, b)[1:] for a, b in zip(chain, chain[1:])]))
    return pieces


def timed(piece, speed, accel):
    """Places of a piece at every period, from rest to rest."""
    step = np.linalg.norm(np.diff(piece, axis=0), axis=1)
    path = np.concatenate([[0.0], np.cumsum(step)])
    total = path[-1]
    if total <= 0.0:
        return piece[:1]
    top = min(speed, math.sqrt(accel * total))
    ramp = top / accel
    time = 2.0 * ramp + (total - top * ramp) / top
    t = np.arange(PERIOD, time + PERIOD, PERIOD)
    s = np.where(t < ramp, 0.5 * accel * t**2, 0.5 * top * ramp + top * (t - ramp))
    left = np.maximum(time - t, 0.0)
    s = np.where(left < ramp, total - 0.5 * accel * left**2, s)
    return np.column_stack([np.interp(s, path, piece[:, i]) for i in range(3)])


def path_of(case):
    """(n, 3): laps, each turned and shifted against the cells, each with a new stock."""
    scale = 0.62 * min(case.size) - case.tool[0]
    pieces = plan(case, scale)
    laps, count, turn = [], 0, 0.0
    flat = np.concatenate([timed(piece, case.speed, case.accel) for piece in pieces])
    while count < case.periods:
        c, s = math.cos(turn), math.sin(turn)
        lap = np.column_stack(
            [
                c * flat[:, 0] - s * flat[:, 1] + 0.013 * len(laps),
                s * flat[:, 0] + c * flat[:, 1] - 0.007 * len(laps),
                flat[:, 2],
            ]
        )
        laps += [NEW_STOCK, lap]
        count += len(lap)
        turn += 0.37
    return np.concatenate(laps), len(flat)


def run(case, path, replays=REPLAYS, first=-1, last=-2, wrapper=()):
    """(times (n, 3): first ns, fastest ns, 1/1000 mm3; bytes, cells; the program's errors)."""
    x, y = 0.5 * case.size[0], 0.5 * case.size[1]
    with tempfile.TemporaryDirectory() as folder:
        source, result = Path(folder) / "path", Path(folder) / "times"
        np.ascontiguousarray(path, float).tofile(source)
        numbers = [*case.tool, case.cell, -x, -y, -20, x, y, 0, case.accel, replays, first, last]
        done = subprocess.run(
            [*wrapper, str(PROGRAM), str(source), str(result), *map(repr, map(float, numbers))],
            text=True,
            capture_output=True,
            check=True,
            env={**os.environ, "COST_FIFO": "1", **environment(case)},
        )
        size, cells = done.stdout.split()[:2]
        times = np.fromfile(result, np.uint32).reshape(-1, 3)
    return times, float(size), int(cells), done.stderr


def environment(case):
    """Of the program: the clamps of a case."""
    if not case.clamps:
        return {}
    return {
        "COST_CLAMPS": str(case.clamps),
        "COST_REACH": repr(0.5 * (0.62 * min(case.size) - case.tool[0]) + case.tool[0] / 2),
        "COST_BESIDE": repr(BESIDE),
    }


def instructions(case, path, first, last):
    """Instructions of the periods first..last, by callgrind; None without it."""
    if not shutil.which("valgrind"):
        return None
    wrapper = ["valgrind", "--tool=callgrind", "--toggle-collect=marked_period", "--callgrind-out-file=/dev/null"]
    found = re.search(r"Collected : (\d+)", run(case, path, 1, first, last, wrapper)[3])
    return int(found.group(1)) if found else None


def measure(case):
    """dict of a case's figures."""
    path, lap = path_of(case)
    times, size, cells, _ = run(case, path)
    moving = ~np.isnan(path[:, 0])
    fastest, first = times[moving, 1] / 1000.0, times[moving, 0] / 1000.0
    laps = np.flatnonzero(~moving)
    worst = int(np.argmax(np.where(moving, times[:, 1], 0)))
    begin = int(laps[laps <= worst].max()) + 1
    end = int(min([edge for edge in laps if edge > begin], default=len(path)))
    part = path[begin:end]
    # a thousand periods round the worst period: the whole lap would take callgrind too long
    low = max(0, worst - begin - 500)
    high = min(len(part) - 1, low + 1000)
    around = instructions(case, part[: high + 1], low, high) if case.counted else None
    single = instructions(case, part[: high + 1], worst - begin, worst - begin) if case.counted else None
    return {
        "case": case,
        "periods": int(moving.sum()),
        "mean": float(fastest.mean()),
        "p9999": float(np.quantile(fastest, 0.9999)),
        "worst": float(fastest.max()),
        "first_p9999": float(np.quantile(first, 0.9999)),
        "first_worst": float(first.max()),
        "instructions": around / (high - low + 1) if around else None,
        "worst_instructions": single,
        "place": path[worst].tolist(),
        "bytes_a_cell": size / (case.size[0] * case.size[1] / case.cell**2),
        "head": size - 8.0 * cells,
    }


def counted(case, periods):
    """Mean of the instructions of a case's first `periods` periods: the same in every run; None without valgrind."""
    path = path_of(replace(case, periods=1))[0][1 : periods + 1]
    found = instructions(case, path, 0, periods - 1)
    return found / periods if found else None


def growth():
    """Mean us over a slot, [(size mm, speed mm/s, us, mm3 a period)], and cells make the cost."""
    out = []
    for size in ((75.0, 50.0), (150.0, 100.0), (300.0, 200.0)):
        for speed in (25.0, 50.0, 100.0):
            case = Case("", (10, 0, 0), 0.25, speed, 1e6, 5, 0, size)
            pass_ = timed(line((-20, -3, -5), (20, 4, -5)), speed, 1e6)
            path = np.concatenate([part for _ in range(10) for part in (NEW_STOCK, pass_)])
            times, *_ = run(case, path)
            steady = np.tile(np.concatenate([[False], (np.abs(pass_[:, 0]) < 15)]), 10)
            out.append((size, speed, float(times[steady, 1].mean() / 1000.0), float(times[steady, 2].mean() / 1000.0)))
    return out


def row(name, value, unit, target=None, note=""):
    if target is not None:
        note = f"{'meets' if value <= target else 'MISSES'} {target:g}; {note}".rstrip("; ")
    return {"name": name, "value": round(value, 3), "unit": unit, "target": target, "note": note}


def rows_of(found):
    case = found["case"]
    yield row(f"{case.name}: mean", found["mean"], "us", case.mean_us, f"{found['periods']} periods")
    yield row(f"{case.name}: p99.99", found["p9999"], "us", None, f"{found['first_p9999']:.1f} at the first time")
    yield row(
        f"{case.name}: worst", found["worst"], "us", case.worst_us, f"{found['first_worst']:.1f} at the first time"
    )
    if found["instructions"]:
        yield row(
            f"{case.name}: instructions",
            found["instructions"],
            "",
            None,
            f"mean of 1000 periods; {found['worst_instructions']} in the worst",
        )


def growth_rows(points):
    for size, speed, us, volume in points:
        yield row(
            f"growth, slot D10: map {size[0]:g} x {size[1]:g} mm, {speed:g} mm/s",
            us,
            "us",
            None,
            f"{volume:.2f} mm3, {volume / 5.0 / 0.0625:.0f} cells newly swept a period",
        )


def show(case, found, table):
    """Print what measure() found of a case: a line of a table, else rows."""
    if table:
        print(
            f"{case.name:44s} mean {found['mean']:7.2f}  p99.99 {found['p9999']:7.2f}  worst {found['worst']:7.2f}"
            f"  (first {found['first_p9999']:8.2f} {found['first_worst']:8.2f}) us;  "
            f"instr {found['instructions'] or 0:9.0f}, worst {found['worst_instructions'] or 0:9d} at "
            + " ".join(f"{v:.2f}" for v in found["place"]),
            flush=True,
        )
    else:
        for line_ in rows_of(found):
            print(json.dumps(line_), flush=True)
        if case is MILLION:
            print(
                json.dumps(
                    row(
                        "memory of the map, all included",
                        found["bytes_a_cell"],
                        "B/cell",
                        None,
                        f"8 bytes a cell, the empty ring's too, and a head of {found['head']:.0f} bytes",
                    )
                ),
                flush=True,
            )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--count", type=int, metavar="PERIODS", help="only the instructions of a case's first periods")
    options = parser.parse_args()
    for case in CASES:
        if options.names and not any(name in case.name for name in options.names):
            continue
        if options.count:
            found = counted(case, options.count)
            if found is None:
                sys.exit("bench_cost: --count needs valgrind")
            print(
                json.dumps(
                    row(f"{case.name}: instructions", found, "", None, f"mean of the first {options.count} periods")
                ),
                flush=True,
            )
            continue
        if options.quick:
            case.periods //= 10
        found = measure(case)
        show(case, found, options.table)
    if not options.names and not options.count:
        points = growth()
        for point in growth_rows(points):
            print(json.dumps(point) if not options.table else f"{point['name']}: {point['value']} us, {point['note']}")


if __name__ == "__main__":
    sys.exit(main())
