# SPDX-License-Identifier: GPL-2.0-or-later
"""Datagrams of the link: what is packed comes out, what is damaged does not, and only newer packets go on."""

import random
import socket
import subprocess
import threading
import time
import timeit

import pytest

from chipwise.errors import CycleError
from chipwise.link import key, packets, reception, transport
from chipwise.link.reception import IGNORED, PASSED, REFUSED
from support import ROOT
from support.random_cases import random_count, random_seed


def row(number, generator):
    return (
        number % 2**32,
        *(generator.randrange(2**32) for _ in range(3)),
        *(generator.randrange(-(2**31), 2**31) for _ in range(6)),
    )


def test_pack_and_unpack():
    generator, codec = random.Random(random_seed()), packets.Codec(b"k" * 16)
    for _ in range(random_count(200)):
        sent, session, challenge = (
            row(generator.randrange(2**32), generator),
            generator.randbytes(8),
            generator.randbytes(8),
        )
        datagram = codec.pack(sent, session, challenge)
        assert len(datagram) == packets.SIZE and codec.unpack(datagram) == (sent, session, challenge)
        place = generator.randrange(packets.SIZE)
        assert (
            codec.unpack(
                datagram[:place] + bytes([datagram[place] ^ 1 << generator.randrange(8)]) + datagram[place + 1 :]
            )
            is None
        ), (sent, place)
        assert codec.unpack(datagram[:place]) is None and codec.unpack(datagram + b"x") is None
        assert packets.Codec(b"").unpack(datagram) is None and packets.Codec(b"l" * 16).unpack(datagram) is None


def at(number, x=0):
    """A row of a master at x counts."""
    return (number % 2**32, x % 2**32, 0, 0, x >> 32, 0, 0, 0, 0, 0)


def test_only_newer_ones_pass():
    order = reception.Order()
    numbers = [2**32 - 2, 2**32 - 1, 2**32 - 1, 1, 0, 2, 2**32 - 2, 3]
    verdicts = [order.decide(at(number), 0.001 * k) for k, number in enumerate(numbers)]
    assert verdicts == [PASSED, PASSED, IGNORED, PASSED, IGNORED, PASSED, IGNORED, PASSED]


def test_a_jump_is_refused_and_the_true_master_goes_on():
    """Half the range ahead, a thousand numbers ahead, 95,000 counts in one: each is refused, and the master's next one
    passes."""
    order = reception.Order()
    assert order.decide(at(100), 0.0) == PASSED
    for number, x in ((100 + 2**31 - 1, 0), (1100, 95000), (101, 95000), (99, 0)):
        assert order.decide(at(number, x), 0.001) in (REFUSED, IGNORED)
        assert order.heard_s == 0.0
    assert order.decide(at(101, 50), 0.002) == PASSED
    assert order.decide(at(1101, 3000), 0.9) == PASSED  # 1000 periods were lost, and took their time


MASTER, STRANGER = ("10.0.0.1", 5000), ("10.0.0.9", 5000)


def bound(codec, at_s=0.0, address=MASTER, slave=None):
    """A slave that has bound a master -> (slave, session, challenge)."""
    slave, session = slave or reception.Reception(codec), bytes([int(at_s) % 250 + 1]) * 8
    verdict, _row, ask = slave.decide(codec.pack(at(1), session), address, at_s)
    assert verdict == REFUSED and len(ask) <= packets.SIZE
    challenge = codec.challenge(ask, session)
    assert slave.decide(codec.pack(at(2), session, challenge), address, at_s + 0.001)[0] == PASSED
    return slave, session, challenge


def test_the_first_master_is_bound():
    """Another address, another session, another key: refused while the master lives; its packets go on."""
    codec = packets.Codec(b"k" * 16)
    slave, session, challenge = bound(codec)
    for datagram, address in (
        (codec.pack(at(3), session, challenge), STRANGER),
        (codec.pack(at(3), b"s" * 8, challenge), MASTER),
        (codec.pack(at(3), b"s" * 8), STRANGER),
        (packets.Codec(b"").pack(at(3), session, challenge), MASTER),
        (b"", MASTER),
    ):
        assert slave.decide(datagram, address, 0.01) == (REFUSED, None, None)
    assert slave.decide(codec.pack(at(3), session, challenge), MASTER, 0.02) == (PASSED, at(3), None)
    chosen = reception.Reception(codec, "10.0.0.2")
    assert chosen.decide(codec.pack(at(1), session), MASTER, 0.0) == (REFUSED, None, None)


def test_recordings_are_worth_nothing():
    """All that was ever sent comes again, from anybody, while the master is silent and after the slave was started
    anew."""
    codec = packets.Codec(b"k" * 16)
    slave, session, challenge = bound(codec)
    recorded = [codec.pack(at(number), session, challenge) for number in range(3, 20)]
    assert [slave.decide(datagram, MASTER, 0.01)[0] for datagram in recorded] == [PASSED] * 17
    recorded += [codec.pack(at(1), session), codec.pack(at(2), session, challenge)]
    for decide, start_s in ((slave.decide, 5.0), (reception.Reception(codec).decide, 0.0)):
        for k, datagram in enumerate(recorded):
            for address in (MASTER, STRANGER):
                assert decide(datagram, address, start_s + k)[0] != PASSED
    again, _session, _challenge = bound(codec, 60.0, ("10.0.0.1", 6000), slave)  # the master started anew
    assert again.decide(recorded[-3], MASTER, 70.0)[0] != PASSED


def test_without_a_key_the_first_sender_is_bound():
    codec, slave = packets.Codec(), reception.Reception(packets.Codec())
    assert slave.decide(codec.pack(at(1), b"m" * 8), MASTER, 0.0)[0] == PASSED
    assert slave.decide(codec.pack(at(2), b"s" * 8), STRANGER, 0.5)[0] == REFUSED
    assert slave.decide(codec.pack(at(2), b"n" * 8), MASTER, 1.5)[0] == PASSED


def test_the_key_of_the_ini_file(tmp_path):
    ini, file = tmp_path / "a.ini", tmp_path / "link.key"
    ini.write_text("[TRACER_LINK]\nKEY_FILE = link.key\nMASTER = 10.0.0.2\n")
    file.write_bytes(b"0123456789abcdef\n")
    file.chmod(0o600)
    assert key.key_of(str(ini)) == b"0123456789abcdef" and key.master_of(str(ini)) == "10.0.0.2"
    file.chmod(0o640)
    with pytest.raises(CycleError, match="can be read by others, mode 640"):
        key.key_of(str(ini))
    file.unlink()
    with pytest.raises(CycleError, match="No such file"):
        key.key_of(str(ini))
    ini.write_text("[TRACER_LINK]\nKEY = short\n")
    with pytest.raises(CycleError, match="has 5 bytes"):
        key.key_of(str(ini))
    ini.write_text("[TRACER_LINK]\nSLAVE = 127.0.0.1:1\n")
    assert key.key_of(str(ini)) == b""


def test_what_a_tag_costs():
    """Printed, not judged: it depends on the computer."""
    codec, sent = packets.Codec(b"k" * 32), at(1)
    for name, work in (
        ("made", lambda: codec.pack(sent)),
        ("checked", lambda datagram=codec.pack(sent): codec.unpack(datagram)),
    ):
        print(f"datagram {name}: {min(timeit.repeat(work, number=2000, repeat=5)) / 2000 * 1e6:.1f} us")


class Stream:
    """A streamer that nobody empties, with room for `maxdepth` rows."""

    def __init__(self, maxdepth):
        self.rows, self.maxdepth = [], maxdepth

    depth = property(lambda self: len(self.rows))
    writable = property(lambda self: len(self.rows) < self.maxdepth)

    def write(self, values):
        self.rows.append(values)


@pytest.mark.parametrize("most, room, expected", [(20, 100, 20), (20, 5, 5)])
def test_no_more_wait_than_asked_for(most, room, expected):
    """The others are dropped; other datagrams are refused, and nothing ends the loop."""
    generator, stream, counted = random.Random(random_seed()), Stream(room), []
    channel = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    channel.bind(("127.0.0.1", 0))
    slave = reception.Reception(packets.Codec())
    threading.Thread(
        target=transport.receive,
        args=(stream, channel, most, lambda *numbers: counted.append(numbers), slave),
        daemon=True,
    ).start()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sent = [at(k + 1, generator.randrange(1000)) for k in range(50)]
        for datagram in [b"", b"x" * 9000, b"\0" * packets.SIZE, *map(packets.Codec().pack, sent)]:
            sender.sendto(datagram, channel.getsockname())
            time.sleep(0.001)
    end = time.monotonic() + 300
    while len(counted) < 53 and time.monotonic() < end:
        time.sleep(0.01)
    assert stream.rows == sent[:expected] and counted[-1] == (expected, 0, 50 - expected, 3)


@pytest.mark.parametrize(
    "arguments, text",
    [
        (["send", "nowhere"], "is not HOST:PORT"),
        (["send", "127.0.0.1:0"], "is not HOST:PORT"),
        (["send", "no.such.host.invalid:7134"], "host no.such.host.invalid"),
        (["receive", "127.0.0.1:7134", "--waiting", "0"], "--waiting 0 is not from 1 to 10000"),
        (["receive", "0.0.0.0:7134"], "is not the loopback and there is no key"),
        (["send", "192.0.2.7:7134"], "is not the loopback and there is no key"),
        (["receive", "127.0.0.1:7134", "--most-counts", "0"], "--most-counts 0 is not from 1"),
        (["receive", "127.0.0.1:7134", "--channel", "9"], "--channel 9 is not from 0 to 7"),
    ],
)
def test_what_cannot_be_carried_out(arguments, text):
    done = subprocess.run(
        [str(ROOT / "bin/chipwise"), "link", *arguments], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    assert done.returncode == 2 and text in done.stdout and "Traceback" not in done.stdout, done.stdout


class Rows:
    """A sampler that has a new row at each look, as long as `has_all` is FALSE."""

    def __init__(self):
        self.number, self.has_all = 0, False

    readable = property(lambda self: not self.has_all and self.number % 3 != 2 or self.skip())

    def skip(self):
        self.number += 1
        return False

    def read(self):
        self.number += 1
        return at(self.number)


def test_a_master_answers_its_slave():
    """Both loops with a key: after one challenge all of the master's packets pass, and none of a master with another
    key."""
    stream, rows, stranger, channel = Stream(10000), Rows(), Rows(), socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    channel.bind(("127.0.0.1", 0))
    slave, counted = reception.Reception(packets.Codec(b"k" * 16)), []
    threading.Thread(
        target=transport.receive,
        args=(stream, channel, 10000, lambda *numbers: counted.append(numbers), slave),
        daemon=True,
    ).start()
    for source, secret in ((stranger, b"s" * 16), (rows, b"k" * 16)):
        threading.Thread(
            target=transport.send,
            args=(source, channel.getsockname(), lambda *numbers: None, packets.Codec(secret)),
            daemon=True,
        ).start()
    end = time.monotonic() + 300
    while len(stream.rows) < 100 and time.monotonic() < end:
        time.sleep(0.01)
    rows.has_all = stranger.has_all = True
    passed = [row[0] for row in stream.rows]
    assert len(passed) >= 100 and passed == sorted(set(passed)) and counted[-1][3] > 0
