# SPDX-License-Identifier: GPL-2.0-or-later
"""Outlines of very many lines, about 150 mm across, as drawings have them.  Called by
tests/geometry/test_pocket_size.py, bench/bench_pocket_size.py."""

import numpy as np

from chipwise.geometry.base.contour import LineElement


def outline(kind, count):
    """A loop of `count` lines.

    curve: three lobes with waves, 146 mm across, as a CAD program writes out a curve: every element is on every ring
    lobes: two lobes, 208 mm across, with a waist
    coast: the curve with noise, as on a map: elements drown between their neighbours
    """
    angle = 2 * np.pi * np.arange(count) / count
    radius = (
        65.0 * (1 + 0.6 * np.cos(2 * angle)) * (1 + 0.02 * np.sin(5 * angle))
        if kind == "lobes"
        else 65.0 * (1 + 0.12 * np.sin(3 * angle) + 0.023 * np.cos(20 * angle))
    )
    if kind == "coast":
        radius += np.random.default_rng(1).uniform(-0.1, 0.1, count) * min(1.0, 500 / count)
    p = np.stack((radius * np.cos(angle), radius * np.sin(angle)), axis=1)
    return tuple(
        LineElement(tuple(a), tuple(b), k)
        for k, (a, b) in enumerate(zip(p.tolist(), np.roll(p, -1, axis=0).tolist()), 1)
    )
