# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise check on long programs: computing time of reading and judging on one core, memory, and programs side by
side.

A million moves of 0.1 mm on a stock of 100 x 100 mm with cells of 0.1 mm, by tool.  Computing time is that of all
processes; on a machine that does nothing else it is the time it takes on one core.  Arguments: moves (default 1000000);
`--parallel`: only the 8 programs side by side; `--set-up`: only `chipwise setup` and the monitor's estimate of the time
set up, of a relief.

Eight programs on one core and on two, in turns.  The time on the clock depends on what else the machine does; the
computing time does not.  S is that of the first process, which is done before the others begin, P that of all others.
Alone on n cores the command takes S + P / n: two cores are (S1 + P1) / (S2 + P2 / 2) times as fast as one.  P2 is
larger than P1 by what the cores take from each other (memory, caches).
"""

import contextlib
import json
import math
import os
import subprocess
import sys
import tempfile
import time

from roots import ROOT
from rows import row

from chipwise.host import processes
from support.scenes import SCENE

CHIPWISE = os.path.join(ROOT, "bin", "chipwise")
MEGA = 1 << 20

#       name, tool, Z varies, target of computing time (s) for a million moves
CASES = (
    ("flat D6", 1, False, 20),
    ("ball D6", 4, True, 60),
    ("bull-nose D6", 5, True, 60),
    ("flat D12", 8, False, 120),
    ("ball D12", 9, True, 120),
)
MOST_MB = 300
SET_UP_S = 15  # of computing time, for a million moves
ROUNDS = 3  # of one core and two
LEAST_GAIN = 1.7


def program(path, tool, wavy, moves, seed=0):
    """Rows 0.1 mm apart, moves of 0.1 mm; Z varies by 1 mm where it is wavy."""
    with open(path, "w", encoding="ascii") as file:
        file.write(
            "G21 G90 G17 G94 G40\nM250 P0 Q0 R-20 I100 J100 K20\n"
            f"T{tool} M6\nS10000 M3\nG0 X0 Y0 Z5\nG1 Z-2 F300\nF2000\n"
        )
        for k in range(1, moves + 1):
            row, step = divmod(k + seed, 1000)
            x, y = (step if row % 2 == 0 else 1000 - step) / 10, row % 1000 / 10
            z = f" Z{-2 + math.sin(x / 3) * math.cos(y / 5):.4f}" if wavy else ""
            file.write(f"G1 X{x:.1f} Y{y:.1f}{z}\n")
        file.write("G0 Z10\nM2\n")


def memory(root):
    """Bytes in use of a process and its descendants."""
    total = 0
    for pid in [root, *processes.descendants(root)]:
        with contextlib.suppress(OSError):  # it has just ended
            _address_space, resident, shared = processes.memory_bytes(pid)
            total += resident - shared  # what is shared with files is left out
    return total


def run(command, cores=None, order="", **options):
    """-> (status, computing s, wall s, most memory in bytes).  order: its standard input."""
    before, start, most = os.times(), time.monotonic(), 0
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        text=True,
        preexec_fn=(lambda: os.sched_setaffinity(0, cores)) if cores else None,
        **options,
    )
    with process.stdin as file:
        file.write(order)
    while process.poll() is None:
        most = max(most, memory(process.pid))
        time.sleep(0.1)
    after = os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return process.returncode, used, time.monotonic() - start, most


def own_time(pid):
    """Computing time (s) of a process without its children."""
    fields = processes.stat_fields(pid)
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK") if fields else 0.0


def side_by_side(paths, jobs, ini):
    """-> (status, computing s of the first process, of the others, wall s)."""
    start = time.monotonic()
    command = [CHIPWISE, "check", *paths, "--ini", ini, "--cell", "0.1", "--jobs", str(jobs)]
    cores = sorted(os.sched_getaffinity(0))[:jobs]
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=lambda: os.sched_setaffinity(0, cores)
    )
    while os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is None:
        time.sleep(0.05)
    own = own_time(process.pid)  # a zombie has it still
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, own, usage.ru_utime + usage.ru_stime - own, time.monotonic() - start


def parallel(folder, ini, moves):
    """Rows of 8 programs on two cores; -> whether something failed."""
    paths = [os.path.join(folder, f"{k}.ngc") for k in range(8)]
    for k, path in enumerate(paths):
        program(path, 4, True, moves // 20, seed=50 * k)
    if len(os.sched_getaffinity(0)) < 2:
        return False
    rounds = [(side_by_side(paths, 1, ini), side_by_side(paths, 2, ini)) for _ in range(ROUNDS)]
    one, two = (min((r[k] for r in rounds), key=lambda found: found[1] + found[2]) for k in (0, 1))
    gain = (one[1] + one[2]) / (two[1] + two[2] / 2)
    show(
        "8 programs, two cores against one, by computing time",
        gain,
        "times",
        f"{'meets' if gain >= LEAST_GAIN else 'MISSES'} at least {LEAST_GAIN}; S {one[1]:.2f} s, P {one[2]:.2f} s; two "
        f"cores: "
        f"S {two[1]:.2f} s, P {two[2]:.2f} s",
    )
    walls = [min(r[k][3] for r in rounds) for k in (0, 1)]
    show(
        "8 programs, two cores against one, on the clock",
        walls[0] / walls[1],
        "times",
        f"the best of {ROUNDS}: {walls[0]:.1f} s and {walls[1]:.1f} s; says something on a machine that does nothing "
        f"else",
    )
    return gain < LEAST_GAIN or any(run[0] for pair in rounds for run in pair)


def set_up(folder, ini, moves):
    """Rows of chipwise setup and of the process of the monitor that estimates the time set up; -> whether something
    failed."""
    path, failed = os.path.join(folder, "relief.ngc"), False
    program(path, 4, True, moves)
    scene = {**SCENE, "tool": 0}
    estimate = (
        [sys.executable, "-m", "chipwise.setup.time_process", str(os.getpid())],
        json.dumps({"ini": ini, "program": path, "scene": scene}),
    )
    for name, target, (command, order) in (
        ("chipwise setup", SET_UP_S, ([CHIPWISE, "setup", path, "--ini", ini], "")),
        ("the estimate of the time set up", None, estimate),
    ):
        status, used, wall, most = run(
            command, order=order, env={**os.environ, "PYTHONPATH": os.path.join(ROOT, "remap")}
        )
        show(
            f"{moves} moves, {name}",
            used,
            "s",
            f"computing time of all processes; {wall:.1f} s on the clock",
            target=target and target * moves / 1e6,
        )
        show(
            f"memory, {name}",
            most / MEGA,
            "MB",
            f"all processes; {os.path.getsize(path) / MEGA:.0f} MB of text",
            target=MOST_MB,
        )
        failed |= status != 0 or most > MOST_MB * MEGA
    return failed


def machine(folder):
    """The sample mill with two more tools."""
    with open(os.path.join(ROOT, "configs", "mill.ini"), encoding="utf-8") as file:
        text = file.read()
    remap = os.path.join(ROOT, "remap")
    text = text.replace("TOPLEVEL = remap/toplevel.py", f"TOPLEVEL = {remap}/toplevel.py").replace(
        "PATH_PREPEND = remap", f"PATH_PREPEND = {remap}"
    )
    files = {
        "mill.ini": text,
        "mill.tbl": "T1 P1 D6\nT4 P4 D6\nT5 P5 D6\nT8 P8 D12\nT9 P9 D12\n",
        "tools.toml": "[tool.1]\nflute_length = 20\n[tool.4]\nshape = 'ball'\nflute_length = 15\n[tool.5]\n"
        "shape = 'bull'\n"
        "corner_radius = 0.5\nflute_length = 20\n[tool.8]\nflute_length = 20\n[tool.9]\nshape = 'ball'\n"
        "flute_length = 20\n",
    }
    for name, content in files.items():
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(content)
    return os.path.join(folder, "mill.ini")


def show(*values, **more):
    print(json.dumps(row(*values, **more)), flush=True)


def main(moves, only=""):
    failed = False
    with tempfile.TemporaryDirectory(prefix="chipwise-bench-") as folder:
        ini = machine(folder)
        if only == "set-up":
            return set_up(folder, ini, moves)
        for name, tool, wavy, target in () if only else CASES:
            path = os.path.join(folder, "part.ngc")
            program(path, tool, wavy, moves)
            status, used, wall, most = run(
                [CHIPWISE, "check", path, "--ini", ini, "--cell", "0.1"], {min(os.sched_getaffinity(0))}
            )
            show(
                f"{moves} moves, {name}",
                used,
                "s",
                f"computing time; {wall:.1f} s on the clock",
                target=target * moves / 1e6,
            )
            show(f"memory, {name}", most / MEGA, "MB", "all processes", target=MOST_MB)
            failed |= status != 0 or used > target * moves / 1e6 or most > MOST_MB * MEGA
        failed |= parallel(folder, ini, moves)
    return failed


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    sys.exit(
        main(
            *numbers[:1] or [1_000_000],
            only="parallel" if "--parallel" in sys.argv else "set-up" if "--set-up" in sys.argv else "",
        )
    )
