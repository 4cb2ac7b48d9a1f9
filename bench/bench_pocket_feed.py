# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 P0 against P4 in the simulated mill, both under M251 with the same limits of removal rate and chip: cycle times.

Called by bench/run.py with one pocket (prints JSON rows).  In full:

    /usr/bin/python3 bench/bench_pocket_feed.py --table [--shapes rectangle,L,..] [--depths 6,12] [--limits
    slot,side,half,levels,force]

The nine pockets of tests/support/engagement_shapes.py, tool 6 mm, D 2.4 mm, 6061, one level of one or two diameters, a
stock 1 mm below R.  M251 P2 with a ceiling of 3000 mm/min, 3 edges at 10,000 rpm with a largest chip of 0.05 mm: 1500
mm/min where the tool cuts half of its width or more.  The removal rate is one of

  slot    what a full slot gives at that feed: the chip alone limits
  side    what a side cut of D gives at that feed: full slots are slower
  half    half of that
  levels  what a side cut of D one diameter deep gives at that feed; P0 clears in levels of one diameter, P4 at once
  force   as slot, and the tool (carbide, sticks out 30 mm) may bend by 0.02 mm

The time is that in which the tool moves, helix and traverses included: what planning takes beside other work on a clock
that runs six times as fast is not the machine's.
"""

import argparse
import json
import math
import tempfile
from pathlib import Path

import numpy as np

import roots  # noqa: F401  the path to chipwise
from chipwise.geometry.base.contour import ArcElement
from chipwise.headless import runner
from rows import row
from support.engagement_shapes import SHAPES
from support.speed_log import Log

SPEED, SECONDS = 6, 1800.0  # of the clock; s that a run may take
RADIUS, STEP, CEILING = 3.0, 2.4, 3000.0
SPINDLE, EDGES, CHIP, BENDING = 10000, 3, 0.05, 0.02
SLOT, SIDE = 2 * RADIUS, STEP  # width of the cut
SHARE = {"slot": SLOT, "side": SIDE, "half": 0.5 * SIDE, "levels": SIDE, "force": SLOT}
CUTTING_MM2 = 0.01  # smaller section areas count as air
BESIDE, BELOW = 5.0, 3.0  # mm of stock about and under the pocket


def rate(depth, limit):
    """cm3/min."""
    return SHARE[limit] * (2 * RADIUS if limit == "levels" else depth) * SPINDLE * EDGES * CHIP / 1000.0


def program(shape, strategy, depth, limit):
    """The text of a program."""
    pass_ = 2 * RADIUS + 0.5 if limit == "levels" and strategy == 0 else depth + 2  # R is 1 mm above the stock
    lines, ends = [], np.array([part.start for loop in SHAPES[shape] for part in loop])
    low, size = ends.min(axis=0) - BESIDE, np.ptp(ends, axis=0) + 2 * BESIDE
    if shape == "circle":  # one arc, from the right back to there
        low, size = np.array((-30.0, -30.0)), np.array((60.0, 60.0))
    for loop in SHAPES[shape]:
        lines.append("G0 X{:.6f} Y{:.6f}".format(*loop[0].start))
        for part in loop:
            word = ""
            if isinstance(part, ArcElement):
                word = " I{:.6f} J{:.6f}".format(*(c - s for c, s in zip(part.centre, part.start)))
            code = "G1" if not word else "G3" if part.ccw else "G2"
            lines.append(f"{code} X{part.end[0]:.6f} Y{part.end[1]:.6f}{word}")
    return "\n".join(
        (
            "(MATERIAL,NAME=6061)",
            "o179 sub",
            *lines,
            "o179 endsub",
            "G21 G90 G17 G40 G64 P0.01",
            "T1 M6",
            "G43 H1",
            f"M250 P{low[0]:.6f} Q{low[1]:.6f} R{-depth - BELOW:g} I{size[0]:.6f} J{size[1]:.6f} K{depth + BELOW:g}",
            f"M251 P2 Q{rate(depth, limit):g} E{CEILING:g}",
            f"S{SPINDLE} M3",
            f"G0 X{ends[0][0]:.6f} Y{ends[0][1]:.6f} Z5",
            "F1500",
            f"G79 Q179 P{strategy} Z{-depth:g} J{pass_:g} R1 D{STEP:g} E300",
            "M252",
            "G0 Z5",
            "M5",
            "M2",
            "",
        )
    )


def geometry(limit):
    """A tool geometry file with tool 1."""
    more = f'material = "carbide"\nstick_out = 30\ndeflection = {BENDING:g}\n' if limit == "force" else ""
    return f'[tool.1]\nshape = "flat"\nflute_length = 25\nflutes = {EDGES}\nchip_load = {CHIP:g}\n{more}'


def run(shape, strategy, depth, limit, folder):
    """What judged() has of a run."""
    path, tools = folder / f"{strategy}.ngc", folder / "tools.toml"
    path.write_text(program(shape, strategy, depth, limit))
    tools.write_text(geometry(limit))
    found = runner.run_headless(
        str(path),
        runner.Machine(settings={"TOOL_GEOMETRY": str(tools)}),
        speed=SPEED,
        timeout=SECONDS,
        log=str(folder / f"{strategy}.npz"),
    )
    if found["exit_status"] or found["errors"]:
        raise RuntimeError(f"bench: {shape} P{strategy}: {found['errors']}")
    log = Log(folder / f"{strategy}.npz")
    moves, cuts = np.diff(log.toolpath, prepend=0.0) > 0.0, log.area > CUTTING_MM2
    feeds = moves & log.feeding
    return {
        "seconds": float(log.took[moves].sum()),
        "cut": float(log.took[feeds & cuts].sum()),
        "air": float(log.took[feeds & ~cuts].sum()),
        "mean": found["rate_mean"],
        "peak": found["rate_peak"],
    }


def judged(shape, depth, limit):
    """Of a pocket: {P: seconds of motion, of feeds that cut and that do not; removal rates (mm3/min), mean while it
    cuts and peak}."""
    with tempfile.TemporaryDirectory(prefix="chipwise-bench.") as scratch:
        return {strategy: run(shape, strategy, depth, limit, Path(scratch)) for strategy in (0, 4)}


def line(shape, depth, limit, found):
    """A row of the table."""
    p0, p4 = found[0], found[4]
    each = " | ".join(
        f"{one['seconds']:.1f}, {one['cut']:.1f} | {one['mean'] / 1000:.1f}, {one['peak'] / 1000:.1f}"
        for one in (p0, p4)
    )
    return (
        f"| {shape} | {depth:g} | {limit} | {rate(depth, limit):.1f} | {each} | {p4['seconds'] / p0['seconds']:.2f} |"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--shapes")
    parser.add_argument("--depths")
    parser.add_argument("--limits")
    given = parser.parse_args()
    shapes = given.shapes.split(",") if given.shapes else list(SHAPES) if given.table else ["rectangle"]
    depths = [float(d) for d in given.depths.split(",")] if given.depths else [6.0, 12.0] if given.table else [6.0]
    limits = given.limits.split(",") if given.limits else list(SHARE) if given.table else ["side"]
    ratios = {}
    for limit in limits:
        for depth in depths:
            for shape in shapes:
                found = judged(shape, depth, limit)
                ratio = found[4]["seconds"] / found[0]["seconds"]
                ratios.setdefault((depth, limit), []).append(ratio)
                if given.table:
                    print(line(shape, depth, limit, found), flush=True)
                else:
                    print(
                        json.dumps(
                            row(
                                f"{shape}, {depth:g} mm deep, {limit}: time of P4 / P0",
                                round(ratio, 3),
                                "x",
                                f"{found[4]['seconds']:.1f} s, {found[0]['seconds']:.1f} s",
                            )
                        )
                    )
    if given.table:
        for (depth, limit), of in ratios.items():
            print(
                f"median, {depth:g} mm, {limit}: {np.median(of):.2f} ({min(of):.2f} to {max(of):.2f}, {len(of)} "
                f"pockets)"
            )
    assert all(math.isfinite(one) for of in ratios.values() for one in of)


if __name__ == "__main__":
    main()
