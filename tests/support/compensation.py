# SPDX-License-Identifier: GPL-2.0-or-later
"""One random contour through LinuxCNC's own cutter compensation (G41.1, G42.1) and through ours, judged by one oracle.

How LinuxCNC gets its fair chance: the head of bench/bench_compensation.py, which counts thousands of these cases;
test_compensation_bench.py shows that it does.
"""

import collections
import os
import signal
import subprocess
from pathlib import Path

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.offset.kernel import LEFT, offset_contour
from chipwise.geometry.offset.paths import PointContact
from support import contour_oracle as oracle
from support.canon import parse_rs274
from support.contour_judge import judged
from support.contour_random import contour_case

GOUGE_MM = 1e-3  # four decimals of rs274's output are worth 1e-4 mm
SAMPLE_MM = 0.1  # along the path, where the oracle measures
RUN_S, WAIT_S = 20, 600.0  # of computing: an interpreter that needs longer is counted as an alarm


def seam(contour, result):
    """(finish element, parameter) where the program starts: the middle of the longest piece of a line that the tool
    touches, of an arc where it touches no line; None where it touches nothing for a length."""
    best, found = (False, 0.0), None
    for path in result.paths:
        if isinstance(path, PointContact):
            continue
        feet = path.feet
        size = np.abs(feet.t1 - feet.t0) * contour.length[feet.finish]
        straight = ~contour.elements.is_arc[feet.finish]
        for k in np.flatnonzero(size > 1e-3):
            if (bool(straight[k]), size[k]) > best:
                best = (bool(straight[k]), size[k])
                found = int(feet.finish[k]), float(0.5 * (feet.t0[k] + feet.t1[k]))
    return found


def program(contour, side, radius, index, t):
    """G-code of the closed contour with compensation from a place on it."""
    e = contour.elements
    start = elements.point_at(e, np.array([index]), np.array([t]))[0]
    ahead = elements.tangent_at(e, np.array([index]), np.array([t]))[0]
    reach = 1.5 * radius + 1.0
    lines = [
        "G21 G90 G17 G40 G64",
        "G0 X%.6f Y%.6f Z5" % tuple(start - reach * ahead),
        "F1000",
        f"G{41 if side == LEFT else 42}.1 D{2.0 * radius:.6f}",
        "G1 X%.6f Y%.6f" % tuple(start),
        "(contour)",
    ]
    order = list(range(index, len(e))) + list(range(index + 1))
    here = start
    for number, k in enumerate(order):
        end = start if number == len(order) - 1 else e.end[k]
        if e.is_arc[k]:
            lines.append("G%d X%.6f Y%.6f I%.6f J%.6f" % (3 if e.sweep[k] > 0.0 else 2, *end, *(e.centre[k] - here)))
        else:
            lines.append("G1 X%.6f Y%.6f" % tuple(end))
        here = end
    lines += ["(done)", "G40", "G1 X%.6f Y%.6f" % tuple(start + reach * ahead), "M2"]
    return "\n".join(lines) + "\n"


def interpret(text, folder):
    """(centre path as oracle tuples, alarm text or None) of a program."""
    source = Path(folder) / "case.ngc"
    source.write_text(text)
    try:
        run = subprocess.run(
            ["prlimit", f"--cpu={RUN_S}", "rs274", "-g", "-v", f"{folder}/case.var", str(source)],
            cwd=folder,
            text=True,
            env={**os.environ, "HOME": str(folder)},
            capture_output=True,
            timeout=WAIT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return [], f"no end within {WAIT_S:g} s"
    if run.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return [], f"no end within {RUN_S} s of computing"
    if run.returncode:
        said = [line for line in run.stderr.splitlines() if line and line != "executing"]
        return [], said[0] if said else f"exit {run.returncode}"
    trace = parse_rs274(run.stdout)
    return [plain(motion) for motion in trace.between("contour", "done")], None


def plain(motion):
    """A motion as the oracle takes it."""
    (ax, ay), (bx, by) = motion.a[:2], motion.b[:2]
    if motion.kind != "arc":
        return ("L", ax, ay, bx, by)
    return ("A", ax, ay, bx, by, *motion.centre, motion.sweep[1])


def in_words(alarm):
    """An alarm without its numbers, so that equal ones are counted together."""
    if "mismatched radii" in alarm:
        return "BUG: cutter compensation has generated an invalid arc with mismatched radii"
    return alarm.strip()


def judge_case(seed, kind, side, folder):
    """Counter and worst depths of one case."""
    parts, radius = contour_case(seed, kind)
    counts, worst = collections.Counter(cases=1), {}
    try:
        contour = make_contour(parts)
        result = offset_contour(contour, side, radius)
        findings = judged(contour, side, radius, result)
    except Exception:  # whatever it is, it is an alarm of ours
        return counts + collections.Counter({"possible": 1, "our alarms": 1}), worst, {}
    place = seam(contour, result)
    if place is None:
        return counts + collections.Counter({"our wrong verdicts": bool(findings)}), worst, {}
    counts["possible"] += 1
    shape = oracle.from_elements(contour.elements)
    ours = [el for path in result.paths for el in oracle.from_elements(path.elements)]
    worst["ours"] = oracle.gouge(shape, radius, ours, SAMPLE_MM)
    single = len(result.paths) == 1
    counts += collections.Counter({"our gouges": bool(worst["ours"] > GOUGE_MM), "our wrong verdicts": bool(findings)})
    counts["one path"] += single
    theirs, alarm = interpret(program(contour, side, radius, *place), folder)
    if alarm is not None:
        return counts + collections.Counter({"alarms": 1, "alarms, one path": single}), worst, {in_words(alarm): 1}
    worst["theirs"] = oracle.gouge(shape, radius, theirs, SAMPLE_MM)
    gouged = bool(worst["theirs"] > GOUGE_MM)
    counts += collections.Counter({"gouges": gouged, "gouges, one path": gouged and single, "right": not gouged})
    return counts, worst, {}
