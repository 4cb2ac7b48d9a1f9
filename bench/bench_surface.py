# SPDX-License-Identifier: GPL-2.0-or-later
"""Curved surfaces in figures: the drop cutter's speed and memory.

    /usr/bin/python3 bench/bench_surface.py [--points 100000] [--table]

Called by bench/run.py (prints JSON rows).
points   random points over 100,000 triangles of hills and hollows on 100 x 100 mm, D6 ball and bull-nose (corner 1), and
         opencamlib's batch drop cutter on some of the same points, if pip has it
memory   bytes a triangle while the model is read and put into bins
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

import numpy as np

import roots  # noqa: F401  sys.path
from chipwise.check.sweep import Shape
from chipwise.surface import drop
from chipwise.surface.model import Placing, read_model
from rows import row
from support import second_oracles, surface_cases

FLOOR = -50.0
OTHERS = 300            # points for opencamlib
SHAPES = {"D6 ball": Shape(6, 3), "D6 bull-nose": Shape(6, 1)}


def cpu_s():
    return sum(os.times()[:2])


def points(count):
    """Rows of the points a CPU second."""
    model = surface_cases.model_of(surface_cases.waves(225, 100.0))
    rng = np.random.default_rng(1)
    for name, shape in SHAPES.items():
        xy = rng.uniform(0, 100, (count, 2))
        began = cpu_s()
        found = drop.Mesh(model, 3.0).heights(drop.drop_tool(shape), xy, FLOOR)
        rate = count / (cpu_s() - began)
        yield row(f"surface: {name}, points a CPU second", rate, "1/s", f"{'meets' if rate >= 20_000 else 'MISSES'} 20000; "
                  f"{len(model.triangles)} triangles, {count} points, bins included")
        ocl, reason = second_oracles.load("opencamlib")
        if ocl is None:
            print(reason)
            continue
        began = cpu_s()
        expected = surface_cases.opencamlib_heights(ocl, surface_cases.triangles_of(model), shape, xy[:OTHERS], FLOOR)
        other = OTHERS / (cpu_s() - began)
        yield row(f"surface: {name}, times as many as opencamlib", rate / other, "", f"{'meets' if rate >= 100 * other else 'MISSES'} 100; "
                  f"opencamlib {other:.0f} points a CPU second")
        yield row(f"surface: {name}, largest difference from opencamlib", float(np.abs(found[:OTHERS] - expected).max()), "mm", "", 1e-3)


def memory():
    """Bytes a triangle at the peak, in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        path = surface_cases.write_stl(f"{folder}/model.stl", surface_cases.waves(708, 300.0))
        done = subprocess.run([sys.executable, __file__, "--measure", path], check=True, stdout=subprocess.PIPE, text=True)
    return float(done.stdout)


def peak_bytes():
    """The largest memory this process has had; getrusage would count its parent's."""
    with open("/proc/self/status") as file:
        return next(1024 * int(line.split()[1]) for line in file if line.startswith("VmHWM"))


def measure(path):
    """Growth of this process in bytes a triangle."""
    drop.Mesh(surface_cases.model_of(surface_cases.waves(12)), 3.0)
    before = peak_bytes()
    model = read_model(path, Placing())
    drop.Mesh(model, 3.0)
    print((peak_bytes() - before) / len(model.triangles))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=100_000)
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--measure", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        return measure(options.measure)
    rows = [*points(options.points), row("surface: memory a triangle, reading and bins", memory(), "bytes", "1,000,000 triangles", 150)]
    for line in rows:
        print(json.dumps(line) if not options.table else f"{line['name']:60s} {line['value']:12.5g} {line['unit']:5s} {line['note']}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
