# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise-command.0.status: no part of it reaches into the next one, and a double has all of its digits."""

from chipwise.clib import layout
from chipwise.stock.reasons import REASONS

# (largest value, weight) from the lowest on; a ceiling has hundredths of F
PARTS = [
    (max(layout.FeedMode), 1),
    (1, layout.STATUS_STOCK),
    (max(layout.Fault), layout.STATUS_FAULT),
    (max(REASONS), layout.STATUS_REPLY),
    (100 * layout.MOST_CEILING, layout.STATUS_JOB),
    (1, layout.STATUS_WAITS),
    (1, layout.STATUS_ACTIVE),
    (1, layout.STATUS_CARRIED),
    (1, layout.STATUS_AIR),
]


def test_no_part_reaches_into_the_next():
    below = 0
    for most, weight in PARTS:
        assert below < weight
        below += most * weight
    assert below < 2**53
