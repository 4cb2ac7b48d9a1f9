# SPDX-License-Identifier: GPL-2.0-or-later
"""A load that is lost in the middle of a cut: when it counts as lost and found (load_watch.h), and the feed meanwhile
(feed_hold.h)."""

import numpy as np
import pytest

from chipwise.clib import core
from support.feed_cases import FALLBACK, HERE, NOTHING, given, hostile
from support.random_cases import random_seed

TOOL = (6.0, 0.0, 0.0, 20.0)
REQUESTED = 50.0


class Watched:
    """The watch over the load; each call is a period."""

    def __init__(self):
        self.watch = core.LoadWatch()

    def __call__(self, ready, unwatched=False, number=1, tool=TOOL, stock=False, decided=False):
        values = core.LoadWatchIn(
            is_ready=ready,
            is_unwatched=unwatched,
            stock_changes=stock,
            is_decided=decided,
            tool_in_spindle_number=number,
        )
        values.tool_mu[:] = tool
        return core.load_is_lost(self.watch, values)


def test_lost_and_found():
    """Nothing is lost that was not known; what was is lost until it is known again, and so it is with an unchanged tool
    that nobody followed."""
    load = Watched()
    assert not load(False) and not load(False, unwatched=True) and not load(True)
    assert load(False) and load(False) and not load(True)
    assert load(False, unwatched=True) and not load(True, unwatched=True) and not load(True)


def test_a_followed_tool_change_is_none():
    """M6 with a monitor that follows it 20 ms later."""
    load = Watched()
    load(True)
    assert load(False, number=8) and not load(True, number=8, tool=(12.0, 0.0, 0.0, 30.0))


@pytest.mark.parametrize(
    "change", [dict(number=8), dict(tool=(12.0, 0.0, 0.0, 20.0)), dict(tool=(6.0, 0.0, 0.0, 0.0)), dict(stock=True)]
)
def test_another_tool_or_stock_that_nobody_followed(change):
    """It stays lost, ready or not, until somebody decides; then what is there counts."""
    load = Watched()
    load(True)
    assert load(False, unwatched=True) and load(False, unwatched=True, **change)
    later = {key: value for key, value in change.items() if key != "stock"}
    assert all(load(True, **later) for _ in range(5))
    assert not load(True, decided=True, **later) and not load(True, **later)
    assert load(False, **later) and not load(True, **later)


def test_a_decision_while_it_is_lost():
    load = Watched()
    load(True)
    assert (
        load(False, unwatched=True)
        and not load(False, unwatched=True, decided=True)
        and not load(False)
        and not load(True)
    )


class Feed:
    """The law's output held or not; each call is a period in a feed move."""

    def __init__(self):
        self.hold = core.FeedHold()

    def __call__(self, scale, area=18.0, lost=False, limit=HERE, **values):
        values = {"feed_mode": 2, "requested_vel_mm_s": REQUESTED, **values}
        return core.hold_feed(self.hold, given(section_area_mm2=area, **values), lost, core.FeedOut(scale, limit))


def test_held_in_the_stock():
    """Override and velocity stay at most what they were, also with another requested velocity; they may fall; then the
    law counts."""
    feed = Feed()
    assert feed(0.3).scale == 0.3 and feed(0.2).scale == 0.2
    held = feed(0.4, lost=True, limit=FALLBACK)
    assert held.scale == 0.2 and held.limit == FALLBACK
    assert feed(0.4, lost=True, limit=FALLBACK, requested_vel_mm_s=100.0).scale == pytest.approx(0.1)
    assert feed(1.0, lost=True, limit=FALLBACK, requested_vel_mm_s=20.0).scale == 0.2
    assert feed(0.1, lost=True, limit=FALLBACK).scale == pytest.approx(0.1)
    assert feed(0.4, lost=True, limit=NOTHING).scale == 0.2
    assert feed(0.4).scale == 0.4


def test_held_in_air():
    """Lost between two cuts: the lowest of the cut before, not of the one before that, nor the feed in air."""
    feed = Feed()
    for area, scale in ((20.0, 0.05), (0.0, 1.0), (18.0, 0.4), (18.0, 0.2), (10.0, 0.5), (0.0, 1.0)):
        feed(scale, area)
    assert feed(0.4, 0.0, lost=True, limit=FALLBACK).scale == 0.2
    air = Feed()
    air(0.9, 0.0)
    assert air(1.0, 0.0, lost=True).scale == 0.9


def test_not_held():
    """A traverse, a feed that is off, and one that was never known; M252 forgets."""
    feed = Feed()
    assert feed(0.4, lost=True, limit=FALLBACK).scale == 0.4
    feed(0.1)
    assert feed(1.0, lost=True, motion=1, limit=NOTHING).scale == 1.0
    assert feed(1.0, lost=True, feed_mode=0, limit=NOTHING).scale == 1.0
    assert feed(0.4, lost=True, limit=FALLBACK).scale == 0.4


def test_hostile():
    """Whatever comes in: finite, from 0 to what the law says."""
    random, hold = np.random.default_rng(random_seed()), core.FeedHold()
    for _ in range(5000):
        values = hostile(random)
        last = values.pop("last")
        now = given(**values)
        law = core.feed(now, last)
        found = core.hold_feed(hold, now, int(random.integers(2)), law)
        assert 0.0 <= found.scale <= law.scale and 0 <= found.limit <= FALLBACK
