# SPDX-License-Identifier: GPL-2.0-or-later
"""Which datagrams go on to the slave: those of one master, in their order, that it can have moved.

Called by transport.py.  What is refused or ignored changes nothing, and does not count as heard.
"""

import secrets

from chipwise.link.packets import NO_TOKEN, TOKEN_BYTES

SILENT_S = 1.0  # a master that was silent for so long may have started anew: another session can take its place
MOST_GAP = 200  # numbers that may be missing at once, beside those of the time since the last packet
GAP_HZ = 4000.0  # of these, a second: the fastest servo thread
MOST_COUNTS = 20000  # of an axis in a period: 200 machine units/s at 1 ms and 100000 counts a unit
ASK_S = 0.01  # between two challenges
PASSED, IGNORED, REFUSED = "passed", "ignored", "refused"


def counts_of(row):
    """The counts of the three axes, 64 bits."""
    return [high * 2**32 + low for low, high in zip(row[1:4], row[4:7])]


class Order:
    """Lets each packet of a session pass that is newer than all before, and not further from them than a master gets in
    that time."""

    def __init__(self, most_counts=MOST_COUNTS):
        self.most_counts = most_counts
        self.newest, self.heard_s = None, float("-inf")
        self.counts: tuple = ()  # of the newest

    def is_silent(self, now_s):
        return now_s - self.heard_s > SILENT_S

    def forget(self):
        self.newest, self.heard_s = None, float("-inf")

    def decide(self, row, now_s):
        """PASSED, IGNORED (doubled, late) or REFUSED (a jump), at a time in s."""
        counts = counts_of(row)
        if self.newest is not None:
            gap = (row[0] - self.newest) % 2**32
            if gap == 0 or gap >= 2**31:
                return IGNORED
            if gap > MOST_GAP + GAP_HZ * (now_s - self.heard_s):
                return REFUSED
            if any(abs(new - old) > gap * self.most_counts for new, old in zip(counts, self.counts)):
                return REFUSED
        self.newest, self.counts, self.heard_s = row[0], counts, now_s
        return PASSED


class Reception:
    """Binds one master: the host of the setting, or the first one whose datagram is authentic.

    With a key the master has to answer a challenge before it is bound, and another can take its place after SILENT_S
    only."""

    def __init__(self, codec, host=None, most_counts=MOST_COUNTS):
        self.codec, self.host = codec, host
        self.order = Order(most_counts)
        self.bound = None  # (address, session)
        self.challenge, self.pending, self.asked_s = NO_TOKEN, None, float("-inf")

    def decide(self, datagram, address, now_s):
        """A datagram from an address (host, port) at a time in s -> (PASSED, IGNORED or REFUSED, row or None, answer or
        None)."""
        found = self.codec.unpack(datagram)
        if found is None or (self.host is not None and address[0] != self.host):
            return REFUSED, None, None
        row, session, challenge = found
        if self.bound != (address, session) or challenge != self.challenge:
            if self.bound is not None and not self.order.is_silent(now_s):
                return REFUSED, None, None
            if self.codec.key and challenge != self.pending:
                return REFUSED, None, self._ask(session, now_s)
            self.bound, self.challenge, self.pending = (address, session), challenge, None
            self.order.forget()
        verdict = self.order.decide(row, now_s)
        return verdict, row if verdict == PASSED else None, None

    def _ask(self, session, now_s):
        """The challenge for a master that is not bound yet; None if there was one just now."""
        if now_s - self.asked_s < ASK_S:
            return None
        self.asked_s = now_s
        self.pending = self.pending or secrets.token_bytes(TOKEN_BYTES)
        return self.codec.ask(session, self.pending)
