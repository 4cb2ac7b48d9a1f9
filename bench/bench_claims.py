"""The claims on programs nobody here wrote: every program of nc_files/ and ten foreign ones, on the real LinuxCNC.

Called by bench/run.py (prints JSON rows); by hand with --table:
`/usr/bin/python3 bench/bench_claims.py --table --only estlcam_relief --count 3 --seed 5`.

 1. A program (nc_files/ or bench/foreign.py) runs under a condition: path mode, acceleration, servo period, feed
    override, metric or inch machine.  Every program runs under CONDITIONS[0]; `--count` of the others, drawn by the
    seed, follow.  Only the INI file, the line with the path mode and the tool table are made for it.
 2. bench/judge.py says what the tool removed; nothing of that comes from the tracker.  Its own error is in the table.
 3. cycle / optimum: a second run with a target out of reach gives the velocity the planner allows; the rest as in
    bench_time.py, with the judge's section area.
 4. A run in which servo periods were lost is void and says so.

The target of a run with a feed override: TARGET_SCALE below, as docs/Hal.md has it.
"""
import argparse
import json
import random
import re
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "remap"), str(ROOT / "bench")]

import bench_time                                           # noqa: E402
import foreign                                              # noqa: E402
import judge as judging                                     # noqa: E402
from chipwise.machine import runner                         # noqa: E402
from rows import row                                        # noqa: E402

SPEED = 6.0
FREE = 1000.0
INCH = 25.4
PEAK, SHARE = 102.0, 0.0
CYCLE = {"long": 1.01, "small": 1.03}
SMALL = {"cam_part", "estlcam_relief", "taper_two_tools", "spiral_round", "vectric_vcarve", "pocket_concentric"}
VOLUME = 0.003
PATH = re.compile(r"^(N\d+ ?)?(?:G61\.1|G61|G64)(?: ?P[\d.]+)?(?: ?Q[\d.]+)?\s*$", re.M)
FALLBACK = 5                # volumetric-feed.limited-by


def target_scale(override):
    """The rate that counts under a feed override: the override multiplies the rate like any feed (docs/Hal.md)."""
    return override


@dataclass(frozen=True)
class Condition:
    path: str = ""              # "" as the program has it; lengths in mm
    accel: float = 500.0        # mm/s2
    period: float = 1.0         # ms
    override: float = 1.0
    inch: bool = False

    def __str__(self):
        words = [self.path or "as written", f"{self.accel:g} mm/s2"]
        if self.period != 1.0:
            words.append(f"{self.period:g} ms")
        if self.override != 1.0:
            words.append(f"{100 * self.override:g} %")
        if self.inch:
            words.append("inch machine")
        return ", ".join(words)


PATHS = ("G61", "G61.1", "G64", "G64 P0.02", "G64 P0.05 Q0.02", "G64 P0.2")
ACCELS = (50.0, 150.0, 500.0, 1000.0, 2000.0)
PERIODS = (0.5, 1.0, 2.0)
OVERRIDES = (0.5, 0.8, 1.0, 1.0, 1.2)


def conditions(seed, count):
    """The plain one, and `count` drawn from the matrix."""
    rng = random.Random(f"conditions {seed}")
    return [Condition()] + [Condition(rng.choice(PATHS), rng.choice(ACCELS), rng.choice(PERIODS), rng.choice(OVERRIDES),
                                      rng.random() < 0.3) for _ in range(count)]


def own_programs():
    """{name: foreign.Program} of nc_files/, described by their own comments and the sample tables."""
    found = {}
    for path in sorted((ROOT / "nc_files").glob("*.ngc")):
        text = path.read_text()
        if not re.search(r"^M251", text, re.M):
            continue
        radius, low, high, _target = bench_time.facts(text)
        number = int(re.search(r"^T(\d+)\s*M6", text, re.M).group(1))
        found[path.stem] = foreign.Program(path.stem, text, judging.Blank.corners(low, high),
                                           {number: (judging.Tool(2.0 * radius), 0.0)}, "own")
    return found


def own_rates():
    """{tool number: mm3/s} of the sample geometry file."""
    text = (ROOT / "configs" / "tools.toml").read_text()
    return {int(n): float(rate) / 60.0 for n, rate in
            re.findall(r"\[tool\.(\d+)\](?:(?!\[tool).)*?max_removal_rate = ([\d.]+)", text, re.S)}


# --- what is made for a run ---------------------------------------------------------------------

def with_path(text, path):
    """The program with another path mode; P and Q in its own unit."""
    if not path:
        return text
    unit = INCH if re.search(r"\bG20\b|G20", re.sub(r"\([^)]*\)", "", text)) else 1.0
    words = re.sub(r"([PQ])([\d.]+)", lambda m: f"{m.group(1)}{float(m.group(2)) / unit:.6f}", path)
    made, count = PATH.subn(lambda m: (m.group(1) or "") + words, text)
    if not count:
        raise ValueError("bench_claims: no line with a path mode to replace")
    return made


def ini_text(condition, table, geometry):
    """An INI file of the sample mill (metric or inch) under a condition, with a longer Z axis."""
    name = "mill_inch.ini" if condition.inch else "mill_headless.ini"
    unit = INCH if condition.inch else 1.0
    text = (ROOT / "configs" / name).read_text().replace("../", f"{ROOT}/")
    text = re.sub(r"^(TOPLEVEL|PATH_PREPEND) *= *(?!/)", rf"\1 = {ROOT}/configs/", text, flags=re.M)
    text = re.sub(r"^DISPLAY *=.*$", f"DISPLAY = {ROOT}/bench/lib/claims_display", text, flags=re.M)
    text = re.sub(r"^TOOL_TABLE *=.*$", f"TOOL_TABLE = {table}", text, flags=re.M)
    text = re.sub(r"^TOOL_GEOMETRY *=.*$", f"TOOL_GEOMETRY = {geometry}", text, flags=re.M)
    text = re.sub(r"^(\w*ACCELERATION) *=.*$", rf"\1 = {condition.accel / unit:.6f}", text, flags=re.M)
    text = re.sub(r"^SERVO_PERIOD *=.*$", f"SERVO_PERIOD = {round(condition.period * 1e6)}", text, flags=re.M)
    text = re.sub(r"^SUBROUTINE_PATH *=.*$", f"SUBROUTINE_PATH = {ROOT}/nc_files", text, flags=re.M)
    head, axis, rest = text.partition("[AXIS_Z]")
    rest = re.sub(r"^MIN_LIMIT *=.*$", f"MIN_LIMIT = {-250 / unit:.6f}", rest, flags=re.M)
    rest = re.sub(r"^MAX_LIMIT *=.*$", f"MAX_LIMIT = {220 / unit:.6f}", rest, flags=re.M)
    rest = re.sub(r"^(HOME|HOME_OFFSET) *= *\d[\d.]*$", rf"\1 = {120 / unit:.6f}", rest, flags=re.M)
    text = head + axis + rest
    if condition.inch:
        chip = f"HALFILE = {ROOT}/hal/chipwise.hal\n"
        text = text.replace(chip, chip + f"HALFILE = {ROOT}/hal/headless.hal\n")
    return text


def without_limit(text):
    """The program with a target that the stock never reaches."""
    return re.sub(r"^(M251.*?Q)([\d.]+)", lambda m: f"{m.group(1)}{float(m.group(2)) * FREE:g}", text, flags=re.M)


def run(program, condition, folder, free=False, speed=SPEED):
    """-> (summary, log) of one run."""
    stem = f"{program.name}-{'free' if free else 'held'}"
    text = with_path(program.text, condition.path)
    (folder / f"{stem}.ngc").write_text(without_limit(text) if free else text)
    unit = INCH if condition.inch else 1.0
    table, geometry = folder / f"{stem}.tbl", folder / f"{stem}.toml"
    if program.notes == "own":
        sample = "mill_inch.tbl" if condition.inch else "mill.tbl"
        table.write_text((ROOT / "configs" / sample).read_text())
        shapes = (ROOT / "configs" / "tools.toml").read_text()
        geometry.write_text(re.sub(r"^max_removal_rate.*\n", "", shapes, flags=re.M) if free else shapes)
    else:
        table.write_text(foreign.tool_table(program.tools, unit))
        geometry.write_text(foreign.geometry_file(program.tools))
    ini = folder / f"{stem}.ini"
    ini.write_text(ini_text(condition, table, geometry))
    log = folder / f"{stem}.npz"
    summary = runner.run_headless(str(folder / f"{stem}.ngc"), ini=str(ini), speed=speed, log=str(log), timeout=3000.0,
                                  env={"CLAIMS_OVERRIDE": f"{condition.override:g}"})
    return summary, log


# --- what the judge is told ---------------------------------------------------------------------

def by_line(log, at_lines):
    """Index into `at_lines` (sorted line numbers) of the last one passed, -1 before the first, for every row."""
    line = np.where(log["motion_type"] > 0, log["line"], 0)
    last = np.maximum.accumulate(np.where(line > 0, np.arange(len(line)), 0))
    return np.searchsorted(np.array(at_lines), line[last], side="left") - 1


def told(program, log):
    """-> (Run, tools, target (n,) mm3/s at 100 %)."""
    lines = program.text.splitlines()
    bare = [re.sub(r"\([^)]*\)", "", line).replace(" ", "") for line in lines]
    numbers = sorted(program.tools)
    changes, defined, rates = [], 0, []
    inch = any("G20" in line for line in bare)
    limits = own_rates() if program.notes == "own" else {}
    waiting = None
    for at, line in enumerate(bare, 1):
        word = re.search(r"T(\d+)", line)
        waiting = int(word.group(1)) if word else waiting
        if re.search(r"M0?6(?!\d)", line):
            changes.append((at, numbers.index(waiting)))
        if re.match(r"(N\d+)?M250", line):
            defined = at
        found = re.match(r"(?:N\d+)?M251.*?Q([\d.]+)", line)
        if found:
            rate = float(found.group(1)) * (INCH ** 3 if inch else 1000.0) / 60.0
            rates.append((at, min(rate, limits.get(waiting, rate))))
        if re.match(r"(N\d+)?M252", line):
            rates.append((at, 0.0))
    which = by_line(log, [at for at, _tool in changes])
    tool = np.array([index for _at, index in changes])[which.clip(0)]
    held = by_line(log, [at for at, _rate in rates])
    target = np.where(held < 0, 0.0, np.array([rate for _at, rate in rates])[held.clip(0)])
    start = int(np.argmax(by_line(log, [defined]) >= 0))
    return judging.Run(log, tool, start), [program.tools[n][0] for n in numbers], target


# --- cycle / optimum ----------------------------------------------------------------------------

def timed(run_, way):
    """What bench_time's functions want of a log."""
    speed = np.diff(way, prepend=way[:1]) / run_.took.clip(1e-9)
    return SimpleNamespace(tips=run_.tips, way=way, motion=run_.motion, line=run_.line, took=run_.took, speed=speed,
                           period=run_.period, feeding=run_.feeding)


def optimum(run_, swept, free_run, target, accel):
    """cycle / optimum over the whole run (s / s)."""
    held = timed(run_, np.cumsum(np.linalg.norm(np.diff(run_.tips, axis=0, prepend=run_.tips[:1]), axis=1)))
    free = timed(free_run, np.cumsum(np.linalg.norm(np.diff(free_run.tips, axis=0, prepend=free_run.tips[:1]), axis=1)))
    rows, other_rows = bench_time.Log.places(held), bench_time.Log.places(free)
    other_way = bench_time.matched(held, rows, free, other_rows)
    accel_of = bench_time.accelerations((held, free), accel)
    moving = np.concatenate([[True], np.diff(free.way) > 1e-9])
    actual = best = 0.0
    for first, last in bench_time.blocks(run_.feeding & (target > 0)):
        a, b = held.way[first - 1], held.way[last - 1]
        if b - a < 1e-6:
            continue
        way = np.linspace(a, b, max(3, int((b - a) / bench_time.SLACK_MM) + 1))
        planner = np.interp(np.interp(way, held.way[rows], other_way), free.way[moving], free.speed[moving])
        planner = np.maximum(planner, np.minimum(np.interp(way, held.way, held.speed), 0.5))
        index = np.searchsorted(held.way[first:last], way).clip(0, last - first - 1) + first
        gain = np.array([accel_of.get(place, accel) for place in zip(held.line[index], held.motion[index])])
        stock = target[index] / np.maximum(swept.area[index], 1e-9)
        best += bench_time.fastest(way, np.minimum(planner, stock), gain)[0]
        actual += float(held.took[first:last].sum())
    other = float(held.took.sum()) - actual
    return (actual + other) / (best + other)


# --- one line of the table ------------------------------------------------------------------------

def measure(program, condition, folder, with_optimum=True, speed=SPEED, keep=None):
    """dict of one run's figures."""
    summary, path = run(program, condition, folder, speed=speed)
    return figures(program, condition, summary, path, folder, with_optimum, speed)


def figures(program, condition, summary, path, folder, with_optimum=True, speed=SPEED):
    with np.load(path) as stored:
        log = {name: stored[name] for name in stored.files}
    run_, tools, target = told(program, log)
    target = target * target_scale(condition.override)
    swept = judging.sweep(run_, program.blank, tools)
    found = judging.judge(run_, program.blank, tools, target, swept)
    held = run_.feeding & (target > 0)
    tracker = float(log["removed_volume"][-1])
    result = {"program": program.name, "condition": str(condition), "finished": bool(summary["finished"]),
              "errors": summary["errors"], "lost": run_.lost, "cycle_s": float(run_.took.sum()),
              "peak_10ms": found.peak_10ms, "peak_1ms": found.peak_1ms, "over_share": found.over_share,
              "mean": found.mean, "volume": found.volume, "tracker": tracker,
              "volume_off": tracker / found.volume - 1.0 if found.volume else 0.0, "own_error": found.own_error,
              "rapid_volume": found.rapid_volume, "stops": sum("stopped" in text for text in summary["errors"]),
              "fallback_s": float((held & (log["limited_by"] == FALLBACK)).sum() * run_.period),
              "places": found.places, "worst": found.worst, "cycle_ratio": None}
    if with_optimum and summary["finished"] and not run_.lost:
        _summary, free_path = run(program, condition, folder, free=True, speed=speed)
        with np.load(free_path) as stored:
            free_log = {name: stored[name] for name in stored.files}
        free_run = told(program, free_log)[0]
        result["cycle_ratio"] = optimum(run_, swept, free_run, target, condition.accel)
    return result


HEAD = f"{'program':20s} {'condition':38s} {'10 ms %':>8s} {'1 ms %':>8s} {'>102 %':>7s} {'cyc/opt':>8s} " \
       f"{'tracker':>8s} {'judge':>7s} {'stops':>5s} {'fallb.':>6s} {'mean %':>7s}"


def line_of(f):
    if f["lost"]:
        return f"{f['program']:20s} {f['condition']:38s} VOID: {f['lost']} servo periods lost"
    ratio = f"{f['cycle_ratio']:8.4f}" if f["cycle_ratio"] else f"{'-':>8s}"
    text = f"{f['program']:20s} {f['condition']:38s} {100 * f['peak_10ms']:8.1f} {100 * f['peak_1ms']:8.1f} " \
           f"{100 * f['over_share']:7.2f} {ratio} {100 * f['volume_off']:+7.2f}% {100 * f['own_error']:6.2f}% " \
           f"{f['stops']:5d} {f['fallback_s']:5.1f}s {100 * f['mean']:7.2f}"
    return text + ("" if f["finished"] else "  NOT FINISHED: " + "; ".join(f["errors"])[:160])


def rows_of(f):
    """The rows of one run for build/bench.json."""
    name = f"{f['program']}, {f['condition']}"
    if f["lost"]:
        return [row(f"{name}: servo periods lost, void", f["lost"], "")]
    made = [row(f"{name}: peak rate, 10 ms", round(100 * f["peak_10ms"], 2), "%", target=PEAK,
                note=f"line {f['worst'][1]} at X{f['worst'][2]} Y{f['worst'][3]} Z{f['worst'][4]}" if f["worst"] else ""),
            row(f"{name}: cutting time above 102 %", round(100 * f["over_share"], 3), "%", target=SHARE),
            row(f"{name}: peak rate, 1 ms", round(100 * f["peak_1ms"], 2), "%"),
            row(f"{name}: volume, tracker less judge", round(100 * f["volume_off"], 3), "%",
                f"judge's own error {100 * f['own_error']:.2f} %; {'meets' if abs(f['volume_off']) <= VOLUME else 'MISSES'} 0.3"),
            row(f"{name}: stops and seconds without stock", f["stops"] + f["fallback_s"], "", target=0,
                note="; ".join(f["errors"])[:200])]
    if f["cycle_ratio"]:
        made.append(row(f"{name}: cycle / optimum", round(f["cycle_ratio"], 4), "x",
                        target=CYCLE["small" if f["program"] in SMALL else "long"]))
    return made


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", default=[], help="programs")
    parser.add_argument("--seed", default="1", help="of the foreign programs and of the conditions")
    parser.add_argument("--count", type=int, default=0, help="conditions beside the plain one, for each program")
    parser.add_argument("--foreign", action="store_true", help="not those of nc_files/")
    parser.add_argument("--no-plain", action="store_true", help="only the drawn conditions")
    parser.add_argument("--no-optimum", action="store_true", help="one run less each")
    parser.add_argument("--speed", type=float, default=SPEED)
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--keep", help="folder for programs and logs")
    parser.add_argument("--json", help="file for all figures")
    options = parser.parse_args()
    chosen = {} if options.foreign else own_programs()
    chosen.update(foreign.programs(options.seed))
    if options.only:
        chosen = {name: made for name, made in chosen.items() if name in options.only}
    if options.table:
        print(HEAD, flush=True)
    everything = []
    for name, program in chosen.items():
        for number, condition in enumerate(conditions(f"{options.seed} {name}", options.count)[int(options.no_plain):]):
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
                print(line_of(found), flush=True)
                for place in found["places"][:4]:
                    print("    %.3f for %g ms, line %d at X%g Y%g Z%g" % tuple(place), flush=True)
            else:
                for made in rows_of(found):
                    print(json.dumps(made), flush=True)
            if options.json:
                Path(options.json).write_text(json.dumps(everything, indent=1))


if __name__ == "__main__":
    main()
