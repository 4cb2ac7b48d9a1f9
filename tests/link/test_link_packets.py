# SPDX-License-Identifier: GPL-2.0-or-later
"""Datagrams of the link: what is packed comes out, what is damaged does not, and only newer packets go on."""
import random
import socket
import subprocess
import threading
import time

import pytest

from chipwise.link import packets, transport
from support import ROOT
from support.random_cases import random_count, random_seed


def row(number, generator):
    return (number % 2 ** 32, *(generator.randrange(2 ** 32) for _ in range(3)), *(generator.randrange(-2 ** 31, 2 ** 31) for _ in range(6)))


def test_pack_and_unpack():
    generator = random.Random(random_seed())
    for _ in range(random_count(200)):
        sent = row(generator.randrange(2 ** 32), generator)
        datagram = packets.pack(sent)
        assert len(datagram) == packets.SIZE and packets.unpack(datagram) == sent
        place = generator.randrange(packets.SIZE)
        assert packets.unpack(datagram[:place] + bytes([datagram[place] ^ 1 << generator.randrange(8)]) + datagram[place + 1:]) is None, (sent, place)
        assert packets.unpack(datagram[:place]) is None and packets.unpack(datagram + b'x') is None


def test_only_newer_ones_pass():
    order = packets.Order()
    numbers = [2 ** 32 - 2, 2 ** 32 - 1, 2 ** 32 - 1, 1, 0, 2, 2 ** 32 - 2, 3]
    assert [order.passes(number, 0.001 * k) for k, number in enumerate(numbers)] == [True, True, False, True, False, True, False, True]
    assert order.ignored == 3
    assert not order.passes(1, 0.9) and order.passes(1, 0.9 + 1.1 * packets.SILENT_S)         # the master has started anew


class Stream:
    """A streamer that nobody empties, with room for `maxdepth` rows."""

    def __init__(self, maxdepth):
        self.rows, self.maxdepth = [], maxdepth

    depth = property(lambda self: len(self.rows))
    writable = property(lambda self: len(self.rows) < self.maxdepth)

    def write(self, values):
        self.rows.append(values)


@pytest.mark.parametrize('most, room, expected', [(20, 100, 20), (20, 5, 5)])
def test_no_more_wait_than_asked_for(most, room, expected):
    """The others are dropped; other datagrams are refused, and nothing ends the loop."""
    generator, stream, counted = random.Random(random_seed()), Stream(room), []
    channel = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    channel.bind(('127.0.0.1', 0))
    threading.Thread(target=transport.receive, args=(stream, channel, most, lambda *numbers: counted.append(numbers)), daemon=True).start()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sent = [row(k, generator) for k in range(50)]
        for datagram in [b'', b'x' * 9000, b'\0' * packets.SIZE, *map(packets.pack, sent)]:
            sender.sendto(datagram, channel.getsockname())
            time.sleep(0.001)
    end = time.monotonic() + 60
    while len(counted) < 53 and time.monotonic() < end:
        time.sleep(0.01)
    assert stream.rows == sent[:expected] and counted[-1] == (expected, 0, 50 - expected, 3)


@pytest.mark.parametrize('arguments, text', [(['send', 'nowhere'], 'is not HOST:PORT'), (['send', '127.0.0.1:0'], 'is not HOST:PORT'),
                                             (['send', 'no.such.host.invalid:7134'], 'host no.such.host.invalid'),
                                             (['receive', '127.0.0.1:7134', '--waiting', '0'], '--waiting 0 is not from 1 to 10000'),
                                             (['receive', '127.0.0.1:7134', '--channel', '9'], '--channel 9 is not from 0 to 7')])
def test_what_cannot_be_carried_out(arguments, text):
    done = subprocess.run([str(ROOT / 'bin/chipwise'), 'link', *arguments], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert done.returncode == 2 and text in done.stdout and 'Traceback' not in done.stdout, done.stdout
