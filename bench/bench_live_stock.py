# SPDX-License-Identifier: GPL-2.0-or-later
"""What it costs to save the stock while the machine works ([CHIPWISE]KEEP_STOCK), and how old the saved stock gets.

A cutter of 10 mm goes to and fro at 100 mm/s, 1 mm deeper on each lane, as fast as it cuts the most.  Shares are
computing time of the thread that saves, so other load does not count; ages are real time, the disk's time in them.

What the servo thread has of it (period()): the same cuts, one servo period each, while another process saves the map,
look after look without a pause, and while none does.  The saver writes nothing into the map and holds no lock, so only
the caches can be felt.
"""

import array
import ctypes
import json
import math
import mmap
import os
import statistics
import sys
import tempfile
import threading
import time
import types

from roots import ROOT
from rows import row

from chipwise.host.files import JOURNAL
from chipwise.monitor import live_stock
from chipwise.clib import core
from chipwise.stock import journal
from chipwise.clib.library import library
from chipwise.stock.shared import SharedStock

assert ROOT
POLL_S, VELOCITY, DEPTH = 0.02, 100.0, 12.0
LOOKS = 60
PERIODS, BLOCKS = 500, 20  # servo periods in a row with a saver, then as many without, so many times
SERVO_S = 0.001
AGE_S = 10.0
MOST_MM2 = 1e5  # of a map for period(): its cells are looked at over and over
MOST_READ = 1 << 24  # cells: reading makes copies
SIZES = (
    ("sample map", 0.25, 300.0, 200.0),
    ("map of 64 MB", 0.1, 320.0, 250.0),
    ("largest map, 2 GiB", 0.1, 1638.0, 1638.0),
)


def show(*values, **more):
    print(json.dumps(row(*values, **more)), flush=True)


class Cutting:
    """A map, and a tool that cuts it poll by poll."""

    def __init__(self, cell, wide, deep):
        cells = library().chip_stock_cells(cell, wide, deep)
        self.block = mmap.mmap(-1, library().chip_stock_bytes(cells))
        address = ctypes.addressof(ctypes.c_char.from_buffer(self.block))
        library().chip_stock_init(address, cell, cells)
        assert (
            library().chip_stock_define(address, (ctypes.c_double * 3)(0, 0, -20), (ctypes.c_double * 3)(wide, deep, 0))
            == 0
        )
        library().chip_stock_fill(address, 1 << 30)
        self.stock, self.at, self.wide, self.deep = SharedStock(memoryview(self.block)), 0.0, wide, deep
        self.cutter = core.Cutter(types.SimpleNamespace(address=address), core.Tool(10.0), self.tip())

    def tip(self):
        lane, along = divmod(self.at, self.wide)
        return (
            along if int(lane) % 2 == 0 else self.wide - along,
            10.0 + lane * 8.0 % (self.deep - 20.0),
            -1.0 - math.fmod(lane, DEPTH),
        )

    def advance(self, seconds):
        self.at += VELOCITY * seconds
        self.cutter.to(self.tip())

    def poll(self, live):
        self.advance(POLL_S)
        live.note(self.tip(), 5.0, 1, "part.ngc")


def share(name, size, folder):
    """Computing time of a look, of the glances and of the notes."""
    cutting = Cutting(*size)
    live = live_stock.LiveStock(os.path.join(folder, JOURNAL), cutting.stock, print)
    began = time.thread_time()
    live.look()
    show(
        f"{name}: a new stock",
        time.thread_time() - began,
        "s",
        f"of computing time, once; {os.path.getsize(live.path) / 1e6:.2f} MB",
    )
    spent, first = 0.0, os.path.getsize(live.path)
    for _ in range(LOOKS):
        for _poll in range(round(live_stock.LOOK_S / POLL_S)):
            cutting.poll(live)
        began = time.thread_time()
        assert live.look()
        spent += time.thread_time() - began
    grown = (os.path.getsize(live.path) - first) / (LOOKS * live_stock.LOOK_S)
    began = time.thread_time()
    for _ in range(1000):
        live.glance()
        live.note((time.time(), 0.0, 0.0), 5.0)
    other = (time.thread_time() - began) / 1000 / live_stock.GLANCE_S
    show(
        f"{name}: saving while cutting",
        100 * (spent / (LOOKS * live_stock.LOOK_S) + other),
        "%",
        f"of a core; {grown / 1000:.0f} kB/s to the disk",
        target=1,
    )
    if cutting.stock.capacity < MOST_READ:
        exact = bool((journal.read(live.path)[1] == cutting.stock.take(60.0)[1]).all())
        show(f"{name}: cells differ after reading it", float(not exact), "", target=0)
    return cutting, live


def age(name, cutting, live):
    """The oldest that the saved stock got in real time."""
    oldest, end = 0.0, time.monotonic() + AGE_S
    live.look()
    live.start()
    spent = time.process_time(), time.monotonic()
    while time.monotonic() < end:
        cutting.poll(live)
        time.sleep(POLL_S)
        oldest = max(oldest, time.monotonic() - live.saved)
    live.end()
    show(
        f"{name}: age",
        oldest,
        "s",
        f"largest in {time.monotonic() - spent[1]:.0f} s, cutting, {threading.active_count()} threads",
        target=1,
    )


def save_always(cutting, folder, shared):
    """A process that saves the map while shared[0] is 1; shared[1]: looks, shared[2:5]: the tip."""
    live = live_stock.LiveStock(os.path.join(folder, JOURNAL), cutting.stock, print)
    while shared[0] >= 0:
        if shared[0]:
            live.note(tuple(shared[2:5]), 5.0, 1, "part.ngc")
            live.look()
            shared[1] += 1
        else:
            time.sleep(0.001)


def period(name, size, folder):
    """Computing time of the cut of a servo period, while the map is saved and while it is not."""
    cutting, shared = Cutting(*size), memoryview(mmap.mmap(-1, 40)).cast("d")
    child = os.fork()
    if not child:
        try:
            save_always(cutting, folder, shared)
        finally:
            os._exit(0)
    spent = {0: [], 1: []}
    try:
        for block in range(2 * BLOCKS):
            saving = block % 2
            shared[0], had = saving, shared[1]
            while saving and shared[1] < had + 1:  # it has begun
                time.sleep(0.001)
            for _ in range(PERIODS):
                shared[2:5] = memoryview(array.array("d", cutting.tip()))
                began = time.thread_time_ns()
                cutting.advance(SERVO_S)
                spent[saving].append(time.thread_time_ns() - began)
    finally:
        shared[0] = -1
        os.waitpid(child, 0)
    without, beside = (statistics.median(spent[saving]) / 1000 for saving in (0, 1))
    most = [statistics.quantiles(spent[saving], n=100)[98] / 1000 for saving in (0, 1)]
    show(
        f"{name}: a servo period's cut while it is saved",
        100 * (beside / without - 1),
        "%",
        f"longer, median; {beside:.1f} us, {without:.1f} us without; 99 % below "
        f"{most[1]:.1f} us, {most[0]:.1f} us without; {shared[1]:.0f} looks",
        target=5,
    )


def main(chosen):
    for name, *size in SIZES:
        if chosen and not any(part in name for part in chosen):
            continue
        with tempfile.TemporaryDirectory(dir=os.path.join(ROOT, "build")) as folder:
            cutting, live = share(name, size, folder)
            age(name, cutting, live)
            del cutting, live
        if size[1] * size[2] < MOST_MM2:
            with tempfile.TemporaryDirectory(dir=os.path.join(ROOT, "build")) as folder:
                period(name, size, folder)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
