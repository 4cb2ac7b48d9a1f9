# SPDX-License-Identifier: GPL-2.0-or-later
"""A tool whose feed the core commands by its side force, against an exact stock and its edges one by one
(support/tooth_oracle.py): the largest force of each revolution, of no mean."""

import math

import numpy as np
import pytest

from chipwise.clib import core
from support.feed_cases import FORCE
from support.tooth_oracle import Z, Drive, Limits, Plane, beside

PEAK, REACHED = 1.02, 0.97  # of the limit: held from above, and used where nothing else limits
ROUGH_PEAK = 1.05  # steps and crossing slots
BEGUN = 100  # periods in which a tool that begins within the stock speeds up before its weights are known


def driven(plane, segments, diameter=10.0, cell=0.25, force=80.0, flutes=3, **more):
    """(share of the limit, rows of Drive.seen) of each period."""
    seen = Drive(plane, diameter, Z, Limits(force=force, flutes=flutes), cell, **more).go(segments)[BEGUN:]
    return seen[:, 6] / force, seen


@pytest.mark.parametrize(
    "diameter, cell, share, flutes",
    [
        (10.0, 0.25, 0.05, 3),
        (10.0, 0.25, 0.5, 3),
        (10.0, 0.25, 0.75, 4),
        (10.0, 0.25, 1.2, 4),
        (6.0, 0.25, 0.25, 2),
        (3.0, 0.125, 0.5, 2),
    ],
)
def test_side_cut(diameter, cell, share, flutes):
    """Held and used; the limit in force is said, and what the pins say is what is there."""
    load, seen = driven(
        *beside(diameter, share, 0.3),
        diameter,
        cell,
        (20.0 if share < 0.1 else 40.0 + 100.0 * share) * diameter / 10.0,
        flutes,
    )
    steady = slice(len(seen) // 3, 2 * len(seen) // 3)
    assert load.max() < PEAK and load[steady].min() > REACHED, (load.max(), load[steady].min())
    assert set(seen[steady, 3]) == {FORCE}
    assert np.median(seen[steady, 8] / seen[steady, 6]) == pytest.approx(1.0, abs=0.03) and np.median(
        seen[steady, 9] / seen[steady, 7]
    ) == pytest.approx(1.0, abs=0.03)


def test_the_oracle_sees_a_feed_without_a_limit():
    load, _seen = driven(*beside(10.0, 0.5, 0.3), limited=False)
    assert load.max() > 1.5


@pytest.mark.parametrize("side", [0.0, 63.0])
def test_entry(side):
    """Into the stock at the ceiling: the force is there at first contact. side: mm, of the path; the stock ends at
    60."""
    load, _seen = driven(Plane(), [core.line((-72.0, side, Z), (-48.0, side, Z))], force=50.0)
    assert load.max() < PEAK, load.max()


@pytest.mark.parametrize("turn", [1.5, -1.5])
def test_arc(turn):
    """A line into an arc and out of it, in full stock."""
    sign, angle = math.copysign(1.0, turn), abs(turn) - 0.5 * math.pi
    end = np.array([15.0 * math.cos(angle), sign * (15.0 + 15.0 * math.sin(angle))])
    load, _seen = driven(
        Plane(),
        [
            core.line((-18.0, 0.0, Z), (0.0, 0.0, Z)),
            core.arc((0.0, sign * 15.0), (0.0, 0.0, Z), turn),
            core.line((*end, Z), (*(end + 18.0 * np.array([math.cos(turn), math.sin(turn)])), Z)),
        ],
    )
    assert load.max() < PEAK, load.max()


@pytest.mark.parametrize("seed", range(6, 12))
def test_steps_and_crossing_slots(seed):
    """Slots of other depths and widths cross the pass: islands, shelves, walls."""
    rng = np.random.default_rng(seed)
    plane, segments = beside(10.0, rng.uniform(0.1, 1.2), 0.0, 40.0)
    for _ in range(3):
        angle, middle = rng.uniform(0.4, 2.7), rng.uniform(-12.0, 12.0)
        along = 70.0 * np.array([math.cos(angle), math.sin(angle)])
        plane.cut([(middle, 0.0) - along, (middle, 0.0) + along], rng.uniform(1.0, 4.0), rng.choice([-1.0, -2.0, -4.0]))
    load, _seen = driven(plane, segments)
    assert load.max() < ROUGH_PEAK, load.max()
