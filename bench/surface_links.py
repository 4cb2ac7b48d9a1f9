# SPDX-License-Identifier: GPL-2.0-or-later
"""Many links of random surfaces, judged apart: whether one meets stock.  Called by bench_surface.py."""

import dataclasses
import json
import sys
import tempfile

import numpy as np

import roots  # noqa: F401  sys.path
from chipwise.clib.height_map import Shape
from chipwise.cycles.surface import surface_plan
from chipwise.errors import CycleError
from support import link_judge, random_cases, surface_cases, surface_judge

START = (-5.0, -5.0, 20.0)
A_NEEDLE = 12.0  # needles a mm2


def triangles(rng):
    """A random model of about 9 mm."""
    size = rng.uniform(6, 12, 2)
    kind = rng.integers(0, 4)
    if kind == 0:
        x, y = np.linspace(0, size[0], 25), np.linspace(0, size[1], 25)
        wave = rng.uniform(0.2, 1.5, 2)
        return surface_cases.terrain(
            x, y, rng.uniform(0.3, 3) * np.sin(wave[0] * x + rng.uniform(0, 6))[None, :] * np.cos(wave[1] * y)[:, None]
        )
    if kind == 1:
        low = rng.uniform(0.5, 3, 2)
        block = surface_cases.box((*low, 0), (*(low + rng.uniform(1, 4, 2)), rng.uniform(0.5, 4)))
        return np.concatenate([surface_cases.box((0, 0, -1), (*size, 0)), block])
    if kind == 2:
        return surface_cases.sphere(float(rng.uniform(2, 5)), 32) * rng.uniform(0.4, 1, 3)
    y = np.linspace(0, size[1], 49)
    depth = np.abs((y + rng.uniform(0, 4)) % 4 - 2) * rng.uniform(0.2, 2)
    return surface_cases.terrain(np.linspace(0, size[0], 3), y, np.repeat(depth[:, None], 3, axis=1))


def request(rng, file, number):
    diameter = float(rng.uniform(1.0, 4.0))
    corner, tip = [(0, 0), (diameter / 2, 0), (diameter / 5, 0), (0, 60), (diameter / 6, 20)][rng.integers(0, 5)]
    levels = rng.random() < 0.3
    made = surface_cases.request(
        file,
        stamp=(number,),
        tool=Shape(diameter, corner, tip),
        step=float(rng.uniform(0.1, 0.4)) * diameter,
        feed=1500.0,
        plunge_feed=600.0,
        start=START,
        direction=float(rng.integers(0, 360)),
        relief=float(rng.choice([0.1, 0.3, 1.0, 1.5])),
        link=2 if levels and rng.random() < 0.3 else 1,
        cell=float(rng.choice([0.1, 0.15, 0.25])),
        tolerance=0.03,
        climb=bool(rng.integers(0, 2)),
        allowance=float(rng.choice([0.0, 0.2])),
        depth=float(rng.uniform(0.5, 2)) if levels else None,
    )
    return made if rng.random() < 0.7 else rest(rng, made)


def rest(rng, made):
    """What a tool of twice to three times the diameter has left, zigzag or not; one half of them has been cut in
    another direction."""
    large = Shape(float(rng.uniform(2, 3)) * made.tool.diameter, 0.0)
    before = dataclasses.replace(
        made,
        tool=dataclasses.replace(large, corner_radius=float(rng.choice([0.0, 0.5])) * large.diameter),
        step=0.3 * large.diameter,
    )
    least, link, turn = (
        float(rng.uniform(0.05, 0.2)),
        int(rng.integers(1, 3)),
        float(rng.choice([0, rng.integers(1, 180)])),
    )
    before = dataclasses.replace(before, direction=(made.direction + turn) % 360)
    return dataclasses.replace(made, depth=None, allowance=0.0, least=least, link=link, earlier=(before,))


EXACT = "G64 P0.002"  # of the cuts
SPEED = 5  # of the simulated machine's time: the log loses samples on a busy computer
LEAP = 0.25  # mm in a servo period, twice what the mill does: samples are missing


def machine_seconds(plan, folder):
    """(seconds of the links of a plan on the simulated mill, gaps in the log): lines with G0, the line after them, and
    a lift before."""
    from chipwise.headless import runner
    from chipwise.gcode_lines import texts

    lines = [
        "G21 G17 G40 G49 G54 G80 G90 G94 G91.1",
        EXACT,
        f"G0 Z{plan.clearance:.4f}",
        "G0 X{:.4f} Y{:.4f}".format(*plan.first),
    ]
    lines += [*texts(plan.moves, (*plan.first, plan.clearance), 1.0, 4, EXACT), "M2", ""]
    with open(f"{folder}/links.ngc", "w") as file:
        file.write("\n".join(lines))
    summary = runner.run_headless(f"{folder}/links.ngc", speed=SPEED, timeout=1200, log=f"{folder}/log.npz")
    if not summary["finished"]:
        raise SystemExit(f"LinuxCNC: {summary['errors']}")
    with np.load(f"{folder}/log.npz") as log:
        place, number, period = np.column_stack([log[k] for k in "xyz"]), log["line"].astype(int), float(log["period"])
    spent, in_link, total, first = np.bincount(number, minlength=len(lines) + 1) * period, False, 0.0, True
    for k, line in enumerate(lines):
        if line.startswith("G0"):
            if (
                not in_link
                and lines[k - 1].startswith("G1")
                and lines[k - 1].split()[1:3] == line.split()[1:3] == lines[k - 2].split()[1:3]
            ):
                total += spent[k]
            total, in_link = total + spent[k + 1], True
        elif line.startswith("G1") and in_link:
            total, in_link = (
                (0.0 if first else total + spent[k + 1]),
                False,
            )  # what leads to the first cut does not count
            first = False
    return total, int((np.linalg.norm(np.diff(place, axis=0), axis=1) > LEAP).sum())


def places(moves, depths, straight):
    """A line of text for each traverse that meets stock: how deep, and from where to where it goes."""
    made = (surface_judge.positions if straight else link_judge.rounded_positions)(moves, START)
    traverses = [points for is_rapid, points in made if is_rapid]
    return [
        f"{depth:.3f} mm from X{a[0]:.3f} Y{a[1]:.3f} Z{a[2]:.3f} to X{b[0]:.3f} Y{b[1]:.3f} Z{b[2]:.3f}"
        for depth, (a, *_, b) in zip(depths, traverses, strict=True)
        if depth > surface_judge.RIDGE
    ]


def contacts(count, seed):
    """(links, those that meet stock by more than the ridges of the judge, the deepest in mm): corners as they are, or
    rounded, by turns."""
    links, met, deepest, case = 0, 0, 0.0, seed
    with tempfile.TemporaryDirectory() as folder:
        while links < count:
            rng = np.random.default_rng(case)
            r = request(rng, surface_cases.write_stl(f"{folder}/model.stl", triangles(rng)), case)
            try:
                plan = surface_plan(r)
            except CycleError as error:
                print(f"seed {case}: {error}", file=sys.stderr)
                case += 1
                continue
            before = [(surface_plan(one).moves, one.tool) for one in r.earlier]
            area = (plan.high[0] - plan.low[0]) * (plan.high[1] - plan.low[1])
            needles = surface_judge.Needles(plan.low, plan.high, plan.high[2] + r.allowance, int(A_NEEDLE * area), case)
            straight = case % 2 == 0
            for moves, tool in before:
                needles.follow(moves, START, tool)
            depths = needles.follow(
                plan.moves, START, r.tool, surface_judge.positions if straight else link_judge.rounded_positions
            )
            bad = sum(depth > surface_judge.RIDGE for depth in depths)
            links, met, deepest = (
                links + len(link_judge.links_of(plan.moves, START)) + 1,
                met + bad,
                max(deepest, max(depths)),
            )
            if bad:
                where = random_cases.write_replay(f"surface_links_{case}", dict(dataclasses.asdict(r), seed=case))
                print(
                    f"seed {case}: {bad} contacts, {max(depths):.3f} mm deep; {where}",
                    *places(plan.moves, depths, straight),
                    sep="\n  ",
                    file=sys.stderr,
                )
            case += 1
    return links, met, deepest


if __name__ == "__main__":
    print(json.dumps(contacts(int(sys.argv[1]), int(sys.argv[2]))))
