# SPDX-License-Identifier: GPL-2.0-or-later
"""The claims on programs nobody here wrote: every program of nc_files/ and ten foreign ones, on the real LinuxCNC.

Called by bench/run.py (prints JSON rows) and bench/bench_limits.py; by hand with --table:
`/usr/bin/python3 bench/bench_claims.py --table --only estlcam_relief --count 3 --seed 5`.

 1. A program (nc_files/ or tests/support/foreign.py) runs under a condition: path mode, acceleration, servo period,
    feed override, metric or inch machine.  Every program runs under CONDITIONS[0]; `--count` of the others, drawn by
    the seed, follow.  Only the INI file, the line with the path mode and the tool table are made for it.
 2. tests/support/judge.py says what the tool removed; nothing of that comes from the tracker.  Its own error is in the
    table.
 3. cycle / optimum: a second run with a target out of reach gives the velocity the planner allows; the rest as in
    bench_time.py, with the judge's section area.
 4. A run in which servo periods were lost is void and says so.

The target of a run with a feed override: TARGET_SCALE below, as docs/design/hal.md has it.
"""

import argparse
import json
import random
import re
import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from roots import ROOT
import bench_time
from support.claims import Condition
from support import claims, foreign, foreign_post, speed_log
from support import judge as judging
from chipwise.headless import runner
from rows import row

PEAK, SHARE = 102.0, 0.0
CYCLE = {"long": 1.01, "small": 1.03}
SMALL = {"cam_part", "estlcam_relief", "taper_two_tools", "spiral_round", "vectric_vcarve", "pocket_concentric"}
VOLUME = 0.003


PATHS = ("G61", "G61.1", "G64", "G64 P0.02", "G64 P0.05 Q0.02", "G64 P0.2")
ACCELS = (50.0, 150.0, 500.0, 1000.0, 2000.0)
PERIODS = (0.5, 1.0, 2.0)
OVERRIDES = (0.5, 0.8, 1.0, 1.0, 1.2)


def conditions(seed, count):
    """The plain one, and `count` drawn from the matrix."""
    rng = random.Random(f"conditions {seed}")
    return [Condition()] + [
        Condition(rng.choice(PATHS), rng.choice(ACCELS), rng.choice(PERIODS), rng.choice(OVERRIDES), rng.random() < 0.3)
        for _ in range(count)
    ]


def own_tools(text):
    """{number: (judging.Tool, length)} of the tools a program of nc_files/ changes to; they are flat in the sample
    table."""
    diameters = dict(re.findall(r"^T(\d+) .*?\bD([\d.]+)", (ROOT / "configs" / "mill.tbl").read_text(), re.M))
    return {
        int(number): (judging.Tool(float(diameters[number])), 0.0) for number in re.findall(r"^T(\d+)\s*M6", text, re.M)
    }


def own_programs():
    """{name: foreign_post.Program} of nc_files/, described by their own comments and the sample tables."""
    found = {}
    for path in sorted((ROOT / "nc_files").glob("*.ngc")):
        text = path.read_text()
        if not re.search(r"^M251", text, re.M):
            continue
        _radius, low, high, _target = bench_time.facts(text)
        found[path.stem] = foreign_post.Program(
            path.stem, text, judging.Blank.corners(low, high), own_tools(text), "own"
        )
    return found


# --- cycle / optimum ----------------------------------------------------------------------------


def timed(run_, toolpath):
    """What bench_time's functions want of a log."""
    speed = np.diff(toolpath, prepend=toolpath[:1]) / run_.took.clip(1e-9)
    return SimpleNamespace(
        tips=run_.tips,
        toolpath=toolpath,
        motion=run_.motion,
        line=run_.line,
        took=run_.took,
        speed=speed,
        period=run_.period,
        feeding=run_.feeding,
    )


def optimum(run_, swept, free_run, target, accel, allowed=None):
    """cycle / optimum over the whole run (s / s).  allowed (n,): mm/s that other limits than the rate allow."""
    held = timed(run_, np.cumsum(np.linalg.norm(np.diff(run_.tips, axis=0, prepend=run_.tips[:1]), axis=1)))
    free = timed(free_run, np.cumsum(np.linalg.norm(np.diff(free_run.tips, axis=0, prepend=free_run.tips[:1]), axis=1)))
    rows, other_rows = speed_log.Log.places(held), speed_log.Log.places(free)
    other_way = bench_time.matched(held, rows, free, other_rows)
    accel_of = bench_time.accelerations((held, free), accel)
    moving = np.concatenate([[True], np.diff(free.toolpath) > 1e-9])
    actual = best = 0.0
    for first, last in bench_time.blocks(run_.feeding & (target > 0)):
        a, b = held.toolpath[first - 1], held.toolpath[last - 1]
        if b - a < 1e-6:
            continue
        toolpath = np.linspace(a, b, max(3, int((b - a) / bench_time.SLACK_MM) + 1))
        planner = np.interp(
            np.interp(toolpath, held.toolpath[rows], other_way), free.toolpath[moving], free.speed[moving]
        )
        planner = np.maximum(planner, np.minimum(np.interp(toolpath, held.toolpath, held.speed), 0.5))
        index = np.searchsorted(held.toolpath[first:last], toolpath).clip(0, last - first - 1) + first
        gain = np.array([accel_of.get(place, accel) for place in zip(held.line[index], held.motion[index])])
        stock = target[index] / np.maximum(swept.area[index], 1e-9)
        if allowed is not None:
            stock = np.minimum(stock, allowed[index])
        best += bench_time.fastest(toolpath, np.minimum(planner, stock), gain)[0]
        actual += float(held.took[first:last].sum())
    other = float(held.took.sum()) - actual
    return (actual + other) / (best + other)


# --- one line of the table ------------------------------------------------------------------------


def measure(program, condition, folder, with_optimum=True, speed=claims.SPEED):
    """dict of one run's figures; with_optimum: a second run with a target out of reach, for cycle / optimum."""
    result, run_, swept, target = claims.measure(program, condition, folder, speed)
    if with_optimum and result["finished"] and not run_.lost:
        _summary, free_path = claims.run(program, condition, folder, free=True, speed=speed)
        free_run = claims.told(program, claims.loaded(free_path))[0]
        result["cycle_ratio"] = optimum(run_, swept, free_run, target, condition.accel)
    return result


def rows_of(f):
    """The rows of one run for build/bench.json."""
    name = f"{f['program']}, {f['condition']}"
    if f["lost"]:
        return [row(f"{name}: servo periods lost, void", f["lost"], "")]
    made = [
        row(
            f"{name}: peak rate, 10 ms",
            round(100 * f["peak_10ms"], 2),
            "%",
            target=PEAK,
            note=f"line {f['worst'][1]} at X{f['worst'][2]} Y{f['worst'][3]} Z{f['worst'][4]}" if f["worst"] else "",
        ),
        row(f"{name}: cutting time above 102 %", round(100 * f["over_share"], 3), "%", target=SHARE),
        row(f"{name}: peak rate, 1 ms", round(100 * f["peak_1ms"], 2), "%"),
        row(
            f"{name}: volume, tracker less judge",
            round(100 * f["volume_off"], 3),
            "%",
            f"judge's own error {100 * f['own_error']:.2f} %; "
            f"{'meets' if abs(f['volume_off']) <= VOLUME else 'MISSES'} 0.3",
        ),
        row(
            f"{name}: stops and seconds without stock",
            f["stops"] + f["fallback_s"],
            "",
            target=0,
            note="; ".join(f["errors"])[:200],
        ),
    ]
    if f["cycle_ratio"]:
        made.append(
            row(
                f"{name}: cycle / optimum",
                round(f["cycle_ratio"], 4),
                "x",
                target=CYCLE["small" if f["program"] in SMALL else "long"],
            )
        )
    return made


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", default=[], help="programs")
    parser.add_argument("--seed", default="1", help="of the foreign programs and of the conditions")
    parser.add_argument("--count", type=int, default=0, help="conditions beside the plain one, for each program")
    parser.add_argument("--foreign", action="store_true", help="not those of nc_files/")
    parser.add_argument("--no-plain", action="store_true", help="only the drawn conditions")
    parser.add_argument("--no-optimum", action="store_true", help="one run less each")
    parser.add_argument("--speed", type=float, default=claims.SPEED)
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--keep", help="folder for programs and logs")
    parser.add_argument("--json", help="file for all figures")
    options = parser.parse_args()
    chosen = {} if options.foreign else own_programs()
    chosen.update(foreign.programs(options.seed))
    if options.only:
        chosen = {name: made for name, made in chosen.items() if name in options.only}
    if options.table:
        print(claims.HEAD, flush=True)
    everything = []
    for name, program in chosen.items():
        for number, condition in enumerate(
            conditions(f"{options.seed} {name}", options.count)[int(options.no_plain) :]
        ):
            with tempfile.TemporaryDirectory() as scratch:
                folder = Path(options.keep or scratch) / f"{name}-{number + int(options.no_plain)}"
                folder.mkdir(parents=True, exist_ok=True)
                try:
                    found = measure(program, condition, folder, not options.no_optimum, options.speed)
                except runner.RunError as error:
                    print(f"{name} {condition}: {error}", flush=True)
                    continue
            everything.append(found)
            if options.table:
                print(claims.line_of(found), flush=True)
                for place in found["places"][:4]:
                    print("    %.3f for %g ms, line %d at X%g Y%g Z%g" % tuple(place), flush=True)
            else:
                for made in rows_of(found):
                    print(json.dumps(made), flush=True)
            if options.json:
                Path(options.json).write_text(json.dumps(everything, indent=1))


if __name__ == "__main__":
    main()
