# SPDX-License-Identifier: GPL-2.0-or-later
"""The kernel against two other offset libraries; skipped with the reason where they cannot
be installed (see second_oracles.py)."""

import pytest

from support import second_oracles
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.offset.kernel import LEFT, RIGHT, offset_contour
from support.contour_judge import count_from_environment, seed_from_environment
from support.contour_oracle import from_elements
from support.contour_random import contour_case

SEED, COUNT = seed_from_environment(), count_from_environment(150)


@pytest.fixture(scope="module")
def cavalier():
    module, reason = second_oracles.load("cavaliercontours")
    return module or pytest.skip(reason)


@pytest.fixture(scope="module")
def clipper():
    module, reason = second_oracles.load("pyclipper")
    return module or pytest.skip(reason)


def cases():
    for kind in ("filleted", "bulged"):
        for seed in range(SEED, SEED + COUNT):
            parts, radius = contour_case(seed, kind)
            contour = make_contour(parts)
            for side in (LEFT, RIGHT):
                result = offset_contour(contour, side, radius)
                yield (
                    f"{kind} CHIPWISE_SEED={seed} side {side}",
                    from_elements(contour.elements),
                    side,
                    radius,
                    result,
                )


def test_area_and_size_against_cavalier_contours(cavalier):
    """Same area of the centre region, and at most 1.1 times its elements.

    The other library is not always right itself: it may lose a path; it may never have one
    more, and the areas must agree wherever the number of paths does.
    """
    ours, theirs, differ = 0, 0, []
    for name, shape, side, radius, result in cases():
        other = second_oracles.cavalier_paths(cavalier, shape, side, radius)
        area = sum(elements.area(p.elements) for p in result.paths)
        if len(other) != len(result.paths):
            differ.append((name, len(result.paths), len(other)))
            continue
        assert area == pytest.approx(sum(a for _, a in other), abs=1e-3), name
        ours += sum(len(p.elements) for p in result.paths)
        theirs += sum(n for n, _ in other)
    assert len(differ) <= 0.02 * 4 * COUNT + 1, differ
    assert ours <= 1.1 * theirs


def test_area_against_clipper(clipper):
    """Same area within what its chords may stray, on every case."""
    for name, shape, side, radius, result in cases():
        area = sum(elements.area(p.elements) for p in result.paths)
        other = second_oracles.clipper_area(clipper, shape, side, radius)
        slack = 1e-2 + 2e-3 * (second_oracles.perimeter(shape) + 7.0 * radius)
        assert area == pytest.approx(other, abs=slack), name
