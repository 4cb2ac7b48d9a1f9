# SPDX-License-Identifier: GPL-2.0-or-later
"""Strokes that cross and lie beside each other, level and sloped: section area against the judge's
(tests/support/judge.c).

Who calls it: tests/core/test_strokes.py.  The judge works the stock out of the strokes before and knows no cells, bands
or map.  Lengths mm, areas mm2.
"""

from __future__ import annotations

import math

import numpy as np

from chipwise.clib import core

from support import judge

LOW, HIGH = (-20.03, -20.02, -8.0), (20.02, 20.11, 0.0)
ABOVE = 20.0  # mm, where the tool goes to the next stroke
STEP = 0.05  # mm between two readings
WINDOW = 6  # readings that are taken together: 10 ms at 30 mm/s
LEAST = 0.15  # of the ordinary load: what is less does not count


def strokes(rng, depth, sloped, count=10):
    """[(start, end)] of tips: `count` anywhere, half as many beside them, 0.3..1 of the depth at their ends."""
    found = []
    for _ in range(count):
        angle, half = rng.uniform(0.0, 2.0 * math.pi), 0.5 * rng.uniform(5.0, 11.0)
        path, middle = (
            half * np.array([math.cos(angle), math.sin(angle), 0.0]),
            np.append(rng.uniform(-3.0, 3.0, 2), 0.0),
        )
        ends = -rng.uniform(0.3, 1.0, 2) * depth
        found.append((middle - path + [0.0, 0.0, ends[0]], middle + path + [0.0, 0.0, ends[int(sloped)]]))
    for start, end in found[: count // 2]:
        path = (end - start) / np.linalg.norm(end - start)
        aside = rng.uniform(0.2, 1.0) * rng.choice([-1.0, 1.0]) * np.array([-path[1], path[0], 0.0])
        deeper = np.array([0.0, 0.0, min(0.0, rng.uniform(-0.3, 0.3) * depth)])
        found.append((start + aside + deeper, end + aside + deeper))
    return found


def truths(tool, some):
    """[(places along the stroke, areas there)] of each stroke, by the judge."""
    chords, own = [np.array([0.0, 0.0, ABOVE + 1.0, 0.0, 0.0, ABOVE])], []
    for start, end in some:
        for point in ((*chords[-1][3:5], ABOVE), (*start[:2], ABOVE), start):
            chords.append(np.hstack([chords[-1][3:], point]))
        own.append(len(chords))
        chords.append(np.hstack([start, end]))
    chords = np.array(chords)
    found = judge.areas(
        judge.Blank.corners(LOW, HIGH), [judge.Tool(*tool)], chords, np.zeros(len(chords), np.int32), 0.04
    )
    ends = np.cumsum(np.linalg.norm(chords[:, 3:] - chords[:, :3], axis=1))
    for n in own:
        inside = (found[:, 0] > ends[n - 1] + 1e-6) & (found[:, 0] <= ends[n])
        yield found[inside, 0] - ends[n - 1], found[inside, 1]


def measured(tool, seed, depth=1.5, sloped=True, cell=0.25):
    """(mean error, standard deviation of the windows' errors), both over the truth."""
    some = strokes(np.random.default_rng(seed), depth, sloped)
    stock, cutting = core.Stock(LOW, HIGH, cell), core.Tool(*tool)
    read, true = [], []
    for (start, end), (places, areas) in zip(some, truths(tool, some)):
        length = float(np.linalg.norm(end - start))
        heading = (end - start) / length
        hole = cutting.reach(-min(start[2], end[2]))
        at = np.arange(2.0 * hole + 0.3, length, STEP)  # clear of where it went down
        if len(at) > WINDOW:
            seen = [stock.section(cutting, start + heading * s, heading, core.UNCUT)[0] for s in at]
            for found, values in ((read, seen), (true, np.interp(at, places, areas))):
                found.append(np.convolve(values, np.ones(WINDOW) / WINDOW, "valid"))
        cutter = core.Cutter(stock, cutting, (*start[:2], ABOVE))
        cutter.to(start)
        cutter.to(end)
    read, true = np.concatenate(read), np.concatenate(true)
    counts = true > LEAST * np.quantile(true, 0.95)
    return float(read.sum() / true.sum() - 1.0), float((read[counts] / true[counts] - 1.0).std())
