# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 P4 on random pockets and on letters, by the independent judge (tests/support/engagement_verdict.py); a line of
JSON for each.

    /usr/bin/python3 bench/bench_engagement_random.py random --first 60000 --count 50 > FILE
    /usr/bin/python3 bench/bench_engagement_random.py glyphs --first 60000 --count 50 > FILE
    /usr/bin/python3 bench/bench_engagement_random.py table FILE ..

Random pockets: tests/support/pocket_random.py, D of 0.2 to 1 tool radii.  Letters: any character of any font of this
computer, tool of 1 to 6 mm, 20 to 45 tool radii to the em, D of 0.4 to 1 tool radii.
"""

import argparse
import dataclasses
import json
import math
import time

import numpy as np

from roots import ROOT  # noqa: F401  the path to chipwise
from chipwise.cycles.pocket import PocketRequest
from support.engagement_verdict import verdict
from support.glyph_shapes import Font, fonts
from support.pocket_judge import random_request


def random_pocket(seed):
    """(name, request) of a random pocket."""
    asked = random_request(seed, 4)
    return f"random {seed}", dataclasses.replace(
        asked, step=float(np.random.default_rng([seed, 451]).uniform(0.2, 1.0)) * asked.tool_radius
    )


def glyph(seed):
    """(name, request) of a letter."""
    rng, known = np.random.default_rng([seed, 452]), sorted(fonts().items())
    while True:
        name, path = known[int(rng.integers(len(known)))]
        font = Font(path)
        characters = font.characters()
        code = int(characters[int(rng.integers(len(characters)))])
        radius = float(rng.uniform(0.5, 3.0))
        size = radius * math.exp(rng.uniform(math.log(20.0), math.log(45.0)))
        loops = font.loops(code, size)
        if loops:
            return f"{name} U+{code:04X} size {size:.3f} r {radius:.4f}", PocketRequest(
                loops=loops,
                bottom=-2.0,
                clearance=1.0,
                tool_radius=radius,
                step=float(rng.uniform(0.4, 1.0)) * radius,
                feed=1500.0,
                plunge_feed=300.0,
                start=(0.0, 0.0, 10.0),
                strategy=4,
                climb=bool(rng.random() < 0.7),
            )


def judged(kind, seed):
    """The row of one case."""
    name, asked = (glyph if kind == "glyphs" else random_pocket)(seed)
    begun = time.process_time()
    try:
        found = dataclasses.asdict(verdict(asked, seed))
    except Exception as error:  # any alarm is a finding
        found = {"said": "", "faults": [f"alarm: {error!r}"]}
    return {
        "kind": kind,
        "seed": seed,
        "name": name,
        "share": round(asked.step / asked.tool_radius, 3),
        "seconds": round(time.process_time() - begun, 1),
        **found,
    }


def table(paths):
    """What the files say, and each fault."""
    rows = {(row["kind"], row["seed"]): row for path in paths for row in map(json.loads, open(path, encoding="utf-8"))}
    for kind in sorted({kind for kind, _ in rows}):
        these = [row for row in rows.values() if row["kind"] == kind]
        ran = [row for row in these if not row["said"] and "p99" in row]
        print(
            f"{kind}: {len(these)} cases, {len(ran)} planned, {sum(bool(row['faults']) for row in these)} with a "
            f"fault; p99 above nominal: median "
            f"{np.median([row['p99'] for row in ran]):.1f}, largest {max(row['p99'] for row in ran):.1f} degrees, "
            f"without corners and necks largest {max(row['rest'] for row in ran):.1f}; mm above nominal + 10: corners "
            f"{sum(row['corner'] for row in ran):.0f}, necks {sum(row['neck'] for row in ran):.0f} in "
            f"{sum(row['neck'] > 0 for row in ran)} cases, elsewhere "
            f"{sum(row['other'] for row in ran):.1f}; full slot where a trochoid fits "
            f"{sum(row['full'] for row in ran):.1f} mm"
        )
        for row in these:
            for fault in row["faults"]:
                print(f"  {row['name']} (seed {row['seed']}, D {row['share']} r): {fault}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("random", "glyphs", "table"))
    parser.add_argument("files", nargs="*")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=50)
    args = parser.parse_args()
    if args.what == "table":
        table(args.files)
        return
    for seed in range(args.first, args.first + args.count):
        print(json.dumps(judged(args.what, seed)), flush=True)


if __name__ == "__main__":
    main()
