# SPDX-License-Identifier: GPL-2.0-or-later
"""Between HAL's streams and a socket: send() beside the master, receive() beside the slave.  Both run until they are ended.

A packet that finds no place costs the slave time, never position: the next one has the whole count.
"""
import select
import socket
import time

from chipwise.link.packets import SIZE, Order, pack, unpack

POLL_S = 0.0005         # HAL's streams cannot be waited for
RECEIVE_BYTES = 4096    # more than SIZE: a longer datagram is seen as one


def send(stream, address, count):
    """Rows of the sampler's stream to address (host, port); count(sent, failed) after each turn."""
    sent = failed = 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.setblocking(False)
        while True:
            while stream.readable:
                try:
                    channel.sendto(pack(stream.read()), address)
                    sent += 1
                except OSError:         # no receiver yet, or a full buffer
                    failed += 1
            count(sent, failed)
            time.sleep(POLL_S)


def receive(stream, channel, most_waiting, count):
    """Datagrams of a bound socket to the streamer's stream.

    most_waiting    packets in the stream from which on others are dropped: so many periods the slave is late at most
    count           called with (passed, ignored, dropped, refused) after each turn
    """
    order, passed, dropped, refused = Order(), 0, 0, 0
    while True:
        select.select([channel], [], [])
        row = unpack(channel.recv(RECEIVE_BYTES))
        if row is None:
            refused += 1
        elif order.passes(row[0], time.monotonic()):
            if stream.depth < most_waiting and stream.writable:
                stream.write(row)
                passed += 1
            else:
                dropped += 1
        count(passed, order.ignored, dropped, refused)


assert RECEIVE_BYTES > SIZE
