# SPDX-License-Identifier: GPL-2.0-or-later
"""`chipwise turn` in figures: random parts against the oracle, residue, feed lengths, time of long profiles.

    /usr/bin/python3 bench/bench_turning.py [--count 50] [--seed 7134] [--cell 0.01] [--table]

Called by bench/run.py (prints JSON rows).
random   parts of lines, arcs, walls, pockets and bores, in both directions, C80 D55 V35, allowance 0 or 0.3, half with
         a chuck barrier
g71      LinuxCNC's own G71 and G70 on those parts that have no bore
residue  against closing by filters on a 0.005 mm grid, parts whose walls are on it
stopped  such parts, stopped at a random cut and finished by a second plan
long     one profile of 100 and of 1,000 elements: the whole plan, and the file of its stock
"""

import argparse
import json
import math
import pathlib
import random
import tempfile
import time

import roots  # noqa: F401  sys.path
from chipwise.errors import CycleError
from chipwise.turning import resume, stock_file
from chipwise.turning import nc, reach
from chipwise.turning.blocks import feed_of
from chipwise.turning.profile_function import at, flat
from chipwise.turning.plan import total_length
from chipwise.turning.times import seconds
from rows import row
from support.turning_cut import CELL, THIN, lengths
from support.turning_g71 import judged
from support.turning_oracle import Insert, judge, inaccessible_area
from support.turning_random import INSERTS, Case, words, dense, random_case
from support.turning_rest import feed_left, finished, stop, stopped
from support.turning_rig import planned, with_margins

RESIDUE_CASES = 6
SAMPLE_MM, ALMOST = 0.01, 0.02  # stock that is deeper than whole passes by less than 2 % of one needs no pass more
SECOND = 2  # tool of role FINISH in support/turning_rig.py, which roughs what the first one does not reach
REPEATS = 5  # of a plan: the least computing time, for other work on the processor only adds to it
LEVELS = ("rough outside", "rough inside", "rest outside", "rest inside")


class OfParts:
    """Sums and worst figures of random parts; lengths in mm, times in s."""

    def __init__(self):
        self.worst = {"gouge": -math.inf, "rapid": -math.inf, "holder": -math.inf}
        self.refused, self.barriers, self.columns = 0, 0, 0
        self.spent = 0.0  # for the slowest plan
        self.length, self.least, self.bound = 0.0, 0.0, 0.0
        self.cycle, self.shortest = 0.0, {True: 0.0, False: 0.0}
        self.total = {"feed": 0.0, "air": 0.0, "rapid": 0.0, (SECOND, "feed"): 0.0, (SECOND, "air"): 0.0}

    def add(self, case, folder, cell):
        """One part more."""
        self.barriers += bool(case.barrier)
        began = time.process_time()
        try:
            plan, request, machine, text = planned(case, folder)
        except CycleError:
            self.refused += 1
            return
        self.spent = max(self.spent, time.process_time() - began)
        found, _, _ = judge(text, request.scale, case, machine.tools)
        self.worst = {name: max(depth, found[name]) for name, depth in self.worst.items()}
        self.total = _added(self.total, lengths(text, request.scale, case.blank, machine.tools, cell))
        self._add_plan(plan, request, machine)

    def _add_plan(self, plan, request, machine):
        fine = total_length([s for s in plan.steps if s.name.startswith("finish")])
        levels = [s for s in plan.steps if s.name in LEVELS]
        self.length += total_length(levels) + fine
        self.least += sum(s.removed for s in levels) / request.words["D"] + fine
        self.bound += passes_along(plan, request.words["D"]) + fine
        self.columns += any(s.transverse for s in plan.steps)
        self.cycle += sum(seconds(s, request, machine.motion) for s in plan.steps if s.needed)
        for whole in self.shortest:
            self.shortest[whole] += least_seconds(plan, request, whole)


def random_parts(seed, count, folder, cell):
    """Rows of random parts."""
    found = OfParts()
    for k in range(count):
        found.add(random_case(random.Random(f"bench turning {seed} {k}")), folder, cell)
    note = f"{count} parts, {found.barriers} with a barrier"
    air = f"{note}; air is what takes less than {THIN * cell:g} mm"
    return [
        row("turning: deepest gouge, barriers included", max(found.worst["gouge"], 0.0), "mm", note, 0.001),
        row("turning: deepest rapid in stock", max(found.worst["rapid"], 0.0), "mm", note, 0.002),
        row("turning: holder in stock", max(found.worst["holder"], 0.0), "mm", note, 0.001),
        row("turning: parts refused", found.refused, "", note, 0),
        row("turning: slowest plan", found.spent, "s", note, 2.0),
        row("turning: feed in the air", 100 * found.total["air"] / found.total["feed"], "%", air, 5.0),
        row(
            "turning: the second tool's feed in the air",
            100 * found.total[SECOND, "air"] / found.total[SECOND, "feed"],
            "%",
            air,
            5.0,
        ),
        row("turning: rapids that cut", found.total["rapid"], "mm", air, 0.0),
        row("turning: feed / (area / D + finish)", found.length / found.least, "", note, 1.1),
        row(
            "turning: the same of passes along Z at depth D",
            found.bound / found.least,
            "",
            f"{note}; stock h deep is passed h / D times, rounded up",
        ),
        row(
            "turning: cycle / bound",
            found.cycle / found.shortest[False],
            "",
            f"{note}; bound: area / D at F, facing too, finish and drill at E, no rapids",
            1.1,
        ),
        row(
            "turning: cycle / bound of whole passes",
            found.cycle / found.shortest[True],
            "",
            f"{note}; the same with h / D rounded up",
        ),
        row("turning: parts with columns", found.columns, "", note),
    ]


def least_seconds(plan, request, whole):
    """s, a bound of the cycle: each step's area over the depth of cut at its feed, whole passes for levels if `whole`;
    the length of a finish or another step with the feed E as it is, of a drill its depth.  Nothing for rapids, entries,
    walls and slopes."""
    depth, total = request.words["D"], 0.0
    for step in (s for s in plan.steps if s.needed):
        if step.name == "face":
            length = step.removed / depth
        elif step.name == "drill":
            length = step.z1 - step.z0
        else:
            length = 0.0 if step.name in LEVELS else total_length([step])
        total += length / feed_of(step, request)
    levels = passes_along(plan, depth) if whole else sum(s.removed for s in plan.steps if s.name in LEVELS) / depth
    return 60.0 * (total + levels / request.words["F"])


def passes_along(plan, depth):
    """mm of passes along Z that take what the levels of a plan have taken, with nothing for entries and walls: stock h
    deep needs h / depth of them."""
    total, before = 0.0, plan.order.blank.bore or [flat(plan.order.blank.z0, plan.order.blank.z1, 0.0)]
    before = {False: plan.order.blank.outside, True: before}
    for step in plan.steps:
        side = step.tool is not None and step.tool.inside
        if step.name in LEVELS and step.needed:
            z0, z1 = step.after[side][0].z0, step.after[side][-1].z1
            for k in range(int((z1 - z0) / SAMPLE_MM) + 1):
                old, new = (at(g, z0 + (k + 0.5) * SAMPLE_MM) for g in (before[side], step.after[side]))
                if old is not None and new is not None and old - new > SAMPLE_MM:
                    total += SAMPLE_MM * math.ceil((old - new) / depth - ALMOST)
        before = step.after
    return total


def stopped_parts(seed, count, folder):
    """Rows of parts that are stopped and finished."""
    worst, left, again, cut = {"gouge": -math.inf, "rapid": -math.inf, "holder": -math.inf}, 0.0, 0.0, 0.0
    for k in range(count):
        rng = random.Random(f"bench stopped {seed} {k}")
        case = random_case(rng)
        plan, request, machine, text = planned(case, folder)
        stage, number, moves = stop(rng, plan)
        second = finished(plan, stage)
        found, _, _ = judge(
            stopped(text, number, moves) + nc.program(second, request, "rest"), request.scale, case, machine.tools
        )
        worst = {name: max(depth, found[name]) for name, depth in worst.items()}
        left, again, cut = (
            left + feed_left(plan, number, moves),
            again + total_length(second.steps),
            cut + total_length(plan.steps),
        )
    note = f"{count} parts"
    return [
        row("turning: stopped parts, deepest gouge", max(worst["gouge"], 0.0), "mm", note, 0.001),
        row("turning: stopped parts, deepest rapid in stock", max(worst["rapid"], 0.0), "mm", note, 0.002),
        row("turning: stopped parts, holder in stock", max(worst["holder"], 0.0), "mm", note, 0.001),
        row(
            "turning: feed of the rest / feed that was left",
            again / left,
            "",
            f"{note}; {again / cut:.2f} of the whole plan",
        ),
    ]


def _added(total, found):
    return {name: total[name] + found.get(name, 0.0) for name in total}


def g71(seed, count, folder):
    """Rows of LinuxCNC's own cycles on the same parts, depth of cut 1 mm."""
    total, failed, gouges, worst, parts = {"feed": 0.0, "air": 0.0, "rapid": 0.0}, 0, 0, 0.0, 0
    for k in range(count):
        case = random_case(random.Random(f"bench turning {seed} {k}"))
        if case.bore:
            continue
        parts += 1
        found = judged(case, Insert(0.8, *INSERTS[case.insert], 2), 1.0, folder)
        if found["error"]:
            failed += 1
            continue
        gouges, worst = gouges + (found["gouge"] > 0.001), max(worst, found["gouge"])
        total = _added(total, found)
    note = f"{parts} parts without a bore"
    return [
        row("G71 G70: parts that end in an error", failed, "", note),
        row("G71 G70: parts that are gouged", gouges, "", f"{note}; {worst:.2g} mm at most"),
        row("G71 G70: feed in the air", 100 * total["air"] / max(total["feed"], 1e-9), "%", note),
        row("G71 G70: rapids that cut", total["rapid"], "mm", note),
    ]


def residue(seed, folder):
    """Row of the largest difference of residue."""
    worst = 0.0
    for k in range(RESIDUE_CASES):
        case = random_case(random.Random(f"bench residue {seed} {k}"), allowance=0.0, snap=0.005)
        plan, _, machine, _ = planned(case, folder)
        exact = inaccessible_area(case, [with_margins(machine.tools[n]) for n in (1, 2)])
        worst = max(worst, abs(sum(r.area for r in plan.residue if not r.inside) - exact))
    return [
        row(
            "turning: residue against filters",
            worst,
            "mm2",
            f"{RESIDUE_CASES} parts with walls on the oracle's grid; closed forms agree to 1e-5 (tests/turning)",
            0.01,
        )
    ]


def long_case(count, seed):
    """Case of a profile of so many elements."""
    rng = random.Random(seed)
    chain, x = [(0.0, 12.0, None)], 12.0
    for k in range(1, count + 1):
        x = min(max(x + rng.uniform(-0.4, 0.4), 8.0), 16.0)
        chain.append((-60.0 * k / count, x, None))
    text = "\n".join(
        [
            "(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=34,ZMIN=-90,ZMAX=1)",
            "G21 G18 G8 G94 G97 S500 M3",
            "G26 Q100 I0.3 D1.5 F100",
            "M2",
            "O100 sub",
            *words(chain, False, 1.0),
            "O100 endsub",
            "",
        ]
    )
    return Case(text, dense(chain), [], (17.0, -90.0, 1.0), 0.3, sorted(INSERTS)[1])


def long_profiles(seed, folder):
    """Rows of profiles of 100 and 1,000 elements."""
    rows = []
    for count, target in ((100, 0.1), (1000, 1.0)):
        case = long_case(count, seed)
        times = []
        for _ in range(REPEATS):
            reach._dilated.cache_clear()
            began = time.process_time()
            plan, _, machine, program = planned(case, folder)
            times.append(time.process_time() - began)
        spent = min(times)
        found, _, _ = judge(program, 1.0, case, machine.tools)
        rows.append(
            row(
                f"turning: whole plan of {count} elements",
                spent,
                "s",
                f"computing time, the least of {REPEATS}; gouge {max(found['gouge'], 0.0):.2g} mm",
                target,
            )
        )
        began, stages = time.process_time(), resume.stages(plan).stages
        stock_file.write(str(folder / "turning.stock"), stock_file.key_of(plan.order, "part.ngc", (0.0, 0.0)), stages)
        rows.append(
            row(
                f"turning: file of the stock, {count} elements",
                time.process_time() - began,
                "s",
                f"{len(stages)} stages, {(folder / 'turning.stock').stat().st_size} bytes",
            )
        )
        rough = [s for s in plan.steps if s.name == "rough outside"]
        ratio = total_length(rough) / (rough[0].removed / 1.5)
        rows.append(
            row(
                f"turning: rough feed / (area / D), {count} elements",
                ratio,
                "",
                "with the shoulders that each level climbs",
                1.1,
            )
        )
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=7134)
    parser.add_argument("--cell", type=float, default=CELL, help="mm, of the grid on which feed in the air is measured")
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        rows = (
            random_parts(options.seed, options.count, folder, options.cell)
            + stopped_parts(options.seed, options.count, folder)
            + g71(options.seed, options.count, folder)
            + residue(options.seed, folder)
            + long_profiles(options.seed, folder)
        )
    if options.table:
        print("\n".join(f"{r['name']:48} {r['value']:10.4g} {r['unit']:4} {r['note']}" for r in rows))
    else:
        print(json.dumps(rows))


if __name__ == "__main__":
    main()
