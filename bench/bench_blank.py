# SPDX-License-Identifier: GPL-2.0-or-later
"""Random castings that are probed on a grid: how far the stock of `chipwise blank` is above the casting, by the spacing
of the points.

Called by hand: `/usr/bin/python3 bench/bench_blank.py --castings 200`.  The castings are those of
tests/support/castings.py: 60 to 160 mm wide, 20 to 70 mm high, waves of up to 1 mm and 40 to 160 mm length, humps and
hollows of up to 2 mm and 12 to 30 mm radius, a probe that is off by 0.005 to 0.05 mm.  mm.
"""

import argparse

import numpy as np

import roots  # noqa: F401  puts tests/ and remap/ on the path
from chipwise.blank import points, stock
from support.castings import CELL, MOST_ABOVE, Casting

SPACINGS = 3.0, 4.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0
SEED = 44


def one(seed, spacing):
    """(share of the volume above the casting, the share that the command states, mm by which it is nowhere below the
    casting minus the error)."""
    casting = Casting(seed, spacing)
    typed = stock.Typed((0.0, 0.0, 0.0), (casting.wide, casting.deep, casting.high))
    found = stock.made(casting.points, typed, points.Place(), CELL, casting.error)
    tops = found.cells["top"][1:-1, 1:-1].astype(float)
    x, y = np.meshgrid((np.arange(found.head.nx) + 0.5) * CELL, (np.arange(found.head.ny) + 0.5) * CELL)
    casting.places = np.column_stack((x.ravel(), y.ravel()))
    covered = [
        np.clip((casting.wide, casting.deep)[k] / CELL - np.arange((found.head.nx, found.head.ny)[k]), 0.0, 1.0)
        for k in (0, 1)
    ]
    volume = float((tops * covered[1][:, None] * covered[0]).sum()) * CELL**2
    return (
        volume / casting.volume() - 1.0,
        found.above_share,
        float((tops.ravel() - casting.highest() + casting.error).min()),
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--castings", type=int, default=200)
    parser.add_argument("--spacing", type=float, nargs="*", default=SPACINGS)
    options = parser.parse_args()
    print(
        f"{'spacing mm':>10s} {'above: mean':>12s} {'most':>8s} {'stated':>8s} {'within 3 %':>11s} "
        f"{'least over truth - error, mm':>29s}"
    )
    for spacing in options.spacing:
        above, stated, least = np.array([one(SEED * 100_019 + k, spacing) for k in range(options.castings)]).T
        print(
            f"{spacing:10.1f} {above.mean():12.2%} {above.max():8.2%} {stated.max():8.2%} "
            f"{(above <= MOST_ABOVE).mean():11.1%} {least.min():29.4f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
