#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A server of `chipwise panel` on a network of two computers: a stranger at one attacks it, an operator at the other,
and one with a tablet, use it.

Run by tests and by hand: panel_lan.py [ATTACK ..] prints one JSON object.  It makes a network of its own (two network
namespaces, a veth pair): needs root, or a system where users may have namespaces.
"""

import http.client
import json
import os
import pathlib
import socket
import subprocess
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "remap"), str(ROOT / "tests")]
OPERATOR, STRANGER, TABLET = "10.87.0.1", "10.87.0.2", "10.87.0.3"
ATTACKS = ("streams", "drip", "plan", "gets")
SECONDS = float(os.environ.get("CHIPWISE_ATTACK_S", 4.0))
PLAN_S = 0.3  # that a plan takes here
STREAMS, DRIPPING, LOOPS = 16, 40, 4


def outside():
    """Start this program again in a network of its own; -> its exit status."""
    user = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]
    return subprocess.run(
        ["unshare", *user, "--net", "--", sys.executable, __file__, "inside", *sys.argv[1:]], check=False
    ).returncode


def connected():
    """The two computers; -> the process whose network is the stranger's."""
    other = subprocess.Popen(
        ["unshare", "--net", "--", "sh", "-c", "ip link set lo up; echo ready; exec sleep 600"],
        stdout=subprocess.PIPE,
        text=True,
    )
    other.stdout.readline()
    there = ["nsenter", "-t", str(other.pid), "-n", "--"]
    for words in (
        ["ip", "link", "set", "lo", "up"],
        ["ip", "link", "add", "here", "type", "veth", "peer", "name", "there", "netns", str(other.pid)],
        ["ip", "addr", "add", OPERATOR + "/24", "dev", "here"],
        ["ip", "link", "set", "here", "up"],
        [*there, "ip", "addr", "add", STRANGER + "/24", "dev", "there"],
        [*there, "ip", "addr", "add", TABLET + "/24", "dev", "there"],
        [*there, "ip", "link", "set", "there", "up"],
    ):
        subprocess.run(words, check=True)
    return other


# ---- the stranger ------------------------------------------------------------------------------------------------


def for_ever(work):
    def go():
        while True:
            try:
                work()
            except (OSError, http.client.HTTPException):
                time.sleep(0.02)

    threading.Thread(target=go, daemon=True).start()


def connect(port):
    return socket.create_connection((OPERATOR, port), timeout=20, source_address=(STRANGER, 0))


def stream(port):
    with connect(port) as connection:
        connection.sendall(f"GET /stream HTTP/1.0\r\nHost: {OPERATOR}:{port}\r\n\r\n".encode())
        while connection.recv(65536):
            pass


def drip(port):
    with connect(port) as connection:
        for byte in b"GET / HTTP/1.0\r\nX-Long: " + b"a" * 10000:
            connection.sendall(bytes([byte]))
            time.sleep(0.1)


def ask(port, method, path, **headers):
    connection = http.client.HTTPConnection(OPERATOR, port, timeout=20, source_address=(STRANGER, 0))
    body = json.dumps({"code": "M252", "text": "", "mode": "light"}) if method == "POST" else None
    connection.request(method, path, body, {"Origin": f"http://{OPERATOR}:{port}", **headers})
    connection.getresponse().read()
    connection.close()


def attack(port, kinds):
    for kind, count, work in (
        ("streams", STREAMS, lambda: stream(port)),
        ("drip", DRIPPING, lambda: drip(port)),
        ("plan", LOOPS, lambda: ask(port, "POST", "/plan")),
        ("gets", LOOPS, lambda: ask(port, "GET", "/codes.json")),
    ):
        for _ in range(count if kind in kinds else 0):
            for_ever(work)
    print("ready", flush=True)
    sys.stdin.read()


# ---- those who work with it --------------------------------------------------------------------------------------


class Hand:
    """One who uses the page from an address; times: {call: s of each answer}, refused: [[call, status or error]]."""

    def __init__(self, port, at, source, token):
        self.port, self.at, self.source, self.token = port, at, source, token
        self.times, self.refused = {}, []

    def call(self, name, method, path, body=None, wanted=200, length=None):
        began = time.monotonic()
        try:
            connection = http.client.HTTPConnection(self.at, self.port, timeout=20, source_address=(self.source, 0))
            connection.request(
                method,
                path,
                None if body is None else json.dumps(body),
                {"Origin": f"http://{self.at}:{self.port}", **({"X-Chipwise-Token": self.token} if self.token else {})},
            )
            answer = connection.getresponse()
            found = answer.read(length)
            connection.close()
        except (OSError, http.client.HTTPException) as error:
            self.refused.append([name, type(error).__name__])
            return b""
        self.times.setdefault(name, []).append(time.monotonic() - began)
        if answer.status != wanted:
            self.refused.append([name, answer.status, found.decode()[:200]])
        return found

    def round(self):
        self.call("page", "GET", "/")
        self.call("state", "GET", "/state.json")
        self.call("tools", "GET", "/tools.json")
        self.call("stream", "GET", "/stream", length=5)
        self.call("clear", "POST", "/clear", {})

    def work(self):
        """What one at a time does."""
        self.call("guard", "POST", "/guard", {"guard": "rapid", "on": True})
        self.call("tool", "POST", "/tool", {"tool": 1, "values": {}, "checksum": ""})
        planned = self.call("plan", "POST", "/plan", {"code": "M252", "text": "", "mode": "light"})
        number = json.loads(planned).get("plan") if planned.startswith(b"{") else None
        self.call("run", "POST", "/run", {"plan": number or 0}, 200)

    def report(self):
        return {
            "rounds": min(map(len, self.times.values()), default=0),
            "refused": self.refused,
            "times": {
                name: [round(sorted(found)[len(found) // 2], 3), round(max(found), 3)]
                for name, found in self.times.items()
            },
        }


def answers(order):
    """In the place of line_process.py."""
    if order["do"] == "plan":
        time.sleep(PLAN_S)
        return {"line": "M252", "unit": "mm", "svg": "", "figures": [], "messages": [], "refused": "", "state": {}}
    return {"file": "tools.toml"} if order["do"] == "tool" else {}


def tablet(port, token):
    """The round of the tablet, from the other computer, until standard input ends; prints its report."""
    hand = Hand(int(port), OPERATOR, TABLET, token)
    hand.call("token", "POST", "/token", {})
    print("ready", flush=True)
    ends = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ends.set()), daemon=True).start()
    while not ends.is_set():
        hand.round()
        time.sleep(0.02)
    print(json.dumps(hand.report()))


def inside(kinds):
    from chipwise.panel import entry
    from support.panel_rig import TOKEN, serving

    other = connected()
    there = ["nsenter", "-t", str(other.pid), "-n", "--", sys.executable, __file__]
    with serving(TOKEN, "0.0.0.0", lines=entry.Lines(str(ROOT / "configs/mill.ini"), answers)) as rig:
        rig.looks()
        port = rig.server.server_port
        helpers = []
        for words in (["tablet", str(port), TOKEN], ["attack", str(port), *kinds]):
            helpers.append(subprocess.Popen([*there, *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
            helpers[-1].stdout.readline()
        time.sleep(1.0)  # the stranger has all that it can get
        hand = Hand(port, "127.0.0.1", "127.0.0.1", TOKEN)
        end = time.monotonic() + SECONDS
        while time.monotonic() < end or len(hand.times.get("run", [])) < 2 and time.monotonic() < end + 120:
            hand.round()
            hand.work()
        words = helpers[0].communicate("", timeout=120)[0]
        helpers[1].stdin.close()
        helpers[1].wait(60)
        print(
            json.dumps(
                {"operator": hand.report(), "tablet": json.loads(words.splitlines()[-1]), "looks": rig.watch.number}
            )
        )
    other.kill()


if __name__ == "__main__":
    if sys.argv[1:2] == ["inside"]:
        inside(sys.argv[2:] or ATTACKS)
    elif sys.argv[1:2] == ["attack"]:
        attack(int(sys.argv[2]), sys.argv[3:])
    elif sys.argv[1:2] == ["tablet"]:
        tablet(*sys.argv[2:])
    else:
        sys.exit(outside())
