# SPDX-License-Identifier: GPL-2.0-or-later
"""Clamps of one source on their path into the table in front of the guard: due, asked for, answered.  Called by
set_up.py and comment_clamps.py."""

from chipwise.stock import reasons


class ClampRequest:
    """Of one source: JOB or COMMENTS of clamps_in_force.py.  step() at each look of the monitor.

    Clamps that become due while others are asked for take their place in the table; the answer is then to the last
    ones.
    """

    def __init__(self, component, stock_files, source):
        self.pins, self.files, self.source = component, stock_files, source
        self.is_due = self.is_asked = False

    @property
    def is_open(self):
        """Whether an answer is still to come."""
        return self.is_due or self.is_asked

    def begin(self, is_due):
        """A new request, due or not, in the place of one that is open."""
        self.is_due, self.is_asked = is_due, False

    def step(self, clamps, may_begin=True):
        """The reply (stock/reasons.py) to clamps [(how many M256 come before it, Clamp)], once, as soon as it is there;
        else None.

        may_begin: whether they may be put into the table now, besides what the pins and the stock say.
        """
        if self.is_due and may_begin and self.files.stock and not self.pins["request"]:
            self.is_due, self.is_asked = False, True
            reply = self.files.lay_clamps(self.source, clamps)
        elif self.is_asked:
            reply = self.files.clamps.reply
        else:
            return None
        if reply == reasons.BUSY:
            return None
        self.is_asked = False
        return reply
