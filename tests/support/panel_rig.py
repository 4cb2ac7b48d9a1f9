# SPDX-License-Identifier: GPL-2.0-or-later
"""The server of `chipwise panel` with a machine that a test sets by hand, and a stock that the real core cuts."""

import contextlib
import ctypes
import json
import threading
import time

from chipwise.panel import entry_process, machine, server, watch
from chipwise.clib import core, layout
from chipwise.clib.library import library
from chipwise.stock.path_done import PathDone
from chipwise.stock.shared import SharedStock
from support.panel_client import request
from support.scenes import SCENE

TOKEN = "correct-horse-7"


class Kept:
    """The path done that the C core keeps, of a tip that a test moves."""

    def __init__(self):
        self.done, self._thinner = layout.PathDone(), layout.PathThinner()

    def go(self, points):
        """A period at each point, mm."""
        for point in points:
            library().chip_path_done_step(
                ctypes.byref(self._thinner), ctypes.byref(self.done), (ctypes.c_double * 3)(*point)
            )


class Machine:
    """As panel.machine.Machine, but everything in it is set by the test.  keeps: it keeps the path done, as
    stock_tracker does."""

    def __init__(self, low=(0.0, 0.0, -10.0), high=(60.0, 40.0, 0.0), cell=0.25, keeps=False):
        self.core, self.kept = core.Stock(low, high, cell), Kept() if keeps else None
        self.values = {name: 0.0 for name in (*machine.NUMBERS, *machine.LENGTHS, "area_ahead")}
        self.values.update(
            stock_defined=1.0,
            certain=1.0,
            ready=1.0,
            tool=3.0,
            tool_diameter=6.0,
            override=1.0,
            guard_rapid=1.0,
            guard_flute=1.0,
        )
        self.tip = (0.0, 0.0, 10.0)
        self.tasks = {
            "state": "on",
            "program": "/home/me/part.ngc",
            "running": False,
            "paused": False,
            "auto": True,
            "idle": True,
            "failed": False,
            "inch": False,
            "mdi_unit": "mm",
            "feed_override": 1.0,
        }
        self.alive, self.closed, self.looks, self.loaded = True, False, 0, None

    def runs(self):
        return self.alive

    def pins(self):
        self.looks += 1
        return {**self.values, "feed_per_tooth": machine.feed_per_tooth(self.values), "tip": self.tip}

    def task(self):
        return None if self.tasks is None else dict(self.tasks)

    def scene(self):
        return self.loaded

    def stock(self):
        return Shared(self.core, self.kept)

    def close(self):
        self.closed = True

    def go(self, points):
        """The tip moves from period to period."""
        self.kept.go(points)
        self.tip = tuple(float(a) for a in points[-1])

    def cut(self, start, end, diameter=6.0):
        """A straight cut of a flat tool."""
        cutter = core.Cutter(self.core, core.Tool(diameter), start)
        cutter.to(end)
        cutter.run()
        self.tip = end


class Shared(SharedStock):
    """The map of a core.Stock, with the path done of Kept where the tracker has it: behind the cells."""

    def __init__(self, stock, kept):
        super().__init__(memoryview(stock._block))
        self._kept = kept

    def path_done(self):
        return PathDone(memoryview(self._kept.done), 0) if self._kept else super().path_done()


class Rig:
    """Machine, watch and server; look() by hand, or looks() in a thread."""

    def __init__(self, found, token, address, ahead=None, **parts):
        self.machine, self.watch = found, watch.Watch(found, ahead=ahead)
        self.server = server.Server(address, 0, self.watch, token, **parts)
        self.url = self.server.url
        self._going = True

    def look(self, count=1):
        for _ in range(count):
            self.watch.look()

    def looks(self):
        def go():
            while self._going and self.watch.look():
                time.sleep(watch.LOOK_S)

        threading.Thread(target=go, daemon=True).start()

    def wait(self, reached, seconds=300.0):
        """Wait until something is so; AssertionError after so many seconds."""
        end = time.monotonic() + seconds
        while not reached():
            assert time.monotonic() < end, "not reached in time"
            time.sleep(0.01)


@contextlib.contextmanager
def serving(token="", address="127.0.0.1", items=None, lines=None, ahead=None, **box):
    """A Rig whose server answers; it has looked once."""
    rig = Rig(Machine(**box), token, address, ahead, items=items, lines=lines)
    thread = threading.Thread(target=rig.server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
    thread.start()
    rig.look()
    try:
        yield rig
    finally:
        rig._going = False
        rig.watch.end()
        rig.server.close()


def scene(program, **changed):
    """The scene that LinuxCNC shows of a loaded program (chipwise.panel.look_ahead); machine units."""
    return {**SCENE, "program": str(program), "codes": "G21 G17 G90 G91.1", **changed}


def asking(mdi):
    """What chipwise.panel.entry.Lines asks: the answers of panel/entry_process.py, here in this process, of a machine
    like entry/mdi.py."""
    return lambda order: json.loads(json.dumps(entry_process.answer(json.loads(json.dumps(order)), mdi)))


def post(rig, path, body, token=TOKEN, origin="own"):
    """-> (status, headers, content) of a request as the page sends it; body: of JSON."""
    return request(
        rig.url,
        path,
        "POST",
        json.dumps(body).encode(),
        X_Chipwise_Token=token,
        Origin=rig.url if origin == "own" else origin,
    )


def posted(rig, path, body, **who):
    """-> (status, answer) of post(): from JSON, or words."""
    status, _headers, content = post(rig, path, body, **who)
    return status, json.loads(content) if content[:1] == b"{" else content.decode()
