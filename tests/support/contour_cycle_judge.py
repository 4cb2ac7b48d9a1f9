# SPDX-License-Identifier: GPL-2.0-or-later
"""Requests of G77 and G78, random ones too, and the verdict on one: shared by test_contour.py and test_g77_g78*.py."""

import math

import numpy as np
import pytest

from chipwise.cycles.contour import ContourRequest, radial_distances
from chipwise.geometry.base.contour import ArcElement, LineElement, make_contour
from support import contour_cycle_oracle as oracle
from support.contour_oracle import from_elements
from support.contour_random import contour_case

NEAR = 1e-3  # mm: the target for a gouge


def polygon(*points, closed=True):
    """LineElements through points."""
    ends = points[1:] + points[:1] if closed else points[1:]
    return tuple(LineElement(a, b, k + 1) for k, (a, b) in enumerate(zip(points, ends)))


def rounded_square(size, fillet):
    """Counter-clockwise from the middle of the lower side."""
    s, f = size, fillet
    rows = [
        ((s / 2, 0), (s - f, 0), None),
        ((s - f, 0), (s, f), (s - f, f)),
        ((s, f), (s, s - f), None),
        ((s, s - f), (s - f, s), (s - f, s - f)),
        ((s - f, s), (f, s), None),
        ((f, s), (0, s - f), (f, s - f)),
        ((0, s - f), (0, f), None),
        ((0, f), (f, 0), (f, f)),
        ((f, 0), (s / 2, 0), None),
    ]
    return tuple(
        LineElement(a, b, k) if c is None else ArcElement(a, b, c, True, k) for k, (a, b, c) in enumerate(rows, 1)
    )


def request(shape=rounded_square(40.0, 5.0), **changes):
    """A request with sensible numbers."""
    words = dict(
        shape=tuple(shape),
        side=41,
        tool_radius=3.0,
        bottom=-6.0,
        clearance=2.0,
        feed=600.0,
        plunge_feed=200.0,
        start=(0.0, 0.0, 20.0),
    )
    return ContourRequest(**{**words, **changes})


def side_of(r):
    return -1 if r.side == 41 else 1


def judge(r, elements):
    """All promises of the cycle; returns what was not promised but is worth counting."""
    contour = make_contour(list(r.shape))
    finish = from_elements(contour.elements)
    reach = r.tool_radius + r.allowance
    assert oracle.deepest(elements, finish, reach, r.clearance) <= NEAR
    assert oracle.rapid_faults(elements, r.clearance) == []
    count = 1 if r.depth_step is None else math.ceil((r.clearance - r.bottom) / r.depth_step - 1e-6)
    levels = [r.clearance - (r.clearance - r.bottom) * k / count for k in range(1, count + 1)]
    lost = oracle.missed(elements, finish, contour.closed, side_of(r), radial_distances(r), levels)
    assert [m for m in lost if m[2] > 2e-3] == []
    assert min(e.b[2] for e in elements) == pytest.approx(r.bottom, abs=1e-9)
    assert elements[-1].b[2] == pytest.approx(r.clearance, abs=1e-9)
    slants = oracle.slants(elements, finish)
    if r.approach is None:
        assert slants == []
    for dz, angle, off, _down in slants:
        assert dz == pytest.approx(r.approach, abs=1e-6)
        assert angle == pytest.approx(math.degrees(r.angle), abs=1e-4)
        assert off < 1e-3
    return slants, oracle.plunges(elements, finish, r.clearance)


def random_request(seed):
    """A random contour with random words; whether it may be refused is left to the cycle."""
    rng = np.random.default_rng([seed, 78])
    parts, radius = contour_case(seed, "filleted" if rng.random() < 0.5 else "bulged")
    if rng.random() < 0.3:
        k = int(rng.integers(len(parts)))
        parts = (parts[k:] + parts[:k])[: -max(1, len(parts) // 3)]
    passes = int(rng.choice([1, 1, 2, 3]))
    return request(
        parts,
        side=int(rng.choice([41, 42])),
        tool_radius=float(radius),
        finish=bool(rng.random() < 0.5),
        allowance=float(rng.choice([0.0, 0.0, 0.3])),
        passes=passes,
        step=float(radius * rng.uniform(0.3, 1.5)) if passes > 1 else None,
        depth_step=float(rng.choice([3.0, 9.0])),
        approach=None if rng.random() < 0.5 else float(rng.uniform(0.5, 10.0)),
        angle=math.radians(float(rng.uniform(15, 85))),
        start=(float(rng.uniform(-30, 30)), 0.0, float(rng.choice([0.0, 2.0, 20.0]))),
    )
