#!/usr/bin/python3
"""LinuxCNC's own cutter compensation (G41.1, G42.1) on the random contours of the geometry tests, beside ours.

Called by bench/run.py (prints JSON rows) and by hand:

    /usr/bin/python3 bench/bench_compensation.py [--count 5000] [--jobs 2] [--table]

CHIPWISE_RANDOM_COUNT contours of each kind (default 100) from CHIPWISE_SEED on, both sides of each.  Counted are the
cases in which a path exists: where the tool fits nowhere, an alarm is the right answer.

How LinuxCNC gets its fair chance: every case is a program of its own for the real interpreter (`rs274 -g`, own HOME,
G41.1 D in program units, so that no tool table and no machine unit come into it).  The program starts in the middle
of the longest straight piece that the tool can touch (an arc where there is no straight one), so that no corner
stands at the seam; the entry move is longer than the tool radius and tangent to the contour there, and so is the
exit: neither can meet a corner.  Both would be run in the air and are not judged, only what is cut between them.

Its centre path, as the interpreter hands it to the machine, and ours are judged by the same oracle, written apart
from the kernel (tests/python/contour_oracle.py): the depth of the tool in the finish shape.  rs274 prints four
decimals of a mm, so a gouge counts from 0.001 mm.
"""
import argparse
import collections
import json
import math
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
for folder in (ROOT / "remap", ROOT / "tests" / "python", ROOT / "tests"):
    sys.path.insert(0, str(folder))

import numpy as np                                                          # noqa: E402

import contour_oracle as oracle                                             # noqa: E402
from chipwise.geometry import elements                                      # noqa: E402
from chipwise.geometry.contour import make_contour                          # noqa: E402
from chipwise.geometry.offset import LEFT, RIGHT, offset_contour            # noqa: E402
from chipwise.geometry.paths import SpotPath                                # noqa: E402
from contour_judge import count_from_environment, judged, seed_from_environment  # noqa: E402
from contour_random import contour_case                                     # noqa: E402
from rs274.canon import parse_rs274                                         # noqa: E402

KINDS = {"filleted": "filleted polygons, tool 0.2 .. 2.5 x smallest fillet",
         "bulged": "line/arc polygons, tool 0.3 .. 10 mm"}
GOUGE_MM = 1e-3             # four decimals of rs274's output are worth 1e-4 mm
SAMPLE_MM = 0.1             # along the path, where the oracle measures
RUN_S = 20                  # an interpreter that needs longer is counted as an alarm


def seam(contour, result):
    """(finish element, parameter) where the program starts: the middle of the longest piece of a line that the tool
    touches, of an arc where it touches no line; None where it touches nothing for a length."""
    best, found = (False, 0.0), None
    for path in result.paths:
        if isinstance(path, SpotPath):
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
    lines = ["G21 G90 G17 G40 G64", "G0 X%.6f Y%.6f Z5" % tuple(start - reach * ahead), "F1000",
             f"G{41 if side == LEFT else 42}.1 D{2.0 * radius:.6f}", "G1 X%.6f Y%.6f" % tuple(start), "(contour)"]
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
        run = subprocess.run(["rs274", "-g", "-v", f"{folder}/case.var", str(source)], cwd=folder, text=True,
                             env={**os.environ, "HOME": str(folder)}, capture_output=True, timeout=RUN_S, check=False)
    except subprocess.TimeoutExpired:
        return [], f"no end within {RUN_S} s"
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
    except Exception:                                    # whatever it is, it is an alarm of ours
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


def judge_range(job):
    """Cases first..last-1 of one kind: (counts, worst depths, alarms, [gouged seeds])."""
    kind, first, last = job
    counts, worst, alarms, gouged = collections.Counter(), {"ours": 0.0, "theirs": 0.0}, collections.Counter(), []
    with tempfile.TemporaryDirectory(prefix="chipwise-bench.") as folder:
        (Path(folder) / "case.var").write_text("5161 0\n")
        for seed in range(first, last):
            for side in (LEFT, RIGHT):
                one, depth, said = judge_case(seed, kind, side, folder)
                counts, alarms = counts + one, alarms + collections.Counter(said)
                gouged += [(seed, side, depth["theirs"])] if one["gouges"] else []
                worst = {who: max(worst[who], depth.get(who, 0.0)) for who in worst}
    return counts, worst, alarms, gouged


def measure(kind, count, jobs):
    """The figures of one kind as a dictionary."""
    first = seed_from_environment()
    ranges = [(kind, k, min(k + 25, first + count)) for k in range(first, first + count, 25)]
    with ProcessPoolExecutor(jobs) as pool:
        found = list(pool.map(judge_range, ranges))
    counts = sum((row[0] for row in found), collections.Counter())
    return {"contours": count, "first": first, "counts": dict(counts),
            "worst": {who: max(row[1][who] for row in found) for who in ("ours", "theirs")},
            "alarms": dict(sum((row[2] for row in found), collections.Counter()).most_common()),
            "gouged": sorted((g for row in found for g in row[3]), key=lambda g: -g[2])}


def rows(kind, made):
    """The figures as rows of the bench."""
    counts, possible = collections.Counter(made["counts"]), made["counts"].get("possible", 0)
    share = 100.0 / max(possible, 1)

    def row(name, value, unit, note=""):
        return {"name": f"{KINDS[kind]}: {name}", "value": value, "unit": unit, "note": note}
    yield row("cases with a path", possible, "", f"of {counts['cases']}, {made['contours']} contours from "
              f"{made['first']} on, both sides")
    yield row("chipwise, alarms", counts["our alarms"], "", "target 0")
    yield row("chipwise, gouges", counts["our gouges"], "", f"target 0; deepest {made['worst']['ours']:.2g} mm")
    yield row("chipwise, wrong verdicts", counts["our wrong verdicts"], "",
              "gouge, lost path or false region; target 0")
    yield row("LinuxCNC, alarms", round(share * counts["alarms"], 2), "%", f"{counts['alarms']} cases; "
              f"{counts['alarms, one path']} of the {counts['one path']} with a single path")
    yield row("LinuxCNC, silent gouges", round(share * counts["gouges"], 2), "%",
              f"{counts['gouges']} cases, deepest {made['worst']['theirs']:.3f} mm; {counts['gouges, one path']} of "
              f"the {counts['one path']} with a single path")
    yield row("LinuxCNC, neither", round(share * counts["right"], 2), "%", f"{counts['right']} cases")
    for text, number in made["alarms"].items():
        yield row("LinuxCNC says", number, "x", text)


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--count", type=int, default=count_from_environment(100), help="contours of each kind")
    arguments.add_argument("--jobs", type=int, default=2, help="processes at once")
    arguments.add_argument("--table", action="store_true", help="print a table instead of JSON rows")
    arguments.add_argument("--output", help="JSON file for all figures, gouged cases included")
    given = arguments.parse_args()
    made = {kind: measure(kind, given.count, given.jobs) for kind in KINDS}
    for kind, figures in made.items():
        for row in rows(kind, figures):
            print(f"{row['name']:86} {row['value']:>10g} {row['unit']:2} {row['note']}" if given.table
                  else json.dumps(row))
    if given.output:
        Path(given.output).write_text(json.dumps(made, indent=1))


if __name__ == "__main__":
    main()
