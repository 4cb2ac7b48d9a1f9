# SPDX-License-Identifier: GPL-2.0-or-later
"""How P0 to P3 of G79 come onto finished walls and leave them: nine shapes, random pockets, letters; by
tests/support/wall_judge.py.

    /usr/bin/python3 bench/bench_walls.py [--first 31000] [--count 40] [--letters]

Each pocket is judged by tests/support/pocket_oracle.py, too: gouge, residue, rapids, walls, entries.  Tangent: within 1
degree.
"""

import argparse
from dataclasses import replace

from roots import ROOT
from bench_engagement import request
from bench_engagement_random import glyph
from support import hole_oracle, wall_judge
from support.engagement_shapes import SHAPES
from support.pocket_judge import case_of, random_request, verdict
from chipwise.geometry.pocket.strategies import NAMES

TANGENT = 1.0


def cases(args, strategy):
    """(name, request, seed)"""
    for name, loops in SHAPES.items():
        yield name, request(loops, strategy), 0
    for seed in range(args.first, args.first + args.count):
        yield (
            f"seed {seed}",
            replace(glyph(seed)[1], strategy=strategy) if args.letters else random_request(seed, strategy),
            seed,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=31000)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--letters", action="store_true", help="letters of any font in place of random pockets")
    args = parser.parse_args()
    for strategy in sorted(NAMES):
        count = faulty = onto = off = 0
        for name, asked, seed in cases(args, strategy):
            faults, plan = verdict(asked, seed, 2500)
            if faults:
                faulty += 1
                print(f"P{strategy} {name}: {faults}", flush=True)
            if plan is None:
                continue
            moves = hole_oracle.walk(plan.moves, asked.start)
            for finish in wall_judge.finishes(case_of(asked), moves, asked.bottom + asked.floor_allowance):
                count += 1
                onto += finish.on is not None and finish.on < TANGENT
                off += finish.off is not None and finish.off < TANGENT
        print(
            f"{ROOT.name} P{strategy}: {count} finished walls, onto {onto} tangent, off {off} tangent; pockets with a "
            f"fault: {faulty}",
            flush=True,
        )


if __name__ == "__main__":
    main()
