# SPDX-License-Identifier: GPL-2.0-or-later
"""The server of `chipwise panel`: what it serves, who may ask and who may change; nothing foreign is served, and
strangers change nothing."""

import json
import os
import re
import socket
import subprocess
import sys
import time

import pytest

from chipwise.panel import server
from support import ROOT
from support.panel_client import follow, request
from support.panel_rig import TOKEN, serving


def raw(rig, data, seconds=300.0):
    """What comes back for some bytes, up to the end of the connection."""
    with socket.create_connection(rig.server.server_address[:2], timeout=seconds) as connection:
        connection.sendall(data)
        found = b""
        try:
            while part := connection.recv(65536):
                found += part
        except ConnectionResetError:
            pass
        return found


def post(rig, path, body=b"{}", origin="own", token=TOKEN, **headers):
    given = {"Origin": rig.url if origin == "own" else origin, "X-Chipwise-Token": token, **headers}
    return request(rig.url, path, "POST", body, **given)


# ---- what it serves ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", sorted(server.FILES))
def test_its_own_files(rig, path):
    status, headers, content = request(rig.url, path)
    folder, name, kind = server.FILES[path]
    with open(os.path.join(folder, name), "rb") as file:
        assert (status, content) == (200, file.read()) and headers["Content-Type"].startswith(kind)
    assert "default-src 'none'" in headers["Content-Security-Policy"] and headers["Cache-Control"] == "no-store"
    assert "Access-Control-Allow-Origin" not in headers


def test_the_page_asks_for_what_there_is():
    """Every path in the page's files is one of the tables, and each of these is asked for."""
    texts = [(ROOT / "remap/chipwise/panel/page" / name).read_text() for name in os.listdir(server.FOLDER)]
    routes = {*server.READING, *server.HARMLESS, *server.CHANGES, "/token"}
    asked = {f"/{name}" for text in texts for name in re.findall(r"""['"`]([a-z-]+(?:\.\w+)?)\??['"`]""", text)}
    assert routes - asked == {"/state.json"}  # that one is for other programs
    assert {path for path in asked if path.endswith(".json")} <= routes


@pytest.mark.parametrize(
    "path",
    [
        "/../../../../etc/passwd",
        "/..%2f..%2f..%2fetc/passwd",
        "//etc/passwd",
        "/panel.css/../../__init__.py",
        "/server.py",
        "/.",
        "/%00",
        "/page/panel.html",
        "/panel.html",
        "/panel.js%00.css",
        "\\..\\..\\server.py",
        "http://127.0.0.1/panel.js",
        "/panel.js/",
    ],
)
def test_nothing_else(rig, path):
    answer = raw(rig, f"GET {path} HTTP/1.0\r\nHost: {rig.url[7:]}\r\n\r\n".encode())
    assert re.match(rb"HTTP/1.0 40[04] |<!DOCTYPE|HTTP/1.0 505|$", answer), answer[:200]
    assert b"root:" not in answer and b"import " not in answer


def test_the_state_and_the_stream_agree(rig):
    rig.machine.values.update(mrr=5900.0, target=6000.0)
    rig.looks()
    page = follow(rig.url, states=3)
    state = json.loads(request(rig.url, "/state.json")[2])
    assert page.kinds[0] == "R" and page.states[-1]["mrr"] == state["mrr"] == 5900.0
    assert page.height(10.0, 10.0) == 0.0
    rig.machine.cut((-10.0, 20.0, -4.0), (40.0, 20.0, -4.0))
    rig.wait(lambda: follow(rig.url).height(20.0, 20.0) < -3.99)


def test_without_a_page_the_map_is_looked_at_between_programs(rig):
    rig.look(3)
    seen = rig.watch.tiles.now
    rig.machine.cut((-10.0, 20.0, -4.0), (40.0, 20.0, -4.0))
    rig.wait(lambda: (rig.look(), rig.watch.tiles.now != seen)[1])
    seen = rig.watch.tiles.now
    rig.machine.tasks["running"] = True
    rig.machine.cut((-10.0, 30.0, -4.0), (40.0, 30.0, -4.0))
    rig.look(2)
    time.sleep(1.0)  # a look would be due again
    rig.look()
    assert rig.watch.tiles.now == seen
    rig.looks()
    rig.wait(lambda: follow(rig.url).height(20.0, 30.0) < -3.99)
    rig.wait(lambda: rig.watch.pages == 0)


# ---- who may ask ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "host, status",
    [
        ("own", 200),
        ("localhost", 200),
        ("evil.example", 421),
        ("127.0.0.1", 421),
        ("", 421),
        (None, 421),
        ("127.0.0.1:1", 421),
        ("127.0.0.1.evil.example:%d", 421),
    ],
)
def test_host(rig, host, status):
    port = rig.server.server_port
    given = {"own": f"127.0.0.1:{port}", "localhost": f"LOCALHOST:{port}"}.get(
        host, host and host.replace("%d", str(port))
    )
    for path in ("/", "/stream", "/state.json"):
        if path != "/stream" or status != 200:
            assert request(rig.url, path, Host=given)[0] == status


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
        {"Origin": "http://127.0.0.1"},
    ],
)
def test_other_pages_are_refused(changing, headers):
    for path in ("/state.json", "/stream", "/"):
        assert request(changing.url, path, **headers)[0] == 403
    given = {"Origin": changing.url, **headers}
    assert request(changing.url, "/clear", "POST", b"{}", X_Chipwise_Token=TOKEN, **given)[0] == 403


def test_ipv6():
    try:
        with serving(address="::1") as rig:
            assert rig.url.startswith("http://[::1]:") and request(rig.url, "/state.json")[0] == 200
            assert request(rig.url, "/state.json", Host=f"[::2]:{rig.server.server_port}")[0] == 421
    except OSError:
        pytest.skip("no IPv6 here")


# ---- who may change ------------------------------------------------------------------------------------------------


def alarm(rig):
    """An alarm whose cause has gone."""
    rig.machine.values["override_ignored"] = 1.0
    rig.look()
    rig.machine.values["override_ignored"] = 0.0
    rig.look()
    (entry,) = rig.watch.alarms.entries
    assert not entry["active"] and not entry["cleared"]
    return entry


def test_clear_with_the_token(changing):
    entry = alarm(changing)
    assert post(changing, "/clear", json.dumps({"alarm": entry["id"]}).encode())[0] == 200 and entry["cleared"]


@pytest.mark.parametrize(
    "how",
    [
        {"token": "wrong-token"},
        {"token": ""},
        {"token": None},
        {"token": TOKEN[:-1]},
        {"token": TOKEN + "x"},
        {"token": "\xe4" * 8},
        {"origin": None},
        {"origin": "http://evil.example"},
    ],
)
def test_nothing_without_token_and_origin(changing, how, monkeypatch):
    monkeypatch.setattr(server, "WRONG_TOKEN_S", 0.01)
    entry = alarm(changing)
    status, _headers, words = post(changing, "/clear", **how)
    assert status == 403 and b";" in words or status == 403 and how.get("origin"), words
    assert not entry["cleared"]


def test_read_only(rig):
    entry = alarm(rig)
    status, _headers, words = post(rig, "/clear")
    assert status == 403 and b"read-only" in words and not entry["cleared"]
    assert json.loads(request(rig.url, "/about.json")[2])["can_change"] is False


@pytest.mark.parametrize(
    "body, status",
    [
        (b"", 200),
        (b"{}", 200),
        (b"[]", 400),
        (b"{", 400),
        (b"\xff", 400),
        (b'{"alarm": "1"}', 400),
        (b'{"alarm": true}', 400),
        (b'{"alarm": 99}', 404),
        (b'{"alarm": 1e400}', 400),
        (b"[" * 4000, 400),
        (b"x" * 5000, 413),
    ],
)
def test_bodies(changing, body, status):
    assert post(changing, "/clear", body)[0] == status


def test_an_active_alarm_stays(changing):
    changing.machine.values["override_ignored"] = 1.0
    changing.look()
    status, _headers, words = post(changing, "/clear", b'{"alarm": 1}')
    assert status == 409 and b"the cause is still there" in words


@pytest.mark.parametrize("method", ["PUT", "DELETE", "OPTIONS", "HEAD", "CONNECT", "BREW"])
def test_other_methods(changing, method):
    assert request(changing.url, "/clear", method, X_Chipwise_Token=TOKEN)[0] == 501


def test_no_tracker(tmp_path):
    """Without LinuxCNC: words, no traceback."""
    env = {**os.environ, "HOME": str(tmp_path), "PATH": "/nowhere"}
    env.pop("INI_FILE_NAME", None)
    done = subprocess.run(
        [sys.executable, ROOT / "bin/chipwise", "panel"], env=env, text=True, capture_output=True, timeout=300
    )
    assert (
        done.returncode == 1
        and "Traceback" not in done.stderr
        and done.stderr.splitlines()[-1].startswith("chipwise: ")
    ), done.stderr
