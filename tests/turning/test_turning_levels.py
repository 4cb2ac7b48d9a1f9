# SPDX-License-Identifier: GPL-2.0-or-later
"""Heights of the levels of roughing: never more than the depth of cut apart, down to the floor, and not longer than a
grid from the top."""

import math
import random

import pytest

from chipwise.turning.profile_function import at, flat, segment
from chipwise.turning.levels import levels
from support.random_cases import random_count, random_seed

SAMPLES = 4000


def passes(heights, high, surface, floor, z0, z1):
    """mm of passes, counted place by place: a level passes where stock is left above it and the floor is below the
    level before."""
    total, before = 0.0, high
    places = [z0 + (z1 - z0) * (k + 0.5) / SAMPLES for k in range(SAMPLES)]
    stock = [(at(surface, z), at(floor, z)) for z in places]
    for c in heights:
        total += sum(min(up, before) > max(low, c) + 1e-6 for up, low in stock) * (z1 - z0) / SAMPLES
        before = c
    return total


def from_the_top(high, low, depth):
    """Levels D apart, or equal where the last would be thinner than a fifth."""
    count = max(math.ceil((high - low) / depth - 1e-9), 1)
    step = depth if high - low - (count - 1) * depth >= 0.2 * depth else (high - low) / count
    return [max(high - k * step, low) for k in range(1, count + 1)]


def stairs(rng, low, high):
    """A random graph of flats over Z0 to Z20."""
    cuts = sorted(rng.uniform(0, 20) for _ in range(rng.randint(1, 5)))
    return [flat(a, b, rng.uniform(low, high)) for a, b in zip([0.0, *cuts], [*cuts, 20.0])]


@pytest.mark.parametrize("k", range(random_count(30)))
def test_levels_are_no_deeper_than_allowed_and_no_longer_than_a_plain_grid(k):
    rng = random.Random(f"levels {random_seed()} {k}")
    surface, floor, depth = stairs(rng, 10.0, 14.0), stairs(rng, 5.0, 9.9), rng.uniform(0.3, 2.5)
    high, heights = levels(floor, surface, (0.0, 20.0), depth)
    assert high == max(p.xr for p in surface) and heights[-1] == min(p.xr for p in floor)
    assert all(0.0 < a - b <= depth + 1e-9 for a, b in zip([high, *heights], heights)), heights
    plain = from_the_top(high, heights[-1], depth)
    found, limit = (passes(h, high, surface, floor, 0.0, 20.0) for h in (heights, plain))
    assert found <= 1.03 * limit + 20.0 / SAMPLES * len(heights) * 12, (found, limit)


def test_a_step_of_the_blank_is_a_level():
    """0.8 mm on the cone that a drill has left: a plain grid would take 0.2 mm from all of the bore first."""
    surface, floor = [flat(0.0, 1.0, 13.8), flat(1.0, 20.0, 13.0)], [flat(0.0, 20.0, 11.2)]
    assert levels(floor, surface, (0.0, 20.0), 1.0)[1] == pytest.approx([13.0, 12.0, 11.2], abs=1e-5)


def test_a_thin_last_level_is_cut_only_where_it_saves():
    """1.1 mm in two equal levels; but if only a tenth of it is so deep, the first level is 1 mm."""
    whole = levels([flat(0.0, 20.0, 10.0)], [flat(0.0, 20.0, 11.1)], (0.0, 20.0), 1.0)[1]
    assert whole == pytest.approx([10.55, 10.0])
    tenth = levels([flat(0.0, 2.0, 10.0), flat(2.0, 20.0, 10.2)], [flat(0.0, 20.0, 11.1)], (0.0, 20.0), 1.0)[1]
    assert tenth == pytest.approx([10.1, 10.0])


def test_a_slope_has_levels_down_to_its_end():
    high, heights = levels([segment(0.0, 5.0, 20.0, 9.0)], [flat(0.0, 20.0, 10.0)], (0.0, 20.0), 1.5)
    assert high == 10.0 and heights == pytest.approx([8.5, 7.0, 5.5, 5.0], abs=1e-6)
