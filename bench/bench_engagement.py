# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 P4 against its targets: engagement, length, time, planning; nine shapes and random pockets.

    /usr/bin/python3 bench/bench_engagement.py [--count 40] [--first 0] [--strategy 4]

Engagement by tests/support/engagement_judge.py (exact), everything else by tests/support/pocket_oracle.py.  Tool 6 mm,
D 2.4 mm, F1500, one level.  LB: area the tool reaches / D.  Length: at the feed at the level, without the helix.  Time:
500 mm/s2, rapids of 6000 mm/min from and to standstill, bends as slow as the acceleration asks; without the descents.
Blended: rapids of links without a stop at ends that are tangent.
Degrees are above nominal.
"""

import argparse
import math
import time
from dataclasses import replace

import numpy as np

from roots import ROOT
from support import engagement_judge, hole_oracle
from support.engagement_shapes import SHAPES
from support.pocket_judge import random_request, verdict
from chipwise.cycles import pocket
from chipwise.errors import CycleError
from chipwise.geometry.base import elements
from chipwise.geometry.pocket.machinable import split
from chipwise.geometry.base.contour import make_contour

RADIUS, STEP, FEED, ACCEL, RAPID = 3.0, 2.4, 25.0, 500.0, 100.0
SHARP = 0.1  # rad: a corner at which the path stops
NEAR = 0.1  # mm over the level that a feed still belongs to it
LIFTED = 0.5  # mm over the level that a rapid of a link stays below


def request(loops, strategy=4, **fields):
    return pocket.PocketRequest(
        loops=loops,
        bottom=-3.0,
        clearance=1.0,
        tool_radius=RADIUS,
        step=STEP,
        feed=60 * FEED,
        plunge_feed=300.0,
        start=(0.0, 0.0, 10.0),
        strategy=strategy,
        **fields,
    )


def least_length(loops):
    """Area that the tool reaches, over the step-over."""
    contours = [make_contour(parts) for parts in loops]
    area = 0.0
    for region in split(contours[0], contours[1:], RADIUS):
        border = sum(elements.lengths(c).sum() for c in region.contours)
        area += region.area + RADIUS * border + math.pi * RADIUS**2 * (1 - len(region.holes))
    return area / STEP


def seconds(moves, level, blended=False):
    """Estimated time of what runs at and near a level, helix left out; blended: rapids there do not stop."""
    total, run, across = 0.0, [], []
    for e in moves:
        highest = max(e.a[2], e.b[2])
        if highest < level + NEAR if e.kind != "rapid" else blended and highest < level + LIFTED:
            total, across = total + rapid_seconds(across), []
            run.append(e)
            continue
        total, run = total + feed_seconds(run), []
        if e.kind == "rapid" and min(e.a[2], e.b[2]) < 0.5:
            if across and not straight(across[-1], e):
                total, across = total + rapid_seconds(across), []
            across.append(e)
    return total + feed_seconds(run) + rapid_seconds(across)


def straight(a, b):
    """Whether a rapid goes on from the one before without a stop."""
    u, v = np.subtract(a.b, a.a), np.subtract(b.b, b.a)
    return u @ v > math.cos(SHARP) * np.linalg.norm(u) * np.linalg.norm(v)


def rapid_seconds(run):
    length = sum(math.dist(e.a, e.b) for e in run)
    return 2 * math.sqrt(length / ACCEL) if length < RAPID**2 / ACCEL else length / RAPID + RAPID / ACCEL


def heading(e, at_end):
    if e.centre is None:
        return math.atan2(e.b[1] - e.a[1], e.b[0] - e.a[0])
    start, turn = e.sweep
    return start + (turn if at_end else 0.0) + math.copysign(math.pi / 2, turn)


def feed_seconds(run):
    """From standstill to standstill along feeds."""
    run = [e for e in run if e.centre is not None or math.dist(e.a, e.b) > 1e-9]
    if not run:
        return 0.0
    size = np.array([math.dist(e.a, e.b) if e.centre is None else e.radius * abs(e.sweep[1]) for e in run])
    bend = [math.inf if e.centre is None else math.sqrt(ACCEL * e.radius) for e in run]
    most = np.array([min(RAPID if e.kind == "rapid" else FEED, fastest) for e, fastest in zip(run, bend)])
    at = np.concatenate(([0.0], np.minimum(most[:-1], most[1:]), [0.0]))
    for k in range(1, len(run)):
        if abs(math.remainder(heading(run[k], False) - heading(run[k - 1], True), 2 * math.pi)) > SHARP:
            at[k] = 0.0
    for k in range(len(run)):
        at[k + 1] = min(at[k + 1], math.sqrt(at[k] ** 2 + 2 * ACCEL * size[k]))
    for k in reversed(range(len(run))):
        at[k] = min(at[k], math.sqrt(at[k + 1] ** 2 + 2 * ACCEL * size[k]))
    peak = np.minimum(most, np.sqrt((at[:-1] ** 2 + at[1:] ** 2) / 2 + ACCEL * size))
    even = np.maximum(0.0, size - (2 * peak**2 - at[:-1] ** 2 - at[1:] ** 2) / (2 * ACCEL))
    return float(((2 * peak - at[:-1] - at[1:]) / ACCEL + even / peak).sum())


def measured(loops, strategy):
    """Figures of one shape."""
    asked = request(loops, strategy)
    begun = time.process_time()
    plan = pocket.pocket_plan(asked)
    planning = time.process_time() - begun
    moves = hole_oracle.walk(plan.moves, asked.start)
    found = engagement_judge.engagement(moves, asked.bottom, RADIUS)
    nominal, least = math.acos(1 - STEP / RADIUS), least_length(loops)
    limit = nominal + math.radians(10)
    sloped = sum(math.dist(e.a, e.b) for e in moves if e.kind != "rapid" and 1e-6 < e.a[2] - asked.bottom < NEAR)
    return dict(
        length=(found.length() + sloped) / least,
        time=seconds(moves, asked.bottom) / (least / FEED),
        blended=seconds(moves, asked.bottom, True) / (least / FEED),
        p99=math.degrees(found.percentile(0.99) - nominal),
        most=math.degrees(found.most - nominal),
        over=found.length(limit),
        full=found.length(engagement_judge.FULL),
        air=1 - found.length(engagement_judge.AIR) / found.length(),
        lifts=sum(m.kind == "rapid" and m.b[2] > 0.5 for m in moves),
        moves=len(plan.moves),
        planning=planning,
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=0, help="random pockets")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--strategy", type=int, default=4)
    args = parser.parse_args()
    print(
        f"{ROOT.name}: shape, length/LB, time/LB, blended, p99 and most above nominal (degrees), mm over 10 degrees, "
        f"full slot mm, air %, rapids to R, moves, planning s"
    )
    rows = []
    for name, loops in SHAPES.items():
        try:
            rows.append(row := measured(loops, args.strategy))
            print(
                f"{name:20s} {row['length']:.2f} {row['time']:.2f} {row['blended']:.2f} {row['p99']:6.1f} "
                f"{row['most']:6.1f} {row['over']:5.1f} {row['full']:5.2f} {100 * row['air']:4.0f}"
                f" {row['lifts']:3d} {row['moves']:6d} {row['planning']:.2f}",
                flush=True,
            )
        except CycleError as error:
            print(f"{name:20s} {error}")
    print(
        f"{'median':20s} {np.median([r['length'] for r in rows]):.2f} {np.median([r['time'] for r in rows]):.2f} "
        f"{np.median([r['blended'] for r in rows]):.2f} "
        f"{np.median([r['p99'] for r in rows]):6.1f}"
    )
    refused = cleared = 0
    for seed in range(args.first, args.first + args.count):
        asked = random_request(seed, args.strategy)
        asked = replace(asked, step=min(asked.step, 0.8 * asked.tool_radius))
        faults, plan = verdict(asked, seed, 2500)
        refused += bool(faults) and faults[0].startswith("refused")
        cleared += plan is not None and not faults
        if faults or plan is None:
            print(f"seed {seed}: {faults or 'fits nowhere'}", flush=True)
    if args.count:
        print(f"random pockets from {args.first}: {args.count}, cleared without a fault {cleared}, refused {refused}")


if __name__ == "__main__":
    main()
