# SPDX-License-Identifier: GPL-2.0-or-later
"""Who may have how many connections and pages of `chipwise panel` at once, so that nobody shuts the operator out.

Called by server.py.

 1. Visitors are of two kinds: this computer's own (the loopback, or the address at which it is served), and addresses
    from which the right token came, are friends; all others are strangers.
 2. Of MOST_CONNECTIONS and MOST_STREAMS, ROOM_CONNECTIONS and ROOM_STREAMS are kept for friends: strangers, however
    many they are, get no more than the rest, and no place of a friend is ever theirs.
 3. One stranger has at most MOST_OF_ADDRESS connections and STREAMS_OF_ADDRESS pages.  An IPv6 network of 64 bits is
    one stranger: a computer may have any address of its own.
 4. One stranger may connect REQUESTS_AT_ONCE times at once and REQUESTS_PER_S times a second after that.  Each more is
    closed unread.
 5. What is remembered is bounded: MOST_FRIENDS addresses, and MOST_REMEMBERED strangers; the one that was here least
    recently is forgotten.

Any function is called under the lock of the server.
"""

import ipaddress
import time
from collections import Counter, OrderedDict
from collections.abc import Hashable

MOST_CONNECTIONS = 48
ROOM_CONNECTIONS = 16
MOST_STREAMS = 16
ROOM_STREAMS = 8
MOST_OF_ADDRESS = 12  # a browser opens six at once
STREAMS_OF_ADDRESS = 4
REQUESTS_AT_ONCE = 60  # a page is some fifteen requests
REQUESTS_PER_S = 20.0
MOST_FRIENDS = 16
MOST_REMEMBERED = 1024


def plain(address: str) -> str:
    """An address as text, without zone; IPv4 that has come by IPv6 is IPv4."""
    return address.partition("%")[0].removeprefix("::ffff:")


def network(address: str) -> str:
    """What counts as one visitor."""
    try:
        found = ipaddress.ip_address(plain(address))
    except ValueError:
        return address
    return str(ipaddress.ip_network((found, 64), strict=False)) if found.version == 6 else str(found)


def is_local(address: str, served: str) -> bool:
    """Whether a connection is from this computer; served: the address of it that the connection has come to."""
    return ipaddress.ip_address(plain(address)).is_loopback or plain(address) == plain(served)


class Visitor:
    """One connection: who it is from."""

    def __init__(self, name: str, local: bool) -> None:
        self.name, self.local = name, local


Places = dict[Hashable, Visitor]  # by connection


class Visitors:
    """All connections of one server."""

    def __init__(self) -> None:
        self.connections: Places = {}
        self.streams: Places = {}
        self._friends: OrderedDict[str, bool] = OrderedDict()  # names, the last one that was here at the end
        # name of a stranger: (requests left, s on the clock)
        self._budgets: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def is_friend(self, visitor: Visitor) -> bool:
        return visitor.local or visitor.name in self._friends

    def befriend(self, visitor: Visitor) -> None:
        """The right token has come."""
        if not visitor.local:
            self._friends[visitor.name] = True
            self._friends.move_to_end(visitor.name)
            while len(self._friends) > MOST_FRIENDS:
                self._friends.popitem(last=False)

    def _strangers(self, places: Places) -> Counter[str]:
        return Counter(one.name for one in places.values() if not self.is_friend(one))

    def _fits(self, places: Places, visitor: Visitor, most: int, room: int, of_address: int) -> bool:
        """Whether one more place is free for a visitor."""
        if len(places) >= most:
            return False
        if self.is_friend(visitor):
            return True
        strangers = self._strangers(places)
        return sum(strangers.values()) < most - room and strangers[visitor.name] < of_address

    def come(self, connection: object, address: str, served: str) -> bool:
        """-> whether a connection may stay."""
        visitor = Visitor(network(address), is_local(address, served))
        if not self._fits(
            self.connections, visitor, MOST_CONNECTIONS, ROOM_CONNECTIONS, MOST_OF_ADDRESS
        ) or not self._may_ask(visitor):
            return False
        self.connections[connection] = visitor
        return True

    def _may_ask(self, visitor: Visitor) -> bool:
        """Count a request of a stranger; -> whether it is not one too many."""
        if self.is_friend(visitor):
            return True
        now = time.monotonic()
        left, then = self._budgets.pop(visitor.name, (REQUESTS_AT_ONCE, now))
        left = min(REQUESTS_AT_ONCE, left + (now - then) * REQUESTS_PER_S)
        self._budgets[visitor.name] = (max(0.0, left - 1.0), now)
        while len(self._budgets) > MOST_REMEMBERED:
            self._budgets.popitem(last=False)
        return left >= 1.0

    def go(self, connection: object) -> None:
        self.connections.pop(connection, None)
        self.streams.pop(connection, None)

    def open_page(self, connection: object) -> bool:
        """-> whether a connection may have a stream, which close_page() or go() ends."""
        visitor = self.connections.get(connection)
        if visitor is None or not self._fits(self.streams, visitor, MOST_STREAMS, ROOM_STREAMS, STREAMS_OF_ADDRESS):
            return False
        self.streams[connection] = visitor
        return True

    def close_page(self, connection: object) -> None:
        self.streams.pop(connection, None)
