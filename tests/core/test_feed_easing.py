# SPDX-License-Identifier: GPL-2.0-or-later
"""Easing of the feed law: drops pass at once, rises climb, and nothing is above the law."""

import numpy as np
import pytest

from chipwise.clib import core
from support.feed_cases import OFF, NOTHING, HERE, CEILING, FALLBACK, ODD, given, hostile
from support.random_cases import random_count, random_seed, write_replay


def test_hostile_easing():
    """Whatever comes in, period after period: finite, 0 <= scale <= that of the law."""
    seed, random = random_seed(), np.random.default_rng(random_seed())
    easing = core.FeedEasing()
    for _ in range(max(random_count(0), 20000)):
        case = hostile(random)
        values = dict(case)
        last = values.pop("last")
        given_now = given(**values)
        law_now = core.feed(given_now, last)
        recover, band = (ODD[random.integers(len(ODD))] for _ in range(2))
        scale = core.ease(easing, given_now, law_now, recover, band).scale
        if not 0.0 <= scale <= law_now.scale:
            pytest.fail(f"seed {seed}: {scale} of {law_now.scale}; {write_replay('easing', case)}")


def eased(scales, recover=0.0, deadband=0.0):
    """The scales of the law (limited by the stock here), one a period -> what is given out."""
    easing, values = core.FeedEasing(), given()
    return [core.ease(easing, values, core.FeedOut(scale, HERE), recover, deadband).scale for scale in scales]


def test_drops_pass_at_once_and_rises_climb():
    """500 mm/s2 in 1 ms at 10 mm/s: 0.05 a period."""
    assert eased([0.5, 0.2, 0.4, 0.4, 0.4, 0.4, 0.4, 0.1], recover=500.0) == pytest.approx(
        [0.5, 0.2, 0.25, 0.3, 0.35, 0.4, 0.4, 0.1]
    )
    assert eased([0.5, 0.2, 0.4]) == pytest.approx([0.5, 0.2, 0.4])


def test_deadband_holds_rises_only():
    """10 %: a rise to 0.55 is held, one to 0.56 passes; the smallest drop passes."""
    assert eased([0.5, 0.54, 0.549, 0.56, 0.559, 0.6, 0.62], deadband=0.1) == pytest.approx(
        [0.5, 0.5, 0.5, 0.56, 0.559, 0.559, 0.62]
    )


def test_deadband_and_climb():
    """The climb goes on behind the deadband and shows in steps."""
    scales = eased([0.2] + [0.4] * 6, recover=500.0, deadband=0.4)
    assert scales == pytest.approx([0.2, 0.2, 0.3, 0.3, 0.3, 0.3, 0.3])
    top = core.FeedEasing()
    for scale, by, expected in ((0.5, HERE, 0.5), (0.52, NOTHING, 0.52), (0.51, HERE, 0.51), (0.53, CEILING, 0.53)):
        assert core.ease(top, given(), core.FeedOut(scale, by), 0.0, 0.1).scale == pytest.approx(expected)


def test_never_above_the_law():
    random = np.random.default_rng(random_seed())
    for recover, deadband in ((0.0, 0.2), (50.0, 0.0), (200.0, 0.05), (0.0, 5.0)):
        scales = np.clip(0.5 + np.cumsum(random.normal(0, 0.02, 5000)), 0, 1)
        assert np.all(np.array(eased(scales, recover, deadband)) <= scales + 1e-15)


def test_easing_is_for_the_law_only():
    """Fallback, rapids and mode 0 go through as they are, and the next feed move starts anew."""
    easing = core.FeedEasing()
    low = core.FeedOut(0.1, HERE)
    for values, law_now in (
        (given(), core.FeedOut(0.9, FALLBACK)),
        (given(motion=1), core.FeedOut(1.0, NOTHING)),
        (given(kind=OFF), core.FeedOut(1.0, NOTHING)),
    ):
        assert core.ease(easing, given(), low, 1.0, 0.5).scale == pytest.approx(0.1)
        assert core.ease(easing, values, law_now, 1.0, 0.5).scale == law_now.scale
        assert core.ease(easing, given(), core.FeedOut(0.3, HERE), 1.0, 0.5).scale == pytest.approx(0.3)
        easing.is_begun = 0
