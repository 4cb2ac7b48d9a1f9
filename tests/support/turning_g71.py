# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC's own G71 and G70 on a random part: run by rs274, judged without anything of the product.

Called by tests/turning and bench/bench_turning.py.  G71 knows no tool: it moves the controlled point along the profile.
So gouges are those of the point; air and rapids are those of the insert that chipwise uses.
"""

import os
import re
import signal
import subprocess

import numpy as np

from support.turning_cut import lengths
from support.turning_oracle import moves
from support.turning_paths import distances
from support.turning_random import reversed_chain, words

LIMIT_S = 10  # of computing: an endless loop has more
WAIT_S = 600.0


def chain_of(case):
    """[(z, x, arc)] mm of the sub of a random case without a bore, from the face to the left."""
    unit = 25.4 if "G20" in case.text else 1.0
    half = unit * (0.5 if " G7 " in case.text else 1.0)
    chain = []
    for line in case.text.split("O100 sub\n")[1].splitlines():
        found = dict(re.findall(r"([GXZIK])(-?[\d.]+)", line))
        if "X" not in found or "Z" not in found:
            continue
        z, x = float(found["Z"]) * unit, float(found["X"]) * half
        arc = None
        if found["G"] in "23":
            arc = (chain[-1][0] + float(found["K"]) * unit, chain[-1][1] + float(found["I"]) * unit), found["G"] == "3"
        chain.append((z, x, arc))
    return chain if chain[0][0] > chain[-1][0] else reversed_chain(chain)


def program(case, depth):
    """Text of a program with G71 and G70 for a case."""
    start = f"G0 X{case.blank[0] + 1:.6f} Z{case.blank[2] + 1:.6f}"
    lines = words(chain_of(case), False, 1.0)
    return "\n".join(
        [
            "G21 G18 G8 G40 G90 G91.1 G94 G97 S500 M3",
            "F100",
            start,
            f"G71 Q100 D{case.allowance:.6f} I{depth:.6f} R0.5",
            start,
            "G70 Q100",
            start,
            "M2",
            "O100 sub",
            lines[0].replace("G0", "G1"),
            *lines[1:],
            "O100 endsub",
            "",
        ]
    )


def run(case, depth, folder):
    """(moves as plain G-code, error text): error "endless" if it does not come to an end."""
    (folder / "g71.ngc").write_text(program(case, depth))
    (folder / "g71.var").write_text("5161 0\n")
    try:
        done = subprocess.run(
            ["prlimit", f"--cpu={LIMIT_S}", "rs274", "-g", "-v", str(folder / "g71.var"), str(folder / "g71.ngc")],
            env={**os.environ, "HOME": str(folder)},
            cwd=folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=WAIT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return "", "endless"
    if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return "", "endless"
    error = "" if "PROGRAM_END" in done.stdout else (done.stdout.splitlines() or [""])[-1] + done.stderr
    return "\n".join(["T1", *_lines(done.stdout)]), error


def _lines(canon):
    """G0 G1 G2 G3 with X and Z of rs274's calls."""
    z = x = None
    for call, text in re.findall(r"(STRAIGHT_TRAVERSE|STRAIGHT_FEED|ARC_FEED)\(([^)]*)\)", canon):
        n = [float(v) for v in text.split(",")]
        if call == "ARC_FEED":
            z1, x1, cz, cx = n[:4]
            yield f"G{3 if n[4] > 0 else 2} X{x1:.6f} Z{z1:.6f} I{cx - x:.6f} K{cz - z:.6f}"
        else:
            z1, x1 = n[2], n[0]
            yield f"G{0 if call == 'STRAIGHT_TRAVERSE' else 1} X{x1:.6f} Z{z1:.6f}"
        z, x = z1, x1


def judged(case, insert, depth, folder):
    """{"error"; "gouge": mm that the controlled point gets into the part; "feed", "air", "rapid": as
    turning_cut.lengths()} of a case."""
    text, error = run(case, depth, folder)
    if error:
        return {"error": error}
    points = np.array([p for _, kind, path in moves(text, 1.0) if kind == "feed" for p in path])
    profile = np.array(case.outside)[::-1]
    z, x = profile[:, 0], profile[:, 1]
    inside = points[(points[:, 0] > z[0]) & (points[:, 0] < z[-1]) & (points[:, 1] < np.interp(points[:, 0], z, x))]
    gouge = float(distances(inside, profile).max()) if len(inside) else 0.0
    return {"error": "", "gouge": gouge, **lengths(text, 1.0, case.blank, {1: insert})}
