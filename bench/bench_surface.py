# SPDX-License-Identifier: GPL-2.0-or-later
"""Curved surfaces in figures: the drop cutter's speed and memory.

    /usr/bin/python3 bench/bench_surface.py [--points 100000] [--table]

Called by bench/run.py (prints JSON rows).
points   random points over 100,000 triangles of hills and hollows on 100 x 100 mm, D6 ball and bull-nose (corner 1),
         and opencamlib's batch drop cutter on some of the same points, if pip has it
memory   bytes a triangle while the model is read and put into bins
whole    `chipwise surface` from STL to program: 10^6 points over the same triangles, one core
path     D6 ball over hills, D6 bull-nose over a step, D6 flat over a sphere: gouge (drop cutter along every move; brute
         force at random points), lines a point, time of the links P1 / P0 with what brings the tool off and in
         (support/link_judge.py: 100 mm/s, 500 mm/s2 an axis, corners as the planner rounds them), and traverses of all
         links that meet one of 3,000 needles of stock; the path across and the last relief at the plunge feed against
         the links of P0, which no straight one-way link can go below
contacts 20,000 links (--links N, --seed S) of random surfaces, tools, directions, levels, cells (surface_links.py):
those that meet stock
machine  the links of P1 / P0 of the same three surfaces in LinuxCNC on the simulated mill, from its log of every servo
         period
rest     after a D6 ball at 0.5 mm a D3 ball at 0.2 mm where more than 0.05 mm is left: share of the feed in air
         (needles 0.15 mm apart, bits of 0.25 mm), cuts alone and with plunges; link time P1 / P0; and levels of 1.5 mm
         with a flat D6: the same
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time

import numpy as np

import roots  # noqa: F401  sys.path
from chipwise.clib.height_map import Shape
from chipwise.cycles.surface import surface_plan
from chipwise.moves import PlaneArc
from chipwise.clib import drop_cutter
from chipwise.surface.model import Placing, read_model
from rows import row
from roots import ROOT
import surface_links
import surface_rest
from surface_rest import START, link_seconds
from support import link_judge, second_oracles, surface_cases, surface_judge

FLOOR = -50.0
OTHERS = 300  # points for opencamlib
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
        found = drop_cutter.Mesh(model, 3.0).heights(drop_cutter.drop_tool(shape), xy, FLOOR)
        rate = count / (cpu_s() - began)
        yield row(
            f"surface: {name}, points a CPU second",
            rate,
            "1/s",
            f"{'meets' if rate >= 20_000 else 'MISSES'} 20000; "
            f"{len(model.triangles)} triangles, {count} points, bins included",
        )
        ocl, reason = second_oracles.load("opencamlib")
        if ocl is None:
            print(reason)
            continue
        began = cpu_s()
        expected = surface_cases.opencamlib_heights(ocl, surface_cases.triangles_of(model), shape, xy[:OTHERS], FLOOR)
        other = OTHERS / (cpu_s() - began)
        yield row(
            f"surface: {name}, times as many as opencamlib",
            rate / other,
            "",
            f"{'meets' if rate >= 100 * other else 'MISSES'} 100; opencamlib {other:.0f} points a CPU second",
        )
        yield row(
            f"surface: {name}, largest difference from opencamlib",
            float(np.abs(found[:OTHERS] - expected).max()),
            "mm",
            "",
            1e-3,
        )


def memory():
    """Bytes a triangle at the peak, in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        path = surface_cases.write_stl(f"{folder}/model.stl", surface_cases.waves(708, 300.0))
        done = subprocess.run(
            [sys.executable, __file__, "--measure", path], check=True, stdout=subprocess.PIPE, text=True
        )
    return float(done.stdout)


def peak_bytes():
    """The largest memory this process has had; getrusage would count its parent's."""
    with open("/proc/self/status") as file:
        return next(1024 * int(line.split()[1]) for line in file if line.startswith("VmHWM"))


def measure(path):
    """Growth of this process in bytes a triangle."""
    drop_cutter.Mesh(surface_cases.model_of(surface_cases.waves(12)), 3.0)
    before = peak_bytes()
    model = read_model(path, Placing())
    drop_cutter.Mesh(model, 3.0)
    print((peak_bytes() - before) / len(model.triangles))


def whole(step):
    """Rows of the command from file to file."""
    with tempfile.TemporaryDirectory() as folder:
        path = surface_cases.write_stl(f"{folder}/model.stl", surface_cases.waves(225, 100.0))
        began, clock = sum(os.times()[2:4]), time.monotonic()
        subprocess.run(
            [
                ROOT / "bin" / "chipwise",
                "surface",
                path,
                "-o",
                f"{folder}/out.ngc",
                "--tool",
                "4",
                "--step",
                str(step),
                "--link",
                "1",
                "--json",
                f"{folder}/out.json",
            ],
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        used, clock = sum(os.times()[2:4]) - began, time.monotonic() - clock
        with open(f"{folder}/out.json") as file:
            figures = json.load(file)
    yield row(
        "surface: STL to program, computing time",
        used,
        "s",
        f"{figures['sampled']} points, {clock:.0f} s on the clock",
        60,
    )
    yield row(
        "surface: lines a sampled point at 0.01 mm",
        figures["moves"] / figures["sampled"],
        "",
        f"{figures['moves']} moves, {figures['arcs']} of them arcs",
        1 / 3,
    )


DEMOS = {
    "hills, D6 ball": (lambda: surface_cases.waves(60), Shape(6, 3)),
    "step, D6 bull-nose": (
        lambda: np.concatenate(
            [surface_cases.box((0, 0, -5), (40, 40, 0)), surface_cases.box((10, 10, 0), (25.3, 24.1, 4))]
        ),
        Shape(6, 1),
    ),
    "sphere, D6 flat": (lambda: surface_cases.sphere(15.0, 90), Shape(6)),
}
RELIEF = 1.0  # mm, of the requests of DEMOS


def path():
    """Rows of gouges, links and contacts of the demo surfaces."""
    for name, (make, shape) in DEMOS.items():
        with tempfile.TemporaryDirectory() as folder:
            file = surface_cases.write_stl(f"{folder}/model.stl", make())
            known = dict(stamp=(name,), tool=shape, step=0.5, feed=1500.0, plunge_feed=600.0, start=START)
            plans = [surface_plan(surface_cases.request(file, link=link, **known)) for link in (0, 1, 2)]
            model = read_model(file, Placing())
        probe = drop_cutter.Probe(drop_cutter.Mesh(model, 3.0), shape, floor=float(model.low[2]))
        yield from gouges(name, plans[1], model, shape, probe)
        times = [link_seconds(plan) for plan in plans]
        yield row(
            f"surface: {name}, link time P1 / P0",
            times[1] / times[0],
            "",
            f"{times[0]:.1f}, {times[1]:.1f} and with P2 {times[2]:.1f} s",
            0.5,
        )
        yield row(
            f"surface: {name}, across and the last relief alone / P0",
            least_seconds(plans[0], probe) / times[0],
            "",
            "no straight one-way link goes below it",
        )
        yield traverses_in_stock(name, plans, shape)


def gouges(name, plan, model, shape, probe):
    """Rows of what a plan takes from the model."""
    points = np.concatenate(
        [
            p[1:] if isinstance(move, PlaneArc) else p[-1:]
            for move, (_kind, p) in zip(plan.moves, surface_judge.positions(plan.moves, START))
        ]
    )
    yield row(
        f"surface: {name}, deepest gouge along every move",
        float(probe.excess(points[2:-1], points[3:], 0.0)[0].max()),
        "mm",
        "",
        1e-3,
    )
    deepest, highest = surface_judge.gouge_and_rest(
        plan.moves, START, surface_cases.triangles_of(model), shape, float(model.low[2]), 60, 1
    )
    yield row(
        f"surface: {name}, the same by brute force at 60 points",
        max(0.0, deepest),
        "mm",
        f"highest {highest:.4f} mm, walls included",
        1e-3,
    )


def traverses_in_stock(name, plans, shape):
    """Row of the traverses that meet one of many needles."""
    contacts, links = 0, 0
    for plan in plans:
        depths = surface_judge.Needles(plan.low, plan.high, plan.high[2], 3000, 1).follow(plan.moves, START, shape)
        contacts, links = contacts + sum(depth > surface_judge.RIDGE for depth in depths), links + len(depths)
    return row(f"surface: {name}, traverses that meet stock", contacts, "", f"of {links}", 0)


def least_seconds(plan, probe):
    """Seconds of the links of P0 if corners, stock and the other axes cost nothing: across, Z meanwhile over the
    highest place of the model (drop.Probe) by the relief, as fast as Z alone can, and the last relief straight down."""
    total = 0.0
    for link in link_judge.links_of(plan.moves, START):
        start, end = link.before[1][0] if link.before else link.corners[0], link.after[1][1]
        top = float(probe.heights(np.linspace(start, end, 101)[:, :2]).max()) + RELIEF
        across = max(
            one_axis(np.abs(end - start)[:2].max()), one_axis(top - start[2]) + one_axis(top - end[2] - RELIEF)
        )
        total += across + link_judge.path_seconds(
            np.array([(0, 0, RELIEF), (0, 0, 0)]), np.full(2, np.inf), link.after[0] / 60
        )
    return total


def one_axis(length):
    """Seconds of an axis for a length (mm) from rest to rest."""
    return link_judge.path_seconds(np.array([(0.0, 0, 0), (max(length, 1e-6), 0, 0)]), np.full(2, np.inf))


def contacts(count, seed):
    """The row of contacts of random links."""
    began = cpu_s()
    links, met, deepest = surface_links.contacts(count, seed)
    yield row(
        "surface: links of random surfaces that meet stock",
        met,
        "",
        f"of {links}, seed {seed}, deepest {deepest:.3f} mm, {cpu_s() - began:.0f} s",
        0,
    )


def machine():
    """Rows of the links in LinuxCNC."""
    for name, (make, shape) in DEMOS.items():
        with tempfile.TemporaryDirectory() as folder:
            file = surface_cases.write_stl(f"{folder}/model.stl", make())
            known = dict(tool=shape, step=0.5, feed=1500.0, plunge_feed=600.0, start=None)
            known |= dict(stamp=(name, "machine"), placing=Placing((40.0, 40.0, -20.0)))
            found = [
                surface_links.machine_seconds(surface_plan(surface_cases.request(file, link=link, **known)), folder)
                for link in (0, 1)
            ]
        lost = max(lost for _seconds, lost in found)
        yield row(
            f"surface: {name}, link time P1 / P0 in LinuxCNC",
            found[1][0] / found[0][0],
            "",
            f"{found[0][0]:.1f} and {found[1][0]:.1f} s; {lost} gaps in the log",
            0.5,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=100_000)
    parser.add_argument("--step", type=float, default=0.055, help="mm, of the whole run: 0.055 gives 10^6 points")
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--measure", help=argparse.SUPPRESS)
    parser.add_argument("--only", choices=("path", "rest", "contacts", "machine"), help="one group of rows")
    parser.add_argument("--links", type=int, default=20_000, help="of contacts")
    parser.add_argument("--seed", type=int, default=10_000, help="of contacts")
    options = parser.parse_args()
    if options.only:
        groups = {
            "path": path,
            "rest": surface_rest.rows_of_rest,
            "contacts": lambda: contacts(options.links, options.seed),
            "machine": machine,
        }
        for line in groups[options.only]():
            print(f"{line['name']:75s} {line['value']:12.5g} {line['note']}", flush=True)
        return 0
    if options.measure:
        return measure(options.measure)
    rows = [
        *points(options.points),
        *whole(options.step),
        *path(),
        *surface_rest.rows_of_rest(),
        row("surface: memory a triangle, reading and bins", memory(), "bytes", "1,000,000 triangles", 150),
    ]
    for line in rows:
        print(
            json.dumps(line)
            if not options.table
            else f"{line['name']:60s} {line['value']:12.5g} {line['unit']:5s} {line['note']}"
        )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
