# SPDX-License-Identifier: GPL-2.0-or-later
"""G75 in figures: error against the oracle, and the time of many copies.

    /usr/bin/python3 bench/bench_pattern.py [--count 20] [--seed 7134] [--only error stations ..] [--table]

Called by bench/run.py (prints JSON rows).
error    random subs (tests/support/pattern_oracle.py) x 8 transforms in LinuxCNC's interpreter, against what each sub
         does by itself
stations random stations from exact points, and from points that are 0.01 mm off, against the bound that is predicted
robot    random programs of the simulated robot: bad ones that are found, good ones that are refused
         (tests/support/reach_oracle.py)
climb    share of the volume that is cut climbing (tests/support/climb_oracle.py), of subs and of their mirror images,
         kept and not kept
copies   200 copies of a sub of 500 moves: computing time of the plan, its child process included, and of LinuxCNC
         executing the lines
"""

import argparse
import json
import os
import random
import re
import tempfile
import time

import numpy as np

import roots  # noqa: F401  sys.path
from chipwise.planner import plans
from chipwise.contour_sub.job import Job
from chipwise.order import Order
from chipwise.pattern.job import PatternJob
from chipwise.stations.frame import frame_of
from rows import row
from roots import ROOT
from support import canon, climb_oracle, pattern_oracle, reach_oracle
from support.pattern_oracle import calls_to_moves, compare, moves_of, random_sub, transformed
from support.station_cases import case, off, shares_of_bound

HEAD = "G21 G90 G64 G94 G17 G40\nT1 M6\nS5000 M3\nF600\n"
COPIES, MOVES = 200, 500
TRIES = 5  # plans; the least computing time counts: what other processes do to the caches is not the plan's
GROUP = 4  # subs in a program
CONTOURS = 8  # one sub of so many has G77, G78, G79 and patterns of its own: most of the time


def transforms(seed):
    """Eight (mirror, degrees, shift)."""
    r = random.Random(f"bench pattern {seed}")
    places = [
        (mirror, degrees)
        for mirror in (0, 1, 2, 3)
        for degrees in (90.0 * r.randrange(4), round(r.uniform(-360, 360), 4))
    ]
    return [(mirror, degrees, tuple(round(r.uniform(-50, 50), 4) for _ in range(3))) for mirror, degrees in places]


def places_of(number):
    """[(sub, mirror, degrees, shift)] of a random sub; a cycle in a mirrored pattern plans the other hand, so those
    subs have none."""
    subs = {cycles: random_sub(number, cycles, contours=number % CONTOURS == 0) for cycles in (True, False)}
    return [(subs[mirror in (0, 3)], mirror, degrees, shift) for mirror, degrees, shift in transforms(number)]


def errors(seed, count):
    """(largest error in mm, cases, those that are not compared because arcs become chords, cases that differ
    otherwise)."""
    worst, cases, chords, wrong = 0.0, 0, 0, []
    for first in range(seed, seed + count, GROUP):
        numbers = range(first, min(first + GROUP, seed + count))
        places = [(number, *place) for number in numbers for place in places_of(number)]
        exact = [
            place
            for place in places
            if place[3] % 90 == 0 or not any("G18" in line or "G19" in line for line in place[1])
        ]
        cases, chords = cases + len(exact), chords + len(places) - len(exact)
        for place, pairs in zip(exact, _pairs(exact)):
            number, _sub, mirror, degrees, shift = place
            try:
                if isinstance(pairs, AssertionError):
                    raise pairs
                compare(*pairs, lambda p, m=mirror, d=degrees, s=shift: transformed(p, m, d, s))
                worst = max(
                    worst,
                    *(
                        float(np.abs(a.points - transformed(b.points, mirror, degrees, shift)).max())
                        for a, b in zip(*pairs)
                    ),
                )
            except AssertionError as error:
                wrong.append(f"CHIPWISE_SEED={number} H{mirror} R{degrees:.4f}: {str(error)[:200]}")
    return worst, cases, chords, wrong


def _pairs(places):
    """Of each place (moves as a pattern, moves of the sub by itself from where that place begins), or the error of its
    program.

    All are one program, because most of the time is the start of its processes; if that has an error, each is one of
    its own.
    """
    trace = canon.run_preview("\n".join(_program(places)), timeout=900)
    if trace.error:
        return (
            [AssertionError(trace.error)]
            if len(places) == 1
            else [pair for place in places for pair in _pairs([place])]
        )
    calls = json.loads(trace.output.splitlines()[-1])["calls"]
    ends = [0, *(n + 1 for n, (kind, _line, *more) in enumerate(calls) if kind == "comment" and more[0] == "end")]
    parts = [calls_to_moves(calls[a:b], "begin", "end") for a, b in zip(ends, ends[1:])]
    return list(zip(parts[::2], parts[1::2]))


def _program(places):
    lines, names = [], {}
    for number, sub, *_ in places:
        key = number, id(sub)
        if key not in names:
            names[key] = 1000 * len(names)
            lines += [
                re.sub(r"\b([oQ])(\d{3})\b", lambda found, key=key: f"{found[1]}{int(found[2]) + names[key]}", line)
                for line in sub
            ]
    lines += [HEAD]
    for number, sub, mirror, degrees, shift in places:
        start, name = np.array([[3.0, -4.0, 7.0 + shift[2]]]), 100 + names[number, id(sub)]
        back = transformed(transformed(start - np.array(shift), 0, -degrees, (0, 0, 0)), mirror, 0, (0, 0, 0))
        pattern = f"G75 Q{name} H{mirror} R{degrees:.4f} X{shift[0]} Y{shift[1]} Z{shift[2]}"
        for place, call in zip((start, back), (pattern, f"o{name} call")):
            where = " ".join(f"{letter}{value:.9f}" for letter, value in zip("XYZ", place[0]))
            # a plain call leaves the modes of the sub to the next one
            lines += ["G21 G90 G91.1 G94 G17 G40 G98 F600", f"G0 {where}", "(begin)", call, "(end)"]
    return [*lines, "M2", ""]


def stations(seed, count):
    """(largest error of exact points in mm, largest share of the bound, stations)."""
    worst = 0.0
    for number in range(seed, seed + count):
        matrix, origin, local, points = case(number)
        found = frame_of(points)
        worst = max(worst, *(off(found, matrix, origin, np.array(place, float)) for place in local.values()))
    return worst, max(max(shares_of_bound(number, 0.01)) for number in range(seed, seed + count)), count


def climbs(seed, count):
    """(largest difference of the climb share with it kept, and to the other share without, patterns)."""
    kept, lost, pattern_oracle.SHARES = 0.0, 0.0, np.linspace(0.0, 1.0, 33)[1:]
    for number in range(seed, seed + count):
        sub, shares = climb_oracle.random_profile(number), []
        for call, before, x in (
            ("o100 call", "", 3),
            ("G75 Q100 H1", "#<_chipwise_keep_climb> = 1", -3),
            ("G75 Q100 H1", "", -3),
        ):
            text = "\n".join([*sub, HEAD, before, f"G0 X{x} Y-4 Z7", "(begin)", call, "(end)", "M2", ""])
            shares.append(climb_oracle.cut(moves_of(text)[0], (x, -4.0, 7.0), climb_oracle.disc(9.5), 1.0)[0])
        kept, lost = max(kept, abs(shares[1] - shares[0])), max(lost, abs(shares[2] - 1 + shares[0]))
    return kept, lost, count


def robots(seed, count):
    """(bad programs, those not found, good programs, those refused) of so many."""
    verdicts = [reach_oracle.judged(number, wild=number % 2 == 1) for number in range(seed, seed + count)]
    bad, good = ([said for verdict, said in verdicts if verdict == kind] for kind in ("bad", "good"))
    return len(bad), sum(not said for said in bad), len(good), sum(bool(said) for said in good)


def long_sub(moves):
    """A sub of so many moves, lines and arcs."""
    r = random.Random("long sub")
    body = ["G0 X0 Y0", "G0 Z2", "G1 Z-1 F300"]
    while len(body) < moves - 1:
        body.append(f"G1 X{r.uniform(0, 9):.3f} Y{r.uniform(0, 9):.3f}" if len(body) % 3 else "G3 I1.5 J0.5")
    return ["o100 sub", *body, "G0 Z5", "o100 endsub"]


def used_s():
    return sum(os.times()[:4])


def copies(folder):
    """(s of computing for the plan, s of computing for the whole program in rs274, lines)."""
    path = os.path.join(folder, "long.ngc")
    text = "\n".join([*long_sub(MOVES), HEAD, "G0 X0 Y0 Z5", f"G75 Q100 L{COPIES} I12 J3 K7", "M2", ""])
    with open(path, "w", encoding="ascii") as file:
        file.write(text)
    ini = canon.write_ini(folder)
    os.chdir(ROOT / "configs")
    job = PatternJob(Job(program=path, sub=100, ini=str(ini), position=(0.0, 0.0, 5.0)))
    order = Order(
        cycle="pattern",
        code="G75",
        unit="mm",
        unit_mm=1.0,
        start=(0.0, 0.0, 5.0),
        memory_mb=1024,
        job=job,
        fields=dict(
            shift=(0.0, 0.0, 0.0),
            start=(0.0, 0.0, 5.0),
            chord=0.002,
            most_moves=500_000,
            copies=COPIES,
            step=(12.0, 3.0),
            turn=7.0,
        ),
    )
    spent = []
    for _ in range(TRIES):
        plans.forget()
        before, began = used_s(), time.monotonic()
        outcome = plans.make(order)
        spent.append((used_s() - before, time.monotonic() - began))
    plan_s, wall_s = min(spent)
    before = used_s()
    canon.run_rs274(text)
    return (
        plan_s,
        wall_s,
        used_s() - before,
        sum(lines.count("\n") + 1 for chunk in outcome.chunks for _feed, lines, *_ in chunk),
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=7134)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    bad = False
    for part in options.only:
        for line in PARTS[part](options.seed, options.count):
            bad = bad or part == "error" and line["name"].endswith("otherwise") and line["value"] > 0
            print(
                json.dumps(line)
                if not options.table
                else f"{line['name']:60s} {line['value']:12.3g} {line['unit']:3s} {line['note']}",
                flush=True,
            )
    return 1 if bad else 0


def error_rows(seed, count):
    worst, cases, chords, wrong = errors(seed, count)
    return [
        row(
            f"G75: largest error in {cases} random cases",
            worst,
            "mm",
            f"{chords} more have arcs of G18 or G19 that become chords",
            1e-6,
        ),
        row("G75: cases that differ otherwise", len(wrong), "", "; ".join(wrong), 0),
    ]


def station_rows(seed, count):
    exact, share, number = stations(seed, 10 * count)
    return [
        row(f"stations: largest error of {number} from exact points", exact, "mm", "", 1e-9),
        row(
            f"stations: points 0.01 mm off, largest share of the bound, {number}",
            share,
            "",
            "90 places each, up to 300 mm per axis away",
            1.0,
        ),
    ]


def climb_rows(seed, count):
    kept, lost, profiles = climbs(seed, count)
    return [
        row(
            f"G75: climb share kept in {profiles} mirrored profiles, largest difference",
            kept,
            "",
            f"grid of {climb_oracle.CELL} mm",
            0.04,
        ),
        row("G75: not kept, largest difference to the other share", lost, "", ""),
    ]


def robot_rows(seed, count):
    bad, missed, good, alarms = robots(seed, 10 * count)
    return [
        row(
            f"robot: bad programs not found before motion, of {bad}",
            missed,
            "",
            "reach, joint limits, singularities",
            0,
        ),
        row(f"robot: good programs refused, of {good}", alarms, "", "", 0),
    ]


def copy_rows(_seed, _count):
    with tempfile.TemporaryDirectory() as folder:
        plan_s, wall_s, run_s, lines = copies(folder)
    return [
        row(
            f"G75: plan of {COPIES} copies of {MOVES} moves",
            plan_s,
            "s",
            f"least computing time of {TRIES}; {wall_s:.2f} s on the clock, {lines} lines",
            1.0,
        ),
        row(
            f"G75: the same program in rs274, {lines} lines",
            run_s,
            "s",
            "computing time, start of the interpreter included",
        ),
    ]


PARTS = {"error": error_rows, "stations": station_rows, "climb": climb_rows, "robot": robot_rows, "copies": copy_rows}


if __name__ == "__main__":
    raise SystemExit(main())
