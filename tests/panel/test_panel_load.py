# SPDX-License-Identifier: GPL-2.0-or-later
"""Connections to the server of `chipwise panel` that are many, slow, silent or garbage: they are cut off, and nobody
waits."""

import os
import random
import socket
import threading
import time

import pytest

from chipwise.panel import server, visitors, watch
from support.panel_client import follow, request
from support.panel_rig import serving

GARBAGE = int(os.environ.get("CHIPWISE_PANEL_GARBAGE", 60))


def test_a_hundred_connections(rig, monkeypatch):
    """Those that say nothing are cut off; then there is place again."""
    monkeypatch.setattr(server, "REQUEST_S", 1.5)
    at_once = []  # the connections and threads after each one that came

    def process_request(self, *connection, process=server.Server.process_request):
        process(self, *connection)
        at_once.append((len(self._open), threading.active_count()))

    monkeypatch.setattr(server.Server, "process_request", process_request)
    rig.looks()
    others = threading.active_count()  # of the tests
    page = threading.Thread(target=follow, args=(rig.url, 4.0))
    page.start()
    rig.wait(lambda: rig.watch.pages == 1)
    crowd = [socket.create_connection(rig.server.server_address[:2]) for _ in range(100)]
    rig.wait(lambda: len(at_once) >= 101)
    connections, threads = map(max, zip(*at_once))
    assert 1 < connections <= visitors.MOST_CONNECTIONS and threads - others < visitors.MOST_CONNECTIONS + 10
    before = rig.machine.looks
    rig.wait(lambda: len(rig.server._open) <= 1)
    rig.wait(lambda: rig.machine.looks > before)  # the looks at the machine go on
    monkeypatch.setattr(server, "REQUEST_S", 60.0)
    assert request(rig.url, "/state.json")[0] == 200
    for one in crowd:
        one.close()
    page.join(300)
    assert not page.is_alive()


@pytest.mark.parametrize(
    "at_once, slowly",
    [
        ("", "GET / HTTP/1.0\r\nX-Long: " + "a" * 1000),
        ("POST /plan HTTP/1.0\r\nHost: {0}\r\nOrigin: http://{0}\r\nContent-Length: 4000\r\n\r\n", " " * 1000),
    ],
    ids=["head", "body"],
)
def test_byte_by_byte(rig, monkeypatch, at_once, slowly):
    """A request that never ends is cut off, though each byte of it comes in time."""
    monkeypatch.setattr(server, "REQUEST_S", 1.0)
    with socket.create_connection(rig.server.server_address[:2], timeout=300) as connection:
        sent, cut = 0, False
        connection.sendall(at_once.format(rig.url.removeprefix("http://")).encode())
        for byte in slowly.encode():
            try:
                connection.sendall(bytes([byte]))
            except OSError:
                cut = True
                break
            sent += 1
            time.sleep(0.05)
    assert cut and 0 < sent < 800  # each takes 0.05 s or more
    rig.wait(lambda: not rig.server._open)


def test_a_slow_reader(monkeypatch):
    """A page that does not read is cut off; another one beside it gets everything."""
    monkeypatch.setattr(server, "SEND_S", 1.0)
    with serving(high=(250.0, 150.0, 0.0)) as rig:
        rig.looks()
        slow = socket.socket()
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.connect(rig.server.server_address[:2])
        slow.sendall(f"GET /stream HTTP/1.0\r\nHost: {rig.url[7:]}\r\n\r\n".encode())
        rig.wait(lambda: rig.watch.pages == 1)
        assert len(follow(rig.url, states=5).states) >= 5
        rig.wait(lambda: rig.watch.pages == 0)
        slow.close()


def test_pages_have_an_end(rig, monkeypatch):
    monkeypatch.setattr(visitors, "MOST_STREAMS", 3)
    rig.looks()
    stop = []
    pages = [threading.Thread(target=follow, args=(rig.url, 60.0)) for _ in range(3)]
    for page in pages:
        page.start()
    rig.wait(lambda: rig.watch.pages == 3)
    status, _headers, words = request(rig.url, "/stream")
    assert status == 503 and b"3 pages are open already" in words and not stop
    rig.watch.end()  # LinuxCNC has ended: so do all streams
    for page in pages:
        page.join(300)
        assert not page.is_alive()


@pytest.mark.parametrize("seed", range(GARBAGE))
def test_garbage(changing, seed):
    """Random bytes, and requests with random parts: an answer or none, and the next request is served."""
    chance = random.Random(seed)
    some = bytes(chance.randrange(256) for _ in range(chance.randrange(1, 300)))
    data = chance.choice(
        [
            some,
            b"GET " + some + b" HTTP/1.0\r\n\r\n",
            b"GET / HTTP/" + some + b"\r\n\r\n",
            b"POST /clear HTTP/1.1\r\nContent-Length: -5\r\n\r\n",
            b"GET / HTTP/1.0\r\n" + some * 500 + b"\r\n\r\n",
            b"GET / HTTP/1.0\r\n" + b"A: b\r\n" * 300 + b"\r\n",
            b"GET /" + b"a" * 70000 + b"\r\n\r\n",
            b"POST /clear HTTP/1.0\r\nHost: x\r\nContent-Length: 99999999999\r\n\r\n",
            b"\r\n" * 50,
            b"GET / HTTP/1.0\r\nHost: \xff\xfe\r\n\r\n",
        ]
    )
    with socket.create_connection(changing.server.server_address[:2], timeout=300) as connection:
        try:
            connection.sendall(data)
            connection.shutdown(socket.SHUT_WR)
            connection.recv(65536)
        except OSError:  # cut off in the middle of it
            pass
    assert request(changing.url, "/state.json")[0] == 200, f"seed {seed}: {data!r:.300}"


def test_a_page_that_goes_away(rig):
    rig.looks()  # without them nothing is sent, and it is not seen before server.WAIT_S
    for _ in range(20):
        with socket.create_connection(rig.server.server_address[:2]) as connection:
            connection.sendall(f"GET /stream HTTP/1.0\r\nHost: {rig.url[7:]}\r\n\r\n".encode())
            connection.recv(100)
    rig.wait(lambda: rig.watch.pages == 0 and not rig.server._open)


def test_looks_do_not_wait_for_pages(rig):
    """One page that does not read does not hold the looks up."""
    with socket.create_connection(rig.server.server_address[:2]) as connection:
        connection.sendall(f"GET /stream HTTP/1.0\r\nHost: {rig.url[7:]}\r\n\r\n".encode())
        rig.wait(lambda: rig.watch.pages == 1)
        before = time.thread_time()
        rig.look(50)
        assert rig.watch.number >= 51 and time.thread_time() - before < 2.0


def test_times_fit_together():
    assert server.WAIT_S > watch.LOOK_S and visitors.MOST_STREAMS < visitors.MOST_CONNECTIONS
