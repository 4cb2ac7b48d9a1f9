# SPDX-License-Identifier: GPL-2.0-or-later
"""CAM styles set up with `chipwise setup --yes` and run with that, without M250, M251 and M252: peak of the removal
rate against the proposal, downward feed, and time against the same program without a set-up.

Called by hand: `/usr/bin/python3 bench/bench_set_up.py --only peel_arcs small_bends`.

 1. The programs are those of bench_styles.py without chipwise's codes; the stock of their M250 is confirmed with
    --stock.
 2. tests/support/judge.py says from the servo-rate log, the blank and the tool alone what was removed in every window
    of 10 ms in which only feeds run.  The target is that of the job file for the tool in the spindle.
 3. The velocity of moves that go down is compared with the F of their line; LinuxCNC itself goes faster for some ms
    behind a traverse.
"""

import argparse
import json
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np

import roots  # noqa: F401  puts tests/ and remap/ on the path
from chipwise.setup import job as jobs
from support import ROOT, claims, foreign, foreign_styles
from support import judge as judging
from support.operate import operate

SEED, SPEED, CELL, FALL = "40", 4.0, 0.01, 1e-3
OWN = re.compile(r"^(N\d+ ?)?M25[012].*\n", re.M)
HEAD = (
    f"{'program':20s} {'peak 10 ms %':>12s} {'at F %':>8s} {'down / F':>9s} {'at F':>9s} {'time s':>8s} "
    f"{'at F s':>8s} {'longer %':>9s} {'errors':>6s}"
)


def unit_mm(program):
    """mm of a unit of a program."""
    return 25.4 if "G20" in program.text else 1.0


def set_up(program, folder):
    """(path of the program, INI file, Job)."""
    path, table, geometry, ini = (folder / f"part{end}" for end in (".ngc", ".tbl", ".toml", ".ini"))
    path.write_text(OWN.sub("", program.text))
    table.write_text(foreign.tool_table(program.tools, 1.0))
    geometry.write_text(foreign.geometry_file(program.tools))
    ini.write_text(claims.ini_text(claims.Condition(), table, geometry))
    low, size = (
        [float(v) for v in re.search(pattern, program.text).groups()]
        for pattern in (r"M250 P(\S+) Q(\S+) R(\S+)", r"I(\S+) J(\S+) K(\S+)")
    )
    corners = [f"{value * unit_mm(program):.4f}" for value in (*low, *(a + b for a, b in zip(low, size)))]
    return path, ini, confirmed(path, ini, corners)


def confirmed(path, ini, corners, *options):
    """Job of a program that is set up without questions."""
    done = subprocess.run(
        [str(ROOT / "bin" / "chipwise"), "setup", str(path), "--ini", str(ini), "--yes", *options, "--stock", *corners],
        text=True,
        capture_output=True,
        check=False,
    )
    if done.returncode:
        raise SystemExit(done.stdout + done.stderr)
    return jobs.read(jobs.path_of(str(path)))


def runs(path, ini, folder, speed=SPEED):
    """(errors, log) with the set-up, and of a copy without one.  speed: of the clock."""
    bare = folder / "bare.ngc"
    bare.write_text(path.read_text())
    home = ["mdi", "G53 G0 X0 Y0 Z100"]
    answers = operate(
        folder,
        [
            home,
            ["log", str(bare)],
            ["open", str(path)],
            home,
            ["messages", "part.ngc: set up as confirmed"],
            ["log", str(path)],
        ],
        ini=str(ini),
        speed=speed,
        timeout=900,
    )
    return answers[5], answers[1]


def feeds_of(lines, unit):
    """(n,) mm/s: F of each line of a program, from line 1 on."""
    feeds, feed = [0.0], 0.0
    for line in lines:
        word = re.search(r"F([\d.]+)", line)
        feed = float(word.group(1)) * unit / 60.0 if word else feed
        feeds.append(feed)
    return np.array(feeds)


def judged(program, log, job):
    """(Verdict, judging.Run, (n,) rows of velocity over F in moves down)."""
    lines = [re.sub(r"\([^)]*\)", "", line).replace(" ", "") for line in OWN.sub("", program.text).splitlines()]
    numbers, changes, waiting = sorted(program.tools), [], None
    for at, line in enumerate(lines, 1):
        word = re.search(r"T(\d+)", line)
        waiting = int(word.group(1)) if word else waiting
        if re.search(r"M0?6(?!\d)", line):
            changes.append((at, numbers.index(waiting)))
    which = claims.by_line(log, [at for at, _tool in changes])
    tool = np.array([index for _at, index in changes])[which.clip(0)]
    target = np.array([(job.tools[n].target or 0.0) / 60.0 for n in numbers])[tool]
    run = judging.Run(log, tool)
    tools = [program.tools[n][0] for n in numbers]
    verdict = judging.judge(run, program.blank, tools, target, judging.sweep(run, program.blank, tools, CELL))
    steps = np.diff(run.tips, axis=0, prepend=run.tips[:1])
    length = np.linalg.norm(steps, axis=1)
    feeds = feeds_of(lines, unit_mm(program))
    feed = feeds[log["line"].clip(0, len(feeds) - 1)]
    falls = run.feeding & (steps[:, 2] < -FALL * length) & (length > 0) & (feed > 0)
    return verdict, run, (length / run.period / np.maximum(feed, 1e-9))[falls]


def measured(program, folder, speed):
    """One line of the table, as a dict."""
    path, ini, job = set_up(program, folder)
    (errors, held), (_errors, free) = runs(path, ini, folder, speed)
    held, free = claims.loaded(held), claims.loaded(free)
    verdict, run, down = judged(program, held, job)
    before, first, down_at_f = judged(program, free, job)
    return {
        "program": program.name,
        "peak_10ms": verdict.peak_10ms,
        "peak_at_f": before.peak_10ms,
        "down": float(down.max(initial=0.0)),
        "down_at_f": float(down_at_f.max(initial=0.0)),
        "time_s": float(run.took.sum()),
        "time_at_f_s": float(first.took.sum()),
        "errors": errors,
        "lost": run.lost + first.lost,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", default=[], help="programs")
    parser.add_argument("--seed", default=SEED)
    parser.add_argument(
        "--speed",
        type=float,
        default=SPEED,
        help="of the clock; what this computer needs for the first F takes that many times as long",
    )
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    print(HEAD, flush=True)
    for name, program in foreign_styles.programs(options.seed).items():
        if options.only and name not in options.only:
            continue
        with tempfile.TemporaryDirectory() as scratch:
            f = measured(program, Path(scratch), options.speed)
        print(
            json.dumps(f)
            if options.json
            else f"{f['program']:20s} {100 * f['peak_10ms']:12.1f} {100 * f['peak_at_f']:8.1f} {f['down']:9.3f} "
            f"{f['down_at_f']:9.3f} {f['time_s']:8.2f} {f['time_at_f_s']:8.2f} "
            f"{100 * (f['time_s'] / f['time_at_f_s'] - 1):9.2f} {len(f['errors']):6d}"
            + (f"  {f['lost']} servo periods lost, void" if f["lost"] else ""),
            flush=True,
        )
        for error in f["errors"]:
            print("    " + error, flush=True)


if __name__ == "__main__":
    main()
