# SPDX-License-Identifier: GPL-2.0-or-later
"""A program on the real LinuxCNC under a condition, and what the judge says of the run.

Called by bench/bench_claims.py (all programs and conditions, cycle / optimum), bench/bench_styles.py, test_foreign.py
and test_foreign_styles.py (two each).
"""

import re
from dataclasses import dataclass

import numpy as np

from chipwise.headless import runner
from support import ROOT, foreign
from support import judge as judging
from support.headless_rig import SLOW_MOTION

SPEED = 6.0
FREE, FREE_MOST = 1000.0, 600.0  # times Q; cm3/min or in3/min, and M251 takes no more than that of an inch program
INCH = 25.4
PATH = re.compile(r"^(N\d+ ?)?(?:G61\.1|G61|G64)(?: ?P[\d.]+)?(?: ?Q[\d.]+)?\s*$", re.M)
FALLBACK = 5  # volumetric-feed.limited-by


def target_scale(override):
    """The rate that counts under a feed override: the override multiplies the rate like any feed
    (docs/design/hal.md)."""
    return override


@dataclass(frozen=True)
class Condition:
    path: str = ""  # "" as the program has it; lengths in mm
    accel: float = 500.0  # mm/s2
    period: float = 1.0  # ms
    override: float = 1.0
    inch: bool = False
    arc_blends: bool = True  # False: [TRAJ]ARC_BLEND_ENABLE = 0, parabolic blends only

    def __str__(self):
        words = [self.path or "as written", f"{self.accel:g} mm/s2"]
        if self.period != 1.0:
            words.append(f"{self.period:g} ms")
        if self.override != 1.0:
            words.append(f"{100 * self.override:g} %")
        if self.inch:
            words.append("inch machine")
        if not self.arc_blends:
            words.append("parabolic blends")
        return ", ".join(words)


def own_rates():
    """{tool number: mm3/s} of the sample geometry file, whose rates are cm3/min."""
    text = (ROOT / "configs" / "tools.toml").read_text()
    return {
        int(n): float(rate) * 1000.0 / 60.0
        for n, rate in re.findall(r"\[tool\.(\d+)\](?:(?!\[tool).)*?max_rate = ([\d.]+)", text, re.S)
    }


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
    text = re.sub(r"^DISPLAY *=.*$", f"DISPLAY = {ROOT}/tests/support/claims_display", text, flags=re.M)
    text = re.sub(r"^TOOL_TABLE *=.*$", f"TOOL_TABLE = {table}", text, flags=re.M)
    text = re.sub(r"^TOOL_GEOMETRY *=.*$", f"TOOL_GEOMETRY = {geometry}", text, flags=re.M)
    text = re.sub(r"^(\w*ACCELERATION) *=.*$", rf"\1 = {condition.accel / unit:.6f}", text, flags=re.M)
    text = re.sub(r"^SERVO_PERIOD *=.*$", f"SERVO_PERIOD = {round(condition.period * 1e6)}", text, flags=re.M)
    text = re.sub(r"^COMM_TIMEOUT *=.*$", SLOW_MOTION, text, flags=re.M)
    text = re.sub(r"^SUBROUTINE_PATH *=.*$", f"SUBROUTINE_PATH = {ROOT}/nc_files", text, flags=re.M)
    if not condition.arc_blends:
        text = text.replace("[TRAJ]\n", "[TRAJ]\nARC_BLEND_ENABLE = 0\n", 1)
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
    return re.sub(
        r"^(M251.*?Q)([\d.]+)", lambda m: f"{m.group(1)}{min(float(m.group(2)) * FREE, FREE_MOST):g}", text, flags=re.M
    )


def run(program, condition, folder, free=False, speed=SPEED, settings=None):
    """-> (summary, log) of one run; settings: {key: text} of [CHIPWISE]."""
    stem = f"{program.name}-{'free' if free else 'held'}"
    text = with_path(program.text, condition.path)
    (folder / f"{stem}.ngc").write_text(without_limit(text) if free else text)
    unit = INCH if condition.inch else 1.0
    table, geometry = folder / f"{stem}.tbl", folder / f"{stem}.toml"
    if program.notes == "own":
        sample = "mill_inch.tbl" if condition.inch else "mill.tbl"
        table.write_text((ROOT / "configs" / sample).read_text())
        shapes = (ROOT / "configs" / "tools.toml").read_text()
        geometry.write_text(re.sub(r"^max_rate.*\n", "", shapes, flags=re.M) if free else shapes)
    else:
        table.write_text(foreign.tool_table(program.tools, unit))
        geometry.write_text(foreign.geometry_file(program.tools))
    ini = folder / f"{stem}.ini"
    ini.write_text(ini_text(condition, table, geometry))
    log = folder / f"{stem}.npz"
    summary = runner.run_headless(
        str(folder / f"{stem}.ngc"),
        runner.Machine(str(ini), settings, {"CLAIMS_OVERRIDE": f"{condition.override:g}"}),
        speed=speed,
        log=str(log),
        timeout=3000.0,
    )
    return summary, log


def by_line(log, at_lines):
    """Index into `at_lines` (sorted line numbers) of the last one passed, -1 before the first, for every row.

    No program here goes back to a tool change or a code of ours; a sub above them is run after them.
    """
    farthest = np.maximum.accumulate(np.where(log["motion_type"] > 0, log["line"], 0))
    return np.searchsorted(np.array(at_lines), farthest, side="left") - 1


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
            rate = float(found.group(1)) * (INCH**3 if inch else 1000.0) / 60.0
            rates.append((at, min(rate, limits.get(waiting, rate))))
        if re.match(r"(N\d+)?M252", line):
            rates.append((at, 0.0))
    which = by_line(log, [at for at, _tool in changes])
    tool = np.array([index for _at, index in changes])[which.clip(0)]
    held = by_line(log, [at for at, _rate in rates])
    target = np.where(held < 0, 0.0, np.array([rate for _at, rate in rates])[held.clip(0)])
    start = int(np.argmax(by_line(log, [defined]) >= 0))
    return judging.Run(log, tool, start), [program.tools[n][0] for n in numbers], target


def loaded(path):
    """A log, {column: values}."""
    with np.load(path) as stored:
        return {name: stored[name] for name in stored.files}


def mean_off(run_, swept, summary):
    """The summary's rate_mean against the judge: volume over the time of feed moves whose section area is above
    CUTTING_MM2; a share."""
    gone = np.diff(swept.volume, prepend=0.0)
    cuts = run_.feeding & ~run_.apart & (swept.area > judging.CUTTING_MM2) & (gone > 0)
    return summary["rate_mean"] / (60.0 * gone[run_.feeding].sum() / (cuts.sum() * run_.period)) - 1.0


def peak_off(run_, swept, summary):
    """The same of rate_peak: the largest volume in WINDOW_S wholly in feed moves."""
    span = int(round(judging.WINDOW_S / run_.period))
    _rows, rate = judging.windows(run_, swept, np.ones(len(run_.feeding)), span)
    return summary["rate_peak"] / (60.0 * rate.max()) - 1.0


def measure(program, condition, folder, speed=SPEED, cell=judging.CELL, settings=None):
    """(dict of one run's figures, judging.Run, its swept stock, target (n,) mm3/s under the condition).  cell: mm, the
    judge's."""
    summary, path = run(program, condition, folder, speed=speed, settings=settings)
    log = loaded(path)
    run_, tools, target = told(program, log)
    target = target * target_scale(condition.override)
    swept = judging.sweep(run_, program.blank, tools, cell)
    found = judging.judge(run_, program.blank, tools, target, swept)
    held = run_.feeding & (target > 0)
    # at rest, before the task has sent the next move, no velocity is asked for, and the law has none to compare with
    fallback = held & (log["limited_by"] == FALLBACK) & (log["velocity"] > 0)
    tracker = float(log["removed_volume"][-1])
    result = {
        "program": program.name,
        "condition": str(condition),
        "finished": bool(summary["finished"]),
        "errors": summary["errors"],
        "lost": run_.lost,
        "cycle_s": float(run_.took.sum()),
        "peak_10ms": found.peak_10ms,
        "peak_1ms": found.peak_1ms,
        "over_share": found.over_share,
        "mean": found.mean,
        "volume": found.volume,
        "tracker": tracker,
        "volume_off": tracker / found.volume - 1.0 if found.volume else 0.0,
        "own_error": found.own_error,
        "rapid_volume": found.rapid_volume,
        "stops": sum("stopped" in text for text in summary["errors"]),
        "fallback_s": float(fallback.sum() * run_.period),
        "rate_mean_off": mean_off(run_, swept, summary),
        "rate_peak_off": peak_off(run_, swept, summary),
        "places": found.places,
        "worst": found.worst,
        "cycle_ratio": None,
    }
    return result, run_, swept, target


HEAD = (
    f"{'program':20s} {'condition':38s} {'10 ms %':>8s} {'1 ms %':>8s} {'>102 %':>7s} {'cyc/opt':>8s} "
    f"{'tracker':>8s} {'judge':>7s} {'stops':>5s} {'fallb.':>6s} {'mean %':>7s} {'m.off%':>6s} {'p.off%':>6s}"
)


def line_of(f):
    if f["lost"]:
        return f"{f['program']:20s} {f['condition']:38s} VOID: {f['lost']} servo periods lost"
    ratio = f"{f['cycle_ratio']:8.4f}" if f["cycle_ratio"] else f"{'-':>8s}"
    text = (
        f"{f['program']:20s} {f['condition']:38s} {100 * f['peak_10ms']:8.1f} {100 * f['peak_1ms']:8.1f} "
        f"{100 * f['over_share']:7.2f} {ratio} {100 * f['volume_off']:+7.2f}% {100 * f['own_error']:6.2f}% "
        f"{f['stops']:5d} {f['fallback_s']:5.1f}s {100 * f['mean']:7.2f} {100 * f['rate_mean_off']:+6.2f} "
        f"{100 * f['rate_peak_off']:+6.2f}"
    )
    return text + ("" if f["finished"] else "  NOT FINISHED: " + "; ".join(f["errors"])[:160])
