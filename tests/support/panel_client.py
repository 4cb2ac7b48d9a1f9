#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A reader of `chipwise panel` that shares no code with it: the stream's messages, and the stock put together from its
tiles.

Imported by tests; as a program, inside the LinuxCNC of a test: panel_client.py URL SECONDS [alarm | ended | runs] [X,Y
..] prints one JSON object; runs: waits until the page knows that a program runs.  panel_client.py URL run FILE [X,Y ..]
follows a program from before its start to its end: the file is there as soon as it looks, and has the JSON object of
through() in the end.
"""

import http.client
import json
import struct
import sys
import time
import urllib.parse


ALARMS = {"alarm": True, "ended": False}
WAIT_S = 600.0  # of a clock that may be fast


class Page:
    """What a page knows after some messages."""

    def __init__(self):
        self.kinds, self.states, self.points, self.recent, self.map, self.rows = [], [], [], [], None, None
        self.before = 0  # heights of the stock before the program
        self.tiles, self.loops, self.ahead, self.ahead_points = 0, [], (0, 0), []

    def take(self, kind, content):
        self.kinds.append(kind)
        if kind == "S":
            self.states.append(json.loads(content))
        elif kind == "P":
            self.points += json.loads(content)["points"]
        elif kind == "R":
            self.recent = json.loads(content)
        elif kind == "M":
            self.map = json.loads(content)
            self.rows = [[None] * self.map["columns"] for _ in range(self.map["rows"])]
        elif kind == "T":
            self.put(content)
        elif kind == "B":
            self.before = (len(content) - 4) // 2
        elif kind == "A":
            self.ahead = struct.unpack_from("<II", content)
            self.ahead_points = list(struct.iter_unpack("<4f", content[8:]))
        elif kind == "C":
            self.loops = json.loads(content)

    def put(self, content):
        (epoch,) = struct.unpack_from("<I", content)
        assert epoch == self.map["epoch"]
        at = 4
        while at < len(content):
            column, row, columns, rows = struct.unpack_from("<HHHH", content, at)
            values = struct.unpack_from(f"<{columns * rows}H", content, at + 8)
            at += 8 + 2 * columns * rows
            self.tiles += 1
            for j in range(rows):
                self.rows[row + j][column : column + columns] = values[j * columns : (j + 1) * columns]

    def whole(self):
        """Whether there is a map and every cell of it has come: the tiles are messages of their own."""
        return bool(self.map) and not any(None in row for row in self.rows)

    def height(self, x, y):
        """mm, machine coordinates, of the cell at a place."""
        found = self.map
        value = self.rows[int((y - found["y"]) / found["cell"])][int((x - found["x"]) / found["cell"])]
        return found["bottom"] + value / 65535 * (found["top"] - found["bottom"])


def request(url, path, method="GET", body=None, **headers):
    """-> (status, headers, content); headers: Host_ and such with _ for -, None leaves one out."""
    place = urllib.parse.urlsplit(url)
    connection = http.client.HTTPConnection(place.hostname, place.port, timeout=300)
    given = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.putrequest(method, path, skip_host="Host" in given)
    for name, value in given.items():
        if value is not None:
            connection.putheader(name, value)
    if body is not None:
        connection.putheader("Content-Length", str(len(body)))
    connection.endheaders(body)
    answer = connection.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read()
    connection.close()
    return found


def messages(url, page):
    """Each message of the stream, when the page has taken it: yields its kind."""
    place = urllib.parse.urlsplit(url)
    connection = http.client.HTTPConnection(place.hostname, place.port, timeout=300)
    connection.request("GET", "/stream")
    answer = connection.getresponse()
    assert answer.status == 200, answer.read()
    try:
        while len(head := answer.read(5)) == 5:
            page.take(chr(head[0]), answer.read(struct.unpack("<I", head[1:])[0]))
            yield chr(head[0])
    finally:
        connection.close()


def through(url, file, places):
    """{"looks": [[state, heights known by then]] of a program, "gap_s": the longest time without a state meanwhile}.  A
    busy computer may look late, so the reader chooses what it judges, and knows what it cannot know."""
    page, looks, times = Page(), [], []
    for kind in messages(url, page):
        if kind != "S":
            continue
        if not looks and not page.states[-1]["task"]["running"]:
            times = [time.monotonic()]
            file.write("\n")
            file.flush()
            continue
        times.append(time.monotonic())
        looks.append((page.states[-1], [page.height(*place) for place in places] if page.whole() else []))
        if not page.states[-1]["task"]["running"]:
            break
    file.write(json.dumps({"looks": looks, "gap_s": max(b - a for a, b in zip(times, times[1:]))}) + "\n")


def follow(url, seconds=0.0, states=1, awaited=lambda _state: True):
    """Read the stream for so long and until so many states have come, the last one awaited (WAIT_S at most), or to its
    end -> Page."""
    page, end, last = Page(), time.monotonic() + seconds, time.monotonic() + WAIT_S
    for _kind in messages(url, page):
        if not (
            time.monotonic() < end
            or len(page.states) < states
            or (not awaited(page.states[-1]) and time.monotonic() < last)
            or (page.states[-1]["stock"] and not page.whole())
        ):
            break
    return page


def main(url, seconds, *words):
    """words: X,Y in mm whose heights are wanted; alarm or ended: wait for one that is active, or over."""
    if seconds == "run":
        with open(words[0], "w", encoding="utf-8") as file:
            through(url, file, [tuple(map(float, word.split(","))) for word in words[1:]])
        return
    places, wanted = [word for word in words if "," in word], [ALARMS[word] for word in words if word in ALARMS]
    page = follow(
        url,
        float(seconds),
        2,
        lambda state: (
            (not wanted or [alarm["active"] for alarm in state["alarms"]] == wanted)
            and (state["task"]["running"] or "runs" not in words)
        ),
    )
    print(
        json.dumps(
            {
                "state": page.states[-1],
                "states": len(page.states),
                "map": page.map,
                "path": page.points,
                "recent": len(page.recent),
                "tiles": page.tiles,
                "before": page.before,
                "heights": [page.height(*map(float, place.split(","))) for place in places] if page.whole() else [],
            }
        )
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
