# SPDX-License-Identifier: GPL-2.0-or-later
"""How long the task serves neither Stop nor E-stop while a long plan is made, comes and is handed over.

Called by bench/run.py (prints JSON rows).  A program is run again and again in the simulated machine at its own speed
and stopped at random moments
(CHIPWISE_SEED, CHIPWISE_RANDOM_COUNT of each program); until then the task is asked something all the time
(bench/lib/stop_display).  What counts is the computing time of milltask between question and answer, to which other
load on the computer adds nothing; the clock is said beside it.

    /usr/bin/python3 bench/bench_stop.py [NAME ...]
"""

import json
import math
import os
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from roots import ROOT

COUNT, SEED = 4, 1
FIRST_S, LAST_S = 0.2, 40.0
TARGET_S = 0.3
SANDBOX = ROOT / "bin" / "chipwise-sandbox"


def outline(count):
    """A closed contour of so many lines."""
    angles = [2 * math.pi * k / count for k in range(count + 1)]
    points = [
        (150 + 50 * (1 + 0.1 * math.sin(40 * a)) * math.cos(a), 100 + 50 * (1 + 0.1 * math.sin(40 * a)) * math.sin(a))
        for a in angles
    ]
    return (
        f"o100 sub\nG0 X{points[0][0]:.4f} Y{points[0][1]:.4f}\n"
        + "".join(f"G1 X{x:.4f} Y{y:.4f}\n" for x, y in points[1:])
        + "o100 endsub\n"
    )


def zigzag(count):
    """A sub of so many moves that ends above its cuts."""
    return (
        "o100 sub\nG0 X0 Y0\nG1 Z-1\n"
        + "".join(f"G1 X{k % 2 * 3 + 1} Y{k * 150 / count:.4f}\n" for k in range(count))
        + "G0 Z5\no100 endsub\n"
    )


def shaft(count):
    """A turned part of so many lines."""
    lines = [
        f"G1 X{2 * (20 + 5 * math.sin(60 * k / count) + 10 * k / count):.4f} Z{-100 * (k + 1) / count:.4f}\n"
        for k in range(count)
    ]
    return "o100 sub\nG0 X0 Z0\n" + "".join(lines) + "G1 X90\no100 endsub\n"


def milled(cycle, sub=""):
    """(INI file, program): the machine moves for 4 s while the cycle is read."""
    return "mill.ini", f"G21 G90 G17 G64 P0.01 T1 M6 F3000\nG0 X0 Y0 Z5\nG1 X200\n{cycle} R0 F600\n{sub}M2\n"


def turned(cycle, sub):
    return "lathe.ini", (
        "(WORKPIECE,CYLINDER,AXIS=Z,X=0,Y=0,ZMIN=-120,ZMAX=2,DIAMETER=90)\nG21 G18 G7 G90 G40 T1 M6 G43\n"
        "G95 G96 D2500 S180 M3\n"
        f"G0 X200 Z50\n{cycle}\n{sub}M2\n"
    )


PROGRAMS = {
    "G13, 75 rings, 1,000 levels": milled("G13 X100 Y100 I6 K36 Q0.4 Z-10 J0.01"),
    "G77, 18,000 elements": milled("G77 Q100 P42 Z-10 J5", outline(18000)),
    "G79, 15,000 elements": milled("G79 Q100 Z-10 J2", outline(15000)),
    "G75, 990 copies of 500 moves": milled("G75 Q100 L990 I0.1", zigzag(497)),
    "G75, 24 copies of 19,000 moves": milled("G75 Q100 L24 I0.1", zigzag(18997)),
    "a clamp that the machine is held before": (
        "mill.ini",
        "(CLAMP,BOX,XMIN=60,YMIN=-20,ZMIN=-20,XMAX=80,YMAX=20,ZMAX=20)\nG21 G90 G17 G64 P0.01 T1 M6 F3000\n"
        "G0 X0 Y0 Z5\nG4 P3\nG1 X200\nG4 P100\nM2\n",
    ),
    "M256 again and again": (
        "mill.ini",
        "G21 G90 G17 T1 M6 F3000\nG0 X0 Y0 Z5\no1 repeat [5000]\nM256 P0\no1 endrepeat\nM2\n",
    ),
    "G26, 4,500 elements": turned("G26 Q100 I0.3 D0.15 E0.08 F0.2", shaft(4500)),
}


def machine(folder, name):
    """The INI of a copy of configs/ in `folder` whose display is bench/lib/stop_display."""
    shutil.copytree(ROOT / "configs", folder / "configs", symlinks=True)
    for link in ("hal", "bin", "remap", "nc_files", "bench", "build"):
        (folder / link).symlink_to(ROOT / link)
    ini = folder / "configs" / name
    lines = [
        f"DISPLAY = {ROOT}/bench/lib/stop_display" if line.startswith("DISPLAY = ") else line
        for line in ini.read_text().splitlines()
    ]
    ini.write_text("\n".join(lines) + "\n")
    return ini


def measured(ini_name, text, moments):
    """[[kind, s after the start, s of computing, s on the clock], ..]"""
    with tempfile.TemporaryDirectory(prefix="chipwise-bench.") as scratch:
        folder = Path(scratch)
        os.chmod(folder, 0o777)
        (folder / "program.ngc").write_text(text)
        stops = folder / "stops.json"
        env = {
            **os.environ,
            "CHIPWISE_PROGRAM": str(folder / "program.ngc"),
            "CHIPWISE_MOMENTS": json.dumps(moments),
            "CHIPWISE_STOPS": str(stops),
        }
        env.pop("DISPLAY", None)
        done = subprocess.run(
            [SANDBOX, "--timeout", "900", "--", "linuxcnc", "-r", str(machine(folder, ini_name))],
            env=env,
            text=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
        )
        if not stops.exists():
            raise SystemExit(done.stdout[-2000:])
        return json.loads(stops.read_text())


def rows(name, found):
    """JSON rows of one program: its longest answers, and their distribution."""
    for kinds, what in ((("ask",), "any moment"), (("abort", "estop"), "stops")):
        used = sorted(cpu for kind, _at, cpu, _clock in found if kind in kinds)
        if used:
            clock = max(row[3] for row in found if row[0] in kinds)
            spread = ", ".join(
                f"{100 * share:g} % {used[min(int(share * len(used)), len(used) - 1)]:.3f}"
                for share in (0.5, 0.9, 0.99, 0.999)
            )
            yield {
                "name": f"{name}: {what}, longest",
                "value": round(used[-1], 4),
                "unit": "s",
                "note": f"of {len(used)}; {spread}; on the clock {clock:.2f} s; target {TARGET_S}",
            }


def main(chosen):
    seed, count = int(os.environ.get("CHIPWISE_SEED", SEED)), int(os.environ.get("CHIPWISE_RANDOM_COUNT", COUNT))
    for name, (ini, text) in PROGRAMS.items():
        if chosen and not any(word in name for word in chosen):
            continue
        rng = random.Random(f"stop {seed} {name}")
        moments = [(LAST_S, "abort")] + [
            (rng.uniform(FIRST_S, LAST_S), rng.choice(("abort", "estop"))) for _ in range(count - 1)
        ]
        for row in rows(name, measured(ini, text, moments)):
            print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
