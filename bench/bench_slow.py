# SPDX-License-Identifier: GPL-2.0-or-later
"""A computer that is four times slower: the ten foreign programs with a part of the stock model's work in each servo
period.

Called by bench/run.py (prints JSON rows, of three programs); by hand with --table: `/usr/bin/python3
bench/bench_slow.py --table`.

 1. `chipwise load` measures how much of the work a period has time for (clib/work_trial.py); --slower says how many
    times slower than this one the computer is.  What it chooses for that is the first row.  --work takes another part:
    the default, 25 %, is what a quarter of the time does, though much more fits in most computers.
 2. Each program of tests/support/foreign.py runs in LinuxCNC with it, and tests/support/judge.py says what the tool
    removed, as in bench_claims.py.
 3. The tips of its log go through the C core again, without LinuxCNC, with that work.  The time of a period is the
    fastest of REPLAYS, because the work is the same each time and what else this computer does is not, times --slower.
    The path ahead is the predicted one there; what is read for either has the same bound.
"""

import argparse
import ctypes as C
import json
import tempfile
import time
from pathlib import Path

import numpy as np

import roots  # noqa: F401  puts tests/ and remap/ on the path
from rows import row
from support import claims, foreign
from chipwise.cli.load import finest_cell, tool_shapes
from chipwise.clib import layout, work_trial
from chipwise.clib.library import library
from chipwise.ini import Ini
from chipwise.settings import load_settings

SEED = "1"
SLOWER, WORK = 4.0, 25
PEAK, SHARE = 103.0, 60.0  # % of the target; % of the servo period
SHORT = ("fusion_adaptive", "taper_two_tools", "facing_rim")  # what bench/run.py runs
REPLAYS = 3
FILLING = 2000  # periods at most until a stock is filled


class Replay:
    """The tracker of a log: its tools and blank."""

    def __init__(self, run, tools, blank, ini):
        self.run, self.tools = run, tools
        opened = Ini(str(ini))
        settings = load_settings(str(ini))
        self.cell, self.size = settings["CELL"], settings["MAP_SIZE"]
        self.finest = finest_cell(opened, settings, tool_shapes(settings))
        half = np.array([0.5 * blank.size_x, 0.5 * blank.size_y])
        self.low, self.high = (
            (*(np.array([blank.x, blank.y]) - half), blank.low),
            (*(np.array([blank.x, blank.y]) + half), blank.high),
        )
        self.round, self.turn = blank.round, np.degrees(blank.turn)

    def begin(self, work):
        """-> (tracker, input, output, address of the map, its memory): a stock is defined."""
        lib = library()
        cells = lib.chip_stock_cells(self.cell, *self.size)
        block = np.zeros(lib.chip_stock_bytes(cells), np.uint8)
        tracker, given, out = layout.Tracker(), layout.TrackerIn(), layout.TrackerOut()
        lib.chip_stock_init_finer(block.ctypes.data, self.cell, self.finest, cells)
        lib.chip_tracker_init(C.byref(tracker))
        lib.chip_tracker_set_work(C.byref(tracker), C.c_int(work))
        given.mu_per_mm, given.period_s, given.mrr_window_s, given.acceleration_mu_s2 = (
            1.0,
            self.run.period,
            0.02,
            500.0,
        )
        given.box_shape, given.box_turn_deg, given.define_request = int(self.round), self.turn, 1
        for axis in range(3):
            given.axis_acceleration_mu_s2[axis] = 500.0
            given.box_min_mu[axis], given.box_max_mu[axis], given.pos_mu[axis] = (
                self.low[axis],
                self.high[axis],
                self.run.tips[0, axis],
            )
        self.take(given, 0)
        for _ in range(FILLING):
            lib.chip_tracker_step(C.byref(tracker), C.c_void_p(block.ctypes.data), C.byref(given), C.byref(out))
            if out.is_ready:
                return tracker, given, out, block
        raise SystemExit(f"bench_slow: the stock was not defined: fault {out.fault_number}")

    def take(self, given, number):
        tool = self.tools[number]
        given.tool_diameter_mu, given.tool_corner_radius_mu, given.tool_tip_angle_deg = (
            tool.diameter,
            tool.corner,
            tool.angle,
        )

    def once(self, work):
        """(n,) ns of each period."""
        tracker, given, out, block = self.begin(work)
        step, clock = library().chip_tracker_step, time.perf_counter_ns
        words = C.byref(tracker), C.c_void_p(block.ctypes.data), C.byref(given), C.byref(out)
        run, taken, place = self.run, 0, given.pos_mu
        took = np.zeros(len(run.tips))
        given.is_enabled, given.define_request = 1, 0
        for n, (tip, motion, tool, apart) in enumerate(
            zip(run.tips.tolist(), run.motion.tolist(), run.tool.tolist(), run.apart.tolist())
        ):
            if tool != taken:
                self.take(given, tool)
                taken = tool
            given.is_enabled = int(not apart)  # a tool change, and what came before the stock
            given.motion = motion
            place[0], place[1], place[2] = tip
            begun = clock()
            step(*words)
            took[n] = clock() - begun
        return took

    def costliest_us(self, work):
        """us of the costliest period."""
        return float(np.minimum.reduce([self.once(work) for _ in range(REPLAYS)]).max() / 1000.0)


def measured(program, work, speed):
    """claims' figures of a run, and the costliest period (us) of its path on this computer."""
    with tempfile.TemporaryDirectory() as folder:
        condition = claims.Condition()
        found, run, _swept, _target = claims.measure(
            program, condition, Path(folder), speed=speed, settings={"WORK": str(work)}
        )
        tools = [program.tools[n][0] for n in sorted(program.tools)]
        found["costliest_us"] = Replay(
            run, tools, program.blank, Path(folder, f"{program.name}-held.ini")
        ).costliest_us(work)
    return found


def rows_of(f, slower):
    """The rows of one run for build/bench.json."""
    name = f"{f['program']}, a quarter of the work"
    if f["lost"]:
        return [row(f"{name}: servo periods lost, void", f["lost"], "")]
    return [
        row(f"{name}: peak rate, 10 ms", round(100 * f["peak_10ms"], 2), "%", target=PEAK),
        row(
            f"{name}: costliest period, {slower:g} times slower",
            round(slower * f["costliest_us"] / 10.0, 1),
            "% of 1 ms",
            target=SHARE,
        ),
        row(f"{name}: operator errors", len(f["errors"]), "", target=0, note="; ".join(f["errors"])[:200]),
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", default=[], help="programs")
    parser.add_argument("--slower", type=float, default=SLOWER, help="times")
    parser.add_argument("--work", type=int, default=WORK, help="per cent of the stock model's work in a period")
    parser.add_argument("--speed", type=float, default=claims.SPEED)
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    chosen = work_trial.choose(0.001, options.slower)
    line = row(
        f"chipwise load on a computer {options.slower:g} times slower: work",
        chosen,
        "%",
        f"costliest period {options.slower * work_trial.costliest_us(chosen):.0f} us of 1000",
    )
    print(f"{line['name']} {chosen} %, {line['note']}" if options.table else json.dumps(line), flush=True)
    for name, program in foreign.programs(SEED).items():
        if name not in (options.only or (foreign.programs(SEED) if options.table else SHORT)):
            continue
        found = measured(program, options.work, options.speed)
        if options.table:
            print(
                f"{name:18s} peak {100 * found['peak_10ms']:6.1f} %  above 102 % {100 * found['over_share']:5.2f} %  "
                f"volume {100 * found['volume_off']:+.2f} %  "
                f"costliest period {options.slower * found['costliest_us']:6.1f} us of 1000  lost {found['lost']}  "
                f"stops {found['stops']}  " + "; ".join(found["errors"])[:200],
                flush=True,
            )
        else:
            for made in rows_of(found, options.slower):
                print(json.dumps(made), flush=True)


if __name__ == "__main__":
    main()
