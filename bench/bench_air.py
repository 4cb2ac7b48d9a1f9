# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs whose rapids are G1, set up with `chipwise setup --air --yes`: time against the same with rapids, and what
the tool meets how fast.

Called by hand: `/usr/bin/python3 bench/bench_air.py --only trochoid --seed 7`.

 1. The programs are those of rapids_as_feeds.py.  Four runs each, on the simulated mill: rapids as G1 with the set-up,
    and without it; with G0 and a set-up that is the same but for air, and without one.
 2. tests/support/judge.py says from the servo-rate log, the blank and the tool alone what was removed in every window
    of 10 ms in which only feeds run.
 3. A contact is a period in which a feed removes something behind 20 ms in which none does.  It is above the load's
    feed if the tool is more than 2 % faster there than target / area in 10 ms, than the ceiling times F, or, going
    down, than F.  The same is counted for every period of cutting.
"""

import argparse
import json
import re
import tempfile
from pathlib import Path

import numpy as np

import rapids_as_feeds
import roots  # noqa: F401  puts tests/ and remap/ on the path
from bench_set_up import confirmed, feeds_of
from chipwise.errors import MM_PER_INCH
from support import claims, foreign
from support import judge as judging
from support.operate import operate

SEED, SPEED, CELL, FALL, APART_S, OVER = "41", 4.0, 0.01, 1e-3, 0.02, 1.02
HEAD = (
    f"{'program':15s} {'peak 10 ms %':>12s} {'contacts':>8s} {'too fast':>8s} {'v / ceiling':>11s} {'down / F':>8s} "
    f"{'G1 at F s':>9s} {'set up s':>8s} "
    f"{'G0 at F s':>9s} {'set up s':>8s} {'ratio':>6s} {'errors':>6s}"
)


def set_up(path, program, ini, *options):
    """Job of a program, confirmed."""
    blank = program.blank
    corners = [
        blank.x - blank.size_x / 2,
        blank.y - blank.size_y / 2,
        blank.low,
        blank.x + blank.size_x / 2,
        blank.y + blank.size_y / 2,
        blank.high,
    ]
    return confirmed(path, ini, [f"{value:.4f}" for value in corners], *options)


def runs(program, folder):
    """({name: (errors, log)}, Job): of G1 and G0, with the set-up and bare."""
    table, geometry, ini = (folder / f"part{end}" for end in (".tbl", ".toml", ".ini"))
    table.write_text(foreign.tool_table(program.tools, 1.0))
    geometry.write_text(foreign.geometry_file(program.tools))
    ini.write_text(claims.ini_text(claims.Condition(), table, geometry))
    steps, home, kept = [], ["mdi", "G53 G0 X0 Y0 Z100"], None
    for name in ("G1", "G0"):
        for bare in (False, True):
            path = folder / f"{name}{'_bare' * bare}.ngc"
            path.write_text(program.text(name == "G0"))
            steps += [
                ["open", str(path)],
                home,
                *([] if bare else [["messages", f"{path.name}: set up as confirmed"]]),
                ["log", str(path)],
            ]
            if not bare:
                job = set_up(path, program, ini, *(["--air"] if name == "G1" else []))
                kept = job if name == "G1" else kept
    answers = operate(folder, steps, ini=str(ini), speed=SPEED, timeout=1200)
    logs = [answer for answer, step in zip(answers, steps) if step[0] == "log"]
    return dict(zip(("air", "G1", "G0 set up", "G0"), logs)), kept


def of_lines(program):
    """(n,) mm/s: F of each line of the text with G1, from line 1 on; [(line, index of the tool)]."""
    lines, changes = re.sub(r"\([^)]*\)", "", program.text(False)).splitlines(), []
    for at, line in enumerate(lines, 1):
        tool = re.match(r"T(\d+) M6", line)
        if tool:
            changes.append((at, sorted(program.tools).index(int(tool.group(1)))))
    return feeds_of(lines, MM_PER_INCH if program.inch else 1.0), changes


def judged(program, log, job):
    """(Verdict, judging.Run, figures) of a run with a set-up."""
    feeds, changes = of_lines(program)
    tool = np.array([index for _at, index in changes])[claims.by_line(log, [at for at, _tool in changes]).clip(0)]
    numbers = sorted(program.tools)
    tools = [program.tools[n][0] for n in numbers]
    target, ceiling = (
        np.array(values)[tool]
        for values in ([(job.tools[n].target or 0.0) / 60.0 for n in numbers], [job.tools[n].ceiling for n in numbers])
    )
    run = judging.Run(log, tool)
    swept = judging.sweep(run, program.blank, tools, CELL)
    verdict = judging.judge(run, program.blank, tools, target, swept)
    steps = np.diff(run.tips, axis=0, prepend=run.tips[:1])
    length = np.linalg.norm(steps, axis=1)
    velocity, line = length / run.period, log["line"].clip(0, len(feeds) - 1)
    feed = feeds[line]
    gone = np.diff(swept.volume, prepend=0.0)
    cuts = run.feeding & ~run.apart & (gone > judging.CUTTING_MM3) & (length > 0) & (feed > 0)
    falls = steps[:, 2] < -FALL * length
    over = velocity / np.maximum(feed * np.where(falls, 1.0, ceiling), 1e-9)
    span = int(round(judging.WINDOW_S / run.period))
    rows, ratio = judging.windows(run, swept, target, span)
    rate = np.zeros(len(cuts))
    rate[rows] = ratio
    ahead = np.array([rate[n : n + span + 1].max() for n in np.flatnonzero(cuts)]) if cuts.any() else np.zeros(0)
    numbers = np.flatnonzero(cuts)
    begins = np.diff(numbers, prepend=-(10**6)) > APART_S / run.period
    fast = (over[numbers] > OVER) | (ahead > OVER)
    return (
        verdict,
        run,
        {
            "contacts": int(begins.sum()),
            "too_fast": int((fast & begins).sum()),
            "periods_too_fast": int((over[numbers] > OVER).sum()),
            "over": float(over[cuts & ~falls].max(initial=0.0)),
            "down": float(over[cuts & falls].max(initial=0.0)),
            "where": [
                (
                    int(log["line"][n]),
                    round(float(over[n]), 3),
                    round(float(velocity[n]), 2),
                    *np.round(run.tips[n], 3).tolist(),
                )
                for n in sorted(numbers[over[numbers] > OVER], key=lambda n: -over[n])[:6]
            ],
        },
    )


def moves(run):
    """(n,) whether the tool has moved in a period."""
    return np.linalg.norm(np.diff(run.tips, axis=0, prepend=run.tips[:1]), axis=1) > 1e-9


def moving(run):
    """s in which it moves: how long the task waits for a busy computer is not the program's."""
    return float(run.took[moves(run)].sum())


def by_line(run):
    """(n,) s of moving on each line."""
    return np.bincount(run.line.clip(0, 10**5), run.took * moves(run), 10**5 + 1)


def measured(program, folder):
    """One line of the table, as a dict."""
    found, job = runs(program, folder)
    logs = {name: claims.loaded(log) for name, (_errors, log) in found.items()}
    verdict, run, figures = judged(program, logs["air"], job)
    times = {name: judging.Run(log) for name, log in logs.items()}
    seconds = {name: moving(one) for name, one in times.items()}
    later = by_line(times["air"]) - by_line(times["G0 set up"])
    figures["where"] += [f"line {n}: {later[n]:.3f} s longer than with G0" for n in np.argsort(-later)[:6]]
    return {
        "program": program.name + (" in" if program.inch else ""),
        "peak_10ms": verdict.peak_10ms,
        **figures,
        "seconds": seconds,
        "ratio": seconds["air"] / seconds["G0 set up"],
        "errors": [error for errors, _log in found.values() for error in errors],
        "lost": sum(one.lost for one in times.values()),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", default=[], help="programs")
    parser.add_argument("--seed", default=SEED)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--where", action="store_true", help="the fastest places too")
    options = parser.parse_args()
    print(HEAD, flush=True)
    for program in rapids_as_feeds.programs(options.seed):
        if options.only and program.name not in options.only:
            continue
        with tempfile.TemporaryDirectory() as scratch:
            f = measured(program, Path(scratch))
        s = f["seconds"]
        print(
            json.dumps(f)
            if options.json
            else f"{f['program']:15s} {100 * f['peak_10ms']:12.1f} {f['contacts']:8d} {f['too_fast']:8d} "
            f"{f['over']:11.3f} {f['down']:8.3f} {s['G1']:9.2f} {s['air']:8.2f} "
            f"{s['G0']:9.2f} {s['G0 set up']:8.2f} {f['ratio']:6.3f} {len(f['errors']):6d}"
            + (f"  {f['lost']} servo periods lost, void" if f["lost"] else ""),
            flush=True,
        )
        for text in f["errors"] + (f["where"] if options.where else []):
            print(f"    {text}", flush=True)


if __name__ == "__main__":
    main()
