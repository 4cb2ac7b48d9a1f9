# SPDX-License-Identifier: GPL-2.0-or-later
"""Rate, chip, power, torque and side force limited at once, on the real LinuxCNC: cycle / optimum, and how the limits
are kept and used.

Called by bench/run.py (prints JSON rows, of one program); by hand with --table: `/usr/bin/python3 bench/bench_limits.py
--table --only slots fusion_adaptive`.

 1. A program runs at the rate of its M251 alone.  tests/support/judge_force.py says what the edges met, from the
    servo-rate log, the blank and the tools alone.
 2. It runs again with limits: chip and side force of each tool, power and torque of the spindle, each SHARE of the
    median of 1.
 3. It runs a third time with no limit and a rate out of reach: the velocity that the planner allows.
 4. The optimum is the fastest run along the same path below that velocity and the velocity that the rate and each limit
    allow at every place, by what the judge says was met there, with the planner's accelerations (bench_claims.py).
 5. Chip, power and force are judged in means over 10 ms.
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import bench_claims
import bench_force
from rows import by_program, row
from chipwise.tool_data.materials import find_material
from support import claims, foreign, judge_force
from support import judge as judging
from support.claims import Condition

SHARE = {"chip": 0.9, "power": 0.9, "torque": 0.9, "force": 0.9}
LEAST = 1e-3  # of the limit: less is air
CYCLE, PEAK, OVER, OVER_SHARE = 1.02, 102.0, 1.05, 0.2  # x, %, of the limit, % of the time
WINDOW_S = 0.010
BY = {"chip": 6, "power": 7, "torque": 8, "force": 9}  # volumetric-feed.limited-by
OWN = ("slots", "panel")
SHORT = ("slots",)  # what bench/run.py runs
HEAD = (
    f"{'program':20s} {'cyc/opt':>8s} {'time s':>7s} {'by rate':>7s}   limit: peak %, > 105 % of the time, used %, "
    "limits % of the time"
)


@dataclass
class Limits:
    chip: dict  # mm, of each tool
    force: dict  # N
    power: float  # W
    torque: float  # Nm

    def settings(self, program, folder):
        """[CHIPWISE] of a run with them."""
        made = bench_force.settings_of(program, self.force, folder)
        path = Path(made["TOOL_GEOMETRY"])
        text = path.read_text()
        for number, chip in self.chip.items():
            text = text.replace(f"[tool.{number}]\n", f"[tool.{number}]\nchip_load = {chip:.9f}\n")
        path.write_text(text)
        return {**made, "SPINDLE_POWER": f"{self.power:.6f}", "SPINDLE_TORQUE": f"{self.torque:.9f}"}

    def of_samples(self, program, run):
        """{kind: (n,) limit at each sample}; inf: none."""
        numbers = sorted(program.tools)
        chip, force = (np.array([found.get(n, np.inf) for n in numbers])[run.tool] for found in (self.chip, self.force))
        whole = np.ones(len(run.tool))
        return {"chip": chip, "power": self.power * whole, "torque": self.torque * whole, "force": force}


class Ran:
    """A run and what the edges met in it."""

    def __init__(self, program, material, settings, folder, cell):
        self.summary, path = claims.run(program, Condition(), folder, settings=settings)
        log = claims.loaded(path)
        self.run, self.tools, self.target = claims.told(program, log)
        self.held = self.run.feeding & (self.target > 0.0)
        self.limited_by, self.rps = log["limited_by"], bench_force.spindle(program, log)
        self.material, self.program = material, program
        edges = [bench_force.edges_of(tool) for tool in self.tools]
        self.met = judge_force.met(
            self.run, program.blank, self.tools, edges, self.rps, material.mc, cell or bench_force.step_of(program)
        )

    def loads(self):
        """{kind: (n,) as it was}."""
        met, power = self.met, 1.0 - self.material.mc
        watts = self.material.kc11 * met.rate * met.work * met.fed**power / 1000.0
        return {
            "chip": met.chip * met.fed,
            "power": watts,
            "torque": watts / np.maximum(2.0 * np.pi * self.rps, 1e-9),
            "force": self.material.kc11 * met.most * met.fed**power,
        }

    def limits(self):
        """Limits: SHARE of the median of each, in the time in which a tool cuts under M251."""
        loads, cuts = self.loads(), self.held & (self.met.work > 0.0)
        each = {
            kind: {
                n: SHARE[kind] * float(np.median(loads[kind][some]))
                for k, n in enumerate(sorted(self.program.tools))
                if (some := cuts & (self.run.tool == k)).any() and np.median(loads[kind][some]) > least
            }
            for kind, least in (("chip", 0.0), ("force", bench_force.SMALLEST))
        }
        power, torque = (SHARE[kind] * float(np.median(loads[kind][cuts])) for kind in ("power", "torque"))
        return Limits(each["chip"], each["force"], power, torque)

    def allowed(self, limits):
        """(n,) mm/s: the largest velocity within the limits {kind: (n,)} at each place."""
        met, kc11, inverse = self.met, self.material.kc11, 1.0 / (1.0 - self.material.mc)
        watts = np.minimum(limits["power"], limits["torque"] * 2.0 * np.pi * self.rps)
        with np.errstate(divide="ignore", invalid="ignore"):
            fed = np.minimum.reduce(
                [
                    limits["chip"] / met.chip,
                    (limits["force"] / (kc11 * met.most)) ** inverse,
                    (1000.0 * watts / (kc11 * met.rate * met.work)) ** inverse,
                ]
            )
        return np.where(met.work > 0.0, fed * met.rate, np.inf)

    def verdicts(self, limits):
        """{kind: (peak, share of the time above OVER, used, share of the time in which it is said to limit)}."""
        span = max(1, round(WINDOW_S / self.run.period))
        even, loads = np.full(span, 1.0 / span), self.loads()
        held = self.held & ~self.run.apart
        whole = np.convolve(held, even, "valid") > 1.0 - 0.5 / span
        found = {}
        for kind, limit in limits.items():
            load = np.convolve(np.where(np.isfinite(limit), loads[kind] / limit, 0.0), even, "valid")
            rows = whole & (load > LEAST)
            said = rows & (np.convolve(self.limited_by == BY[kind], even, "valid") > 1.0 - 0.5 / span)
            found[kind] = (
                float(load[rows].max(initial=0.0)),
                float((load[rows] > OVER).mean()) if rows.any() else 0.0,
                float(np.median(load[said])) if said.any() else 0.0,
                float(said.sum() / max(rows.sum(), 1)),
            )
        return found


def measured(program, folder, cell=None):
    """dict of the figures of a program.  cell: mm between judged places; None: bench_force.step_of()."""
    material = find_material(bench_force.MATERIAL)
    plain = Ran(program, material, bench_force.settings_of(program, {}, folder), folder, cell)
    limits = plain.limits()
    found = Ran(program, material, limits.settings(program, folder), folder, cell)
    _summary, path = claims.run(
        program, Condition(), folder, free=True, settings=bench_force.settings_of(program, {}, folder)
    )
    free = claims.told(program, claims.loaded(path))[0]
    swept, each = judging.sweep(found.run, program.blank, found.tools), limits.of_samples(program, found.run)
    return {
        "program": program.name,
        "cycle_ratio": bench_claims.optimum(
            found.run, swept, free, found.target, Condition().accel, found.allowed(each)
        ),
        "time_s": float(found.run.took.sum()),
        "time_by_rate_s": float(plain.run.took.sum()),
        "limits": {kind: float(np.min(limit)) for kind, limit in each.items()},
        "verdicts": found.verdicts(each),
        "lost": plain.run.lost + found.run.lost + free.lost,
        "errors": found.summary["errors"],
    }


def line_of(f):
    if f["lost"]:
        return f"{f['program']:20s} VOID: {f['lost']} servo periods lost"
    kept = "; ".join(
        f"{kind} {f['limits'][kind]:.4g}: " + ", ".join(f"{100 * value:.4g}" for value in verdict)
        for kind, verdict in f["verdicts"].items()
    )
    return f"{f['program']:20s} {f['cycle_ratio']:8.4f} {f['time_s']:7.1f} {f['time_by_rate_s']:7.1f}   {kept}"


def rows_of(f):
    """The rows of one program for build/bench.json."""
    name = f["program"]
    if f["lost"]:
        return [row(f"{name}: servo periods lost, void", f["lost"], "")]
    made = [row(f"{name}: cycle / optimum under all limits", round(f["cycle_ratio"], 4), "x", target=CYCLE)]
    for kind, (peak, over, used, said) in f["verdicts"].items():
        made += [
            row(f"{name}: largest {kind}, 10 ms", round(100 * peak, 2), "%", target=PEAK),
            row(f"{name}: {kind}, time above 105 %", round(100 * over, 3), "%", target=OVER_SHARE),
            row(f"{name}: {kind}, used", round(100 * used, 2), "%", f"limits {100 * said:.0f} % of the time"),
        ]
    return made


def programs(seed):
    """{name: Program}; those of nc_files/ with the tools of the sample table, without their own rates."""
    own = bench_claims.own_programs()
    return {**{name: replace(own[name], notes="") for name in OWN}, **foreign.programs(seed)}


if __name__ == "__main__":
    by_program(sys.modules[__name__], programs)
