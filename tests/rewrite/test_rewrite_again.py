# SPDX-License-Identifier: GPL-2.0-or-later
"""rewrite/cut_cache.py: trials whose parts are not cut again, against trials that are cut from the beginning; to the
last bit."""

import dataclasses

import numpy as np
import pytest

from chipwise.clib.height_map import HeightMap, Shape
from chipwise.rewrite import cut_cache, sections
from support.random_cases import random_count, random_seed

LOW, HIGH, CELL = (0.0, 0.0, -20.0), (40.0, 30.0, 0.0), 0.25
SHAPES = (Shape(6.0), Shape(6.0, 3.0), Shape(5.0, 1.0), Shape(4.0, 0.0, 90.0))
TRIALS = 6


def random_path(rng, longest):
    """(n, 3): a path that crosses itself, with plunges and moves of a few micrometres."""
    steps = rng.uniform(-1, 1, (500, 3)) * [1.0, 1.0, 0.2] * longest * rng.choice([1.0, 1.0, 0.01], (500, 1))
    steps[rng.random(500) < 0.03, :2] = 0.0
    path = np.cumsum(steps, axis=0) + [20.0, 15.0, -6.0]
    size = np.array(HIGH) - LOW + [6.0, 6.0, 0.0]
    return np.abs((path - LOW) % (2 * size) - size) + LOW - [3.0, 3.0, 0.0]  # mirrored at its limits


def new_map(rng):
    stock = HeightMap(LOW, HIGH, CELL)
    if rng.random() < 0.7:
        stock.add_needles(rng.uniform(LOW[:2], HIGH[:2], (200, 2)))
    return stock


def same_map(stock):
    other = HeightMap(LOW, HIGH, CELL)
    if len(stock.needles):
        other.add_needles(stock.needles)
    return other


@pytest.mark.parametrize("shape", SHAPES, ids=["flat", "ball", "bull", "vee"])
def test_trials_meet_what_they_meet_when_all_is_cut(shape):
    for case in range(random_count(6)):
        rng = np.random.default_rng([random_seed(), case, SHAPES.index(shape)])
        stock = new_map(rng)
        other, path, label = same_map(stock), random_path(rng, rng.choice([0.3, 1.5])), np.arange(499) // 40
        recut, window = cut_cache.Recut(stock, shape), sections.Window(stock, path, 30.0)
        for trial in range(TRIALS):
            reference = sections.Window(other, path, 30.0)
            depth = recut.depths(path[0], path[1:], label)
            wanted = other.cut(shape, path[0], path[1:])["depth"]
            assert (depth == wanted).all(), (random_seed(), case, trial)
            assert (stock.height == other.height).all() and (stock.needle_height == other.needle_height).all(), (
                random_seed(),
                case,
                trial,
            )
            window.restore()
            reference.restore()
            at = rng.integers(0, 480)
            path[at : at + rng.integers(1, 20), 2] += (
                rng.choice([-1.0, 1.0]) * rng.uniform(0, 2) * (trial != 2)
            )  # one trial is as before
        assert recut.again > len(np.unique(label))


@pytest.mark.parametrize("shape", SHAPES, ids=["flat", "ball", "bull", "vee"])
def test_a_long_path_is_cut_in_parts_as_in_one(shape, monkeypatch):
    monkeypatch.setattr(sections, "PART", 37)
    shape = dataclasses.replace(shape, holder_diameter=16.0, stick_out=7.0)
    for case in range(random_count(6)):
        rng = np.random.default_rng([random_seed(), case, 1])
        stock = new_map(rng)
        other, path = same_map(stock), random_path(rng, rng.choice([0.3, 1.5, 4.0]))
        owners, met = zip(
            *((owner.copy(), met.copy()) for owner, met in sections.cut_along(stock, shape, path[0], path[1:], 1.0))
        )
        points, owner = sections.pieces(path, 1.0)
        wanted, met = other.cut(shape, points[0], points[1:]), np.concatenate(met)
        assert len(owners) > 5 and (np.concatenate(owners) == owner).all(), (random_seed(), case)
        assert all((met[name] == wanted[name]).all() for name in ("depth", "at", "holder")), (random_seed(), case)
        assert (stock.height == other.height).all() and (stock.needle_height == other.needle_height).all(), (
            random_seed(),
            case,
        )


def test_other_stock_is_cut_again():
    rng = np.random.default_rng(random_seed())
    stock, shape, path = HeightMap(LOW, HIGH, CELL), SHAPES[0], random_path(rng, 0.5)
    recut, window = cut_cache.Recut(stock, shape), sections.Window(stock, path, 30.0)
    for depth in (0.0, 0.0, 3.0):
        stock.cut(Shape(12.0), (-10, 15, -depth), np.array([[60.0, 15, -depth]]))
        met = recut.depths(path[0], path[1:], np.arange(499) // 40)
        window.restore()
    stock.cut(Shape(12.0), (-10, 15, -3.0), np.array([[60.0, 15, -3.0]]))
    assert (met == stock.cut(shape, path[0], path[1:])["depth"]).all()


def test_parts_do_not_begin_with_a_short_move():
    """Its cut needs what the sweep knows of the moves before."""
    places = np.cumsum(np.tile([0.2, 0.0, 0.0], (12, 1)), axis=0)
    assert cut_cache.parts((0, 0, 0), places, np.arange(12) // 4) == [0, 4, 8, 12]
    places[4:, 0] -= 0.17
    places[8:, 0] -= 0.2  # along the axis
    assert cut_cache.parts((0, 0, 0), places, np.arange(12) // 4) == [0, 5, 8, 12]
    assert cut_cache.parts((0, 0, 0), places / 10, np.arange(12) // 4) == [0, 8, 12]


def test_what_is_kept_is_limited(monkeypatch):
    rng = np.random.default_rng(random_seed())
    stock, path = HeightMap(LOW, HIGH, CELL), random_path(rng, 1.0)
    monkeypatch.setattr(cut_cache, "MOST_BYTES", 10_000)
    recut, window = cut_cache.Recut(stock, SHAPES[1]), sections.Window(stock, path, 30.0)
    found = []
    for _ in range(3):
        found.append(recut.depths(path[0], path[1:], np.arange(499) // 40))
        window.restore()
    assert (found[0] == found[2]).all() and 0 < recut.again < 13
    assert sum(kept.size for kept in recut._kept.values()) <= 10_000
