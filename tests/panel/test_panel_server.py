# SPDX-License-Identifier: GPL-2.0-or-later
"""The server of `chipwise panel` and what strangers send to it: nothing is changed, nothing foreign is served, nobody waits."""

import json
import os
import random
import re
import shutil
import socket
import subprocess
import sys
import threading
import time

import pytest

from chipwise import language
from chipwise.panel import colours, page_colours, server, watch
from support import ROOT, colour_vision
from support.panel_client import follow, request
from support.panel_rig import TOKEN, serving

GARBAGE = int(os.environ.get("CHIPWISE_PANEL_GARBAGE", 60))
PAGE = ROOT / "remap/chipwise/panel/page"


@pytest.fixture
def rig():
    with serving() as found:
        yield found


@pytest.fixture
def changing():
    with serving(TOKEN) as found:
        yield found


def raw(rig, data, seconds=20.0):
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


@pytest.mark.parametrize("path", [
    "/../../../../etc/passwd", "/..%2f..%2f..%2fetc/passwd", "//etc/passwd", "/panel.css/../../__init__.py", "/server.py", "/.", "/%00",
    "/page/panel.html", "/panel.html", "/panel.js%00.css", "\\..\\..\\server.py", "http://127.0.0.1/panel.js", "/panel.js/"])
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
    time.sleep(1.0)                     # a look would be due again
    rig.look()
    assert rig.watch.tiles.now == seen
    rig.looks()
    rig.wait(lambda: follow(rig.url).height(20.0, 30.0) < -3.99)
    rig.wait(lambda: rig.watch.pages == 0)


@pytest.mark.parametrize("accept, language", [("de-AT,de;q=0.9,en;q=0.5", "de"), ("fr,en", "en"), (None, "en"), ("x" * 2000, "en")])
def test_the_language_of_the_browser(rig, accept, language):
    found = json.loads(request(rig.url, "/strings.json", Accept_Language=accept)[2])
    assert found["language"] == language
    assert json.loads(request(rig.url, "/strings.json?de", Accept_Language=accept)[2])["strings"]["Tool"] == "Werkzeug"


def test_every_string_is_translated():
    text = "".join(path.read_text() for path in sorted(PAGE.iterdir()) if path.suffix in (".html", ".js"))
    wanted = set(re.findall(r'data-t="([^"]+)"', text)) | set(re.findall(r"\bt\('([^']+)'\)", text))
    for table in re.findall(r"const (?:STATUS|MODES|LIMITS|NAMES) = \{(.*?)\};", text, re.DOTALL):
        wanted |= set(re.findall(r"\w+: '([^']+)'", table))
    part = (ROOT / "remap/chipwise/locale/de.po").read_text().partition("# ---- panel/page\n")[2]
    known = language.catalogue(("de",))[1]
    assert len(wanted) > 40 and not [word for word in wanted if word not in known]
    assert set(re.findall(r'\nmsgid "(.+)"', part)) <= wanted                 # nothing is left behind


def test_the_page_has_the_one_catalogue():
    name, texts = language.catalogue(("fr-CA", "de-AT", "en"))
    assert name == "de" and texts["step-over"] == "Bahnabstand" and texts["Tool"] == "Werkzeug" and "" not in texts
    assert language.catalogue(("en", "de")) == ("en", {}) and language.catalogue(()) == ("en", {}) and language.catalogue(("../de",)) == ("en", {})


def test_a_catalogue_that_is_broken(tmp_path):
    folder = tmp_path / "de" / "LC_MESSAGES"
    folder.mkdir(parents=True)
    (folder / "chipwise.mo").write_bytes(b"\xde\x12\x04\x95 broken")
    assert language.catalogue(("de",), str(tmp_path)) == ("en", {})


# ---- its colours -------------------------------------------------------------------------------------------------


def sheet(url):
    """{mode: {name: "#rrggbb"}} of the style sheet, read by itself."""
    text = request(url, "/colours.css")[2].decode()
    light, dark = re.fullmatch(r':root \{(.*)\}\n:root\[data-theme="dark"\] \{(.*)\}\n', text).groups()
    return {mode: dict(re.findall(r"--([a-z-]+): (#[0-9a-f]{6});", part)) for mode, part in (("light", light), ("dark", dark))}


def test_the_page_has_the_colours_of_the_items(rig, tmp_path):
    found = sheet(rig.url)
    for mode in colours.MODES:
        for item, entry in colours.load("").items():
            assert found[mode][item.replace("_", "-")] == entry.colour(mode)
    path = tmp_path / "colours.toml"
    path.write_text('[tool]\nlight = "#8a2be2"\n')
    with serving(items=colours.load(str(path))) as other:
        assert sheet(other.url)["light"]["tool"] == "#8a2be2" and sheet(other.url)["dark"] == found["dark"]


def test_every_colour_that_the_page_asks_for_is_there(rig):
    text = "".join(path.read_text() for path in PAGE.iterdir() if path.suffix in (".css", ".js"))
    wanted = set(re.findall(r"var\(--([a-z-]+)\)", text)) | set(re.findall(r"\b(?:colour|rgb)\('([a-z-]+)'\)", text))
    for names in sheet(rig.url).values():
        assert len(wanted) > 15 and not wanted - set(names)
    assert not re.findall(r"#[0-9a-fA-F]{6}", text)           # no colour of its own


def test_words_are_read_in_every_state():
    """WCAG 2.1, 1.4.3: 4.5:1 for words, for every eye."""
    for mode in colours.MODES:
        names = page_colours.variables(colours.load(""), mode)
        for behind in ("box", *(name for name in names if name.startswith("state-"))):
            for word in ("ink", "faint") if behind == "box" else ("ink",):
                for eye in colour_vision.VISIONS:
                    assert colour_vision.contrast(names[word], names[behind], eye) >= 4.5, (mode, behind, word, eye)


@pytest.mark.skipif(shutil.which("node") is None, reason="no node to read JavaScript with")
@pytest.mark.parametrize("path", sorted(path for path in server.FILES if path.endswith(".js")))
def test_the_scripts_are_some(path):
    folder, name, _kind = server.FILES[path]
    done = subprocess.run(["node", "--check", os.path.join(folder, name)], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr


# ---- who may ask ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("host, status", [("own", 200), ("localhost", 200), ("evil.example", 421), ("127.0.0.1", 421), ("", 421),
                                          (None, 421), ("127.0.0.1:1", 421), ("127.0.0.1.evil.example:%d", 421)])
def test_host(rig, host, status):
    port = rig.server.server_port
    given = {"own": f"127.0.0.1:{port}", "localhost": f"LOCALHOST:{port}"}.get(host, host and host.replace("%d", str(port)))
    for path in ("/", "/stream", "/state.json"):
        if path != "/stream" or status != 200:
            assert request(rig.url, path, Host=given)[0] == status


@pytest.mark.parametrize("headers", [{"Origin": "http://evil.example"}, {"Origin": "null"}, {"Sec-Fetch-Site": "cross-site"},
                                     {"Sec-Fetch-Site": "same-site"}, {"Origin": "http://127.0.0.1"}])
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
    entry, = rig.watch.alarms.entries
    assert not entry["active"] and not entry["cleared"]
    return entry


def test_clear_with_the_token(changing):
    entry = alarm(changing)
    assert post(changing, "/clear", json.dumps({"alarm": entry["id"]}).encode())[0] == 200 and entry["cleared"]


@pytest.mark.parametrize("how", [{"token": "wrong-token"}, {"token": ""}, {"token": None}, {"token": TOKEN[:-1]}, {"token": TOKEN + "x"},
                                 {"token": "\xe4" * 8}, {"origin": None}, {"origin": "http://evil.example"}])
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


@pytest.mark.parametrize("body, status", [
    (b"", 200), (b"{}", 200), (b"[]", 400), (b"{", 400), (b"\xff", 400), (b'{"alarm": "1"}', 400), (b'{"alarm": true}', 400),
    (b'{"alarm": 99}', 404), (b'{"alarm": 1e400}', 400), (b"[" * 4000, 400), (b"x" * 5000, 413)])
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


# ---- what strangers do ---------------------------------------------------------------------------------------------


def test_a_hundred_connections(rig, monkeypatch):
    """Those that say nothing are cut off; then there is place again."""
    monkeypatch.setattr(server, "REQUEST_S", 1.5)
    at_once = []                                            # the connections and threads after each one that came

    def process_request(self, *connection, process=server.Server.process_request):
        process(self, *connection)
        at_once.append((len(self._open), threading.active_count()))

    monkeypatch.setattr(server.Server, "process_request", process_request)
    rig.looks()
    page = threading.Thread(target=follow, args=(rig.url, 4.0))
    page.start()
    rig.wait(lambda: rig.watch.pages == 1)
    crowd = [socket.create_connection(rig.server.server_address[:2]) for _ in range(100)]
    rig.wait(lambda: len(at_once) >= 101)
    connections, threads = map(max, zip(*at_once))
    assert 1 < connections <= server.MOST_CONNECTIONS and threads < server.MOST_CONNECTIONS + 10
    before = rig.machine.looks
    rig.wait(lambda: len(rig.server._open) <= 1)
    assert rig.machine.looks > before                       # the looks at the machine went on
    assert request(rig.url, "/state.json")[0] == 200
    for one in crowd:
        one.close()
    page.join(60)
    assert not page.is_alive()


@pytest.mark.parametrize("at_once, slowly", [
    ("", "GET / HTTP/1.0\r\nX-Long: " + "a" * 1000),
    ("POST /plan HTTP/1.0\r\nHost: {0}\r\nOrigin: http://{0}\r\nContent-Length: 4000\r\n\r\n", " " * 1000)], ids=["head", "body"])
def test_byte_by_byte(rig, monkeypatch, at_once, slowly):
    """A request that never ends is cut off, though each byte of it comes in time."""
    monkeypatch.setattr(server, "REQUEST_S", 1.0)
    with socket.create_connection(rig.server.server_address[:2], timeout=300) as connection:
        began, cut = time.monotonic(), False
        connection.sendall(at_once.format(rig.url.removeprefix("http://")).encode())
        for byte in slowly.encode():
            try:
                connection.sendall(bytes([byte]))
            except OSError:
                cut = True
                break
            time.sleep(0.05)
    assert cut and time.monotonic() - began < 40
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
    monkeypatch.setattr(server, "MOST_STREAMS", 3)
    rig.looks()
    stop = []
    pages = [threading.Thread(target=follow, args=(rig.url, 60.0)) for _ in range(3)]
    for page in pages:
        page.start()
    rig.wait(lambda: rig.watch.pages == 3)
    status, _headers, words = request(rig.url, "/stream")
    assert status == 503 and b"3 pages are open already" in words and not stop
    rig.watch.end()                                         # LinuxCNC has ended: so do all streams
    for page in pages:
        page.join(60)
        assert not page.is_alive()


@pytest.mark.parametrize("seed", range(GARBAGE))
def test_garbage(changing, seed):
    """Random bytes, and requests with random parts: an answer or none, and the next request is served."""
    chance = random.Random(seed)
    some = bytes(chance.randrange(256) for _ in range(chance.randrange(1, 300)))
    data = chance.choice([
        some, b"GET " + some + b" HTTP/1.0\r\n\r\n", b"GET / HTTP/" + some + b"\r\n\r\n", b"POST /clear HTTP/1.1\r\nContent-Length: -5\r\n\r\n",
        b"GET / HTTP/1.0\r\n" + some * 500 + b"\r\n\r\n", b"GET / HTTP/1.0\r\n" + b"A: b\r\n" * 300 + b"\r\n", b"GET /" + b"a" * 70000 + b"\r\n\r\n",
        b"POST /clear HTTP/1.0\r\nHost: x\r\nContent-Length: 99999999999\r\n\r\n", b"\r\n" * 50, b"GET / HTTP/1.0\r\nHost: \xff\xfe\r\n\r\n"])
    with socket.create_connection(changing.server.server_address[:2], timeout=300) as connection:
        try:
            connection.sendall(data)
            connection.shutdown(socket.SHUT_WR)
            connection.recv(65536)
        except OSError:             # cut off in the middle of it
            pass
    assert request(changing.url, "/state.json")[0] == 200, f"seed {seed}: {data!r:.300}"


def test_a_page_that_goes_away(rig):
    rig.looks()         # without them nothing is sent, and it is not seen before server.WAIT_S
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


def test_no_tracker(tmp_path):
    """Without LinuxCNC: words, no traceback."""
    env = {**os.environ, "HOME": str(tmp_path), "PATH": "/nowhere"}
    env.pop("INI_FILE_NAME", None)
    done = subprocess.run([sys.executable, ROOT / "bin/chipwise", "panel"], env=env, text=True, capture_output=True, timeout=120)
    assert done.returncode == 1 and "Traceback" not in done.stderr and done.stderr.splitlines()[-1].startswith("chipwise: "), done.stderr


def test_times_fit_together():
    assert server.WAIT_S > watch.LOOK_S and server.MOST_STREAMS < server.MOST_CONNECTIONS
