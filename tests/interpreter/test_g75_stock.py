# SPDX-License-Identifier: GPL-2.0-or-later
"""G75 with a mirror leaves the mirrored part: the stock cut by the pattern against the stock cut by the sub, turned
over.

The paths differ where a cycle keeps climb milling (it is planned with the other hand), so heights are compared, within
a cell.
"""

import numpy as np
import pytest

from chipwise.clib.core import Cutter, Stock, Tool
from support import pattern_oracle
from support.pattern_oracle import moves_of, random_sub
from support.random_cases import random_count, random_seed

HEAD = "G21 G90 G64 G94 G17 G40\nT1 M6\nS5000 M3\nF600\n"
HALF, TOP, CELL, SAME_MM = 40.0, 4.5, 0.25, 2e-3  # traverses at Z4 cut, too
GRID = np.arange(-HALF + CELL / 2, HALF, CELL)  # its own mirror image


def heights(call, sub, start):
    """(ny, nx) of the stock after the moves of a call."""
    text = "\n".join(
        [*sub, HEAD, "G0 " + " ".join(f"{a}{v:.6f}" for a, v in zip("XYZ", start)), "(begin)", call, "(end)", "M2", ""]
    )
    stock = Stock((-HALF, -HALF, -8.0), (HALF, HALF, TOP), CELL)
    cutter = Cutter(stock, Tool(2.0), start)
    for move in moves_of(text)[0]:
        for point in move.points:
            cutter.to(point)
    return np.array([[stock.above(x, y, -8.0) for x in GRID] for y in GRID]), stock.volume()


def within_a_cell(first, second):
    """Share of the places where `first` is between the lowest and the highest of `second` within a cell."""
    padded = np.pad(second, 1, mode="edge")
    near = [
        padded[1 + i : padded.shape[0] - 1 + i, 1 + j : padded.shape[1] - 1 + j] for i in (-1, 0, 1) for j in (-1, 0, 1)
    ]
    return float(((first >= np.min(near, axis=0) - SAME_MM) & (first <= np.max(near, axis=0) + SAME_MM)).mean())


@pytest.fixture(autouse=True)
def fine_arcs(monkeypatch):
    """Arcs in 128 chords: those of a circle and of its mirror image do not begin at the same place."""
    monkeypatch.setattr(pattern_oracle, "SHARES", np.linspace(0.0, 1.0, 129)[1:])


@pytest.mark.parametrize("keep", ["", "#<_chipwise_keep_climb> = 1\n"], ids=["", "keep climb"])
@pytest.mark.parametrize("case", range(random_count(6)))
def test_the_mirrored_part(case, keep):
    seed, mirror = random_seed() + case, (1, 2, 3)[case % 3]
    sub = random_sub(seed)
    flip = {1: (1,), 2: (0,), 3: (0, 1)}[mirror]
    plain, volume = heights("o100 call", sub, (3.0, -4.0, 7.0))
    start = (-3.0 if mirror & 1 else 3.0, 4.0 if mirror & 2 else -4.0, 7.0)
    found, mirrored_volume = heights(f"{keep}G75 Q100 H{mirror}", sub, start)
    assert plain.min() < TOP + 7.9, "nothing is cut"
    assert within_a_cell(found, np.flip(plain, flip)) == 1.0, f"CHIPWISE_SEED={seed} H{mirror} {keep}"
    assert mirrored_volume == pytest.approx(volume, rel=1e-3)


def test_the_comparison_sees_what_is_not_mirrored():
    sub = ["o100 sub", "G0 X10 Y5", "G1 Z-2", "G1 X20 Y9", "G0 Z7", "o100 endsub"]
    plain, _ = heights("o100 call", sub, (3.0, -4.0, 7.0))
    for words in ("H2", "H1 X0.6", "H1 Z-0.01", "H1 R1"):
        found, _ = heights(f"G75 Q100 {words}", sub, (-3.0, -4.0, 7.0))
        assert within_a_cell(found, np.flip(plain, 1)) < 1.0, words
