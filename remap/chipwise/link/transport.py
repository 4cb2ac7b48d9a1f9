# SPDX-License-Identifier: GPL-2.0-or-later
"""Between HAL's streams and a socket: send() beside the master, receive() beside the slave.  Both run until they are
ended.

A packet that finds no place costs the slave time, never position: the next one has the whole count.
"""

import secrets
import select
import socket
import time

from chipwise.link.packets import NO_TOKEN, SIZE, TOKEN_BYTES
from chipwise.link.reception import IGNORED, PASSED

POLL_S = 0.0005  # HAL's streams cannot be waited for
RECEIVE_BYTES = 4096  # more than SIZE: a longer datagram is seen as one
MOST_ANSWERS = 100  # datagrams read in a turn of the master: strangers do not keep it from sending


def challenge_of(channel, codec, session, known):
    """The slave's newest challenge among what has arrived, `known` without one."""
    for _ in range(MOST_ANSWERS):
        try:
            known = codec.challenge(channel.recv(RECEIVE_BYTES), session) or known
        except BlockingIOError:
            break
        except OSError:  # nobody listens there yet
            continue
    return known


def send(stream, address, count, codec):
    """Rows of the sampler's stream to address (host, port); count(sent, failed) after each turn."""
    sent = failed = 0
    session, challenge = secrets.token_bytes(TOKEN_BYTES), NO_TOKEN
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.setblocking(False)
        while True:
            challenge = challenge_of(channel, codec, session, challenge)
            while stream.readable:
                try:
                    channel.sendto(codec.pack(stream.read(), session, challenge), address)
                    sent += 1
                except OSError:  # no receiver yet, or a full buffer
                    failed += 1
            count(sent, failed)
            time.sleep(POLL_S)


def receive(stream, channel, most_waiting, count, reception):
    """Datagrams of a bound socket to the streamer's stream.

    most_waiting    packets in the stream from which on others are dropped: so many periods the slave is late at most
    count           called with (passed, ignored, dropped, refused) after each turn
    """
    passed = ignored = dropped = refused = 0
    while True:
        select.select([channel], [], [])
        datagram, address = channel.recvfrom(RECEIVE_BYTES)
        verdict, row, answer = reception.decide(datagram, address, time.monotonic())
        if answer is not None:
            try:
                channel.sendto(answer, socket.MSG_DONTWAIT, address)
            except OSError:  # it asks again with the next datagram
                pass
        if verdict == PASSED and stream.depth < most_waiting and stream.writable:
            stream.write(row)
            passed += 1
        elif verdict == PASSED:
            dropped += 1
        elif verdict == IGNORED:
            ignored += 1
        else:
            refused += 1
        count(passed, ignored, dropped, refused)


assert RECEIVE_BYTES > SIZE
