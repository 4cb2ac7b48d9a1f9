# SPDX-License-Identifier: GPL-2.0-or-later
"""A stranger in the network who has no token shuts nobody out: neither the operator at the machine nor one with a
tablet and the token."""

import json
import os
import subprocess
import sys

import pytest

from chipwise.panel import visitors
from chipwise.panel.visitors import Visitors
from support import ROOT

ATTACK = str(ROOT / "tests/support/panel_lan.py")
USER = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]


def no_network():
    """Why this computer cannot have a network of two, "" if it can."""
    try:
        tried = subprocess.run(
            [
                "unshare",
                *USER,
                "--net",
                "--",
                "sh",
                "-c",
                "ip link add here type veth peer name there && unshare --net true",
            ],
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
    except OSError as error:
        return str(error)
    return tried.stderr.strip() if tried.returncode else ""


@pytest.mark.skipif(no_network() != "", reason="no network namespace: " + no_network())
@pytest.mark.parametrize("kind", ["streams", "drip", "plan", "gets", "all"])
def test_a_stranger_shuts_nobody_out(kind):
    """From a computer of its own: 16 streams, 40 requests byte by byte, plans and codes in a loop.  Every call of the
    others is answered."""
    done = subprocess.run(
        [sys.executable, ATTACK, *([] if kind == "all" else [kind])],
        stdout=subprocess.PIPE,
        text=True,
        timeout=300,
        check=True,
    )
    found = json.loads(done.stdout.splitlines()[-1])
    for who in ("operator", "tablet"):
        assert found[who]["refused"] == [] and found[who]["rounds"] >= 1, found
    print(kind, found)


# ---- who gets a place ------------------------------------------------------------------------------------------------


@pytest.fixture
def clock(monkeypatch):
    """[s]: what the clock shows."""
    now = [100.0]
    monkeypatch.setattr(visitors.time, "monotonic", lambda: now[0])
    return now


def crowd(found, addresses, served="10.0.0.1"):
    """How many of these connections may stay."""
    return sum(found.come(object(), address, served) for address in addresses)


def test_one_address(clock):
    found = Visitors()
    assert crowd(found, ["10.0.0.9"] * 40) == visitors.MOST_OF_ADDRESS
    assert crowd(found, ["10.0.0.8"]) == 1


@pytest.mark.parametrize("own", ["127.0.0.1", "127.0.0.7", "10.0.0.1", "::1", "::ffff:127.0.0.1", "::ffff:10.0.0.1"])
def test_room_for_this_computer(clock, own):
    """Many addresses do not get more than their part."""
    found = Visitors()
    assert (
        crowd(found, [f"10.0.{k // 200}.{k % 200 + 2}" for k in range(400)])
        == visitors.MOST_CONNECTIONS - visitors.ROOM_CONNECTIONS
    )
    assert crowd(found, [own] * 100) == visitors.ROOM_CONNECTIONS


def test_a_network_of_ipv6_is_one_stranger(clock):
    assert crowd(Visitors(), [f"2001:db8::{k:x}" for k in range(1, 60)], "2001:db8:1::1") == visitors.MOST_OF_ADDRESS
    assert crowd(Visitors(), [f"fe80::{k:x}%eth0" for k in range(2, 60)], "fe80::1%eth0") == visitors.MOST_OF_ADDRESS


def test_who_has_brought_the_token_has_the_room(clock):
    found = Visitors()
    first = object()
    assert found.come(first, "10.0.0.5", "10.0.0.1")
    found.befriend(found.connections[first])
    strangers = visitors.MOST_CONNECTIONS - visitors.ROOM_CONNECTIONS
    assert crowd(found, [f"10.0.1.{k}" for k in range(1, 200)]) == strangers
    assert crowd(found, ["10.0.0.5"] * 50) == visitors.ROOM_CONNECTIONS - 1
    found.go(first)
    assert crowd(found, ["10.0.0.6"]) == 0 and crowd(found, ["10.0.0.5"]) == 1


def test_pages(clock):
    found = Visitors()

    def pages(address, count):
        opened = 0
        for _ in range(count):
            connection = object()
            opened += found.come(connection, address, "10.0.0.1") and found.open_page(connection)
        return opened

    assert pages("10.0.0.9", 10) == visitors.STREAMS_OF_ADDRESS
    assert (
        sum(pages(f"10.0.0.{k}", 1) for k in range(20, 40))
        == visitors.MOST_STREAMS - visitors.ROOM_STREAMS - visitors.STREAMS_OF_ADDRESS
    )
    assert pages("127.0.0.1", 12) == visitors.ROOM_STREAMS
    assert not found.open_page(object())


def test_requests_in_time(clock):
    """A stranger who asks faster is closed, one who waits is served again."""
    found = Visitors()

    def ask(count, address="10.0.0.9"):
        served = 0
        for _ in range(count):
            connection = object()
            served += found.come(connection, address, "10.0.0.1")
            found.go(connection)
        return served

    assert ask(500) == visitors.REQUESTS_AT_ONCE and ask(20, "10.0.0.8") == 20 and ask(500, "127.0.0.1") == 500
    clock[0] += 1.0
    assert ask(500) == visitors.REQUESTS_PER_S


def test_what_is_remembered_is_bounded(clock):
    found = Visitors()
    for k in range(5000):
        connection = object()
        found.come(connection, f"10.{k // 60000}.{k // 250 % 240}.{k % 250 + 2}", "10.0.0.1")
        if k % 2:
            found.befriend(found.connections[connection])
        found.go(connection)
    assert (
        len(found._budgets) <= visitors.MOST_REMEMBERED
        and len(found._friends) <= visitors.MOST_FRIENDS
        and not found.connections
    )


# ---- a plan costs computing time -------------------------------------------------------------------------------------


def test_a_plan_from_elsewhere_needs_the_token(monkeypatch):
    """127.0.0.2 counts as another computer here."""
    from chipwise.panel import entry
    from chipwise.panel import server
    from support.panel_client import request
    from support.panel_rig import TOKEN, serving

    monkeypatch.setattr(visitors, "is_local", lambda address, _served: address == "127.0.0.2")
    monkeypatch.setattr(server, "WRONG_TOKEN_S", 0.01)
    asked = []

    def ask(order):
        asked.append(order["do"])
        return {"line": "M252", "unit": "mm", "svg": "", "figures": [], "messages": [], "refused": "", "state": {}}

    for token in (TOKEN, ""):
        with serving(token, lines=entry.Lines(str(ROOT / "configs/mill.ini"), ask)) as rig:

            def plan(**headers):
                return request(
                    rig.url,
                    "/plan",
                    "POST",
                    b'{"code": "M252", "text": "", "mode": "light"}',
                    Origin=rig.url,
                    **headers,
                )[::2]

            for headers in ({}, {"X_Chipwise_Token": "wrong"}):
                status, words = plan(**headers)
                assert status == 403 and b"PANEL_TOKEN" in words and asked == []
            assert json.loads(request(rig.url, "/about.json")[2])["local"] is False
            if token:
                assert plan(X_Chipwise_Token=TOKEN)[0] == 200 and asked.pop() == "plan"
