# SPDX-License-Identifier: GPL-2.0-or-later
"""Ten CAM styles under a limit of the side force, on the real LinuxCNC: the largest force of a turn, tooth by tooth.

Called by bench/run.py (prints JSON rows, of one program); by hand with --table: `/usr/bin/python3 bench/bench_force.py
--table --only estlcam_relief`.

 1. A program of tests/support/foreign.py runs at the rate of its M251 with no limit of the force.
    tests/support/judge_force.py says what the force of each tool was: from the servo-rate log, the blank and the tools
    alone.
 2. It runs again with a `deflection` at which each tool may have SHARE of its median, by its stick-out (STICK_OUT
    diameters, carbide).
 3. Judged is every servo period in which M251 holds and a feed cuts: the force of the period over the limit, and how
    much of the limit is used where limited-by says that it limits.  The first run is judged by the limit of the second
    as well.
"""

import re
import sys
import tomllib

import numpy as np

from roots import ROOT
from rows import by_program, row
from support import claims, foreign, judge_force
from support.claims import Condition

SHARE, STICK_OUT = 0.6, 4.0
PEAK, OVER, USED = 105.0, 0.2, 97.0  # %
BY_FORCE = 9  # volumetric-feed.limited-by
SMALLEST = 5.0  # N: a tool with less is not limited
MATERIAL = "6061"
STEP, ROUND_STEP = 0.04, 0.1  # mm between judged places; of programs with a tool that is not flat
SHORT = ("slots_three_depths",)  # what bench/run.py runs
HEAD = (
    f"{'program':20s} {'peak %':>7s} {'> 105 %, % of time':>18s} {'used %':>7s} {'limits % of time':>16s} "
    f"{'without %':>9s} {'time s':>7s} {'without':>7s}  limits"
)


def edges_of(tool):
    return 2 if tool.diameter < 4.0 else 3 if tool.diameter < 10.0 else 4


def spindle(program, log):
    """(n,) turns a second, of the S words."""
    lines = [re.sub(r"\([^)]*\)", "", line) for line in program.text.splitlines()]
    found = [
        (at, float(word.group(1)) / 60.0) for at, line in enumerate(lines, 1) if (word := re.search(r"S(\d+)", line))
    ]
    return np.array([speed for _at, speed in found])[claims.by_line(log, [at for at, _speed in found]).clip(0)]


def settings_of(program, limits, folder):
    """[CHIPWISE] of a run: material, and a tool geometry with edges and, for the tools in `limits` {number: N}, what
    bends them by that."""
    more = {n: [f"flutes = {edges_of(tool)}"] for n, (tool, _length) in program.tools.items()}
    for n, force in limits.items():
        out = STICK_OUT * program.tools[n][0].diameter
        more[n] += [
            f"stick_out = {out:g}",
            'material = "carbide"',
            f"deflection = {force / judge_force.stiffness(program.tools[n][0].diameter, out):.9f}",
        ]
    path = folder / "force.toml"
    path.write_text(foreign.geometry_file(program.tools, more))
    return {"MATERIAL": MATERIAL, "DEFAULT_CHIP": "no", "TOOL_GEOMETRY": str(path)}


def step_of(program):
    """mm between judged places."""
    return STEP if all(tool.corner == tool.angle == 0.0 for tool, _length in program.tools.values()) else ROUND_STEP


def forces(program, limits, folder, step):
    """(run, force (n,) N, whether M251 holds (n,), summary) of a run with these limits."""
    with open(ROOT / "remap/chipwise/tool_data/materials.toml", "rb") as handle:
        material = tomllib.load(handle)[MATERIAL]
    summary, path = claims.run(program, Condition(), folder, settings=settings_of(program, limits, folder))
    log = claims.loaded(path)
    run, tools, target = claims.told(program, log)
    force = judge_force.side_force(
        run,
        program.blank,
        tools,
        [edges_of(tool) for tool in tools],
        spindle(program, log),
        material["kc11"],
        material["mc"],
        step,
    )
    return run, force, target > 0.0, summary


def judged(program, limits, found):
    run, force, held, _summary = found
    limit = np.array([limits.get(n, 0.0) for n in sorted(program.tools)])[run.tool]
    return judge_force.judge(run, force, limit, held, run.columns["limited_by"] == BY_FORCE)


def measured(program, folder, step=None):
    """dict of the figures of a program.  step: mm between judged places; None: step_of()."""
    step = step or step_of(program)
    free = forces(program, {}, folder, step)
    run, force, held, _summary = free
    limits = {}
    for k, n in enumerate(sorted(program.tools)):
        some = force[held & run.feeding & (run.tool == k) & (force > SMALLEST)]
        if len(some):
            limits[n] = SHARE * float(np.median(some))
    found = forces(program, limits, folder, step)
    before, verdict = judged(program, limits, free), judged(program, limits, found)
    return {
        "program": program.name,
        "peak": verdict.peak,
        "over_share": verdict.over_share,
        "used": verdict.used,
        "limits_share": verdict.limits_share,
        "worst": verdict.worst,
        "without": before.peak,
        "time_s": float(found[0].took.sum()),
        "time_without_s": float(run.took.sum()),
        "limits": {n: round(force, 1) for n, force in limits.items()},
        "lost": run.lost + found[0].lost,
        "errors": found[3]["errors"],
    }


def line_of(f):
    if f["lost"]:
        return f"{f['program']:20s} VOID: {f['lost']} servo periods lost"
    return (
        f"{f['program']:20s} {100 * f['peak']:7.1f} {100 * f['over_share']:18.2f} {100 * f['used']:7.1f} "
        f"{100 * f['limits_share']:16.1f} "
        f"{100 * f['without']:9.1f} {f['time_s']:7.1f} {f['time_without_s']:7.1f}  {f['limits']} N, peak in line "
        f"{f['worst'][:1]} at {f['worst'][1:]}"
    )


def rows_of(f):
    """The rows of one program for build/bench.json."""
    if f["lost"]:
        return [row(f"{f['program']}: servo periods lost, void", f["lost"], "")]
    return [
        row(
            f"{f['program']}: largest side force of a turn",
            round(100 * f["peak"], 2),
            "%",
            target=PEAK,
            note=f"without the limit {100 * f['without']:.0f} %",
        ),
        row(f"{f['program']}: time above {PEAK:g} %", round(100 * f["over_share"], 3), "%", target=OVER),
        row(f"{f['program']}: used where it limits", round(100 * f["used"], 2), "%", f"wanted: at least {USED:g}"),
    ]


if __name__ == "__main__":
    by_program(sys.modules[__name__], foreign.programs)
