# SPDX-License-Identifier: GPL-2.0-or-later
"""How close the feed comes to the best there is: cycle time and removal rate of whole runs.

Called by bench/run.py (prints JSON rows); by hand with --table, and with the names of programs:
`/usr/bin/python3 bench/bench_time.py --table slots entry`.  `--keep DIR` keeps the logs, `--from DIR`
judges kept ones again without running LinuxCNC.

Method:
 1. A program runs twice on a LinuxCNC of its own: as it is, and with a target so high (and the tools'
    own rates gone) that the stock never limits it.  The second run gives the velocity the planner itself allows at
    every place (ceiling, corners, ends); both give the acceleration it really uses on every line.
 2. The section area A(s) along the logged path comes from tests/support/fine_model.c, which shares
    nothing with the core.  Removal rate = A v, v from the logged positions; windows of 1 and 10 ms.
 3. The optimum is the fastest v(s) <= min(planner, Q / A(s)) with that acceleration, by a forward and a
    backward pass.  Time outside feed moves (traverses, tool change) is the log's own and counts
    the same on both sides.
 4. The constant feed with the same peak: the run's own peak rate (10 ms) over the largest area
    it met, by the same passes; plunges and steep ramps go as in the optimum.

Figures are of the simulated mill (configs/mill_headless.ini); docs/proof/benchmarks.md has a table.
"""

import argparse
import ctypes as C
import json
import re
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from roots import ROOT
from chipwise.headless import runner
from support.speed_log import Log

SPEED = 6
TOGETHER = 2  # runs at once
FREE = 1000.0  # times the target: the stock never limits
FREE_MOST = 600.0  # cm3/min or in3/min: M251 takes no more than that of an inch program
SLACK_MM = 0.02  # step of the optimum's passes
CUTTING_MM2 = 1e-3  # smaller areas do not count as contact
ACCEL = 500.0  # mm/s2, of configs/mill_headless.ini
SMALL = ("cam_part", "cam01", "pocket_concentric")  # parts of small moves
TIME_TARGET = {False: 1.02, True: 1.05}  # by whether the moves are small
PEAK_10MS, PEAK_1MS, OVER = 1.02, 1.05, 0.0

VEC = C.c_double * 3


def programs():
    """{name: path} of what is run."""
    own = sorted((ROOT / "bench" / "nc").glob("*.ngc"))
    shown = [
        ROOT / "nc_files" / f"{name}.ngc"
        for name in (
            "slots",
            "cam_part",
            "panel",
            "pocket",
            "pocket_oneway",
            "pocket_zigzag",
            "pocket_concentric",
            "chop_contour",
        )
    ]
    return {path.stem: path for path in shown + own}


def facts(text):
    """Radius of the tool, box low and high (mm), target (mm3/s) that a program names."""
    box = {key: float(value) for key, value in re.findall(r"([XYZ]M(?:IN|AX))=([-\d.]+)", text)}
    words = dict(re.findall(r"([PQRIJK])([-\d.]+)", "".join(re.findall(r"^M250 (.*?)(?:\(|$)", text, re.M))))
    for axis, corner, size in zip("XYZ", "PQR", "IJK"):
        if corner in words:
            box[axis + "MIN"] = float(words[corner])
            box[axis + "MAX"] = float(words[corner]) + float(words[size])
    number = re.search(r"^T(\d+)\s*M6", text, re.M).group(1)
    table = (ROOT / "configs" / "mill.tbl").read_text()
    diameter = float(re.search(rf"^T{number}\s.*?D([\d.]+)", table, re.M).group(1))
    target = float(re.search(r"^M251.*?Q([\d.]+)", text, re.M).group(1)) * 1000.0 / 60.0
    rates = (ROOT / "configs" / "tools.toml").read_text().partition(f"[tool.{number}]")[2].partition("[")[0]
    most = re.search(r"max_rate = ([\d.]+)", rates)
    if most:
        target = min(target, float(most.group(1)) * 1000.0 / 60.0)
    return (0.5 * diameter, [box[a + "MIN"] for a in "XYZ"], [box[a + "MAX"] for a in "XYZ"], target)


def run_both(name, path, folder):
    """The logs of a program as it is and with the target out of reach, in `folder`."""
    text = path.read_text()
    free = re.sub(
        r"(^M251.*?Q)([\d.]+)", lambda m: f"{m.group(1)}{min(float(m.group(2)) * FREE, FREE_MOST):g}", text, flags=re.M
    )
    jobs = []
    for kind, source in (("held", text), ("free", free)):
        program = folder / f"{name}-{kind}.ngc"
        program.write_text(source)
        jobs.append((program, folder / f"{name}-{kind}.npz"))
    return jobs


def without_rates(folder):
    """A tool geometry file like the sample one, but no tool has a removal rate of its own."""
    text = (ROOT / "configs" / "tools.toml").read_text()
    copy = folder / "tools.toml"
    copy.write_text(re.sub(r"^max_rate.*\n", "", text, flags=re.M))
    return {"TOOL_GEOMETRY": str(copy)}


def run(job):
    program, log = job
    settings = without_rates(program.parent) if program.stem.endswith("-free") else None
    summary = runner.run_headless(str(program), runner.Machine(settings=settings), SPEED, log=str(log))
    if summary["exit_status"] or summary["errors"]:
        raise RuntimeError(f"bench: {program.name}: {summary['errors']}")


def areas(log, rows, radius, low, high):
    """Section area (mm2) of the step that ends at every row of the log."""
    library = C.CDLL(str(ROOT / "build" / "tests" / "support" / "fine_model.so"))
    tips = np.ascontiguousarray(log.tips[rows])
    wanted = np.append(log.feeding[rows[1:]], False).astype(np.uint8)
    area = np.zeros(len(rows))
    library.fine_areas(
        C.c_double(radius),
        VEC(*low),
        VEC(*high),
        tips.ctypes.data_as(C.c_void_p),
        wanted.ctypes.data_as(C.c_void_p),
        C.c_long(len(rows)),
        area.ctypes.data_as(C.c_void_p),
    )
    volume = np.concatenate([[0.0], np.cumsum(area[:-1] * np.diff(log.toolpath[rows]))])
    step = np.searchsorted(log.toolpath[rows][1:], log.toolpath, side="left").clip(0, len(rows) - 2)
    return area[step], np.interp(log.toolpath, log.toolpath[rows], volume)


def matched(log, rows, other, other_rows):
    """Path of `other` (mm) at the rows of `log`: the nearest place, never backwards."""
    a, b = log.tips[rows], other.tips[other_rows]
    start, span = b[:-1], np.diff(b, axis=0)
    length = np.sqrt((span**2).sum(axis=1)).clip(1e-12)
    at, out = 0, np.zeros(len(a))
    for i, tip in enumerate(a):
        near = slice(at, min(at + 40, len(span)))
        t = (((tip - start[near]) * span[near]).sum(axis=1) / length[near] ** 2).clip(0.0, 1.0)
        off = np.linalg.norm(start[near] + t[:, None] * span[near] - tip, axis=1)
        best = int(np.argmin(off + 0.004 * np.arange(len(off))))
        at += best
        out[i] = other.toolpath[other_rows[at]] + t[best] * length[at]
    return np.maximum.accumulate(out)


def accelerations(logs, accel=ACCEL):
    """{(line, kind of motion): mm/s2} the planner really uses: half the machine's on lines that blend in parabolas
    and on most arcs; a cycle's moves all have its line."""
    used = {}
    for log in logs:
        gain = np.abs(np.diff(log.speed, prepend=log.speed[:1])) / log.period
        steady = np.minimum(gain[1:-1], np.minimum(gain[:-2], gain[2:]))  # of three in a row
        same = (log.motion[2:] == log.motion[1:-1]) & (log.motion[:-2] == log.motion[1:-1])
        for line, kind, value, feeding in zip(log.line[1:-1], log.motion[1:-1], steady, log.feeding[1:-1] & same):
            if feeding and value > used.get((line, kind), 0.0):
                used[line, kind] = value
    return {place: accel if value > 0.62 * accel else 0.5 * accel for place, value in used.items()}


def fastest(toolpath, limit, accel):
    """Time (s) of the fastest run over `path` (n,) under limit (n,) mm/s and accel (n,) mm/s2."""
    v2 = np.minimum(limit, 1e4) ** 2
    gain = 2.0 * np.diff(toolpath) * 0.5 * (accel[1:] + accel[:-1])
    v2, gain = v2.tolist(), gain.tolist()
    for i in range(1, len(v2)):
        v2[i] = min(v2[i], v2[i - 1] + gain[i - 1])
    for i in range(len(v2) - 2, -1, -1):
        v2[i] = min(v2[i], v2[i + 1] + gain[i])
    v = np.sqrt(np.array(v2))
    pace = 0.5 * (v[1:] + v[:-1])
    step = np.diff(toolpath)
    rest = np.sqrt(2.0 * step / accel[1:])  # a step between two stands
    return float(np.where(pace > 1e-6, step / pace.clip(1e-6), rest).sum()), v


def blocks(mask):
    """(first, last + 1) of the runs of True."""
    edge = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return list(zip(edge[::2], edge[1::2]))


def window_rates(log, volume, area, span):
    """(rate mm3/s, row, mean area mm2) of every window of `span` periods spent wholly in held feed moves that cuts."""
    held = np.concatenate([[0], np.cumsum(log.held)])
    count = len(volume)
    if span == 1:
        rows = np.flatnonzero(log.held & (area > CUTTING_MM2) & (log.speed > 0.0))
        return area[rows] * log.speed[rows], rows, area[rows]
    end = np.arange(span, count)
    inside = held[end + 1] - held[end - span] == span + 1
    removed = volume[end] - volume[end - span]
    time = np.cumsum(log.took)
    rows = end[inside & (removed > 1e-6)]
    removed = volume[rows] - volume[rows - span]
    toolpath = (log.toolpath[rows] - log.toolpath[rows - span]).clip(1e-9)
    return removed / (time[rows] - time[rows - span]), rows, removed / toolpath


def feed_times(held, free, rows, area, target, steep, steady_feed):
    """(seconds of the feed moves, of the optimum, at the constant feed; [(lost s, first and last line, took s, best s)]
    of each block)."""
    other_way = matched(held, rows, free, free.places())
    moving = np.concatenate([[True], np.diff(free.toolpath) > 1e-9])
    accel_of = accelerations((held, free))
    actual = best = constant = 0.0
    lost, row_path = [], held.toolpath[rows]
    for first, last in blocks(held.held):
        if held.toolpath[last - 1] - held.toolpath[first - 1] < 1e-6:
            continue
        a, b = held.toolpath[first - 1], held.toolpath[last - 1]
        toolpath = np.linspace(a, b, max(3, int((b - a) / SLACK_MM) + 1))
        there = np.interp(toolpath, row_path, other_way)
        planner = np.interp(there, free.toolpath[moving], free.speed[moving])
        planner = np.maximum(planner, np.minimum(np.interp(toolpath, held.toolpath, held.speed), 0.5))
        index = np.searchsorted(held.toolpath[first:last], toolpath).clip(0, last - first - 1) + first
        accel = np.array([accel_of.get(place, ACCEL) for place in zip(held.line[index], held.motion[index])])
        stock = target / np.maximum(area[index], 1e-9)
        seconds, _ = fastest(toolpath, np.minimum(planner, stock), accel)
        took = float(held.took[first:last].sum())
        actual += took
        best += seconds
        plain = np.where(steep[index], stock, steady_feed)
        constant += fastest(toolpath, np.minimum(planner, plain), accel)[0]
        lost.append((took - seconds, int(held.line[first]), int(held.line[last - 1]), took, seconds))
    return actual, best, constant, lost


def judge(name, folder, text):
    """dict of a program's figures."""
    radius, low, high, target = facts(text)
    held, free = Log(folder / f"{name}-held.npz"), Log(folder / f"{name}-free.npz")
    rows = held.places()
    area, volume = areas(held, rows, radius, low, high)
    rate10, at10, met10 = window_rates(held, volume, area, 10)
    rate1, at1, _ = window_rates(held, volume, area, 1)
    peak = float(rate10.max())
    steep = np.abs(np.diff(held.tips[:, 2], prepend=held.tips[0, 2])) > 0.7 * held.speed * held.took
    steady_feed = peak / float(met10[~(steep[at10] | steep[at10 - 10])].max())
    actual, best, constant, lost = feed_times(held, free, rows, area, target, steep, steady_feed)
    other = float(held.took.sum()) - actual
    span = held.took[at10].sum()
    worst10, worst1 = int(at10[np.argmax(rate10)]), int(at1[np.argmax(rate1)])
    over = rate10 > PEAK_10MS * target

    def where(row):
        return f"line {held.line[row]} at X{held.tips[row, 0]:.2f} Y{held.tips[row, 1]:.2f} Z{held.tips[row, 2]:.2f}"

    lines = {}
    for line, seconds in zip(held.line[at10[over]], held.took[at10[over]]):
        lines[int(line)] = lines.get(int(line), 0.0) + float(seconds)
    return {
        "program": name,
        "cycle_s": float(held.took.sum()),
        "feed_s": actual,
        "optimum_s": best,
        "cycle_ratio": (actual + other) / (best + other),
        "feed_ratio": actual / best,
        "peak_10ms": peak / target,
        "peak_1ms": float(rate1.max()) / target,
        "over_share": float(held.took[at10[over]].sum() / span),
        "over_s": float(held.took[at10[over]].sum()),
        "constant_ratio": (actual + other) / (constant + other),
        "worst_10ms": where(worst10),
        "worst_1ms": where(worst1),
        "over_lines": lines,
        "volume_mm3": float(volume[-1]),
        "removed_mm3": held.removed,
        "lost": sorted(lost, reverse=True)[:5],
    }


def rows_of(found):
    """The rows of one program for the table and build/bench.json."""
    name = found["program"]
    time_target = TIME_TARGET[name in SMALL]

    def row(what, value, unit, target=None, note=""):
        if target is not None:
            note = f"{'meets' if value <= target + 1e-9 else 'MISSES'} {target:g}; {note}".rstrip("; ")
        return {"name": f"{name}: {what}", "value": round(value, 4), "unit": unit, "target": target, "note": note}

    return [
        row(
            "cycle / optimum",
            found["cycle_ratio"],
            "x",
            time_target,
            f"{found['cycle_s']:.2f} s; feed moves alone {found['feed_ratio']:.4f}",
        ),
        row("peak rate, 10 ms", 100.0 * found["peak_10ms"], "%", 100.0 * PEAK_10MS, found["worst_10ms"]),
        row("peak rate, 1 ms", 100.0 * found["peak_1ms"], "%", 100.0 * PEAK_1MS, found["worst_1ms"]),
        row("cutting time above 102 %", 100.0 * found["over_share"], "%", OVER, f"{found['over_s']:.3f} s"),
        row("cycle / constant feed of the same peak", found["constant_ratio"], "x"),
    ]


def results(names, folder, again=False):
    """Figures of the named programs (all: none named)."""
    chosen = {name: path for name, path in programs().items() if not names or name in names}
    if not again:
        jobs = [job for name, path in chosen.items() for job in run_both(name, path, folder)]
        with ThreadPoolExecutor(TOGETHER) as pool:
            list(pool.map(run, jobs))
    return [judge(name, folder, path.read_text()) for name, path in chosen.items()]


def print_table(found):
    print(
        f"{'program':10s} {'cycle s':>8s} {'feed s':>8s} {'best s':>8s} {'cyc/opt':>8s} {'feed/opt':>8s} "
        f"{'10ms %':>7s} {'1ms %':>7s} {'over %':>7s} {'/const':>7s}"
    )
    for f in found:
        print(
            f"{f['program']:10s} {f['cycle_s']:8.2f} {f['feed_s']:8.2f} {f['optimum_s']:8.2f} "
            f"{f['cycle_ratio']:8.4f} {f['feed_ratio']:8.4f} {100 * f['peak_10ms']:7.1f} "
            f"{100 * f['peak_1ms']:7.1f} {100 * f['over_share']:7.2f} {f['constant_ratio']:7.3f}"
        )
    for f in found:
        print(
            f"\n{f['program']}: {f['volume_mm3']:.1f} mm3 by the fine model, {f['removed_mm3']:.1f} by the tracker; "
            f"10 ms peak {f['worst_10ms']}; 1 ms peak {f['worst_1ms']}"
        )
        worst = sorted(f["over_lines"].items(), key=lambda item: -item[1])[:8]
        print("  above 102 %, by line: " + ", ".join(f"{line}: {1000 * s:.0f} ms" for line, s in worst))
        print(
            "  most time lost: "
            + ", ".join(f"lines {a}..{b}: {lost:.3f} s of {took:.3f}" for lost, a, b, took, _ in f["lost"])
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--keep")
    parser.add_argument("--from", dest="again")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(options.again or options.keep or scratch)
        folder.mkdir(parents=True, exist_ok=True)
        found = results(options.names, folder, bool(options.again))
    if options.table:
        print_table(found)
    else:
        for f in found:
            for row in rows_of(f):
                print(json.dumps(row))


if __name__ == "__main__":
    main()
